//! What fog takes from light on its way, and what it scatters towards the camera.
//!
//! Extinction is one number for all colours, so that one ratio of a light stands for all of them under reuse too: the
//! shadow rays of a point count by what fog lets through of each, and the irradiance of a light without shadows is
//! that of clear air times the mean that fog lets through (`Fog::mean_transmittance`). Where nothing blocks a
//! light there is no noise. A sky's rays go very different ways, so that the mean of a few would be off: what fog lets
//! through of them is part of their ratio. What fog scatters (`in_scattering.rs`) depends on the view and is traced in every frame.

mod distance;
mod light_tree;
pub(super) mod phase;

pub(super) use distance::Distances;
pub(super) use light_tree::{FarLight, LightTree};

use super::Renderer;
use super::light::{LightSample, LightView, SampleSink, ShadowTarget};
use super::point::{SamplePlace, ShadingPoint};
use super::source::LightSource;
use crate::intersect::{Hit, Ray};
use crate::math::{DVec3, Rgb};
use crate::scene::Fog;

/// Rows and columns of the points of a light by which it is dimmed.
const GRID: usize = 4;

impl Fog {
    /// The part `(from, to)` of the ray from `org` along the unit direction `dir` that lies in fog, of the stretch up
    /// to `length`; `None` where none does.
    pub(super) fn span(&self, org: DVec3, dir: DVec3, length: f64) -> Option<(f64, f64)> {
        let span = match &self.bounds {
            None => Some((0.0, length)),
            Some(bounds) => bounds.clip(org, dir.recip(), 0.0, length),
        };
        span.filter(|(from, to)| from < to)
    }

    /// The part of light that is left after `distance` in fog (Bouguer, 1729).
    pub(super) fn after(&self, distance: f64) -> f64 {
        libm::exp(-self.extinction * distance)
    }

    /// The part of light that is left after the way from `org` along the unit direction `dir`.
    fn along(&self, org: DVec3, dir: DVec3, length: f64) -> f64 {
        self.span(org, dir, length).map_or(1.0, |(from, to)| self.after(to - from))
    }

    /// The part of light that arrives along a shadow ray. More than 0 where it has an end.
    pub(super) fn transmittance(&self, ray: &Ray) -> f64 {
        let length = ray.dir.length();
        // The end keeps clear of the light by some rounding errors.
        let end = if ray.tfar <= 1.0 { 1.0 } else { ray.tfar };
        let left = self.along(ray.org, ray.dir / length, end * length);
        if end.is_finite() { left.max(f64::MIN_POSITIVE) } else { left }
    }

    /// The part of a light's irradiance without shadows at `p` with unit normal `n` that fog lets through: a mean over a
    /// grid of its samples, so that it has no noise.
    fn mean_transmittance(&self, view: &LightView, (p, n): (DVec3, DVec3), grid: usize) -> f64 {
        let mut mean = Mean { fog: self, p, n, left: 0.0, all: 0.0 };
        let at = |k: usize| (k as f32 + 0.5) / grid as f32;
        let u: [_; GRID * GRID] = std::array::from_fn(|k| [at(k % grid), at(k / grid)]);
        view.sample_li(p, &u[..grid * grid], &mut mean);
        if mean.all > 0.0 {
            return mean.left / mean.all;
        }
        // A sliver above the horizon.
        view.above(p, n).map_or(1.0, |target| self.towards(p, &target, DVec3::ZERO))
    }

    /// The part of light that arrives at `p` from `target`, in the direction `wi` if that has no end.
    fn towards(&self, p: DVec3, target: &ShadowTarget, wi: DVec3) -> f64 {
        match target {
            ShadowTarget::Point(end) => {
                let way = end.point - p;
                let length = way.length();
                self.along(p, way / length, length)
            }
            ShadowTarget::Direction(_) | ShadowTarget::Sky(_) => self.along(p, wi, f64::INFINITY),
        }
    }
}

/// A stretch of a path in fog.
pub(super) struct FogSegment {
    /// Where it begins, scene space.
    pub start: DVec3,
    /// Unit direction away from the camera.
    pub dir: DVec3,
    /// Scene units; infinite where nothing ends it.
    pub length: f64,
    /// Radiance that reaches the camera per unit that leaves its start towards the camera.
    pub throughput: Rgb,
    pub place: SamplePlace,
}

/// Buffers of the samples along one stretch.
#[derive(Default)]
pub(super) struct FogSamples {
    pub distances: Vec<[f32; 2]>,
    pub places: Vec<[f32; 2]>,
    pub choices: Vec<[f32; 2]>,
    pub balls: Vec<light_tree::SeenBall>,
}

impl FogSegment {
    /// Scene space.
    pub fn at(&self, distance: f64) -> DVec3 {
        self.start + self.dir * distance
    }
}

/// Sums of what samples of a light weigh, with and without fog.
struct Mean<'f> {
    fog: &'f Fog,
    p: DVec3,
    n: DVec3,
    left: f64,
    all: f64,
}

impl SampleSink for Mean<'_> {
    fn push(&mut self, sample: LightSample) {
        let weight = sample.pdf.weight(self.n);
        if weight > 0.0 {
            self.all += weight;
            self.left += weight * self.fog.towards(self.p, &sample.target, sample.wi);
        }
    }
}

/// Sends a ray through `fog`, which takes from `throughput`: notes where light may be scattered to it.
pub(super) fn enter(
    fog: &Fog,
    (ray, hit): (&Ray, Option<&Hit>),
    throughput: &mut Rgb,
    place: SamplePlace,
    segments: &mut Vec<FogSegment>,
) {
    if !ray.is_valid() {
        return;
    }
    let length = ray.dir.length();
    let dir = ray.dir / length;
    let end = hit.map_or(f64::INFINITY, |hit| hit.t * length);
    let Some((from, to)) = fog.span(ray.org, dir, end) else { return };
    let start = ray.org + dir * from;
    segments.push(FogSegment { start, dir, length: to - from, throughput: *throughput, place });
    *throughput *= fog.after(to - from) as f32;
}

impl Renderer<'_> {
    /// The fog, if there is any.
    pub(super) fn fog(&self) -> Option<&Fog> {
        self.scene.fog.as_ref().filter(|_| self.plan.fog)
    }
}

/// The part of the irradiance of `source`, which is no sky, at `point` that `fog` lets through where nothing is in the way.
pub(super) fn dimmed(fog: &Fog, source: &LightSource, point: &ShadingPoint) -> f64 {
    let grid = if source.is_sampled() { GRID } else { 1 };
    let (p, n) = (point.si.p, point.n);
    let view = source.sampler.seen_from(p, n);
    view.map_or(1.0, |view| fog.mean_transmittance(&view, (p, n), grid))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Bounds3, Rgb};

    #[test]
    fn light_is_lost_within_the_box_only() {
        let bounds = Some(Bounds3 { min: DVec3::ZERO, max: DVec3::new(1.0, 2.0, 4.0) });
        let fog = Fog { extinction: 0.7, albedo: Rgb::ONE, anisotropy: 0.0, bounds };
        let middle = DVec3::new(0.5, 1.0, 2.0);
        assert_eq!(fog.span(middle, DVec3::Z, f64::INFINITY), Some((0.0, 2.0)));
        assert_eq!(fog.span(middle - DVec3::Z * 5.0, DVec3::Z, 4.0), Some((3.0, 4.0)));
        assert_eq!(fog.span(middle - DVec3::Z * 5.0, DVec3::Z, 3.0), None);
        assert_eq!(fog.span(middle + DVec3::X, DVec3::Z, f64::INFINITY), None);
        let ray = Ray { tfar: 0.999_999, ..Ray::new(middle, DVec3::Y * 3.0) };
        assert!((fog.transmittance(&ray) - libm::exp(-0.7)).abs() < 1e-15);
        let everywhere = Fog { bounds: None, ..fog };
        assert_eq!(everywhere.transmittance(&Ray::new(middle, DVec3::Y)), 0.0);
        assert!((everywhere.transmittance(&ray) - libm::exp(-2.1)).abs() < 1e-15);
    }
}
