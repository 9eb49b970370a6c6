//! Check that a store is the one that belongs to the records: it contains a marker that the records generated.
//!
//! A folder whose disk is not mounted looks like an empty store. Without this check, sessions that can be scored would
//! be set aside, and bundles on that disk would be reported as erased.

use super::sync::SyncError;
use crate::cli::CliError;
use typodont_school::connection::DbConnection;
use typodont_school::records::{confirm_store_marker, store_marker};
use typodont_school::store::{ObjectStoreHandle, StoreError};

/// Name of the object that holds the marker.
const MARKER_OBJECT: &str = "typodont-store";

/// Checks that the store belongs to the records. Before the first upload, any store without a marker is accepted.
///
/// # Errors
/// A message if the store is a different one, or cannot be read.
pub fn verify(connection: &mut DbConnection, store: &ObjectStoreHandle) -> Result<(), CliError> {
    let (marker, is_marked) = connection.query_with_retry(store_marker)?;
    match store.get_if_present(MARKER_OBJECT)? {
        Some(found) if found == marker.as_bytes() => Ok(()),
        None if !is_marked => Ok(()),
        found => Err(wrong_store_error(found.is_some())),
    }
}

/// As [`verify`], for a station: writes the marker into the store of a new school.
pub fn verify_or_create(connection: &mut DbConnection, store: &ObjectStoreHandle) -> Result<(), SyncError> {
    let (marker, is_marked) = connection.query_with_retry(store_marker)?;
    match store.get_if_present(MARKER_OBJECT)? {
        // Nothing writes the marker any more: what is left of it is of a station that was stopped while it did.
        Some(found) if found == marker.as_bytes() && is_marked => store.remove_partial_uploads(""),
        Some(found) if found == marker.as_bytes() => {}
        None if !is_marked => put_marker(store, &marker)?,
        found => return Err(SyncError::WrongStore(wrong_store_error(found.is_some()))),
    }
    if !is_marked {
        connection.query_with_retry(confirm_store_marker)?;
    }
    Ok(())
}

/// Writes the marker, which other stations may write at the same time.
fn put_marker(store: &ObjectStoreHandle, marker: &str) -> Result<(), StoreError> {
    let Err(error) = store.put(MARKER_OBJECT, marker.as_bytes().to_vec()) else { return Ok(()) };
    match store.get_if_present(MARKER_OBJECT) {
        Ok(Some(found)) if found == marker.as_bytes() => Ok(()),
        _ => Err(error),
    }
}

fn wrong_store_error(is_marked: bool) -> CliError {
    CliError::wrong(match is_marked {
        true => "--store: wrong-store: the store belongs to another database",
        false => {
            "--store: wrong-store: this is not the store to which the school's sessions were sent; check that its disk \
             is mounted and its address is correct"
        }
    })
}
