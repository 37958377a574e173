//! A frame's traced surface points, found by position in the image or in the scene.
//!
//! The layout suits lookups, which mostly wait for memory: a sample with the data of the scene's first light
//! fills half a cache line; the samples that a block of pixels sees directly are stored
//! together, and so are the samples in a cell of the index.

mod contrast;
mod gather;
mod lists;

use super::evidence::ProbeFindings;
use super::index::Index;
use crate::inference::{SurfacePoint, TracedPoints};
use crate::math::{DVec3, Vec3};
use crate::scene::Camera;
use gather::Gathered;
use lists::LightLists;
use wide::f32x4;

/// Sample number that means: no sample.
pub(super) const NONE: u32 = u32::MAX;
/// Edge of a block of pixels whose samples are stored together, pixels.
const BLOCK: usize = 8;

/// A traced surface point.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(32))]
pub(super) struct Sample {
    pub p: Vec3,
    /// Normal; a component of 1 is stored as [`Sample::UNIT`].
    n: [i16; 3],
    pub geom_id: u32,
    /// The ratio and contrasts of the first light (channel 0).
    first: Known,
}

/// The ratio of one light at a sample, and how it changes around the sample.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
struct Known {
    /// Ratio of shadowed to unshadowed irradiance; NaN where unknown.
    ratio: f32,
    bend: Level,
    wide: Level,
    far: Level,
}

/// A number from 0 to 1 in a byte, with a relative error of at most a sixteenth; 255 is NaN.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Level(u8);

impl Level {
    const UNKNOWN: Self = Self(u8::MAX);
    /// Upper bits (exponent and first four bits of the mantissa) of the f32 whose byte is 0: 2⁻¹⁶.
    const ZERO: u32 = (127 - 16) << 4;

    fn of(x: f32) -> Self {
        if x.is_nan() {
            return Self::UNKNOWN;
        }
        let level = (x.max(0.0).to_bits() >> 19).saturating_sub(Self::ZERO);
        Self(level.min(254) as u8)
    }

    fn get(self) -> f32 {
        match self {
            Self(0) => 0.0,
            Self::UNKNOWN => f32::NAN,
            Self(level) => f32::from_bits((u32::from(level) + Self::ZERO) << 19),
        }
    }
}

/// Ratio and [`Contrast`] of one light at four samples.
pub(super) struct Known4 {
    pub ratio: f32x4,
    pub bend: f32x4,
    pub wide: f32x4,
    pub far: f32x4,
}

/// How a ratio changes around a sample on its surface; NaN where too few samples are known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Contrast {
    /// Largest difference between the ratio and the mean of two samples on opposite sides: 0 where the ratio
    /// changes linearly.
    pub bend: f32,
    /// Largest difference between the ratio and those of the 5 x 5 pixels around it.
    pub wide: f32,
    /// Largest `wide` among these 5 x 5 pixels: it reaches 9 x 9 pixels.
    pub far: f32,
}

impl Contrast {
    pub const UNKNOWN: Self = Self { bend: f32::NAN, wide: f32::NAN, far: f32::NAN };
}

impl Sample {
    pub const UNIT: f32 = 32767.0;

    fn of(point: &SurfacePoint, first: Known) -> Self {
        // Normals of files may be a little longer than 1.
        let n = point.n.clamp(Vec3::NEG_ONE, Vec3::ONE);
        // To the nearest, without a call of `round`.
        let n = (n * Self::UNIT + Vec3::splat(32768.5)).to_array().map(|x| x as i32 - 32768);
        Self { p: point.p.as_vec3(), n: n.map(|x| x as i16), geom_id: point.geom_id, first }
    }

    /// Normal, times [`Sample::UNIT`].
    pub fn normal(&self) -> [f32; 3] {
        let [x, y, z] = self.n;
        [f32::from(x), f32::from(y), f32::from(z)]
    }
}

impl Known {
    const NOTHING: Self =
        Self { ratio: f32::NAN, bend: Level::UNKNOWN, wide: Level::UNKNOWN, far: Level::UNKNOWN };

    fn of(ratio: f32, contrast: Contrast) -> Self {
        let [bend, wide, far] = [contrast.bend, contrast.wide, contrast.far].map(Level::of);
        Self { ratio, bend, wide, far }
    }
}

/// A camera prepared for projecting many points.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    pub eye: DVec3,
    pub forward: DVec3,
    /// Right and up of the camera, scaled so that their products with a point at depth 1 are in pixels.
    pub right: DVec3,
    pub up: DVec3,
    /// The point where the view axis meets the image, from the middle of the first pixel, pixels.
    pub middle: [f64; 2],
    /// Columns and rows.
    pub size: [i32; 2],
    /// Edge of a pixel at distance 1.
    pub pixel_size: f64,
}

impl View {
    fn of(camera: &Camera) -> Self {
        let size = [camera.width, camera.height];
        let half = size.map(|size| 0.5 * f64::from(size));
        let by_pixels = |v: DVec3, half: f64| v * (half / v.length_squared());
        Self {
            eye: camera.eye,
            forward: camera.forward,
            right: by_pixels(camera.half_right, half[0]),
            up: by_pixels(camera.half_up, half[1]),
            middle: [
                half[0] - half[0] * camera.middle[0] - 0.5,
                half[1] + half[1] * camera.middle[1] - 0.5,
            ],
            size: size.map(|size| size as i32),
            pixel_size: camera.pixel_size(),
        }
    }

    /// Number of blocks in a row of blocks.
    fn blocks_across(&self) -> usize {
        (self.size[0] as usize).div_ceil(BLOCK)
    }

    /// Index of a pixel in the order of pixels block by block.
    fn slot(&self, x: usize, y: usize) -> usize {
        let block = y / BLOCK * self.blocks_across() + x / BLOCK;
        block * (BLOCK * BLOCK) + y % BLOCK * BLOCK + x % BLOCK
    }

    /// Number of pixels in the order block by block, with incomplete blocks at the edges filled up.
    fn slots(&self) -> usize {
        (self.size[1] as usize).div_ceil(BLOCK) * self.blocks_across() * BLOCK * BLOCK
    }
}

/// A frame as a source for other frames: its camera, its traced surface points (samples) with their ratios,
/// and the findings of its probes.
#[derive(Debug, Clone)]
pub struct Reference {
    /// Number of the frame; [`Reference::SUPPLIED`] for a frame of another shot.
    pub frame: u32,
    /// The camera, scene space.
    pub(super) view: View,
    /// For each pixel, block by block, the sample that is seen there directly.
    slots: Vec<u32>,
    /// The samples of pixels in the order of `slots`, then all others cell by cell of the index.
    pub(super) samples: Vec<Sample>,
    /// For each sample the ratios and contrasts of the channels after the first.
    more: Vec<Known>,
    channels: usize,
    /// Whose ratios each sample has; empty where each channel has the same light everywhere.
    lights: LightLists,
    /// Finds samples that are not in `slots`: points seen in mirrors, through glass or beside another surface.
    pub(super) index: Index,
    /// The findings of the frame's probes.
    findings: ProbeFindings,
}

impl Reference {
    /// The reference of frame `frame`, seen by `camera` (scene space), whose `traced` points have `channels` ratios
    /// each.
    pub fn new(frame: u32, camera: &Camera, traced: &TracedPoints, channels: usize) -> Self {
        let view = View::of(camera);
        let gathered = Gathered::of(traced, channels, &view);
        let contrasts = gathered.contrasts();
        let known = |i: u32, channel: usize| {
            let at = i as usize * channels + channel;
            Known::of(gathered.ratios[at], contrasts[at])
        };
        let mut order = Vec::with_capacity(gathered.points.len());
        let mut slots = vec![NONE; view.slots()];
        for (y, row) in gathered.slots.chunks(view.size[0] as usize).enumerate() {
            for (x, own) in row.iter().enumerate() {
                slots[view.slot(x, y)] = *own;
            }
        }
        for slot in slots.iter_mut().filter(|slot| **slot != NONE) {
            order.push(*slot);
            *slot = order.len() as u32 - 1;
        }
        let (index, members) = Index::new(&gathered.points, &gathered.others, order.len() as u32);
        order.extend(members);
        let samples = order.iter().map(|i| {
            let first = if channels == 0 { Known::NOTHING } else { known(*i, 0) };
            Sample::of(&gathered.points[*i as usize], first)
        });
        let samples = samples.collect();
        let more = order.iter().flat_map(|i| (1..channels).map(|channel| known(*i, channel)));
        let more = more.collect();
        let lights = LightLists::of(&gathered.lights, &order, channels);
        Self {
            frame,
            view,
            slots,
            samples,
            more,
            channels,
            lights,
            index,
            findings: ProbeFindings::default(),
        }
    }

    /// This reference with the findings of the frame's probes.
    pub fn with_findings(self, findings: ProbeFindings) -> Self {
        Self { findings, ..self }
    }

    /// The findings of the frame's probes.
    pub fn findings(&self) -> &ProbeFindings {
        &self.findings
    }

    /// Frame number of references from another shot: they count as earlier than all frames.
    pub const SUPPLIED: u32 = 0;

    /// Position of the frame's camera, scene space.
    pub fn eye(&self) -> DVec3 {
        self.view.eye
    }

    /// View direction of the frame's camera, unit.
    pub fn forward(&self) -> DVec3 {
        self.view.forward
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// Memory that the reference takes, bytes.
    pub fn memory(&self) -> u64 {
        let samples = size_of_val(&self.samples[..]) + size_of_val(&self.more[..]);
        let findings = size_of_val(&self.findings.list[..]);
        let own = samples + size_of_val(&self.slots[..]) + findings;
        own as u64 + self.lights.memory() + self.index.memory()
    }

    /// The sample that is seen directly at a pixel; [`NONE`] where there is none, and outside the image.
    pub(super) fn seen_at(&self, x: i32, y: i32) -> u32 {
        let [width, height] = self.view.size;
        let is_inside = x >= 0 && y >= 0 && x < width && y < height;
        if is_inside { self.slots[self.view.slot(x as usize, y as usize)] } else { NONE }
    }

    /// Ratios and contrasts of four samples in a channel of a point with these `lights`, of which there are none where
    /// each channel has the same light everywhere. A sample without the light has no ratio, and no contrast.
    pub(super) fn known(&self, samples: &[u32; 4], channel: usize, lights: &[u32]) -> Known4 {
        let [mut ratio, mut bend, mut wide, mut far] = [[0.0; 4]; 4];
        for (k, sample) in samples.iter().enumerate() {
            let Some(channel) = self.lights.channel(*sample, lights, channel) else {
                ratio[k] = f32::NAN;
                continue;
            };
            let own = self.known_by(*sample, channel);
            ratio[k] = own.ratio;
            bend[k] = own.bend.get();
            wide[k] = own.wide.get();
            far[k] = own.far.get();
        }
        Known4 { ratio: ratio.into(), bend: bend.into(), wide: wide.into(), far: far.into() }
    }

    #[inline]
    fn known_by(&self, sample: u32, channel: usize) -> &Known {
        match channel {
            0 => &self.samples[sample as usize].first,
            _ => &self.more[sample as usize * (self.channels - 1) + channel - 1],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_fills_half_a_line_of_the_cache() {
        assert_eq!(size_of::<Sample>(), 32);
    }

    #[test]
    fn levels_lose_a_sixteenth_at_most() {
        assert!(Level::of(f32::NAN).get().is_nan());
        assert_eq!([0.0, 1.0, 0.5, 1e-9].map(|x| Level::of(x).get()), [0.0, 0.9375, 0.5, 0.0]);
        for k in 1..10_000 {
            let x = k as f32 / 10_000.0;
            let got = Level::of(x).get();
            assert!(got <= x && got >= x * (1.0 - 1.0 / 16.0), "{x}: {got}");
        }
    }
}
