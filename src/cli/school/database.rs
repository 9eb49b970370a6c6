//! Which database, and with what secret: from files and the environment, never from the command line.

use super::asking::Line;
use super::patience::Patience;
use crate::cli::Failure;
use crate::school::{is_near, read_address};
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

/// Where it is looked for if the command line does not say.
const ADDRESS: &str = "TYPODONT_DATABASE";
const PASSWORD_FILE: &str = "TYPODONT_DATABASE_PASSWORD_FILE";

/// For a connection. A server in the house needs milliseconds.
const CONNECT: Duration = Duration::from_secs(10);

/// After so long a silence the line is asked whether it still holds.
const KEEP_ALIVE: Duration = Duration::from_secs(30);

#[derive(Args, Clone)]
pub struct At {
    /// The database: postgres://user@host/name. Without it TYPODONT_DATABASE says so. The password comes from the file that
    /// TYPODONT_DATABASE_PASSWORD_FILE names, from PGPASSWORD, or from PGPASSFILE
    #[arg(long, value_name = "URL")]
    pub database: Option<String>,
    /// Certificates to trust in place of the usual, for a school's own
    #[arg(long, value_name = "FILE.pem")]
    pub database_certificates: Option<PathBuf>,
    /// For how long a server that does not answer is tried again, in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0)]
    pub patience: f64,
}

impl At {
    /// Whether a database is named at all.
    pub fn is_named(&self) -> bool {
        self.database.is_some() || std::env::var_os(ADDRESS).is_some()
    }

    pub fn patience(&self) -> Result<Patience, Failure> {
        let wait = Duration::try_from_secs_f64(self.patience);
        wait.map(Patience).map_err(|e| Failure::misuse(format!("--patience: {e}")))
    }

    /// A line to it, not yet open.
    pub fn line(&self) -> Result<Line, Failure> {
        let address = match &self.database {
            Some(address) => address.clone(),
            None => std::env::var(ADDRESS).map_err(|_| {
                Failure::misuse(format!("no-database: give --database, or its address in the environment's {ADDRESS}"))
            })?,
        };
        let mut config = read_address(&address).map_err(|e| Failure::misuse(format!("--database: {e}")))?;
        if let Some(password) = password(&config)? {
            config.password(password);
        }
        config.connect_timeout(CONNECT).keepalives_idle(KEEP_ALIVE).application_name("typodont");
        let tls = match is_near(&config) && config.get_ssl_mode() != SslMode::Require {
            true => None,
            false => Some(tls(self.database_certificates.as_deref())?),
        };
        if tls.is_none() {
            config.ssl_mode(SslMode::Disable);
        }
        Ok(Line { config, tls, patience: self.patience()?, client: None })
    }

    /// The line's client itself, for what must not be asked twice.
    pub fn client(&self) -> Result<postgres::Client, Failure> {
        let mut line = self.line()?;
        let patience = line.patience;
        patience.keep(|| line.open().map(|_| ()))?;
        line.client.ok_or_else(|| Failure::wrong("--database: no-answer"))
    }
}

/// TLS that believes the usual authorities, or a school's own, and the names in their certificates.
fn tls(certificates: Option<&Path>) -> Result<MakeRustlsConnect, Failure> {
    let mut roots = RootCertStore::empty();
    match certificates {
        None => roots.extend(webpki_roots::TLS_SERVER_ROOTS.iter().cloned()),
        Some(path) => {
            let pem = crate::content::read_file(path)?;
            let found: Vec<CertificateDer> = CertificateDer::pem_slice_iter(&pem).filter_map(Result::ok).collect();
            let (added, _) = roots.add_parsable_certificates(found);
            if added == 0 {
                return Err(Failure::wrong(format!("{}: no-certificate: it holds none in PEM", path.display())));
            }
        }
    }
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let config = ClientConfig::builder_with_provider(provider)
        .with_safe_default_protocol_versions()
        .map_err(|e| Failure::wrong(format!("--database: no TLS here: {e}")))?
        .with_root_certificates(roots)
        .with_no_client_auth();
    Ok(MakeRustlsConnect::new(config))
}

/// The secret, where there is one.
fn password(config: &Config) -> Result<Option<String>, Failure> {
    if let Some(path) = std::env::var_os(PASSWORD_FILE) {
        let text = crate::content::read_text(Path::new(&path))?.text.clone();
        return Ok(Some(text.trim_end_matches(['\r', '\n']).to_string()));
    }
    if let Ok(password) = std::env::var("PGPASSWORD") {
        return Ok(Some(password));
    }
    let own = directories::BaseDirs::new().map(|dirs| dirs.home_dir().join(".pgpass"));
    let Some(path) = std::env::var_os("PGPASSFILE").map(PathBuf::from).or(own).filter(|path| path.is_file()) else {
        return Ok(None);
    };
    is_private(&path)?;
    let text = crate::content::read_text(&path)?.text.clone();
    Ok(text.lines().find_map(|line| in_line(line, config)))
}

#[cfg(unix)]
fn is_private(path: &Path) -> Result<(), Failure> {
    use std::os::unix::fs::PermissionsExt;
    let mode = std::fs::metadata(path).map_or(0, |meta| meta.permissions().mode());
    match mode & 0o077 {
        0 => Ok(()),
        _ => Err(Failure::wrong(format!("{}: open-secret: others may read it; chmod 600 closes it", path.display()))),
    }
}

#[cfg(not(unix))]
fn is_private(_: &Path) -> Result<(), Failure> {
    Ok(())
}

/// The password of a line `host:port:database:user:password`, if it is for this connection; `*` is for any, `\` goes before a colon.
fn in_line(line: &str, config: &Config) -> Option<String> {
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
        let config = read_address("postgres://anna@records.example.edu:5433/school").unwrap();
        let check = |line: &str, expected: Option<&str>| {
            assert_eq!(in_line(line, &config).as_deref(), expected, "{line}");
        };
        check("records.example.edu:5433:school:anna:se:cret", Some("se:cret"));
        check(r"*:*:*:anna:a\:b\\c", Some(r"a:b\c"));
        check("*:5432:*:*:x", None);
        check("*:*:*:berk:x", None);
        check("# a remark", None);
    }
}
