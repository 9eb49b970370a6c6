//! Bundles: a session's folder, written completely or not at all, and verified byte by byte.
//!
//! While a session runs, its recording grows in a folder named `….partial`; when all files are written, the folder is
//! renamed. All other files follow from the recording: [`verify`] derives them again and compares. Every file is synced
//! to the disk before the folder is renamed, so that a bundle is whole even after a power cut.

use super::first_result::FirstResult;
use super::session_file::SessionFile;
use super::templates::Templates;
use super::verification::with_template_name;
use super::{glb, labelmap, pictures, session_page};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fmt;
use std::fs;
use std::fs::{File, TryLockError};
use std::io;
use std::io::Write;
use std::path::{Component, Path, PathBuf};
use typodont_core::tick::Tick;
use typodont_exercise::record;
use typodont_exercise::record::{Recording, RecordingError, ReplayCheck};
use typodont_exercise::scenario::hex;
use typodont_exercise::score;
use typodont_exercise::score::Scored;

/// Name of the result within a bundle.
pub const SESSION_FILE: &str = "session.json";

/// Name of the page within a bundle.
pub const REPORT_FILE: &str = "report.html";

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
pub struct PartialBundle {
    partial: PathBuf,
    path: PathBuf,
    /// The locked file, by which other programs see that the session is not interrupted; `None` where the file system
    /// has no locks.
    lock: Option<File>,
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
        Ok(PartialBundle { partial, path, lock })
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
            lock => Ok(PartialBundle { partial: partial.to_path_buf(), path, lock: lock.into_file() }),
        }
    }

    /// Removes the folder of a session that never began.
    pub fn abandon(self) {
        // A folder that cannot be removed stays, with the ending `.partial`.
        let _ = fs::remove_dir_all(&self.partial);
    }

    /// Path of the recording.
    pub fn recording_path(&self) -> PathBuf {
        self.partial.join(record::FILE_NAME)
    }

    /// Reveals the seed of a sealed session that was cut off, by the examiner's code.
    ///
    /// # Errors
    ///
    /// When the recording cannot be read or written, is not sealed, or was sealed with another code.
    pub fn reveal_seed(&self, code: &str) -> Result<(), BundleError> {
        let path = self.recording_path();
        let unmade = |why: String| BundleError::new(&self.partial, why);
        let bytes = fs::read(&path).map_err(|e| unmade(e.to_string()))?;
        let revealed = record::reveal(&bytes, code).map_err(unmade)?;
        // The recording is replaced as a whole, so that a power cut leaves one or the other.
        let copy = path.with_extension("revealed");
        let replaced = write_synced(&copy, &revealed).and_then(|()| fs::rename(&copy, &path));
        sync_folder(&self.partial);
        replaced.map_err(|error| {
            let _ = fs::remove_file(&copy);
            unmade(error.to_string())
        })
    }

    /// Scores the finished recording, writes all files that follow from it, and renames the folder.
    ///
    /// # Errors
    ///
    /// When the recording cannot be scored or a file cannot be written; the folder then stays `….partial`.
    pub fn complete(self, templates: &Templates, observer: CompletionObserver) -> Result<PathBuf, BundleError> {
        self.complete_checked(templates, ReplayCheck::Skip, observer).map(|completed| completed.path)
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
        let PartialBundle { partial, path, lock } = self;
        let unmade = |why: String| BundleError::new(&partial, why);
        let unwritten = |name: &str, e: &io::Error| {
            let why = format!("{name}: {}", typodont_formats::write_failure(e));
            BundleError { remedy: Remedy::Finish, ..unmade(why) }
        };
        let bytes = match fs::read(partial.join(record::FILE_NAME)) {
            // The session was killed before it had created its recording.
            Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
            read => read.map_err(|e| unmade(e.to_string()))?,
        };
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
        fs::create_dir_all(partial.join("views")).map_err(|e| unwritten("views", &e))?;
        for (name, bytes) in files {
            write_synced(&partial.join(&name), &bytes).map_err(|e| unwritten(&name, &e))?;
        }
        for folder in [&partial.join("views"), &partial] {
            sync_folder(folder);
        }
        // Some systems do not rename a folder with an open file.
        drop(lock);
        let _ = fs::remove_file(partial.join(LOCK_FILE));
        fs::rename(&partial, &path).map_err(|e| unwritten("the folder cannot be renamed", &e))?;
        sync_folder(path.parent().unwrap_or(Path::new(".")));
        let difference = scored
            .replay
            .difference
            .map(|d| format!("{}: {d}; `typodont verify` will not confirm this bundle", record::FILE_NAME));
        let loss = recording.describe_loss().map(|loss| format!("{}: {loss}", record::FILE_NAME));
        Ok(CompletedBundle { path, remarks: loss.into_iter().chain(difference).collect() })
    }
}

impl BundleError {
    fn new(path: &Path, why: impl Into<String>) -> BundleError {
        BundleError { path: path.to_path_buf(), why: why.into(), remedy: Remedy::None }
    }
}

/// The bundle of an interrupted session.
#[derive(Clone, Debug)]
pub struct CompletedBundle {
    pub path: PathBuf,
    /// Parts of the session that were lost, and differences of its replay.
    pub remarks: Vec<String>,
}

/// Writes a file and syncs it to the disk.
fn write_synced(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(bytes)?;
    file.sync_data()
}

/// Syncs the names in a folder to the disk, where the system can. A file system that cannot is not an error: the files
/// are written in any case.
pub fn sync_folder(folder: &Path) {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let _ = File::open(folder).and_then(|folder| folder.sync_all());
}

/// Everything in a bundle that follows from its recording, by name.
fn derive_files(
    recording: &Recording,
    bytes: &[u8],
    scored: &Scored,
    templates: &Templates,
    observer: CompletionObserver,
) -> Result<BTreeMap<String, Vec<u8>>, String> {
    observer(CompletionStep::Maps);
    let mut files = derive_maps(recording, scored)?;
    observer(CompletionStep::Surfaces);
    files.insert("performance.glb".to_string(), glb::encode(&pictures::surface_parts(scored))?);
    let views = pictures::all_pictures(recording, scored, &mut |done, all| {
        observer(CompletionStep::Pictures { done, all });
    });
    observer(CompletionStep::Page);
    files.extend(views.iter().map(|view| (format!("views/{}.png", view.name), view.png.clone())));
    let mut session = SessionFile::of(recording, scored);
    session.digests = files.iter().map(|(name, bytes)| (name.clone(), sha256(bytes))).collect();
    session.digests.insert(record::FILE_NAME.to_string(), sha256(bytes));
    session.template_sha256 = sha256(templates.session_source_text().as_bytes());
    let page = session_page::render(templates, recording, scored, &session, &views)?;
    let page = with_template_name(&page, &session.template_sha256);
    session.digests.insert(REPORT_FILE.to_string(), sha256(page.as_bytes()));
    files.insert(REPORT_FILE.to_string(), page.into_bytes());
    files.insert(SESSION_FILE.to_string(), session.to_json().into_bytes());
    Ok(files)
}

/// Label maps and removal times, by file name.
pub(super) fn derive_maps(recording: &Recording, scored: &Scored) -> Result<BTreeMap<String, Vec<u8>>, String> {
    let workpiece = &scored.replay.workpiece;
    let tissues = &recording.scenario.tissues;
    let grid = workpiece.volume.grid();
    Ok(BTreeMap::from([
        ("initial.seg.nrrd".to_string(), labelmap::tissues(&workpiece.volume, tissues)?),
        ("final.seg.nrrd".to_string(), labelmap::tissues(&scored.replay.volume, tissues)?),
        ("performance.seg.nrrd".to_string(), labelmap::performance(grid, &scored.verdicts)?),
        ("removal_time.nrrd".to_string(), labelmap::removal_times(grid, &scored.removals)?),
    ]))
}

pub fn sha256(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

/// Result of [`verify`].
#[derive(Clone, Debug, Default)]
pub struct Verification {
    /// Differences between the bundle and its recording.
    pub complaints: Vec<String>,
    /// Parts that could not be judged.
    pub unverified: Vec<String>,
    /// Facts that are no differences, such as a session that was cut off.
    pub remarks: Vec<String>,
}

/// Answer of a [`Verification`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VerificationOutcome {
    /// Everything was judged and follows from the recording.
    Verified,
    /// Everything that could be judged follows from the recording.
    PartlyVerified,
    /// Something differs from the recording.
    Differs,
}

impl Verification {
    pub fn outcome(&self) -> VerificationOutcome {
        match (self.complaints.is_empty(), self.unverified.is_empty()) {
            (false, _) => VerificationOutcome::Differs,
            (true, false) => VerificationOutcome::PartlyVerified,
            (true, true) => VerificationOutcome::Verified,
        }
    }
}

/// Replays a bundle's recording, derives all other files again, and compares. The page is made again from the templates
/// among `known` that the bundle names. Of a bundle from another version of the program, the recording, the results and
/// the digests are verified, but not its pages and pictures.
///
/// A session that was cut off verifies as what it is: its result must say so, and follow from the part that can be read.
///
/// # Errors
///
/// When nothing can be verified: the recording is missing or cannot be read, or `known` is empty.
pub fn verify(bundle: &Path, known: &[Templates]) -> Result<Verification, String> {
    let path = bundle.join(record::FILE_NAME);
    let bytes = typodont_formats::read_file(&path).map_err(|d| d.headline())?;
    let recording = Recording::parse(&path.display().to_string(), &bytes).map_err(|e| e.to_string())?;
    let (made_by, this) = (&recording.head.typodont_version, env!("CARGO_PKG_VERSION"));
    let scored = score::score(&recording, ReplayCheck::Full).map_err(|e| format!("{}: {e}", path.display()))?;
    let loss = recording.describe_loss().map(|loss| format!("{}: {loss}", record::FILE_NAME));
    let mut verification = Verification { remarks: loss.into_iter().collect(), ..Verification::default() };
    let complaints = &mut verification.complaints;
    complaints.extend(scored.replay.difference.iter().map(|d| format!("{}: {d}", record::FILE_NAME)));
    let (written, session) = match read_session_file(bundle) {
        Ok(read) => read,
        Err(error) => {
            complaints.push(error);
            return Ok(verification);
        }
    };
    complaints.extend(compare_files(bundle, &bytes, &session));
    complaints.extend(compare_results(&SessionFile::of(&recording, &scored), &session));
    complaints.extend(unlisted_files(bundle, &session).iter().map(|name| unlisted_complaint(name)));
    if made_by != this {
        // The results are compared in any case; the drawings and texts of another version cannot be.
        let part = format!("its pages and images, which were made by typodont {made_by} (this is version {this})");
        verification.unverified.push(part);
    } else if complaints.is_empty() {
        let own = known.iter().find(|t| session.template_sha256 == sha256(t.session_source_text().as_bytes()));
        let templates = own.or(known.first()).ok_or("no templates are known")?;
        let derived = derive_files(&recording, &bytes, &scored, templates, &mut |_| ())?;
        complaints.extend(compare_derived(bundle, &session, &derived, &written, own.is_some()));
        if own.is_none() {
            let part = format!("{REPORT_FILE}, which was made from templates that are not available here");
            verification.unverified.push(part);
        }
    }
    Ok(verification)
}

/// Reads `session.json`: its bytes and its content. The error is a complaint.
fn read_session_file(bundle: &Path) -> Result<(Vec<u8>, SessionFile), String> {
    let is_unfinished = is_partial(bundle) && !bundle.join(SESSION_FILE).exists();
    if is_unfinished {
        let bundle = bundle.display();
        return Err(format!("this session was not finished; `typodont finish {bundle}` makes its bundle"));
    }
    let written = read_plain_file(bundle, SESSION_FILE).map_err(|e| format!("{SESSION_FILE}: {e}"))?;
    let session = serde_json::from_slice(&written).map_err(|e| format!("{SESSION_FILE}: {e}"))?;
    Ok((written, session))
}

/// Names of files that `session.json` does not name.
pub(super) fn unlisted_files(bundle: &Path, session: &SessionFile) -> Vec<String> {
    let in_folder = |folder: &str| -> Vec<String> {
        let entries = fs::read_dir(bundle.join(folder)).into_iter().flatten().flatten();
        entries.map(|e| format!("{folder}{}", e.file_name().to_string_lossy())).collect()
    };
    let is_ours = |name: &String| session.digests.contains_key(name) || name == SESSION_FILE || name == "views";
    let mut found: Vec<String> = in_folder("").into_iter().chain(in_folder("views/")).collect();
    found.retain(|name| !is_ours(name));
    found.sort();
    found
}

pub(super) fn unlisted_complaint(name: &str) -> String {
    format!("{name}: this file is not part of a bundle")
}

/// [`verify`] for a recording without a bundle: compares its replay with the states that it contains. Whatever followed
/// the end of a cut-off recording is not judged.
///
/// # Errors
///
/// When the recording or its workpiece cannot be read.
pub fn verify_recording(path: &Path) -> Result<Verification, String> {
    let recording = Recording::read(path).map_err(|e| e.to_string())?;
    let workpiece = recording.workpiece().map_err(|e| format!("{}: {e}", path.display()))?;
    let replay = record::replay(&recording, workpiece, ReplayCheck::Full, |_, _, _, _| ());
    let complaints = replay.difference.iter().map(ToString::to_string).collect();
    let kept = Tick(recording.len() as u64).seconds();
    let unjudged = recording.is_cut_off().then(|| format!("the end of the session, after {kept:.3} s"));
    let (unverified, remarks) = (unjudged.into_iter().collect(), recording.describe_loss().into_iter().collect());
    Ok(Verification { complaints, unverified, remarks })
}

/// Reads a file of a bundle. Only a regular file is read, never a link, a pipe or a device, which might be endless.
pub(super) fn read_plain_file(bundle: &Path, name: &str) -> Result<Vec<u8>, String> {
    let path = bundle.join(name);
    match fs::symlink_metadata(&path) {
        Err(error) => Err(error.to_string()),
        Ok(meta) if !meta.is_file() => Err("this is not a regular file".to_string()),
        Ok(_) => typodont_formats::read_file(&path).map_err(|d| d.message),
    }
}

/// Complaints about files whose SHA-256 differs from that in `session.json`.
pub(super) fn compare_files(bundle: &Path, recording: &[u8], session: &SessionFile) -> Vec<String> {
    let mut complaints = Vec::new();
    if session.digests.get(record::FILE_NAME) != Some(&sha256(recording)) {
        complaints.push(format!("{}: the file differs from the recording that was scored", record::FILE_NAME));
    }
    for (name, digest) in session.digests.iter().filter(|(n, _)| *n != record::FILE_NAME) {
        // A name that leads out of the folder is not a file of the bundle.
        if Path::new(name).components().any(|c| !matches!(c, Component::Normal(_))) {
            complaints.push(format!("{SESSION_FILE}: digests: \"{name}\" is not a file of a bundle"));
            continue;
        }
        match read_plain_file(bundle, name) {
            Err(error) => complaints.push(format!("{name}: {error}")),
            Ok(found) if *digest != sha256(&found) => {
                complaints.push(format!("{name}: the file differs from the digest in {SESSION_FILE}"));
            }
            Ok(_) => {}
        }
    }
    complaints
}

/// Complaints about files that differ from those derived from the recording.
fn compare_derived(
    bundle: &Path,
    session: &SessionFile,
    derived: &BTreeMap<String, Vec<u8>>,
    written: &[u8],
    is_our_page: bool,
) -> Vec<String> {
    let mut complaints = Vec::new();
    for (name, bytes) in derived {
        let follows = match name.as_str() {
            // Of a page made from a school's own template only the digest is known, which was compared.
            REPORT_FILE if !is_our_page => true,
            SESSION_FILE => with_digests_of_page(bytes, session).is_some_and(|text| text.as_bytes() == written),
            _ => read_plain_file(bundle, name).is_ok_and(|found| found == *bytes),
        };
        if !follows {
            complaints.push(format!("{name}: the file differs from the one derived from the recording"));
        }
    }
    complaints
}

/// Text of a derived `session.json` with the digests of the page and templates that the written one names.
fn with_digests_of_page(derived: &[u8], session: &SessionFile) -> Option<String> {
    let mut expected: SessionFile = serde_json::from_slice(derived).ok()?;
    expected.template_sha256.clone_from(&session.template_sha256);
    if let Some(page) = session.digests.get(REPORT_FILE) {
        expected.digests.insert(REPORT_FILE.to_string(), page.clone());
    }
    Some(expected.to_json())
}

/// Complaints about results that differ from those that a recording gives.
pub fn compare_results(expected: &SessionFile, session: &SessionFile) -> Vec<String> {
    let mut complaints = compare_facts(expected, session);
    complaints.extend(compare_scores(expected, session));
    complaints
}

/// Complaints about facts in `session.json` that differ from the recording's. No formula has a part in them.
pub(super) fn compare_facts(expected: &SessionFile, session: &SessionFile) -> Vec<String> {
    let differing = [
        ("scenario", expected.scenario != session.scenario),
        ("participant", expected.participant != session.participant),
        ("seed", expected.seed != session.seed),
        ("started", expected.started != session.started),
        ("ended_because", expected.ended_because != session.ended_because),
        ("operator", expected.operator != session.operator),
        ("typodont_version", expected.typodont_version != session.typodont_version),
        ("device", expected.device != session.device),
        ("tooth_fdi", expected.tooth_fdi != session.tooth_fdi),
        ("servo", expected.servo != session.servo),
    ];
    differing.into_iter().filter(|(_, differs)| *differs).map(|(name, _)| differing_part(name)).collect()
}

/// Complaints about measures, grade and answers in `session.json` that differ from the recording's.
pub(super) fn compare_scores(expected: &SessionFile, session: &SessionFile) -> Vec<String> {
    let mut complaints = Vec::new();
    let tell = |value: Option<f64>| value.map_or("none".to_string(), |v| v.to_string());
    for (name, &value) in &expected.metrics {
        let written = session.metrics.get(name).copied().flatten();
        if written != value {
            let (written, value) = (tell(written), tell(value));
            complaints.push(format!(
                "{SESSION_FILE}: metrics.{name}: the file has {written}, but the recording gives {value}"
            ));
        }
    }
    let is_more = session.metrics.keys().any(|name| !expected.metrics.contains_key(name));
    let differing = [
        ("metrics", is_more),
        ("evidence", expected.evidence != session.evidence),
        ("grade", expected.grade != session.grade),
        ("stages", expected.stages != session.stages),
        ("chart", expected.chart != session.chart),
        ("episodes", expected.episodes != session.episodes),
        ("seed_origin", expected.seed_origin != session.seed_origin),
        ("voxel_mm", expected.voxel_mm != session.voxel_mm),
        ("tooth_sha256", expected.tooth_sha256 != session.tooth_sha256),
        ("questionnaire", expected.questionnaire != session.questionnaire),
    ];
    complaints.extend(differing.into_iter().filter(|(_, differs)| *differs).map(|(name, _)| differing_part(name)));
    complaints
}

fn differing_part(name: &str) -> String {
    format!("{SESSION_FILE}: {name}: differs from the value that the recording gives")
}
