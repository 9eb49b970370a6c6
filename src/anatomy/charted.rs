//! A label map of a tooth as a volume: its voxels as drawn, its surface without their steps.

use super::slope::{self, slope_of};
use super::window::Window;
use crate::volume::{Grid, Label, Volume, distance, ramp};

/// Rounds of smoothing: after six the steps of a map no longer show in the direction of the surface.
const ROUNDS: usize = 6;

/// How near a voxel's centre may come to the surface by smoothing, voxels: it never crosses it.
const HOLD: f32 = 0.05;

/// Empty voxels around the matter that smoothing needs beyond the surface's own.
const SPARE: [u32; 3] = [1; 3];

/// Makes a volume of a map. Every voxel keeps its label and stays solid or empty as it was drawn.
///
/// The grid stays the map's, and grows by a few voxels only where matter lies at its border. `None` for an empty map.
pub fn charted(grid: &Grid, label: Vec<Label>) -> Option<Volume> {
    let [low, high] = drawn_box(grid, &label)?;
    let window = Window::around(grid, low, high, SPARE);
    let label = window.cut(label, Label::AIR);
    let grid = &window.grid;
    let untold = label.iter().copied().find(|&l| l != Label::AIR)?;

    let mut field = distance::signed(grid, |i| label[i] != Label::AIR);
    let hold = HOLD * grid.spacing.min_element();
    for _ in 0..ROUNDS {
        slope::calm(grid, &mut field);
        for (distance, &label) in field.iter_mut().zip(&label) {
            *distance = if label != Label::AIR { distance.min(-hold) } else { distance.max(hold) };
        }
    }
    field.iter_mut().for_each(|distance| *distance = -*distance);
    let slope = slope_of(grid, &field, slope::reach(grid));
    drop(field);
    let band = slope::band(grid);
    let density = slope.into_iter().map(|distance| ramp(distance, band)).collect();
    let (grid, density, label) = window.paste(density, label);
    Some(Volume::new(grid, band, density, label, untold))
}

fn drawn_box(grid: &Grid, label: &[Label]) -> Option<[[u32; 3]; 2]> {
    let mut drawn = grid.cells().zip(label).filter(|(_, l)| **l != Label::AIR).map(|(cell, _)| cell);
    let first = drawn.next()?;
    let join = |a: [u32; 3], b: [u32; 3], choose: fn(u32, u32) -> u32| std::array::from_fn(|i| choose(a[i], b[i]));
    Some(drawn.fold([first; 2], |[low, high], cell| [join(low, cell, u32::min), join(high, cell, u32::max)]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Vec3;

    #[test]
    fn a_drawn_ball_is_round_and_keeps_its_voxels() {
        // Aim: no steps. Method: on the surface of a drawn ball the gradient points outward within a few degrees.
        let grid = Grid::centred([48, 48, 48], Vec3::splat(0.2));
        let is_drawn = |cell| grid.centre(cell).length() < 3.5;
        let label: Vec<Label> = grid.cells().map(|c| if is_drawn(c) { Label(4) } else { Label::AIR }).collect();
        let volume = charted(&grid, label.clone()).unwrap();
        assert_eq!(*volume.grid(), grid);
        assert!(volume.tissues().eq(label));
        let mut worst = 1.0f32;
        for (index, cell) in grid.cells().enumerate() {
            let (density, out) = (volume.voxel(index).density.unit(), grid.centre(cell));
            if (0.3..0.7).contains(&density) {
                let (_, gradient) = volume.density_and_gradient_at(out);
                worst = worst.min(-gradient.normalize().dot(out.normalize()));
            }
        }
        assert!(worst > 0.97, "{worst}");
    }

    #[test]
    fn matter_at_the_border_gets_room() {
        let grid = Grid::centred([5, 6, 7], Vec3::ONE);
        let volume = charted(&grid, vec![Label(2); grid.len()]).unwrap();
        assert_eq!(volume.grid().dims, [11, 12, 13]);
        assert_eq!(volume.count(Label(2)), grid.len());
        assert!(charted(&grid, vec![Label::AIR; grid.len()]).is_none());
    }
}
