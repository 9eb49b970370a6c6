//! The measures that a rubric can refer to: their names, units and formulae.
//!
//! Names are a contract (`session.json`); what each is worth is computed in `score`, from a recording alone.

use std::fmt;

/// Which way a measure gets better.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Better {
    Higher,
    Lower,
    /// It describes; more or less of it is neither good nor bad in itself.
    Neither,
}

/// What there is to know of a measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct About {
    pub name: &'static str,
    pub title: &'static str,
    /// Unit shown behind the value; empty for counts and ratios.
    pub unit: &'static str,
    pub better: Better,
    /// How it is computed, with its rule for empty sets. R removed voxels, D decay at the start, T target zone.
    pub formula: &'static str,
}

/// A measure: one of the table, with its argument where it takes one.
#[derive(Clone, Debug, PartialEq)]
pub struct Metric {
    pub about: &'static About,
    pub argument: Option<Argument>,
}

/// What stands in the brackets of a measure's name.
#[derive(Clone, Debug, PartialEq)]
pub enum Argument {
    Zone(String),
    ToleranceMm(f32),
}

/// Measures that say nothing where there was nothing to remove: their rules for empty sets would read as praise.
const OF_TARGET: [&str; 13] = [
    "decay_cleared_pct",
    "healthy_per_decay_pct",
    "efficiency_pct_s",
    "dice",
    "jaccard",
    "precision",
    "recall",
    "hausdorff_mm",
    "hausdorff95_mm",
    "overcut_depth_max_mm",
    "undercut_depth_max_mm",
    "surface_within_tol",
    "time_to_clear_s",
];

impl About {
    pub fn is_of_target(&self) -> bool {
        OF_TARGET.contains(&self.name)
    }
}

use Better::{Higher, Lower, Neither};

const fn about(
    name: &'static str,
    title: &'static str,
    unit: &'static str,
    better: Better,
    formula: &'static str,
) -> About {
    About { name, title, unit, better, formula }
}

/// Every measure that has no argument, in the order of reports.
pub const PLAIN: &[About] = &[
    about("decay_cleared_pct", "Decay removed", "%", Higher, "100·|R∩D| / |D|; none without decay"),
    about(
        "healthy_per_decay_pct",
        "Sound tissue removed, per decay",
        "%",
        Lower,
        "100·|R∖D| / |D|: the denominator is the decay at the start, so it may pass 100; none without decay",
    ),
    about(
        "time_to_clear_s",
        "Time of the cutting stage",
        "s",
        Lower,
        "end − start of the last stage in which tooth or filling is cut",
    ),
    about(
        "detect_tooth",
        "Decayed tooth named",
        "",
        Higher,
        "1 if the named tooth has the decay, 0 if another or none was named; none if not asked",
    ),
    about(
        "detect_level",
        "Stiffness at which decay was found",
        "",
        Higher,
        "stiffness coefficient of decay in force at the answer; none if not asked or not answered",
    ),
    about(
        "detect_level_time_s",
        "Time to find the decayed tooth",
        "s",
        Lower,
        "from the start of the stiffness step, or of the stage where there are no steps, to the answer; none if not answered",
    ),
    about(
        "detect_quadrant",
        "Quadrant named",
        "",
        Higher,
        "1 if the named quadrant has the decay, 0 if another or none was named; none if not asked",
    ),
    about(
        "detect_quadrant_time_s",
        "Time to name the quadrant",
        "s",
        Lower,
        "from the start of the stage to the answer; none if not answered",
    ),
    about(
        "questions_right_pct",
        "Questions answered rightly",
        "%",
        Higher,
        "100·right / questions with a right answer, those left unanswered among them; none if there is none",
    ),
    about("dice", "Overlap with the target (Dice)", "", Higher, "2·|R∩T| / (|R|+|T|); both empty: 1"),
    about("jaccard", "Overlap with the target (Jaccard)", "", Higher, "|R∩T| / |R∪T|; both empty: 1"),
    about(
        "precision",
        "Share of the removed that was target",
        "",
        Higher,
        "|R∩T| / |R|; nothing removed: 1 if T is empty, else 0",
    ),
    about("recall", "Share of the target that was removed", "", Higher, "|R∩T| / |T|; no target: 1"),
    about(
        "hausdorff_mm",
        "Greatest distance between outlines",
        "mm",
        Lower,
        "symmetric, between the borders of R and T; none if either is empty",
    ),
    about(
        "hausdorff95_mm",
        "Distance between outlines, 95 %",
        "mm",
        Lower,
        "95th percentile of the distances of which hausdorff_mm is the greatest",
    ),
    about(
        "overcut_depth_max_mm",
        "Deepest cut into sound tissue",
        "mm",
        Lower,
        "greatest distance from D of a removed sound voxel; none removed: 0; removed, but no decay: none",
    ),
    about(
        "undercut_depth_max_mm",
        "Deepest decay left",
        "mm",
        Lower,
        "greatest distance from R of a remaining decay voxel; none left: 0; nothing removed: none",
    ),
    about(
        "pulp_exposed",
        "Pulp exposed",
        "",
        Lower,
        "1 if a pulp voxel was removed or laid open by a removed neighbour, else 0",
    ),
    about(
        "remaining_dentine_thickness_min_mm",
        "Least distance of the cavity from the pulp",
        "mm",
        Higher,
        "least distance between R without pulp and pulp; none if either is empty",
    ),
    about(
        "force_max_n",
        "Greatest force",
        "N",
        Lower,
        "greatest force on the hand in contact, guidance left out; never in contact: 0",
    ),
    about(
        "force_mean_n",
        "Mean force",
        "N",
        Lower,
        "mean force over ticks in contact, guidance left out; never in contact: none",
    ),
    about(
        "speed_max_mm_s",
        "Greatest speed in contact",
        "mm/s",
        Lower,
        "of the tip over spans of 20 ms with any contact, so the last of an approach counts; never in contact: none",
    ),
    about(
        "force_max_near_pulp_n",
        "Greatest force near the pulp",
        "N",
        Lower,
        "within near_mm of the pulp at the start; never there: 0",
    ),
    about(
        "force_mean_near_pulp_n",
        "Mean force near the pulp",
        "N",
        Lower,
        "within near_mm of the pulp at the start; never there: 0",
    ),
    about(
        "speed_max_near_pulp_mm_s",
        "Greatest speed near the pulp",
        "mm/s",
        Lower,
        "within near_mm of the pulp at the start; never there: 0",
    ),
    about("path_length_mm", "Way of the tip", "mm", Neither, "sum of the tip's steps over 20 ms"),
    about("drilling_time_s", "Time cutting", "s", Neither, "ticks in which matter was being cut"),
    about("contact_time_s", "Time in contact", "s", Neither, "ticks in which anything was touched"),
    about(
        "efficiency_pct_s",
        "Decay removed per second of cutting",
        "%/s",
        Higher,
        "decay_cleared_pct / drilling_time_s; never cut: none",
    ),
    about(
        "jerk",
        "Smoothness (log dimensionless jerk)",
        "",
        Higher,
        "−ln(T⁵/L² · ∫|jerk|² dt) of the tip in contact, sampled at 50 Hz; under 1 s of contact: none",
    ),
    about(
        "soft_tissue_drilled_s",
        "Running bur on soft tissue",
        "s",
        Lower,
        "ticks in which a running bur touched gum or the like",
    ),
    about(
        "neighbour_drilled_s",
        "Running bur on a neighbouring tooth",
        "s",
        Lower,
        "ticks in which a running bur touched a neighbouring tooth",
    ),
    about("session_time_s", "Length of the session", "s", Neither, "all stages together"),
];

/// Measures of fillings, for exercises that begin with a prepared cavity. C the cavity, S the surface at the end, O the tooth's
/// original contour.
pub const OF_FILLINGS: &[About] = &[
    about("filled_pct", "Cavity filled", "%", Higher, "100·|filled∩C| / |C|"),
    about(
        "contour_mean_mm",
        "Mean distance from the original contour",
        "mm",
        Lower,
        "mean distance of S from O, along O's normals, over the cavity's mouth and wherever material lies on the tooth",
    ),
    about(
        "contour_p95_mm",
        "Distance from the original contour, 95 %",
        "mm",
        Lower,
        "95th percentile of the distances of S from O that contour_mean_mm is the mean of",
    ),
    about(
        "contour_max_mm",
        "Greatest distance from the original contour",
        "mm",
        Lower,
        "greatest of the distances of S from O that contour_mean_mm is the mean of",
    ),
    about(
        "overhang_max_mm",
        "Highest overhang",
        "mm",
        Lower,
        "greatest distance by which S lies outside O; nowhere: 0",
    ),
    about("deficit_max_mm", "Deepest deficit", "mm", Lower, "greatest distance by which S lies inside O; nowhere: 0"),
    about(
        "overhang_mm3",
        "Material outside the original contour",
        "mm³",
        Lower,
        "volume laid outside O, from densities",
    ),
    about("void_mm3", "Voids in the filling", "mm³", Lower, "volume of air in C that matter encloses on all sides"),
];

/// Measures of a periodontal chart, computed where a stage asks for one. Sites are the six of the tooth.
pub const CHARTING: &[About] = &[
    about("sites_read_pct", "Sites probed", "%", Higher, "100·sites with a reading / 6"),
    about(
        "probing_within_1mm_pct",
        "Readings within 1 mm",
        "%",
        Higher,
        "100·sites with |reading − true depth| ≤ 1 mm / 6; a site without a reading is not within",
    ),
    about(
        "probing_error_mm",
        "Mean error of the readings",
        "mm",
        Lower,
        "mean of |reading − true depth| over the sites with a reading; none without any",
    ),
    about(
        "probing_bias_mm",
        "Readings too deep or too shallow",
        "mm",
        Neither,
        "mean of reading − true depth over the sites with a reading: positive is too deep; none without any",
    ),
    about(
        "probing_force_max_n",
        "Greatest probing force",
        "N",
        Lower,
        "greatest force at the moment of a reading; none without any",
    ),
    about(
        "probing_force_high",
        "Readings with too much force",
        "",
        Lower,
        "readings at which the probe was pressed with more than 0.35 N (0.25 N is taught); none without a reading",
    ),
    about(
        "calculus_found_pct",
        "Calculus found",
        "%",
        Higher,
        "100·sites with calculus that were marked / sites with calculus; none without calculus or if not asked",
    ),
    about(
        "calculus_false_alarms",
        "Calculus marked where there is none",
        "",
        Lower,
        "sites that were marked and have none; none if not asked, or if there is some and no site was marked",
    ),
];

/// Measures with an argument in brackets.
pub const WITH_ARGUMENT: &[About] = &[
    about("zone_removed_pct", "Zone removed", "%", Neither, "100·|R∩Z| / |Z|; empty zone: none"),
    about(
        "surface_within_tol",
        "Outlines that agree",
        "",
        Higher,
        "share of the borders of R and T within the tolerance of each other; none if either is empty",
    ),
];

/// Why a measure's name is not understood.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Unknown {
    /// No measure of that name.
    Name(String),
    /// The measure takes a zone or a tolerance in brackets, or none.
    Argument(&'static str),
}

impl Metric {
    /// Understands a name such as `dice`, `zone_removed_pct(target)` or `surface_within_tol(0.3)`.
    pub fn parse(written: &str) -> Result<Metric, Unknown> {
        let (name, inner) = match written.split_once('(') {
            Some((name, rest)) => match rest.strip_suffix(')') {
                Some(inner) => (name, Some(inner.trim())),
                None => return Err(Unknown::Argument("the bracket is not closed")),
            },
            None => (written, None),
        };
        if let Some(about) = without_argument().find(|a| a.name == name) {
            return match inner {
                None => Ok(Metric { about, argument: None }),
                Some(_) => Err(Unknown::Argument("this measure takes nothing in brackets")),
            };
        }
        let about = WITH_ARGUMENT.iter().find(|a| a.name == name).ok_or_else(|| Unknown::Name(name.to_string()))?;
        let argument = match (name, inner) {
            ("zone_removed_pct", Some(zone)) if !zone.is_empty() => Argument::Zone(zone.to_string()),
            ("zone_removed_pct", _) => {
                return Err(Unknown::Argument("name a zone in brackets: zone_removed_pct(target)"));
            }
            (_, Some(number)) => match number.parse() {
                Ok(mm) if mm > 0.0 && mm < 10.0 => Argument::ToleranceMm(mm),
                _ => return Err(Unknown::Argument("give a tolerance in mm in brackets: surface_within_tol(0.3)")),
            },
            (_, None) => return Err(Unknown::Argument("give a tolerance in mm in brackets: surface_within_tol(0.3)")),
        };
        Ok(Metric { about, argument: Some(argument) })
    }

    /// The measure's full name, as [`Metric::parse`] takes it and `session.json` has it.
    pub fn name(&self) -> String {
        match &self.argument {
            None => self.about.name.to_string(),
            Some(Argument::Zone(zone)) => format!("{}({zone})", self.about.name),
            Some(Argument::ToleranceMm(mm)) => format!("{}({mm})", self.about.name),
        }
    }

    /// A measure without argument, by a name of the table.
    pub fn plain(about: &'static About) -> Metric {
        Metric { about, argument: None }
    }
}

impl fmt::Display for Metric {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.name())
    }
}

/// Every measure that takes nothing in brackets, in the order of reports.
pub fn without_argument() -> impl Iterator<Item = &'static About> + Clone {
    PLAIN.iter().chain(OF_FILLINGS).chain(CHARTING)
}

/// Every measure.
pub fn every() -> impl Iterator<Item = &'static About> + Clone {
    without_argument().chain(WITH_ARGUMENT)
}

/// Every name that can be written, for complaints.
pub fn names() -> impl Iterator<Item = &'static str> + Clone {
    every().map(|a| a.name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_round_trip() {
        for name in ["dice", "zone_removed_pct(target)", "surface_within_tol(0.3)"] {
            assert_eq!(Metric::parse(name).map(|m| m.name()), Ok(name.to_string()));
        }
        for about in without_argument() {
            assert!(Metric::parse(about.name).is_ok(), "{}", about.name);
        }
    }

    #[test]
    fn wrong_names_say_what_is_missing() {
        assert_eq!(Metric::parse("dise"), Err(Unknown::Name("dise".into())));
        for name in ["zone_removed_pct", "zone_removed_pct()", "surface_within_tol(x)", "dice(1)", "dice("] {
            assert!(matches!(Metric::parse(name), Err(Unknown::Argument(_))), "{name}");
        }
    }
}
