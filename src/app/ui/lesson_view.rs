//! The picture of a lesson: drawn again only when something in it has changed.

use crate::command::{AppCommand, PracticeCommand};
use crate::lesson_scene::{DisplayMode, LessonScene, VolumeSource};
use crate::lesson_state::LessonState;
use crate::settings::Settings;
use crate::snapshot::InstrumentPose;
use crate::ui::section_view::SectionImage;
use crate::ui::view_refresh::{Redraw, ViewInputs, ViewRefresh};
use crate::ui::viewport::{EyeWindow, Viewport};
use eframe::egui;
use std::f32::consts::TAU;
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_devices::servo::SecondHandRole;
use typodont_render::{Background, Changes, Lights, MeshInstance, RenderError, RenderScene, Viewpoint, VolumeInstance};
use typodont_scene as scene;
use typodont_scene::particles;
use typodont_scene::particles::{ParticleField, VisibleParticles};

/// The last picture of a lesson.
#[derive(Default)]
pub struct LessonView {
    refresh: ViewRefresh,
    /// The values that the renderer has of the volume, but for the edits that the scene lists as not drawn.
    uploaded: Option<VolumeSource>,
    particles: VisibleParticles,
    bur: BurRotation,
    /// Last image of the section through the working end.
    pub section: Option<SectionImage>,
}

/// Rotation of the bur that is drawn, which goes on while it cuts.
#[derive(Clone, Copy, Debug, Default)]
struct BurRotation {
    /// Share of a turn.
    turn: f32,
    /// Time of the last frame, and time until which the bur turns, s.
    now: f64,
    turns_until: f64,
}

impl BurRotation {
    /// Takes over the time of a frame.
    fn advance(&mut self, now: f64, is_cutting: bool) {
        /// Turns per second: so slow that the blades do not seem to turn backwards at 24 frames per second.
        const RATE: f32 = 1.2;
        /// Time after which a bur that does not cut any more stands still, s: some ticks between two that cut do not.
        const RUN_ON: f64 = 0.1;
        /// Longest frame, s.
        const FRAME: f64 = 0.1;
        if is_cutting {
            self.turns_until = now + RUN_ON;
        }
        if now < self.turns_until {
            self.turn = (self.turn + RATE * (now - self.now).clamp(0.0, FRAME) as f32).fract();
        }
        self.now = now;
    }
}

/// Cost of the pictures as they are drawn now.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PictureCost {
    /// Number of pictures per second of a changing view, smoothed.
    pub frames_per_second: f64,
    pub has_shadows: bool,
    /// True if edges are smoothed.
    pub is_smooth: bool,
    pub has_depth_of_field: bool,
    /// Share of the view's width and height at which a changing view is drawn.
    pub share_while_changing: f32,
    /// Name of the graphics processor, or of the software in its place.
    pub adapter: String,
}

/// The picture that a frame asks for: its size, pixels, and the time of the frame, s.
#[derive(Clone, Copy)]
pub struct PictureFrame {
    pub size: [u32; 2],
    pub now: f64,
}

impl LessonView {
    /// True if the tooth has been drawn.
    pub fn has_volume(&self) -> bool {
        self.uploaded.is_some()
    }

    /// The particles of the last picture.
    pub fn particles(&self) -> &VisibleParticles {
        &self.particles
    }

    /// True if the view has changed a moment before `now`, s, so that the next frame should come soon.
    pub fn is_active(&self, now: f64) -> bool {
        self.refresh.is_active(now)
    }

    /// Returns what the pictures cost, and what they leave out where they are slow.
    pub fn picture_cost(&self, settings: &Settings, viewport: Option<&Viewport>) -> PictureCost {
        PictureCost {
            frames_per_second: self.refresh.frames_per_second(),
            has_shadows: viewport.is_some_and(|viewport| self.has_shadows(settings, viewport)),
            is_smooth: viewport.is_some_and(|viewport| settings.is_smooth(viewport.has_graphics())),
            has_depth_of_field: settings.depth_of_field,
            share_while_changing: self.refresh.share_while_changing(),
            adapter: viewport.map(Viewport::adapter).unwrap_or_default(),
        }
    }

    /// Draws the lesson's scene if the last picture is not right any more; `None` before it is built.
    ///
    /// # Errors
    /// When the picture cannot be drawn; the next frame tries again.
    pub fn draw(
        &mut self,
        lesson: &LessonState,
        settings: &Settings,
        viewport: &mut Viewport,
        frame: PictureFrame,
        commands: &mut Vec<AppCommand>,
    ) -> Result<Option<egui::TextureId>, RenderError> {
        let Some(scene) = &lesson.scene else { return Ok(None) };
        let particle_count = scene.particles.as_ref().map_or(0, ParticleField::moving_count);
        let stereo = [settings.stereo(), settings.second_eye()];
        // What cuts changes the picture anyhow: the rotation alone asks for none.
        self.bur.advance(frame.now, lesson.snapshot.is_some_and(|seen| seen.cutting));
        let inputs = ViewInputs {
            size: frame.size,
            orbit: lesson.orbit,
            mode: lesson.display_mode,
            instrument: lesson.snapshot.as_ref().map(InstrumentPose::from),
            assistant: lesson.snapshot.and_then(|seen| seen.assistant),
            edit_count: scene.edit_count,
            appearance_count: scene.appearance_count,
            stereo,
            second_size: second_size(settings, viewport, frame.size),
            is_smooth: settings.is_smooth(viewport.has_graphics()),
            has_shadows: self.has_shadows(settings, viewport),
            has_relief: self.is_quick(viewport),
            has_depth_of_field: settings.depth_of_field,
            is_left_handed: settings.left_handed,
            particle_count,
        };
        let is_moving = particle_count > 0 && !lesson.is_standing_still();
        // In stereo each pixel may belong to one eye.
        let may_be_coarse = stereo == [None, None];
        let share = match self.refresh.plan(inputs, is_moving, may_be_coarse, frame.now) {
            Redraw::Keep if let Some(texture) = viewport.texture() => return Ok(Some(texture)),
            Redraw::Keep => 1.0,
            Redraw::At(share) => share,
        };
        let size = frame.size.map(|pixels| (share * pixels as f32).ceil() as u32);
        let drawn = self.draw_scene(lesson, scene, settings, viewport, size);
        // After a failed frame the whole volume is sent to the renderer again, since its changes were lost.
        self.uploaded = drawn.is_ok().then(|| scene.volume_source(lesson.display_mode));
        match drawn {
            Ok(_) => commands.push(AppCommand::Practice(PracticeCommand::PictureDrawn)),
            Err(_) => self.refresh.invalidate(),
        }
        drawn.map(Some)
    }

    fn has_shadows(&self, settings: &Settings, viewport: &Viewport) -> bool {
        settings.has_shadows(self.is_quick(viewport))
    }

    /// True where a graphics processor draws, and has been quick enough so far.
    fn is_quick(&self, viewport: &Viewport) -> bool {
        viewport.has_graphics() && !self.refresh.has_been_slow()
    }

    fn draw_scene(
        &mut self,
        lesson: &LessonState,
        lesson_scene: &LessonScene,
        settings: &Settings,
        viewport: &mut Viewport,
        size: [u32; 2],
    ) -> Result<egui::TextureId, RenderError> {
        let (viewpoint, mode) = (lesson.orbit.viewpoint(), lesson.display_mode);
        let (source, is_radiograph) = (lesson_scene.volume_source(mode), mode == DisplayMode::Xray);
        if let Some(field) = &lesson_scene.particles {
            self.particles.update(field, &viewpoint);
        }
        let mut scene = RenderScene {
            tooth: Some(VolumeInstance {
                volume: lesson_scene.volume_of(source),
                changes: match self.uploaded == Some(source) {
                    true => Changes::Bricks(&lesson_scene.undrawn),
                    false => Changes::All,
                },
                world_from_tooth: lesson_scene.workpiece.world_from_tooth,
                palette: &lesson_scene.palette,
                unworked_tooth: Some(lesson_scene.unworked_tooth(&lesson.scenario.tissues)),
                mode: lesson_scene.render_mode(mode),
            }),
            solids: solids(lesson, lesson_scene, settings, &viewpoint, self.bur.turn),
            opaque_particles: self.particles.opaque(),
            translucent_particles: self.particles.translucent(),
            mirror: lesson.mirror(),
            lights: Lights::along(&viewpoint),
            shadows: self
                .has_shadows(settings, viewport)
                .then(|| scene::shadow_region(&lesson_scene.workpiece, &lesson.orbit)),
            relief_seed: self.is_quick(viewport).then(|| scene::relief_seed(&lesson.scenario)),
            background: if is_radiograph { Background::plain([0.0; 3]) } else { Background::default() },
            lens: settings.depth_of_field.then(|| scene::camera_lens(&lesson.orbit)),
            is_antialiased: settings.is_smooth(viewport.has_graphics()),
        };
        let drawn = viewport.draw(EyeWindow::Main, &scene, &viewpoint, settings.stereo(), size)?;
        if let Some(second_eye) = settings.second_eye() {
            // Nothing has changed between the two eyes.
            scene.tooth.iter_mut().for_each(|tooth| tooth.changes = Changes::Bricks(&[]));
            let size = second_size(settings, viewport, size);
            viewport.draw(EyeWindow::SecondEye, &scene, &viewpoint, Some(second_eye), size)?;
        }
        Ok(drawn)
    }
}

/// Size of the right eye's own picture, pixels: that of its window, or of the main picture, in whose place it is shown.
fn second_size(settings: &Settings, viewport: &Viewport, main: [u32; 2]) -> [u32; 2] {
    if settings.has_second_window() { viewport.second_eye_size() } else { main }
}

/// Whatever stands around the tooth, and the instrument in use. `bur_turn`: rotation of a bur, as a share of a turn.
fn solids(
    lesson: &LessonState,
    scene: &LessonScene,
    settings: &Settings,
    viewpoint: &Viewpoint,
    bur_turn: f32,
) -> Vec<MeshInstance> {
    // On a radiograph neither gingiva nor neighbours cover the tooth; the instrument stays.
    let mut solids = Vec::new();
    if lesson.display_mode != DisplayMode::Xray {
        let ball = lesson.snapshot.as_ref().map(|seen| (seen.tip, scene.head_radius(seen.instrument)));
        solids = match &scene.mouth {
            Some(mouth) => mouth.seen_from(&scene.surroundings, viewpoint, scene.mouth_opening, ball),
            None => scene.surroundings.clone(),
        };
        solids.extend(suction_and_syringe(lesson, scene));
    }
    let Some(seen) = &lesson.snapshot else { return solids };
    let index = seen.instrument as usize;
    let world_from_tip = seen.world_from_tip();
    let placed = |solid: &MeshInstance| MeshInstance { world_from_solid: world_from_tip, ..solid.clone() };
    let turn = Pose { position: Vec3::ZERO, orientation: Quat::from_rotation_z(TAU * bur_turn) };
    let turned = |solid: &MeshInstance| MeshInstance { world_from_solid: world_from_tip * turn, ..solid.clone() };
    // A shape or a mesh from a file does not turn.
    match scene.contra_angles.get(index).and_then(Option::as_ref) {
        Some(held) if lesson.has_mouse() => {
            solids.push(turned(&held.bur));
            if !hides_tip(viewpoint, world_from_tip) {
                solids.push(placed(held.handpiece(settings.left_handed)));
            }
        }
        Some(_) => solids.extend(scene.instruments.get(index).map(turned)),
        None => solids.extend(scene.instruments.get(index).map(placed)),
    }
    solids
}

/// The saliva ejector, or the tool that an assistant holds; a held tube takes its place.
fn suction_and_syringe(lesson: &LessonState, scene: &LessonScene) -> Vec<MeshInstance> {
    let tool = lesson.snapshot.and_then(|seen| seen.assistant);
    let held = tool.and_then(|tool| match tool.role {
        SecondHandRole::Suction => Some(particles::suction_tube(tool.tip)),
        SecondHandRole::Irrigation => {
            let crowns = scene.workpiece.crown_bounds().centre();
            Some(particles::syringe(tool.tip, scene.workpiece.world_from_tooth * crowns))
        }
        SecondHandRole::Instructor => None,
    });
    let is_tube_held = tool.is_some_and(|tool| tool.role == SecondHandRole::Suction);
    scene.ejector.iter().filter(|_| !is_tube_held).cloned().chain(held).collect()
}

/// True if a handpiece over the working end would hide the work: it is seen from above, within 42° of its axis.
fn hides_tip(viewpoint: &Viewpoint, world_from_tip: Pose) -> bool {
    const COSINE: f32 = 0.74;
    let to_eye = (viewpoint.position - world_from_tip.position).normalize_or(Vec3::Y);
    to_eye.dot(world_from_tip.rotate(Vec3::Z)) > COSINE
}
