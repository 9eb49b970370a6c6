//! `typodont bench`: measures the program's speed and memory on this computer.

mod mouth;
mod percentiles;
mod pictures;
mod session;
mod ticks;
mod volumes;

use super::{CliError, print_line};

use clap::Args;
use percentiles::Percentiles;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::PathBuf;
use typodont_core::volume::Volume;
use typodont_exercise::tooth_import;
use typodont_formats::nrrd;

#[derive(Args)]
pub struct Arguments {
    /// CT volume (NRRD) to measure with, instead of the program's own tooth in several sizes; may be repeated
    #[arg(long, value_name = "FILE")]
    volume: Vec<PathBuf>,
    /// Voxel spacing of these volumes, if their headers do not state it
    #[arg(long, value_name = "MM", requires = "volume", value_parser = super::run::spacing)]
    tooth_spacing_mm: Option<f32>,
    /// Measure only the ticks of the servo
    #[arg(long)]
    ticks: bool,
    /// Measure only pictures, also those of the whole mouth for both eyes at 3840×2160 pixels; `--volume` applies
    #[arg(long, conflicts_with = "ticks")]
    pictures: bool,
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    /// Run one session of this size and print its peak memory, which `peak_mib` reports
    #[arg(long, value_name = "DIMS", hide = true)]
    session_peak: Option<String>,
}

/// Volume sizes, voxels, for which every figure is measured.
const DIMS: [[u32; 3]; 3] = [[128, 128, 80], [256, 256, 161], [512, 512, 322]];

/// Voxel sizes, mm, for which the ticks of the servo are measured as well: those of micro-CT scans of single teeth, 22 mm
/// over 128, 256 and 512 voxels. Dimensions alone say little, because a grid may be much wider than its tooth.
const VOXEL_SIZES: [f32; 3] = [22.0 / 128.0, 22.0 / 256.0, 22.0 / 512.0];

/// Volume size, voxels, on which the replay and scoring of a whole session are measured.
const SESSION_DIMS: [u32; 3] = DIMS[1];

/// Results as they are printed; times are in the unit of their name, as `{p50, p99, max, n}`.
#[derive(Serialize, Default)]
struct BenchResults {
    version: &'static str,
    threads: usize,
    cpu: String,
    /// Size of a voxel of each measured volume, mm.
    voxel_mm: BTreeMap<String, f64>,
    tick_us: BTreeMap<String, BTreeMap<&'static str, Percentiles>>,
    mesh_ms: BTreeMap<String, Percentiles>,
    remesh_ms: BTreeMap<String, Percentiles>,
    frame_ms: BTreeMap<String, pictures::FrameTimings>,
    /// Pictures of the whole mouth for both eyes.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    stereo_4k_ms: BTreeMap<String, pictures::StereoTimings>,
    edt_ms: BTreeMap<String, Percentiles>,
    load_ms: BTreeMap<String, Percentiles>,
    /// One tooth by itself, and the same tooth among all others of the mouth.
    #[serde(skip_serializing_if = "Option::is_none")]
    mouth: Option<mouth::MouthTimings>,
    /// Volume removed by the same path at each size, mm³.
    removed_mm3: BTreeMap<String, f64>,
    /// Replay of a session of five minutes, s.
    replay_s: Option<Percentiles>,
    /// Computation of all metrics of that session, after its last tick, s.
    score_s: Option<Percentiles>,
    startup_ms: Option<Percentiles>,
    peak_mib: BTreeMap<String, f64>,
}

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    if let Some(dims) = &arguments.session_peak {
        return session::print_peak(dims).map_err(CliError::Wrong);
    }
    let mut results = BenchResults {
        version: env!("CARGO_PKG_VERSION"),
        threads: std::thread::available_parallelism().map_or(1, |n| n.get()),
        cpu: cpu(),
        ..BenchResults::default()
    };
    let bar = super::run::spinner("measuring");
    let measured = measure(arguments, &mut results);
    bar.finish_and_clear();
    measured.map_err(CliError::Wrong)?;
    match arguments.json {
        // The types contain only values that JSON can represent.
        true => print_line(serde_json::to_string_pretty(&results).unwrap_or_default()),
        false => print_line(results.table().trim_end()),
    }
}

fn measure(arguments: &Arguments, results: &mut BenchResults) -> Result<(), String> {
    let measure_tooth = match arguments {
        Arguments { ticks: true, .. } => measure_ticks,
        Arguments { pictures: true, .. } => measure_pictures,
        _ => measure_all,
    };
    let is_partial = arguments.ticks || arguments.pictures;
    for path in &arguments.volume {
        let image = nrrd::read(path).map_err(|e| format!("{}: wrong-volume: {e}", path.display()))?;
        let spacing = arguments.tooth_spacing_mm.map(|mm| [mm; 3]);
        let tooth = tooth_import::segmented(&image, spacing, &volumes::tissues()?)
            .map_err(|e| format!("{}: wrong-volume: {e}", path.display()))?;
        measure_tooth(tooth.volume, results)?;
    }
    if arguments.volume.is_empty() {
        for dims in DIMS {
            measure_tooth(grow_tooth(dims)?, results)?;
        }
        if !arguments.pictures {
            for spacing in VOXEL_SIZES {
                measure_ticks(grow_tooth_of_spacing(spacing)?, results)?;
            }
            results.mouth = Some(mouth::measure()?);
        }
        if !is_partial {
            measure_sessions(results)?;
        }
    }
    if !is_partial {
        results.startup_ms = Some(volumes::startup_ms()?);
    }
    Ok(())
}

/// Measures whole sessions on the program's own tooth.
fn measure_sessions(results: &mut BenchResults) -> Result<(), String> {
    for name in DIMS.map(name_of) {
        let peak = session::peak_mib(&name)?;
        results.peak_mib.insert(name, peak);
    }
    let five_minutes = session::five_minutes(grow_tooth(SESSION_DIMS)?)?;
    results.replay_s = Some(five_minutes.replay_s);
    results.score_s = Some(five_minutes.score_s);
    Ok(())
}

/// Takes all measurements on one tooth.
fn measure_all(tooth: Volume, results: &mut BenchResults) -> Result<(), String> {
    let name = name_of(tooth.grid().dims);
    let work = volumes::measure(&tooth)?;
    results.mesh_ms.insert(name.clone(), work.mesh_ms);
    results.remesh_ms.insert(name.clone(), work.remesh_ms);
    results.frame_ms.insert(name.clone(), pictures::measure_tooth(&tooth)?);
    results.edt_ms.insert(name.clone(), work.edt_ms);
    results.load_ms.insert(name, work.load_ms);
    measure_ticks(tooth, results)
}

/// Measures pictures of one tooth.
fn measure_pictures(tooth: Volume, results: &mut BenchResults) -> Result<(), String> {
    let name = name_of(tooth.grid().dims);
    results.voxel_mm.insert(name.clone(), f64::from(tooth.grid().spacing.max_element()));
    results.frame_ms.insert(name.clone(), pictures::measure_tooth(&tooth)?);
    let (scenario, workpiece) = volumes::grinding_workpiece(tooth)?;
    results.stereo_4k_ms.insert(name, pictures::measure_exercise(&scenario, &workpiece)?);
    Ok(())
}

/// Measures the ticks of the servo on one tooth.
fn measure_ticks(tooth: Volume, results: &mut BenchResults) -> Result<(), String> {
    let name = name_of(tooth.grid().dims);
    results.voxel_mm.insert(name.clone(), f64::from(tooth.grid().spacing.max_element()));
    let ticks = ticks::measure(tooth)?;
    results.tick_us.insert(name.clone(), ticks.us);
    results.removed_mm3.insert(name, ticks.removed_mm3);
    Ok(())
}

/// Generates the program's own molar in a grid of this size, voxels.
fn grow_tooth(dims: [u32; 3]) -> Result<Volume, String> {
    let form = &typodont_anatomy::lower_first_molar::LOWER_FIRST;
    Ok(typodont_anatomy::grow(form, typodont_anatomy::grid_fitting(form, dims), &volumes::tissues()?))
}

/// Generates the program's own molar in the smallest grid with this voxel size, mm.
fn grow_tooth_of_spacing(spacing: f32) -> Result<Volume, String> {
    let form = &typodont_anatomy::lower_first_molar::LOWER_FIRST;
    Ok(typodont_anatomy::grow(form, typodont_anatomy::grid_of_spacing(form, spacing), &volumes::tissues()?))
}

fn name_of(dims: [u32; 3]) -> String {
    dims.map(|n| n.to_string()).join("x")
}

/// Name of the processor, if the system reports it.
fn cpu() -> String {
    let cpuinfo = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpuinfo.lines().find_map(|l| l.strip_prefix("model name"));
    model.and_then(|l| l.split_once(':')).map_or_else(|| std::env::consts::ARCH.into(), |(_, name)| name.trim().into())
}

impl BenchResults {
    /// The results as a text table, one line per figure.
    fn table(&self) -> String {
        let mut lines = vec![format!("typodont {} on {}, {} threads", self.version, self.cpu, self.threads)];
        if let Some(frames) = self.frame_ms.values().next() {
            lines.push(format!("pictures: {}", frames.adapter));
        }
        lines.push(format!("{:<34}{:>10}{:>10}{:>10}{:>9}", "", "p50", "p99", "max", "n"));
        let mut line = |name: String, f: &Percentiles| {
            lines.push(format!("{name:<34}{:>10.2}{:>10.2}{:>10.2}{:>9}", f.p50, f.p99, f.max, f.n));
        };
        for (dims, cases) in &self.tick_us {
            cases.iter().for_each(|(case, f)| line(format!("tick_us.{dims}.{case}"), f));
        }
        if let Some(mouth) = &self.mouth {
            for (name, cases) in [("one_tooth", &mouth.one_tooth_tick_us), ("mouth", &mouth.mouth_tick_us)] {
                cases.iter().for_each(|(case, f)| line(format!("mouth.{name}.{case}"), f));
            }
            line("mouth.open_s".into(), &mouth.open_s);
        }
        for (dims, cases) in &self.frame_ms {
            line(format!("frame_ms.{dims}.surface"), &cases.surface);
            line(format!("frame_ms.{dims}.surface_smooth"), &cases.surface_smooth);
            line(format!("frame_ms.{dims}.surface_specks"), &cases.surface_specks);
            line(format!("frame_ms.{dims}.iso"), &cases.iso);
            line(format!("frame_ms.{dims}.volume"), &cases.volume);
        }
        for (dims, cases) in &self.stereo_4k_ms {
            line(format!("stereo_4k_ms.{dims}.surface"), &cases.surface);
            line(format!("stereo_4k_ms.{dims}.surface_shadows"), &cases.surface_shadows);
            line(format!("stereo_4k_ms.{dims}.iso"), &cases.iso);
            line(format!("stereo_4k_ms.{dims}.iso_shadows"), &cases.iso_shadows);
            line(format!("stereo_4k_ms.{dims}.volume"), &cases.volume);
        }
        let tables = [
            ("mesh_ms", &self.mesh_ms),
            ("remesh_ms", &self.remesh_ms),
            ("edt_ms", &self.edt_ms),
            ("load_ms", &self.load_ms),
        ];
        for (name, table) in tables {
            table.iter().for_each(|(dims, f)| line(format!("{name}.{dims}"), f));
        }
        let single = [("replay_s", &self.replay_s), ("score_s", &self.score_s), ("startup_ms", &self.startup_ms)];
        for (name, figures) in single {
            figures.iter().for_each(|f| line(name.to_string(), f));
        }
        let plain = |name: &str, table: &BTreeMap<String, f64>| -> Vec<String> {
            table.iter().map(|(dims, value)| format!("{:<34}{value:>10.3}", format!("{name}.{dims}"))).collect()
        };
        lines.extend(plain("voxel_mm", &self.voxel_mm));
        lines.extend(plain("removed_mm3", &self.removed_mm3));
        lines.extend(plain("peak_mib", &self.peak_mib));
        lines.join("\n") + "\n"
    }
}
