//! Error episodes: errors of one kind, on one tissue, at one wall, in one period of time.
//!
//! A measure gives the extent of an error, an episode its time and place. Tissue, wall, place, depth, force and time of
//! an episode all come from the same voxels or the same contact. Episodes do not influence the score.

use super::contact_spell::ContactSpell;
use super::nearest_offset::{AnatomicalDirection, NearestOffsets};
use super::trials::tissue_felt;
use super::voxel_removals::VoxelRemoval;
use super::{Scored, Verdict};
use crate::catalog::TissueRole;
use crate::scenario::Scenario;
use crate::scenario::file::ZoneRole;
use std::collections::BTreeMap;
use typodont_core::frame::Vec3;
use typodont_core::tick::{TICK_S, Tick};
use typodont_core::volume::Label;

/// Pause after which further cutting at the same wall is a separate episode, s. A stroke back and forth takes about one
/// second; at 3 s, the passes along one wall stay together.
const PAUSE_S: f64 = 3.0;

/// Minimum volume of an episode of removed or remaining tissue, mm³: a smaller one cannot be recognized by a trainee.
/// 0.02 mm³ is a cube of 0.27 mm.
const VOLUME_LEAST: f64 = 0.02;

/// Kind of error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum EpisodeKind {
    /// Tissue that should have been preserved was removed beyond the leeway.
    Overcut,
    /// Vulnerable tissue was removed or exposed.
    Vulnerable,
    /// Tissue of a zone that must never be removed was removed.
    Zone,
    /// Tissue to be removed was left.
    Left,
    /// The force exceeded the value that still earns all points.
    Force,
    /// A running bur touched a neighbouring tooth.
    Neighbour,
    /// A running bur touched gingiva or other soft tissue.
    Soft,
}

impl EpisodeKind {
    /// Returns the name in files.
    pub fn id(self) -> &'static str {
        match self {
            EpisodeKind::Overcut => "overcut",
            EpisodeKind::Vulnerable => "vulnerable",
            EpisodeKind::Zone => "zone",
            EpisodeKind::Left => "left",
            EpisodeKind::Force => "force",
            EpisodeKind::Neighbour => "neighbour",
            EpisodeKind::Soft => "soft",
        }
    }
}

/// An error on one tissue, at one wall, in one period of time.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorEpisode {
    pub kind: EpisodeKind,
    /// Index of the zone in the scenario; for errors of the kind [`EpisodeKind::Zone`].
    pub zone: Option<usize>,
    /// First and last tick; `None` for an omission.
    pub span: Option<[Tick; 2]>,
    /// Tick of the greatest depth or force; of vulnerable tissue and zones, the first.
    pub worst: Option<Tick>,
    /// Position at that tick, tooth space, mm; of an omission, the position of the greatest depth.
    pub place: Vec3,
    /// Direction of every voxel of the episode; `None` for contact and force.
    pub direction: Option<AnatomicalDirection>,
    /// Tissue of every voxel or of every tick of the episode. Of contact with a possible site of a draw, the tissue
    /// whose properties the site had at the tick `worst`.
    pub tissue: Label,
    /// Distance of the place from the tissue to be removed; for remaining tissue, from the cavity; mm.
    pub depth: Option<f32>,
    /// Volume of the removed, exposed or remaining tissue, mm³.
    pub volume: f64,
    /// Maximum force during the episode, N.
    pub force: f32,
    /// Force at the tick `worst`, N.
    pub worst_force: f32,
    /// Duration, s; for contact and force, the total time in contact.
    pub seconds: f64,
}

/// Returns all error episodes of a session by kind, the greatest of each kind first.
pub fn error_episodes(scenario: &Scenario, scored: &Scored) -> Vec<ErrorEpisode> {
    let mut found = removal_episodes(scenario, scored);
    found.extend(remaining_episodes(scenario, scored));
    let contact = |kind, spell: &ContactSpell| {
        let tissue = tissue_felt(scenario, &scored.replay, spell.tissue, spell.peak);
        episode_of_contact(kind, tissue, spell)
    };
    found.extend(scored.hard_presses.iter().map(|spell| contact(EpisodeKind::Force, spell)));
    found.extend(scored.forbidden_contacts.iter().map(|spell| {
        let is_soft = scenario.tissues.role(spell.tissue) == Some(TissueRole::Soft);
        contact(if is_soft { EpisodeKind::Soft } else { EpisodeKind::Neighbour }, spell)
    }));
    let severity = |episode: &ErrorEpisode| match episode.kind {
        EpisodeKind::Force => f64::from(episode.force),
        EpisodeKind::Neighbour | EpisodeKind::Soft => episode.seconds,
        EpisodeKind::Overcut | EpisodeKind::Vulnerable | EpisodeKind::Zone | EpisodeKind::Left => {
            episode.volume * (1.0 + f64::from(episode.depth.unwrap_or(0.0)))
        }
    };
    found.sort_by(|a, b| a.kind.cmp(&b.kind).then(severity(b).total_cmp(&severity(a))));
    found
}

/// One voxel of an error episode.
struct EpisodeVoxel {
    voxel: usize,
    tissue: Label,
    /// Removal of the voxel, or the removal that exposed it; `None` for remaining tissue.
    removal: Option<VoxelRemoval>,
    depth: Option<f32>,
    direction: Option<AnatomicalDirection>,
}

impl EpisodeVoxel {
    fn at(&self) -> Option<Tick> {
        self.removal.map(|r| r.at)
    }

    fn is_same_spell(&self, later: &EpisodeVoxel) -> bool {
        let [earlier_at, later_at] = [self, later].map(|v| v.at().unwrap_or(Tick::ZERO));
        self.direction == later.direction
            && self.tissue == later.tissue
            && later_at.seconds_since(earlier_at) <= PAUSE_S
    }
}

/// Returns the episodes of tissue that should have been preserved.
fn removal_episodes(scenario: &Scenario, scored: &Scored) -> Vec<ErrorEpisode> {
    let volume = &scored.replay.workpiece.volume;
    let grid = volume.grid();
    let roles: [Option<TissueRole>; 256] = std::array::from_fn(|l| scenario.tissues.role(Label(l as u8)));
    let zones_of = |role: ZoneRole| (0..scored.zones.len()).filter(move |&z| scenario.zones[z].role == role);
    let is_wanted = |v: usize| {
        roles[usize::from(volume.tissue(v).0)] == Some(TissueRole::Decay)
            || zones_of(ZoneRole::Target).any(|z| scored.zones[z].counted.contains(v))
    };
    let is_wrong = |v: usize| matches!(scored.verdicts[v], Verdict::Overcut | Verdict::VulnerableTouched);
    let from_wanted = NearestOffsets::new(grid, &scored.replay.workpiece, is_wanted, is_wrong);
    let is_removed = |v: usize| scored.replay.volume.tissue(v) == Label::AIR;
    let protected: Vec<usize> = zones_of(ZoneRole::NeverRemove).collect();
    let mut voxels: BTreeMap<(EpisodeKind, Option<usize>), Vec<EpisodeVoxel>> = BTreeMap::new();
    for voxel in (0..scored.verdicts.len()).filter(|&v| is_wrong(v)) {
        let tissue = volume.tissue(voxel);
        let (depth, direction) = from_wanted.of(voxel).unzip();
        let mut add = |kind, zone, removal| {
            voxels.entry((kind, zone)).or_default().push(EpisodeVoxel { voxel, tissue, removal, depth, direction });
        };
        if scored.verdicts[voxel] == Verdict::Overcut {
            add(EpisodeKind::Overcut, None, scored.removals.get(voxel));
        } else if roles[usize::from(tissue.0)] == Some(TissueRole::Vulnerable) {
            add(EpisodeKind::Vulnerable, None, scored.removals.exposing(grid, voxel));
        }
        for &zone in protected.iter().filter(|&&z| is_removed(voxel) && scored.zones[z].counted.contains(voxel)) {
            add(EpisodeKind::Zone, Some(zone), scored.removals.get(voxel));
        }
    }
    let episodes = voxels.into_iter().flat_map(|((kind, zone), mut voxels)| {
        voxels.sort_by_key(|v| (v.direction, v.tissue.0, v.at(), v.voxel));
        let spells = voxels.chunk_by(EpisodeVoxel::is_same_spell);
        spells.map(|spell| episode_of_voxels(scored, kind, zone, spell)).collect::<Vec<_>>()
    });
    // Even the smallest exposure of the pulp is reported, and the smallest loss within a protected zone.
    episodes.filter(|e| e.volume >= VOLUME_LEAST || e.kind != EpisodeKind::Overcut).collect()
}

/// Returns the episodes of tissue that should have been removed: none in an exercise in which nothing is cut. A
/// possible site of a draw is to be found, and not to be removed.
fn remaining_episodes(scenario: &Scenario, scored: &Scored) -> Vec<ErrorEpisode> {
    if scenario.cutting_stage().is_none() {
        return Vec::new();
    }
    let is_site: [bool; 256] = std::array::from_fn(|label| {
        scenario.tissues.by_label(Label(label as u8)).is_some_and(|entry| entry.site_of.is_some())
    });
    let (before, after) = (&scored.replay.workpiece.volume, &scored.replay.volume);
    let is_removed = |v: usize| before.tissue(v) != Label::AIR && after.tissue(v) == Label::AIR;
    let is_left = |v: usize| scored.verdicts[v] == Verdict::Left && !is_site[usize::from(before.tissue(v).0)];
    let from_removed = NearestOffsets::new(before.grid(), &scored.replay.workpiece, is_removed, is_left);
    let mut voxels: BTreeMap<(Option<AnatomicalDirection>, u8), Vec<EpisodeVoxel>> = BTreeMap::new();
    for voxel in (0..scored.verdicts.len()).filter(|&v| is_left(v)) {
        let tissue = before.tissue(voxel);
        let (depth, direction) = from_removed.of(voxel).unzip();
        let voxel = EpisodeVoxel { voxel, tissue, removal: None, depth, direction };
        voxels.entry((direction, tissue.0)).or_default().push(voxel);
    }
    let episodes = voxels.into_values().map(|voxels| episode_of_voxels(scored, EpisodeKind::Left, None, &voxels));
    episodes.filter(|e| e.volume >= VOLUME_LEAST).collect()
}

/// Returns the episode of voxels of one tissue at one wall, in order of time.
fn episode_of_voxels(scored: &Scored, kind: EpisodeKind, zone: Option<usize>, voxels: &[EpisodeVoxel]) -> ErrorEpisode {
    let grid = scored.replay.workpiece.volume.grid();
    let first = voxels.first().expect("an episode has a voxel");
    let worst = match kind {
        // Vulnerable tissue is opened, and a protected zone entered, by the first voxel.
        EpisodeKind::Vulnerable | EpisodeKind::Zone => first,
        _ => {
            let depth = |v: &EpisodeVoxel| v.depth.unwrap_or(0.0);
            voxels.iter().fold(first, |worst, v| if depth(v) > depth(worst) { v } else { worst })
        }
    };
    let span = first.at().zip(voxels.last().and_then(EpisodeVoxel::at)).map(|(from, to)| [from, to]);
    let force = |v: &EpisodeVoxel| v.removal.map_or(0.0, |r| r.force);
    ErrorEpisode {
        kind,
        zone,
        span,
        worst: worst.at(),
        place: grid.centre(grid.cell(worst.voxel)),
        direction: worst.direction,
        tissue: worst.tissue,
        depth: worst.depth,
        volume: voxels.len() as f64 * grid.voxel_mm3(),
        force: voxels.iter().map(force).fold(0.0, f32::max),
        worst_force: force(worst),
        seconds: span.map_or(0.0, |[from, to]| to.seconds_since(from)),
    }
}

fn episode_of_contact(kind: EpisodeKind, tissue: Label, spell: &ContactSpell) -> ErrorEpisode {
    ErrorEpisode {
        kind,
        zone: None,
        span: Some(spell.span),
        worst: Some(spell.peak),
        place: spell.place,
        direction: None,
        tissue,
        depth: None,
        volume: 0.0,
        force: spell.force,
        worst_force: spell.force,
        seconds: spell.ticks as f64 * TICK_S,
    }
}
