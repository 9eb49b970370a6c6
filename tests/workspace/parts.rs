//! A build without a part says so in one sentence.

use std::process::Command;

#[test]
fn a_build_without_a_part_says_which_is_missing() {
    // Aim: somebody with a small build learns what to build or install. Method: the build without any part, which
    // `scripts/test --long` makes; every command and option that needs a part.
    let Some(program) = std::env::var_os("TYPODONT_OTHER_BUILD") else {
        return println!("left to scripts/test --long: there is no build without parts");
    };
    for (arguments, feature) in [
        (&[][..], "desktop"),
        (&["run", "scenarios/5-grinding.json"], "desktop"),
        (&["preview", "scenarios/5-grinding.json", "--watch"], "desktop"),
        (&["run", "scenarios/5-grinding.json", "--device", "haply"], "devices"),
        (&["devices"], "devices"),
        (&["assist", "--help"], "devices"),
        (&["gradebook", "reports", "--for", "moodle"], "integrations"),
        (&["xapi", "send", "spool"], "integrations"),
        (&["parquet", "reports"], "integrations"),
        (&["review", "reports", "--port", "0"], "review"),
        (&["school", "init"], "school"),
        (&["worker"], "school"),
        (&["cohort", "--database", "postgres://nowhere"], "school"),
    ] {
        let output = Command::new(&program).args(arguments).current_dir(env!("CARGO_MANIFEST_DIR")).output().unwrap();
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {error}");
        assert_eq!(error.trim_end().lines().count(), 1, "{arguments:?}: {error}");
        assert!(error.contains(&format!("--features {feature}`")), "{arguments:?}: {error}");
    }
}
