//! The workspace's source files, read as text.

use regex_lite::Regex;
use std::fs;
use std::path::{Path, PathBuf};

pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A source file of a crate.
pub struct SourceFile {
    /// Crate folder below `src`; `cli` is the program itself.
    pub krate: String,
    /// Path below `src`, with `/`.
    pub path: String,
    /// Module path inside the crate; empty for its root.
    pub module: Vec<String>,
    pub text: String,
}

impl SourceFile {
    /// The text before the unit tests.
    pub fn without_tests(&self) -> &str {
        self.text.split("#[cfg(test)]\nmod ").next().unwrap_or_default()
    }

    /// The text before the unit tests, without comments and the contents of strings.
    pub fn code(&self) -> String {
        let comments = Regex::new(r"//[^\n]*").unwrap();
        let strings = Regex::new(r#""(?:\\.|[^"\\])*""#).unwrap();
        let text = comments.replace_all(self.without_tests(), "");
        strings.replace_all(&text, "\"\"").into_owned()
    }
}

/// Every source file of every crate, and of the program.
pub fn sources() -> Vec<SourceFile> {
    let src = root().join("src");
    let mut paths = Vec::new();
    collect(&src, &mut paths);
    paths.sort();
    let mut files = Vec::new();
    for path in paths {
        let below = path.strip_prefix(&src).unwrap();
        let mut parts: Vec<String> = below.iter().map(|part| part.to_string_lossy().into_owned()).collect();
        let shown = parts.join("/");
        if parts.len() < 2 || parts.contains(&"examples".to_string()) {
            continue;
        }
        let krate = parts.remove(0);
        let last = parts.pop().unwrap();
        let stem = last.trim_end_matches(".rs");
        if !matches!(stem, "lib" | "mod") {
            parts.push(stem.to_string());
        }
        files.push(SourceFile { krate, path: shown, module: parts, text: fs::read_to_string(&path).unwrap() });
    }
    assert!(files.len() > 300, "only {} source files were found below {}", files.len(), src.display());
    files
}

fn collect(folder: &Path, paths: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            collect(&path, paths);
        } else if path.extension().is_some_and(|e| e == "rs") {
            paths.push(path);
        }
    }
}
