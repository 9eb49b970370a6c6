//! Parsing of database URLs and the TLS requirement that follows from them.

use postgres::Config;
use postgres::config::{Host, SslMode};
use typodont_integrations::is_this_machine;

/// Parses `postgres://user@host/name` or `host=… user=… dbname=…`. TLS is required for every server that is not on
/// this machine, whatever SSL mode the URL states.
///
/// # Errors
///
/// Returns a message when the text is not a database URL, contains a password, or names no server. The message never
/// repeats the text.
pub fn parse_database_url(text: &str) -> Result<Config, String> {
    let mut config: Config = text.parse().map_err(|_| {
        "not a database URL; write postgres://user@host/name, or host=/run/postgresql user=… dbname=…".to_string()
    })?;
    if config.get_password().is_some() {
        return Err("the URL contains a password, which every user of this machine can read; put it into a file".into());
    }
    if config.get_hosts().is_empty() && config.get_hostaddrs().is_empty() {
        return Err("the URL names no server; write postgres://user@host/name, or host=/run/postgresql …".into());
    }
    if !is_local(&config) {
        // `Require` is the minimum; the certificate is verified by the TLS connector.
        config.ssl_mode(SslMode::Require);
    }
    Ok(config)
}

/// Returns true if every server of the configuration is on this machine: a Unix socket or a loopback address.
pub fn is_local(config: &Config) -> bool {
    let host = |host: &Host| match host {
        Host::Tcp(name) => is_this_machine(name),
        #[cfg(unix)]
        Host::Unix(path) => path != std::path::Path::new(""),
    };
    let addresses = config.get_hostaddrs();
    match addresses.is_empty() {
        true => config.get_hosts().iter().all(host),
        // A host name given beside an address is used only to verify the certificate.
        false => addresses.iter().all(|ip| ip.is_loopback()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_remote_server_requires_tls() {
        let check = |text: &str, near: bool, mode: SslMode| {
            let config = parse_database_url(text).unwrap();
            assert_eq!((is_local(&config), config.get_ssl_mode()), (near, mode), "{text}");
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
    fn a_password_in_a_url_is_refused_and_not_repeated() {
        for text in ["postgres://a:hunter2@localhost/b", "host=localhost user=a password=hunter2", "nonsense hunter2"] {
            let why = parse_database_url(text).unwrap_err();
            assert!(!why.contains("hunter2"), "{why}");
        }
        assert!(parse_database_url("postgres://a@/b").is_err());
    }
}
