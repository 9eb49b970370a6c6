//! Errors of the records and of the store, as the command line says them.

use crate::cli::CliError;
use typodont_school::connection::DbError;
use typodont_school::records::describe_db_error;
use typodont_school::store::StoreError;

impl From<DbError> for CliError {
    fn from(unanswered: DbError) -> CliError {
        match unanswered {
            DbError::Unavailable(why) => CliError::wrong(format!("--database: no-answer: {why}")),
            DbError::Rejected(error) => CliError::wrong(match error.code().map(|code| code.code()) {
                // A table, schema or function is missing.
                Some("42P01" | "3F000" | "42883") => {
                    "--database: no-schema: the tables are missing or out of date; run `typodont school init` as the \
                     database's owner"
                        .to_string()
                }
                Some("42501") => format!(
                    "--database: not-allowed: the role of this login does not permit this ({}); see `typodont school \
                    admit`",
                    describe_db_error(&error)
                ),
                _ => format!("--database: refused: {}", describe_db_error(&error)),
            }),
        }
    }
}

impl From<StoreError> for CliError {
    fn from(undone: StoreError) -> CliError {
        CliError::wrong(format!("--store: no-answer: {}", undone.why))
    }
}
