//! A trial of the workpiece, which finds errors that only the volume itself shows.

use super::tooth_path;
use crate::catalog::TissueRole;
use crate::scenario::file::ScenarioFile;
use crate::scenario::workpiece_error::WorkpieceError;
use crate::scenario::{DecayPlace, Scenario, Workpiece};
use typodont_core::aabb::Aabb;
use typodont_core::frame::Vec3;
use typodont_core::touch::Guidance;
use typodont_core::volume::Label;
use typodont_formats::diagnostic::Diagnostic;
use typodont_formats::json::SourceMap;

/// Distance from the teeth beyond which a path is reported as misplaced, mm.
const PATH_AWAY: f32 = 10.0;

/// Seeds that are tried if the random position of a cavity may open the pulp.
const DRAWN: std::ops::Range<u64> = 1..8;

/// Makes the workpiece and reports errors that only the volume itself shows, such as decay outside its tooth.
pub(super) fn check_workpiece(
    scenario: &Scenario,
    written: &ScenarioFile,
    source_map: &SourceMap,
    found: &mut Vec<Diagnostic>,
) {
    let is_drawn = |place: &DecayPlace| matches!(place, DecayPlace::Random | DecayPlace::RandomQuadrant);
    let is_cavity_drawn = scenario.scene.teeth.iter().filter_map(|t| t.cavity.as_ref()).any(|c| is_drawn(&c.place));
    let mut problem = match Workpiece::make(scenario, 0) {
        Ok(workpiece) => {
            find_paths_away(scenario, &workpiece, source_map, found);
            find_zones_outside(scenario, &workpiece, source_map, found);
            find_decay_cut_away(scenario, written, &workpiece, source_map, found);
            None
        }
        Err(problem) => Some(problem),
    };
    if problem.is_none() && is_cavity_drawn {
        problem = DRAWN.into_iter().find_map(|seed| Workpiece::make(scenario, seed).err());
    }
    if let Some(problem) = problem {
        let (path, help) = place_and_help(&problem, written);
        found.push(source_map.complain(&path, "impossible-scene", problem.to_string(), Some(help.into())));
    }
}

/// Returns the place of an error in the scenario file, as a JSON pointer, and a remedy.
fn place_and_help(problem: &WorkpieceError, written: &ScenarioFile) -> (String, &'static str) {
    let of_tooth = |tooth: usize, part: String| format!("{}/{part}", tooth_path(&written.scene, tooth));
    match problem {
        WorkpieceError::DecayOutside { tooth, decay } => (
            of_tooth(*tooth, format!("decay/{decay}")),
            "enlarge it, move it towards the centre of the surface, or change depth_mm",
        ),
        WorkpieceError::NoGroove { tooth, decay } => (
            of_tooth(*tooth, format!("decay/{decay}/at")),
            "move it closer to a fissure, or use \"smooth\" for a smooth-surface lesion",
        ),
        WorkpieceError::StainOutside { tooth, stain } => {
            (of_tooth(*tooth, format!("stains/{stain}")), "enlarge it, or move it towards the centre of the surface")
        }
        WorkpieceError::CavityOutside { tooth } => (
            of_tooth(*tooth, "cavity".to_string()),
            "move \"at\" towards the centre of the surface, or make the cavity deeper",
        ),
        WorkpieceError::CavityInPulp { tooth } => {
            (of_tooth(*tooth, "cavity".to_string()), "make the cavity shallower, or move it away from the pulp horns")
        }
        WorkpieceError::NoRoot { tooth, calculus } => (
            of_tooth(*tooth, format!("calculus/{calculus}/below_margin_mm")),
            "place it between the gingival margin and the apex of the root",
        ),
        WorkpieceError::FillingOutside { tooth, filling } => {
            (of_tooth(*tooth, format!("old_fillings/{filling}/offset_mm")), "move it towards the centre of the crown")
        }
        WorkpieceError::PocketTooDeep { .. } => {
            ("/scene/jaw/periodontium".to_string(), "reduce the depth of the deepest pocket or the recession")
        }
        WorkpieceError::NoEnamel { tooth } => (
            of_tooth(*tooth, "form".to_string()),
            "check the number or grey value that stands for \
            enamel",
        ),
        WorkpieceError::ZoneSize { zone, .. } => (
            format!("/zones/{zone}/region/labels/file"),
            "draw the map on the same volume from which the tooth is made",
        ),
        WorkpieceError::UnequalSpacing => ("/scene".to_string(), "give both teeth the same spacing_mm"),
        WorkpieceError::NoSuchTooth { .. } => (
            "/scene".to_string(),
            "the FDI number must be one of 11–18, 21–28, \
        31–38 or 41–48",
        ),
        WorkpieceError::TooLarge { .. } | WorkpieceError::OnlyRecorded => {
            ("/scene".to_string(), "choose a larger spacing_mm")
        }
    }
}

/// Reports decay that lies entirely within tissue cut away before the session.
fn find_decay_cut_away(
    scenario: &Scenario,
    written: &ScenarioFile,
    workpiece: &Workpiece,
    source_map: &SourceMap,
    found: &mut Vec<Diagnostic>,
) {
    let is_decay = |label: Label| scenario.tissues.role(label) == Some(TissueRole::Decay);
    let is_left = || workpiece.volume.tissues().any(is_decay);
    if let Some(tooth) = scenario.scene.teeth_in_volume().iter().position(|t| !t.decay.is_empty())
        && !is_left()
    {
        let message = "no caries remains: a cavity or an old filling occupies its entire volume";
        let help = "move or enlarge the caries, or make the cavity smaller";
        let path = format!("{}/decay", tooth_path(&written.scene, tooth));
        found.push(source_map.complain(&path, "no-decay", message.into(), Some(help.into())));
    }
}

/// Reports zones that contain no part of any tooth, since they would have no effect without the author's knowledge.
fn find_zones_outside(scenario: &Scenario, workpiece: &Workpiece, source_map: &SourceMap, found: &mut Vec<Diagnostic>) {
    let teeth = workpiece.bounds();
    for (index, zone) in scenario.zones.iter().enumerate() {
        if zone.region.bounding_box().is_some_and(|bounds| !bounds.overlaps(&teeth)) {
            let message = format!("the zone \"{}\" is outside the tooth", zone.id);
            found.push(source_map.complain(
                &format!("/zones/{index}/region"),
                "empty-region",
                message,
                Some(extent_text(&teeth)),
            ));
        }
    }
}

/// Reports paths far from every tooth, which are probably written in another space or another unit.
fn find_paths_away(scenario: &Scenario, workpiece: &Workpiece, source_map: &SourceMap, found: &mut Vec<Diagnostic>) {
    let teeth = workpiece.bounds();
    let is_near = |p: &Vec3| p.distance(teeth.nearest(*p)) <= PATH_AWAY;
    for (index, stage) in scenario.stages.iter().enumerate() {
        if let Some(Guidance::Path(fixture)) = stage.guidance.and_then(|g| scenario.guidances.get(g))
            && !fixture.path.points().iter().any(is_near)
        {
            let message = format!("the whole path is more than {PATH_AWAY} mm away from the tooth");
            let path = format!("/stages/{}/guidance/path/file", scenario.written_stage(index));
            found.push(source_map.complain(&path, "wrong-place", message, Some(extent_text(&teeth))));
        }
    }
}

fn extent_text(teeth: &Aabb) -> String {
    let Aabb { low, high } = teeth;
    format!("the tooth extends from {low:.1} to {high:.1} mm along x (buccal), y, z (occlusal)")
}
