//! `docs/thesis.md`: everything that the thesis describes has a row, and each row's evidence exists.

use super::sources::root;
use regex_lite::Regex;
use std::collections::BTreeMap;
use std::fs;

/// Number of rows about the thesis itself, numbered from 1.
const ROWS: usize = 70;

const STATES: [&str; 4] = ["Yes", "Partly", "Not yet", "Waits for hardware"];

#[test]
fn every_file_and_test_of_the_table_exists() {
    // Aim: evidence that was renamed or deleted is noticed. Method: what stands in backticks and has a slash is a path
    // below the root, or `file::test`, whose file has a test of this name.
    let mut wrong = Vec::new();
    let text = table();
    let quoted = Regex::new(r"`([^`\n]+)`").unwrap();
    let mut tests = 0;
    for found in quoted.captures_iter(&text).map(|c| c[1].to_string()).filter(|f| f.contains('/')) {
        let (path, test) = found.split_once("::").map_or((found.as_str(), None), |(path, test)| (path, Some(test)));
        match (fs::read_to_string(root().join(path)), test) {
            (Ok(file), Some(test)) => {
                tests += 1;
                let is_there = file.contains(&format!("#[test]\nfn {test}()"))
                    || file.contains(&format!("#[test]\n    fn {test}()"))
                    || file.contains(&format!("]\nfn {test}()"));
                if !is_there {
                    wrong.push(format!("{path} has no test {test}"));
                }
            }
            (Err(_), None) if root().join(path).exists() => {}
            (Err(why), _) => wrong.push(format!("{path}: {why}")),
            (Ok(_), None) => {}
        }
    }
    assert!(wrong.is_empty(), "docs/thesis.md:\n{}", wrong.join("\n"));
    assert!(tests > 50, "only {tests} tests are named");
}

#[test]
fn no_row_of_the_table_is_missing_and_the_counts_are_right() {
    let text = table();
    let rows: Vec<Vec<&str>> = text
        .lines()
        .map(|line| line.trim_matches('|').split('|').map(str::trim).collect::<Vec<_>>())
        .filter(|cells| cells[0].parse::<usize>().is_ok())
        .collect();
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for (index, row) in rows.iter().enumerate() {
        assert_eq!(row.len(), 5, "row {} has {} cells", index + 1, row.len());
        assert_eq!(row[0], (index + 1).to_string(), "rows are numbered one by one");
        let (state, rest) = row[4].split_once(':').unwrap_or((row[4], ""));
        let known = STATES.iter().find(|s| s.to_lowercase() == state);
        let known = known.unwrap_or_else(|| panic!("row {}: \"{state}\" is no state", index + 1));
        *counts.entry((*known).to_string()).or_default() += 1;
        match *known {
            "Yes" => assert!(row[2].contains('`') && !row[3].is_empty(), "row {} has no evidence", index + 1),
            _ => assert!(!rest.is_empty() || row[3].is_empty(), "row {} does not say what is missing", index + 1),
        }
    }
    assert_eq!(rows.len(), ROWS);
    let counted = STATES.map(|state| format!("{state}: {}.", counts.get(state).unwrap_or(&0))).join(" ");
    assert!(text.contains(&counted), "the counts are: {counted}");
}

fn table() -> String {
    fs::read_to_string(root().join("docs/thesis.md")).unwrap()
}
