//! A rubber dam with the clamp that holds it.

use super::{FinishedMesh, MeshInstance};
use crate::instrument::{STEEL, wire};
use std::sync::Arc;
use typodont_anatomy::jaw::{DentalArch, ToothSeat};
use typodont_core::frame::{Pose, Vec3};
use typodont_core::mesh::Mesh;
use typodont_exercise::catalog::catmull_rom;
use typodont_render::Rgb;

/// Number of teeth on each side of the treated one that stand out.
pub const ISOLATED_BESIDE: f32 = 3.0;

/// Colour of blue latex, and its gloss.
const LATEX: Rgb = [0.33, 0.50, 0.66];
const LATEX_GLOSS: f32 = 0.12;

/// Radius of the clamp's wire, mm.
const WIRE: f32 = 0.6;

pub struct RubberDam {
    pub sheet: FinishedMesh,
    /// Arch space; `None` without an isolated tooth.
    pub clamp: Option<MeshInstance>,
}

impl RubberDam {
    /// A dam over a jaw. `is_isolated`: by side of x and place from the midline; `side`: that of the treated tooth.
    pub fn over(jaw: &DentalArch, side: f32, is_isolated: &dyn Fn(f32, usize) -> bool) -> RubberDam {
        let last = (0..8).rev().filter(|&index| is_isolated(side, index)).find_map(|index| jaw.seat(side, index));
        let clamp = last.map(|seat| MeshInstance::plain(Arc::new(clamp(seat, side)), Pose::IDENTITY, STEEL));
        let mut sheet = jaw.rubber_dam(is_isolated);
        let under = Mesh {
            positions: sheet.mesh.positions.clone(),
            normals: sheet.mesh.normals.iter().map(|normal| -*normal).collect(),
            triangles: sheet.mesh.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect(),
        };
        sheet.mesh.append(under);
        sheet.tints = Vec::new();
        RubberDam { sheet: FinishedMesh::new(sheet, LATEX, LATEX_GLOSS), clamp }
    }
}

/// A clamp around a tooth: its jaws lie at the neck on both sides, its bow passes behind the crown.
fn clamp(seat: &ToothSeat, side: f32) -> Mesh {
    /// Places on the cheek side: shares of the tooth's length across and along, and height over the neck, mm.
    const HALF: [[f32; 3]; 5] =
        [[0.50, -0.30, 1.2], [0.56, 0.0, 0.9], [0.54, 0.30, 1.4], [0.50, 0.62, 5.0], [0.30, 0.85, 8.6]];
    const TOP: [f32; 3] = [0.0, 0.93, 9.4];
    /// Greatest distance between two rings of the wire, mm.
    const FINENESS: f32 = 0.6;
    let length = seat.to - seat.from;
    let place = |[across, along, height]: [f32; 3]| {
        let place = seat.neck() + seat.buccal * (across * length) + seat.distal * (along * length) + Vec3::Z * height;
        place * Vec3::new(side, 1.0, 1.0)
    };
    let tongue_side = HALF.into_iter().rev().map(|[across, along, height]| [-across, along, height]);
    let knots: Vec<Vec3> = HALF.into_iter().chain([TOP]).chain(tongue_side).map(place).collect();
    wire(&catmull_rom(&knots, FINENESS), WIRE)
}
