//! `typodont rescore`: scores many bundles again without a database, divided among computers.

use crate::cli::progress::progress_bar;
use crate::cli::{CliError, cohort, print_line};
use clap::Args;
use sha2::{Digest, Sha256};
use std::fs;
use std::path::{Path, PathBuf};
use typodont_exercise::scenario::hex;
use typodont_exercise::score::SCORER_VERSION;
use typodont_formats::{read_file, write_atomically};
use typodont_integrations::session_id;
use typodont_report::{SessionFile, sanitize_display};
use typodont_school::{RECORDING, Shard, rescore};

#[derive(Args)]
pub struct Arguments {
    /// Folder that contains bundles, at any depth
    folder: PathBuf,
    /// Part of the sessions for this computer: 3/8 is the third of eight parts
    #[arg(long, value_name = "I/N", default_value = "1/1")]
    shard: Shard,
    /// Folder for the results: one file per session with the output of `typodont score`
    #[arg(long, value_name = "DIR", default_value = "rescored")]
    out: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let Arguments { folder, shard, out } = arguments;
    let cohort = cohort::read_folder(folder)?;
    let unwritable = |e: std::io::Error| CliError::wrong(format!("{}: unwritable-folder: {e}", out.display()));
    fs::create_dir_all(out).map_err(unwritable)?;
    let with_recording = |path: &Path| path.join(RECORDING).is_file();
    let sessions = cohort.sessions.iter().map(|(path, session)| (session_id(session), path, session));
    let own: Vec<(String, &PathBuf, &SessionFile)> =
        sessions.filter(|(id, path, _)| shard.contains(id) && with_recording(path)).collect();
    let bar = progress_bar(own.len() as u64, "scored");
    let (mut done, mut before, mut failed) = (0, 0, 0);
    for (id, path, session) in own {
        let file = out.join(format!("{id}.v{SCORER_VERSION}.json"));
        if file.is_file() {
            before += 1;
        } else {
            let read = read_file(&path.join(RECORDING)).map_err(|d| d.headline());
            let read = read.and_then(|bytes| check_digest(session, &bytes).map(|()| bytes));
            match read.and_then(|bytes| rescore(&id, &bytes).map_err(|unscored| unscored.0)) {
                Ok(result) => {
                    // The file is complete or absent: a killed program leaves nothing that looks finished.
                    write_atomically(&file, result.to_json().as_bytes()).map_err(unwritable)?;
                    done += 1;
                }
                Err(why) => {
                    failed += 1;
                    eprintln!("{}: {}", path.display(), sanitize_display(&why, 400));
                }
            }
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    print_line(format!("{}: {done} scored, {before} already scored, {failed} failed", out.display()))?;
    if failed > 0 { Err(CliError::AlreadyReported) } else { Ok(()) }
}

/// Checks that a recording is the one that was scored. A damaged one would be read up to the damage, and give the result
/// of a session that was cut off.
fn check_digest(session: &SessionFile, bytes: &[u8]) -> Result<(), String> {
    match session.digests.get(RECORDING) {
        Some(digest) if *digest != hex(&Sha256::digest(bytes)) => {
            Err(format!("{RECORDING}: damaged-recording: the file differs from the recording that was scored"))
        }
        _ => Ok(()),
    }
}
