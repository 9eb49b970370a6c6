//! Forgetting: the records first, in one step that also writes down what is left to remove elsewhere.

use postgres::{Client, Error};

/// Something outside the records that an erasure has still to remove.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Left {
    /// A folder of the store.
    Bundle { id: i64, folder: String },
    /// A partition of an export: it is made anew without whoever was erased.
    Export { id: i64, destination: String, partition: String },
}

/// Takes a participant out of the records, for good; gives how many sessions went. Whoever was not there is not let in later either.
pub fn erase_participant(client: &mut Client, code: &str) -> Result<i64, Error> {
    Ok(client.query_one("SELECT typodont.erase_participant($1)", &[&code])?.get(0))
}

/// Sessions that their class no longer keeps; takes them out of the records if that is asked for.
pub fn outlived(client: &mut Client, erase: bool) -> Result<i64, Error> {
    let sql = match erase {
        true => {
            "SELECT typodont.erase_sessions(array(SELECT typodont.outlived()), 'kept for as long as their class is')"
        }
        false => "SELECT count(*) FROM typodont.outlived()",
    };
    Ok(client.query_one(sql, &[])?.get(0))
}

/// What is left to remove, of this erasure and of any that broke off.
pub fn left(client: &mut Client) -> Result<Vec<Left>, Error> {
    let sql = "SELECT id, kind, place, part FROM typodont.erasing ORDER BY id";
    let left = |row: &postgres::Row| match row.get(1) {
        "bundle" => Left::Bundle { id: row.get(0), folder: row.get(2) },
        _ => Left::Export { id: row.get(0), destination: row.get(2), partition: row.get(3) },
    };
    Ok(client.query(sql, &[])?.iter().map(left).collect())
}

/// Says that it is removed.
pub fn removed(client: &mut Client, left: &Left) -> Result<(), Error> {
    let (Left::Bundle { id, .. } | Left::Export { id, .. }) = left;
    client.execute("DELETE FROM typodont.erasing WHERE id = $1", &[id])?;
    Ok(())
}
