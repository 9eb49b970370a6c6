//! `typodont import`: from a scan, a label map or surfaces to a labelled tooth.

use super::{Failure, say, write};
use crate::anatomy;
use crate::anatomy::shells::{self, Shaped, UNITS, Unsound};
use crate::content::imaging::{self, Cut, Told, raw};
use crate::content::nrrd::{Image, Samples};
use crate::content::{Library, TissueTable, scan, surfaces};
use crate::frame::Vec3;
use crate::report::{sections_png, tissue_map};
use crate::scenario;
use crate::volume::{Label, Volume};
use clap::Args;
use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::{Path, PathBuf};

/// Distance between the voxels of a tooth made from surfaces unless told otherwise, mm: that of the program's own teeth.
const SPACING: f32 = 0.1;

#[derive(Args)]
#[command(after_help = HELP)]
pub struct Arguments {
    /// A CT, a label map, a folder of DICOM slices, or a surface of closed shells
    #[arg(required_unless_present = "tissue", conflicts_with = "tissue")]
    scan: Option<PathBuf>,
    /// The label map: enamel, dentine and pulp, crown up; 3D Slicer opens it, a scenario names it under "labels"
    #[arg(short, long, value_name = "FILE.seg.nrrd")]
    output: PathBuf,
    /// A picture of it: three cuts with the tissues in their colours
    #[arg(long, value_name = "FILE.png")]
    preview: Option<PathBuf>,
    /// Distance between the scan's voxels where its file lacks it; between those made from surfaces [default there: 0.1]
    #[arg(long, value_name = "MM", value_parser = spacing)]
    spacing_mm: Option<[f32; 3]>,
    /// Lay the scan anew along the axes of space, with this distance between voxels
    #[arg(long, value_name = "MM", value_parser = super::run::spacing)]
    resample: Option<f32>,
    /// Cut out what lies between these places, mm, left, posterior, superior
    #[arg(long, value_name = "X0,X1,Y0,Y1,Z0,Z1", value_parser = numbers::<6>, allow_hyphen_values = true)]
    crop: Option<[f32; 6]>,
    /// Cut out one tooth: a place in it, mm, left, posterior, superior
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers::<3>, conflicts_with = "crop", allow_hyphen_values = true)]
    at: Option<[f32; 3]>,
    /// How far around that place to cut, mm to each side
    #[arg(long, value_name = "MM", default_value_t = 14.0, requires = "at")]
    around: f32,
    /// The numbers of a label map, as in enamel=1,dentine=2,pulp=3
    #[arg(long, value_name = "TISSUE=NUMBER,…", value_parser = named_number, value_delimiter = ',')]
    labels: Vec<(String, u8)>,
    /// A closed surface for each tissue, as in enamel=e.stl dentine=d.stl pulp=p.stl
    #[arg(long, value_name = "TISSUE=FILE", num_args = 1.., value_parser = named_file)]
    tissue: Vec<(String, PathBuf)>,
    /// What the closed shells of one surface hold, from outside in
    #[arg(
        long,
        value_name = "TISSUE,…",
        value_delimiter = ',',
        default_value = "enamel,dentine,pulp",
        hide_default_value = true
    )]
    shells: Vec<String>,
    /// The unit in which surfaces were made
    #[arg(long, default_value = "mm", value_parser = UNITS.map(|(name, _)| name))]
    unit: String,
    /// Of several series in a folder of DICOM slices, the one of this number, or whose UID ends so
    #[arg(long)]
    series: Option<String>,
    /// Plain voxels: how many along x, y and z
    #[arg(long, value_name = "X,Y,Z", value_parser = sizes, requires = "type", requires = "spacing_mm")]
    size: Option<[u64; 3]>,
    /// Plain voxels: how each is written
    #[arg(long, requires = "size", value_parser = NUMBERS.map(|(name, _)| name))]
    r#type: Option<String>,
    /// Plain voxels: the high byte comes first
    #[arg(long, requires = "size")]
    big_endian: bool,
    /// Plain voxels: bytes before the first
    #[arg(long, value_name = "N", default_value_t = 0, requires = "size")]
    skip_bytes: u64,
}

const HELP: &str = "\
Read are: NRRD (.nrrd, .nhdr, .seg.nrrd); NIfTI-1 (.nii, .nii.gz); MetaImage (.mha, .mhd); a folder with one DICOM series of \
CT or CBCT, uncompressed, run-length coded or JPEG Lossless; plain voxels (--size, --type, --spacing-mm); surfaces as STL, \
PLY, OBJ or glTF (.glb, .gltf), closed, one per tissue or nested in one another.

A CT is told apart into enamel, dentine and pulp; a label map is taken as drawn; of surfaces each voxel becomes what its \
centre lies in.

  typodont import tooth.nii.gz -o tooth.seg.nrrd --preview tooth.png
  typodont import cbct/ --at -21.5,38,102 --resample 0.1 -o 36.seg.nrrd
  typodont import map.nii.gz --labels enamel=1,dentine=2,pulp=3 -o tooth.seg.nrrd
  typodont import --tissue enamel=e.stl dentine=d.stl pulp=p.stl -o tooth.seg.nrrd";

/// What `--type` calls how a plain voxel is written.
const NUMBERS: [(&str, raw::Number); 8] = [
    ("uint8", raw::Number::Uint8),
    ("int8", raw::Number::Int8),
    ("uint16", raw::Number::Uint16),
    ("int16", raw::Number::Int16),
    ("uint32", raw::Number::Uint32),
    ("int32", raw::Number::Int32),
    ("float", raw::Number::Float),
    ("double", raw::Number::Double),
];

fn numbers<const N: usize>(text: &str) -> Result<[f32; N], String> {
    let found: Option<Vec<f32>> = text.split(',').map(|word| word.trim().parse().ok()).collect();
    let numbers: Option<[f32; N]> = found.and_then(|found| found.try_into().ok());
    numbers
        .filter(|n| n.iter().all(|v| v.is_finite()))
        .ok_or_else(|| format!("it takes {N} numbers with commas between"))
}

/// One distance for all axes, or three.
fn spacing(text: &str) -> Result<[f32; 3], String> {
    let words: Vec<&str> = text.split(',').collect();
    let found = words.iter().map(|word| super::run::spacing(word.trim())).collect::<Result<Vec<f32>, String>>()?;
    match found[..] {
        [mm] => Ok([mm; 3]),
        [x, y, z] => Ok([x, y, z]),
        _ => Err("it takes one distance, or three with commas between".into()),
    }
}

fn sizes(text: &str) -> Result<[u64; 3], String> {
    let found: Option<Vec<u64>> = text.split(',').map(|word| word.trim().parse().ok()).collect();
    found
        .and_then(|found| found.try_into().ok())
        .ok_or_else(|| "it takes three whole numbers with commas between".into())
}

fn named_number(text: &str) -> Result<(String, u8), String> {
    let pair = text.split_once('=').and_then(|(name, number)| Some((name.to_string(), number.parse().ok()?)));
    pair.filter(|(_, number)| *number > 0).ok_or_else(|| "it takes a tissue and its number, as in enamel=1".into())
}

fn named_file(text: &str) -> Result<(String, PathBuf), String> {
    let pair = text.split_once('=').filter(|(name, file)| !name.is_empty() && !file.is_empty());
    pair.map(|(name, file)| (name.to_string(), file.into()))
        .ok_or_else(|| "it takes a tissue and a file, as in enamel=e.stl".into())
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    check_outputs(arguments)?;
    let table = TissueTable::read(&Library::shipped())?;
    let bar = super::run::spinner("telling tissues apart");
    let made = make(arguments, &table);
    bar.finish_and_clear();
    let Shaped { volume, notes } = made?;
    write(&arguments.output, tissue_map(&volume, &table).map_err(Failure::Wrong)?)?;
    if let Some(preview) = &arguments.preview {
        write(preview, sections_png(&volume, &table))?;
    }
    notes.iter().for_each(|note| eprintln!("note: {note}"));
    say(describe(&volume, &table))
}

/// Before anything is read: what is written must not be what is read.
fn check_outputs(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { output, preview, .. } = arguments;
    if !output.to_string_lossy().ends_with(".nrrd") {
        return Err(Failure::misuse(format!("{}: the label map is a .seg.nrrd file", output.display())));
    }
    if let Some(preview) = preview.as_ref().filter(|p| p.extension().is_none_or(|e| !e.eq_ignore_ascii_case("png"))) {
        return Err(Failure::misuse(format!("{}: the picture is a .png file", preview.display())));
    }
    let inputs = arguments.scan.iter().chain(arguments.tissue.iter().map(|(_, file)| file));
    let is_same = |a: &Path, b: &Path| a.canonicalize().is_ok_and(|a| b.canonicalize().is_ok_and(|b| a == b));
    for input in inputs {
        if let Some(written) = std::iter::once(output).chain(preview).find(|written| is_same(input, written)) {
            return Err(Failure::misuse(format!("{}: this is the scan itself", written.display())));
        }
    }
    Ok(())
}

fn make(arguments: &Arguments, table: &TissueTable) -> Result<Shaped, Failure> {
    match &arguments.scan {
        Some(path) if surfaces::is_surface(path) => {
            let labels = arguments.shells.iter().map(|name| label(table, name)).collect::<Result<Vec<Label>, _>>()?;
            let triangles = triangles(path, arguments)?;
            let parts = shells::nested(&labels, &triangles).map_err(|unsound| about_surface(path, &unsound))?;
            shaped(&parts, arguments, table).map_err(|unsound| about_surface(path, &unsound))
        }
        Some(path) => from_scan(path, arguments, table),
        None => from_tissues(arguments, table),
    }
}

fn from_tissues(arguments: &Arguments, table: &TissueTable) -> Result<Shaped, Failure> {
    let mut named = Vec::new();
    for (name, path) in &arguments.tissue {
        named.push((label(table, name)?, path));
    }
    // From outside in: where two overlap, the inner one is.
    let tissues = scenario::anatomy_tissues(table);
    let depth = |label: Label| [tissues.enamel, tissues.dentine, tissues.pulp].iter().position(|l| *l == label);
    named.sort_by_key(|(label, _)| depth(*label).unwrap_or(usize::MAX));
    if let Some(pair) = named.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        return Err(Failure::misuse(format!("{}: its tissue has a surface already", pair[1].1.display())));
    }
    let mut parts = Vec::new();
    for (label, path) in named {
        let mut part =
            shells::part(label, &triangles(path, arguments)?).map_err(|unsound| about_surface(path, &unsound))?;
        part.notes.iter_mut().for_each(|note| *note = format!("{}: {note}", path.display()));
        parts.push(part);
    }
    let first = &arguments.tissue[0].1;
    shaped(&parts, arguments, table).map_err(|unsound| about_surface(first, &unsound))
}

fn about_surface(path: &Path, unsound: &Unsound) -> Failure {
    Failure::Wrong(format!("{}: wrong-surface: {unsound}", path.display()))
}

/// A surface's triangles, mm.
fn triangles(path: &Path, arguments: &Arguments) -> Result<Vec<[Vec3; 3]>, Failure> {
    let mm = UNITS.iter().find(|(name, _)| *name == arguments.unit).map_or(1.0, |(_, mm)| *mm);
    let triangles = surfaces::read(path).map_err(|unread| wrong(path, &unread))?;
    Ok(triangles.into_iter().map(|t| t.map(|corner| corner * mm)).collect())
}

fn shaped(parts: &[shells::Part], arguments: &Arguments, table: &TissueTable) -> Result<Shaped, Unsound> {
    let spacing = arguments.resample.or(arguments.spacing_mm.map(|[x, ..]| x)).unwrap_or(SPACING);
    shells::voxelised(parts, spacing, crop(arguments), &scenario::anatomy_tissues(table))
}

fn from_scan(path: &Path, arguments: &Arguments, table: &TissueTable) -> Result<Shaped, Failure> {
    let number = arguments.r#type.as_ref().and_then(|told| NUMBERS.iter().find(|(name, _)| name == told));
    let raw = arguments.size.zip(number).zip(arguments.spacing_mm).map(|((size, (_, number)), spacing)| raw::Told {
        size,
        number: *number,
        is_big_endian: arguments.big_endian,
        skip: arguments.skip_bytes,
        spacing: spacing.map(written),
    });
    if path.is_dir() && arguments.spacing_mm.is_some() {
        let what = "DICOM slices say how far their pixels lie apart; give --resample for another distance";
        return Err(Failure::misuse(format!("{}: {what}", path.display())));
    }
    let is_raw = raw.is_some();
    let told = Told { raw, series: arguments.series.clone() };
    let imaging::Scan { mut image, mut notes } = imaging::read(path, &told).map_err(|unread| wrong(path, &unread))?;
    if let Some(spacing) = arguments.spacing_mm.filter(|_| !is_raw) {
        respace(&mut image, spacing);
    }
    let names = names(&image, arguments, table).map_err(|what| wrong(path, &what))?;
    let wanted = Cut {
        crop: crop(arguments).map(|corners| corners.map(|corner| corner.as_dvec3())),
        resample: arguments.resample.map(written),
        holds_labels: names.is_some(),
    };
    let image = imaging::cut(image, &wanted).and_then(imaging::checked).map_err(|unread| wrong(path, &unread))?;
    let tissues = scenario::anatomy_tissues(table);
    let dims = image.geometry.dims;
    let volume = match &names {
        Some(names) => scan::labelled(&image, None, names).map(|volume| anatomy::set_upright(volume, &tissues)),
        None => scan::labels_of(image, &tissues),
    };
    let volume = volume.map_err(|what| wrong(path, &what))?;
    if names.is_none() && reaches_border(&volume, dims) {
        notes.push(
            "it reaches the border of the scan, or of what was cut out: bone or a neighbour may hang together with it; \
             look at --preview, and draw a label map (3D Slicer: Segment Editor) if it is so"
                .to_string(),
        );
    }
    if volume.count(tissues.enamel) == 0 {
        notes.push("there is no enamel in it, so that its crown was not looked for: it must point to +z".to_string());
    }
    Ok(Shaped { volume, notes })
}

/// True when matter lies at the border of a scan of so many voxels: then its volume has got all the room that a surface needs
/// beyond it, or is full to the brim.
fn reaches_border(volume: &Volume, mut scanned: [u32; 3]) -> bool {
    /// Voxels by which a volume grows on a side that matter touches; less where it only comes near.
    const ROOM: u32 = 3;
    let mut dims = volume.grid().dims;
    let is_full = |[low, high]: [[u32; 3]; 2]| (0..3).any(|axis| low[axis] == 0 || high[axis] + 1 == dims[axis]);
    let is_at_brim = volume.tight_box().is_some_and(is_full);
    // The crown was turned up: axes may have changed places.
    dims.sort_unstable();
    scanned.sort_unstable();
    is_at_brim || (0..3).any(|axis| dims[axis] >= scanned[axis] + ROOM)
}

/// Gives an image's axes these lengths; its directions stay.
fn respace(image: &mut Image, spacing: [f32; 3]) {
    let axes = image.geometry.axes();
    for (step, axis) in image.geometry.steps.iter_mut().zip(axes) {
        *step = step.normalize_or(DVec3::AXES[axis.along]) * written(spacing[axis.along]);
    }
}

/// The double that a person meant by a float: 0.2 and not 0.20000000298.
fn written(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}

/// The box to be cut out, mm.
fn crop(arguments: &Arguments) -> Option<[Vec3; 2]> {
    match (arguments.crop, arguments.at) {
        (Some([x0, x1, y0, y1, z0, z1]), _) => {
            let (a, b) = (Vec3::new(x0, y0, z0), Vec3::new(x1, y1, z1));
            Some([a.min(b), a.max(b)])
        }
        (None, Some(at)) => Some([Vec3::from(at) - arguments.around, Vec3::from(at) + arguments.around]),
        (None, None) => None,
    }
}

/// Which number of a label map is which tissue; `None` for grey values.
fn names(image: &Image, arguments: &Arguments, table: &TissueTable) -> Result<Option<BTreeMap<u8, Label>>, String> {
    if !arguments.labels.is_empty() {
        let pair = |(name, number): &(String, u8)| Ok((*number, table.label_of(name)?));
        return arguments.labels.iter().map(pair).collect::<Result<_, String>>().map(Some);
    }
    let hint = |unknown| {
        format!("{unknown}; name the numbers of the map with --labels, as in --labels enamel=1,dentine=2,pulp=3")
    };
    if let Some(named) = scan::named(image, table).map_err(hint)? {
        return Ok(Some(named));
    }
    match few_values(&image.samples) {
        None => Ok(None),
        Some(values) => Err(format!(
            "it holds the numbers {values} only, as a label map does; say which is which, as in --labels \
             enamel=1,dentine=2,pulp=3"
        )),
    }
}

/// The numbers of an image that holds so few of them, all small, that it must be a label map.
fn few_values(samples: &Samples) -> Option<String> {
    /// A tooth's tissues, decay, fillings and bone are fewer; grey values of a scan are hundreds.
    const FEW: usize = 12;
    let mut found = BTreeSet::new();
    let mut add = |value: f32| {
        // Written so that a NaN does not pass.
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
    // One value is no map, and two may be a sphere somebody scanned.
    (is_map && found.len() > 1 && found.contains(&0)).then(list)
}

fn label(table: &TissueTable, name: &str) -> Result<Label, Failure> {
    table.label_of(name).map_err(|unknown| Failure::misuse(format!("unknown-tissue: {unknown}")))
}

fn wrong(path: &Path, what: &impl fmt::Display) -> Failure {
    Failure::Wrong(format!("{}: wrong-volume: {what}", path.display()))
}

/// Size and tissues in a line each, so that a wrong spacing or a wrong threshold is seen at once.
fn describe(tooth: &Volume, table: &TissueTable) -> String {
    let grid = tooth.grid();
    let size = tooth.tight_box().map_or([0.0; 3], |[low, high]| (grid.centre(high) - grid.centre(low)).to_array());
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
