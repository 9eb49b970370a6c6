//! Verification of results: does what a bundle says follow from its recording?
//!
//! Takes a bundle and the `session.json` that was read from it. Gives a [`VerificationStatus`]: at once from the
//! digests of all files, the sums of points and the head of the recording; completely by a replay, which is done once
//! per recording and kept in a cache. Never judges whether the page and the images were drawn from the recording:
//! [`super::bundle::verify`] draws them again.

use super::bundle::{
    BundleFolder, REPORT_FILE, SESSION_FILE, compare_facts, compare_files, compare_scores, derive_maps, named_template,
    sha256, unlisted_complaint, unlisted_files,
};
use super::session_file::{DeviceFile, GradeFile, POINTS_TOLERANCE, SessionFile};
use super::templates::Templates;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs;
use std::panic::{self, AssertUnwindSafe};
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use typodont_core::parallel;
use typodont_exercise::record;
use typodont_exercise::record::{Recording, RecordingHeadFile, ReplayCheck};
use typodont_exercise::score;
use typodont_exercise::score::SCORER_VERSION;

/// Maximum size of an entry of the cache, bytes.
const ENTRY_BYTES_MAX: u64 = 16 << 20;

/// Relation of a session's result to its recording.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum VerificationStatus {
    /// A replay of the recording gives this result.
    Verified,
    /// The recording has not been replayed yet.
    #[default]
    Pending,
    /// This program cannot tell, for the reason given.
    Unverified(String),
    /// The bundle is not what its recording gives; one sentence per difference.
    Differs(Vec<String>),
}

impl VerificationStatus {
    /// Word for exports: `verified`, `not verified` or `differs`.
    pub fn name(&self) -> &'static str {
        match self {
            VerificationStatus::Verified => "verified",
            VerificationStatus::Pending | VerificationStatus::Unverified(_) => "not verified",
            VerificationStatus::Differs(_) => "differs",
        }
    }

    /// Differences or the reason, as one line; empty for a verified result.
    pub fn note(&self) -> String {
        match self {
            VerificationStatus::Verified => String::new(),
            VerificationStatus::Pending => "the recording has not been replayed yet".to_string(),
            VerificationStatus::Unverified(why) => why.clone(),
            VerificationStatus::Differs(differences) => differences.join("; "),
        }
    }

    pub fn is_verified(&self) -> bool {
        *self == VerificationStatus::Verified
    }

    pub fn differs(&self) -> bool {
        matches!(self, VerificationStatus::Differs(_))
    }
}

/// Result of a replay, as kept in the cache.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct ReplayedFile {
    /// The result without digests and template, and without the participant: whoever is erased elsewhere is not left
    /// here. The participant is compared with the head of the recording each time.
    session: SessionFile,
    /// SHA-256 of the label maps, by file name.
    maps: BTreeMap<String, String>,
    /// First difference between the replay and the recorded states.
    difference: Option<String>,
}

/// Judge of bundles, with the cache of its replays.
#[derive(Clone, Debug)]
pub struct Verifier {
    template_sha256: String,
    cache: Option<ReplayCache>,
}

#[derive(Clone, Debug)]
struct ReplayCache {
    folder: PathBuf,
    /// Identity of this build of the program: another build replays everything again.
    build: String,
}

/// A bundle after everything that needs no replay was compared.
enum FirstCheck {
    Decided(VerificationStatus),
    /// `digest` is the SHA-256 of the recording.
    NeedsReplay {
        written: Vec<u8>,
        recording: Vec<u8>,
        digest: String,
    },
}

impl Verifier {
    /// A verifier without a cache.
    pub fn new(templates: &Templates) -> Verifier {
        Verifier { template_sha256: sha256(templates.session_source_text().as_bytes()), cache: None }
    }

    /// Keeps replays in a folder that only this user can write. `build` names the program that made them.
    pub fn with_cache(self, folder: PathBuf, build: String) -> Verifier {
        Verifier { cache: Some(ReplayCache { folder, build }), ..self }
    }

    /// Compares all that can be compared without a replay. The status is [`VerificationStatus::Pending`] if only a
    /// replay is missing that the cache does not have.
    pub fn check(&self, bundle: &BundleFolder, session: &SessionFile) -> VerificationStatus {
        match self.first_check(bundle, session) {
            FirstCheck::Decided(status) => status,
            FirstCheck::NeedsReplay { written, digest, .. } => {
                let replayed = self.cache.as_ref().and_then(|cache| cache.read(&digest));
                replayed.map_or(VerificationStatus::Pending, |replayed| judge(&replayed, session, &written))
            }
        }
    }

    /// Judges a bundle completely; replays its recording unless the cache has the replay.
    pub fn verify(&self, bundle: &BundleFolder, session: &SessionFile) -> VerificationStatus {
        let (written, recording, digest) = match self.first_check(bundle, session) {
            FirstCheck::Decided(status) => return status,
            FirstCheck::NeedsReplay { written, recording, digest } => (written, recording, digest),
        };
        if let Some(replayed) = self.cache.as_ref().and_then(|cache| cache.read(&digest)) {
            return judge(&replayed, session, &written);
        }
        match replay(&recording) {
            Ok(replayed) => {
                self.cache.iter().for_each(|cache| cache.write(&digest, &replayed));
                judge(&replayed, session, &written)
            }
            Err(why) => VerificationStatus::Unverified(why),
        }
    }

    /// Judges many bundles on all processors. `progress` is called after each one with the number of those done.
    pub fn verify_all(
        &self,
        bundles: &[(PathBuf, SessionFile)],
        progress: impl Fn(usize) + Sync,
    ) -> Vec<VerificationStatus> {
        let done = AtomicUsize::new(0);
        parallel::par_map(bundles.len(), |index| {
            let (bundle, session) = &bundles[index];
            let status = self.verify(&BundleFolder::on_disk(bundle), session);
            progress(done.fetch_add(1, Ordering::Relaxed) + 1);
            status
        })
    }

    fn first_check(&self, bundle: &BundleFolder, session: &SessionFile) -> FirstCheck {
        let unverified = |why: String| FirstCheck::Decided(VerificationStatus::Unverified(why));
        let written = match bundle.read(SESSION_FILE) {
            Ok(written) => written,
            Err(why) => return unverified(format!("{SESSION_FILE}: {why}")),
        };
        let is_as_read = std::str::from_utf8(&written)
            .is_ok_and(|text| SessionFile::from_json(text).is_ok_and(|again| again == *session));
        if !is_as_read {
            return unverified(format!("{SESSION_FILE} was changed while it was read"));
        }
        let Some(digest) = session.digests.get(record::FILE_NAME) else {
            return unverified("it has no recording".to_string());
        };
        let recording = match bundle.read(record::FILE_NAME) {
            Ok(recording) => recording,
            Err(why) => {
                let difference = format!("{}: {why}", record::FILE_NAME);
                return FirstCheck::Decided(VerificationStatus::Differs(vec![difference]));
            }
        };
        let mut differences = compare_files(bundle, &recording, session);
        let unlisted = unlisted_files(bundle, session);
        differences.extend(unlisted.iter().filter(|name| is_of_a_bundle(name)).map(|name| unlisted_complaint(name)));
        differences.extend(session.grade.as_ref().map(sum_differences).unwrap_or_default());
        let head = Recording::parse_head(record::FILE_NAME, &recording);
        differences.extend(head.iter().flat_map(|head| head_differences(head, session)));
        let page = bundle.read(REPORT_FILE).unwrap_or_default();
        let named = named_template(&page);
        if named.is_some_and(|named| named != session.template_sha256.as_bytes()) {
            differences.push(format!("{REPORT_FILE}: it names another template than {SESSION_FILE}"));
        }
        if !differences.is_empty() {
            return FirstCheck::Decided(VerificationStatus::Differs(differences));
        }
        if let Err(error) = head {
            return unverified(error.to_string());
        }
        if named.is_none() && session.template_sha256 != self.template_sha256 {
            return unverified(format!("{REPORT_FILE} was made from a different template, which it does not name"));
        }
        // The digest is that of the recording, or the files would have differed.
        FirstCheck::NeedsReplay {
            written: written.into_owned(),
            recording: recording.into_owned(),
            digest: digest.clone(),
        }
    }
}

impl ReplayCache {
    /// File of the entry for a recording with this SHA-256.
    fn path(&self, digest: &str) -> PathBuf {
        let parts = [digest, &SCORER_VERSION.to_string(), &self.build];
        self.folder.join(sha256(parts.join("\n").as_bytes()))
    }

    /// An entry; `None` if there is none, or none that can be read.
    fn read(&self, digest: &str) -> Option<ReplayedFile> {
        let path = self.path(digest);
        let meta = fs::symlink_metadata(&path).ok()?;
        if !meta.is_file() || meta.len() > ENTRY_BYTES_MAX {
            return None;
        }
        serde_json::from_slice(&fs::read(path).ok()?).ok()
    }

    /// Writes an entry. A cache that cannot be written is no error: the recording is replayed again next time.
    fn write(&self, digest: &str, replayed: &ReplayedFile) {
        let path = self.path(digest);
        if path.exists() || fs::create_dir_all(&self.folder).is_err() {
            return;
        }
        let Ok(text) = serde_json::to_vec(replayed) else { return };
        // Programs that write the same entry at the same time write the same bytes; a reader sees all of them or none.
        let _ = typodont_formats::write_atomically(&path, &text);
    }
}

/// Replays and scores a recording.
///
/// # Errors
///
/// A sentence when this program cannot read or score the recording.
fn replay(bytes: &[u8]) -> Result<ReplayedFile, String> {
    let scored = panic::catch_unwind(AssertUnwindSafe(|| {
        let recording = Recording::parse(record::FILE_NAME, bytes).map_err(|e| e.to_string())?;
        let scored = score::score(&recording, ReplayCheck::Full).map_err(|e| format!("{}: {e}", record::FILE_NAME))?;
        let maps = derive_maps(&recording, &scored)?;
        let difference = scored.replay.difference.as_ref();
        Ok(ReplayedFile {
            session: SessionFile { participant: String::new(), ..SessionFile::of(&recording, &scored) },
            maps: maps.iter().map(|(name, bytes)| (name.clone(), sha256(bytes))).collect(),
            difference: difference.map(|d| format!("{}: {d}", record::FILE_NAME)),
        })
    }));
    // A recording that makes the scorer panic must not stop the others.
    scored.unwrap_or_else(|_| Err(format!("{}: the scorer failed unexpectedly; please report it", record::FILE_NAME)))
}

/// Compares a result with what its recording gives.
fn judge(replayed: &ReplayedFile, session: &SessionFile, written: &[u8]) -> VerificationStatus {
    let ReplayedFile { session: expected, maps, difference } = replayed;
    let expected = &SessionFile { participant: session.participant.clone(), ..expected.clone() };
    let mut differences: Vec<String> = difference.iter().cloned().collect();
    differences.extend(compare_facts(expected, session));
    let has_our_formulae = session.scorer_version == SCORER_VERSION;
    if has_our_formulae {
        differences.extend(compare_scores(expected, session));
    }
    let is_our_version = expected.typodont_version == env!("CARGO_PKG_VERSION");
    let unlike = || maps.iter().filter(|(name, digest)| session.digests.get(*name) != Some(digest));
    if has_our_formulae && is_our_version {
        differences.extend(
            unlike().map(|(name, _)| format!("{name}: the file differs from the one derived from the recording")),
        );
        let (digests, template_sha256) = (session.digests.clone(), session.template_sha256.clone());
        let whole = SessionFile { digests, template_sha256, ..expected.clone() };
        if differences.is_empty() && whole.to_json().as_bytes() != written {
            differences.push(format!("{SESSION_FILE}: the file differs from the one derived from the recording"));
        }
    }
    match (differences.is_empty(), has_our_formulae) {
        (false, _) => VerificationStatus::Differs(differences),
        // Another version of the program may write the same map in other bytes.
        (true, true) if !is_our_version && unlike().next().is_some() => VerificationStatus::Unverified(format!(
            "version {} of the program wrote its maps in another way, and this is version {}",
            expected.typodont_version,
            env!("CARGO_PKG_VERSION")
        )),
        (true, true) => VerificationStatus::Verified,
        (true, false) => VerificationStatus::Unverified(format!(
            "it was scored by version {} of the formulae, and this program has version {SCORER_VERSION}",
            session.scorer_version
        )),
    }
}

/// Differences between a result and the head of its recording.
fn head_differences(head: &RecordingHeadFile, session: &SessionFile) -> Vec<String> {
    let device = DeviceFile::clone(&head.device);
    let differing = [
        ("scenario", head.scenario_id != session.scenario.id || head.scenario_sha256 != session.scenario.sha256),
        ("participant", head.participant != session.participant),
        // The head of a sealed session holds the commitment to the seed; the replay compares the seed itself.
        ("seed", head.seed_sha256.is_none() && head.seed != session.seed),
        ("started", head.started != session.started),
        ("operator", head.operator != session.operator),
        ("typodont_version", head.typodont_version != session.typodont_version),
        ("device", session.device.as_ref().is_some_and(|own| own.name != device.name)),
    ];
    let differing = differing.into_iter().filter(|(_, differs)| *differs);
    differing.map(|(name, _)| format!("{SESSION_FILE}: {name}: differs from the recording")).collect()
}

/// Differences within a grade: sums of points, critical errors, and the result that follows from them.
fn sum_differences(grade: &GradeFile) -> Vec<String> {
    let (points, most) =
        grade.items.iter().fold((0.0, 0.0), |(points, most), item| (points + item.points, most + item.max_points));
    let failed: Vec<&str> = grade.hard_fail_checks.iter().filter(|f| f.failed).map(|f| f.title.as_str()).collect();
    let passes = grade.finished && grade.points >= grade.pass_points && grade.hard_fails.is_empty();
    let mut found = Vec::new();
    let mut complain = |differs: bool, what: String| {
        if differs {
            found.push(format!("{SESSION_FILE}: grade: {what}"));
        }
    };
    let off = |a: f64, b: f64| (a - b).abs() > POINTS_TOLERANCE;
    // Files of the first versions name neither items nor the critical errors that were checked.
    if !grade.items.is_empty() {
        complain(off(points, grade.points), format!("the items add up to {points:.3} points, not {:.3}", grade.points));
        complain(off(most, grade.max_points), format!("the items allow {most:.3} points, not {:.3}", grade.max_points));
    }
    let lists_all = grade.hard_fail_checks.is_empty() || failed == grade.hard_fails;
    complain(!lists_all, "the critical errors are not those that were checked".to_string());
    complain(passes != grade.passed, "passed or not passed does not follow from the points".to_string());
    found
}

/// True if a file that `session.json` does not name has a name that readers of bundles open. Others, such as those
/// that file managers leave behind, are nobody's result.
fn is_of_a_bundle(name: &str) -> bool {
    name == REPORT_FILE
        || [".nrrd", ".glb", ".mcap"].iter().any(|end| name.ends_with(end))
        || name.starts_with("views/") && name.ends_with(".png")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// The committed example and what verifies it, whatever the templates are now.
    fn example() -> (PathBuf, SessionFile, Verifier) {
        let bundle = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../reports/example");
        let session = crate::cohort::read_session(&bundle.join(SESSION_FILE)).unwrap();
        let verifier = Verifier { template_sha256: session.template_sha256.clone(), cache: None };
        (bundle, session, verifier)
    }

    #[test]
    fn a_result_is_compared_with_its_recording() {
        // Aim: every claim of a session.json is judged. Method: one claim of the example is changed at a time.
        let (bundle, session, _) = example();
        let recording = fs::read(bundle.join(record::FILE_NAME)).unwrap();
        let replayed = replay(&recording).unwrap();
        let judged = |session: &SessionFile| judge(&replayed, session, session.to_json().as_bytes());
        if session.scorer_version == SCORER_VERSION {
            assert_eq!(judged(&session), VerificationStatus::Verified);
        }
        let current = SessionFile { scorer_version: SCORER_VERSION, ..replayed.session.clone() };
        let (digests, template_sha256) = (session.digests.clone(), session.template_sha256.clone());
        let current = SessionFile { digests, template_sha256, participant: session.participant.clone(), ..current };
        let head = Recording::parse_head(record::FILE_NAME, &recording).unwrap();
        assert_eq!(head_differences(&head, &current), Vec::<String>::new());
        let other = SessionFile { participant: "other".into(), ..current.clone() };
        assert_eq!(head_differences(&head, &other), ["session.json: participant: differs from the recording"]);
        type Change = fn(&mut SessionFile);
        let changes: [(&str, Change); 9] = [
            ("seed", |s| s.seed += 1),
            ("started", |s| s.started = "2020-01-01T00:00:00Z".into()),
            ("operator", |s| s.operator = None),
            ("scenario", |s| s.scenario.title = "other".into()),
            ("typodont_version", |s| s.typodont_version = "9.9.9".into()),
            ("grade", |s| s.grade.as_mut().unwrap().points = 100.0),
            ("metrics.dice", |s| s.metrics.extend([("dice".into(), Some(1.0))])),
            ("metrics", |s| s.metrics.extend([("invented".into(), Some(1.0))])),
            ("stages", |s| s.stages[0].ended_s += 1.0),
        ];
        for (part, change) in changes {
            let mut changed = current.clone();
            change(&mut changed);
            let status = judged(&changed);
            assert!(
                status.differs() && status.note().contains(&format!("session.json: {part}: ")),
                "{part}: {status:?}"
            );
        }
        let older = SessionFile { scorer_version: SCORER_VERSION + 1, ..current };
        assert_eq!(judged(&older).name(), "not verified");
    }

    #[test]
    fn a_grade_that_contradicts_itself_is_named() {
        let (_, session, _) = example();
        let grade = session.grade.unwrap();
        assert_eq!(sum_differences(&grade), Vec::<String>::new());
        type Change = fn(&mut GradeFile);
        let changes: [(&str, Change); 4] = [
            ("the items add up to", |g| g.points += 1.0),
            ("the items allow", |g| g.max_points += 1.0),
            ("critical errors", |g| g.hard_fails.push("invented".into())),
            ("passed or not passed", |g| g.passed = !g.passed),
        ];
        for (what, change) in changes {
            let mut changed = grade.clone();
            change(&mut changed);
            assert!(sum_differences(&changed).iter().any(|d| d.contains(what)), "{what}");
        }
    }
}
