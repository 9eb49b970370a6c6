//! The periodontium: gingiva with its sulcus or pockets, the attachment at their floor, and the bone below.
//!
//! A periodontal chart has six sites per tooth. Between the sites, margin and floor change smoothly around the tooth,
//! so that a probe that is walked along the gingiva meets no step.

use std::f32::consts::PI;
use typodont_core::aabb::Aabb;
use typodont_core::frame::Vec3;
use typodont_core::volume::{Grid, ISO, Label, Volume, distance};

/// One of the six sites of a periodontal chart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ProbingSite {
    MesioBuccal,
    Buccal,
    DistoBuccal,
    MesioLingual,
    Lingual,
    DistoLingual,
}

impl ProbingSite {
    /// All sites in the order of a chart: along the buccal side from mesial to distal, then along the lingual side.
    pub const ALL: [ProbingSite; 6] = [
        ProbingSite::MesioBuccal,
        ProbingSite::Buccal,
        ProbingSite::DistoBuccal,
        ProbingSite::MesioLingual,
        ProbingSite::Lingual,
        ProbingSite::DistoLingual,
    ];

    /// Returns the site's abbreviation in charts.
    pub fn code(self) -> &'static str {
        ["MB", "B", "DB", "ML", "L", "DL"][self as usize]
    }

    /// Returns the azimuth of the site around the tooth, rad: 0 in the middle of the buccal side, increasing toward
    /// distal. The interproximal sites are at the line angles, at which a probe enters under the contact.
    pub fn azimuth(self) -> f32 {
        const ANGLE: f32 = 50.0 * PI / 180.0;
        [-ANGLE, 0.0, ANGLE, ANGLE - PI, PI, PI - ANGLE][self as usize]
    }

    /// Returns the site nearest to an azimuth, rad.
    pub fn nearest(azimuth: f32) -> ProbingSite {
        let off = |site: &ProbingSite| wrap_angle(site.azimuth() - azimuth).abs();
        ProbingSite::ALL.into_iter().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(ProbingSite::Buccal)
    }
}

/// A length at each site, mm, in the order of [`ProbingSite::ALL`].
pub type SiteLengths = [f32; 6];

/// Probing depth and recession around a tooth, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pockets {
    /// Probing depths from the gingival margin to the floor of the sulcus or pocket.
    pub depth: SiteLengths,
    /// Recession of the gingival margin below the cemento-enamel junction; negative if the margin covers enamel.
    pub recession: SiteLengths,
}

impl Pockets {
    /// Healthy gingiva: a sulcus of 1 to 3 mm, with its margin on enamel.
    pub const HEALTHY: Pockets =
        Pockets { depth: [2.4, 1.4, 2.4, 2.4, 1.4, 2.4], recession: [-1.2, -0.8, -1.2, -1.2, -0.8, -1.2] };
}

/// Height of the attachment from the floor of a sulcus to the crest of the bone, mm: epithelial 0.97 and connective
/// 1.07 (A. W. Gargiulo and others, *Dimensions and relations of the dentogingival junction in humans*, 1961).
pub const ATTACHMENT: f32 = 2.04;

/// Width of the sulcus for a probe, mm. Gingiva lies on the tooth and yields to the end of a probe, which is 0.5 mm
/// thick; the additional half prevents the end from being clamped between two walls, each of which is accurate to 0.1
/// mm.
pub const PROBING_GAP: f32 = 0.75;

/// Visible width of the sulcus, mm.
const VISUAL_GAP: f32 = 0.1;

/// Profile of the free gingiva at its margin.
#[derive(Clone, Copy, Debug)]
struct MarginEdge {
    /// Thickness before it descends, mm.
    thickness: f32,
    /// Descent where it begins, mm per mm.
    slope: f32,
    /// True if papillae descend toward cheek and tongue.
    has_round_papillae: bool,
}

/// Visible gingiva ends on the tooth in a thin edge. What is felt is blunter; recordings are replayed in it, so it never changes.
const VISUAL_EDGE: MarginEdge = MarginEdge { thickness: 0.0, slope: 0.6, has_round_papillae: true };
const PROBING_EDGE: MarginEdge = MarginEdge { thickness: 0.7, slope: 0.0, has_round_papillae: false };

/// Ratio of the distance from the top of the gingiva to the height above it, from the typical slope of the top.
const SLOPE: f32 = 0.85;

/// Spacing of the samples of the distance from the tooth, mm.
const SPACING: f32 = 0.16;

/// Extent of the sampled region beside the box of the crown and above the gingival margin, mm.
const BESIDE: f32 = 3.0;
const ABOVE: f32 = 1.5;

/// Number of steps around the tooth at which the cemento-enamel junction is sampled.
const AZIMUTH_STEPS: usize = 72;

/// Gingiva around one tooth; tooth space, mm.
#[derive(Clone, Debug)]
pub struct Periodontium {
    pub pockets: Pockets,
    /// Bounding box of the crown.
    crown: Aabb,
    /// +1 if y is distal, -1 if it is mesial.
    distal: f32,
    /// Height of the cemento-enamel junction by step around the tooth.
    neckline: [f32; AZIMUTH_STEPS],
    grid: Grid,
    /// Signed distances from the tooth's surface including its deposits, negative inside.
    tooth_distances: Vec<f32>,
}

/// Data of a tooth from which its periodontium is made.
#[derive(Clone, Copy, Debug)]
pub struct ToothContext<'a> {
    pub volume: &'a Volume,
    pub enamel: Label,
    /// Bounding box of the crown, tooth space, mm.
    pub crown: Aabb,
    /// +1 if y is distal, -1 if it is mesial.
    pub distal: f32,
}

impl Periodontium {
    pub fn around(tooth: &ToothContext, pockets: Pockets) -> Periodontium {
        let ToothContext { volume, crown, distal, .. } = *tooth;
        let neckline = neckline(tooth);
        let mut made = Periodontium {
            pockets,
            crown,
            distal,
            neckline,
            grid: Grid::centred([1; 3], Vec3::ONE),
            tooth_distances: Vec::new(),
        };
        let heights = (0..AZIMUTH_STEPS).map(|i| (made.margin(azimuth_of_step(i)), made.floor(azimuth_of_step(i))));
        let [low, high] = heights.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], (margin, floor)| {
            [low.min(floor), high.max(margin)]
        });
        let (from, to) = (crown.low.with_z(low - 1.0), crown.high.with_z(high + ABOVE));
        let beside = Vec3::new(BESIDE, BESIDE, 0.0);
        made.grid = Grid::covering(from - beside, to + beside, Vec3::splat(SPACING), 1);
        made.tooth_distances = distances_to_tooth(volume, &made.grid);
        made
    }

    /// Returns the azimuth of a point around the tooth, rad, as in [`ProbingSite::azimuth`].
    pub fn azimuth(&self, point: Vec3) -> f32 {
        let (middle, half) = self.middle_and_half();
        let at = (point - middle) / half;
        libm::atan2f(at.y * self.distal, at.x)
    }

    /// Returns the horizontal unit vector from the centre of the tooth outward at an azimuth.
    pub fn outward(&self, azimuth: f32) -> Vec3 {
        let (_, half) = self.middle_and_half();
        let level = Vec3::new(libm::cosf(azimuth) * half.x, libm::sinf(azimuth) * self.distal * half.y, 0.0);
        level.normalize_or(Vec3::X)
    }

    /// Returns the centre of the crown, at the height of the origin.
    pub fn middle(&self) -> Vec3 {
        self.middle_and_half().0
    }

    fn middle_and_half(&self) -> (Vec3, Vec3) {
        (self.crown.centre().with_z(0.0), self.crown.half_size().with_z(1.0))
    }

    /// Returns the height of the cemento-enamel junction.
    pub fn neckline(&self, azimuth: f32) -> f32 {
        let at = wrap_angle(azimuth) / (2.0 * PI) * AZIMUTH_STEPS as f32 + AZIMUTH_STEPS as f32;
        let (before, part) = (at as usize, at.fract());
        let [a, b] = [before, before + 1].map(|i| self.neckline[i % AZIMUTH_STEPS]);
        a + (b - a) * part
    }

    /// Returns the height of the gingival margin.
    pub fn margin(&self, azimuth: f32) -> f32 {
        self.neckline(azimuth) - between_sites(&self.pockets.recession, azimuth)
    }

    /// Returns the height of the floor of the sulcus or pocket.
    pub fn floor(&self, azimuth: f32) -> f32 {
        self.margin(azimuth) - between_sites(&self.pockets.depth, azimuth)
    }

    /// Returns the height of the crest of the bone.
    pub fn bone(&self, azimuth: f32) -> f32 {
        self.floor(azimuth) - ATTACHMENT
    }

    /// Returns the height of the lowest point of the floor.
    pub fn lowest_floor(&self) -> f32 {
        (0..AZIMUTH_STEPS).map(|i| self.floor(azimuth_of_step(i))).fold(f32::INFINITY, f32::min)
    }

    /// Returns the depth of a point in the sulcus, mm, measured along a shaft that points from there toward the handle;
    /// negative above the margin.
    pub fn depth_along(&self, place: Vec3, shaft: Vec3) -> f32 {
        // Limit for the inclination: a nearly horizontal shaft would give an arbitrary depth.
        const STEEP: f32 = 0.5;
        (self.margin(self.azimuth(place)) - place.z) / shaft.z.max(STEEP)
    }

    /// Returns the signed distance from the tooth's surface to a point, mm; negative inside. It is accurate to 0.05 mm
    /// beside the gingiva; elsewhere it does not exceed the true distance.
    pub fn distance_to_tooth(&self, point: Vec3) -> f32 {
        let Aabb { low, high } = self.grid.extent();
        let inside = point.clamp(low, high);
        self.grid.trilinear(&self.tooth_distances, inside) + point.distance(inside)
    }

    /// Returns the signed distance from the gingiva for a probe, mm, up to its outer border: the gingiva is displaced
    /// from the tooth by [`PROBING_GAP`].
    pub fn gum_sdf_probing(&self, point: Vec3) -> f32 {
        self.gum_sdf(point, PROBING_GAP, PROBING_EDGE)
    }

    /// Returns the signed distance from the visible gingiva, mm, which lies on the tooth.
    pub fn gum_sdf_visual(&self, point: Vec3) -> f32 {
        self.gum_sdf(point, VISUAL_GAP, VISUAL_EDGE)
    }

    /// Returns the signed distance from the gingiva as if the tooth were gingiva too, mm: its top continues through the
    /// tooth at the height of the margin. The displayed surface of the gingiva is derived from this.
    pub fn gum_sdf_filled(&self, point: Vec3) -> f32 {
        ((point.z - self.gum_height(point, VISUAL_EDGE)) * SLOPE).max(self.alveolar_ridge_sdf(point))
    }

    fn gum_sdf(&self, point: Vec3, open: f32, edge: MarginEdge) -> f32 {
        let below = (point.z - self.gum_height(point, edge)) * SLOPE;
        below.max(open - self.distance_to_tooth(point)).max(self.alveolar_ridge_sdf(point))
    }

    /// Returns the signed distance from the alveolar ridge, a rounded wall along the arch, mm.
    fn alveolar_ridge_sdf(&self, point: Vec3) -> f32 {
        /// Extent beyond the crown toward buccal and lingual, radius of the edge, and height of the ridge above the
        /// margin, mm.
        const BEYOND: f32 = 1.5;
        const ROUND: f32 = 4.0;
        const OVER: f32 = 0.9;
        let (middle, half) = self.middle_and_half();
        let top =
            ProbingSite::ALL.map(|site| self.margin(site.azimuth())).into_iter().fold(f32::NEG_INFINITY, f32::max)
                + OVER;
        let aside = (point.x - middle.x).abs() - (half.x + BEYOND - ROUND);
        let over = point.z - (top - ROUND);
        libm::hypotf(aside.max(0.0), over.max(0.0)) + aside.max(over).min(0.0) - ROUND
    }

    /// Returns the height of the top of the gingiva at a point: a rounded margin that descends toward buccal and
    /// lingual, and a papilla that rises toward the contacts.
    fn gum_height(&self, point: Vec3, edge: MarginEdge) -> f32 {
        /// Radius of the descent, mm.
        const ROUND: f32 = 2.2;
        /// Height of a papilla above the margin, and the distance over which it rises, mm.
        const PAPILLA: f32 = 0.9;
        const RISE: f32 = 1.2;
        /// Half-width of a papilla's ridge, as a share of the crown's, and radius of its descent to cheek and tongue, mm.
        const RIDGE: f32 = 0.6;
        const PAPILLA_ROUND: f32 = 1.5;
        let azimuth = self.azimuth(point);
        let margin = self.margin(azimuth);
        let aside = (self.distance_to_tooth(point.with_z(margin)) - VISUAL_GAP).max(0.0);
        let (cheekward, mesiodistal) = (libm::cosf(azimuth), libm::sinf(azimuth));
        let falls = (aside - edge.thickness).max(0.0);
        let falls = edge.slope * falls + falls * falls / ROUND;
        let share = (aside / RISE).clamp(0.0, 1.0);
        let papilla = PAPILLA * share * share * (3.0 - 2.0 * share);
        // A papilla exists only between two teeth.
        let between = mesiodistal * mesiodistal * mesiodistal * mesiodistal;
        let (middle, half) = self.middle_and_half();
        let papilla = if edge.has_round_papillae {
            let beyond_ridge = ((point.x - middle.x).abs() - RIDGE * half.x).max(0.0);
            papilla - share * (beyond_ridge * beyond_ridge / PAPILLA_ROUND).min(6.0)
        } else {
            papilla
        };
        margin - falls.min(6.0) * cheekward * cheekward + papilla * between
    }

    /// Returns the signed distance from the attachment that closes the sulcus, mm.
    pub fn attachment_sdf(&self, point: Vec3) -> f32 {
        /// Extent under the gingiva and downward, mm: beyond the reach of any instrument.
        const UNDER: f32 = 0.4;
        const DOWN: f32 = 3.0;
        let floor = self.floor(self.azimuth(point));
        (point.z - floor).max(self.distance_to_tooth(point) - PROBING_GAP - UNDER).max(floor - DOWN - point.z)
    }
}

fn azimuth_of_step(step: usize) -> f32 {
    2.0 * PI * step as f32 / AZIMUTH_STEPS as f32
}

/// Returns an equivalent angle within −π to π.
fn wrap_angle(angle: f32) -> f32 {
    angle - (angle / (2.0 * PI)).round() * 2.0 * PI
}

/// Interpolates between the two sites on either side of an azimuth, with a slope of 0 at the sites, so that no value
/// between two sites exceeds both.
fn between_sites(values: &SiteLengths, azimuth: f32) -> f32 {
    // Indices of the sites in the order of their azimuths, around the tooth from lingual over mesial.
    const ROUND: [usize; 7] = [4, 3, 0, 1, 2, 5, 4];
    let wrapped_azimuth = wrap_angle(azimuth);
    let angle = |place: usize| if place == 0 { -PI } else { ProbingSite::ALL[ROUND[place]].azimuth() };
    let place = (0..6).rev().find(|&place| angle(place) <= wrapped_azimuth).unwrap_or(0);
    let (from, to) = (angle(place), if place == 5 { PI } else { angle(place + 1) });
    let share = ((wrapped_azimuth - from) / (to - from)).clamp(0.0, 1.0);
    let (a, b) = (values[ROUND[place]], values[ROUND[place + 1]]);
    a + (b - a) * share * share * (3.0 - 2.0 * share)
}

/// Returns the height of the lowest enamel around the tooth, smoothed over some degrees to remove the steps of voxels.
fn neckline(tooth: &ToothContext) -> [f32; AZIMUTH_STEPS] {
    /// Number of steps on either side over which heights are averaged.
    const AROUND: i32 = 4;
    let ToothContext { volume, enamel, crown, distal } = *tooth;
    let (middle, half) = (crown.centre(), crown.half_size());
    let grid = volume.grid();
    let mut lowest = [f32::INFINITY; AZIMUTH_STEPS];
    for (index, _) in volume.tissues().enumerate().filter(|(_, label)| *label == enamel) {
        let at = (grid.centre(grid.cell(index)) - middle) / half;
        let turn = wrap_angle(libm::atan2f(at.y * distal, at.x)) / (2.0 * PI) * AZIMUTH_STEPS as f32;
        let step = (turn.round() as i32).rem_euclid(AZIMUTH_STEPS as i32) as usize;
        let height = grid.centre(grid.cell(index)).z;
        lowest[step] = lowest[step].min(height);
    }
    // A side without enamel takes the mean height of the other sides.
    let known = lowest.iter().copied().filter(|z| z.is_finite());
    let (sum, count) = known.fold((0.0, 0u32), |(sum, count), z| (sum + z, count + 1));
    let mean = if count > 0 { sum / count as f32 } else { crown.low.z };
    lowest.iter_mut().filter(|z| !z.is_finite()).for_each(|z| *z = mean);
    std::array::from_fn(|i| {
        let near = (-AROUND..=AROUND).map(|by| lowest[(i as i32 + by).rem_euclid(AZIMUTH_STEPS as i32) as usize]);
        near.sum::<f32>() / (2 * AROUND + 1) as f32
    })
}

/// Returns the signed distance from a volume's surface to each point of a grid, mm, more accurate than its samples:
/// from the nearest sample inside and the depth of that sample.
fn distances_to_tooth(volume: &Volume, grid: &Grid) -> Vec<f32> {
    let density: Vec<f32> = grid.cells().map(|cell| volume.density_at(grid.centre(cell))).collect();
    let depth = |i: usize| (density[i] - ISO) * 2.0 * volume.half_band();
    let (mut away, nearest) = distance::to_nearest(grid, |i| density[i] >= ISO);
    for (i, away) in away.iter_mut().enumerate() {
        *away = match *away {
            far if far.is_infinite() => FAR,
            far => far - depth(nearest[i] as usize),
        };
    }
    away
}

/// Distance assigned if the volume is empty, mm.
const FAR: f32 = 100.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{TissueLabels, grid_of_spacing, grow, teeth};

    const TISSUES: TissueLabels = TissueLabels { enamel: Label(1), dentine: Label(2), pulp: Label(3) };

    fn tooth(fdi: u8) -> (Volume, Aabb) {
        let form = teeth::tooth(fdi).unwrap();
        let volume = grow(&form, grid_of_spacing(&form, 0.2), &TISSUES);
        let grid = *volume.grid();
        let enamel = volume.tissues().enumerate().filter(|(_, l)| *l == TISSUES.enamel);
        let crown = Aabb::around(enamel.map(|(i, _)| grid.centre(grid.cell(i))));
        (volume, crown)
    }

    #[test]
    fn each_site_has_its_own_depth_and_between_two_it_changes_without_a_step() {
        let pockets = Pockets { depth: [6.0, 2.0, 4.0, 3.0, 1.0, 8.0], recession: [0.0; 6] };
        let (volume, crown) = tooth(36);
        let gum =
            Periodontium::around(&ToothContext { volume: &volume, enamel: Label(1), crown, distal: 1.0 }, pockets);
        for (site, depth) in ProbingSite::ALL.into_iter().zip(pockets.depth) {
            let turn = site.azimuth();
            assert!((gum.margin(turn) - gum.floor(turn) - depth).abs() < 1e-4, "{site:?}");
            assert_eq!(ProbingSite::nearest(gum.azimuth(gum.middle() + gum.outward(turn) * 5.0)), site);
        }
        let steps: Vec<f32> = (0..=720).map(|i| gum.floor(i as f32 * PI / 360.0)).collect();
        let widest = steps.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f32::max);
        assert!(widest < 0.15, "half a degree changes the floor by {widest} mm");
    }

    #[test]
    fn a_probe_finds_room_down_to_the_floor_and_none_below() {
        // Aim: the sulcus is a cleft that ends at its floor. Method: points 0.4 mm from the root, all around, above and
        // below the floor.
        for (fdi, distal) in [(36, 1.0), (11, 1.0), (46, -1.0)] {
            let (volume, crown) = tooth(fdi);
            let standing = ToothContext { volume: &volume, enamel: Label(1), crown, distal };
            let pockets = Pockets { depth: [4.0, 3.0, 4.0, 4.0, 3.0, 5.0], recession: [-1.0; 6] };
            let gum = Periodontium::around(&standing, pockets);
            for site in ProbingSite::ALL {
                let (turn, out) = (site.azimuth(), gum.outward(site.azimuth()));
                let place = |z: f32| {
                    let at = |i: u32| (gum.middle() + out * (12.0 - 0.02 * i as f32)).with_z(z);
                    (0..600).map(at).find(|p| gum.distance_to_tooth(*p) < 0.4).unwrap()
                };
                for z in [gum.margin(turn) - 0.3, gum.floor(turn) + 0.4] {
                    let at = place(z);
                    assert!(
                        gum.gum_sdf_probing(at) > 0.2,
                        "{fdi} {site:?}: {} from the gum at {z}",
                        gum.gum_sdf_probing(at)
                    );
                    assert!(gum.attachment_sdf(at) > 0.2, "{fdi} {site:?}: {}", gum.attachment_sdf(at));
                }
                // The top of the gingiva is round; further down it is a wall.
                let outside = place(gum.floor(turn) + 0.4) + out;
                assert!(
                    gum.gum_sdf_probing(outside) < 0.0,
                    "{fdi} {site:?}: {} from the gum outside",
                    gum.gum_sdf_probing(outside)
                );
                let at = place(gum.floor(turn) - 0.5);
                assert!(gum.attachment_sdf(at) < 0.0, "{fdi} {site:?}: {}", gum.attachment_sdf(at));
            }
        }
    }
}
