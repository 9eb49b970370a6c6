//! `typodont anatomy`: writes teeth as files, with a table of their sizes.

use super::{CliError, print_line, write_file};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use typodont_anatomy::jaw::Jaw;
use typodont_anatomy::{TissueLabels, age, caliper, teeth};
use typodont_core::volume::{Label, Volume, surface};
use typodont_exercise::catalog::TissueTable;
use typodont_exercise::scenario;
use typodont_formats::{Library, obj};
use typodont_report::{SurfacePart, surfaces_glb, tissue_map};
use typodont_scene::StandaloneJaw;

#[derive(Args)]
pub struct Arguments {
    /// Teeth to generate, by their FDI numbers (ISO 3950): 11–18, 21–28, 31–38, 41–48
    #[arg(long, value_name = "N", value_delimiter = ',', required_unless_present_any = ["all", "arch"], value_parser = number)]
    fdi: Vec<u8>,
    /// All 32 permanent teeth
    #[arg(long, conflicts_with = "fdi")]
    all: bool,
    /// One jaw instead of single teeth: writes JAW.glb with a part for each of its 14 teeth and one for the gingiva
    #[arg(long, value_name = "JAW", conflicts_with_all = ["fdi", "all"])]
    arch: Option<ArchName>,
    /// Age of the dentition in years, 12 to 90: narrower pulps and worn cusps, and gingival recession in a jaw. Without it, the
    /// teeth are unworn, with the pulps and gingiva of an adult of 30
    #[arg(long, value_name = "YEARS", value_parser = age)]
    age: Option<f32>,
    /// Voxel size
    #[arg(long, value_name = "MM", default_value_t = 0.1, value_parser = spacing)]
    spacing_mm: f32,
    /// Output folder for N.seg.nrrd, N.glb and N.obj of each tooth and for teeth.json
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
struct ToothSizeRow {
    fdi: u8,
    /// Anatomical direction of the volume's +y axis: "distal", or "mesial" in the upper left and the lower right.
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

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let Arguments { fdi, all, arch, age, spacing_mm, output } = arguments;
    let table = TissueTable::read(&Library::shipped())?;
    let tissues = scenario::anatomy_tissues(&table);
    std::fs::create_dir_all(output)
        .map_err(|e| CliError::wrong(format!("{}: unwritable-folder: {e}", output.display())))?;
    if let Some(arch) = arch {
        return save_arch(output, *arch, ArchOptions { age: *age, spacing: *spacing_mm }, &table, &tissues);
    }
    let numbers: Vec<u8> = if *all { teeth::numbers().collect() } else { fdi.clone() };
    let mut rows = Vec::new();
    for fdi in numbers {
        let form = teeth::tooth_of_age(fdi, *age).ok_or_else(|| CliError::misuse(INVALID_FDI))?;
        let grid = typodont_anatomy::grid_of_spacing(&form, *spacing_mm);
        let tooth = typodont_anatomy::grow(&form, grid, &tissues);
        save_tooth(output, fdi, &tooth, &table, &tissues)?;
        let row = measure_tooth(fdi, &tooth, &tissues).ok_or_else(|| {
            CliError::wrong(format!(
                "tooth {fdi} cannot be measured at a voxel size of {spacing_mm} mm; \
            choose a smaller --spacing-mm"
            ))
        })?;
        print_line(format!(
            "{fdi}: crown {:.1} mm, root {:.1} mm, {:.1} × {:.1} mm",
            row.crown_length_mm, row.root_length_mm, row.mesiodistal_mm, row.buccolingual_mm
        ))?;
        rows.push(row);
    }
    let text = serde_json::to_string_pretty(&rows).map_err(CliError::wrong)?;
    write_file(&output.join("teeth.json"), text + "\n")
}

/// Age of the dentition, years, and voxel spacing, mm, of a jaw.
#[derive(Clone, Copy)]
struct ArchOptions {
    age: Option<f32>,
    spacing: f32,
}

/// Writes a jaw as one glTF file: a part for each tooth, named by its FDI number, and one for the gingiva.
fn save_arch(
    folder: &Path,
    arch: ArchName,
    options: ArchOptions,
    table: &TissueTable,
    tissues: &TissueLabels,
) -> Result<(), CliError> {
    let ArchOptions { age, spacing } = options;
    let (jaw, name) = match arch {
        ArchName::Upper => (Jaw::Upper, "upper"),
        ArchName::Lower => (Jaw::Lower, "lower"),
    };
    let StandaloneJaw { gum, gum_colours, teeth: standing } = StandaloneJaw::new(jaw, age, table);
    let enamel = table.by_label(tissues.enamel).map_or([0.95, 0.94, 0.9], |e| e.rgb());
    let mut parts = vec![SurfacePart::coloured("gum", gum, &gum_colours)];
    for (fdi, arch_from_tooth) in standing {
        let form = teeth::tooth_of_age(fdi, age).ok_or_else(|| CliError::misuse(INVALID_FDI))?;
        let tooth = typodont_anatomy::grow(&form, typodont_anatomy::grid_of_spacing(&form, spacing), tissues);
        let mut mesh = surface::extract(&tooth);
        mesh.positions.iter_mut().for_each(|p| *p = arch_from_tooth * *p);
        mesh.normals.iter_mut().for_each(|n| *n = arch_from_tooth.rotate(*n));
        parts.push(SurfacePart::plain(&fdi.to_string(), mesh, enamel));
    }
    let path = folder.join(format!("{name}.glb"));
    write_file(&path, surfaces_glb(&parts).map_err(CliError::Wrong)?)?;
    print_line(format!("{}: {} teeth and the gingiva", path.display(), parts.len() - 1))
}

/// Writes a tooth as a label map, its tissues as one glTF file, and its whole surface as OBJ.
fn save_tooth(
    folder: &Path,
    fdi: u8,
    tooth: &Volume,
    table: &TissueTable,
    tissues: &TissueLabels,
) -> Result<(), CliError> {
    write_file(&folder.join(format!("{fdi}.seg.nrrd")), tissue_map(tooth, table).map_err(CliError::Wrong)?)?;
    let part = |label: Label| {
        let entry = table.by_label(label);
        let mesh = surface::of_mask(tooth.grid(), |voxel| tooth.tissue(voxel) == label);
        SurfacePart::plain(entry.map_or("tissue", |e| e.name.as_str()), mesh, entry.map_or([0.9; 3], |e| e.rgb()))
    };
    let parts = [tissues.enamel, tissues.dentine, tissues.pulp].map(part);
    write_file(&folder.join(format!("{fdi}.glb")), surfaces_glb(&parts).map_err(CliError::Wrong)?)?;
    write_file(&folder.join(format!("{fdi}.obj")), obj::text(&surface::extract(tooth)))
}

fn measure_tooth(fdi: u8, tooth: &Volume, tissues: &TissueLabels) -> Option<ToothSizeRow> {
    let sizes = caliper::sizes(tooth, tissues, teeth::is_mirrored(fdi))?;
    let enamel = caliper::enamel_thickness(tooth, tissues)?;
    let mm3 = |label: Label| rounded(tooth.count(label) as f64 * tooth.grid().voxel_mm3());
    let mm = |value: f32| rounded(f64::from(value));
    Some(ToothSizeRow {
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

/// Rounds to a thousandth: finer digits are below the accuracy of a measurement on voxels.
fn rounded(value: f64) -> f64 {
    (value * 1000.0).round() / 1000.0
}

const INVALID_FDI: &str = "the FDI number must be one of 11–18, 21–28, 31–38 or 41–48";

fn number(text: &str) -> Result<u8, String> {
    let number = text.trim().parse().map_err(|_| INVALID_FDI.to_string())?;
    teeth::tooth(number).map(|_| number).ok_or_else(|| INVALID_FDI.to_string())
}

/// Parses a voxel spacing in the range allowed in scenarios, 0.04 to 0.4 mm.
fn spacing(text: &str) -> Result<f32, String> {
    let spacing = text.parse().ok().filter(|mm| (0.04..=0.4).contains(mm));
    spacing.ok_or_else(|| "the voxel size must be 0.04 to 0.4 mm".to_string())
}

fn age(text: &str) -> Result<f32, String> {
    let age = text.parse().ok().filter(|years| (age::MIN_AGE..=age::MAX_AGE).contains(years));
    age.ok_or_else(|| format!("the age must be {} to {} years", age::MIN_AGE, age::MAX_AGE))
}
