//! What the work looks like: from all sides, and cut through.
//!
//! Takes a recording and its score, or an exercise. Gives PNG pictures and coloured surfaces. The same score gives the same
//! bytes.

mod marks;
mod preview;
mod sections;
mod shares;
mod tint;

pub use preview::{SEEN, preview_png};
pub use sections::sections_png;
pub use shares::{BANDS, shares};
pub(super) use tint::linear;

use super::glb::Part;
use crate::frame::Vec3;
use crate::record::{Recording, Replay};
use crate::scenario::ToothPlace;
use crate::score::{Scored, Verdict};
use crate::volume::march::{self, Camera, Picture as Pixels, Shot, Side};
use crate::volume::rows::each;
use crate::volume::{Volume, surface};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use tint::{Palette, Tint};

/// What a picture is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shows {
    Before,
    After,
    Map,
    BeforeSlice,
    AfterSlice,
    MapSlice,
}

pub struct Picture {
    /// Stem of its file's name.
    pub name: String,
    pub title: String,
    pub shows: Shows,
    pub png: Vec<u8>,
}

/// Width and height of a picture, pixels: a tooth fills it at 40 to 50 µm a pixel, about a voxel.
const SIZE: u32 = 480;

const PAPER: [f32; 3] = [1.0; 3];

/// Where a cut meets a surface that is there, and one that was.
const LINE: [f32; 3] = [0.22, 0.20, 0.18];
const FORMER_LINE: [f32; 3] = [0.62, 0.62, 0.62];

/// Width of such a line, pixels.
const LINE_WIDTH: f32 = 1.6;

/// Every picture of a session: six sides and three cuts, each before, after and as a map.
pub fn all(recording: &Recording, scored: &Scored) -> Vec<Picture> {
    let palette = Palette::of(&recording.scenario.tissues);
    let tint = Tint::of(scored);
    let mut drawn = Vec::new();
    for side in Side::ALL {
        drawn.extend(sides(scored, &palette, &tint, side));
    }
    let middle = middle_of_work(scored);
    for cut in CUTS {
        drawn.extend(cuts(scored, &palette, cut, middle));
    }
    encoded(drawn)
}

/// A picture before it is a file.
struct Drawn {
    name: String,
    title: String,
    shows: Shows,
    pixels: Pixels,
}

impl Drawn {
    fn new(shows: Shows, name: &str, title: &str, pixels: Pixels) -> Drawn {
        let (stem, when) = match shows {
            Shows::Before | Shows::BeforeSlice => ("before", "before"),
            Shows::After | Shows::AfterSlice => ("after", "after"),
            Shows::Map | Shows::MapSlice => ("map", "map"),
        };
        Drawn { name: format!("{stem}-{name}"), title: format!("{title}, {when}"), shows, pixels }
    }
}

fn sides(scored: &Scored, palette: &Palette, tint: &Tint, side: Side) -> [Drawn; 3] {
    let (before, after) = (&scored.replay.workpiece.volume, &scored.replay.volume);
    let shot = Shot { camera: Camera::framing(side, before, 1.0), width: SIZE, height: SIZE };
    let first = march::look(before, &shot);
    let last = if is_unchanged(scored) { first.clone() } else { march::look_again(after, &shot, &first) };
    let distal = scored.replay.workpiece.distal();
    // What a side is called where y is mesial.
    let called = match side {
        Side::Mesial if distal.y < 0.0 => Side::Distal,
        Side::Distal if distal.y < 0.0 => Side::Mesial,
        side => side,
    };
    let (name, title) = match called {
        Side::Occlusal => ("occlusal", "Occlusal side"),
        Side::Buccal => ("buccal", "Buccal side"),
        Side::Lingual => ("lingual", "Lingual side"),
        Side::Mesial => ("mesial", "Mesial side"),
        Side::Distal => ("distal", "Distal side"),
        Side::Apical => ("apical", "Apical side"),
    };
    let kept = |label, voxel: usize| palette.quiet(label, scored.verdicts[voxel]);
    [
        (Shows::Before, first.paint(before, |label, _| palette.tissue(label))),
        (Shows::After, last.paint(after, |label, _| palette.tissue(label))),
        (Shows::Map, last.paint(after, |label, voxel| tint.colour(voxel, kept(label, voxel)))),
    ]
    .map(|(shows, pixels)| Drawn::new(shows, name, title, marks::on_paper(&pixels, &shot, distal)))
}

fn is_unchanged(scored: &Scored) -> bool {
    scored.replay.workpiece.volume.densities() == scored.replay.volume.densities()
}

/// Cuts: the side from which each is seen, its file's name and its title.
const CUTS: [(Side, &str, &str); 3] = [
    (Side::Mesial, "slice-buccolingual", "Buccolingual section"),
    (Side::Buccal, "slice-mesiodistal", "Mesiodistal section"),
    (Side::Occlusal, "slice-horizontal", "Horizontal section"),
];

fn cuts(scored: &Scored, palette: &Palette, (side, name, title): (Side, &str, &str), middle: Vec3) -> [Drawn; 3] {
    let (before, after) = (&scored.replay.workpiece.volume, &scored.replay.volume);
    let shot = crown_shot(side, tooth_at(&scored.replay.workpiece.teeth, middle));
    let cut = |volume: &Volume| march::slice(volume, &shot, middle, |label, _| palette.tissue(label));
    let line = |volume: &Volume, colour| march::outline(volume, &shot, middle, colour, LINE_WIDTH);
    let verdict = |label, voxel: usize| match scored.verdicts[voxel] {
        kept @ (Verdict::KeptSound | Verdict::Kept) => palette.quiet(label, kept),
        verdict => verdict.color(),
    };
    let map = match laid_too(scored) {
        Some(all) => march::slice(&all, &shot, middle, verdict),
        None => march::slice(before, &shot, middle, verdict),
    };
    let (was, is) = (line(before, FORMER_LINE), line(after, LINE));
    [
        (Shows::BeforeSlice, vec![cut(before), line(before, LINE)]),
        (Shows::AfterSlice, vec![cut(after), was.clone(), is.clone()]),
        (Shows::MapSlice, vec![map, was, is]),
    ]
    .map(|(shows, layers)| {
        let mut layers = layers.into_iter();
        let mut pixels = layers.next().unwrap_or_else(|| Pixels::clear(SIZE, SIZE));
        layers.for_each(|layer| pixels.lay_over(&layer));
        Drawn::new(shows, name, title, marks::on_paper(&pixels, &shot, scored.replay.workpiece.distal()))
    })
}

/// All matter that a filling's map is about: what was there, what was to be there and what was laid. `None` without a filling.
fn laid_too(scored: &Scored) -> Option<Volume> {
    let Replay { workpiece, volume: after, .. } = &scored.replay;
    let original = workpiece.original.as_ref().filter(|_| scored.restoration.is_some())?;
    let layers = [&*workpiece.volume, original, after];
    let (grid, band) = (*after.grid(), after.band());
    let most = |voxel: usize| layers.iter().map(|v| v.voxel(voxel)).max_by_key(|v| v.density).unwrap_or_default();
    let (density, label) = (0..grid.len()).map(|voxel| (most(voxel).density, most(voxel).label)).unzip();
    Volume::restored(grid, band, density, label)
}

/// Frames the crown of a tooth and the beginning of its roots.
fn crown_shot(side: Side, tooth: &ToothPlace) -> Shot {
    /// Of the roots, mm.
    const ROOTS: f32 = 3.0;
    let low = tooth.low.max(Vec3::new(f32::NEG_INFINITY, f32::NEG_INFINITY, tooth.crown_low.z - ROOTS));
    let camera = Camera::around(side, low, tooth.high, 1.0);
    Shot { camera, width: SIZE, height: SIZE }
}

/// The tooth whose crown is nearest to a point.
fn tooth_at(teeth: &[ToothPlace], point_in_tooth: Vec3) -> &ToothPlace {
    let off = |t: &&ToothPlace| point_in_tooth.distance(point_in_tooth.clamp(t.crown_low, t.crown_high));
    teeth.iter().min_by(|a, b| off(a).total_cmp(&off(b))).expect("a workpiece has a tooth")
}

/// The middle of what was done and what was to be done; of the first crown, where there is neither.
fn middle_of_work(scored: &Scored) -> Vec3 {
    let workpiece = &scored.replay.workpiece;
    let grid = workpiece.volume.grid();
    let mut sum = glam::DVec3::ZERO;
    let mut count = 0u32;
    for (voxel, verdict) in scored.verdicts.iter().enumerate() {
        if !matches!(verdict, Verdict::Outside | Verdict::KeptSound | Verdict::Kept) {
            sum += grid.centre(grid.cell(voxel)).as_dvec3();
            count += 1;
        }
    }
    match count {
        0 => 0.5 * (workpiece.teeth[0].crown_low + workpiece.teeth[0].crown_high),
        count => (sum / f64::from(count)).as_vec3(),
    }
}

/// The surfaces of `performance.glb`: what is left of the tooth, its cavity coloured by verdict; and what was left behind.
pub fn parts(scored: &Scored) -> Vec<Part> {
    let after = &scored.replay.volume;
    let tint = Tint::of(scored);
    let colour = |_, voxel: usize| tint.colour(voxel, scored.verdicts[voxel].color());
    let mesh = surface::extract(after);
    let colors = mesh.positions.iter().map(|p| tint::linear(march::surface_colour(after, *p, colour))).collect();
    let left = surface::of_mask(after.grid(), |voxel| scored.verdicts[voxel] == Verdict::Left);
    let left_colors = vec![tint::linear(Verdict::Left.color()); left.positions.len()];
    vec![
        Part { name: "tooth".into(), mesh, colors },
        Part { name: Verdict::Left.id().into(), mesh: left, colors: left_colors },
    ]
}

/// Every picture as a file's bytes; each processor takes its share.
fn encoded(drawn: Vec<Drawn>) -> Vec<Picture> {
    each(drawn.len(), |number| {
        let Drawn { name, title, shows, pixels } = &drawn[number];
        Picture { name: name.clone(), title: title.clone(), shows: *shows, png: png(pixels) }
    })
}

fn png(pixels: &Pixels) -> Vec<u8> {
    let mut bytes = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut bytes, CompressionType::Default, FilterType::Adaptive);
    encoder
        .write_image(&pixels.rgb8(), pixels.width, pixels.height, ExtendedColorType::Rgb8)
        .expect("memory takes every byte, and the size fits");
    bytes
}
