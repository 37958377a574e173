//! How much noise a traced frame would have, by what is known of its light.

use super::Lookup;
use super::lookup::{steps_per_radiance, stratified_variance};
use crate::inference::{Inference, Questions};
use std::sync::atomic::{AtomicU64, Ordering};

/// Units of the sums in a squared display step: whole numbers, whose sum is the same in any order.
const UNITS: f64 = (1u64 << 20) as f64;
/// What a point counts for at most, squared display steps: more than black and white are apart.
const MOST: f64 = 1e5;

/// Answers as its lookup does, and sums the noise that tracing would have had at these points.
pub struct NoiseMeter<'a> {
    lookup: Lookup<'a>,
    variance: AtomicU64,
    points: AtomicU64,
}

impl<'a> NoiseMeter<'a> {
    /// One that knows what `lookup` knows.
    pub fn new(lookup: Lookup<'a>) -> Self {
        Self { lookup, variance: AtomicU64::new(0), points: AtomicU64::new(0) }
    }

    /// Root mean square of the noise at the points asked about so far that light could reach, display
    /// steps of 1/255; `None` where there was none. Noise of points that nothing is known of does not
    /// count.
    pub fn rms(&self) -> Option<f64> {
        let points = self.points.load(Ordering::Relaxed);
        let variance = self.variance.load(Ordering::Relaxed) as f64 / UNITS;
        (points > 0).then(|| (variance / points as f64).sqrt())
    }

    /// Variance of what tracing would show of a point, squared display steps.
    fn variance(&self, samples: u32, unshadowed: &[f32], ratios: &[f32]) -> f64 {
        let known = || unshadowed.iter().zip(ratios).zip(self.lookup.rays);
        let known = || known().filter(|((_, ratio), _)| !ratio.is_nan());
        let seen: f32 = known().map(|((light, ratio), _)| light * ratio).sum();
        let steps = steps_per_radiance(seen);
        let of_light = |((light, ratio), rays): ((&f32, &f32), &u32)| {
            let rays = (rays * samples).max(1) as f32;
            f64::from(steps * light).powi(2) * f64::from(stratified_variance(*ratio, rays))
        };
        known().map(of_light).sum()
    }
}

impl Inference for NoiseMeter<'_> {
    fn infer(&self, questions: &mut Questions) {
        self.lookup.infer(questions);
        let Questions { points, unshadowed, ratios, .. } = questions;
        let channels = self.lookup.rays.len();
        let (mut variance, mut lit) = (0, 0);
        for (i, point) in points.iter().enumerate() {
            let own = i * channels..(i + 1) * channels;
            let light = &unshadowed[own.clone()];
            if light.iter().any(|light| *light != 0.0) {
                lit += 1;
                let of_point = self.variance(point.samples, light, &ratios[own]);
                variance += (of_point.min(MOST) * UNITS) as u64;
            }
        }
        self.variance.fetch_add(variance, Ordering::Relaxed);
        self.points.fetch_add(lit, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::{Origin, SurfacePoint, TracedPoint, TracedPoints};
    use crate::math::{DVec3, Vec3};
    use crate::reuse::{Evidence, Reference};
    use crate::scene::{Camera, Pose};

    const EDGE: u32 = 16;

    fn camera() -> Camera {
        let (eye, up) = (DVec3::ZERO, DVec3::Y);
        let pose = Pose { eye, target: -DVec3::Z, up, roll_degrees: 0.0 };
        Camera::new(&pose, 40.0, EDGE, EDGE).expect("a camera")
    }

    /// The pixels of a wall straight ahead, traced.
    fn wall(ratio: f32) -> TracedPoints {
        let mut traced = TracedPoints::default();
        for (x, y) in (0..EDGE).flat_map(|y| (0..EDGE).map(move |x| (x, y))) {
            let dir = camera().direction(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let footprint = camera().pixel_size() as f32;
            let p = dir / -dir.z;
            let (n, geom_id, cos, direct, samples) = (Vec3::Z, 0, 1.0, true, 1);
            let point = SurfacePoint { p, n, geom_id, footprint, cos, direct, samples };
            traced.points.push(TracedPoint { x, y, point });
            traced.ratios.push(ratio);
        }
        traced
    }

    /// The noise of a wall where every other pixel would show `light`, and shows a `ratio` of it by `rays`
    /// shadow rays.
    fn noise(ratio: f32, rays: u32, light: f32) -> Option<f64> {
        let traced = wall(ratio);
        let reference = Reference::new(1, &camera(), &traced, 1);
        let (references, rays) = ([&reference], [rays]);
        let evidence = Evidence::default();
        let lookup = Lookup { frame: 2, references: &references, rays: &rays, evidence };
        let meter = NoiseMeter::new(lookup);
        for half in traced.points.chunks(100) {
            let mut asked = Questions {
                points: half.iter().map(|t| t.point).collect(),
                unshadowed: (0..half.len()).map(|k| [light, 0.0][k % 2]).collect(),
                ratios: vec![f32::NAN; half.len()],
                origins: vec![Origin::default(); half.len()],
            };
            meter.infer(&mut asked);
            assert!(light == 0.0 || asked.ratios[0] == ratio, "it answers as well");
        }
        meter.rms()
    }

    #[test]
    fn noise_is_that_of_stratified_samples_where_light_is_half_open() {
        // √(0.25 · 0.75 / 100^1.5) of a light that would show 1 and shows a quarter, where a step is
        // 1/255 of the sRGB curve: its slope at 0.25 is 1.055/2.4 · 0.25^(−7/12), for which roots stand in.
        let step = 255.0 * 1.055 / 2.4 * 0.25f64.powf(-7.0 / 12.0);
        let expected = (0.25f64 * 0.75 / 1000.0).sqrt() * step;
        let got = noise(0.25, 100, 1.0).expect("lit");
        assert!((got / expected - 1.0).abs() < 0.04, "{got} of {expected}");
        // A fourth of the samples, √8 times the noise.
        let fewer = noise(0.25, 25, 1.0).expect("lit");
        assert!((fewer / got / 8f64.sqrt() - 1.0).abs() < 1e-3, "{fewer} {got}");
        // A light that is not stopped has none, and where none shines there is nothing to tell.
        assert_eq!(noise(1.0, 16, 1.0), Some(0.0));
        assert_eq!(noise(0.25, 16, 0.0), None);
    }
}
