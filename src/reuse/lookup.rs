//! Reprojection with evidence: what a surface point's ratios are, as far as references tell.
//!
//! A point is projected into each reference. Of the four samples around it those count that lie on
//! the same surface: same mesh, compatible normal, within the pixel's footprint on the surface, and
//! sampled no more coarsely than the point itself. Their weights are renormalised; in each channel
//! they must carry enough weight together and agree as well as their sampling noise allows.

use super::index::{edge_of, level_of};
use super::reference::{NONE, Reference, Sample};
use crate::inference::{Inference, Origin, Questions, SurfacePoint};
use crate::math::{DVec3, Vec3};

/// Samples that one point's answer is made of, at most.
const MOST_TAPS: usize = 24;

/// What counts as evidence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evidence {
    /// Least sum of weights, of 1 that a whole reference gives.
    pub least_weight: f64,
    /// With this sum of weights no further reference is asked.
    pub enough_weight: f64,
    /// Least cosine between normals; samples count by the square of what is above it.
    pub least_cos: f32,
    /// Height above the tangent plane, footprints.
    pub height: f64,
    /// Further height, of the distance along the plane.
    pub slope: f64,
    /// By how much a sample's area on the surface may exceed the point's.
    pub coarser: f64,
    /// Samples lie within two footprints, and further where the reference looks along the surface: as
    /// far as at this cosine.
    pub grazing: f64,
    /// Deviation of samples that is always allowed, display steps of 1/255.
    pub tolerance: f32,
    /// Variance allowed on top, in that of independent shadow samples.
    pub noise: f32,
    /// How far the samples' weighted mean may lie from the point, footprints: beside it they tell
    /// about another place, however well they agree.
    pub offset: f32,
    /// A light that makes as many display steps may lie an `offset` further off; dimmer ones more.
    pub offset_steps: f32,
    /// Where tracing's noise (standard deviation of a ratio) times this exceeds 1, by so much
    /// further.
    pub offset_noise: f32,
    /// The same as `offset` where all samples see the whole light, or none of it.
    pub offset_saturated: f32,
}

impl Default for Evidence {
    fn default() -> Self {
        Self {
            least_weight: 0.1,
            enough_weight: 0.6,
            least_cos: 0.8,
            height: 0.7,
            slope: 0.35,
            coarser: 6.0,
            grazing: 0.3,
            tolerance: 1.0,
            noise: 2.0,
            offset: 1.0,
            offset_steps: 30.0,
            offset_noise: 14.0,
            offset_saturated: 4.0,
        }
    }
}

/// Answers from reference frames, asked in their order.
pub struct Lookup<'a> {
    /// The frame that is inferred.
    pub frame: u32,
    /// The first two are asked always, the others where those do not tell enough.
    pub references: &'a [&'a Reference],
    /// Shadow rays of one camera sample, by channel.
    pub rays: &'a [u32],
    /// What counts.
    pub evidence: Evidence,
}

/// A sample that lies on the point's surface.
#[derive(Clone, Copy)]
struct Tap {
    reference: u32,
    sample: u32,
    weight: f32,
    /// From the point to the sample, footprints.
    apart: Vec3,
}

#[derive(Clone, Copy)]
struct Taps {
    list: [Tap; MOST_TAPS],
    len: usize,
    weight: f64,
}

impl Taps {
    const NONE: Self = Self {
        list: [Tap { reference: 0, sample: 0, weight: 0.0, apart: Vec3::ZERO }; MOST_TAPS],
        len: 0,
        weight: 0.0,
    };

    fn push(&mut self, tap: Tap) {
        if self.len < MOST_TAPS && tap.weight > 0.0 {
            self.list[self.len] = tap;
            self.len += 1;
            self.weight += f64::from(tap.weight);
        }
    }

    fn iter(&self) -> impl Iterator<Item = &Tap> {
        self.list[..self.len].iter()
    }
}

impl Inference for Lookup<'_> {
    fn infer(&self, questions: &mut Questions) {
        let Questions { points, unshadowed, ratios, origins } = questions;
        let channels = self.rays.len();
        let lights = unshadowed.chunks_exact(channels).zip(ratios.chunks_exact_mut(channels));
        for ((point, (shown, ratios)), origin) in points.iter().zip(lights).zip(origins) {
            if shown.iter().all(|s| *s == 0.0) {
                continue;
            }
            let taps = self.taps(point);
            if taps.weight >= self.evidence.least_weight {
                self.answer(&taps, shown, ratios);
                *origin = self.origin(&taps);
            }
        }
    }
}

impl Lookup<'_> {
    fn taps(&self, point: &SurfacePoint) -> Taps {
        let mut taps = Taps::NONE;
        for (number, reference) in self.references.iter().enumerate() {
            if number >= 2 && taps.weight >= self.evidence.enough_weight {
                break;
            }
            self.screen_taps(number as u32, reference, point, &mut taps);
        }
        if !point.direct {
            for (number, reference) in self.references.iter().enumerate() {
                if taps.weight >= self.evidence.enough_weight {
                    break;
                }
                self.index_taps(number as u32, reference, point, &mut taps);
            }
        }
        taps
    }

    /// The four samples around the point's image in the reference.
    fn screen_taps(
        &self,
        number: u32,
        reference: &Reference,
        point: &SurfacePoint,
        taps: &mut Taps,
    ) {
        let camera = &reference.camera;
        let Some((x, y, depth)) = camera.project(point.p) else { return };
        let (x, y) = (x - 0.5, y - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let (width, height) = (f64::from(camera.width), f64::from(camera.height));
        if !(left >= -1.0 && top >= -1.0 && left < width && top < height) {
            return;
        }
        let n = point.n.as_dvec3();
        let to_eye = camera.eye - point.p;
        let cos = (n.dot(to_eye) / to_eye.length()).max(0.02);
        let footprint = depth * reference.pixel_size;
        let own = f64::from(point.footprint);
        let own_area = own * own / if point.direct { f64::from(point.cos).max(0.02) } else { 1.0 };
        if footprint * footprint / cos > self.evidence.coarser * own_area {
            return;
        }
        let (fx, fy) = (x - left, y - top);
        let reach = 2.0 * footprint / cos.max(self.evidence.grazing);
        for k in 0..4 {
            let (dx, dy) = (f64::from(k & 1), f64::from(k >> 1));
            let (tx, ty) = (left + dx, top + dy);
            if tx < 0.0 || ty < 0.0 || tx >= width || ty >= height {
                continue;
            }
            let sample = reference.slots[ty as usize * camera.width as usize + tx as usize];
            if sample == NONE {
                continue;
            }
            let s = &reference.samples[sample as usize];
            let Some(apart) = self.on_surface(point, n, s, footprint, reach) else { continue };
            let wx = if dx > 0.0 { fx } else { 1.0 - fx };
            let wy = if dy > 0.0 { fy } else { 1.0 - fy };
            let apart = (apart / footprint).as_vec3();
            let alike = self.alikeness(point, s);
            let weight = (wx * wy) as f32 * alike * alike;
            taps.push(Tap { reference: number, sample, weight, apart });
        }
    }

    /// Samples near the point, by place.
    fn index_taps(
        &self,
        number: u32,
        reference: &Reference,
        point: &SurfacePoint,
        taps: &mut Taps,
    ) {
        let n = point.n.as_dvec3();
        let footprint = f64::from(point.footprint);
        let own = level_of(point.footprint);
        for level in [own, own - 1] {
            let reach = edge_of(level);
            reference.index.around(level, point.geom_id, point.p, |sample| {
                let s = &reference.samples[sample as usize];
                let Some(apart) = self.on_surface(point, n, s, footprint, reach) else { return };
                let weight = 0.5 * (1.0 - apart.length() / reach);
                let apart = (apart / footprint).as_vec3();
                taps.push(Tap { reference: number, sample, weight: weight as f32, apart });
            });
        }
    }

    /// From the point to a sample on its own surface; `None` where it is on another.
    fn on_surface(
        &self,
        point: &SurfacePoint,
        n: DVec3,
        s: &Sample,
        footprint: f64,
        reach: f64,
    ) -> Option<DVec3> {
        if s.geom_id != point.geom_id || s.n.dot(point.n) < self.evidence.least_cos {
            return None;
        }
        let apart = s.position() - point.p;
        let distance = apart.length();
        let height = apart.dot(n).abs();
        let allowed = self.evidence.height * footprint + self.evidence.slope * distance;
        (distance <= reach && height <= allowed).then_some(apart)
    }

    /// Weighted means of the ratios that agree. `shown` is what the pixel would show of each light
    /// without shadows.
    fn answer(&self, taps: &Taps, shown: &[f32], ratios: &mut [f32]) {
        let mut seen = 0.0;
        for (channel, out) in ratios.iter_mut().enumerate() {
            let (mut weight, mut sum) = (0.0, 0.0);
            for (tap, ratio) in self.known(taps, channel) {
                weight += tap.weight;
                sum += tap.weight * ratio;
            }
            if f64::from(weight) >= self.evidence.least_weight {
                *out = sum / weight;
                seen += shown[channel] * *out;
            }
        }
        let steps = steps_per_radiance(seen);
        for (channel, out) in ratios.iter_mut().enumerate().filter(|(_, out)| !out.is_nan()) {
            let allowed = self.evidence.tolerance / (steps * shown[channel]).max(1e-6);
            if !self.agrees(taps, channel, *out, allowed) {
                *out = f32::NAN;
            }
        }
    }

    /// The taps whose ratio is known.
    fn known<'t>(&'t self, taps: &'t Taps, channel: usize) -> impl Iterator<Item = (&'t Tap, f32)> {
        taps.iter().filter_map(move |tap| {
            let ratio = self.references[tap.reference as usize].ratio(tap.sample, channel);
            (!ratio.is_nan()).then_some((tap, ratio))
        })
    }

    /// Whether the taps of a channel lie no further from their `mean` than their sampling noise and
    /// an `allowed` deviation explain.
    fn agrees(&self, taps: &Taps, channel: usize, mean: f32, allowed: f32) -> bool {
        let (mut weight, mut squares, mut rays) = (0.0, 0.0, 0.0);
        let mut offset = Vec3::ZERO;
        for (tap, ratio) in self.known(taps, channel) {
            let sample = &self.references[tap.reference as usize].samples[tap.sample as usize];
            weight += tap.weight;
            squares += tap.weight * (ratio - mean) * (ratio - mean);
            rays += tap.weight * sample.samples as f32;
            offset += tap.apart * tap.weight;
        }
        let rays = rays / weight * self.rays[channel] as f32;
        let noise = self.evidence.noise * (mean * (1.0 - mean)).max(0.0) / rays;
        squares / weight <= allowed * allowed + noise
            && offset.length() / weight <= self.most_offset(mean, allowed, noise)
    }

    /// How far the samples' mean may lie from the point, footprints: the further, the less of an
    /// error there shows. `allowed` is the deviation of a ratio that makes the tolerated display
    /// steps, `noise` the variance that tracing has.
    fn most_offset(&self, mean: f32, allowed: f32, noise: f32) -> f32 {
        let Evidence { tolerance, offset, offset_steps, offset_noise, .. } = self.evidence;
        if mean == 0.0 || mean == 1.0 {
            return self.evidence.offset_saturated;
        }
        let dim = offset_steps * allowed / tolerance;
        let noisy = offset_noise * noise.sqrt();
        offset * dim.max(noisy).max(1.0)
    }

    /// 1 for a sample with the point's own normal, 0 where they are as far apart as can be.
    fn alikeness(&self, point: &SurfacePoint, s: &Sample) -> f32 {
        let least = self.evidence.least_cos;
        ((s.n.dot(point.n) - least) / (1.0 - least)).clamp(0.0, 1.0)
    }

    fn origin(&self, taps: &Taps) -> Origin {
        let mut origin = Origin::default();
        let mut most = 0.0;
        let mut distance = 0.0;
        let mut by_reference = 0.0;
        let mut last = NONE;
        for tap in taps.iter() {
            let frame = self.references[tap.reference as usize].frame;
            origin.earlier |= frame < self.frame;
            origin.later |= frame > self.frame;
            distance += tap.weight * tap.apart.length();
            by_reference =
                if last == tap.reference { by_reference + tap.weight } else { tap.weight };
            last = tap.reference;
            if by_reference > most {
                most = by_reference;
                origin.frame = frame;
            }
        }
        origin.distance = distance / taps.weight as f32;
        origin
    }
}

/// How many display steps of 1/255 a unit of radiance makes where `radiance` is shown: the slope of
/// the sRGB curve, as a power of 1/2.4.
fn steps_per_radiance(radiance: f32) -> f32 {
    let shown = f64::from(radiance).clamp(0.003, 1.0);
    // Nearly x^(-7/12), by square roots, which are the same on every machine.
    let root = shown.sqrt();
    (255.0 * 1.055 / 2.4 / (root * root.sqrt().sqrt().sqrt())) as f32
}
