//! Positions of the teeth in one jaw.
//!
//! In arch space, mm; each half is laid out at x > 0.

use super::tooth_model::ToothModel;
use crate::crown_contour::CrownContour;
use typodont_core::frame::{Pose, Quat, Vec3};

/// A jaw's shape.
#[derive(Clone, Copy, Debug)]
pub struct ArchShape {
    /// Distance between the centres of the second molars, mm.
    pub width: f32,
    /// Distance from the incisors back to the centres of the second molars, mm; `None` to derive it from the teeth's
    /// widths.
    pub depth: Option<f32>,
    /// Depth of the curve of Spee between canine and second molar, mm; negative where the curve bulges occlusally.
    pub spee: f32,
}

/// Widths between the second molars' middles that put the middles of the first molars' cheek faces apart as measured, 57.9 mm
/// above and 54.2 mm below (Mina and others, *Odontology* 105, 2017), and with how far canines stand out the tips of those that are felt, 34 and 26 mm, to
/// 5 %. Those people's teeth were wider than the table's, so the arches stay 10 to 17 % less deep than theirs. Spee's curve: 1.5 mm in untreated adults, as a
/// round figure of many authors; the upper jaw follows the lower.
pub const UPPER: ArchShape = ArchShape { width: 54.0, depth: None, spee: -1.4 };
pub const LOWER: ArchShape = ArchShape { width: 50.3, depth: None, spee: 1.4 };

/// One half of an arch, from the midline back.
#[derive(Clone, Debug)]
pub struct HalfArch {
    pub seats: Vec<ToothSeat>,
    /// Points of the line through the middles of all crowns, by way along it.
    line: Vec<[f32; 3]>,
}

/// Position of one tooth in the arch.
#[derive(Clone, Copy, Debug)]
pub struct ToothSeat {
    /// Way along the arch from the midline to its mesial and distal contact.
    pub from: f32,
    pub to: f32,
    /// The highest place of its crown, above its middle.
    pub top: Vec3,
    /// Unit, from mesial to distal, level.
    pub distal: Vec3,
    /// Unit, toward cheek or lip, level.
    pub buccal: Vec3,
    /// Crown's length, mm, and its lean toward the cheek, rad.
    pub crown: f32,
    pub lean: f32,
    /// Its root's lean distally under the crown, rad.
    pub tip: f32,
    /// Further lean of a crown that is only drawn, about its neck, rad.
    drawn_lean: f32,
    /// True for a tooth that is felt, and therefore drawn as it is felt.
    pub is_felt: bool,
}

impl ToothSeat {
    /// The tooth's own space, upright but for its lean; its crown's top is over the middle of its seat.
    pub fn arch_from_tooth(&self) -> Pose {
        let level = Quat::from_mat3(&glam::Mat3::from_cols(self.buccal, self.distal, Vec3::Z));
        let orientation = (level * Quat::from_rotation_y(self.lean) * Quat::from_rotation_x(self.tip)).normalize();
        Pose { position: self.top - orientation * (Vec3::Z * self.crown), orientation }
    }

    /// The space of the crown that is drawn.
    pub fn arch_from_drawn(&self) -> Pose {
        let felt = self.arch_from_tooth();
        if self.is_felt {
            return felt;
        }
        Pose { orientation: (felt.orientation * Quat::from_rotation_y(self.drawn_lean)).normalize(), ..felt }
    }

    /// Moves a tooth that is felt to a pose in which it stands upright.
    pub fn place(&mut self, arch_from_tooth: Pose) {
        self.buccal = arch_from_tooth.rotate(Vec3::X);
        self.distal = arch_from_tooth.rotate(Vec3::Y);
        (self.lean, self.tip, self.is_felt) = (0.0, 0.0, true);
        self.top = arch_from_tooth * (Vec3::Z * self.crown);
    }

    pub fn middle(&self) -> f32 {
        0.5 * (self.from + self.to)
    }

    /// The middle of its neck.
    pub fn neck(&self) -> Vec3 {
        self.arch_from_tooth().position
    }
}

impl HalfArch {
    /// Seats for teeth of these widths and models; the line fits the first seven.
    ///
    /// The line is the beta function of Braun et al. (1998): in an arch W wide and D deep a place x to the side lies
    /// 3.0314 · D · ((1/2 + x/W)(1/2 − x/W))^0.8 before the last molars' middles, which is D · (1 − (2x/W)²)^0.8. D follows from
    /// the teeth's widths.
    pub fn new(shape: ArchShape, teeth: &[(ToothModel, f32)]) -> HalfArch {
        let wanted: f32 = teeth.iter().take(7).map(|(_, width)| width).sum::<f32>() - 0.5 * teeth[6].1;
        let (mut low, mut high) = (15.0, 80.0);
        for _ in 0..24 {
            let depth = 0.5 * (low + high);
            if polyline_length(&beta_curve(shape.width, depth)) < wanted { low = depth } else { high = depth }
        }
        let depth = shape.depth.unwrap_or(0.5 * (low + high));
        let line = with_arc_length(&beta_curve(shape.width, depth));
        let mut half = HalfArch { seats: Vec::new(), line };
        let girths: Vec<CrownContour> =
            teeth.iter().map(|(model, _)| CrownContour::of(&model.form_in_place())).collect();
        let mut middles: Vec<f32> = Vec::new();
        for (i, (model, width)) in teeth.iter().enumerate() {
            // Each tooth goes back until it just touches the one before it, the first until it touches its twin.
            let (mut near, mut far) = match middles.last() {
                None => (0.2 * width, 0.9 * width),
                Some(before) => (before + 0.25 * (width + teeth[i - 1].1), before + 0.8 * (width + teeth[i - 1].1)),
            };
            for _ in 0..12 {
                let arc_length = 0.5 * (near + far);
                let seat = half.position_at(shape, model, *width, arc_length);
                let gap = match half.seats.last() {
                    None => midline_gap(&girths[0], &seat),
                    Some(before) => crown_gap(&girths[i - 1], before, &girths[i], &seat),
                };
                if gap < CONTACT_GAP { near = arc_length } else { far = arc_length }
            }
            let arc_length = 0.5 * (near + far);
            middles.push(arc_length);
            let seat = half.position_at(shape, model, *width, arc_length);
            half.seats.push(seat);
        }
        half.divide_arc(&middles);
        half
    }

    /// A tooth whose middle lies so far along the line, turned as the line runs from its mesial to its distal end.
    fn position_at(&self, shape: ArchShape, model: &ToothModel, width: f32, arc_length: f32) -> ToothSeat {
        let [mesial, behind] = [arc_length - 0.5 * width, arc_length + 0.5 * width].map(|way| self.point_at(way));
        let distal = (behind - mesial).normalize_or(Vec3::Y);
        let buccal = distal.cross(Vec3::Z);
        let place = 0.5 * (mesial + behind) + buccal * model.buccal_offset;
        let (sin, cos) = (libm::sinf(model.rotation.to_radians()), libm::cosf(model.rotation.to_radians()));
        let (distal, buccal) = (distal * cos - buccal * sin, buccal * cos + distal * sin);
        let top = Vec3::new(place.x, place.y, -model.infraocclusion - spee_depth(shape, self, arc_length));
        let (from, to) = (arc_length - 0.5 * width, arc_length + 0.5 * width);
        ToothSeat {
            from,
            to,
            top,
            distal,
            buccal,
            crown: model.sizes.crown - model.form.age_effects.map_or(0.0, |aged| aged.crown_wear(&model.form)),
            lean: model.lean.to_radians(),
            tip: model.tip.to_radians(),
            drawn_lean: model.drawn.lean.to_radians(),
            is_felt: false,
        }
    }

    /// Divides the arc between the centres of two neighbours in proportion to their widths.
    fn divide_arc(&mut self, middles: &[f32]) {
        let widths: Vec<f32> = self.seats.iter().map(|seat| seat.to - seat.from).collect();
        let mut from = 0.0;
        for (i, seat) in self.seats.iter_mut().enumerate() {
            let to = match middles.get(i + 1) {
                Some(next) => middles[i] + (next - middles[i]) * widths[i] / (widths[i] + widths[i + 1]),
                None => middles[i] + 0.5 * widths[i],
            };
            (seat.from, seat.to) = (from, to);
            from = to;
        }
    }

    /// The line's point and its way back, level, so far along it.
    pub fn frame_at(&self, arc_length: f32) -> (Vec3, Vec3) {
        /// The way is taken over a tooth's width or so: the beta function bends sharply where it ends, gum does not. mm
        const BEND: f32 = 3.0;
        (
            self.point_at(arc_length),
            (self.point_at(arc_length + BEND) - self.point_at(arc_length - BEND)).normalize_or(Vec3::Y),
        )
    }

    /// A point of the line; straight on behind its end, and on the other side before its beginning.
    fn point_at(&self, arc_length: f32) -> Vec3 {
        if arc_length < 0.0 {
            return self.point_at(-arc_length) * Vec3::new(-1.0, 1.0, 1.0);
        }
        let after = self.line.partition_point(|p| p[2] <= arc_length).max(1);
        let Some(&[bx, by, b]) = self.line.get(after) else {
            let [x, y, end] = self.line[self.line.len() - 1];
            return Vec3::new(x, y + arc_length - end, 0.0);
        };
        let [ax, ay, a] = self.line[after - 1];
        let part = (arc_length - a) / (b - a).max(1e-6);
        Vec3::new(ax + (bx - ax) * part, ay + (by - ay) * part, 0.0)
    }

    /// Way along the line to the last tooth's end.
    pub fn length(&self) -> f32 {
        self.seats.last().map_or(0.0, |seat| seat.to)
    }
}

/// Gap between two crowns that touch, mm: the crowns are accurate to a few hundredths, and must not overlap.
const CONTACT_GAP: f32 = 0.04;

/// Least distance between two crowns' sides, mm; negative where they overlap.
fn crown_gap(mesial: &CrownContour, before: &ToothSeat, distal: &CrownContour, after: &ToothSeat) -> f32 {
    let (before, after) = (before.arch_from_tooth(), after.arch_from_tooth());
    let [before_from_after, after_from_before] = [before.inverse() * after, after.inverse() * before];
    // Only sides that face each other.
    let faces = |p: &Vec3, way: f32| p.y * way > 0.3 * p.with_z(0.0).length();
    let ahead = mesial.points().filter(|p| faces(p, 1.0)).map(|p| distal.distance_outside(after_from_before * p));
    let back = distal.points().filter(|p| faces(p, -1.0)).map(|p| mesial.distance_outside(before_from_after * p));
    ahead.chain(back).fold(f32::INFINITY, f32::min)
}

/// Between a front tooth and its mirror image beyond the midline, mm.
fn midline_gap(girth: &CrownContour, seat: &ToothSeat) -> f32 {
    let arch_from_tooth = seat.arch_from_tooth();
    2.0 * girth.points().map(|p| (arch_from_tooth * p).x).fold(f32::INFINITY, f32::min)
}

/// Distance, mm, of a point of the arch below the plane through the incisors' edges.
fn spee_depth(shape: ArchShape, half: &HalfArch, arc_length: f32) -> f32 {
    let [_, _, end] = half.line.last().copied().unwrap_or_default();
    let share = ((arc_length - 0.25 * end) / (0.75 * end)).clamp(0.0, 1.2);
    shape.spee * 4.0 * share * (1.0 - share)
}

/// Points of the beta function, from the midline to the last molar.
fn beta_curve(width: f32, depth: f32) -> Vec<[f32; 2]> {
    const POINTS: usize = 240;
    let at = |i: usize| {
        let t = i as f32 / POINTS as f32;
        // Denser toward the end, where the curve turns straight back.
        let side = 1.0 - (1.0 - t) * (1.0 - t);
        let x = 0.5 * width * side;
        let y = depth * libm::powf((1.0 - side * side).max(0.0), 0.8);
        [x, depth - y]
    };
    (0..=POINTS).map(at).collect()
}

fn polyline_length(curve: &[[f32; 2]]) -> f32 {
    curve.windows(2).map(|p| libm::hypotf(p[1][0] - p[0][0], p[1][1] - p[0][1])).sum()
}

/// The same points with the way to each.
fn with_arc_length(curve: &[[f32; 2]]) -> Vec<[f32; 3]> {
    let mut arc_length = 0.0;
    let mut before = curve[0];
    let step = |&[x, y]: &[f32; 2]| {
        arc_length += libm::hypotf(x - before[0], y - before[1]);
        before = [x, y];
        [x, y, arc_length]
    };
    curve.iter().map(step).collect()
}

#[cfg(test)]
mod tests {
    use super::super::crown::{self, CrownDetail};
    use super::super::tooth_model;
    use super::*;
    use typodont_core::mesh::Mesh;
    use typodont_core::touch::ClosedMesh;

    fn half(form: ArchShape, models: &[ToothModel], is_felt: bool) -> HalfArch {
        let teeth: Vec<(ToothModel, f32)> = models.iter().map(|m| (*m, m.sizes.mesiodistal[0])).collect();
        let mut half = HalfArch::new(form, &teeth);
        half.seats.iter_mut().for_each(|seat| seat.is_felt = is_felt);
        half
    }

    /// Each crown's surface, arch space.
    fn crowns(half: &HalfArch, models: &[ToothModel]) -> Vec<(Mesh, Pose)> {
        let mesh = |model: &ToothModel, is_felt| crown::crown(model, is_felt, 0.0, CrownDetail::Far).mesh;
        let crown = |(model, seat): (&ToothModel, &ToothSeat)| (mesh(model, seat.is_felt), seat.arch_from_drawn());
        models.iter().zip(&half.seats).map(crown).collect()
    }

    #[test]
    fn neighbours_touch_and_hardly_overlap() {
        // Aim: no gap and no overlap worth seeing, on what is drawn. Method: every corner of each crown against the next one's
        // closed surface; the first against its mirror image. Below the neck teeth are out of sight and out of touch.
        let jaws = [(UPPER, tooth_model::UPPER), (LOWER, tooth_model::LOWER)];
        for ((form, models), is_felt) in jaws.into_iter().flat_map(|jaw| [(jaw, false), (jaw, true)]) {
            let half = half(form, &models, is_felt);
            let crowns = crowns(&half, &models);
            for (i, pair) in crowns.windows(2).enumerate() {
                let [(a, arch_from_a), (b, arch_from_b)] = [&pair[0], &pair[1]];
                let least = |from: &Mesh, arch_from: &Pose, to: &Mesh, arch_to: &Pose| {
                    let obstacle = ClosedMesh::new(to).unwrap();
                    let to_from = arch_to.inverse() * *arch_from;
                    let places = from.positions.iter().filter(|p| p.z > 0.0).map(|p| to_from * *p);
                    places.filter(|p| p.z > 0.0).map(|p| obstacle.distance(p)).fold(f32::INFINITY, f32::min)
                };
                let gap = least(a, arch_from_a, b, arch_from_b).min(least(b, arch_from_b, a, arch_from_a));
                println!("{form:?} {i}: {gap:.3}");
                // Canines that are only drawn are more upright than those that are felt, and lie a little in the lateral incisors.
                let overlap = if i == 1 && !is_felt { 0.25 } else { 0.1 };
                let name = format!("{form:?}, felt: {is_felt}, teeth {} and {}", i + 1, i + 2);
                assert!((-overlap..0.3).contains(&gap), "{name}: {gap} mm");
            }
            let (mesh, arch_from_crown) = &crowns[0];
            let least = mesh.positions.iter().map(|p| (*arch_from_crown * *p).x).fold(f32::INFINITY, f32::min);
            assert!((-0.05..0.15).contains(&least), "{form:?}: the midline is {least} mm off");
        }
    }

    #[test]
    fn teeth_stand_upright_along_the_arch() {
        for (form, models) in [(UPPER, tooth_model::UPPER), (LOWER, tooth_model::LOWER)] {
            let half = half(form, &models, true);
            assert!((half.seats[6].top.x - 0.5 * form.width).abs() < 1.5);
            for seat in &half.seats {
                assert!(seat.arch_from_tooth().is_valid() && seat.buccal.x > 0.0);
            }
        }
    }
}
