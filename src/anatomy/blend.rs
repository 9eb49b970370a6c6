//! Combination of signed distances (mm, negative inside) without sharp edges.

/// Returns the intersection of two bodies, its convex edge rounded with a radius.
#[inline]
pub(super) fn smooth_intersection(a: f32, b: f32, radius: f32) -> f32 {
    let (over_a, over_b) = (a + radius, b + radius);
    if over_a > 0.0 && over_b > 0.0 { (over_a * over_a + over_b * over_b).sqrt() - radius } else { a.max(b) }
}

/// Returns the union of two bodies, the concave edge between them filled with a radius.
#[inline]
pub(super) fn smooth_union(a: f32, b: f32, radius: f32) -> f32 {
    -smooth_intersection(-a, -b, radius)
}

/// Returns the maximum of two values, with a smooth transition where they differ by less than `width`.
///
/// The excess over the maximum is greatest where both are equal: a quarter of the width.
#[inline]
pub(super) fn smooth_max(a: f32, b: f32, width: f32) -> f32 {
    let near = (width - (a - b).abs()).max(0.0);
    a.max(b) + near * near / (4.0 * width)
}

/// Returns a bump of height 1 at 0 that decreases smoothly to 0 at `width`.
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
