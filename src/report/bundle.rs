//! A session's folder: made whole or not at all, and checked to the last byte.
//!
//! While a session runs its recording grows in a folder named `….partial`; when everything is there the folder gets its
//! name. Everything but the recording follows from the recording: [`verify`] makes it anew and compares.

use super::html::Templates;
use super::session_file::SessionFile;
use super::{glb, labelmap, pictures, session_page};
use crate::record::{self, Recording, Watch};
use crate::scenario::hex;
use crate::score::{self, Scored};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fmt;
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

/// Name of the result within a bundle.
pub const SESSION_FILE: &str = "session.json";

/// Name of the page within a bundle.
pub const REPORT_FILE: &str = "report.html";

/// Why a bundle cannot be made or read.
#[derive(Debug)]
pub struct Unmade {
    path: PathBuf,
    why: String,
}

impl fmt::Display for Unmade {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}: unmade-bundle: {}", self.path.display(), self.why)
    }
}

/// A bundle whose session still runs.
#[derive(Debug)]
pub struct Unfinished {
    partial: PathBuf,
    path: PathBuf,
}

impl Unfinished {
    /// Makes the folder for a session that is about to begin.
    pub fn begin(out: &Path, name: &str) -> Result<Unfinished, Unmade> {
        let (path, partial) = (out.join(name), out.join(format!("{name}.partial")));
        let unmade = |e: io::Error| Unmade { path: partial.clone(), why: e.to_string() };
        fs::create_dir_all(out).map_err(unmade)?;
        if path.exists() {
            return Err(Unmade { path, why: "there is a bundle of that name already".into() });
        }
        fs::create_dir(&partial).map_err(unmade)?;
        Ok(Unfinished { partial, path })
    }

    /// Takes up the folder that a session left which was cut off.
    pub fn resume(partial: &Path) -> Result<Unfinished, Unmade> {
        let path = match partial.extension().is_some_and(|e| e == "partial") {
            true => partial.with_extension(""),
            false => {
                let why = "an unfinished session's folder ends in .partial".to_string();
                return Err(Unmade { path: partial.to_path_buf(), why });
            }
        };
        match path.exists() {
            true => Err(Unmade { path, why: "there is a bundle of that name already".into() }),
            false => Ok(Unfinished { partial: partial.to_path_buf(), path }),
        }
    }

    /// Removes the folder of a session that never began.
    pub fn abandon(self) {
        // What cannot be removed stays, under a name that says it is nothing.
        let _ = fs::remove_dir_all(&self.partial);
    }

    /// Where the recording goes.
    pub fn recording(&self) -> PathBuf {
        self.partial.join(record::FILE_NAME)
    }

    /// Scores the finished recording, writes everything that follows from it, and gives the folder its name.
    pub fn complete(self, templates: &Templates) -> Result<PathBuf, Unmade> {
        let Unfinished { partial, path } = self;
        let unmade = |why: String| Unmade { path: partial.clone(), why };
        let bytes = fs::read(partial.join(record::FILE_NAME)).map_err(|e| unmade(e.to_string()))?;
        let recording = Recording::parse(record::FILE_NAME, &bytes).map_err(|e| unmade(e.to_string()))?;
        let scored = score::score(&recording, Watch::Nothing).map_err(unmade)?;
        let files = derive(&recording, &bytes, &scored, templates).map_err(unmade)?;
        fs::create_dir_all(partial.join("views")).map_err(|e| unmade(e.to_string()))?;
        for (name, bytes) in files {
            fs::write(partial.join(&name), bytes).map_err(|e| unmade(format!("{name}: {e}")))?;
        }
        fs::rename(&partial, &path).map_err(|e| unmade(e.to_string()))?;
        Ok(path)
    }
}

/// Everything in a bundle that follows from its recording, by name.
fn derive(
    recording: &Recording,
    bytes: &[u8],
    scored: &Scored,
    templates: &Templates,
) -> Result<BTreeMap<String, Vec<u8>>, String> {
    let workpiece = &scored.replay.workpiece;
    let tissues = &recording.scenario.tissues;
    let grid = workpiece.volume.grid();
    let mut files = BTreeMap::new();
    files.insert("initial.seg.nrrd".to_string(), labelmap::tissues(&workpiece.volume, tissues)?);
    files.insert("final.seg.nrrd".to_string(), labelmap::tissues(&scored.replay.volume, tissues)?);
    files.insert("performance.seg.nrrd".to_string(), labelmap::performance(grid, &scored.verdicts)?);
    files.insert("removal_time.nrrd".to_string(), labelmap::removal_times(grid, &scored.falls)?);
    files.insert("performance.glb".to_string(), glb::bytes(&pictures::parts(scored))?);
    let views = pictures::all(recording, scored);
    files.extend(views.iter().map(|view| (format!("views/{}.png", view.name), view.png.clone())));
    let mut session = SessionFile::of(recording, scored);
    session.digests = files.iter().map(|(name, bytes)| (name.clone(), sha256(bytes))).collect();
    session.digests.insert(record::FILE_NAME.to_string(), sha256(bytes));
    session.template_sha256 = sha256(templates.of_session().as_bytes());
    let page = session_page::render(templates, recording, scored, &session, &views)?;
    session.digests.insert(REPORT_FILE.to_string(), sha256(page.as_bytes()));
    files.insert(REPORT_FILE.to_string(), page.into_bytes());
    files.insert(SESSION_FILE.to_string(), session.text().into_bytes());
    Ok(files)
}

fn sha256(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

/// What there is to say about a bundle.
#[derive(Clone, Debug, Default)]
pub struct Judgement {
    /// What does not hold.
    pub complaints: Vec<String>,
    /// What could not be judged: with these a bundle holds as far as can be told, and no further.
    pub unjudged: Vec<String>,
}

/// Turns a bundle's recording again, makes everything that follows from it anew, and compares.
///
/// `Err` when it cannot be judged at all: no recording, or one that cannot be read. Of another version's bundle the recording,
/// the results and the files' digests are judged, but not what its pages look like.
pub fn verify(bundle: &Path, templates: &Templates) -> Result<Judgement, String> {
    let path = bundle.join(record::FILE_NAME);
    let bytes = crate::content::read_file(&path).map_err(|d| d.headline())?;
    let recording = Recording::parse(&path.display().to_string(), &bytes).map_err(|e| e.to_string())?;
    let (made_by, this) = (&recording.head.typodont_version, env!("CARGO_PKG_VERSION"));
    let scored = score::score(&recording, Watch::Everything).map_err(|e| format!("{}: {e}", path.display()))?;
    let mut complaints: Vec<String> =
        scored.replay.difference.iter().map(|d| format!("{}: {d}", record::FILE_NAME)).collect();
    let written = match read_part(bundle, SESSION_FILE) {
        Ok(written) => written,
        Err(error) => {
            complaints.push(format!("{SESSION_FILE}: {error}"));
            return Ok(Judgement { complaints, ..Judgement::default() });
        }
    };
    let session: SessionFile = match serde_json::from_slice(&written) {
        Ok(session) => session,
        Err(error) => {
            complaints.push(format!("{SESSION_FILE}: {error}"));
            return Ok(Judgement { complaints, ..Judgement::default() });
        }
    };
    complaints.extend(compare_files(bundle, &bytes, &session));
    complaints.extend(compare_results(&recording, &scored, &session));
    let mut unjudged = Vec::new();
    complaints.extend(strangers(bundle, &session));
    if made_by != this {
        // What the recording comes to is compared as ever; how another version drew and worded it cannot be.
        unjudged.push(format!("its pages and pictures, which typodont {made_by} made; this is {this}"));
    } else if complaints.is_empty() {
        let anew = derive(&recording, &bytes, &scored, templates)?;
        let is_our_page = session.template_sha256 == sha256(templates.of_session().as_bytes());
        complaints.extend(compare_derived(bundle, &session, &anew, &written, is_our_page));
        if !is_our_page {
            unjudged.push(format!("{REPORT_FILE}: made from another template than the one here"));
        }
    }
    Ok(Judgement { complaints, unjudged })
}

/// Files that the result does not name.
fn strangers(bundle: &Path, session: &SessionFile) -> Vec<String> {
    let in_folder = |folder: &str| -> Vec<String> {
        let entries = fs::read_dir(bundle.join(folder)).into_iter().flatten().flatten();
        entries.map(|e| format!("{folder}{}", e.file_name().to_string_lossy())).collect()
    };
    let is_ours = |name: &String| session.digests.contains_key(name) || name == SESSION_FILE || name == "views";
    let mut found: Vec<String> = in_folder("").into_iter().chain(in_folder("views/")).collect();
    found.retain(|name| !is_ours(name));
    found.sort();
    found.iter().map(|name| format!("{name}: is not part of a bundle")).collect()
}

/// [`verify`] for a recording without a bundle: whether it replays to what it says.
pub fn verify_recording(path: &Path) -> Result<Judgement, String> {
    let recording = Recording::read(path).map_err(|e| e.to_string())?;
    let workpiece = recording.workpiece().map_err(|e| format!("{}: {e}", path.display()))?;
    let replay = record::replay(&recording, workpiece, Watch::Everything, |_, _, _, _| ());
    let complaints = replay.difference.iter().map(ToString::to_string).collect();
    Ok(Judgement { complaints, ..Judgement::default() })
}

/// A file of a bundle: a plain one, never a link, a pipe or a device, which might have no end.
fn read_part(bundle: &Path, name: &str) -> Result<Vec<u8>, String> {
    let path = bundle.join(name);
    match fs::symlink_metadata(&path) {
        Err(error) => Err(error.to_string()),
        Ok(meta) if !meta.is_file() => Err("this is not a plain file".to_string()),
        Ok(_) => crate::content::read_file(&path).map_err(|d| d.message),
    }
}

/// Which files are not those that `session.json` names.
fn compare_files(bundle: &Path, recording: &[u8], session: &SessionFile) -> Vec<String> {
    let mut complaints = Vec::new();
    if session.digests.get(record::FILE_NAME) != Some(&sha256(recording)) {
        complaints.push(format!("{}: its bytes are not those that were scored", record::FILE_NAME));
    }
    for (name, digest) in session.digests.iter().filter(|(n, _)| *n != record::FILE_NAME) {
        // A name that leads elsewhere is not one of ours.
        if Path::new(name).components().any(|c| !matches!(c, Component::Normal(_))) {
            complaints.push(format!("{SESSION_FILE}: digests: \"{name}\" is not a file of a bundle"));
            continue;
        }
        match read_part(bundle, name) {
            Err(error) => complaints.push(format!("{name}: {error}")),
            Ok(found) if *digest != sha256(&found) => {
                complaints.push(format!("{name}: its bytes are not those that {SESSION_FILE} names"));
            }
            Ok(_) => {}
        }
    }
    complaints
}

/// Which files are other than what the recording gives.
fn compare_derived(
    bundle: &Path,
    session: &SessionFile,
    anew: &BTreeMap<String, Vec<u8>>,
    written: &[u8],
    is_our_page: bool,
) -> Vec<String> {
    let mut complaints = Vec::new();
    for (name, bytes) in anew {
        let follows = match name.as_str() {
            // Of a page made from a school's own template only the digest is known, which was compared.
            REPORT_FILE if !is_our_page => true,
            SESSION_FILE => with_page_of(bytes, session).is_some_and(|text| text.as_bytes() == written),
            _ => read_part(bundle, name).is_ok_and(|found| found == *bytes),
        };
        if !follows {
            complaints.push(format!("{name}: it does not follow from the recording"));
        }
    }
    complaints
}

/// The text of a result made anew, as it would be with the page that another result names.
fn with_page_of(anew: &[u8], session: &SessionFile) -> Option<String> {
    let mut expected: SessionFile = serde_json::from_slice(anew).ok()?;
    expected.template_sha256.clone_from(&session.template_sha256);
    if let Some(page) = session.digests.get(REPORT_FILE) {
        expected.digests.insert(REPORT_FILE.to_string(), page.clone());
    }
    Some(expected.text())
}

/// Which results in `session.json` the recording does not give.
fn compare_results(recording: &Recording, scored: &Scored, session: &SessionFile) -> Vec<String> {
    let again = SessionFile::of(recording, scored);
    let mut complaints = Vec::new();
    let tell = |value: Option<f64>| value.map_or("none".to_string(), |v| v.to_string());
    for (name, &value) in &again.metrics {
        let written = session.metrics.get(name).copied().flatten();
        if written != value {
            let (written, value) = (tell(written), tell(value));
            complaints
                .push(format!("{SESSION_FILE}: metrics.{name}: {written} is written, the recording gives {value}"));
        }
    }
    let mut part = |name: &str, differs: bool| {
        if differs {
            complaints.push(format!("{SESSION_FILE}: {name}: not what the recording gives"));
        }
    };
    part("grade", again.grade != session.grade);
    part("stages", again.stages != session.stages);
    part("questionnaire", again.questionnaire != session.questionnaire);
    part("scenario", again.scenario != session.scenario);
    part("participant", again.participant != session.participant);
    part("device", again.device != session.device);
    part("servo", again.servo != session.servo);
    complaints
}
