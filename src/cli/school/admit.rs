//! `typodont school admit`: who may come in, and as what.

use super::database::At;
use crate::cli::{Failure, say};
use crate::report::harmless;
use crate::school::records::told;
use clap::{Args, ValueEnum};
use postgres::{Client, Error};
use std::path::PathBuf;

#[derive(Args)]
pub struct Arguments {
    /// Name of the login; it is made where there is none
    login: String,
    /// What it may do
    #[arg(long = "as", value_name = "ROLE")]
    role: Role,
    /// Of an examiner: the class that is read and judged; may stand several times
    #[arg(long, value_name = "NAME")]
    class: Vec<String>,
    /// A file with the login's password, where the server asks for one
    #[arg(long, value_name = "FILE")]
    password_file: Option<PathBuf>,
    #[command(flatten)]
    at: At,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Role {
    /// Writes its own sessions, and reads no others
    Station,
    /// Reads its classes, and judges
    Examiner,
    /// Reads everything, exports, erases
    Registrar,
    /// Scores
    Worker,
}

impl Role {
    fn name(self) -> &'static str {
        match self {
            Role::Station => "station",
            Role::Examiner => "examiner",
            Role::Registrar => "registrar",
            Role::Worker => "worker",
        }
    }
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { login, role, class, .. } = arguments;
    let fits = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
    if login.is_empty() || login.len() > 63 || !login.chars().all(fits) || login.starts_with(['.', '-']) {
        let shown = harmless(login, 80);
        return Err(Failure::misuse(format!(
            "\"{shown}\": wrong-login: letters, digits, dot, dash, underscore; 63 at most"
        )));
    }
    if login.starts_with("typodont_") {
        return Err(Failure::misuse(format!(
            "\"{login}\": wrong-login: this is a role of many; name a login of its own"
        )));
    }
    if class.is_empty() == (*role == Role::Examiner) {
        return Err(Failure::misuse("--class: an examiner has a class or several, and nobody else has one"));
    }
    let password = match &arguments.password_file {
        None => None,
        Some(path) => {
            let text = crate::content::read_text(path)?.text.clone();
            // What goes over the line, and may stand in the server's log, is no password.
            Some(postgres_protocol::password::scram_sha_256(text.trim_end_matches(['\r', '\n']).as_bytes()))
        }
    };
    let mut client = arguments.at.client()?;
    let missing = admit(&mut client, arguments, password.as_deref());
    match missing.map_err(|e| Failure::wrong(format!("--database: refused: {}", told(&e))))? {
        None => say(format!("{login}: {}", role.name())),
        Some(class) => Err(Failure::wrong(format!("--class: unknown-class: there is no class \"{class}\""))),
    }
}

/// Does it, or gives the class that is not there.
fn admit(client: &mut Client, arguments: &Arguments, password: Option<&str>) -> Result<Option<String>, Error> {
    let Arguments { login, role, class, .. } = arguments;
    let mut change = client.transaction()?;
    let is_there = change.query_opt("SELECT FROM pg_roles WHERE rolname = $1", &[login])?.is_some();
    // The server itself quotes what these sentences are made of.
    let mut say = |sql: &str, words: [&str; 2]| -> Result<(), Error> {
        let [first, second] = words;
        let sentence: String = change.query_one(sql, &[&first, &second])?.get(0);
        change.batch_execute(&sentence)
    };
    if !is_there {
        say("SELECT format('CREATE ROLE %I LOGIN', $1::text, $2::text)", [login, ""])?;
    }
    if let Some(password) = password {
        say("SELECT format('ALTER ROLE %I PASSWORD %L', $1::text, $2::text)", [login, password])?;
    }
    let group = format!("typodont_{}", role.name());
    say("SELECT format('GRANT %I TO %I', $1::text, $2::text)", [&group, login])?;
    for class in class {
        let sql = "INSERT INTO typodont.examines (login, class_id) SELECT $1, id FROM typodont.class WHERE name = $2
          ON CONFLICT (login, class_id) DO UPDATE SET login = excluded.login";
        if change.execute(sql, &[login, class])? == 0 {
            return Ok(Some(harmless(class, 80)));
        }
    }
    let detail = format!("{login} as {}", role.name());
    change.query("SELECT typodont.note('admitted', $1)", &[&detail])?;
    change.commit()?;
    Ok(None)
}
