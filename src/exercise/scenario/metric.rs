//! The measures that a rubric can refer to: their names, units and formulae.
//!
//! The names are a contract (`session.json`); the values are computed in `score`, from a recording alone.

use super::metric_id::{
    ChartMetric, FillingMetric, MetricId, ProcessMetric, RemovalDepthMetric, RemovedVolumeMetric, StageMetric,
    TrialMetric, VisibilityMetric, ZoneMetric,
};
use std::fmt;

/// Direction in which a measure improves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Better {
    Higher,
    Lower,
    /// A descriptive measure: neither a higher nor a lower value is better.
    Neither,
}

/// Description of a measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MetricInfo {
    pub id: MetricId,
    pub name: &'static str,
    pub title: &'static str,
    /// Unit shown after the value; empty for counts and ratios.
    pub unit: &'static str,
    pub better: Better,
    /// Formula, with its rule for empty sets. R is the set of removed voxels, D the decay at the start, T the target
    /// zone.
    pub formula: &'static str,
    /// Features without which the measure has no value, in the order in which they are checked.
    pub required_features: &'static [RequiredFeature],
    /// True for a measure that has no meaning without tissue to be removed.
    pub is_of_target: bool,
}

/// A measure of the table, with its argument if it takes one.
#[derive(Clone, Debug, PartialEq)]
pub struct Metric {
    pub info: &'static MetricInfo,
    pub argument: Option<MetricArgument>,
}

/// Argument in the brackets of a measure's name.
#[derive(Clone, Debug, PartialEq)]
pub enum MetricArgument {
    Zone(String),
    ToleranceMm(f32),
}

/// Feature of an exercise without which a measure has no value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RequiredFeature {
    /// A tooth with caries.
    Decay,
    /// A prepared cavity, and a stage in which it is filled.
    Filling,
    /// A question about which tooth has the caries.
    ToothQuestion,
    /// A question about the quadrant of the caries.
    QuadrantQuestion,
    /// A question with a correct answer.
    JudgedQuestion,
    StiffnessSteps,
    /// A stage in which the site of the caries is drawn.
    Draw,
    /// A stage in which probing depths are charted.
    DepthChart,
    /// A stage in which calculus is charted.
    CalculusChart,
    /// A tooth with calculus.
    Calculus,
}

impl MetricInfo {
    /// Returns true for a measure of force or speed near a zone.
    pub fn is_near_zone(&self) -> bool {
        matches!(self.id, MetricId::Zone(ZoneMetric::MaxForceNear | ZoneMetric::MaxSpeedNear))
    }

    /// Returns true for a measure whose argument is a zone.
    pub fn takes_zone(&self) -> bool {
        matches!(self.id, MetricId::Zone(_))
    }

    /// Adds the features that an exercise must have for this measure, in the order in which they are checked.
    const fn requires(self, required_features: &'static [RequiredFeature]) -> MetricInfo {
        MetricInfo { required_features, ..self }
    }

    /// Marks a measure that has no meaning without tissue to be removed: by its rule for empty sets, it would then
    /// report a good result.
    const fn of_target(self) -> MetricInfo {
        MetricInfo { is_of_target: true, ..self }
    }
}

use Better::{Higher, Lower, Neither};

const fn info(
    id: MetricId,
    name: &'static str,
    title: &'static str,
    unit: &'static str,
    better: Better,
    formula: &'static str,
) -> MetricInfo {
    MetricInfo { id, name, title, unit, better, formula, required_features: &[], is_of_target: false }
}

/// Measures without an argument, in the order of reports.
pub const PLAIN: &[MetricInfo] = &[
    info(
        MetricId::RemovedVolume(RemovedVolumeMetric::DecayCleared),
        "decay_cleared_pct",
        "Caries removed",
        "%",
        Higher,
        "100·|R∩D| / |D|; no value without caries",
    )
    .requires(&[RequiredFeature::Decay])
    .of_target(),
    info(
        MetricId::RemovedVolume(RemovedVolumeMetric::AccessibleDecayCleared),
        "accessible_decay_cleared_pct",
        "Accessible caries removed",
        "%",
        Higher,
        "100·|R∩D′| / |D′|; D′ is the part of D that the smallest cutting instrument of the tray reaches, as a ball, \
         without cutting other tissue: corners between coarse voxels do not count; no value without caries",
    )
    .requires(&[RequiredFeature::Decay])
    .of_target(),
    info(
        MetricId::RemovedVolume(RemovedVolumeMetric::HealthyPerDecay),
        "healthy_per_decay_pct",
        "Sound tissue removed, relative to the caries",
        "%",
        Lower,
        "100·|R∖D| / |D|; the denominator is the caries at the start, so the value may exceed 100; no value \
         without caries",
    )
    .requires(&[RequiredFeature::Decay])
    .of_target(),
    info(
        MetricId::Stage(StageMetric::CuttingStageTime),
        "time_to_clear_s",
        "Duration of the cutting stage",
        "s",
        Lower,
        "end − start of the last stage in which tooth or restoration is cut",
    )
    .of_target(),
    info(
        MetricId::Stage(StageMetric::ToothDetected),
        "detect_tooth",
        "Carious tooth identified",
        "",
        Higher,
        "1 if the tooth named has caries; 0 if another tooth or none was named; no value if not asked",
    )
    .requires(&[RequiredFeature::ToothQuestion]),
    info(
        MetricId::Stage(StageMetric::DetectionLevel),
        "detect_level",
        "Stiffness at which the caries was detected",
        "",
        Higher,
        "stiffness coefficient of the caries at the time of the answer; no value if not asked or not answered",
    )
    .requires(&[RequiredFeature::ToothQuestion, RequiredFeature::StiffnessSteps]),
    info(
        MetricId::Stage(StageMetric::ToothDetectionTime),
        "detect_level_time_s",
        "Time to identify the carious tooth",
        "s",
        Lower,
        "from the start of the stiffness step, or of the stage if there are no steps, to the answer; no value \
         if not answered",
    )
    .requires(&[RequiredFeature::ToothQuestion]),
    info(
        MetricId::Stage(StageMetric::QuadrantDetected),
        "detect_quadrant",
        "Carious quarter of the occlusal surface identified",
        "",
        Higher,
        "1 if the quarter named has caries; 0 if another quarter or none was named; no value if not asked",
    )
    .requires(&[RequiredFeature::QuadrantQuestion]),
    info(
        MetricId::Stage(StageMetric::QuadrantDetectionTime),
        "detect_quadrant_time_s",
        "Time to identify the carious quarter of the occlusal surface",
        "s",
        Lower,
        "from the start of the stage to the answer; no value if not answered",
    )
    .requires(&[RequiredFeature::QuadrantQuestion]),
    info(
        MetricId::Stage(StageMetric::QuestionsRight),
        "questions_right_pct",
        "Questions answered correctly",
        "%",
        Higher,
        "100·correct answers / questions with a correct answer, including those left unanswered; no value if there are \
        none",
    )
    .requires(&[RequiredFeature::JudgedQuestion]),
    info(
        MetricId::RemovedVolume(RemovedVolumeMetric::Dice),
        "dice",
        "Overlap with the target (Dice)",
        "",
        Higher,
        "2·|R∩T| / (|R|+|T|); 1 if both are empty",
    )
    .of_target(),
    info(
        MetricId::RemovedVolume(RemovedVolumeMetric::Jaccard),
        "jaccard",
        "Overlap with the target (Jaccard)",
        "",
        Higher,
        "|R∩T| / |R∪T|; 1 if both are empty",
    )
    .of_target(),
    info(
        MetricId::RemovedVolume(RemovedVolumeMetric::Precision),
        "precision",
        "Proportion of the removed tissue within the target (precision)",
        "",
        Higher,
        "|R∩T| / |R|; if nothing was removed: 1 if T is empty, otherwise 0",
    )
    .of_target(),
    info(
        MetricId::RemovedVolume(RemovedVolumeMetric::Recall),
        "recall",
        "Proportion of the target removed (recall)",
        "",
        Higher,
        "|R∩T| / |T|; 1 if there \
         is no target",
    )
    .of_target(),
    info(
        MetricId::RemovalDepth(RemovalDepthMetric::Hausdorff),
        "hausdorff_mm",
        "Maximum distance between cavity and target (Hausdorff)",
        "mm",
        Lower,
        "symmetric, between the borders of R and T; no value if either is empty",
    )
    .of_target(),
    info(
        MetricId::RemovalDepth(RemovalDepthMetric::Hausdorff95),
        "hausdorff95_mm",
        "Distance between cavity and target, 95th percentile",
        "mm",
        Lower,
        "95th percentile of the distances of which hausdorff_mm is the greatest",
    )
    .of_target(),
    info(
        MetricId::RemovalDepth(RemovalDepthMetric::OvercutDepth),
        "overcut_depth_max_mm",
        "Deepest cut into sound tissue",
        "mm",
        Lower,
        "greatest distance of a removed sound voxel from D; 0 if none was removed; no value if some were \
         removed but there is no caries",
    )
    .of_target(),
    info(
        MetricId::RemovalDepth(RemovalDepthMetric::UndercutDepth),
        "undercut_depth_max_mm",
        "Maximum distance of remaining caries from the cavity",
        "mm",
        Lower,
        "greatest distance of a remaining carious voxel from R; 0 if none remains; no value if nothing was removed",
    )
    .of_target(),
    info(
        MetricId::RemovalDepth(RemovalDepthMetric::PulpExposed),
        "pulp_exposed",
        "Pulp exposed",
        "",
        Lower,
        "1 if a pulp voxel was removed or exposed by the removal of an adjacent voxel, otherwise 0",
    ),
    info(
        MetricId::RemovalDepth(RemovalDepthMetric::RemainingDentineThickness),
        "remaining_dentine_thickness_min_mm",
        "Minimum remaining dentine thickness (cavity to pulp)",
        "mm",
        Higher,
        "smallest distance between R without pulp and the pulp; no value if either is empty",
    ),
    info(
        MetricId::Process(ProcessMetric::MaxForce),
        "force_max_n",
        "Maximum force",
        "N",
        Lower,
        "greatest force on the device in contact, without guidance forces; 0 if never in contact",
    ),
    info(
        MetricId::Process(ProcessMetric::MeanForce),
        "force_mean_n",
        "Mean force",
        "N",
        Lower,
        "mean force over the cycles in contact, without guidance forces; no value if never in contact",
    ),
    info(
        MetricId::Process(ProcessMetric::MaxSpeed),
        "speed_max_mm_s",
        "Maximum speed in contact",
        "mm/s",
        Lower,
        "of the tip, over intervals of 20 ms with any contact, including the end of an approach; no value if \
         never in contact",
    ),
    info(
        MetricId::Process(ProcessMetric::MaxForceNearPulp),
        "force_max_near_pulp_n",
        "Maximum force near the pulp",
        "N",
        Lower,
        "within near_mm of the pulp at the start; 0 if never there",
    ),
    info(
        MetricId::Process(ProcessMetric::MeanForceNearPulp),
        "force_mean_near_pulp_n",
        "Mean force near the pulp",
        "N",
        Lower,
        "within near_mm of the pulp at the start; 0 if never there",
    ),
    info(
        MetricId::Process(ProcessMetric::MaxSpeedNearPulp),
        "speed_max_near_pulp_mm_s",
        "Maximum speed near the pulp",
        "mm/s",
        Lower,
        "within near_mm of the pulp at the start; 0 if never there",
    ),
    info(
        MetricId::Process(ProcessMetric::PathLength),
        "path_length_mm",
        "Path length of the tip",
        "mm",
        Neither,
        "sum of the displacements of the tip over 20 ms",
    ),
    info(
        MetricId::Process(ProcessMetric::DrillingTime),
        "drilling_time_s",
        "Cutting time",
        "s",
        Neither,
        "time during which material was cut",
    ),
    info(
        MetricId::Process(ProcessMetric::ContactTime),
        "contact_time_s",
        "Contact time",
        "s",
        Neither,
        "time during which anything was touched",
    ),
    info(
        MetricId::RemovedVolume(RemovedVolumeMetric::Efficiency),
        "efficiency_pct_s",
        "Caries removed per second of cutting",
        "%/s",
        Higher,
        "decay_cleared_pct / drilling_time_s; no value if nothing was cut",
    )
    .requires(&[RequiredFeature::Decay])
    .of_target(),
    info(
        MetricId::Process(ProcessMetric::Jerk),
        "jerk",
        "Smoothness (log dimensionless jerk)",
        "",
        Higher,
        "−ln(T⁵/L² · ∫|jerk|² dt) of the tip in contact, sampled at 50 Hz; no value for less than 1 s of contact",
    ),
    info(
        MetricId::Process(ProcessMetric::SoftTissueDrilledTime),
        "soft_tissue_drilled_s",
        "Time the rotating bur touched soft tissue",
        "s",
        Lower,
        "time during which a rotating bur touched gingiva or other soft tissue",
    ),
    info(
        MetricId::Process(ProcessMetric::NeighbourDrilledTime),
        "neighbour_drilled_s",
        "Time the rotating bur touched an adjacent tooth",
        "s",
        Lower,
        "time during which a rotating bur touched an adjacent tooth",
    ),
    info(
        MetricId::Process(ProcessMetric::SessionTime),
        "session_time_s",
        "Duration of the session",
        "s",
        Neither,
        "all stages together",
    ),
];

/// Measures of fillings, for exercises with a prepared cavity. C is the cavity, S the surface at the end, O the tooth's
/// original contour.
pub const OF_FILLINGS: &[MetricInfo] = &[
    info(
        MetricId::Filling(FillingMetric::Filled),
        "filled_pct",
        "Cavity filled with restorative material",
        "%",
        Higher,
        "100·|filled∩C| / |C|",
    )
    .requires(&[RequiredFeature::Filling]),
    info(
        MetricId::Filling(FillingMetric::ContourMean),
        "contour_mean_mm",
        "Mean distance from the original contour",
        "mm",
        Lower,
        "mean distance of S from O along the normals of O, over the mouth of the cavity and wherever material \
         lies on the tooth",
    )
    .requires(&[RequiredFeature::Filling]),
    info(
        MetricId::Filling(FillingMetric::ContourP95),
        "contour_p95_mm",
        "Distance from the original contour, 95th percentile",
        "mm",
        Lower,
        "95th percentile of the distances of S from O whose mean is contour_mean_mm",
    )
    .requires(&[RequiredFeature::Filling]),
    info(
        MetricId::Filling(FillingMetric::ContourMax),
        "contour_max_mm",
        "Maximum distance from the original contour",
        "mm",
        Lower,
        "greatest of the distances of S from O whose mean is contour_mean_mm",
    )
    .requires(&[RequiredFeature::Filling]),
    info(
        MetricId::Filling(FillingMetric::OverhangMax),
        "overhang_max_mm",
        "Maximum excess beyond the original contour",
        "mm",
        Lower,
        "greatest distance by which S lies outside O; 0 \
         if nowhere",
    )
    .requires(&[RequiredFeature::Filling]),
    info(
        MetricId::Filling(FillingMetric::DeficitMax),
        "deficit_max_mm",
        "Maximum deficiency",
        "mm",
        Lower,
        "greatest distance by which S lies inside O; 0 if nowhere",
    )
    .requires(&[RequiredFeature::Filling]),
    info(
        MetricId::Filling(FillingMetric::OverhangVolume),
        "overhang_mm3",
        "Restorative material outside the original contour",
        "mm³",
        Lower,
        "volume placed outside O, from voxel densities",
    )
    .requires(&[RequiredFeature::Filling]),
    info(
        MetricId::Filling(FillingMetric::VoidVolume),
        "void_mm3",
        "Voids in the restoration",
        "mm³",
        Lower,
        "volume of air in C enclosed by material on all sides",
    )
    .requires(&[RequiredFeature::Filling]),
];

/// Measures of trials in which the site of the caries is drawn, computed if an exercise has such trials.
pub const OF_DRAWS: &[MetricInfo] = &[
    info(
        MetricId::Trial(TrialMetric::Corrected),
        "detect_corrected_pct",
        "Caries located, corrected for chance",
        "%",
        Higher,
        "100·(p − c) / (1 − c); p is the share of trials with a correct answer, c the share that guessing achieves on \
         average; a trial without an answer counts as c in p; 0 for guessing, negative for fewer correct answers than \
         guessing achieves",
    )
    .requires(&[RequiredFeature::Draw]),
    info(
        MetricId::Trial(TrialMetric::CorrectedLow),
        "detect_corrected_low_pct",
        "Caries located, corrected for chance: lower bound",
        "%",
        Higher,
        "lower bound of the 95 % interval (Wilson) of p, corrected for chance as the result is",
    )
    .requires(&[RequiredFeature::Draw]),
    info(
        MetricId::Trial(TrialMetric::CorrectedHigh),
        "detect_corrected_high_pct",
        "Caries located, corrected for chance: upper bound",
        "%",
        Higher,
        "upper bound of the 95 % interval (Wilson) of p, corrected for chance as the result is",
    )
    .requires(&[RequiredFeature::Draw]),
    info(
        MetricId::Trial(TrialMetric::TrialsRight),
        "detect_trials_right",
        "Trials with a correct answer",
        "",
        Higher,
        "number of trials with a correct answer",
    )
    .requires(&[RequiredFeature::Draw]),
    info(
        MetricId::Trial(TrialMetric::LevelCorrected),
        "detect_level_corrected",
        "Stiffness at which the caries was located, corrected for chance",
        "",
        Higher,
        "sum / number of trials; a correct answer adds the stiffness coefficient of the caries at its time, an \
         incorrect one subtracts that coefficient times c / (1 − c), with c as above; no value without stiffness steps",
    )
    .requires(&[RequiredFeature::Draw, RequiredFeature::StiffnessSteps]),
    info(
        MetricId::Trial(TrialMetric::AnswerTime),
        "detect_trial_time_s",
        "Mean time to an answer",
        "s",
        Lower,
        "mean time from the start of a trial to its answer, over all trials with an answer; no value if there is none",
    )
    .requires(&[RequiredFeature::Draw]),
];

/// Measures of visibility, computed if the trainee's view was recorded, as the window records it.
pub const OF_VIEWS: &[MetricInfo] = &[
    info(
        MetricId::Visibility(VisibilityMetric::UnseenShare),
        "unseen_cut_pct",
        "Tissue cut without direct or mirror vision",
        "%",
        Lower,
        "100·|H| / |R′|; R′ are the voxels removed while the view is known, H those of them that were hidden from the \
         eye at that moment by the tooth, the gingiva or an adjacent tooth, or lay outside of the picture, and were not \
         seen in a mirror either; what is within 0.5 mm of a voxel does not hide it; no value if nothing was cut or no view was recorded",
    ),
    info(
        MetricId::Visibility(VisibilityMetric::UnseenVolume),
        "unseen_cut_mm3",
        "Volume of tissue cut without direct or mirror vision",
        "mm³",
        Lower,
        "volume of H, as in unseen_cut_pct; no value if no view was recorded",
    ),
    info(
        MetricId::Visibility(VisibilityMetric::UnseenSoundVolume),
        "unseen_sound_cut_mm3",
        "Volume of sound tissue cut without direct or mirror vision",
        "mm³",
        Lower,
        "volume of the sound voxels of H, as in unseen_cut_pct; no value if no view was recorded",
    ),
];

/// Measures of a periodontal chart, computed if a stage asks for one. The sites are the six sites of the tooth.
pub const CHARTING: &[MetricInfo] = &[
    info(
        MetricId::Chart(ChartMetric::SitesRead),
        "sites_read_pct",
        "Sites probed",
        "%",
        Higher,
        "100·sites with a reading / 6",
    )
    .requires(&[RequiredFeature::DepthChart]),
    info(
        MetricId::Chart(ChartMetric::WithinOneMm),
        "probing_within_1mm_pct",
        "Readings within 1 mm",
        "%",
        Higher,
        "100·sites with |reading − true depth| ≤ 1 mm / 6; a site without a reading does not count",
    )
    .requires(&[RequiredFeature::DepthChart]),
    info(
        MetricId::Chart(ChartMetric::MeanError),
        "probing_error_mm",
        "Mean error of the readings",
        "mm",
        Lower,
        "mean of |reading − true depth| over the sites with a reading; no value without readings",
    )
    .requires(&[RequiredFeature::DepthChart]),
    info(
        MetricId::Chart(ChartMetric::MeanBias),
        "probing_bias_mm",
        "Mean over- or under-reading",
        "mm",
        Neither,
        "mean of reading − true depth over the sites with a reading; positive values are too deep; no value \
         without readings",
    )
    .requires(&[RequiredFeature::DepthChart]),
    info(
        MetricId::Chart(ChartMetric::MaxForce),
        "probing_force_max_n",
        "Maximum probing force",
        "N",
        Lower,
        "greatest force at the time of a reading; no value without readings",
    )
    .requires(&[RequiredFeature::DepthChart]),
    info(
        MetricId::Chart(ChartMetric::HighForceReadings),
        "probing_force_high",
        "Readings with excessive force",
        "",
        Lower,
        "readings at which the probe was pressed with more than 0.35 N (0.25 N is taught); no value without readings",
    )
    .requires(&[RequiredFeature::DepthChart]),
    info(
        MetricId::Chart(ChartMetric::CalculusFound),
        "calculus_found_pct",
        "Calculus detected",
        "%",
        Higher,
        "100·sites with calculus that were recorded / sites with calculus; no value without calculus or if not asked",
    )
    .requires(&[RequiredFeature::CalculusChart, RequiredFeature::Calculus]),
    info(
        MetricId::Chart(ChartMetric::CalculusFalseAlarms),
        "calculus_false_alarms",
        "Calculus recorded where there is none",
        "",
        Lower,
        "sites that were recorded but have no calculus; no value if not asked, or if there is calculus and no \
         site was recorded",
    )
    .requires(&[RequiredFeature::CalculusChart]),
];

/// Measures with an argument in brackets.
pub const WITH_ARGUMENT: &[MetricInfo] = &[
    info(
        MetricId::Zone(ZoneMetric::Removed),
        "zone_removed_pct",
        "Zone removed",
        "%",
        Neither,
        "100·|R∩Z| / |Z|; caries does not count in a zone that must be preserved or must not be touched; no value if \
         the zone is empty",
    ),
    info(
        MetricId::Zone(ZoneMetric::MaxForceNear),
        "force_max_near_n",
        "Maximum force near a zone",
        "N",
        Lower,
        "within near_mm of the zone at the start, without guidance forces; 0 if never there",
    ),
    info(
        MetricId::Zone(ZoneMetric::MaxSpeedNear),
        "speed_max_near_mm_s",
        "Maximum speed near a zone",
        "mm/s",
        Lower,
        "within near_mm of the zone at the start, over intervals of 20 ms with any contact; 0 if never there",
    ),
    info(
        MetricId::SurfaceWithinTolerance,
        "surface_within_tol",
        "Agreement of cavity and target surfaces",
        "",
        Higher,
        "proportion of the borders of R and T within the tolerance of each other; no value if either is empty",
    )
    .of_target(),
];

/// Reason for which a measure's name is not accepted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum MetricParseError {
    /// There is no measure of this name.
    Name(String),
    /// The argument in brackets is missing, invalid or not permitted.
    Argument(&'static str),
}

impl Metric {
    /// Parses a name such as `dice`, `zone_removed_pct(target)` or `surface_within_tol(0.3)`.
    ///
    /// # Errors
    /// Returns an error if there is no measure of this name, or if its argument is missing, invalid or not permitted.
    pub fn parse(written: &str) -> Result<Metric, MetricParseError> {
        let (name, inner) = match written.split_once('(') {
            Some((name, rest)) => match rest.strip_suffix(')') {
                Some(inner) => (name, Some(inner.trim())),
                None => return Err(MetricParseError::Argument("the bracket is not closed")),
            },
            None => (written, None),
        };
        if let Some(info) = without_argument().find(|a| a.name == name) {
            return match inner {
                None => Ok(Metric { info, argument: None }),
                Some(_) => Err(MetricParseError::Argument("this measure takes no argument in brackets")),
            };
        }
        let info =
            WITH_ARGUMENT.iter().find(|a| a.name == name).ok_or_else(|| MetricParseError::Name(name.to_string()))?;
        let argument = match inner {
            Some(zone) if info.takes_zone() && !zone.is_empty() => MetricArgument::Zone(zone.to_string()),
            _ if info.takes_zone() => {
                return Err(MetricParseError::Argument("name a zone in brackets: zone_removed_pct(target)"));
            }
            Some(number) => match number.parse() {
                Ok(mm) if mm > 0.0 && mm < 10.0 => MetricArgument::ToleranceMm(mm),
                _ => {
                    return Err(MetricParseError::Argument(
                        "give a tolerance in mm in brackets: surface_within_tol(0.3)",
                    ));
                }
            },
            None => {
                return Err(MetricParseError::Argument("give a tolerance in mm in brackets: surface_within_tol(0.3)"));
            }
        };
        Ok(Metric { info, argument: Some(argument) })
    }

    /// Returns the measure's full name, as accepted by [`Metric::parse`] and written to `session.json`.
    pub fn name(&self) -> String {
        match &self.argument {
            None => self.info.name.to_string(),
            Some(MetricArgument::Zone(zone)) => format!("{}({zone})", self.info.name),
            Some(MetricArgument::ToleranceMm(mm)) => format!("{}({mm})", self.info.name),
        }
    }

    /// Returns a measure without an argument.
    pub fn plain(info: &'static MetricInfo) -> Metric {
        Metric { info, argument: None }
    }
}

impl fmt::Display for Metric {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.name())
    }
}

/// Returns every measure without an argument, in the order of reports.
pub fn without_argument() -> impl Iterator<Item = &'static MetricInfo> + Clone {
    PLAIN.iter().chain(OF_FILLINGS).chain(OF_DRAWS).chain(OF_VIEWS).chain(CHARTING)
}

/// Returns every measure.
pub fn all() -> impl Iterator<Item = &'static MetricInfo> + Clone {
    without_argument().chain(WITH_ARGUMENT)
}

/// Returns the names of all measures, without arguments, for diagnostics.
pub fn names() -> impl Iterator<Item = &'static str> + Clone {
    all().map(|a| a.name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn names_round_trip() {
        for name in ["dice", "zone_removed_pct(target)", "force_max_near_n(nerve)", "surface_within_tol(0.3)"] {
            assert_eq!(Metric::parse(name).map(|m| m.name()), Ok(name.to_string()));
        }
        for about in without_argument() {
            assert!(Metric::parse(about.name).is_ok(), "{}", about.name);
        }
    }

    #[test]
    fn every_measure_has_a_row_and_a_name_of_its_own() {
        let (ids, names): (HashSet<_>, HashSet<_>) = all().map(|about| (about.id, about.name)).unzip();
        assert_eq!([ids.len(), names.len()], [all().count(); 2]);
        assert_eq!(ids, MetricId::all().collect(), "a variant without a row, or a row of another");
    }

    #[test]
    fn wrong_names_say_what_is_missing() {
        assert_eq!(Metric::parse("dise"), Err(MetricParseError::Name("dise".into())));
        for name in
            ["zone_removed_pct", "zone_removed_pct()", "force_max_near_n", "surface_within_tol(x)", "dice(1)", "dice("]
        {
            assert!(matches!(Metric::parse(name), Err(MetricParseError::Argument(_))), "{name}");
        }
    }
}
