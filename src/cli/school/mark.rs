//! Whether a store is the one that the records know: a word of theirs lies in it.
//!
//! A folder whose disk is not mounted looks like an empty store. Whoever took it for the school's would set aside what can be
//! scored, and call erased what lies on that disk.

use super::asking::Line;
use super::store::Store;
use super::sync::Stopped;
use crate::cli::Failure;
use crate::school::records::{store_is_marked, store_word};

/// Name of the object that holds the word.
const MARK: &str = "typodont-store";

/// Refuses a store that is another than the records'. One that nobody has sent anything to is as good as any.
pub fn check(line: &mut Line, store: &Store) -> Result<(), Failure> {
    let (word, is_marked) = line.ask(store_word)?;
    match store.find(MARK)? {
        Some(found) if found == word.as_bytes() => Ok(()),
        None if !is_marked => Ok(()),
        found => Err(wrong(found.is_some())),
    }
}

/// The same for a station, which lays the word into a new school's store.
pub fn check_or_lay(line: &mut Line, store: &Store) -> Result<(), Stopped> {
    let (word, is_marked) = line.ask(store_word)?;
    match store.find(MARK)? {
        Some(found) if found == word.as_bytes() => {}
        None if !is_marked => store.put(MARK, word.into_bytes())?,
        found => return Err(Stopped::WrongStore(wrong(found.is_some()))),
    }
    if !is_marked {
        line.ask(store_is_marked)?;
    }
    Ok(())
}

fn wrong(is_marked: bool) -> Failure {
    Failure::wrong(match is_marked {
        true => "--store: wrong-store: it belongs to another school's records",
        false => {
            "--store: wrong-store: it is not the one that the school's sessions were sent to; is its disk mounted, is its \
             address right?"
        }
    })
}
