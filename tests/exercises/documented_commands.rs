//! The commands that README and guides print: every one is a command of this program, and those that need nothing but a
//! folder are run as they are printed.

use crate::support::bundle;
use crate::support::coarse_exercise::coarse_text;
use crate::support::folder;

use bundle::{complained, program, told};
use folder::folder;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Commands with one of these words are not run here, because of what they need.
const NOT_RUN: [(&str, &str); 21] = [
    ("COMMAND", "any of the commands"),
    ("--station", "a station's file: tests/exercises/station.rs"),
    ("…", "an argument that the reader fills in"),
    ("--device", "a device: tests/devices"),
    ("--tooth", "a scanned tooth: tests/formats"),
    ("--watch", "a window: tests/desktop"),
    ("--seed-sealed", "a code for one session: tests/exercises/guessing.rs"),
    ("--ratings", "ratings of two examiners: tests/school/agreement.rs"),
    ("school", "a database: tests/school"),
    ("worker", "a database: tests/school"),
    ("enqueue", "a database: tests/school"),
    ("sync", "a store: tests/school"),
    ("review", "a browser: tests/school"),
    ("station.toml", "a station's file: tests/exercises/station.rs"),
    ("station", "a school's exercises: tests/exercises/station.rs"),
    ("send", "a record store: tests/school/handover.rs"),
    ("import", "a scan: tests/formats"),
    ("package", "the page, built: tests/school/learning_platform.rs"),
    ("--shard", "several machines: tests/school"),
    ("NAME.zip", "a file from the page: tests/desktop/page.rs"),
    ("bench", "minutes"),
];

/// Verbs that are complete without an argument; elsewhere the bare verb only names the command.
const COMPLETE: [&str; 3] = ["devices", "doctor", "schema"];

/// A text in which a code span begins with the program's name and is no command.
const NO_COMMAND: &str = "typodont second hand, protocol 2";

/// Printed commands with the page of each, in the order of the pages, each once.
fn documented() -> Vec<(String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut pages: Vec<PathBuf> = ["docs", "content/devices", "content/sounds"]
        .iter()
        .flat_map(|name| std::fs::read_dir(root.join(name)).unwrap().map(|entry| entry.unwrap().path()))
        .filter(|path| path.extension().is_some_and(|extension| extension == "md"))
        .chain(["README.md", "SECURITY.md", "reports/README.md"].map(|name| root.join(name)))
        .collect();
    pages.sort();
    let mut seen = BTreeSet::new();
    let mut found = Vec::new();
    for page in pages {
        let text = std::fs::read_to_string(&page).unwrap().replace("\\\n", " ");
        let name = page.strip_prefix(root).unwrap().display().to_string();
        let blocks = text.lines().filter_map(|line| line.strip_prefix("    "));
        let spans = text.split('`').skip(1).step_by(2);
        for command in blocks.chain(spans).filter(|code| code.starts_with("typodont ") && *code != NO_COMMAND) {
            let command = command.split("  #").next().unwrap().split('>').next().unwrap();
            let command = command.split_whitespace().collect::<Vec<_>>().join(" ");
            if seen.insert(command.clone()) {
                found.push((command, name.clone()));
            }
        }
    }
    found
}

/// Help of a command and, with its words, of the deepest subcommand that they name.
fn help(words: &[&str], known: &mut BTreeMap<String, Option<String>>) -> Option<(usize, String)> {
    let verbs = words.iter().take_while(|word| word.starts_with(|c: char| c.is_ascii_lowercase())).count();
    (0..=verbs.min(2)).rev().find_map(|count| {
        let verbs = &words[..count];
        let answer = known.entry(verbs.join(" ")).or_insert_with(|| {
            let output = Command::new(program()).args(verbs).arg("--help").output().unwrap();
            let usage = ["typodont"].iter().chain(verbs).copied().collect::<Vec<_>>().join(" ");
            Some(told(&output)).filter(|text| {
                output.status.success()
                    && text
                        .lines()
                        .any(|line| line == format!("Usage: {usage}") || line.starts_with(&format!("Usage: {usage} ")))
            })
        });
        answer.clone().map(|text| (count, text))
    })
}

#[test]
fn every_command_in_the_guides_is_one_of_the_program() {
    let mut known = BTreeMap::new();
    let mut wrong = Vec::new();
    let commands = documented();
    for (command, page) in &commands {
        let words: Vec<&str> = command.split(' ').skip(1).collect();
        let (count, text) = help(&words, &mut known).expect("the program has a help");
        let is_name = |word: &&str| word.starts_with(|c: char| c.is_ascii_lowercase());
        if count == 0 && words.first().is_some_and(is_name) {
            wrong.push(format!("{page}: `{command}`: there is no such command"));
            continue;
        }
        let is_option =
            |word: &&&str| word.starts_with('-') && word.chars().nth(1).is_some_and(|c| !c.is_ascii_digit());
        for option in words[count..].iter().filter(is_option) {
            let option = option.split('=').next().unwrap();
            if !text.split(|c: char| c.is_whitespace() || ",=[]<>".contains(c)).any(|word| word == option) {
                wrong.push(format!("{page}: `{command}`: no option {option}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(commands.len() > 80, "only {} commands were found in the guides", commands.len());
}

/// True for a word, a path that ends with it, and an argument that ends with an ellipsis.
fn is_or_ends_with(word: &str, ending: &str) -> bool {
    word == ending || word.ends_with(&format!("/{ending}")) || ending == "…" && word.ends_with('…')
}

#[test]
fn commands_in_the_guides_do_what_they_say() {
    // Method: in a folder with coarse exercises, as a reader has them, first the sessions and then all else in the order of
    // the pages.
    let folder = folder("documented_commands");
    let coarse = coarse_text("5-grinding", 0.4);
    for name in ["scenarios/5-grinding.json", "my-exercises/buccal-caries.json"] {
        std::fs::create_dir_all(folder.join(name).parent().unwrap()).unwrap();
        std::fs::write(folder.join(name), &coarse).unwrap();
    }
    let mut used = BTreeSet::new();
    let mut commands: Vec<(Vec<String>, String)> = Vec::new();
    for (command, page) in documented() {
        let words: Vec<String> = command.split(' ').skip(1).map(String::from).collect();
        let needs = NOT_RUN.iter().find(|(needing, _)| words.iter().any(|word| is_or_ends_with(word, needing)));
        let is_name = words.len() == 1 && !COMPLETE.contains(&words[0].as_str());
        let is_window = words[0] == "run" && !words.iter().any(|word| word == "--headless" || word == "--new-code");
        let is_long = words[0] == "demo" || words == ["check", "scenarios/"];
        used.extend(needs.map(|(word, _)| *word));
        let is_run = needs.is_none() && !is_name && !is_window && !is_long;
        if is_run && !words.iter().any(|word| word.ends_with(".partial") || word == "--overrides") {
            commands.push((words, page));
        }
    }
    commands.sort_by_key(|(words, _)| words[0] != "run");
    // A gradebook has only sessions of participants.
    let graded = "run scenarios/5-grinding.json --headless --operator hasty --participant P-07";
    commands.insert(0, (graded.split(' ').map(String::from).collect(), "this test".into()));
    let (mut bundle, mut run) = (String::new(), BTreeSet::new());
    for (words, page) in &commands {
        let words: Vec<&str> = words
            .iter()
            .map(|word| match (words[0].as_str(), word.as_str()) {
                (_, "BUNDLE" | "SESSION" | "OTURUM") => bundle.as_str(),
                ("anatomy", "DIR") => "teeth",
                (_, "DIR") => "reports/sessions",
                (_, "FILE") => "written.txt",
                (_, other) => other,
            })
            .collect();
        // Guides name the same bundle in several ways.
        if !run.insert(words.join(" ")) {
            continue;
        }
        let _ = std::fs::remove_file(folder.join("written.txt"));
        let output: Output =
            Command::new(program()).args(&words).current_dir(&folder).env("HOME", &folder).output().unwrap();
        // A machine of the tests may lack what a station has.
        let is_fine = output.status.success() || words[0] == "doctor" && output.status.code() == Some(1);
        assert!(is_fine, "{page}: typodont {}: {}{}", words.join(" "), told(&output), complained(&output));
        if words[0] == "run" && words.contains(&"--headless") {
            bundle = told(&output).lines().last().unwrap().to_string();
        }
    }
    let unused: Vec<&str> = NOT_RUN.iter().map(|(word, _)| *word).filter(|word| !used.contains(word)).collect();
    assert!(unused.is_empty(), "no command of the guides has {unused:?}");
    assert!(commands.len() >= 20, "only {} commands were run", commands.len());
    for made in ["class.html", "class.csv", "grades.csv", "expert.csv", "tooth.png", "tables/sessions.parquet", "spool"]
    {
        assert!(folder.join(made).exists(), "{made} was not made");
    }
}
