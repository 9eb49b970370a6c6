//! The identity of every measure, by the family that computes it.
//!
//! `score` computes each family by a match over its enum, so that the compiler finds a measure without a formula.

/// A measure of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MetricId {
    Stage(StageMetric),
    RemovedVolume(RemovedVolumeMetric),
    RemovalDepth(RemovalDepthMetric),
    Process(ProcessMetric),
    Visibility(VisibilityMetric),
    Filling(FillingMetric),
    Trial(TrialMetric),
    Chart(ChartMetric),
    Zone(ZoneMetric),
    /// Agreement of the borders of the removed volume and the target, within a tolerance.
    SurfaceWithinTolerance,
}

/// Measures of a stage and its questions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StageMetric {
    CuttingStageTime,
    ToothDetected,
    DetectionLevel,
    ToothDetectionTime,
    QuadrantDetected,
    QuadrantDetectionTime,
    QuestionsRight,
}

/// Measures of the removed volume, from numbers of voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RemovedVolumeMetric {
    DecayCleared,
    AccessibleDecayCleared,
    HealthyPerDecay,
    Efficiency,
    Dice,
    Jaccard,
    Precision,
    Recall,
}

/// Measures of distances at the removed volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RemovalDepthMetric {
    Hausdorff,
    Hausdorff95,
    OvercutDepth,
    UndercutDepth,
    PulpExposed,
    RemainingDentineThickness,
}

/// Measures of force, movement and time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ProcessMetric {
    MaxForce,
    MeanForce,
    MaxSpeed,
    MaxForceNearPulp,
    MeanForceNearPulp,
    MaxSpeedNearPulp,
    PathLength,
    DrillingTime,
    ContactTime,
    Jerk,
    SoftTissueDrilledTime,
    NeighbourDrilledTime,
    SessionTime,
}

/// Measures of what was cut out of sight.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum VisibilityMetric {
    UnseenShare,
    UnseenVolume,
    UnseenSoundVolume,
}

/// Measures of a filling.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FillingMetric {
    Filled,
    ContourMean,
    ContourP95,
    ContourMax,
    OverhangMax,
    DeficitMax,
    OverhangVolume,
    VoidVolume,
}

/// Measures of trials in which the site of the caries is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TrialMetric {
    Corrected,
    CorrectedLow,
    CorrectedHigh,
    TrialsRight,
    LevelCorrected,
    AnswerTime,
}

/// Measures of a periodontal chart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ChartMetric {
    SitesRead,
    WithinOneMm,
    MeanError,
    MeanBias,
    MaxForce,
    HighForceReadings,
    CalculusFound,
    CalculusFalseAlarms,
}

/// Measures of a zone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ZoneMetric {
    Removed,
    MaxForceNear,
    MaxSpeedNear,
}
