//! The teeth of both jaws as numbers: sizes from tables of anatomy, and what makes each kind look like itself.
//!
//! Axes as in tooth space: x lingual (−) to buccal (+), y mesial (−) to distal (+), z apical (−) to occlusal (+), 0 at the
//! neck. Shares along x and y are of half the crown's width, along z of the crown's length.

use crate::anatomy::form::Sizes;

/// One tooth: its size, its shape and how it stands.
#[derive(Clone, Copy, Debug)]
pub struct Model {
    pub sizes: Sizes,
    pub kind: Kind,
    /// Places and heights of the cusps' tips; the incisors' edge has none.
    pub cusps: &'static [[f32; 3]],
    /// Ridges that are lower than cusps: from x, y to x, y at a height.
    pub ridges: &'static [Ridge],
    /// The crown's axis leans so far toward lip or cheek, degrees.
    pub lean: f32,
    /// How far cusps or edge stay short of the occlusal plane, mm.
    pub short: f32,
}

/// A ridge at one height.
#[derive(Clone, Copy, Debug)]
pub struct Ridge {
    pub from: [f32; 2],
    pub to: [f32; 2],
    pub height: f32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Incisor,
    Canine,
    Premolar,
    Molar,
}

/// How far the sides of a crown reach at one height.
#[derive(Clone, Copy, Debug)]
pub struct Level {
    pub height: f32,
    /// Buccal, lingual, mesial, distal.
    pub sides: [f32; 4],
}

impl Kind {
    pub fn levels(self) -> &'static [Level] {
        match self {
            Kind::Incisor => &INCISOR,
            Kind::Canine => &CANINE,
            Kind::Premolar => &PREMOLAR,
            Kind::Molar => &MOLAR,
        }
    }

    /// Exponent of the outline: 2 is an ellipse, more is squarer.
    pub fn squareness(self) -> f32 {
        match self {
            Kind::Incisor | Kind::Canine => 2.2,
            Kind::Premolar => 2.35,
            Kind::Molar => 2.9,
        }
    }
}

/// Sides from just above the neck to the border of the chewing surface or the edge, after the drawings of the same book as the
/// sizes: buccal crest of curvature in the cervical third, lingual in the middle third of premolars and molars, contacts in
/// the incisal third of incisors and at the junction of middle and occlusal third of the others.
const INCISOR: [Level; 6] = [
    level(0.16, [1.0, 0.98, 0.90, 0.90]),
    level(0.32, [0.95, 0.78, 0.94, 0.94]),
    level(0.50, [0.82, 0.46, 0.97, 0.97]),
    level(0.70, [0.62, 0.20, 0.99, 1.0]),
    level(0.88, [0.42, 0.04, 1.0, 0.99]),
    level(1.00, [0.26, -0.02, 0.97, 0.92]),
];
const CANINE: [Level; 6] = [
    level(0.18, [1.0, 1.0, 0.88, 0.88]),
    level(0.36, [0.97, 0.84, 0.94, 0.93]),
    level(0.55, [0.84, 0.54, 0.99, 0.98]),
    level(0.72, [0.66, 0.32, 1.0, 1.0]),
    level(0.88, [0.48, 0.16, 0.90, 0.94]),
    level(1.00, [0.30, 0.04, 0.70, 0.76]),
];
const PREMOLAR: [Level; 6] = [
    level(0.20, [1.0, 0.93, 0.88, 0.88]),
    level(0.40, [0.99, 0.99, 0.95, 0.95]),
    level(0.60, [0.95, 1.0, 1.0, 1.0]),
    level(0.78, [0.87, 0.95, 0.99, 0.99]),
    level(0.90, [0.79, 0.86, 0.94, 0.94]),
    level(1.00, [0.68, 0.74, 0.84, 0.84]),
];
const MOLAR: [Level; 6] = [
    level(0.18, [1.0, 0.93, 0.89, 0.89]),
    level(0.38, [0.99, 0.99, 0.94, 0.94]),
    level(0.58, [0.95, 1.0, 0.99, 0.99]),
    level(0.76, [0.89, 0.95, 1.0, 1.0]),
    level(0.90, [0.81, 0.87, 0.96, 0.96]),
    level(1.00, [0.71, 0.76, 0.88, 0.88]),
];

const fn level(height: f32, sides: [f32; 4]) -> Level {
    Level { height, sides }
}

/// Upper teeth from the midline outward. Sizes: Wheeler's table of average measurements (Ash & Nelson, *Dental Anatomy,
/// Physiology, and Occlusion*), in mm.
pub const UPPER: [Model; 8] = [
    Model { lean: 20.0, ..incisor([10.5, 13.0], [8.5, 7.0], [7.0, 6.0], [3.5, 2.5]) },
    Model { lean: 18.0, short: 0.6, ..incisor([9.0, 13.0], [6.5, 5.0], [6.0, 5.0], [3.0, 2.0]) },
    Model { lean: 8.0, ..canine([10.0, 17.0], [7.5, 5.5], [8.0, 7.0], [2.5, 1.5]) },
    premolar([8.5, 14.0], [7.0, 5.0], [9.0, 8.0], [1.0, 0.0], &[[0.52, 0.04, 1.0], [-0.50, -0.08, 0.90]]),
    premolar([8.5, 14.0], [7.0, 5.0], [9.0, 8.0], [1.0, 0.0], &[[0.51, 0.0, 1.0], [-0.51, -0.06, 0.97]]),
    upper_molar(
        [7.5, 12.5],
        [10.0, 8.0],
        [11.0, 10.0],
        &[[0.56, -0.46, 0.98], [0.52, 0.40, 0.94], [-0.44, -0.40, 1.0], [-0.58, 0.46, 0.84]],
    ),
    upper_molar(
        [7.0, 11.5],
        [9.0, 7.0],
        [11.0, 10.0],
        &[[0.56, -0.44, 0.99], [0.48, 0.40, 0.92], [-0.46, -0.30, 1.0], [-0.54, 0.50, 0.78]],
    ),
    upper_molar([6.5, 11.0], [8.5, 6.5], [10.0, 9.5], &[[0.54, -0.42, 1.0], [0.44, 0.42, 0.90], [-0.46, -0.10, 0.98]]),
];

/// Lower teeth from the midline outward; sizes from the same table.
pub const LOWER: [Model; 8] = [
    Model { lean: 12.0, ..incisor([9.0, 12.5], [5.0, 3.5], [6.0, 5.3], [3.0, 2.0]) },
    Model { lean: 11.0, ..incisor([9.5, 14.0], [5.5, 4.0], [6.5, 5.8], [3.0, 2.0]) },
    Model { lean: 5.0, ..canine([11.0, 16.0], [7.0, 5.5], [7.5, 7.0], [2.5, 1.0]) },
    premolar([8.5, 14.0], [7.0, 5.0], [7.5, 6.5], [1.0, 0.0], &[[0.22, -0.04, 1.0], [-0.62, 0.0, 0.68]]),
    premolar(
        [8.0, 14.5],
        [7.0, 5.0],
        [8.0, 7.0],
        [1.0, 0.0],
        &[[0.42, -0.05, 1.0], [-0.56, -0.34, 0.90], [-0.54, 0.40, 0.84]],
    ),
    lower_molar(
        [7.5, 14.0],
        [11.0, 9.0],
        [10.5, 9.0],
        &[[0.54, -0.54, 0.97], [0.58, 0.10, 0.95], [0.34, 0.70, 0.86], [-0.57, -0.46, 1.0], [-0.57, 0.34, 0.98]],
    ),
    lower_molar(
        [7.0, 13.0],
        [10.5, 8.0],
        [10.0, 9.0],
        &[[0.55, -0.46, 0.98], [0.54, 0.44, 0.95], [-0.57, -0.44, 1.0], [-0.57, 0.42, 0.97]],
    ),
    lower_molar(
        [7.0, 11.0],
        [10.0, 7.5],
        [9.5, 9.0],
        &[[0.53, -0.44, 0.98], [0.50, 0.44, 0.93], [-0.55, -0.42, 1.0], [-0.53, 0.42, 0.95]],
    ),
];

const fn sizes(length: [f32; 2], mesiodistal: [f32; 2], buccolingual: [f32; 2], neckline_rise: [f32; 2]) -> Sizes {
    Sizes { crown: length[0], root: length[1], mesiodistal, buccolingual, neckline_rise }
}

const fn incisor(length: [f32; 2], mesiodistal: [f32; 2], buccolingual: [f32; 2], rise: [f32; 2]) -> Model {
    let sizes = sizes(length, mesiodistal, buccolingual, rise);
    Model { sizes, kind: Kind::Incisor, cusps: &[], ridges: &[], lean: 0.0, short: 0.0 }
}

const fn canine(length: [f32; 2], mesiodistal: [f32; 2], buccolingual: [f32; 2], rise: [f32; 2]) -> Model {
    let sizes = sizes(length, mesiodistal, buccolingual, rise);
    Model { sizes, kind: Kind::Canine, cusps: &[[0.16, -0.08, 1.0]], ridges: &[], lean: 0.0, short: 0.0 }
}

const fn premolar(
    length: [f32; 2],
    mesiodistal: [f32; 2],
    buccolingual: [f32; 2],
    rise: [f32; 2],
    cusps: &'static [[f32; 3]],
) -> Model {
    let sizes = sizes(length, mesiodistal, buccolingual, rise);
    Model { sizes, kind: Kind::Premolar, cusps, ridges: &MARGINS, lean: 0.0, short: 0.3 }
}

const fn upper_molar(
    length: [f32; 2],
    mesiodistal: [f32; 2],
    buccolingual: [f32; 2],
    cusps: &'static [[f32; 3]],
) -> Model {
    let sizes = sizes(length, mesiodistal, buccolingual, [1.0, 0.0]);
    Model { sizes, kind: Kind::Molar, cusps, ridges: &MARGINS_AND_OBLIQUE, lean: 2.0, short: 0.3 }
}

const fn lower_molar(
    length: [f32; 2],
    mesiodistal: [f32; 2],
    buccolingual: [f32; 2],
    cusps: &'static [[f32; 3]],
) -> Model {
    let sizes = sizes(length, mesiodistal, buccolingual, [1.0, 0.0]);
    Model { sizes, kind: Kind::Molar, cusps, ridges: &MARGINS, lean: -3.0, short: 0.3 }
}

/// Marginal ridges, mesial and distal.
const MARGINS: [Ridge; 2] = [MESIAL_MARGIN, DISTAL_MARGIN];
const MESIAL_MARGIN: Ridge = Ridge { from: [0.45, -0.80], to: [-0.45, -0.78], height: 0.83 };
const DISTAL_MARGIN: Ridge = Ridge { from: [0.45, 0.80], to: [-0.45, 0.80], height: 0.80 };

/// The oblique ridge of upper molars runs from the mesiolingual to the distobuccal cusp.
const OBLIQUE: Ridge = Ridge { from: [-0.40, -0.32], to: [0.48, 0.38], height: 0.80 };
const MARGINS_AND_OBLIQUE: [Ridge; 3] = [MESIAL_MARGIN, DISTAL_MARGIN, OBLIQUE];
