//! Probes: the pixels that are both estimated and traced, and the errors found at them.

use super::Lookup;
use super::check::agrees;
use super::evidence::{Finding, LightComparison, LitCounts, findings_of};
use crate::film::Provenance;
use crate::inference::{Estimate, Inference, LookupBatch, SurfacePoint, channel_of};
use crate::sampling::mix;
use std::sync::{Mutex, PoisonError};

/// Number of parts that a frame's probes are cut into; each part is judged by the findings of the others.
pub const PARTS: usize = 4;

/// Which pixels of a frame are probes: one at a random place in each square cell of the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ProbeDraw {
    /// The job's seed.
    pub seed: u64,
    /// Number of the frame.
    pub frame: u32,
    /// Edge of a cell, in blocks of pixels.
    pub cell: u32,
    /// Edge of a block of pixels that are probed together, in pixels.
    pub block: u32,
}

impl ProbeDraw {
    /// The draw whose probes are about `share` of all pixels.
    pub fn of(seed: u64, frame: u32, share: f64, block: u32) -> Self {
        let cell = (1.0 / share.max(1e-6)).sqrt().round().max(1.0) as u32;
        Self { seed, frame, cell, block }
    }

    /// Number of pixels that a probe represents.
    pub fn weight(&self) -> f64 {
        f64::from(self.cell) * f64::from(self.cell)
    }

    /// Number of the cell that contains a pixel; a cell has one probed block.
    pub fn group(&self, x: u32, y: u32) -> u64 {
        let edge = self.cell * self.block;
        u64::from(y / edge) << 32 | u64::from(x / edge)
    }

    fn words(&self, x: u32, y: u32) -> u64 {
        mix(self.seed ^ mix(u64::from(self.frame) ^ mix(self.group(x, y))))
    }

    /// The probed block of the cell that contains a pixel: its column and row among the cell's blocks.
    fn probed_block(&self, x: u32, y: u32) -> [u32; 2] {
        let word = self.words(x, y);
        let cell = u64::from(self.cell);
        [word % cell, (word >> 32) % cell].map(|at| at as u32)
    }

    /// Whether the pixel is a probe.
    #[cfg(test)]
    fn has(&self, x: u32, y: u32) -> bool {
        [x, y].map(|p| p / self.block % self.cell) == self.probed_block(x, y)
    }

    /// The part of the probes, below [`PARTS`], that a probe belongs to.
    pub fn part(&self, x: u32, y: u32) -> usize {
        (self.words(x, y) >> 32) as usize / self.cell as usize % PARTS
    }

    /// For each pixel of an image, row by row, whether it is a probe.
    pub fn mask(&self, width: u32, height: u32) -> Vec<bool> {
        let mut mask = vec![false; width as usize * height as usize];
        let edge = (self.cell * self.block) as usize;
        // Once for each cell, not for each pixel.
        for top in (0..height).step_by(edge) {
            for left in (0..width).step_by(edge) {
                let [right, down] = self.probed_block(left, top).map(|at| at * self.block);
                for y in (top + down)..(top + down + self.block).min(height) {
                    for x in (left + right)..(left + right + self.block).min(width) {
                        mask[y as usize * width as usize + x as usize] = true;
                    }
                }
            }
        }
        mask
    }
}

/// Records estimates and traces of probes. Infers nothing, so that every point is traced.
pub struct Probe<'a> {
    /// The source of estimates; `None` to record only traces.
    pub lookup: Option<&'a Lookup<'a>>,
    /// Number of lights whose ratios are kept.
    pub channels: usize,
    /// Error that counts as invisible, display steps.
    pub tolerance: f32,
    notes: Mutex<Vec<Note>>,
}

/// A surface point of a probe.
struct Note {
    pixel: [u32; 2],
    point: SurfacePoint,
    lights: Vec<LightComparison>,
    /// The numbers of these lights; empty where they are the same everywhere.
    numbers: Vec<u32>,
    /// Whether check rays agreed.
    agreed: bool,
}

impl<'a> Probe<'a> {
    /// A recorder without notes.
    pub fn new(lookup: Option<&'a Lookup<'a>>, channels: usize, tolerance: f32) -> Self {
        Self { lookup, channels, tolerance, notes: Mutex::default() }
    }

    /// The notes row by row, and within a pixel in the order in which they were made.
    fn sorted(self) -> Vec<Note> {
        let mut notes = self.notes.into_inner().unwrap_or_else(PoisonError::into_inner);
        notes.sort_by_key(|note| (note.pixel[1], note.pixel[0]));
        notes
    }

    /// Of the recorded points that a pixel shows directly, or of the others, those that a light may reach.
    pub fn lit(&self, direct: bool) -> LitCounts {
        let notes = self.notes.lock().unwrap_or_else(PoisonError::into_inner);
        let is_lit = |light: &&LightComparison| light.unshadowed != 0.0;
        let lit = notes.iter().filter(|note| {
            note.point.direct == direct && note.lights.iter().any(|light| is_lit(&light))
        });
        let is_known = |note: &&Note| {
            note.lights.iter().filter(is_lit).any(|light| !light.estimate.ratio.is_nan())
        };
        let known = lit.clone().filter(is_known).count() as u64;
        LitCounts { all: lit.count() as u64, known }
    }

    /// The findings by pixel (column, row). `self` recorded estimates and traces, `other` a second trace of the same
    /// probes with other random numbers. A pixel has `samples` camera samples; the noise of a trace is stated for
    /// `spp` of them.
    pub fn findings(
        self,
        other: Self,
        spp: u32,
        samples: &dyn Fn([u32; 2]) -> u32,
    ) -> Vec<([u32; 2], Vec<Finding>)> {
        let mut all: Vec<([u32; 2], Vec<Note>)> = Vec::new();
        for (mut own, again) in self.sorted().into_iter().zip(other.sorted()) {
            let is_same = own.pixel == again.pixel && own.point.p == again.point.p;
            if !is_same {
                // Cannot happen: camera samples do not depend on random numbers of the light.
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
        let findings = |note: &Note| {
            let samples = samples(note.pixel) as f32;
            let mut found = findings_of(note.point.samples as f32 / samples, &note.lights);
            found.iter_mut().for_each(|found| found.noise *= samples / spp as f32);
            found
        };
        let of_pixel = |(pixel, notes): ([u32; 2], Vec<Note>)| {
            (pixel, notes.iter().flat_map(findings).collect())
        };
        all.into_iter().map(of_pixel).collect()
    }
}

impl Note {
    /// Whether `other`, a note of other camera samples of the same pixel, is of the same surface. The estimates of
    /// both then have the same error, while the noise of their traces is independent.
    fn is_one_with(&self, other: &Self) -> bool {
        self.agreed == other.agreed
            && self.point.direct == other.point.direct
            && self.point.is_one_surface(&other.point)
    }

    fn join(&mut self, other: &Self) {
        let share = self.point.join(&other.point);
        for (k, light) in other.lights.iter().enumerate() {
            match channel_of(&self.numbers, &other.numbers, k) {
                Some(at) => self.lights[at].join(light, share),
                None if light.unshadowed == 0.0 => {}
                // No light of the samples so far.
                None => {
                    let dark = LightComparison { unshadowed: 0.0, ..*light };
                    self.lights.push(dark);
                    self.numbers.push(other.numbers[k]);
                    let at = self.lights.len() - 1;
                    self.lights[at].join(light, share);
                }
            }
        }
    }
}

impl Inference for Probe<'_> {
    fn infer(&self, batch: &mut LookupBatch) {
        batch.estimates.clear();
        if let Some(lookup) = self.lookup {
            lookup.estimate(batch);
            // Probes show their traces.
            batch.provenance.fill(Provenance::default());
            let is_known = |estimate: &Estimate| !estimate.ratio.is_nan();
            batch.checks.extend(batch.estimates.iter().map(is_known));
        }
    }

    fn hear(&self, answered: &LookupBatch) {
        let LookupBatch { points, pixels, unshadowed, lights, ratios, estimates, .. } = answered;
        let channels = self.channels;
        let agreed = |i: usize, most: u32| {
            !answered.checks.is_empty() && agrees(answered, (i, channels), most, self.tolerance)
        };
        let light = |i: usize, channel: usize| {
            let at = i * channels + channel;
            let estimate = estimates.get(at).copied().unwrap_or(Estimate::UNKNOWN);
            LightComparison {
                unshadowed: unshadowed[at],
                estimate,
                traced: [ratios[at]; 2],
                agreed: agreed(i, estimate.order),
            }
        };
        let note = |(i, point): (usize, &SurfacePoint)| Note {
            pixel: pixels[i],
            point: *point,
            lights: (0..channels).map(|channel| light(i, channel)).collect(),
            numbers: lights.get(i * channels..(i + 1) * channels).unwrap_or_default().to_vec(),
            agreed: agreed(i, u32::MAX),
        };
        let notes = points.iter().enumerate().map(note);
        self.notes.lock().unwrap_or_else(PoisonError::into_inner).extend(notes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mask_has_the_probe_of_each_cell() {
        for ([width, height], share, block) in
            [([1, 1], 0.01, 1), ([7, 5], 0.25, 2), ([161, 97], 0.016, 1), ([161, 97], 0.01, 2)]
        {
            let draw = ProbeDraw::of(3, 9, share, block);
            let mask = draw.mask(width, height);
            let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
            assert!(places.zip(&mask).all(|((x, y), own)| draw.has(x, y) == *own));
            let found = mask.iter().filter(|own| **own).count() as f64;
            let wanted = f64::from(width * height) * share;
            assert!(found <= 1.5 * wanted + f64::from(4 * block * block), "{found} for {wanted}");
        }
    }
}
