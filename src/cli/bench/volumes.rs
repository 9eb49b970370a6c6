//! Measurements on whole volumes: distances, files and surfaces; and the start-up time of the program.

use super::percentiles::{Percentiles, time_repeated};
use std::path::PathBuf;
use std::process::Command;
use std::sync::Arc;
use typodont_anatomy::TissueLabels;
use typodont_core::frame::Vec3;
use typodont_core::volume::{Label, Volume, Voxel, density_at_distance, distance, surface};
use typodont_exercise::catalog::TissueTable;
use typodont_exercise::scenario;
use typodont_exercise::scenario::{ResolveMode, Scenario, ToothSource, Workpiece};
use typodont_formats::Library;
use typodont_formats::diagnostic::{SourceText, headlines};
use typodont_formats::import::ImportedTooth;
use typodont_formats::nrrd;
use typodont_formats::nrrd::{CoordinateSystem, Encoding, Geometry, Samples, VoxelImage};
use typodont_render::LabelPalette;

/// The exercise on which the measurements are taken.
const GRINDING: (&str, &str) = ("scenarios/5-grinding.json", include_str!("../../../scenarios/5-grinding.json"));

/// The lesion of every measured session: the same at every size.
pub const SEED: u64 = 1;

/// The grinding exercise on a given tooth.
pub fn exercise(tooth: Volume) -> Result<Scenario, String> {
    let source = SourceText::new(GRINDING.0, GRINDING.1);
    let mut scenario = scenario::resolve(source, &Library::shipped(), ResolveMode::MakeWorkpiece)
        .map_err(|found| headlines(&found))?;
    let tooth = Arc::new(ImportedTooth { volume: tooth, grey_values: None });
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
}

pub fn measure(tooth: &Volume) -> Result<VolumeTimings, String> {
    let edt_ms = time_repeated(1e3, || {
        std::hint::black_box(distance::to_set(tooth.grid(), |i| tooth.tissue(i) == Label::AIR));
    });
    let mesh_ms = time_repeated(1e3, || {
        std::hint::black_box(surface::extract(tooth));
    });
    let load_ms = load_ms(tooth)?;
    Ok(VolumeTimings { edt_ms, load_ms, mesh_ms, remesh_ms: remesh_ms(tooth) })
}

/// Time to rebuild the surface after one cut by a round bur of 0.7 mm radius at the highest cusp, in one thread.
fn remesh_ms(tooth: &Volume) -> Percentiles {
    let mut tooth = tooth.clone();
    let grid = *tooth.grid();
    let solid = (0..grid.len()).rev().find(|&i| tooth.tissue(i) != Label::AIR);
    let Some(highest) = solid else { return Percentiles::of(Vec::new()) };
    let middle = grid.centre(grid.cell(highest));
    tooth.take_dirty();
    const RADIUS: f32 = 0.7;
    let band = tooth.half_band();
    let reach = Vec3::splat(RADIUS + band);
    let [xs, ys, zs] = grid.cells_within(middle - reach, middle + reach);
    for z in zs {
        for y in ys.clone() {
            for x in xs.clone() {
                let before = tooth.voxel(grid.index([x, y, z]));
                let density = density_at_distance(RADIUS - grid.centre([x, y, z]).distance(middle), band);
                if density < before.density {
                    tooth.set_cell([x, y, z], Voxel { density, ..before });
                }
            }
        }
    }
    let dirty = tooth.take_dirty();
    time_repeated(1e3, || {
        for brick in surface::dirty_neighbourhood(&tooth, &dirty) {
            std::hint::black_box(surface::extract_brick(&tooth, &tooth, brick));
        }
    })
}

/// The colours of the shipped tissues.
pub fn palette() -> Result<LabelPalette, String> {
    let table = TissueTable::read(&Library::shipped()).map_err(|found| headlines(&found))?;
    Ok(LabelPalette::from_colours(|label| table.by_label(label).map_or([0.5; 3], |tissue| tissue.rgb()), 0.2))
}

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
