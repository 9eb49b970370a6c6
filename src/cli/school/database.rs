//! Address and password of the database; the password comes from files or the environment, never from the command line.

use crate::cli::CliError;
use crate::cli::secret_file::require_private;
use clap::Args;
use postgres::Config;
use postgres::config::{Host, SslMode};
use rustls::pki_types::CertificateDer;
use rustls::pki_types::pem::PemObject;
use rustls::{ClientConfig, RootCertStore};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use tokio_postgres_rustls::MakeRustlsConnect;
use typodont_school::connection::DbConnection;
use typodont_school::retry::RetryPolicy;
use typodont_school::{is_local, parse_database_url};

/// Environment variables with the database's address and password file, if the command line does not give them.
const DATABASE_VARIABLE: &str = "TYPODONT_DATABASE";
const PASSWORD_FILE_VARIABLE: &str = "TYPODONT_DATABASE_PASSWORD_FILE";

/// Time limit for opening a connection; a server in the local network needs milliseconds.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(10);

/// Idle time after which the connection is checked by a TCP keepalive.
const KEEPALIVE_IDLE: Duration = Duration::from_secs(30);

#[derive(Args, Clone)]
pub struct DatabaseArguments {
    /// URL of the database: postgres://user@host/name; by default taken from TYPODONT_DATABASE. The password is read from the file
    /// named by TYPODONT_DATABASE_PASSWORD_FILE, from PGPASSWORD, or from PGPASSFILE
    #[arg(long, value_name = "URL")]
    pub database: Option<String>,
    /// Certificates to trust instead of the public authorities, for a school's own authority
    #[arg(long, value_name = "FILE.pem")]
    pub database_certificates: Option<PathBuf>,
    /// Time to keep trying a server that does not respond, in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0)]
    pub patience: f64,
}

impl DatabaseArguments {
    /// True if a database is named, on the command line or in the environment.
    pub fn is_configured(&self) -> bool {
        self.database.is_some() || std::env::var_os(DATABASE_VARIABLE).is_some()
    }

    pub fn retry_policy(&self) -> Result<RetryPolicy, CliError> {
        let wait = Duration::try_from_secs_f64(self.patience);
        wait.map(RetryPolicy).map_err(|e| CliError::misuse(format!("--patience: {e}")))
    }

    /// A connection to the database, not yet open.
    pub fn connection(&self) -> Result<DbConnection, CliError> {
        let address = match &self.database {
            Some(address) => address.clone(),
            None => std::env::var(DATABASE_VARIABLE).map_err(|_| {
                CliError::misuse(format!(
                    "no-database: give --database, or set the environment variable {DATABASE_VARIABLE}"
                ))
            })?,
        };
        let mut config = parse_database_url(&address).map_err(|e| CliError::misuse(format!("--database: {e}")))?;
        if let Some(password) = password(&config)? {
            config.password(password);
        }
        config.connect_timeout(CONNECT_TIMEOUT).keepalives_idle(KEEPALIVE_IDLE).application_name("typodont");
        let tls = match is_local(&config) && config.get_ssl_mode() != SslMode::Require {
            true => None,
            false => Some(tls_connector(self.database_certificates.as_deref())?),
        };
        if tls.is_none() {
            config.ssl_mode(SslMode::Disable);
        }
        Ok(DbConnection::new(config, tls, self.retry_policy()?))
    }

    /// An open client, for statements that must not run twice.
    pub fn connect(&self) -> Result<postgres::Client, CliError> {
        Ok(self.connection()?.into_client()?)
    }
}

/// TLS connector that trusts the public authorities, or a school's own, and checks host names.
fn tls_connector(certificates: Option<&Path>) -> Result<MakeRustlsConnect, CliError> {
    let mut roots = RootCertStore::empty();
    match certificates {
        None => roots.extend(webpki_roots::TLS_SERVER_ROOTS.iter().cloned()),
        Some(path) => {
            let pem = typodont_formats::read_file(path)?;
            let found: Vec<CertificateDer> = CertificateDer::pem_slice_iter(&pem).filter_map(Result::ok).collect();
            let (added, _) = roots.add_parsable_certificates(found);
            if added == 0 {
                return Err(CliError::wrong(format!(
                    "{}: no-certificate: the file contains no PEM certificate",
                    path.display()
                )));
            }
        }
    }
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let config = ClientConfig::builder_with_provider(provider)
        .with_safe_default_protocol_versions()
        .map_err(|e| CliError::wrong(format!("--database: TLS is not available: {e}")))?
        .with_root_certificates(roots)
        .with_no_client_auth();
    Ok(MakeRustlsConnect::new(config))
}

/// The password, if there is one.
fn password(config: &Config) -> Result<Option<String>, CliError> {
    if let Some(path) = std::env::var_os(PASSWORD_FILE_VARIABLE) {
        let text = typodont_formats::read_text(Path::new(&path))?.text.clone();
        return Ok(Some(text.trim_end_matches(['\r', '\n']).to_string()));
    }
    if let Ok(password) = std::env::var("PGPASSWORD") {
        return Ok(Some(password));
    }
    let own = directories::BaseDirs::new().map(|dirs| dirs.home_dir().join(".pgpass"));
    let Some(path) = std::env::var_os("PGPASSFILE").map(PathBuf::from).or(own).filter(|path| path.is_file()) else {
        return Ok(None);
    };
    require_private(&path)?;
    let text = typodont_formats::read_text(&path)?.text.clone();
    Ok(text.lines().find_map(|line| match_pgpass_line(line, config)))
}

/// The password of a line `host:port:database:user:password`, if it matches this connection; `*` matches anything, and
/// `\` escapes a colon.
fn match_pgpass_line(line: &str, config: &Config) -> Option<String> {
    let mut fields = vec![String::new()];
    let mut letters = line.chars();
    while let Some(letter) = letters.next() {
        match letter {
            '\\' => fields.last_mut()?.extend(letters.next()),
            ':' if fields.len() < 5 => fields.push(String::new()),
            letter => fields.last_mut()?.push(letter),
        }
    }
    let [host, port, database, user, password] = <[String; 5]>::try_from(fields).ok()?;
    let is = |field: &str, value: &str| field == "*" || field == value;
    let hosts = config.get_hosts().iter().map(|host| match host {
        Host::Tcp(name) => name.clone(),
        #[cfg(unix)]
        Host::Unix(path) => path.display().to_string(),
    });
    let has_host = hosts.into_iter().any(|own| is(&host, &own) || own.starts_with('/') && host == "localhost");
    let has_port = match config.get_ports() {
        [] => is(&port, "5432"),
        ports => ports.iter().any(|own| is(&port, &own.to_string())),
    };
    let login = config.get_user().unwrap_or_default();
    let own = has_host && has_port && is(&database, config.get_dbname().unwrap_or(login)) && is(&user, login);
    own.then_some(password)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_password_is_found_as_psql_finds_it() {
        let config = parse_database_url("postgres://anna@records.example.edu:5433/school").unwrap();
        let check = |line: &str, expected: Option<&str>| {
            assert_eq!(match_pgpass_line(line, &config).as_deref(), expected, "{line}");
        };
        check("records.example.edu:5433:school:anna:se:cret", Some("se:cret"));
        check(r"*:*:*:anna:a\:b\\c", Some(r"a:b\c"));
        check("*:5432:*:*:x", None);
        check("*:*:*:berk:x", None);
        check("# a remark", None);
    }
}
