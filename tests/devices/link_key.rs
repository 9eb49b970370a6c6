//! The key of the link to a second device stands in no list of processes, unless somebody insists.

use crate::support::bundle::typodont;
use std::fs;
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("link_key");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Exit status and standard error of `typodont assist` with these arguments and a device that does not exist.
fn assist(arguments: &[&str]) -> (Option<i32>, String) {
    let fixed = ["assist", "--device", "no-such-device", "--to", "127.0.0.1:9"];
    let output = typodont(&[&fixed, arguments].concat());
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn a_key_is_made_and_read_from_a_file_that_nobody_else_reads() {
    let path = folder().join("link.key");
    let file = path.to_str().unwrap();
    let made = typodont(&["assist", "--new-key", file]);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let key = fs::read_to_string(&path).unwrap();
    assert!(key.trim().len() >= 25 && !String::from_utf8_lossy(&made.stdout).contains(key.trim()));
    // An existing key is not replaced.
    let again = typodont(&["assist", "--new-key", file]);
    assert!(again.status.code() == Some(1) && String::from_utf8_lossy(&again.stderr).contains("known-file"));
    assert_eq!(fs::read_to_string(&path).unwrap(), key);
    // The key is read before the device is looked for; nothing is said about it.
    let (_, said) = assist(&["--key-file", file]);
    assert!(said.contains("no-such-device") && !said.contains("secret") && !said.contains(key.trim()), "{said}");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        fs::set_permissions(&path, fs::Permissions::from_mode(0o644)).unwrap();
        let (status, said) = assist(&["--key-file", file]);
        assert!(status == Some(1) && said.contains("open-secret") && said.contains("chmod 600"), "{said}");
    }
}

#[test]
fn a_key_is_required_and_a_typed_one_brings_a_warning() {
    let (status, said) = assist(&[]);
    assert!(status == Some(2) && said.contains("no-key") && said.contains("TYPODONT_LINK_KEY"), "{said}");
    let (status, said) = assist(&["--key", "short"]);
    assert!(status == Some(2) && said.contains("weak-key"), "{said}");
    let (_, said) = assist(&["--key", "a key of ours"]);
    assert!(said.contains("open-secret") && said.contains("--key-file") && !said.contains("a key of ours"), "{said}");
    let trainee = ["run", "scenarios/5-grinding.json", "--device", "no-such-device", "--second-at", "127.0.0.1:0"];
    assert_eq!(
        typodont(&[&trainee[..], &["--second-key", "a key of ours", "--second-key-file", "x"]].concat()).status.code(),
        Some(2)
    );
}
