//! A CT of one tooth, told apart into enamel, dentine and pulp.
//!
//! Takes values on a grid. Gives a volume in tooth space, its voxels those of the scan.
//! Never cuts by a plane: where a voxel is only partly filled, what lies nearest decides and not the value.

mod cavity;
mod fine;
mod layers;
mod levels;

use super::Tissues;
use super::pieces::Pieces;
use super::slope::{self, slope_of};
use super::turn;
use super::window::Window;
use crate::volume::{Grid, Label, Volume, ramp};
pub use fine::labels;
use levels::Levels;
use std::fmt;

/// Longest side of a voxel in shortest sides. Clinical scans have up to 10.
const FLATNESS_MAX: f32 = 20.0;

/// How long a tooth, or what was scanned of it, can be, mm: a milk incisor's crown to a canine with its root, with leeway.
const LENGTH: std::ops::RangeInclusive<f32> = 4.0..=50.0;

/// Why a scan cannot be told apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Unclear {
    /// All values are the same, or none is a number.
    Flat,
    /// Nothing in it has an inside.
    NoBody,
    /// Its hard matter has one level, not the two of dentine and enamel.
    OneLevel,
    /// Voxels are so many times longer than they are wide.
    Uneven(f32),
    /// The largest solid thing has a length that no tooth has, mm.
    Size(f32),
}

impl fmt::Display for Unclear {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Unclear::Flat => f.write_str(
                "there is no tooth in it: all values are the same; name the CT volume of a tooth, or cut out another part \
                 of it (--at, --crop)",
            ),
            Unclear::NoBody => f.write_str(
                "there is no tooth in it: nothing is solid; give a CT volume in which hard tissue is bright, or cut out \
                 another part of it (--at, --crop)",
            ),
            Unclear::OneLevel => f.write_str(
                "there is no tooth in it whose enamel can be told from its dentine: the solid matter has one grey value, \
                 not two; cut out the part with one tooth (--at, --crop), give a CT volume in which enamel is brighter, \
                 or a label map (--labels)",
            ),
            Unclear::Uneven(times) => write!(
                f,
                "its voxels are {times:.0} times longer than wide, more than {FLATNESS_MAX:.0} is a mistake; \
                 check the spacing"
            ),
            Unclear::Size(mm) => write!(
                f,
                "there is no tooth by itself in it: its largest solid piece is {mm:.1} mm long, and a tooth is {} to {} mm \
                 long; cut one out (--at, --crop), or give tooth spacing in mm where the file's is wrong (--spacing-mm)",
                LENGTH.start(),
                LENGTH.end()
            ),
        }
    }
}

/// What a voxel of a scan holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Matter {
    Air,
    Dentine,
    Enamel,
    Pulp,
}

impl Matter {
    fn is_hard(self) -> bool {
        matches!(self, Matter::Dentine | Matter::Enamel)
    }
}

/// Tells the tissues of a tooth apart and sets it upright: crown up along z, which is 0 at the lowest enamel.
///
/// Values must rise from background over dentine to enamel; their scale does not matter, NaN counts as background.
pub fn segment(grid: &Grid, values: Vec<f32>, tissues: &Tissues) -> Result<Volume, Unclear> {
    let Told { window, levels, mut values, matter, nearest_enamel } = tell_apart(grid, values)?;
    let grid = &window.grid;
    into_field(&mut values, &matter, &levels, &nearest_enamel);
    drop(nearest_enamel);
    keep_one_piece(grid, &mut values);

    let mut slope = slope_of(grid, &values, slope::reach(grid));
    drop(values);
    slope::calm(grid, &mut slope);
    let band = slope::band(grid);
    let density = slope.into_iter().map(|distance| ramp(distance, band)).collect();
    let label = matter.into_iter().map(|matter| label_of(matter, tissues)).collect();
    Ok(turn::upright(window.paste(density, label), band, tissues))
}

/// The part of a scan in which the tooth is, and what each of its voxels holds.
struct Told {
    window: Window,
    levels: Levels,
    /// Of the window, without NaN.
    values: Vec<f32>,
    matter: Vec<Matter>,
    /// Whether the nearest hard matter of a voxel is enamel.
    nearest_enamel: Vec<bool>,
}

fn tell_apart(grid: &Grid, values: Vec<f32>) -> Result<Told, Unclear> {
    let solid_from = levels::solid_from(&values)?;
    let window = window_of_tooth(grid, &values, solid_from)?;
    let background = levels::background(&values, solid_from);
    let mut values = window.cut(values, background);
    values.iter_mut().filter(|value| value.is_nan()).for_each(|value| *value = background);
    let grid = &window.grid;

    let levels = Levels::of(grid, &values, background, solid_from)?;
    let mut matter = solid(grid, &values, &levels);
    let nearest_enamel = layers::part(grid, &values, &levels, &mut matter);
    cavity::fill(grid, &values, &levels, &mut matter);
    Ok(Told { window, levels, values, matter, nearest_enamel })
}

fn label_of(matter: Matter, tissues: &Tissues) -> Label {
    match matter {
        Matter::Air => Label::AIR,
        Matter::Dentine => tissues.dentine,
        Matter::Enamel => tissues.enamel,
        Matter::Pulp => tissues.pulp,
    }
}

/// The part of the grid around the largest solid piece, with room for what is done there.
fn window_of_tooth(grid: &Grid, values: &[f32], solid_from: f32) -> Result<Window, Unclear> {
    let pieces = Pieces::of(grid, |i| values[i] >= solid_from);
    let (tooth, _) = pieces.largest().ok_or(Unclear::NoBody)?;
    let [low, high] = box_around(grid, |i| pieces.at(i) == Some(tooth));
    let length = (grid.centre(high) - grid.centre(low) + grid.spacing).max_element();
    // Thin slices are ordinary; beyond this a header is wrong, and distances in voxels lose their meaning.
    let flatness = grid.spacing.max_element() / grid.spacing.min_element();
    if flatness > FLATNESS_MAX {
        return Err(Unclear::Uneven(flatness));
    }
    if !LENGTH.contains(&length) {
        return Err(Unclear::Size(length));
    }
    // One more, so that the window's corner stays outside what bridging seals.
    let bridge = cavity::bridge(grid);
    let spare = grid.spacing.to_array().map(|step| (bridge / step).ceil() as u32 + 1);
    Ok(Window::around(grid, low, high, spare))
}

/// Lowest and highest cell of a set that is not empty.
fn box_around(grid: &Grid, is_in: impl Fn(usize) -> bool) -> [[u32; 3]; 2] {
    let mut found = [[u32::MAX; 3], [0; 3]];
    for (index, cell) in grid.cells().enumerate() {
        if is_in(index) {
            for axis in 0..3 {
                found[0][axis] = found[0][axis].min(cell[axis]);
                found[1][axis] = found[1][axis].max(cell[axis]);
            }
        }
    }
    found
}

/// The tooth's hard matter, all of it dentine for now.
fn solid(grid: &Grid, values: &[f32], levels: &Levels) -> Vec<Matter> {
    let from = levels.dentine_from();
    let pieces = Pieces::of(grid, |i| values[i] >= from);
    let tooth = pieces.largest().map(|(number, _)| number);
    let matter = |i| if tooth.is_some() && pieces.at(i) == tooth { Matter::Dentine } else { Matter::Air };
    (0..grid.len()).map(matter).collect()
}

/// Makes of the values how far each voxel is above half full: the surface of the tooth is where that is zero.
///
/// Half full depends on what fills it: enamel's surface lies nearer to enamel's level than dentine's does.
fn into_field(values: &mut [f32], matter: &[Matter], levels: &Levels, nearest_enamel: &[bool]) {
    /// What is not part of the tooth, or surely within it, whatever its value.
    const SURE: f32 = 0.5;
    for ((value, matter), is_enamel) in values.iter_mut().zip(matter).zip(nearest_enamel) {
        let full = if *is_enamel { levels.enamel } else { levels.dentine };
        let above_half = (*value - levels.background) / (full - levels.background) - 0.5;
        *value = match matter {
            Matter::Pulp => SURE,
            Matter::Air => above_half.clamp(-SURE, -0.01),
            Matter::Dentine | Matter::Enamel => above_half.min(SURE),
        };
    }
}

/// Empties what the surface's exact place cut off.
fn keep_one_piece(grid: &Grid, field: &mut [f32]) {
    let pieces = Pieces::of(grid, |i| field[i] >= 0.0);
    let tooth = pieces.largest().map(|(number, _)| number);
    for (index, value) in field.iter_mut().enumerate() {
        if pieces.at(index) != tooth {
            *value = value.min(-0.01);
        }
    }
}

#[cfg(test)]
mod tests;
