//! Error episodes: periods of time in which an error occurred at one place.
//!
//! A measure gives the extent of an error, an episode its time and place. Episodes do not influence the score.

use super::cropped_grid::CroppedGrid;
use super::{Scored, Verdict};
use crate::catalog::TissueRole;
use crate::record::Recording;
use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use typodont_core::frame::Vec3;
use typodont_core::tick::{TICK_S, Tick};
use typodont_core::volume::{Label, distance};

/// Time without an error after which the next error is a separate episode, s: one press, or one uninterrupted period of
/// cutting, is one episode.
const LIFT_S: f64 = 0.7;

/// Maximum duration of a period of cutting that counts as one episode, s. In a longer period, each wall is an episode
/// of its own, and so is each return to a wall after a pause of this length. A stroke back and forth takes about one
/// second; at 3 s, the passes along one wall stay together.
const PAUSE_S: f64 = 3.0;

/// Minimum volume of an episode of removed or remaining tissue, mm³: a smaller one cannot be recognized by a trainee.
/// 0.02 mm³ is a cube of 0.27 mm.
const VOLUME_LEAST: f64 = 0.02;

/// Kind of error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum EpisodeKind {
    /// Sound tissue was removed beyond the leeway.
    Overcut,
    /// Vulnerable tissue was removed or exposed, or sound tissue of a zone that must never be removed was removed.
    Vulnerable,
    /// Tissue to be removed was left.
    Left,
    /// The force exceeded the value that still earns all points.
    Force,
    /// A running bur touched a neighbouring tooth.
    Neighbour,
    /// A running bur touched gingiva or other soft tissue.
    Soft,
}

/// Direction from the tissue to be removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum AnatomicalDirection {
    Buccal,
    Lingual,
    Mesial,
    Distal,
    Occlusal,
    Apical,
}

/// An error at one place in one period of time.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorEpisode {
    pub kind: EpisodeKind,
    /// First and last tick; `None` for an omission.
    pub span: Option<[Tick; 2]>,
    /// Tick of the greatest error.
    pub worst: Option<Tick>,
    /// Position of the greatest error, tooth space, mm.
    pub place: Vec3,
    pub direction: Option<AnatomicalDirection>,
    /// Tissue that was affected most; air if none was touched.
    pub tissue: Label,
    /// Depth of the removed or remaining tissue, mm.
    pub depth: Option<f32>,
    /// Volume of the removed or remaining tissue, mm³.
    pub volume: f64,
    /// Maximum force during the episode, N.
    pub force: f32,
    /// Duration, s; for contact errors, the total time in contact.
    pub seconds: f64,
}

/// Returns all error episodes of a session by kind, the greatest of each kind first.
pub fn error_episodes(recording: &Recording, scored: &Scored) -> Vec<ErrorEpisode> {
    let mut found = overcut_episodes(scored);
    found.extend(undercut_episodes(scored));
    found.extend(force_episodes(recording, scored));
    found.extend(contact_episodes(recording, scored));
    let severity = |l: &ErrorEpisode| match l.kind {
        EpisodeKind::Force => f64::from(l.force),
        EpisodeKind::Neighbour | EpisodeKind::Soft => l.seconds,
        EpisodeKind::Overcut | EpisodeKind::Vulnerable | EpisodeKind::Left => {
            l.volume * (1.0 + f64::from(l.depth.unwrap_or(0.0)))
        }
    };
    found.sort_by(|a, b| a.kind.cmp(&b.kind).then(severity(b).total_cmp(&severity(a))));
    found
}

/// One voxel of an error episode.
struct EpisodeVoxel {
    voxel: usize,
    at: Option<Tick>,
    force: f32,
    depth: Option<f32>,
    direction: Option<AnatomicalDirection>,
}

/// Returns the episodes of tissue that should not have been removed.
fn overcut_episodes(scored: &Scored) -> Vec<ErrorEpisode> {
    let from_wanted =
        NearestOffsets::new(scored, |v| matches!(scored.verdicts[v], Verdict::RightlyRemoved | Verdict::Left));
    let grid = scored.replay.workpiece.volume.grid();
    let mut pieces: BTreeMap<EpisodeKind, Vec<EpisodeVoxel>> = BTreeMap::new();
    for (voxel, verdict) in scored.verdicts.iter().enumerate() {
        let mistake = match verdict {
            Verdict::Overcut => EpisodeKind::Overcut,
            Verdict::VulnerableTouched => EpisodeKind::Vulnerable,
            _ => continue,
        };
        // An exposed voxel was not removed itself; its removed neighbour gives the tick.
        let neighbours = grid.neighbours(voxel).filter_map(|n| scored.removals.get(n));
        let removal = scored.removals.get(voxel).or_else(|| neighbours.min_by_key(|f| f.at));
        let (depth, direction) = from_wanted.of(voxel).unzip();
        let piece = EpisodeVoxel {
            voxel,
            at: removal.map(|f| f.at),
            force: removal.map_or(0.0, |f| f.force),
            depth,
            direction,
        };
        pieces.entry(mistake).or_default().push(piece);
    }
    let lapses = pieces.into_iter().flat_map(|(mistake, mut pieces)| {
        pieces.sort_by_key(|p| (p.at, p.voxel));
        let bouts = pieces.chunk_by_mut(|a, b| is_within(a, b, LIFT_S));
        bouts.flat_map(|bout| episodes_of_bout(scored, mistake, bout)).collect::<Vec<_>>()
    });
    // Even the smallest exposure of the pulp is reported.
    lapses.filter(|l| l.volume >= VOLUME_LEAST || l.kind == EpisodeKind::Vulnerable).collect()
}

/// Returns the episodes of one uninterrupted period of cutting: one of a short period; of a long one, one for each wall
/// and each return to it.
fn episodes_of_bout(scored: &Scored, mistake: EpisodeKind, bout: &mut [EpisodeVoxel]) -> Vec<ErrorEpisode> {
    let is_short = matches!((bout.first(), bout.last()), (Some(a), Some(b)) if is_within(a, b, PAUSE_S));
    if is_short {
        return vec![episode_of_voxels(scored, mistake, bout)];
    }
    bout.sort_by_key(|p| (p.direction, p.at, p.voxel));
    let visits = bout.chunk_by(|a, b| a.direction == b.direction && is_within(a, b, PAUSE_S));
    visits.map(|visit| episode_of_voxels(scored, mistake, visit)).collect()
}

/// Returns true if the later voxel was removed within this number of seconds after the earlier one.
fn is_within(earlier: &EpisodeVoxel, later: &EpisodeVoxel, seconds: f64) -> bool {
    let [earlier, later] = [earlier, later].map(|p| p.at.unwrap_or(Tick::ZERO));
    later.seconds_since(earlier) <= seconds
}

/// Returns the episodes of tissue that should have been removed.
fn undercut_episodes(scored: &Scored) -> Vec<ErrorEpisode> {
    let (before, after) = (&scored.replay.workpiece.volume, &scored.replay.volume);
    let is_removed = |v: usize| before.tissue(v) != Label::AIR && after.tissue(v) == Label::AIR;
    let from_removed = NearestOffsets::new(scored, is_removed);
    let mut pieces: BTreeMap<Option<AnatomicalDirection>, Vec<EpisodeVoxel>> = BTreeMap::new();
    for voxel in (0..scored.verdicts.len()).filter(|&v| scored.verdicts[v] == Verdict::Left) {
        let (depth, direction) = from_removed.of(voxel).unzip();
        pieces.entry(direction).or_default().push(EpisodeVoxel { voxel, at: None, force: 0.0, depth, direction });
    }
    let lapses = pieces.into_values().map(|pieces| episode_of_voxels(scored, EpisodeKind::Left, &pieces));
    lapses.filter(|l| l.volume >= VOLUME_LEAST).collect()
}

fn episode_of_voxels(scored: &Scored, mistake: EpisodeKind, pieces: &[EpisodeVoxel]) -> ErrorEpisode {
    let volume = &scored.replay.workpiece.volume;
    let grid = volume.grid();
    let depth = |p: &&EpisodeVoxel| p.depth.unwrap_or(0.0);
    let deepest = pieces.iter().max_by(|a, b| depth(a).total_cmp(&depth(b))).expect("a lapse has a voxel");
    let mut counts = [0u32; 256];
    pieces.iter().for_each(|p| counts[usize::from(volume.tissue(p.voxel).0)] += 1);
    let most = (0..256).max_by_key(|&l| (counts[l], std::cmp::Reverse(l))).unwrap_or(0);
    let mut ways: BTreeMap<Option<AnatomicalDirection>, usize> = BTreeMap::new();
    pieces.iter().for_each(|p| *ways.entry(p.direction).or_default() += 1);
    let direction = ways.into_iter().max_by_key(|(_, count)| *count).and_then(|(way, _)| way);
    let ends = pieces.first().and_then(|p| p.at).zip(pieces.last().and_then(|p| p.at));
    ErrorEpisode {
        kind: mistake,
        span: ends.map(|(first, last)| [first, last]),
        worst: deepest.at,
        place: grid.centre(grid.cell(deepest.voxel)),
        direction,
        tissue: Label(most as u8),
        depth: deepest.depth,
        volume: pieces.len() as f64 * grid.voxel_mm3(),
        force: pieces.iter().map(|p| p.force).fold(0.0, f32::max),
        seconds: ends.map_or(0.0, |(first, last)| last.seconds_since(first)),
    }
}

/// Distance and direction of voxels from the nearest voxel of a set.
struct NearestOffsets {
    near: Option<(CroppedGrid, Vec<f32>, Vec<u32>)>,
    /// Unit vector toward distal, tooth space.
    distal: Vec3,
}

impl NearestOffsets {
    fn new(scored: &Scored, is_in: impl Fn(usize) -> bool) -> NearestOffsets {
        let grid = scored.replay.workpiece.volume.grid();
        let is_asked =
            |v: usize| matches!(scored.verdicts[v], Verdict::Overcut | Verdict::VulnerableTouched | Verdict::Left);
        let crop = CroppedGrid::around(grid, 1, (0..grid.len()).filter(|&v| is_in(v) || is_asked(v)));
        let near = crop.map(|crop| {
            let (distances, nearest) = distance::to_nearest(&crop.grid, |i| is_in(crop.whole_index(i)));
            (crop, distances, nearest)
        });
        NearestOffsets { near, distal: scored.replay.workpiece.distal() }
    }

    /// Returns the distance (mm) and direction of a voxel from the nearest voxel of the set; `None` for an empty set or
    /// outside the box around all voxels in question.
    fn of(&self, voxel: usize) -> Option<(f32, AnatomicalDirection)> {
        let (crop, distances, nearest) = self.near.as_ref()?;
        let place = crop.index_of(voxel).filter(|&i| distances[i].is_finite())?;
        let centre = |i: usize| crop.grid.centre(crop.grid.cell(i));
        Some((distances[place], direction_of(centre(place) - centre(nearest[place] as usize), self.distal)))
    }
}

/// Returns the anatomical direction nearest to a vector in tooth space.
fn direction_of(vector: Vec3, distal: Vec3) -> AnatomicalDirection {
    let Vec3 { x, y, z } = vector;
    match (x.abs(), y.abs(), z.abs()) {
        (a, b, c) if c >= a && c >= b => {
            if z > 0.0 {
                AnatomicalDirection::Occlusal
            } else {
                AnatomicalDirection::Apical
            }
        }
        (a, b, _) if a >= b => {
            if x > 0.0 {
                AnatomicalDirection::Buccal
            } else {
                AnatomicalDirection::Lingual
            }
        }
        _ => {
            if y * distal.y > 0.0 {
                AnatomicalDirection::Distal
            } else {
                AnatomicalDirection::Mesial
            }
        }
    }
}

/// Returns the episodes in which the force exceeded the value that still earns all points for the measure
/// `force_max_n`.
fn force_episodes(recording: &Recording, scored: &Scored) -> Vec<ErrorEpisode> {
    let items = recording.scenario.rubric.iter().flat_map(|r| &r.items);
    let limits = items.filter(|i| i.metric.info.name == "force_max_n").map(|i| i.full_at as f32);
    let Some(limit) = limits.reduce(f32::min) else { return Vec::new() };
    let hard: Vec<_> = scored.trace.samples.iter().filter(|s| s.touched && s.force > limit).collect();
    let lift = (LIFT_S / TICK_S) as u64;
    let spell = |samples: &[&super::TraceSample]| {
        let worst = samples.iter().max_by(|a, b| a.force.total_cmp(&b.force)).expect("a spell has a sample");
        let span = super::Trace::SPAN_TICKS;
        let begin = samples[0].at.0.saturating_sub(span);
        let end = samples[samples.len() - 1].at.0.saturating_sub(1);
        let within = worst.at.0.saturating_sub(span)..=worst.at.0.saturating_sub(1);
        let peak = peak(recording, within);
        ErrorEpisode {
            kind: EpisodeKind::Force,
            span: Some([Tick(begin), Tick(end)]),
            worst: Some(peak.map_or(worst.at, |p| p.tick)),
            place: peak.map_or(Vec3::ZERO, |p| tip_in_tooth(scored, p)),
            direction: None,
            tissue: peak.map_or(Label::AIR, |p| Label(p.touched)),
            depth: None,
            volume: 0.0,
            force: worst.force,
            seconds: (end - begin) as f64 * TICK_S,
        }
    };
    hard.chunk_by(|a, b| b.at.0 - a.at.0 <= lift).map(spell).collect()
}

/// Returns the record of the greatest force among some ticks, without the coupling force of another hand.
fn peak(recording: &Recording, ticks: RangeInclusive<u64>) -> Option<&crate::record::TickRecord> {
    let ticks = recording.ticks.get(*ticks.start() as usize..=(*ticks.end() as usize).min(recording.len() - 1))?;
    let force = |h: &crate::record::TickRecord| (h.force - h.lead).length();
    ticks.iter().filter(|h| h.touched != 0).max_by(|a, b| force(a).total_cmp(&force(b)))
}

fn tip_in_tooth(scored: &Scored, haptic: &crate::record::TickRecord) -> Vec3 {
    scored.replay.workpiece.world_from_tooth.inverse() * haptic.tip
}

/// Returns the episodes in which a running bur touched neighbouring teeth or soft tissue.
fn contact_episodes(recording: &Recording, scored: &Scored) -> Vec<ErrorEpisode> {
    let scenario = &recording.scenario;
    let stages = scenario.stages.iter().zip(&scored.replay.outcome.stages).filter(|(stage, _)| stage.cutting);
    let running: Vec<[Tick; 2]> = stages.map(|(_, result)| [result.started, result.ended]).collect();
    let is_running = |h: &crate::record::TickRecord| {
        scenario.instruments.get(usize::from(h.instrument)).is_some_and(|i| i.is_bur())
            && running.iter().any(|[from, to]| (*from..*to).contains(&h.tick))
    };
    let lift = (LIFT_S / TICK_S) as u64;
    let of_role = |role: TissueRole, mistake: EpisodeKind| {
        let is_meant = |h: &&crate::record::TickRecord| {
            h.touched != 0 && scenario.tissues.role(Label(h.touched)) == Some(role) && is_running(h)
        };
        let ticks: Vec<_> = recording.ticks.iter().filter(is_meant).collect();
        let spell = |ticks: &[&crate::record::TickRecord]| {
            let (first, last) = (ticks[0], ticks[ticks.len() - 1]);
            let force = |h: &&&crate::record::TickRecord| (h.force - h.lead).length();
            let worst = ticks.iter().max_by(|a, b| force(a).total_cmp(&force(b))).expect("a spell has a tick");
            ErrorEpisode {
                kind: mistake,
                span: Some([first.tick, last.tick]),
                worst: Some(worst.tick),
                place: tip_in_tooth(scored, worst),
                direction: None,
                tissue: Label(worst.touched),
                depth: None,
                volume: 0.0,
                force: force(&worst),
                seconds: ticks.len() as f64 * TICK_S,
            }
        };
        ticks.chunk_by(|a, b| b.tick.0 - a.tick.0 <= lift).map(spell).collect::<Vec<_>>()
    };
    [of_role(TissueRole::Neighbour, EpisodeKind::Neighbour), of_role(TissueRole::Soft, EpisodeKind::Soft)].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_is_the_axis_that_a_vector_follows_most() {
        for (vector, expected) in [
            (Vec3::new(0.9, 0.3, 0.2), AnatomicalDirection::Buccal),
            (Vec3::new(-0.9, 0.3, 0.2), AnatomicalDirection::Lingual),
            (Vec3::new(0.2, -0.7, 0.2), AnatomicalDirection::Mesial),
            (Vec3::new(0.2, 0.7, -0.2), AnatomicalDirection::Distal),
            (Vec3::new(0.5, 0.1, -0.6), AnatomicalDirection::Apical),
            (Vec3::Z, AnatomicalDirection::Occlusal),
        ] {
            assert_eq!(direction_of(vector, Vec3::Y), expected, "{vector}");
        }
    }
}
