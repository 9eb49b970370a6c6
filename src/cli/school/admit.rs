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
    let missing = grant_role(&mut client, arguments, password.as_deref());
    match missing.map_err(|e| CliError::wrong(format!("--database: refused: {}", describe_db_error(&e))))? {
        None => print_line(format!("{login}: {}", role.name())),
        Some(class) => Err(CliError::wrong(format!("--class: unknown-class: there is no class \"{class}\""))),
    }
}

/// Grants the role; returns the name of a class that does not exist, if there is one.
fn grant_role(client: &mut Client, arguments: &Arguments, password: Option<&str>) -> Result<Option<String>, Error> {
    let Arguments { login, role, class, .. } = arguments;
    let mut transaction = client.transaction()?;
    let is_there = transaction.query_opt("SELECT FROM pg_roles WHERE rolname = $1", &[login])?.is_some();
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
            return Ok(Some(sanitize_display(class, 80)));
        }
    }
    let detail = format!("{login} as {}", role.name());
    transaction.query("SELECT typodont.note('admitted', $1)", &[&detail])?;
    transaction.commit()?;
    Ok(None)
}
