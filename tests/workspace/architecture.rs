//! The table of crates in `ARCHITECTURE.md` is true, and crates keep the promises made there.

use super::sources::{root, sources};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;

/// Rows of the table: crate and those it may use, lowest first.
fn table() -> Vec<(String, BTreeSet<String>)> {
    let text = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let section = text.split("## Crates, lowest first").nth(1).expect("ARCHITECTURE.md has a table of crates");
    let section = section.split("\n## ").next().unwrap();
    let rows = section.lines().filter(|line| line.starts_with("| `"));
    rows.map(|row| {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let uses = cells[2].split(',').map(|name| name.trim().trim_matches('`').to_string());
        (cells[0].trim_matches('`').to_string(), uses.filter(|name| !name.is_empty()).collect())
    })
    .collect()
}

/// Crates that a manifest names among its dependencies, optional ones included; development dependencies do not count.
fn dependencies(manifest: &str) -> BTreeSet<String> {
    let mut section = "";
    let mut found = BTreeSet::new();
    for line in manifest.lines() {
        if line.starts_with('[') {
            section = line;
        }
        let is_dependency = section.ends_with("dependencies]")
            && !section.contains("dev-dependencies")
            && !section.starts_with("[workspace");
        if let Some(name) = line.strip_prefix("typodont-").filter(|_| is_dependency) {
            found.insert(name.chars().take_while(|c| c.is_ascii_alphanumeric() || *c == '-').collect());
        }
    }
    found
}

#[test]
fn the_table_of_crates_is_what_the_manifests_say() {
    // Aim: whoever reads the table knows the graph. Method: compare its rows with every Cargo.toml.
    let mut manifests = BTreeMap::new();
    for entry in fs::read_dir(root().join("src")).unwrap() {
        let folder = entry.unwrap().path();
        if let Ok(manifest) = fs::read_to_string(folder.join("Cargo.toml")) {
            manifests.insert(folder.file_name().unwrap().to_string_lossy().into_owned(), dependencies(&manifest));
        }
    }
    manifests.insert("cli".into(), dependencies(&fs::read_to_string(root().join("Cargo.toml")).unwrap()));
    assert_eq!(manifests, table().into_iter().collect(), "Cargo.toml on the left, ARCHITECTURE.md on the right");
}

#[test]
fn every_file_that_the_text_names_exists() {
    // Aim: a stranger who follows the text finds the file. Method: every path in backticks that begins with a folder of the
    // repository.
    let text = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let folders = ["src/", "tests/", "content/", "reports/", "scenarios/", "scripts/"];
    let paths: BTreeSet<&str> = text
        .split('`')
        .skip(1)
        .step_by(2)
        .filter(|path| folders.iter().any(|folder| path.starts_with(folder)) && !path.contains(' '))
        .collect();
    assert!(paths.len() > 30, "{paths:?}");
    let missing: Vec<_> = paths.iter().filter(|path| !root().join(path).exists()).collect();
    assert!(missing.is_empty(), "ARCHITECTURE.md names {missing:?}");
}

#[test]
fn the_table_names_the_lowest_crate_first() {
    let table = table();
    for (place, (name, uses)) in table.iter().enumerate() {
        let below: BTreeSet<String> = table[..place].iter().map(|(name, _)| name.clone()).collect();
        let above: Vec<_> = uses.difference(&below).collect();
        assert!(above.is_empty(), "{name} uses {above:?}, which the table names later");
    }
}

/// Crates that also build for WebAssembly.
const PORTABLE: [&str; 7] = ["core", "anatomy", "formats", "exercise", "render", "scene", "report"];

#[test]
fn crates_keep_their_promises() {
    // Aim: absences that the graph cannot show: no clock, no printing, no random order where results are made.
    const CLOCKS: [&str; 3] = ["Instant::now", "SystemTime", "Timestamp::now"];
    const PRINTING: [&str; 3] = ["println!", "eprintln!", "HashMap"];
    const PLATFORM_MATHEMATICS: [&str; 9] =
        [".sin()", ".cos()", ".exp()", ".ln()", ".powf(", ".cbrt()", ".acos()", ".tan()", "thread_rng"];
    // Bundles and written exercises are files that others may change: their times are compared.
    let compares_file_times = ["review/index.rs", "author/file_io.rs"];
    // Ends the retries of a server that does not answer.
    let waits = ["school/retry.rs"];
    let mut wrong = Vec::new();
    for file in sources() {
        let krate = file.krate.as_str();
        let code = file.code();
        let mut check = |words: &[&str], reason: &str| {
            for word in words.iter().filter(|word| code.contains(**word)) {
                wrong.push(format!("src/{}: {word}: {reason}", file.path));
            }
        };
        if PORTABLE.contains(&krate) {
            check(&CLOCKS, "a portable crate reads no clock");
            check(&["std::net", "std::process", "std::env::"], "a portable crate knows no system");
        }
        if matches!(krate, "core" | "anatomy") {
            check(&["serde", "std::fs", "std::path"], "serialisation and files stand at the borders");
        }
        if matches!(krate, "render" | "scene" | "lesson" | "audio") {
            check(&["serde"], "serialisation stands at the borders");
        }
        if matches!(krate, "lesson" | "integrations" | "review" | "school" | "author" | "render" | "scene")
            && !compares_file_times.contains(&file.path.as_str())
            && !waits.contains(&file.path.as_str())
        {
            check(&CLOCKS, "only the program and the window read the wall clock");
        }
        if matches!(krate, "devices" | "audio" | "app") {
            check(&["SystemTime"], "a monotonic clock keeps the rate; no result depends on the date");
        }
        if !matches!(krate, "cli" | "app") {
            check(&PRINTING, "only the program prints, and no result depends on the order of a hash table");
        }
        if file.path.starts_with("core/touch") || file.path.starts_with("core/sim") {
            check(&PLATFORM_MATHEMATICS, "the tick has the same bits on every machine (use libm)");
        }
        if krate == "report"
            || [
                "render/shading.rs",
                "render/surface_colours.rs",
                "render/unworked_tooth.rs",
                "render/enamel_colours.rs",
                "render/relief.rs",
            ]
            .contains(&file.path.as_str())
        {
            check(&PLATFORM_MATHEMATICS, "pictures of a report have the same bytes on every machine (use libm)");
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_portable_crates_open_files_only_where_the_text_says() {
    // Aim: whoever brings the program to a place without a disk reads these files and no others. Method: the words by which
    // Rust opens files.
    let opens = [
        "exercise/record/writer.rs",
        "formats/file_writer.rs",
        "formats/imaging/dicom/mod.rs",
        "formats/imaging/mod.rs",
        "formats/library.rs",
        "formats/nrrd/source.rs",
        "report/bundle/bundle_folder.rs",
        "report/bundle/partial_bundle.rs",
        "report/cohort/loader.rs",
        "report/templates.rs",
        "report/verification.rs",
    ];
    let text = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let words = ["std::fs", "fs::", "File::", ".read_dir(", ".canonicalize(", "OpenOptions"];
    let mut found = BTreeSet::new();
    for file in sources().into_iter().filter(|file| PORTABLE.contains(&file.krate.as_str())) {
        let code = file.code();
        // `SessionFile::of` and its like are types of files, not files.
        let is_word = |word: &str| {
            code.match_indices(word).any(|(at, _)| !code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_'))
        };
        if words.iter().any(|word| is_word(word) || (word.starts_with('.') && code.contains(word))) {
            found.insert(file.path);
        }
    }
    assert_eq!(found, BTreeSet::from(opens.map(String::from)), "sources on the left, the list on the right");
    let unnamed: Vec<_> = opens.iter().filter(|path| !text.contains(&format!("`src/{path}`"))).collect();
    assert!(unnamed.is_empty(), "ARCHITECTURE.md does not name {unnamed:?}");
}

#[test]
fn the_network_is_used_only_where_the_text_says() {
    // Aim: whoever asks what this program says to a network, and who may speak to it, reads these files and no others. A
    // socket that waits for connections stands in one place.
    let speaks = [
        "devices/haply/service.rs",
        "devices/link.rs",
        "devices/stream.rs",
        "cli/http_server.rs",
        "cli/review.rs",
        "cli/review/server.rs",
        "cli/school/metrics.rs",
        "cli/station/exercise_server.rs",
        "integrations/lrs.rs",
        "integrations/tls_roots.rs",
        "school/connection.rs",
        "school/http_client.rs",
        "school/store.rs",
    ];
    let listens = ["cli/http_server.rs", "cli/review.rs", "cli/review/server.rs", "cli/school/metrics.rs"];
    let words = ["TcpStream", "UdpSocket", "TcpListener", "tokio::", "hyper::", "ureq::", "NoTls", "object_store::"];
    let mut wrong = Vec::new();
    let mut seen = BTreeSet::new();
    for file in sources() {
        let code = file.code();
        for word in words.iter().filter(|word| code.contains(**word)) {
            seen.insert(file.path.clone());
            let allowed: &[&str] = if *word == "TcpListener" { &listens } else { &speaks };
            if !allowed.contains(&file.path.as_str()) {
                wrong.push(format!("src/{}: {word}", file.path));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let stale: Vec<_> = speaks.iter().filter(|path| !seen.contains(**path)).collect();
    assert!(stale.is_empty(), "listed here, and speak to no network: {stale:?}");
}

#[test]
fn unsafe_stands_only_where_c_is_called() {
    // Aim: whoever audits the program for memory safety reads these files and no others.
    let allowed = ["devices/openhaptics.rs", "devices/forcedimension.rs", "app/platform/console.rs"];
    for file in sources() {
        let has = ["unsafe {", "allow(unsafe_code)", "unsafe fn"].iter().any(|word| file.text.contains(word));
        assert!(
            allowed.contains(&file.path.as_str()) || !has,
            "src/{}: unsafe code belongs into {allowed:?}",
            file.path
        );
    }
}

#[test]
fn every_suite_is_run_by_scripts_test() {
    // Aim: a new suite is not forgotten, because the script names those that wait and the others. Method: each folder of tests/ with a
    // main.rs is named there.
    let script = fs::read_to_string(root().join("scripts/test")).unwrap();
    let script: BTreeSet<&str> = script.split_whitespace().collect();
    let suites = fs::read_dir(root().join("tests")).unwrap().map(|entry| entry.unwrap().path());
    let suites: Vec<String> = suites
        .filter(|path| path.join("main.rs").is_file())
        .map(|path| path.file_name().unwrap().to_string_lossy().into_owned())
        .collect();
    assert!(suites.len() >= 10);
    let forgotten: Vec<&String> = suites.iter().filter(|suite| !script.contains(suite.as_str())).collect();
    assert!(forgotten.is_empty(), "scripts/test does not run {forgotten:?}");
}
