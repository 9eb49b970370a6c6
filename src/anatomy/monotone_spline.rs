//! Smooth interpolation of values along a line without overshoot.

/// A spline through several values given at points of a line.
///
/// It consists of cubic Hermite pieces with the slopes of Fritsch & Butland (*A method for constructing local monotone
/// piecewise cubic interpolants*, 1984). Between two given points no value is higher or lower than both, so that a cusp
/// remains the highest point and a constriction the narrowest. Beyond the ends, the values are constant.
#[derive(Clone, Debug)]
pub(super) struct MonotoneSpline<const N: usize> {
    knots: Vec<Knot<N>>,
}

#[derive(Clone, Copy, Debug)]
struct Knot<const N: usize> {
    at: f32,
    values: [f32; N],
    slopes: [f32; N],
}

impl<const N: usize> MonotoneSpline<N> {
    /// Makes a spline from at least one point. The points may be in any order, but their places must differ.
    pub(super) fn new(places: impl IntoIterator<Item = (f32, [f32; N])>) -> MonotoneSpline<N> {
        let mut knots: Vec<Knot<N>> =
            places.into_iter().map(|(at, values)| Knot { at, values, slopes: [0.0; N] }).collect();
        knots.sort_by(|a, b| a.at.total_cmp(&b.at));
        for i in 0..knots.len() {
            let before = i.checked_sub(1).map(|b| secants(&knots[b], &knots[i]));
            let after = knots.get(i + 1).map(|next| secants(&knots[i], next));
            knots[i].slopes = std::array::from_fn(|c| slope(before.map(|s| s[c]), after.map(|s| s[c])));
        }
        MonotoneSpline { knots }
    }

    pub(super) fn start(&self) -> f32 {
        self.knots.first().map_or(0.0, |k| k.at)
    }

    pub(super) fn end(&self) -> f32 {
        self.knots.last().map_or(0.0, |k| k.at)
    }

    pub(super) fn at(&self, place: f32) -> [f32; N] {
        let next = self.knots.partition_point(|k| k.at <= place);
        match (next.checked_sub(1).map(|i| &self.knots[i]), self.knots.get(next)) {
            (Some(a), Some(b)) => between(a, b, place),
            (Some(k), None) | (None, Some(k)) => k.values,
            (None, None) => [0.0; N],
        }
    }
}

fn secants<const N: usize>(a: &Knot<N>, b: &Knot<N>) -> [f32; N] {
    std::array::from_fn(|c| (b.values[c] - a.values[c]) / (b.at - a.at))
}

/// Returns the harmonic mean of the slopes on both sides, or 0 if they have opposite signs.
fn slope(before: Option<f32>, after: Option<f32>) -> f32 {
    match (before, after) {
        (Some(a), Some(b)) if a * b > 0.0 => 2.0 * a * b / (a + b),
        (Some(_), Some(_)) | (None, None) => 0.0,
        (Some(end), None) | (None, Some(end)) => end,
    }
}

fn between<const N: usize>(a: &Knot<N>, b: &Knot<N>, place: f32) -> [f32; N] {
    let width = b.at - a.at;
    let t = (place - a.at) / width;
    let u = 1.0 - t;
    std::array::from_fn(|c| {
        let values = u * u * (1.0 + 2.0 * t) * a.values[c] + t * t * (1.0 + 2.0 * u) * b.values[c];
        values + width * t * u * (u * a.slopes[c] - t * b.slopes[c])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_track_meets_its_places_and_never_overshoots() {
        // Aim: interpolation keeps the heights of tips and saddles. Method: every value lies between those of its
        // neighbouring points.
        let places = [(0.0, [1.0, 5.0]), (1.0, [3.0, 5.0]), (1.5, [2.0, 4.0]), (4.0, [2.5, -3.0])];
        let track = MonotoneSpline::new(places.into_iter().rev());
        for (at, values) in places {
            assert_eq!(track.at(at), values);
        }
        for pair in places.windows(2) {
            let ((start, a), (end, b)) = (pair[0], pair[1]);
            for step in 0..=50 {
                let values = track.at(start + (end - start) * step as f32 / 50.0);
                for c in 0..2 {
                    let (low, high) = (f32::min(a[c], b[c]), f32::max(a[c], b[c]));
                    assert!(low - 1e-5 <= values[c] && values[c] <= high + 1e-5, "{values:?}");
                }
            }
        }
        assert_eq!((track.at(-1.0), track.at(9.0)), ([1.0, 5.0], [2.5, -3.0]));
    }
}
