//! Verification of the sessions that a command reads, with the cache of replays and the option `--verified`.

use super::progress::progress_bar;
use super::{CliError, cohort, load_templates};
use clap::Args;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::UNIX_EPOCH;
use typodont_report::cohort::Cohort;
use typodont_report::{VerificationStatus, Verifier, sanitize_display};

/// Environment variable that names another folder for the cache of replays.
const CACHE: &str = "TYPODONT_CACHE";

/// Maximum length of a printed path or reason, characters.
const PRINTED_MAX: usize = 300;

#[derive(Args)]
pub struct VerificationArguments {
    /// Leave out sessions whose result was not confirmed by a replay of the recording
    #[arg(long)]
    verified: bool,
}

/// A verifier with the templates of the working folder and the user's cache of replays.
///
/// # Errors
/// Fails if the templates are not valid.
pub fn verifier() -> Result<Verifier, CliError> {
    let verifier = Verifier::new(&load_templates()?);
    Ok(match (cache_folder(), build_identity()) {
        (Some(folder), Some(build)) => verifier.with_cache(folder, build),
        // Without a cache, everything is replayed each time.
        _ => verifier,
    })
}

/// Folder of this user in which replays are kept. It is not beside the bundles: whoever hands in a bundle could write
/// there.
fn cache_folder() -> Option<PathBuf> {
    match std::env::var_os(CACHE).filter(|folder| !folder.is_empty()) {
        Some(folder) => Some(PathBuf::from(folder)),
        None => Some(directories::ProjectDirs::from("", "", "typodont")?.cache_dir().join("replays")),
    }
}

/// Version, size and time of this program: after an update, every recording is replayed again.
fn build_identity() -> Option<String> {
    let meta = std::fs::metadata(std::env::current_exe().ok()?).ok()?;
    let modified = meta.modified().ok()?.duration_since(UNIX_EPOCH).ok()?;
    Some(format!("{} {} {}", env!("CARGO_PKG_VERSION"), meta.len(), modified.as_nanos()))
}

/// Verifies a folder's sessions; those of a database come with the workers' judgement. Prints what differs and what is
/// not verified, and leaves that out where it is asked for.
///
/// # Errors
/// A message if nothing remains.
pub fn settle(cohort: &mut Cohort, arguments: &VerificationArguments) -> Result<(), CliError> {
    let reported_count = cohort.skipped.len();
    if cohort.verification.is_empty() {
        let bar = progress_bar(cohort.sessions.len() as u64, "verified");
        cohort.verify(&verifier()?, |done| bar.set_position(done as u64));
        bar.finish_and_clear();
    } else {
        cohort.skip_repeated_recordings();
    }
    cohort::report_skipped(cohort, reported_count);
    report_unverified(cohort);
    let Cohort { sessions, verification, .. } = cohort;
    arguments.retain(sessions, |(path, _)| verification.get(path).cloned().unwrap_or_default())
}

impl VerificationArguments {
    /// Leaves out sessions that are not verified, if that is asked for, and prints their number.
    ///
    /// # Errors
    /// A message if nothing remains.
    pub fn retain<T>(&self, sessions: &mut Vec<T>, status: impl Fn(&T) -> VerificationStatus) -> Result<(), CliError> {
        if !self.verified {
            return Ok(());
        }
        let before = sessions.len();
        let differing = sessions.iter().filter(|session| status(session).differs()).count();
        sessions.retain(|session| status(session).is_verified());
        let left_out = before - sessions.len();
        if left_out > 0 {
            let rest = left_out - differing;
            eprintln!("left out: {rest} sessions that are not verified, {differing} that differ from their recordings");
        }
        match sessions.is_empty() {
            true => Err(CliError::wrong("--verified: no-sessions: no session is verified")),
            false => Ok(()),
        }
    }
}

/// Prints a line for each session that differs, and one for each reason for which sessions are not verified.
fn report_unverified(cohort: &Cohort) {
    let shown = |text: &str| sanitize_display(text, PRINTED_MAX);
    let mut reasons: BTreeMap<String, usize> = BTreeMap::new();
    for (path, _) in &cohort.sessions {
        let status = cohort.status(path);
        match status {
            VerificationStatus::Verified => {}
            VerificationStatus::Differs(_) => {
                eprintln!("{}: differs: {}", shown(&path.display().to_string()), shown(&status.note()));
            }
            _ => *reasons.entry(status.note()).or_default() += 1,
        }
    }
    for (why, count) in reasons {
        let sessions = if count == 1 { "1 session".to_string() } else { format!("{count} sessions") };
        eprintln!("{sessions}: not verified: {}", shown(&why));
    }
}
