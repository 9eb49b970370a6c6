//! A session's folder: made whole or not at all, and checked to the last byte.
//!
//! While a session runs its recording grows in a folder named `….partial`; when everything is there the folder gets its
//! name. Everything but the recording follows from the recording: [`verify`] makes it anew and compares.

use super::html::{self, Templates};
use super::session_file::SessionFile;
use super::{glb, labelmap, pictures};
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
    session.template_sha256 = sha256(templates.report.as_bytes());
    let page = html::session_page(templates, recording, scored, &session, &views)?;
    session.digests.insert(REPORT_FILE.to_string(), sha256(page.as_bytes()));
    files.insert(REPORT_FILE.to_string(), page.into_bytes());
    files.insert(SESSION_FILE.to_string(), session.text().into_bytes());
    Ok(files)
}

fn sha256(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

/// Everything that does not hold about a bundle; nothing when it holds.
///
/// `Err` when it cannot be judged at all: no recording, or one that cannot be read.
pub fn verify(bundle: &Path, templates: &Templates) -> Result<Vec<String>, String> {
    let path = bundle.join(record::FILE_NAME);
    let bytes = crate::content::read_file(&path).map_err(|d| d.headline())?;
    let recording = Recording::parse(&path.display().to_string(), &bytes).map_err(|e| e.to_string())?;
    let scored = score::score(&recording, Watch::Everything).map_err(|e| format!("{}: {e}", path.display()))?;
    let mut complaints = Vec::new();
    if let Some(difference) = &scored.replay.difference {
        complaints.push(format!("{}: {difference}", record::FILE_NAME));
    }
    let written = match fs::read(bundle.join(SESSION_FILE)) {
        Ok(written) => written,
        Err(error) => {
            complaints.push(format!("{SESSION_FILE}: {error}"));
            return Ok(complaints);
        }
    };
    match serde_json::from_slice::<SessionFile>(&written) {
        Err(error) => complaints.push(format!("{SESSION_FILE}: {error}")),
        Ok(session) => {
            complaints.extend(compare_files(bundle, &bytes, &session));
            if session.scorer_version == score::SCORER_VERSION {
                complaints.extend(compare_results(&recording, &scored, &session));
            }
            // Made by this very version, everything can be made anew; by another, digests must do.
            if complaints.is_empty() && session.typodont_version == env!("CARGO_PKG_VERSION") {
                let anew = derive(&recording, &bytes, &scored, templates)?;
                complaints.extend(compare_derived(bundle, &session, &anew, &written));
            }
        }
    }
    Ok(complaints)
}

/// [`verify`] for a recording without a bundle: whether it replays to what it says.
pub fn verify_recording(path: &Path) -> Result<Vec<String>, String> {
    let recording = Recording::read(path).map_err(|e| e.to_string())?;
    let replay = record::replay(&recording, Watch::Everything, |_, _, _, _| ());
    let replay = replay.map_err(|e| format!("{}: {e}", path.display()))?;
    Ok(replay.difference.iter().map(ToString::to_string).collect())
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
        match fs::read(bundle.join(name)) {
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
) -> Vec<String> {
    let mut complaints = Vec::new();
    // With another template than the school's the page cannot be made anew; its digest was compared.
    let is_our_page = anew.get(SESSION_FILE).is_some_and(|text| {
        serde_json::from_slice::<SessionFile>(text).is_ok_and(|s| s.template_sha256 == session.template_sha256)
    });
    for (name, bytes) in anew.iter().filter(|(n, _)| is_our_page || !matches!(n.as_str(), REPORT_FILE | SESSION_FILE)) {
        let found = if name == SESSION_FILE { Some(written.to_vec()) } else { fs::read(bundle.join(name)).ok() };
        if found.as_deref() != Some(bytes) {
            complaints.push(format!("{name}: it does not follow from the recording"));
        }
    }
    complaints
}

/// Which results in `session.json` the recording does not give.
fn compare_results(recording: &Recording, scored: &Scored, session: &SessionFile) -> Vec<String> {
    let again = SessionFile::of(recording, scored);
    let mut complaints = Vec::new();
    for (name, value) in &again.metrics {
        let written = session.metrics.get(name);
        if written.is_some_and(|w| w != value) {
            complaints
                .push(format!("{SESSION_FILE}: metrics.{name}: {written:?} is written, the recording gives {value:?}"));
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
