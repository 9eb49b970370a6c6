//! Names and docs: no two types share a name, and docs begin with a noun or a verb.

use super::sources::sources;
use regex_lite::Regex;
use std::collections::{BTreeMap, BTreeSet};

/// Type names that stand several times, with the reason.
const SHARED_NAMES: [(&str, &str); 1] =
    [("Arguments", "clap's arguments of a command: each command's file has its own")];

#[test]
fn no_two_types_share_a_name() {
    // Aim: a name that is searched for is found in one place. Method: every struct, enum, trait and type alias outside of
    // tests and of implementations.
    let declaration = Regex::new(r"(?m)^(?:pub(?:\([a-z ]+\))? )?(?:struct|enum|union|trait|type) ([A-Z]\w*)").unwrap();
    let inner = Regex::new(r"(?m)^    pub(?:\([a-z ]+\))? (?:struct|enum|union|trait) ([A-Z]\w*)").unwrap();
    let mut places: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for file in sources() {
        let code = file.code();
        for found in declaration.captures_iter(&code).chain(inner.captures_iter(&code)) {
            places.entry(found[1].to_string()).or_default().insert(file.path.clone());
        }
    }
    let is_allowed = |name: &str| SHARED_NAMES.iter().any(|(shared, _)| *shared == name);
    let shared: Vec<String> = places
        .iter()
        .filter(|(name, files)| files.len() > 1 && !is_allowed(name))
        .map(|(name, files)| format!("{name}: {files:?}"))
        .collect();
    assert!(shared.is_empty(), "types that share a name:\n{}", shared.join("\n"));
}

#[test]
fn errors_are_called_errors_and_are_errors() {
    // Aim: every type whose name ends in `Error` works with `?` and `Box<dyn Error>`.
    let declaration = Regex::new(r"(?m)^pub (?:struct|enum) (\w+Error)\b").unwrap();
    let mut wrong = Vec::new();
    let files = sources();
    for file in files.iter().filter(|file| file.krate != "cli") {
        for found in declaration.captures_iter(&file.code()) {
            let name = &found[1];
            let implements = files.iter().filter(|other| other.krate == file.krate).any(|other| {
                other.text.contains(&format!("Error for {name}")) || other.text.contains(&format!("Error> for {name}"))
            });
            if !implements {
                wrong.push(format!("src/{}: {name} does not implement std::error::Error", file.path));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn docs_begin_with_a_noun_or_a_verb() {
    // Aim: docs that say what a thing is. Method: no line of a doc comment begins with a headless clause.
    let headless = Regex::new(r"^\s*//[/!] (?:What|How|Whether|Where)\b").unwrap();
    let mut wrong = Vec::new();
    for file in sources() {
        for (number, line) in file.text.lines().enumerate().filter(|(_, line)| headless.is_match(line)) {
            wrong.push(format!("src/{}:{}: {}", file.path, number + 1, line.trim()));
        }
    }
    assert!(wrong.is_empty(), "{} headless lines:\n{}", wrong.len(), wrong.join("\n"));
}
