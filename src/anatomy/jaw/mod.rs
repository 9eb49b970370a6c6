//! The dental arch of one jaw: how its teeth stand, their crowns, and the gingiva over the ridge.
//!
//! *Arch space*: x to the patient's left in the lower jaw and to the right in the upper one, y back from the edges of the
//! central incisors, z occlusal, 0 on the plane through the incisors' edges; right-handed, mm. There stand, at x > 0, the
//! quadrants whose forms are grown as they are written (1 and 3), the mirrored ones (2 and 4) at x < 0.

mod crown;
mod gum;
mod half_arch;
mod occlusion;
mod rubber_dam;
mod tinted_mesh;
mod tooth_model;

use self::crown::CrownDetail;
use self::gum::HalfJaw;
use self::half_arch::{ArchShape, HalfArch};
use self::tooth_model::{ToothKind, ToothModel};
use crate::age;
use crate::age::AgeEffects;
use crate::form::Sizes;
use crate::periodontium::SiteLengths;
use crate::teeth::distal_sign;
use glam::Mat3;
use std::collections::{BTreeMap, BTreeSet};
use typodont_core::aabb::Aabb;
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_core::mesh::Mesh;
use typodont_core::parallel;

pub use self::gum::{GumForm, MucosaRegion, RidgeSide, ridge_tint};
pub use self::half_arch::ToothSeat;
pub use self::occlusion::{CUSP_WIDTH, Occlusion, WORKING_OPENING_DEG};
pub use self::tinted_mesh::{Tint, TintedMesh};

/// Upper or lower jaw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Jaw {
    Upper,
    Lower,
}

impl Jaw {
    pub const BOTH: [Jaw; 2] = [Jaw::Upper, Jaw::Lower];

    /// The jaw of a tooth.
    pub fn of(fdi: u8) -> Jaw {
        if fdi / 10 <= 2 { Jaw::Upper } else { Jaw::Lower }
    }

    pub fn other(self) -> Jaw {
        match self {
            Jaw::Upper => Jaw::Lower,
            Jaw::Lower => Jaw::Upper,
        }
    }

    /// FDI number of the tooth at a place from the midline, 0 to 7, on a side of x, 1 or −1.
    pub fn fdi(self, side: f32, index: usize) -> u8 {
        let quadrant = match (self, side > 0.0) {
            (Jaw::Upper, true) => 1,
            (Jaw::Upper, false) => 2,
            (Jaw::Lower, true) => 3,
            (Jaw::Lower, false) => 4,
        };
        10 * quadrant + index as u8 + 1
    }

    /// FDI numbers of the fourteen teeth of an adult without third molars.
    pub fn teeth_of_adult(self) -> impl Iterator<Item = u8> {
        [1.0, -1.0].into_iter().flat_map(move |side| (0..7).map(move |index| self.fdi(side, index)))
    }

    fn models(self) -> [ToothModel; 8] {
        match self {
            Jaw::Upper => tooth_model::UPPER,
            Jaw::Lower => tooth_model::LOWER,
        }
    }

    fn average_shape(self) -> ArchShape {
        match self {
            Jaw::Upper => half_arch::UPPER,
            Jaw::Lower => half_arch::LOWER,
        }
    }
}

/// Differences from the average arch of an adult.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ArchPlan {
    /// Width between the second molars' centres and depth to them, mm; `None` for the average.
    pub width: Option<f32>,
    pub depth: Option<f32>,
    /// FDI numbers of rotated teeth, each with its rotation, degrees: mesial toward lip or cheek.
    pub rotated: Vec<(u8, f32)>,
    /// Age that teeth and gingiva show, years.
    pub age: Option<f32>,
}

/// A tooth for which the arch leaves room of that tooth's own size.
#[derive(Clone, Copy, Debug)]
pub struct FittedTooth {
    pub fdi: u8,
    /// Size of its crown, mm: buccolingual, mesiodistal, height.
    pub crown: Vec3,
}

/// Teeth and gingiva of one jaw.
pub struct DentalArch {
    jaw: Jaw,
    age: Option<f32>,
    /// On which side of x the fitted tooth stands: 1 or −1.
    sign: f32,
    /// The fitted tooth's place from the midline, 0 to 7.
    fitted_index: Option<usize>,
    /// The side with the fitted tooth and the other; each is laid out at x > 0.
    fitted: ArchSide,
    plain: ArchSide,
}

/// Half a jaw's teeth.
#[derive(Clone)]
struct ArchSide {
    half: HalfArch,
    models: Vec<ToothModel>,
}

impl DentalArch {
    /// An arch with this many teeth on each side: 7, or 8 with third molars. A fitted third molar brings both.
    pub fn new(jaw: Jaw, count: usize, fitted: Option<FittedTooth>, plan: &ArchPlan) -> DentalArch {
        let fitted = fitted.map(|tooth| (tooth, usize::from(tooth.fdi % 10)));
        let count = if fitted.is_some_and(|(_, number)| number == 8) { 8 } else { count.clamp(7, 8) };
        let plain = jaw.models()[..count].to_vec();
        let mut models = plain.clone();
        if let Some((tooth, number)) = fitted {
            models[number - 1] = fitted_model(&models[number - 1], tooth.crown);
        }
        let sign = fitted.map_or(1.0, |(tooth, _)| distal_sign(tooth.fdi));
        let fitted_index = fitted.map(|(_, number)| number - 1);
        let average = jaw.average_shape();
        let shape = ArchShape { width: plan.width.unwrap_or(average.width), depth: plan.depth, ..average };
        let row = |mut models: Vec<ToothModel>, side: f32| {
            for (index, model) in models.iter_mut().enumerate() {
                let fdi = jaw.fdi(side, index);
                let is_fitted = side == sign && fitted.is_some_and(|(_, number)| number == index + 1);
                // The fitted one's own crown was measured as it is.
                model.form.age_effects = plan.age.filter(|_| !is_fitted).and_then(|years| AgeEffects::of(fdi, years));
                model.rotation = plan.rotated.iter().find(|(turned, _)| *turned == fdi).map_or(0.0, |(_, deg)| *deg);
            }
            let teeth: Vec<(ToothModel, f32)> = models.iter().map(|m| (*m, m.sizes.mesiodistal[0])).collect();
            ArchSide { half: HalfArch::new(shape, &teeth), models }
        };
        if fitted.is_none() && plan.rotated.is_empty() {
            let both = row(plain, -sign);
            return DentalArch { jaw, age: plan.age, sign, fitted_index, fitted: both.clone(), plain: both };
        }
        DentalArch { jaw, age: plan.age, sign, fitted_index, fitted: row(models, sign), plain: row(plain, -sign) }
    }

    /// Pose of the arch in which a fitted tooth's crown, a box in tooth space, stands in its seat: `arch_from_tooth`. `None` for a
    /// tooth that the arch has no seat for.
    pub fn arch_from_fitted(&self, fdi: u8, crown: &Aabb) -> Option<Pose> {
        let side = distal_sign(fdi);
        let seat = self.seat(side, usize::from(fdi % 10).checked_sub(1)?)?;
        let anchor = crown.centre().with_z(crown.low.z);
        Some(mirrored_pose(seat.arch_from_tooth(), side) * Pose::at(-anchor))
    }

    /// Puts a tooth where it stands upright in an exercise (`arch_from_tooth`). `index`: its place from the midline, 0 to 7, on a side of x.
    pub fn place(&mut self, side: f32, index: usize, arch_from_tooth: Pose) {
        let row = if side == self.sign { &mut self.fitted } else { &mut self.plain };
        if let Some(seat) = row.half.seats.get_mut(index) {
            seat.place(mirrored_pose(arch_from_tooth, side));
        }
    }

    /// The same arch with all of its teeth felt, and therefore drawn as they are felt.
    pub fn with_felt_teeth(mut self) -> DentalArch {
        let seats = [&mut self.plain, &mut self.fitted].into_iter().flat_map(|side| &mut side.half.seats);
        seats.for_each(|seat| seat.is_felt = true);
        self
    }

    pub fn jaw(&self) -> Jaw {
        self.jaw
    }

    /// The side of x on which the fitted tooth stands, 1 or −1; 1 without one.
    pub fn fitted_side(&self) -> f32 {
        self.sign
    }

    /// Seat of a tooth by its side of x and its place from the midline, 0 to 7, as at x > 0.
    pub fn seat(&self, side: f32, index: usize) -> Option<&ToothSeat> {
        let row = if side == self.sign { &self.fitted } else { &self.plain };
        row.half.seats.get(index)
    }

    /// Pose of each tooth in its own axes (`arch_from_tooth`), with its FDI number, from the midline back: quadrants 1 and 2
    /// or 3 and 4.
    pub fn teeth(&self) -> Vec<(u8, Pose)> {
        let side = |sign: f32| {
            let seats =
                (0..self.plain.half.seats.len()).filter_map(move |index| Some((index, self.seat(sign, index)?)));
            seats.map(move |(index, seat)| (self.jaw.fdi(sign, index), mirrored_pose(seat.arch_from_tooth(), sign)))
        };
        side(1.0).chain(side(-1.0)).collect()
    }

    /// All crowns but those that are left out, by side of x and place from the midline; those beside the fitted tooth in more detail.
    pub fn crowns(&self, is_left_out: &dyn Fn(f32, usize, &ToothSeat) -> bool) -> TintedMesh {
        let recession = self.recession().into_iter().fold(0.0, f32::max);
        let rows = [(&self.fitted, self.sign), (&self.plain, -self.sign)];
        let teeth = rows
            .into_iter()
            .flat_map(|(row, sign)| row.half.seats.iter().enumerate().map(move |(index, seat)| (sign, index, seat)));
        let drawn: Vec<_> = teeth.filter(|&(sign, index, seat)| !is_left_out(sign, index, seat)).collect();
        // Places around the arch, counted from one end to the other.
        let along = |sign: f32, index: usize| if sign < 0.0 { -1 - index as i32 } else { index as i32 };
        let detail = |sign: f32, index: usize| {
            let is_beside =
                self.fitted_index.is_some_and(|fitted| (along(sign, index) - along(self.sign, fitted)).abs() == 1);
            if is_beside { CrownDetail::Near } else { CrownDetail::Far }
        };
        // Twins on both sides share a form.
        let kind = |&(sign, index, seat): &(f32, usize, &ToothSeat)| (index, seat.is_felt, detail(sign, index));
        let kinds: Vec<_> = drawn.iter().map(kind).collect::<BTreeSet<_>>().into_iter().collect();
        let crown = |i: usize| {
            let (index, is_felt, detail) = kinds[i];
            crown::crown(&self.plain.models[index], is_felt, recession, detail)
        };
        let crowns: BTreeMap<_, _> = kinds.iter().zip(parallel::par_map(kinds.len(), crown)).collect();
        let mut all = TintedMesh::default();
        for tooth @ (sign, _, seat) in drawn {
            let pose = seat.arch_from_drawn();
            let side = Vec3::new(sign, 1.0, 1.0);
            all.append(&crowns[&kind(&tooth)], |p| pose * p * side, |n| pose.rotate(n) * side, sign < 0.0);
        }
        all
    }

    /// The gingiva with the palate or the floor of the mouth. `fit` may move each point.
    pub fn gum(&self, form: GumForm, fit: &dyn Fn(Vec3) -> Vec3) -> TintedMesh {
        gum::gum(self.jaw, self.sides(form), form, fit)
    }

    /// A rubber dam over this jaw. `is_isolated`: by side of x and place from the midline.
    pub fn rubber_dam(&self, is_isolated: &dyn Fn(f32, usize) -> bool) -> TintedMesh {
        rubber_dam::rubber_dam(&self.sides(GumForm::Touched), is_isolated)
    }

    /// The gingiva that is touched as closed solids that do not overlap, each of one region of the mucosa.
    pub fn gum_solids(&self) -> Vec<(MucosaRegion, Mesh)> {
        gum::gum_solids(self.jaw, self.sides(GumForm::Touched))
    }

    fn recession(&self) -> SiteLengths {
        self.age.map_or([0.0; 6], age::recession)
    }

    fn sides(&self, form: GumForm) -> [HalfJaw<'_>; 2] {
        let rows = if self.sign > 0.0 { [&self.plain, &self.fitted] } else { [&self.fitted, &self.plain] };
        let recession = self.recession();
        [(rows[0], -1.0), (rows[1], 1.0)].map(|(row, sign)| HalfJaw {
            half: &row.half,
            models: &row.models,
            necks: match form {
                GumForm::Touched => Vec::new(),
                GumForm::Drawn => gum::necks(&row.models),
            },
            recession,
            sign,
        })
    }
}

/// A pose at x > 0, or its mirror image at x < 0 for a tooth that is a mirror image (in y) too.
pub fn mirrored_pose(pose: Pose, sign: f32) -> Pose {
    let across = Mat3::from_diagonal(Vec3::new(sign, 1.0, 1.0));
    let along = Mat3::from_diagonal(Vec3::new(1.0, sign, 1.0));
    let orientation = Quat::from_mat3(&(across * Mat3::from_quat(pose.orientation) * along)).normalize();
    Pose { position: across * pose.position, orientation }
}

/// A table's tooth with a crown of another size.
fn fitted_model(model: &ToothModel, crown: Vec3) -> ToothModel {
    /// Room between the fitted crown and its neighbours on each side, mm.
    const CONTACT: f32 = 0.05;
    let share = |of: [f32; 2], now: f32| [now, now * of[1] / of[0]];
    let sizes = Sizes {
        crown: crown.z,
        mesiodistal: share(model.sizes.mesiodistal, crown.y + 2.0 * CONTACT),
        buccolingual: share(model.sizes.buccolingual, crown.x),
        ..model.sizes
    };
    // Front teeth lean as in any jaw; the others stand as upright as their space.
    let lean = if matches!(model.kind, ToothKind::Incisor | ToothKind::Canine) { model.lean } else { 0.0 };
    ToothModel { sizes, lean, ..*model }
}
