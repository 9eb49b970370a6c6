//! Work on whole volumes: distances, files, surfaces, pictures; and how long the program takes to start.

use super::figures::{Figures, repeated};
use crate::anatomy::Tissues;
use crate::content::nrrd::{self, Encoding, Geometry, Image, Samples, Space};
use crate::content::{Library, TissueTable};
use crate::diagnostic::{Source, headlines};
use crate::frame::{Pose, Quat, Vec3};
use crate::render::{Changes, Finish, Orbit, Painter, Palette, Scene, Shown, Speck, Tooth, TransferFunction};
use crate::scenario::{self, Form, Forms, Scenario, Workpiece};
use crate::volume::{Label, Volume, Voxel, distance, surface};
use serde::Serialize;
use std::path::PathBuf;
use std::process::Command;
use std::sync::Arc;

/// The exercise that is measured on.
const GRINDING: (&str, &str) = ("scenarios/5-grinding.json", include_str!("../../../scenarios/5-grinding.json"));

/// The lesion of every measured session: the same at every size.
pub const SEED: u64 = 1;

/// The grinding exercise on a given tooth.
pub fn exercise(tooth: Volume) -> Result<Scenario, String> {
    let source = Source::new(GRINDING.0, GRINDING.1);
    let mut scenario =
        scenario::resolve(source, &Library::shipped(), Forms::Made).map_err(|found| headlines(&found))?;
    let tooth = Arc::new(tooth);
    for each in &mut scenario.scene.teeth {
        each.form = Form::Given(tooth.clone());
    }
    Ok(scenario)
}

/// [`exercise`] and what its session works on; the tooth it was made from is let go.
pub fn grinding(tooth: Volume) -> Result<(Arc<Scenario>, Arc<Workpiece>), String> {
    let mut scenario = exercise(tooth)?;
    let workpiece = Workpiece::make(&scenario, SEED).map_err(|e| e.to_string())?;
    for each in &mut scenario.scene.teeth {
        each.form = Form::Recorded;
    }
    Ok((Arc::new(scenario), Arc::new(workpiece)))
}

/// The labels of the shipped table.
pub fn tissues() -> Result<Tissues, String> {
    Ok(scenario::anatomy_tissues(&TissueTable::read(&Library::shipped()).map_err(|found| headlines(&found))?))
}

pub struct Work {
    pub edt_ms: Figures,
    pub load_ms: Figures,
    pub mesh_ms: Figures,
    /// What one tick of cutting makes necessary.
    pub remesh_ms: Figures,
    pub frames: Frames,
}

/// One picture of 780×690 pixels, in each way to see a tooth.
#[derive(Serialize)]
pub struct Frames {
    /// What draws it: an adapter's name, or `cpu`.
    pub adapter: String,
    pub surface: Figures,
    /// The same with its edges smoothed.
    pub surface_smooth: Figures,
    /// The same among all the dust and water that there can be.
    pub surface_specks: Figures,
    pub iso: Figures,
    pub volume: Figures,
}

pub fn on(tooth: &Volume) -> Result<Work, String> {
    let edt_ms = repeated(1e3, || {
        std::hint::black_box(distance::to_set(tooth.grid(), |i| tooth.tissue(i) == Label::AIR));
    });
    let mesh_ms = repeated(1e3, || {
        std::hint::black_box(surface::extract(tooth));
    });
    let load_ms = load_ms(tooth)?;
    Ok(Work { edt_ms, load_ms, mesh_ms, remesh_ms: remesh_ms(tooth), frames: frames(tooth)? })
}

/// The surface around a bite of a bur of 0.7 mm radius, taken from the highest cusp.
fn remesh_ms(tooth: &Volume) -> Figures {
    let mut tooth = tooth.clone();
    let grid = *tooth.grid();
    let solid = (0..grid.len()).rev().find(|&i| tooth.tissue(i) != Label::AIR);
    let Some(highest) = solid else { return Figures::of(Vec::new()) };
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
    repeated(1e3, || {
        for brick in surface::affected(&tooth, &dirty) {
            std::hint::black_box(surface::brick(&tooth, brick));
        }
    })
}

fn frames(tooth: &Volume) -> Result<Frames, String> {
    let (mut painter, _) = Painter::best();
    let table = TissueTable::read(&Library::shipped()).map_err(|found| headlines(&found))?;
    let palette = Palette::of(|label| table.by_label(label).map_or([0.5; 3], |tissue| tissue.rgb()), 0.2);
    let function = Arc::new(TransferFunction::tissue(&palette));
    let grid = tooth.grid();
    let [low, high] = tooth.tight_box().unwrap_or_default().map(|cell| grid.centre(cell));
    let upright = Pose { position: Vec3::ZERO, orientation: Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2) };
    let orbit = Orbit::around(upright * (0.5 * (low + high)), 0.5 * (high - low).length());
    let mut failed = None;
    let middle = upright * (0.5 * (low + high));
    let (grains, drops) = (strewn(middle, 2000, 1.0), strewn(middle, 800, 0.3));
    let mut times = |shown: Shown, is_smooth: bool, specks: [&[Speck]; 2]| {
        let mut view = orbit;
        // Shaders are translated with the first picture; the next are what a trainee waits for.
        let mut changes = Changes::Anew;
        let mut picture = || {
            let seen =
                Tooth { volume: tooth, changes, world_from_tooth: upright, palette: &palette, shown: shown.clone() };
            let [grains, drops] = specks;
            let scene = Scene { tooth: Some(seen), is_smooth, grains, drops, ..Scene::empty() };
            let drawn = painter.draw_only(&scene, &view.viewpoint(), None, [780, 690]);
            failed = drawn.err().or(failed.take());
            changes = Changes::Bricks(&[]);
            view = view.turned(STEP_AROUND, 0.0);
        };
        picture();
        repeated(1e3, picture)
    };
    let [surface, iso, volume] =
        [Shown::Surface, Shown::Iso, Shown::Volume(function)].map(|shown| times(shown, false, [&[]; 2]));
    let surface_smooth = times(Shown::Surface, true, [&[]; 2]);
    let surface_specks = times(Shown::Surface, false, [&grains, &drops]);
    match failed {
        Some(error) => Err(error.to_string()),
        None => {
            let adapter = painter.adapter().to_string();
            Ok(Frames { adapter, surface, surface_smooth, surface_specks, iso, volume })
        }
    }
}

/// Specks of a tenth of a millimetre, spread evenly over a ball of 9 mm by a Fibonacci lattice, the farthest first.
fn strewn(middle: Vec3, count: usize, opacity: f32) -> Vec<Speck> {
    let finish = Finish { colour: [0.9; 3], gloss: 0.1 };
    let speck = |i: usize| {
        let height = 1.0 - 2.0 * (i as f32 + 0.5) / count as f32;
        let (ring, turn) = ((1.0 - height * height).max(0.0).sqrt(), 2.399_963 * i as f32);
        let place = middle + 9.0 * Vec3::new(ring * libm::cosf(turn), ring * libm::sinf(turn), -height);
        Speck { place, radius: 0.1, facing: None, finish, opacity }
    };
    (0..count).map(speck).collect()
}

/// 40°: nine pictures go once round the tooth.
const STEP_AROUND: f32 = 0.698;

/// Reading the tooth from a compressed NRRD.
fn load_ms(tooth: &Volume) -> Result<Figures, String> {
    let image = Image {
        geometry: Geometry::of(tooth.grid(), Space::LeftPosteriorSuperior),
        samples: Samples::U8(tooth.densities().iter().map(|d| d.bits()).collect()),
        keys: Vec::new(),
    };
    let bytes = nrrd::bytes(&image, Encoding::Gzip).map_err(|e| e.to_string())?;
    drop(image);
    let file = Scratch::new("nrrd");
    std::fs::write(&file.0, bytes).map_err(|e| format!("{}: {e}", file.0.display()))?;
    let mut failed = None;
    let figures = repeated(1e3, || failed = nrrd::read(&file.0).err());
    match failed {
        Some(error) => Err(error.to_string()),
        None => Ok(figures),
    }
}

/// From the shell to the first line and back.
pub fn startup_ms() -> Result<Figures, String> {
    let program = std::env::current_exe().map_err(|e| e.to_string())?;
    Ok(repeated(1e3, || {
        let told = Command::new(&program).arg("--version").output();
        std::hint::black_box(told.is_ok());
    }))
}

/// A file or a folder that is gone with its name.
pub struct Scratch(pub PathBuf);

impl Scratch {
    pub fn new(extension: &str) -> Scratch {
        Scratch(std::env::temp_dir().join(format!("typodont-bench-{}.{extension}", std::process::id())))
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // Gone already is as good.
        let _ = if self.0.is_dir() { std::fs::remove_dir_all(&self.0) } else { std::fs::remove_file(&self.0) };
    }
}
