//! Where the teeth of one jaw stand.
//!
//! *Arch space*: x to the patient's left in the lower jaw and to the right in the upper one, y back from the edges of the
//! central incisors, z occlusal, 0 on the plane through the incisors' edges; right-handed, mm. Both jaws have such a space of
//! their own.

use super::teeth::Model;
use crate::anatomy::{self, girth::Girth};
use crate::frame::{Pose, Quat, Vec3};

/// A jaw's shape.
#[derive(Clone, Copy, Debug)]
pub struct Form {
    /// Between the middles of the second molars.
    pub width: f32,
    /// How far back the second molars' middles lie; `None`: as the teeth's widths ask for.
    pub depth: Option<f32>,
    /// How far the curve of Spee leaves the plane between canine and second molar; negative where it bulges occlusally.
    pub spee: f32,
}

/// Widths between the second molars' middles that put the middles of the first molars' cheek faces apart as measured, 57.9 mm
/// above and 54.2 mm below (Mina and others, *Odontology* 105, 2017), and with how far canines stand out their tips, 34 and 26 mm, to
/// 5 %. Those people's teeth were wider than the table's, so the arches stay 10 to 17 % less deep than theirs. Spee's curve: 1.5 mm in untreated adults, as a
/// round figure of many authors; the upper jaw follows the lower.
pub const UPPER: Form = Form { width: 54.0, depth: None, spee: -1.4 };
pub const LOWER: Form = Form { width: 50.3, depth: None, spee: 1.4 };

/// One half of an arch, from the midline back.
#[derive(Clone, Debug)]
pub struct Half {
    pub seats: Vec<Seat>,
    /// Points of the line through the middles of all crowns, by way along it.
    line: Vec<[f32; 3]>,
}

/// Where one tooth stands.
#[derive(Clone, Copy, Debug)]
pub struct Seat {
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
}

impl Seat {
    /// The tooth's own space, upright but for its lean; its crown's top is over the middle of its seat.
    pub fn arch_from_tooth(&self) -> Pose {
        let level = Quat::from_mat3(&glam::Mat3::from_cols(self.buccal, self.distal, Vec3::Z));
        let orientation = (level * Quat::from_rotation_y(self.lean) * Quat::from_rotation_x(self.tip)).normalize();
        Pose { position: self.top - orientation * (Vec3::Z * self.crown), orientation }
    }

    pub fn middle(&self) -> f32 {
        0.5 * (self.from + self.to)
    }

    /// The middle of its neck.
    pub fn neck(&self) -> Vec3 {
        self.arch_from_tooth().position
    }
}

impl Half {
    /// Seats for teeth of these widths and models; the line fits the first seven.
    ///
    /// The line is the beta function of Braun et al. (1998): in an arch W wide and D deep a place x to the side lies
    /// 3.0314 · D · ((1/2 + x/W)(1/2 − x/W))^0.8 before the last molars' middles, which is D · (1 − (2x/W)²)^0.8. D follows from
    /// the teeth's widths.
    pub fn of(form: Form, teeth: &[(Model, f32)]) -> Half {
        let wanted: f32 = teeth.iter().take(7).map(|(_, width)| width).sum::<f32>() - 0.5 * teeth[6].1;
        let (mut low, mut high) = (15.0, 80.0);
        for _ in 0..24 {
            let depth = 0.5 * (low + high);
            if length(&curve(form.width, depth)) < wanted { low = depth } else { high = depth }
        }
        let depth = form.depth.unwrap_or(0.5 * (low + high));
        let line = measured(&curve(form.width, depth));
        let mut half = Half { seats: Vec::new(), line };
        let girths: Vec<Girth> =
            teeth.iter().map(|(model, _)| Girth::of(&anatomy::Form { sizes: model.sizes, ..model.form })).collect();
        let mut middles: Vec<f32> = Vec::new();
        for (i, (model, width)) in teeth.iter().enumerate() {
            // Each tooth goes back until it just touches the one before it, the first until it touches its twin.
            let (mut near, mut far) = match middles.last() {
                None => (0.2 * width, 0.9 * width),
                Some(before) => (before + 0.25 * (width + teeth[i - 1].1), before + 0.8 * (width + teeth[i - 1].1)),
            };
            for _ in 0..12 {
                let way = 0.5 * (near + far);
                let seat = half.seat_at(form, model, *width, way);
                let gap = match half.seats.last() {
                    None => to_twin(&girths[0], &seat),
                    Some(before) => between_two(&girths[i - 1], before, &girths[i], &seat),
                };
                if gap < TOUCH { near = way } else { far = way }
            }
            let way = 0.5 * (near + far);
            middles.push(way);
            let seat = half.seat_at(form, model, *width, way);
            half.seats.push(seat);
        }
        half.share_out(&middles);
        half
    }

    /// A tooth whose middle lies so far along the line, turned as the line runs from its mesial to its distal end.
    fn seat_at(&self, form: Form, model: &Model, width: f32, way: f32) -> Seat {
        let [mesial, behind] = [way - 0.5 * width, way + 0.5 * width].map(|way| self.place(way));
        let distal = (behind - mesial).normalize_or(Vec3::Y);
        let buccal = distal.cross(Vec3::Z);
        let place = 0.5 * (mesial + behind) + buccal * model.out;
        let (sin, cos) = (libm::sinf(model.turn.to_radians()), libm::cosf(model.turn.to_radians()));
        let (distal, buccal) = (distal * cos - buccal * sin, buccal * cos + distal * sin);
        let top = Vec3::new(place.x, place.y, -model.short - spee(form, self, way));
        let (from, to) = (way - 0.5 * width, way + 0.5 * width);
        Seat {
            from,
            to,
            top,
            distal,
            buccal,
            crown: model.sizes.crown - model.form.aged.map_or(0.0, |aged| aged.off_crown(&model.form)),
            lean: model.lean.to_radians(),
            tip: model.tip.to_radians(),
        }
    }

    /// What lies between two teeth's middles belongs to both by their widths.
    fn share_out(&mut self, middles: &[f32]) {
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
    pub fn at(&self, way: f32) -> (Vec3, Vec3) {
        /// The way is taken over a tooth's width or so: the beta function bends sharply where it ends, gum does not. mm
        const BEND: f32 = 3.0;
        (self.place(way), (self.place(way + BEND) - self.place(way - BEND)).normalize_or(Vec3::Y))
    }

    /// A point of the line; straight on behind its end, and on the other side before its beginning.
    fn place(&self, way: f32) -> Vec3 {
        if way < 0.0 {
            return self.place(-way) * Vec3::new(-1.0, 1.0, 1.0);
        }
        let after = self.line.partition_point(|p| p[2] <= way).max(1);
        let Some(&[bx, by, b]) = self.line.get(after) else {
            let [x, y, end] = self.line[self.line.len() - 1];
            return Vec3::new(x, y + way - end, 0.0);
        };
        let [ax, ay, a] = self.line[after - 1];
        let part = (way - a) / (b - a).max(1e-6);
        Vec3::new(ax + (bx - ax) * part, ay + (by - ay) * part, 0.0)
    }

    /// Way along the line to the last tooth's end.
    pub fn length(&self) -> f32 {
        self.seats.last().map_or(0.0, |seat| seat.to)
    }
}

/// Room between two crowns that touch, mm: what is grown later is good to a few hundredths, and they must not overlap.
const TOUCH: f32 = 0.04;

/// Least distance between two crowns' sides, mm; negative where they overlap.
fn between_two(mesial: &Girth, before: &Seat, distal: &Girth, after: &Seat) -> f32 {
    let (before, after) = (before.arch_from_tooth(), after.arch_from_tooth());
    let [before_from_after, after_from_before] = [before.inverse() * after, after.inverse() * before];
    // Only sides that face each other.
    let faces = |p: &Vec3, way: f32| p.y * way > 0.3 * p.with_z(0.0).length();
    let ahead = mesial.places().filter(|p| faces(p, 1.0)).map(|p| distal.outside(after_from_before * p));
    let back = distal.places().filter(|p| faces(p, -1.0)).map(|p| mesial.outside(before_from_after * p));
    ahead.chain(back).fold(f32::INFINITY, f32::min)
}

/// Between a front tooth and its mirror image beyond the midline, mm.
fn to_twin(girth: &Girth, seat: &Seat) -> f32 {
    let arch_from_tooth = seat.arch_from_tooth();
    2.0 * girth.places().map(|p| (arch_from_tooth * p).x).fold(f32::INFINITY, f32::min)
}

/// How far a place of the arch lies below the plane through the incisors.
fn spee(form: Form, half: &Half, way: f32) -> f32 {
    let [_, _, end] = half.line.last().copied().unwrap_or_default();
    let share = ((way - 0.25 * end) / (0.75 * end)).clamp(0.0, 1.2);
    form.spee * 4.0 * share * (1.0 - share)
}

/// Points of the beta function, from the midline to the last molar.
fn curve(width: f32, depth: f32) -> Vec<[f32; 2]> {
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

fn length(curve: &[[f32; 2]]) -> f32 {
    curve.windows(2).map(|p| libm::hypotf(p[1][0] - p[0][0], p[1][1] - p[0][1])).sum()
}

/// The same points with the way to each.
fn measured(curve: &[[f32; 2]]) -> Vec<[f32; 3]> {
    let mut way = 0.0;
    let mut before = curve[0];
    let step = |&[x, y]: &[f32; 2]| {
        way += libm::hypotf(x - before[0], y - before[1]);
        before = [x, y];
        [x, y, way]
    };
    curve.iter().map(step).collect()
}

#[cfg(test)]
mod tests {
    use super::super::{crown, teeth};
    use super::*;
    use crate::mesh::Mesh;
    use crate::touch::Obstacle;

    fn half(form: Form, models: &[Model]) -> Half {
        let teeth: Vec<(Model, f32)> = models.iter().map(|m| (*m, m.sizes.mesiodistal[0])).collect();
        Half::of(form, &teeth)
    }

    /// Each crown's surface, arch space.
    fn crowns(half: &Half, models: &[Model]) -> Vec<(Mesh, Pose)> {
        let crown = |(model, seat): (&Model, &Seat)| (crown::crown(model).mesh, seat.arch_from_tooth());
        models.iter().zip(&half.seats).map(crown).collect()
    }

    #[test]
    fn neighbours_touch_and_none_overlaps_another_by_more_than_a_tenth() {
        // Aim: no gap and no overlap worth seeing, on what is drawn. Method: every corner of each crown against the next one's
        // closed surface; the first against its mirror image. Below the neck teeth are out of sight and out of touch.
        for (form, models) in [(UPPER, teeth::UPPER), (LOWER, teeth::LOWER)] {
            let half = half(form, &models);
            let crowns = crowns(&half, &models);
            for (i, pair) in crowns.windows(2).enumerate() {
                let [(a, arch_from_a), (b, arch_from_b)] = [&pair[0], &pair[1]];
                let least = |from: &Mesh, arch_from: &Pose, to: &Mesh, arch_to: &Pose| {
                    let obstacle = Obstacle::new(to).unwrap();
                    let to_from = arch_to.inverse() * *arch_from;
                    let places = from.positions.iter().filter(|p| p.z > 0.0).map(|p| to_from * *p);
                    places.filter(|p| p.z > 0.0).map(|p| obstacle.distance(p)).fold(f32::INFINITY, f32::min)
                };
                let gap = least(a, arch_from_a, b, arch_from_b).min(least(b, arch_from_b, a, arch_from_a));
                println!("{form:?} {i}: {gap:.3}");
                assert!((-0.1..0.3).contains(&gap), "{form:?}, teeth {} and {}: {gap} mm", i + 1, i + 2);
            }
            let (mesh, arch_from_tooth) = &crowns[0];
            let least = mesh.positions.iter().map(|p| (*arch_from_tooth * *p).x).fold(f32::INFINITY, f32::min);
            assert!((-0.05..0.15).contains(&least), "{form:?}: the midline is {least} mm off");
        }
    }

    #[test]
    fn teeth_stand_upright_along_the_arch() {
        for (form, models) in [(UPPER, teeth::UPPER), (LOWER, teeth::LOWER)] {
            let half = half(form, &models);
            assert!((half.seats[6].top.x - 0.5 * form.width).abs() < 1.5);
            for seat in &half.seats {
                assert!(seat.arch_from_tooth().is_sound() && seat.buccal.x > 0.0);
            }
        }
    }
}
