//! What holds a tooth: gum with its sulcus or pockets, the attachment at their floor, the bone below.
//!
//! A periodontal chart has six sites a tooth. Between them margin and floor change smoothly round the tooth, so that a probe
//! that is walked along the gum finds no step.

use crate::frame::Vec3;
use crate::volume::{Grid, ISO, Label, Volume, distance};
use std::f32::consts::PI;

/// One of the six places where a periodontal chart has a reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Site {
    MesioBuccal,
    Buccal,
    DistoBuccal,
    MesioLingual,
    Lingual,
    DistoLingual,
}

impl Site {
    /// In the order of a chart: along the cheek from mesial, then along the tongue.
    pub const ALL: [Site; 6] =
        [Site::MesioBuccal, Site::Buccal, Site::DistoBuccal, Site::MesioLingual, Site::Lingual, Site::DistoLingual];

    /// As charts write it.
    pub fn code(self) -> &'static str {
        ["MB", "B", "DB", "ML", "L", "DL"][self as usize]
    }

    /// Where round the tooth it lies, rad: 0 in the middle of the cheek's side, growing toward distal. The sites beside the
    /// neighbours lie at the line angles, where a probe comes in under the contact.
    pub fn turn(self) -> f32 {
        const ANGLE: f32 = 50.0 * PI / 180.0;
        [-ANGLE, 0.0, ANGLE, ANGLE - PI, PI, PI - ANGLE][self as usize]
    }

    /// The site that is nearest to a place round the tooth.
    pub fn nearest(turn: f32) -> Site {
        let off = |site: &Site| wrapped(site.turn() - turn).abs();
        Site::ALL.into_iter().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(Site::Buccal)
    }
}

/// A length at each site, mm, in the order of [`Site::ALL`].
pub type AtSites = [f32; 6];

/// How deep the gum reaches round a tooth; mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pockets {
    /// From the gum's margin to the floor of the sulcus or pocket.
    pub depth: AtSites,
    /// How far the margin has gone back below the neckline; negative where it covers enamel.
    pub recession: AtSites,
}

impl Pockets {
    /// Healthy gum: a sulcus of 1 to 3 mm, its margin on enamel.
    pub const HEALTHY: Pockets =
        Pockets { depth: [2.4, 1.4, 2.4, 2.4, 1.4, 2.4], recession: [-1.2, -0.8, -1.2, -1.2, -0.8, -1.2] };
}

/// From the floor of a sulcus to the bone's crest, mm: epithelial 0.97 and connective 1.07 (A. W. Gargiulo and others,
/// *Dimensions and relations of the dentogingival junction in humans*, 1961).
pub const ATTACHMENT: f32 = 2.04;

/// How far a sulcus stands open for a probe, mm. Gum lies on the tooth and gives way to the end of a probe, 0.5 mm thick; half
/// as much again keeps the end from being clamped between two walls that each are good to a tenth.
pub const OPEN: f32 = 0.75;

/// How far a sulcus stands open to the eye, mm.
const CLOSED: f32 = 0.1;

/// The gum's top slopes about so: a height over it is so much of a distance.
const SLOPE: f32 = 0.85;

/// Distance between samples of the distance from the tooth, mm.
const SPACING: f32 = 0.16;

/// What is known of the gum beside the tooth: so far from its crown's box, and above the margin, mm.
const BESIDE: f32 = 3.0;
const ABOVE: f32 = 1.5;

/// Steps round the tooth in which its neckline is looked for.
const TURNS: usize = 72;

/// Gum round one tooth; tooth space, mm.
#[derive(Clone, Debug)]
pub struct Periodontium {
    pub pockets: Pockets,
    /// The crown's box.
    crown: [Vec3; 2],
    /// +1 where y is distal, -1 where it is mesial.
    distal: f32,
    /// Height of the neckline by place round the tooth.
    neckline: [f32; TURNS],
    grid: Grid,
    /// From the tooth's surface, what has settled on it included; negative inside.
    away: Vec<f32>,
}

/// A tooth as its gum sees it.
#[derive(Clone, Copy, Debug)]
pub struct Standing<'a> {
    pub volume: &'a Volume,
    pub enamel: Label,
    /// Corners of the box around the crown, tooth space.
    pub crown: [Vec3; 2],
    /// +1 where y is distal, -1 where it is mesial.
    pub distal: f32,
}

impl Periodontium {
    pub fn around(standing: &Standing, pockets: Pockets) -> Periodontium {
        let Standing { volume, crown, distal, .. } = *standing;
        let neckline = neckline(standing);
        let mut made =
            Periodontium { pockets, crown, distal, neckline, grid: Grid::centred([1; 3], Vec3::ONE), away: Vec::new() };
        let heights = (0..TURNS).map(|i| (made.margin(turn_of(i)), made.floor(turn_of(i))));
        let [low, high] = heights.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], (margin, floor)| {
            [low.min(floor), high.max(margin)]
        });
        let (from, to) = (crown[0].with_z(low - 1.0), crown[1].with_z(high + ABOVE));
        let beside = Vec3::new(BESIDE, BESIDE, 0.0);
        made.grid = Grid::covering(from - beside, to + beside, Vec3::splat(SPACING), 1);
        made.away = away(volume, &made.grid);
        made
    }

    /// Where round the tooth a point lies, rad, as [`Site::turn`] counts.
    pub fn turn(&self, point: Vec3) -> f32 {
        let (middle, half) = self.middle_and_half();
        let at = (point - middle) / half;
        libm::atan2f(at.y * self.distal, at.x)
    }

    /// The way from the tooth's middle outward at a place round it; level, unit.
    pub fn outward(&self, turn: f32) -> Vec3 {
        let (_, half) = self.middle_and_half();
        let level = Vec3::new(libm::cosf(turn) * half.x, libm::sinf(turn) * self.distal * half.y, 0.0);
        level.normalize_or(Vec3::X)
    }

    /// The middle of the crown, level with the origin.
    pub fn middle(&self) -> Vec3 {
        self.middle_and_half().0
    }

    fn middle_and_half(&self) -> (Vec3, Vec3) {
        let [low, high] = self.crown;
        ((0.5 * (low + high)).with_z(0.0), (0.5 * (high - low)).with_z(1.0))
    }

    /// Height of the neckline (the cemento-enamel junction).
    pub fn neckline(&self, turn: f32) -> f32 {
        let at = wrapped(turn) / (2.0 * PI) * TURNS as f32 + TURNS as f32;
        let (before, part) = (at as usize, at.fract());
        let [a, b] = [before, before + 1].map(|i| self.neckline[i % TURNS]);
        a + (b - a) * part
    }

    /// Height of the gum's margin.
    pub fn margin(&self, turn: f32) -> f32 {
        self.neckline(turn) - between_sites(&self.pockets.recession, turn)
    }

    /// Height of the floor of the sulcus or pocket.
    pub fn floor(&self, turn: f32) -> f32 {
        self.margin(turn) - between_sites(&self.pockets.depth, turn)
    }

    /// Height of the bone's crest.
    pub fn bone(&self, turn: f32) -> f32 {
        self.floor(turn) - ATTACHMENT
    }

    /// The lowest floor of all.
    pub fn deepest(&self) -> f32 {
        (0..TURNS).map(|i| self.floor(turn_of(i))).fold(f32::INFINITY, f32::min)
    }

    /// How deep in the sulcus a place lies, along a shaft that points from there toward the hand; negative above the margin.
    pub fn depth_along(&self, place: Vec3, shaft: Vec3) -> f32 {
        // A shaft that lies nearly level would read any depth.
        const STEEP: f32 = 0.5;
        (self.margin(self.turn(place)) - place.z) / shaft.z.max(STEEP)
    }

    /// From the tooth's surface to a point; negative inside. Good to a twentieth of a millimetre beside the gum, never more
    /// than it is elsewhere.
    pub fn away(&self, point: Vec3) -> f32 {
        let [low, high] = self.grid.extent();
        let inside = point.clamp(low, high);
        self.grid.mixed(&self.away, inside) + point.distance(inside)
    }

    /// Signed distance from the gum as a probe feels it, up to its outer border: it stands off the tooth by [`OPEN`].
    pub fn gum(&self, point: Vec3) -> f32 {
        self.gum_standing_off(point, OPEN)
    }

    /// The same as the eye sees it: it lies on the tooth.
    pub fn seen_gum(&self, point: Vec3) -> f32 {
        self.gum_standing_off(point, CLOSED)
    }

    /// The same as if the tooth were gum too: its top goes on through the tooth as its margin runs there. What a drawn sheet of gum is
    /// laid on.
    pub fn filled_gum(&self, point: Vec3) -> f32 {
        ((point.z - self.top(point)) * SLOPE).max(self.ridge(point))
    }

    fn gum_standing_off(&self, point: Vec3, open: f32) -> f32 {
        let below = (point.z - self.top(point)) * SLOPE;
        below.max(open - self.away(point)).max(self.ridge(point))
    }

    /// Signed distance from the ridge that the tooth stands in: a rounded wall along the arch.
    fn ridge(&self, point: Vec3) -> f32 {
        /// How far it reaches beyond the crown toward cheek and tongue, how round its edge is, and how far that stays over the
        /// margin, mm.
        const BEYOND: f32 = 1.5;
        const ROUND: f32 = 4.0;
        const OVER: f32 = 0.9;
        let (middle, half) = self.middle_and_half();
        let top = Site::ALL.map(|site| self.margin(site.turn())).into_iter().fold(f32::NEG_INFINITY, f32::max) + OVER;
        let aside = (point.x - middle.x).abs() - (half.x + BEYOND - ROUND);
        let over = point.z - (top - ROUND);
        libm::hypotf(aside.max(0.0), over.max(0.0)) + aside.max(over).min(0.0) - ROUND
    }

    /// Height of the gum's top over a place: a rounded margin that falls away toward cheek and tongue, a papilla that rises
    /// toward the contacts.
    fn top(&self, point: Vec3) -> f32 {
        /// Free gum is so thick before it falls away, mm, and so round.
        const THICK: f32 = 0.7;
        const ROUND: f32 = 2.2;
        /// How far a papilla rises over the margin, and over which way, mm.
        const PAPILLA: f32 = 0.9;
        const RISE: f32 = 1.2;
        let turn = self.turn(point);
        let margin = self.margin(turn);
        let aside = (self.away(point.with_z(margin)) - CLOSED).max(0.0);
        let (cheekward, mesiodistal) = (libm::cosf(turn), libm::sinf(turn));
        let falls = (aside - THICK).max(0.0);
        let falls = falls * falls / ROUND;
        let share = (aside / RISE).clamp(0.0, 1.0);
        let papilla = PAPILLA * share * share * (3.0 - 2.0 * share);
        // Only between two teeth is a papilla held up.
        let between = mesiodistal * mesiodistal * mesiodistal * mesiodistal;
        margin - falls.min(6.0) * cheekward * cheekward + papilla * between
    }

    /// Signed distance from what closes the sulcus below.
    pub fn attachment(&self, point: Vec3) -> f32 {
        /// How far it reaches under the gum, and down, mm: nobody gets there.
        const UNDER: f32 = 0.4;
        const DOWN: f32 = 3.0;
        let floor = self.floor(self.turn(point));
        (point.z - floor).max(self.away(point) - OPEN - UNDER).max(floor - DOWN - point.z)
    }
}

fn turn_of(step: usize) -> f32 {
    2.0 * PI * step as f32 / TURNS as f32
}

/// An angle within half a turn of zero.
fn wrapped(turn: f32) -> f32 {
    turn - (turn / (2.0 * PI)).round() * 2.0 * PI
}

/// Between the two sites on either side of a place, with level ends: no reading between two sites is beyond both.
fn between_sites(values: &AtSites, turn: f32) -> f32 {
    // Round the tooth from the tongue's side over mesial: sites in the order of their angles.
    const ROUND: [usize; 7] = [4, 3, 0, 1, 2, 5, 4];
    let turn = wrapped(turn);
    let angle = |place: usize| if place == 0 { -PI } else { Site::ALL[ROUND[place]].turn() };
    let place = (0..6).rev().find(|&place| angle(place) <= turn).unwrap_or(0);
    let (from, to) = (angle(place), if place == 5 { PI } else { angle(place + 1) });
    let share = ((turn - from) / (to - from)).clamp(0.0, 1.0);
    let (a, b) = (values[ROUND[place]], values[ROUND[place + 1]]);
    a + (b - a) * share * share * (3.0 - 2.0 * share)
}

/// The lowest enamel all round, smoothed over some degrees: a voxel's step is not the neckline's.
fn neckline(standing: &Standing) -> [f32; TURNS] {
    /// Steps on either side over which it is smoothed.
    const AROUND: i32 = 4;
    let Standing { volume, enamel, crown: [low, high], distal } = *standing;
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let grid = volume.grid();
    let mut lowest = [f32::INFINITY; TURNS];
    for (index, _) in volume.tissues().enumerate().filter(|(_, label)| *label == enamel) {
        let at = (grid.centre(grid.cell(index)) - middle) / half;
        let turn = wrapped(libm::atan2f(at.y * distal, at.x)) / (2.0 * PI) * TURNS as f32;
        let step = (turn.round() as i32).rem_euclid(TURNS as i32) as usize;
        let height = grid.centre(grid.cell(index)).z;
        lowest[step] = lowest[step].min(height);
    }
    // A side without enamel has its neckline where the others have it.
    let known = lowest.iter().copied().filter(|z| z.is_finite());
    let (sum, count) = known.fold((0.0, 0u32), |(sum, count), z| (sum + z, count + 1));
    let mean = if count > 0 { sum / count as f32 } else { low.z };
    lowest.iter_mut().filter(|z| !z.is_finite()).for_each(|z| *z = mean);
    std::array::from_fn(|i| {
        let near = (-AROUND..=AROUND).map(|by| lowest[(i as i32 + by).rem_euclid(TURNS as i32) as usize]);
        near.sum::<f32>() / (2 * AROUND + 1) as f32
    })
}

/// From a volume's surface to each point of a grid, finer than its samples: by the nearest sample inside and how deep that
/// one lies.
fn away(volume: &Volume, grid: &Grid) -> Vec<f32> {
    let density: Vec<f32> = grid.cells().map(|cell| volume.density_at(grid.centre(cell))).collect();
    let depth = |i: usize| (density[i] - ISO) * 2.0 * volume.band();
    let (mut away, nearest) = distance::to_nearest(grid, |i| density[i] >= ISO);
    for (i, away) in away.iter_mut().enumerate() {
        *away = match *away {
            far if far.is_infinite() => FAR,
            far => far - depth(nearest[i] as usize),
        };
    }
    away
}

/// From a tooth that is not there, mm.
const FAR: f32 = 100.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anatomy::{Tissues, grid_of_spacing, grow, teeth};

    const TISSUES: Tissues = Tissues { enamel: Label(1), dentine: Label(2), pulp: Label(3) };

    fn tooth(fdi: u8) -> (Volume, [Vec3; 2]) {
        let form = teeth::tooth(fdi).unwrap();
        let volume = grow(&form, grid_of_spacing(&form, 0.2), &TISSUES);
        let grid = *volume.grid();
        let enamel = volume.tissues().enumerate().filter(|(_, l)| *l == TISSUES.enamel);
        let [low, high] = enamel.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], (i, _)| {
            let at = grid.centre(grid.cell(i));
            [low.min(at), high.max(at)]
        });
        (volume, [low, high])
    }

    #[test]
    fn each_site_has_its_own_depth_and_between_two_it_changes_without_a_step() {
        let pockets = Pockets { depth: [6.0, 2.0, 4.0, 3.0, 1.0, 8.0], recession: [0.0; 6] };
        let (volume, crown) = tooth(36);
        let gum = Periodontium::around(&Standing { volume: &volume, enamel: Label(1), crown, distal: 1.0 }, pockets);
        for (site, depth) in Site::ALL.into_iter().zip(pockets.depth) {
            let turn = site.turn();
            assert!((gum.margin(turn) - gum.floor(turn) - depth).abs() < 1e-4, "{site:?}");
            assert_eq!(Site::nearest(gum.turn(gum.middle() + gum.outward(turn) * 5.0)), site);
        }
        let steps: Vec<f32> = (0..=720).map(|i| gum.floor(i as f32 * PI / 360.0)).collect();
        let widest = steps.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f32::max);
        assert!(widest < 0.15, "half a degree changes the floor by {widest} mm");
    }

    #[test]
    fn a_probe_finds_room_down_to_the_floor_and_none_below() {
        // Aim: a cleft, no tunnel. Method: places 0.4 mm off the root, all round, above and below the floor.
        for (fdi, distal) in [(36, 1.0), (11, 1.0), (46, -1.0)] {
            let (volume, crown) = tooth(fdi);
            let standing = Standing { volume: &volume, enamel: Label(1), crown, distal };
            let pockets = Pockets { depth: [4.0, 3.0, 4.0, 4.0, 3.0, 5.0], recession: [-1.0; 6] };
            let gum = Periodontium::around(&standing, pockets);
            for site in Site::ALL {
                let (turn, out) = (site.turn(), gum.outward(site.turn()));
                let place = |z: f32| {
                    let at = |i: u32| (gum.middle() + out * (12.0 - 0.02 * i as f32)).with_z(z);
                    (0..600).map(at).find(|p| gum.away(*p) < 0.4).unwrap()
                };
                for z in [gum.margin(turn) - 0.3, gum.floor(turn) + 0.4] {
                    let at = place(z);
                    assert!(gum.gum(at) > 0.2, "{fdi} {site:?}: {} from the gum at {z}", gum.gum(at));
                    assert!(gum.attachment(at) > 0.2, "{fdi} {site:?}: {}", gum.attachment(at));
                }
                // Its top is round; further down there is a wall.
                let outside = place(gum.floor(turn) + 0.4) + out;
                assert!(gum.gum(outside) < 0.0, "{fdi} {site:?}: {} from the gum outside", gum.gum(outside));
                let at = place(gum.floor(turn) - 0.5);
                assert!(gum.attachment(at) < 0.0, "{fdi} {site:?}: {}", gum.attachment(at));
            }
        }
    }
}
