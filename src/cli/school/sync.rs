//! `typodont sync`: uploads a station's finished bundles: first the files, then the row in the database.

use super::database::DatabaseArguments;
use super::store_arguments::StoreArguments;
use super::store_marker;
use crate::cli::progress::progress_bar;
use crate::cli::{CliError, print_line, station, verification};
use clap::Args;
use sha2::{Digest, Sha256};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;
use typodont_integrations::session_id;
use typodont_report::bundle::BundleFolder;
use typodont_report::cohort::{find_bundles, read_session};
use typodont_report::sanitize_display;
use typodont_report::{SessionFile, Verifier};
use typodont_school::connection::{DbConnection, DbError};
use typodont_school::records;
use typodont_school::records::{InsertOutcome, NewSession, SyncStatus};
use typodont_school::retry::Transient;
use typodont_school::store::{ObjectStoreHandle, StoreError};
use typodont_school::{ArchiveError, BundleArchive};

#[derive(Args)]
pub struct Arguments {
    /// Folder that contains bundles, at any depth
    folder: PathBuf,
    /// Class to which the sessions belong; without it that of the station's file
    #[arg(long, value_name = "NAME")]
    class: Option<String>,
    #[command(flatten)]
    at: DatabaseArguments,
    #[command(flatten)]
    store: StoreArguments,
    /// Delete local bundles whose session or participant the school has erased
    #[arg(long)]
    remove_erased: bool,
    /// Keep running and send finished sessions until the program is stopped
    #[arg(long)]
    stay: bool,
}

/// Number of sessions per status query.
const STATUS_BATCH: usize = 500;

/// Poll interval of the folder.
const POLL_INTERVAL: Duration = Duration::from_secs(5);

/// Maximum length of a printed path or reason, characters.
const PRINTED_MAX: usize = 300;

/// Counts of one synchronisation.
#[derive(Default)]
struct SyncStats {
    sent: usize,
    known: usize,
    erased: usize,
    refused: usize,
}

/// Reason why a synchronisation was interrupted.
pub enum SyncError {
    Database(DbError),
    Store(StoreError),
    /// The store is not the one that belongs to the records.
    WrongStore(CliError),
    UnknownClass,
}

impl From<DbError> for SyncError {
    fn from(unanswered: DbError) -> SyncError {
        SyncError::Database(unanswered)
    }
}

impl From<StoreError> for SyncError {
    fn from(undone: StoreError) -> SyncError {
        SyncError::Store(undone)
    }
}

/// A bundle in the station's folder.
struct LocalBundle {
    path: PathBuf,
    session: SessionFile,
}

impl Arguments {
    /// Takes the class from the station's file if none is given.
    fn with_class_of_station(mut self) -> Result<Arguments, CliError> {
        if self.class.is_none() {
            self.class = station::find(None)?.and_then(|station| station.class);
        }
        match self.class {
            Some(_) => Ok(self),
            None => Err(CliError::misuse("--class is required: the machine has no station file that names a class")),
        }
    }

    fn class(&self) -> &str {
        self.class.as_deref().unwrap_or_default()
    }
}

pub fn run(arguments: Arguments) -> Result<(), CliError> {
    let arguments = &arguments.with_class_of_station()?;
    let Arguments { folder, at, store, stay, .. } = arguments;
    if !folder.is_dir() {
        return Err(CliError::wrong(format!("{}: missing-folder: the folder does not exist", folder.display())));
    }
    let mut connection = at.connection()?;
    let store = store.open(at.retry_policy()?)?;
    // Before anything is sent: an unreadable template is a mistake to be mended, not a reason to send unchecked bundles.
    let verifier = verification::verifier()?;
    let mut reported = BTreeSet::new();
    let mut swept = BTreeSet::new();
    loop {
        let mut stats = SyncStats::default();
        let (log, kept) = (&mut reported, &mut swept);
        let sync_error = sync_once(arguments, &verifier, &mut connection, &store, &mut stats, log, kept).err();
        let words = describe(&stats);
        match sync_error {
            None if !stay && stats.refused == 0 => return print_line(words),
            None if !stay => {
                print_line(words)?;
                return Err(CliError::AlreadyReported);
            }
            None => {
                if stats.sent > 0 {
                    print_line(words)?;
                }
            }
            Some(SyncError::UnknownClass) => return Err(unknown_class_error(arguments.class())),
            Some(SyncError::WrongStore(failure)) if !stay => return Err(failure),
            Some(SyncError::Database(DbError::Rejected(error))) => return Err(DbError::Rejected(error).into()),
            Some(SyncError::Database(away)) if !stay => return Err(offline_error(away.into(), &words)),
            Some(SyncError::Store(undone)) if !stay => return Err(offline_error(undone.into(), &words)),
            // A station continues without the school: finished bundles wait in its folder.
            Some(SyncError::WrongStore(failure)) => {
                if reported.insert("wrong-store".into()) {
                    failure.report();
                }
            }
            // An unavailable store is tried again without a message; a refusal is reported once.
            Some(SyncError::Store(undone)) if !undone.is_transient() && reported.insert(undone.why.clone()) => {
                CliError::from(undone).report();
            }
            Some(SyncError::Database(_) | SyncError::Store(_)) => {}
        }
        thread::sleep(POLL_INTERVAL);
    }
}

fn describe(stats: &SyncStats) -> String {
    let SyncStats { sent, known, erased, refused } = stats;
    format!("{sent} sessions sent, {known} already stored, {erased} erased by the school, {refused} refused")
}

pub fn unknown_class_error(class: &str) -> CliError {
    let class = sanitize_display(class, 80);
    CliError::wrong(format!(
        "--class: unknown-class: there is no class \"{class}\"; create it with `typodont school \
    class`"
    ))
}

fn offline_error(failure: CliError, words: &str) -> CliError {
    CliError::wrong(format!("{}; so far {words}; the others remain here and are sent next time", failure.message()))
}

fn sync_once(
    arguments: &Arguments,
    verifier: &Verifier,
    connection: &mut DbConnection,
    store: &ObjectStoreHandle,
    stats: &mut SyncStats,
    reported: &mut BTreeSet<String>,
    swept: &mut BTreeSet<String>,
) -> Result<(), SyncError> {
    let mut complain = |path: &Path, why: &str| {
        let text = format!(
            "{}: {}",
            sanitize_display(&path.display().to_string(), PRINTED_MAX),
            sanitize_display(why, PRINTED_MAX)
        );
        // With --stay, the same message is not repeated every five seconds.
        if reported.insert(text.clone()) {
            eprintln!("{text}");
        }
    };
    let found = find_local_bundles(&arguments.folder, &mut complain);
    let station = connection.query_with_retry(records::login_name)?;
    if !connection.query_with_retry(|client| records::has_class(client, arguments.class()))? {
        return Err(SyncError::UnknownClass);
    }
    store_marker::verify_or_create(connection, store)?;
    let mut orphans = OrphanSweep { store, station: &station, swept };
    let new = select_new(arguments, connection, stats, &mut orphans, &found, &mut complain)?;
    let bar = progress_bar(new.len() as u64, "sent");
    // One after the other: the station's processors belong to the session that is running.
    for found in new {
        let status = verifier.verify(&BundleFolder::on_disk(&found.path), &found.session);
        if status.differs() {
            stats.refused += 1;
            complain(&found.path, &format!("differs: the bundle was not sent: {}", status.note()));
            bar.inc(1);
            continue;
        }
        match upload_session(arguments, connection, store, &station, found)? {
            Ok(InsertOutcome::Inserted) => stats.sent += 1,
            Ok(InsertOutcome::AlreadyInserted | InsertOutcome::OtherStation) => stats.known += 1,
            Ok(InsertOutcome::Erased) => handle_erased(arguments, stats, found, &mut complain),
            Ok(InsertOutcome::UnknownClass) => return Err(SyncError::UnknownClass),
            Err(why) => {
                stats.refused += 1;
                complain(&found.path, &why);
            }
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(())
}

/// Folder of the store that holds a station's copy of a session.
fn store_folder(station: &str, session: &SessionFile) -> String {
    format!("{station}/{}", session_id(session))
}

/// Removal of parts to which no row refers: a station that is stopped after the upload, but before it learns that the
/// session was erased or sent by another station, leaves them in the store.
struct OrphanSweep<'a> {
    store: &'a ObjectStoreHandle,
    station: &'a str,
    /// Folders that were searched; with `--stay` each is searched once.
    swept: &'a mut BTreeSet<String>,
}

impl OrphanSweep<'_> {
    /// Removes this station's parts of a session of which it has no row.
    fn remove(&mut self, session: &SessionFile) -> Result<(), StoreError> {
        let folder = store_folder(self.station, session);
        if !self.swept.contains(&folder) {
            self.store.remove_folder(&folder)?;
            self.swept.insert(folder);
        }
        Ok(())
    }
}

/// Bundles that the school does not yet have. Counts the others, and reports those that were changed or erased.
fn select_new<'a>(
    arguments: &Arguments,
    connection: &mut DbConnection,
    stats: &mut SyncStats,
    orphans: &mut OrphanSweep,
    all: &'a [LocalBundle],
    complain: &mut impl FnMut(&Path, &str),
) -> Result<Vec<&'a LocalBundle>, SyncError> {
    let mut new = Vec::new();
    for some in all.chunks(STATUS_BATCH) {
        let sessions: Vec<&SessionFile> = some.iter().map(|found| &found.session).collect();
        let standing = connection.query_with_retry(|client| records::sync_status(client, &sessions))?;
        let ids: Vec<String> = sessions.iter().map(|session| session_id(session)).collect();
        let written = connection.query_with_retry(|client| records::session_digests(client, &ids))?;
        for (found, standing) in some.iter().zip(standing) {
            match standing {
                SyncStatus::New => new.push(found),
                SyncStatus::Known => {
                    stats.known += 1;
                    match written.get(&session_id(&found.session)) {
                        Some(digest) if *digest != session_file_digest(&found.path) => complain(
                            &found.path,
                            "changed: session.json differs from the version that was sent; the version that was sent \
                             is valid",
                        ),
                        Some(_) => {}
                        // Another station sent the session.
                        None => orphans.remove(&found.session)?,
                    }
                }
                SyncStatus::Erased => {
                    orphans.remove(&found.session)?;
                    handle_erased(arguments, stats, found, complain);
                }
            }
        }
    }
    Ok(new)
}

/// All bundles below a folder, each session once.
fn find_local_bundles(folder: &Path, complain: &mut impl FnMut(&Path, &str)) -> Vec<LocalBundle> {
    let all = find_bundles(folder);
    for (path, why) in &all.skipped {
        complain(path, why);
    }
    let mut known = BTreeSet::new();
    let mut found = Vec::new();
    for file in all.files {
        let path = file.parent().unwrap_or(folder).to_path_buf();
        match read_session(&file) {
            Ok(session) if known.insert(session_id(&session)) => found.push(LocalBundle { path, session }),
            Ok(_) => complain(&path, "skipped: another bundle in this folder contains the same session"),
            Err(why) => complain(&path, &format!("skipped: {why}")),
        }
    }
    found
}

fn handle_erased(
    arguments: &Arguments,
    stats: &mut SyncStats,
    bundle: &LocalBundle,
    complain: &mut impl FnMut(&Path, &str),
) {
    stats.erased += 1;
    if !arguments.remove_erased {
        return complain(
            &bundle.path,
            "erased: the school has erased this session; delete the bundle, or give \
        --remove-erased",
        );
    }
    if let Err(error) = std::fs::remove_dir_all(&bundle.path) {
        complain(&bundle.path, &format!("erased: the bundle cannot be deleted: {error}"));
    }
}

/// Uploads one bundle. The inner `Err` is the reason of a permanent refusal.
fn upload_session(
    arguments: &Arguments,
    connection: &mut DbConnection,
    store: &ObjectStoreHandle,
    station: &str,
    found: &LocalBundle,
) -> Result<Result<InsertOutcome, String>, SyncError> {
    let folder = store_folder(station, &found.session);
    let text = match typodont_formats::read_text(&found.path.join(typodont_report::bundle::SESSION_FILE)) {
        Ok(source) => source.text.clone(),
        Err(complaint) => return Ok(Err(complaint.message)),
    };
    let archive = match BundleArchive::of(&found.path, &found.session, folder.clone()) {
        Ok(pack) => pack,
        Err(why) => return Ok(Err(why.to_string())),
    };
    if let Err(why) = upload_parts(store, &archive)? {
        return Ok(Err(why.to_string()));
    }
    let bundle = found.path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let finished = NewSession {
        class: arguments.class(),
        bundle: &bundle,
        session: &found.session,
        session_json: &text,
        manifest: &archive.manifest,
    };
    let entered = match connection.query_with_retry(|client| records::insert_session(client, &finished)) {
        // Text that a database cannot store, such as a character with the value zero, or one that is too long.
        Err(DbError::Rejected(error)) if records::is_data_error(&error) => {
            store.remove_folder(&folder)?;
            return Ok(Err(format!("unkept-session: {}", records::describe_db_error(&error))));
        }
        entered => entered?,
    };
    if matches!(entered, InsertOutcome::OtherStation | InsertOutcome::Erased) {
        // The row in the database belongs to other files, or does not exist.
        store.remove_folder(&folder)?;
    }
    Ok(Ok(entered))
}

/// SHA-256 of a bundle's `session.json` as it would be sent; empty if the file is missing.
fn session_file_digest(bundle: &Path) -> String {
    let text = typodont_formats::read_text(&bundle.join(typodont_report::bundle::SESSION_FILE));
    text.map_or(String::new(), |source| typodont_exercise::scenario::hex(&Sha256::digest(source.text.as_bytes())))
}

/// Uploads the missing parts. Parts of an earlier attempt are read back and compared.
fn upload_parts(store: &ObjectStoreHandle, archive: &BundleArchive) -> Result<Result<(), ArchiveError>, StoreError> {
    store.remove_partial_uploads(&archive.manifest.folder);
    let stored = store.list(&archive.manifest.folder)?;
    for (index, part) in archive.manifest.parts.iter().enumerate() {
        let name = archive.manifest.part_name(index);
        if stored.iter().any(|(known, bytes)| *known == name && *bytes == part.bytes) {
            let digest = typodont_exercise::scenario::hex(&Sha256::digest(store.get(&name)?));
            if digest == part.sha256 {
                continue;
            }
        }
        match archive.part(index) {
            Ok(bytes) => store.put(&name, bytes)?,
            Err(why) => return Ok(Err(why)),
        }
    }
    for (name, _) in stored {
        // Parts of an earlier attempt with a different content of the bundle.
        if !(0..archive.manifest.parts.len()).any(|index| archive.manifest.part_name(index) == name) {
            store.remove(&name)?;
        }
    }
    Ok(Ok(()))
}
