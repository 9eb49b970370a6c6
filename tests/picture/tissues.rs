//! Colours of tissues: soft borders of decay, and decay that stays hidden.

use crate::render::adapter;
use crate::scenes::*;
use std::sync::Arc;
use typodont_core::frame::{Pose, Vec3};
use typodont_core::volume::{Grid, Label, Volume};
use typodont_exercise::catalog::{TissueRole, TissueTable};
use typodont_formats::Library;
use typodont_render::*;
use typodont_scene::tissue_palette;

const SPACING: f32 = 0.1;

/// White light from everywhere: what is drawn is the tissue's own colour.
fn even_light() -> Lights {
    Lights { ambient: 1.0, chair: Lamp::OFF, head: Lamp::OFF }
}

/// A plate with its top at z = 0 and a label by place.
fn plate(label: impl Fn(Vec3) -> Label) -> Volume {
    let grid = Grid { dims: [90, 90, 40], spacing: Vec3::splat(SPACING), origin: Vec3::new(-4.45, -4.45, -3.45) };
    Volume::from_distance(grid, 1.5 * SPACING, |p| (p.z, label(p)))
}

/// The plate from above, without perspective to speak of; the number of pixels per voxel follows from the distance.
fn from_above(volume: &Volume, palette: &LabelPalette, mode: RenderMode, size: [u32; 2]) -> RgbaImage {
    let viewpoint = Viewpoint::look_at(Vec3::new(0.0, 0.0, 30.0), Vec3::ZERO, Vec3::Y);
    let scene = RenderScene {
        tooth: Some(VolumeInstance { world_from_tooth: Pose::IDENTITY, ..tooth(volume, palette, mode) }),
        lights: even_light(),
        ..RenderScene::empty()
    };
    OffscreenRenderer::cpu().draw(&scene, &viewpoint, None, size).unwrap()
}

#[test]
fn the_border_of_decay_is_soft_and_has_no_steps() {
    // Aim: no saw-teeth where labels change from voxel to voxel. Method: a plate decayed on one side of a line that is
    // slightly turned against the voxels. Nowhere does a fifth of the change from sound to decayed happen within a quarter
    // of a voxel, and most of it takes more than two voxels; labels that are merely interpolated take one.
    let line = Vec3::new(1.0, 0.21, 0.0).normalize();
    let volume = plate(|p| if p.dot(line) > 0.0 { CARIES } else { Label(1) });
    for mode in [RenderMode::Surface, RenderMode::Iso] {
        let image = from_above(&volume, &palette(), mode.clone(), [600, 600]);
        let field_of_view = Viewpoint::look_at(Vec3::Z * 30.0, Vec3::ZERO, Vec3::Y).field_of_view;
        let pixels_per_voxel = 600.0 * SPACING / (2.0 * 30.0 * (0.5 * field_of_view).tan());
        // Within the plate, away from its edges.
        let half = (25.0 * pixels_per_voxel) as u32;
        let (mut largest_step, mut between) = (0.0f32, 0);
        for y in 300 - half..300 + half {
            let green: Vec<f32> = (300 - half..300 + half).map(|x| f32::from(image.pixel(x, y)[1])).collect();
            let (sound, decayed) = (green[0], green[green.len() - 1]);
            assert!(sound > decayed + 80.0, "{mode:?}: {sound} to {decayed}");
            let share: Vec<f32> = green.iter().map(|v| (sound - v) / (sound - decayed)).collect();
            largest_step = share.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(largest_step, f32::max);
            between += share.iter().filter(|share| (0.05..0.9).contains(*share)).count();
        }
        let width = between as f32 / (2 * half) as f32 / pixels_per_voxel;
        let per_quarter = largest_step * 0.25 * pixels_per_voxel;
        println!(
            "{mode:?}: {pixels_per_voxel:.1} pixels a voxel, {per_quarter:.2} in a quarter, {width:.1} voxels wide"
        );
        assert!(per_quarter < 0.2, "{mode:?}: {per_quarter} of the change within a quarter of a voxel");
        assert!(width > 2.0, "{mode:?}: {width} voxels from sound to decayed");
    }
}

#[test]
fn decay_that_was_removed_leaves_no_tint() {
    // Aim: a clean floor looks clean, so that nobody cuts on. Method: decay cut out to the last voxel, beside the same
    // cavity in a sound plate.
    let cut = |mut volume: Volume| {
        carve(&mut volume, Vec3::new(0.0, 0.0, 0.2), 1.0);
        carve(&mut volume, Vec3::new(0.0, 0.0, 0.0), 1.0);
        volume
    };
    let decayed = cut(plate(|p| if p.length() < 0.7 { CARIES } else { Label(2) }));
    let sound = cut(plate(|_| Label(2)));
    assert_eq!(decayed.count(CARIES), 0);
    for mode in [RenderMode::Surface, RenderMode::Iso, tissue(&palette())] {
        let [decayed, sound] = [&decayed, &sound].map(|v| from_above(v, &palette(), mode.clone(), [200, 200]));
        assert!(decayed.rgba == sound.rgba, "{mode:?}");
    }
}

#[test]
fn hidden_decay_changes_no_pixel() {
    // Aim: where an exercise hides decay, no rendering gives it away. Method: the shipped tissues; a molar with and without
    // each kind of decay in its enamel, in every mode that such a stage offers and in the translucent one; in the latter also
    // across the border of two tissues, where labels are mixed. Decay looks like enamel, so that it replaces only that. By the
    // processor, and by the adapter where there is one.
    let tissues = TissueTable::read(&Library::shipped()).unwrap();
    let palette = tissue_palette(&tissues, false);
    let shown = tissue_palette(&tissues, true);
    assert!(palette.under_translucent.is_none() && shown.under_translucent.is_some());
    let [enamel, dentine] = ["enamel", "dentine"].map(|name| tissues.label_of(name).unwrap());
    let mut sound = molar([96, 96, 60]);
    sound.relabel(|_, label| if label == Label::AIR { label } else { enamel });
    let grid = *sound.grid();
    let top = sound.extent().high;
    let mut layered = sound.clone();
    layered.relabel(|i, label| {
        let height = grid.centre(grid.cell(i)).z;
        if label != Label::AIR && height < top.z - 2.0 { dentine } else { label }
    });
    let viewpoint =
        Orbit { middle: Vec3::new(0.0, 1.0, 0.0), azimuth: 0.5, elevation: 0.9, distance: 42.0 }.viewpoint();
    let mut gpu = OffscreenRenderer::gpu().ok();
    let mut draw = |volume: &Volume, palette: &LabelPalette, mode: RenderMode| {
        let unworked = UnworkedTooth::of(volume, &[dentine]);
        let shown = VolumeInstance { unworked_tooth: Some(&unworked), ..tooth(volume, palette, mode) };
        let scene = RenderScene { tooth: Some(shown), ..RenderScene::empty() };
        let by_processor = OffscreenRenderer::cpu().draw(&scene, &viewpoint, None, [240, 240]).unwrap();
        let by_adapter = gpu.as_mut().map(|gpu| gpu.draw(&scene, &viewpoint, None, [240, 240]).unwrap().rgba);
        (by_processor.rgba, by_adapter)
    };
    for entry in tissues.entries().iter().filter(|entry| entry.role == TissueRole::Decay) {
        let place = Vec3::new(0.0, 0.0, top.z - 2.0);
        let with_decay = |volume: &Volume| {
            let mut decayed = volume.clone();
            decayed.relabel(|i, label| {
                if label == enamel && grid.centre(grid.cell(i)).distance(place) < 2.5 { entry.label() } else { label }
            });
            decayed
        };
        let decayed = with_decay(&sound);
        let film = Arc::new(TransferFunction::radiograph(|l| typodont_scene::x_ray_attenuation(&tissues, l, false)));
        for mode in [RenderMode::Surface, RenderMode::Iso, tissue(&palette), RenderMode::Volume(film)] {
            let [with, without] = [&decayed, &sound].map(|volume| draw(volume, &palette, mode.clone()));
            assert!(with == without, "{} in {mode:?}", entry.name);
        }
        let [with, without] = [&with_decay(&layered), &layered].map(|volume| draw(volume, &palette, tissue(&palette)));
        assert!(with == without, "{} across two tissues", entry.name);
        let seen = draw(&decayed, &shown, RenderMode::Iso) != draw(&sound, &shown, RenderMode::Iso);
        assert!(seen, "{} can be seen where it is shown", entry.name);
    }
}

#[test]
fn enamel_has_the_cracks_of_its_seed_on_both_renderers() {
    // Aim: cracks are drawn, on the carved tooth in both modes and on another tooth, are others for another seed, and are where the twin
    // has them. Method: the side of a block of enamel, close by in light from everywhere, beside the same without relief; what is darker
    // is crack.
    let Some((mut gpu, _turn)) = adapter() else { return };
    let grid = Grid::centred([100, 100, 100], Vec3::splat(SPACING));
    let side = |p: Vec3| (p.abs() - 4.0).max_element();
    let volume = Volume::from_distance(grid, 1.5 * SPACING, |p| (side(p), Label(1)));
    let white = LabelPalette::from_colours(|_| [0.9; 3], ENAMEL_GLOSS);
    let enamel = Appearance { colour: [0.9; 3], gloss: ENAMEL_GLOSS };
    let plain = MeshInstance::plain(block(Vec3::splat(4.0)), Pose::IDENTITY, enamel);
    let solid = MeshInstance { is_enamel: true, ..plain };
    let viewpoint = Viewpoint::look_at(Vec3::X * 18.0, Vec3::ZERO, Vec3::Z);
    let size = [600, 600];
    let scene = |mode: Option<RenderMode>, relief_seed| RenderScene {
        solids: if mode.is_some() { Vec::new() } else { vec![solid.clone()] },
        tooth: mode.map(|mode| VolumeInstance { world_from_tooth: Pose::IDENTITY, ..tooth(&volume, &white, mode) }),
        lights: even_light(),
        relief_seed,
        ..RenderScene::empty()
    };
    for mode in [Some(RenderMode::Surface), Some(RenderMode::Iso), None] {
        let twin = |seed| OffscreenRenderer::cpu().draw(&scene(mode.clone(), seed), &viewpoint, None, size).unwrap();
        let without = twin(None);
        let blue = |image: &RgbaImage| -> Vec<i32> { image.rgba.chunks(4).map(|p| i32::from(p[2])).collect() };
        let cracks = |image: &RgbaImage| -> Vec<bool> {
            blue(&without).iter().zip(blue(image)).map(|(plain, seen)| plain - seen >= 8).collect()
        };
        let count = |cracks: &[bool]| cracks.iter().filter(|is_crack| **is_crack).count();
        // Not every side has one.
        let mut cracked = (0..16).filter_map(|seed| {
            let image = twin(Some(seed));
            let found = cracks(&image);
            (count(&found) > 300).then_some((seed, image, found))
        });
        let (seed, first, first_cracks) = cracked.next().expect("one of a few seeds has cracks");
        let (_, _, second_cracks) = cracked.next().expect("and another one");
        let shared = first_cracks.iter().zip(&second_cracks).filter(|(a, b)| **a && **b).count();
        assert!(2 * shared < count(&first_cracks), "{mode:?}: {shared} pixels have cracks for either seed");
        let drawn = gpu.draw(&scene(mode.clone(), Some(seed)), &viewpoint, None, size).unwrap();
        let pairs = blue(&drawn).into_iter().zip(blue(&first)).zip(&first_cracks);
        let apart: i32 = pairs.filter(|(_, is_crack)| **is_crack).map(|((a, b), _)| (a - b).abs()).sum();
        let apart = apart as f32 / count(&first_cracks) as f32;
        assert!(apart < 2.0, "{mode:?}: cracks differ by {apart} of 255 from the twin's");
    }
}
