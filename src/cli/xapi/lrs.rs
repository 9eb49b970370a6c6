//! A learning record store, spoken to by xAPI 1.0.3 (Part Three) or 2.0.0 (IEEE 9274.1.1): one request, one answer.

use crate::cli::trusted;
use base64::Engine;
use serde_json::Value as Json;
use std::time::Duration;
use ureq::Agent;

/// For one request with its answer: a slow store over a bad line. Longer is as good as gone.
const TIMEOUT: Duration = Duration::from_secs(30);

/// Letters of a store's own words that are told.
const WORDS_MAX: usize = 400;

pub struct Lrs {
    agent: Agent,
    statements: String,
    authorization: String,
    version: String,
}

/// What a store makes of statements.
#[derive(Debug, PartialEq)]
pub enum Answer {
    /// It has them now, or had the very same before.
    Taken,
    /// It has one of them already, with other content.
    Conflict,
    /// It will never take them.
    Refused(String),
    /// It does not let us in.
    LockedOut(String),
    /// It cannot be reached, or not now.
    Later(String),
}

impl Lrs {
    /// `endpoint` is the address that `statements` is appended to. `version` is of xAPI; what we send is right in both.
    /// `roots` are certificates in PEM to trust in place of the usual.
    ///
    /// `Err` for an address that would send the secret in the clear, or is none.
    pub fn at(endpoint: &str, key: &str, secret: &str, roots: Option<&[u8]>, version: &str) -> Result<Lrs, String> {
        let url = url::Url::parse(endpoint).map_err(|e| format!("\"{endpoint}\" is no address: {e}"))?;
        if !url.username().is_empty() || url.password().is_some() || url.query().is_some() || url.fragment().is_some() {
            return Err("give it without a name, secret, query or fragment; the key and its secret have options".into());
        }
        let near = match url.host() {
            Some(url::Host::Domain(name)) => name == "localhost",
            Some(url::Host::Ipv4(ip)) => ip.is_loopback(),
            Some(url::Host::Ipv6(ip)) => ip.is_loopback(),
            None => false,
        };
        match url.scheme() {
            "https" => {}
            "http" if near => {}
            "http" => return Err("over http the secret could be read on the way; use https".into()),
            other => return Err(format!("a store is reached by https, not by {other}")),
        }
        let config = Agent::config_builder()
            .http_status_as_error(false)
            .timeout_global(Some(TIMEOUT))
            .max_redirects(0)
            // Over http a proxy would read the secret, and `localhost` would be another machine's.
            .proxy(if url.scheme() == "http" { None } else { ureq::Proxy::try_from_env() })
            .tls_config(trusted::tls(roots)?)
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

    /// Sends statements, all or none.
    pub fn post(&self, statements: &[Json]) -> Answer {
        let body = serde_json::to_string(statements).unwrap_or_default();
        let request = self
            .agent
            .post(&self.statements)
            .header("X-Experience-API-Version", &self.version)
            .header("Authorization", &self.authorization)
            .header("Content-Type", "application/json");
        answer(request.send(body))
    }

    /// Whether it has a statement of this id: taken if so, refused if not.
    pub fn has(&self, id: &str) -> Answer {
        let request = self
            .agent
            .get(&self.statements)
            .query("statementId", id)
            .header("X-Experience-API-Version", &self.version)
            .header("Authorization", &self.authorization);
        match request.call() {
            Ok(response) if response.status() == 404 => {
                Answer::Refused(format!("statement {id} is in conflict, and not there"))
            }
            response => answer(response),
        }
    }
}

fn answer(response: Result<ureq::http::Response<ureq::Body>, ureq::Error>) -> Answer {
    let mut response = match response {
        Ok(response) => response,
        Err(error) => return Answer::Later(error.to_string()),
    };
    let status = response.status().as_u16();
    let words = response.body_mut().read_to_string();
    match (status, words) {
        // Whoever hangs up while answering may not have written it down.
        (200 | 204, Ok(_)) => Answer::Taken,
        (200 | 204, Err(error)) => Answer::Later(error.to_string()),
        (status, words) => {
            let words = crate::report::harmless(&words.unwrap_or_default(), WORDS_MAX);
            let said = format!("the store answers {status}: {words}");
            match status {
                409 => Answer::Conflict,
                401 | 403 => Answer::LockedOut(said),
                408 | 425 | 429 | 500.. => Answer::Later(said),
                // What was sent is at fault; anything else is at the wrong address, and would be for every file.
                400 | 413 | 422 => Answer::Refused(said),
                _ => Answer::LockedOut(said),
            }
        }
    }
}
