//! The table of modules in `ARCHITECTURE.md` is true.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Each module with those it may use, from the table.
fn table() -> BTreeMap<String, Vec<String>> {
    let text = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let rows = text.lines().filter(|l| l.starts_with("| `"));
    rows.map(|row| {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let uses = cells[2].split(',').map(|m| m.trim().to_string()).filter(|m| !m.is_empty());
        (cells[0].trim_matches('`').to_string(), uses.collect())
    })
    .collect()
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => files.extend(sources(&path)),
            false if path.extension().is_some_and(|e| e == "rs") => files.push(path),
            false => {}
        }
    }
    files
}

fn module_of(path: &Path) -> String {
    let below = path.strip_prefix(root().join("src")).unwrap();
    below.components().next().unwrap().as_os_str().to_string_lossy().trim_end_matches(".rs").to_string()
}

/// Every `crate::module` in a text, with its line. Comments do not count; `use crate::{a, b}` does.
fn uses(text: &str) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let code = line.split("//").next().unwrap_or_default();
        for part in code.split("crate::").skip(1) {
            let names: Vec<&str> = match part.strip_prefix('{') {
                Some(list) => list.split(['}', ',']).collect(),
                None => vec![part],
            };
            for name in names {
                let name: String = name.trim().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                if !name.is_empty() {
                    found.push((number + 1, name));
                }
            }
        }
    }
    found
}

#[test]
fn no_module_uses_one_above_it() {
    // Aim: the table in ARCHITECTURE.md says who may use whom. Method: read it, and every `crate::` in the sources.
    let table = table();
    let mut wrong = Vec::new();
    for path in sources(&root().join("src")) {
        let module = module_of(&path);
        if matches!(module.as_str(), "lib" | "main") {
            continue;
        }
        let allowed = table.get(&module).unwrap_or_else(|| panic!("{module} is not in the table"));
        let text = fs::read_to_string(&path).unwrap();
        for (line, used) in uses(&text) {
            if used != module && !allowed.contains(&used) {
                wrong.push(format!("{}:{line}: {module} may not use {used}", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_table_lists_every_module_lowest_first() {
    let text = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let order: Vec<String> =
        text.lines().filter(|l| l.starts_with("| `")).map(|l| l.split('`').nth(1).unwrap().to_string()).collect();
    let lib = fs::read_to_string(root().join("src/lib.rs")).unwrap();
    let declared: Vec<&str> = lib.lines().filter_map(|l| l.strip_prefix("pub mod ")?.strip_suffix(';')).collect();
    assert_eq!(order, declared, "ARCHITECTURE.md and src/lib.rs name the same modules in the same order");
    for (module, uses) in table() {
        let place = |m: &str| order.iter().position(|o| o == m).unwrap_or_else(|| panic!("no module {m}"));
        for used in uses {
            assert!(place(&used) < place(&module), "{module} uses {used}, which stands above it");
        }
    }
}

#[test]
fn the_lower_rooms_keep_their_promises() {
    // Aim: what cannot be seen from imports of our own modules: no clock, no printing, no serde, no randomness where a
    // tick is turned.
    // Drivers speak JSON to services and look at a monotonic clock, and so does the servo: both keep a beat.
    let banned: [(&[&str], &[&str]); 6] = [
        (
            &["tick", "frame", "mesh", "mailbox", "statistics", "volume", "anatomy", "touch", "sim", "score"],
            &["serde", "println!", "eprintln!", "HashMap", "std::fs"],
        ),
        (
            &["tick", "frame", "mesh", "mailbox", "statistics", "volume", "anatomy", "touch", "sim", "score"],
            &["std::time", "Instant"],
        ),
        // The player waits for a server; what it plays follows from loads and a seed alone.
        (&["device", "sim", "audio"], &["SystemTime", "println!", "eprintln!", "HashMap"]),
        (
            &["scenario", "session", "record", "report", "handover", "content", "school", "lesson"],
            &["std::time", "SystemTime", "Instant", "println!", "HashMap"],
        ),
        // Requests and responses are plain values, and say what time it is.
        (&["review"], &["Instant", "SystemTime::now", "Timestamp::now", "println!", "HashMap"]),
        (
            &["statistics", "volume", "touch", "sim"],
            &[".sin()", ".cos()", ".exp()", ".ln()", ".powf(", ".acos()", ".tan()", "thread_rng"],
        ),
    ];
    let mut wrong = Vec::new();
    for path in sources(&root().join("src")) {
        let module = module_of(&path);
        let text = fs::read_to_string(&path).unwrap();
        let code = text.split("#[cfg(test)]").next().unwrap();
        for (modules, words) in &banned {
            let keeps_a_beat = ["sim/servo.rs", "sim/beats.rs", "sim/pace.rs"].iter().any(|file| path.ends_with(file));
            if keeps_a_beat && words.contains(&"Instant") && !words.contains(&"SystemTime") {
                continue;
            }
            if modules.contains(&module.as_str()) {
                for (number, line) in code.lines().enumerate().filter(|(_, l)| !l.trim_start().starts_with("//")) {
                    for word in words.iter().filter(|w| line.contains(**w)) {
                        wrong.push(format!("{}:{}: {module} has {word}", path.display(), number + 1));
                    }
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_network_is_used_only_where_the_text_says() {
    // Aim: whoever asks what this program says to a network, and who may speak to it, reads these files and no others. A socket
    // that waits for connections stands in one place.
    let speaks = [
        "device/haply/service.rs",
        "device/link.rs",
        "device/stream.rs",
        "cli/review.rs",
        "cli/review/server.rs",
        "cli/school/asking.rs",
        "cli/school/database.rs",
        "cli/school/http.rs",
        "cli/school/metrics.rs",
        "cli/school/store.rs",
        "cli/trusted.rs",
        "cli/xapi/lrs.rs",
    ];
    let listens = ["cli/review.rs", "cli/review/server.rs", "cli/school/metrics.rs"];
    let words = ["TcpStream", "UdpSocket", "TcpListener", "tokio::", "hyper::", "ureq::", "NoTls", "object_store::"];
    let mut wrong = Vec::new();
    for path in sources(&root().join("src")) {
        let text = fs::read_to_string(&path).unwrap();
        let code = text.split("#[cfg(test)]").next().unwrap();
        let is_in = |files: &[&str]| files.iter().any(|file| path.ends_with(file));
        for word in words.iter().filter(|word| code.contains(**word)) {
            let allowed = if *word == "TcpListener" { is_in(&listens) } else { is_in(&speaks) };
            if !allowed {
                wrong.push(format!("{}: {word}", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn unsafe_stands_only_where_c_is_called() {
    // Aim: whoever audits the program for memory safety reads these files and no others.
    let allowed = ["device/openhaptics.rs", "device/forcedimension.rs"];
    for path in sources(&root().join("src")) {
        let text = fs::read_to_string(&path).unwrap();
        let is_allowed = allowed.iter().any(|file| path.ends_with(file));
        let has = text.contains("unsafe {") || text.contains("allow(unsafe_code)") || text.contains("unsafe fn");
        assert!(is_allowed || !has, "{}: unsafe code belongs into {allowed:?}", path.display());
    }
}
