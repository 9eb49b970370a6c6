//! Measurements on whole volumes: distances, files, surfaces and images; and the start-up time of the program.

use super::percentiles::{Percentiles, time_repeated};
use serde::Serialize;
use std::path::PathBuf;
use std::process::Command;
use std::sync::Arc;
use typodont_anatomy::TissueLabels;
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_core::volume::{Label, Volume, Voxel, distance, surface};
use typodont_exercise::catalog::TissueTable;
use typodont_exercise::scenario;
use typodont_exercise::scenario::{ResolveMode, Scenario, ToothSource, Workpiece};
use typodont_formats::Library;
use typodont_formats::diagnostic::{SourceText, headlines};
use typodont_formats::nrrd;
use typodont_formats::nrrd::{CoordinateSystem, Encoding, Geometry, Samples, VoxelImage};
use typodont_render::{
    Appearance, Changes, LabelPalette, OffscreenRenderer, Orbit, Particle, RenderMode, RenderScene, TransferFunction,
    VolumeInstance,
};

/// The exercise on which the measurements are taken.
const GRINDING: (&str, &str) = ("scenarios/5-grinding.json", include_str!("../../../scenarios/5-grinding.json"));

/// The lesion of every measured session: the same at every size.
pub const SEED: u64 = 1;

/// The grinding exercise on a given tooth.
pub fn exercise(tooth: Volume) -> Result<Scenario, String> {
    let source = SourceText::new(GRINDING.0, GRINDING.1);
    let mut scenario = scenario::resolve(source, &Library::shipped(), ResolveMode::MakeWorkpiece)
        .map_err(|found| headlines(&found))?;
    let tooth = Arc::new(tooth);
    for each in &mut scenario.scene.teeth {
        each.source = ToothSource::Given(tooth.clone());
    }
    Ok(scenario)
}

/// [`exercise`] with its workpiece; the volume of the tooth it was built from is dropped.
pub fn grinding_workpiece(tooth: Volume) -> Result<(Arc<Scenario>, Arc<Workpiece>), String> {
    let mut scenario = exercise(tooth)?;
    let workpiece = Workpiece::make(&scenario, SEED).map_err(|e| e.to_string())?;
    for each in &mut scenario.scene.teeth {
        each.source = ToothSource::Recorded;
    }
    Ok((Arc::new(scenario), Arc::new(workpiece)))
}

/// The labels of the shipped table.
pub fn tissues() -> Result<TissueLabels, String> {
    Ok(scenario::anatomy_tissues(&TissueTable::read(&Library::shipped()).map_err(|found| headlines(&found))?))
}

pub struct VolumeTimings {
    pub edt_ms: Percentiles,
    pub load_ms: Percentiles,
    pub mesh_ms: Percentiles,
    /// Surface update that one tick of cutting makes necessary, ms.
    pub remesh_ms: Percentiles,
    pub frames: FrameTimings,
}

/// Time to render an image of 780×690 pixels, in each display mode, ms.
#[derive(Serialize)]
pub struct FrameTimings {
    /// Renderer: the name of a graphics adapter, or `cpu`.
    pub adapter: String,
    pub surface: Percentiles,
    /// The surface with smoothed edges.
    pub surface_smooth: Percentiles,
    /// The surface with the maximum amount of dust and water.
    pub surface_specks: Percentiles,
    pub iso: Percentiles,
    pub volume: Percentiles,
}

pub fn measure(tooth: &Volume) -> Result<VolumeTimings, String> {
    let edt_ms = time_repeated(1e3, || {
        std::hint::black_box(distance::to_set(tooth.grid(), |i| tooth.tissue(i) == Label::AIR));
    });
    let mesh_ms = time_repeated(1e3, || {
        std::hint::black_box(surface::extract(tooth));
    });
    let load_ms = load_ms(tooth)?;
    Ok(VolumeTimings { edt_ms, load_ms, mesh_ms, remesh_ms: remesh_ms(tooth), frames: frames(tooth)? })
}

/// Time to rebuild the surface after one cut by a bur of 0.7 mm radius at the highest cusp.
fn remesh_ms(tooth: &Volume) -> Percentiles {
    let mut tooth = tooth.clone();
    let grid = *tooth.grid();
    let solid = (0..grid.len()).rev().find(|&i| tooth.tissue(i) != Label::AIR);
    let Some(highest) = solid else { return Percentiles::of(Vec::new()) };
    let middle = grid.centre(grid.cell(highest));
    tooth.take_dirty();
    let reach = Vec3::splat(0.7);
    let [xs, ys, zs] = grid.cells_within(middle - reach, middle + reach);
    for z in zs {
        for y in ys.clone() {
            for x in xs.clone() {
                tooth.set_cell([x, y, z], Voxel::AIR);
            }
        }
    }
    let dirty = tooth.take_dirty();
    time_repeated(1e3, || {
        for brick in surface::dirty_neighbourhood(&tooth, &dirty) {
            std::hint::black_box(surface::extract_brick(&tooth, brick));
        }
    })
}

fn frames(tooth: &Volume) -> Result<FrameTimings, String> {
    let (mut painter, _) = OffscreenRenderer::gpu_or_cpu();
    let table = TissueTable::read(&Library::shipped()).map_err(|found| headlines(&found))?;
    let palette =
        LabelPalette::from_colours(|label| table.by_label(label).map_or([0.5; 3], |tissue| tissue.rgb()), 0.2);
    let function = Arc::new(TransferFunction::tissue(&palette));
    let grid = tooth.grid();
    let bounds = grid.extent_of(&tooth.bounding_box().unwrap_or_default());
    let upright = Pose { position: Vec3::ZERO, orientation: Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2) };
    let orbit = Orbit::around(upright * bounds.centre(), bounds.half_size().length());
    let mut failed = None;
    let middle = upright * bounds.centre();
    let (grains, drops) = (particle_ball(middle, 2000, 1.0), particle_ball(middle, 800, 0.3));
    let mut times = |shown: RenderMode, is_smooth: bool, specks: [&[Particle]; 2]| {
        let mut view = orbit;
        // Shaders are compiled with the first image; the times of the following ones are those a trainee experiences.
        let mut changes = Changes::All;
        let mut picture = || {
            let seen = VolumeInstance {
                volume: tooth,
                changes,
                world_from_tooth: upright,
                palette: &palette,
                mode: shown.clone(),
            };
            let [grains, drops] = specks;
            let scene = RenderScene {
                tooth: Some(seen),
                is_antialiased: is_smooth,
                opaque_particles: grains,
                translucent_particles: drops,
                ..RenderScene::empty()
            };
            let drawn = painter.draw_only(&scene, &view.viewpoint(), None, [780, 690]);
            failed = drawn.err().or(failed.take());
            changes = Changes::Bricks(&[]);
            view = view.rotated(STEP_AROUND, 0.0);
        };
        picture();
        time_repeated(1e3, picture)
    };
    let [surface, iso, volume] =
        [RenderMode::Surface, RenderMode::Iso, RenderMode::Volume(function)].map(|shown| times(shown, false, [&[]; 2]));
    let surface_smooth = times(RenderMode::Surface, true, [&[]; 2]);
    let surface_specks = times(RenderMode::Surface, false, [&grains, &drops]);
    match failed {
        Some(error) => Err(error.to_string()),
        None => {
            let adapter = painter.adapter().to_string();
            Ok(FrameTimings { adapter, surface, surface_smooth, surface_specks, iso, volume })
        }
    }
}

/// Particles of 0.1 mm, spread evenly over a ball of 9 mm by a Fibonacci lattice, the farthest first.
fn particle_ball(middle: Vec3, count: usize, opacity: f32) -> Vec<Particle> {
    let finish = Appearance { colour: [0.9; 3], gloss: 0.1 };
    let speck = |i: usize| {
        let height = 1.0 - 2.0 * (i as f32 + 0.5) / count as f32;
        let (ring, angle) = ((1.0 - height * height).max(0.0).sqrt(), 2.399_963 * i as f32);
        let place = middle + 9.0 * Vec3::new(ring * libm::cosf(angle), ring * libm::sinf(angle), -height);
        Particle { position: place, radius: 0.1, facing: None, appearance: finish, opacity }
    };
    (0..count).map(speck).collect()
}

/// Camera step between two images, rad: 40°, so that nine images make one turn around the tooth.
const STEP_AROUND: f32 = 0.698;

/// Time to read the tooth from a compressed NRRD file.
fn load_ms(tooth: &Volume) -> Result<Percentiles, String> {
    let image = VoxelImage {
        geometry: Geometry::of(tooth.grid(), CoordinateSystem::LeftPosteriorSuperior),
        samples: Samples::U8(tooth.densities().iter().map(|d| d.bits()).collect()),
        keys: Vec::new(),
    };
    let bytes = nrrd::bytes(&image, Encoding::Gzip).map_err(|e| e.to_string())?;
    drop(image);
    let file = TempPath::new("nrrd");
    std::fs::write(&file.0, bytes).map_err(|e| format!("{}: {e}", file.0.display()))?;
    let mut failed = None;
    let figures = time_repeated(1e3, || failed = nrrd::read(&file.0).err());
    match failed {
        Some(error) => Err(error.to_string()),
        None => Ok(figures),
    }
}

/// Time from starting the program to its end after printing one line.
pub fn startup_ms() -> Result<Percentiles, String> {
    let program = std::env::current_exe().map_err(|e| e.to_string())?;
    Ok(time_repeated(1e3, || {
        let output = Command::new(&program).arg("--version").output();
        std::hint::black_box(output.is_ok());
    }))
}

/// A file or folder that is removed when this value is dropped.
pub struct TempPath(pub PathBuf);

impl TempPath {
    pub fn new(extension: &str) -> TempPath {
        TempPath(std::env::temp_dir().join(format!("typodont-bench-{}.{extension}", std::process::id())))
    }
}

impl Drop for TempPath {
    fn drop(&mut self) {
        // If it is already removed, nothing is left to do.
        let _ = if self.0.is_dir() { std::fs::remove_dir_all(&self.0) } else { std::fs::remove_file(&self.0) };
    }
}
