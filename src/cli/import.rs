//! `typodont import`: converts a scan, a label map or surfaces into a labelled tooth.

use super::{CliError, print_line, write_file};

use clap::Args;
use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::{Path, PathBuf};
use typodont_core::aabb::Aabb;
use typodont_core::frame::Vec3;
use typodont_core::volume::{CellBox, Label, Volume};
use typodont_exercise::catalog::TissueTable;
use typodont_exercise::scenario;
use typodont_exercise::tooth_import;
use typodont_formats::imaging;
use typodont_formats::imaging::{CropOptions, ReadOptions, raw};
use typodont_formats::import::voxelize::{UNITS, VoxelizeError, Voxelized};
use typodont_formats::import::{ImportedTooth, set_upright, voxelize};
use typodont_formats::nrrd::{Samples, VoxelImage};
use typodont_formats::{Library, surfaces};
use typodont_report::{grey_value_map, sections_png, tissue_map};

/// Default voxel spacing of a tooth built from surfaces, mm: that of the program's own teeth.
const SPACING: f32 = 0.1;

#[derive(Args)]
#[command(after_help = HELP)]
pub struct Arguments {
    /// CT volume, label map, folder of DICOM slices, or surface made of closed shells
    #[arg(required_unless_present = "tissue", conflicts_with = "tissue")]
    scan: Option<PathBuf>,
    /// Label map to write: enamel, dentine and pulp, crown up; 3D Slicer can open it, and a scenario refers to it under "labels"
    #[arg(short, long, value_name = "FILE.seg.nrrd")]
    output: PathBuf,
    /// Image to write: three sections with the tissues in their colours
    #[arg(long, value_name = "FILE.png")]
    preview: Option<PathBuf>,
    /// Grey values of a CT volume to write, on the grid of the label map; a scenario refers to it under "scan"
    #[arg(long, value_name = "FILE.nrrd")]
    grey_values: Option<PathBuf>,
    /// Voxel spacing of the scan, if its file does not state it, or of the volume made from surfaces [default for surfaces: 0.1]
    #[arg(long, value_name = "MM", value_parser = spacing)]
    spacing_mm: Option<[f32; 3]>,
    /// Resample the scan along the axes of space with this voxel spacing
    #[arg(long, value_name = "MM", value_parser = super::run::spacing)]
    resample: Option<f32>,
    /// Crop the scan to the box between these coordinates, mm (left, posterior, superior)
    #[arg(long, value_name = "X0,X1,Y0,Y1,Z0,Z1", value_parser = numbers::<6>, allow_hyphen_values = true)]
    crop: Option<[f32; 6]>,
    /// Crop one tooth around a point in it, mm (left, posterior, superior)
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers::<3>, conflicts_with = "crop", allow_hyphen_values = true)]
    at: Option<[f32; 3]>,
    /// Half the side of the box around that point, mm
    #[arg(long, value_name = "MM", default_value_t = 14.0, requires = "at")]
    around: f32,
    /// Meaning of the numbers in a label map, as in enamel=1,dentine=2,pulp=3
    #[arg(long, value_name = "TISSUE=NUMBER,…", value_parser = named_number, value_delimiter = ',')]
    labels: Vec<(String, u8)>,
    /// Closed surface of each tissue, as in enamel=e.stl dentine=d.stl pulp=p.stl
    #[arg(long, value_name = "TISSUE=FILE", num_args = 1.., value_parser = named_file)]
    tissue: Vec<(String, PathBuf)>,
    /// Tissues within the closed shells of one surface, from outside in
    #[arg(
        long,
        value_name = "TISSUE,…",
        value_delimiter = ',',
        default_value = "enamel,dentine,pulp",
        hide_default_value = true
    )]
    shells: Vec<String>,
    /// Unit of length of the surfaces
    #[arg(long, default_value = "mm", value_parser = UNITS.map(|(name, _)| name))]
    unit: String,
    /// Series to read if a folder of DICOM slices contains several: its number, or the end of its UID
    #[arg(long)]
    series: Option<String>,
    /// Raw voxels: number along x, y and z
    #[arg(long, value_name = "X,Y,Z", value_parser = sizes, requires = "type", requires = "spacing_mm")]
    size: Option<[u64; 3]>,
    /// Raw voxels: type of each value
    #[arg(long, requires = "size", value_parser = NUMBERS.map(|(name, _)| name))]
    r#type: Option<String>,
    /// Raw voxels: the most significant byte comes first
    #[arg(long, requires = "size")]
    big_endian: bool,
    /// Raw voxels: number of bytes before the first voxel
    #[arg(long, value_name = "N", default_value_t = 0, requires = "size")]
    skip_bytes: u64,
}

const HELP: &str = "\
Supported inputs: NRRD (.nrrd, .nhdr, .seg.nrrd); NIfTI-1 (.nii, .nii.gz); MetaImage (.mha, .mhd); a folder with one DICOM \
series of CT or CBCT, uncompressed, run-length coded or JPEG Lossless; raw voxels (--size, --type, --spacing-mm); closed \
surfaces as STL, PLY, OBJ or glTF (.glb, .gltf), one per tissue or nested in one another.

A CT volume is segmented into enamel, dentine and pulp. A label map is used as drawn. For surfaces, each voxel is assigned \
the tissue in which its centre is located.

  typodont import tooth.nii.gz -o tooth.seg.nrrd --preview tooth.png
  typodont import cbct/ --at -21.5,38,102 --resample 0.1 -o 36.seg.nrrd
  typodont import map.nii.gz --labels enamel=1,dentine=2,pulp=3 -o tooth.seg.nrrd
  typodont import --tissue enamel=e.stl dentine=d.stl pulp=p.stl -o tooth.seg.nrrd";

/// Names of the raw sample types in `--type`.
const NUMBERS: [(&str, raw::RawSampleType); 8] = [
    ("uint8", raw::RawSampleType::Uint8),
    ("int8", raw::RawSampleType::Int8),
    ("uint16", raw::RawSampleType::Uint16),
    ("int16", raw::RawSampleType::Int16),
    ("uint32", raw::RawSampleType::Uint32),
    ("int32", raw::RawSampleType::Int32),
    ("float", raw::RawSampleType::Float),
    ("double", raw::RawSampleType::Double),
];

/// An imported tooth, and what its author should know about it.
struct ImportResult {
    tooth: ImportedTooth,
    notes: Vec<String>,
}

impl From<Voxelized> for ImportResult {
    fn from(Voxelized { volume, notes }: Voxelized) -> ImportResult {
        ImportResult { tooth: ImportedTooth { volume, grey_values: None }, notes }
    }
}

fn numbers<const N: usize>(text: &str) -> Result<[f32; N], String> {
    let found: Option<Vec<f32>> = text.split(',').map(|word| word.trim().parse().ok()).collect();
    let numbers: Option<[f32; N]> = found.and_then(|found| found.try_into().ok());
    numbers
        .filter(|n| n.iter().all(|v| v.is_finite()))
        .ok_or_else(|| format!("expected {N} numbers separated by commas"))
}

/// Parses a voxel spacing: one number for all axes, or three.
fn spacing(text: &str) -> Result<[f32; 3], String> {
    let words: Vec<&str> = text.split(',').collect();
    let found = words.iter().map(|word| super::run::spacing(word.trim())).collect::<Result<Vec<f32>, String>>()?;
    match found[..] {
        [mm] => Ok([mm; 3]),
        [x, y, z] => Ok([x, y, z]),
        _ => Err("expected one distance, or three separated by commas".into()),
    }
}

fn sizes(text: &str) -> Result<[u64; 3], String> {
    let found: Option<Vec<u64>> = text.split(',').map(|word| word.trim().parse().ok()).collect();
    found
        .and_then(|found| found.try_into().ok())
        .ok_or_else(|| "expected three whole numbers separated by commas".into())
}

fn named_number(text: &str) -> Result<(String, u8), String> {
    let pair = text.split_once('=').and_then(|(name, number)| Some((name.to_string(), number.parse().ok()?)));
    pair.filter(|(_, number)| *number > 0).ok_or_else(|| "expected a tissue and its number, as in enamel=1".into())
}

fn named_file(text: &str) -> Result<(String, PathBuf), String> {
    let pair = text.split_once('=').filter(|(name, file)| !name.is_empty() && !file.is_empty());
    pair.map(|(name, file)| (name.to_string(), file.into()))
        .ok_or_else(|| "expected a tissue and a file, as in enamel=e.stl".into())
}

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    check_outputs(arguments)?;
    let table = TissueTable::read(&Library::shipped())?;
    let bar = super::run::spinner("segmenting the tissues");
    let made = make_tooth(arguments, &table);
    bar.finish_and_clear();
    let ImportResult { tooth: ImportedTooth { volume, grey_values }, notes } = made?;
    write_file(&arguments.output, tissue_map(&volume, &table).map_err(CliError::Wrong)?)?;
    if let (Some(path), Some(values)) = (&arguments.grey_values, &grey_values) {
        write_file(path, grey_value_map(&volume, values).map_err(CliError::Wrong)?)?;
    }
    if let Some(preview) = &arguments.preview {
        write_file(preview, sections_png(&volume, &table))?;
    }
    notes.iter().for_each(|note| eprintln!("note: {note}"));
    print_line(describe(&volume, &table))
}

/// Checks, before anything is read, that no output file is also an input file.
fn check_outputs(arguments: &Arguments) -> Result<(), CliError> {
    let Arguments { output, preview, grey_values, .. } = arguments;
    if !output.to_string_lossy().ends_with(".nrrd") {
        return Err(CliError::misuse(format!("{}: the name of the label map must end in .seg.nrrd", output.display())));
    }
    if let Some(preview) = preview.as_ref().filter(|p| p.extension().is_none_or(|e| !e.eq_ignore_ascii_case("png"))) {
        return Err(CliError::misuse(format!("{}: the name of the image must end in .png", preview.display())));
    }
    if let Some(written) = grey_values.as_ref().filter(|p| !p.to_string_lossy().ends_with(".nrrd")) {
        return Err(CliError::misuse(format!("{}: the name of the grey values must end in .nrrd", written.display())));
    }
    let is_one_file = |a: &Path, b: &Path| {
        let folder = |path: &Path| path.parent().map(|parent| Path::new(".").join(parent).canonicalize().ok());
        a.file_name() == b.file_name() && folder(a) == folder(b)
    };
    if grey_values.as_ref().is_some_and(|path| is_one_file(path, output)) {
        return Err(CliError::misuse(format!(
            "{}: the label map and the grey values need two names",
            output.display()
        )));
    }
    let is_surface = arguments.scan.as_ref().is_none_or(|path| surfaces::is_surface(path));
    if grey_values.is_some() && (is_surface || !arguments.labels.is_empty()) {
        return Err(no_grey_values());
    }
    let inputs = arguments.scan.iter().chain(arguments.tissue.iter().map(|(_, file)| file));
    let is_same = |a: &Path, b: &Path| a.canonicalize().is_ok_and(|a| b.canonicalize().is_ok_and(|b| a == b));
    for input in inputs {
        if let Some(written) =
            std::iter::once(output).chain(preview).chain(grey_values).find(|written| is_same(input, written))
        {
            return Err(CliError::misuse(format!(
                "{}: this is an input file and would be overwritten; choose another \
            name",
                written.display()
            )));
        }
    }
    Ok(())
}

fn no_grey_values() -> CliError {
    CliError::misuse("--grey-values: only a CT volume has grey values; label maps and surfaces have none")
}

fn make_tooth(arguments: &Arguments, table: &TissueTable) -> Result<ImportResult, CliError> {
    match &arguments.scan {
        Some(path) if surfaces::is_surface(path) => {
            let labels = arguments.shells.iter().map(|name| label(table, name)).collect::<Result<Vec<Label>, _>>()?;
            let triangles = triangles(path, arguments)?;
            let parts = voxelize::nested_tissue_surfaces(&labels, &triangles)
                .map_err(|unsound| surface_error(path, &unsound))?;
            voxelize_parts(&parts, arguments, table)
                .map_err(|unsound| surface_error(path, &unsound))
                .map(ImportResult::from)
        }
        Some(path) => from_scan(path, arguments, table),
        None => from_tissues(arguments, table).map(ImportResult::from),
    }
}

fn from_tissues(arguments: &Arguments, table: &TissueTable) -> Result<Voxelized, CliError> {
    let mut named = Vec::new();
    for (name, path) in &arguments.tissue {
        named.push((label(table, name)?, path));
    }
    // From outside in: where two surfaces overlap, the inner tissue is used.
    let tissues = scenario::anatomy_tissues(table);
    let depth = |label: Label| [tissues.enamel, tissues.dentine, tissues.pulp].iter().position(|l| *l == label);
    named.sort_by_key(|(label, _)| depth(*label).unwrap_or(usize::MAX));
    if let Some(pair) = named.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        return Err(CliError::misuse(format!(
            "{}: another surface was given for the same tissue; give one surface per \
        tissue",
            pair[1].1.display()
        )));
    }
    let mut parts = Vec::new();
    for (label, path) in named {
        let mut part = voxelize::tissue_surface(label, &triangles(path, arguments)?)
            .map_err(|unsound| surface_error(path, &unsound))?;
        part.notes.iter_mut().for_each(|note| *note = format!("{}: {note}", path.display()));
        parts.push(part);
    }
    let first = &arguments.tissue[0].1;
    voxelize_parts(&parts, arguments, table).map_err(|unsound| surface_error(first, &unsound))
}

fn surface_error(path: &Path, unsound: &VoxelizeError) -> CliError {
    CliError::Wrong(format!("{}: wrong-surface: {unsound}", path.display()))
}

/// Reads the triangles of a surface, mm.
fn triangles(path: &Path, arguments: &Arguments) -> Result<Vec<[Vec3; 3]>, CliError> {
    let mm = UNITS.iter().find(|(name, _)| *name == arguments.unit).map_or(1.0, |(_, mm)| *mm);
    let triangles = surfaces::read(path).map_err(|unread| volume_error(path, &unread))?;
    Ok(triangles.into_iter().map(|t| t.map(|corner| corner * mm)).collect())
}

fn voxelize_parts(
    parts: &[voxelize::TissueSurface],
    arguments: &Arguments,
    table: &TissueTable,
) -> Result<Voxelized, VoxelizeError> {
    let spacing = arguments.resample.or(arguments.spacing_mm.map(|[x, ..]| x)).unwrap_or(SPACING);
    voxelize::voxelize(parts, spacing, crop_box(arguments), &scenario::anatomy_tissues(table))
}

fn from_scan(path: &Path, arguments: &Arguments, table: &TissueTable) -> Result<ImportResult, CliError> {
    let number = arguments.r#type.as_ref().and_then(|type_name| NUMBERS.iter().find(|(name, _)| name == type_name));
    let raw =
        arguments.size.zip(number).zip(arguments.spacing_mm).map(|((size, (_, number)), spacing)| raw::RawLayout {
            size,
            sample_type: *number,
            is_big_endian: arguments.big_endian,
            skip: arguments.skip_bytes,
            spacing: spacing.map(as_typed_f64),
        });
    if path.is_dir() && arguments.spacing_mm.is_some() {
        let what = "DICOM slices state their pixel spacing; to change it, give --resample instead of --spacing-mm";
        return Err(CliError::misuse(format!("{}: {what}", path.display())));
    }
    let is_raw = raw.is_some();
    let read_options = ReadOptions { raw, series: arguments.series.clone() };
    let imaging::ImportedScan { mut image, mut notes } =
        imaging::read(path, &read_options).map_err(|unread| volume_error(path, &unread))?;
    if let Some(spacing) = arguments.spacing_mm.filter(|_| !is_raw) {
        respace(&mut image, spacing);
    }
    let names = label_names(&image, arguments, table).map_err(|what| volume_error(path, &what))?;
    if names.is_some() && arguments.grey_values.is_some() {
        return Err(no_grey_values());
    }
    let wanted = CropOptions {
        crop: crop_box(arguments).map(|crop| [crop.low.as_dvec3(), crop.high.as_dvec3()]),
        resample: arguments.resample.map(as_typed_f64),
        holds_labels: names.is_some(),
    };
    let image = imaging::crop_and_resample(image, &wanted)
        .and_then(imaging::require_axis_aligned)
        .map_err(|unread| volume_error(path, &unread))?;
    let tissues = scenario::anatomy_tissues(table);
    let dims = image.geometry.dims;
    let tooth = match &names {
        Some(names) => tooth_import::labelled(&image, None, names)
            .map(|volume| ImportedTooth { volume: set_upright(volume, &tissues), grey_values: None }),
        None => tooth_import::segmented_labels(image, &tissues, arguments.grey_values.is_some()),
    };
    let tooth = tooth.map_err(|what| volume_error(path, &what))?;
    if names.is_none() && reaches_border(&tooth.volume, dims) {
        notes.push(
            "the tooth extends to the border of the scan or of the cropped box: it may be joined to bone or to a \
             neighbouring tooth; check it with --preview and, if so, draw a label map (3D Slicer: Segment Editor)"
                .to_string(),
        );
    }
    if tooth.volume.count(tissues.enamel) == 0 {
        notes.push("there is no enamel, so the crown could not be located: it must point to +z".to_string());
    }
    Ok(ImportResult { tooth, notes })
}

/// True if solid tissue touches the border of a scan of this many voxels: its volume was then extended by all the room
/// that a surface needs beyond it, or is completely full.
fn reaches_border(volume: &Volume, mut scanned: [u32; 3]) -> bool {
    /// Voxels by which a volume is extended on a side that tissue touches; fewer where tissue only comes near.
    const ROOM: u32 = 3;
    let mut dims = volume.grid().dims;
    let is_full = |CellBox { low, high }: CellBox| (0..3).any(|axis| low[axis] == 0 || high[axis] + 1 == dims[axis]);
    let is_at_brim = volume.bounding_box().is_some_and(is_full);
    // The crown was turned upwards: axes may have been exchanged.
    dims.sort_unstable();
    scanned.sort_unstable();
    is_at_brim || (0..3).any(|axis| dims[axis] >= scanned[axis] + ROOM)
}

/// Sets the voxel spacing of an image, mm; the directions of its axes are kept.
fn respace(image: &mut VoxelImage, spacing: [f32; 3]) {
    let axes = image.geometry.axes();
    for (step, axis) in image.geometry.steps.iter_mut().zip(axes) {
        *step = step.normalize_or(DVec3::AXES[axis.along]) * as_typed_f64(spacing[axis.along]);
    }
}

/// The `f64` that was meant by an `f32` that somebody typed: 0.2 instead of 0.20000000298.
fn as_typed_f64(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}

/// The box to which the scan is cropped, mm; `None` if it is not cropped.
fn crop_box(arguments: &Arguments) -> Option<Aabb> {
    match (arguments.crop, arguments.at) {
        (Some([x0, x1, y0, y1, z0, z1]), _) => {
            let (a, b) = (Vec3::new(x0, y0, z0), Vec3::new(x1, y1, z1));
            Some(Aabb::around([a, b]))
        }
        (None, Some(at)) => Some(Aabb::around([Vec3::from(at)]).grown(Vec3::splat(arguments.around))),
        (None, None) => None,
    }
}

/// Tissue of each number of a label map; `None` if the image holds grey values.
fn label_names(
    image: &VoxelImage,
    arguments: &Arguments,
    table: &TissueTable,
) -> Result<Option<BTreeMap<u8, Label>>, String> {
    if !arguments.labels.is_empty() {
        let pair = |(name, number): &(String, u8)| Ok((*number, table.label_of(name)?));
        return arguments.labels.iter().map(pair).collect::<Result<_, String>>().map(Some);
    }
    let hint = |unknown| {
        format!(
            "{unknown}; assign the numbers of the map to tissues with --labels, as in --labels \
        enamel=1,dentine=2,pulp=3"
        )
    };
    if let Some(named) = tooth_import::labels_by_number(image, table).map_err(hint)? {
        return Ok(Some(named));
    }
    match few_values(&image.samples) {
        None => Ok(None),
        Some(values) => Err(format!(
            "it contains only the numbers {values} and appears to be a label map; assign them to tissues, as in \
             --labels enamel=1,dentine=2,pulp=3"
        )),
    }
}

/// The numbers of an image, as a list, if they are so few and small that it must be a label map.
fn few_values(samples: &Samples) -> Option<String> {
    /// Maximum number of labels: a tooth's tissues, decay, fillings and bone are fewer; a scan has hundreds of values.
    const FEW: usize = 12;
    let mut found = BTreeSet::new();
    let mut add = |value: f32| {
        // The comparison is written so that a NaN is rejected.
        let is_number = (0.0..=255.0).contains(&value) && value.fract() == 0.0;
        is_number && (found.contains(&(value as u8)) || (found.insert(value as u8) && found.len() <= FEW))
    };
    let is_map = match samples {
        Samples::U8(all) => all.iter().all(|&v| add(v.into())),
        Samples::I16(all) => all.iter().all(|&v| add(v.into())),
        Samples::U16(all) => all.iter().all(|&v| add(v.into())),
        Samples::F32(all) => all.iter().all(|&v| add(v)),
    };
    let list = || found.iter().map(u8::to_string).collect::<Vec<_>>().join(", ");
    // An image with one value is not a label map.
    (is_map && found.len() > 1 && found.contains(&0)).then(list)
}

fn label(table: &TissueTable, name: &str) -> Result<Label, CliError> {
    table.label_of(name).map_err(|unknown| CliError::misuse(format!("unknown-tissue: {unknown}")))
}

fn volume_error(path: &Path, what: &impl fmt::Display) -> CliError {
    CliError::Wrong(format!("{}: wrong-volume: {what}", path.display()))
}

/// Size and tissues in a line each, so that a wrong spacing or a wrong threshold is noticed at once.
fn describe(tooth: &Volume, table: &TissueTable) -> String {
    let grid = tooth.grid();
    let size = tooth.bounding_box().map_or([0.0; 3], |cells| grid.extent_of(&cells).size().to_array());
    let mut lines = vec![format!("{:.1} × {:.1} × {:.1} mm", size[0], size[1], size[2])];
    let mut counts = [0u64; 256];
    tooth.tissues().for_each(|label| counts[usize::from(label.0)] += 1);
    for entry in table.entries() {
        let mm3 = counts[usize::from(entry.id)] as f64 * grid.voxel_mm3();
        if mm3 > 0.0 {
            lines.push(format!("{}: {mm3:.1} mm³", entry.title));
        }
    }
    lines.join("\n")
}
