//! Joining signed distances (mm, negative inside) without sharp edges.

/// The common part of two bodies, its convex edge rounded with a radius.
#[inline]
pub(super) fn common(a: f32, b: f32, radius: f32) -> f32 {
    let (over_a, over_b) = (a + radius, b + radius);
    if over_a > 0.0 && over_b > 0.0 { (over_a * over_a + over_b * over_b).sqrt() - radius } else { a.max(b) }
}

/// Two bodies in one, the concave edge between them filled with a radius.
#[inline]
pub(super) fn joined(a: f32, b: f32, radius: f32) -> f32 {
    -common(-a, -b, radius)
}

/// The higher of two values; where they come within `width` of each other the way from one to the other is soft.
///
/// Highest where both are equal: a quarter of the width above them.
#[inline]
pub(super) fn soft_max(a: f32, b: f32, width: f32) -> f32 {
    let near = (width - (a - b).abs()).max(0.0);
    a.max(b) + near * near / (4.0 * width)
}

/// A bump of height 1 at 0 that has run out, smoothly, at `width`.
#[inline]
pub(super) fn bump(distance: f32, width: f32) -> f32 {
    let share = (distance / width).min(1.0);
    let rest = 1.0 - share * share;
    rest * rest
}

#[inline]
pub(super) fn mix(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}
