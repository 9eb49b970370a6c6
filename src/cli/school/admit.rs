//! `typodont school admit`: grants logins their roles.

use super::database::DatabaseArguments;
use crate::cli::{CliError, print_line};
use clap::{Args, ValueEnum};
use postgres::{Client, Error};
use std::path::PathBuf;
use typodont_report::sanitize_display;
use typodont_school::records::describe_db_error;

#[derive(Args)]
pub struct Arguments {
    /// Name of the login; it is created if necessary
    login: String,
    /// Role of the login
    #[arg(long = "as", value_name = "ROLE")]
    role: LoginRole,
    /// For an examiner: class to be examined; may be given several times
    #[arg(long, value_name = "NAME")]
    class: Vec<String>,
    /// File with the login's password, if the server requires one
    #[arg(long, value_name = "FILE")]
    password_file: Option<PathBuf>,
    /// With --password-file: replace the password of a login that already exists
    #[arg(long, requires = "password_file")]
    replace: bool,
    #[command(flatten)]
    at: DatabaseArguments,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum LoginRole {
    /// Writes its own sessions, and reads no others
    Station,
    /// Reads the sessions of its classes, and overrides grades
    Examiner,
    /// Reads, exports and erases all sessions
    Registrar,
    /// Scores queued sessions
    Worker,
}

impl LoginRole {
    fn name(self) -> &'static str {
        match self {
            LoginRole::Station => "station",
            LoginRole::Examiner => "examiner",
            LoginRole::Registrar => "registrar",
            LoginRole::Worker => "worker",
        }
    }
}

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let Arguments { login, role, class, .. } = arguments;
    let fits = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
    if login.is_empty() || login.len() > 63 || !login.chars().all(fits) || login.starts_with(['.', '-']) {
        let shown = sanitize_display(login, 80);
        return Err(CliError::misuse(format!(
            "\"{shown}\": wrong-login: a login consists of up to 63 letters, digits, dots, dashes and underscores, and \
            does not begin with a dot or dash"
        )));
    }
    if login.starts_with("typodont_") {
        return Err(CliError::misuse(format!(
            "\"{login}\": wrong-login: names that begin with typodont_ are reserved for roles; choose another name"
        )));
    }
    if login.starts_with("pg_") {
        return Err(CliError::misuse(format!(
            "\"{login}\": wrong-login: names that begin with pg_ are reserved by PostgreSQL; choose another name"
        )));
    }
    if class.is_empty() == (*role == LoginRole::Examiner) {
        return Err(CliError::misuse("--class: an examiner needs at least one class, and no other role takes a class"));
    }
    let password = match &arguments.password_file {
        None => None,
        Some(path) => {
            let text = typodont_formats::read_text(path)?.text.clone();
            // Only a SCRAM verifier is transmitted, and possibly logged by the server, never the password itself.
            Some(postgres_protocol::password::scram_sha_256(text.trim_end_matches(['\r', '\n']).as_bytes()))
        }
    };
    let mut client = arguments.at.connect()?;
    let outcome = grant_role(&mut client, arguments, password.as_deref());
    match outcome.map_err(|e| CliError::wrong(format!("--database: refused: {}", describe_db_error(&e))))? {
        AdmitOutcome::Admitted(roles) => print_line(format!("{login}: {}", roles.join(", "))),
        AdmitOutcome::UnknownClass(class) => {
            Err(CliError::wrong(format!("--class: unknown-class: there is no class \"{class}\"")))
        }
        AdmitOutcome::TooPowerful(why) => Err(CliError::wrong(format!(
            "\"{login}\": wrong-login: this login {why}, and would read every record; choose a login of its own for \
            the {}",
            role.name()
        ))),
        AdmitOutcome::Exists => Err(CliError::wrong(format!(
            "\"{login}\": known-login: the login already exists; give --replace to change its password, or leave \
            --password-file out to grant only the role"
        ))),
    }
}

/// Result of a request to admit a login. Nothing is changed unless it was admitted.
enum AdmitOutcome {
    /// Contains the names of all roles that the login now has.
    Admitted(Vec<String>),
    UnknownClass(String),
    /// The rules about rows do not apply to the login; contains the reason.
    TooPowerful(String),
    /// The login exists, and its password was to be set without --replace.
    Exists,
}

/// Reason for which no rule about rows would hold for an existing login, empty if there is none; no row for a new login.
const PRIVILEGES_SQL: &str = "SELECT CASE
    WHEN r.rolsuper THEN 'is a superuser'
    WHEN pg_has_role(r.oid, d.datdba, 'MEMBER') THEN 'owns the database'
    WHEN pg_has_role(r.oid, n.nspowner, 'MEMBER') THEN 'owns the tables'
    WHEN r.rolbypassrls THEN 'has the attribute BYPASSRLS'
    WHEN r.rolcreaterole THEN 'has the attribute CREATEROLE'
    WHEN r.rolreplication THEN 'has the attribute REPLICATION'
    WHEN NOT r.rolcanlogin THEN 'is a group of logins'
    ELSE '' END
  FROM pg_roles r, pg_database d, pg_namespace n
  WHERE r.rolname = $1 AND d.datname = current_database() AND n.nspname = 'typodont'";

/// Creates the login if necessary, and grants the role.
fn grant_role(client: &mut Client, arguments: &Arguments, password: Option<&str>) -> Result<AdmitOutcome, Error> {
    let Arguments { login, role, class, replace, .. } = arguments;
    let mut transaction = client.transaction()?;
    let found = transaction.query_opt(PRIVILEGES_SQL, &[login])?;
    let is_there = found.is_some();
    if let Some(row) = found {
        let privilege: String = row.get(0);
        if !privilege.is_empty() {
            return Ok(AdmitOutcome::TooPowerful(privilege));
        }
        if password.is_some() && !replace {
            return Ok(AdmitOutcome::Exists);
        }
    }
    // The server quotes the names and values of these statements itself (`format`).
    let mut execute_formatted = |sql: &str, words: [&str; 2]| -> Result<(), Error> {
        let [first, second] = words;
        let sentence: String = transaction.query_one(sql, &[&first, &second])?.get(0);
        transaction.batch_execute(&sentence)
    };
    if !is_there {
        execute_formatted("SELECT format('CREATE ROLE %I LOGIN', $1::text, $2::text)", [login, ""])?;
    }
    if let Some(password) = password {
        execute_formatted("SELECT format('ALTER ROLE %I PASSWORD %L', $1::text, $2::text)", [login, password])?;
    }
    let group = format!("typodont_{}", role.name());
    execute_formatted("SELECT format('GRANT %I TO %I', $1::text, $2::text)", [&group, login])?;
    for class in class {
        let sql = "INSERT INTO typodont.examines (login, class_id) SELECT $1, id FROM typodont.class WHERE name = $2
          ON CONFLICT (login, class_id) DO UPDATE SET login = excluded.login";
        if transaction.execute(sql, &[login, class])? == 0 {
            return Ok(AdmitOutcome::UnknownClass(sanitize_display(class, 80)));
        }
    }
    let detail = format!("{login} as {}", role.name());
    transaction.query("SELECT typodont.note('admitted', $1)", &[&detail])?;
    let sql = "SELECT substr(g.rolname, 10) FROM pg_roles g JOIN pg_auth_members m ON m.roleid = g.oid
      JOIN pg_roles l ON l.oid = m.member
      WHERE l.rolname = $1 AND g.rolname LIKE 'typodont\\_%' ORDER BY 1";
    let roles = transaction.query(sql, &[login])?.iter().map(|row| row.get(0)).collect();
    transaction.commit()?;
    Ok(AdmitOutcome::Admitted(roles))
}
