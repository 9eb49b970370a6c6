//! Where the teeth of one jaw stand.
//!
//! *Arch space*: x to the patient's left in the lower jaw and to the right in the upper one, y back from the edges of the
//! central incisors, z occlusal, 0 on the plane through the incisors' edges; right-handed, mm. Both jaws have such a space of
//! their own.

use super::teeth::Model;
use crate::frame::{Pose, Quat, Vec3};

/// A jaw's shape.
#[derive(Clone, Copy, Debug)]
pub struct Form {
    /// Between the middles of the second molars.
    pub width: f32,
    /// How far the curve of Spee leaves the plane between canine and second molar; negative where it bulges occlusally.
    pub spee: f32,
}

/// Width between the second molars' middles: the cusp tips measured in S. Braun et al., *The form of the human dental arch*,
/// Angle Orthodontist 68 (1998), less the way from tip to middle. Spee's curve: 1.5 mm in untreated adults, as a round
/// figure of many authors; the upper jaw follows the lower.
pub const UPPER: Form = Form { width: 51.5, spee: -1.4 };
pub const LOWER: Form = Form { width: 47.0, spee: 1.4 };

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
}

impl Seat {
    /// The tooth's own space, upright but for its lean; its crown's top is over the middle of its seat.
    pub fn arch_from_tooth(&self) -> Pose {
        let level = Quat::from_mat3(&glam::Mat3::from_cols(self.buccal, self.distal, Vec3::Z));
        let orientation = (level * Quat::from_rotation_y(self.lean)).normalize();
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
        let line = measured(&curve(form.width, 0.5 * (low + high)));
        let mut half = Half { seats: Vec::new(), line };
        let mut from = 0.0;
        for (model, width) in teeth {
            let to = from + width;
            // From contact to contact, so that neighbours meet however the line bends.
            let [mesial, behind] = [from, to].map(|way| half.place(way));
            let (place, distal) = (0.5 * (mesial + behind), (behind - mesial).normalize_or(Vec3::Y));
            let z = -model.short - spee(form, &half, 0.5 * (from + to));
            let top = Vec3::new(place.x, place.y, z);
            let buccal = distal.cross(Vec3::Z);
            let seat = Seat { from, to, top, distal, buccal, crown: model.sizes.crown, lean: model.lean.to_radians() };
            half.seats.push(seat);
            from = to;
        }
        half
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
    use super::super::teeth;
    use super::*;

    #[test]
    fn teeth_stand_in_contact_along_the_arch() {
        // Aim: no gap and no overlap worth seeing. Method: the mesial and distal ends of neighbours, half their widths from
        // their middles, are one place but for the arch's bend.
        for (form, models) in [(UPPER, teeth::UPPER), (LOWER, teeth::LOWER)] {
            let teeth: Vec<(Model, f32)> = models.iter().map(|m| (*m, m.sizes.mesiodistal[0])).collect();
            let half = Half::of(form, &teeth);
            let level = |v: Vec3| Vec3::new(v.x, v.y, 0.0);
            for (pair, widths) in half.seats.windows(2).zip(teeth.windows(2)) {
                let a = level(pair[0].top + pair[0].distal * 0.5 * widths[0].1);
                let b = level(pair[1].top - pair[1].distal * 0.5 * widths[1].1);
                assert!(a.distance(b) < 0.25, "{a} {b}");
            }
            let first = half.seats[0].top;
            assert!((first.x - 0.5 * teeth[0].1).abs() < 0.5 && first.y < 2.0, "{first}");
            assert!((half.seats[6].top.x - 0.5 * form.width).abs() < 1.5);
            for seat in &half.seats {
                assert!(seat.arch_from_tooth().is_sound() && seat.buccal.x > 0.0);
            }
        }
    }
}
