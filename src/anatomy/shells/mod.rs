//! A tooth out of closed surfaces: shells of enamel, dentine and pulp become voxels.
//!
//! Takes triangles in mm. Gives a volume whose every voxel is what its centre lies in, its density from the exact distance
//! to the outer surface. Never guesses an inside: what is open, tangled or crosses itself is refused.

mod sound;

pub use sound::{UNITS, Unsound};

use super::pieces::Pieces;
use super::{Tissues, slope, turn};
use crate::frame::Vec3;
use crate::volume::solid::{Solid, Triangle, approach, windings};
use crate::volume::{Density, Grid, Label, Volume, distance, ramp};
use sound::{Sound, bounds};

/// Empty voxels around what is made.
const MARGIN: u32 = 4;

/// Most voxels in all and along an axis, as of a scan.
const VOXELS_MAX: f64 = (1u64 << 28) as f64;
const AXIS_MAX: f32 = 4096.0;

/// Share of what is inside that may lie inside twice before it is called a mistake: slivers where shells were drawn a little
/// into one another.
const CROSSING: f64 = 0.01;

/// A gap that is closed all around and smaller, mm³, is a sliver between two shells, not a chamber.
const SLIVER: f64 = 1.0;

/// What one tissue fills.
#[derive(Clone, Debug)]
pub struct Part {
    pub label: Label,
    /// Closed; facing outward, and inward around hollows.
    pub triangles: Vec<Triangle>,
    /// By the divergence theorem, mm³.
    pub mm3: f64,
    /// What its owner should know, as sentences without a full stop.
    pub notes: Vec<String>,
}

/// A tissue's own surface, put right: all pieces face outward, those around hollows inward.
pub fn part(label: Label, triangles: &[Triangle]) -> Result<Part, Unsound> {
    let sound = Sound::of(triangles)?;
    let mut notes = turned_note(sound.turned);
    let pieces: Vec<Vec<Triangle>> = (0..sound.pieces.len()).map(|n| sound.triangles(n)).collect();
    let depths = depths(&pieces);
    let mut all = Vec::new();
    let mut flipped = 0;
    for (mut piece, depth) in pieces.into_iter().zip(depths) {
        // A piece in a piece bounds a hollow, and one in a hollow is solid again.
        if (mm3(&piece) < 0.0) == (depth % 2 == 0) {
            piece.iter_mut().for_each(|t| t.swap(1, 2));
            flipped += 1;
        }
        all.extend(piece);
    }
    notes.extend(flipped_note(flipped));
    Ok(Part { label, mm3: mm3(&all), triangles: all, notes })
}

/// The shells of one surface by how deep they stand in one another: the outermost first.
pub fn nested(labels: &[Label], triangles: &[Triangle]) -> Result<Vec<Part>, Unsound> {
    let sound = Sound::of(triangles)?;
    let pieces: Vec<Vec<Triangle>> = (0..sound.pieces.len()).map(|n| sound.triangles(n)).collect();
    let depths = depths(&pieces);
    let found = depths.iter().max().map_or(0, |most| most + 1);
    if found != labels.len() {
        return Err(Unsound::Levels { found, named: labels.len() });
    }
    let part = |&label| Part { label, triangles: Vec::new(), mm3: 0.0, notes: Vec::new() };
    let mut parts: Vec<Part> = labels.iter().map(part).collect();
    let mut flipped = 0;
    for (mut piece, depth) in pieces.into_iter().zip(depths) {
        if mm3(&piece) < 0.0 {
            piece.iter_mut().for_each(|t| t.swap(1, 2));
            flipped += 1;
        }
        parts[depth].mm3 += mm3(&piece);
        parts[depth].triangles.extend(piece);
    }
    // What is inside a shell belongs to the next tissue.
    for level in 1..parts.len() {
        parts[level - 1].mm3 -= parts[level].mm3;
    }
    parts[0].notes = turned_note(sound.turned);
    parts[0].notes.extend(flipped_note(flipped));
    Ok(parts)
}

fn turned_note(turned: usize) -> Vec<String> {
    match turned {
        0 => Vec::new(),
        1 => vec!["one triangle faced another way than its neighbours and was turned".to_string()],
        n => vec![format!("{n} triangles faced another way than their neighbours and were turned")],
    }
}

fn flipped_note(flipped: usize) -> Option<String> {
    match flipped {
        0 => None,
        1 => Some("a closed shell faced the wrong way and was turned inside out".to_string()),
        n => Some(format!("{n} closed shells faced the wrong way and were turned inside out")),
    }
}

fn mm3(triangles: &[Triangle]) -> f64 {
    let wedge = |t: &Triangle| {
        let [a, b, c] = t.map(|corner| corner.as_dvec3());
        a.dot(b.cross(c)) / 6.0
    };
    triangles.iter().map(wedge).sum()
}

/// In how many other pieces each piece stands.
fn depths(pieces: &[Vec<Triangle>]) -> Vec<usize> {
    if pieces.len() == 1 {
        return vec![0];
    }
    let solids: Vec<Solid> = pieces.iter().map(|piece| Solid::new(piece)).collect();
    let is_in = |inner: usize, outer: usize| {
        // The middle of a triangle lies on no other piece's edge.
        let [a, b, c] = pieces[inner][0];
        inner != outer && solids[outer].winding((a + b + c) / 3.0) != 0
    };
    (0..pieces.len()).map(|inner| (0..pieces.len()).filter(|&outer| is_in(inner, outer)).count()).collect()
}

/// A tooth made of shells.
#[derive(Clone, Debug)]
pub struct Shaped {
    pub volume: Volume,
    pub notes: Vec<String>,
}

/// Voxels `spacing` mm apart of parts in the order from outside in: where two overlap, the later one is.
///
/// `crop` is the part wanted, lowest and highest corner, mm. The crown is turned up along z as a scan's is, if there is
/// enamel.
pub fn voxelised(parts: &[Part], spacing: f32, crop: Option<[Vec3; 2]>, tissues: &Tissues) -> Result<Shaped, Unsound> {
    let grid = grid_around(parts, spacing, crop)?;
    let mut notes: Vec<String> = parts.iter().flat_map(|part| part.notes.clone()).collect();
    let mut label = vec![Label::AIR; grid.len()];
    for part in parts {
        notes.extend(fill(&grid, part, &mut label)?);
    }
    if label.iter().all(|l| *l == Label::AIR) {
        return Err(Unsound::NothingLeft);
    }
    notes.extend(seal(&grid, &mut label));

    let reach = slope::reach(&grid);
    let mut away = vec![reach; grid.len()];
    outer_surface(parts, spacing, |triangle| approach(&grid, triangle, reach, &mut away));
    let band = slope::band(&grid);
    let least = slope::LEAST * spacing;
    let density: Vec<Density> = away
        .into_iter()
        .zip(&label)
        .map(|(away, label)| ramp(if *label == Label::AIR { away.max(least) } else { -away.max(least) }, band))
        .collect();
    let volume = match label.contains(&tissues.enamel) {
        true => turn::upright((grid, density, label), band, tissues),
        false => {
            notes.push("there is no enamel, so that its crown was not looked for: it must point to +z".to_string());
            let untold = parts.first().map_or(tissues.dentine, |part| part.label);
            Volume::new(grid, band, density, label, untold)
        }
    };
    Ok(Shaped { volume, notes })
}

fn grid_around(parts: &[Part], spacing: f32, crop: Option<[Vec3; 2]>) -> Result<Grid, Unsound> {
    let [mut low, mut high] = bounds(parts.iter().flat_map(|part| part.triangles.iter().flatten().copied()));
    if let Some([from, to]) = crop {
        let whole = [low, high];
        [low, high] = [low.max(from), high.min(to)];
        if !low.cmplt(high).all() {
            return Err(Unsound::Outside { low: whole[0], high: whole[1] });
        }
    }
    let counts = (high - low) / spacing + 2.0 * MARGIN as f32 + 2.0;
    let voxels = f64::from(counts.x) * f64::from(counts.y) * f64::from(counts.z);
    if !(voxels <= VOXELS_MAX && counts.max_element() <= AXIS_MAX) {
        return Err(Unsound::TooFine { spacing, voxels });
    }
    // Half a voxel in, so that flat sides lie between voxels.
    Ok(Grid::covering(low + 0.5 * spacing, high, Vec3::splat(spacing), MARGIN))
}

/// Labels what a part fills; returns a note where its surface crosses itself a little.
fn fill(grid: &Grid, part: &Part, label: &mut [Label]) -> Result<Option<String>, Unsound> {
    let (mut inside, mut crossing, mut first) = (0u64, 0u64, None);
    windings(grid, &part.triangles, |index, winding| {
        if winding > 0 {
            label[index] = part.label;
            inside += 1;
        }
        if winding != 1 {
            crossing += 1;
            first.get_or_insert(index);
        }
    });
    let Some(first) = first else { return Ok(None) };
    let (mm3, share) = (crossing as f64 * grid.voxel_mm3(), crossing as f64 / inside.max(1) as f64);
    let place = grid.centre(grid.cell(first));
    match share > CROSSING {
        true => Err(Unsound::Crossing { mm3, share, place }),
        false => Ok(Some(format!(
            "a surface crosses itself near ({:.1}, {:.1}, {:.1}) mm; {mm3:.3} mm³ that lie inside twice count once",
            place.x, place.y, place.z
        ))),
    }
}

/// Fills slivers of air between shells with what lies nearest; tells of larger hollows.
fn seal(grid: &Grid, label: &mut [Label]) -> Vec<String> {
    let pieces = Pieces::of(grid, |i| label[i] == Label::AIR);
    let Some(outside) = pieces.largest().map(|(number, _)| number) else { return Vec::new() };
    let size = |number: usize| pieces.sizes()[number] as f64 * grid.voxel_mm3();
    let is_at_border = |index: usize| grid.neighbours(index).count() < 6;
    let mut is_open = vec![false; pieces.sizes().len()];
    for index in 0..grid.len() {
        if let Some(number) = pieces.at(index).filter(|_| is_at_border(index)) {
            is_open[number] = true;
        }
    }
    is_open[outside] = true;
    let mut notes = Vec::new();
    let is_sliver: Vec<bool> = (0..is_open.len()).map(|n| !is_open[n] && size(n) < SLIVER).collect();
    if is_sliver.contains(&true) {
        let mm3: f64 = (0..is_sliver.len()).filter(|&n| is_sliver[n]).map(size).sum();
        let (_, nearest) = distance::to_nearest(grid, |i| label[i] != Label::AIR);
        for index in 0..grid.len() {
            if pieces.at(index).is_some_and(|n| is_sliver[n]) {
                label[index] = label[nearest[index] as usize];
            }
        }
        notes.push(format!("{mm3:.2} mm³ of gaps between the shells were closed"));
    }
    let hollow: f64 = (0..is_open.len()).filter(|&n| !is_open[n] && !is_sliver[n]).map(size).sum();
    if hollow > 0.0 {
        notes.push(format!("{hollow:.1} mm³ within the tooth stay empty: give a surface for the pulp to fill them"));
    }
    notes
}

/// The triangles of all parts, cut small, that have nothing of another part before them.
fn outer_surface(parts: &[Part], spacing: f32, mut see: impl FnMut(&Triangle)) {
    let solids: Vec<Solid> = parts.iter().map(|part| Solid::new(&part.triangles)).collect();
    let mut waiting = Vec::new();
    for (number, part) in parts.iter().enumerate() {
        for triangle in &part.triangles {
            waiting.push(*triangle);
            while let Some(triangle) = waiting.pop() {
                match halves(&triangle, spacing) {
                    Some(halves) => waiting.extend(halves),
                    None => {
                        let [a, b, c] = triangle;
                        let out = (b - a).cross(c - a).normalize_or_zero();
                        // Half a voxel before it: gaps that no voxel fits in are none.
                        let before = (a + b + c) / 3.0 + out * (0.5 * spacing);
                        let is_covered = (0..parts.len()).any(|n| n != number && solids[n].winding(before) > 0);
                        if !is_covered {
                            see(&triangle);
                        }
                    }
                }
            }
        }
    }
}

/// Both halves of a triangle with a side longer than so many mm, cut across that side.
fn halves(triangle: &Triangle, longest: f32) -> Option<[Triangle; 2]> {
    let side = |n: usize| triangle[n].distance_squared(triangle[(n + 1) % 3]);
    let n = (0..3).fold(0, |most, n| if side(n) > side(most) { n } else { most });
    let [a, b, c] = [0, 1, 2].map(|k| triangle[(n + k) % 3]);
    let middle = 0.5 * (a + b);
    // A side so long that single precision has no middle for it cannot be cut.
    (side(n) > longest * longest && middle != a && middle != b).then_some([[a, middle, c], [middle, b, c]])
}

#[cfg(test)]
mod tests;
