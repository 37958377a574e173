//! Piecewise cubic curves.

use crate::math::DVec3;
use std::ops::{Add, Mul, Sub};

/// The eye at `progress` in `[0, 1]` of a uniform cubic B-spline (de Boor, 1972).
///
/// The plain curve of n points has n − 3 pieces and starts inside, near the second point. Here
/// the end points are reflected, `P₋₁ = 2 P₀ − P₁`, which makes n − 1 pieces that start at the
/// first point and end at the last, with the speed of their neighbours and no curvature. The
/// curve stays in the convex hull of the given points: all their weights remain non-negative.
pub fn b_spline(points: &[DVec3], progress: f64) -> DVec3 {
    let last = points.len() - 1;
    if progress <= 0.0 || progress >= 1.0 {
        return if progress <= 0.0 { points[0] } else { points[last] };
    }
    let along = progress * last as f64;
    let piece = (along as usize).min(last - 1);
    let s = along - piece as f64;
    let before = if piece == 0 { points[0] * 2.0 - points[1] } else { points[piece - 1] };
    let after = match points.get(piece + 2) {
        Some(p) => *p,
        None => points[last] * 2.0 - points[last - 1],
    };
    let [a, _, c, d] = b_spline_weights(s);
    // Relative to one point, so that equal points give that point exactly.
    let p = points[piece];
    p + (before - p) * a + (points[piece + 1] - p) * c + (after - p) * d
}

/// Weights of four successive control points at `s` in `[0, 1]` of their piece; they sum to 1.
fn b_spline_weights(s: f64) -> [f64; 4] {
    let (s2, r) = (s * s, 1.0 - s);
    [
        r * r * r / 6.0,
        (4.0 - 6.0 * s2 + 3.0 * s2 * s) / 6.0,
        (1.0 + 3.0 * s + 3.0 * s2 - 3.0 * s2 * s) / 6.0,
        s2 * s / 6.0,
    ]
}

/// Something that has a moment.
pub trait Timed {
    /// When, in `[0, 1]`; strictly increasing from key to key.
    fn at(&self) -> f64;
}

/// What `get` gives of `keys` (one or more), at `progress` in `[0, 1]`: a Catmull–Rom spline (Catmull and Rom,
/// 1974) through each key at its time, at rest before the first and after the last.
///
/// Knots are the keys' own times: a parametrisation by chord length (centripetal, say) would
/// move the camera past a key at another time than the file says. At a key the slope is that
/// of the parabola through it and its neighbours (Barry and Goldman, 1988), the plain
/// Catmull–Rom slope where times are equally spaced. At the ends a key is reflected in the
/// end, in place and time, which leaves the end's slope that of the chord.
pub fn catmull_rom<K: Timed, T>(keys: &[K], progress: f64, get: impl Fn(&K) -> T) -> T
where
    T: Copy + Add<Output = T> + Sub<Output = T> + Mul<f64, Output = T>,
{
    let [left, right] = around(keys, progress);
    if left == right {
        return get(&keys[left]);
    }
    let at = |i: usize| keys[i].at();
    let s = (progress - at(left)) / (at(right) - at(left));
    let (p, q) = (get(&keys[left]), get(&keys[right]));
    let width = at(right) - at(left);
    let rise = q - p;
    // Slopes times the piece's width.
    let slope_left = left.checked_sub(1).map_or(rise, |before| {
        let w = at(left) - at(before);
        ((p - get(&keys[before])) * (width / w * width) + rise * w) * (1.0 / (w + width))
    });
    let slope_right = keys.get(right + 1).map_or(rise, |after| {
        let w = after.at() - at(right);
        ((get(after) - q) * (width / w * width) + rise * w) * (1.0 / (w + width))
    });
    let r = 1.0 - s;
    p + rise * (s * s * (3.0 - 2.0 * s)) + slope_left * (s * r * r) - slope_right * (s * s * r)
}

/// The numbers of the keys at or before `progress` and after it; before the first and from the last on, that key twice.
pub fn around<K: Timed>(keys: &[K], progress: f64) -> [usize; 2] {
    let next = keys.partition_point(|key| key.at() <= progress);
    [next.saturating_sub(1), next.min(keys.len() - 1)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn b_spline_weights_sum_to_one_and_are_the_known_ones_at_knots() {
        for i in 0..=1000 {
            let w = b_spline_weights(f64::from(i) / 1000.0);
            assert!((w.iter().sum::<f64>() - 1.0).abs() < 4e-16 && w.iter().all(|w| *w >= 0.0));
        }
        assert_eq!(b_spline_weights(0.0), [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0, 0.0]);
        assert_eq!(b_spline_weights(1.0), [0.0, 1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0]);
    }

    /// The weight that each of `n` control points has at `progress`, ends reflected.
    fn weights(n: usize, progress: f64) -> Vec<f64> {
        let mut points = vec![DVec3::ZERO; n];
        let mut weight = |i: usize| {
            points.fill(DVec3::ZERO);
            points[i] = DVec3::X;
            b_spline(&points, progress).x
        };
        (0..n).map(&mut weight).collect()
    }

    #[test]
    fn the_curve_is_a_convex_combination_of_its_points_ends_included() {
        for n in [4, 5, 9] {
            for i in 0..=600 {
                let w = weights(n, f64::from(i) / 600.0);
                assert!((w.iter().sum::<f64>() - 1.0).abs() < 1e-15);
                assert!(w.iter().all(|w| *w >= -1e-16), "{w:?}");
            }
        }
    }

    fn wild() -> Vec<DVec3> {
        let p = DVec3::new;
        vec![
            p(0., 0., 0.),
            p(3., 1., 0.),
            p(2., -4., 5.),
            p(2., 2., 2.),
            p(-7., 0., 1.),
            p(0., 9., 0.),
        ]
    }

    #[test]
    fn the_curve_is_twice_continuously_differentiable_across_knots() {
        let points = wild();
        let pieces = (points.len() - 1) as f64;
        let h = 1e-4;
        let at = |x: f64| b_spline(&points, x / pieces);
        for knot in 1..points.len() - 1 {
            let x = knot as f64;
            // One-sided differences of a cubic: errors of third order are h times the jerk.
            let first = |d: f64| (at(x + d) - at(x)) / d;
            let second = |d: f64| (at(x + 2.0 * d) - at(x + d) * 2.0 + at(x)) / (d * d);
            assert!((first(h) - first(-h)).length() < 50.0 * h);
            assert!((second(h) - second(-h)).length() < 200.0 * h, "knot {knot}");
            assert!((at(x + 1e-12) - at(x - 1e-12)).length() < 1e-10);
        }
    }

    #[test]
    fn the_curve_starts_and_ends_at_its_points_along_their_legs() {
        let points = wild();
        let last = points.len() - 1;
        assert!((b_spline(&points, 0.0) - points[0]).length() < 1e-15);
        assert_eq!(b_spline(&points, 1.0), points[last]);
        let h = 1e-7;
        let start = (b_spline(&points, h) - points[0]) / (h * last as f64);
        assert!((start - (points[1] - points[0])).length() < 1e-5);
        let end = (points[last] - b_spline(&points, 1.0 - h)) / (h * last as f64);
        assert!((end - (points[last] - points[last - 1])).length() < 1e-5);
    }

    #[test]
    fn equally_spaced_points_on_a_line_give_constant_speed() {
        let points: Vec<DVec3> = (0..5).map(|i| DVec3::X * f64::from(i)).collect();
        for i in 0..=100 {
            let t = f64::from(i) / 100.0;
            assert!((b_spline(&points, t).x - 4.0 * t).abs() < 1e-14);
        }
    }
}
