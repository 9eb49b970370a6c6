//! Checks of the folder in which sessions are stored: rights, space, interrupted sessions.

use super::finding::{Finding, FindingStatus};
use super::remedies::StationFault;
use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use typodont_report::bundle::{is_in_use, is_partial};

/// Space that must be free, bytes: a long session with its volumes, recording and pictures takes half of it.
const SPACE: usize = 64 << 20;

/// Bytes of one write.
const BLOCK: usize = 1 << 20;

const CHECK: &str = "sessions";

pub fn findings(folder: &Path) -> Vec<Finding> {
    let missing = |what: String, fault| vec![Finding::fault(CHECK, FindingStatus::Missing, what, fault)];
    // The folder is made by the first session: until then, the folder above it decides. It is not made here.
    let Some(existing) = folder.ancestors().map(or_working_folder).find(|path| path.exists()) else {
        return missing(format!("{}: there is no such drive", folder.display()), StationFault::FolderNotWritable);
    };
    if !existing.is_dir() {
        return missing(format!("{} is a file, not a folder", existing.display()), StationFault::NotAFolder);
    }
    if let Err(error) = try_writing(existing) {
        let what = format!("{}: cannot write {} MB: {error}", existing.display(), SPACE >> 20);
        return missing(what, fault_of(&error));
    }
    let mut findings = vec![Finding::ok(CHECK, format!("{}: {} MB can be written", folder.display(), SPACE >> 20))];
    findings.extend(interrupted(folder).iter().map(|name| {
        let what = format!("{}: the session was interrupted", folder.join(name).display());
        Finding::fault(CHECK, FindingStatus::Warning, what, StationFault::InterruptedSession)
    }));
    findings
}

/// The last ancestor of a relative path is empty; it means the working folder.
fn or_working_folder(path: &Path) -> &Path {
    if path.as_os_str().is_empty() { Path::new(".") } else { path }
}

fn fault_of(error: &io::Error) -> StationFault {
    match error.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => StationFault::DiskFull,
        ErrorKind::FileTooLarge => StationFault::FileSizeLimit,
        _ => StationFault::FolderNotWritable,
    }
}

/// Writes as much as a session may need, synced to the disk, and deletes it: rights, quotas and limits are found only so.
fn try_writing(folder: &Path) -> io::Result<()> {
    let probe = DeletedOnDrop(folder.join(format!(".typodont-doctor-{}", std::process::id())));
    let mut file = File::create_new(&probe.0)?;
    let mut block = vec![0; BLOCK];
    let mut state = 1_u64;
    for _ in 0..SPACE / BLOCK {
        // Noise, so that no file system compresses it.
        for bytes in block.chunks_exact_mut(8) {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            bytes.copy_from_slice(&state.to_le_bytes());
        }
        file.write_all(&block)?;
    }
    file.sync_all()
}

struct DeletedOnDrop(PathBuf);

impl Drop for DeletedOnDrop {
    fn drop(&mut self) {
        // If the file was never made, there is nothing to delete.
        let _ = fs::remove_file(&self.0);
    }
}

/// Names of interrupted sessions; one that a program is recording at present is not.
fn interrupted(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let partial = entries.map(|entry| entry.path()).filter(|path| is_partial(path) && !is_in_use(path));
    let mut names: Vec<String> = partial.filter_map(|path| Some(path.file_name()?.display().to_string())).collect();
    names.sort();
    names
}
