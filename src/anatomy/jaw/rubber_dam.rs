//! A rubber dam: a sheet over one jaw, from which the isolated teeth stand out.
//!
//! Takes the halves of a jaw and which of its teeth are isolated. Gives a sheet in arch space, mm, that lies just above the gingival
//! margin of these teeth, covers the others, and rises toward its frame outside the mouth.

use super::gum::{GumForm, HalfJaw, column_positions, from_end_to_end, open_sheet};
use super::tinted_mesh::{Tint, TintedMesh};
use typodont_core::frame::{Vec3, smooth_step};

/// Distance between columns along the arch, and extent of the sheet behind the last tooth, mm.
const COLUMN: f32 = 0.6;
const BEYOND: f32 = 16.0;

/// Height above the gingival margin at which a tooth leaves the sheet, mm.
const OVER_MARGIN: f32 = 0.3;

/// Height of the sheet over covered teeth, above the occlusal plane, mm.
const OVER_CUSPS: f32 = 1.2;

/// Length along the arch in which the sheet rises from isolated to covered teeth, mm.
const RISE: f32 = 4.0;

/// Length behind the last tooth of the arch in which the sheet stays down under the clamp's bow, mm.
const UNDER_BOW: f32 = 12.0;

/// Distances beyond the necks of the rows on the outer side, mm.
const OUTER_ROWS: [f32; 11] = [30.0, 25.5, 21.0, 17.0, 13.0, 9.0, 6.0, 4.0, 2.4, 1.2, 0.3];

/// Height of the outermost of these rows, where the sheet leaves the mouth, mm.
const AT_LIPS: f32 = 6.0;

/// Rows in front of the lips, down to the frame: distance beyond the outermost row above, and below its height, mm.
const HANGING_ROWS: [[f32; 2]; 5] = [[3.5, 34.0], [3.2, 22.0], [2.8, 11.0], [2.0, 4.0], [1.0, 1.0]];

/// Rows on the inner side, up to the midline, and the height there, mm: over the tongue or the palate.
const INNER_ROWS: usize = 14;
const AT_MIDLINE: f32 = 1.5;

/// Least distance of the inner rows' beginning from the midline, as a share of the teeth's.
const LEAST_INNER_X: f32 = 0.35;

/// Least distance between two columns on the midline, mm.
const LEAST_STEP: f32 = 0.05;

/// The sheet over both halves. `is_isolated`: by side of x and place from the midline.
pub fn rubber_dam(sides: &[HalfJaw; 2], is_isolated: &dyn Fn(f32, usize) -> bool) -> TintedMesh {
    let positions = column_positions(sides, COLUMN, BEYOND);
    let is_down_at_midline = sides.iter().all(|side| is_isolated(side.sign, 0));
    let columns = std::array::from_fn(|number| {
        let side = &sides[number];
        let isolated = |index: usize| is_isolated(side.sign, index);
        // Around the bend in front, columns come together on the inner side, and must not cross.
        let mut front = f32::NEG_INFINITY;
        let column = |&position: &f32| {
            let column = side.dam_column(position, front, side.isolation(position, &isolated, is_down_at_midline));
            front = column.last().map_or(front, |(place, _)| place.y + LEAST_STEP);
            column
        };
        positions[number].iter().map(column).collect::<Vec<_>>()
    });
    open_sheet(&from_end_to_end(columns))
}

impl HalfJaw<'_> {
    /// Share by which the sheet is down at a position along the arch: 1 beside isolated teeth, 0 over others.
    /// `is_down_at_midline`: both front teeth are isolated, so that the sheet is down on the midline, too.
    fn isolation(&self, position: f32, is_isolated: &dyn Fn(usize) -> bool, is_down_at_midline: bool) -> f32 {
        let seats = &self.half.seats;
        let is_beside = |index: usize| index < seats.len() && is_isolated(index);
        let way_inside = |index: usize| {
            // Between two isolated teeth nothing rises.
            let before = match index {
                0 if is_down_at_midline => f32::INFINITY,
                0 => 0.0,
                _ if is_beside(index - 1) => RISE,
                _ => 0.0,
            };
            let behind = match index + 1 {
                next if next == seats.len() => UNDER_BOW,
                next if is_beside(next) => RISE,
                _ => 0.5 * RISE,
            };
            (position - seats[index].from + before).min(seats[index].to + behind - position)
        };
        let isolated = (0..seats.len()).filter(|&index| is_isolated(index));
        smooth_step(isolated.map(way_inside).fold(f32::NEG_INFINITY, f32::max) / RISE)
    }

    /// Places from the frame over the teeth to the midline. `front`: the least y of those on the inner side.
    fn dam_column(&self, position: f32, front: f32, isolation: f32) -> Vec<(Vec3, Tint)> {
        let (place, distal) = self.half.frame_at(position);
        let out = distal.cross(Vec3::Z);
        let section = self.section(GumForm::Touched, position);
        let middle = place + out * section.offset;
        let height = |margin: f32| OVER_CUSPS + (margin + OVER_MARGIN - OVER_CUSPS) * isolation;
        let (outer, inner) = (height(section.margin), height(section.inner_margin));
        let risen = |low: f32, high: f32, share: f32| low + (high - low) * smooth_step(share);
        let at = |aside: f32, z: f32| (middle + out * aside).with_z(z);
        let mut rows: Vec<Vec3> = OUTER_ROWS
            .iter()
            .map(|&beyond| at(section.half + beyond, risen(outer, AT_LIPS, (beyond - 0.5) / (OUTER_ROWS[0] - 0.5))))
            .collect();
        let edge = section.half + OUTER_ROWS[0];
        rows.splice(0..0, HANGING_ROWS.map(|[beyond, below]| at(edge + beyond, AT_LIPS - below)));
        // Within a tooth, where nobody sees it.
        rows.push(at(0.4 * section.half, outer));
        rows.push(at(-0.4 * section.half, inner));
        let foot = at(-section.half - 0.3, inner);
        let foot = Vec3::new(foot.x.max(LEAST_INNER_X * middle.x), foot.y.max(front), foot.z);
        for i in 0..=INNER_ROWS {
            let share = i as f32 / INNER_ROWS as f32;
            let z = risen(inner, AT_MIDLINE, share / 0.8);
            rows.push(Vec3::new(foot.x * (1.0 - share), foot.y, z));
        }
        rows.into_iter().map(|p| (Vec3::new(p.x * self.sign, p.y, p.z), Tint::smooth([1.0; 3]))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ArchPlan, DentalArch, FittedTooth, Jaw};
    use super::*;

    #[test]
    fn isolated_teeth_stand_out_and_the_others_are_covered() {
        // Aim: the sheet lies near the neck beside isolated teeth, over the cusps of all others, has no hole and faces the eye.
        // Method: the highest place of the sheet over the middle of each tooth's cheek side.
        for jaw in Jaw::BOTH {
            let fdi = jaw.fdi(1.0, 5);
            let fitted = FittedTooth { fdi, crown: Vec3::new(10.0, 10.5, 7.0) };
            let arch = DentalArch::new(jaw, 7, Some(fitted), &ArchPlan::default());
            let is_isolated = |side: f32, index: usize| side > 0.0 && (3..7).contains(&index);
            let TintedMesh { mesh, tints } = arch.rubber_dam(&is_isolated);
            assert_eq!(tints.len(), mesh.positions.len());
            let inside = |i: &u32| mesh.positions[*i as usize].y > -14.0;
            let folded = mesh.triangles.iter().filter(|corners| {
                let [a, b, c] = corners.map(|i| mesh.positions[i as usize]);
                corners.iter().all(inside) && (b - a).cross(c - a).z < -1e-3 * a.distance(b) * a.distance(c)
            });
            assert_eq!(folded.count(), 0, "{jaw:?}: the sheet is folded");
            for (side, index) in [1.0, -1.0].into_iter().flat_map(|side| (0..7).map(move |index| (side, index))) {
                let seat = arch.seat(side, index).unwrap();
                let beside = (seat.neck() + seat.buccal * 8.0) * Vec3::new(side, 1.0, 1.0);
                let level = |p: &&Vec3| p.truncate().distance(beside.truncate());
                let nearest = mesh.positions.iter().min_by(|a, b| level(a).total_cmp(&level(b))).unwrap();
                let cusps = seat.top.z;
                match is_isolated(side, index) {
                    true => assert!(nearest.z < cusps - 3.0, "{jaw:?} {index}: {} under {cusps}", nearest.z),
                    false => assert!(nearest.z > cusps, "{jaw:?} {side} {index}: {} over {cusps}", nearest.z),
                }
            }
        }
    }
}
