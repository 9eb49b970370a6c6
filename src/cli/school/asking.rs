//! An open line to the database, opened anew whenever it broke.

use super::patience::{Passing, Patience};
use crate::cli::Failure;
use crate::school::records::{is_passing, told};
use postgres::{Client, Config, Error};
use tokio_postgres_rustls::MakeRustlsConnect;

/// Why there is no answer.
#[derive(Debug)]
pub enum Unanswered {
    /// The database is away, or says that it cannot just now.
    Away(String),
    /// It does not let us in, or refuses the question.
    Refused(Error),
}

impl Passing for Unanswered {
    fn is_passing(&self) -> bool {
        matches!(self, Unanswered::Away(_))
    }
}

impl From<Error> for Unanswered {
    fn from(error: Error) -> Unanswered {
        match is_passing(&error) {
            true => Unanswered::Away(told(&error)),
            false => Unanswered::Refused(error),
        }
    }
}

impl From<Unanswered> for Failure {
    fn from(unanswered: Unanswered) -> Failure {
        match unanswered {
            Unanswered::Away(why) => Failure::wrong(format!("--database: no-answer: {why}")),
            Unanswered::Refused(error) => Failure::wrong(match error.code().map(|code| code.code()) {
                // Tables, schema or function that are not there.
                Some("42P01" | "3F000" | "42883") => {
                    "--database: no-schema: the tables are not there, or of an older program; `typodont school init` \
                     makes them, as the database's owner"
                        .to_string()
                }
                Some("42501") => format!(
                    "--database: not-allowed: this login's role may not do that ({}); see `typodont school admit`",
                    told(&error)
                ),
                _ => format!("--database: refused: {}", told(&error)),
            }),
        }
    }
}

/// Where the database is, and how it is spoken to.
pub struct Line {
    pub(super) config: Config,
    /// What makes a connection to elsewhere safe; none where the address is on this machine and does not ask for it.
    pub(super) tls: Option<MakeRustlsConnect>,
    pub(super) patience: Patience,
    pub(super) client: Option<Client>,
}

impl Line {
    /// Asks something that may be asked twice: an answer that is lost on its way back is asked for again.
    pub fn ask<T>(&mut self, mut what: impl FnMut(&mut Client) -> Result<T, Error>) -> Result<T, Unanswered> {
        let patience = self.patience;
        patience.keep(|| {
            let result = self.open().and_then(|client| what(client).map_err(Unanswered::from));
            if result.as_ref().is_err_and(Passing::is_passing) {
                self.client = None;
            }
            result
        })
    }

    /// Asks once, whatever comes.
    pub fn ask_once<T>(&mut self, what: impl FnMut(&mut Client) -> Result<T, Error>) -> Result<T, Unanswered> {
        let patience = std::mem::replace(&mut self.patience, Patience(std::time::Duration::ZERO));
        let result = self.ask(what);
        self.patience = patience;
        result
    }

    /// Another line to the same place.
    pub fn another(&self) -> Line {
        Line { config: self.config.clone(), tls: self.tls.clone(), patience: self.patience, client: None }
    }

    pub(super) fn open(&mut self) -> Result<&mut Client, Unanswered> {
        let client = match self.client.take().filter(|client| !client.is_closed()) {
            Some(client) => client,
            None => match &self.tls {
                Some(tls) => self.config.connect(tls.clone())?,
                None => self.config.connect(postgres::NoTls)?,
            },
        };
        Ok(self.client.insert(client))
    }
}
