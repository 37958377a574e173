//! A disk light.

use super::flat::Flat;
use super::{LightSample, ShadowTarget};
use crate::intersect::PlaneError;
use crate::math::{DVec3, orthonormal_basis};
use crate::sampling::concentric_disk;
use crate::scene::DiskLight;
use std::f64::consts::{PI, TAU};

/// A flat disk.
pub(super) struct Disk {
    centre: DVec3,
    radius: f64,
    plane: Flat,
    /// Unit vectors that span the disk.
    basis: (DVec3, DVec3),
    two_sided: bool,
}

impl Disk {
    pub fn new(light: &DiskLight) -> Self {
        let basis = orthonormal_basis(light.normal);
        // As long as the longest of the triangles that show it, and as narrow as the narrowest.
        let (s, t) = (basis.0 * light.radius, basis.1 * light.radius);
        let plane_error =
            PlaneError::of(&[light.centre - s, light.centre + s, light.centre + t * 0.024]);
        let area = PI * light.radius * light.radius;
        Self {
            centre: light.centre,
            radius: light.radius,
            plane: Flat { normal: light.normal, plane_error, area },
            basis,
            two_sided: light.two_sided,
        }
    }

    /// Whether it emits towards `p`.
    pub fn reaches(&self, p: DVec3) -> bool {
        self.two_sided || self.plane.normal.dot(p - self.centre) > 0.0
    }

    /// Irradiance at `p` with unit normal `n` from the part above the horizon, in closed form: Lambert's contour
    /// integral (Lambert, 1760; Arvo, 1994) along the circle and, where the horizon cuts it, the chord.
    pub fn unshadowed(&self, p: DVec3, n: DVec3) -> f64 {
        let to_centre = self.centre - p;
        // Negative before the emitting side.
        let normal = self.plane.normal;
        let height = to_centre.dot(normal);
        if height == 0.0 || (height > 0.0 && !self.two_sided) {
            return 0.0;
        }
        let across = to_centre - normal * height;
        // Once more: near the axis what is left is rounding, in any direction.
        let across = across - normal * across.dot(normal);
        let distance = across.length();
        let s = across.try_normalize().unwrap_or(self.basis.0);
        let circle = Circle::new(
            height,
            distance,
            self.radius,
            [s, normal.cross(s), normal].map(|v| v.dot(n)),
        );
        0.5 * circle.contour(to_centre.dot(n)).abs()
    }

    /// Uniform over the area.
    #[inline(always)] // Once for each shadow ray.
    pub fn sample_li(&self, p: DVec3, u: [f64; 2]) -> LightSample {
        let (x, y, _) = concentric_disk(u);
        let point = self.centre + (self.basis.0 * x + self.basis.1 * y) * self.radius;
        self.plane.sample_li(p, point)
    }

    pub fn pdf_li(&self, p: DVec3, point: DVec3) -> f64 {
        self.plane.pdf(p, point).per_steradian()
    }

    /// The middle of the part above the horizon, on the diameter that rises most.
    pub fn above(&self, p: DVec3, n: DVec3) -> Option<ShadowTarget> {
        let along = n - self.plane.normal * n.dot(self.plane.normal);
        let rise = along.length() * self.radius;
        let height = (self.centre - p).dot(n);
        if height + rise <= 0.0 {
            return None;
        }
        let lowest = (-height / rise).max(-1.0);
        let at = if lowest.is_finite() { 0.5 * (1.0 + lowest) } else { 0.0 };
        let point = self.centre + along.normalize_or_zero() * (self.radius * at);
        Some(self.plane.target(point))
    }
}

/// The rim of a disk as seen from a point, `r(φ) = c + R (s cos φ + t sin φ)`, where `s` points away from the
/// foot of the disk's axis, and a surface's normal `n` there.
///
/// Lambert's integrand `n·(r × dr) / |r|²` is `(a cos φ + b sin φ + c) / (d + g cos φ)`.
struct Circle {
    a: f64,
    b: f64,
    c: f64,
    d: f64,
    /// Over `d`: 0 on the axis, below 1.
    g: f64,
    /// √(1 − g²).
    root: f64,
    /// √((1 − g) / (1 + g)).
    squeeze: f64,
    /// 1 − g.
    nearest: f64,
    /// By how much the rim rises over its middle, seen along `n`: towards `s` and towards `t`.
    rise: [f64; 2],
    /// What makes `r(φ)` but for `n`: height over the disk's plane, distance from its axis, radius.
    place: [f64; 3],
    /// `n` along `s`, `t` and the disk's normal.
    n: [f64; 3],
}

impl Circle {
    fn new(height: f64, distance: f64, radius: f64, n: [f64; 3]) -> Self {
        let [ns, nt, nk] = n;
        let (inwards, outwards) = (distance - radius, distance + radius);
        let near = height * height + inwards * inwards;
        let far = height * height + outwards * outwards;
        let d = height * height + distance * distance + radius * radius;
        Self {
            a: radius * (distance * nk - height * ns),
            b: -radius * height * nt,
            c: radius * radius * nk,
            d,
            g: 2.0 * radius * distance / d,
            root: (near * far).sqrt() / d,
            squeeze: (near / far).sqrt(),
            nearest: near / d,
            rise: [radius * ns, radius * nt],
            place: [height, distance, radius],
            n,
        }
    }

    /// The contour integral over the part above the horizon; the disk's centre is `middle` above it.
    fn contour(&self, middle: f64) -> f64 {
        let [rise_s, rise_t] = self.rise;
        let most = (rise_s * rise_s + rise_t * rise_t).sqrt();
        if middle <= -most || self.root == 0.0 {
            return 0.0;
        }
        if middle >= most {
            return self.whole();
        }
        let (top, half) = (libm::atan2(rise_t, rise_s), libm::acos(-middle / most));
        let (first, last) = (top - half, top + half);
        self.arc(first, last) + self.chord(last, first)
    }

    /// The integral over the whole circle, without differences of almost equal numbers.
    fn whole(&self) -> f64 {
        let Self { a, c, d, g, root, .. } = self;
        TAU / (d * root) * (c - a * g / (1.0 + root))
    }

    /// The integral from the angle `first` to `last`, both within 2π of 0.
    fn arc(&self, first: f64, last: f64) -> f64 {
        let Self { a, b, c, d, g, root, squeeze, nearest, .. } = self;
        let [(sin0, cos0), (sin1, cos1)] = [first, last].map(|x| (libm::sin(x), libm::cos(x)));
        let half = |x: f64| libm::atan2(squeeze * libm::sin(0.5 * x), libm::cos(0.5 * x));
        // Of 1 / (1 + g cos φ).
        let one = 2.0 / root * (half(last) - half(first));
        if *g <= 1e-4 {
            // Near the axis: of cos φ over it as a series, and of sin φ.
            let cos = |x: f64, sin: f64, cos: f64| {
                sin - g * 0.5 * (x + sin * cos) + g * g * sin * (1.0 - sin * sin / 3.0)
            };
            let cos = cos(last, sin1, cos1) - cos(first, sin0, cos0);
            let step = (cos1 - cos0) / (1.0 + g * cos0);
            let slope = if g * step == 0.0 { 1.0 } else { libm::log1p(g * step) / (g * step) };
            return (a * cos - b * step * slope + c * one) / d;
        }
        // 1 + g cos φ, at the rim too, where g is 1 as far as f64 can tell.
        let [from, to] = [first, last].map(|x| {
            let cos = libm::cos(0.5 * x);
            nearest + 2.0 * g * cos * cos
        });
        // c − a/g, of which both terms are almost equal there.
        let [height, distance, radius] = self.place;
        let [ns, _, nk] = self.n;
        let level = (radius - distance) * (radius + distance) - height * height;
        let rest = 0.5 * (nk * level + height * ns * d / distance);
        (a / g * (last - first) + rest * one - b / g * libm::log(to / from)) / d
    }

    /// The straight edge between two points of the rim: its angle times the cosine between `n` and the normal of
    /// its plane with the point.
    fn chord(&self, from: f64, to: f64) -> f64 {
        let [height, distance, radius] = self.place;
        let at =
            |x: f64| DVec3::new(distance + radius * libm::cos(x), radius * libm::sin(x), height);
        let (from, to) = (at(from), at(to));
        let across = from.cross(to);
        let sin = across.length();
        if sin == 0.0 {
            return 0.0;
        }
        libm::atan2(sin, from.dot(to)) * across.dot(DVec3::from(self.n)) / sin
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rgb;
    use std::f64::consts::PI;

    fn disk(centre: DVec3, normal: DVec3, radius: f64) -> Disk {
        let (radiance, two_sided) = (Rgb::ONE, true);
        Disk::new(&DiskLight { centre, normal, radius, radiance, two_sided })
    }

    /// The mean over the disk of what its points send, by as many points in even rings.
    fn by_quadrature(disk: &Disk, n: DVec3, points: u32) -> f64 {
        let golden = PI * (3.0 - 5f64.sqrt());
        let sent = (0..points).map(|i| {
            let r = ((f64::from(i) + 0.5) / f64::from(points)).sqrt() * disk.radius;
            let angle = golden * f64::from(i);
            let (s, t) = disk.basis;
            let to = disk.centre + (s * angle.cos() + t * angle.sin()) * r;
            let d2 = to.length_squared();
            to.dot(n).max(0.0) * to.dot(disk.plane.normal).abs() / (d2 * d2)
        });
        PI * disk.radius * disk.radius * sent.sum::<f64>() / f64::from(points)
    }

    /// Random numbers from -1 to 1.
    fn random(mut seed: u64) -> impl FnMut() -> f64 {
        move || {
            seed = crate::sampling::mix(seed);
            (seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
    }

    #[test]
    fn irradiance_on_the_axis_is_the_textbook_one() {
        for (height, radius) in [(1.0, 1.0), (3.0, 0.5), (0.01, 2.0), (1e6, 1.0)] {
            let disk = disk(DVec3::Z * height, DVec3::NEG_Z, radius);
            let expected = PI * radius * radius / (radius * radius + height * height);
            let got = disk.unshadowed(DVec3::ZERO, DVec3::Z);
            assert!((got - expected).abs() < 1e-14 * expected, "{got} against {expected}");
        }
    }

    #[test]
    fn irradiance_matches_quadrature_from_anywhere() {
        let mut next = random(7);
        let mut cut = 0;
        for case in 0..300 {
            let far = [0.3, 1.0, 4.0][case % 3];
            let mut centre = DVec3::new(next(), next(), next()) * far + DVec3::Z;
            let normal = DVec3::new(next(), next(), next()).normalize();
            if case % 4 == 0 {
                // On the axis, or as good as that.
                centre = normal * far * 1.3 + DVec3::X * (1e-9 * (case % 8) as f64);
            }
            let n = DVec3::new(next(), next(), next()).normalize();
            let disk = disk(centre, normal, 0.7);
            if centre.dot(normal).abs() < 0.1 {
                continue; // Too close to its plane for the quadrature.
            }
            let tangent = (n - normal * n.dot(normal)).length() * 0.7;
            cut += usize::from(centre.dot(n).abs() < tangent);
            let expected = by_quadrature(&disk, n, 200_000);
            let got = disk.unshadowed(DVec3::ZERO, n);
            assert!(
                (got - expected).abs() < 2e-4 + 2e-3 * expected,
                "{case}: {got} against {expected}"
            );
        }
        assert!(cut > 30, "the horizon cuts {cut}");
    }

    #[test]
    fn irradiance_is_smooth_where_formulas_meet() {
        // Across g = 1e-4, from the axis outwards, the horizon cutting the disk.
        let n = DVec3::new(0.9, 0.3, 0.1).normalize();
        let at =
            |x: f64| disk(DVec3::new(x, 0.0, 1.0), DVec3::NEG_Z, 1.0).unshadowed(DVec3::ZERO, n);
        let (below, above) = (at(0.999e-4), at(1.001e-4));
        assert!((below - above).abs() < 1e-6, "{below} {above}");
        let axis = at(0.0);
        assert!((axis - at(1e-12)).abs() < 1e-10 && (axis - below).abs() < 1e-3);
    }

    #[test]
    fn irradiance_is_finite_and_smooth_at_the_rim() {
        let mut next = random(11);
        for _ in 0..2000 {
            let n = DVec3::new(next(), next(), next()).normalize();
            let off = DVec3::new(next(), 0.0, -next().abs() - 0.01);
            let at = |scale: f64| {
                disk(DVec3::NEG_X * 0.5 - off * scale, DVec3::NEG_Z, 0.5).unshadowed(DVec3::ZERO, n)
            };
            // The closer, the more alike: the rim is a straight edge then.
            let values = [1e-6, 1e-7, 1e-8, 1e-9, 1e-10].map(at);
            for value in values {
                assert!((value - values[0]).abs() < 2e-5, "{n} {off}: {values:?}");
            }
            // Closer, f64 cannot tell how far it is.
            let closer = [1e-12, 1e-14, 1e-17].map(at);
            assert!(closer.iter().all(|value| (0.0..=PI).contains(value)), "{n} {off}: {closer:?}");
        }
        for tiny in [1e-100, 1e-160, 1e-200] {
            let disk = disk(DVec3::new(-0.5, 0.0, tiny), DVec3::NEG_Z, 0.5);
            assert!(disk.unshadowed(DVec3::ZERO, DVec3::new(0.6, 0.0, 0.8)).is_finite());
        }
    }

    #[test]
    fn a_disk_shines_from_its_front_and_where_asked_from_its_back() {
        let light = |two_sided| {
            let (centre, normal, radius) = (DVec3::Z, DVec3::Z, 0.5);
            Disk::new(&DiskLight { centre, normal, radius, radiance: Rgb::ONE, two_sided })
        };
        assert_eq!(light(false).unshadowed(DVec3::ZERO, DVec3::Z), 0.0);
        let back = light(true).unshadowed(DVec3::ZERO, DVec3::Z);
        assert_eq!(light(false).unshadowed(DVec3::Z * 2.0, DVec3::NEG_Z), back);
        // In its own plane nothing arrives.
        assert_eq!(light(true).unshadowed(DVec3::new(2.0, 0.0, 1.0), DVec3::NEG_X), 0.0);
    }

    #[test]
    fn slivers_above_the_horizon_have_a_point() {
        let disk = disk(DVec3::new(2.0, 0.0, -0.99), DVec3::NEG_X, 1.0);
        let target = disk.above(DVec3::ZERO, DVec3::Z).expect("a sliver is above");
        let ShadowTarget::Point(target) = target else { panic!("a point") };
        assert!(target.point.z > 0.0 && target.point.z < 0.01);
        assert!(disk.above(DVec3::ZERO, DVec3::NEG_Y).is_some());
        assert!(disk.above(DVec3::Z * 0.1, DVec3::Z).is_none());
    }
}
