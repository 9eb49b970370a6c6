//! The radiograph: the line integral of the attenuation along each ray, on the adapter and by its twin.

use crate::scenes;
use std::sync::Arc;
use typodont_core::frame::{Pose, Vec3};
use typodont_core::volume::{Grid, Label, Volume};
use typodont_exercise::catalog::TissueTable;
use typodont_formats::Library;
use typodont_render::*;
use typodont_scene::x_ray_attenuation;

/// Optical depth that the film shows as white while it is linear.
const WHITE_DEPTH: f32 = 3.0;

const SIZE: [u32; 2] = [480, 240];

/// Length and width of a block across the rays, mm.
const BLOCK: f32 = 4.0;

fn tissues() -> TissueTable {
    TissueTable::read(&Library::shipped()).unwrap()
}

/// Blocks of a thickness and a label side by side along x, which stand on one plane.
fn blocks(content: &[(f32, Label)]) -> Volume {
    let most = content.iter().map(|block| block.0).fold(0.0, f32::max);
    let length = BLOCK * content.len() as f32;
    let low = Vec3::new(-0.5 * length, -0.5 * BLOCK, 0.0);
    let grid = Grid::covering(low, Vec3::new(0.5 * length, 0.5 * BLOCK, most), Vec3::splat(0.1), 4);
    Volume::from_distance(grid, 0.2, |p| {
        let index = (((p.x - low.x) / BLOCK).max(0.0) as usize).min(content.len() - 1);
        let (thickness, label) = content[index];
        let aside = (p.x.abs() - 0.5 * length).max(p.y.abs() - 0.5 * BLOCK);
        (((p.z - 0.5 * thickness).abs() - 0.5 * thickness).max(aside), label)
    })
}

/// From so far that rays are nearly parallel.
fn viewpoint() -> Viewpoint {
    Viewpoint { field_of_view: 0.07, ..Viewpoint::look_at(Vec3::new(0.0, 0.0, 400.0), Vec3::ZERO, Vec3::Y) }
}

fn film_of(painter: &mut OffscreenRenderer, volume: &Volume, solids: Vec<MeshInstance>) -> RgbaImage {
    let (tissues, palette) = (tissues(), scenes::palette());
    let function = TransferFunction::radiograph(|label| x_ray_attenuation(&tissues, label, true));
    let tooth = VolumeInstance {
        volume,
        changes: Changes::All,
        world_from_tooth: Pose::IDENTITY,
        palette: &palette,
        enamel_depth: None,
        mode: RenderMode::Volume(Arc::new(function)),
    };
    let background = Background::plain([0.0; 3]);
    let scene = RenderScene { tooth: Some(tooth), solids, background, ..RenderScene::empty() };
    painter.draw(&scene, &viewpoint(), None, SIZE).unwrap()
}

/// Brightness of the film, 0 to 1, at a place of the world.
fn brightness(film: &RgbaImage, place: Vec3) -> f32 {
    let eye = viewpoint().eye(SIZE[0] as f32 / SIZE[1] as f32);
    let [x, y] = eye.project(place).0;
    f32::from(film.pixel((x * SIZE[0] as f32) as u32, (y * SIZE[1] as f32) as u32)[2]) / 255.0
}

fn painters() -> Vec<OffscreenRenderer> {
    let mut all = vec![OffscreenRenderer::cpu()];
    match OffscreenRenderer::gpu() {
        Ok(gpu) => all.push(gpu),
        Err(error) => crate::support::tools::skip(&error.to_string()),
    }
    all
}

#[test]
fn a_step_wedge_has_the_analytic_optical_density() {
    // Aim: the film is physics, not a picture of it. Method: a wedge of dentine in steps of 1 to 8 mm; the optical depth
    // read from the film is attenuation times thickness within 2 %, and half of the film's last bit.
    let tissues = tissues();
    let dentine = tissues.label_of("dentine").unwrap();
    let steps: Vec<(f32, Label)> = (1..=8).map(|mm| (mm as f32, dentine)).collect();
    let volume = blocks(&steps);
    for mut painter in painters() {
        let film = film_of(&mut painter, &volume, vec![]);
        for (i, (thickness, label)) in steps.iter().enumerate() {
            let x = (i as f32 + 0.5 - 0.5 * steps.len() as f32) * BLOCK;
            let seen = brightness(&film, Vec3::new(x, 0.0, 0.5 * thickness)) * WHITE_DEPTH;
            let expected = x_ray_attenuation(&tissues, *label, true) * thickness;
            let least = 0.5 / 255.0 * WHITE_DEPTH;
            let adapter = painter.adapter();
            assert!(
                (seen - expected).abs() < 0.02 * expected + least,
                "{adapter}, {thickness} mm: {seen}, not {expected}"
            );
        }
    }
}

#[test]
fn slabs_of_tissue_are_told_apart_on_a_radiograph() {
    // Aim: pulp, decay, dentine and enamel differ on the film, each by its own attenuation; an amalgam is white and not
    // burnt out. Method: slabs of 4 mm, and again with hidden decay, which then is as dentine.
    let tissues = tissues();
    let names = ["pulp", "caries", "firm_caries", "dentine", "enamel", "amalgam"];
    let slabs: Vec<(f32, Label)> = names.iter().map(|name| (4.0, tissues.label_of(name).unwrap())).collect();
    let volume = blocks(&slabs);
    for mut painter in painters() {
        let film = film_of(&mut painter, &volume, vec![]);
        let at = |i: usize| Vec3::new((i as f32 + 0.5 - 0.5 * slabs.len() as f32) * BLOCK, 0.0, 2.0);
        let seen: Vec<f32> = (0..slabs.len()).map(|i| brightness(&film, at(i))).collect();
        for (i, name) in names.iter().enumerate().take(5) {
            let expected = x_ray_attenuation(&tissues, slabs[i].1, true) * 4.0;
            let depth = seen[i] * WHITE_DEPTH;
            assert!((depth - expected).abs() < 0.02 * expected + 0.006, "{name}: {depth}, not {expected}");
        }
        assert!(seen.windows(2).all(|pair| pair[1] - pair[0] > 8.0 / 255.0), "{}: {seen:?}", painter.adapter());
        assert!((0.97..=1.0).contains(&seen[5]), "{seen:?}");
        // A solid behind is seen through the film; in front of it only the matter before the solid is exposed.
        let card = |z: f32| {
            let white = Appearance { colour: [1.0; 3], gloss: 0.0 };
            MeshInstance::plain(scenes::block(Vec3::new(30.0, 30.0, 0.5)), Pose::at(Vec3::new(0.0, 0.0, z)), white)
        };
        let behind = brightness(&film_of(&mut painter, &volume, vec![card(-5.0)]), at(0));
        assert!(behind > seen[0] + 0.3, "{behind}");
    }
}
