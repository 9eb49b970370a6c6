//! The schema, step by step: each is applied once, in order, and never changed afterwards.

use crate::scenario::hex;
use postgres::Client;
use sha2::{Digest, Sha256};
use std::fmt;

/// Name and text of each; its number is its place, from 1.
const STEPS: [(&str, &str); 3] = [
    ("records", include_str!("migrations/0001_records.sql")),
    ("roles", include_str!("migrations/0002_roles.sql")),
    ("store", include_str!("migrations/0003_store.sql")),
];

/// Keeps two programs from migrating at once; any number will do that nothing else takes.
const LOCK: i64 = 7368;

/// Why the schema is not what it should be.
#[derive(Debug)]
pub enum Unapplied {
    Failed(postgres::Error),
    /// A step was applied from another text than ours.
    Changed {
        number: usize,
    },
    /// A newer program was here.
    Newer {
        number: i32,
    },
}

impl From<postgres::Error> for Unapplied {
    fn from(error: postgres::Error) -> Unapplied {
        Unapplied::Failed(error)
    }
}

impl fmt::Display for Unapplied {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Unapplied::Failed(error) => write!(f, "{}", super::records::told(error)),
            Unapplied::Changed { number } => {
                write!(f, "changed-schema: step {number} was applied from another text than this program's")
            }
            Unapplied::Newer { number } => {
                write!(f, "newer-schema: step {number} is unknown here; take the program that made it")
            }
        }
    }
}

/// Brings the schema up to this program's; gives the names of the steps that were new. As the database's owner.
pub fn apply(client: &mut Client) -> Result<Vec<&'static str>, Unapplied> {
    let mut change = client.transaction()?;
    change.execute("SELECT pg_advisory_xact_lock($1)", &[&LOCK])?;
    let there: bool =
        change.query_one("SELECT to_regclass('typodont.migration') IS NOT NULL", &[]).map(|row| row.get(0))?;
    let applied = match there {
        true => change.query("SELECT number, sha256 FROM typodont.migration ORDER BY number", &[])?,
        false => Vec::new(),
    };
    for row in &applied {
        let (number, digest): (i32, String) = (row.get(0), row.get(1));
        let own = usize::try_from(number - 1).ok().and_then(|place| STEPS.get(place));
        match own {
            None => return Err(Unapplied::Newer { number }),
            Some((_, text)) if hex(&Sha256::digest(text.as_bytes())) != digest => {
                return Err(Unapplied::Changed { number: number as usize });
            }
            Some(_) => {}
        }
    }
    let mut new = Vec::new();
    for (place, (name, text)) in STEPS.iter().enumerate().skip(applied.len()) {
        change.batch_execute(text)?;
        let sql = "INSERT INTO typodont.migration (number, name, sha256) VALUES ($1, $2, $3)";
        change.execute(sql, &[&(place as i32 + 1), name, &hex(&Sha256::digest(text.as_bytes()))])?;
        new.push(*name);
    }
    change.commit()?;
    Ok(new)
}
