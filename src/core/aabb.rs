//! Axis-aligned bounding boxes.
//!
//! Takes and gives points in mm, in one space; the box does not know which. Its low corner is at most its high corner,
//! along each axis, except for [`Aabb::EMPTY`].

use crate::frame::Vec3;

/// Axis-aligned box, mm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Aabb {
    pub low: Vec3,
    pub high: Vec3,
}

impl Aabb {
    /// The box around no point: a union with it changes nothing.
    pub const EMPTY: Aabb = Aabb { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY };

    #[inline]
    pub fn new(low: Vec3, high: Vec3) -> Aabb {
        Aabb { low, high }
    }

    /// Returns the smallest box around points; [`Aabb::EMPTY`] if there are none.
    pub fn around(points: impl IntoIterator<Item = Vec3>) -> Aabb {
        points.into_iter().fold(Aabb::EMPTY, |bounds, point| bounds.with(point))
    }

    /// Returns the smallest box around this one and a point.
    #[inline]
    pub fn with(self, point: Vec3) -> Aabb {
        Aabb { low: self.low.min(point), high: self.high.max(point) }
    }

    /// Returns the smallest box around two boxes.
    #[inline]
    pub fn union(self, other: Aabb) -> Aabb {
        Aabb { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Returns the box with `margin` more on every side.
    #[inline]
    pub fn grown(self, margin: Vec3) -> Aabb {
        Aabb { low: self.low - margin, high: self.high + margin }
    }

    /// Returns the eight corners.
    pub fn corners(self) -> [Vec3; 8] {
        let Aabb { low, high } = self;
        let end = |i: usize, bit: usize, low: f32, high: f32| if i & bit == 0 { low } else { high };
        std::array::from_fn(|i| Vec3::new(end(i, 1, low.x, high.x), end(i, 2, low.y, high.y), end(i, 4, low.z, high.z)))
    }

    /// Returns true for a box without any point.
    #[inline]
    pub fn is_empty(&self) -> bool {
        !self.low.cmple(self.high).all()
    }

    #[inline]
    pub fn centre(&self) -> Vec3 {
        0.5 * (self.low + self.high)
    }

    /// Lengths of the edges.
    #[inline]
    pub fn size(&self) -> Vec3 {
        self.high - self.low
    }

    #[inline]
    pub fn half_size(&self) -> Vec3 {
        0.5 * (self.high - self.low)
    }

    /// Returns the point of the box that is nearest to a point.
    #[inline]
    pub fn nearest(&self, point: Vec3) -> Vec3 {
        point.clamp(self.low, self.high)
    }

    /// Returns true for a point inside or on the border.
    #[inline]
    pub fn contains(&self, point: Vec3) -> bool {
        point.cmpge(self.low).all() && point.cmple(self.high).all()
    }

    /// Returns true if the boxes have a point in common.
    #[inline]
    pub fn overlaps(&self, other: &Aabb) -> bool {
        self.low.cmple(other.high).all() && self.high.cmpge(other.low).all()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_holds_its_points_and_nothing_beyond() {
        let bounds = Aabb::around([Vec3::new(1.0, -2.0, 3.0), Vec3::new(-1.0, 4.0, 3.0)]);
        assert_eq!(bounds, Aabb::new(Vec3::new(-1.0, -2.0, 3.0), Vec3::new(1.0, 4.0, 3.0)));
        assert!(bounds.contains(Vec3::new(0.0, 4.0, 3.0)) && !bounds.contains(Vec3::new(0.0, 4.1, 3.0)));
        assert_eq!(bounds.nearest(Vec3::new(5.0, 0.0, 0.0)), Vec3::new(1.0, 0.0, 3.0));
        assert_eq!([bounds.centre(), bounds.size()], [Vec3::new(0.0, 1.0, 3.0), Vec3::new(2.0, 6.0, 0.0)]);
    }

    #[test]
    fn the_empty_box_holds_nothing_and_changes_no_union() {
        let bounds = Aabb::new(Vec3::ZERO, Vec3::ONE);
        assert!(Aabb::EMPTY.is_empty() && !bounds.is_empty() && !Aabb::default().is_empty());
        assert_eq!(bounds.union(Aabb::EMPTY), bounds);
        assert!(!Aabb::EMPTY.overlaps(&bounds) && bounds.overlaps(&bounds.grown(Vec3::splat(-0.4))));
    }
}
