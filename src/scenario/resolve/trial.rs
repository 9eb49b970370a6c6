//! One trial of the workpiece: what only shows in the matter itself is told to the author too.

use super::tooth_path;
use crate::content::Role;
use crate::content::json::Places;
use crate::diagnostic::Diagnostic;
use crate::frame::Vec3;
use crate::scenario::file::ScenarioFile;
use crate::scenario::workpiece::Unmakeable;
use crate::scenario::{DecayPlace, Scenario, Workpiece};
use crate::touch::Guidance;
use crate::volume::Label;

/// A path further from the teeth than this leads nowhere, mm.
const PATH_AWAY: f32 = 10.0;

/// Seeds that are tried where chance may put a cavity into the pulp.
const DRAWN: std::ops::Range<u64> = 1..8;

/// Makes the workpiece: what only shows in the matter itself (a decay outside its tooth) is told to the author too.
pub(super) fn try_to_make(scenario: &Scenario, written: &ScenarioFile, places: &Places, found: &mut Vec<Diagnostic>) {
    let is_drawn = |place: &DecayPlace| matches!(place, DecayPlace::Random | DecayPlace::RandomQuadrant);
    let is_cavity_drawn = scenario.scene.teeth.iter().filter_map(|t| t.cavity.as_ref()).any(|c| is_drawn(&c.place));
    let mut problem = match Workpiece::make(scenario, 0) {
        Ok(workpiece) => {
            find_paths_away(scenario, &workpiece, places, found);
            find_zones_outside(scenario, &workpiece, places, found);
            find_decay_cut_away(scenario, written, &workpiece, places, found);
            None
        }
        Err(problem) => Some(problem),
    };
    if problem.is_none() && is_cavity_drawn {
        problem = DRAWN.into_iter().find_map(|seed| Workpiece::make(scenario, seed).err());
    }
    let Some(problem) = problem else { return };
    let (path, help) = match &problem {
        Unmakeable::DecayOutside { tooth, decay } => (
            format!("{}/decay/{decay}", tooth_path(&written.scene, *tooth)),
            "make it larger, move it toward the surface's middle, or change depth_mm",
        ),
        Unmakeable::NoGroove { tooth, decay } => (
            format!("{}/decay/{decay}/at", tooth_path(&written.scene, *tooth)),
            "move it nearer to a groove, or take \"smooth\" for a lesion of a plain surface",
        ),
        Unmakeable::StainOutside { tooth, stain } => (
            format!("{}/stains/{stain}", tooth_path(&written.scene, *tooth)),
            "make it larger, or move it toward the surface's middle",
        ),
        Unmakeable::CavityOutside { tooth } => (
            format!("{}/cavity", tooth_path(&written.scene, *tooth)),
            "move \"at\" toward the surface's middle, or make it deeper",
        ),
        Unmakeable::CavityInPulp { tooth } => (
            format!("{}/cavity", tooth_path(&written.scene, *tooth)),
            "make it less deep, or move it away from the pulp's horns",
        ),
        Unmakeable::NoRoot { tooth, calculus } => (
            format!("{}/calculus/{calculus}/below_margin_mm", tooth_path(&written.scene, *tooth)),
            "place it between the gum's margin and the root's end",
        ),
        Unmakeable::FillingOutside { tooth, filling } => (
            format!("{}/old_fillings/{filling}/offset_mm", tooth_path(&written.scene, *tooth)),
            "move it toward the crown's middle",
        ),
        Unmakeable::PocketTooDeep { .. } => {
            ("/scene/jaw/periodontium".to_string(), "make the deepest pocket or the recession smaller")
        }
        Unmakeable::NoEnamel { tooth } => {
            (format!("{}/form", tooth_path(&written.scene, *tooth)), "check which number or grey value is enamel")
        }
        Unmakeable::ZoneSize { zone, .. } => {
            (format!("/zones/{zone}/region/labels/file"), "draw the map on the very volume that the tooth is made from")
        }
        Unmakeable::UnequalSpacing => ("/scene".to_string(), "give both teeth the same spacing_mm"),
        Unmakeable::NoSuchTooth { .. } => ("/scene".to_string(), "FDI numbers run 11–18, 21–28, 31–38, 41–48"),
        Unmakeable::TooLarge { .. } | Unmakeable::OnlyRecorded => ("/scene".to_string(), "choose a larger spacing_mm"),
    };
    found.push(places.complain(&path, "impossible-scene", problem.to_string(), Some(help.into())));
}

/// Decay that lies within what is cut away before the session was never there.
fn find_decay_cut_away(
    scenario: &Scenario,
    written: &ScenarioFile,
    workpiece: &Workpiece,
    places: &Places,
    found: &mut Vec<Diagnostic>,
) {
    let is_decay = |label: Label| scenario.tissues.role(label) == Some(Role::Decay);
    let is_left = || workpiece.volume.tissues().any(is_decay);
    if let Some(tooth) = scenario.scene.teeth.iter().position(|t| !t.decay.is_empty())
        && !is_left()
    {
        let message = "nothing of the decay is left: a cavity or an old filling takes all of its place";
        let help = "move or enlarge the decay, or make the cavity smaller";
        let path = format!("{}/decay", tooth_path(&written.scene, tooth));
        found.push(places.complain(&path, "no-decay", message.into(), Some(help.into())));
    }
}

/// A zone that no tooth reaches would never matter, and its author would never know.
fn find_zones_outside(scenario: &Scenario, workpiece: &Workpiece, places: &Places, found: &mut Vec<Diagnostic>) {
    let [low, high] = corners(workpiece);
    for (index, zone) in scenario.zones.iter().enumerate() {
        let is_outside = |[from, to]: [Vec3; 2]| from.cmpgt(high).any() || to.cmplt(low).any();
        if zone.region.extent().is_some_and(is_outside) {
            let message = format!("the zone \"{}\" lies outside the tooth", zone.id);
            let help = format!("the tooth reaches from {low:.1} to {high:.1} mm along x (buccal), y, z (occlusal)");
            found.push(places.complain(&format!("/zones/{index}/region"), "empty-region", message, Some(help)));
        }
    }
}

/// A path far from every tooth is one in another space or another unit.
fn find_paths_away(scenario: &Scenario, workpiece: &Workpiece, places: &Places, found: &mut Vec<Diagnostic>) {
    let [low, high] = corners(workpiece);
    let is_near = |p: &Vec3| p.distance(p.clamp(low, high)) <= PATH_AWAY;
    for (index, stage) in scenario.stages.iter().enumerate() {
        if let Some(Guidance::Path(fixture)) = stage.guidance.and_then(|g| scenario.guidances.get(g))
            && !fixture.path.points().iter().any(is_near)
        {
            let message = format!("the path stays more than {PATH_AWAY} mm away from the tooth");
            let help = format!("the tooth reaches from {low:.1} to {high:.1} mm along x (buccal), y, z (occlusal)");
            let path = format!("/stages/{index}/guidance/path/file");
            found.push(places.complain(&path, "wrong-place", message, Some(help)));
        }
    }
}

/// Corners of the box around all teeth, tooth space, mm.
fn corners(workpiece: &Workpiece) -> [Vec3; 2] {
    let low = workpiece.teeth.iter().map(|t| t.low).reduce(Vec3::min).unwrap_or_default();
    let high = workpiece.teeth.iter().map(|t| t.high).reduce(Vec3::max).unwrap_or_default();
    [low, high]
}
