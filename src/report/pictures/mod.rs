//! Pictures of a session's work: views from all sides, and sections.
//!
//! Takes a recording and its score, or an exercise. Gives PNG pictures and coloured surfaces. The same score gives the same
//! bytes.

mod annotations;
mod preview;
mod sections;
mod removal_share;
mod tooth_surface;
mod verdict_colours;

pub use preview::{PREVIEW_SIZE, preview_png};
pub use removal_share::{SHARE_BANDS, draw_removal_share};
pub use sections::sections_png;
pub(super) use verdict_colours::srgb_to_linear;

use super::glb::SurfacePart;
use crate::raycast;
use crate::raycast::{ImagePlane, OrthographicCamera, PixelBuffer, ViewSide};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use tooth_surface::{ToothMaterial, ToothSurface};
use typodont_core::aabb::Aabb;
use typodont_core::frame::Vec3;
use typodont_core::parallel::par_map;
use typodont_core::volume::{Volume, surface};
use typodont_exercise::record::{Recording, Replay};
use typodont_exercise::scenario::{ToothBounds, Workpiece};
use typodont_exercise::score::{Scored, Verdict};
use verdict_colours::{TissueColours, VerdictColours};

/// Subject of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ViewKind {
    Before,
    After,
    Map,
    BeforeSlice,
    AfterSlice,
    MapSlice,
}

pub struct EncodedPicture {
    /// Stem of the picture's file name.
    pub name: String,
    pub title: String,
    pub kind: ViewKind,
    pub png: Vec<u8>,
}

/// Width and height of a picture, pixels: a tooth fills it at 40 to 50 µm a pixel, about a voxel.
const SIZE: u32 = 480;

const PAPER: [f32; 3] = [1.0; 3];

/// Colours of the line in which a section meets the present surface, and of the line of the surface before the work.
const CONTOUR: [f32; 3] = [0.22, 0.20, 0.18];
const FORMER_CONTOUR: [f32; 3] = [0.62, 0.62, 0.62];

/// Width of such a line, pixels.
const CONTOUR_WIDTH: f32 = 1.6;

/// Every picture of a session: six sides and three cuts, each before, after and as a map.
pub fn all_pictures(
    recording: &Recording,
    scored: &Scored,
    progress: &mut dyn FnMut(usize, usize),
) -> Vec<EncodedPicture> {
    let all = ViewSide::ALL.len() + SECTIONS.len();
    let palette = TissueColours::of(&recording.scenario.tissues);
    let colours = VerdictColours::of(scored);
    let (before, after) = (&scored.replay.workpiece.volume, &scored.replay.volume);
    let material = ToothMaterial::of(&recording.scenario, &scored.replay.workpiece);
    let surfaces = SurfacesOfWork { before: material.surface_of(before), after: material.surface_of(after) };
    let mut raw = Vec::new();
    for (done, side) in ViewSide::ALL.into_iter().enumerate() {
        progress(done, all);
        raw.extend(side_pictures(scored, &palette, &colours, &surfaces, side));
    }
    let middle = centre_of_work(scored);
    for (done, cut) in SECTIONS.into_iter().enumerate() {
        progress(ViewSide::ALL.len() + done, all);
        raw.extend(section_pictures(scored, &palette, cut, middle));
    }
    encode_all(raw)
}

/// A picture before it is a file.
struct RawPicture {
    name: String,
    title: String,
    kind: ViewKind,
    pixels: PixelBuffer,
}

impl RawPicture {
    fn new(kind: ViewKind, name: &str, title: &str, pixels: PixelBuffer) -> RawPicture {
        let (stem, when) = match kind {
            ViewKind::Before | ViewKind::BeforeSlice => ("before", "before"),
            ViewKind::After | ViewKind::AfterSlice => ("after", "after"),
            ViewKind::Map | ViewKind::MapSlice => ("map", "map"),
        };
        RawPicture { name: format!("{stem}-{name}"), title: format!("{title}, {when}"), kind, pixels }
    }
}

/// The tooth before and after the work.
struct SurfacesOfWork<'a> {
    before: ToothSurface<'a>,
    after: ToothSurface<'a>,
}

fn side_pictures(
    scored: &Scored,
    palette: &TissueColours,
    colours: &VerdictColours,
    surfaces: &SurfacesOfWork,
    side: ViewSide,
) -> [RawPicture; 3] {
    let (before, after) = (&scored.replay.workpiece.volume, &scored.replay.volume);
    let plane = ImagePlane { camera: OrthographicCamera::framing_volume(side, before, 1.0), width: SIZE, height: SIZE };
    let before_view = raycast::render(before, &plane);
    let after_view = if is_unchanged(scored) {
        before_view.clone()
    } else {
        raycast::render_after_removal(after, &plane, &before_view)
    };
    let distal = scored.replay.workpiece.distal();
    // Name of the side where y is mesial.
    let side_in_chart = match side {
        ViewSide::Mesial if distal.y < 0.0 => ViewSide::Distal,
        ViewSide::Distal if distal.y < 0.0 => ViewSide::Mesial,
        side => side,
    };
    let (name, title) = match side_in_chart {
        ViewSide::Occlusal => ("occlusal", "Occlusal side"),
        ViewSide::Buccal => ("buccal", "Buccal side"),
        ViewSide::Lingual => ("lingual", "Lingual side"),
        ViewSide::Mesial => ("mesial", "Mesial side"),
        ViewSide::Distal => ("distal", "Distal side"),
        ViewSide::Apical => ("apical", "Apical side"),
    };
    let unchanged = |label, voxel: usize| palette.muted(label, scored.verdicts[voxel]);
    [
        (ViewKind::Before, surfaces.before.paint(&before_view)),
        (ViewKind::After, surfaces.after.paint(&after_view)),
        (
            ViewKind::Map,
            after_view.paint_voxels(after, |label, voxel| colours.colour_at(voxel, unchanged(label, voxel))),
        ),
    ]
    .map(|(shows, pixels)| {
        RawPicture::new(
            shows,
            name,
            title,
            annotations::annotate(&pixels, &plane, scored.replay.workpiece.common_distal()),
        )
    })
}

fn is_unchanged(scored: &Scored) -> bool {
    scored.replay.workpiece.volume.densities() == scored.replay.volume.densities()
}

/// Cuts: the side from which each is seen, its file's name and its title.
const SECTIONS: [(ViewSide, &str, &str); 3] = [
    (ViewSide::Mesial, "slice-buccolingual", "Buccolingual section"),
    (ViewSide::Buccal, "slice-mesiodistal", "Mesiodistal section"),
    (ViewSide::Occlusal, "slice-horizontal", "Horizontal section"),
];

fn section_pictures(
    scored: &Scored,
    palette: &TissueColours,
    (side, name, title): (ViewSide, &str, &str),
    middle: Vec3,
) -> [RawPicture; 3] {
    let (before, after) = (&scored.replay.workpiece.volume, &scored.replay.volume);
    let distal = scored.replay.workpiece.distal();
    let plane = crown_image_plane(side, nearest_tooth(&scored.replay.workpiece, middle));
    let plane = ImagePlane { camera: plane.camera.with_mesial_left(distal), ..plane };
    let cut = |volume: &Volume| raycast::slice(volume, &plane, middle, |label, _| palette.tissue(label));
    let line = |volume: &Volume, colour| raycast::contour(volume, &plane, middle, colour, CONTOUR_WIDTH);
    let verdict = |label, voxel: usize| match scored.verdicts[voxel] {
        kept @ (Verdict::KeptSound | Verdict::Kept) => palette.muted(label, kept),
        verdict => verdict.color(),
    };
    let map = match merged_matter(scored) {
        Some(all) => raycast::slice(&all, &plane, middle, verdict),
        None => raycast::slice(before, &plane, middle, verdict),
    };
    let (was, is) = (line(before, FORMER_CONTOUR), line(after, CONTOUR));
    [
        (ViewKind::BeforeSlice, vec![cut(before), line(before, CONTOUR)]),
        (ViewKind::AfterSlice, vec![cut(after), was.clone(), is.clone()]),
        (ViewKind::MapSlice, vec![map, was, is]),
    ]
    .map(|(shows, layers)| {
        let mut layers = layers.into_iter();
        let mut pixels = layers.next().unwrap_or_else(|| PixelBuffer::transparent(SIZE, SIZE));
        layers.for_each(|layer| pixels.composite(&layer));
        RawPicture::new(
            shows,
            name,
            title,
            annotations::annotate(&pixels, &plane, scored.replay.workpiece.common_distal()),
        )
    })
}

/// All matter that the map of a filling covers: the matter before, the planned filling and the placed filling. `None`
/// without a filling.
fn merged_matter(scored: &Scored) -> Option<Volume> {
    let Replay { workpiece, volume: after, .. } = &scored.replay;
    let original = workpiece.original.as_ref().filter(|_| scored.restoration.is_some())?;
    let layers = [&*workpiece.volume, original, after];
    let (grid, band) = (*after.grid(), after.half_band());
    let densest = |voxel: usize| layers.iter().map(|v| v.voxel(voxel)).max_by_key(|v| v.density).unwrap_or_default();
    let (density, label) = (0..grid.len()).map(|voxel| (densest(voxel).density, densest(voxel).label)).unzip();
    Volume::from_parts(grid, band, density, label)
}

/// Frames the crown of a tooth and the coronal part of its roots.
fn crown_image_plane(side: ViewSide, tooth: &ToothBounds) -> ImagePlane {
    /// Length of the roots shown, mm.
    const ROOTS: f32 = 3.0;
    let low = tooth.whole.low.max(Vec3::new(f32::NEG_INFINITY, f32::NEG_INFINITY, tooth.crown.low.z - ROOTS));
    let camera = OrthographicCamera::framing_box(side, &Aabb::new(low, tooth.whole.high), 1.0);
    ImagePlane { camera, width: SIZE, height: SIZE }
}

/// The tooth whose crown is nearest to a point.
fn nearest_tooth(workpiece: &Workpiece, point_in_tooth: Vec3) -> &ToothBounds {
    let nearest = workpiece.nearest_tooth(point_in_tooth).expect("a workpiece has a tooth");
    &workpiece.teeth[nearest]
}

/// Centre of the work done and the work planned; the centre of the first crown if there is neither.
fn centre_of_work(scored: &Scored) -> Vec3 {
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
        0 => workpiece.teeth[0].crown.centre(),
        count => (sum / f64::from(count)).as_vec3(),
    }
}

/// Surfaces of `performance.glb`: the remaining tooth with its cavity coloured by verdict, and the matter that was left
/// behind.
pub fn surface_parts(scored: &Scored) -> Vec<SurfacePart> {
    let after = &scored.replay.volume;
    let colours = VerdictColours::of(scored);
    let colour = |_, voxel: usize| colours.colour_at(voxel, scored.verdicts[voxel].color());
    let mesh = surface::extract(after);
    let colors = mesh
        .positions
        .iter()
        .map(|p| verdict_colours::srgb_to_linear(raycast::surface_colour(after, *p, colour)))
        .collect();
    let left = surface::of_mask(after.grid(), |voxel| scored.verdicts[voxel] == Verdict::Left);
    let left_colors = vec![verdict_colours::srgb_to_linear(Verdict::Left.color()); left.positions.len()];
    vec![
        SurfacePart { name: "tooth".into(), mesh, colors },
        SurfacePart { name: Verdict::Left.id().into(), mesh: left, colors: left_colors },
    ]
}

/// Every picture as a file's bytes; each processor takes its share.
fn encode_all(raw: Vec<RawPicture>) -> Vec<EncodedPicture> {
    par_map(raw.len(), |number| {
        let RawPicture { name, title, kind: shows, pixels } = &raw[number];
        EncodedPicture { name: name.clone(), title: title.clone(), kind: *shows, png: encode_png(pixels) }
    })
}

fn encode_png(pixels: &PixelBuffer) -> Vec<u8> {
    let mut bytes = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut bytes, CompressionType::Default, FilterType::Adaptive);
    encoder
        .write_image(&pixels.rgb8(), pixels.width, pixels.height, ExtendedColorType::Rgb8)
        .expect("memory takes every byte, and the size fits");
    bytes
}
