//! The rule by which a server counts as being on this machine, where a connection may go without encryption.

use std::net::IpAddr;

/// True if a host name or an address means this machine: `localhost`, or a loopback address, with or without the brackets
/// of IPv6.
pub fn is_this_machine(host: &str) -> bool {
    let address = host.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')).unwrap_or(host);
    host.eq_ignore_ascii_case("localhost") || address.parse::<IpAddr>().is_ok_and(|ip| ip.to_canonical().is_loopback())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_loopback_is_this_machine() {
        for host in ["localhost", "LOCALHOST", "127.0.0.1", "127.8.9.1", "::1", "[::1]", "::ffff:127.0.0.1"] {
            assert!(is_this_machine(host), "{host}");
        }
        // A name that begins like an address belongs to whoever registered it.
        for host in [
            "",
            "localhost.example.edu",
            "127.0.0.1.example.edu",
            "192.168.0.1",
            "0.0.0.0",
            "::",
            "[::1",
            "[localhost]",
        ] {
            assert!(!is_this_machine(host), "{host}");
        }
    }
}
