//! Copies of finished sessions in a folder of the school, such as one on a network drive.
//!
//! Takes the folder of the sessions and a target. A bundle appears in the target whole or not at all, and once. Never
//! changes or deletes a session.

use std::fs;
use std::io;
use std::path::Path;
use typodont_report::bundle::{SESSION_FILE, is_partial};

/// Copies every finished bundle that the target does not have; returns their number.
///
/// # Errors
/// The first file that cannot be read or written. What was copied before stays.
pub fn send(sessions: &Path, target: &Path) -> Result<usize, String> {
    let failed = |path: &Path, error: io::Error| format!("{}: {error}", path.display());
    let mut count = 0;
    let entries = match fs::read_dir(sessions) {
        Ok(entries) => entries,
        // Until the first session there is no folder.
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(0),
        Err(error) => return Err(failed(sessions, error)),
    };
    for entry in entries {
        let entry = entry.map_err(|error| failed(sessions, error))?;
        let bundle = entry.path();
        if is_partial(&bundle) || !bundle.join(SESSION_FILE).is_file() {
            continue;
        }
        let own = target.join(entry.file_name());
        if own.exists() {
            continue;
        }
        fs::create_dir_all(target).map_err(|error| failed(target, error))?;
        let unfinished = target.join(format!(".{}.partial", entry.file_name().display()));
        if unfinished.exists() {
            fs::remove_dir_all(&unfinished).map_err(|error| failed(&unfinished, error))?;
        }
        copy_folder(&bundle, &unfinished).map_err(|error| failed(&bundle, error))?;
        fs::rename(&unfinished, &own).map_err(|error| failed(&own, error))?;
        count += 1;
    }
    Ok(count)
}

fn copy_folder(from: &Path, to: &Path) -> io::Result<()> {
    fs::create_dir(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let target = to.join(entry.file_name());
        match entry.file_type()?.is_dir() {
            true => copy_folder(&entry.path(), &target)?,
            false => drop(fs::copy(entry.path(), target)?),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finished_sessions_are_sent_once_and_whole() {
        // Aim: the school's folder has every finished session, and none that is still running. Method: a finished one
        // with a folder in it, one that runs, one whose copy was interrupted.
        let folder = std::env::temp_dir().join(format!("typodont-send-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        let (sessions, target) = (folder.join("sessions"), folder.join("school/lab-2"));
        for name in ["a", "b.partial"] {
            fs::create_dir_all(sessions.join(name).join("views")).unwrap();
            fs::write(sessions.join(name).join(SESSION_FILE), name).unwrap();
            fs::write(sessions.join(name).join("views/front.png"), name).unwrap();
        }
        fs::create_dir_all(target.join(".a.partial")).unwrap();
        assert_eq!(send(&sessions, &target), Ok(1));
        assert_eq!(fs::read_to_string(target.join("a/views/front.png")).unwrap(), "a");
        assert_eq!(fs::read_dir(&target).unwrap().count(), 1, "nothing else");
        assert_eq!(send(&sessions, &target), Ok(0));
        assert_eq!(send(&folder.join("none"), &target), Ok(0));
        fs::remove_dir_all(folder).unwrap();
    }
}
