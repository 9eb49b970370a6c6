//! What is to be seen, as plain data: the carved tooth, solids, lamps and a background.

use super::mirror::Mirror;
use super::transfer::TransferFunction;
use crate::frame::{Pose, Vec3};
use crate::mesh::Mesh;
use crate::volume::{Label, Volume};
use std::sync::Arc;

/// Red, green, blue from 0 to 1, as a screen shows them.
pub type Rgb = [f32; 3];

/// Everything in one picture. World space, mm.
#[derive(Clone, Debug)]
pub struct Scene<'a> {
    pub tooth: Option<Tooth<'a>>,
    pub solids: Vec<Solid>,
    /// Opaque specks: dust. At most some thousands.
    pub grains: &'a [Speck],
    /// Specks that let light through: water. Painted in this order, the farthest first, after the tooth; what lies behind one
    /// of them and comes later covers it.
    pub drops: &'a [Speck],
    /// Shows all of this but itself.
    pub mirror: Option<Mirror>,
    pub lights: Lights,
    pub background: Background,
    /// Stairs along edges are smoothed once all is drawn.
    pub is_smooth: bool,
}

impl Scene<'_> {
    /// Nothing but light.
    pub fn empty() -> Scene<'static> {
        Scene {
            tooth: None,
            solids: Vec::new(),
            grains: &[],
            drops: &[],
            mirror: None,
            lights: Lights::default(),
            background: Background { top: [0.80, 0.85, 0.88], bottom: [0.60, 0.66, 0.70] },
            is_smooth: false,
        }
    }
}

/// The tooth that is carved.
#[derive(Clone, Debug)]
pub struct Tooth<'a> {
    pub volume: &'a Volume,
    /// What has changed since the same painter's last picture.
    pub changes: Changes<'a>,
    pub world_from_tooth: Pose,
    pub palette: &'a Palette,
    pub shown: Shown,
}

/// Which part of a volume a painter has not seen yet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Changes<'a> {
    /// Another volume, or the first; also after a picture that failed.
    Anew,
    /// Bricks in which voxels changed, as [`Volume::take_dirty`] gives them. A painter that holds no volume of this size yet
    /// takes all of it.
    Bricks(&'a [usize]),
}

/// The way to see a volume.
#[derive(Clone, Debug, PartialEq)]
pub enum Shown {
    /// Triangles where density crosses a half.
    Surface,
    /// The same surface, met by a ray through each pixel.
    Iso,
    /// Colours and opacities by density, blended along each ray.
    Volume(Arc<TransferFunction>),
}

/// How each label looks.
#[derive(Clone, Debug, PartialEq)]
pub struct Palette(pub [Finish; 256]);

impl Palette {
    /// One colour per label, with a gloss for all.
    pub fn of(colour: impl Fn(Label) -> Rgb, gloss: f32) -> Palette {
        Palette(std::array::from_fn(|l| Finish { colour: colour(Label(l as u8)), gloss }))
    }

    pub fn finish(&self, label: Label) -> Finish {
        self.0[usize::from(label.0)]
    }
}

/// Colour and shine of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finish {
    pub colour: Rgb,
    /// Share of a lamp that a wet or polished surface mirrors, 0 to 1: dull decay 0.02, wet enamel 0.25, steel 0.6.
    pub gloss: f32,
}

/// A closed surface that is not carved: gum, palate, another tooth, an instrument.
#[derive(Clone, Debug)]
pub struct Solid {
    /// Shared, so that a painter keeps it where it draws as long as the scene names it.
    pub mesh: Arc<Mesh>,
    /// One colour per position of the mesh; the finish's colour is multiplied with it. Empty: white everywhere.
    pub tints: Arc<Vec<Rgb>>,
    pub world_from_solid: Pose,
    pub finish: Finish,
}

impl Solid {
    /// A solid of one colour.
    pub fn plain(mesh: Arc<Mesh>, world_from_solid: Pose, finish: Finish) -> Solid {
        Solid { mesh, tints: Arc::default(), world_from_solid, finish }
    }
}

/// One of very many small things: a ball, or a disc that may be looked at from both sides. World space, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Speck {
    pub place: Vec3,
    pub radius: f32,
    /// Out of a disc's face, a unit vector; `None` for a ball.
    pub facing: Option<Vec3>,
    pub finish: Finish,
    /// Share of what lies behind that is covered where a drop is thickest, 0 to 1. A grain covers all.
    pub opacity: f32,
}

impl Speck {
    /// True when its numbers make a picture.
    pub(super) fn is_sound(&self) -> bool {
        self.place.is_finite()
            && (0.0..100.0).contains(&self.radius)
            && self.facing.is_none_or(Vec3::is_normalized)
            && (0.0..=1.0).contains(&self.opacity)
    }
}

/// The light of a treatment room.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lights {
    /// From everywhere, as a share of full light.
    pub ambient: f32,
    pub chair: Lamp,
    pub head: Lamp,
}

/// A large, soft lamp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lamp {
    /// World space, mm.
    pub position: Vec3,
    /// Share of full light where a surface faces it; 0 is off.
    pub strength: f32,
    pub colour: Rgb,
    /// How far its light reaches round the edge of its own shadow, 0 to 1.
    pub wrap: f32,
}

impl Lamp {
    pub const OFF: Lamp = Lamp { position: Vec3::ZERO, strength: 0.0, colour: [1.0; 3], wrap: 0.0 };

    /// The operating light above the patient's chest, upper left of the trainee.
    pub fn chair() -> Lamp {
        Lamp { position: Vec3::new(-350.0, 480.0, 420.0), strength: 0.62, colour: [1.0, 0.98, 0.94], wrap: 0.2 }
    }

    /// A lamp on the head of whoever looks from a place.
    pub fn head(eye: Vec3) -> Lamp {
        Lamp { position: eye, strength: 0.22, colour: [0.96, 0.98, 1.0], wrap: 0.1 }
    }
}

impl Default for Lights {
    /// The chair's lamp, and no head lamp.
    fn default() -> Lights {
        Lights { ambient: 0.34, chair: Lamp::chair(), head: Lamp::OFF }
    }
}

/// Behind everything: from one colour at the picture's top to another at its bottom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Background {
    pub top: Rgb,
    pub bottom: Rgb,
}

impl Background {
    pub fn plain(colour: Rgb) -> Background {
        Background { top: colour, bottom: colour }
    }
}
