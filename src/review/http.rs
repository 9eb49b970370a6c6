//! HTTP requests and responses as plain values, independent of the server.

use jiff::Timestamp;
use std::net::{IpAddr, SocketAddr};

/// Maximum size of a request body, bytes: enough for a percent-encoded reason of several thousand characters.
pub const BODY_MAX: usize = 64 << 10;

/// HTTP request.
#[derive(Clone, Debug)]
pub struct Request {
    pub method: String,
    /// Path as sent, without percent-decoding.
    pub path: String,
    pub query: String,
    /// Headers with lower-case names. Repeated headers are listed repeatedly.
    pub headers: Vec<(String, String)>,
    pub body: Vec<u8>,
    /// Address of the client.
    pub peer: IpAddr,
    /// Address at which the request was received.
    pub local_addr: SocketAddr,
    pub now: Timestamp,
}

impl Request {
    /// Returns a header's value, or `None` if the header is missing or repeated.
    pub fn header(&self, name: &str) -> Option<&str> {
        let mut all = self.headers.iter().filter(|(own, _)| own == name);
        match (all.next(), all.next()) {
            (Some((_, value)), None) => Some(value),
            _ => None,
        }
    }

    /// Returns a cookie's value.
    pub fn cookie(&self, name: &str) -> Option<&str> {
        let all = self.headers.iter().filter(|(own, _)| own == "cookie").flat_map(|(_, value)| value.split(';'));
        all.filter_map(|one| one.trim().split_once('=')).find(|(own, _)| *own == name).map(|(_, value)| value)
    }

    /// Returns the decoded name-value pairs of the query, in order.
    pub fn query_pairs(&self) -> Vec<(String, String)> {
        decode_pairs(self.query.as_bytes())
    }

    /// Returns the decoded name-value pairs of a form in the body, in order.
    pub fn form_pairs(&self) -> Vec<(String, String)> {
        decode_pairs(&self.body)
    }
}

fn decode_pairs(encoded: &[u8]) -> Vec<(String, String)> {
    url::form_urlencoded::parse(encoded).into_owned().collect()
}

/// Returns the first value of a name, or an empty string if there is none.
pub fn first_value<'a>(pairs: &'a [(String, String)], name: &str) -> &'a str {
    pairs.iter().find(|(own, _)| own == name).map_or("", |(_, value)| value)
}

/// HTTP response.
#[derive(Clone, Debug)]
pub struct Response {
    pub status: u16,
    pub headers: Vec<(&'static str, String)>,
    pub body: Vec<u8>,
    /// Lines for the program's log.
    pub log_lines: Vec<String>,
    /// New login token, to be printed at the terminal and never logged.
    pub new_login_token: Option<String>,
}

/// Headers of every response: no caching, no content sniffing, no framing, no access by other sites.
const SECURITY_HEADERS: [(&str, &str); 5] = [
    ("x-content-type-options", "nosniff"),
    ("x-frame-options", "DENY"),
    // With "no-referrer", browsers would send forms with the origin "null".
    ("referrer-policy", "same-origin"),
    ("cache-control", "no-store"),
    ("cross-origin-resource-policy", "same-origin"),
];

impl Response {
    /// Creates a response. `kind` is the content type and `policy` the content security policy.
    pub fn new(status: u16, kind: &str, policy: &str, body: impl Into<Vec<u8>>) -> Response {
        let mut headers: Vec<(&str, String)> = SECURITY_HEADERS.map(|(name, value)| (name, value.to_string())).to_vec();
        headers.push(("content-type", kind.to_string()));
        headers.push(("content-security-policy", policy.to_string()));
        Response { status, headers, body: body.into(), log_lines: Vec::new(), new_login_token: None }
    }

    /// Creates a plain-text error response, for clients that are not shown a page.
    pub fn plain_error(status: u16, why: &str) -> Response {
        Response::new(status, "text/plain; charset=utf-8", CSP_NONE, format!("{why}\n"))
    }

    /// Creates a redirect that the browser follows with a GET request (303 See Other).
    pub fn redirect(place: &str) -> Response {
        Response::new(303, "text/plain; charset=utf-8", CSP_NONE, "").with_header("location", place)
    }

    /// Adds a header.
    pub fn with_header(mut self, name: &'static str, value: impl Into<String>) -> Response {
        self.headers.push((name, value.into()));
        self
    }

    /// Adds a line for the program's log.
    pub fn with_log(mut self, line: impl Into<String>) -> Response {
        self.log_lines.push(line.into());
        self
    }
}

/// Content security policy under which nothing runs, loads or is submitted.
pub const CSP_NONE: &str = "default-src 'none'; frame-ancestors 'none'; sandbox";
