//! The mouth around the teeth that are worked on: both jaws with their teeth and gingiva.
//!
//! A single tooth is left out, and the arch is placed so that its own crown fits the gap. Near the tooth, the drawn
//! jaw follows the gingiva and neighbours that can be touched, so that the picture agrees with the contact. Where a whole
//! arch can be touched, its gingiva is drawn as it is felt.

mod rubber_dam;

use self::rubber_dam::{ISOLATED_BESIDE, RubberDam};
use super::lips::Lips;
use super::oral_cavity::{OralCavity, mucosa_tint};
use super::soft_tissue::YieldingSurface;
use super::surroundings;
use std::sync::Arc;
use typodont_anatomy::jaw::{
    ArchPlan, DentalArch, FittedTooth, GumForm, Jaw, Occlusion, Tint, TintedMesh, ToothSeat, WORKING_OPENING_DEG,
};
use typodont_anatomy::periodontium::Periodontium;
use typodont_anatomy::teeth::distal_sign;
use typodont_core::frame::{Pose, Vec3, smooth_step};
use typodont_core::mesh::Mesh;
use typodont_core::touch::{Collider, ColliderGeometry};
use typodont_core::volume::Label;
use typodont_exercise::catalog::{TissueRole, TissueTable};
use typodont_exercise::scenario::{MouthArches, ToothBounds, Workpiece};
use typodont_render::{Appearance, ENAMEL_GLOSS, MeshInstance, Quadrant, Rgb, VertexTint, Viewpoint};

/// Gloss of wet gingiva, 0 to 1.
const GUM_GLOSS: f32 = 0.175;

/// Distances from the carved tooth's box, mm: up to the first, the gingiva is drawn as it is touched; from the second
/// on, as the jaw has it. Among the front teeth the arch bends away from the straight ridge that is touched, so the
/// distances are shorter there.
const TOUCH_BLEND: [f32; 2] = [6.0, 13.0];
const TOUCH_BLEND_IN_FRONT: [f32; 2] = [2.0, 5.0];
/// The same for gingiva with a modelled margin: beyond the papillae the jaw's own margins follow the teeth better.
const TOUCH_BLEND_WITH_MARGIN: [f32; 2] = [1.5, 4.5];

/// The last tooth from the midline around which the arch bends away from the straight row in which neighbours are touched. There
/// the drawn gingiva keeps to the touched one's form, and neighbours are drawn as they are touched.
const LAST_IN_BEND: u8 = 4;

/// Colours of enamel and gingiva where the table of tissues has none.
const IVORY: Rgb = [0.93, 0.91, 0.86];
const PINK: Rgb = [0.85, 0.53, 0.50];

/// Touched shapes nearer than this to the middle of a crown take its place, mm.
const OCCUPIED_DISTANCE: f32 = 1.0;

/// Both jaws about the teeth that are worked on. Made once for a workpiece; its solids share their meshes.
#[derive(Clone, Debug)]
pub struct Mouth {
    /// The jaw with the teeth that are worked on.
    near: JawMeshes,
    /// `None` where a whole arch can be touched: it lies on the bench, so that nothing is drawn that cannot be felt.
    opposite: Option<JawMeshes>,
    jaw: Jaw,
    world_from_near: Pose,
    occlusion: Occlusion,
    /// Opening at which the opposite jaw can be touched, degrees; `None` where it is only drawn.
    felt_opening: Option<f32>,
    /// Solids that can be touched beside the tooth and are not part of the near jaw's gingiva.
    touched: Vec<MeshInstance>,
    /// Cheek and tongue.
    yielding: Vec<YieldingSurface>,
    /// Solids around the jaws that are seen from in front.
    face: Option<Face>,
    /// True under a rubber dam, which covers the face.
    has_dam: bool,
}

#[derive(Clone, Debug)]
struct Face {
    lips: Lips,
    retractors: Option<MeshInstance>,
    cavity: OralCavity,
}

#[derive(Clone, Debug)]
struct JawMeshes {
    teeth: FinishedMesh,
    gum: FinishedMesh,
}

impl JawMeshes {
    /// `tooth_from_arch`: to the space in which the gingiva's colour varies; any for a jaw that does not meet the touched gingiva.
    fn new(teeth: TintedMesh, mut gum: TintedMesh, tooth_from_arch: Pose, tissues: &TissueTable) -> JawMeshes {
        let colour = |name: &str, otherwise: Rgb| tissues.by_name(name).map_or(otherwise, |e| e.rgb());
        for (place, tint) in gum.mesh.positions.iter().zip(&mut gum.tints) {
            *tint = gum_tint(*tint, tooth_from_arch * *place);
        }
        JawMeshes {
            teeth: FinishedMesh {
                is_enamel: true,
                ..FinishedMesh::new(teeth, colour("neighbour", IVORY), ENAMEL_GLOSS)
            },
            gum: FinishedMesh::new(gum, colour("gingiva", PINK), GUM_GLOSS),
        }
    }

    fn instances(&self, world_from_arch: Pose) -> impl Iterator<Item = MeshInstance> {
        [&self.gum, &self.teeth].into_iter().map(move |mesh| mesh.instance(world_from_arch))
    }
}

/// The tint of an anatomical surface as it is drawn.
pub(super) fn vertex_tint(Tint { colour, stippling }: Tint) -> VertexTint {
    VertexTint { colour, stippling }
}

/// The tint of gingiva at a place in tooth space, redder here and paler there.
pub(super) fn gum_tint(Tint { colour, stippling }: Tint, place_in_tooth: Vec3) -> Tint {
    let local = mucosa_tint(place_in_tooth);
    Tint { colour: std::array::from_fn(|c| colour[c] * local[c]), stippling }
}

/// A mesh with tints, and the finish they are multiplied with.
#[derive(Clone, Debug)]
struct FinishedMesh {
    mesh: Arc<Mesh>,
    vertex_tints: Arc<Vec<VertexTint>>,
    appearance: Appearance,
    is_enamel: bool,
}

impl FinishedMesh {
    fn new(made: TintedMesh, colour: Rgb, gloss: f32) -> FinishedMesh {
        FinishedMesh {
            mesh: Arc::new(made.mesh),
            vertex_tints: Arc::new(made.tints.into_iter().map(vertex_tint).collect()),
            appearance: Appearance { colour, gloss },
            is_enamel: false,
        }
    }

    fn instance(&self, world_from_solid: Pose) -> MeshInstance {
        MeshInstance {
            vertex_tints: self.vertex_tints.clone(),
            is_enamel: self.is_enamel,
            ..MeshInstance::plain(self.mesh.clone(), world_from_solid, self.appearance)
        }
    }
}

impl Mouth {
    /// The jaws for a workpiece with one tooth of FDI 11–48 or a whole arch; `None` for two teeth side by side, which
    /// stand in no jaw.
    pub fn around(workpiece: &Workpiece, tissues: &TissueTable) -> Option<Mouth> {
        let mouth = match (workpiece.tooth_from_arch, &workpiece.teeth[..]) {
            (Some(tooth_from_arch), [first, ..]) => {
                Some(Mouth::around_arch(workpiece, Jaw::of(first.fdi), tooth_from_arch, tissues))
            }
            (None, [tooth, others @ ..]) if workpiece.teeth_in_volume == 1 && !others.is_empty() => {
                Mouth::among_other_teeth(workpiece, tooth, others, tissues)
            }
            (None, [tooth]) if workpiece.own_jaw => Mouth::of_own_jaw(workpiece, tooth, tissues),
            (None, [tooth]) => Mouth::around_tooth(workpiece, tooth, tissues),
            _ => None,
        };
        mouth.map(|mouth| mouth.with_face(workpiece.retractors))
    }

    /// The gingiva of an arch whose teeth are all worked on.
    fn around_arch(workpiece: &Workpiece, jaw: Jaw, tooth_from_arch: Pose, tissues: &TissueTable) -> Mouth {
        let near = workpiece.arch.of_jaw(jaw, workpiece.teeth.iter().map(|tooth| tooth.fdi));
        let other = workpiece.arch.of_jaw(jaw.other(), []);
        Mouth {
            near: JawMeshes::new(TintedMesh::default(), near.gum(GumForm::Touched, &|p| p), tooth_from_arch, tissues),
            opposite: None,
            jaw,
            world_from_near: workpiece.world_from_tooth * tooth_from_arch,
            occlusion: workpiece.arch.occlusion(&near, &other),
            felt_opening: None,
            touched: Vec::new(),
            has_dam: false,
            yielding: Vec::new(),
            face: None,
        }
    }

    /// The jaws of a tooth all of whose others can be touched, and are drawn where they are felt.
    fn among_other_teeth(
        workpiece: &Workpiece,
        tooth: &ToothBounds,
        others: &[ToothBounds],
        tissues: &TissueTable,
    ) -> Option<Mouth> {
        let numbers: Vec<u8> = workpiece.teeth.iter().map(|tooth| tooth.fdi).collect();
        let arches = MouthArches::around_tooth(&workpiece.arch, tooth, &numbers)?;
        let drawn = |arch: &DentalArch, tooth_from_arch: Pose| {
            let is_there = |fdi: u8| others.iter().any(|tooth| tooth.fdi == fdi);
            let crowns = arch.crowns(&|side, index, _| !is_there(arch.jaw().fdi(side, index)));
            JawMeshes::new(crowns, arch.gum(GumForm::Touched, &|p| p), tooth_from_arch, tissues)
        };
        let yielding = workpiece.surroundings.iter().filter_map(|s| YieldingSurface::of(s, workpiece, tissues));
        Some(Mouth {
            near: drawn(&arches.near, arches.tooth_from_near),
            opposite: Some(drawn(&arches.opposite, Pose::IDENTITY)),
            jaw: arches.near.jaw(),
            world_from_near: workpiece.world_from_tooth * arches.tooth_from_near,
            occlusion: workpiece.arch.occlusion(&arches.near, &arches.opposite),
            felt_opening: Some(WORKING_OPENING_DEG),
            touched: Vec::new(),
            has_dam: false,
            yielding: yielding.collect(),
            face: None,
        })
    }

    /// The jaw that an exercise brings along. Its bite is not known: nothing is drawn opposite to it.
    fn of_own_jaw(workpiece: &Workpiece, tooth: &ToothBounds, tissues: &TissueTable) -> Option<Mouth> {
        // Views look along the arch of average form.
        let jaw = Jaw::of(tooth.fdi);
        let plan = &workpiece.arch;
        let fitted = FittedTooth { fdi: tooth.fdi, crown: tooth.crown.size() };
        let near = DentalArch::new(jaw, 7, Some(fitted), &plan.plan(jaw));
        let near_from_tooth = near.arch_from_fitted(tooth.fdi, &tooth.crown)?;
        let nothing = || JawMeshes::new(TintedMesh::default(), TintedMesh::default(), Pose::IDENTITY, tissues);
        let touched = workpiece.surroundings.iter().filter(|shape| {
            surroundings::is_visible(shape, tissues) && YieldingSurface::of(shape, workpiece, tissues).is_none()
        });
        let yielding = workpiece.surroundings.iter().filter_map(|s| YieldingSurface::of(s, workpiece, tissues));
        Some(Mouth {
            near: nothing(),
            opposite: None,
            jaw,
            world_from_near: workpiece.world_from_tooth * near_from_tooth.inverse(),
            occlusion: plan.occlusion(&near, &plan.of_jaw(jaw.other(), [])),
            felt_opening: None,
            touched: touched.map(|shape| surroundings::solid_of_shape(shape, workpiece, tissues)).collect(),
            has_dam: false,
            yielding: yielding.collect(),
            face: None,
        })
    }

    fn around_tooth(workpiece: &Workpiece, tooth: &ToothBounds, tissues: &TissueTable) -> Option<Mouth> {
        let (quadrant, number) = (tooth.fdi / 10, usize::from(tooth.fdi % 10));
        if !(1..=4).contains(&quadrant) || !(1..=8).contains(&number) {
            return None;
        }
        let jaw = Jaw::of(tooth.fdi);
        let plan = &workpiece.arch;
        let fitted = FittedTooth { fdi: tooth.fdi, crown: tooth.crown.size() };
        let mut near = DentalArch::new(jaw, 7, Some(fitted), &plan.plan(jaw));
        let other = plan.of_jaw(jaw.other(), []);
        let sign = distal_sign(tooth.fdi);
        let near_from_tooth = near.arch_from_fitted(tooth.fdi, &tooth.crown)?;
        let tooth_from_near = near_from_tooth.inverse();
        let is_in_bend = tooth.fdi % 10 <= LAST_IN_BEND;
        let neighbours = if is_in_bend { &[][..] } else { &workpiece.neighbours[..] };
        for neighbour in neighbours {
            let index = usize::from(neighbour.fdi % 10) - 1;
            near.place(distal_sign(neighbour.fdi), index, near_from_tooth * neighbour.tooth_from_neighbour);
        }
        let gums = tissues.by_name("gingiva").map(|e| e.label());
        let periodontium = workpiece.periodontium.as_deref();
        let geometry = TouchedGeometry {
            tooth,
            shapes: &workpiece.surroundings,
            periodontium,
            tissues,
            gum_label: gums,
            near_from_tooth,
        };
        let is_neighbour = |fdi: u8| neighbours.iter().any(|neighbour| neighbour.fdi == fdi);
        let is_isolated = |side: f32, index: usize| {
            let place = |side: f32, index: usize| side * (index as f32 + 0.5);
            !workpiece.rubber_dam || (place(side, index) - place(sign, number - 1)).abs() <= ISOLATED_BESIDE
        };
        let is_left_out = |side: f32, index: usize, seat: &ToothSeat| {
            plan.missing.contains(&jaw.fdi(side, index))
                || !is_isolated(side, index)
                || (side == sign && index + 1 == number)
                || (!is_neighbour(jaw.fdi(side, index)) && geometry.occupies(seat, side))
        };
        let is_drawn = |(index, shape): &(usize, &Collider)| {
            let is_soft = tissues.role(shape.label) == Some(TissueRole::Soft);
            // Neighbours with the form of their kind are drawn with the jaw's teeth.
            let is_drawn_with_jaw = neighbours.iter().any(|neighbour| neighbour.collider == *index);
            let is_under_dam = is_soft && workpiece.rubber_dam;
            surroundings::is_visible(shape, tissues)
                && !is_drawn_with_jaw
                && !is_under_dam
                && (!is_soft || has_own_surface(shape))
        };
        let touched = workpiece.surroundings.iter().enumerate().filter(is_drawn).map(|(_, shape)| shape);
        let form = if is_in_bend { GumForm::Touched } else { GumForm::Drawn };
        let dam = workpiece.rubber_dam.then(|| {
            RubberDam::over(&near, sign, &|side, index| {
                is_isolated(side, index) && !plan.missing.contains(&jaw.fdi(side, index))
            })
        });
        let yielding = workpiece.surroundings.iter().filter_map(|s| YieldingSurface::of(s, workpiece, tissues));
        let crowns = near.crowns(&is_left_out);
        let meshes = match &dam {
            Some(dam) => JawMeshes {
                gum: dam.sheet.clone(),
                ..JawMeshes::new(crowns, TintedMesh::default(), tooth_from_near, tissues)
            },
            None => {
                let gum = near.gum(form, &|p| geometry.sink_within_tooth(p));
                JawMeshes::new(crowns, gum, tooth_from_near, tissues)
            }
        };
        let world_from_near = workpiece.world_from_tooth * tooth_from_near;
        let clamp =
            dam.and_then(|dam| dam.clamp).map(|clamp| MeshInstance { world_from_solid: world_from_near, ..clamp });
        Some(Mouth {
            near: meshes,
            opposite: Some(opposite_jaw(workpiece, &other, tissues)),
            jaw,
            world_from_near,
            occlusion: plan.occlusion(&near, &other),
            felt_opening: None,
            touched: touched
                .map(|shape| surroundings::solid_of_shape(shape, workpiece, tissues))
                .chain(clamp)
                .collect(),
            has_dam: workpiece.rubber_dam,
            yielding: yielding.collect(),
            face: None,
        })
    }

    /// Everything but the teeth that are worked on, world space: the mouth open by an angle about the condyles' axis,
    /// degrees, 0 to 35, unless the opposite jaw can be touched where it is; the jaw with these teeth stays where it is.
    pub fn solids(&self, open: f32) -> Vec<MeshInstance> {
        let opposite = self.opposite.iter().flat_map(|jaw| jaw.instances(self.world_from_opposite(open)));
        // The lamp is aimed past the jaw that is not worked on.
        let opposite = opposite.map(|solid| MeshInstance { casts_shadow: false, ..solid });
        let yielding = self.yielding.iter().map(|surface| surface.at_rest().clone());
        let touched = self.touched.iter().cloned().chain(yielding);
        self.near.instances(self.world_from_near).chain(opposite).chain(touched).collect()
    }

    /// Solids around the jaws that an eye in front of the mouth sees: lips with their retractors, cheeks, throat and the tongue at rest.
    /// Nothing where the lips would be in the way of the eye, around a jaw by itself, and where the mouth is open otherwise than
    /// during treatment. `open`: as in [`Mouth::solids`].
    pub fn front_solids(&self, viewpoint: &Viewpoint, open: f32) -> Vec<MeshInstance> {
        let face = self.face.as_ref().filter(|_| open == WORKING_OPENING_DEG);
        let Some((face, lips)) = face.and_then(|face| Some((face, face.lips.seen_from(viewpoint)?))) else {
            return Vec::new();
        };
        let has_tongue = !self.yielding.iter().any(YieldingSurface::is_tongue);
        std::iter::once(lips).chain(face.retractors.clone()).chain(face.cavity.solids(has_tongue)).collect()
    }

    /// Puts a face around both jaws, if both are drawn.
    fn with_face(self, has_retractors: bool) -> Mouth {
        let arches = [self.world_from_near, self.world_from_opposite(WORKING_OPENING_DEG)];
        let front = arches.iter().map(|arch| arch.rotate(Vec3::NEG_Y)).sum::<Vec3>().normalize_or(Vec3::Z);
        let [lower, upper] = if self.jaw == Jaw::Lower { arches } else { [arches[1], arches[0]] };
        let face = (self.opposite.is_some() && !self.has_dam).then(|| {
            let lips = Lips::around([lower, upper].map(|arch| arch.position), front);
            let retractors = has_retractors.then(|| lips.retractors());
            let crowns = [Some(&self.near), self.opposite.as_ref()]
                .into_iter()
                .flatten()
                .flat_map(|jaw| &jaw.teeth.mesh.positions);
            let teeth = crowns.fold([0.0, 0.0], |[aside, back]: [f32; 2], p| [aside.max(p.x.abs()), back.max(p.y)]);
            let cavity = OralCavity::between(lower, upper, &lips, front, teeth);
            Face { lips, retractors, cavity }
        });
        Mouth { face, ..self }
    }

    /// The mouth's solids, made for an opening, as one picture shows them: with those that are seen from in front; without the opposite
    /// jaw, the cheek or the tongue where they hide the work; and with the dent of a working end's ball in soft tissue, its middle in world
    /// space and its radius, mm.
    pub fn seen_from(
        &self,
        solids: &[MeshInstance],
        viewpoint: &Viewpoint,
        open: f32,
        ball: Option<(Vec3, f32)>,
    ) -> Vec<MeshInstance> {
        let mut seen: Vec<MeshInstance> = solids.iter().cloned().chain(self.front_solids(viewpoint, open)).collect();
        self.fit_to_view(&mut seen, viewpoint, open, ball);
        seen
    }

    fn fit_to_view(&self, solids: &mut Vec<MeshInstance>, viewpoint: &Viewpoint, open: f32, ball: Option<(Vec3, f32)>) {
        if let Some(opposite) = self.opposite.as_ref().filter(|_| self.way_past_opposite(viewpoint, open).is_some()) {
            let is_opposite = |solid: &MeshInstance| {
                [&opposite.gum, &opposite.teeth].iter().any(|own| Arc::ptr_eq(&own.mesh, &solid.mesh))
            };
            solids.retain(|solid| !is_opposite(solid));
        }
        for surface in &self.yielding {
            let is_own = |solid: &MeshInstance| Arc::ptr_eq(&solid.mesh, &surface.at_rest().mesh);
            if surface.hides(viewpoint.position, viewpoint.focus) {
                solids.retain(|solid| !is_own(solid));
            } else if let Some(pressed) = ball.and_then(|(middle, radius)| surface.pressed(middle, radius)) {
                solids.iter_mut().filter(|solid| is_own(solid)).for_each(|solid| *solid = pressed.clone());
            }
        }
    }

    /// Plane on the cusps of the opposite jaw, world space, as a point and the unit vector into the mouth, if the eye looks through that
    /// jaw, as from above at an upper tooth, which stands upright; `None` if it does not. What is before the plane is not drawn then.
    pub fn way_past_opposite(&self, viewpoint: &Viewpoint, open: f32) -> Option<(Vec3, Vec3)> {
        /// Extent of a jaw in its arch space, to each side and from before its incisors to the throat, mm.
        const ASIDE: f32 = 38.0;
        const BACK: [f32; 2] = [-10.0, 76.0];
        /// Height above which nothing of the jaw stands, arch space, mm.
        const CUSPS: f32 = 1.5;
        self.opposite.as_ref()?;
        let world_from_opposite = self.world_from_opposite(open);
        let opposite_from_world = world_from_opposite.inverse();
        let [eye, focus] = [viewpoint.position, viewpoint.focus].map(|place| opposite_from_world * place);
        // The mouth is on the occlusal side of the jaw's plane.
        if eye.z >= 0.0 || focus.z <= 0.0 {
            return None;
        }
        let through = eye.lerp(focus, eye.z / (eye.z - focus.z));
        let is_through_jaw = through.x.abs() < ASIDE && (BACK[0]..BACK[1]).contains(&through.y);
        is_through_jaw.then(|| (world_from_opposite * (Vec3::Z * CUSPS), world_from_opposite.rotate(Vec3::Z)))
    }

    /// The same without the opposite jaw: as a model jaw lies on the bench.
    pub fn one_jaw(&self) -> Vec<MeshInstance> {
        self.near.instances(self.world_from_near).chain(self.touched.iter().cloned()).collect()
    }

    /// The arch space of the jaw with the teeth that are worked on, in world space.
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
        self.world_from_near * self.occlusion.near_from_opposite(self.felt_opening.unwrap_or(open))
    }
}

/// One jaw of 28 teeth by itself; arch space, mm.
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
        let arch = DentalArch::new(jaw, 7, None, &ArchPlan { age, ..ArchPlan::default() }).with_felt_teeth();
        let TintedMesh { mesh, tints } = arch.gum(GumForm::Drawn, &|p| p);
        let pink = tissues.by_name("gingiva").map_or(PINK, |e| e.rgb());
        let gum_colours = tints.iter().map(|tint| std::array::from_fn(|c| pink[c] * tint.colour[c])).collect();
        StandaloneJaw { gum: mesh, gum_colours, teeth: arch.teeth() }
    }
}

/// The jaw that is not worked on.
fn opposite_jaw(workpiece: &Workpiece, arch: &DentalArch, tissues: &TissueTable) -> JawMeshes {
    let missing = &workpiece.arch.missing;
    let crowns = arch.crowns(&|side, index, _| missing.contains(&arch.jaw().fdi(side, index)));
    JawMeshes::new(crowns, arch.gum(GumForm::Drawn, &|p| p), Pose::IDENTITY, tissues)
}

/// Colliders around the carved tooth, which the drawn jaw follows.
struct TouchedGeometry<'a> {
    tooth: &'a ToothBounds,
    shapes: &'a [Collider],
    /// Gingiva with a modelled margin, if the exercise has one.
    periodontium: Option<&'a Periodontium>,
    tissues: &'a TissueTable,
    gum_label: Option<Label>,
    near_from_tooth: Pose,
}

impl TouchedGeometry<'_> {
    /// True when a touched shape other than soft tissue stands where a crown would.
    /// `sign` is the side of x on which the seat lies.
    fn occupies(&self, seat: &ToothSeat, sign: f32) -> bool {
        let middle_in_arch = (seat.top - Vec3::Z * (0.5 * seat.crown)) * Vec3::new(sign, 1.0, 1.0);
        let middle = self.near_from_tooth.inverse() * middle_in_arch;
        self.shapes
            .iter()
            .filter(|shape| self.tissues.role(shape.label) != Some(TissueRole::Soft))
            .any(|shape| shape.distance(middle) < OCCUPIED_DISTANCE)
    }

    /// A place of the gum, arch space, as it is drawn: [`TouchedGeometry::fit_to_gum`] around the tooth, and deep within it, where a
    /// cavity would show it, below its neck.
    fn sink_within_tooth(&self, point_in_arch: Vec3) -> Vec3 {
        /// Depths in the tooth, mm, between which the lowering grows from nothing to the whole.
        const WITHIN: [f32; 2] = [0.3, 0.8];
        /// The whole lowering, mm.
        const LOWERED: f32 = 9.0;
        /// Width of the neck, as a share of the crown's.
        const NECK: f32 = 0.7;
        let place = self.near_from_tooth.inverse() * point_in_arch;
        let (half, middle) = (self.tooth.crown.half_size() * NECK, self.tooth.crown.centre());
        let depth = (1.0 - ((place - middle) / half).truncate().length()) * half.x.min(half.y);
        let lowered = LOWERED * rise(depth, WITHIN);
        let fitted = self.fit_to_gum(point_in_arch);
        if lowered > 0.0 { fitted - self.near_from_tooth.rotate(Vec3::Z) * lowered } else { fitted }
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
        /// Least share of a step's direction that is across the arch.
        const ACROSS: f32 = 0.5;
        let Some(gum) = self.shapes.iter().find(|shape| Some(shape.label) == self.gum_label) else {
            return point_in_arch;
        };
        let ToothBounds { crown, .. } = *self.tooth;
        let mut point = self.near_from_tooth.inverse() * point_in_arch;
        let aside = (point - point.clamp(crown.low, crown.high)) * Vec3::new(1.0, 1.0, 0.0);
        let deep = crown.low.z - point.z;
        let as_felt = match self.periodontium {
            _ if self.tooth.fdi % 10 <= 3 => TOUCH_BLEND_IN_FRONT,
            Some(_) if self.tooth.fdi % 10 > LAST_IN_BEND => TOUCH_BLEND_WITH_MARGIN,
            _ => TOUCH_BLEND,
        };
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
            // Across the arch only: along it, columns of the gum's mesh would pass each other.
            let across = out.with_y(0.0);
            point -= across * ((distance - wanted) / across.length_squared().max(ACROSS * ACROSS));
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
