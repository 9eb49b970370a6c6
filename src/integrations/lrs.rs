//! Client of a learning record store, by xAPI 1.0.3 (Part Three) or 2.0.0 (IEEE 9274.1.1).

use crate::is_this_machine;
use crate::tls_roots;
use base64::Engine;
use serde_json::Value as Json;
use std::time::Duration;
use ureq::Agent;

/// Time limit of one request with its response: enough for a slow store over a slow line.
const TIMEOUT: Duration = Duration::from_secs(30);

/// Maximum length of a store's error text that is printed, characters.
const WORDS_MAX: usize = 400;

pub struct Lrs {
    agent: Agent,
    statements: String,
    authorization: String,
    version: String,
}

/// Response of a store to statements.
#[derive(Debug, PartialEq)]
pub enum LrsResponse {
    /// The store has the statements now, or had identical ones before.
    Accepted,
    /// The store has a statement with the same id but other content.
    Conflict,
    /// The store permanently rejects the statements.
    Rejected(String),
    /// The store denies access.
    Unauthorized(String),
    /// The store is unavailable at present; the request may be repeated.
    RetryLater(String),
}

impl Lrs {
    /// Creates a client. `endpoint` is the address to which `statements` is appended; `version` is the version of xAPI,
    /// and the statements sent are valid in both versions. `roots` are certificates in PEM that replace the public
    /// authorities.
    ///
    /// # Errors
    /// A message if `endpoint` is not a valid address, or would transmit the secret without encryption.
    pub fn at(endpoint: &str, key: &str, secret: &str, roots: Option<&[u8]>, version: &str) -> Result<Lrs, String> {
        let url = url::Url::parse(endpoint).map_err(|e| format!("\"{endpoint}\" is not an address: {e}"))?;
        if !url.username().is_empty() || url.password().is_some() || url.query().is_some() || url.fragment().is_some() {
            return Err("the address must not contain a user name, secret, query or fragment; use --key and \
            --secret-file"
                .into());
        }
        let is_local = url.host_str().is_some_and(is_this_machine);
        match url.scheme() {
            "https" => {}
            "http" if is_local => {}
            "http" => return Err("http would transmit the secret without encryption; use https".into()),
            other => return Err(format!("the address must begin with https, not with {other}")),
        }
        let config = Agent::config_builder()
            .http_status_as_error(false)
            .timeout_global(Some(TIMEOUT))
            .max_redirects(0)
            // Over http a proxy could read the secret, and would take `localhost` for itself.
            .proxy(if url.scheme() == "http" { None } else { ureq::Proxy::try_from_env() })
            .tls_config(tls_roots::tls_config(roots)?)
            .user_agent(concat!("typodont/", env!("CARGO_PKG_VERSION")))
            .build();
        let login = base64::engine::general_purpose::STANDARD.encode(format!("{key}:{secret}"));
        Ok(Lrs {
            agent: config.into(),
            statements: format!("{}/statements", endpoint.trim_end_matches('/')),
            authorization: format!("Basic {login}"),
            version: version.into(),
        })
    }

    /// Sends statements; the store accepts all or none of them.
    pub fn post(&self, statements: &[Json]) -> LrsResponse {
        let body = serde_json::to_string(statements).unwrap_or_default();
        let request = self
            .agent
            .post(&self.statements)
            .header("X-Experience-API-Version", &self.version)
            .header("Authorization", &self.authorization)
            .header("Content-Type", "application/json");
        classify_response(request.send(body))
    }

    /// Asks for a statement by its id: [`LrsResponse::Accepted`] if the store has it, [`LrsResponse::Rejected`] if not.
    pub fn has(&self, id: &str) -> LrsResponse {
        let request = self
            .agent
            .get(&self.statements)
            .query("statementId", id)
            .header("X-Experience-API-Version", &self.version)
            .header("Authorization", &self.authorization);
        match request.call() {
            Ok(response) if response.status() == 404 => LrsResponse::Rejected(format!(
                "the store reports a conflict for statement {id} but does not contain it"
            )),
            response => classify_response(response),
        }
    }
}

fn classify_response(response: Result<ureq::http::Response<ureq::Body>, ureq::Error>) -> LrsResponse {
    let mut response = match response {
        Ok(response) => response,
        Err(error) => return LrsResponse::RetryLater(error.to_string()),
    };
    let status = response.status().as_u16();
    let words = response.body_mut().read_to_string();
    match (status, words) {
        // A store that closes the connection during its response may not have saved the statements.
        (200 | 204, Ok(_)) => LrsResponse::Accepted,
        (200 | 204, Err(error)) => LrsResponse::RetryLater(error.to_string()),
        (status, words) => {
            let words = typodont_report::sanitize_display(&words.unwrap_or_default(), WORDS_MAX);
            let said = format!("the store answers {status}: {words}");
            match status {
                409 => LrsResponse::Conflict,
                401 | 403 => LrsResponse::Unauthorized(said),
                408 | 425 | 429 | 500.. => LrsResponse::RetryLater(said),
                // With these codes the statements are at fault; with any other, the address or the access is.
                400 | 413 | 422 => LrsResponse::Rejected(said),
                _ => LrsResponse::Unauthorized(said),
            }
        }
    }
}
