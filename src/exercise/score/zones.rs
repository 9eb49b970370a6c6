//! The voxels of zones.

use super::voxel_set::VoxelSet;
use crate::catalog::TissueRole;
use crate::scenario::file::ZoneRole;
use crate::scenario::{Scenario, Workpiece, Zone, ZoneRegion};
use typodont_core::frame::Vec3;
use typodont_core::volume::subgrid::SubGrid;
use typodont_core::volume::{Grid, Label, Volume, distance};

/// A zone as it is judged.
#[derive(Clone, Debug)]
pub struct ZoneVoxels {
    /// Voxels that count. Only sound tissue can be harmed: a zone that protects tissue does not contain its decay,
    /// unless the author names that decay as the zone's tissue.
    pub counted: VoxelSet,
    /// Number of voxels that were left out because they are decay.
    pub decay: usize,
}

impl ZoneVoxels {
    pub fn of(zone: &Zone, scenario: &Scenario, initial: &Volume) -> ZoneVoxels {
        let whole = mask(zone, initial);
        let protects = matches!(zone.role, ZoneRole::NeverRemove | ZoneRole::Container);
        if !protects || matches!(zone.region, ZoneRegion::Tissue(_)) {
            return ZoneVoxels { counted: whole, decay: 0 };
        }
        let is_decay = |v: usize| scenario.tissues.role(initial.tissue(v)) == Some(TissueRole::Decay);
        let counted: VoxelSet = (0..initial.grid().len()).map(|v| whole.contains(v) && !is_decay(v)).collect();
        let decay = whole.count() - counted.count();
        ZoneVoxels { counted, decay }
    }
}

/// Decay within a zone that protects tissue: the trainee has to remove it close to tissue that must be preserved.
#[derive(Clone, Debug, PartialEq)]
pub struct DecayInZone {
    /// Title of the zone.
    pub zone: String,
    /// Index of the zone in the scenario.
    pub index: usize,
    /// Volume of the decay within the zone, mm³.
    pub decay_mm3: f64,
}

/// Returns the protected zones of a workpiece that contain decay, in the scenario's order.
pub fn decay_in_zones(scenario: &Scenario, workpiece: &Workpiece) -> Vec<DecayInZone> {
    let initial = &workpiece.volume;
    let found = scenario.zones.iter().enumerate().map(|(index, zone)| {
        let decay = ZoneVoxels::of(zone, scenario, initial).decay;
        DecayInZone { zone: zone.title.clone(), index, decay_mm3: decay as f64 * initial.grid().voxel_mm3() }
    });
    found.filter(|d| d.decay_mm3 > 0.0).collect()
}

/// Returns the volume of decay that lies directly on vulnerable tissue, mm³: its removal exposes that tissue.
pub fn decay_on_vulnerable_mm3(scenario: &Scenario, workpiece: &Workpiece) -> f64 {
    let initial = &workpiece.volume;
    let grid = initial.grid();
    let role = |v: usize| scenario.tissues.role(initial.tissue(v));
    let is_on = |v: &usize| {
        role(*v) == Some(TissueRole::Decay) && grid.neighbours(*v).any(|n| role(n) == Some(TissueRole::Vulnerable))
    };
    (0..grid.len()).filter(is_on).count() as f64 * grid.voxel_mm3()
}

/// Returns the voxels of a zone in the volume at the start.
fn mask(zone: &Zone, initial: &Volume) -> VoxelSet {
    let grid = initial.grid();
    match &zone.region {
        ZoneRegion::Tissue(label) => initial.tissues().map(|l| l == *label).collect(),
        ZoneRegion::Around { label, within } => around(initial, *label, *within),
        region @ (ZoneRegion::Sphere { .. } | ZoneRegion::Box { .. } | ZoneRegion::Cylinder { .. }) => {
            matter_where(initial, |p| region.contains(p))
        }
        // A map of another size belongs to another tooth and marks nothing here.
        ZoneRegion::Mask(mask) if mask.dims == grid.dims => {
            mask.is_inside.iter().zip(initial.tissues()).map(|(&inside, l)| inside && l != Label::AIR).collect()
        }
        ZoneRegion::Mask(_) => initial.tissues().map(|_| false).collect(),
    }
}

fn matter_where(initial: &Volume, is_inside: impl Fn(Vec3) -> bool) -> VoxelSet {
    let grid: &Grid = initial.grid();
    let tissues = initial.tissues().zip(grid.cells());
    tissues.map(|(l, cell)| l != Label::AIR && is_inside(grid.centre(cell))).collect()
}

/// Returns the matter within a distance (mm) of a tissue, without the tissue itself.
fn around(initial: &Volume, label: Label, within: f32) -> VoxelSet {
    let grid = initial.grid();
    let is_label = |i: usize| initial.tissue(i) == label;
    let margin = (within / grid.spacing.min_element()).ceil() as u32 + 1;
    let Some(crop) = SubGrid::around(grid, margin, (0..grid.len()).filter(|&i| is_label(i))) else {
        return initial.tissues().map(|_| false).collect();
    };
    let distance = distance::to_set(&crop.grid, |i| is_label(crop.whole_index(i)));
    let is_near = |voxel: usize| crop.index_of(voxel).is_some_and(|i| distance[i] <= within);
    initial.tissues().enumerate().map(|(i, l)| l != Label::AIR && l != label && is_near(i)).collect()
}

#[cfg(test)]
mod tests {
    use crate::catalog::TissueRole;
    use crate::record::Replay;
    use crate::scenario::{ResolveMode, Scenario, Workpiece, resolve};
    use crate::score::Verdict;
    use crate::score::removal_comparison::RemovalComparison;
    use crate::score::verdict;
    use crate::session::SessionOutcome;
    use typodont_core::volume::{Density, Voxel};
    use typodont_formats::Library;
    use typodont_formats::diagnostic::SourceText;

    /// The shipped exercise with its lesion `depth_mm` below the surface, and its workpiece.
    fn deep_lesion(depth_mm: f32) -> (Scenario, Workpiece) {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/5-grinding.json");
        let text = std::fs::read_to_string(path).unwrap();
        let deep = text
            .replace("\"depth_mm\": 0.4", &format!("\"depth_mm\": {depth_mm}"))
            .replace("\"spacing_mm\": 0.1", "\"spacing_mm\": 0.2");
        assert_ne!(deep, text);
        let scenario =
            resolve(SourceText::new("deep.json", deep), &Library::shipped(), ResolveMode::ReadScans).unwrap();
        let workpiece = Workpiece::make(&scenario, 1).unwrap();
        (scenario, workpiece)
    }

    /// A session on a workpiece in which these voxels were removed.
    fn removed(workpiece: &Workpiece, voxels: impl Iterator<Item = usize>) -> Replay {
        let mut volume = (*workpiece.volume).clone();
        for voxel in voxels {
            volume.set(voxel, Voxel { density: Density::EMPTY, ..volume.voxel(voxel) });
        }
        let workpiece = workpiece.clone();
        Replay { workpiece, volume, outcome: SessionOutcome::default(), difference: None }
    }

    #[test]
    fn decay_near_the_pulp_is_not_forbidden_tissue() {
        // Aim: a careful hand that removes all caries and no dentine harms no protected zone; one voxel of sound
        // dentine of the zone is harm. A lesion near the pulp once failed everybody. Method: a deep lesion, removed
        // entirely by assignment, without and with one sound voxel of the zone.
        let (scenario, workpiece) = deep_lesion(4.0);
        let zone = scenario.zones.iter().position(|z| z.id == "over_pulp").unwrap();
        let initial = workpiece.volume.clone();
        let is_decay = |v: &usize| scenario.tissues.role(initial.tissue(*v)) == Some(TissueRole::Decay);
        let decay: Vec<usize> = (0..initial.grid().len()).filter(is_decay).collect();
        let whole_zone = super::mask(&scenario.zones[zone], &initial);
        let in_zone: Vec<usize> = decay.iter().copied().filter(|&v| whole_zone.contains(v)).collect();
        assert!(in_zone.len() > 4, "the lesion reaches the zone: {}", in_zone.len());
        assert_eq!(super::decay_in_zones(&scenario, &workpiece)[0].zone, scenario.zones[zone].title);

        let careful = removed(&workpiece, decay.iter().copied());
        let comparison = RemovalComparison::of(&scenario, &careful);
        assert_eq!(comparison.zone_removed_pct(zone), Some(0.0));
        let verdicts = verdict::of(&scenario, &careful, &comparison, None);
        assert!(in_zone.iter().all(|&v| verdicts[v] == Verdict::RightlyRemoved));

        let sound = whole_zone.iter().find(|v| !is_decay(v)).unwrap();
        let careless = removed(&workpiece, decay.iter().copied().chain([sound]));
        let comparison = RemovalComparison::of(&scenario, &careless);
        assert!(comparison.zone_removed_pct(zone) > Some(0.0));
        assert_eq!(verdict::of(&scenario, &careless, &comparison, None)[sound], Verdict::VulnerableTouched);
    }
}
