//! At which distance along a ray light is scattered.
//!
//! Two strategies of equal parts, joined by the balance heuristic (Veach and Guibas, 1995): by what fog leaves of the
//! ray, and by the inverse square of the distance to a light (Kulla and Fajardo, 2012). Parallel light has the
//! first alone.

use crate::math::DVec3;

/// The least distance of a light from a ray, over the stretch to the light: the density stays finite on a ray that goes through it.
const NEAREST: f64 = 1e-6;

/// Distances along a stretch of fog.
pub struct Distances {
    extinction: f64,
    length: f64,
    near: Option<Near>,
}

/// A light near the ray.
struct Near {
    /// Distance along the ray of the point nearest to the light.
    foot: f64,
    /// Distance of that point from the light.
    apart: f64,
    /// Angles at the light from there to both ends.
    angles: [f64; 2],
}

impl Distances {
    /// Along the ray from `start` in the unit direction `dir` up to `length`, which may be infinite.
    pub fn new(extinction: f64, length: f64) -> Self {
        Self { extinction, length, near: None }
    }

    /// With a light around `centre`, relative to the ray's start, of radius `reach`.
    pub fn near(self, dir: DVec3, centre: DVec3, reach: f64) -> Self {
        let foot = centre.dot(dir);
        let apart = (centre - dir * foot).length();
        let apart = apart.max(0.5 * reach).max(NEAREST * centre.length()).max(f64::MIN_POSITIVE);
        let angles = [-foot, self.length - foot].map(|along| libm::atan(along / apart));
        let near = (angles[0] < angles[1]).then_some(Near { foot, apart, angles });
        Self { near, ..self }
    }

    /// A distance and its density, for `u` and `strategy` in 0..1.
    pub fn sample(&self, u: f64, strategy: f64) -> (f64, f64) {
        let distance = match &self.near {
            Some(near) if strategy < 0.5 => near.sample(u),
            _ => self.by_extinction(u),
        };
        let distance = distance.clamp(0.0, self.length);
        (distance, self.pdf(distance))
    }

    /// Density of [`sample`](Self::sample) at `distance`.
    pub fn pdf(&self, distance: f64) -> f64 {
        let by_extinction = self.pdf_by_extinction(distance);
        match &self.near {
            Some(near) => 0.5 * (near.pdf(distance) + by_extinction),
            None => by_extinction,
        }
    }

    fn by_extinction(&self, u: f64) -> f64 {
        let lost = -libm::expm1(-self.extinction * self.length);
        -libm::log1p(-u * lost) / self.extinction
    }

    fn pdf_by_extinction(&self, distance: f64) -> f64 {
        let lost = -libm::expm1(-self.extinction * self.length);
        self.extinction * libm::exp(-self.extinction * distance) / lost
    }

    /// Integral over the stretch of what fog leaves.
    pub fn mean_free_length(&self) -> f64 {
        -libm::expm1(-self.extinction * self.length) / self.extinction
    }

    /// Angle under which the light sees the stretch, over its distance from the ray: the integral of the inverse square
    /// of the distance to it. 0 of parallel light.
    pub fn angle_over_distance(&self) -> f64 {
        self.near.as_ref().map_or(0.0, |near| (near.angles[1] - near.angles[0]) / near.apart)
    }
}

impl Near {
    fn sample(&self, u: f64) -> f64 {
        let [from, to] = self.angles;
        self.foot + self.apart * libm::tan(from + (to - from) * u)
    }

    fn pdf(&self, distance: f64) -> f64 {
        let ([from, to], along) = (self.angles, distance - self.foot);
        self.apart / ((to - from) * (self.apart * self.apart + along * along))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean over samples of a function over its density is its integral.
    #[test]
    fn samples_integrate_what_lamps_scatter() {
        let apart = DVec3::new(2.0, 0.3, 0.0);
        for (length, centre) in
            [(5.0, apart), (5.0, DVec3::X * 9.0), (f64::INFINITY, apart), (1.0, -apart)]
        {
            let distances = Distances::new(0.4, length).near(DVec3::X, centre, 0.1);
            let f =
                |s: f64| libm::exp(-0.4 * s) / (DVec3::X * s).distance_squared(centre).max(1e-3);
            let n = 1000;
            let at = |k: i32| (f64::from(k) + 0.5) / f64::from(n);
            let all = (0..n).flat_map(|k| (0..n).step_by(20).map(move |m| (at(k), at(m))));
            let (mut sum, mut count) = (0.0, 0.0);
            for (u, strategy) in all {
                let (s, pdf) = distances.sample(u, strategy);
                assert!((0.0..=length).contains(&s));
                (sum, count) = (sum + f(s) / pdf, count + 1.0);
            }
            let end = if length.is_finite() { length } else { 60.0 };
            let steps = 2_000_000;
            let integral: f64 =
                (0..steps).map(|k| f(end * (f64::from(k) + 0.5) / f64::from(steps))).sum();
            let (mean, exact) = (sum / count, integral * end / f64::from(steps));
            assert!((mean / exact - 1.0).abs() < 2e-3, "{length}: {mean} for {exact}");
        }
    }
}
