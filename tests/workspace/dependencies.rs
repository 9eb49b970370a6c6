//! Dependencies of the workspace: licences, sources, second versions of a crate, and the notices that a package needs.

use crate::tools;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;
use std::sync::LazyLock;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Packages of the lock file, for every platform, as `cargo metadata` describes them.
static PACKAGES: LazyLock<Vec<Value>> = LazyLock::new(|| {
    let cargo = std::env::var_os("CARGO").unwrap_or("cargo".into());
    let arguments = ["metadata", "--format-version", "1", "--all-features", "--locked"];
    let output = Command::new(cargo).args(arguments).current_dir(root()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
    let Value::Array(packages) = metadata["packages"].take() else { panic!("no packages") };
    packages.into_iter().filter(|package| !package["source"].is_null()).collect()
});

fn name(package: &Value) -> &str {
    package["name"].as_str().unwrap()
}

/// Texts in the list of a key of a table in `deny.toml`. Each entry has a line of its own.
fn listed(table: &str, key: &str) -> Vec<String> {
    let text = std::fs::read_to_string(root().join("deny.toml")).unwrap();
    let (_, body) = text.split_once(&format!("\n[{table}]\n")).unwrap_or_else(|| panic!("deny.toml has no [{table}]"));
    let body = body.split("\n[").next().unwrap();
    let (_, list) = body.split_once(&format!("{key} = [")).unwrap_or_else(|| panic!("[{table}] has no {key}"));
    // The list ends at the first bracket on a line of its own, or on its first line.
    let end = list.find("\n]").unwrap_or(list.len()).min(list.find("]\n").unwrap_or(list.len()));
    list[..end]
        .lines()
        .map(|line| line.trim().trim_end_matches(',').trim_matches('"').to_string())
        .filter(|line| !line.is_empty())
        .collect()
}

/// Returns whether an SPDX licence expression holds, if the licences that `accepts` accepts may be chosen.
fn holds(expression: &str, accepts: &dyn Fn(&str) -> bool) -> bool {
    let spaced = expression.replace('(', " ( ").replace(')', " ) ").replace('/', " OR ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let mut at = 0;
    let result = either(&words, &mut at, accepts);
    assert_eq!(at, words.len(), "not a licence expression: {expression}");
    result
}

fn either(words: &[&str], at: &mut usize, accepts: &dyn Fn(&str) -> bool) -> bool {
    let mut result = both(words, at, accepts);
    while words.get(*at) == Some(&"OR") {
        *at += 1;
        result |= both(words, at, accepts);
    }
    result
}

fn both(words: &[&str], at: &mut usize, accepts: &dyn Fn(&str) -> bool) -> bool {
    let mut result = one(words, at, accepts);
    while words.get(*at) == Some(&"AND") {
        *at += 1;
        result &= one(words, at, accepts);
    }
    result
}

fn one(words: &[&str], at: &mut usize, accepts: &dyn Fn(&str) -> bool) -> bool {
    let Some(word) = words.get(*at) else { return false };
    *at += 1;
    if *word == "(" {
        let result = either(words, at, accepts);
        *at += 1;
        return result;
    }
    match words.get(*at) {
        Some(&"WITH") => {
            *at += 2;
            accepts(&format!("{word} WITH {}", words.get(*at - 1).unwrap_or(&"")))
        }
        _ => accepts(word),
    }
}

#[test]
fn a_licence_expression_is_read_as_spdx_means_it() {
    let check = |expression: &str, accepted: &[&str], expected: bool| {
        assert_eq!(holds(expression, &|licence| accepted.contains(&licence)), expected, "{expression} of {accepted:?}");
    };
    check("MIT OR GPL-2.0-only", &["MIT"], true);
    check("MIT AND GPL-2.0-only", &["MIT"], false);
    check("(MIT OR Apache-2.0) AND OFL-1.1", &["MIT"], false);
    check("(MIT OR Apache-2.0) AND OFL-1.1", &["Apache-2.0", "OFL-1.1"], true);
    check("GPL-3.0-only OR MIT AND ISC", &["MIT"], false);
    check("Apache-2.0 WITH LLVM-exception", &["Apache-2.0"], false);
    check("Apache-2.0 WITH LLVM-exception OR MIT", &["Apache-2.0 WITH LLVM-exception"], true);
    check("MIT/Apache-2.0", &["Apache-2.0"], true);
    check("", &["MIT"], false);
}

#[test]
fn every_dependency_has_an_accepted_licence() {
    // Aim: whoever passes the program on may do so. Method: the expression of each crate, against the lists of
    // deny.toml.
    let allowed = listed("licenses", "allow");
    let exceptions: BTreeMap<String, String> = listed("licenses", "exceptions")
        .into_iter()
        .map(|line| {
            let (_, rest) = line.split_once("crate = \"").unwrap();
            let (name, licences) = rest.split_once('"').unwrap();
            (name.to_string(), licences.to_string())
        })
        .collect();
    assert!(allowed.contains(&"MIT".to_string()) && exceptions.contains_key("option-ext"), "deny.toml is read");
    let mut wrong = Vec::new();
    for package in PACKAGES.iter() {
        let accepts = |licence: &str| {
            let quoted = format!("\"{licence}\"");
            allowed.iter().any(|a| a == licence) || exceptions.get(name(package)).is_some_and(|e| e.contains(&quoted))
        };
        let expression = package["license"].as_str().unwrap_or_default();
        if !holds(expression, &accepts) {
            wrong.push(format!("{}: {expression}", name(package)));
        }
    }
    assert!(PACKAGES.len() > 100 && wrong.is_empty(), "not in deny.toml: {wrong:#?}");
    let unused: Vec<&String> =
        exceptions.keys().filter(|crate_name| PACKAGES.iter().all(|p| name(p) != crate_name.as_str())).collect();
    assert!(unused.is_empty(), "nobody needs the exceptions for {unused:?}");
}

#[test]
fn every_dependency_comes_from_the_registry() {
    let registries = listed("sources", "allow-registry");
    let known: Vec<String> =
        registries.iter().map(|address| format!("registry+{}", address.trim_matches('"'))).collect();
    let wrong: Vec<String> = PACKAGES
        .iter()
        .filter(|package| !known.iter().any(|known| package["source"] == known.as_str()))
        .map(|package| format!("{}: {}", name(package), package["source"]))
        .collect();
    assert!(!known.is_empty() && wrong.is_empty(), "{wrong:#?}");
    // The lock file holds the digest of each.
    let lock = std::fs::read_to_string(root().join("Cargo.lock")).unwrap();
    let entries = lock.split("[[package]]").filter(|entry| entry.contains("source = "));
    let unsigned: Vec<&str> = entries.filter(|entry| !entry.contains("checksum = ")).collect();
    assert!(unsigned.is_empty(), "{unsigned:?}");
}

#[test]
fn a_second_version_of_a_crate_is_known() {
    // Aim: nobody adds a second version of a crate without noticing it. Method: all but the newest version of each
    // crate, against the list `skip` of deny.toml, both ways.
    let mut versions: BTreeMap<&str, Vec<Vec<u64>>> = BTreeMap::new();
    let numbers = |version: &str| -> Vec<u64> {
        let plain = version.split(['+', '-']).next().unwrap();
        plain.split('.').map(|number| number.parse().unwrap()).collect()
    };
    for package in PACKAGES.iter() {
        versions.entry(name(package)).or_default().push(numbers(package["version"].as_str().unwrap()));
    }
    let mut found = BTreeSet::new();
    for (name, mut all) in versions {
        all.sort();
        for older in &all[..all.len() - 1] {
            let version = older.iter().map(u64::to_string).collect::<Vec<_>>().join(".");
            found.insert(format!("{name}@{version}"));
        }
    }
    let known: BTreeSet<String> = listed("bans", "skip").into_iter().collect();
    let new: Vec<&String> = found.difference(&known).collect();
    assert!(new.is_empty(), "crates in a second version; avoid them, or add them to `skip` in deny.toml: {new:#?}");
    let gone: Vec<&String> = known.difference(&found).collect();
    assert!(gone.is_empty(), "no longer there; remove them from `skip` in deny.toml: {gone:#?}");
}

#[test]
fn a_package_can_name_all_it_contains() {
    // Aim: the notices name every crate in the program with a text of its licence, also those of the fonts. Method:
    // `scripts/notices`, for all platforms; crates that nobody can overlook.
    let Ok(output) = Command::new("python3").arg("scripts/notices").current_dir(root()).output() else {
        return tools::skip("there is no python3: the notices are not collected");
    };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = std::fs::read_to_string(root().join("target/notices/THIRD-PARTY-NOTICES.txt")).unwrap();
    let (list, texts) = text.split_once("\nText 1\n").unwrap();
    let named: BTreeSet<&str> = list.lines().filter(|line| !line.starts_with(' ')).collect();
    for package in PACKAGES.iter() {
        let line = format!("{} {}", name(package), package["version"].as_str().unwrap());
        let is_expected =
            ["serde", "wgpu", "eframe", "postgres", "option-ext", "epaint_default_fonts"].contains(&name(package));
        assert!(!is_expected || named.contains(line.as_str()), "{line}");
    }
    assert!(!named.iter().any(|line| line.starts_with("proptest ")), "a test's dependency is not in the program");
    for expected in
        ["Mozilla Public License", "SIL OPEN FONT LICENSE", "UBUNTU FONT LICENCE", "Apache License", "Unicode"]
    {
        assert!(texts.to_lowercase().contains(&expected.to_lowercase()), "{expected}");
    }
    for line in list.lines().filter_map(|line| line.strip_prefix("    texts: ")) {
        assert!(!line.is_empty());
    }
}

#[test]
fn a_bill_of_materials_names_every_crate_with_its_digest() {
    // Aim: IT can compare the program with a list of known weaknesses. Method: `scripts/sbom` names the crates of the lock
    // file with their digests, each reference leads to one of them, and the same sources give the same bytes.
    let bill = || {
        let mut command = Command::new("python3");
        command.arg("scripts/sbom").current_dir(root()).env("SOURCE_DATE_EPOCH", "1800000000").output()
    };
    let (Ok(output), Ok(again)) = (bill(), bill()) else {
        return tools::skip("there is no python3: the bill of materials is not written");
    };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.stdout, again.stdout);
    let bill: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&bill["specVersion"], &bill["metadata"]["timestamp"]), (&"1.5".into(), &"2027-01-15T08:00:00Z".into()));
    let components = bill["components"].as_array().unwrap();
    let mut references: BTreeSet<&str> =
        components.iter().map(|component| component["bom-ref"].as_str().unwrap()).collect();
    for component in components {
        assert_eq!(component["hashes"][0]["content"].as_str().unwrap().len(), 64, "{component}");
        assert!(!component["licenses"][0]["expression"].as_str().unwrap().is_empty(), "{component}");
    }
    for package in PACKAGES.iter().filter(|package| ["serde", "wgpu", "postgres"].contains(&name(package))) {
        let reference = format!("pkg:cargo/{}@{}", name(package), package["version"].as_str().unwrap());
        assert!(references.contains(reference.as_str()), "{reference}");
    }
    assert!(!references.iter().any(|reference| reference.starts_with("pkg:cargo/proptest@")), "a test's dependency");
    references.insert(bill["metadata"]["component"]["bom-ref"].as_str().unwrap());
    for dependency in bill["dependencies"].as_array().unwrap() {
        assert!(references.contains(dependency["ref"].as_str().unwrap()), "{dependency}");
        for used in dependency["dependsOn"].as_array().unwrap() {
            assert!(references.contains(used.as_str().unwrap()), "{dependency}");
        }
    }
}
