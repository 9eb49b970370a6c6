//! A bundle while its session runs: the growing recording, on disk or in memory, and its completion.

use super::bundle_folder::{BundleFolder, VIEWS};
use super::derived_files::derive_files;
use crate::first_result::FirstResult;
use crate::templates::Templates;
use std::collections::BTreeMap;
use std::fmt;
use std::fs;
use std::fs::{File, TryLockError};
use std::io;
use std::io::{Cursor, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use typodont_exercise::record;
use typodont_exercise::record::{Recorder, RecorderError, Recording, RecordingError, RecordingHeadFile, ReplayCheck};
use typodont_exercise::scenario::{Scenario, Workpiece};
use typodont_exercise::score;
use typodont_formats::{remove_unfinished, sync_folder, write_atomically, write_synced};

/// Name of the file that a running session keeps locked in its folder.
const LOCK_FILE: &str = "session.lock";

/// Error while a bundle is made or read.
#[derive(Debug)]
pub struct BundleError {
    path: PathBuf,
    why: String,
    remedy: Remedy,
}

/// Advice to the person who meets a [`BundleError`].
#[derive(Debug)]
enum Remedy {
    None,
    /// The recording is on the disk; the bundle can be made later.
    Finish,
    /// The folder holds nothing of a session.
    Delete,
}

impl BundleError {
    fn new(path: &Path, why: impl Into<String>) -> BundleError {
        BundleError { path: path.to_path_buf(), why: why.into(), remedy: Remedy::None }
    }
}

impl fmt::Display for BundleError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let path = self.path.display();
        write!(f, "{path}: unmade-bundle: {}", self.why)?;
        match self.remedy {
            Remedy::None => Ok(()),
            Remedy::Finish => write!(
                f,
                "\nthe recording is safe in {path}; once the cause is removed, `typodont finish {path}` makes the bundle"
            ),
            Remedy::Delete => f.write_str("; the folder may be deleted"),
        }
    }
}

impl std::error::Error for BundleError {}

/// A bundle whose session is still running.
#[derive(Debug)]
pub struct PartialBundle(Storage);

#[derive(Debug)]
enum Storage {
    Disk(PartialFolder),
    Memory { name: String, recording: MemoryFile },
}

/// The folder of a running session on disk.
#[derive(Debug)]
struct PartialFolder {
    partial: PathBuf,
    path: PathBuf,
    /// The locked file, by which other programs see that the session is not interrupted; `None` where the file system
    /// has no locks.
    lock: Option<File>,
}

/// A file in memory, which its writer and the bundle share.
#[derive(Clone, Debug, Default)]
struct MemoryFile(Arc<Mutex<MemoryContent>>);

#[derive(Debug, Default)]
struct MemoryContent {
    cursor: Cursor<Vec<u8>>,
    /// Position from which the file may differ from its last [`RecordingChange`], bytes.
    changed_from: usize,
}

impl MemoryFile {
    fn of(bytes: Vec<u8>) -> MemoryFile {
        MemoryFile(Arc::new(Mutex::new(MemoryContent { cursor: Cursor::new(bytes), changed_from: 0 })))
    }

    fn lock(&self) -> MutexGuard<'_, MemoryContent> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn bytes(&self) -> Vec<u8> {
        self.lock().cursor.get_ref().clone()
    }
}

impl Write for MemoryFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut content = self.lock();
        content.changed_from = content.changed_from.min(content.cursor.position() as usize);
        content.cursor.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for MemoryFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.lock().cursor.seek(to)
    }
}

/// The growing recording of a bundle in memory, for whoever keeps a copy of it elsewhere.
#[derive(Debug)]
pub struct RecordingGrowth(MemoryFile);

/// A part of a recording that is new or was written again: it replaces everything from its offset on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordingChange {
    /// Position of the first byte in the recording.
    pub offset: usize,
    pub bytes: Vec<u8>,
}

impl RecordingGrowth {
    /// Everything that was written since the last call; `None` if that is nothing.
    pub fn take_change(&self) -> Option<RecordingChange> {
        let mut content = self.0.lock();
        let (offset, end) = (content.changed_from, content.cursor.get_ref().len());
        content.changed_from = end;
        (offset < end).then(|| RecordingChange { offset, bytes: content.cursor.get_ref()[offset..].to_vec() })
    }
}

/// A step in the completion of a bundle, in order.
#[derive(Clone, Debug)]
pub enum CompletionStep {
    /// The recording is being replayed and scored.
    Scoring,
    /// The result is known; the files are still to be made.
    Scored(Box<FirstResult>),
    /// The label maps are being written.
    Maps,
    /// The coloured surfaces are being made.
    Surfaces,
    /// Images are being drawn; `done` of `all` are finished.
    Pictures { done: usize, all: usize },
    /// The report page is being written.
    Page,
    /// All files are being saved.
    Saving,
}

/// Observer of the steps of a completion.
pub type CompletionObserver<'a> = &'a mut dyn FnMut(CompletionStep);

/// The bundle of a session that is over.
#[derive(Clone, Debug)]
pub struct CompletedBundle {
    pub folder: BundleFolder,
    /// Parts of the session that were lost, and differences of its replay.
    pub remarks: Vec<String>,
}

/// Lock of a session's folder.
enum SessionLock {
    Held(File),
    Unsupported,
    /// Another program holds it.
    Taken,
}

impl SessionLock {
    fn acquire(partial: &Path) -> SessionLock {
        match File::create(partial.join(LOCK_FILE)).map(|file| (file.try_lock(), file)) {
            Ok((Ok(()), file)) => SessionLock::Held(file),
            Ok((Err(TryLockError::WouldBlock), _)) => SessionLock::Taken,
            Ok((Err(TryLockError::Error(_)), _)) | Err(_) => SessionLock::Unsupported,
        }
    }

    fn into_file(self) -> Option<File> {
        if let SessionLock::Held(file) = self { Some(file) } else { None }
    }
}

/// True for the name of a folder whose bundle is not made yet.
pub fn is_partial(folder: &Path) -> bool {
    folder.extension().is_some_and(|extension| extension == "partial")
}

/// True if a program is still recording or completing the session of this folder.
pub fn is_in_use(partial: &Path) -> bool {
    let lock = File::open(partial.join(LOCK_FILE)).map(|file| file.try_lock_shared());
    matches!(lock, Ok(Err(TryLockError::WouldBlock)))
}

impl PartialBundle {
    /// Creates the folder for a session that is about to begin.
    ///
    /// # Errors
    ///
    /// When the folder cannot be created, or a bundle of that name exists.
    pub fn create(out: &Path, name: &str) -> Result<PartialBundle, BundleError> {
        let (path, partial) = (out.join(name), out.join(format!("{name}.partial")));
        let unmade = |e: io::Error| BundleError::new(&partial, typodont_formats::write_failure(&e));
        if let Some(file) = out.ancestors().find(|folder| folder.is_file()) {
            return Err(BundleError::new(file, "this is a file, not a folder"));
        }
        fs::create_dir_all(out).map_err(unmade)?;
        if path.exists() {
            return Err(BundleError::new(&path, "a bundle with this name exists already"));
        }
        fs::create_dir(&partial).map_err(unmade)?;
        let lock = SessionLock::acquire(&partial).into_file();
        Ok(PartialBundle(Storage::Disk(PartialFolder { partial, path, lock })))
    }

    /// Makes a bundle in memory, for a session that is about to begin.
    pub fn in_memory(name: &str) -> PartialBundle {
        PartialBundle(Storage::Memory { name: name.to_string(), recording: MemoryFile::default() })
    }

    /// The bundle of a session that was interrupted, of whose recording these bytes were kept.
    pub fn in_memory_from(name: &str, recording: Vec<u8>) -> PartialBundle {
        PartialBundle(Storage::Memory { name: name.to_string(), recording: MemoryFile::of(recording) })
    }

    /// Reopens the folder of a session that was interrupted.
    ///
    /// # Errors
    ///
    /// When the folder's name does not end in `.partial`, the finished bundle exists, or the session is still running.
    pub fn resume(partial: &Path) -> Result<PartialBundle, BundleError> {
        let path = match is_partial(partial) {
            true => partial.with_extension(""),
            false => {
                return Err(BundleError::new(
                    partial,
                    "the name of an unfinished session's folder must end in .partial",
                ));
            }
        };
        if path.exists() {
            return Err(BundleError::new(&path, "a bundle with this name exists already"));
        }
        if !partial.is_dir() {
            return Err(BundleError::new(partial, "there is no folder of this name"));
        }
        match SessionLock::acquire(partial) {
            SessionLock::Taken => {
                let why = "another program is still recording or completing this session; finish the session there";
                Err(BundleError::new(partial, why))
            }
            lock => {
                let lock = lock.into_file();
                Ok(PartialBundle(Storage::Disk(PartialFolder { partial: partial.to_path_buf(), path, lock })))
            }
        }
    }

    /// Removes the folder of a session that never began.
    pub fn abandon(self) {
        if let Storage::Disk(folder) = self.0 {
            // A folder that cannot be removed stays, with the ending `.partial`.
            let _ = fs::remove_dir_all(&folder.partial);
        }
    }

    /// Opens the recording and writes everything that is known before the first tick.
    ///
    /// # Errors
    ///
    /// When the recording cannot be created or written, or a volume cannot be encoded.
    pub fn start_recording(
        &self,
        head: &RecordingHeadFile,
        scenario: &Scenario,
        workpiece: &Workpiece,
    ) -> Result<Recorder, RecorderError> {
        match &self.0 {
            Storage::Disk(folder) => Recorder::create(&folder.recording_path(), head, scenario, workpiece),
            Storage::Memory { recording, .. } => {
                Recorder::start(Box::new(recording.clone()), Path::new(record::FILE_NAME), head, scenario, workpiece)
            }
        }
    }

    /// Folder of the running session on disk; `None` in memory.
    pub fn folder(&self) -> Option<&Path> {
        match &self.0 {
            Storage::Disk(folder) => Some(&folder.partial),
            Storage::Memory { .. } => None,
        }
    }

    /// Path of the recording on disk; `None` in memory.
    pub fn recording_path(&self) -> Option<PathBuf> {
        self.folder().map(|folder| folder.join(record::FILE_NAME))
    }

    /// The growing recording in memory; `None` on disk.
    pub fn growth(&self) -> Option<RecordingGrowth> {
        match &self.0 {
            Storage::Disk(_) => None,
            Storage::Memory { recording, .. } => Some(RecordingGrowth(recording.clone())),
        }
    }

    /// Name of the finished bundle.
    pub fn name(&self) -> String {
        match &self.0 {
            Storage::Disk(folder) => folder.path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            Storage::Memory { name, .. } => name.clone(),
        }
    }

    /// Bytes of the recording as far as they are written; none if it was never created.
    ///
    /// # Errors
    ///
    /// When the file cannot be read.
    pub fn recording(&self) -> Result<Vec<u8>, BundleError> {
        match &self.0 {
            Storage::Disk(folder) => match fs::read(folder.recording_path()) {
                // The session was killed before it had created its recording.
                Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Vec::new()),
                read => read.map_err(|e| BundleError::new(&folder.partial, e.to_string())),
            },
            Storage::Memory { recording, .. } => Ok(recording.bytes()),
        }
    }

    /// Reveals the seed of a sealed session that was cut off, by the examiner's code.
    ///
    /// # Errors
    ///
    /// When the recording cannot be read or written, is not sealed, or was sealed with another code.
    pub fn reveal_seed(&self, code: &str) -> Result<(), BundleError> {
        match &self.0 {
            Storage::Disk(folder) => folder.reveal_seed(code),
            Storage::Memory { name, recording } => {
                let mut recording = recording.lock();
                let revealed = record::reveal(recording.cursor.get_ref(), code);
                let bytes = revealed.map_err(|why| BundleError::new(Path::new(name), why))?;
                *recording = MemoryContent { cursor: Cursor::new(bytes), changed_from: 0 };
                Ok(())
            }
        }
    }

    /// Scores the finished recording, writes all files that follow from it, and renames the folder.
    ///
    /// # Errors
    ///
    /// When the recording cannot be scored or a file cannot be written; the folder then stays `….partial`.
    pub fn complete(self, templates: &Templates, observer: CompletionObserver) -> Result<BundleFolder, BundleError> {
        self.complete_checked(templates, ReplayCheck::Skip, observer).map(|completed| completed.folder)
    }

    /// [`PartialBundle::complete`] for a session that was interrupted: reads its recording as far as it is intact.
    ///
    /// # Errors
    ///
    /// As [`PartialBundle::complete`]; when nothing was recorded, the error says so.
    pub fn complete_interrupted(
        self,
        templates: &Templates,
        observer: CompletionObserver,
    ) -> Result<CompletedBundle, BundleError> {
        self.complete_checked(templates, ReplayCheck::Full, observer)
    }

    fn complete_checked(
        self,
        templates: &Templates,
        check: ReplayCheck,
        observer: CompletionObserver,
    ) -> Result<CompletedBundle, BundleError> {
        let bytes = self.recording()?;
        let unmade = |why: String| BundleError::new(self.0.path(), why);
        let recording = match Recording::parse(record::FILE_NAME, &bytes) {
            Err(error @ RecordingError::NothingRecorded { .. }) => {
                return Err(BundleError { remedy: Remedy::Delete, ..unmade(error.to_string()) });
            }
            parsed => parsed.map_err(|e| unmade(e.to_string()))?,
        };
        observer(CompletionStep::Scoring);
        let scored = score::score(&recording, check).map_err(unmade)?;
        observer(CompletionStep::Scored(Box::new(FirstResult::of(&recording, &scored, templates))));
        let files = derive_files(&recording, &bytes, &scored, templates, observer).map_err(unmade)?;
        observer(CompletionStep::Saving);
        let difference = scored
            .replay
            .difference
            .map(|d| format!("{}: {d}; `typodont verify` will not confirm this bundle", record::FILE_NAME));
        let loss = recording.describe_loss().map(|loss| format!("{}: {loss}", record::FILE_NAME));
        let folder = self.0.save(files, bytes)?;
        Ok(CompletedBundle { folder, remarks: loss.into_iter().chain(difference).collect() })
    }
}

impl Storage {
    /// Path of the running session's folder; in memory the bundle's name.
    fn path(&self) -> &Path {
        match self {
            Storage::Disk(folder) => &folder.partial,
            Storage::Memory { name, .. } => Path::new(name),
        }
    }

    /// Adds the files that follow from the recording, and finishes the bundle.
    fn save(self, mut files: BTreeMap<String, Vec<u8>>, recording: Vec<u8>) -> Result<BundleFolder, BundleError> {
        match self {
            Storage::Disk(folder) => folder.save(files).map(BundleFolder::OnDisk),
            Storage::Memory { name, .. } => {
                files.insert(record::FILE_NAME.to_string(), recording);
                Ok(BundleFolder::InMemory { name, files })
            }
        }
    }
}

impl PartialFolder {
    fn recording_path(&self) -> PathBuf {
        self.partial.join(record::FILE_NAME)
    }

    fn reveal_seed(&self, code: &str) -> Result<(), BundleError> {
        let path = self.recording_path();
        let unmade = |why: String| BundleError::new(&self.partial, why);
        let bytes = fs::read(&path).map_err(|e| unmade(e.to_string()))?;
        let revealed = record::reveal(&bytes, code).map_err(unmade)?;
        // The recording is replaced as a whole, so that a power cut leaves one or the other.
        write_atomically(&path, &revealed).map_err(|error| unmade(typodont_formats::write_failure(&error)))
    }

    /// Writes all files and renames the folder; returns its new path.
    fn save(self, files: BTreeMap<String, Vec<u8>>) -> Result<PathBuf, BundleError> {
        let PartialFolder { partial, path, lock } = self;
        let unwritten = |name: &str, e: &io::Error| {
            let why = format!("{name}: {}", typodont_formats::write_failure(e));
            BundleError { remedy: Remedy::Finish, ..BundleError::new(&partial, why) }
        };
        remove_unfinished(&partial.join(record::FILE_NAME));
        fs::create_dir_all(partial.join(VIEWS)).map_err(|e| unwritten(VIEWS, &e))?;
        for (name, bytes) in files {
            write_synced(&partial.join(&name), &bytes).map_err(|e| unwritten(&name, &e))?;
        }
        for folder in [&partial.join(VIEWS), &partial] {
            sync_folder(folder);
        }
        // Some systems do not rename a folder with an open file.
        drop(lock);
        let _ = fs::remove_file(partial.join(LOCK_FILE));
        fs::rename(&partial, &path).map_err(|e| unwritten("the folder cannot be renamed", &e))?;
        sync_folder(path.parent().unwrap_or(Path::new(".")));
        Ok(path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_changes_of_a_growing_recording_make_the_recording() {
        // Aim: a copy that is kept elsewhere is the recording, also where the writer goes back to fill in a length.
        let mut file = MemoryFile::default();
        let growth = RecordingGrowth(file.clone());
        assert_eq!(growth.take_change(), None);
        let mut copy = Vec::new();
        let mut keep = |expected: Option<usize>| {
            let change = growth.take_change();
            assert_eq!(change.as_ref().map(|change| change.offset), expected);
            if let Some(RecordingChange { offset, bytes }) = change {
                copy.truncate(offset);
                copy.extend(bytes);
            }
            copy.clone()
        };
        file.write_all(b"head....").unwrap();
        assert_eq!(keep(Some(0)), b"head....");
        file.write_all(b"chunk").unwrap();
        file.seek(SeekFrom::Start(4)).unwrap();
        file.write_all(b"0005").unwrap();
        file.seek(SeekFrom::End(0)).unwrap();
        assert_eq!(keep(Some(4)), b"head0005chunk");
        assert_eq!(keep(None), file.bytes());
        file.write_all(b"more").unwrap();
        assert_eq!(keep(Some(13)), b"head0005chunkmore");
    }
}
