//! One crown as triangles, made as a carved tooth is, but coarser and cut off below the gingival margin.

use super::tinted_mesh::{Tint, TintedMesh, mixed_tint};
use super::tooth_model::{ToothKind, ToothModel};
use crate::form::ToothForm;
use crate::grow::grow_with_ramp;
use crate::{TissueLabels, grid_of_spacing};
use typodont_core::frame::{Vec3, smooth_step};
use typodont_core::volume::{Label, Volume, hollowness, surface};

/// Distance between samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum CrownDetail {
    /// 0.36 mm: cusps and ridges show, the finest grooves as shallow valleys. From 0.45 mm on edges fray, below 0.3 mm a whole
    /// mouth takes longer to draw than it gains.
    Far,
    /// 0.2 mm: no corner shows in the outline of a tooth beside the one that fills a picture.
    Near,
}

impl CrownDetail {
    /// mm
    fn spacing(self) -> f32 {
        match self {
            CrownDetail::Far => 0.36,
            CrownDetail::Near => 0.2,
        }
    }
}

/// Length of root in the gingiva below a crown, mm: farther down a leaning root would leave it.
const ROOT_LENGTH: f32 = 2.5;

/// Half-width, mm, of the ramp from nothing to matter where the matter around a place is measured.
const MEASURED_HALF_BAND: f32 = 0.54;

/// Half the width of the density ramp, voxels: wide, so that the normals between so coarse samples are those of the form.
const DRAWN_HALF_BAND: f32 = 3.0;

/// Width, voxels, that the thin corners of an incisor's edge lose between samples, where incisors touch.
const EDGE_LOSS: f32 = 0.3;

/// Width of other crowns that closes the gaps between their felt forms, mm, so that no gum shines through a contact.
const CONTACT_CLOSED: f32 = 0.08;

/// Labels used while a crown is made. They are independent of the exercise's tissues, since a crown is only drawn.
const TISSUES: TissueLabels = TissueLabels { enamel: Label(1), dentine: Label(2), pulp: Label(3) };

/// A tooth's crown and the beginning of its root, closed, in tooth space; mm. `is_felt`: drawn as it is felt; `recession`: length of root
/// above the gingiva.
pub fn crown(model: &ToothModel, is_felt: bool, recession: f32, detail: CrownDetail) -> TintedMesh {
    let form = if is_felt { model.form } else { drawn_form(model, detail.spacing()) };
    let grid = grid_of_spacing(&form, detail.spacing()).above(-recession - ROOT_LENGTH);
    let volume = grow_with_ramp(&form, grid, &TISSUES, DRAWN_HALF_BAND);
    let mesh = surface::extract(&volume);
    let tints = mesh.positions.iter().map(|p| tint(model, &volume, *p, detail.spacing())).collect();
    TintedMesh { mesh, tints }
}

/// The form of a crown that is only drawn. `spacing`: of its samples, mm.
fn drawn_form(model: &ToothModel, spacing: f32) -> ToothForm {
    let mut form = ToothForm { occlusal: *model.drawn.occlusal.unwrap_or(&model.form.occlusal), ..model.form };
    let gap = if model.kind == ToothKind::Incisor { EDGE_LOSS * spacing } else { CONTACT_CLOSED };
    form.sizes.mesiodistal[0] += model.drawn.width + gap;
    form
}

/// Tints of enamel's colour: warmer toward the neck, where dentine shines through; greyish and clear at an incisor's edge and at tips,
/// which light leaves at their sides.
const NECK: Tint = Tint::smooth([0.99, 0.93, 0.85]);
const ROOT: Tint = Tint::smooth([0.95, 0.82, 0.66]);
const CLEAR: Tint = Tint::smooth([0.88, 0.915, 0.95]);
const DEEP: Tint = Tint::smooth([0.93, 0.885, 0.81]);
const CANINE: Tint = Tint::smooth([0.99, 0.98, 0.95]);
const PLAIN: Tint = Tint::smooth([1.0, 1.0, 1.0]);

/// `spacing`: of the volume, mm.
fn tint(model: &ToothModel, volume: &Volume, place: Vec3, spacing: f32) -> Tint {
    let sizes = &model.form.sizes;
    let [mesial, distal] = sizes.neckline_rise;
    let rise = if place.y < 0.0 { mesial } else { distal };
    let neckline = rise * place.y * place.y / (place.x * place.x + place.y * place.y + 0.01);
    let body = if model.kind == ToothKind::Canine { CANINE } else { PLAIN };
    let height = (place.z - neckline) / sizes.crown;
    let on_enamel = mixed_tint(NECK, body, height / 0.35);
    // Toward the edge, height counts from the neck's level: where a crown is thin, that of its line is not defined.
    let share = place.z / sizes.crown;
    let hollow = || hollowness_at(volume, place, DRAWN_HALF_BAND * spacing);
    let tip = |hollow: f32| mixed_tint(on_enamel, CLEAR, -hollow * smooth_step((share - 0.4) / 0.3));
    let enamel = match model.kind {
        ToothKind::Incisor => {
            // Dentine reaches farther into the three lobes (mamelons) than between them.
            let lobes = libm::cosf(3.0 * std::f32::consts::TAU * place.y / sizes.mesiodistal[0]);
            mixed_tint(on_enamel, CLEAR, smooth_step((share - 0.74 - 0.03 * lobes) / 0.22))
        }
        ToothKind::Canine if share > 0.4 => tip(hollow()),
        ToothKind::Premolar | ToothKind::Molar if height > 0.3 => {
            let hollow = hollow();
            mixed_tint(tip(hollow), DEEP, hollow)
        }
        ToothKind::Canine | ToothKind::Premolar | ToothKind::Molar => on_enamel,
    };
    // Over a sample's width, so that the neckline is a line and not a stair.
    mixed_tint(ROOT, enamel, 0.5 + (place.z - neckline) / spacing)
}

/// Form of a crown around a place, as [`hollowness`] gives it. `half_band`: half the width of the volume's density ramp, mm.
fn hollowness_at(volume: &Volume, place: Vec3, half_band: f32) -> f32 {
    hollowness(place, |p| (0.5 + (volume.density_at(p) - 0.5) * half_band / MEASURED_HALF_BAND).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::super::tooth_model::{LOWER, UPPER};
    use super::*;
    use typodont_core::touch::ClosedMesh;

    #[test]
    fn the_whole_edge_of_an_incisor_is_clear_and_its_body_is_not() {
        // Aim: enamel without dentine behind it looks clear from corner to corner. Method: the tints at both heights.
        let incisors = UPPER.iter().chain(&LOWER).filter(|model| model.kind == ToothKind::Incisor);
        for model in incisors {
            let TintedMesh { mesh, tints } = crown(model, false, 0.0, CrownDetail::Far);
            let reds_at = |heights: std::ops::Range<f32>| -> Vec<f32> {
                let places = mesh.positions.iter().zip(&tints);
                let there = places.filter(|(place, _)| heights.contains(&(place.z / model.sizes.crown)));
                there.map(|(_, tint)| tint.colour[0]).collect()
            };
            let (edge, body) = (reds_at(0.97..1.1), reds_at(0.4..0.6));
            assert!(edge.len() > 10 && edge.iter().all(|red| *red < 0.9), "{edge:?}");
            assert!(body.len() > 100 && body.iter().all(|red| *red > 0.985), "{body:?}");
        }
    }

    #[test]
    fn every_crown_is_closed_and_as_large_as_the_table_says() {
        // Aim: a closed surface facing outward, of the table's widths and length to a sample's distance.
        let kinds = [(CrownDetail::Far, false), (CrownDetail::Far, true), (CrownDetail::Near, false)];
        for (model, (detail, is_felt)) in UPPER.iter().chain(&LOWER).flat_map(|model| kinds.map(|kind| (model, kind))) {
            let TintedMesh { mesh, tints } = crown(model, is_felt, 0.0, detail);
            let sizes = &model.sizes;
            assert!(ClosedMesh::new(&mesh).is_some(), "{sizes:?} is closed");
            assert!(mesh.volume_mm3() > 50.0, "{sizes:?}");
            assert_eq!(tints.len(), mesh.positions.len());
            let low = mesh.positions.iter().copied().fold(Vec3::INFINITY, Vec3::min);
            let high = mesh.positions.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
            let found = Vec3::new(high.x - low.x, high.y - low.y, high.z);
            let width = if is_felt { 0.0 } else { model.drawn.width };
            let wanted = Vec3::new(sizes.buccolingual[0], sizes.mesiodistal[0] + width, sizes.crown);
            assert!((found - wanted).abs().max_element() < detail.spacing(), "{found} not {wanted}");
            assert!((low.z + ROOT_LENGTH).abs() < 2.0 * detail.spacing(), "the root ends at {}", low.z);
        }
    }
}
