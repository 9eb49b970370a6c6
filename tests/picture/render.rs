//! The picture: what adapters draw and what the processor draws is one picture, and it shows what is there.
//!
//! Needs an adapter, if only one in software (`scripts/test` installs it). Without one, these tests are skipped.
//! The images are written to `target/tmp/render/` for inspection.

use crate::fixed_scenes::{FIXED_VIEWS, FixedCase};
use crate::scenes;

use scenes::*;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};
use typodont_core::frame::{Pose, Vec3};
use typodont_core::volume::{BRICK, Grid, Label, Volume, surface};
use typodont_render::*;

/// One test draws at a time: an adapter in software takes all processors anyway.
pub fn adapter() -> Option<(OffscreenRenderer, MutexGuard<'static, ()>)> {
    static TURN: Mutex<()> = Mutex::new(());
    let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    match OffscreenRenderer::gpu() {
        Ok(painter) => Some((painter, turn)),
        Err(error @ (RenderError::NoAdapter { .. } | RenderError::NoDevice { .. })) => {
            crate::support::tools::skip(&error.to_string());
            None
        }
        Err(error) => panic!("{error}"),
    }
}

pub fn keep(name: &str, image: &RgbaImage) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("render");
    std::fs::create_dir_all(&folder).unwrap();
    let RgbaImage { width, height, rgba } = image;
    let path = folder.join(format!("{name}.png"));
    image::save_buffer(path, rgba, *width, *height, image::ColorType::Rgba8).unwrap();
}

/// Mean difference of a channel, and the share of pixels that differ by 8 or more in any.
fn differences(a: &RgbaImage, b: &RgbaImage) -> (f64, f64) {
    assert_eq!((a.width, a.height), (b.width, b.height));
    let sum: u64 = a.rgba.iter().zip(&b.rgba).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    let pixels = a.rgba.chunks(4).zip(b.rgba.chunks(4));
    let far = pixels.filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) >= 8)).count();
    (sum as f64 / (a.rgba.len() / 4 * 3) as f64, far as f64 / (a.rgba.len() / 4) as f64)
}

pub fn is_close(a: &RgbaImage, b: &RgbaImage) -> bool {
    let (mean, far) = differences(a, b);
    mean < 1.0 && far < 0.001
}

#[test]
fn adapter_and_processor_draw_the_same_picture() {
    // Aim: every pass agrees with its twin: mean difference under 1 of 255, 99.9 % of pixels under 8.
    let Some((mut gpu, _turn)) = adapter() else { return };
    let (volume, palette) = (molar([128, 128, 80]), palette());
    let mut wrong = Vec::new();
    let (grains, drops) = (grains(), drops());
    for Story { name, scene, viewpoint, stereo, size } in stories(&volume, &palette, &grains, &drops) {
        let drawn = gpu.draw(&scene, &viewpoint, stereo, size).unwrap();
        let twin = OffscreenRenderer::cpu().draw(&scene, &viewpoint, stereo, size).unwrap();
        keep(&format!("{name}-gpu"), &drawn);
        keep(&format!("{name}-cpu"), &twin);
        let (mean, far) = differences(&drawn, &twin);
        println!("{name}: mean {mean:.3}, {:.3} % by 8 or more", 100.0 * far);
        if !is_close(&drawn, &twin) {
            wrong.push(format!("{name}: mean {mean:.3} of 255, {:.3} % of pixels differ by 8 or more", 100.0 * far));
        }
        let background = drawn.pixel(0, 0);
        let seen = drawn.rgba.chunks(4).filter(|p| p[0].abs_diff(background[0]) > 40).count();
        assert!(seen > 5000, "{name}: {seen} pixels show anything");
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_fixed_scenes_are_one_picture_and_neither_burn_out_nor_drown() {
    // Aim: what schools see, not only what tests were made for, agrees with its twin, and keeps form in light and dark.
    // Method: three exercises in their mouths, before and after; of the pixels that show teeth or gum few are flat white or
    // black. `scripts/pictures` takes the pictures from here.
    let Some((mut gpu, _turn)) = adapter() else { return };
    let mut wrong = Vec::new();
    for case in FixedCase::all() {
        for view in FIXED_VIEWS {
            let name = format!("fixed-{}-{}", case.number, view.name);
            let size = [800, 500];
            for mode in [RenderMode::Surface, RenderMode::Iso] {
                let (shaded, viewpoint) = case.scene(view, mode.clone(), true);
                let twin = OffscreenRenderer::cpu().draw(&shaded, &viewpoint, None, size).unwrap();
                let drawn = gpu.draw(&shaded, &viewpoint, None, size).unwrap();
                keep(&format!("{name}-shadows"), &twin);
                let (mean, far) = differences(&drawn, &twin);
                println!("{name}, {mode:?} with shadows: mean {mean:.3}, {:.3} % by 8 or more", 100.0 * far);
                if !is_close(&drawn, &twin) {
                    wrong.push(format!("{name} with shadows: mean {mean:.3} of 255, {:.3} % of pixels", 100.0 * far));
                }
            }
            let (scene, viewpoint) = case.scene(view, RenderMode::Iso, false);
            let twin = OffscreenRenderer::cpu().draw(&scene, &viewpoint, None, size).unwrap();
            let drawn = gpu.draw(&scene, &viewpoint, None, size).unwrap();
            keep(&name, &twin);
            let (mean, far) = differences(&drawn, &twin);
            if !is_close(&drawn, &twin) {
                wrong.push(format!("{name}: mean {mean:.3} of 255, {:.3} % of pixels differ", 100.0 * far));
            }
            let count = |is: &dyn Fn(&[u8]) -> bool| twin.rgba.chunks(4).filter(|p| is(p)).count();
            let shown = count(&|p| p[0] > 90);
            let burnt = count(&|p| p[..3].iter().all(|v| *v > 250));
            assert!(shown > 40_000, "{name}: {shown} pixels of teeth and gum");
            assert!(burnt * 200 < shown, "{name}: {burnt} of {shown} pixels are flat white");
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn shaders_are_valid_and_share_their_structs_with_the_program() {
    // Aim: a struct that is changed on one side only is found without an adapter. Method: naga, which is what wgpu reads
    // shaders with, lays each struct out; sizes must be those of the program's own.
    for shader in shaders() {
        let module = naga::front::wgsl::parse_str(&shader.source)
            .unwrap_or_else(|e| panic!("{}: {}", shader.name, e.emit_to_string(&shader.source)));
        let mut validator =
            naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::default());
        validator.validate(&module).unwrap_or_else(|e| panic!("{}: {e:?}", shader.name));
        let mut layouter = naga::proc::Layouter::default();
        layouter.update(module.to_ctx()).unwrap();
        assert!(!shader.structs.is_empty());
        for (name, size) in &shader.structs {
            let found = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name));
            let (handle, _) = found.unwrap_or_else(|| panic!("{} has no struct {name}", shader.name));
            assert_eq!(layouter[handle].size as usize, *size, "{}: {name}", shader.name);
        }
    }
}

#[test]
fn a_point_on_the_focus_plane_has_no_parallax_in_the_picture() {
    // Aim: the analytic amount and sign. Method: small balls before, on and behind the focus plane, found again in both
    // eyes' pictures as the middle of their pixels. For eyes e apart, focus at f, a point at z: e (z - f) / z on the plane.
    let (focus, apart) = (100.0f32, 6.0f32);
    let viewpoint = Viewpoint::look_at(Vec3::new(0.0, 0.0, focus), Vec3::ZERO, Vec3::Y);
    let size = [600, 400];
    let per_mm = size[1] as f32 / (2.0 * focus * (0.5 * viewpoint.field_of_view).tan());
    let (gpu, _turn) = adapter().unzip();
    let painters = [Some(OffscreenRenderer::cpu()), gpu];
    for mut painter in painters.into_iter().flatten() {
        for z in [70.0f32, 100.0, 150.0] {
            let white = Appearance { colour: [1.0; 3], gloss: 0.0 };
            let place = Pose::at(Vec3::new(2.0, 1.0, focus - z));
            let scene = RenderScene {
                solids: vec![MeshInstance::plain(ball(1.5), place, white)],
                lights: Lights { ambient: 1.0, chair: Lamp::OFF, head: Lamp::OFF },
                background: Background::plain([0.0; 3]),
                ..RenderScene::empty()
            };
            let mut middle = |layout| {
                let stereo = Some(Stereo { layout, eye_distance: apart });
                let image = painter.draw(&scene, &viewpoint, stereo, size).unwrap();
                let lit = (0..size[0] * size[1]).map(|i| (i % size[0], i / size[0]));
                let lit: Vec<(u32, u32)> = lit.filter(|&(x, y)| image.pixel(x, y)[0] > 60).collect();
                assert!(lit.len() > 100);
                lit.iter().map(|p| p.0 as f32 + 0.5).sum::<f32>() / lit.len() as f32
            };
            let parallax = middle(StereoLayout::Right) - middle(StereoLayout::Left);
            let expected = apart * (z - focus) / z * per_mm;
            let adapter = painter.adapter();
            assert!((parallax - expected).abs() < 0.35, "{adapter}, {z} mm: {parallax} pixels, not {expected}");
        }
    }
}

#[test]
fn a_solid_half_in_front_hides_exactly_what_it_should() {
    // Aim: one depth for triangles and rays. Method: a block whose right half is before the tooth and whose left half is
    // behind. Where the tooth alone is seen, the picture is that without the block; where the block must hide the tooth, it
    // is that without the tooth.
    let (volume, palette) = (molar([128, 128, 80]), palette());
    let viewpoint = Viewpoint::look_at(Vec3::new(0.0, -2.0, 60.0), Vec3::new(0.0, -2.0, 0.0), Vec3::Y);
    let size = [300, 300];
    let block = |x: f32, z: f32| {
        let finish = Appearance { colour: [0.1, 0.3, 0.9], gloss: 0.0 };
        MeshInstance::plain(block(Vec3::new(6.0, 2.0, 1.0)), Pose::at(Vec3::new(x, -2.0, z)), finish)
    };
    let (gpu, _turn) = adapter().unzip();
    for mut painter in [Some(OffscreenRenderer::cpu()), gpu].into_iter().flatten() {
        for shown in [RenderMode::Surface, RenderMode::Iso, tissue(&palette)] {
            let mut draw = |tooth: Option<VolumeInstance>, solids: Vec<MeshInstance>| {
                let background = Background::plain([0.0; 3]);
                let scene = RenderScene { tooth, solids, background, ..RenderScene::empty() };
                painter.draw(&scene, &viewpoint, None, size).unwrap()
            };
            let tooth = || Some(tooth(&volume, &palette, shown.clone()));
            let (before, behind) = (block(6.0, 14.0), block(-6.0, -14.0));
            let both = draw(tooth(), vec![before.clone(), behind.clone()]);
            let alone = draw(tooth(), vec![]);
            let front_alone = draw(None, vec![before]);
            let behind_alone = draw(None, vec![behind]);
            let (mut hidden, mut hiding) = (0, 0);
            let is_black = |p: [u8; 4]| p[..3] == [0; 3];
            let is_opaque = !matches!(shown, RenderMode::Volume(_));
            for (x, y) in (0..size[0] * size[1]).map(|i| (i % size[0], i / size[0])) {
                let seen = both.pixel(x, y);
                if !is_black(front_alone.pixel(x, y)) {
                    assert_eq!(seen, front_alone.pixel(x, y), "{shown:?} {x} {y}: the block is before the tooth");
                    hidden += u32::from(!is_black(alone.pixel(x, y)));
                } else if is_black(behind_alone.pixel(x, y)) || is_opaque && !is_black(alone.pixel(x, y)) {
                    assert_eq!(seen, alone.pixel(x, y), "{shown:?} {x} {y}: the tooth is before the block");
                    hiding += u32::from(!is_black(behind_alone.pixel(x, y)));
                }
            }
            assert!(hidden > 300 && (hiding > 300 || !is_opaque), "{hidden} {hiding}");
        }
    }
}

#[test]
fn after_a_cut_only_its_bricks_travel_and_the_picture_is_as_made_anew() {
    // Aim: the cost of a cut is that of its bricks, in every way of seeing. Method: count what is brought over, and compare
    // with a painter that has never seen the tooth before.
    let Some((mut gpu, _turn)) = adapter() else { return };
    let palette = palette();
    let orbit = Orbit { middle: Vec3::new(0.0, 1.0, 0.0), azimuth: 0.5, elevation: 0.9, distance: 40.0 };
    for shown in [RenderMode::Surface, RenderMode::Iso, tissue(&palette)] {
        let mut volume = molar([128, 128, 80]);
        let whole = RenderScene { tooth: Some(tooth(&volume, &palette, shown.clone())), ..RenderScene::empty() };
        let before = gpu.draw(&whole, &orbit.viewpoint(), None, [300, 300]).unwrap();
        let middle = surface::extract(&volume).positions.iter().copied().max_by(|a, b| a.z.total_cmp(&b.z)).unwrap();
        for step in 0..6 {
            carve(&mut volume, middle + Vec3::new(-0.2, 0.1, -0.5) * step as f32, 1.0);
            let changed = volume.take_dirty();
            let cut = VolumeInstance { changes: Changes::Bricks(&changed), ..tooth(&volume, &palette, shown.clone()) };
            let OffscreenRenderer::Gpu(painter) = &mut gpu else { unreachable!() };
            let scene = RenderScene { tooth: Some(cut), ..RenderScene::empty() };
            let uploads = painter.paint(&scene, &orbit.viewpoint(), None, [300, 300]).unwrap();
            // The picture is smoothed over the next voxel, which may lie in the next brick.
            let around = surface::dirty_neighbourhood(&volume, &changed);
            assert!(!uploads.is_full_volume && uploads.bricks <= around.len(), "{uploads:?}, {} around", around.len());
            let next =
                if shown == RenderMode::Surface { surface::dirty_neighbourhood(&volume, &around).len() } else { 0 };
            assert!((next / 8..=next).contains(&uploads.surfaces), "{uploads:?}, {next} around those");
            assert!(changed.len() < volume.bricks().len() / 20, "{} bricks of {BRICK}³", changed.len());
        }
        let cut = VolumeInstance { changes: Changes::Bricks(&[]), ..tooth(&volume, &palette, shown.clone()) };
        let after = gpu
            .draw(&RenderScene { tooth: Some(cut), ..RenderScene::empty() }, &orbit.viewpoint(), None, [300, 300])
            .unwrap();
        let anew = RenderScene { tooth: Some(tooth(&volume, &palette, shown.clone())), ..RenderScene::empty() };
        let anew = OffscreenRenderer::gpu().unwrap().draw(&anew, &orbit.viewpoint(), None, [300, 300]).unwrap();
        let (mean, far) = differences(&after, &anew);
        assert!(mean < 0.02 && far < 0.0005, "{shown:?}: mean {mean}, {far} far");
        let (_, changed) = differences(&before, &after);
        assert!(changed > 0.01, "the cut is seen: {changed}");
    }
}

#[test]
fn after_a_cut_the_processor_draws_the_tooth_as_anew() {
    // Aim: what the processor keeps between pictures never shows matter that is gone. Method: cut, draw with the changed
    // bricks, and compare with a painter that has never seen the tooth before.
    let palette = palette();
    let viewpoint =
        Orbit { middle: Vec3::new(0.0, 1.0, 0.0), azimuth: 0.5, elevation: 0.9, distance: 40.0 }.viewpoint();
    for shown in [RenderMode::Surface, RenderMode::Iso, tissue(&palette)] {
        let mut volume = molar([96, 96, 60]);
        let mut painter = OffscreenRenderer::cpu();
        let draw = |painter: &mut OffscreenRenderer, volume: &Volume, changes: Changes| {
            let instance = VolumeInstance { changes, ..tooth(volume, &palette, shown.clone()) };
            let scene = RenderScene { tooth: Some(instance), ..RenderScene::empty() };
            painter.draw(&scene, &viewpoint, None, [200, 200]).unwrap()
        };
        let before = draw(&mut painter, &volume, Changes::All);
        assert!(draw(&mut painter, &volume, Changes::Bricks(&[])) == before);
        let highest = surface::extract(&volume).positions.iter().copied().max_by(|a, b| a.z.total_cmp(&b.z)).unwrap();
        carve(&mut volume, highest, 1.2);
        let changed = volume.take_dirty();
        let after = draw(&mut painter, &volume, Changes::Bricks(&changed));
        assert!(after == draw(&mut OffscreenRenderer::cpu(), &volume, Changes::All), "{shown:?}");
        assert!(after != before, "{shown:?}: the cut is seen");
    }
}

#[test]
fn matter_at_the_grids_end_is_drawn_closed() {
    // Aim: rays come out of the grid wherever matter touches its end. Method: a grid all full, seen from eight corners; a
    // ray once went back and forth in the first brick for ever.
    let grid = Grid::centred([21, 16, 13], Vec3::splat(0.5));
    let volume = Volume::from_distance(grid, 0.75, |_| (-9.0, Label(1)));
    let palette = palette();
    let (mut gpu, _turn) = adapter().unzip();
    for n in 0..8u32 {
        let side = |bit: u32| if n >> bit & 1 == 1 { 1.0 } else { -1.0 };
        let from = Vec3::new(20.0 * side(0), 14.0 * side(1), 17.0 * side(2));
        let viewpoint = Viewpoint::look_at(from, Vec3::ZERO, Vec3::Y);
        let draw = |painter: &mut OffscreenRenderer, shown| {
            let background = Background::plain([0.0; 3]);
            let scene =
                RenderScene { tooth: Some(tooth(&volume, &palette, shown)), background, ..RenderScene::empty() };
            painter.draw(&scene, &viewpoint, None, [160, 120]).unwrap()
        };
        let surface = draw(&mut OffscreenRenderer::cpu(), RenderMode::Surface);
        let iso = draw(&mut OffscreenRenderer::cpu(), RenderMode::Iso);
        let covered = |image: &RgbaImage| image.rgba.chunks(4).filter(|p| p[0] > 20).count() as f64;
        assert!(covered(&surface) > 2000.0);
        // Rays see the block smoothed: with round edges, and a sixth of a voxel smaller where it touches the grid's end.
        assert!((covered(&iso) / covered(&surface) - 1.0).abs() < 0.1, "{} {}", covered(&iso), covered(&surface));
        if let Some(gpu) = &mut gpu {
            for shown in [RenderMode::Iso, tissue(&palette)] {
                let mode = if shown == RenderMode::Iso { "iso" } else { "volume" };
                let (drawn, twin) = (draw(gpu, shown.clone()), draw(&mut OffscreenRenderer::cpu(), shown));
                keep(&format!("corner-{n}-{mode}-gpu"), &drawn);
                keep(&format!("corner-{n}-{mode}-cpu"), &twin);
                let (mean, far) = differences(&drawn, &twin);
                assert!(
                    is_close(&drawn, &twin),
                    "corner {n}, {mode}: mean {mean:.3}, {:.3} % by 8 or more",
                    100.0 * far
                );
            }
        }
    }
}

#[test]
fn an_adapter_with_small_textures_shows_a_coarser_tooth_and_says_so() {
    // Aim: a picture and a notice instead of a crash. Method: a device that is held to textures of 64 voxels.
    let Some((mut gpu, _turn)) = adapter() else { return };
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let found = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default())).unwrap();
    let required_limits = wgpu::Limits { max_texture_dimension_3d: 64, ..found.limits() };
    let asked = wgpu::DeviceDescriptor { required_limits, ..Default::default() };
    let (device, queue) = pollster::block_on(found.request_device(&asked)).unwrap();
    let mut small = OffscreenRenderer::with_gpu(Gpu {
        error_listener: DeviceErrorListener::attach(&device),
        device,
        queue,
        is_software: found.get_info().device_type == wgpu::DeviceType::Cpu,
        name: "small".into(),
    })
    .unwrap();
    let (volume, palette) = (molar([128, 128, 80]), palette());
    let orbit = Orbit { middle: Vec3::new(0.0, 1.0, 0.0), azimuth: 0.5, elevation: 0.75, distance: 42.0 };
    let scene = RenderScene { tooth: Some(tooth(&volume, &palette, RenderMode::Iso)), ..RenderScene::empty() };
    let OffscreenRenderer::Gpu(painter) = &mut small else { unreachable!() };
    let uploads = painter.paint(&scene, &orbit.viewpoint(), None, [200, 180]).unwrap();
    assert_eq!((uploads.is_full_volume, uploads.downsampling), (true, 2));
    let coarse = small.draw(&scene, &orbit.viewpoint(), None, [200, 180]).unwrap();
    let fine = gpu.draw(&scene, &orbit.viewpoint(), None, [200, 180]).unwrap();
    keep("coarse", &coarse);
    let (mean, _) = differences(&coarse, &fine);
    assert!(mean > 0.05 && mean < 6.0, "the same tooth, coarser: {mean}");
}

#[test]
fn a_mirror_shows_what_is_before_it_and_nothing_behind() {
    // Aim: the picture in the mirror is where geometry says, and what stands behind the mirror is not in it. Method: a mirror
    // at 45° shows a red ball beside the way of sight in its middle; a blue one behind the mirror is hidden by it.
    let matt = |colour| Appearance { colour, gloss: 0.0 };
    let orientation = typodont_core::frame::Quat::from_rotation_y(std::f32::consts::FRAC_PI_4);
    let mirror =
        PlaneMirror { world_from_mirror: Pose { position: Vec3::ZERO, orientation }, radius: 8.0, reflectance: 1.0 };
    let scene = RenderScene {
        solids: vec![
            MeshInstance::plain(ball(3.0), Pose::at(Vec3::new(40.0, 0.0, 0.0)), matt([1.0, 0.1, 0.1])),
            MeshInstance::plain(ball(3.0), Pose::at(Vec3::new(0.0, 0.0, -14.0)), matt([0.1, 0.1, 1.0])),
        ],
        mirror: Some(mirror),
        lights: Lights { ambient: 1.0, chair: Lamp::OFF, head: Lamp::OFF },
        background: Background::plain([0.5; 3]),
        ..RenderScene::empty()
    };
    let viewpoint = Viewpoint::look_at(Vec3::new(0.0, 0.0, 60.0), Vec3::ZERO, Vec3::Y);
    let (gpu, _turn) = adapter().unzip();
    for mut painter in [Some(OffscreenRenderer::cpu()), gpu].into_iter().flatten() {
        let image = painter.draw(&scene, &viewpoint, None, [300, 300]).unwrap();
        let red = (0..300 * 300u32).map(|i| (i % 300, i / 300));
        let red: Vec<(u32, u32)> =
            red.filter(|&(x, y)| image.pixel(x, y)[0] > 150 && image.pixel(x, y)[1] < 100).collect();
        let middle = red.iter().map(|p| p.0 as f32 + 0.5).sum::<f32>() / red.len() as f32;
        assert!(red.len() > 200 && (middle - 150.0).abs() < 1.5, "{}: {} at {middle}", painter.adapter(), red.len());
        let blue = image.rgba.chunks(4).filter(|p| p[2] > 150 && p[0] < 100).count();
        assert_eq!(blue, 0, "{}", painter.adapter());
    }
}

#[test]
fn specks_are_where_they_are_as_large_as_they_are_and_hidden_by_what_is_before_them() {
    // Aim: dust and water share the scene's depth in each eye. Method: a ball of 1 mm to the left; its pixels' number and
    // middle are what geometry says. A block before it hides it, one behind it does not; a drop lets the block through.
    let (focus, apart) = (100.0f32, 6.0f32);
    let viewpoint = Viewpoint::look_at(Vec3::new(0.0, 0.0, focus), Vec3::ZERO, Vec3::Y);
    let size = [600, 400];
    let per_mm = size[1] as f32 / (2.0 * focus * (0.5 * viewpoint.field_of_view).tan());
    let white = Appearance { colour: [1.0; 3], gloss: 0.0 };
    let blue = Appearance { colour: [0.1, 0.1, 0.9], gloss: 0.0 };
    let speck =
        Particle { position: Vec3::new(-5.0, 2.0, 0.0), radius: 1.0, facing: None, appearance: white, opacity: 1.0 };
    let disc = Particle { facing: Some(Vec3::Z), ..speck };
    let (gpu, _turn) = adapter().unzip();
    for mut painter in [Some(OffscreenRenderer::cpu()), gpu].into_iter().flatten() {
        let adapter = painter.adapter().to_string();
        let mut seen = |grains: &[Particle], drops: &[Particle], block_at: f32, layout| {
            let place = Pose::at(Vec3::new(-5.0, 2.0, block_at));
            let scene = RenderScene {
                solids: vec![MeshInstance::plain(block(Vec3::new(4.0, 4.0, 0.5)), place, blue)],
                lights: Lights { ambient: 0.7, chair: Lamp::OFF, head: Lamp::OFF },
                background: Background::plain([0.0; 3]),
                opaque_particles: grains,
                translucent_particles: drops,
                ..RenderScene::empty()
            };
            let stereo = Some(Stereo { layout, eye_distance: apart });
            let image = painter.draw(&scene, &viewpoint, stereo, size).unwrap();
            let all = (0..size[0] * size[1]).map(|i| (i % size[0], i / size[0]));
            let lit: Vec<(u32, u32)> = all.filter(|&(x, y)| image.pixel(x, y)[0] > 70).collect();
            let middle = lit.iter().map(|p| p.0 as f32 + 0.5).sum::<f32>() / lit.len() as f32;
            (lit.len() as f32, middle)
        };
        let expected = std::f32::consts::PI * per_mm * per_mm;
        for layout in [StereoLayout::Left, StereoLayout::Right] {
            for (grains, drops) in [(&[speck][..], &[][..]), (&[disc], &[]), (&[], &[disc])] {
                let (count, middle) = seen(grains, drops, -5.0, layout);
                // A disc has lobes, and a drop fades toward its rim.
                let is_disc = grains.iter().chain(drops).all(|speck| speck.facing.is_some());
                let least = match (is_disc, drops.is_empty()) {
                    (false, _) => 0.94,
                    (true, true) => 0.75,
                    (true, false) => 0.6,
                };
                let uneven = if is_disc { 0.8 } else { 0.5 };
                let share = count / expected;
                assert!((least..1.06).contains(&share), "{adapter}: {count} pixels, not {expected}");
                // Both lie in the plane on which both eyes agree.
                assert!((middle - (300.0 - 5.0 * per_mm)).abs() < uneven, "{adapter}: {middle}");
                assert_eq!(seen(grains, drops, 5.0, layout).0, 0.0, "{adapter}: hidden by the block");
            }
        }
        // Mostly the block's colour.
        let faint = Particle { opacity: 0.2, ..speck };
        assert_eq!(
            seen(&[], &[faint], -5.0, StereoLayout::Left).0,
            0.0,
            "{adapter}: a faint drop lets the block through"
        );
    }
}

#[test]
fn smoothing_brings_edges_nearer_to_the_truth_and_leaves_the_rest() {
    // Aim: what is smoothed is nearer to what an endlessly fine picture shows, and nothing but edges changes. Method: a
    // turned block drawn four times as large and averaged is the truth.
    let viewpoint = Viewpoint::look_at(Vec3::new(10.0, 20.0, 80.0), Vec3::ZERO, Vec3::Y);
    let orientation =
        typodont_core::frame::Quat::from_rotation_z(0.21) * typodont_core::frame::Quat::from_rotation_y(0.4);
    let finish = Appearance { colour: [0.95, 0.93, 0.9], gloss: 0.0 };
    let scene = |is_smooth| RenderScene {
        solids: vec![MeshInstance::plain(
            block(Vec3::new(9.0, 6.0, 5.0)),
            Pose { position: Vec3::ZERO, orientation },
            finish,
        )],
        background: Background::plain([0.15; 3]),
        is_antialiased: is_smooth,
        ..RenderScene::empty()
    };
    let (gpu, _turn) = adapter().unzip();
    for mut painter in [Some(OffscreenRenderer::cpu()), gpu].into_iter().flatten() {
        let size = [240, 200];
        let plain = painter.draw(&scene(false), &viewpoint, None, size).unwrap();
        let smooth = painter.draw(&scene(true), &viewpoint, None, size).unwrap();
        let fine = painter.draw(&scene(false), &viewpoint, None, size.map(|n| 4 * n)).unwrap();
        let truth = |x: u32, y: u32| {
            let parts = (0..16).map(|i| f32::from(fine.pixel(4 * x + i % 4, 4 * y + i / 4)[0]));
            parts.sum::<f32>() / 16.0
        };
        let (mut before, mut after, mut changed) = (0.0, 0.0, 0);
        for (x, y) in (0..size[0] * size[1]).map(|i| (i % size[0], i / size[0])) {
            let [own, now] = [&plain, &smooth].map(|image| f32::from(image.pixel(x, y)[0]));
            before += (own - truth(x, y)).powi(2);
            after += (now - truth(x, y)).powi(2);
            changed += u32::from(own != now);
        }
        println!("{}: squared error {before:.0}, smoothed {after:.0}; {changed} pixels", painter.adapter());
        assert!(after < 0.5 * before, "{}: from {before} to {after}", painter.adapter());
        assert!((100..3000).contains(&changed), "{}: {changed} pixels changed", painter.adapter());
    }
}

#[test]
fn a_lens_blurs_what_is_not_in_focus_and_leaves_when_it_is_taken_away() {
    // Aim: the lens of a scene is drawn; what is in focus and a translucent tooth stay as they are; switching it on and off leaves
    // nothing behind. Method: a block of stripes in focus and another far behind, with and without a lens, on one renderer.
    let viewpoint = Viewpoint::look_at(Vec3::Z * 100.0, Vec3::ZERO, Vec3::Y);
    let grey = Appearance { colour: [0.8; 3], gloss: 0.0 };
    let bars = |x: f32, z: f32| {
        let bar = |i: i32| {
            MeshInstance::plain(block(Vec3::new(0.5, 8.0, 0.5)), Pose::at(Vec3::new(x + 2.0 * i as f32, 0.0, z)), grey)
        };
        (-3..=3).map(bar).collect::<Vec<_>>()
    };
    let (volume, palette) = (molar([64, 64, 40]), palette());
    let (gpu, _turn) = adapter().unzip();
    for mut painter in [Some(OffscreenRenderer::cpu()), gpu].into_iter().flatten() {
        let mut draw = |lens: Option<Lens>, mode: Option<RenderMode>| {
            let scene = RenderScene {
                tooth: mode.map(|mode| tooth(&volume, &palette, mode)),
                solids: [bars(-12.0, 0.0), bars(16.0, -60.0)].concat(),
                background: Background::plain([0.1; 3]),
                lens,
                is_antialiased: true,
                ..RenderScene::empty()
            };
            painter.draw(&scene, &viewpoint, None, [400, 300]).unwrap()
        };
        let lens = Lens { focus: Vec3::ZERO, aperture: 8.0 };
        let [sharp, blurred, again, other] = [None, Some(lens), None, Some(lens)].map(|lens| draw(lens, None));
        assert!(sharp == again && blurred == other);
        let contrast = |image: &RgbaImage, from: u32| {
            (from..from + 200)
                .map(|x| i32::from(image.pixel(x, 150)[0].abs_diff(image.pixel(x - 1, 150)[0])))
                .sum::<i32>()
        };
        let [left, right] = [1, 200].map(|from| [&sharp, &blurred].map(|image| contrast(image, from)));
        assert!(left[0] > 500 && left[0].abs_diff(left[1]) < 40, "in focus: {left:?}");
        assert!(right[0] > 300 && 2 * right[1] < right[0], "behind the focus: {right:?}");
        let through = tissue(&palette);
        assert!(draw(None, Some(through.clone())) == draw(Some(lens), Some(through)), "a translucent tooth");
    }
}

#[test]
fn what_cannot_be_drawn_is_refused_in_words() {
    let viewpoint = Viewpoint::look_at(Vec3::Z * 50.0, Vec3::ZERO, Vec3::Y);
    let (gpu, _turn) = adapter().unzip();
    for mut painter in [Some(OffscreenRenderer::cpu()), gpu].into_iter().flatten() {
        let mut refused = |scene: &RenderScene, viewpoint: Viewpoint, size| {
            let told = painter.draw(scene, &viewpoint, None, size).unwrap_err().to_string();
            assert!(told.starts_with("impossible-picture: "), "{told}");
            told
        };
        let scene = RenderScene::empty();
        assert!(refused(&scene, viewpoint, [0, 20]).contains("0x20"));
        assert!(refused(&scene, viewpoint, [20, 70_000]).contains("20x70000"));
        refused(&scene, Viewpoint { near: f32::NAN, ..viewpoint }, [20, 20]);
        refused(&scene, Viewpoint { position: viewpoint.focus, ..viewpoint }, [20, 20]);
        let flat = PlaneMirror { world_from_mirror: Pose::IDENTITY, radius: 0.0, reflectance: 1.0 };
        assert!(
            refused(&RenderScene { mirror: Some(flat), ..RenderScene::empty() }, viewpoint, [20, 20])
                .contains("mirror")
        );
        let lens = Lens { focus: Vec3::ZERO, aperture: -1.0 };
        assert!(
            refused(&RenderScene { lens: Some(lens), ..RenderScene::empty() }, viewpoint, [20, 20]).contains("lens")
        );
        let grey = Appearance { colour: [0.5; 3], gloss: 0.0 };
        let speck = Particle { position: Vec3::ZERO, radius: f32::NAN, facing: None, appearance: grey, opacity: 1.0 };
        assert!(
            refused(&RenderScene { opaque_particles: &[speck], ..RenderScene::empty() }, viewpoint, [20, 20])
                .contains("particle")
        );
        let nowhere = MeshInstance::plain(ball(1.0), Pose::at(Vec3::splat(f32::INFINITY)), grey);
        let scene = RenderScene { solids: vec![nowhere], ..RenderScene::empty() };
        assert!(refused(&scene, viewpoint, [20, 20]).contains("mesh instance 0"));
    }
}

#[test]
fn a_lost_device_is_told_and_another_goes_on() {
    // Aim: no crash, an error that says what to do. Method: destroy the device under a painter.
    let Some((_, _turn)) = adapter() else { return };
    let gpu = Gpu::open().unwrap();
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, wgpu::TextureFormat::Rgba8Unorm);
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: 64, height: 64, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    let viewpoint = Viewpoint::look_at(Vec3::Z * 50.0, Vec3::ZERO, Vec3::Y);
    let target = RenderTarget { view: &view, size: [64, 64] };
    renderer.draw(&RenderScene::empty(), &viewpoint, None, target).unwrap();
    assert_eq!(gpu.error_listener.check(), Ok(()));
    gpu.device.destroy();
    let _ = renderer.draw(&RenderScene::empty(), &viewpoint, None, target);
    let _ = gpu.device.poll(wgpu::PollType::Wait { submission_index: None, timeout: None });
    let told = gpu.error_listener.check().unwrap_err();
    assert!(matches!(told, RenderError::Lost { .. }), "{told}");
    assert!(gpu.error_listener.check().is_err(), "it stays lost");
    assert!(OffscreenRenderer::gpu().unwrap().draw(&RenderScene::empty(), &viewpoint, None, [32, 32]).is_ok());
}
