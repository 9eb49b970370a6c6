//! Result of a session as soon as it is scored, before its maps, pictures and pages are made.

use super::feedback::{self, Feedback};
use super::language::Message;
use super::phrases;
use super::pictures::srgb_to_linear;
use super::session_file::SessionFile;
use super::templates::Templates;
use std::collections::BTreeMap;
use typodont_exercise::local_text::LocalTexts;
use typodont_exercise::record::Recording;
use typodont_exercise::scenario::{Metric, Scenario};
use typodont_exercise::score::{Scored, Verdict};

/// Result of a session before its files are made.
#[derive(Clone, Debug)]
pub struct FirstResult {
    /// As in `session.json`, without the digests of the other files.
    pub session: SessionFile,
    pub feedback: Feedback,
    /// Colours of the map, as far as they occur.
    pub legend: Vec<LegendEntry>,
    /// Translations of the exercise's texts.
    pub texts: LocalTexts,
    /// Titles of the exercise's zones, by id.
    zone_titles: BTreeMap<String, Message>,
}

/// A colour of the map.
#[derive(Clone, Debug)]
pub struct LegendEntry {
    pub verdict: Verdict,
    pub title: Message,
    /// Red, green and blue, sRGB.
    pub color: [u8; 3],
    /// Sign that distinguishes the entry without its colour.
    pub sign: &'static str,
    /// Volume of the tissue with this colour, mm³.
    pub volume: f64,
    /// True if black is not legible on the colour.
    pub is_dark: bool,
}

impl FirstResult {
    pub fn of(recording: &Recording, scored: &Scored, templates: &Templates) -> FirstResult {
        FirstResult {
            legend: legend(scored),
            ..FirstResult::of_session(SessionFile::of(recording, scored), &[], &recording.scenario, templates)
        }
    }

    /// The result of a session that was scored elsewhere. `volumes`: the volume of the tissue of each verdict, mm³, in the
    /// order of the legend.
    pub fn of_session(
        session: SessionFile,
        volumes: &[(Verdict, f64)],
        scenario: &Scenario,
        templates: &Templates,
    ) -> FirstResult {
        let feedback = feedback::build(&session, scenario, templates.rules());
        let legend = volumes.iter().map(|(verdict, volume)| LegendEntry::new(*verdict, *volume)).collect();
        let zones = scenario.zones.iter();
        let zone_titles =
            zones.map(|zone| (zone.id.clone(), Message::authored(&scenario.texts, &zone.title))).collect();
        FirstResult { session, feedback, legend, texts: scenario.texts.clone(), zone_titles }
    }
}

impl FirstResult {
    /// Title of a measure of the session, by name.
    pub fn measure_title(&self, name: &str) -> Message {
        let zone_title = |zone: &str| self.zone_titles.get(zone).cloned();
        Metric::parse(name).map_or_else(|_| Message::plain(name), |m| phrases::measure_of_zone(&m, zone_title))
    }
}

impl LegendEntry {
    fn new(verdict: Verdict, volume: f64) -> LegendEntry {
        let [r, g, b] = verdict.color();
        // Black is read better from this luminance on (WCAG 2): (0.179 + 0.05)² ≈ 1.05·0.05.
        let [red, green, blue] = srgb_to_linear([r, g, b]);
        LegendEntry {
            verdict,
            title: Message::text_or(format!("verdict.{}", verdict.id()), verdict.title()),
            color: [r, g, b].map(|c| (c * 255.0).round() as u8),
            sign: verdict.sign(),
            volume,
            is_dark: 0.2126 * red + 0.7152 * green + 0.0722 * blue < 0.179,
        }
    }
}

/// Colours of the map of a session, as far as they occur.
pub fn legend(scored: &Scored) -> Vec<LegendEntry> {
    let voxel = scored.replay.workpiece.volume.grid().voxel_mm3();
    let count = |verdict: &Verdict| scored.verdicts.iter().filter(|v| *v == verdict).count();
    let counts = shown_verdicts(scored).map(|verdict| (verdict, count(verdict)));
    counts
        .filter(|(_, count)| *count > 0)
        .map(|(verdict, count)| LegendEntry::new(*verdict, count as f64 * voxel))
        .collect()
}

/// The verdicts that a session's maps may show.
pub fn shown_verdicts(scored: &Scored) -> impl Iterator<Item = &'static Verdict> + use<> {
    let of_fillings: &[Verdict] = if scored.restoration.is_some() { &Verdict::OF_FILLINGS } else { &[] };
    Verdict::VISIBLE.iter().chain(of_fillings)
}
