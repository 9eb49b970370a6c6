//! The identity of every measure, by the family that computes it.
//!
//! `score` computes each family by a match over its enum, so that the compiler finds a measure without a formula.

/// Declares a family: an enum, and all its variants for the test that each has a row in the table.
macro_rules! family {
    ($(#[$doc:meta])* $family:ident { $($variant:ident,)+ }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum $family {
            $($variant,)+
        }

        impl $family {
            /// Every measure of the family.
            pub const ALL: &[$family] = &[$($family::$variant),+];
        }
    };
}

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

impl MetricId {
    /// Returns every measure, family by family.
    pub fn all() -> impl Iterator<Item = MetricId> {
        let single = std::iter::once(MetricId::SurfaceWithinTolerance);
        single
            .chain(StageMetric::ALL.iter().copied().map(MetricId::Stage))
            .chain(RemovedVolumeMetric::ALL.iter().copied().map(MetricId::RemovedVolume))
            .chain(RemovalDepthMetric::ALL.iter().copied().map(MetricId::RemovalDepth))
            .chain(ProcessMetric::ALL.iter().copied().map(MetricId::Process))
            .chain(VisibilityMetric::ALL.iter().copied().map(MetricId::Visibility))
            .chain(FillingMetric::ALL.iter().copied().map(MetricId::Filling))
            .chain(TrialMetric::ALL.iter().copied().map(MetricId::Trial))
            .chain(ChartMetric::ALL.iter().copied().map(MetricId::Chart))
            .chain(ZoneMetric::ALL.iter().copied().map(MetricId::Zone))
    }
}

family! {
    /// Measures of a stage and its questions.
    StageMetric {
        CuttingStageTime,
        ToothDetected,
        DetectionLevel,
        ToothDetectionTime,
        QuadrantDetected,
        QuadrantDetectionTime,
        QuestionsRight,
    }
}

family! {
    /// Measures of the removed volume, from numbers of voxels.
    RemovedVolumeMetric {
        DecayCleared,
        AccessibleDecayCleared,
        HealthyPerDecay,
        Efficiency,
        Dice,
        Jaccard,
        Precision,
        Recall,
    }
}

family! {
    /// Measures of distances at the removed volume.
    RemovalDepthMetric {
        Hausdorff,
        Hausdorff95,
        OvercutDepth,
        UndercutDepth,
        PulpExposed,
        RemainingDentineThickness,
    }
}

family! {
    /// Measures of force, movement and time.
    ProcessMetric {
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
}

family! {
    /// Measures of what was cut out of sight.
    VisibilityMetric {
        UnseenShare,
        UnseenVolume,
        UnseenSoundVolume,
    }
}

family! {
    /// Measures of a filling.
    FillingMetric {
        Filled,
        ContourMean,
        ContourP95,
        ContourMax,
        OverhangMax,
        DeficitMax,
        OverhangVolume,
        VoidVolume,
    }
}

family! {
    /// Measures of trials in which the site of the caries is drawn.
    TrialMetric {
        Corrected,
        CorrectedLow,
        CorrectedHigh,
        TrialsRight,
        LevelCorrected,
        AnswerTime,
    }
}

family! {
    /// Measures of a periodontal chart.
    ChartMetric {
        SitesRead,
        WithinOneMm,
        MeanError,
        MeanBias,
        MaxForce,
        HighForceReadings,
        CalculusFound,
        CalculusFalseAlarms,
    }
}

family! {
    /// Measures of a zone.
    ZoneMetric {
        Removed,
        MaxForceNear,
        MaxSpeedNear,
    }
}
