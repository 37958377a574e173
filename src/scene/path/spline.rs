//! Piecewise cubic curves.

use super::KeyPose;
use super::level::unit;
use crate::math::DVec3;
use crate::scene::Pose;
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

/// The pose at `progress` in `[0, 1]`: eye, target, up and roll each on a Catmull–Rom spline.
///
/// `up` has length 1 at the keys and vanishes midway between keys with opposite ones.
pub fn key_pose(keys: &[KeyPose], progress: f64) -> Pose {
    let next = keys.partition_point(|k| k.at <= progress);
    if next == 0 {
        return held(&keys[0].pose);
    }
    if next == keys.len() {
        return held(&keys[next - 1].pose);
    }
    let window = Window::new(keys, next);
    let s = (progress - keys[next - 1].at) / (keys[next].at - keys[next - 1].at);
    Pose {
        eye: window.interpolate(s, |p| p.eye),
        target: window.interpolate(s, |p| p.target),
        up: window.interpolate(s, |p| unit(p.up)),
        roll_degrees: window.interpolate(s, |p| p.roll_degrees),
    }
}

fn held(pose: &Pose) -> Pose {
    Pose { up: unit(pose.up), ..*pose }
}

/// The two keys around a moment and those beside them, where there are any.
struct Window<'a> {
    before: Option<&'a KeyPose>,
    left: &'a KeyPose,
    right: &'a KeyPose,
    after: Option<&'a KeyPose>,
}

impl<'a> Window<'a> {
    /// `next` is the key after the moment, at least 1.
    fn new(keys: &'a [KeyPose], next: usize) -> Self {
        Self {
            before: next.checked_sub(2).map(|i| &keys[i]),
            left: &keys[next - 1],
            right: &keys[next],
            after: keys.get(next + 1),
        }
    }

    /// A cubic Hermite piece with Catmull–Rom slopes, at `s` in `[0, 1]` between left and right.
    ///
    /// Knots are the keys' own times: a parametrisation by chord length (centripetal, say) would
    /// move the camera past a key at another time than the file says. At a key the slope is that
    /// of the parabola through it and its neighbours (Barry and Goldman, 1988), the plain
    /// Catmull–Rom slope where times are equally spaced. At the ends a key is reflected in the
    /// end, in place and time, which leaves the end's slope that of the chord.
    fn interpolate<T>(&self, s: f64, get: impl Fn(&Pose) -> T) -> T
    where
        T: Copy + Add<Output = T> + Sub<Output = T> + Mul<f64, Output = T>,
    {
        let (p, q) = (get(&self.left.pose), get(&self.right.pose));
        let width = self.right.at - self.left.at;
        let rise = q - p;
        // Slopes times the piece's width.
        let slope_left = self.before.map_or(rise, |k| {
            let w = self.left.at - k.at;
            ((p - get(&k.pose)) * (width / w * width) + rise * w) * (1.0 / (w + width))
        });
        let slope_right = self.after.map_or(rise, |k| {
            let w = k.at - self.right.at;
            ((get(&k.pose) - q) * (width / w * width) + rise * w) * (1.0 / (w + width))
        });
        let r = 1.0 - s;
        p + rise * (s * s * (3.0 - 2.0 * s)) + slope_left * (s * r * r) - slope_right * (s * s * r)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

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

    fn key(at: f64, x: f64, roll: f64) -> KeyPose {
        let pose = Pose { eye: DVec3::X * x, target: DVec3::Z, up: DVec3::Y, roll_degrees: roll };
        KeyPose { at, pose }
    }

    #[test]
    fn keys_are_met_at_their_times_and_two_keys_make_a_line() {
        let keys =
            [key(0.0, 1.0, 0.0), key(0.1, -3.0, 5.0), key(0.7, 9.0, 0.0), key(1.0, 2.0, 1.0)];
        for k in &keys {
            assert_eq!(key_pose(&keys, k.at), k.pose);
        }
        let line = [key(0.0, 1.0, 0.0), key(1.0, 5.0, 90.0)];
        let middle = key_pose(&line, 0.25);
        assert_eq!((middle.eye.x, middle.roll_degrees), (2.0, 22.5));
        assert_eq!(middle.up, DVec3::Y);
        let held = [key(0.25, 1.0, 0.0), key(0.5, 5.0, 90.0)];
        assert_eq!(key_pose(&held, 0.1), held[0].pose);
        assert_eq!(key_pose(&held, 0.9), held[1].pose);
        assert_eq!(key_pose(&held[..1], 0.3), held[0].pose);
    }

    #[test]
    fn uneven_key_times_reproduce_a_parabola_inside() {
        // Slopes are those of parabolas: away from the ends quadratic motion is exact.
        let times = [0.0, 0.1, 0.35, 0.4, 0.8, 1.0];
        let keys: Vec<KeyPose> = times.iter().map(|t| key(*t, t * t - 3.0 * t, *t)).collect();
        for i in 0..=70 {
            let t = 0.1 + 0.01 * f64::from(i);
            let found = key_pose(&keys, t);
            assert!((found.eye.x - (t * t - 3.0 * t)).abs() < 1e-14);
            assert!((found.roll_degrees - t).abs() < 1e-14);
        }
    }

    proptest! {
        #[test]
        fn key_paths_are_smooth(xs in prop::collection::vec(-10.0f64..10.0, 3..8)) {
            let last = (xs.len() - 1) as f64;
            let time = |i: usize| (i as f64 / last).powi(2);
            let keys: Vec<KeyPose> =
                xs.iter().enumerate().map(|(i, x)| key(time(i), *x, 0.0)).collect();
            for i in 1..xs.len() - 1 {
                let (t, h) = (time(i), 1e-8);
                let at = |t| key_pose(&keys, t).eye.x;
                let (before, after) = ((at(t) - at(t - h)) / h, (at(t + h) - at(t)) / h);
                prop_assert!((before - after).abs() < 1e-2, "{before} {after} at key {i}");
            }
        }
    }
}
