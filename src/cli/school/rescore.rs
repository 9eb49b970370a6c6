//! `typodont rescore`: many bundles scored again without a database, a share for each machine.

use super::sync::bar;
use crate::cli::{Failure, cohort, say};
use crate::content::read_file;
use crate::handover::session_id;
use crate::report::harmless;
use crate::school::{RECORDING, Shard, rescored};
use crate::score::SCORER_VERSION;
use clap::Args;
use std::fs;
use std::path::{Path, PathBuf};

#[derive(Args)]
pub struct Arguments {
    /// Folder that holds bundles, at any depth
    folder: PathBuf,
    /// This machine's share: 3/8 is the third of eight
    #[arg(long, value_name = "I/N", default_value = "1/1")]
    shard: Shard,
    /// Folder for the results, one file per session: what `typodont score` prints
    #[arg(long, value_name = "DIR", default_value = "rescored")]
    out: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { folder, shard, out } = arguments;
    let cohort = cohort::read(folder)?;
    let unwritable = |e: std::io::Error| Failure::wrong(format!("{}: unwritable-folder: {e}", out.display()));
    fs::create_dir_all(out).map_err(unwritable)?;
    let with_recording = |path: &Path| path.join(RECORDING).is_file();
    let sessions = cohort.sessions.iter().map(|(path, session)| (session_id(session), path));
    let own: Vec<(String, &PathBuf)> = sessions.filter(|(id, path)| shard.has(id) && with_recording(path)).collect();
    let bar = bar(own.len() as u64, "scored");
    let (mut done, mut before, mut failed) = (0, 0, 0);
    for (id, path) in own {
        let file = out.join(format!("{id}.v{SCORER_VERSION}.json"));
        if file.is_file() {
            before += 1;
        } else {
            let read = read_file(&path.join(RECORDING)).map_err(|d| d.headline());
            match read.and_then(|bytes| rescored(&id, &bytes).map_err(|unscored| unscored.0)) {
                Ok(result) => {
                    // Whole or absent: whoever is killed leaves nothing that looks finished.
                    let partial = file.with_extension("partial");
                    fs::write(&partial, result.text())
                        .and_then(|()| fs::rename(&partial, &file))
                        .map_err(unwritable)?;
                    done += 1;
                }
                Err(why) => {
                    failed += 1;
                    eprintln!("{}: {}", path.display(), harmless(&why, 400));
                }
            }
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    say(format!("{}: {done} scored, {before} were there, {failed} failed", out.display()))?;
    if failed > 0 { Err(Failure::Told) } else { Ok(()) }
}
