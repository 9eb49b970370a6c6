//! Names that the author sees for the keys and words of a scenario, and the units of numbers.

use crate::i18n::Translations;

/// Keys with the texts that name them. A key that is not listed is spelled out from the key itself.
const LABELS: &[(&str, &str)] = &[
    ("title", "label.title"),
    ("id", "label.id"),
    ("summary", "label.summary"),
    ("instruction", "label.instruction"),
    ("scene", "label.scene"),
    ("tooth", "label.tooth"),
    ("pair", "label.pair"),
    ("jaw", "label.jaw"),
    ("left", "label.left"),
    ("right", "label.right"),
    ("gap_mm", "label.gap"),
    ("fdi", "label.fdi"),
    ("form", "label.form"),
    ("procedural", "label.procedural"),
    ("ct", "label.ct"),
    ("labels", "label.labels"),
    ("file", "label.file"),
    ("mesh", "label.mesh"),
    ("spacing_mm", "label.spacing"),
    ("around", "label.around"),
    ("decay", "label.decay"),
    ("stains", "label.stains"),
    ("shape", "label.shape"),
    ("sphere", "label.sphere"),
    ("ellipsoid", "label.ellipsoid"),
    ("fissure", "label.fissure"),
    ("smooth", "label.smooth"),
    ("surface", "label.surface"),
    ("M", "label.mesial"),
    ("O", "label.occlusal"),
    ("D", "label.distal"),
    ("B", "label.buccal"),
    ("L", "label.lingual"),
    ("at", "label.at"),
    ("centre", "label.centre"),
    ("random", "label.random"),
    ("random_quadrant", "label.random_quadrant"),
    ("quadrant", "label.quadrant"),
    ("offset_mm", "label.offset"),
    ("depth_mm", "label.depth"),
    ("radius_mm", "label.radius"),
    ("radii_mm", "label.radii"),
    ("reaches", "label.reaches"),
    ("outer_enamel", "label.outer_enamel"),
    ("inner_enamel", "label.inner_enamel"),
    ("outer_dentine", "label.outer_dentine"),
    ("middle_dentine", "label.middle_dentine"),
    ("inner_dentine", "label.inner_dentine"),
    ("length_mm", "label.length"),
    ("width_mm", "label.width"),
    ("height_mm", "label.height"),
    ("spread_mm", "label.spread"),
    ("rim", "label.rim"),
    ("share", "label.share"),
    ("tissue", "label.tissue"),
    ("tissues", "label.tissues"),
    ("new_tissues", "label.new_tissues"),
    ("stiffness", "label.stiffness"),
    ("damping", "label.damping"),
    ("static_friction", "label.static_friction"),
    ("dynamic_friction", "label.dynamic_friction"),
    ("cut_force_n", "label.cut_force"),
    ("hardness_hv", "label.hardness"),
    ("stiffness_ratio", "label.stiffness_ratio"),
    ("of", "label.of"),
    ("to", "label.to"),
    ("ratio", "label.ratio"),
    ("carving", "label.carving"),
    ("dwell_s", "label.dwell"),
    ("dwell_share", "label.dwell_share"),
    ("max_feed_mm_s", "label.max_feed"),
    ("law", "label.law"),
    ("threshold", "label.threshold"),
    ("rate", "label.rate"),
    ("rpm", "label.rpm"),
    ("grit", "label.grit"),
    ("vibration", "label.vibration"),
    ("frequency_hz", "label.frequency"),
    ("amplitude_n", "label.amplitude"),
    ("operating_field", "label.operating_field"),
    ("dust", "label.dust"),
    ("water_spray", "label.water_spray"),
    ("suction", "label.suction"),
    ("patient", "label.patient"),
    ("age_years", "label.age"),
    ("shows_age", "label.shows_age"),
    ("instruments", "label.instruments"),
    ("zones", "label.zones"),
    ("role", "label.role"),
    ("target", "label.target"),
    ("leeway", "label.leeway"),
    ("container", "label.container"),
    ("never_remove", "label.never_remove"),
    ("region", "label.region"),
    ("within_mm", "label.within"),
    ("box", "label.box"),
    ("cylinder", "label.cylinder"),
    ("min_mm", "label.min"),
    ("max_mm", "label.max"),
    ("centre_mm", "label.centre_point"),
    ("from_mm", "label.from_point"),
    ("to_mm", "label.to_point"),
    ("value", "label.value"),
    ("stages", "label.stages"),
    ("time_limit_s", "label.time_limit"),
    ("cutting", "label.cutting"),
    ("show_decay", "label.show_decay"),
    ("shows_controls", "label.shows_controls"),
    ("adjustable", "label.adjustable"),
    ("draw", "label.draw"),
    ("one_of", "label.one_of"),
    ("trials", "label.trials"),
    ("stiffness_steps", "label.stiffness_steps"),
    ("coefficients", "label.coefficients"),
    ("step_time_s", "label.step_time"),
    ("guidance", "label.guidance"),
    ("path", "label.path"),
    ("forces", "label.forces"),
    ("ask", "label.ask"),
    ("text", "label.text"),
    ("answer", "label.answer"),
    ("tooth_with", "label.tooth_with"),
    ("quadrant_of", "label.quadrant_of"),
    ("choice", "label.choice"),
    ("yes_no", "label.yes_no"),
    ("number", "label.number"),
    ("options", "label.options"),
    ("correct", "label.correct"),
    ("unit", "label.unit"),
    ("tolerance", "label.tolerance"),
    ("ends_when", "label.ends_when"),
    ("answered", "label.answered"),
    ("confirmed", "label.confirmed"),
    ("cleared_pct", "label.cleared"),
    ("measures", "label.measures"),
    ("near_mm", "label.near"),
    ("leeway_mm", "label.leeway_mm"),
    ("tolerance_mm", "label.tolerance_mm"),
    ("rubric", "label.rubric"),
    ("pass_points", "label.pass_points"),
    ("items", "label.items"),
    ("metric", "label.metric"),
    ("points", "label.points"),
    ("full_at", "label.full_at"),
    ("zero_at", "label.zero_at"),
    ("counts_with", "label.counts_with"),
    ("hard_fails", "label.hard_fails"),
    ("when", "label.when"),
    ("above", "label.above"),
    ("below", "label.below"),
    ("questionnaire", "label.questionnaire"),
    ("questionnaire_time", "label.questionnaire_time"),
    ("each_time", "label.each_time"),
    ("end_of_course", "label.end_of_course"),
    ("color", "label.color"),
    ("name", "label.name"),
];

/// Endings of keys that name a unit, the longest first.
const UNITS: [(&str, &str); 13] = [
    ("_n_s_per_mm", "N·s/mm"),
    ("_n_per_mm", "N/mm"),
    ("_mm_s", "mm/s"),
    ("_mm3", "mm³"),
    ("_mm", "mm"),
    ("_hz", "Hz"),
    ("_hv", "HV"),
    ("_pct", "%"),
    ("_deg", "°"),
    ("_years", "a"),
    ("rpm", "1/min"),
    ("_s", "s"),
    ("_n", "N"),
];

/// Display name of a key or word.
pub fn label(words: &Translations, key: &str) -> String {
    match LABELS.iter().find(|(known, _)| *known == key) {
        Some((_, text)) => words.get(text).to_string(),
        None => spelled_out(key),
    }
}

/// The unit of a key's number.
pub fn unit(key: &str) -> &'static str {
    UNITS.iter().find(|(end, _)| key.ends_with(end)).map_or("", |(_, unit)| unit)
}

/// `some_key_mm` as "Some key".
fn spelled_out(key: &str) -> String {
    let end = UNITS.iter().find(|(end, _)| key.len() > end.len() && key.ends_with(end)).map_or("", |(end, _)| end);
    let bare = key.strip_suffix(end).unwrap_or(key).replace('_', " ");
    let mut letters = bare.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_tells_its_unit_and_one_without_a_name_is_spelt_out() {
        for (key, expected) in [
            ("radius_mm", "mm"),
            ("speed_mm_s", "mm/s"),
            ("step_time_s", "s"),
            ("max_force_n", "N"),
            ("damping_n_s_per_mm", "N·s/mm"),
            ("ratio", ""),
        ] {
            assert_eq!(unit(key), expected, "{key}");
        }
        assert_eq!(label(&Translations::default(), "look_ahead_mm"), "Look ahead");
    }
}
