//! Database schema migrations. Each is applied once, in order, and is never changed afterwards.

use postgres::Client;
use sha2::{Digest, Sha256};
use std::fmt;
use typodont_exercise::scenario::hex;

/// Name and SQL text of each migration. The number of a migration is its position, from 1.
const MIGRATIONS: [(&str, &str); 5] = [
    ("records", include_str!("migrations/0001_records.sql")),
    ("roles", include_str!("migrations/0002_roles.sql")),
    ("store", include_str!("migrations/0003_store.sql")),
    ("measures", include_str!("migrations/0004_measures.sql")),
    ("examiner_ratings", include_str!("migrations/0005_examiner_ratings.sql")),
];

/// Key of the advisory lock that keeps two programs from migrating at the same time. Any number that nothing else
/// locks works.
const ADVISORY_LOCK_ID: i64 = 7368;

/// Reason for which the schema cannot be migrated.
#[derive(Debug)]
pub enum MigrationError {
    Database(postgres::Error),
    /// The applied migration differs from this program's migration of the same number.
    Changed {
        number: usize,
    },
    /// The schema was created by a newer program.
    Newer {
        number: i32,
    },
}

impl From<postgres::Error> for MigrationError {
    fn from(error: postgres::Error) -> MigrationError {
        MigrationError::Database(error)
    }
}

impl fmt::Display for MigrationError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            MigrationError::Database(error) => write!(f, "{}", super::records::describe_db_error(error)),
            MigrationError::Changed { number } => {
                write!(f, "changed-schema: the applied migration {number} differs from this program's")
            }
            MigrationError::Newer { number } => {
                write!(
                    f,
                    "newer-schema: migration {number} is unknown to this program; use the version that applied it"
                )
            }
        }
    }
}

/// Applies all missing migrations in one transaction and returns their names. The login must own the database.
///
/// # Errors
///
/// Returns an error when the database fails, an applied migration differs from this program's, or the schema is newer
/// than this program.
pub fn apply_migrations(client: &mut Client) -> Result<Vec<&'static str>, MigrationError> {
    let mut transaction = client.transaction()?;
    transaction.execute("SELECT pg_advisory_xact_lock($1)", &[&ADVISORY_LOCK_ID])?;
    let has_table: bool =
        transaction.query_one("SELECT to_regclass('typodont.migration') IS NOT NULL", &[]).map(|row| row.get(0))?;
    let applied = match has_table {
        true => transaction.query("SELECT number, sha256 FROM typodont.migration ORDER BY number", &[])?,
        false => Vec::new(),
    };
    for row in &applied {
        let (number, digest): (i32, String) = (row.get(0), row.get(1));
        let own = usize::try_from(number - 1).ok().and_then(|place| MIGRATIONS.get(place));
        match own {
            None => return Err(MigrationError::Newer { number }),
            Some((_, text)) if hex(&Sha256::digest(text.as_bytes())) != digest => {
                return Err(MigrationError::Changed { number: number as usize });
            }
            Some(_) => {}
        }
    }
    let mut new = Vec::new();
    for (place, (name, text)) in MIGRATIONS.iter().enumerate().skip(applied.len()) {
        transaction.batch_execute(text)?;
        let sql = "INSERT INTO typodont.migration (number, name, sha256) VALUES ($1, $2, $3)";
        transaction.execute(sql, &[&(place as i32 + 1), name, &hex(&Sha256::digest(text.as_bytes()))])?;
        new.push(*name);
    }
    transaction.commit()?;
    Ok(new)
}
