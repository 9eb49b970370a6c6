//! Exercises on a web server: a folder with the list of its digests.

use super::exercise_copy::{DIGEST_FILE, Digests, ExerciseFiles, parse_digests};
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
