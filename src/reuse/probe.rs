//! Probes: the pixels that are estimated and traced, and what is noted about them.

use super::Lookup;
use super::check::agrees;
use super::evidence::{Finding, LightComparison, finding_of};
use crate::film::Provenance;
use crate::inference::{Estimate, Inference, LookupBatch, SurfacePoint};
use crate::sampling::mix;
use std::sync::{Mutex, PoisonError};

/// Number of parts that a frame's probes are cut into; each part is judged by the findings of the others.
pub const PARTS: usize = 4;

/// Which pixels of a frame are probes: one at a random place in each square cell of the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ProbeDraw {
    /// The job's seed.
    pub seed: u64,
    /// The frame.
    pub frame: u32,
    /// Edge of a cell, blocks of pixels.
    pub cell: u32,
    /// Edge of a block of pixels that is probed as one, pixels.
    pub block: u32,
}

impl ProbeDraw {
    /// The draw whose probes are about `share` of all pixels.
    pub fn of(seed: u64, frame: u32, share: f64, block: u32) -> Self {
        let cell = (1.0 / share.max(1e-6)).sqrt().round().max(1.0) as u32;
        Self { seed, frame, cell, block }
    }

    /// How many pixels a probe stands for.
    pub fn weight(&self) -> f64 {
        f64::from(self.cell) * f64::from(self.cell)
    }

    /// The number of the cell that a pixel lies in: its probes are drawn together.
    pub fn group(&self, x: u32, y: u32) -> u64 {
        let edge = self.cell * self.block;
        u64::from(y / edge) << 32 | u64::from(x / edge)
    }

    fn words(&self, x: u32, y: u32) -> u64 {
        mix(self.seed ^ mix(u64::from(self.frame) ^ mix(self.group(x, y))))
    }

    /// Whether the pixel is a probe.
    pub fn has(&self, x: u32, y: u32) -> bool {
        let word = self.words(x, y);
        let cell = u64::from(self.cell);
        let at = [word % cell, (word >> 32) % cell];
        let own = [x, y].map(|p| u64::from(p / self.block % self.cell));
        own == at
    }

    /// Which part of the probes, of [`PARTS`], a probe belongs to: each is judged by what the others find.
    pub fn part(&self, x: u32, y: u32) -> usize {
        (self.words(x, y) >> 32) as usize / self.cell as usize % PARTS
    }

    /// For each pixel of an image, row by row, whether it is a probe.
    pub fn mask(&self, width: u32, height: u32) -> Vec<bool> {
        (0..height).flat_map(|y| (0..width).map(move |x| self.has(x, y))).collect()
    }
}

/// Records estimates and traces of probes; answers no question, so that all is traced.
pub struct Probe<'a> {
    /// What estimates; `None` to note the traces alone.
    pub lookup: Option<&'a Lookup<'a>>,
    /// How many lights' ratios are kept.
    pub channels: usize,
    /// An error of so many display steps is not seen.
    pub tolerance: f32,
    notes: Mutex<Vec<Note>>,
}

/// A surface point of a probe.
struct Note {
    pixel: [u32; 2],
    point: SurfacePoint,
    lights: Vec<LightComparison>,
    /// Whether check rays agreed.
    agreed: bool,
}

impl<'a> Probe<'a> {
    /// Nothing noted.
    pub fn new(lookup: Option<&'a Lookup<'a>>, channels: usize, tolerance: f32) -> Self {
        Self { lookup, channels, tolerance, notes: Mutex::default() }
    }

    /// The notes in the image's order; those of a pixel as they were made.
    fn sorted(self) -> Vec<Note> {
        let mut notes = self.notes.into_inner().unwrap_or_else(PoisonError::into_inner);
        notes.sort_by_key(|note| (note.pixel[1], note.pixel[0]));
        notes
    }

    /// What `self`, which estimated, and `other`, which traced the same probes once more with other random
    /// numbers, found: pixel by pixel, for frames of `spp` camera samples.
    pub fn findings(self, other: Self, spp: u32) -> Vec<([u32; 2], Vec<Finding>)> {
        let mut all: Vec<([u32; 2], Vec<Note>)> = Vec::new();
        for (mut own, again) in self.sorted().into_iter().zip(other.sorted()) {
            let is_same = own.pixel == again.pixel && own.point.p == again.point.p;
            if !is_same {
                // Camera samples do not depend on random numbers of the light: it cannot be.
                debug_assert!(is_same, "{:?} {:?}", own.pixel, again.pixel);
                continue;
            }
            for (own, again) in own.lights.iter_mut().zip(&again.lights) {
                own.traced[1] = again.traced[0];
            }
            if all.last().is_none_or(|(pixel, _)| *pixel != own.pixel) {
                all.push((own.pixel, Vec::new()));
            }
            let Some((_, notes)) = all.last_mut() else { continue };
            match notes.iter_mut().find(|note| note.is_one_with(&own)) {
                Some(note) => note.join(&own),
                None => notes.push(own),
            }
        }
        let finding = |note: &Note| {
            let share = note.point.samples as f32 / spp as f32;
            finding_of(share, &note.lights, note.agreed)
        };
        let of_pixel = |(pixel, notes): ([u32; 2], Vec<Note>)| {
            (pixel, notes.iter().filter_map(finding).collect())
        };
        all.into_iter().map(of_pixel).collect()
    }
}

impl Note {
    /// Whether `other` is of another part of the same pixel's camera samples and of the same surface. Their
    /// estimates are off by the same, while the noise of tracing is independent.
    fn is_one_with(&self, other: &Self) -> bool {
        self.agreed == other.agreed
            && self.point.direct == other.point.direct
            && self.point.is_one_surface(&other.point)
    }

    fn join(&mut self, other: &Self) {
        let share = self.point.join(&other.point);
        for (own, other) in self.lights.iter_mut().zip(&other.lights) {
            own.join(other, share);
        }
    }
}

impl Inference for Probe<'_> {
    fn infer(&self, batch: &mut LookupBatch) {
        batch.estimates.clear();
        if let Some(lookup) = self.lookup {
            lookup.estimate(batch);
            // Nothing of what is shown comes from there.
            batch.provenance.fill(Provenance::default());
            let is_known = |estimate: &Estimate| !estimate.ratio.is_nan();
            batch.checks.extend(batch.estimates.iter().map(is_known));
        }
    }

    fn hear(&self, answered: &LookupBatch) {
        let LookupBatch { points, pixels, unshadowed, ratios, estimates, .. } = answered;
        let channels = self.channels;
        let light = |at: usize| LightComparison {
            unshadowed: unshadowed[at],
            estimate: estimates.get(at).copied().unwrap_or(Estimate::UNKNOWN),
            traced: [ratios[at]; 2],
        };
        let note = |(i, point): (usize, &SurfacePoint)| Note {
            pixel: pixels[i],
            point: *point,
            lights: (i * channels..(i + 1) * channels).map(light).collect(),
            agreed: !answered.checks.is_empty() && agrees(answered, i, channels, self.tolerance),
        };
        let notes = points.iter().enumerate().map(note);
        self.notes.lock().unwrap_or_else(PoisonError::into_inner).extend(notes);
    }
}
