//! How much noise a traced frame would have, by how much of each light arrives.

use super::Lookup;
use super::lookup::{steps_per_radiance, stratified_variance};
use crate::inference::{Inference, Questions};
use std::sync::atomic::{AtomicU64, Ordering};

/// Units of the sums in a squared display step: whole numbers, whose sum is the same in any order.
const UNITS: f64 = (1u64 << 20) as f64;
/// What a point counts for at most, squared display steps: half of black to white.
const MOST: f64 = 127.5 * 127.5;

/// Answers as its lookup does, and sums the noise that tracing all points would have.
pub struct NoiseMeter<'a> {
    lookup: Lookup<'a>,
    /// Camera samples of a pixel, whose shadow rays are stratified together.
    spp: u32,
    /// Of the points that the lookup knows.
    known: Sums,
    /// Of all.
    all: Sums,
}

#[derive(Default)]
struct Sums {
    variance: AtomicU64,
    samples: AtomicU64,
}

impl<'a> NoiseMeter<'a> {
    /// One that knows what `lookup` knows, of frames of `spp` camera samples a pixel.
    pub fn new(lookup: Lookup<'a>, spp: u32) -> Self {
        Self { lookup, spp, known: Sums::default(), all: Sums::default() }
    }

    /// Root mean square of the noise at the points so far that light could reach, display steps of 1/255;
    /// `None` where there was none. Each camera sample counts as if all of its pixel were like it.
    ///
    /// Where at least half of them are known, it is that of the known ones: few others, at the rims of
    /// shadows, have most of the noise, and in a small picture one of them is most of that.
    pub fn rms(&self) -> Option<f64> {
        let [(known, by_known), (all, by_all)] = [&self.known, &self.all].map(Sums::mean);
        let mean = if 2 * known >= all { by_known } else { by_all };
        (all > 0).then(|| mean.sqrt())
    }

    /// Adds up the points with a ratio for each light that could reach them.
    fn measure(&self, told: &Questions, sums: &Sums) {
        let Questions { points, unshadowed, ratios, .. } = told;
        let channels = self.lookup.rays.len();
        let (mut variance, mut count) = (0, 0);
        for (i, point) in points.iter().enumerate() {
            let own = i * channels..(i + 1) * channels;
            let (light, ratios) = (&unshadowed[own.clone()], &ratios[own]);
            let is_told = light.iter().zip(ratios).all(|(l, ratio)| *l == 0.0 || !ratio.is_nan());
            let of_point = self.variance(light, ratios);
            if light.iter().any(|light| *light != 0.0) && is_told && of_point.is_finite() {
                let samples = u64::from(point.samples);
                count += samples;
                variance += samples * (of_point.min(MOST) * UNITS) as u64;
            }
        }
        sums.variance.fetch_add(variance, Ordering::Relaxed);
        sums.samples.fetch_add(count, Ordering::Relaxed);
    }

    /// Variance of what tracing would show of a pixel of such points, squared display steps.
    fn variance(&self, unshadowed: &[f32], ratios: &[f32]) -> f64 {
        let lights = || unshadowed.iter().zip(ratios).zip(self.lookup.rays);
        let lights = || lights().filter(|((_, ratio), _)| !ratio.is_nan());
        let of_light = |((light, ratio), rays): ((&f32, &f32), &u32)| {
            let rays = (*rays as f32 * self.spp as f32).max(1.0);
            light * light * stratified_variance(*ratio, rays)
        };
        let seen: f32 = lights().map(|((light, ratio), _)| light * ratio).sum();
        let deviation = lights().map(of_light).sum::<f32>().sqrt();
        // What is brighter than the display shows no noise there.
        let [below, above] = [seen - deviation, seen + deviation].map(|v| v.clamp(0.0, 1.0));
        let shown = f64::from(0.5 * (above - below) * steps_per_radiance(seen));
        shown * shown
    }
}

impl Sums {
    /// How many camera samples, and the mean variance.
    fn mean(&self) -> (u64, f64) {
        let samples = self.samples.load(Ordering::Relaxed);
        let variance = self.variance.load(Ordering::Relaxed) as f64 / UNITS;
        (samples, variance / samples.max(1) as f64)
    }
}

impl Inference for NoiseMeter<'_> {
    fn infer(&self, questions: &mut Questions) {
        self.lookup.infer(questions);
        self.measure(questions, &self.known);
    }

    fn hear(&self, answered: &Questions) {
        self.measure(answered, &self.all);
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
    /// shadow rays. Nobody knows so many pixels `aside`: they are traced, and show another.
    fn noise_with((aside, other): (usize, f32), ratio: f32, rays: u32, light: f32) -> Option<f64> {
        let mut traced = wall(ratio);
        let reference = Reference::new(1, &camera(), &traced, 1);
        traced.points.iter_mut().take(aside).for_each(|t| t.point.p.x += 100.0);
        let (references, rays) = ([&reference], [rays]);
        let evidence = Evidence::default();
        let lookup = Lookup { frame: 2, references: &references, rays: &rays, evidence };
        let meter = NoiseMeter::new(lookup, 1);
        for (from, part) in traced.points.chunks(100).enumerate() {
            let mut asked = Questions {
                points: part.iter().map(|t| t.point).collect(),
                unshadowed: (0..part.len()).map(|k| [light, 0.0][k % 2]).collect(),
                ratios: vec![f32::NAN; part.len()],
                origins: vec![Origin::default(); part.len()],
            };
            meter.infer(&mut asked);
            let is_aside = 100 * from < aside;
            let known = if is_aside { f32::NAN } else { ratio };
            assert!(light == 0.0 || asked.ratios[0].total_cmp(&known).is_eq(), "it answers too");
            let traced = if is_aside { other } else { ratio };
            asked.ratios.iter_mut().step_by(2).for_each(|out| *out = traced);
            meter.hear(&asked);
        }
        meter.rms()
    }

    fn noise(ratio: f32, rays: u32, light: f32) -> Option<f64> {
        noise_with((0, 0.0), ratio, rays, light)
    }

    #[test]
    fn what_had_to_be_traced_counts_where_little_is_known() {
        let all = noise(0.25, 16, 1.0);
        assert_eq!(noise_with((100, 0.5), 0.25, 16, 1.0), all);
        assert_eq!(noise_with((256, 0.25), 0.25, 16, 1.0), all);
        // 28 lit points of 128 are known, and the others have none.
        let (few, all) = (noise_with((200, 1.0), 0.25, 16, 1.0), all.expect("lit"));
        let expected = all * (28.0f64 / 128.0).sqrt();
        assert!(few.is_some_and(|few| (few / expected - 1.0).abs() < 1e-3), "{few:?} {expected}");
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
        // Nor a light that is too bright for the display, of which less is enough.
        assert_eq!(noise(0.25, 16, 100.0), Some(0.0));
        assert_eq!(noise(0.25, 16, f32::INFINITY), None);
        // A light that is not stopped has none, and where none shines there is nothing to tell.
        assert_eq!(noise(1.0, 16, 1.0), Some(0.0));
        assert_eq!(noise(0.25, 16, 0.0), None);
    }
}
