//! Replays recordings with the portable crates alone, and prints whether every force and every voxel is as recorded.
//!
//! `cargo run --release -p typodont-exercise --example replay -- RECORDING.mcap …`

use std::path::Path;
use std::process::ExitCode;
use typodont_exercise::record::{Recording, ReplayCheck, replay};
use typodont_exercise::score;

fn main() -> ExitCode {
    let mut status = ExitCode::SUCCESS;
    for path in std::env::args().skip(1) {
        match check(&path) {
            Ok(summary) => println!("{path}: {summary}"),
            Err(error) => {
                eprintln!("{path}: {error}");
                status = ExitCode::FAILURE;
            }
        }
    }
    status
}

/// Replays a recording, compares it with every recorded step and digest, and scores it.
fn check(path: &str) -> Result<String, String> {
    let recording = Recording::read(Path::new(path)).map_err(|e| e.to_string())?;
    let replayed = replay(&recording, recording.workpiece()?, ReplayCheck::Full, |_, _, _, _| {});
    if let Some(difference) = replayed.difference {
        return Err(difference.to_string());
    }
    let scored = score::score(&recording, ReplayCheck::Skip).map_err(|e| e.to_string())?;
    let seconds = recording.len() as f64 * typodont_core::tick::TICK_S;
    Ok(format!("{seconds:.3} s replayed without a difference, {} measures", scored.measures.all.len()))
}
