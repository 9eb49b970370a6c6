//! A pinhole camera for one eye, with a frustum that may be off-axis.

use typodont_core::frame::Vec3;

/// A pinhole camera whose frustum need not be symmetric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eye {
    /// World space, mm.
    pub position: Vec3,
    /// Unit vectors, perpendicular to each other; `forward` points into the image.
    pub right: Vec3,
    pub up: Vec3,
    pub forward: Vec3,
    /// Edges of the frustum at a depth of 1 mm, measured from the forward axis.
    pub window: FrustumWindow,
    /// Clipping depths, mm along `forward`: nothing nearer or farther is drawn. 0 < near < far.
    pub near: f32,
    pub far: f32,
}

/// Edges of a frustum, as tangents of the angles from the forward axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrustumWindow {
    pub left: f32,
    pub right: f32,
    pub bottom: f32,
    pub top: f32,
}

impl Eye {
    /// Returns the direction through an image position (0–1, from the upper left), scaled to a depth of 1 mm:
    /// `position + ray * z` lies at depth z.
    pub fn ray(&self, x: f32, y: f32) -> Vec3 {
        let FrustumWindow { left, right, bottom, top } = self.window;
        self.forward + self.right * (left + (right - left) * x) + self.up * (top + (bottom - top) * y)
    }

    /// Returns the image position of a point (0–1, from the upper left) and its depth, mm. Behind the eye the depth
    /// is negative and the image position has no meaning.
    pub fn project(&self, point_in_world: Vec3) -> ([f32; 2], f32) {
        let FrustumWindow { left, right, bottom, top } = self.window;
        let from_eye = point_in_world - self.position;
        let z = from_eye.dot(self.forward);
        let (x, y) = (from_eye.dot(self.right) / z, from_eye.dot(self.up) / z);
        ([(x - left) / (right - left), (y - top) / (bottom - top)], z)
    }

    /// Returns false if a ball is out of sight for certain: in front of the near plane, beyond the far plane, or beside the
    /// image. World space, mm.
    pub fn may_see(&self, middle: Vec3, radius: f32) -> bool {
        let FrustumWindow { left, right, bottom, top } = self.window;
        let from_eye = middle - self.position;
        let z = from_eye.dot(self.forward);
        let is_beyond = |outward: Vec3| from_eye.dot(outward) > radius * outward.length();
        z + radius >= self.near
            && z - radius <= self.far
            && !is_beyond(self.forward * left - self.right)
            && !is_beyond(self.right - self.forward * right)
            && !is_beyond(self.forward * bottom - self.up)
            && !is_beyond(self.up - self.forward * top)
    }

    /// Returns the value in the depth buffer for a depth in mm: 0 at `near`, 1 at `far`. Equation 1 of the thesis
    /// that this program is based on; it is that of every perspective depth buffer from 0 to 1.
    pub fn buffer_depth(&self, z: f32) -> f32 {
        self.far / (self.far - self.near) * (1.0 - self.near / z)
    }

    /// Returns the depth in mm of a value in the depth buffer.
    pub fn depth(&self, buffer_depth: f32) -> f32 {
        self.near / (1.0 - buffer_depth * (self.far - self.near) / self.far)
    }

    /// Returns the columns of the matrix from world space to wgpu's clip space, whose depth ranges from 0 to 1.
    pub fn clip_from_world(&self) -> [[f32; 4]; 4] {
        let FrustumWindow { left, right, bottom, top } = self.window;
        let (wide, high) = (right - left, top - bottom);
        let stretch = self.far / (self.far - self.near);
        let across = self.right * (2.0 / wide) - self.forward * ((right + left) / wide);
        let upward = self.up * (2.0 / high) - self.forward * ((top + bottom) / high);
        let rows = [across, upward, self.forward * stretch, self.forward];
        let last = rows.map(|row| -row.dot(self.position));
        let last = [last[0], last[1], last[2] - stretch * self.near, last[3]];
        let column = |axis: usize| rows.map(|row| row[axis]);
        [column(0), column(1), column(2), last]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn off_axis_eye() -> Eye {
        let right = Vec3::new(0.6, 0.0, -0.8);
        let up = right.cross(Vec3::new(-0.48, -0.8, -0.36));
        let window = FrustumWindow { left: -0.3, right: 0.5, bottom: -0.4, top: 0.2 };
        Eye { position: Vec3::new(3.0, 40.0, 60.0), right, up, forward: up.cross(right), window, near: 5.0, far: 900.0 }
    }

    #[test]
    fn ray_and_project_are_inverse() {
        let eye = off_axis_eye();
        for (x, y, z) in [(0.0, 0.0, 10.0), (0.25, 0.9, 70.0), (1.0, 1.0, 800.0)] {
            let ([px, py], depth) = eye.project(eye.position + eye.ray(x, y) * z);
            assert!(
                (px - x).abs() < 1e-4 && (py - y).abs() < 1e-4 && (depth / z - 1.0).abs() < 1e-4,
                "{px} {py} {depth}"
            );
        }
    }

    #[test]
    fn the_matrix_agrees_with_project() {
        // Aim: triangles, which go through the matrix, and rays agree in one image and one depth buffer.
        let eye = off_axis_eye();
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
        let eye = off_axis_eye();
        assert!(eye.buffer_depth(eye.near).abs() < 1e-6 && (eye.buffer_depth(eye.far) - 1.0).abs() < 1e-6);
        for z in [5.5, 60.0, 500.0] {
            assert!((eye.depth(eye.buffer_depth(z)) / z - 1.0).abs() < 1e-3);
        }
    }
}
