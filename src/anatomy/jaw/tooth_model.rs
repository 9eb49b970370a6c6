//! The teeth of both jaws as they are drawn: their forms, and how each stands.
//!
//! Axes as in tooth space of the upper right and the lower left: x lingual (−) to buccal (+), y mesial (−) to distal (+),
//! z apical (−) to occlusal (+), 0 at the neck.

use crate::form::{OcclusalForm, Sizes, ToothForm};
use crate::{premolars, teeth};

/// One tooth: its shape, the size of its place, and how it stands.
#[derive(Clone, Copy, Debug)]
pub struct ToothModel {
    pub form: ToothForm,
    /// Sizes of the form; for the place of the carved tooth, that tooth's own sizes.
    pub sizes: Sizes,
    pub kind: ToothKind,
    /// Inclination of the crown's axis toward lip or cheek, degrees.
    pub lean: f32,
    /// Distance of the cusps or the edge below the occlusal plane, mm. It is negative for a canine, whose tip lies
    /// beyond the plane so that its contact is level with the lateral incisor's.
    pub infraocclusion: f32,
    /// Distance of the tooth's centre from the line of the arch toward lip or cheek, mm: a canine is a corner of the
    /// arch.
    pub buccal_offset: f32,
    /// Distal inclination of the root (Andrews's tip), degrees.
    pub tip: f32,
    /// Rotation of the mesial side toward lip or cheek, degrees.
    pub rotation: f32,
    /// Differences of a crown that is only drawn.
    pub drawn: DrawnCrown,
}

/// Differences of a crown that is only drawn from the tooth that is felt, which stays as recordings have it.
#[derive(Clone, Copy, Debug)]
pub struct DrawnCrown {
    /// Another occlusal surface.
    pub occlusal: Option<&'static OcclusalForm>,
    /// Further lean toward lip or cheek, about the neck, degrees.
    pub lean: f32,
    /// Further mesiodistal width, mm.
    pub width: f32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ToothKind {
    Incisor,
    Canine,
    Premolar,
    Molar,
}

impl ToothModel {
    /// The form in the sizes of its place.
    pub fn form_in_place(&self) -> ToothForm {
        ToothForm { sizes: self.sizes, ..self.form }
    }
}

/// Upper teeth from the midline outward. Canines that are drawn stand more upright, as natural ones do, and are so much narrower that
/// they have room between their neighbours.
pub const UPPER: [ToothModel; 8] = {
    let [a, b, c, d, e, f, g, h] = teeth::UPPER;
    [
        with_tip(tooth_model(a, ToothKind::Incisor, 20.0, 0.0), 5.0),
        with_tip(tooth_model(b, ToothKind::Incisor, 16.0, 0.6), 6.0),
        with_drawn(
            with_tip(with_buccal_offset(tooth_model(c, ToothKind::Canine, 12.0, -0.4), 2.2), 2.0),
            DrawnCrown { lean: -6.0, width: -0.2, occlusal: None },
        ),
        with_buccal_offset(tooth_model(d, ToothKind::Premolar, 0.0, 0.3), 0.8),
        with_buccal_offset(tooth_model(e, ToothKind::Premolar, 0.0, 0.3), 0.1),
        tooth_model(f, ToothKind::Molar, 2.0, 0.3),
        tooth_model(g, ToothKind::Molar, 2.0, 0.3),
        tooth_model(h, ToothKind::Molar, 2.0, 0.3),
    ]
};

/// Lower teeth from the midline outward.
pub const LOWER: [ToothModel; 8] = {
    let [a, b, c, d, e, f, g, h] = teeth::LOWER;
    [
        with_tip(tooth_model(a, ToothKind::Incisor, 12.0, 0.0), 2.0),
        with_tip(with_buccal_offset(tooth_model(b, ToothKind::Incisor, 8.0, 0.0), -0.2), 2.0),
        with_drawn(
            with_tip(with_buccal_offset(tooth_model(c, ToothKind::Canine, 12.0, -1.0), 2.5), 2.0),
            DrawnCrown { lean: -8.0, width: -0.3, occlusal: None },
        ),
        with_drawn(
            with_buccal_offset(tooth_model(d, ToothKind::Premolar, 0.0, 0.3), 0.6),
            DrawnCrown { occlusal: Some(&premolars::LOWER_FIRST_DRAWN), lean: 0.0, width: 0.0 },
        ),
        with_buccal_offset(tooth_model(e, ToothKind::Premolar, 0.0, 0.3), 0.1),
        tooth_model(f, ToothKind::Molar, -3.0, 0.3),
        tooth_model(g, ToothKind::Molar, -3.0, 0.3),
        tooth_model(h, ToothKind::Molar, -3.0, 0.3),
    ]
};

const fn tooth_model(form: ToothForm, kind: ToothKind, lean: f32, infraocclusion: f32) -> ToothModel {
    ToothModel {
        form,
        sizes: form.sizes,
        kind,
        lean,
        infraocclusion,
        buccal_offset: 0.0,
        tip: 0.0,
        rotation: 0.0,
        drawn: DrawnCrown { occlusal: None, lean: 0.0, width: 0.0 },
    }
}

const fn with_tip(model: ToothModel, tip: f32) -> ToothModel {
    ToothModel { tip, ..model }
}

const fn with_buccal_offset(model: ToothModel, buccal_offset: f32) -> ToothModel {
    ToothModel { buccal_offset, ..model }
}

const fn with_drawn(model: ToothModel, drawn: DrawnCrown) -> ToothModel {
    ToothModel { drawn, ..model }
}
