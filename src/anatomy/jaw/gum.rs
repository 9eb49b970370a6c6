//! The gingiva of one jaw, with the palate or the floor of the mouth, as one closed sheet over the alveolar ridge.
//!
//! The teeth pass through the sheet, so the gingival margin is the line in which the sheet meets them: low in the
//! middle of each tooth, high between two teeth.

use super::Jaw;
use super::half_arch::{HalfArch, ToothSeat};
use super::tinted_mesh::{Tint, TintedMesh, mixed_tint};
use super::tooth_model::ToothModel;
use crate::crown_contour::CrownContour;
use crate::periodontium::{ProbingSite, SiteLengths};
use std::ops::Range;
use typodont_core::frame::{Pose, Vec3, smooth_step};
use typodont_core::mesh::Mesh;
use typodont_core::parallel::par_map;

/// Form of the gingiva around the teeth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GumForm {
    /// As it is touched in an arch: by the widths of the teeth. Recordings are replayed in it, so it never changes.
    Touched,
    /// As it is drawn: margins lie on the teeth, and papillae have round tips.
    Drawn,
}

impl GumForm {
    /// Distance between columns along the arch, mm: a papilla is some 3 mm wide.
    fn column(self) -> f32 {
        match self {
            GumForm::Touched => 0.9,
            GumForm::Drawn => 0.5,
        }
    }

    /// Height of a papilla above the necks, as a share of the crowns' height: healthy gingiva fills the space up to a few millimetres below
    /// the contact.
    fn papilla_share(self) -> f32 {
        match self {
            GumForm::Touched => 0.42,
            GumForm::Drawn => 0.5,
        }
    }

    /// Length behind the last molar, mm: as it is drawn, the ridge goes on behind its pad, so that its end is out of sight, and the palate
    /// goes on into the throat.
    fn beyond(self, jaw: Jaw) -> f32 {
        match (self, jaw) {
            (GumForm::Touched, _) => PAD,
            (GumForm::Drawn, Jaw::Lower) => 2.0 * PAD,
            (GumForm::Drawn, Jaw::Upper) => 3.75 * PAD,
        }
    }
}

/// Means of normals over neighbouring places: creases between columns fade, the margin stays.
const SMOOTHING: usize = 4;

/// Number of times that drawn columns are smoothed along the arch.
const COLUMN_SMOOTHING: usize = 2;

/// Length of the tuberosity or retromolar pad behind the last molar, mm.
const PAD: f32 = 8.0;

/// Distance before the end of the last tooth, mm, from which tints go over into those of throat and cheeks.
const BEFORE_THROAT: f32 = 6.0;

/// Height of a jaw's flat base below the occlusal plane, mm.
const BASE: f32 = -27.0;

/// Height of the free gingiva above the neck in the middle of a tooth, mm.
const MARGIN: f32 = 0.6;

/// Part of a tooth on which margins and papillae lie, recession included, as shares of the crown above the neck.
const NECK_PART: Range<f32> = -0.45..0.8;

/// Distance from the space between two teeth at which both have sides, and depth of a papilla between these, mm. Farther away, a papilla
/// is the deeper.
const BESIDE_SPACE: f32 = 1.3;
const EMBRASURE: f32 = 0.35;

/// Half the width of a papilla that fills the space between two teeth, as a share of half the necks' width.
const BETWEEN_TEETH: f32 = 0.7;

/// Least distance of a column's places from the midline, as a share of its own.
const LEAST_INNER_X: f32 = 0.25;

/// Rows from the ridge's inner foot to the midline.
const INNER: usize = 12;

/// Height of the palate's vault below the occlusal plane (it is above it in the mouth), mm.
const VAULT: f32 = -20.5;

/// One half of a jaw to be covered.
pub struct HalfJaw<'a> {
    pub half: &'a HalfArch,
    pub models: &'a [ToothModel],
    /// Contours of the teeth where drawn gingiva lies on them; none for touched gingiva.
    pub necks: Vec<CrownContour>,
    /// Recession of the margin, mm.
    pub recession: SiteLengths,
    /// 1, or −1 to mirror this half to the other side.
    pub sign: f32,
}

/// Region of the mucosa over a jaw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MucosaRegion {
    /// Gingiva and alveolar mucosa on the ridge.
    Gingiva,
    Palate,
    FloorOfMouth,
}

/// Depth of a solid below the jaw's base, mm.
const SOLID_BASE: f32 = BASE - 1.0;

/// Contours of teeth at the height of the gingival margin.
pub fn necks(models: &[ToothModel]) -> Vec<CrownContour> {
    par_map(models.len(), |i| CrownContour::of_part(&models[i].form_in_place(), NECK_PART))
}

/// The gingiva over both halves, in arch space, mm. `fit` may move each point.
pub fn gum(jaw: Jaw, sides: [HalfJaw; 2], form: GumForm, fit: impl Fn(Vec3) -> Vec3) -> TintedMesh {
    let mut columns = from_end_to_end(halves(jaw, &sides, form));
    if form == GumForm::Drawn {
        columns = smoothed_along_the_arch(columns);
    }
    for (place, _) in columns.iter_mut().flatten() {
        *place = fit(*place);
    }
    closed_sheet(&columns)
}

/// The touched surface as closed solids that meet without overlap, arch space, mm: of each half its ridge, and its palate or
/// its floor.
pub fn gum_solids(jaw: Jaw, sides: [HalfJaw; 2]) -> Vec<(MucosaRegion, Mesh)> {
    let inner = match jaw {
        Jaw::Upper => MucosaRegion::Palate,
        Jaw::Lower => MucosaRegion::FloorOfMouth,
    };
    let mut solids = Vec::new();
    for (columns, side) in halves(jaw, &sides, GumForm::Touched).iter().zip(&sides) {
        let rows = columns.first().map_or(0, Vec::len);
        // Palate and floor begin at the last place but one of the ridge's section; between two places there is another.
        let border = rows - INNER - 3;
        for (region, rows) in [(MucosaRegion::Gingiva, 0..border + 1), (inner, border..rows)] {
            let part: Vec<Vec<Vec3>> =
                columns.iter().map(|column| column[rows.clone()].iter().map(|(place, _)| *place).collect()).collect();
            solids.push((region, solid_under(&part, side.sign < 0.0)));
        }
    }
    solids
}

/// The same columns, whose rows are lines without corners: each place half its own and half that of the columns beside it, [`COLUMN_SMOOTHING`] times.
fn smoothed_along_the_arch(mut columns: Vec<Vec<(Vec3, Tint)>>) -> Vec<Vec<(Vec3, Tint)>> {
    for _ in 0..COLUMN_SMOOTHING {
        let before = columns.clone();
        for (column, beside) in columns[1..].iter_mut().zip(before.windows(3)) {
            for (row, (place, tint)) in column.iter_mut().enumerate() {
                let [(a, tint_a), (b, tint_b)] = [beside[0][row], beside[2][row]];
                *place = *place * 0.5 + (a + b) * 0.25;
                *tint = mixed_tint(*tint, mixed_tint(tint_a, tint_b, 0.5), 0.5);
            }
        }
    }
    columns
}

/// Columns from behind to the midline, then from there back; the midline once.
pub(super) fn from_end_to_end<T>([left, right]: [Vec<T>; 2]) -> Vec<T> {
    left.into_iter().skip(1).rev().chain(right).collect()
}

/// Positions of columns along each half of the arch, mm, from the midline back: at a distance of about `spacing`, and as far behind the
/// last tooth of the longer half as `beyond`.
pub(super) fn column_positions(sides: &[HalfJaw; 2], spacing: f32, beyond: f32) -> [Vec<f32>; 2] {
    // Both sides end equally far back, also where one tooth is larger than its twin.
    let ends = sides.each_ref().map(|side| side.half.frame_at(side.half.length() + beyond).0.y);
    std::array::from_fn(|number| {
        let end = sides[number].half.length() + beyond + ends[0].max(ends[1]) - ends[number];
        let count = (end / spacing).ceil() as usize;
        (0..=count).map(|i| end * i as f32 / count as f32).collect()
    })
}

/// Columns of places from the midline back, for each half.
fn halves(jaw: Jaw, sides: &[HalfJaw; 2], form: GumForm) -> [Vec<Vec<(Vec3, Tint)>>; 2] {
    let positions = column_positions(sides, form.column(), form.beyond(jaw));
    std::array::from_fn(|number| {
        let side = &sides[number];
        let front = side.ridge(jaw, form, 0.0).pop().map_or(Vec3::ZERO, |row| row.0);
        par_map(positions[number].len(), |i| side.column(jaw, form, front, positions[number][i]))
    })
}

/// The solid between a sheet of places and a level below it, closed. Counter-clockwise seen from outside; `is_mirrored` for
/// a sheet at x < 0, whose columns run the other way.
fn solid_under(columns: &[Vec<Vec3>], is_mirrored: bool) -> Mesh {
    let mut mesh = Mesh::default();
    // Places of a column that coincide, as where it begins at the midline, are one corner.
    let corners: Vec<Vec<u32>> = columns
        .iter()
        .map(|column| {
            let mut own: Vec<u32> = Vec::with_capacity(column.len());
            for (row, place) in column.iter().enumerate() {
                match own.last() {
                    Some(&before) if column[row - 1] == *place => own.push(before),
                    _ => {
                        own.push(mesh.positions.len() as u32);
                        mesh.positions.push(*place);
                    }
                }
            }
            own
        })
        .collect();
    let count = mesh.positions.len() as u32;
    let below: Vec<Vec3> = mesh.positions.iter().map(|p| p.with_z(SOLID_BASE)).collect();
    mesh.positions.extend(below);
    let mut quad = |[a, b, c, d]: [u32; 4]| {
        for [a, b, c] in [[a, b, c], [a, c, d]] {
            if a != b && b != c && c != a {
                mesh.triangles.push(if is_mirrored { [a, c, b] } else { [a, b, c] });
            }
        }
    };
    let (last_column, last_row) = (columns.len() - 1, columns[0].len() - 1);
    for c in 0..last_column {
        for r in 0..last_row {
            let [a, b, d, e] = [corners[c][r], corners[c + 1][r], corners[c][r + 1], corners[c + 1][r + 1]];
            quad([a, b, e, d]);
            quad([d, e, b, a].map(|corner| corner + count));
        }
        for (r, is_first) in [(0, true), (last_row, false)] {
            let [a, b] = [corners[c][r], corners[c + 1][r]];
            let [a, b] = if is_first { [b, a] } else { [a, b] };
            quad([a, b, b + count, a + count]);
        }
    }
    for r in 0..last_row {
        for (c, is_first) in [(0, true), (last_column, false)] {
            let [a, d] = [corners[c][r], corners[c][r + 1]];
            let [a, d] = if is_first { [a, d] } else { [d, a] };
            quad([a, d, d + count, a + count]);
        }
    }
    mesh.compute_normals();
    mesh
}

impl HalfJaw<'_> {
    /// Places from the base's outer edge over the ridge to the midline, so far along the arch. `front`: the ridge's inner foot on
    /// the midline.
    fn column(&self, jaw: Jaw, form: GumForm, front: Vec3, arc_length: f32) -> Vec<(Vec3, Tint)> {
        let mut rows = subdivide(&self.ridge(jaw, form, arc_length));
        let (foot, tint) = rows[rows.len() - 1];
        for i in 1..=INNER {
            let share = i as f32 / INNER as f32;
            let bend = libm::sinf(share * std::f32::consts::FRAC_PI_2);
            let (x, y) = (foot.x * (1.0 - share), foot.y);
            let z = foot.z + (midline_height(jaw, front, y) - foot.z) * bend;
            let inner = match jaw {
                Jaw::Upper => PALATE,
                Jaw::Lower => FLOOR,
            };
            rows.push((Vec3::new(x, y, z + relief(jaw, front, x, y)), mixed_tint(tint, inner, 2.5 * share)));
        }
        // Behind the teeth it goes over into the mucosa of throat and cheeks, and above, the ridge into the soft palate.
        let behind = arc_length - self.half.length();
        let throat = smooth_step((behind + BEFORE_THROAT) / (PAD + BEFORE_THROAT));
        let sunk =
            if jaw == Jaw::Upper && form == GumForm::Drawn { smooth_step((behind - PAD) / (1.5 * PAD)) } else { 0.0 };
        rows.iter()
            .map(|&(p, tint)| {
                let z = p.z - sunk * (p.z - VAULT).max(0.0);
                (Vec3::new(p.x * self.sign, p.y, z), mixed_tint(mixed_tint(tint, THROAT, throat), SOFT_PALATE, sunk))
            })
            .collect()
    }

    /// The ridge's section, from cheek to tongue.
    fn ridge(&self, jaw: Jaw, form: GumForm, arc_length: f32) -> Vec<(Vec3, Tint)> {
        let (place, distal) = self.half.frame_at(arc_length);
        let out = distal.cross(Vec3::Z);
        let RidgeSection { neck, offset, half, margin, inner_margin, between_teeth: between, root, pad } =
            self.section(form, arc_length);
        let middle = place + out * offset;
        let shrink = 1.0 - 0.45 * pad * pad;
        let (wide, narrow) = (half * shrink, half * (1.0 - 0.3 * between) * shrink);
        let front = 1.0 - smooth_step((arc_length - 12.0) / 16.0);
        let crest = margin.max(inner_margin) - 0.25 * between;
        let mut rows = vec![
            (wide + 5.0, BASE, MUCOSA),
            (wide + 4.7, BASE + 4.0, MUCOSA),
            (wide + 4.0, neck - 11.0, MUCOSA),
            (wide + 3.1 + 0.4 * root, neck - MUCOSA_BELOW_NECK, MUCOSA),
            (wide + 2.2 + 0.8 * root, neck - LINE_BELOW_NECK, LINE),
            (wide + 1.5 + root, neck - ATTACHED_BELOW_NECK, ATTACHED),
        ];
        rows.extend(match form {
            GumForm::Touched => vec![
                (narrow + 0.95 + 0.5 * root, margin - 1.3, ATTACHED),
                (narrow + 0.42, margin - 0.25, FREE),
                (narrow - 0.35, margin + 0.05, FREE),
                (0.0, crest, FREE),
                (-narrow + 0.35, inner_margin + 0.05, FREE),
                (-narrow - 0.42, inner_margin - 0.25, FREE),
                (-narrow - 1.0, inner_margin - 1.3, ATTACHED),
            ],
            GumForm::Drawn => {
                // The margin lies on the tooth, and the papilla bridges the space between two with a round crest.
                let edge = |side: f32, height: f32| {
                    let on_tooth = self.distance_to_teeth(arc_length, side, height, wide + 2.5);
                    let bridge = self.bridge(arc_length, side, height, wide + 2.5);
                    smooth_max(on_tooth, bridge.max(BETWEEN_TEETH * wide))
                };
                let (outer, inner) = (edge(1.0, margin), edge(-1.0, inner_margin));
                // On a papilla there is no sulcus, and its sides rise without a step, which places between rows would make a lip.
                let [edge_tint, sulcus_tint] = [EDGE, SULCUS].map(|tint| mixed_tint(tint, FREE, between));
                let [first, last] = FREE_BELOW_MARGIN;
                vec![
                    (outer + 0.85 + 0.5 * root, attached_from(margin - between, neck), ATTACHED),
                    (outer + 0.55, margin - last - 0.7 * between, FREE),
                    (outer + 0.30, margin - first - 0.8 * between, FREE),
                    (outer + 0.04, margin - 0.6 * between, edge_tint),
                    (outer - 0.40, margin + 0.15 - 0.3 * between, sulcus_tint),
                    (outer - 1.10, crest, sulcus_tint),
                    (0.0, crest, FREE),
                    (1.10 - inner, crest, sulcus_tint),
                    (0.40 - inner, inner_margin + 0.15 - 0.3 * between, sulcus_tint),
                    (-inner - 0.04, inner_margin - 0.6 * between, edge_tint),
                    (-inner - 0.30, inner_margin - first - 0.8 * between, FREE),
                    (-inner - 0.55, inner_margin - last - 0.7 * between, FREE),
                    (-inner - 0.95, attached_from(inner_margin - between, neck), ATTACHED),
                ]
            }
        });
        // Behind the front teeth the palate rises gently, beside the molars steeply; below, the ridge falls to the floor.
        let gentle = |steep: [f32; 2], gentle: [f32; 2]| {
            let [a, z] = [0, 1].map(|i| steep[i] + (gentle[i] - steep[i]) * front);
            (-wide - a, neck - z)
        };
        let inner = match jaw {
            Jaw::Upper => {
                [gentle([1.6, 3.2], [2.2, 2.4]), gentle([2.8, 6.0], [4.4, 4.2]), gentle([4.4, 8.8], [6.8, 6.0])]
            }
            Jaw::Lower => {
                [gentle([1.6, 3.4], [1.6, 3.4]), gentle([2.3, 6.6], [2.2, 6.4]), gentle([2.6, 10.0], [2.8, 9.4])]
            }
        };
        let tints = match jaw {
            Jaw::Upper => [ATTACHED, PALATE, PALATE],
            Jaw::Lower => [ATTACHED, LINE, FLOOR],
        };
        rows.extend(inner.iter().zip(tints).map(|(&(aside, z), tint)| (aside, z, tint)));
        let place = |aside: f32, z: f32| {
            let point = middle + out * aside + Vec3::Z * (z - middle.z);
            match form {
                GumForm::Touched => point,
                // Around the bend in front, columns come together on the inner side, and must not cross.
                GumForm::Drawn => point.with_x(point.x.max(LEAST_INNER_X * middle.x)),
            }
        };
        rows.into_iter().map(|(aside, z, tint)| (place(aside, z), tint)).collect()
    }

    /// Distance from the middle of the ridge to the line between the sides of both teeth beside the nearest space, at a height, less the
    /// depth of a papilla, mm; 0 far from any space. `side` and `reach` as of [`HalfJaw::distance_to_teeth`].
    fn bridge(&self, arc_length: f32, side: f32, height: f32, reach: f32) -> f32 {
        let spaces = self.half.seats.iter().map(|seat| seat.from);
        let distance = |space: &f32| (arc_length - space).abs();
        let Some(space) =
            spaces.min_by(|a, b| distance(a).total_cmp(&distance(b))).filter(|s| distance(s) < 2.5 * BESIDE_SPACE)
        else {
            return 0.0;
        };
        let at = |end: f32| self.distance_to_teeth(end, side, height, reach);
        let share = ((arc_length - space) / BESIDE_SPACE).clamp(-1.0, 1.0);
        let side_here = match share {
            // On the midline, the other half's tooth is taken to be as this half's.
            _ if space < BESIDE_SPACE => at(space + BESIDE_SPACE),
            -1.0 => at(space - BESIDE_SPACE),
            1.0 => at(space + BESIDE_SPACE),
            _ => {
                let [a, b] = [at(space - BESIDE_SPACE), at(space + BESIDE_SPACE)];
                a + (b - a) * 0.5 * (1.0 + share)
            }
        };
        side_here - EMBRASURE - (distance(&space) - BESIDE_SPACE).max(0.0)
    }

    /// Distance from the middle of the ridge out to the side of the tooth here, at a height, mm; 0 between two teeth. `side`: 1 toward
    /// lip or cheek, −1 toward palate or tongue; looked for from `reach` inward.
    fn distance_to_teeth(&self, arc_length: f32, side: f32, height: f32, reach: f32) -> f32 {
        const STEP: f32 = 0.15;
        let seats = &self.half.seats;
        let (place, distal) = self.half.frame_at(arc_length);
        let out = distal.cross(Vec3::Z);
        let from = (place + out * self.section(GumForm::Drawn, arc_length).offset).with_z(height);
        let out = out * side;
        let here = seats.iter().position(|s| arc_length < s.to).unwrap_or(seats.len() - 1);
        let around = here.saturating_sub(1)..(here + 2).min(seats.len());
        let tooth_from_arch: Vec<Pose> = around.clone().map(|i| seats[i].arch_from_drawn().inverse()).collect();
        let distance = |way: f32| {
            let place = from + out * way;
            let of_tooth = |(i, pose): (usize, &Pose)| self.necks[i].distance_outside(*pose * place);
            around.clone().zip(&tooth_from_arch).map(of_tooth).fold(f32::INFINITY, f32::min)
        };
        let steps = (reach / STEP) as u32;
        let Some(first) = (0..steps).map(|i| reach - STEP * i as f32).find(|way| distance(*way) < 0.0) else {
            return 0.0;
        };
        let (mut inside, mut outside) = (first, first + STEP);
        for _ in 0..6 {
            let middle = 0.5 * (inside + outside);
            if distance(middle) < 0.0 { inside = middle } else { outside = middle }
        }
        outside
    }

    pub(super) fn section(&self, form: GumForm, arc_length: f32) -> RidgeSection {
        let seats = &self.half.seats;
        let neck_of = |seat: &ToothSeat| seat.neck().z;
        let offset_of = |seat: &ToothSeat| (seat.neck() - self.half.frame_at(seat.middle()).0).dot(seat.buccal);
        let half_of = |i: usize| 0.5 * self.models[i].sizes.buccolingual[1];
        let between_seats = |of: &dyn Fn(usize) -> f32| {
            let after = seats.iter().position(|s| s.middle() > arc_length).unwrap_or(seats.len());
            let (before, after) = (after.saturating_sub(1), after.min(seats.len() - 1));
            let (a, b) = (seats[before].middle(), seats[after].middle());
            of(before) + (of(after) - of(before)) * smooth_step((arc_length - a) / (b - a).max(1e-3))
        };
        let last = seats.len() - 1;
        let here = seats.iter().position(|s| arc_length < s.to).unwrap_or(last);
        let seat = &seats[here];
        let from_middle = ((arc_length - seat.middle()) / (0.5 * (seat.to - seat.from))).clamp(-1.0, 1.0);
        let between = match form {
            GumForm::Touched => libm::powf(from_middle.abs(), 2.4),
            // A scallop around each tooth, and a round tip between two.
            GumForm::Drawn => smooth_step(libm::powf(from_middle.abs(), 1.4)),
        };
        let over_root = match form {
            GumForm::Touched => 1.0 - from_middle * from_middle,
            // Without a crease between two roots, which would mirror the bright room.
            GumForm::Drawn => 0.55 * smooth_step(1.0 - from_middle.abs()),
        };
        let beside = if from_middle < 0.0 { here.saturating_sub(1) } else { (here + 1).min(last) };
        let papilla = if here == last && from_middle > 0.0 {
            neck_of(seat) + 1.2
        } else {
            0.5 * (neck_of(seat) + neck_of(&seats[beside]) + form.papilla_share() * (seat.crown + seats[beside].crown))
        };
        let behind = (arc_length - self.half.length()) / PAD;
        let pad = match form {
            GumForm::Touched => behind.clamp(0.0, 1.0),
            // The ridge goes on behind it without a kink.
            GumForm::Drawn => smooth_step(behind / 1.25),
        };
        let neck = between_seats(&|i| neck_of(&seats[i])) - 2.0 * pad * pad;
        let [buccal, lingual, beside] = [ProbingSite::Buccal, ProbingSite::Lingual, ProbingSite::MesioBuccal]
            .map(|site| self.recession[site as usize]);
        let risen = |low: f32, high: f32| low + (high - low) * between - 4.0 * pad * pad;
        RidgeSection {
            neck,
            offset: between_seats(&|i| offset_of(&seats[i])),
            half: between_seats(&half_of),
            margin: risen(neck_of(seat) + MARGIN - buccal, papilla - beside),
            inner_margin: risen(neck_of(seat) + MARGIN + 0.2 - lingual, papilla - 0.5 - beside),
            between_teeth: between,
            root: 0.6 * over_root * if here == 2 { 1.6 } else { 1.0 },
            pad,
        }
    }
}

/// The greater of two lengths, mm, with a round transition.
fn smooth_max(a: f32, b: f32) -> f32 {
    const ROUNDING: f32 = 0.3;
    0.5 * (a + b + ((a - b) * (a - b) + ROUNDING * ROUNDING).sqrt())
}

/// Section of the ridge at one point of the arch; lengths in mm.
pub(super) struct RidgeSection {
    /// Height of the necks.
    neck: f32,
    /// Distance of the necks from the line through the crowns, outward.
    pub offset: f32,
    /// Half the necks' width.
    pub half: f32,
    /// Height of the gingival margin, buccally and lingually.
    pub margin: f32,
    pub inner_margin: f32,
    /// 0 in the middle of a tooth, 1 between two.
    between_teeth: f32,
    /// Bulge of the ridge over a root.
    root: f32,
    /// 0 beside teeth, 1 at the end of the pad behind them.
    pad: f32,
}

/// Tints of the gingiva's colour: pale and stippled where it is attached to bone, smooth and redder where it is loose, dark in the
/// sulcus around a tooth.
const ATTACHED: Tint = Tint::stippled([1.0, 1.0, 1.0], 1.0);
const FREE: Tint = Tint::smooth([1.0, 0.94, 0.93]);
const EDGE: Tint = Tint::smooth([0.96, 0.86, 0.85]);
const SULCUS: Tint = Tint::smooth([0.84, 0.64, 0.63]);
const LINE: Tint = Tint::smooth([0.97, 0.87, 0.86]);
const MUCOSA: Tint = Tint::smooth([0.90, 0.70, 0.69]);
const PALATE: Tint = Tint::stippled([0.98, 0.96, 0.94], 0.4);
/// Mucosa of throat and cheeks behind the teeth.
const THROAT: Tint = Tint::smooth([0.80, 0.62, 0.60]);
/// Mucosa of the soft palate, where it goes over into that of the throat.
const SOFT_PALATE: Tint = Tint::smooth([0.70, 0.46, 0.45]);
const FLOOR: Tint = Tint::smooth([0.88, 0.68, 0.67]);

/// Heights below the gingival margin, mm, between which the gingiva is free.
const FREE_BELOW_MARGIN: [f32; 2] = [0.3, 0.8];

/// Heights below the neck of a tooth, mm, down to which gingiva is attached, and at which it ends and loose mucosa begins.
const ATTACHED_BELOW_NECK: f32 = 3.6;
const LINE_BELOW_NECK: f32 = 6.0;
const MUCOSA_BELOW_NECK: f32 = 8.5;

/// The same of the line and of the floor of the mouth on the inner side of the lower jaw.
const INNER_LINE_BELOW_NECK: f32 = 6.6;
const FLOOR_BELOW_NECK: f32 = 10.0;

/// Height from which gingiva is attached: above the next row, however far the margin has receded.
fn attached_from(margin: f32, neck: f32) -> f32 {
    (margin - 1.6).max(neck - 2.9)
}

/// Side of the ridge: toward the cheek, or toward palate or tongue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RidgeSide {
    Outer,
    Inner,
}

/// Tint at a height, mm, on a side of the ridge beside a tooth whose margin and neck lie at other heights: the tint that [`gum`] has
/// there beside teeth. `from_tooth`: distance from the tooth, mm; the margin is dark only where it lies on the tooth.
pub fn ridge_tint(jaw: Jaw, side: RidgeSide, height: f32, [margin, neck]: [f32; 2], from_tooth: f32) -> Tint {
    let edge = mixed_tint(EDGE, FREE, from_tooth / 0.4);
    let [first, last] = FREE_BELOW_MARGIN;
    let [line, lowest] = match (side, jaw) {
        (RidgeSide::Outer, _) => [(neck - LINE_BELOW_NECK, LINE), (neck - MUCOSA_BELOW_NECK, MUCOSA)],
        (RidgeSide::Inner, Jaw::Upper) => [(neck - LINE_BELOW_NECK, PALATE), (neck - MUCOSA_BELOW_NECK, PALATE)],
        (RidgeSide::Inner, Jaw::Lower) => [(neck - INNER_LINE_BELOW_NECK, LINE), (neck - FLOOR_BELOW_NECK, FLOOR)],
    };
    let rows = [
        (margin + first, FREE),
        (margin, edge),
        (margin - first, FREE),
        (margin - last, FREE),
        (attached_from(margin, neck), ATTACHED),
        (neck - ATTACHED_BELOW_NECK, ATTACHED),
        line,
        lowest,
    ];
    let mut above = rows[0];
    if height >= above.0 {
        return above.1;
    }
    for (row, tint) in rows {
        // A margin that has receded far lies below rows that depend on the neck: none is above the one before it.
        let row = row.min(above.0);
        if height >= row {
            return mixed_tint(tint, above.1, (height - row) / (above.0 - row).max(1e-6));
        }
        above = (row, tint);
    }
    above.1
}

/// Height on the midline.
fn midline_height(jaw: Jaw, front: Vec3, y: f32) -> f32 {
    match jaw {
        Jaw::Upper => front.z + (VAULT - front.z) * smooth_step((y - front.y) / 26.0),
        Jaw::Lower => front.z - 2.5 * smooth_step((y - front.y) / 12.0),
    }
}

/// Relief of the oral side, mm: rugae, raphe and incisive papilla of the palate; the frenulum below the tongue.
fn relief(jaw: Jaw, front: Vec3, x: f32, y: f32) -> f32 {
    let behind = y - front.y;
    let bell = |v: f32, width: f32| libm::expf(-(v / width) * (v / width));
    match jaw {
        Jaw::Upper => {
            let aside = x.abs();
            let mask = smooth_step(aside / 2.0) * (1.0 - smooth_step((aside - 7.0) / 4.0)) * smooth_step(behind / 2.0);
            let mask = mask * (1.0 - smooth_step((behind - 9.0) / 5.0));
            let folds = libm::sinf(std::f32::consts::TAU * (behind - 0.45 * aside + 0.3 * libm::sinf(aside)) / 4.0);
            0.4 * mask * folds
                + 0.25 * bell(x, 0.9) * smooth_step(behind / 4.0)
                + 0.9 * bell(x, 1.6) * bell(behind + 0.5, 2.4)
        }
        Jaw::Lower => 1.8 * bell(x, 1.0) * smooth_step(behind / 1.5) * (1.0 - smooth_step((behind - 5.0) / 8.0)),
    }
}

/// Twice as many places on a smooth line through them (Catmull–Rom).
fn subdivide(rows: &[(Vec3, Tint)]) -> Vec<(Vec3, Tint)> {
    let mut finer = Vec::with_capacity(2 * rows.len());
    for (i, &(place, tint)) in rows.iter().enumerate() {
        finer.push((place, tint));
        let Some(&(next, next_tint)) = rows.get(i + 1) else { break };
        let before = rows[i.saturating_sub(1)].0;
        let after = rows[(i + 2).min(rows.len() - 1)].0;
        finer.push(((place + next) * 0.5625 - (before + after) * 0.0625, mixed_tint(tint, next_tint, 0.5)));
    }
    finer
}

/// Columns of places from one end of the arch to the other, each from the outer side to the midline, as a sheet.
pub(super) fn open_sheet(columns: &[Vec<(Vec3, Tint)>]) -> TintedMesh {
    let mut made = TintedMesh::default();
    let rows = columns[0].len();
    for (place, tint) in columns.iter().flatten() {
        made.mesh.positions.push(*place);
        made.tints.push(*tint);
    }
    let mut strip = |corner: &dyn Fn(usize, usize) -> u32, columns: usize, rows: usize| {
        for c in 0..columns - 1 {
            for r in 0..rows - 1 {
                let [a, b, d, e] = [corner(c, r), corner(c + 1, r), corner(c, r + 1), corner(c + 1, r + 1)];
                made.mesh.triangles.extend([[a, b, d], [d, b, e]]);
            }
        }
    };
    strip(&|c, r| (c * rows + r) as u32, columns.len(), rows);
    made.mesh.compute_normals();
    made.mesh.smooth_normals(SMOOTHING);
    // On the midline both halves end alike.
    for c in 0..columns.len() {
        let normal = &mut made.mesh.normals[c * rows + rows - 1];
        *normal = Vec3::new(0.0, normal.y, normal.z).normalize_or(Vec3::Z);
    }
    made
}

/// Columns of places as one closed surface: the sheet, a flat base under it and a wall behind.
fn closed_sheet(columns: &[Vec<(Vec3, Tint)>]) -> TintedMesh {
    let mut made = open_sheet(columns);
    let rows = columns[0].len();
    let mut flat = |places: &dyn Fn(usize) -> [Vec3; 2], count: usize, normal: Vec3, tint: Tint| {
        let first = made.mesh.positions.len() as u32;
        for i in 0..count {
            made.mesh.positions.extend(places(i));
            made.mesh.normals.extend([normal; 2]);
            made.tints.extend([tint; 2]);
        }
        for i in 0..count as u32 - 1 {
            let [a, b, c, d] = [0, 1, 2, 3].map(|n| first + 2 * i + n);
            made.mesh.triangles.extend([[a, b, c], [c, b, d]]);
        }
    };
    let onto_base = |p: Vec3| Vec3::new(p.x, p.y, BASE);
    let base = |c: usize| [Vec3::new(0.0, columns[c][0].0.y, BASE), columns[c][0].0].map(onto_base);
    flat(&base, columns.len(), Vec3::NEG_Z, MUCOSA);
    let last = columns.len() - 1;
    for (column, is_first) in [(&columns[0], true), (&columns[last], false)] {
        let pair = |r: usize| {
            let [top, foot] = [column[r].0, onto_base(column[r].0)];
            if is_first { [foot, top] } else { [top, foot] }
        };
        flat(&pair, rows, Vec3::Y, THROAT);
    }
    made
}

#[cfg(test)]
mod tests {
    use super::super::{ArchPlan, DentalArch};
    use super::*;
    use typodont_core::touch::ClosedMesh;

    #[test]
    fn the_solids_of_the_mucosa_are_closed_and_lie_under_what_is_drawn() {
        // Aim: gum, palate and floor are felt where they are seen. Method: every solid is closed and faces outward, and each corner
        // of the drawn surface above the base lies on one of them, for straight and for turned teeth.
        let turned = ArchPlan { rotated: vec![(35, 30.0), (12, -20.0)], ..ArchPlan::default() };
        for (jaw, plan) in [(Jaw::Upper, ArchPlan::default()), (Jaw::Lower, ArchPlan::default()), (Jaw::Lower, turned)]
        {
            let arch = DentalArch::new(jaw, 7, None, &plan);
            let solids = arch.gum_solids();
            assert_eq!(solids.len(), 4);
            let mut closed = Vec::new();
            for (region, mesh) in &solids {
                assert!(mesh.volume_mm3() > 500.0, "{jaw:?} {region:?}: {} mm³", mesh.volume_mm3());
                closed.push(ClosedMesh::new(mesh).unwrap_or_else(|| panic!("{jaw:?} {region:?} is open")));
            }
            let drawn = arch.gum(GumForm::Touched, &|p| p).mesh;
            let top = drawn.positions.iter().filter(|p| p.z > BASE + 0.1);
            let worst = top
                .clone()
                .step_by(7)
                .map(|p| closed.iter().map(|solid| solid.distance(*p).abs()).fold(f32::INFINITY, f32::min));
            let worst = worst.fold(0.0, f32::max);
            assert!(worst < 0.01, "{jaw:?}: {worst} mm off");
        }
    }

    #[test]
    fn the_sides_of_a_drawn_papilla_rise_without_a_lip() {
        // Aim: nothing on a papilla hides what is behind it, which looks like a seam. Method: columns between two teeth, with the
        // places between rows, from the attached gingiva up to the edge on both sides.
        let (mut seen, form) = (0, GumForm::Drawn);
        for jaw in [Jaw::Upper, Jaw::Lower] {
            let arch = DentalArch::new(jaw, 7, None, &ArchPlan::default());
            let sides = arch.sides(form);
            let positions = column_positions(&sides, form.column(), form.beyond(jaw));
            for (side, positions) in sides.iter().zip(&positions) {
                for &position in positions.iter().filter(|p| (2.0..side.half.length() - 4.0).contains(*p)) {
                    if side.section(form, position).between_teeth < 0.8 {
                        continue;
                    }
                    let rows = subdivide(&side.ridge(jaw, form, position));
                    let heights: Vec<f32> = rows.iter().map(|(place, _)| place.z).collect();
                    // With the places between, of rows 6 to 10 of a section and of their counterparts inside, 14 to 18.
                    let (outer, inner) = (&heights[12..=20], &heights[28..=36]);
                    assert!(outer.windows(2).all(|pair| pair[1] > pair[0] - 0.02), "{jaw:?} at {position}: {outer:?}");
                    assert!(inner.windows(2).all(|pair| pair[1] < pair[0] + 0.02), "{jaw:?} at {position}: {inner:?}");
                    seen += 1;
                }
            }
        }
        assert!(seen > 60, "{seen} columns between teeth");
    }

    #[test]
    fn the_drawn_margin_is_a_line_without_corners() {
        // Aim: no corner in the highlight along the free gingiva. Method: the greatest angle, seen from above, between two neighbouring
        // parts of each outer row from the free gingiva to the margin, beside the teeth.
        let sharpest = |columns: &[Vec<(Vec3, Tint)>]| {
            let corner = |three: &[Vec<(Vec3, Tint)>], row: usize| {
                let [a, b, c] = [0, 1, 2].map(|i| three[i][row].0.with_z(0.0));
                (b - a).normalize().dot((c - b).normalize()).clamp(-1.0, 1.0)
            };
            let cosines = columns.windows(3).flat_map(|three| (14..=18).map(|row| corner(three, row)));
            libm::acosf(cosines.fold(1.0, f32::min)).to_degrees()
        };
        for jaw in [Jaw::Upper, Jaw::Lower] {
            let arch = DentalArch::new(jaw, 7, None, &ArchPlan::default());
            let columns = from_end_to_end(halves(jaw, &arch.sides(GumForm::Drawn), GumForm::Drawn));
            let rows = columns[0].len();
            let drawn = arch.gum(GumForm::Drawn, &|p| p);
            let places: Vec<(Vec3, Tint)> = drawn.mesh.positions.into_iter().zip(drawn.tints).collect();
            let smoothed: Vec<_> = places.chunks(rows).take(columns.len()).map(<[_]>::to_vec).collect();
            let behind = (GumForm::Drawn.beyond(jaw) / GumForm::Drawn.column()) as usize;
            let [before, after] =
                [&columns, &smoothed].map(|columns| sharpest(&columns[behind..columns.len() - behind]));
            println!("{jaw:?}: {before:.1}° and, smoothed, {after:.1}°");
            assert!(after < 25.0 && after < 0.6 * before, "{jaw:?}: {after}°, {before}° before");
        }
    }

    #[test]
    fn tints_beside_a_tooth_change_gradually_however_far_the_margin_has_receded() {
        // Aim: no step of colour, free gingiva at the margin's height away from the tooth, and mucosa far below. Method: steps of
        // 0.05 mm from above the margin down.
        for (jaw, side) in
            [(Jaw::Lower, RidgeSide::Outer), (Jaw::Lower, RidgeSide::Inner), (Jaw::Upper, RidgeSide::Inner)]
        {
            for recession in [-4.0, -1.0, 0.0, 1.0, 2.5, 4.0, 8.0] {
                let tint = |height: f32| ridge_tint(jaw, side, height, [-recession, 0.0], 1.0);
                assert_eq!(tint(-recession), FREE);
                let all: Vec<Tint> = (0..400).map(|i| tint(5.0 - 0.05 * i as f32)).collect();
                for pair in all.windows(2) {
                    let step = (0..3).map(|c| (pair[0].colour[c] - pair[1].colour[c]).abs()).fold(0.0, f32::max);
                    assert!(step < 0.05 || recession > 2.0 && step < 0.35, "{side:?}, recession {recession}: {pair:?}");
                }
                let lowest =
                    if side == RidgeSide::Outer { MUCOSA } else { [PALATE, FLOOR][usize::from(jaw == Jaw::Lower)] };
                assert_eq!(all[399], lowest);
            }
        }
    }
}
