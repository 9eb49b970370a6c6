//! The tooth's surface as a lesson draws it, before and after the work.

use crate::raycast::{GBuffer, PixelBuffer};
use typodont_core::frame::Pose;
use typodont_core::volume::Volume;
use typodont_exercise::catalog::TissueTable;
use typodont_render::{Changes, EnamelDepth, LabelPalette, RenderMode, SurfaceColours, VolumeInstance};
use typodont_scene::{enamel_depth, tissue_palette};

/// Colours of a tooth's tissues, with decay shown, and the thickness of its enamel before the work.
pub struct ToothMaterial {
    palette: LabelPalette,
    enamel_depth: EnamelDepth,
}

impl ToothMaterial {
    pub fn of(tissues: &TissueTable, before: &Volume) -> ToothMaterial {
        ToothMaterial { palette: tissue_palette(tissues, true), enamel_depth: enamel_depth(before, tissues) }
    }

    /// The surface of the tooth at a stage of the work.
    pub fn surface_of<'a>(&self, volume: &'a Volume) -> ToothSurface<'a> {
        let colours = SurfaceColours::new(&VolumeInstance {
            volume,
            changes: Changes::All,
            world_from_tooth: Pose::IDENTITY,
            palette: &self.palette,
            enamel_depth: Some(&self.enamel_depth),
            mode: RenderMode::Surface,
        });
        ToothSurface { volume, colours }
    }
}

/// The surface of a tooth at a stage of the work, with the colour and gloss of each place.
pub struct ToothSurface<'a> {
    volume: &'a Volume,
    colours: SurfaceColours,
}

impl ToothSurface<'_> {
    /// A view of this volume, in colour.
    pub fn paint(&self, view: &GBuffer) -> PixelBuffer {
        view.paint(|point| self.colours.at(self.volume.grid().from_tooth(point)))
    }
}
