//! The teeth of both jaws as they are drawn: their forms, and how each stands.
//!
//! Axes as in tooth space of the upper right and the lower left: x lingual (−) to buccal (+), y mesial (−) to distal (+),
//! z apical (−) to occlusal (+), 0 at the neck.

use crate::anatomy::form::{Form, Sizes};
use crate::anatomy::teeth;

/// One tooth: its shape, the size of its place, and how it stands.
#[derive(Clone, Copy, Debug)]
pub struct Model {
    pub form: Form,
    /// The form's, but for the place of the carved tooth, which fits that one.
    pub sizes: Sizes,
    pub kind: Kind,
    /// The crown's axis leans so far toward lip or cheek, degrees.
    pub lean: f32,
    /// How far cusps or edge stay short of the occlusal plane, mm; a canine's tip stands beyond it, which brings its contact level with
    /// the lateral incisor's.
    pub short: f32,
    /// How far its middle stands out of the arch's line toward lip or cheek, mm: a canine is an arch's corner.
    pub out: f32,
    /// How far its root leans distally under its crown, degrees (Andrews's tip).
    pub tip: f32,
    /// How far its mesial side is turned toward lip or cheek, degrees.
    pub turn: f32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Incisor,
    Canine,
    Premolar,
    Molar,
}

/// Upper teeth from the midline outward.
pub const UPPER: [Model; 8] = {
    let [a, b, c, d, e, f, g, h] = teeth::UPPER;
    [
        tipped(model(a, Kind::Incisor, 20.0, 0.0), 5.0),
        tipped(model(b, Kind::Incisor, 16.0, 0.6), 6.0),
        tipped(standing_out(model(c, Kind::Canine, 12.0, -0.4), 2.2), 2.0),
        standing_out(model(d, Kind::Premolar, 0.0, 0.3), 0.8),
        standing_out(model(e, Kind::Premolar, 0.0, 0.3), 0.1),
        model(f, Kind::Molar, 2.0, 0.3),
        model(g, Kind::Molar, 2.0, 0.3),
        model(h, Kind::Molar, 2.0, 0.3),
    ]
};

/// Lower teeth from the midline outward.
pub const LOWER: [Model; 8] = {
    let [a, b, c, d, e, f, g, h] = teeth::LOWER;
    [
        tipped(model(a, Kind::Incisor, 12.0, 0.0), 2.0),
        tipped(standing_out(model(b, Kind::Incisor, 8.0, 0.0), -0.2), 2.0),
        tipped(standing_out(model(c, Kind::Canine, 12.0, -1.0), 2.5), 2.0),
        standing_out(model(d, Kind::Premolar, 0.0, 0.3), 0.6),
        standing_out(model(e, Kind::Premolar, 0.0, 0.3), 0.1),
        model(f, Kind::Molar, -3.0, 0.3),
        model(g, Kind::Molar, -3.0, 0.3),
        model(h, Kind::Molar, -3.0, 0.3),
    ]
};

const fn model(form: Form, kind: Kind, lean: f32, short: f32) -> Model {
    Model { form, sizes: form.sizes, kind, lean, short, out: 0.0, tip: 0.0, turn: 0.0 }
}

const fn tipped(model: Model, tip: f32) -> Model {
    Model { tip, ..model }
}

const fn standing_out(model: Model, out: f32) -> Model {
    Model { out, ..model }
}
