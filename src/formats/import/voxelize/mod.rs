//! Voxelization of closed surfaces: shells of enamel, dentine and pulp become a tooth volume.
//!
//! Takes triangles in mm. Gives a volume in which every voxel has the tissue at its centre, and its density from the
//! exact distance to the outer surface. Never guesses an inside: surfaces that are open, tangled or self-intersecting
//! are refused.

mod mesh_check;

pub use mesh_check::{UNITS, VoxelizeError};

use crate::import::orientation;
use crate::limits::{AXIS_MAX, VOXELS_MAX};
use mesh_check::CheckedMesh;
use typodont_anatomy::TissueLabels;
use typodont_core::aabb::Aabb;
use typodont_core::frame::Vec3;
use typodont_core::volume::components::Components;
use typodont_core::volume::redistance;
use typodont_core::volume::solid::{Triangle, WindingQuery, for_each_winding, lower_distances};
use typodont_core::volume::{Density, Grid, Label, Volume, density_at_distance, distance};

/// Margin of empty voxels around the tooth.
const MARGIN: u32 = 4;

/// Fraction of the inside that may be inside twice before it counts as a mistake: slivers where shells were drawn
/// slightly into one another.
const CROSSING: f64 = 0.01;

/// Volume below which a completely enclosed gap is a sliver between two shells and not a chamber, mm³.
const SLIVER: f64 = 1.0;

/// The surface of one tissue.
#[derive(Clone, Debug)]
pub struct TissueSurface {
    pub label: Label,
    /// Closed; facing outward, and inward around hollows.
    pub triangles: Vec<Triangle>,
    /// Volume by the divergence theorem, mm³.
    pub volume_mm3: f64,
    /// Notes for the owner, as sentences without a full stop.
    pub notes: Vec<String>,
}

/// Checks and orients the surface of one tissue: all pieces face outward, those around hollows inward.
///
/// # Errors
/// Fails when the surface is empty, open, inconsistent, or not of a tooth's size.
pub fn tissue_surface(label: Label, triangles: &[Triangle]) -> Result<TissueSurface, VoxelizeError> {
    let mesh = CheckedMesh::of(triangles)?;
    let mut notes = flipped_triangles_note(mesh.flipped_triangles);
    let (all, flipped_shells) = outward_triangles(&mesh);
    notes.extend(flipped_shells_note(flipped_shells));
    Ok(TissueSurface { label, volume_mm3: signed_volume_mm3(&all), triangles: all, notes })
}

/// Maximum number of pieces of an object: an assembly has dozens, and each is compared with every other.
const PIECES_MAX: usize = 500;

/// Checks and orients a closed surface of any size: all pieces face outward, those around hollows inward.
///
/// # Errors
/// Fails when the surface is empty, open or inconsistent, or in too many pieces.
pub fn closed_surface(triangles: &[Triangle]) -> Result<Vec<Triangle>, VoxelizeError> {
    let mesh = CheckedMesh::of_any_size(triangles)?;
    match mesh.pieces.len() {
        found if found > PIECES_MAX => Err(VoxelizeError::Pieces(found)),
        _ => Ok(outward_triangles(&mesh).0),
    }
}

/// Triangles of all pieces, facing outward, and the number of pieces that had to be turned inside out.
fn outward_triangles(mesh: &CheckedMesh) -> (Vec<Triangle>, usize) {
    let pieces: Vec<Vec<Triangle>> = (0..mesh.pieces.len()).map(|n| mesh.triangles(n)).collect();
    let depths = nesting_depths(&pieces);
    let mut all = Vec::new();
    let mut flipped = 0;
    for (mut piece, depth) in pieces.into_iter().zip(depths) {
        // A piece within a piece bounds a hollow, and a piece within a hollow is solid again.
        if (signed_volume_mm3(&piece) < 0.0) == (depth % 2 == 0) {
            piece.iter_mut().for_each(|t| t.swap(1, 2));
            flipped += 1;
        }
        all.extend(piece);
    }
    (all, flipped)
}

/// Assigns the shells of one surface to tissues by nesting depth: the first label is the outermost.
///
/// # Errors
/// Fails when the surface is not closed and consistent, or when the nesting depth differs from the number of labels.
pub fn nested_tissue_surfaces(labels: &[Label], triangles: &[Triangle]) -> Result<Vec<TissueSurface>, VoxelizeError> {
    let mesh = CheckedMesh::of(triangles)?;
    let pieces: Vec<Vec<Triangle>> = (0..mesh.pieces.len()).map(|n| mesh.triangles(n)).collect();
    let depths = nesting_depths(&pieces);
    let found = depths.iter().max().map_or(0, |most| most + 1);
    if found != labels.len() {
        return Err(VoxelizeError::Levels { found, named: labels.len() });
    }
    let part = |&label| TissueSurface { label, triangles: Vec::new(), volume_mm3: 0.0, notes: Vec::new() };
    let mut parts: Vec<TissueSurface> = labels.iter().map(part).collect();
    let mut flipped = 0;
    for (mut piece, depth) in pieces.into_iter().zip(depths) {
        if signed_volume_mm3(&piece) < 0.0 {
            piece.iter_mut().for_each(|t| t.swap(1, 2));
            flipped += 1;
        }
        parts[depth].volume_mm3 += signed_volume_mm3(&piece);
        parts[depth].triangles.extend(piece);
    }
    // The inside of a shell belongs to the next tissue.
    for level in 1..parts.len() {
        parts[level - 1].volume_mm3 -= parts[level].volume_mm3;
    }
    parts[0].notes = flipped_triangles_note(mesh.flipped_triangles);
    parts[0].notes.extend(flipped_shells_note(flipped));
    Ok(parts)
}

fn flipped_triangles_note(turned: usize) -> Vec<String> {
    match turned {
        0 => Vec::new(),
        1 => vec!["one triangle was oriented differently from its neighbours and was flipped".to_string()],
        n => vec![format!("{n} triangles were oriented differently from their neighbours and were flipped")],
    }
}

fn flipped_shells_note(flipped: usize) -> Option<String> {
    match flipped {
        0 => None,
        1 => Some("a closed shell faced the wrong way and was turned inside out".to_string()),
        n => Some(format!("{n} closed shells faced the wrong way and were turned inside out")),
    }
}

fn signed_volume_mm3(triangles: &[Triangle]) -> f64 {
    let wedge = |t: &Triangle| {
        let [a, b, c] = t.map(|corner| corner.as_dvec3());
        a.dot(b.cross(c)) / 6.0
    };
    triangles.iter().map(wedge).sum()
}

/// Returns, for each piece, the number of other pieces that contain it.
fn nesting_depths(pieces: &[Vec<Triangle>]) -> Vec<usize> {
    if pieces.len() == 1 {
        return vec![0];
    }
    let solids: Vec<WindingQuery> = pieces.iter().map(|piece| WindingQuery::new(piece)).collect();
    let is_in = |inner: usize, outer: usize| {
        // The middle of a triangle does not lie on an edge of another piece.
        let [a, b, c] = pieces[inner][0];
        inner != outer && solids[outer].winding((a + b + c) / 3.0) != 0
    };
    (0..pieces.len()).map(|inner| (0..pieces.len()).filter(|&outer| is_in(inner, outer)).count()).collect()
}

/// A tooth made of shells, with notes for its owner.
#[derive(Clone, Debug)]
pub struct Voxelized {
    pub volume: Volume,
    pub notes: Vec<String>,
}

/// Voxelizes parts at a spacing in mm. Parts are ordered from outside in: where two overlap, the later one wins.
///
/// `crop` is the box of the wanted part, mm. If there is enamel, the crown is turned up along z
/// as for a scan.
///
/// # Errors
/// Fails when the grid would be too large, the crop box or the result is empty, or a surface crosses itself.
pub fn voxelize(
    parts: &[TissueSurface],
    spacing: f32,
    crop: Option<Aabb>,
    tissues: &TissueLabels,
) -> Result<Voxelized, VoxelizeError> {
    let grid = grid_around(parts, spacing, crop)?;
    let mut notes: Vec<String> = parts.iter().flat_map(|part| part.notes.clone()).collect();
    let mut label = vec![Label::AIR; grid.len()];
    for part in parts {
        notes.extend(label_inside(&grid, part, &mut label)?);
    }
    if label.iter().all(|l| *l == Label::AIR) {
        return Err(VoxelizeError::NothingLeft);
    }
    notes.extend(fill_gaps(&grid, &mut label));

    let reach = redistance::max_distance(&grid);
    let mut away = vec![reach; grid.len()];
    for_each_outer_triangle(parts, spacing, |triangle| lower_distances(&grid, triangle, reach, &mut away));
    let band = redistance::half_band(&grid);
    let least = redistance::MIN_DISTANCE_VOXELS * spacing;
    let density: Vec<Density> = away
        .into_iter()
        .zip(&label)
        .map(|(away, label)| {
            density_at_distance(if *label == Label::AIR { away.max(least) } else { -away.max(least) }, band)
        })
        .collect();
    let volume = match label.contains(&tissues.enamel) {
        true => orientation::upright((grid, density, label), band, tissues).0,
        false => {
            notes.push("there is no enamel, so the crown could not be located: it must point to +z".to_string());
            let default_label = parts.first().map_or(tissues.dentine, |part| part.label);
            Volume::new(grid, band, density, label, default_label)
        }
    };
    Ok(Voxelized { volume, notes })
}

fn grid_around(parts: &[TissueSurface], spacing: f32, crop: Option<Aabb>) -> Result<Grid, VoxelizeError> {
    let whole = Aabb::around(parts.iter().flat_map(|part| part.triangles.iter().flatten().copied()));
    let Aabb { low, high } = match crop {
        Some(crop) => Aabb::new(whole.low.max(crop.low), whole.high.min(crop.high)),
        None => whole,
    };
    if crop.is_some() && !low.cmplt(high).all() {
        return Err(VoxelizeError::Outside { low: whole.low, high: whole.high });
    }
    let counts = (high - low) / spacing + 2.0 * MARGIN as f32 + 2.0;
    let voxels = f64::from(counts.x) * f64::from(counts.y) * f64::from(counts.z);
    if !(voxels <= VOXELS_MAX as f64 && counts.max_element() <= AXIS_MAX as f32) {
        return Err(VoxelizeError::TooFine { spacing, voxels });
    }
    // Shifted by half a voxel, so that flat sides lie between voxel centres.
    Ok(Grid::covering(low + 0.5 * spacing, high, Vec3::splat(spacing), MARGIN))
}

/// Labels the inside of a part; returns a note if its surface crosses itself slightly.
fn label_inside(grid: &Grid, part: &TissueSurface, label: &mut [Label]) -> Result<Option<String>, VoxelizeError> {
    let (mut inside, mut crossing, mut first) = (0u64, 0u64, None);
    for_each_winding(grid, &part.triangles, |index, winding| {
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
        true => Err(VoxelizeError::Crossing { mm3, share, place }),
        false => Ok(Some(format!(
            "a surface crosses itself near ({:.1}, {:.1}, {:.1}) mm; {mm3:.3} mm³ inside twice are counted once",
            place.x, place.y, place.z
        ))),
    }
}

/// Fills slivers of air between shells with the nearest tissue; returns notes about these and about larger hollows.
fn fill_gaps(grid: &Grid, label: &mut [Label]) -> Vec<String> {
    let pieces = Components::of(grid, |i| label[i] == Label::AIR);
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
        notes.push(format!("{hollow:.1} mm³ within the tooth remain empty: give a surface for the pulp to fill them"));
    }
    notes
}

/// Visits the triangles of all parts, subdivided to the voxel spacing, that are not covered by another part.
fn for_each_outer_triangle(parts: &[TissueSurface], spacing: f32, mut visit: impl FnMut(&Triangle)) {
    let solids: Vec<WindingQuery> = parts.iter().map(|part| WindingQuery::new(&part.triangles)).collect();
    let mut waiting = Vec::new();
    for (number, part) in parts.iter().enumerate() {
        for triangle in &part.triangles {
            waiting.push(*triangle);
            while let Some(triangle) = waiting.pop() {
                match bisect_longest_edge(&triangle, spacing) {
                    Some(halves) => waiting.extend(halves),
                    None => {
                        let [a, b, c] = triangle;
                        let out = (b - a).cross(c - a).normalize_or_zero();
                        // Half a voxel in front of the triangle: gaps narrower than a voxel are ignored.
                        let before = (a + b + c) / 3.0 + out * (0.5 * spacing);
                        let is_covered = (0..parts.len()).any(|n| n != number && solids[n].winding(before) > 0);
                        if !is_covered {
                            visit(&triangle);
                        }
                    }
                }
            }
        }
    }
}

/// Bisects a triangle across its longest side if that side is longer than `longest`, mm.
fn bisect_longest_edge(triangle: &Triangle, longest: f32) -> Option<[Triangle; 2]> {
    let side = |n: usize| triangle[n].distance_squared(triangle[(n + 1) % 3]);
    let n = (0..3).fold(0, |most, n| if side(n) > side(most) { n } else { most });
    let [a, b, c] = [0, 1, 2].map(|k| triangle[(n + k) % 3]);
    let middle = 0.5 * (a + b);
    // A side so long that its midpoint is not representable in single precision cannot be bisected.
    (side(n) > longest * longest && middle != a && middle != b).then_some([[a, middle, c], [middle, b, c]])
}

#[cfg(test)]
mod tests;
