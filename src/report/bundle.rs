//! Bundles: a session's folder, written completely or not at all, and verified byte by byte.
//!
//! While a session runs, its recording grows in a folder named `….partial`; when all files are written, the folder is
//! renamed. All other files follow from the recording: [`verify`] derives them again and compares.

use super::session_file::SessionFile;
use super::templates::Templates;
use super::verification::with_template_name;
use super::{glb, labelmap, pictures, session_page};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fmt;
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};
use typodont_exercise::record;
use typodont_exercise::record::{Recording, ReplayCheck};
use typodont_exercise::scenario::hex;
use typodont_exercise::score;
use typodont_exercise::score::Scored;

/// Name of the result within a bundle.
pub const SESSION_FILE: &str = "session.json";

/// Name of the page within a bundle.
pub const REPORT_FILE: &str = "report.html";

/// Error while a bundle is made or read.
#[derive(Debug)]
pub struct BundleError {
    path: PathBuf,
    why: String,
}

impl fmt::Display for BundleError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}: unmade-bundle: {}", self.path.display(), self.why)
    }
}

impl std::error::Error for BundleError {}

/// A bundle whose session is still running.
#[derive(Debug)]
pub struct PartialBundle {
    partial: PathBuf,
    path: PathBuf,
}

impl PartialBundle {
    /// Creates the folder for a session that is about to begin.
    ///
    /// # Errors
    ///
    /// When the folder cannot be created, or a bundle of that name exists.
    pub fn create(out: &Path, name: &str) -> Result<PartialBundle, BundleError> {
        let (path, partial) = (out.join(name), out.join(format!("{name}.partial")));
        let unmade = |e: io::Error| BundleError { path: partial.clone(), why: e.to_string() };
        fs::create_dir_all(out).map_err(unmade)?;
        if path.exists() {
            return Err(BundleError { path, why: "a bundle with this name exists already".into() });
        }
        fs::create_dir(&partial).map_err(unmade)?;
        Ok(PartialBundle { partial, path })
    }

    /// Reopens the folder of a session that was interrupted.
    ///
    /// # Errors
    ///
    /// When the folder's name does not end in `.partial`, or the finished bundle exists.
    pub fn resume(partial: &Path) -> Result<PartialBundle, BundleError> {
        let path = match partial.extension().is_some_and(|e| e == "partial") {
            true => partial.with_extension(""),
            false => {
                let why = "the name of an unfinished session's folder must end in .partial".to_string();
                return Err(BundleError { path: partial.to_path_buf(), why });
            }
        };
        match path.exists() {
            true => Err(BundleError { path, why: "a bundle with this name exists already".into() }),
            false => Ok(PartialBundle { partial: partial.to_path_buf(), path }),
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

    /// Scores the finished recording, writes all files that follow from it, and renames the folder.
    ///
    /// # Errors
    ///
    /// When the recording cannot be scored or a file cannot be written; the folder then stays `….partial`.
    pub fn complete(self, templates: &Templates) -> Result<PathBuf, BundleError> {
        let PartialBundle { partial, path } = self;
        let unmade = |why: String| BundleError { path: partial.clone(), why };
        let bytes = fs::read(partial.join(record::FILE_NAME)).map_err(|e| unmade(e.to_string()))?;
        let recording = Recording::parse(record::FILE_NAME, &bytes).map_err(|e| unmade(e.to_string()))?;
        let scored = score::score(&recording, ReplayCheck::Skip).map_err(unmade)?;
        let files = derive_files(&recording, &bytes, &scored, templates).map_err(unmade)?;
        fs::create_dir_all(partial.join("views")).map_err(|e| unmade(e.to_string()))?;
        for (name, bytes) in files {
            fs::write(partial.join(&name), bytes).map_err(|e| unmade(format!("{name}: {e}")))?;
        }
        fs::rename(&partial, &path).map_err(|e| unmade(e.to_string()))?;
        Ok(path)
    }
}

/// Everything in a bundle that follows from its recording, by name.
fn derive_files(
    recording: &Recording,
    bytes: &[u8],
    scored: &Scored,
    templates: &Templates,
) -> Result<BTreeMap<String, Vec<u8>>, String> {
    let mut files = derive_maps(recording, scored)?;
    files.insert("performance.glb".to_string(), glb::encode(&pictures::surface_parts(scored))?);
    let views = pictures::all_pictures(recording, scored);
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

pub(super) fn sha256(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

/// Result of [`verify`].
#[derive(Clone, Debug, Default)]
pub struct Verification {
    /// Differences between the bundle and its recording.
    pub complaints: Vec<String>,
    /// Parts that could not be verified.
    pub unverified: Vec<String>,
}

/// Replays a bundle's recording, derives all other files again, and compares. Of a bundle from another version of the
/// program, the recording, the results and the digests are verified, but not its pages and pictures.
///
/// # Errors
///
/// When nothing can be verified: the recording is missing or cannot be read.
pub fn verify(bundle: &Path, templates: &Templates) -> Result<Verification, String> {
    let path = bundle.join(record::FILE_NAME);
    let bytes = typodont_formats::read_file(&path).map_err(|d| d.headline())?;
    let recording = Recording::parse(&path.display().to_string(), &bytes).map_err(|e| e.to_string())?;
    let (made_by, this) = (&recording.head.typodont_version, env!("CARGO_PKG_VERSION"));
    let scored = score::score(&recording, ReplayCheck::Full).map_err(|e| format!("{}: {e}", path.display()))?;
    let mut complaints: Vec<String> =
        scored.replay.difference.iter().map(|d| format!("{}: {d}", record::FILE_NAME)).collect();
    let written = match read_plain_file(bundle, SESSION_FILE) {
        Ok(written) => written,
        Err(error) => {
            complaints.push(format!("{SESSION_FILE}: {error}"));
            return Ok(Verification { complaints, ..Verification::default() });
        }
    };
    let session: SessionFile = match serde_json::from_slice(&written) {
        Ok(session) => session,
        Err(error) => {
            complaints.push(format!("{SESSION_FILE}: {error}"));
            return Ok(Verification { complaints, ..Verification::default() });
        }
    };
    complaints.extend(compare_files(bundle, &bytes, &session));
    complaints.extend(compare_results(&recording, &scored, &session));
    let mut unjudged = Vec::new();
    complaints.extend(unlisted_files(bundle, &session));
    if made_by != this {
        // The results are compared in any case; the drawings and texts of another version cannot be.
        unjudged.push(format!("its pages and images, which were made by typodont {made_by} (this is version {this})"));
    } else if complaints.is_empty() {
        let derived = derive_files(&recording, &bytes, &scored, templates)?;
        let is_our_page = session.template_sha256 == sha256(templates.session_source_text().as_bytes());
        complaints.extend(compare_derived(bundle, &session, &derived, &written, is_our_page));
        if !is_our_page {
            unjudged.push(format!("{REPORT_FILE}, which was made from a different template"));
        }
    }
    Ok(Verification { complaints, unverified: unjudged })
}

/// Complaints about files that `session.json` does not name.
pub(super) fn unlisted_files(bundle: &Path, session: &SessionFile) -> Vec<String> {
    let in_folder = |folder: &str| -> Vec<String> {
        let entries = fs::read_dir(bundle.join(folder)).into_iter().flatten().flatten();
        entries.map(|e| format!("{folder}{}", e.file_name().to_string_lossy())).collect()
    };
    let is_ours = |name: &String| session.digests.contains_key(name) || name == SESSION_FILE || name == "views";
    let mut found: Vec<String> = in_folder("").into_iter().chain(in_folder("views/")).collect();
    found.retain(|name| !is_ours(name));
    found.sort();
    found.iter().map(|name| format!("{name}: this file is not part of a bundle")).collect()
}

/// [`verify`] for a recording without a bundle: compares its replay with the states that it contains.
///
/// # Errors
///
/// When the recording or its workpiece cannot be read.
pub fn verify_recording(path: &Path) -> Result<Verification, String> {
    let recording = Recording::read(path).map_err(|e| e.to_string())?;
    let workpiece = recording.workpiece().map_err(|e| format!("{}: {e}", path.display()))?;
    let replay = record::replay(&recording, workpiece, ReplayCheck::Full, |_, _, _, _| ());
    let complaints = replay.difference.iter().map(ToString::to_string).collect();
    Ok(Verification { complaints, ..Verification::default() })
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

/// Complaints about results in `session.json` that differ from the recording's.
fn compare_results(recording: &Recording, scored: &Scored, session: &SessionFile) -> Vec<String> {
    let expected = SessionFile::of(recording, scored);
    let mut complaints = compare_facts(&expected, session);
    complaints.extend(compare_scores(&expected, session));
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
        ("questionnaire", expected.questionnaire != session.questionnaire),
    ];
    complaints.extend(differing.into_iter().filter(|(_, differs)| *differs).map(|(name, _)| differing_part(name)));
    complaints
}

fn differing_part(name: &str) -> String {
    format!("{SESSION_FILE}: {name}: differs from the value that the recording gives")
}
