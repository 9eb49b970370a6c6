//! Parts that a build lacks, and the version in the texts of a release.

use regex_lite::Regex;
use std::path::Path;
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

#[test]
fn the_texts_name_this_version() {
    // Aim: a release is not published with the names of another one's packages, and what it offers is written down for later
    // ones to keep. Method: every package that a guide names, the newest part of the changelog, the list of the version.
    let (root, version) = (Path::new(env!("CARGO_MANIFEST_DIR")), env!("CARGO_PKG_VERSION"));
    let named = Regex::new(r"typodont(?:-dbgsym)?[_:-](\d+\.\d+\.\d+)").unwrap();
    let mut count = 0;
    for page in ["README.md", "docs/it.md", "docs/school/workers.yaml", "docs/school/rescore-job.yaml"] {
        let text = std::fs::read_to_string(root.join(page)).unwrap();
        for found in named.captures_iter(&text) {
            assert_eq!(&found[1], version, "{page}: {}", &found[0]);
            count += 1;
        }
    }
    assert!(count >= 10, "only {count} packages are named");
    let changes = std::fs::read_to_string(root.join("CHANGELOG.md")).unwrap();
    let newest = changes.lines().find_map(|line| line.strip_prefix("## ")).unwrap();
    assert!(
        newest.split(' ').any(|word| word.trim_matches(['(', ')']) == version),
        "CHANGELOG.md begins with {newest}"
    );
    let list = root.join(format!("tests/golden/contract-{version}.txt"));
    assert!(list.exists(), "{} is missing (docs/compatibility.md, For a new release)", list.display());
}
