//! Exercises on a web server: a folder with the list of its digests.

use super::exercise_copy::{DIGEST_FILE, Digests, ExerciseFiles, FILES_MAX, is_inside};
use std::time::Duration;
use typodont_formats::diagnostic::SourceText;
use ureq::Agent;

/// Time limit of one request with its response: enough for a scan of a tooth over a slow line.
const TIMEOUT: Duration = Duration::from_secs(60);

/// Time limit of a connection: a station without the network opens its window soon.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);

/// Maximum size of a file, bytes: more than a fine label map has.
const FILE_BYTES_MAX: u64 = 256 << 20;

/// A folder on a web server.
pub struct ExerciseServer {
    agent: Agent,
    address: String,
}

impl ExerciseServer {
    /// `address` has no slash at its end.
    pub fn at(address: &str) -> ExerciseServer {
        let config = Agent::config_builder()
            .timeout_global(Some(TIMEOUT))
            .timeout_connect(Some(CONNECT_TIMEOUT))
            // A redirection must not lead to a connection that others can change.
            .https_only(address.starts_with("https://"))
            .user_agent(concat!("typodont/", env!("CARGO_PKG_VERSION")));
        ExerciseServer { agent: config.build().into(), address: address.to_string() }
    }

    fn get(&self, path: &str) -> Result<Vec<u8>, String> {
        let address = format!("{}/{}", self.address, escaped(path));
        let failed = |error: ureq::Error| format!("{address}: unreachable: {error}");
        let mut response = self.agent.get(&address).call().map_err(failed)?;
        response.body_mut().with_config().limit(FILE_BYTES_MAX).read_to_vec().map_err(failed)
    }
}

/// A path in an address: every byte but letters, digits and `-_./` as `%` and its hexadecimal number.
fn escaped(path: &str) -> String {
    let escape = |byte: u8| match byte {
        b'-' | b'_' | b'.' | b'/' => char::from(byte).to_string(),
        _ if byte.is_ascii_alphanumeric() => char::from(byte).to_string(),
        _ => format!("%{byte:02X}"),
    };
    path.bytes().map(escape).collect()
}

impl ExerciseFiles for ExerciseServer {
    fn digests(&self) -> Result<Digests, String> {
        let text = String::from_utf8_lossy(&self.get(DIGEST_FILE)?).into_owned();
        parse_digests(&SourceText::new(format!("{}/{DIGEST_FILE}", self.address), text))
    }

    fn bytes(&self, path: &str) -> Result<Vec<u8>, String> {
        self.get(path)
    }
}

/// Reads the lines of [`DIGEST_FILE`].
///
/// # Errors
/// The first line that is not a digest and a path inside the folder.
fn parse_digests(source: &SourceText) -> Result<Digests, String> {
    let mut digests = Digests::new();
    for (number, line) in source.text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
        let parsed = line.split_once("  ").or_else(|| line.split_once(" *"));
        let Some((digest, path)) = parsed.filter(|(digest, path)| is_digest(digest) && is_inside(path)) else {
            return Err(format!(
                "{}:{}: wrong-line: expected a SHA-256 digest, two spaces and a path inside the folder, as `sha256sum * > \
                 {DIGEST_FILE}` writes them",
                source.name,
                number + 1
            ));
        };
        digests.insert(path.strip_prefix("./").unwrap_or(path).to_string(), digest.to_lowercase());
    }
    match digests.len() {
        0 => Err(format!("{}: no-files: the list of digests is empty", source.name)),
        1..=FILES_MAX => Ok(digests),
        count => Err(format!("{}: too-many: {count} files; a course may have {FILES_MAX}", source.name)),
    }
}

fn is_digest(text: &str) -> bool {
    text.len() == 64 && text.bytes().all(|letter| letter.is_ascii_hexdigit())
}

#[cfg(test)]
mod tests {
    use super::super::exercise_copy::digest_of;
    use super::*;

    #[test]
    fn a_list_of_digests_names_only_files_inside_its_folder() {
        let digest = digest_of(b"");
        let check = |line: &str, is_valid: bool| {
            let source = SourceText::new("SHA256SUMS", format!("{digest}  first.json\n{line}\n"));
            assert_eq!(parse_digests(&source).is_ok(), is_valid, "{line}");
        };
        check(&format!("{digest}  sub/1.json"), true);
        check(&format!("{digest} *1.json"), true);
        check(&format!("{digest}  ./1.json"), true);
        check("", true);
        for path in ["../1.json", "/etc/passwd", "a/../../b", r"..\b", "C:b", "a//b", ".hidden", "a%2e", ""] {
            check(&format!("{digest}  {path}"), false);
        }
        check("<html>", false);
    }
}
