//! Where the database is, and what may be said on the way there.

use postgres::Config;
use postgres::config::{Host, SslMode};
use std::path::Path;

/// Reads an address: `postgres://user@host/name`, or `host=… user=… dbname=…`. It says who and where, never the secret.
///
/// `Err` for one that holds a password, or names no server.
pub fn read_address(text: &str) -> Result<Config, String> {
    let mut config: Config = text.parse().map_err(|_| {
        "no address of a database; write postgres://user@host/name, or host=/run/postgresql user=… dbname=…".to_string()
    })?;
    if config.get_password().is_some() {
        return Err("it holds a password, which every user of this machine can read; put it into a file".into());
    }
    if config.get_hosts().is_empty() && config.get_hostaddrs().is_empty() {
        return Err("it names no server; write postgres://user@host/name, or host=/run/postgresql …".into());
    }
    if !is_near(&config) {
        // Encrypted, or not at all: what the address asks for can only be more.
        config.ssl_mode(SslMode::Require);
    }
    Ok(config)
}

/// Whether every server of an address is on this machine: a Unix socket or a loopback address.
pub fn is_near(config: &Config) -> bool {
    let host = |host: &Host| match host {
        Host::Tcp(name) => name == "localhost" || name.parse::<std::net::IpAddr>().is_ok_and(|ip| ip.is_loopback()),
        #[cfg(unix)]
        Host::Unix(path) => path != Path::new(""),
    };
    let addresses = config.get_hostaddrs();
    match addresses.is_empty() {
        true => config.get_hosts().iter().all(host),
        // A name beside a number is only what the certificate says.
        false => addresses.iter().all(|ip| ip.is_loopback()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_server_elsewhere_is_spoken_to_under_tls_or_not_at_all() {
        let check = |text: &str, near: bool, mode: SslMode| {
            let config = read_address(text).unwrap();
            assert_eq!((is_near(&config), config.get_ssl_mode()), (near, mode), "{text}");
        };
        check("postgres://a@localhost/b", true, SslMode::Prefer);
        check("postgres://a@127.0.0.1:5433/b", true, SslMode::Prefer);
        check("postgres://a@%2Frun%2Fpostgresql/b", true, SslMode::Prefer);
        check("host=/run/postgresql user=a dbname=b", true, SslMode::Prefer);
        check("postgres://a@records.example.edu/b", false, SslMode::Require);
        check("postgres://a@records.example.edu/b?sslmode=disable", false, SslMode::Require);
        check("postgres://a@localhost,records.example.edu/b?sslmode=prefer", false, SslMode::Require);
        check("host=localhost hostaddr=192.0.2.7 user=a", false, SslMode::Require);
    }

    #[test]
    fn a_password_in_an_address_is_refused_and_not_repeated() {
        for text in ["postgres://a:hunter2@localhost/b", "host=localhost user=a password=hunter2", "nonsense hunter2"] {
            let why = read_address(text).unwrap_err();
            assert!(!why.contains("hunter2"), "{why}");
        }
        assert!(read_address("postgres://a@/b").is_err());
    }
}
