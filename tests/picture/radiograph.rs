//! The radiograph: the line integral of the attenuation along each ray, on the adapter and by its twin.

use crate::scenes;
use crate::support::shared_data;
use std::sync::Arc;
use typodont_anatomy::TissueLabels;
use typodont_anatomy::lower_first_molar::lower_first;
use typodont_core::frame::{Pose, Vec3};
use typodont_core::volume::{Density, Grid, Label, Volume, Voxel};
use typodont_exercise::catalog::TissueTable;
use typodont_exercise::scenario::{self, ResolveMode, Scenario, ToothSource, Workpiece};
use typodont_exercise::tooth_import;
use typodont_formats::Library;
use typodont_formats::diagnostic::SourceText;
use typodont_formats::import::{ENAMEL_GREY, GreyValues};
use typodont_formats::nrrd;
use typodont_formats::nrrd::{CoordinateSystem, Geometry, Samples, VoxelImage};
use typodont_render::*;
use typodont_scene::{GreyVolume, x_ray_attenuation};

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
    let tissues = tissues();
    let function = TransferFunction::radiograph(|label| x_ray_attenuation(&tissues, label, true));
    film_by(painter, volume, function, solids, &viewpoint())
}

fn film_by(
    painter: &mut OffscreenRenderer,
    volume: &Volume,
    function: TransferFunction,
    solids: Vec<MeshInstance>,
    viewpoint: &Viewpoint,
) -> RgbaImage {
    let palette = scenes::palette();
    let tooth = VolumeInstance {
        volume,
        changes: Changes::All,
        world_from_tooth: Pose::IDENTITY,
        palette: &palette,
        unworked_tooth: None,
        mode: RenderMode::Volume(Arc::new(function)),
    };
    let background = Background::plain([0.0; 3]);
    let scene = RenderScene { tooth: Some(tooth), solids, background, ..RenderScene::empty() };
    painter.draw(&scene, viewpoint, None, SIZE).unwrap()
}

/// Brightness of the film, 0 to 1, at a place of the world.
fn brightness(film: &RgbaImage, place: Vec3) -> f32 {
    brightness_from(&viewpoint(), film, place)
}

fn brightness_from(viewpoint: &Viewpoint, film: &RgbaImage, place: Vec3) -> f32 {
    let eye = viewpoint.eye(SIZE[0] as f32 / SIZE[1] as f32);
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

/// A CT scan in a file's order, its voxel size, mm, and the value of its background.
struct Scan {
    image: VoxelImage,
    spacing: f32,
    background: f32,
}

/// A molar as a scanner with 12 bits might see it: enamel and dentine are brighter here and darker there, which no
/// segmentation into three tissues can show.
fn uneven_molar() -> Scan {
    let tooth = lower_first(0.2, &TissueLabels { enamel: Label(1), dentine: Label(2), pulp: Label(3) });
    let grid = tooth.grid();
    let background = 100.0;
    let value = |(index, cell): (usize, [u32; 3])| {
        let level = [0.0, 2400.0, 1300.0, 300.0][usize::from(tooth.tissue(index).0)];
        let [x, y, z] = grid.centre(cell).to_array();
        let unevenness = 0.1 * libm::sinf(2.0 * x) * libm::sinf(1.5 * y + 1.0) + 0.08 * libm::sinf(2.5 * z);
        (background + tooth.densities()[index].unit() * level * (1.0 + unevenness)) as u16
    };
    let samples = Samples::U16(grid.cells().enumerate().map(value).collect());
    let geometry = Geometry::of(grid, CoordinateSystem::LeftPosteriorSuperior);
    Scan { image: VoxelImage { geometry, samples, keys: Vec::new() }, spacing: 0.2, background }
}

fn ge_tooth() -> Option<Scan> {
    let image = nrrd::read(&shared_data::find("ge-tooth/tooth_u8_103x94x161.nrrd")?).unwrap();
    // With its mount.
    Some(Scan { image, spacing: 0.2, background: 77.0 })
}

/// The grinding exercise with a scan in place of its tooth, without decay.
fn on_scan(scan: &Scan) -> (Scenario, Workpiece) {
    let text = include_str!("../../scenarios/5-grinding.json");
    let source = SourceText::new("5-grinding.json", text);
    let mut scenario = scenario::resolve(source, &Library::shipped(), ResolveMode::MakeWorkpiece).unwrap();
    let tissues = scenario::anatomy_tissues(&scenario.tissues);
    let tooth = tooth_import::segmented(&scan.image, Some([scan.spacing; 3]), &tissues).unwrap();
    scenario.scene.teeth[0].source = ToothSource::Given(Arc::new(tooth));
    scenario.scene.teeth[0].decay.clear();
    let workpiece = Workpiece::make(&scenario, 1).unwrap();
    (scenario, workpiece)
}

#[test]
fn the_radiograph_of_a_scan_is_the_projection_of_its_grey_values() {
    // Aim: what a scanner measured is what the film shows, not what the segmentation made of it. Method: along each column of
    // voxels the values above the background are added up, from the file alone, of an uneven molar and of a scan by others;
    // they correlate with the optical depth of the film there. By tissues alone, the uneven molar correlates less.
    for scan in [Some(uneven_molar()), ge_tooth()].into_iter().flatten() {
        let (scenario, workpiece) = on_scan(&scan);
        let tissues = &scenario.tissues;
        let grid = *workpiece.volume.grid();
        // The scans stand upright in their files. Where a tooth ends at the upper border, the volume is longer there.
        let file = scan.image.geometry.dims;
        assert_eq!(grid.dims[..2], file[..2]);
        let value = |index: usize| match &scan.image.samples {
            Samples::U8(values) => f32::from(values[index]),
            Samples::U16(values) => f32::from(values[index]),
            _ => unreachable!("8 or 16 bits"),
        };
        let [nx, ny, nz] = file;
        let measured = |[x, z]: [u32; 2]| -> f32 {
            let row = |y: u32| ((z * ny + y) * nx + x) as usize;
            (0..ny).map(|y| (value(row(y)) - scan.background).max(0.0)).sum()
        };
        let [low, high] = [grid.centre([0; 3]), grid.centre(grid.dims.map(|n| n - 1))];
        let middle = 0.5 * (low + high);
        // From so far that rays are parallel.
        let from = middle + 2000.0 * Vec3::Y;
        let viewpoint = Viewpoint { field_of_view: 0.018, ..Viewpoint::look_at(from, middle, Vec3::Z) };
        let by_grey = GreyVolume::new(&workpiece, &workpiece.volume, tissues).unwrap();
        let by_tissue = TransferFunction::radiograph(|label| x_ray_attenuation(tissues, label, true));
        for mut painter in painters() {
            let mut correlation_of = |volume: &Volume, function: TransferFunction| {
                let film = film_by(&mut painter, volume, function, vec![], &viewpoint);
                let shown = |[x, z]: [u32; 2]| brightness_from(&viewpoint, &film, grid.centre([x, ny / 2, z]));
                let columns: Vec<[u32; 2]> = (0..nz).flat_map(|z| (0..nx).map(move |x| [x, z])).collect();
                // The film is linear up to three quarters.
                let linear = columns.iter().filter(|at| shown(**at) < 0.75);
                let pairs: Vec<[f32; 2]> = linear.map(|&at| [measured(at), shown(at)]).collect();
                assert!(pairs.len() * 10 > columns.len() * 8, "{} of {} columns", pairs.len(), columns.len());
                correlation(&pairs)
            };
            let found = correlation_of(by_grey.volume(), GreyVolume::radiograph(tissues));
            let flat = correlation_of(&workpiece.volume, by_tissue.clone());
            println!("{}: by grey values {found:.5}, by tissues {flat:.5}", painter.adapter());
            assert!(found >= 0.99 && found > flat, "{found}, by tissues {flat}");
        }
    }
}

#[test]
fn what_is_cut_is_gone_from_the_grey_values() {
    // Aim: the film follows the bur, and what was never scanned shows by its own attenuation. Method: edits as carving makes
    // them: a voxel is halved, one is emptied and one is filled with amalgam.
    let (scenario, workpiece) = on_scan(&uneven_molar());
    let tissues = &scenario.tissues;
    let (enamel, amalgam) = (tissues.label_of("enamel").unwrap(), tissues.label_of("amalgam").unwrap());
    let mut volume = Volume::clone(&workpiece.volume);
    let mut grey = GreyVolume::new(&workpiece, &volume, tissues).unwrap();
    let is_full = |index: &usize| volume.voxel(*index) == Voxel { density: Density::FULL, label: enamel };
    let places: Vec<usize> = (0..volume.grid().len()).filter(is_full).skip(1000).step_by(1000).take(3).collect();
    let before: Vec<u8> = places.iter().map(|&at| grey.volume().densities()[at].bits()).collect();
    let [half, empty] = [0.5, 0.0].map(|density| Voxel { density: Density::from_unit(density), label: enamel });
    for (&at, voxel) in places.iter().zip([half, empty, Voxel { density: Density::FULL, label: amalgam }]) {
        let edit = volume.set(at, voxel);
        grey.apply_edit(&edit);
    }
    let after: Vec<u8> = places.iter().map(|&at| grey.volume().densities()[at].bits()).collect();
    assert!((120..=200).contains(&before[0]), "enamel is about {ENAMEL_GREY}: {before:?}");
    assert_eq!(after, [before[0].div_ceil(2), 0, 255]);
    let anew = GreyVolume::new(&workpiece, &volume, tissues).unwrap();
    assert_eq!(anew.volume().densities(), grey.volume().densities());
    assert_eq!(anew.volume().labels(), grey.volume().labels());
}

#[test]
fn placed_decay_is_as_bright_as_its_tissue_and_scanned_tissue_as_it_was_scanned() {
    // Aim: an exercise's caries is darker than the tooth around it, though the scan knows nothing of it. Method: half of a
    // scanned tooth is relabelled as caries, as placing decay does; and a map in which the same is drawn before the import.
    let scan = uneven_molar();
    let (scenario, workpiece) = on_scan(&scan);
    let tissues = &scenario.tissues;
    let caries = tissues.label_of("caries").unwrap();
    let ToothSource::Given(imported) = &scenario.scene.teeth[0].source else { panic!("a scan") };
    let mut decayed = imported.volume.clone();
    let grid = *decayed.grid();
    decayed.relabel(|index, label| if grid.cell(index)[0] * 2 < grid.dims[0] { caries } else { label });
    let values = imported.grey_values.as_ref().unwrap();
    let shown = |values: GreyValues| {
        let grey_values = Some(Arc::new(values));
        let made = Workpiece { grey_values, volume: Arc::new(decayed.clone()), ..workpiece.clone() };
        GreyVolume::new(&made, &decayed, tissues).unwrap().volume().clone()
    };
    let placed = shown(values.only_where(&imported.volume, &decayed));
    let drawn = shown(values.only_where(&decayed, &decayed));
    let grey = (x_ray_attenuation(tissues, caries, true)
        / x_ray_attenuation(tissues, tissues.label_of("enamel").unwrap(), true)
        * f32::from(ENAMEL_GREY))
    .round() as u8;
    let full = |index: &usize| decayed.densities()[*index] == Density::FULL;
    for index in (0..grid.len()).filter(full) {
        let is_decayed = decayed.labels()[index] == caries;
        let as_scanned = values.values()[index].max(1);
        assert_eq!(drawn.densities()[index].bits(), as_scanned);
        assert_eq!(placed.densities()[index].bits(), if is_decayed { grey } else { as_scanned });
    }
}

/// Pearson's correlation coefficient.
fn correlation(pairs: &[[f32; 2]]) -> f64 {
    let n = pairs.len() as f64;
    let mean = |i: usize| pairs.iter().map(|pair| f64::from(pair[i])).sum::<f64>() / n;
    let means = [mean(0), mean(1)];
    let product = |i: usize, j: usize| -> f64 {
        pairs.iter().map(|pair| (f64::from(pair[i]) - means[i]) * (f64::from(pair[j]) - means[j])).sum()
    };
    product(0, 1) / (product(0, 0) * product(1, 1)).sqrt()
}
