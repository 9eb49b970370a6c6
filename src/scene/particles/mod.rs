//! The operating field: the dust that a bur throws, the water that cools it, the blood of an opened pulp, and the suction that takes
//! all of them away.
//!
//! Takes removed voxels, the pose of the working end and the elapsed time. Gives particles to draw. Never reads a
//! clock, and never affects a tick, a recording or a score: it uses a copy of the volume. The same edits and times give
//! the same particles.

mod bleeding;
mod xorshift;
mod dust;
mod collision;
mod mirror_drops;
mod suction;
mod syringe;
mod water;

pub use collision::CollisionWorld;
pub use suction::{saliva_ejector, suction_tube};
pub use syringe::syringe;

use self::bleeding::Bleeding;
use self::dust::Dust;
use self::mirror_drops::MirrorDrops;
use self::suction::Suction;
use self::water::Water;
use self::xorshift::Xorshift32;
use super::instrument::head_height;
use typodont_core::frame::{Pose, Vec3};
use typodont_core::volume::{Edit, Grid, Label};
use typodont_exercise::catalog::InstrumentEntry;
use typodont_exercise::scenario::OperatingField;
use typodont_render::{LabelPalette, Particle, PlaneMirror, Viewpoint};

/// Length of a step, s: short enough that no chip passes through enamel. The fastest chip moves 2 mm in one step.
const STEP: f32 = 0.004;

/// Longest time between two frames that is simulated, s. A window that was frozen does not catch up.
const MAX_ELAPSED: f32 = 0.1;

/// Water sits so far over its surface, mm.
const WATER_OFFSET: f32 = 0.05;

/// Gravity, mm/s², world space. Down is down on the screen.
const GRAVITY: Vec3 = Vec3::new(0.0, -9810.0, 0.0);

/// Distance from the origin of world space beyond which a particle has left the mouth, mm.
const WORLD_RADIUS: f32 = 60.0;

/// All flying and resting particles, in pools of a fixed size in which the newest replace the oldest.
pub struct ParticleField {
    options: OperatingField,
    drills: Vec<DrillGeometry>,
    suction: Option<Suction>,
    dust: Dust,
    water: Water,
    mirror_drops: MirrorDrops,
    bleeding: Bleeding,
    rng: Xorshift32,
    /// Time that is not yet a whole step, s.
    pending_time: f32,
}

/// Geometry of an instrument's bur and spray.
#[derive(Clone, Copy, Debug, PartialEq)]
struct DrillGeometry {
    cuts: bool,
    /// Of the bur, mm.
    radius: f32,
    /// From the tip to the handpiece's head, from which the water comes, mm.
    height: f32,
}

/// The working end while it runs, world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunningBur {
    /// Pose of the tip, +z along the shaft toward the handle.
    pub world_from_tip: Pose,
    /// mm
    pub radius: f32,
    /// From the tip to where the water comes from, mm.
    pub height: f32,
}

/// Tools in use during a time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tools {
    pub bur: Option<RunningBur>,
    pub assistant: Option<AssistantAction>,
    pub mirror: Option<PlaneMirror>,
}

/// Effect of an assistant's tool on dust and water, world space, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AssistantAction {
    /// Draws them in, in place of the saliva ejector.
    Draw { inlet: Vec3 },
    /// Sprays water toward a place.
    Spray { nozzle: Vec3, aim: Vec3 },
}

impl ParticleField {
    /// An empty field. `suction_inlet` is the position of a suction tip, if there is one, world space, mm; `pulp` is the label of
    /// what bleeds when it is cut, if there is any.
    ///
    /// This function allocates; the other methods do not.
    pub fn new(
        options: OperatingField,
        tray: &[InstrumentEntry],
        suction_inlet: Option<Vec3>,
        pulp: Option<Label>,
    ) -> ParticleField {
        let drill = |entry: &InstrumentEntry| DrillGeometry {
            cuts: entry.is_bur(),
            radius: entry.to_instrument().head_radius(),
            height: head_height(&entry.end),
        };
        ParticleField {
            options,
            drills: tray.iter().map(drill).collect(),
            suction: suction_inlet.filter(|_| options.suction).map(Suction::new),
            dust: Dust::new(),
            water: Water::new(),
            mirror_drops: MirrorDrops::new(),
            bleeding: Bleeding::of(pulp),
            rng: Xorshift32::new(),
            pending_time: 0.0,
        }
    }

    /// An instrument of the tray as a running bur; `None` for an instrument that does not rotate.
    pub fn bur(&self, instrument: usize, world_from_tip: Pose) -> Option<RunningBur> {
        let DrillGeometry { cuts, radius, height } = *self.drills.get(instrument)?;
        cuts.then_some(RunningBur { world_from_tip, radius, height })
    }

    /// Records a changed voxel for the next [`ParticleField::advance`].
    pub fn record_removal(&mut self, edit: &Edit, grid: &Grid) {
        if !edit.removes() {
            return;
        }
        self.bleeding.record_removal(edit, grid);
        if self.options.dust {
            self.dust.add_carved(edit, grid);
        }
    }

    /// Advances the field by a time, s. Chips take the colours of `palette`.
    pub fn advance(
        &mut self,
        seconds: f32,
        Tools { bur, assistant, mirror }: Tools,
        world: &CollisionWorld,
        palette: &LabelPalette,
    ) {
        let ParticleField { options, suction, dust, water, mirror_drops, bleeding, rng, pending_time, .. } = self;
        let bur = bur.as_ref();
        mirror_drops.hold(mirror);
        let held = match assistant {
            Some(AssistantAction::Draw { inlet }) => Some(Suction::new(inlet)),
            _ => None,
        };
        let suction = held.as_ref().or(suction.as_ref());
        let is_wet = options.water_spray && bur.is_some();
        dust.emit(bur, is_wet, world, palette, rng);
        *pending_time += if seconds.is_finite() { seconds.clamp(0.0, MAX_ELAPSED) } else { 0.0 };
        while *pending_time >= STEP {
            *pending_time -= STEP;
            if let Some(bur) = bur.filter(|_| is_wet) {
                water.spray(bur, rng);
            }
            if let Some(AssistantAction::Spray { nozzle, aim }) = assistant {
                water.jet(nozzle, aim, rng);
            }
            bleeding.step(water, world, rng);
            water.step_flying(world, suction, (&mut *dust, &mut *mirror_drops), rng);
            let is_drawn = |place| suction.is_some_and(|suction| suction.captures(place, place));
            mirror_drops.step(|place| air_velocity(place, suction, assistant), is_drawn);
            water.step_lying(world, suction);
            dust.step(world, suction);
            if let Some(bur) = bur {
                dust.disturb(bur, rng);
            }
        }
    }

    /// Number of particles that are to be drawn anew in the next picture, or 1 while blood flows: none for blood that has come to rest.
    pub fn moving_count(&self) -> usize {
        self.dust.particles().count()
            + self.water.moving_count()
            + self.mirror_drops.moving_count()
            + usize::from(self.bleeding.is_flowing())
    }
}

/// The particles of a field as one viewpoint sees them, in buffers that are kept from image to image.
pub struct VisibleParticles {
    opaque: Vec<Particle>,
    translucent: Vec<Particle>,
}

impl Default for VisibleParticles {
    fn default() -> VisibleParticles {
        VisibleParticles {
            opaque: Vec::with_capacity(dust::MAX_CHIPS),
            translucent: Vec::with_capacity(water::MAX_PARTICLES + mirror_drops::MAX_DROPS),
        }
    }
}

impl VisibleParticles {
    /// Takes over the particles of a field, sorted for a viewpoint. Does not allocate.
    pub fn update(&mut self, field: &ParticleField, viewpoint: &Viewpoint) {
        self.opaque.clear();
        self.opaque.extend(field.dust.particles());
        self.translucent.clear();
        self.translucent.extend(field.water.particles().chain(field.mirror_drops.particles()));
        let forward = viewpoint.focus - viewpoint.position;
        let depth = |particle: &Particle| (particle.position - viewpoint.position).dot(forward);
        self.translucent.sort_unstable_by(|a, b| depth(b).total_cmp(&depth(a)));
    }

    /// The dust.
    pub fn opaque(&self) -> &[Particle] {
        &self.opaque
    }

    /// The water, the farthest first.
    pub fn translucent(&self) -> &[Particle] {
        &self.translucent
    }
}

/// Velocity of the air that suction and an assistant's syringe move, mm/s.
fn air_velocity(place: Vec3, suction: Option<&Suction>, assistant: Option<AssistantAction>) -> Vec3 {
    let drawn = suction.map_or(Vec3::ZERO, |suction| suction.air_velocity(place));
    match assistant {
        Some(AssistantAction::Spray { nozzle, aim }) => drawn + syringe::air_velocity(nozzle, aim, place),
        _ => drawn,
    }
}

/// The velocity after a step under weight and the drag of air that moves itself: `time` is that in which a thing of its size
/// takes on the air's velocity, s (Stokes: density times diameter squared by 18 times the air's viscosity).
fn apply_drag(velocity: Vec3, air: Vec3, time: f32) -> Vec3 {
    (velocity + (GRAVITY + air / time) * STEP) / (1.0 + STEP / time)
}

#[cfg(test)]
mod tests {
    use super::*;
    use typodont_core::volume::{Volume, Voxel};
    use typodont_exercise::catalog::InstrumentTable;
    use typodont_formats::Library;

    const ALL: OperatingField = OperatingField { dust: true, water_spray: true, suction: true };
    const DUST: OperatingField = OperatingField { dust: true, water_spray: false, suction: false };

    fn viewpoint() -> Viewpoint {
        Viewpoint::look_at(Vec3::Z * 50.0, Vec3::ZERO, Vec3::Y)
    }

    fn visible(field: &ParticleField) -> VisibleParticles {
        let mut visible = VisibleParticles::default();
        visible.update(field, &viewpoint());
        visible
    }

    fn tray() -> Vec<InstrumentEntry> {
        let table = InstrumentTable::read(&Library::shipped()).unwrap();
        ["round_bur_014", "explorer"].map(|id| table.by_id(id).unwrap().clone()).into()
    }

    /// World space is tooth space with y up, and the shaft of the bur stands upright.
    fn upright(position: Vec3) -> Pose {
        Pose { position, orientation: typodont_core::frame::Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2) }
    }

    fn palette() -> LabelPalette {
        LabelPalette::from_colours(|label| [[0.0; 3], [0.9, 0.8, 0.5]][usize::from(label.0.min(1))], 0.1)
    }

    /// All that is below a plane, with a round pit of 2 mm in its middle.
    fn slab() -> Volume {
        let grid = Grid::centred([101, 33, 101], Vec3::splat(0.25));
        Volume::from_distance(grid, 0.4, |p| (p.y.max(2.0 - p.length()), Label(1)))
    }

    /// Position of the bur's work: near the bottom of the pit.
    const AT_WORK: Vec3 = Vec3::new(0.0, -1.5, 0.0);

    fn ground(volume: &Volume) -> CollisionWorld<'_> {
        CollisionWorld { volume, world_from_tooth: Pose::IDENTITY, obstacles: &[] }
    }

    /// Takes a ball of matter away and tells the field of it.
    fn carve(volume: &mut Volume, field: &mut ParticleField, middle: Vec3, radius: f32) {
        let grid = *volume.grid();
        let [xs, ys, zs] = grid.cells_within(middle - radius, middle + radius);
        for z in zs {
            for y in ys.clone() {
                for x in xs.clone() {
                    if grid.centre([x, y, z]).distance(middle) < radius {
                        let edit = volume.set_cell([x, y, z], Voxel::AIR);
                        field.record_removal(&edit, &grid);
                    }
                }
            }
        }
    }

    /// Works in the pit for a while with what the field's options leave out of water, and lets the dust come down.
    fn grind(volume: &mut Volume, field: &mut ParticleField) {
        for round in 0..12 {
            let angle = 0.5 * round as f32;
            let aside = Vec3::new(libm::cosf(angle), 0.0, libm::sinf(angle)) * 0.8;
            let bur = field.bur(0, upright(AT_WORK + aside)).unwrap();
            carve(volume, field, AT_WORK + aside, 1.0);
            field.dust.emit(Some(&bur), false, &ground(volume), &palette(), &mut field.rng);
            field.advance(0.05, Tools::default(), &ground(volume), &palette());
        }
        for _ in 0..10 {
            field.advance(0.1, Tools::default(), &ground(volume), &palette());
        }
    }

    #[test]
    fn dust_leaves_the_rim_the_way_it_turns_and_up_the_flutes() {
        // Aim: momentum. Method: seen from the handpiece a bur turns clockwise; what it cuts at its +x side, seen from above
        // with the user at +z, must leave toward the user, and upward.
        let (mut volume, mut field) = (slab(), ParticleField::new(DUST, &tray(), None, None));
        let bur = field.bur(0, upright(Vec3::new(5.0, 0.2, 0.0))).unwrap();
        carve(&mut volume, &mut field, Vec3::new(5.7, -0.2, 0.0), 0.5);
        field.advance(0.0, Tools { bur: Some(bur), ..Tools::default() }, &ground(&volume), &palette());
        let mean = field.dust.mean_velocity();
        assert!(mean.z > 100.0 && mean.z > 2.0 * mean.x.abs() && mean.y > 50.0, "{mean}");
    }

    #[test]
    fn dust_has_the_colour_in_which_its_tissue_is_shown() {
        // Aim: decay that an exercise hides does not give itself away by its dust. Method: the palette decides, and chips are
        // paler than it by a little, as powder is.
        let (mut volume, mut field) = (slab(), ParticleField::new(DUST, &tray(), None, None));
        let bur = field.bur(0, upright(AT_WORK)).unwrap();
        carve(&mut volume, &mut field, AT_WORK, 1.0);
        field.advance(0.0, Tools { bur: Some(bur), ..Tools::default() }, &ground(&volume), &palette());
        let seen = visible(&field);
        assert!(seen.opaque().len() > 20);
        let shown = palette().appearance(Label(1)).colour;
        for grain in seen.opaque() {
            let colour = grain.appearance.colour;
            assert!((0..3).all(|c| (0.0..0.3).contains(&(colour[c] - shown[c]))), "{colour:?}");
        }
    }

    #[test]
    fn dust_comes_to_lie_on_the_tooth_and_falls_when_that_is_carved_away() {
        // Aim: chips stay on surfaces, never inside them, and only while there is one.
        let (mut volume, mut field) = (slab(), ParticleField::new(DUST, &tray(), None, None));
        grind(&mut volume, &mut field);
        let lying: Vec<Vec3> = field.dust.resting_positions().collect();
        assert!(lying.len() > 30, "{} chips lie", lying.len());
        for place in &lying {
            let near = (0..6).map(|n| Vec3::AXES[n / 2] * if usize::is_multiple_of(n, 2) { 0.35 } else { -0.35 });
            let most = near.map(|aside| volume.density_at(*place + aside)).fold(0.0, f32::max);
            assert!(volume.density_at(*place) < 0.5 && most > 0.3, "{place}: {most}");
        }
        for index in 0..volume.grid().len() {
            volume.set(index, Voxel::AIR);
        }
        for _ in 0..20 {
            field.advance(0.1, Tools::default(), &ground(&volume), &palette());
        }
        assert_eq!(field.dust.resting_positions().count(), 0, "without a tooth all of it has fallen out of the mouth");
    }

    #[test]
    fn a_syringe_washes_away_the_dust_that_hides_the_work() {
        // Aim: an assistant's water is matter: it clears what rests on the tooth, and nothing does without it. Method: dust of
        // dry grinding; half a second without water, then a syringe over it for a second, and two more in which it runs off.
        let (mut volume, mut field) = (slab(), ParticleField::new(DUST, &tray(), None, None));
        grind(&mut volume, &mut field);
        let lying = |field: &ParticleField| {
            field.dust.resting_positions().filter(|place| place.distance(AT_WORK) < 3.0).count()
        };
        let before = lying(&field);
        let spray = AssistantAction::Spray { nozzle: AT_WORK + Vec3::new(2.0, 8.0, 0.0), aim: AT_WORK };
        for _ in 0..5 {
            field.advance(0.1, Tools::default(), &ground(&volume), &palette());
        }
        let waited = lying(&field);
        for round in 0..30 {
            let assistant = (round < 10).then_some(spray);
            field.advance(0.1, Tools { assistant, ..Tools::default() }, &ground(&volume), &palette());
        }
        let washed = lying(&field);
        assert!(before > 20 && waited * 10 > before * 9, "{before} chips, {waited} after waiting");
        assert!(washed * 4 < before, "{washed} of {before} chips are left under the jet");
    }

    #[test]
    fn there_is_never_more_than_the_pools_hold_and_nothing_is_allocated() {
        // Aim: a bound on number and on memory. Method: far more is carved and sprayed than there is room for.
        let far_off = Some(Vec3::new(30.0, 0.0, 0.0));
        let volume = slab();
        let [mut wet, mut dry] = [ALL, DUST].map(|options| ParticleField::new(options, &tray(), far_off, None));
        // Matter that stood over the plane, in no order.
        let grid = *volume.grid();
        let over: Vec<usize> = (0..grid.len()).filter(|i| grid.centre(grid.cell(*i)).y > 0.3).collect();
        let before = Voxel { density: typodont_core::volume::Density::FULL, label: Label(1) };
        // Over a flat place, where water spreads.
        let bur = wet.bur(0, upright(Vec3::new(6.0, 0.6, 0.0))).unwrap();
        let palette = palette();
        let (viewpoint, mut seen) = (viewpoint(), VisibleParticles::default());
        let mirror = level_mirror(Vec3::new(12.0, 4.0, 0.0));
        let rinsing = AssistantAction::Spray { nozzle: Vec3::new(12.0, 22.0, 0.0), aim: Vec3::new(12.0, 4.0, 0.0) };
        let counted = allocation_counter::measure(|| {
            for round in 0..100 {
                for field in [&mut wet, &mut dry] {
                    for n in 0..400 {
                        let index = over[(round * 104_729 + n * 7919) % over.len()] as u32;
                        field.record_removal(&Edit { index, before, after: Voxel::AIR }, &grid);
                    }
                    let tools = Tools { bur: Some(bur), mirror: Some(mirror), assistant: Some(rinsing) };
                    field.advance(0.1, tools, &ground(&volume), &palette);
                    seen.update(field, &viewpoint);
                }
            }
        });
        assert_eq!(counted.count_total, 0, "allocations");
        let chips = visible(&dry).opaque().len();
        assert!((1800..=dust::MAX_CHIPS).contains(&chips), "{chips} chips of nearly ten thousand");
        let drops = visible(&wet).translucent().len();
        assert!((50..=water::MAX_PARTICLES).contains(&drops), "{drops} drops");
    }

    /// A mirror that looks up.
    fn level_mirror(position: Vec3) -> PlaneMirror {
        PlaneMirror { world_from_mirror: upright(position), radius: 9.0, reflectance: 0.8 }
    }

    #[test]
    fn a_syringe_wets_a_mirror_from_afar_and_dries_it_nearby_and_so_does_suction() {
        // Aim: drops come from spray and go by air. Method: a syringe sprays a level mirror from 14 mm; drops lie on it. Beside it from 4 mm
        // it drives off those before its nozzle; suction held to a drop takes it; what else there is stays.
        let volume = slab();
        let at = Vec3::new(0.0, 6.0, 0.0);
        let mirror = Some(level_mirror(at));
        let mut field = ParticleField::new(ALL, &tray(), None, None);
        let mut after = |seconds: usize, assistant: Option<AssistantAction>| -> Vec<Vec3> {
            let tools = Tools { assistant, mirror, ..Tools::default() };
            (0..50 * seconds).for_each(|_| field.advance(0.02, tools, &ground(&volume), &palette()));
            field.mirror_drops.particles().map(|drop| drop.position).collect()
        };
        let spray = |nozzle: Vec3, aim: Vec3| Some(AssistantAction::Spray { nozzle, aim });
        after(1, spray(at + Vec3::Y * 14.0, at));
        let wet = after(1, None);
        assert!(wet.len() > 5 && wet.iter().all(|p| (p.y - at.y - WATER_OFFSET).abs() < 1e-3), "{} drops", wet.len());
        assert_eq!(after(1, None), wet, "they stay");
        let drawn = wet[0];
        let left = after(1, Some(AssistantAction::Draw { inlet: drawn + Vec3::Y }));
        assert!(!left.contains(&drawn) && left.len() < wet.len());
        let near = left.iter().copied().min_by(|a, b| a.distance(at).total_cmp(&b.distance(at)));
        let Some(near) = near else { panic!("suction took all") };
        let blown = after(1, spray(near + Vec3::new(1.0, 4.0, 0.0), near));
        assert!(!blown.contains(&near));
    }

    #[test]
    fn water_washes_dust_away_and_leaves_a_pool_that_suction_clears() {
        // Aim: the three options work on each other. Method: the same dust lies in a pit; with spray less of it is left than
        // without; when the drill stops, the water stays without suction and goes with it.
        let worked = |options: OperatingField| {
            let (mut volume, mut field) =
                (slab(), ParticleField::new(options, &tray(), Some(Vec3::new(4.0, 3.5, 0.0)), None));
            grind(&mut volume, &mut field);
            let in_pit =
                |field: &ParticleField| field.dust.resting_positions().filter(|p| p.distance(AT_WORK) < 2.5).count();
            let before = in_pit(&field);
            let bur = field.bur(0, upright(AT_WORK)).unwrap();
            for _ in 0..30 {
                field.advance(0.1, Tools { bur: Some(bur), ..Tools::default() }, &ground(&volume), &palette());
            }
            let (after, wet) = (in_pit(&field), field.water.lying_mm3());
            for _ in 0..30 {
                field.advance(0.1, Tools::default(), &ground(&volume), &palette());
            }
            (before, after, wet, field.water.lying_mm3())
        };
        let (_, dry, none, _) = worked(DUST);
        let (before, after, wet, still_wet) = worked(OperatingField { suction: false, ..ALL });
        let (_, _, _, drawn) = worked(ALL);
        println!(
            "{before} chips, then {after}, or {dry} without water; {wet} mm³, then {still_wet}, or {drawn} with suction"
        );
        assert!(after * 3 < dry, "{after} chips are left, and {dry} without water");
        assert!(none == 0.0 && wet > 0.5 && still_wet > 0.7 * wet, "{wet} mm³ of water, then {still_wet}");
        assert!(drawn < 0.1 * still_wet, "{drawn} mm³ with suction, {still_wet} without");
    }

    #[test]
    fn dust_clouds_the_water_that_washes_it_away_and_fresh_water_thins_it() {
        // Aim: slurry where something was cut under spray, and clear water elsewhere. Method: the same pit under spray with its dust
        // and without; then as long again without cutting.
        let after = |dust: bool| {
            let options = OperatingField { dust, water_spray: true, suction: false };
            let (mut volume, mut field) = (slab(), ParticleField::new(options, &tray(), None, None));
            grind(&mut volume, &mut field);
            let bur = field.bur(0, upright(AT_WORK)).unwrap();
            let carved = visible(&field).opaque().len() as f32 * dust::CHIP_VOLUME;
            [5, 60].map(|frames| {
                (0..frames).for_each(|_| {
                    field.advance(0.1, Tools { bur: Some(bur), ..Tools::default() }, &ground(&volume), &palette())
                });
                let lying = field.water.lying_dust_mm3();
                assert!(lying <= carved, "{lying} of {carved} mm³");
                lying / field.water.lying_mm3()
            })
        };
        let [[soon, later], clear] = [true, false].map(after);
        assert!(soon > 0.01 && later < 0.5 * soon, "{soon}, then {later}");
        assert_eq!(clear, [0.0; 2]);
    }

    #[test]
    fn an_opened_pulp_bleeds_into_the_cavity_until_the_blood_clots() {
        // Aim: who opens the pulp sees it, and who does not sees no blood. Method: the same cut through matter that is pulp and
        // that is not; blood gathers in the pit, is the same after a minute as after half of it, and is thinned and washed out by a
        // spray.
        const NONE: OperatingField = OperatingField { dust: false, water_spray: false, suction: false };
        let bled = |pulp: Label| {
            let options = OperatingField { water_spray: true, ..NONE };
            let (mut volume, mut field) = (slab(), ParticleField::new(options, &tray(), None, Some(pulp)));
            carve(&mut volume, &mut field, AT_WORK, 0.8);
            let spraying = field.bur(0, upright(AT_WORK)).unwrap();
            let mut after = |seconds: usize, bur: Option<RunningBur>| {
                (0..10 * seconds)
                    .for_each(|_| field.advance(0.1, Tools { bur, ..Tools::default() }, &ground(&volume), &palette()));
                let red = visible(&field).translucent().iter().filter(|p| p.appearance.colour[1] < 0.2).count();
                (field.water.lying_blood_mm3(), red, field.moving_count())
            };
            [after(2, None), after(28, None), after(30, None), after(10, Some(spraying))]
        };
        let sound = bled(Label(2));
        assert!(sound.iter().all(|(blood, red, _)| *blood == 0.0 && *red == 0), "{sound:?}");
        let [(soon, seen, flowing), (later, ..), (last, _, at_rest), (washed, ..)] = bled(Label(1));
        println!("{soon}, {later}, {last} and {washed} mm³ of blood; {seen} patches and drops at first");
        assert!(soon > 0.5 && seen > 0 && flowing > 0, "{soon} mm³, {seen} to be seen, {flowing} moving");
        assert!(later > 2.0 * soon && (last - later).abs() < 0.02 * later, "{soon}, {later}, {last} mm³");
        assert_eq!(at_rest, 0, "a clot needs no new picture");
        assert!(washed < 0.7 * last, "{washed} of {last} mm³ under water");
    }

    #[test]
    fn suction_takes_dust_that_is_near_its_mouth() {
        let mouth = Vec3::new(2.0, 1.0, 0.0);
        let left = |options| {
            let (mut volume, mut field) = (slab(), ParticleField::new(options, &tray(), Some(mouth), None));
            grind(&mut volume, &mut field);
            field.dust.resting_positions().filter(|place| place.distance(mouth) < 3.5).count()
        };
        let (dusty, clean) = (left(DUST), left(OperatingField { suction: true, ..DUST }));
        assert!(dusty > 5 && clean == 0, "{dusty} chips without suction, {clean} with it");
    }

    #[test]
    fn the_same_edits_and_times_give_the_same_specks() {
        // Aim: nothing looks at a clock or at true chance. Method: twice the same; then the same time in other pictures.
        let run = |times: &[f32]| {
            let (mut volume, mut field) =
                (slab(), ParticleField::new(ALL, &tray(), Some(Vec3::new(9.0, 3.0, 0.0)), None));
            let bur = field.bur(0, upright(AT_WORK)).unwrap();
            carve(&mut volume, &mut field, AT_WORK, 1.0);
            times.iter().for_each(|s| {
                field.advance(*s, Tools { bur: Some(bur), ..Tools::default() }, &ground(&volume), &palette())
            });
            let seen = visible(&field);
            (seen.opaque().to_vec(), seen.translucent().to_vec())
        };
        // Whole sixteenths, so that no time is lost by rounding.
        let seldom = run(&[0.0625; 2]);
        assert!(seldom == run(&[0.0625; 2]) && !seldom.1.is_empty());
        assert!(seldom == run(&[0.03125; 4]), "how often a picture is drawn changes nothing");
    }

    #[test]
    fn an_explorer_neither_turns_nor_sprays() {
        let field = ParticleField::new(ALL, &tray(), None, None);
        assert_eq!(field.bur(1, Pose::IDENTITY), None);
        assert!(field.bur(0, Pose::IDENTITY).is_some_and(|bur| bur.radius > 0.5 && bur.height > 5.0));
    }
}
