//! Cheek and tongue as they are drawn: with the dent that a working end presses into them.

use super::oral_cavity::mucosa_tint;
use super::surroundings::SMOOTHING;
use std::sync::Arc;
use typodont_core::frame::Vec3;
use typodont_core::mesh::Mesh;
use typodont_core::touch::{Collider, ColliderGeometry};
use typodont_core::volume::{Grid, Label, Volume, surface};
use typodont_exercise::catalog::TissueTable;
use typodont_exercise::scenario::Workpiece;
use typodont_render::{Appearance, MeshInstance, VertexTint};

/// Names of the tissues that are drawn in this way.
const CHEEK: &str = "cheek";
const TONGUE: &str = "tongue";

/// Distance between the samples of a surface, mm.
const SPACING: f32 = 0.8;

/// Gloss of mucosa under saliva.
const GLOSS: f32 = 0.3;

/// Standard deviation of a dent across the surface: of a light touch, mm, and what its depth adds, per mm.
const DENT_WIDTH: f32 = 2.0;
const DENT_WIDTH_PER_MM: f32 = 0.5;

/// A surface of soft tissue.
#[derive(Clone, Debug)]
pub struct YieldingSurface {
    at_rest: MeshInstance,
    /// The same surface as it is felt.
    felt: Collider,
    is_cheek: bool,
}

impl YieldingSurface {
    /// Returns `None` for a shape that is neither cheek nor tongue.
    pub fn of(shape: &Collider, workpiece: &Workpiece, tissues: &TissueTable) -> Option<YieldingSurface> {
        let ColliderGeometry::Sdf(field) = &shape.geometry else { return None };
        let entry = tissues.by_label(shape.label).filter(|entry| [CHEEK, TONGUE].contains(&entry.name.as_str()))?;
        let extent = field.extent();
        let grid = Grid::covering(extent.low, extent.high, Vec3::splat(SPACING), 1);
        let sampled = Volume::from_distance(grid, 2.0 * SPACING, |place| (shape.distance(place), Label(1)));
        let mut mesh = surface::extract(&sampled);
        mesh.smooth_normals(SMOOTHING);
        let tints = mesh.positions.iter().map(|place| VertexTint::smooth(mucosa_tint(*place))).collect();
        let appearance = Appearance { colour: entry.rgb(), gloss: GLOSS };
        let plain = MeshInstance::plain(Arc::new(mesh), workpiece.world_from_tooth, appearance);
        let at_rest = MeshInstance { vertex_tints: Arc::new(tints), ..plain };
        Some(YieldingSurface { at_rest, felt: shape.clone(), is_cheek: entry.name == CHEEK })
    }

    pub fn is_tongue(&self) -> bool {
        !self.is_cheek
    }

    fn in_tooth(&self, place_in_world: Vec3) -> Vec3 {
        self.at_rest.world_from_solid.inverse() * place_in_world
    }

    /// The surface as nobody touches it, world space.
    pub fn at_rest(&self) -> &MeshInstance {
        &self.at_rest
    }

    /// True if the surface stands between an eye and a place, world space, mm. A cheek is in the way, too, where the eye is so
    /// far off that the lips and the rest of the cheek, which are not modelled, would have to be seen.
    pub fn hides(&self, eye: Vec3, place: Vec3) -> bool {
        /// mm
        const FAR: f32 = 75.0;
        const STEP: f32 = 1.0;
        let way = place - eye;
        if self.is_cheek && way.length() > FAR {
            return true;
        }
        let steps = (way.length() / STEP).ceil().max(1.0);
        (0..=steps as u32).any(|step| self.felt.distance(self.in_tooth(eye + way * (step as f32 / steps))) < 0.0)
    }

    /// The surface with the dent of a ball, world space, mm; `None` if the ball does not press on it.
    pub fn pressed(&self, middle_in_world: Vec3, radius: f32) -> Option<MeshInstance> {
        let middle = self.in_tooth(middle_in_world);
        let depth = radius - self.felt.distance(middle);
        if depth <= 0.0 {
            return None;
        }
        let (distance, out) = self.felt.distance_and_normal(middle);
        let place = middle - out * distance;
        let width = DENT_WIDTH + DENT_WIDTH_PER_MM * depth;
        let mut mesh = Mesh::clone(&self.at_rest.mesh);
        for position in &mut mesh.positions {
            let squared = position.distance_squared(place) / (2.0 * width * width);
            if squared < 8.0 {
                *position -= out * (depth * libm::expf(-squared));
            }
        }
        mesh.compute_normals();
        mesh.smooth_normals(SMOOTHING);
        Some(MeshInstance { mesh: Arc::new(mesh), ..self.at_rest.clone() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use typodont_exercise::scenario::{self, ResolveMode};
    use typodont_formats::Library;
    use typodont_formats::diagnostic::SourceText;

    #[test]
    fn a_ball_dents_the_cheek_and_does_not_stick_out_of_it() {
        // Aim: what is pressed gives way in the picture, near the ball only. Method: a ball of 0.7 mm at 0, 2 and 4 mm below the
        // surface; no corner of the surface is inside it, and corners 20 mm away stay.
        let text = include_str!("../../scenarios/7-spray.json").replace("\"spacing_mm\": 0.1", "\"spacing_mm\": 0.3");
        let library = Library::shipped();
        let source = SourceText::new("7-spray.json", text);
        let scenario = scenario::resolve(source, &library, ResolveMode::MakeWorkpiece).unwrap();
        let workpiece = Workpiece::make(&scenario, 1).unwrap();
        let all: Vec<YieldingSurface> = workpiece
            .surroundings
            .iter()
            .filter_map(|shape| YieldingSurface::of(shape, &workpiece, &scenario.tissues))
            .collect();
        assert_eq!(all.len(), 2, "cheek and tongue");
        let cheek = all.iter().find(|surface| surface.is_cheek).unwrap();
        let crown = workpiece.teeth[0].crown;
        let toward = |x: f32| workpiece.world_from_tooth * Vec3::new(x, crown.centre().y, crown.high.z + 2.0);
        let surface = (0..300).map(|i| crown.high.x + 0.1 * i as f32);
        let surface = surface.into_iter().find(|x| cheek.felt.distance(cheek.in_tooth(toward(*x))) < 0.0).unwrap();
        assert!(cheek.pressed(toward(surface - 1.0), 0.7).is_none());
        for deep in [0.0, 2.0, 4.0] {
            let middle = toward(surface + deep);
            let pressed = cheek.pressed(middle, 0.7).unwrap();
            for (before, after) in cheek.at_rest.mesh.positions.iter().zip(&pressed.mesh.positions) {
                let away = after.distance(cheek.in_tooth(middle));
                assert!(away > 0.6, "{deep} mm deep: a corner is {away} mm from the middle");
                assert!(before.distance(cheek.in_tooth(middle)) < 20.0 || before == after);
            }
        }
        // From the tongue's side the cheek is behind the tooth; from the other side it is before it.
        let [inside, outside] = [crown.low.x - 25.0, crown.high.x + 40.0].map(toward);
        assert!(!cheek.hides(inside, toward(0.0)) && cheek.hides(outside, toward(0.0)));
    }
}
