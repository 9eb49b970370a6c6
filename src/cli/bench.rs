//! `typodont bench`: the product's own figures, measured here and now.

mod figures;
mod session;
mod ticks;
mod work;

use super::{Failure, say};
use crate::anatomy;
use crate::content::{nrrd, scan};
use crate::volume::Volume;
use clap::Args;
use figures::Figures;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

#[derive(Args)]
pub struct Arguments {
    /// A CT volume (NRRD) to measure on instead of the three sizes of the program's own tooth
    #[arg(long, value_name = "FILE")]
    volume: Option<PathBuf>,
    /// Distance between that volume's voxels, where its header lacks it
    #[arg(long, value_name = "MM", requires = "volume", value_parser = super::run::spacing)]
    tooth_spacing_mm: Option<f32>,
    /// Print JSON instead of a table
    #[arg(long)]
    json: bool,
    /// Run one session of that size and print the most memory it held: what `peak_mib` is taken from
    #[arg(long, value_name = "DIMS", hide = true)]
    session_peak: Option<String>,
}

/// The sizes that every figure is given for.
const DIMS: [[u32; 3]; 3] = [[128, 128, 80], [256, 256, 161], [512, 512, 322]];

/// The size that a whole session's replay and score are measured on.
const SESSION_DIMS: [u32; 3] = DIMS[1];

/// What is printed; times in the unit of their name, as `{p50, p99, max, n}`.
#[derive(Serialize, Default)]
struct Results {
    version: &'static str,
    threads: usize,
    cpu: String,
    tick_us: BTreeMap<String, BTreeMap<&'static str, Figures>>,
    mesh_ms: BTreeMap<String, Figures>,
    remesh_ms: BTreeMap<String, Figures>,
    frame_ms: BTreeMap<String, work::Frames>,
    edt_ms: BTreeMap<String, Figures>,
    load_ms: BTreeMap<String, Figures>,
    /// What the same path removes at each size, mm³.
    removed_mm3: BTreeMap<String, f64>,
    /// Five minutes of work, turned again.
    replay_s: Option<Figures>,
    /// Every measure of those five minutes, after the last tick.
    score_s: Option<Figures>,
    startup_ms: Option<Figures>,
    peak_mib: BTreeMap<String, f64>,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    if let Some(dims) = &arguments.session_peak {
        return session::print_peak(dims).map_err(Failure::Wrong);
    }
    let mut results = Results {
        version: env!("CARGO_PKG_VERSION"),
        threads: std::thread::available_parallelism().map_or(1, |n| n.get()),
        cpu: cpu(),
        ..Results::default()
    };
    let bar = super::run::spinner("measuring");
    let measured = measure(arguments, &mut results);
    bar.finish_and_clear();
    measured.map_err(Failure::Wrong)?;
    match arguments.json {
        // The types hold nothing that JSON cannot say.
        true => say(serde_json::to_string_pretty(&results).unwrap_or_default()),
        false => say(results.table().trim_end()),
    }
}

fn measure(arguments: &Arguments, results: &mut Results) -> Result<(), String> {
    match &arguments.volume {
        Some(path) => {
            let image = nrrd::read(path).map_err(|e| format!("{}: wrong-volume: {e}", path.display()))?;
            let spacing = arguments.tooth_spacing_mm.map(|mm| [mm; 3]);
            let tooth = scan::segmented(&image, spacing, &work::tissues()?)
                .map_err(|e| format!("{}: wrong-volume: {e}", path.display()))?;
            on(tooth, results)?;
        }
        None => {
            for dims in DIMS {
                on(grown(dims)?, results)?;
                let name = name_of(dims);
                results.peak_mib.insert(name.clone(), session::peak_mib(&name)?);
            }
            let five_minutes = session::five_minutes(grown(SESSION_DIMS)?)?;
            results.replay_s = Some(five_minutes.replay_s);
            results.score_s = Some(five_minutes.score_s);
        }
    }
    results.startup_ms = Some(work::startup_ms()?);
    Ok(())
}

/// Everything that is measured on one tooth.
fn on(tooth: Volume, results: &mut Results) -> Result<(), String> {
    let name = name_of(tooth.grid().dims);
    let work = work::on(&tooth)?;
    results.mesh_ms.insert(name.clone(), work.mesh_ms);
    results.remesh_ms.insert(name.clone(), work.remesh_ms);
    results.frame_ms.insert(name.clone(), work.frames);
    results.edt_ms.insert(name.clone(), work.edt_ms);
    results.load_ms.insert(name.clone(), work.load_ms);
    let ticks = ticks::on(tooth)?;
    results.tick_us.insert(name.clone(), ticks.us);
    results.removed_mm3.insert(name, ticks.removed_mm3);
    Ok(())
}

/// The program's own molar in a grid of a size.
fn grown(dims: [u32; 3]) -> Result<Volume, String> {
    let form = &anatomy::molar::LOWER_FIRST;
    Ok(anatomy::grow(form, anatomy::grid_fitting(form, dims), &work::tissues()?))
}

fn name_of(dims: [u32; 3]) -> String {
    dims.map(|n| n.to_string()).join("x")
}

/// The processor's name, where the system tells it.
fn cpu() -> String {
    let told = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = told.lines().find_map(|l| l.strip_prefix("model name"));
    model.and_then(|l| l.split_once(':')).map_or_else(|| std::env::consts::ARCH.into(), |(_, name)| name.trim().into())
}

impl Results {
    /// The same for people, one line per figure.
    fn table(&self) -> String {
        let mut lines = vec![format!("typodont {} on {}, {} threads", self.version, self.cpu, self.threads)];
        if let Some(frames) = self.frame_ms.values().next() {
            lines.push(format!("pictures: {}", frames.adapter));
        }
        lines.push(format!("{:<34}{:>10}{:>10}{:>10}{:>9}", "", "p50", "p99", "max", "n"));
        let mut line = |name: String, f: &Figures| {
            lines.push(format!("{name:<34}{:>10.2}{:>10.2}{:>10.2}{:>9}", f.p50, f.p99, f.max, f.n));
        };
        for (dims, cases) in &self.tick_us {
            cases.iter().for_each(|(case, f)| line(format!("tick_us.{dims}.{case}"), f));
        }
        for (dims, cases) in &self.frame_ms {
            line(format!("frame_ms.{dims}.surface"), &cases.surface);
            line(format!("frame_ms.{dims}.surface_smooth"), &cases.surface_smooth);
            line(format!("frame_ms.{dims}.surface_specks"), &cases.surface_specks);
            line(format!("frame_ms.{dims}.iso"), &cases.iso);
            line(format!("frame_ms.{dims}.volume"), &cases.volume);
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
            table.iter().map(|(dims, value)| format!("{:<34}{value:>10.2}", format!("{name}.{dims}"))).collect()
        };
        lines.extend(plain("removed_mm3", &self.removed_mm3));
        lines.extend(plain("peak_mib", &self.peak_mib));
        lines.join("\n") + "\n"
    }
}
