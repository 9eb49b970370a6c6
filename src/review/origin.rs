//! Whether a question comes from our own pages.
//!
//! A page of another site can make a browser ask us anything. It cannot choose `Host` and `Origin`: the first would name the
//! other site even where its name was made to lead here (DNS rebinding), the second names it whenever a form is sent.

use super::exchange::Request;
use std::net::{IpAddr, SocketAddr};

/// Names by which this machine is reached beside its addresses, without a port.
#[derive(Clone, Debug, Default)]
pub struct Names(pub Vec<String>);

/// Why a question is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Foreign {
    Host,
    Origin,
}

impl Foreign {
    pub fn why(self) -> &'static str {
        match self {
            Foreign::Host => "foreign-host: this address is not known under that name; name it by --name",
            Foreign::Origin => "foreign-origin: what another site asks is not answered",
        }
    }
}

impl Names {
    /// `Err` for a question under another name than ours, from another site, or a form whose origin is not told.
    pub fn check(&self, request: &Request) -> Result<(), Foreign> {
        let host = request.header("host").filter(|host| self.is_ours(host, request.at)).ok_or(Foreign::Host)?;
        let told = request.headers.iter().any(|(name, _)| name == "origin");
        match request.header("origin") {
            Some(origin) if is_origin_of(origin, host) => Ok(()),
            None if !told && request.method != "POST" => Ok(()),
            _ => Err(Foreign::Origin),
        }
    }

    fn is_ours(&self, host: &str, at: SocketAddr) -> bool {
        let (name, port) = split(host);
        // A name of our own may be a proxy's, at a port of its own.
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

/// Name and port of an authority; an IPv6 address keeps its brackets.
fn split(host: &str) -> (&str, Option<&str>) {
    match host.rsplit_once(':') {
        Some((name, port)) if !port.contains(']') => (name, Some(port)),
        _ => (host, None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(method: &str, at: &str, headers: &[(&str, &str)]) -> Result<(), Foreign> {
        let request = Request {
            method: method.into(),
            path: "/".into(),
            query: String::new(),
            headers: headers.iter().map(|(n, v)| (n.to_string(), v.to_string())).collect(),
            body: Vec::new(),
            peer: [127, 0, 0, 1].into(),
            at: at.parse().unwrap(),
            now: jiff::Timestamp::UNIX_EPOCH,
        };
        Names(vec!["marks.school.example".into()]).check(&request)
    }

    #[test]
    fn another_name_than_ours_is_refused() {
        let here = "127.0.0.1:4000";
        for host in
            ["127.0.0.1:4000", "localhost:4000", "LocalHost:4000", "marks.school.example", "marks.school.example:8443"]
        {
            assert_eq!(asked("GET", here, &[("host", host)]), Ok(()), "{host}");
        }
        for host in
            ["evil.example:4000", "127.0.0.1:4001", "127.0.0.1", "127.0.0.1.evil.example:4000", "[::1]:4000", ""]
        {
            assert_eq!(asked("GET", here, &[("host", host)]), Err(Foreign::Host), "{host}");
        }
        assert_eq!(asked("GET", here, &[]), Err(Foreign::Host));
        assert_eq!(asked("GET", here, &[("host", here), ("host", here)]), Err(Foreign::Host), "told twice");
        assert_eq!(asked("GET", "[::1]:80", &[("host", "[::1]")]), Ok(()));
        assert_eq!(asked("GET", "192.0.2.7:80", &[("host", "localhost")]), Err(Foreign::Host));
    }

    #[test]
    fn a_form_of_another_site_is_refused() {
        let here = "127.0.0.1:4000";
        let from = |method: &str, origin: &str| asked(method, here, &[("host", here), ("origin", origin)]);
        assert_eq!(from("POST", "http://127.0.0.1:4000"), Ok(()));
        for origin in
            ["http://evil.example", "http://127.0.0.1:4001", "http://localhost:4000", "null", "127.0.0.1:4000", ""]
        {
            assert_eq!(from("POST", origin), Err(Foreign::Origin), "{origin}");
            assert_eq!(from("GET", origin), Err(Foreign::Origin), "{origin}");
        }
        assert_eq!(asked("POST", here, &[("host", here)]), Err(Foreign::Origin), "a form tells where it stood");
    }
}
