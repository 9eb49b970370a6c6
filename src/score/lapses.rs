//! Where and when something went wrong: stretches of time in which one place suffered.
//!
//! A measure says how much; a lapse says which moment and which wall. Nothing here changes a score.

use super::crop::Crop;
use super::{Scored, Verdict};
use crate::content::Role;
use crate::frame::Vec3;
use crate::record::Recording;
use crate::tick::{TICK_S, Tick};
use crate::volume::{Label, distance};
use std::collections::BTreeMap;
use std::ops::RangeInclusive;

/// Time without a mistake after which the next one is another, s: one press, or one unbroken bout of cutting, is one lapse.
const LIFT_S: f64 = 0.7;

/// A bout up to this long is one lapse, s; in a longer one each wall is its own, and each visit to it after so long a pause. A
/// stroke to and fro takes about one; with 3 the passes along one wall stay together.
const PAUSE_S: f64 = 3.0;

/// Least size of a lapse that took tissue or left it, mm³: below, a trainee cannot see what is meant. 0.02 is a cube of 0.27 mm.
const VOLUME_LEAST: f64 = 0.02;

/// What went wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Mistake {
    /// Sound tissue was taken away beyond the leeway.
    Overcut,
    /// Vulnerable tissue, or a zone that must never be touched, was taken away or laid open.
    Vulnerable,
    /// What was to be removed is still there.
    Left,
    /// The hand pressed harder than what still earns all points.
    Force,
    /// A running bur touched a neighbouring tooth.
    Neighbour,
    /// A running bur touched gum or the like.
    Soft,
}

/// Which way from what was to be removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Way {
    Buccal,
    Lingual,
    Mesial,
    Distal,
    Occlusal,
    Apical,
}

/// A mistake at one place in one stretch of time.
#[derive(Clone, Debug, PartialEq)]
pub struct Lapse {
    pub mistake: Mistake,
    /// First and last tick; `None` for what was never done.
    pub span: Option<[Tick; 2]>,
    /// The tick in which it was worst.
    pub worst: Option<Tick>,
    /// Where it was worst, tooth space, mm.
    pub place: Vec3,
    pub way: Option<Way>,
    /// The tissue that suffered most of it; air where none was touched.
    pub tissue: Label,
    /// How far beyond, or left behind, mm.
    pub depth: Option<f32>,
    /// What was taken or left, mm³.
    pub volume: f64,
    /// Greatest force meanwhile, N.
    pub force: f32,
    /// How long it lasted, s: ticks of contact, for what only touches.
    pub seconds: f64,
}

/// Every lapse of a session, by mistake; of each the worst first.
pub fn lapses(recording: &Recording, scored: &Scored) -> Vec<Lapse> {
    let mut found = taken(scored);
    found.extend(left(scored));
    found.extend(pressed(recording, scored));
    found.extend(touched(recording, scored));
    let severity = |l: &Lapse| match l.mistake {
        Mistake::Force => f64::from(l.force),
        Mistake::Neighbour | Mistake::Soft => l.seconds,
        Mistake::Overcut | Mistake::Vulnerable | Mistake::Left => l.volume * (1.0 + f64::from(l.depth.unwrap_or(0.0))),
    };
    found.sort_by(|a, b| a.mistake.cmp(&b.mistake).then(severity(b).total_cmp(&severity(a))));
    found
}

/// One voxel of a lapse.
struct Piece {
    voxel: usize,
    at: Option<Tick>,
    force: f32,
    depth: Option<f32>,
    way: Option<Way>,
}

/// Tissue that should have stayed.
fn taken(scored: &Scored) -> Vec<Lapse> {
    let from_wanted = Offsets::from(scored, |v| matches!(scored.verdicts[v], Verdict::RightlyRemoved | Verdict::Left));
    let grid = scored.replay.workpiece.volume.grid();
    let mut pieces: BTreeMap<Mistake, Vec<Piece>> = BTreeMap::new();
    for (voxel, verdict) in scored.verdicts.iter().enumerate() {
        let mistake = match verdict {
            Verdict::Overcut => Mistake::Overcut,
            Verdict::VulnerableTouched => Mistake::Vulnerable,
            _ => continue,
        };
        // What was laid open fell in no tick; its neighbour did.
        let neighbours = grid.neighbours(voxel).filter_map(|n| scored.falls.get(n));
        let fall = scored.falls.get(voxel).or_else(|| neighbours.min_by_key(|f| f.at));
        let (depth, way) = from_wanted.of(voxel).unzip();
        let piece = Piece { voxel, at: fall.map(|f| f.at), force: fall.map_or(0.0, |f| f.force), depth, way };
        pieces.entry(mistake).or_default().push(piece);
    }
    let lapses = pieces.into_iter().flat_map(|(mistake, mut pieces)| {
        pieces.sort_by_key(|p| (p.at, p.voxel));
        let bouts = pieces.chunk_by_mut(|a, b| is_within(a, b, LIFT_S));
        bouts.flat_map(|bout| of_bout(scored, mistake, bout)).collect::<Vec<_>>()
    });
    // The least opening of the pulp is an opening.
    lapses.filter(|l| l.volume >= VOLUME_LEAST || l.mistake == Mistake::Vulnerable).collect()
}

/// The lapses of one unbroken bout of cutting: one of a short bout; of a long one, one for each wall and visit to it.
fn of_bout(scored: &Scored, mistake: Mistake, bout: &mut [Piece]) -> Vec<Lapse> {
    let is_short = matches!((bout.first(), bout.last()), (Some(a), Some(b)) if is_within(a, b, PAUSE_S));
    if is_short {
        return vec![of_pieces(scored, mistake, bout)];
    }
    bout.sort_by_key(|p| (p.way, p.at, p.voxel));
    let visits = bout.chunk_by(|a, b| a.way == b.way && is_within(a, b, PAUSE_S));
    visits.map(|visit| of_pieces(scored, mistake, visit)).collect()
}

/// True when the later of two pieces fell within so many seconds of the earlier.
fn is_within(earlier: &Piece, later: &Piece, seconds: f64) -> bool {
    let [earlier, later] = [earlier, later].map(|p| p.at.unwrap_or(Tick::ZERO));
    later.seconds_since(earlier) <= seconds
}

/// Tissue that should have gone.
fn left(scored: &Scored) -> Vec<Lapse> {
    let (before, after) = (&scored.replay.workpiece.volume, &scored.replay.volume);
    let is_removed = |v: usize| before.tissue(v) != Label::AIR && after.tissue(v) == Label::AIR;
    let from_removed = Offsets::from(scored, is_removed);
    let mut pieces: BTreeMap<Option<Way>, Vec<Piece>> = BTreeMap::new();
    for voxel in (0..scored.verdicts.len()).filter(|&v| scored.verdicts[v] == Verdict::Left) {
        let (depth, way) = from_removed.of(voxel).unzip();
        pieces.entry(way).or_default().push(Piece { voxel, at: None, force: 0.0, depth, way });
    }
    let lapses = pieces.into_values().map(|pieces| of_pieces(scored, Mistake::Left, &pieces));
    lapses.filter(|l| l.volume >= VOLUME_LEAST).collect()
}

fn of_pieces(scored: &Scored, mistake: Mistake, pieces: &[Piece]) -> Lapse {
    let volume = &scored.replay.workpiece.volume;
    let grid = volume.grid();
    let depth = |p: &&Piece| p.depth.unwrap_or(0.0);
    let deepest = pieces.iter().max_by(|a, b| depth(a).total_cmp(&depth(b))).expect("a lapse has a voxel");
    let mut counts = [0u32; 256];
    pieces.iter().for_each(|p| counts[usize::from(volume.tissue(p.voxel).0)] += 1);
    let most = (0..256).max_by_key(|&l| (counts[l], std::cmp::Reverse(l))).unwrap_or(0);
    let mut ways: BTreeMap<Option<Way>, usize> = BTreeMap::new();
    pieces.iter().for_each(|p| *ways.entry(p.way).or_default() += 1);
    let way = ways.into_iter().max_by_key(|(_, count)| *count).and_then(|(way, _)| way);
    let ends = pieces.first().and_then(|p| p.at).zip(pieces.last().and_then(|p| p.at));
    Lapse {
        mistake,
        span: ends.map(|(first, last)| [first, last]),
        worst: deepest.at,
        place: grid.centre(grid.cell(deepest.voxel)),
        way,
        tissue: Label(most as u8),
        depth: deepest.depth,
        volume: pieces.len() as f64 * grid.voxel_mm3(),
        force: pieces.iter().map(|p| p.force).fold(0.0, f32::max),
        seconds: ends.map_or(0.0, |(first, last)| last.seconds_since(first)),
    }
}

/// How far and which way a voxel lies from the nearest one of a set.
struct Offsets {
    near: Option<(Crop, Vec<f32>, Vec<u32>)>,
    /// Which way is distal, tooth space.
    distal: Vec3,
}

impl Offsets {
    fn from(scored: &Scored, is_in: impl Fn(usize) -> bool) -> Offsets {
        let grid = scored.replay.workpiece.volume.grid();
        let is_asked =
            |v: usize| matches!(scored.verdicts[v], Verdict::Overcut | Verdict::VulnerableTouched | Verdict::Left);
        let crop = Crop::around(grid, 1, (0..grid.len()).filter(|&v| is_in(v) || is_asked(v)));
        let near = crop.map(|crop| {
            let (distances, nearest) = distance::to_nearest(&crop.grid, |i| is_in(crop.whole_index(i)));
            (crop, distances, nearest)
        });
        Offsets { near, distal: scored.replay.workpiece.distal() }
    }

    /// `None` with an empty set, or far from all that was asked about.
    fn of(&self, voxel: usize) -> Option<(f32, Way)> {
        let (crop, distances, nearest) = self.near.as_ref()?;
        let place = crop.index_of(voxel).filter(|&i| distances[i].is_finite())?;
        let centre = |i: usize| crop.grid.centre(crop.grid.cell(i));
        Some((distances[place], way(centre(place) - centre(nearest[place] as usize), self.distal)))
    }
}

/// The side toward which a vector of tooth space points most.
fn way(vector: Vec3, distal: Vec3) -> Way {
    let Vec3 { x, y, z } = vector;
    match (x.abs(), y.abs(), z.abs()) {
        (a, b, c) if c >= a && c >= b => {
            if z > 0.0 {
                Way::Occlusal
            } else {
                Way::Apical
            }
        }
        (a, b, _) if a >= b => {
            if x > 0.0 {
                Way::Buccal
            } else {
                Way::Lingual
            }
        }
        _ => {
            if y * distal.y > 0.0 {
                Way::Distal
            } else {
                Way::Mesial
            }
        }
    }
}

/// Presses harder than what still earns all points for a light hand.
fn pressed(recording: &Recording, scored: &Scored) -> Vec<Lapse> {
    let items = recording.scenario.rubric.iter().flat_map(|r| &r.items);
    let limits = items.filter(|i| i.metric.about.name == "force_max_n").map(|i| i.full_at as f32);
    let Some(limit) = limits.reduce(f32::min) else { return Vec::new() };
    let hard: Vec<_> = scored.trace.samples.iter().filter(|s| s.touched && s.force > limit).collect();
    let lift = (LIFT_S / TICK_S) as u64;
    let spell = |samples: &[&super::Sample]| {
        let worst = samples.iter().max_by(|a, b| a.force.total_cmp(&b.force)).expect("a spell has a sample");
        let span = super::Trace::SPAN_TICKS;
        let begin = samples[0].at.0.saturating_sub(span);
        let end = samples[samples.len() - 1].at.0.saturating_sub(1);
        let within = worst.at.0.saturating_sub(span)..=worst.at.0.saturating_sub(1);
        let peak = peak(recording, within);
        Lapse {
            mistake: Mistake::Force,
            span: Some([Tick(begin), Tick(end)]),
            worst: Some(peak.map_or(worst.at, |p| p.tick)),
            place: peak.map_or(Vec3::ZERO, |p| tip_in_tooth(scored, p)),
            way: None,
            tissue: peak.map_or(Label::AIR, |p| Label(p.touched)),
            depth: None,
            volume: 0.0,
            force: worst.force,
            seconds: (end - begin) as f64 * TICK_S,
        }
    };
    hard.chunk_by(|a, b| b.at.0 - a.at.0 <= lift).map(spell).collect()
}

/// The tick of the greatest force on the hand among some, another hand's lead left out.
fn peak(recording: &Recording, ticks: RangeInclusive<u64>) -> Option<&crate::record::Haptic> {
    let ticks = recording.ticks.get(*ticks.start() as usize..=(*ticks.end() as usize).min(recording.len() - 1))?;
    let force = |h: &crate::record::Haptic| (h.force - h.lead).length();
    ticks.iter().filter(|h| h.touched != 0).max_by(|a, b| force(a).total_cmp(&force(b)))
}

fn tip_in_tooth(scored: &Scored, haptic: &crate::record::Haptic) -> Vec3 {
    scored.replay.workpiece.world_from_tooth.inverse() * haptic.tip
}

/// A running bur on what is not the tooth.
fn touched(recording: &Recording, scored: &Scored) -> Vec<Lapse> {
    let scenario = &recording.scenario;
    let stages = scenario.stages.iter().zip(&scored.replay.outcome.stages).filter(|(stage, _)| stage.cutting);
    let running: Vec<[Tick; 2]> = stages.map(|(_, result)| [result.started, result.ended]).collect();
    let is_running = |h: &crate::record::Haptic| {
        scenario.instruments.get(usize::from(h.instrument)).is_some_and(|i| i.is_bur())
            && running.iter().any(|[from, to]| (*from..*to).contains(&h.tick))
    };
    let lift = (LIFT_S / TICK_S) as u64;
    let of_role = |role: Role, mistake: Mistake| {
        let is_meant = |h: &&crate::record::Haptic| {
            h.touched != 0 && scenario.tissues.role(Label(h.touched)) == Some(role) && is_running(h)
        };
        let ticks: Vec<_> = recording.ticks.iter().filter(is_meant).collect();
        let spell = |ticks: &[&crate::record::Haptic]| {
            let (first, last) = (ticks[0], ticks[ticks.len() - 1]);
            let force = |h: &&&crate::record::Haptic| (h.force - h.lead).length();
            let worst = ticks.iter().max_by(|a, b| force(a).total_cmp(&force(b))).expect("a spell has a tick");
            Lapse {
                mistake,
                span: Some([first.tick, last.tick]),
                worst: Some(worst.tick),
                place: tip_in_tooth(scored, worst),
                way: None,
                tissue: Label(worst.touched),
                depth: None,
                volume: 0.0,
                force: force(&worst),
                seconds: ticks.len() as f64 * TICK_S,
            }
        };
        ticks.chunk_by(|a, b| b.tick.0 - a.tick.0 <= lift).map(spell).collect::<Vec<_>>()
    };
    [of_role(Role::Neighbour, Mistake::Neighbour), of_role(Role::Soft, Mistake::Soft)].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_is_the_axis_that_a_vector_follows_most() {
        for (vector, expected) in [
            (Vec3::new(0.9, 0.3, 0.2), Way::Buccal),
            (Vec3::new(-0.9, 0.3, 0.2), Way::Lingual),
            (Vec3::new(0.2, -0.7, 0.2), Way::Mesial),
            (Vec3::new(0.2, 0.7, -0.2), Way::Distal),
            (Vec3::new(0.5, 0.1, -0.6), Way::Apical),
            (Vec3::Z, Way::Occlusal),
        ] {
            assert_eq!(way(vector, Vec3::Y), expected, "{vector}");
        }
    }
}
