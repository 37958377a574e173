//! A frame's traced surface points, found by image position or by place in the scene.

use super::index::Index;
use crate::inference::{SurfacePoint, TracedPoints};
use crate::math::{DVec3, Vec3};
use crate::scene::Camera;
use rayon::prelude::*;

/// No sample.
pub(super) const NONE: u32 = u32::MAX;
/// How far away samples lie beside one another at most, pixels.
const BESIDE: isize = 3;
/// Normals of one surface within a pixel: cosine.
const SAME_SURFACE: f32 = 0.9;

/// A traced surface point: two fill a line of the cache, and none lies across two.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(32))]
pub(super) struct Sample {
    pub p: Vec3,
    pub n: Vec3,
    pub geom_id: u32,
    /// Camera samples whose shadow rays it gathers.
    pub samples: u32,
}

/// What one frame knows.
#[derive(Debug, Clone)]
pub struct Reference {
    /// Its number; [`Reference::SUPPLIED`] for one of another shot.
    pub frame: u32,
    /// Scene space.
    pub(super) camera: Camera,
    /// Edge of a pixel at distance 1.
    pub(super) pixel_size: f64,
    /// For each pixel the sample of what is seen there directly.
    pub(super) slots: Vec<u32>,
    pub(super) samples: Vec<Sample>,
    /// For each sample the ratio in each channel; NaN where unknown.
    pub(super) ratios: Vec<f32>,
    /// For each of them by how much it changes from the sample to those beside it, per footprint; NaN
    /// where none beside it is known.
    slopes: Vec<f32>,
    pub(super) channels: usize,
    /// Samples that are no pixel's own: seen in mirrors, through glass, beside another surface.
    pub(super) index: Index,
}

impl Reference {
    /// What `traced` tells of frame `frame`, seen by `camera` (scene space).
    pub fn new(frame: u32, camera: &Camera, traced: &TracedPoints, channels: usize) -> Self {
        let mut slots = vec![NONE; camera.width as usize * camera.height as usize];
        let mut samples: Vec<Sample> = Vec::with_capacity(traced.points.len());
        let mut ratios: Vec<f32> = Vec::with_capacity(traced.ratios.len());
        let mut footprints: Vec<f32> = Vec::with_capacity(traced.points.len());
        let mut others = Vec::new();
        for (i, t) in traced.points.iter().enumerate() {
            let own = &traced.ratios[i * channels..(i + 1) * channels];
            let sample = Sample::of(&t.point);
            let slot = &mut slots[t.y as usize * camera.width as usize + t.x as usize];
            if t.point.direct && *slot != NONE && samples[*slot as usize].is_one_surface(&sample) {
                let at = *slot as usize;
                samples[at].join(&sample, &mut ratios[at * channels..(at + 1) * channels], own);
                continue;
            }
            let is_own = t.point.direct
                && (*slot == NONE || samples[*slot as usize].samples < sample.samples);
            let at = samples.len() as u32;
            if is_own {
                let displaced = std::mem::replace(slot, at);
                others.extend((displaced != NONE).then_some(displaced));
            } else {
                others.push(at);
            }
            samples.push(sample);
            footprints.push(t.point.footprint);
            ratios.extend_from_slice(own);
        }
        let pixel_size = camera.pixel_size();
        let index = Index::new(&samples, &footprints, others);
        let slopes = Vec::new();
        let mut reference = Self {
            frame,
            camera: *camera,
            pixel_size,
            slots,
            samples,
            ratios,
            slopes,
            channels,
            index,
        };
        reference.slopes = reference.measure_slopes();
        reference
    }

    /// How much the ratios change around each sample: towards the nearest sample of its surface to the
    /// left, the right, above and below, if that is no further than a few pixels.
    fn measure_slopes(&self) -> Vec<f32> {
        let (channels, width) = (self.channels, self.camera.width as usize);
        let rows = self.slots.par_chunks(width).enumerate().map(|(y, row)| {
            let mut slopes = Vec::new();
            for (x, own) in row.iter().enumerate().filter(|(_, own)| **own != NONE) {
                let own = *own as usize;
                let at = slopes.len();
                slopes.resize(at + channels, f32::NAN);
                for other in self.beside(x, y) {
                    self.steepen(&mut slopes[at..], own, other);
                }
            }
            slopes
        });
        let rows: Vec<Vec<f32>> = rows.collect();
        let mut slopes = vec![f32::NAN; self.ratios.len()];
        for (row, found) in self.slots.chunks(width).zip(rows) {
            let own = row.iter().filter(|own| **own != NONE);
            for (own, found) in own.zip(found.chunks(channels.max(1))) {
                slopes[*own as usize * channels..][..channels].copy_from_slice(found);
            }
        }
        slopes
    }

    /// The nearest samples of the surface seen at (`x`, `y`) in the four directions.
    fn beside(&self, x: usize, y: usize) -> impl Iterator<Item = usize> {
        let (width, height) = (self.camera.width as usize, self.camera.height as usize);
        let own = self.slots[y * width + x] as usize;
        let towards = move |(dx, dy): (isize, isize)| {
            (1..=BESIDE).find_map(|k| {
                let x = x.checked_add_signed(dx * k).filter(|x| *x < width)?;
                let y = y.checked_add_signed(dy * k).filter(|y| *y < height)?;
                let other = self.slots[y * width + x];
                let is_one = other != NONE
                    && self.samples[other as usize].is_one_surface(&self.samples[own]);
                is_one.then_some(other as usize)
            })
        };
        [(1, 0), (-1, 0), (0, 1), (0, -1)].into_iter().filter_map(towards)
    }

    /// Raises the slopes of sample `own` to those towards sample `other`.
    fn steepen(&self, slopes: &mut [f32], own: usize, other: usize) {
        let (a, b) = (&self.samples[own], &self.samples[other]);
        let depth = (a.position() - self.camera.eye).dot(self.camera.forward);
        let footprint = (depth * self.pixel_size) as f32;
        let per_footprint = footprint / a.p.distance(b.p).max(footprint);
        for (channel, slope) in slopes.iter_mut().enumerate() {
            let [a, b] = [own, other].map(|i| self.ratios[i * self.channels + channel]);
            // Of NaN and a number the number.
            *slope = slope.max((a - b).abs() * per_footprint);
        }
    }

    /// Number of references that are frames of another shot: they count as earlier than all.
    pub const SUPPLIED: u32 = 0;

    /// Its camera's eye, scene space.
    pub fn eye(&self) -> DVec3 {
        self.camera.eye
    }

    /// Its camera's view direction.
    pub fn forward(&self) -> DVec3 {
        self.camera.forward
    }

    /// How many samples it has.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Whether it knows nothing.
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// Bytes that it holds.
    pub fn memory(&self) -> u64 {
        let sample = size_of::<Sample>() + 8 * self.channels;
        (self.samples.len() * sample + 4 * self.slots.len()) as u64 + self.index.memory()
    }

    pub(super) fn slope(&self, sample: u32, channel: usize) -> f32 {
        self.slopes[sample as usize * self.channels + channel]
    }

    pub(super) fn ratio(&self, sample: u32, channel: usize) -> f32 {
        self.ratios[sample as usize * self.channels + channel]
    }
}

impl Sample {
    fn of(point: &SurfacePoint) -> Self {
        Self { p: point.p.as_vec3(), n: point.n, geom_id: point.geom_id, samples: point.samples }
    }

    fn is_one_surface(&self, other: &Self) -> bool {
        self.geom_id == other.geom_id && self.n.dot(other.n) > SAME_SURFACE
    }

    /// Takes in more camera samples of the same pixel and surface.
    fn join(&mut self, other: &Self, ratios: &mut [f32], others: &[f32]) {
        let share = other.samples as f32 / (self.samples + other.samples) as f32;
        self.p += (other.p - self.p) * share;
        self.n = (self.n + (other.n - self.n) * share).normalize_or(self.n);
        for (own, other) in ratios.iter_mut().zip(others) {
            match (own.is_nan(), other.is_nan()) {
                (true, _) => *own = *other,
                (false, false) => *own += (other - *own) * share,
                (false, true) => {}
            }
        }
        self.samples += other.samples;
    }

    pub(super) fn position(&self) -> DVec3 {
        self.p.as_dvec3()
    }
}
