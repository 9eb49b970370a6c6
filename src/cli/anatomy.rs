//! `typodont anatomy`: teeth as files, and a table of their sizes.

use super::{Failure, say, write};
use crate::anatomy::{self, Tissues, age, caliper, teeth};
use crate::content::{Library, TissueTable, obj};
use crate::report::{SurfacePart, surfaces_glb, tissue_map};
use crate::scenario;
use crate::scene::{Jaw, JawAlone};
use crate::volume::{Label, Volume, surface};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};

#[derive(Args)]
pub struct Arguments {
    /// The teeth, by their numbers (ISO 3950): 11–18, 21–28, 31–38, 41–48
    #[arg(long, value_name = "N", value_delimiter = ',', required_unless_present_any = ["all", "arch"], value_parser = number)]
    fdi: Vec<u8>,
    /// All 32 permanent teeth
    #[arg(long, conflicts_with = "fdi")]
    all: bool,
    /// One jaw in place of single teeth: JAW.glb, with a part for each of its 14 teeth and one for the gum
    #[arg(long, value_name = "JAW", conflicts_with_all = ["fdi", "all"])]
    arch: Option<ArchName>,
    /// As in a mouth of so many years, 12 to 90: pulps narrowed, cusps worn, of a jaw the gum gone back; without it unworn, with the
    /// pulps and the gum of an adult of 30
    #[arg(long, value_name = "YEARS", value_parser = age)]
    age: Option<f32>,
    /// Size of a voxel
    #[arg(long, value_name = "MM", default_value_t = 0.1, value_parser = spacing)]
    spacing_mm: f32,
    /// The folder: N.seg.nrrd, N.glb and N.obj for each tooth, and teeth.json
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum ArchName {
    Upper,
    Lower,
}

/// A row of `teeth.json`, measured on the voxels.
#[derive(Serialize)]
struct Row {
    fdi: u8,
    /// Which way y of the volume goes: "distal", or "mesial" in the upper left and the lower right.
    y: &'static str,
    crown_length_mm: f64,
    root_length_mm: f64,
    mesiodistal_mm: f64,
    mesiodistal_neck_mm: f64,
    buccolingual_mm: f64,
    buccolingual_neck_mm: f64,
    neckline_rise_mesial_mm: f64,
    neckline_rise_distal_mm: f64,
    enamel_mean_mm: f64,
    enamel_most_mm: f64,
    enamel_mm3: f64,
    dentine_mm3: f64,
    pulp_mm3: f64,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { fdi, all, arch, age, spacing_mm, output } = arguments;
    let table = TissueTable::read(&Library::shipped())?;
    let tissues = scenario::anatomy_tissues(&table);
    std::fs::create_dir_all(output)
        .map_err(|e| Failure::wrong(format!("{}: unwritable-folder: {e}", output.display())))?;
    if let Some(arch) = arch {
        return save_arch(output, *arch, Made { age: *age, spacing: *spacing_mm }, &table, &tissues);
    }
    let numbers: Vec<u8> = if *all { teeth::numbers().collect() } else { fdi.clone() };
    let mut rows = Vec::new();
    for fdi in numbers {
        let form = teeth::tooth_of_age(fdi, *age).ok_or_else(|| Failure::misuse(NO_SUCH))?;
        let grid = anatomy::grid_of_spacing(&form, *spacing_mm);
        let tooth = anatomy::grow(&form, grid, &tissues);
        save(output, fdi, &tooth, &table, &tissues)?;
        let row = row(fdi, &tooth, &tissues)
            .ok_or_else(|| Failure::wrong(format!("tooth {fdi} at {spacing_mm} mm is too coarse to be measured")))?;
        say(format!(
            "{fdi}: crown {:.1} mm, root {:.1} mm, {:.1} × {:.1} mm",
            row.crown_length_mm, row.root_length_mm, row.mesiodistal_mm, row.buccolingual_mm
        ))?;
        rows.push(row);
    }
    let text = serde_json::to_string_pretty(&rows).map_err(Failure::wrong)?;
    write(&output.join("teeth.json"), text + "\n")
}

/// At which age a jaw is made, in years, and of how large voxels, mm.
#[derive(Clone, Copy)]
struct Made {
    age: Option<f32>,
    spacing: f32,
}

/// A jaw as one glTF file: a part for each tooth, named by its number, and one for the gum.
fn save_arch(folder: &Path, arch: ArchName, made: Made, table: &TissueTable, tissues: &Tissues) -> Result<(), Failure> {
    let Made { age, spacing } = made;
    let (jaw, name) = match arch {
        ArchName::Upper => (Jaw::Upper, "upper"),
        ArchName::Lower => (Jaw::Lower, "lower"),
    };
    let JawAlone { gum, gum_colours, teeth: standing } = JawAlone::of(jaw, age, table);
    let enamel = table.by_label(tissues.enamel).map_or([0.95, 0.94, 0.9], |e| e.rgb());
    let mut parts = vec![SurfacePart::coloured("gum", gum, &gum_colours)];
    for (fdi, arch_from_tooth) in standing {
        let form = teeth::tooth_of_age(fdi, age).ok_or_else(|| Failure::misuse(NO_SUCH))?;
        let tooth = anatomy::grow(&form, anatomy::grid_of_spacing(&form, spacing), tissues);
        let mut mesh = surface::extract(&tooth);
        mesh.positions.iter_mut().for_each(|p| *p = arch_from_tooth * *p);
        mesh.normals.iter_mut().for_each(|n| *n = arch_from_tooth.turn(*n));
        parts.push(SurfacePart::plain(&fdi.to_string(), mesh, enamel));
    }
    let path = folder.join(format!("{name}.glb"));
    write(&path, surfaces_glb(&parts).map_err(Failure::Wrong)?)?;
    say(format!("{}: {} teeth and the gum", path.display(), parts.len() - 1))
}

/// The tooth as a label map, its tissues as one glTF file, its whole surface as OBJ.
fn save(folder: &Path, fdi: u8, tooth: &Volume, table: &TissueTable, tissues: &Tissues) -> Result<(), Failure> {
    write(&folder.join(format!("{fdi}.seg.nrrd")), tissue_map(tooth, table).map_err(Failure::Wrong)?)?;
    let part = |label: Label| {
        let entry = table.by_label(label);
        let mesh = surface::of_mask(tooth.grid(), |voxel| tooth.tissue(voxel) == label);
        SurfacePart::plain(entry.map_or("tissue", |e| e.name.as_str()), mesh, entry.map_or([0.9; 3], |e| e.rgb()))
    };
    let parts = [tissues.enamel, tissues.dentine, tissues.pulp].map(part);
    write(&folder.join(format!("{fdi}.glb")), surfaces_glb(&parts).map_err(Failure::Wrong)?)?;
    write(&folder.join(format!("{fdi}.obj")), obj::text(&surface::extract(tooth)))
}

fn row(fdi: u8, tooth: &Volume, tissues: &Tissues) -> Option<Row> {
    let sizes = caliper::sizes(tooth, tissues, teeth::is_mirrored(fdi))?;
    let enamel = caliper::enamel(tooth, tissues)?;
    let mm3 = |label: Label| rounded(tooth.count(label) as f64 * tooth.grid().voxel_mm3());
    let mm = |value: f32| rounded(f64::from(value));
    Some(Row {
        fdi,
        y: if teeth::is_mirrored(fdi) { "mesial" } else { "distal" },
        crown_length_mm: mm(sizes.crown),
        root_length_mm: mm(sizes.root),
        mesiodistal_mm: mm(sizes.mesiodistal[0]),
        mesiodistal_neck_mm: mm(sizes.mesiodistal[1]),
        buccolingual_mm: mm(sizes.buccolingual[0]),
        buccolingual_neck_mm: mm(sizes.buccolingual[1]),
        neckline_rise_mesial_mm: mm(sizes.neckline_rise[0]),
        neckline_rise_distal_mm: mm(sizes.neckline_rise[1]),
        enamel_mean_mm: mm(enamel.mean),
        enamel_most_mm: mm(enamel.most),
        enamel_mm3: mm3(tissues.enamel),
        dentine_mm3: mm3(tissues.dentine),
        pulp_mm3: mm3(tissues.pulp),
    })
}

/// To a thousandth: finer digits are a voxel's, not a tooth's.
fn rounded(value: f64) -> f64 {
    (value * 1000.0).round() / 1000.0
}

const NO_SUCH: &str = "FDI numbers run 11–18, 21–28, 31–38, 41–48";

fn number(text: &str) -> Result<u8, String> {
    let number = text.trim().parse().map_err(|_| NO_SUCH.to_string())?;
    teeth::tooth(number).map(|_| number).ok_or_else(|| NO_SUCH.to_string())
}

/// As a scenario's: 0.04 to 0.4 mm.
fn spacing(text: &str) -> Result<f32, String> {
    let spacing = text.parse().ok().filter(|mm| (0.04..=0.4).contains(mm));
    spacing.ok_or_else(|| "a tooth is grown with voxels of 0.04 to 0.4 mm".to_string())
}

fn age(text: &str) -> Result<f32, String> {
    let age = text.parse().ok().filter(|years| (age::LEAST..=age::MOST).contains(years));
    age.ok_or_else(|| format!("a mouth can look {} to {} years old", age::LEAST, age::MOST))
}
