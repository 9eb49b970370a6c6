//! The mouth around the carved tooth: both jaws with their teeth and gingiva.
//!
//! The carved tooth is left out, and the arch is placed so that its own crown fits the gap. Near the tooth, the drawn
//! jaw follows the gingiva and neighbours that can be touched, so that the picture agrees with the contact.

mod arch;
mod crown;
mod gum;
mod teeth;

use self::arch::{HalfArch, ToothSeat};
use self::crown::ColouredMesh;
pub(super) use self::crown::{compute_normals, smooth_normals};
use self::gum::HalfJaw;
pub use self::gum::Jaw;
use self::teeth::ToothModel;
use super::surroundings;
use glam::Mat3;
use std::sync::Arc;
use typodont_anatomy::age;
use typodont_anatomy::age::AgeEffects;
use typodont_anatomy::form::Sizes;
use typodont_anatomy::teeth as teeth_by_number;
use typodont_core::frame::{Pose, Quat, Vec3, smooth_step};
use typodont_core::mesh::Mesh;
use typodont_core::parallel;
use typodont_core::touch::{Collider, ColliderGeometry};
use typodont_core::volume::Label;
use typodont_exercise::catalog::{TissueRole, TissueTable};
use typodont_exercise::scenario::file::AngleClassFile;
use typodont_exercise::scenario::{DentalArches, Periodontium, ToothBounds, Workpiece};
use typodont_render::{Appearance, MeshInstance, Quadrant, Rgb};

/// Opening of the mouth during treatment, degrees: some 40 mm between the incisors.
pub const WORKING_OPENING_DEG: f32 = 26.0;

/// Position of the condyles' axis relative to the edges of the lower incisors, back and up, mm: the height of Bonwill's
/// triangle of four inches, raised by Balkwill's angle of 26° over the occlusal plane.
const CONDYLES: [f32; 2] = [79.0, 38.5];

/// Overlap of upper and lower edges and cusps when the jaws are closed, mm.
const OVERBITE: f32 = 2.0;

/// Distance by which the upper first molar's centre lies behind the lower one's, mm, so that its mesiobuccal cusp meets
/// the lower one's buccal groove (Angle's class I).
const MOLAR_RELATION: f32 = 0.9;

/// Width of a cusp, mm: distance by which the lower jaw is placed backward in Angle's class II and forward in class
/// III.
const CUSP_WIDTH: f32 = 4.5;

/// Gloss of wet gingiva and enamel, 0 to 1.
const GUM_GLOSS: f32 = 0.28;
const TOOTH_GLOSS: f32 = 0.22;

/// Distances from the carved tooth's box, mm: up to the first, the gingiva is drawn as it is touched; from the second
/// on, as the jaw has it. Among the front teeth the arch bends away from the straight ridge that is touched, so the
/// distances are shorter there.
const TOUCH_BLEND: [f32; 2] = [6.0, 13.0];
const TOUCH_BLEND_IN_FRONT: [f32; 2] = [2.0, 5.0];

/// Touched shapes nearer than this to the middle of a crown take its place, mm.
const OCCUPIED_DISTANCE: f32 = 1.0;

/// Both jaws about one carved tooth. Made once for a workpiece; its solids share their meshes.
#[derive(Clone, Debug)]
pub struct Mouth {
    /// The jaw with the carved tooth, the opposite one.
    near: JawMeshes,
    opposite: JawMeshes,
    jaw: Jaw,
    world_from_near: Pose,
    near_from_opposite: Pose,
    /// Solids that can be touched beside the tooth and are not part of the near jaw's gingiva.
    touched: Vec<MeshInstance>,
}

#[derive(Clone, Debug)]
struct JawMeshes {
    teeth: TintedMesh,
    gum: TintedMesh,
}

/// A mesh with tints, and the finish they are multiplied with.
#[derive(Clone, Debug)]
struct TintedMesh {
    mesh: Arc<Mesh>,
    vertex_colours: Arc<Vec<Rgb>>,
    appearance: Appearance,
}

impl TintedMesh {
    fn new(made: ColouredMesh, colour: Rgb, gloss: f32) -> TintedMesh {
        TintedMesh {
            mesh: Arc::new(made.mesh),
            vertex_colours: Arc::new(made.vertex_colours),
            appearance: Appearance { colour, gloss },
        }
    }

    fn instance(&self, world_from_solid: Pose) -> MeshInstance {
        MeshInstance {
            mesh: self.mesh.clone(),
            vertex_colours: self.vertex_colours.clone(),
            world_from_solid,
            appearance: self.appearance,
        }
    }
}

impl Mouth {
    /// The jaws for a workpiece with one tooth of FDI 11–48; `None` for two teeth side by side, which stand in no jaw.
    ///
    /// Arch space is right-handed, and so x goes to the patient's left in the lower jaw and to the right in the upper one: there
    /// stand the quadrants whose forms are grown as they are written, the mirrored ones on the other side.
    pub fn around(workpiece: &Workpiece, tissues: &TissueTable) -> Option<Mouth> {
        let [tooth] = &workpiece.teeth[..] else { return None };
        let (quadrant, number) = (tooth.fdi / 10, usize::from(tooth.fdi % 10));
        if !(1..=4).contains(&quadrant) || !(1..=8).contains(&number) {
            return None;
        }
        let jaw = if quadrant <= 2 { Jaw::Upper } else { Jaw::Lower };
        let plan = &workpiece.arch;
        let near = JawArch::new(jaw, Some((tooth, number)), plan);
        let other = JawArch::new(jaw.other(), None, plan);
        let seat = near.carved.half.seats[number - 1];
        let top = tooth.crown.centre();
        let anchor = Vec3::new(top.x, top.y, tooth.crown.low.z);
        let sign = teeth_by_number::distal_sign(tooth.fdi);
        let near_from_tooth = mirrored_pose(seat.arch_from_tooth(), sign) * Pose::at(-anchor);
        let gums = tissues.by_name("gingiva").map(|e| e.label());
        let periodontium = workpiece.periodontium.as_deref();
        let geometry =
            TouchedGeometry { tooth, shapes: &workpiece.surroundings, periodontium, gum_label: gums, near_from_tooth };
        let colour = |name: &str, otherwise: Rgb| tissues.by_name(name).map_or(otherwise, |e| e.rgb());
        let (enamel, pink) = (colour("neighbour", [0.93, 0.91, 0.86]), colour("gingiva", [0.85, 0.53, 0.50]));
        let drawn = |arch: &JawArch, is_taken: &dyn Fn(bool, usize, &ToothSeat) -> bool, fit: &dyn Fn(Vec3) -> Vec3| {
            JawMeshes {
                teeth: TintedMesh::new(arch.teeth(is_taken), enamel, TOOTH_GLOSS),
                gum: TintedMesh::new(arch.gum(fit), pink, GUM_GLOSS),
            }
        };
        let is_taken = |is_carved_side: bool, index: usize, seat: &ToothSeat| {
            let side = if is_carved_side { sign } else { -sign };
            let is_missing = plan.missing.contains(&jaw.number(side, index));
            is_missing
                || (is_carved_side && index + 1 == number)
                || geometry.occupies(seat, if is_carved_side { sign } else { -sign })
        };
        let is_drawn = |shape: &&Collider| {
            let is_soft = tissues.role(shape.label) == Some(TissueRole::Soft);
            surroundings::is_visible(shape, tissues) && (!is_soft || has_own_surface(shape))
        };
        let touched = workpiece.surroundings.iter().filter(is_drawn);
        Some(Mouth {
            near: drawn(&near, &is_taken, &|p| geometry.fit_to_gum(p)),
            opposite: drawn(
                &other,
                &|is_carved_side, index, _| {
                    let side = if is_carved_side { other.sign } else { -other.sign };
                    plan.missing.contains(&other.jaw.number(side, index))
                },
                &|p| p,
            ),
            jaw,
            world_from_near: workpiece.world_from_tooth * near_from_tooth.inverse(),
            near_from_opposite: closed_pose(jaw, &near, &other, plan.angle_class),
            touched: touched.map(|shape| surroundings::solid_of_shape(shape, workpiece, tissues)).collect(),
        })
    }

    /// Everything but the carved tooth, world space: the mouth open by an angle about the condyles' axis, degrees, 0 to 35;
    /// the jaw with the carved tooth stays where it is.
    pub fn solids(&self, open: f32) -> Vec<MeshInstance> {
        let both = [(&self.near, self.world_from_near), (&self.opposite, self.world_from_opposite(open))];
        let jaws = both.iter().flat_map(|(jaw, pose)| [jaw.gum.instance(*pose), jaw.teeth.instance(*pose)]);
        jaws.chain(self.touched.iter().cloned()).collect()
    }

    /// The same without the opposite jaw: as a model jaw lies on the bench.
    pub fn one_jaw(&self) -> Vec<MeshInstance> {
        let Mouth { near, world_from_near: pose, .. } = self;
        [near.gum.instance(*pose), near.teeth.instance(*pose)].into_iter().chain(self.touched.iter().cloned()).collect()
    }

    /// The arch space of the jaw with the carved tooth, in world space.
    pub fn world_from_arch(&self) -> Pose {
        self.world_from_near
    }

    /// The arch space of a quadrant's jaw in world space, and on which side of it the quadrant lies: 1 or −1 along x.
    pub(super) fn arch_of(&self, quadrant: Quadrant, open: f32) -> (Pose, f32) {
        let (jaw, side) = match quadrant {
            Quadrant::UpperRight => (Jaw::Upper, 1.0),
            Quadrant::UpperLeft => (Jaw::Upper, -1.0),
            Quadrant::LowerLeft => (Jaw::Lower, 1.0),
            Quadrant::LowerRight => (Jaw::Lower, -1.0),
        };
        (if jaw == self.jaw { self.world_from_near } else { self.world_from_opposite(open) }, side)
    }

    fn world_from_opposite(&self, open: f32) -> Pose {
        self.world_from_near * self.opening_pose(open.clamp(0.0, 35.0)) * self.near_from_opposite
    }

    /// Rotation of the opposite jaw about the condyles' axis, in the near jaw's arch space.
    fn opening_pose(&self, degrees: f32) -> Pose {
        let [back, up] = CONDYLES;
        let axis = match self.jaw {
            Jaw::Lower => Vec3::new(0.0, back, up),
            Jaw::Upper => self.near_from_opposite * Vec3::new(0.0, back, up),
        };
        // About x, which points to one side: the other jaw's front, at −y from the axis, goes to +z.
        let orientation = Quat::from_rotation_x(-degrees.to_radians());
        Pose { position: axis - orientation * axis, orientation }
    }
}

/// One jaw of 28 teeth by itself; arch space: x to the patient's left in the lower jaw and to the right in the upper one, y back,
/// z occlusal, mm.
pub struct StandaloneJaw {
    /// Gum with palate or floor of the mouth, closed, with a colour at each corner.
    pub gum: Mesh,
    pub gum_colours: Vec<Rgb>,
    /// Pose of each tooth (`arch_from_tooth`), with its FDI number.
    pub teeth: Vec<(u8, Pose)>,
}

impl StandaloneJaw {
    /// As written, or at an age in years.
    pub fn new(jaw: Jaw, age: Option<f32>, tissues: &TissueTable) -> StandaloneJaw {
        let arch = JawArch::new(jaw, None, &DentalArches { age, ..DentalArches::default() });
        let ColouredMesh { mesh, vertex_colours: tints } = arch.gum(&|p| p);
        let pink = tissues.by_name("gingiva").map_or([0.85, 0.53, 0.50], |e| e.rgb());
        let gum_colours = tints.iter().map(|tint| std::array::from_fn(|c| pink[c] * tint[c])).collect();
        let quadrants = match jaw {
            Jaw::Upper => [(1, 1.0), (2, -1.0)],
            Jaw::Lower => [(3, 1.0), (4, -1.0)],
        };
        let teeth = quadrants.into_iter().flat_map(|(quadrant, sign)| {
            let seats = arch.plain.half.seats.iter().zip(1u8..);
            seats.map(move |(seat, number)| (10 * quadrant + number, mirrored_pose(seat.arch_from_tooth(), sign)))
        });
        StandaloneJaw { gum: mesh, gum_colours, teeth: teeth.collect() }
    }
}

impl Jaw {
    fn other(self) -> Jaw {
        match self {
            Jaw::Upper => Jaw::Lower,
            Jaw::Lower => Jaw::Upper,
        }
    }

    fn models(self) -> [ToothModel; 8] {
        match self {
            Jaw::Upper => teeth::UPPER,
            Jaw::Lower => teeth::LOWER,
        }
    }

    fn form(self, plan: &DentalArches) -> arch::ArchShape {
        let (average, own) = match self {
            Jaw::Upper => (arch::UPPER, plan.upper),
            Jaw::Lower => (arch::LOWER, plan.lower),
        };
        arch::ArchShape { width: own.width.unwrap_or(average.width), depth: own.depth, ..average }
    }

    /// The number of the tooth at a place from the midline on a side of x.
    fn number(self, side: f32, index: usize) -> u8 {
        let quadrant = match (self, side > 0.0) {
            (Jaw::Upper, true) => 1,
            (Jaw::Upper, false) => 2,
            (Jaw::Lower, true) => 3,
            (Jaw::Lower, false) => 4,
        };
        10 * quadrant + index as u8 + 1
    }
}

/// One jaw before it is drawn.
struct JawArch {
    jaw: Jaw,
    age: Option<f32>,
    /// On which side of x the carved tooth stands: 1 or −1.
    sign: f32,
    /// The side with the carved tooth and the other; each is laid out at x > 0.
    carved: ArchSide,
    plain: ArchSide,
}

/// Half a jaw's teeth.
#[derive(Clone)]
struct ArchSide {
    half: HalfArch,
    models: Vec<ToothModel>,
}

impl JawArch {
    /// A jaw of 28 teeth, with room for a carved tooth of its own size; with the third molars where that is one.
    fn new(jaw: Jaw, carved: Option<(&ToothBounds, usize)>, plan: &DentalArches) -> JawArch {
        let count = if carved.is_some_and(|(_, number)| number == 8) { 8 } else { 7 };
        let plain = jaw.models()[..count].to_vec();
        let mut models = plain.clone();
        if let Some((tooth, number)) = carved {
            models[number - 1] = fitted_model(&models[number - 1], tooth);
        }
        let sign = carved.map_or(1.0, |(tooth, _)| teeth_by_number::distal_sign(tooth.fdi));
        let row = |mut models: Vec<ToothModel>, side: f32| {
            for (index, model) in models.iter_mut().enumerate() {
                let number = jaw.number(side, index);
                let is_carved = side == sign && carved.is_some_and(|(_, carved)| carved == index + 1);
                // The carved one's own crown was measured as it is.
                model.form.age_effects =
                    plan.age.filter(|_| !is_carved).and_then(|years| AgeEffects::of(number, years));
                model.rotation =
                    plan.rotated.iter().find(|(fdi, _)| *fdi == number).map_or(0.0, |(_, degrees)| *degrees);
            }
            let teeth: Vec<(ToothModel, f32)> = models.iter().map(|m| (*m, m.sizes.mesiodistal[0])).collect();
            ArchSide { half: HalfArch::new(jaw.form(plan), &teeth), models }
        };
        if carved.is_none() && plan.rotated.is_empty() {
            let both = row(plain, -sign);
            return JawArch { jaw, age: plan.age, sign, carved: both.clone(), plain: both };
        }
        JawArch { jaw, age: plan.age, sign, carved: row(models, sign), plain: row(plain, -sign) }
    }

    /// All crowns but those that are taken: on the carved tooth's side or the other, by their place from the midline.
    fn teeth(&self, is_taken: &dyn Fn(bool, usize, &ToothSeat) -> bool) -> ColouredMesh {
        let crowns = parallel::par_map(self.plain.models.len(), |index| crown::crown(&self.plain.models[index]));
        let mut all = ColouredMesh::default();
        for (index, crown) in crowns.iter().enumerate() {
            for (row, is_carved_side) in [(&self.carved, true), (&self.plain, false)] {
                let seat = &row.half.seats[index];
                if is_taken(is_carved_side, index, seat) {
                    continue;
                }
                let pose = seat.arch_from_tooth();
                let sign = if is_carved_side { self.sign } else { -self.sign };
                let side = Vec3::new(sign, 1.0, 1.0);
                all.append(crown, |p| pose * p * side, |n| pose.rotate(n) * side, sign < 0.0);
            }
        }
        all
    }

    fn gum(&self, fit: &dyn Fn(Vec3) -> Vec3) -> ColouredMesh {
        let rows = if self.sign > 0.0 { [&self.plain, &self.carved] } else { [&self.carved, &self.plain] };
        let sides = [(rows[0], -1.0), (rows[1], 1.0)];
        let recession = self.age.map_or([0.0; 6], age::recession);
        gum::gum(
            self.jaw,
            sides.map(|(row, sign)| HalfJaw { half: &row.half, models: &row.models, recession, sign }),
            fit,
        )
    }
}

/// A pose at x > 0, or its mirror image at x < 0 for a tooth that is a mirror image (in y) too.
fn mirrored_pose(pose: Pose, sign: f32) -> Pose {
    let across = Mat3::from_diagonal(Vec3::new(sign, 1.0, 1.0));
    let along = Mat3::from_diagonal(Vec3::new(1.0, sign, 1.0));
    let orientation = Quat::from_mat3(&(across * Mat3::from_quat(pose.orientation) * along)).normalize();
    Pose { position: across * pose.position, orientation }
}

/// A table's tooth with the carved one's own crown.
fn fitted_model(model: &ToothModel, tooth: &ToothBounds) -> ToothModel {
    /// Room between the carved crown and its neighbours on each side, mm.
    const CONTACT: f32 = 0.05;
    let size = tooth.crown.size();
    let share = |of: [f32; 2], now: f32| [now, now * of[1] / of[0]];
    let sizes = Sizes {
        crown: size.z,
        mesiodistal: share(model.sizes.mesiodistal, size.y + 2.0 * CONTACT),
        buccolingual: share(model.sizes.buccolingual, size.x),
        ..model.sizes
    };
    // Front teeth lean as in any jaw; the others stand as upright as their space.
    let lean =
        if matches!(model.kind, teeth::ToothKind::Incisor | teeth::ToothKind::Canine) { model.lean } else { 0.0 };
    ToothModel { sizes, lean, ..*model }
}

/// The opposite jaw's arch space in the near one's when the jaws are closed.
fn closed_pose(near: Jaw, own: &JawArch, other: &JawArch, class: AngleClassFile) -> Pose {
    let ahead = match class {
        AngleClassFile::I => 0.0,
        AngleClassFile::II => -CUSP_WIDTH,
        AngleClassFile::III => CUSP_WIDTH,
    };
    let (upper, lower) = if near == Jaw::Upper { (own, other) } else { (other, own) };
    let first_molar = |arch: &JawArch| arch.plain.half.seats[5].top.y;
    let forward = first_molar(lower) + MOLAR_RELATION + ahead - first_molar(upper);
    // Turned about y by half a turn: left becomes right and up becomes down.
    let orientation = Quat::from_rotation_y(std::f32::consts::PI);
    let lower_from_upper = Pose { position: Vec3::new(0.0, forward, -OVERBITE), orientation };
    if near == Jaw::Upper { lower_from_upper.inverse() } else { lower_from_upper }
}

/// Colliders around the carved tooth, which the drawn jaw follows.
struct TouchedGeometry<'a> {
    tooth: &'a ToothBounds,
    shapes: &'a [Collider],
    /// Gingiva with a modelled margin, if the exercise has one.
    periodontium: Option<&'a Periodontium>,
    gum_label: Option<Label>,
    near_from_tooth: Pose,
}

impl TouchedGeometry<'_> {
    /// True when a touched shape other than gum stands where a crown would.
    /// `sign` is the side of x on which the seat lies.
    fn occupies(&self, seat: &ToothSeat, sign: f32) -> bool {
        let middle_in_arch = (seat.top - Vec3::Z * (0.5 * seat.crown)) * Vec3::new(sign, 1.0, 1.0);
        let middle = self.near_from_tooth.inverse() * middle_in_arch;
        self.shapes
            .iter()
            .any(|shape| Some(shape.label) != self.gum_label && shape.distance(middle) < OCCUPIED_DISTANCE)
    }

    /// A place of the gum, arch space: near the tooth laid onto the gum that is felt, or just under it where that is a mesh
    /// drawn for itself.
    fn fit_to_gum(&self, point_in_arch: Vec3) -> Vec3 {
        /// Distance range over which the touched gingiva loses its effect on the drawn one, mm.
        const FAR: [f32; 2] = [3.5, 6.0];
        /// Depth below the neck from which the effect fades, and at which it ends, mm.
        const DEEP: [f32; 2] = [6.0, 10.0];
        /// Distance below a mesh that is drawn separately, mm.
        const UNDER: f32 = 0.4;
        let Some(gum) = self.shapes.iter().find(|shape| Some(shape.label) == self.gum_label) else {
            return point_in_arch;
        };
        let ToothBounds { crown, .. } = *self.tooth;
        let mut point = self.near_from_tooth.inverse() * point_in_arch;
        let aside = (point - point.clamp(crown.low, crown.high)) * Vec3::new(1.0, 1.0, 0.0);
        let deep = crown.low.z - point.z;
        let as_felt = if self.tooth.fdi % 10 <= 3 { TOUCH_BLEND_IN_FRONT } else { TOUCH_BLEND };
        let near = (1.0 - rise(aside.length(), as_felt)) * (1.0 - rise(deep, DEEP));
        // Distance queries to a mesh are slow.
        let away = |p: Vec3| self.periodontium.map_or_else(|| gum.distance(p), |own| own.gum_sdf_filled(p));
        let share = if near > 0.0 { near * (1.0 - rise(away(point).abs(), FAR)) } else { 0.0 };
        if share <= 0.0 {
            return point_in_arch;
        }
        let wanted = if has_own_surface(gum) { -UNDER } else { 0.0 };
        let start = point;
        for _ in 0..3 {
            let (distance, out) = match self.periodontium {
                Some(own) => (own.gum_sdf_filled(point), gradient_direction(&|p| own.gum_sdf_filled(p), point)),
                None => gum.distance_and_normal(point),
            };
            point -= out * (distance - wanted);
        }
        self.near_from_tooth * start.lerp(point, share)
    }
}

/// Unit direction in which a distance increases.
fn gradient_direction(distance: &dyn Fn(Vec3) -> f32, point: Vec3) -> Vec3 {
    /// mm
    const STEP: f32 = 0.15;
    let along = |axis: Vec3| distance(point + axis * STEP) - distance(point - axis * STEP);
    Vec3::new(along(Vec3::X), along(Vec3::Y), along(Vec3::Z)).normalize_or(Vec3::Z)
}

/// True for a collider that is drawn separately and that the drawn jaw must not cover.
fn has_own_surface(shape: &Collider) -> bool {
    matches!(shape.geometry, ColliderGeometry::Mesh(_))
}

/// 0 up to the first bound, 1 from the second on.
fn rise(value: f32, [low, high]: [f32; 2]) -> f32 {
    smooth_step((value - low) / (high - low))
}
