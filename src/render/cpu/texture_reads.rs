//! Counts of texture reads: the cost of a picture on a graphics adapter, whose shaders read the same places.
//!
//! Counts in this crate's tests only; elsewhere every call is empty. Left out: one read per pixel of the depth behind translucent
//! tissue, and those of mirrors and of stereo.

/// A texture that shaders read; one read counts once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Texture {
    /// Density between eight voxels of two bytes.
    Density,
    /// One voxel's density and label.
    Voxel,
    EmptySpace,
    /// Mean density between eight cubes, for ambient occlusion.
    Occlusion,
    /// Colour between eight places.
    Colour,
    TransferTable,
    LampDepth,
    /// A depth compared with four that the lamp sees.
    LampComparison,
    /// A pixel of the picture, or its depth, before a lens blurs it or its edges are smoothed.
    Picture,
}

/// Number of textures.
#[cfg(test)]
const COUNT: usize = Texture::Picture as usize + 1;

#[cfg(test)]
impl Texture {
    pub const ALL: [Texture; COUNT] = [
        Texture::Density,
        Texture::Voxel,
        Texture::EmptySpace,
        Texture::Occlusion,
        Texture::Colour,
        Texture::TransferTable,
        Texture::LampDepth,
        Texture::LampComparison,
        Texture::Picture,
    ];

    /// Bytes of the texels that one read touches.
    pub fn bytes(self) -> u64 {
        match self {
            Texture::Density => 8 * 2,
            Texture::Voxel | Texture::EmptySpace => 2,
            Texture::Occlusion => 8,
            Texture::Colour => 8 * 4,
            Texture::TransferTable | Texture::LampDepth | Texture::Picture => 4,
            Texture::LampComparison => 4 * 4,
        }
    }
}

/// Number of reads of each texture.
#[derive(Debug, Default)]
pub struct TextureReads {
    #[cfg(test)]
    counts: [std::sync::atomic::AtomicU64; COUNT],
}

impl TextureReads {
    #[cfg(test)]
    pub fn count(&self, texture: Texture, reads: u64) {
        self.counts[texture as usize].fetch_add(reads, std::sync::atomic::Ordering::Relaxed);
    }

    #[cfg(not(test))]
    #[inline(always)]
    pub fn count(&self, _: Texture, _: u64) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::CpuRenderer;
    use crate::{
        Appearance, Changes, LabelPalette, Lens, Lights, Orbit, RenderMode, RenderScene, ShadowRegion,
        TransferFunction, VolumeInstance,
    };
    use std::sync::Arc;
    use std::sync::atomic::Ordering;
    use typodont_anatomy::{TissueLabels, grid_of_spacing, grow, teeth};
    use typodont_core::frame::{Pose, Quat, Vec3};
    use typodont_core::volume::{Label, Volume};

    const SIZE: [u32; 2] = [390, 345];

    fn palette() -> LabelPalette {
        let appearances = std::array::from_fn(|label| Appearance {
            colour: [[0.5; 3], [0.95, 0.94, 0.9], [0.9, 0.81, 0.6], [0.75, 0.3, 0.3]][label.min(3)],
            gloss: 0.2,
        });
        LabelPalette { appearances, ..LabelPalette::from_colours(|_| [1.0; 3], 0.2) }
    }

    /// Reads and bytes per pixel of a crown that fills the picture, with smoothed edges, and the reads of each texture.
    fn cost(
        tooth: &Volume,
        palette: &LabelPalette,
        mode: RenderMode,
        has_shadows: bool,
        has_lens: bool,
    ) -> ([f64; 2], String) {
        let upright = Pose { position: Vec3::ZERO, orientation: Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2) };
        /// Radius of what is seen, mm: a molar's crown is larger.
        const SEEN: f32 = 1.8;
        let bounds = tooth.extent();
        let centre = upright * bounds.centre().with_z(bounds.high.z - 1.5);
        let viewpoint = Orbit::around(centre, SEEN).viewpoint();
        let scene = RenderScene {
            tooth: Some(VolumeInstance {
                volume: tooth,
                changes: Changes::All,
                world_from_tooth: upright,
                palette,
                unworked_tooth: None,
                mode,
            }),
            lights: Lights::along(&viewpoint),
            shadows: has_shadows.then_some(ShadowRegion { centre, radius: bounds.half_size().length() }),
            lens: has_lens.then_some(Lens { focus: centre, aperture: 1.0 }),
            is_antialiased: true,
            ..RenderScene::empty()
        };
        let mut renderer = CpuRenderer::default();
        renderer.prepare(&scene);
        renderer.draw(&scene, &viewpoint.eye(SIZE[0] as f32 / SIZE[1] as f32), SIZE);
        let pixels = f64::from(SIZE[0] * SIZE[1]);
        let reads = Texture::ALL.map(|texture| renderer.reads.counts[texture as usize].load(Ordering::Relaxed));
        let bytes: u64 = reads.iter().zip(Texture::ALL).map(|(reads, texture)| reads * texture.bytes()).sum();
        let of_each = Texture::ALL.iter().zip(reads).filter(|(_, reads)| *reads > 0);
        let of_each: Vec<String> =
            of_each.map(|(texture, reads)| format!("{texture:?} {:.2}", reads as f64 / pixels)).collect();
        ([reads.iter().sum::<u64>() as f64 / pixels, bytes as f64 / pixels], of_each.join(", "))
    }

    #[test]
    fn a_picture_reads_no_more_than_it_did() {
        // Aim: the cost of a picture on a graphics adapter does not grow unnoticed. Method: reads and bytes per pixel, which are
        // nearly the same on every machine, of a lower molar; limits a tenth above what was counted.
        let tissues = TissueLabels { enamel: Label(1), dentine: Label(2), pulp: Label(3) };
        let form = teeth::tooth(36).unwrap();
        let tooth = grow(&form, grid_of_spacing(&form, 0.1), &tissues);
        assert!((0..COUNT).all(|i| Texture::ALL[i] as usize == i));
        let palette = palette();
        let translucent = RenderMode::Volume(Arc::new(TransferFunction::tissue(&palette)));
        for (name, mode, [has_shadows, has_lens], limits) in [
            ("surface", RenderMode::Surface, [false, false], [7.9, 66.0]),
            ("surface with shadows", RenderMode::Surface, [true, false], [38.8, 407.0]),
            ("surface through a lens", RenderMode::Surface, [false, true], [151.0, 638.0]),
            ("ray casting", RenderMode::Iso, [false, false], [38.3, 429.0]),
            ("ray casting with shadows", RenderMode::Iso, [true, false], [114.8, 1197.0]),
            ("translucent tissue", translucent, [false, false], [611.0, 2537.0]),
        ] {
            let ([reads, bytes], of_each) = cost(&tooth, &palette, mode, has_shadows, has_lens);
            println!("{name}: {reads:.1} reads and {bytes:.0} bytes per pixel ({of_each})");
            assert!(reads <= limits[0] && bytes <= limits[1], "{name}: {reads} reads, {bytes} bytes per pixel");
            let is_far_below = reads < 0.8 * limits[0] || bytes < 0.8 * limits[1];
            assert!(!is_far_below, "{name}: {reads} reads, {bytes} bytes per pixel: lower the limits");
        }
    }
}
