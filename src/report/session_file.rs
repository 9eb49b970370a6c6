//! `session.json`: the result of a session as other programs read it. Its names are a contract.

use serde::{Deserialize, Serialize};
use serde_json::Value as Json;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use typodont_core::device::DeviceSpec;
use typodont_core::tick::Tick;
use typodont_core::volume::Label;
use typodont_exercise::catalog::{CoefficientName, TissueRole, TissueTable};
use typodont_exercise::record::{
    DeviceSpecFile, Recording, ResumptionFile, SeedOriginFile, ServoStatsFile, ended_by_name,
};
use typodont_exercise::scenario::{Jaw, Limit, QuestionKind, Questionnaire, Scenario, Workpiece, hex};
use typodont_exercise::score;
use typodont_exercise::score::{EpisodeKind, ErrorEpisode, Evidence, Grade, SCORER_VERSION, Scored, SiteResult};
use typodont_exercise::session::{AnswerRecord, AnswerValue};

/// Version of this file's format.
pub const VERSION: u32 = 1;

/// Maximum number of episodes of each kind in the file, the greatest first. More than twenty presses or cuts of one
/// kind are a habit, which the measures show.
const EPISODES_MAX: usize = 20;

/// Maximum size of a `session.json`, bytes. The largest that this program writes has some 100 kB.
pub const FILE_BYTES_MAX: usize = 4 << 20;

/// Maximum length of a participant's code, characters; `typodont run` accepts no longer one.
const PARTICIPANT_MAX: usize = 64;

/// Maximum length of an id, of a measure's name and of a moment, characters. A school's records index ids and names.
const ID_MAX: usize = 256;

/// Maximum number of measures, and of places and times of measures.
const METRICS_MAX: usize = 2000;

/// Greatest magnitude of a measure, in any unit: far above every measure that can occur, and small enough for sums of squares
/// over a cohort.
const MEASURE_MAX: f64 = 1e15;

/// Maximum number of rubric items, critical errors, stages, answers, statements, sites and digests, each.
const ENTRIES_MAX: usize = 1000;

/// Years in which a session can have begun.
const YEARS: std::ops::RangeInclusive<u32> = 1970..=2199;

/// Tolerance of sums of points, which are rounded to nine decimals each.
pub const POINTS_TOLERANCE: f64 = 1e-6;

pub type DeviceFile = DeviceSpecFile;

/// A session's result. Sessions entered by hand may leave out all but the scenario and the metrics.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SessionFile {
    pub version: u32,
    #[serde(default)]
    pub typodont_version: String,
    /// Version of the formulae; 0 for values entered by hand.
    #[serde(default)]
    pub scorer_version: u32,
    pub scenario: ScenarioRef,
    #[serde(default)]
    pub participant: String,
    #[serde(default)]
    pub seed: u64,
    /// Source of the seed; absent in results made before it was recorded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed_origin: Option<SeedOriginFile>,
    /// When the session began, RFC 3339.
    #[serde(default)]
    pub started: String,
    /// "complete", or why the session ended before its time.
    #[serde(default)]
    pub ended_because: String,
    /// Name of the scripted operator, if a script performed the session.
    #[serde(default)]
    pub operator: Option<String>,
    #[serde(default)]
    pub device: Option<DeviceFile>,
    /// Number of the tooth that places are measured on, the first of two; null for all teeth of a jaw.
    #[serde(default)]
    pub tooth_fdi: Option<u8>,
    /// Jaw of which all teeth are in the exercise; left out for one or two teeth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub jaw: Option<ArchJaw>,
    /// Size of a voxel of the tooth along its three axes, mm; absent for values entered by hand.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub voxel_mm: Option<[f64; 3]>,
    /// SHA-256 of the form of the teeth before any caries, cavity and deposit, by which other teeth with the same number
    /// are told apart; absent for values entered by hand.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tooth_sha256: Option<String>,
    #[serde(default)]
    pub stages: Vec<StageResultFile>,
    /// The periodontal chart; left out where none was asked for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub chart: Vec<SiteReadingFile>,
    pub metrics: BTreeMap<String, Option<f64>>,
    /// Place and time at which some of the metrics arose.
    #[serde(default)]
    pub evidence: BTreeMap<String, EvidenceFile>,
    /// Error episodes, which the sentences of the feedback describe; left out if there are none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub episodes: Vec<EpisodeFile>,
    /// Absent without a rubric.
    #[serde(default)]
    pub grade: Option<GradeFile>,
    /// Absent without a questionnaire.
    #[serde(default)]
    pub questionnaire: Option<QuestionnaireFile>,
    #[serde(default)]
    pub servo: ServoStatsFile,
    /// Moments at which the session went on after it had been interrupted; left out if it never was.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub resumed: Vec<SessionResumption>,
    /// SHA-256 of the templates that the page was made from.
    #[serde(default)]
    pub template_sha256: String,
    /// SHA-256 of the bundle's other files, by name.
    #[serde(default)]
    pub digests: BTreeMap<String, String>,
}

/// Moment at which an interrupted session went on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SessionResumption {
    /// Time of the session, s.
    pub session_s: f64,
    /// Date and time, RFC 3339.
    pub at: String,
}

impl SessionResumption {
    fn of(file: &ResumptionFile) -> SessionResumption {
        SessionResumption { session_s: Tick(file.tick).seconds(), at: file.at.clone() }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScenarioRef {
    pub id: String,
    #[serde(default)]
    pub title: String,
    #[serde(default)]
    pub sha256: String,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StageResultFile {
    pub id: String,
    #[serde(default)]
    pub title: String,
    pub started_s: f64,
    pub ended_s: f64,
    pub ended_by: String,
    /// True if the exercise guided the trainee's device; left out where it did not.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub guided: bool,
    /// Time for which another person's device led the trainee's, s; left out if none did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub led_s: Option<f64>,
    /// Haptic coefficients that the trainee changed, each as "tissue coefficient"; left out if none was changed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub adjusted: Vec<String>,
    pub answers: Vec<AnswerResultFile>,
}

/// One site of a periodontal chart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SiteReadingFile {
    /// MB, B, DB, ML, L or DL.
    pub site: String,
    /// Probing depth as read by the trainee, mm; null if the site was not read.
    pub read_mm: Option<u8>,
    pub true_mm: f64,
    /// Recession of the gingival margin below the cementoenamel junction, mm; negative where the gingiva covers enamel.
    pub recession_mm: f64,
    /// Probing force at the reading, N.
    pub force_n: Option<f64>,
    pub at_s: Option<f64>,
    /// True if the trainee marked calculus; null if it was not asked for.
    #[serde(default)]
    pub calculus_marked: Option<bool>,
    #[serde(default)]
    pub calculus: bool,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AnswerResultFile {
    pub question: String,
    #[serde(default)]
    pub text: String,
    /// A text, a number or true/false.
    pub value: Json,
    pub at_s: f64,
    /// True if the answer was correct; null if the question has no correct answer.
    pub right: Option<bool>,
    /// The correct answer; null if there is none.
    #[serde(default)]
    pub truth: Json,
    /// Stiffness coefficient at the time of the answer, if the stage lowers it in steps.
    #[serde(default)]
    pub level: Option<f64>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EvidenceFile {
    /// When it arose, s.
    pub at_s: Option<f64>,
    /// Position in tooth space, mm from the centre of the crown at the neck: buccal, distal (mesial for 21–28 and
    /// 41–48), occlusal.
    pub place_mm: [f64; 3],
    /// FDI number of the tooth there, if it is not the treated one but another tooth of the mouth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tooth_fdi: Option<u8>,
    /// Name of the tissue that was removed, left, exposed or touched there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tissue: Option<String>,
    /// Direction from the nearest caries; for remaining caries, from the cavity: buccal, lingual, mesial, distal,
    /// occlusal or apical.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wall: Option<String>,
    /// Distance that the metric states, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth_mm: Option<f64>,
    /// Volume of the vulnerable tissue that was removed, mm³.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub volume_mm3: Option<f64>,
    /// Force at that time, N.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_n: Option<f64>,
}

/// An error of one kind, on one tissue, at one wall, in one period of time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EpisodeFile {
    /// overcut, vulnerable, zone, left, force, neighbour or soft.
    pub kind: String,
    /// Identifier of the protected zone of which tissue was removed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zone: Option<String>,
    /// Name of the tissue.
    pub tissue: Option<String>,
    /// Direction from the nearest tissue to be removed; for remaining tissue, from the cavity.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wall: Option<String>,
    /// Position of the greatest depth or force, tooth space, mm; of vulnerable tissue and zones, the first position.
    pub place_mm: [f64; 3],
    /// Depth at that position, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth_mm: Option<f64>,
    /// Volume of the removed, exposed or remaining tissue, mm³; left out for contact and force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub volume_mm3: Option<f64>,
    /// Maximum force in this period, N; left out for remaining tissue.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_n: Option<f64>,
    /// When the position was reached, s; left out for remaining tissue.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_s: Option<f64>,
    /// Force at that time, N.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_at_n: Option<f64>,
    /// Begin and end of the period, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from_s: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to_s: Option<f64>,
    /// Total time in contact within the period, s; for contact and force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact_s: Option<f64>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GradeFile {
    pub points: f64,
    pub max_points: f64,
    pub pass_points: f64,
    /// False for a session that was abandoned or interrupted: such a session cannot be passed.
    #[serde(default = "yes")]
    pub finished: bool,
    pub passed: bool,
    /// Titles of the critical errors that occurred.
    pub hard_fails: Vec<String>,
    #[serde(default)]
    pub items: Vec<ItemResultFile>,
    /// Every critical error that was checked, with its value.
    #[serde(default)]
    pub hard_fail_checks: Vec<CriticalErrorFile>,
}

/// Jaw of which all teeth are in an exercise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ArchJaw {
    Upper,
    Lower,
}

impl From<Jaw> for ArchJaw {
    fn from(jaw: Jaw) -> ArchJaw {
        match jaw {
            Jaw::Upper => ArchJaw::Upper,
            Jaw::Lower => ArchJaw::Lower,
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ItemResultFile {
    pub title: String,
    pub metric: String,
    pub value: Option<f64>,
    pub points: f64,
    pub max_points: f64,
    pub full_at: f64,
    pub zero_at: f64,
    /// Measure of the item on which this item depends; left out for an item that counts by itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub counts_with: Option<String>,
    /// Share of its points that the other item earned, 0 to 1, by which the points of this item are multiplied; left
    /// out for an item that counts by itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub counts_with_share: Option<f64>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CriticalErrorFile {
    pub title: String,
    pub metric: String,
    pub value: Option<f64>,
    #[serde(default)]
    pub above: Option<f64>,
    #[serde(default)]
    pub below: Option<f64>,
    pub failed: bool,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct QuestionnaireFile {
    pub id: String,
    pub items: Vec<RatingFile>,
    /// Mean of each category, negative statements mirrored; null where nothing was answered.
    pub categories: BTreeMap<String, Option<f64>>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RatingFile {
    pub id: String,
    pub category: String,
    /// As given; null where not answered.
    pub value: Option<f64>,
    /// As counted: mirrored for statements against the system.
    pub counted: Option<f64>,
}

impl ItemResultFile {
    /// Points by the item's own measure, before they are multiplied by the share of the item on which it depends.
    pub fn own_points(&self) -> f64 {
        let share = self.value.map_or(0.0, |v| ((v - self.zero_at) / (self.full_at - self.zero_at)).clamp(0.0, 1.0));
        if self.counts_with.is_some() { share * self.max_points } else { self.points }
    }
}

impl SessionFile {
    /// The result of a scored recording; the digests of the other files come later.
    pub fn of(recording: &Recording, scored: &Scored) -> SessionFile {
        let head = &recording.head;
        let scenario = &recording.scenario;
        let jaw = scored.replay.workpiece.arch_jaw();
        let metrics = scored.measures.all.iter().map(|m| (m.metric.name(), m.value.map(round_to_nine_decimals)));
        let evidence =
            scored.measures.all.iter().filter_map(|m| {
                Some((m.metric.name(), evidence_file(scenario, &scored.replay.workpiece, &m.evidence?)))
            });
        let ended = match &recording.end {
            Some(end) => end.reason.clone(),
            None => "the recording breaks off".to_string(),
        };
        let ticks = ServoStatsFile { ticks: recording.len() as u64, ..ServoStatsFile::default() };
        SessionFile {
            version: VERSION,
            typodont_version: head.typodont_version.clone(),
            scorer_version: SCORER_VERSION,
            scenario: ScenarioRef {
                id: scenario.id.clone(),
                title: scenario.title.clone(),
                sha256: scenario.sha256.clone(),
            },
            participant: head.participant.clone(),
            seed: head.seed,
            seed_origin: head.seed_origin,
            started: head.started.clone(),
            ended_because: ended,
            operator: head.operator.clone(),
            device: Some(DeviceFile::from(&DeviceSpec::from(&head.device))),
            tooth_fdi: scenario.scene.teeth.first().filter(|_| jaw.is_none()).map(|tooth| tooth.fdi),
            jaw: jaw.map(ArchJaw::from),
            voxel_mm: Some(voxel_mm(&scored.replay.workpiece)),
            tooth_sha256: Some(tooth_sha256(&scored.replay.workpiece, &scenario.tissues)),
            stages: stages(recording, scored),
            chart: scored.chart.iter().flatten().map(site).collect(),
            metrics: metrics.collect(),
            evidence: evidence.collect(),
            episodes: episodes(scenario, scored),
            grade: scored.grade.as_ref().map(grade),
            questionnaire: scenario.questionnaire.as_ref().map(|q| questionnaire(q, &scored.replay.outcome.ratings)),
            servo: recording.end.as_ref().map_or(ticks, |end| end.servo.clone()),
            resumed: head.resumed.iter().map(SessionResumption::of).collect(),
            template_sha256: String::new(),
            digests: BTreeMap::new(),
        }
    }

    /// Reads the text of a `session.json`, and checks that its lengths, counts and points are within their bounds.
    ///
    /// # Errors
    ///
    /// A sentence when the text is no session, or a value is outside its bounds.
    pub fn from_json(text: &str) -> Result<SessionFile, String> {
        if text.len() > FILE_BYTES_MAX {
            let (size, most) = (text.len() >> 20, FILE_BYTES_MAX >> 20);
            return Err(format!("not a session: the file has {size} MiB, and the maximum is {most} MiB"));
        }
        let session: SessionFile = serde_json::from_str(text).map_err(|e| format!("not a session: {e}"))?;
        match session.version {
            VERSION => {}
            version if version > VERSION => return Err(format!("made by a newer program (version {version})")),
            version => return Err(format!("not a session: version {version}")),
        }
        session.check_bounds().map_err(|what| format!("not a session: {what}"))?;
        Ok(session)
    }

    /// Checks lengths, counts, points and the year.
    fn check_bounds(&self) -> Result<(), String> {
        let questions = self.stages.iter().flat_map(|stage| &stage.answers);
        let statements = self.questionnaire.iter().flat_map(|q| &q.items);
        let items = self.grade.iter().flat_map(|grade| &grade.items);
        let checks = self.grade.iter().flat_map(|grade| &grade.hard_fail_checks);
        for (what, count, most) in [
            ("measures", self.metrics.len(), METRICS_MAX),
            ("places of measures", self.evidence.len(), METRICS_MAX),
            ("rubric items", items.clone().count(), ENTRIES_MAX),
            ("critical errors", checks.clone().count(), ENTRIES_MAX),
            ("critical errors", self.grade.as_ref().map_or(0, |g| g.hard_fails.len()), ENTRIES_MAX),
            ("stages", self.stages.len(), ENTRIES_MAX),
            ("answers", questions.clone().count(), ENTRIES_MAX),
            ("statements", statements.clone().count(), ENTRIES_MAX),
            ("categories", self.questionnaire.as_ref().map_or(0, |q| q.categories.len()), ENTRIES_MAX),
            ("sites of a chart", self.chart.len(), ENTRIES_MAX),
            ("error episodes", self.episodes.len(), ENTRIES_MAX),
            ("digests", self.digests.len(), ENTRIES_MAX),
        ] {
            if count > most {
                return Err(format!("it has {count} {what}, and the maximum is {most}"));
            }
        }
        let longer = |text: &str, most: usize| text.chars().nth(most).is_some();
        if longer(&self.participant, PARTICIPANT_MAX) {
            return Err(format!("the participant's code has more than {PARTICIPANT_MAX} characters"));
        }
        let ids = [&self.scenario.id, &self.scenario.sha256, &self.started, &self.typodont_version].into_iter();
        let ids = ids.chain(self.metrics.keys()).chain(self.evidence.keys()).chain(self.digests.keys());
        let ids = ids.chain(self.stages.iter().map(|stage| &stage.id)).chain(questions.map(|answer| &answer.question));
        let ids = ids.chain(items.map(|item| &item.metric)).chain(checks.map(|check| &check.metric));
        let ids = ids.chain(self.questionnaire.iter().map(|q| &q.id));
        let mut ids = ids.chain(statements.flat_map(|statement| [&statement.id, &statement.category]));
        if let Some(id) = ids.find(|id| longer(id, ID_MAX)) {
            let beginning: String = id.chars().take(20).collect();
            return Err(format!("the name \"{beginning}…\" has more than {ID_MAX} characters"));
        }
        self.grade.as_ref().map_or(Ok(()), check_points)?;
        let is_measured = |value: f64| value.abs() <= MEASURE_MAX;
        if let Some((name, value)) = self.metrics.iter().find(|(_, value)| !value.is_none_or(is_measured)) {
            let value = value.unwrap_or_default();
            return Err(format!("the measure \"{name}\" is {value:e}, and the greatest possible is {MEASURE_MAX:e}"));
        }
        let year: String = self.started.chars().take_while(char::is_ascii_digit).collect();
        let is_date = year.len() >= 4 && self.started.as_bytes().get(year.len()) == Some(&b'-');
        if is_date && !year.parse().is_ok_and(|year| YEARS.contains(&year)) {
            return Err(format!("it began in the year {year}; possible are {} to {}", YEARS.start(), YEARS.end()));
        }
        Ok(())
    }

    /// The file's text.
    pub fn to_json(&self) -> String {
        // Numbers are finite and keys are texts: writing cannot fail.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// A metric's value.
    pub fn metric(&self, name: &str) -> Option<f64> {
        self.metrics.get(name).copied().flatten()
    }
}

fn evidence_file(scenario: &Scenario, workpiece: &Workpiece, evidence: &Evidence) -> EvidenceFile {
    let other = workpiece.other_tooth_at(evidence.place);
    let rounded = |value: f32| round_to_nine_decimals(f64::from(value));
    EvidenceFile {
        at_s: evidence.at.map(Tick::seconds),
        place_mm: evidence.place.to_array().map(rounded),
        tooth_fdi: other.map(|tooth| workpiece.teeth[tooth].fdi),
        tissue: evidence.tissue.and_then(|tissue| tissue_name(scenario, tissue)),
        wall: evidence.direction.map(|direction| direction.id().to_string()),
        depth_mm: evidence.depth.map(rounded),
        volume_mm3: evidence.volume.map(round_to_nine_decimals),
        force_n: evidence.force.map(rounded),
    }
}

/// The greatest episodes of each kind.
fn episodes(scenario: &Scenario, scored: &Scored) -> Vec<EpisodeFile> {
    let all = score::error_episodes(scenario, scored);
    let of_kinds = all.chunk_by(|a, b| a.kind == b.kind);
    of_kinds.flat_map(|of_kind| of_kind.iter().take(EPISODES_MAX)).map(|e| episode_file(scenario, e)).collect()
}

fn episode_file(scenario: &Scenario, episode: &ErrorEpisode) -> EpisodeFile {
    let rounded = |value: f32| round_to_nine_decimals(f64::from(value));
    let is_contact = matches!(episode.kind, EpisodeKind::Force | EpisodeKind::Neighbour | EpisodeKind::Soft);
    let is_timed = episode.worst.is_some();
    EpisodeFile {
        kind: episode.kind.id().to_string(),
        zone: episode.zone.map(|zone| scenario.zones[zone].id.clone()),
        tissue: tissue_name(scenario, episode.tissue),
        wall: episode.direction.map(|direction| direction.id().to_string()),
        place_mm: episode.place.to_array().map(rounded),
        depth_mm: episode.depth.map(rounded),
        volume_mm3: (!is_contact).then(|| round_to_nine_decimals(episode.volume)),
        force_n: is_timed.then(|| rounded(episode.force)),
        at_s: episode.worst.map(Tick::seconds),
        force_at_n: is_timed.then(|| rounded(episode.worst_force)),
        from_s: episode.span.map(|[from, _]| from.seconds()),
        to_s: episode.span.map(|[_, to]| to.seconds()),
        contact_s: is_contact.then(|| round_to_nine_decimals(episode.seconds)),
    }
}

fn tissue_name(scenario: &Scenario, tissue: Label) -> Option<String> {
    scenario.tissues.by_label(tissue).map(|entry| entry.name.clone())
}

/// Checks that points are numbers between zero and their maximum, each by itself; their sum is not checked here.
fn check_points(grade: &GradeFile) -> Result<(), String> {
    let pairs = grade.items.iter().map(|item| (item.points, item.max_points));
    for (points, most) in pairs.chain([(grade.points, grade.max_points)]) {
        if !(most.is_finite() && most >= 0.0 && points >= 0.0 && points <= most + POINTS_TOLERANCE) {
            return Err(format!("the points of its grade are invalid: {points:e} of {most:e}"));
        }
    }
    match grade.pass_points.is_finite() {
        true => Ok(()),
        false => Err("the points of its grade are invalid".into()),
    }
}

fn voxel_mm(workpiece: &Workpiece) -> [f64; 3] {
    workpiece.volume.grid().spacing.to_array().map(|mm| (f64::from(mm) * 1e6).round() / 1e6)
}

/// Digest of the form of a workpiece's teeth: the size of the grid, and the voxels that are solid. Caries and stains
/// change tissues and no form; the volume before a cavity was cut is taken, and deposits count as air.
fn tooth_sha256(workpiece: &Workpiece, tissues: &TissueTable) -> String {
    let volume = workpiece.original.as_ref().unwrap_or(&workpiece.volume);
    let is_tooth: [bool; 256] = std::array::from_fn(|label| {
        let label = Label(label as u8);
        label != Label::AIR && tissues.role(label) != Some(TissueRole::Deposit)
    });
    let mut digest = Sha256::new();
    volume.grid().dims.iter().for_each(|n| digest.update(n.to_le_bytes()));
    let solid: Vec<u8> = volume.tissues().map(|tissue| u8::from(is_tooth[usize::from(tissue.0)])).collect();
    digest.update(solid);
    hex(&digest.finalize())
}

fn site(result: &SiteResult) -> SiteReadingFile {
    SiteReadingFile {
        site: result.site.code().to_string(),
        read_mm: result.reading.map(|r| r.depth_mm),
        true_mm: round_to_hundredths(result.true_depth),
        recession_mm: round_to_hundredths(result.recession),
        force_n: result.reading.map(|r| round_to_hundredths(f64::from(r.force))),
        at_s: result.reading.map(|r| r.at.seconds()),
        calculus_marked: result.calculus_marked,
        calculus: result.has_calculus,
    }
}

/// Rounds a length or a force to hundredths.
fn round_to_hundredths(value: f64) -> f64 {
    (value * 100.0).round() / 100.0
}

fn yes() -> bool {
    true
}

/// Rounds to nine decimals: finer than any measure is meaningful, coarser than rounding errors.
fn round_to_nine_decimals(value: f64) -> f64 {
    let rounded = (value * 1e9).round() / 1e9;
    if rounded.is_finite() { rounded + 0.0 } else { value }
}

fn stages(recording: &Recording, scored: &Scored) -> Vec<StageResultFile> {
    let results = recording.scenario.stages.iter().zip(&scored.replay.outcome.stages).zip(&scored.led_ticks);
    let stage = |(index, ((stage, result), &led)): (
        usize,
        ((&typodont_exercise::scenario::Stage, &typodont_exercise::session::StageResult), &u64),
    )| {
        let answers = stage.ask.iter().zip(&result.answers).filter_map(|(question, given)| {
            let AnswerRecord { value, at, correct: right, step } = given.as_ref()?;
            Some(AnswerResultFile {
                question: question.id.clone(),
                text: question.text.clone(),
                value: answer_value(value),
                at_s: at.seconds(),
                right: *right,
                truth: truth(recording, index, &question.kind, scored),
                level: step.map(|(level, _)| (f64::from(level) * 1e6).round() / 1e6),
            })
        });
        let adjusted = result.adjusted.iter().filter_map(|&(label, coefficient)| {
            let tissue = recording.scenario.tissues.by_label(label)?;
            Some(format!("{} {}", tissue.name, CoefficientName::from(coefficient)))
        });
        StageResultFile {
            id: stage.id.clone(),
            title: stage.title.clone(),
            started_s: result.started.seconds(),
            ended_s: result.ended.seconds(),
            ended_by: ended_by_name(result.ended_by).to_string(),
            guided: stage.guidance.is_some(),
            led_s: (led > 0).then(|| Tick(led).seconds()),
            adjusted: adjusted.collect(),
            answers: answers.collect(),
        }
    };
    results.enumerate().map(stage).collect()
}

fn answer_value(value: &AnswerValue) -> Json {
    match value {
        AnswerValue::Word(word) => Json::from(word.as_str()),
        AnswerValue::Quadrant(quadrant) => Json::from(*quadrant),
        AnswerValue::YesNo(yes) => Json::from(*yes),
        AnswerValue::Number(number) => Json::from(*number),
    }
}

fn truth(recording: &Recording, stage: usize, kind: &QuestionKind, scored: &Scored) -> Json {
    let workpiece = &scored.replay.workpiece;
    let lesion = |name: &str| workpiece.lesion(&recording.scenario, stage, name);
    match kind {
        QuestionKind::ToothWith { decay } => {
            lesion(decay).map_or(Json::Null, |l| Json::from(workpiece.teeth[l.tooth].id.as_str()))
        }
        QuestionKind::QuadrantOf { decay } => lesion(decay).map_or(Json::Null, |l| Json::from(l.quadrant)),
        QuestionKind::Choice { correct, .. } => correct.as_deref().map_or(Json::Null, Json::from),
        QuestionKind::YesNo { correct } => correct.map_or(Json::Null, Json::from),
        QuestionKind::Number { correct, .. } => correct.map_or(Json::Null, Json::from),
        QuestionKind::Text => Json::Null,
    }
}

fn grade(grade: &Grade) -> GradeFile {
    GradeFile {
        points: round_to_nine_decimals(grade.points),
        max_points: round_to_nine_decimals(grade.max_points),
        pass_points: grade.pass_points,
        finished: grade.finished,
        passed: grade.passed,
        hard_fails: grade.hard_fails.iter().filter(|f| f.failed).map(|f| f.title.clone()).collect(),
        items: grade
            .items
            .iter()
            .map(|item| ItemResultFile {
                title: item.title.clone(),
                metric: item.metric.clone(),
                value: item.value.map(round_to_nine_decimals),
                points: round_to_nine_decimals(item.points),
                max_points: item.max_points,
                full_at: item.full_at,
                zero_at: item.zero_at,
                counts_with: item.counts_with.as_ref().map(|c| c.metric.clone()),
                counts_with_share: item.counts_with.as_ref().map(|c| round_to_nine_decimals(c.share)),
            })
            .collect(),
        hard_fail_checks: grade
            .hard_fails
            .iter()
            .map(|fail| {
                let (above, below) = match fail.limit {
                    Limit::Above(limit) => (Some(limit), None),
                    Limit::Below(limit) => (None, Some(limit)),
                };
                let (title, metric) = (fail.title.clone(), fail.metric.clone());
                CriticalErrorFile {
                    title,
                    metric,
                    value: fail.value.map(round_to_nine_decimals),
                    above,
                    below,
                    failed: fail.failed,
                }
            })
            .collect(),
    }
}

fn questionnaire(questionnaire: &Questionnaire, ratings: &[Option<u8>]) -> QuestionnaireFile {
    let in_category = questionnaire.categories.iter().flat_map(|c| c.items.iter().map(move |i| (c, i)));
    let items: Vec<RatingFile> = in_category
        .zip(ratings)
        .map(|((category, item), rating)| RatingFile {
            id: item.id.clone(),
            category: category.id.clone(),
            value: rating.map(f64::from),
            counted: rating.map(|r| f64::from(questionnaire.scored_answer(item, r))),
        })
        .collect();
    let mean = |category: &str| mean(items.iter().filter(|i| i.category == category).filter_map(|i| i.counted));
    let categories =
        questionnaire.categories.iter().map(|c| (c.id.clone(), mean(&c.id).map(round_to_nine_decimals))).collect();
    QuestionnaireFile { id: questionnaire.id.clone(), items, categories }
}

/// The mean of numbers; `None` of none.
pub fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0u32), |(sum, count), v| (sum + v, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}
