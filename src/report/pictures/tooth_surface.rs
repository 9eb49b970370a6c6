//! The tooth's surface as a lesson draws it, before and after the work.

use crate::raycast::{GBuffer, PixelBuffer};
use typodont_core::frame::Pose;
use typodont_core::volume::Volume;
use typodont_exercise::scenario::{Scenario, Workpiece};
use typodont_render::{
    Changes, LabelPalette, RenderMode, SeenPlace, SurfaceColours, UnworkedTooth, VolumeInstance, tooth_in_relief,
};
use typodont_scene::{relief_seed, tissue_palette, unworked_tooth};

/// Colours of a tooth's tissues, with decay shown, and the tooth before anybody worked on it.
pub struct ToothMaterial {
    palette: LabelPalette,
    unworked_tooth: UnworkedTooth,
    relief_seed: u16,
}

impl ToothMaterial {
    pub fn of(scenario: &Scenario, workpiece: &Workpiece) -> ToothMaterial {
        ToothMaterial {
            palette: tissue_palette(&scenario.tissues, true),
            unworked_tooth: unworked_tooth(workpiece, &scenario.tissues),
            relief_seed: relief_seed(scenario),
        }
    }

    /// The surface of the tooth at a stage of the work.
    pub fn surface_of<'a>(&self, volume: &'a Volume) -> ToothSurface<'a> {
        let colours = SurfaceColours::new(&VolumeInstance {
            volume,
            changes: Changes::All,
            world_from_tooth: Pose::IDENTITY,
            palette: &self.palette,
            unworked_tooth: Some(&self.unworked_tooth),
            mode: RenderMode::Surface,
        });
        ToothSurface { volume, colours, relief_seed: self.relief_seed }
    }
}

/// The surface of a tooth at a stage of the work, with the colour and gloss of each place.
pub struct ToothSurface<'a> {
    volume: &'a Volume,
    colours: SurfaceColours,
    relief_seed: u16,
}

impl ToothSurface<'_> {
    /// A view of this volume, in colour.
    pub fn paint(&self, view: &GBuffer) -> PixelBuffer {
        let grid = self.volume.grid();
        view.paint_with_relief(|seen| {
            let at = grid.from_tooth(seen.place);
            tooth_in_relief(self.relief_seed, self.colours.at(at), SeenPlace { place: at * grid.spacing, ..seen })
        })
    }
}
