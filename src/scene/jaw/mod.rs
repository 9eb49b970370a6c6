//! The mouth around the carved tooth: both jaws with their teeth and gum.
//!
//! The carved tooth is left out, and the arch is laid so that its own crown fits the gap. Where gum and neighbours are
//! touched, the jaw gives way to them: what is drawn near the tooth is what is felt there.

mod arch;
mod crown;
mod gum;
mod teeth;

use self::arch::{Half, Seat};
use self::crown::Coloured;
pub(super) use self::crown::smooth_normals;
pub use self::gum::Jaw;
use self::gum::Side;
use self::teeth::Model;
use super::around;
use crate::anatomy::age::{self, Aged};
use crate::anatomy::form::Sizes;
use crate::anatomy::teeth as teeth_by_number;
use crate::content::{Role, TissueTable};
use crate::frame::{Pose, Quat, Vec3};
use crate::mesh::Mesh;
use crate::render::{Finish, Quadrant, Rgb, Solid};
use crate::scenario::file::AngleClassFile;
use crate::scenario::{Arch as Plan, Periodontium, ToothPlace, Workpiece};
use crate::touch::{Form, Shape};
use crate::volume::{Label, rows};
use glam::Mat3;
use std::sync::Arc;

/// How far the mouth is open at work, degrees: some 40 mm between the incisors.
pub const OPEN: f32 = 26.0;

/// Where the condyles' axis lies seen from the lower incisors' edges, back and up, mm: the height of Bonwill's triangle of
/// four inches, raised by Balkwill's angle of 26° over the occlusal plane.
const CONDYLES: [f32; 2] = [79.0, 38.5];

/// How far upper edges and cusps reach below the lower ones when the jaws are closed, mm.
const OVERBITE: f32 = 2.0;

/// How far behind the lower first molar's middle the upper one's lies, so that its mesiobuccal cusp meets the lower one's
/// buccal groove (Angle's class I), mm.
const MOLAR_RELATION: f32 = 0.9;

/// The width of a cusp: by so much a lower jaw of Angle's class II stands back and one of class III forward, mm.
const CUSP: f32 = 4.5;

/// Wet gum and enamel.
const GUM_GLOSS: f32 = 0.28;
const TOOTH_GLOSS: f32 = 0.22;

/// Around the carved tooth's box the gum is drawn as it is felt up to the first distance, as the jaw has it from the second
/// on, mm. Among the front teeth the arch bends away from the straight ridge that is felt: farther off that would be no tooth's gum.
const AS_FELT: [f32; 2] = [6.0, 13.0];
const AS_FELT_IN_FRONT: [f32; 2] = [2.0, 5.0];

/// Touched shapes nearer than this to the middle of a crown take its place, mm.
const TAKEN: f32 = 1.0;

/// Both jaws about one carved tooth. Made once for a workpiece; its solids share their meshes.
#[derive(Clone, Debug)]
pub struct Mouth {
    /// The jaw with the carved tooth, the opposite one.
    near: JawMeshes,
    opposite: JawMeshes,
    jaw: Jaw,
    world_from_near: Pose,
    near_from_opposite: Pose,
    /// What is touched beside the tooth and not part of the near jaw's gum.
    touched: Vec<Solid>,
}

#[derive(Clone, Debug)]
struct JawMeshes {
    teeth: Drawn,
    gum: Drawn,
}

/// A mesh with tints, and the finish they are multiplied with.
#[derive(Clone, Debug)]
struct Drawn {
    mesh: Arc<Mesh>,
    tints: Arc<Vec<Rgb>>,
    finish: Finish,
}

impl Drawn {
    fn of(made: Coloured, colour: Rgb, gloss: f32) -> Drawn {
        Drawn { mesh: Arc::new(made.mesh), tints: Arc::new(made.tints), finish: Finish { colour, gloss } }
    }

    fn at(&self, world_from_solid: Pose) -> Solid {
        Solid { mesh: self.mesh.clone(), tints: self.tints.clone(), world_from_solid, finish: self.finish }
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
        let near = Arch::with(jaw, Some((tooth, number)), plan);
        let other = Arch::with(jaw.other(), None, plan);
        let seat = near.carved.half.seats[number - 1];
        let top = 0.5 * (tooth.crown_low + tooth.crown_high);
        let anchor = Vec3::new(top.x, top.y, tooth.crown_low.z);
        let sign = teeth_by_number::distal(tooth.fdi);
        let near_from_tooth = sided(seat.arch_from_tooth(), sign) * Pose::at(-anchor);
        let gums = tissues.by_name("gingiva").map(|e| e.label());
        let periodontium = workpiece.periodontium.as_deref();
        let felt = Felt { tooth, shapes: &workpiece.around, periodontium, gums, near_from_tooth };
        let colour = |name: &str, otherwise: Rgb| tissues.by_name(name).map_or(otherwise, |e| e.rgb());
        let (enamel, pink) = (colour("neighbour", [0.93, 0.91, 0.86]), colour("gingiva", [0.85, 0.53, 0.50]));
        let drawn =
            |arch: &Arch, is_taken: &dyn Fn(bool, usize, &Seat) -> bool, fit: &dyn Fn(Vec3) -> Vec3| JawMeshes {
                teeth: Drawn::of(arch.teeth(is_taken), enamel, TOOTH_GLOSS),
                gum: Drawn::of(arch.gum(fit), pink, GUM_GLOSS),
            };
        let is_taken = |is_carved_side: bool, index: usize, seat: &Seat| {
            let side = if is_carved_side { sign } else { -sign };
            let is_missing = plan.missing.contains(&jaw.number(side, index));
            is_missing
                || (is_carved_side && index + 1 == number)
                || felt.takes(seat, if is_carved_side { sign } else { -sign })
        };
        let is_drawn = |shape: &&Shape| {
            let is_soft = tissues.role(shape.label) == Some(Role::Soft);
            around::is_seen(shape, tissues) && (!is_soft || has_own_surface(shape))
        };
        let touched = workpiece.around.iter().filter(is_drawn);
        Some(Mouth {
            near: drawn(&near, &is_taken, &|p| felt.fitted(p)),
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
            near_from_opposite: closed(jaw, &near, &other, plan.angle_class),
            touched: touched.map(|shape| around::solid(shape, workpiece, tissues)).collect(),
        })
    }

    /// Everything but the carved tooth, world space: the mouth open by an angle about the condyles' axis, degrees, 0 to 35;
    /// the jaw with the carved tooth stays where it is.
    pub fn solids(&self, open: f32) -> Vec<Solid> {
        let both = [(&self.near, self.world_from_near), (&self.opposite, self.world_from_opposite(open))];
        let jaws = both.iter().flat_map(|(jaw, pose)| [jaw.gum.at(*pose), jaw.teeth.at(*pose)]);
        jaws.chain(self.touched.iter().cloned()).collect()
    }

    /// The same without the opposite jaw: as a model jaw lies on the bench.
    pub fn one_jaw(&self) -> Vec<Solid> {
        let Mouth { near, world_from_near: pose, .. } = self;
        [near.gum.at(*pose), near.teeth.at(*pose)].into_iter().chain(self.touched.iter().cloned()).collect()
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
        self.world_from_near * self.opened(open.clamp(0.0, 35.0)) * self.near_from_opposite
    }

    /// The turn of the opposite jaw about the condyles' axis, in the near jaw's arch space.
    fn opened(&self, degrees: f32) -> Pose {
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
pub struct JawAlone {
    /// Gum with palate or floor of the mouth, closed, with a colour at each corner.
    pub gum: Mesh,
    pub gum_colours: Vec<Rgb>,
    /// Where each tooth stands, by its number: `arch_from_tooth`.
    pub teeth: Vec<(u8, Pose)>,
}

impl JawAlone {
    /// As written, or at an age in years.
    pub fn of(jaw: Jaw, age: Option<f32>, tissues: &TissueTable) -> JawAlone {
        let arch = Arch::with(jaw, None, &Plan { age, ..Plan::default() });
        let Coloured { mesh, tints } = arch.gum(&|p| p);
        let pink = tissues.by_name("gingiva").map_or([0.85, 0.53, 0.50], |e| e.rgb());
        let gum_colours = tints.iter().map(|tint| std::array::from_fn(|c| pink[c] * tint[c])).collect();
        let quadrants = match jaw {
            Jaw::Upper => [(1, 1.0), (2, -1.0)],
            Jaw::Lower => [(3, 1.0), (4, -1.0)],
        };
        let teeth = quadrants.into_iter().flat_map(|(quadrant, sign)| {
            let seats = arch.plain.half.seats.iter().zip(1u8..);
            seats.map(move |(seat, number)| (10 * quadrant + number, sided(seat.arch_from_tooth(), sign)))
        });
        JawAlone { gum: mesh, gum_colours, teeth: teeth.collect() }
    }
}

impl Jaw {
    fn other(self) -> Jaw {
        match self {
            Jaw::Upper => Jaw::Lower,
            Jaw::Lower => Jaw::Upper,
        }
    }

    fn models(self) -> [Model; 8] {
        match self {
            Jaw::Upper => teeth::UPPER,
            Jaw::Lower => teeth::LOWER,
        }
    }

    fn form(self, plan: &Plan) -> arch::Form {
        let (average, own) = match self {
            Jaw::Upper => (arch::UPPER, plan.upper),
            Jaw::Lower => (arch::LOWER, plan.lower),
        };
        arch::Form { width: own.width.unwrap_or(average.width), depth: own.depth, ..average }
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
struct Arch {
    jaw: Jaw,
    age: Option<f32>,
    /// On which side of x the carved tooth stands: 1 or −1.
    sign: f32,
    /// The side with the carved tooth and the other; each is laid out at x > 0.
    carved: Row,
    plain: Row,
}

/// Half a jaw's teeth.
#[derive(Clone)]
struct Row {
    half: Half,
    models: Vec<Model>,
}

impl Arch {
    /// A jaw of 28 teeth, with room for a carved tooth of its own size; with the third molars where that is one.
    fn with(jaw: Jaw, carved: Option<(&ToothPlace, usize)>, plan: &Plan) -> Arch {
        let count = if carved.is_some_and(|(_, number)| number == 8) { 8 } else { 7 };
        let plain = jaw.models()[..count].to_vec();
        let mut models = plain.clone();
        if let Some((tooth, number)) = carved {
            models[number - 1] = fitting(&models[number - 1], tooth);
        }
        let sign = carved.map_or(1.0, |(tooth, _)| teeth_by_number::distal(tooth.fdi));
        let row = |mut models: Vec<Model>, side: f32| {
            for (index, model) in models.iter_mut().enumerate() {
                let number = jaw.number(side, index);
                let is_carved = side == sign && carved.is_some_and(|(_, carved)| carved == index + 1);
                // The carved one's own crown was measured as it is.
                model.form.aged = plan.age.filter(|_| !is_carved).and_then(|years| Aged::of(number, years));
                model.turn = plan.rotated.iter().find(|(fdi, _)| *fdi == number).map_or(0.0, |(_, degrees)| *degrees);
            }
            let teeth: Vec<(Model, f32)> = models.iter().map(|m| (*m, m.sizes.mesiodistal[0])).collect();
            Row { half: Half::of(jaw.form(plan), &teeth), models }
        };
        if carved.is_none() && plan.rotated.is_empty() {
            let both = row(plain, -sign);
            return Arch { jaw, age: plan.age, sign, carved: both.clone(), plain: both };
        }
        Arch { jaw, age: plan.age, sign, carved: row(models, sign), plain: row(plain, -sign) }
    }

    /// All crowns but those that are taken: on the carved tooth's side or the other, by their place from the midline.
    fn teeth(&self, is_taken: &dyn Fn(bool, usize, &Seat) -> bool) -> Coloured {
        let crowns = rows::each(self.plain.models.len(), |index| crown::crown(&self.plain.models[index]));
        let mut all = Coloured::default();
        for (index, crown) in crowns.iter().enumerate() {
            for (row, is_carved_side) in [(&self.carved, true), (&self.plain, false)] {
                let seat = &row.half.seats[index];
                if is_taken(is_carved_side, index, seat) {
                    continue;
                }
                let pose = seat.arch_from_tooth();
                let sign = if is_carved_side { self.sign } else { -self.sign };
                let side = Vec3::new(sign, 1.0, 1.0);
                all.add(crown, |p| pose * p * side, |n| pose.turn(n) * side, sign < 0.0);
            }
        }
        all
    }

    fn gum(&self, fit: &dyn Fn(Vec3) -> Vec3) -> Coloured {
        let rows = if self.sign > 0.0 { [&self.plain, &self.carved] } else { [&self.carved, &self.plain] };
        let sides = [(rows[0], -1.0), (rows[1], 1.0)];
        let gone = self.age.map_or([0.0; 6], age::recession);
        gum::gum(self.jaw, sides.map(|(row, sign)| Side { half: &row.half, models: &row.models, gone, sign }), fit)
    }
}

/// A pose at x > 0, or its mirror image at x < 0 for a tooth that is a mirror image (in y) too.
fn sided(pose: Pose, sign: f32) -> Pose {
    let across = Mat3::from_diagonal(Vec3::new(sign, 1.0, 1.0));
    let along = Mat3::from_diagonal(Vec3::new(1.0, sign, 1.0));
    let orientation = Quat::from_mat3(&(across * Mat3::from_quat(pose.orientation) * along)).normalize();
    Pose { position: across * pose.position, orientation }
}

/// A table's tooth with the carved one's own crown.
fn fitting(model: &Model, tooth: &ToothPlace) -> Model {
    /// Room between the carved crown and its neighbours on each side, mm.
    const CONTACT: f32 = 0.05;
    let size = tooth.crown_high - tooth.crown_low;
    let share = |of: [f32; 2], now: f32| [now, now * of[1] / of[0]];
    let sizes = Sizes {
        crown: size.z,
        mesiodistal: share(model.sizes.mesiodistal, size.y + 2.0 * CONTACT),
        buccolingual: share(model.sizes.buccolingual, size.x),
        ..model.sizes
    };
    // Front teeth lean as in any jaw; the others stand as upright as their space.
    let lean = if matches!(model.kind, teeth::Kind::Incisor | teeth::Kind::Canine) { model.lean } else { 0.0 };
    Model { sizes, lean, ..*model }
}

/// The opposite jaw's arch space in the near one's when the jaws are closed.
fn closed(near: Jaw, own: &Arch, other: &Arch, class: AngleClassFile) -> Pose {
    let ahead = match class {
        AngleClassFile::I => 0.0,
        AngleClassFile::II => -CUSP,
        AngleClassFile::III => CUSP,
    };
    let (upper, lower) = if near == Jaw::Upper { (own, other) } else { (other, own) };
    let first_molar = |arch: &Arch| arch.plain.half.seats[5].top.y;
    let forward = first_molar(lower) + MOLAR_RELATION + ahead - first_molar(upper);
    // Turned about y by half a turn: left becomes right and up becomes down.
    let orientation = Quat::from_rotation_y(std::f32::consts::PI);
    let lower_from_upper = Pose { position: Vec3::new(0.0, forward, -OVERBITE), orientation };
    if near == Jaw::Upper { lower_from_upper.inverse() } else { lower_from_upper }
}

/// What is touched around the carved tooth, for the drawn jaw to follow.
struct Felt<'a> {
    tooth: &'a ToothPlace,
    shapes: &'a [Shape],
    /// Gum with a margin of its own.
    periodontium: Option<&'a Periodontium>,
    gums: Option<Label>,
    near_from_tooth: Pose,
}

impl Felt<'_> {
    /// True when a touched shape other than gum stands where a crown would.
    /// `sign` is the side of x on which the seat lies.
    fn takes(&self, seat: &Seat, sign: f32) -> bool {
        let middle_in_arch = (seat.top - Vec3::Z * (0.5 * seat.crown)) * Vec3::new(sign, 1.0, 1.0);
        let middle = self.near_from_tooth.inverse() * middle_in_arch;
        self.shapes.iter().any(|shape| Some(shape.label) != self.gums && shape.distance(middle) < TAKEN)
    }

    /// A place of the gum, arch space: near the tooth laid onto the gum that is felt, or just under it where that is a mesh
    /// drawn for itself.
    fn fitted(&self, point_in_arch: Vec3) -> Vec3 {
        /// Gum that lies so much deeper or farther off than what is felt is not meant by it, mm.
        const FAR: [f32; 2] = [3.5, 6.0];
        /// Nor below the first distance under the neck, fully so from the second on, mm.
        const DEEP: [f32; 2] = [6.0, 10.0];
        /// How far under a drawn mesh, mm.
        const UNDER: f32 = 0.4;
        let Some(gum) = self.shapes.iter().find(|shape| Some(shape.label) == self.gums) else { return point_in_arch };
        let ToothPlace { crown_low, crown_high, .. } = *self.tooth;
        let mut point = self.near_from_tooth.inverse() * point_in_arch;
        let aside = (point - point.clamp(crown_low, crown_high)) * Vec3::new(1.0, 1.0, 0.0);
        let deep = crown_low.z - point.z;
        let as_felt = if self.tooth.fdi % 10 <= 3 { AS_FELT_IN_FRONT } else { AS_FELT };
        let near = (1.0 - between(aside.length(), as_felt)) * (1.0 - between(deep, DEEP));
        // A mesh is slow to ask.
        let away = |p: Vec3| self.periodontium.map_or_else(|| gum.distance(p), |own| own.filled_gum(p));
        let share = if near > 0.0 { near * (1.0 - between(away(point).abs(), FAR)) } else { 0.0 };
        if share <= 0.0 {
            return point_in_arch;
        }
        let wanted = if has_own_surface(gum) { -UNDER } else { 0.0 };
        let start = point;
        for _ in 0..3 {
            let (distance, out) = match self.periodontium {
                Some(own) => (own.filled_gum(point), steepest(&|p| own.filled_gum(p), point)),
                None => gum.distance_and_normal(point),
            };
            point -= out * (distance - wanted);
        }
        self.near_from_tooth * start.lerp(point, share)
    }
}

/// The way in which a distance grows, unit.
fn steepest(distance: &dyn Fn(Vec3) -> f32, point: Vec3) -> Vec3 {
    /// mm
    const STEP: f32 = 0.15;
    let along = |axis: Vec3| distance(point + axis * STEP) - distance(point - axis * STEP);
    Vec3::new(along(Vec3::X), along(Vec3::Y), along(Vec3::Z)).normalize_or(Vec3::Z)
}

/// True for what is drawn for itself, the drawn jaw giving way to it.
fn has_own_surface(shape: &Shape) -> bool {
    matches!(shape.form, Form::Mesh(_))
}

/// 0 up to the first bound, 1 from the second on.
fn between(value: f32, [low, high]: [f32; 2]) -> f32 {
    let t = ((value - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
