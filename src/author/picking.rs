//! The conversion of a point selected on the tooth to the position of decay in the scenario.

use typodont_core::frame::Vec3;
use typodont_exercise::scenario::file::SurfaceFile;
use typodont_exercise::scenario::{ToothBounds, distal};

/// A position on one of a tooth's five surfaces, as in a scenario.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceLocation {
    pub surface: SurfaceFile,
    /// Offset from the centre of the surface along its two directions, mm, rounded to 0.1.
    pub offset: [f32; 2],
}

/// Returns the surface of a tooth on which a point lies, determined by the outward normal there, and the position on
/// that surface.
pub fn surface_location(tooth: &ToothBounds, point_in_tooth: Vec3, outward: Vec3) -> SurfaceLocation {
    /// Weight of the occlusal surface: because cusps are steep, slopes of up to 56° from horizontal belong to it.
    const CUSPS: f32 = 1.5;
    // In the tooth's own axes.
    let own_from_tooth = tooth.tooth_from_own.inverse();
    let (point, outward) = (own_from_tooth * point_in_tooth, own_from_tooth.rotate(outward));
    let distal = distal(tooth.fdi);
    let candidates = [
        (SurfaceFile::O, Vec3::Z, [Vec3::X, distal]),
        (SurfaceFile::B, Vec3::X, [distal, Vec3::Z]),
        (SurfaceFile::L, Vec3::NEG_X, [distal, Vec3::Z]),
        (SurfaceFile::D, distal, [Vec3::X, Vec3::Z]),
        (SurfaceFile::M, -distal, [Vec3::X, Vec3::Z]),
    ];
    let facing =
        |way: &(SurfaceFile, Vec3, [Vec3; 2])| outward.dot(way.1) * if way.0 == SurfaceFile::O { CUSPS } else { 1.0 };
    // The list is not empty.
    let (surface, _, axes) =
        candidates.into_iter().max_by(|a, b| facing(a).total_cmp(&facing(b))).unwrap_or(candidates[0]);
    let from_middle = point - tooth.own_crown.centre();
    SurfaceLocation { surface, offset: axes.map(|axis| (from_middle.dot(axis) * 10.0).round() / 10.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ExerciseDraft, new_exercise};
    use serde_json::json;
    use typodont_exercise::scenario::{ResolveMode, Workpiece, resolve};
    use typodont_formats::Library;
    use typodont_formats::diagnostic::SourceText;

    fn workpiece(draft: &ExerciseDraft) -> Workpiece {
        let scenario =
            resolve(SourceText::new("a.json", draft.text()), &Library::shipped(), ResolveMode::ReadScans).unwrap();
        Workpiece::make(&scenario, 0).unwrap()
    }

    #[test]
    fn a_decay_lies_where_somebody_pointed() {
        // Aim: the selected point, the written position and the generated decay agree, for teeth of both handednesses.
        // Method: rays from above, from buccal and from the side onto a generated tooth; the centre of the decay at the
        // written position is compared with the point.
        for fdi in [36, 46] {
            let mut draft = ExerciseDraft::new(new_exercise("t", "s", "i", ["a", "b", "c"], "d"));
            draft.set("/scene/jaw/tooth/fdi", &json!(fdi)).unwrap();
            draft.set("/scene/jaw/tooth/form/procedural/spacing_mm", &json!(0.2)).unwrap();
            draft.set("/scene/jaw/tooth/decay/0/depth_mm", &json!(0)).unwrap();
            let made = workpiece(&draft);
            let place = &made.teeth[0];
            let distal = place.distal();
            let rays = [
                (Vec3::new(1.5, 1.0, 40.0), Vec3::NEG_Z, SurfaceFile::O),
                (Vec3::new(40.0, 1.0, place.crown.high.z - 3.0), Vec3::NEG_X, SurfaceFile::B),
                (distal * 40.0 + Vec3::Z * (place.crown.high.z - 3.0), -distal, SurfaceFile::D),
            ];
            for (from, along, surface) in rays {
                let (point, outward) = made.volume.raycast(from, along).unwrap();
                let spot = surface_location(place, point, outward);
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
            assert_eq!(made.volume.raycast(Vec3::new(30.0, 30.0, 40.0), Vec3::NEG_Z), None);
        }
    }
}
