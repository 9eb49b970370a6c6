//! A scene as plain data: the carved tooth, other meshes, particles, lamps and a background.

use super::camera::Viewpoint;
use super::mirror::PlaneMirror;
use super::transfer_function::TransferFunction;
use super::unworked_tooth::UnworkedTooth;
use std::sync::Arc;
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_core::mesh::Mesh;
use typodont_core::volume::{Label, Volume};

/// Red, green and blue from 0 to 1, sRGB-encoded.
pub type Rgb = [f32; 3];

/// Everything in one image. World space, mm.
#[derive(Clone, Debug)]
pub struct RenderScene<'a> {
    pub tooth: Option<VolumeInstance<'a>>,
    pub solids: Vec<MeshInstance>,
    /// Opaque particles: dust. At most a few thousand.
    pub opaque_particles: &'a [Particle],
    /// Translucent particles: water. Drawn in this order, farthest first, after the tooth; a particle covers all
    /// earlier ones, even if it lies behind them.
    pub translucent_particles: &'a [Particle],
    /// A mirror, which shows everything but itself.
    pub mirror: Option<PlaneMirror>,
    pub lights: Lights,
    /// Region in which the chair lamp casts shadows; `None` for no shadows.
    pub shadows: Option<ShadowRegion>,
    /// Seed of the fine relief that is drawn: stippled gingiva, the ridges and hairline cracks of enamel, and the marks of burs where a
    /// tooth is dull; `None` for no relief.
    pub relief_seed: Option<u16>,
    pub background: Background,
    /// A lens before the eye, which blurs what is not in its focus; `None` if all is sharp. Where the tooth is translucent there is no
    /// blur, because it has no depth of its own. What a mirror shows is blurred as the mirror, and what lies behind translucent
    /// particles decides how they are.
    pub lens: Option<Lens>,
    /// True when the finished image is antialiased.
    pub is_antialiased: bool,
}

impl RenderScene<'_> {
    /// The lens, where depths are known.
    pub(super) fn drawn_lens(&self) -> Option<&Lens> {
        let is_translucent = self.tooth.as_ref().is_some_and(|tooth| matches!(tooth.mode, RenderMode::Volume(_)));
        self.lens.as_ref().filter(|_| !is_translucent)
    }

    /// Returns a scene with nothing but light.
    pub fn empty() -> RenderScene<'static> {
        RenderScene {
            tooth: None,
            solids: Vec::new(),
            opaque_particles: &[],
            translucent_particles: &[],
            mirror: None,
            lights: Lights::default(),
            shadows: None,
            relief_seed: None,
            background: Background::default(),
            lens: None,
            is_antialiased: false,
        }
    }
}

/// The carved tooth.
#[derive(Clone, Debug)]
pub struct VolumeInstance<'a> {
    pub volume: &'a Volume,
    /// Changes since the last image of the same renderer.
    pub changes: Changes<'a>,
    pub world_from_tooth: Pose,
    pub palette: &'a LabelPalette,
    /// The tooth before it was worked on: dentine shines through thin enamel if the palette says what colour it has, and what is
    /// cut is dull. Another one is used only after [`Changes::All`] or with another palette.
    pub unworked_tooth: Option<&'a UnworkedTooth>,
    pub mode: RenderMode,
}

/// Part of a volume that a renderer has not uploaded yet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Changes<'a> {
    /// Everything: another volume, or the first; also after an image that failed.
    All,
    /// Bricks in which voxels changed, as [`Volume::take_dirty`] returns them. A renderer that holds no volume of
    /// these dimensions yet uploads all of it.
    Bricks(&'a [usize]),
}

/// Technique by which a volume is rendered.
#[derive(Clone, Debug, PartialEq)]
pub enum RenderMode {
    /// Triangles where the density crosses 0.5.
    Surface,
    /// The same surface, traced by a ray through each pixel.
    Iso,
    /// Direct volume rendering: colours and opacities by density, blended along each ray.
    Volume(Arc<TransferFunction>),
}

/// Appearance of each label.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelPalette {
    pub appearances: [Appearance; 256],
    /// True for labels that are drawn as decay, with a soft border.
    pub is_decay: [bool; 256],
    /// Gloss of hard tissue where it is cut, if it is less than its own; `None` for what looks the same there.
    pub cut_gloss: [Option<f32>; 256],
    /// Label of the translucent tissue, enamel: decay near its surface is seen as a white spot, and the tissue beneath shines
    /// through.
    pub translucent: Option<Label>,
    /// Colour that shines through it: that of dentine.
    pub under_translucent: Option<Rgb>,
}

impl LabelPalette {
    /// Builds a palette with one colour per label and the same gloss for all, without decay.
    pub fn from_colours(colour: impl Fn(Label) -> Rgb, gloss: f32) -> LabelPalette {
        let appearances = std::array::from_fn(|l| Appearance { colour: colour(Label(l as u8)), gloss });
        LabelPalette {
            appearances,
            is_decay: [false; 256],
            cut_gloss: [None; 256],
            translucent: None,
            under_translucent: None,
        }
    }

    pub fn appearance(&self, label: Label) -> Appearance {
        self.appearances[usize::from(label.0)]
    }
}

/// Colour and gloss of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Appearance {
    pub colour: Rgb,
    /// Square root of the share of light that the surface mirrors straight back, 0 to 1: a film of saliva has 0.14 (its
    /// refractive index is 1.33), enamel under it 0.2, polished steel 0.8. A duller surface is also a rougher one.
    pub gloss: f32,
}

/// Difference of a place of a mesh from the rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VertexTint {
    /// Multiplied with the colour of the mesh's appearance.
    pub colour: Rgb,
    /// Share of the stippling of gingiva, 0 to 1; drawn where a scene has relief.
    pub stippling: f32,
}

impl VertexTint {
    /// White and smooth.
    pub const NONE: VertexTint = VertexTint::smooth([1.0; 3]);

    pub const fn smooth(colour: Rgb) -> VertexTint {
        VertexTint { colour, stippling: 0.0 }
    }
}

/// A closed surface that is not carved: gingiva, palate, another tooth, an instrument.
#[derive(Clone, Debug)]
pub struct MeshInstance {
    /// Shared, so that a renderer keeps the uploaded mesh for as long as scenes refer to it.
    pub mesh: Arc<Mesh>,
    /// One per position of the mesh. Empty: white and smooth everywhere.
    pub vertex_tints: Arc<Vec<VertexTint>>,
    pub world_from_solid: Pose,
    pub appearance: Appearance,
    /// True for another tooth: where a scene has relief, it has the ridges and cracks of enamel.
    pub is_enamel: bool,
    /// False for what would block the lamp only because the lamp is not aimed as a dentist would aim it.
    pub casts_shadow: bool,
}

impl MeshInstance {
    /// Creates an instance of one colour.
    pub fn plain(mesh: Arc<Mesh>, world_from_solid: Pose, appearance: Appearance) -> MeshInstance {
        MeshInstance {
            mesh,
            vertex_tints: Arc::default(),
            world_from_solid,
            appearance,
            is_enamel: false,
            casts_shadow: true,
        }
    }
}

/// One of very many small objects: a ball, or a disc that is visible from both sides. World space, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Particle {
    pub position: Vec3,
    pub radius: f32,
    /// Unit normal of a disc; `None` for a ball.
    pub facing: Option<Vec3>,
    pub appearance: Appearance,
    /// Share of the background that a translucent particle covers where it is thickest, 0 to 1. Opaque particles
    /// cover all.
    pub opacity: f32,
}

impl Particle {
    /// True when all values are finite and in range.
    pub(super) fn is_valid(&self) -> bool {
        self.position.is_finite()
            && (0.0..100.0).contains(&self.radius)
            && self.facing.is_none_or(Vec3::is_normalized)
            && (0.0..=1.0).contains(&self.opacity)
    }
}

/// Lights of a treatment room.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lights {
    /// Ambient light, as a share of full light.
    pub ambient: f32,
    /// Operating light of the dental unit.
    pub chair: Lamp,
    /// Lamp on the user's head.
    pub head: Lamp,
}

/// Ball of world space, mm, within which bodies cast and receive shadows of the chair lamp. The smaller it is, the finer they
/// are: a thousandth of its diameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowRegion {
    pub centre: Vec3,
    pub radius: f32,
}

impl ShadowRegion {
    pub(super) fn is_valid(&self) -> bool {
        self.centre.is_finite() && (0.1..1000.0).contains(&self.radius)
    }
}

/// A thin lens before the eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Place in focus, world space, mm. Everything at its depth is sharp.
    pub focus: Vec3,
    /// Diameter, mm: the larger, the more is blurred.
    pub aperture: f32,
}

impl Lens {
    pub(super) fn is_valid(&self) -> bool {
        self.focus.is_finite() && (0.0..100.0).contains(&self.aperture)
    }
}

/// A large, soft lamp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lamp {
    /// World space, mm.
    pub position: Vec3,
    /// Share of full light on a surface that faces the lamp; 0 is off.
    pub strength: f32,
    pub colour: Rgb,
    /// Extent to which the light reaches past the terminator on a white tissue, as a cosine, 0 to 1: light enters,
    /// scatters and leaves elsewhere. Less on a darker one, by each colour's reflectance.
    pub wrap: f32,
    /// Radius of the luminous area, mm: the larger, the softer are its shadows.
    pub radius: f32,
}

impl Lamp {
    pub const OFF: Lamp = Lamp { position: Vec3::ZERO, strength: 0.0, colour: [1.0; 3], wrap: 0.0, radius: 0.0 };

    /// Returns the operating light, above the patient's chest and to the upper left of the trainee.
    pub fn chair() -> Lamp {
        let position = Vec3::new(-350.0, 480.0, 420.0);
        Lamp { position, strength: 0.72, colour: [1.0, 0.98, 0.94], wrap: 0.15, radius: 80.0 }
    }

    /// Returns the operating light aimed along a line of sight: where it would come from too far aside, it is swung toward the eye.
    pub fn chair_toward(eye: Vec3, focus: Vec3) -> Lamp {
        /// Greatest angle between the light and the line of sight, rad: wide enough to give form.
        const WIDEST: f32 = 0.87;
        let lamp = Lamp::chair();
        let (to_lamp, to_eye) = (lamp.position - focus, (eye - focus).normalize_or(Vec3::Z));
        let angle = to_lamp.angle_between(to_eye);
        if angle <= WIDEST {
            return lamp;
        }
        // Any way around leads from the far side to the eye.
        let axis = to_lamp.cross(to_eye).try_normalize().unwrap_or_else(|| to_eye.any_orthonormal_vector());
        Lamp { position: focus + Quat::from_axis_angle(axis, angle - WIDEST) * to_lamp, ..lamp }
    }

    /// Returns a head lamp at the position of an eye, world space.
    pub fn head(eye: Vec3) -> Lamp {
        Lamp { position: eye, strength: 0.30, colour: [0.96, 0.98, 1.0], wrap: 0.15, radius: 0.0 }
    }
}

impl Lights {
    /// The operating light aimed along a line of sight, and a lamp at the eye.
    pub fn along(viewpoint: &Viewpoint) -> Lights {
        let chair = Lamp::chair_toward(viewpoint.position, viewpoint.focus);
        Lights { chair, head: Lamp::head(viewpoint.position), ..Lights::default() }
    }
}

impl Default for Lights {
    /// The operating light without a head lamp.
    fn default() -> Lights {
        Lights { ambient: 0.24, chair: Lamp::chair(), head: Lamp::OFF }
    }
}

/// Background: fades from the middle of the image to its corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Background {
    pub middle: Rgb,
    pub edge: Rgb,
}

impl Background {
    pub fn plain(colour: Rgb) -> Background {
        Background { middle: colour, edge: colour }
    }
}

impl Default for Background {
    /// The depth of a mouth: red, dark, and out of focus.
    fn default() -> Background {
        Background { middle: [0.27, 0.155, 0.145], edge: [0.07, 0.04, 0.04] }
    }
}
