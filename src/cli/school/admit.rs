//! `typodont school admit`: grants logins their roles.

use super::database::DatabaseArguments;
use crate::cli::{CliError, print_line};
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use typodont_report::sanitize_display;
use typodont_school::records::describe_db_error;
use typodont_school::roles::{AdmitOutcome, AdmitRequest, LoginRole, admit};

#[derive(Args)]
pub struct Arguments {
    /// Name of the login; it is created if necessary
    login: String,
    /// Role of the login
    #[arg(long = "as", value_name = "ROLE")]
    role: RoleArgument,
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
enum RoleArgument {
    /// Writes its own sessions, and reads no others
    Station,
    /// Reads the sessions of its classes, and overrides grades
    Examiner,
    /// Reads, exports and erases all sessions
    Registrar,
    /// Scores queued sessions
    Worker,
}

impl RoleArgument {
    fn role(self) -> LoginRole {
        match self {
            RoleArgument::Station => LoginRole::Station,
            RoleArgument::Examiner => LoginRole::Examiner,
            RoleArgument::Registrar => LoginRole::Registrar,
            RoleArgument::Worker => LoginRole::Worker,
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
    if class.is_empty() == (*role == RoleArgument::Examiner) {
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
    let request = AdmitRequest {
        login,
        role: role.role(),
        classes: class,
        password_verifier: password.as_deref(),
        replaces_password: arguments.replace,
    };
    match admit(&mut client, &request)
        .map_err(|e| CliError::wrong(format!("--database: refused: {}", describe_db_error(&e))))?
    {
        AdmitOutcome::Admitted(roles) => print_line(format!("{login}: {}", roles.join(", "))),
        AdmitOutcome::UnknownClass(class) => Err(CliError::wrong(format!(
            "--class: unknown-class: there is no class \"{}\"",
            sanitize_display(&class, 80)
        ))),
        AdmitOutcome::TooPowerful(why) => Err(CliError::wrong(format!(
            "\"{login}\": wrong-login: this login {why}, and would read every record; choose a login of its own for \
            the {}",
            request.role.name()
        ))),
        AdmitOutcome::Exists => Err(CliError::wrong(format!(
            "\"{login}\": known-login: the login already exists; give --replace to change its password, or leave \
            --password-file out to grant only the role"
        ))),
    }
}
