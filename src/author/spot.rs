//! From a place that somebody points at on the tooth to where a decay is written to lie.

use crate::frame::Vec3;
use crate::scenario::ToothPlace;
use crate::scenario::file::SurfaceFile;
use crate::volume::{ISO, Volume};

/// A place on one of a tooth's five surfaces, as a scenario has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    pub surface: SurfaceFile,
    /// From the middle of the surface along its two directions, mm, to a tenth.
    pub offset: [f32; 2],
}

/// Where a ray first meets matter, tooth space, mm, and the way out of it. `along` is a unit vector.
pub fn met(volume: &Volume, from: Vec3, along: Vec3) -> Option<(Vec3, Vec3)> {
    /// Farther than this no eye stands, mm.
    const FARTHEST: f32 = 700.0;
    let step = 0.5 * volume.grid().spacing.min_element();
    let [low, high] = volume.grid().extent();
    // From where the ray enters the grid.
    let (a, b) = ((low - from) / along, (high - from) / along);
    let enters = a.min(b).max_element().max(0.0);
    let leaves = a.max(b).min_element().min(FARTHEST);
    let steps = ((leaves - enters).max(0.0) / step) as u32;
    let point = |i: u32| from + along * (enters + i as f32 * step);
    let hit = (0..steps).map(point).find(|&p| volume.density_at(p) >= ISO)?;
    let outward = -volume.density_and_gradient_at(hit).1;
    Some((hit, outward.normalize_or(-along)))
}

/// The surface of a tooth that a point lies on, by the way out of it there, and where on that surface.
pub fn spot_of(place: &ToothPlace, point_in_tooth: Vec3, outward: Vec3) -> Spot {
    /// Cusps are steep: up to 56° from level a slope is still the chewing surface's.
    const CUSPS: f32 = 1.5;
    let distal = place.distal();
    let ways = [
        (SurfaceFile::O, Vec3::Z, [Vec3::X, distal]),
        (SurfaceFile::B, Vec3::X, [distal, Vec3::Z]),
        (SurfaceFile::L, Vec3::NEG_X, [distal, Vec3::Z]),
        (SurfaceFile::D, distal, [Vec3::X, Vec3::Z]),
        (SurfaceFile::M, -distal, [Vec3::X, Vec3::Z]),
    ];
    let facing =
        |way: &(SurfaceFile, Vec3, [Vec3; 2])| outward.dot(way.1) * if way.0 == SurfaceFile::O { CUSPS } else { 1.0 };
    // The list is not empty.
    let (surface, _, axes) = ways.into_iter().max_by(|a, b| facing(a).total_cmp(&facing(b))).unwrap_or(ways[0]);
    let middle = 0.5 * (place.crown_low + place.crown_high);
    let from_middle = point_in_tooth - middle;
    Spot { surface, offset: axes.map(|axis| (from_middle.dot(axis) * 10.0).round() / 10.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::author::{Draft, new_exercise};
    use crate::content::Library;
    use crate::diagnostic::Source;
    use crate::scenario::{Forms, Workpiece, resolve};
    use serde_json::json;

    fn workpiece(draft: &Draft) -> Workpiece {
        let scenario = resolve(Source::new("a.json", draft.text()), &Library::shipped(), Forms::Read).unwrap();
        Workpiece::make(&scenario, 0).unwrap()
    }

    #[test]
    fn a_decay_lies_where_somebody_pointed() {
        // Aim: pointing, writing and making agree, for teeth of both handednesses. Method: rays from above, from the cheek and
        // from the side onto a made tooth; the decay written there, made, and its middle compared with the point.
        for fdi in [36, 46] {
            let mut draft = Draft::of(new_exercise("t", "s", "i", ["a", "b", "c"], "d"));
            draft.set("/scene/jaw/tooth/fdi", &json!(fdi)).unwrap();
            draft.set("/scene/jaw/tooth/form/procedural/spacing_mm", &json!(0.2)).unwrap();
            draft.set("/scene/jaw/tooth/decay/0/depth_mm", &json!(0)).unwrap();
            let made = workpiece(&draft);
            let place = &made.teeth[0];
            let distal = place.distal();
            let rays = [
                (Vec3::new(1.5, 1.0, 40.0), Vec3::NEG_Z, SurfaceFile::O),
                (Vec3::new(40.0, 1.0, place.crown_high.z - 3.0), Vec3::NEG_X, SurfaceFile::B),
                (distal * 40.0 + Vec3::Z * (place.crown_high.z - 3.0), -distal, SurfaceFile::D),
            ];
            for (from, along, surface) in rays {
                let (point, outward) = met(&made.volume, from, along).unwrap();
                let spot = spot_of(place, point, outward);
                assert_eq!(spot.surface, surface, "{fdi}: {outward}");
                let at = "/scene/jaw/tooth/decay/0";
                draft.set(&format!("{at}/surface"), &json!(format!("{surface:?}"))).unwrap();
                draft
                    .set(
                        &format!("{at}/at"),
                        &json!({ "offset_mm": spot.offset.map(|o| (f64::from(o) * 10.0).round() / 10.0) }),
                    )
                    .unwrap();
                let lesion = &workpiece(&draft).lesions[0];
                assert!(lesion.centre.distance(point) < 0.3, "{fdi} {surface:?}: {} for {point}", lesion.centre);
            }
            assert_eq!(met(&made.volume, Vec3::new(30.0, 30.0, 40.0), Vec3::NEG_Z), None);
        }
    }
}
