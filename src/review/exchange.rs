//! Requests and responses as plain values, whatever server carries them.

use jiff::Timestamp;
use std::net::{IpAddr, SocketAddr};

/// Bytes of a request's body that are read: a reason of some thousand letters, percent-encoded, and no more.
pub const BODY_MAX: usize = 64 << 10;

/// What a browser asks.
#[derive(Clone, Debug)]
pub struct Request {
    pub method: String,
    /// As sent: nothing in it is decoded.
    pub path: String,
    pub query: String,
    /// Headers by lower-case name. One that came twice stands twice.
    pub headers: Vec<(String, String)>,
    pub body: Vec<u8>,
    /// Who asks, and the address at which the question came in.
    pub peer: IpAddr,
    pub at: SocketAddr,
    pub now: Timestamp,
}

impl Request {
    /// A header's value; none where it is missing or stands twice.
    pub fn header(&self, name: &str) -> Option<&str> {
        let mut all = self.headers.iter().filter(|(own, _)| own == name);
        match (all.next(), all.next()) {
            (Some((_, value)), None) => Some(value),
            _ => None,
        }
    }

    /// A cookie's value.
    pub fn cookie(&self, name: &str) -> Option<&str> {
        let all = self.headers.iter().filter(|(own, _)| own == "cookie").flat_map(|(_, value)| value.split(';'));
        all.filter_map(|one| one.trim().split_once('=')).find(|(own, _)| *own == name).map(|(_, value)| value)
    }

    /// Values of the query, or of a form, decoded and in their order.
    pub fn asked(&self) -> Vec<(String, String)> {
        pairs(self.query.as_bytes())
    }

    pub fn form(&self) -> Vec<(String, String)> {
        pairs(&self.body)
    }
}

fn pairs(encoded: &[u8]) -> Vec<(String, String)> {
    url::form_urlencoded::parse(encoded).into_owned().collect()
}

/// The first value of a name; empty where there is none.
pub fn value<'a>(pairs: &'a [(String, String)], name: &str) -> &'a str {
    pairs.iter().find(|(own, _)| own == name).map_or("", |(_, value)| value)
}

/// What a browser is answered.
#[derive(Clone, Debug)]
pub struct Response {
    pub status: u16,
    pub headers: Vec<(&'static str, String)>,
    pub body: Vec<u8>,
    /// Lines for whoever runs the program.
    pub told: Vec<String>,
    /// What opens the door next, for whoever sits at the terminal; it is no line of a log.
    pub opens: Option<String>,
}

/// What every response says: nothing is kept, guessed, framed or shown to another site.
const ALWAYS: [(&str, &str); 5] = [
    ("x-content-type-options", "nosniff"),
    ("x-frame-options", "DENY"),
    // "no-referrer" would make browsers send forms with the origin "null".
    ("referrer-policy", "same-origin"),
    ("cache-control", "no-store"),
    ("cross-origin-resource-policy", "same-origin"),
];

impl Response {
    /// `policy` is what the browser lets it do.
    pub fn new(status: u16, kind: &str, policy: &str, body: impl Into<Vec<u8>>) -> Response {
        let mut headers: Vec<(&str, String)> = ALWAYS.map(|(name, value)| (name, value.to_string())).to_vec();
        headers.push(("content-type", kind.to_string()));
        headers.push(("content-security-policy", policy.to_string()));
        Response { status, headers, body: body.into(), told: Vec::new(), opens: None }
    }

    /// A plain sentence, for whoever is not to be shown a page.
    pub fn refusal(status: u16, why: &str) -> Response {
        Response::new(status, "text/plain; charset=utf-8", NOTHING, format!("{why}\n"))
    }

    /// To another page, by a question of its own.
    pub fn see(place: &str) -> Response {
        Response::new(303, "text/plain; charset=utf-8", NOTHING, "").with("location", place)
    }

    pub fn with(mut self, name: &'static str, value: impl Into<String>) -> Response {
        self.headers.push((name, value.into()));
        self
    }

    pub fn telling(mut self, line: impl Into<String>) -> Response {
        self.told.push(line.into());
        self
    }
}

/// A policy under which nothing runs, loads or is sent.
pub const NOTHING: &str = "default-src 'none'; frame-ancestors 'none'; sandbox";
