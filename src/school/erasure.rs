//! Erasure of participants and expired sessions. One transaction removes the rows and records the deletions that
//! remain to be done in the store and in exports.

use postgres::{Client, Error};

/// Data outside the database that an erasure has yet to delete.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PendingDeletion {
    /// Bundle folder in the store.
    Bundle { id: i64, folder: String },
    /// Partition of an export, which is rewritten without the erased sessions.
    Export { id: i64, destination: String, partition: String },
}

/// Erases a participant permanently and returns the number of erased sessions. Sessions under this code are refused
/// from then on, even if the database had none.
///
/// # Errors
///
/// Returns the database error.
pub fn erase_participant(client: &mut Client, code: &str) -> Result<i64, Error> {
    Ok(client.query_one("SELECT typodont.erase_participant($1)", &[&code])?.get(0))
}

/// Counts the sessions whose class's retention period has expired, and erases them if `erase` is set.
///
/// # Errors
///
/// Returns the database error.
pub fn expired_sessions(client: &mut Client, erase: bool) -> Result<i64, Error> {
    let sql = match erase {
        true => {
            "SELECT typodont.erase_sessions(array(SELECT typodont.outlived()), 'retention period of the class expired')"
        }
        false => "SELECT count(*) FROM typodont.outlived()",
    };
    Ok(client.query_one(sql, &[])?.get(0))
}

/// Returns all deletions yet to be done, including those of interrupted erasures.
///
/// # Errors
///
/// Returns the database error.
pub fn pending_deletions(client: &mut Client) -> Result<Vec<PendingDeletion>, Error> {
    let sql = "SELECT id, kind, place, part FROM typodont.erasing ORDER BY id";
    let left = |row: &postgres::Row| match row.get(1) {
        "bundle" => PendingDeletion::Bundle { id: row.get(0), folder: row.get(2) },
        _ => PendingDeletion::Export { id: row.get(0), destination: row.get(2), partition: row.get(3) },
    };
    Ok(client.query(sql, &[])?.iter().map(left).collect())
}

/// Records that a deletion is done.
///
/// # Errors
///
/// Returns the database error.
pub fn mark_deleted(client: &mut Client, deletion: &PendingDeletion) -> Result<(), Error> {
    let (PendingDeletion::Bundle { id, .. } | PendingDeletion::Export { id, .. }) = deletion;
    client.execute("DELETE FROM typodont.erasing WHERE id = $1", &[id])?;
    Ok(())
}
