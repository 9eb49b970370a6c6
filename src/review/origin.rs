//! Validation of a request's `Host` and `Origin` headers.
//!
//! A page of another site can make a browser send any request to this server, but cannot choose these headers: `Host`
//! names the other site even if its name was made to resolve to this machine (DNS rebinding), and `Origin` names it
//! whenever a form is submitted.

use super::http::Request;
use std::fmt;
use std::net::{IpAddr, SocketAddr};

/// Host names under which this machine is reached, in addition to its IP addresses; without ports.
#[derive(Clone, Debug, Default)]
pub struct AllowedHosts(pub Vec<String>);

/// Header for which a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OriginError {
    Host,
    Origin,
}

impl OriginError {
    pub fn message(self) -> &'static str {
        match self {
            OriginError::Host => "foreign-host: this host name is not allowed; add it with --name",
            OriginError::Origin => "foreign-origin: requests from other sites are refused",
        }
    }
}

impl fmt::Display for OriginError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.message())
    }
}

impl std::error::Error for OriginError {}

impl AllowedHosts {
    /// Checks a request.
    ///
    /// # Errors
    ///
    /// Returns an error when the host is not allowed, the origin is another site, or a POST request has no origin.
    pub fn check(&self, request: &Request) -> Result<(), OriginError> {
        let host = request
            .header("host")
            .filter(|host| self.is_allowed_host(host, request.local_addr))
            .ok_or(OriginError::Host)?;
        let has_origin = request.headers.iter().any(|(name, _)| name == "origin");
        match request.header("origin") {
            Some(origin) if is_origin_of(origin, host) => Ok(()),
            None if !has_origin && request.method != "POST" => Ok(()),
            _ => Err(OriginError::Origin),
        }
    }

    fn is_allowed_host(&self, host: &str, at: SocketAddr) -> bool {
        let (name, port) = split_host_and_port(host);
        // A configured name may be that of a proxy, which listens on a port of its own.
        if self.0.iter().any(|own| own.eq_ignore_ascii_case(name)) {
            return true;
        }
        let at = SocketAddr::new(at.ip().to_canonical(), at.port());
        let is_address = name.trim_matches(['[', ']']).parse::<IpAddr>().is_ok_and(|ip| ip == at.ip());
        let is_local = at.ip().is_loopback() && name.eq_ignore_ascii_case("localhost");
        (is_address || is_local) && port.unwrap_or("80") == at.port().to_string()
    }
}

fn is_origin_of(origin: &str, host: &str) -> bool {
    let after = origin.strip_prefix("http://").or_else(|| origin.strip_prefix("https://"));
    after.is_some_and(|authority| authority.eq_ignore_ascii_case(host))
}

/// Splits an authority into host and port. An IPv6 address keeps its brackets.
fn split_host_and_port(host: &str) -> (&str, Option<&str>) {
    match host.rsplit_once(':') {
        Some((name, port)) if !port.contains(']') => (name, Some(port)),
        _ => (host, None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(method: &str, at: &str, headers: &[(&str, &str)]) -> Result<(), OriginError> {
        let request = Request {
            method: method.into(),
            path: "/".into(),
            query: String::new(),
            headers: headers.iter().map(|(n, v)| (n.to_string(), v.to_string())).collect(),
            body: Vec::new(),
            peer: [127, 0, 0, 1].into(),
            local_addr: at.parse().unwrap(),
            now: jiff::Timestamp::UNIX_EPOCH,
        };
        AllowedHosts(vec!["marks.school.example".into()]).check(&request)
    }

    #[test]
    fn an_unknown_host_name_is_refused() {
        let here = "127.0.0.1:4000";
        for host in
            ["127.0.0.1:4000", "localhost:4000", "LocalHost:4000", "marks.school.example", "marks.school.example:8443"]
        {
            assert_eq!(check("GET", here, &[("host", host)]), Ok(()), "{host}");
        }
        for host in
            ["evil.example:4000", "127.0.0.1:4001", "127.0.0.1", "127.0.0.1.evil.example:4000", "[::1]:4000", ""]
        {
            assert_eq!(check("GET", here, &[("host", host)]), Err(OriginError::Host), "{host}");
        }
        assert_eq!(check("GET", here, &[]), Err(OriginError::Host));
        assert_eq!(check("GET", here, &[("host", here), ("host", here)]), Err(OriginError::Host), "repeated header");
        assert_eq!(check("GET", "[::1]:80", &[("host", "[::1]")]), Ok(()));
        assert_eq!(check("GET", "192.0.2.7:80", &[("host", "localhost")]), Err(OriginError::Host));
    }

    #[test]
    fn a_form_from_another_site_is_refused() {
        let here = "127.0.0.1:4000";
        let from = |method: &str, origin: &str| check(method, here, &[("host", here), ("origin", origin)]);
        assert_eq!(from("POST", "http://127.0.0.1:4000"), Ok(()));
        for origin in
            ["http://evil.example", "http://127.0.0.1:4001", "http://localhost:4000", "null", "127.0.0.1:4000", ""]
        {
            assert_eq!(from("POST", origin), Err(OriginError::Origin), "{origin}");
            assert_eq!(from("GET", origin), Err(OriginError::Origin), "{origin}");
        }
        assert_eq!(check("POST", here, &[("host", here)]), Err(OriginError::Origin), "a form must have an origin");
    }
}
