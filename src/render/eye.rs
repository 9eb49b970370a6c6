//! One eye: where it is, what it looks along, and the four-sided, maybe lopsided window it looks through.

use crate::frame::Vec3;

/// A pinhole camera whose window need not be centred.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eye {
    /// World space, mm.
    pub position: Vec3,
    /// Unit, across each other; `ahead` is into the picture.
    pub right: Vec3,
    pub up: Vec3,
    pub ahead: Vec3,
    /// The window's edges at a depth of 1 mm, from the line straight ahead.
    pub window: Window,
    /// What is nearer or farther is not drawn, mm along `ahead`. 0 < near < far.
    pub near: f32,
    pub far: f32,
}

/// Edges as tangents of angles from straight ahead.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    pub left: f32,
    pub right: f32,
    pub bottom: f32,
    pub top: f32,
}

impl Eye {
    /// The direction through a place of the picture (0–1, from the upper left), 1 mm deep: `position + ray * z` lies at
    /// depth z.
    pub fn ray(&self, x: f32, y: f32) -> Vec3 {
        let Window { left, right, bottom, top } = self.window;
        self.ahead + self.right * (left + (right - left) * x) + self.up * (top + (bottom - top) * y)
    }

    /// Where in the picture a point is seen (0–1, from the upper left) and at which depth, mm. Behind the eye the depth is
    /// negative and the place means nothing.
    pub fn place(&self, point_in_world: Vec3) -> ([f32; 2], f32) {
        let Window { left, right, bottom, top } = self.window;
        let from_eye = point_in_world - self.position;
        let z = from_eye.dot(self.ahead);
        let (x, y) = (from_eye.dot(self.right) / z, from_eye.dot(self.up) / z);
        ([(x - left) / (right - left), (y - top) / (bottom - top)], z)
    }

    /// What the depth buffer holds for a depth in mm: 0 at `near`, 1 at `far`. Equation 1 of the thesis this program goes
    /// back to, which is that of every perspective depth buffer from 0 to 1.
    pub fn buffer_depth(&self, z: f32) -> f32 {
        self.far / (self.far - self.near) * (1.0 - self.near / z)
    }

    /// The depth in mm of a value in the depth buffer.
    pub fn depth(&self, buffer_depth: f32) -> f32 {
        self.near / (1.0 - buffer_depth * (self.far - self.near) / self.far)
    }

    /// Columns of the matrix from world space to wgpu's clip space, whose depth goes from 0 to 1.
    pub fn clip_from_world(&self) -> [[f32; 4]; 4] {
        let Window { left, right, bottom, top } = self.window;
        let (wide, high) = (right - left, top - bottom);
        let stretch = self.far / (self.far - self.near);
        let across = self.right * (2.0 / wide) - self.ahead * ((right + left) / wide);
        let upward = self.up * (2.0 / high) - self.ahead * ((top + bottom) / high);
        let rows = [across, upward, self.ahead * stretch, self.ahead];
        let last = rows.map(|row| -row.dot(self.position));
        let last = [last[0], last[1], last[2] - stretch * self.near, last[3]];
        let column = |axis: usize| rows.map(|row| row[axis]);
        [column(0), column(1), column(2), last]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lopsided() -> Eye {
        let right = Vec3::new(0.6, 0.0, -0.8);
        let up = right.cross(Vec3::new(-0.48, -0.8, -0.36));
        let window = Window { left: -0.3, right: 0.5, bottom: -0.4, top: 0.2 };
        Eye { position: Vec3::new(3.0, 40.0, 60.0), right, up, ahead: up.cross(right), window, near: 5.0, far: 900.0 }
    }

    #[test]
    fn a_ray_and_a_place_are_each_others_inverse() {
        let eye = lopsided();
        for (x, y, z) in [(0.0, 0.0, 10.0), (0.25, 0.9, 70.0), (1.0, 1.0, 800.0)] {
            let ([px, py], depth) = eye.place(eye.position + eye.ray(x, y) * z);
            assert!(
                (px - x).abs() < 1e-4 && (py - y).abs() < 1e-4 && (depth / z - 1.0).abs() < 1e-4,
                "{px} {py} {depth}"
            );
        }
    }

    #[test]
    fn the_matrix_says_the_same_as_the_place() {
        // Aim: triangles, which go through the matrix, and rays meet in one picture and one depth buffer.
        let eye = lopsided();
        let columns = eye.clip_from_world();
        for (x, y, z) in [(0.1, 0.2, 6.0), (0.5, 0.5, 80.0), (0.9, 0.3, 700.0)] {
            let point = eye.position + eye.ray(x, y) * z;
            let clip: [f32; 4] = std::array::from_fn(|row| {
                columns[0][row] * point.x + columns[1][row] * point.y + columns[2][row] * point.z + columns[3][row]
            });
            assert!((clip[3] / z - 1.0).abs() < 1e-4);
            assert!((0.5 + 0.5 * clip[0] / clip[3] - x).abs() < 1e-4);
            assert!((0.5 - 0.5 * clip[1] / clip[3] - y).abs() < 1e-4);
            assert!((clip[2] / clip[3] - eye.buffer_depth(z)).abs() < 1e-4);
        }
    }

    #[test]
    fn the_depth_buffer_runs_from_0_to_1_and_back() {
        let eye = lopsided();
        assert!(eye.buffer_depth(eye.near).abs() < 1e-6 && (eye.buffer_depth(eye.far) - 1.0).abs() < 1e-6);
        for z in [5.5, 60.0, 500.0] {
            assert!((eye.depth(eye.buffer_depth(z)) / z - 1.0).abs() < 1e-3);
        }
    }
}
