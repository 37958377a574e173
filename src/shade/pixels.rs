//! The pixels of one block while it is rendered: sums, records, samplers.

use super::adaptive::{SampleSpread, Until};
use super::pilots::{Findings, LightFindings, PixelMask};
use super::{BLOCK, FrameInput, dimensions};
use crate::film::{Film, GPixel, Provenance, ProvenanceKind};
use crate::inference::SAMPLES_TOGETHER;
use crate::math::Rgb;
use crate::sampling::{PixelFilter, PixelSampler};
use crate::scene::Rect;
use crate::stats::Fault;
use std::ops::Range;

/// What no light looks like.
const MAGENTA: Rgb = Rgb::new(1.0, 0.0, 1.0);

/// One block's pixels, in 4 x 4 sub-blocks so that the rays of a packet, which follow this order, are
/// neighbours.
pub(super) struct BlockPixels {
    places: Vec<(u32, u32)>,
    film_samplers: Vec<PixelSampler>,
    /// Where the present chunk's samples lie from their pixels' middles, pixel by pixel, pixels.
    offsets: Vec<[f64; 2]>,
    /// Where they pass the lens, in the unit square; empty where the lens does not care.
    lens: Vec<[f64; 2]>,
    samplers: Vec<PixelSampler>,
    sums: Vec<Rgb>,
    /// How many samples each pixel has.
    taken: Vec<u32>,
    limits: SampleLimits,
    /// Where samples are looked at one by one: the present chunk's, pixel by pixel.
    samples: Vec<Rgb>,
    /// The differences among the samples; empty where no pixel takes more because of them.
    spreads: Vec<SampleSpread>,
    /// The present chunk's samples.
    chunk: Range<u32>,
    /// The pixels that take them.
    active: Vec<u32>,
    /// Of each pixel whether no light of it is inferred.
    is_traced: Vec<bool>,
    /// What pilots found of each light; empty where no light has any.
    findings: Vec<Findings>,
    /// Invalid light of the present chunk of samples: pixel, sample, fault.
    suspects: Vec<(u32, u32, Fault)>,
    /// Pixels with such a sample, once a sample.
    bad: Vec<(u32, Fault)>,
    records: Vec<Record>,
    with_records: bool,
    provenance: Vec<Provenance>,
}

/// What is done with single camera samples.
#[derive(Clone, Copy)]
pub(super) struct SampleLimits {
    /// The most that each channel of a sample's radiance may be.
    pub most: Option<f32>,
    /// The exposure, where differences among samples are of interest.
    pub spread: Option<f32>,
}

impl SampleLimits {
    fn is_any(&self) -> bool {
        self.most.is_some() || self.spread.is_some()
    }
}

/// A pixel as it goes to the film.
pub(super) struct FinishedPixel {
    /// Column.
    pub x: u32,
    /// Row.
    pub y: u32,
    /// Mean radiance of its samples.
    pub rgb: Rgb,
    /// First hit, where asked for.
    pub record: Option<GPixel>,
    /// Where its light comes from.
    pub provenance: Provenance,
    /// The differences among its samples, where they are of interest.
    pub spread: Option<SampleSpread>,
}

/// The sampler of the camera samples' places in a pixel. They do not depend on the frame: frame 0 is
/// no frame's number.
pub(super) fn film_sampler(seed: u64, x: u32, y: u32) -> PixelSampler {
    PixelSampler::new(seed, 0, x, y)
}

/// Where camera samples, at most [`SAMPLES_TOGETHER`], lie from their pixel's middle, pixels: there, where
/// the pixel has but one.
pub(super) fn offsets_of(
    spp: u32,
    filter: &PixelFilter,
    sampler: &PixelSampler,
    samples: Range<u32>,
) -> impl Iterator<Item = [f64; 2]> {
    let mut u = [[0.5; 2]; SAMPLES_TOGETHER as usize];
    let count = samples.len();
    if spp > 1 {
        sampler.fill2(samples.start, dimensions::FILM, &mut u[..count]);
    }
    u.into_iter().take(count).map(move |u| if spp > 1 { filter.offset2(u) } else { [0.0; 2] })
}

/// Where camera samples, at most [`SAMPLES_TOGETHER`], pass the lens, in the unit square. As their places in the
/// pixel they do not depend on the frame.
pub(super) fn lens_positions(
    sampler: &PixelSampler,
    samples: Range<u32>,
) -> impl Iterator<Item = [f64; 2]> {
    let mut u = [[0.5; 2]; SAMPLES_TOGETHER as usize];
    let count = samples.len();
    sampler.fill2(samples.start, dimensions::LENS, &mut u[..count]);
    u.into_iter().take(count).map(|u| u.map(f64::from))
}

#[derive(Clone, Copy)]
struct Record {
    nearest: f64,
    pixel: GPixel,
}

impl BlockPixels {
    /// No block yet; with or without G-buffer records.
    pub fn new(with_records: bool, limits: SampleLimits) -> Self {
        Self {
            places: Vec::new(),
            film_samplers: Vec::new(),
            offsets: Vec::new(),
            lens: Vec::new(),
            samplers: Vec::new(),
            sums: Vec::new(),
            taken: Vec::new(),
            limits,
            samples: Vec::new(),
            spreads: Vec::new(),
            chunk: 0..0,
            active: Vec::new(),
            is_traced: Vec::new(),
            findings: Vec::new(),
            suspects: Vec::new(),
            bad: Vec::new(),
            records: Vec::new(),
            with_records,
            provenance: Vec::new(),
        }
    }

    /// Starts those pixels of the block `rect` (within the image) that are `wanted`.
    pub fn start(&mut self, rect: &Rect, seed: u64, frame: u32, wanted: impl Fn(u32, u32) -> bool) {
        self.places.clear();
        for sub_y in (rect.y0..rect.y1).step_by(4) {
            for sub_x in (rect.x0..rect.x1).step_by(4) {
                for y in sub_y..(sub_y + 4).min(rect.y1) {
                    let row = (sub_x..(sub_x + 4).min(rect.x1)).map(|x| (x, y));
                    self.places.extend(row.filter(|(x, y)| wanted(*x, *y)));
                }
            }
        }
        self.start_places(seed, frame);
    }

    /// Starts the pixels at `places` of the image, which need not be neighbours.
    pub fn start_scattered(&mut self, places: &[(u32, u32)], seed: u64, frame: u32) {
        self.places.clear();
        self.places.extend_from_slice(places);
        self.start_places(seed, frame);
    }

    fn start_places(&mut self, seed: u64, frame: u32) {
        self.film_samplers.clear();
        self.samplers.clear();
        for (x, y) in &self.places {
            self.film_samplers.push(film_sampler(seed, *x, *y));
            self.samplers.push(PixelSampler::new(seed, frame, *x, *y));
        }
        self.sums.clear();
        self.sums.resize(self.places.len(), Rgb::ZERO);
        self.taken.clear();
        self.taken.resize(self.places.len(), 0);
        self.is_traced.clear();
        self.is_traced.resize(self.places.len(), false);
        self.spreads.clear();
        if self.limits.spread.is_some() {
            self.spreads.resize(self.places.len(), SampleSpread::default());
        }
        self.suspects.clear();
        self.bad.clear();
        self.provenance.clear();
        self.provenance.resize(self.places.len(), Provenance::default());
        self.records.clear();
        if self.with_records {
            let empty = Record { nearest: f64::INFINITY, pixel: GPixel::EMPTY };
            self.records.resize(self.places.len(), empty);
        }
    }

    /// Goes on where `film` and `spreads` (one for each of its pixels) left off, with further samples of the same
    /// pixels.
    /// Those that are `known` show traces alone, as probes do.
    pub fn resume(&mut self, film: &Film, spreads: &[SampleSpread], known: impl Fn(usize) -> bool) {
        for (i, (x, y)) in self.places.iter().enumerate() {
            let at = film.index(*x, *y);
            self.is_traced[i] = known(at);
            self.taken[i] = spreads[at].count;
            self.spreads[i] = spreads[at];
            self.sums[i] = spreads[at].sum;
            if let Some(provenance) = &film.provenance {
                self.provenance[i] = provenance[at];
            }
        }
    }

    /// Column and row of a pixel in the image.
    pub fn place(&self, pixel: u32) -> (u32, u32) {
        self.places[pixel as usize]
    }

    /// Where a pixel lies in its block: row by row.
    pub fn place_in_block(&self, pixel: u32) -> usize {
        let (x, y) = self.place(pixel);
        ((y % BLOCK) * BLOCK + x % BLOCK) as usize
    }

    /// Starts to note what pilots find of as many lights, or goes on with what they found before.
    pub fn start_pilots(&mut self, lights: usize, before: Option<&LightFindings>) {
        self.findings.clear();
        self.findings.resize(lights, Findings::default());
        for (light, found) in before.into_iter().flatten() {
            self.findings[*light as usize] = *found;
        }
    }

    /// What pilots found, of those lights that have any.
    pub fn findings(&self) -> impl Iterator<Item = (u32, Findings)> {
        let all = (0..).zip(self.findings.iter().copied());
        all.filter(|(_, found)| *found != Findings::default())
    }

    /// Notes whether any pilots of a pixel reached a light, and whether any did not.
    pub fn note_pilots(&mut self, light: usize, pixel: u32, open: bool, shut: bool) {
        let place = self.place_in_block(pixel);
        self.findings[light].note(place, open, shut);
    }

    /// Notes the ratio of a light that is known from other frames, which counts as pilots do.
    pub fn note_ratio(&mut self, light: usize, pixel: u32, ratio: f32) {
        if !self.findings.is_empty() {
            let place = self.place_in_block(pixel);
            self.findings[light].note_ratio(place, ratio);
        }
    }

    /// The pixels around which pilots to a light disagree.
    pub fn disputed(&self, light: usize) -> PixelMask {
        self.findings[light].disputed()
    }

    /// Notes where the light of a pixel's surface point comes from; `None` where it was traced.
    pub fn join_provenance(&mut self, pixel: u32, inferred: Option<&Provenance>) {
        let traced = Provenance { kind: ProvenanceKind::Traced, ..Provenance::default() };
        self.provenance[pixel as usize].join(inferred.unwrap_or(&traced));
    }

    /// Whether no light of a pixel is inferred.
    pub fn is_traced(&self, pixel: u32) -> bool {
        self.is_traced[pixel as usize]
    }

    /// Pixels in the block.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Adds radiance of one camera sample to its pixel's sum. What is invalid is added as it
    /// is, and noted.
    #[inline]
    pub fn add(&mut self, pixel: u32, sample: u32, radiance: Rgb) {
        let sum = match self.limits.is_any() {
            false => &mut self.sums[pixel as usize],
            true => {
                let at = pixel * self.chunk_len() + sample - self.chunk.start;
                &mut self.samples[at as usize]
            }
        };
        *sum += radiance;
        self.check(pixel, sample, radiance);
    }

    fn chunk_len(&self) -> u32 {
        self.chunk.end - self.chunk.start
    }

    /// Starts the next chunk of camera samples, for those pixels that lack any `until` they have enough; a pixel
    /// takes at most `most`. `None` where all have enough.
    pub fn start_samples(
        &mut self,
        input: &FrameInput,
        until: &Until,
        most: u32,
    ) -> Option<Range<u32>> {
        self.active.clear();
        let mut start = u32::MAX;
        for (i, (x, y)) in self.places.iter().enumerate() {
            let taken = self.taken[i];
            let at = (y * input.camera.width + x) as usize;
            if taken <= start && taken < until.count(at, self.spreads.get(i)) {
                if taken < start {
                    self.active.clear();
                }
                start = taken;
                self.active.push(i as u32);
            }
        }
        if self.active.is_empty() {
            return None;
        }
        // Later chunks start where a run of samples is evenly spread.
        let end = (start / SAMPLES_TOGETHER + 1).saturating_mul(SAMPLES_TOGETHER);
        let end = match until {
            Until::Count(count) => end.min(*count),
            Until::Each(_) | Until::Differences { .. } => end.min(most),
        };
        self.chunk = start..end;
        self.offsets.clear();
        self.lens.clear();
        if most == 1 {
            self.offsets.resize(self.places.len(), [0.0; 2]);
        } else {
            for sampler in &self.film_samplers {
                self.offsets.extend(offsets_of(most, &input.filter, sampler, self.chunk.clone()));
            }
        }
        if input.camera.lens.is_sampled() {
            for sampler in &self.film_samplers {
                self.lens.extend(lens_positions(sampler, self.chunk.clone()));
            }
        }
        if self.limits.is_any() {
            let count = self.chunk_len() as usize * self.places.len();
            self.samples.clear();
            self.samples.resize(count, Rgb::ZERO);
        }
        Some(self.chunk.clone())
    }

    /// The pixels that take the present chunk of samples.
    pub fn active(&self) -> impl Iterator<Item = u32> {
        self.active.iter().copied()
    }

    /// The number of samples that each active pixel has with the present chunk.
    pub fn samples_after(&self) -> u32 {
        self.chunk.end
    }

    /// Adds the chunk's samples, whole by now, to their pixels, none of them above the limit.
    fn add_samples(&mut self) {
        let count = self.chunk_len() as usize;
        for pixel in self.active.iter().map(|pixel| *pixel as usize) {
            for light in &self.samples[pixel * count..][..count] {
                let light = match self.limits.most {
                    // What is invalid stays what it is.
                    Some(most) if light.is_finite() => light.min(Rgb::splat(most)),
                    _ => *light,
                };
                self.sums[pixel] += light;
                if let Some(exposure) = self.limits.spread {
                    self.spreads[pixel].add(light * exposure);
                }
            }
        }
    }

    /// Notes a sample whose light, or weight of light, is invalid.
    #[inline]
    pub fn check(&mut self, pixel: u32, sample: u32, light: Rgb) {
        // The bits of what is finite and has no sign lie below those of infinity.
        let [r, g, b] = light.to_array().map(f32::to_bits);
        if r.max(g).max(b) >= f32::INFINITY.to_bits() {
            self.suspect(pixel, sample, light);
        }
    }

    #[cold]
    fn suspect(&mut self, pixel: u32, sample: u32, radiance: Rgb) {
        if let Some(fault) = Fault::of(radiance.to_array()) {
            self.suspects.push((pixel, sample, fault));
        }
    }

    /// Ends a chunk of camera samples: each bad one counts once, by its worst fault.
    pub fn end_samples(&mut self) {
        if self.limits.is_any() {
            self.add_samples();
        }
        let count = self.chunk_len();
        self.active.iter().for_each(|pixel| self.taken[*pixel as usize] += count);
        if self.suspects.is_empty() {
            return;
        }
        self.suspects.sort_unstable_by(|a, b| b.cmp(a));
        self.suspects.dedup_by_key(|(pixel, sample, _)| (*pixel, *sample));
        self.bad.extend(self.suspects.drain(..).map(|(pixel, _, fault)| (pixel, fault)));
    }

    /// Bad samples of the finished block, by place. A sum of good samples that overflows is one.
    pub fn bad(&self) -> impl Iterator<Item = (u32, u32, Fault)> {
        let overflows = self.sums.iter().enumerate().filter_map(|(pixel, sum)| {
            let pixel = pixel as u32;
            (!sum.is_finite() && !self.is_bad(pixel)).then_some((pixel, Fault::Infinite))
        });
        self.bad.iter().copied().chain(overflows).map(|(pixel, fault)| {
            let (x, y) = self.places[pixel as usize];
            (x, y, fault)
        })
    }

    fn is_bad(&self, pixel: u32) -> bool {
        self.bad.iter().any(|(bad, _)| *bad == pixel)
    }

    /// The sampler of a pixel's paths, which do not depend on the frame.
    pub fn path_sampler(&self, pixel: u32) -> &PixelSampler {
        &self.film_samplers[pixel as usize]
    }

    /// The sampler of a pixel's light.
    pub fn sampler(&self, pixel: u32) -> &PixelSampler {
        &self.samplers[pixel as usize]
    }

    /// Image point of one of the present chunk's camera samples.
    pub fn sample_position(&self, pixel: usize, sample: u32) -> (f64, f64) {
        let (x, y) = self.places[pixel];
        let [dx, dy] = self.offset(pixel, sample);
        (f64::from(x) + 0.5 + dx, f64::from(y) + 0.5 + dy)
    }

    /// Where one of the present chunk's camera samples passes the lens, in the unit square: in the middle where
    /// the lens does not care.
    pub fn lens_position(&self, pixel: usize, sample: u32) -> [f64; 2] {
        self.lens.get(self.place_in_chunk(pixel, sample)).copied().unwrap_or([0.5; 2])
    }

    fn offset(&self, pixel: usize, sample: u32) -> [f64; 2] {
        self.offsets[self.place_in_chunk(pixel, sample)]
    }

    fn place_in_chunk(&self, pixel: usize, sample: u32) -> usize {
        pixel * self.chunk_len() as usize + (sample - self.chunk.start) as usize
    }

    /// Whether first-hit records are kept.
    pub fn wants_records(&self) -> bool {
        self.with_records
    }

    /// Whether this camera sample is the nearest so far to its pixel's middle; remembers it.
    pub fn is_nearest(&mut self, pixel: usize, sample: u32) -> bool {
        let [dx, dy] = self.offset(pixel, sample);
        let distance = dx * dx + dy * dy;
        let nearer = distance < self.records[pixel].nearest;
        if nearer {
            self.records[pixel].nearest = distance;
        }
        nearer
    }

    /// Keeps a pixel's record.
    pub fn set_record(&mut self, pixel: usize, record: GPixel) {
        self.records[pixel].pixel = record;
    }

    /// Each finished pixel. With `flag_bad`, pixels with a bad sample are
    /// magenta.
    pub fn finished(&self, flag_bad: bool) -> impl Iterator<Item = FinishedPixel> {
        self.places.iter().enumerate().map(move |(i, &(x, y))| {
            let sum = self.sums[i];
            let flagged = flag_bad && (!sum.is_finite() || self.is_bad(i as u32));
            let rgb = if flagged { MAGENTA } else { sum * (1.0 / self.taken[i] as f32) };
            let record = self.records.get(i).map(|r| r.pixel);
            let mut spread = self.spreads.get(i).copied();
            if let Some(spread) = &mut spread {
                spread.sum = sum;
                if flagged {
                    // More samples would be added to magenta.
                    spread.spoil();
                }
            }
            FinishedPixel { x, y, rgb, record, provenance: self.provenance[i], spread }
        })
    }
}
