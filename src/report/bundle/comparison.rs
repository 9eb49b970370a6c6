//! Verification of a bundle: every file is derived from the recording again and compared.

use super::bundle_folder::{BundleFolder, is_file_name};
use super::derived_files::derive_files;
use super::{REPORT_FILE, SESSION_FILE, is_partial, sha256};
use crate::session_file::SessionFile;
use crate::templates::Templates;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;
use typodont_core::tick::Tick;
use typodont_exercise::record;
use typodont_exercise::record::{Recording, ReplayCheck};
use typodont_exercise::score;

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
pub fn verify(bundle: &BundleFolder, known: &[Templates]) -> Result<Verification, String> {
    let path = bundle.path().join(record::FILE_NAME);
    let bytes = bundle.read(record::FILE_NAME).map_err(|why| format!("{}: unreadable-file: {why}", path.display()))?;
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
fn read_session_file(bundle: &BundleFolder) -> Result<(Cow<'_, [u8]>, SessionFile), String> {
    let is_unfinished = is_partial(bundle.path()) && !bundle.contains(SESSION_FILE);
    if is_unfinished {
        let bundle = bundle.path().display();
        return Err(format!("this session was not finished; `typodont finish {bundle}` makes its bundle"));
    }
    let written = bundle.read(SESSION_FILE).map_err(|e| format!("{SESSION_FILE}: {e}"))?;
    let session = serde_json::from_slice(&written).map_err(|e| format!("{SESSION_FILE}: {e}"))?;
    Ok((written, session))
}

/// Names of files that `session.json` does not name.
pub(crate) fn unlisted_files(bundle: &BundleFolder, session: &SessionFile) -> Vec<String> {
    let mut found = bundle.names();
    found.retain(|name| !session.digests.contains_key(name) && name != SESSION_FILE);
    found
}

pub(crate) fn unlisted_complaint(name: &str) -> String {
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

/// Complaints about files whose SHA-256 differs from that in `session.json`.
pub(crate) fn compare_files(bundle: &BundleFolder, recording: &[u8], session: &SessionFile) -> Vec<String> {
    let mut complaints = Vec::new();
    if session.digests.get(record::FILE_NAME) != Some(&sha256(recording)) {
        complaints.push(format!("{}: the file differs from the recording that was scored", record::FILE_NAME));
    }
    for (name, digest) in session.digests.iter().filter(|(n, _)| *n != record::FILE_NAME) {
        // A name that leads out of the folder is not a file of the bundle.
        if !is_file_name(name) {
            complaints.push(format!("{SESSION_FILE}: digests: \"{name}\" is not a file of a bundle"));
            continue;
        }
        match bundle.read(name) {
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
    bundle: &BundleFolder,
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
            _ => bundle.read(name).is_ok_and(|found| *found == **bytes),
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
pub(crate) fn compare_facts(expected: &SessionFile, session: &SessionFile) -> Vec<String> {
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
pub(crate) fn compare_scores(expected: &SessionFile, session: &SessionFile) -> Vec<String> {
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
