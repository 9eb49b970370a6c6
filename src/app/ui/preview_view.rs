//! The pictures of the author's screen: the tooth and its three slices, drawn again only when something has changed.

use crate::editor::{EditorState, PreviewMode};
use crate::settings::Settings;
use crate::ui::viewport::{EyeWindow, Viewport};
use eframe::egui;
use typodont_render::{Changes, Lights, Orbit, RenderError, RenderScene, VolumeInstance};
use typodont_scene as scene;

/// The last pictures of the author's screen.
#[derive(Default)]
pub struct PreviewView {
    last: Option<(PreviewInputs, egui::TextureId)>,
    pub slices: [Option<SliceImage>; 3],
}

/// Everything that the picture of the tooth depends on.
#[derive(Clone, Copy, PartialEq)]
struct PreviewInputs {
    orbit: Orbit,
    mode: PreviewMode,
    shows_surroundings: bool,
    has_shadows: bool,
    has_depth_of_field: bool,
    is_smooth: bool,
    size: [u32; 2],
    generation: u64,
}

/// A slice as it was last drawn: generation of the build, position along its axis, mm, and size, pixels.
pub struct SliceImage {
    pub generation: u64,
    pub position: f32,
    pub size: [u32; 2],
    pub texture: egui::TextureHandle,
}

impl PreviewView {
    /// Draws the tooth unless nothing has changed; `None` before the first build.
    ///
    /// # Errors
    /// When the picture cannot be drawn; the next frame tries again.
    pub fn draw(
        &mut self,
        editor: &EditorState,
        settings: &Settings,
        viewport: &mut Viewport,
        size: [u32; 2],
    ) -> Result<Option<egui::TextureId>, RenderError> {
        let Some(build) = &editor.build else { return Ok(None) };
        let (preview, has_graphics) = (&editor.preview, viewport.has_graphics());
        let inputs = PreviewInputs {
            orbit: preview.orbit,
            mode: preview.mode,
            shows_surroundings: preview.shows_surroundings,
            has_shadows: settings.has_shadows(has_graphics),
            has_depth_of_field: settings.depth_of_field,
            is_smooth: settings.is_smooth(has_graphics),
            size,
            generation: preview.generation,
        };
        let last = self.last.take();
        if let Some((drawn, id)) = last.filter(|(drawn, _)| *drawn == inputs) {
            self.last = Some((drawn, id));
            return Ok(Some(id));
        }
        let has_volume = last.is_some_and(|(drawn, _)| drawn.generation == inputs.generation);
        let viewpoint = preview.orbit.viewpoint();
        let scene = RenderScene {
            tooth: Some(VolumeInstance {
                volume: &build.workpiece.volume,
                changes: if has_volume { Changes::Bricks(&[]) } else { Changes::All },
                world_from_tooth: build.workpiece.world_from_tooth,
                palette: &preview.palette,
                unworked_tooth: Some(&build.unworked_tooth),
                mode: preview.render_mode(),
            }),
            solids: match &build.mouth {
                _ if !preview.shows_surroundings => Vec::new(),
                Some(mouth) => mouth.seen_from(&build.surroundings, &viewpoint, scene::WORKING_OPENING_DEG, None),
                None => build.surroundings.clone(),
            },
            lights: Lights::along(&viewpoint),
            shadows: inputs.has_shadows.then(|| scene::shadow_region(&build.workpiece, &preview.orbit)),
            relief_seed: has_graphics.then(|| scene::relief_seed(&build.scenario)),
            lens: inputs.has_depth_of_field.then(|| scene::camera_lens(&preview.orbit)),
            is_antialiased: inputs.is_smooth,
            ..RenderScene::empty()
        };
        let id = viewport.draw(EyeWindow::Main, &scene, &viewpoint, None, size)?;
        self.last = Some((inputs, id));
        Ok(Some(id))
    }
}
