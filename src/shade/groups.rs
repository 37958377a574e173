//! The shading points of one chunk as reuse sees them: camera samples of a pixel that end on one surface
//! are one surface point.
//!
//! Points behind mirrors and glass and points out of focus stay apart, since neighbouring samples may end far from
//! one another there. Those out of focus are traced always. What is traced is gathered per surface point and becomes a source.

use super::dimensions::ROOT;
use super::pixels::BlockPixels;
use super::point::ShadingPoint;
use super::{BLOCK, FrameInput, Reuse};
use crate::film::Provenance;
use crate::inference::{
    Channels, Checked, Estimate, LookupBatch, NO_LIGHT, SurfacePoint, TracedPoint, TracedPoints,
    channel_of, check_rays, sky_light, tail_light,
};
use crate::scene::Scene;
use crate::stats::ReuseCounts;
use std::ops::Range;

/// Pixels of a block.
const PIXELS: usize = (BLOCK * BLOCK) as usize;
/// No point.
const NONE: u32 = u32::MAX;
/// Behind mirrors and glass neighbours may end far from one another, and samples that far apart
/// say nothing of a shadow's edge: a footprint counts as at most this many of a flat mirror's.
const MOST_WIDER: f32 = 3.0;

/// Light gathered in one channel of one surface point, in shares of what would arrive unshadowed.
#[derive(Debug, Clone, Copy, Default)]
struct Gathered {
    open: f64,
    all: f64,
}

impl Gathered {
    /// NaN where nothing would arrive.
    fn ratio(&self) -> f32 {
        // What would arrive of a tail is a stand-in, and may be next to nothing.
        ((self.open / self.all) as f32).clamp(0.0, f32::MAX)
    }
}

/// Which of a list of surface points belong to a pixel of the block.
#[derive(Default)]
struct Chains {
    /// The last point of each pixel.
    heads: Vec<u32>,
    /// For each point the one before it of the same pixel.
    next: Vec<u32>,
}

impl Chains {
    fn clear(&mut self) {
        self.heads.clear();
        self.heads.resize(PIXELS, NONE);
        self.next.clear();
    }

    /// The number of the one among `points`, whose chains these are, that shows the surface of `point` in `pixel`.
    fn find(&self, pixel: u32, points: &[SurfacePoint], point: &SurfacePoint) -> Option<usize> {
        let mut at = self.heads[pixel as usize];
        while at != NONE && !points[at as usize].is_one_surface(point) {
            at = self.next[at as usize];
        }
        (at != NONE).then_some(at as usize)
    }

    /// Notes the list's next point, which belongs to `pixel`, if any point is to find it.
    fn push(&mut self, pixel: Option<u32>) {
        let at = self.next.len() as u32;
        let before = pixel.map(|pixel| std::mem::replace(&mut self.heads[pixel as usize], at));
        self.next.push(before.unwrap_or(NONE));
    }
}

/// What check rays found in a block's pixels so far, surface by surface: those of one chunk of camera samples
/// tell little.
#[derive(Default)]
struct Earlier {
    chains: Chains,
    /// One of each surface's points.
    points: Vec<SurfacePoint>,
    /// For each surface and channel what its rays found, and how many there were.
    found: Vec<(Gathered, u32)>,
    /// For each surface and channel its light, if lights are selected.
    lights: Vec<u32>,
}

impl Earlier {
    fn clear(&mut self) {
        self.chains.clear();
        self.points.clear();
        self.found.clear();
        self.lights.clear();
    }

    /// What is known of the surface that `pixel` shows at `point`, in each channel, and the lights of these channels.
    /// At first they are `lights`, none where each channel has a light of its own.
    fn of(
        &mut self,
        pixel: u32,
        point: &SurfacePoint,
        channels: usize,
        lights: &[u32],
    ) -> (&mut [(Gathered, u32)], &[u32]) {
        let known = self.chains.find(pixel, &self.points, point);
        let at = known.unwrap_or_else(|| {
            self.chains.push(Some(pixel));
            self.points.push(*point);
            self.found.resize(self.points.len() * channels, Default::default());
            self.lights.extend(lights);
            self.points.len() - 1
        });
        let lights = self.lights.get(at * channels..).and_then(|own| own.get(..channels));
        (&mut self.found[at * channels..][..channels], lights.unwrap_or_default())
    }
}

/// Check rays of a shading point to one light. Those of a surface point follow one another in the sequence of
/// samples, since such a run is spread over the light.
pub(super) struct CheckRays {
    /// The surface point.
    pub point: usize,
    /// The first sample number of its run.
    pub first: u32,
    /// How many the run has.
    pub all: usize,
    /// The part of the run that is the shading point's.
    pub own: Range<usize>,
}

/// The surface points of a chunk.
#[derive(Default)]
pub(super) struct Groups {
    /// For each shading point its surface point.
    of_lit: Vec<u32>,
    /// And how many of that point's samples came before it.
    before: Vec<u32>,
    asked: LookupBatch,
    /// Pixel of each surface point, in the block.
    pixels: Vec<u32>,
    /// The first camera sample of each surface point.
    first: Vec<u32>,
    chains: Chains,
    gathered: Vec<Gathered>,
    earlier: Earlier,
    /// Whether a ray to a kept light was cast from the surface point.
    traced: Vec<bool>,
    /// Whether any kept light could shine on it.
    lit: Vec<bool>,
    /// Whether points are only counted: nothing is inferred, and they are no sources.
    is_counted_alone: bool,
    /// Surface points that must be traced whatever is known.
    forbidden: Vec<bool>,
    /// Surface points that a camera ray out of focus ends at; empty where the lens blurs nothing.
    blurred: Vec<bool>,
    order: Vec<(u64, u32)>,
    /// Channels of a surface point.
    channels: usize,
    /// Those of selected lights, which come first.
    slots: usize,
    /// And how many each light has.
    colours: usize,
}

impl Groups {
    /// Starts another block of pixels.
    pub fn start_block(&mut self) {
        self.earlier.clear();
    }

    /// Asks what is known about each surface point of `lit`, which is grouped.
    pub fn ask(
        &mut self,
        input: &FrameInput,
        (scene, reuse): (&Scene, &Reuse),
        lit: &[ShadingPoint],
        unshadowed: &[f32],
        pixels: &BlockPixels,
    ) {
        let (count, channels) = (self.asked.points.len(), reuse.channels.len());
        self.asked.ratios.clear();
        self.asked.ratios.resize(count * channels, f32::NAN);
        for flags in [&mut self.traced, &mut self.lit] {
            flags.clear();
            flags.resize(count, false);
        }
        self.asked.provenance.clear();
        self.asked.provenance.resize(count, Provenance::default());
        self.asked.checks.clear();
        self.asked.checked.clear();
        self.is_counted_alone = reuse.inference.is_none() && !reuse.is_source;
        if self.is_counted_alone {
            return;
        }
        self.asked.refinement = (pixels.samples_after() as f32 / input.least as f32).max(1.0);
        self.note_blurred(input, lit);
        self.forbid(input, scene, lit, pixels);
        self.measure_footprints(lit, pixels);
        self.gather_unshadowed(channels, unshadowed);
        self.asked.pixels.clear();
        let place = |pixel: &u32| <[u32; 2]>::from(pixels.place(*pixel));
        self.asked.pixels.extend(self.pixels.iter().map(place));
        self.gathered.clear();
        self.gathered.resize(count * channels, Gathered::default());
        if let Some(inference) = reuse.inference {
            inference.infer(&mut self.asked);
            let Self { asked: LookupBatch { ratios, estimates, checks, .. }, forbidden, .. } = self;
            for (at, _) in forbidden.iter().enumerate().filter(|(_, forbidden)| **forbidden) {
                let own = at * channels..(at + 1) * channels;
                ratios[own.clone()].fill(f32::NAN);
                // Nor does what is suggested there tell of other surfaces.
                estimates.get_mut(own.clone()).unwrap_or_default().fill(Estimate::UNKNOWN);
                checks.get_mut(own).unwrap_or_default().fill(false);
            }
        }
    }

    /// Groups `lit` into surface points. Where lights are selected, none has a channel at first.
    pub fn gather_points(&mut self, input: &FrameInput, channels: &Channels, lit: &[ShadingPoint]) {
        self.join_points(input, lit);
        let (count, lights) = (self.asked.points.len(), &mut self.asked.lights);
        lights.clear();
        if channels.slots() > 0 {
            lights.resize(count * channels.len(), NO_LIGHT);
            for (part, sky) in channels.sky().enumerate() {
                let light = sky_light(part);
                lights.chunks_exact_mut(channels.len()).for_each(|own| own[sky] = light);
            }
        }
        self.slots = channels.slots();
        self.colours = channels.colours();
        self.channels = channels.len();
    }

    /// The channel of a light at the surface point of shading point `i`, or the first of them: the next free one if it has
    /// none yet. `None` where all are taken, by lights of other cells.
    pub fn slot(&mut self, i: u32, light: u32) -> Option<u16> {
        let first = self.of_lit[i as usize] as usize * self.channels;
        let own = &mut self.asked.lights[first..][..self.slots];
        // A number for each colour.
        let first = light * self.colours as u32;
        let is_own = |lights: &[u32]| lights[0] == first || lights[0] == NO_LIGHT;
        let at = own.chunks_exact(self.colours).position(is_own)? * self.colours;
        (first..).zip(&mut own[at..][..self.colours]).for_each(|(number, own)| *own = number);
        Some(at as u16)
    }

    /// Notes the tail's set of lights at shading point `i`, whose parts have these channels. Of camera samples of one
    /// surface point in several sets, the first counts.
    pub fn note_tail(&mut self, i: usize, set: u32, channels: Range<usize>) {
        let first = self.of_lit[i] as usize * self.channels;
        for (part, channel) in (0..).zip(channels) {
            let own = &mut self.asked.lights[first + channel];
            *own = if *own == NO_LIGHT { tail_light(set, part) } else { *own };
        }
    }

    fn join_points(&mut self, input: &FrameInput, lit: &[ShadingPoint]) {
        let Self { of_lit, before, asked, pixels, first, chains, .. } = self;
        let points = &mut asked.points;
        of_lit.clear();
        before.clear();
        points.clear();
        pixels.clear();
        first.clear();
        chains.clear();
        for point in lit {
            let own = point.surface_point(input);
            let pixel = point.place.pixel;
            // Behind mirrors and out of focus nothing joins.
            let known = own.direct.then(|| chains.find(pixel, points, &own)).flatten();
            if let Some(at) = known {
                before.push(points[at].samples);
                points[at].join(&own);
                of_lit.push(at as u32);
            } else {
                of_lit.push(points.len() as u32);
                points.push(own);
                pixels.push(pixel);
                first.push(point.place.sample);
                chains.push(own.direct.then_some(pixel));
                before.push(0);
            }
        }
    }

    /// Notes the points out of focus. The samples of a pixel end far from one another there, and a reference has
    /// few near any: they are traced, and not kept, since as many as there are camera samples fill memory.
    fn note_blurred(&mut self, input: &FrameInput, lit: &[ShadingPoint]) {
        let Self { of_lit, asked, blurred, .. } = self;
        blurred.clear();
        if input.camera.lens.is_sampled() {
            blurred.resize(asked.points.len(), false);
            for (point, group) in lit.iter().zip(&*of_lit) {
                let group = *group as usize;
                blurred[group] = point.place.branch == ROOT && !asked.points[group].direct;
            }
        }
    }

    fn is_blurred(&self, point: usize) -> bool {
        self.blurred.get(point).copied().unwrap_or(false)
    }

    /// Means over each surface point's samples; nothing where nobody shall look.
    fn gather_unshadowed(&mut self, channels: usize, unshadowed: &[f32]) {
        let Self { of_lit, asked: LookupBatch { points, unshadowed: out, .. }, blurred, .. } = self;
        out.clear();
        out.resize(points.len() * channels, 0.0);
        for (at, own) in of_lit.iter().zip(unshadowed.chunks_exact(channels.max(1))) {
            let at = *at as usize;
            if blurred.get(at) == Some(&true) {
                continue;
            }
            let share = 1.0 / points[at].samples as f32;
            let sums = &mut out[at * channels..(at + 1) * channels];
            sums.iter_mut().zip(own).for_each(|(sum, own)| *sum += own * share);
        }
    }

    /// Behind mirrors and glass a pixel's size on the surface follows from its neighbours: how far
    /// away the same branch of their same sample ends.
    fn measure_footprints(&mut self, lit: &[ShadingPoint], pixels: &BlockPixels) {
        let Self { of_lit, asked: LookupBatch { points, .. }, order, .. } = self;
        order.clear();
        let specular = lit.iter().zip(of_lit.iter()).filter(|(l, _)| l.place.branch != ROOT);
        order.extend(
            specular
                .map(|(l, at)| (u64::from(l.place.branch) << 32 | u64::from(l.place.sample), *at)),
        );
        order.sort_unstable();
        for run in order.chunk_by(|a, b| a.0 == b.0) {
            let mut grid = [NONE; PIXELS];
            let cell = |at: u32| pixels.place_in_block(self.pixels[at as usize]);
            run.iter().for_each(|(_, at)| grid[cell(*at)] = *at);
            for (_, at) in run {
                let own = points[*at as usize];
                let nearest = neighbours(cell(*at))
                    .filter(|c| grid[*c] != NONE)
                    .map(|c| &points[grid[c] as usize])
                    .filter(|other| other.geom_id == own.geom_id)
                    .map(|other| other.p.distance(own.p) as f32)
                    .fold(f32::INFINITY, f32::min);
                if nearest < f32::INFINITY {
                    points[*at as usize].footprint = nearest.min(MOST_WIDER * own.footprint);
                }
            }
        }
    }

    /// Notes the surface points that must be traced whatever is known.
    fn forbid(
        &mut self,
        input: &FrameInput,
        scene: &Scene,
        lit: &[ShadingPoint],
        pixels: &BlockPixels,
    ) {
        let Self { of_lit, forbidden, pixels: pixel_of, .. } = self;
        forbidden.clear();
        forbidden.extend(pixel_of.iter().map(|pixel| pixels.is_traced(*pixel)));
        if input.has_always_traced {
            for (point, group) in lit.iter().zip(&*of_lit) {
                let prim = point.si.prim;
                forbidden[*group as usize] |=
                    scene.is_always_traced(prim.geom_id, prim.prim_id, point.si.p);
            }
        }
    }

    /// How many surface points there are.
    pub fn len(&self) -> usize {
        self.asked.points.len()
    }

    /// Whether any answer is to be checked.
    pub fn wants_checks(&self) -> bool {
        !self.asked.checks.is_empty()
    }

    /// The check rays in `own` channels, which are of the same rays, that shading point `i` casts, where tracing would
    /// cast `rays` from each of them; `None` where none is wanted.
    pub fn check_rays(
        &self,
        i: usize,
        own: Range<usize>,
        channels: usize,
        rays: u32,
    ) -> Option<CheckRays> {
        let point = self.of_lit[i] as usize;
        let checks = &self.asked.checks[point * channels..][..channels];
        if !checks[own.clone()].contains(&true) {
            return None;
        }
        let samples = self.asked.points[point].samples;
        let saved = samples.saturating_mul(rays);
        let shown = &self.asked.unshadowed[point * channels..][..channels];
        let (first, sent) = (own.start, shown[own].iter().sum::<f32>());
        let in_part = shown.iter().zip(checks).any(|(shown, check)| *shown != 0.0 && !check);
        let inferred = shown.iter().zip(checks).filter(|(_, check)| **check);
        let share = sent / inferred.map(|(shown, _)| shown).sum::<f32>();
        // The parts of a light have much the same.
        let ratio = self.asked.estimates[point * channels..][first].ratio;
        let all = check_rays(saved, share, ratio, in_part);
        let until =
            |before: u32| (u64::from(before) * u64::from(all) / u64::from(samples)) as usize;
        // A run of a net's points is spread evenly where it starts at a multiple of a power of two.
        let first = self.first[point].wrapping_mul(rays.next_power_of_two());
        let own = until(self.before[i])..until(self.before[i] + 1);
        Some(CheckRays { point, first, all: all as usize, own })
    }

    /// Adds what check rays from shading point `i` found: `open` of `all`.
    pub fn note_checked(
        &mut self,
        i: usize,
        (channel, channels): (usize, usize),
        (open, all): (f64, f64),
        rays: usize,
    ) {
        let at = self.of_lit[i] as usize * channels + channel;
        self.gathered[at].open += open;
        self.gathered[at].all += all;
        if self.asked.checked.is_empty() {
            self.asked.checked.resize(self.gathered.len(), Checked::default());
        }
        self.asked.checked[at].rays += rays as u32;
    }

    /// Tells the inference what the check rays found, with those of the same pixels' earlier samples.
    pub fn conclude_checks(&mut self, reuse: &Reuse) {
        let channels = reuse.channels.len();
        let Self { asked, gathered, earlier, pixels, .. } = self;
        asked.checked.resize(gathered.len(), Checked::default());
        let found = asked.checked.chunks_mut(channels).zip(gathered.chunks_mut(channels));
        let points = asked.points.iter().zip(pixels).enumerate();
        for ((i, (point, pixel)), (checked, gathered)) in points.zip(found) {
            if point.direct && checked.iter().any(|checked| checked.rays > 0) {
                let lights = asked.lights.get(i * channels..).unwrap_or_default();
                let lights = &lights[..lights.len().min(channels)];
                let (all, known) = earlier.of(*pixel, point, channels, lights);
                for (k, (checked, gathered)) in checked.iter_mut().zip(&mut *gathered).enumerate() {
                    let Some(all) = channel_of(known, lights, k).map(|at| &mut all[at]) else {
                        continue;
                    };
                    all.0.open += gathered.open;
                    all.0.all += gathered.all;
                    all.1 += checked.rays;
                    (*gathered, checked.rays) = *all;
                }
            }
            for (checked, gathered) in checked.iter_mut().zip(gathered) {
                checked.ratio = (gathered.open / gathered.all) as f32;
                *gathered = Gathered::default();
            }
        }
        if let Some(inference) = reuse.inference {
            inference.check(asked);
        }
    }

    /// The ratio that is known for shading point `i` in `channel`, else NaN.
    pub fn known(&self, i: usize, channel: usize, channels: usize) -> f32 {
        self.asked.ratios[self.of_lit[i] as usize * channels + channel]
    }

    /// Notes that the light of a channel shines on shading point `i`, shadows aside.
    pub fn note_lit(&mut self, i: usize) {
        self.lit[self.of_lit[i] as usize] = true;
    }

    /// Adds what was traced for shading point `i`.
    pub fn add(&mut self, i: usize, channel: usize, channels: usize, open: f64, all: f64) {
        let group = self.of_lit[i] as usize;
        self.traced[group] = true;
        if self.is_counted_alone {
            return;
        }
        let gathered = &mut self.gathered[group * channels + channel];
        gathered.open += open;
        gathered.all += all;
    }

    /// Moves what was traced to `sources` if anybody asks for it, counts, tells each pixel where its light is from, and
    /// the inference what came out.
    pub fn finish(
        &mut self,
        reuse: &Reuse,
        pixels: &mut BlockPixels,
        sources: &mut TracedPoints,
        counts: &mut ReuseCounts,
    ) {
        let channels = reuse.channels.len();
        for (i, point) in self.asked.points.iter().enumerate() {
            if !self.lit[i] {
                continue;
            }
            let (lit, inferred) = match point.direct {
                true => (&mut counts.direct, &mut counts.direct_inferred),
                false => (&mut counts.specular, &mut counts.specular_inferred),
            };
            *lit += 1;
            *inferred += u64::from(!self.traced[i]);
            let inferred = (!self.traced[i]).then_some(&self.asked.provenance[i]);
            pixels.join_provenance(self.pixels[i], inferred);
            if self.traced[i] && !self.is_counted_alone && !self.is_blurred(i) {
                let own = i * channels..(i + 1) * channels;
                let sent = &self.asked.unshadowed[own.clone()];
                let mut known = self.asked.ratios[own.clone()].iter().zip(sent);
                let is_known = known.any(|(ratio, sent)| !ratio.is_nan() && *sent != 0.0);
                counts.inferred_in_part += u64::from(is_known);
                let gathered = self.gathered[own.clone()].iter().map(Gathered::ratio);
                let ratios = &mut self.asked.ratios[own];
                ratios.iter_mut().zip(gathered.clone()).for_each(|(ratio, traced)| {
                    *ratio = if traced.is_nan() { *ratio } else { traced };
                });
                if !reuse.is_source {
                    continue;
                }
                let (x, y) = pixels.place(self.pixels[i]);
                sources.points.push(TracedPoint { x, y, point: *point });
                sources.ratios.extend(gathered);
                let lights = self.asked.lights.get(i * channels..).unwrap_or_default();
                sources.lights.extend(lights.iter().take(channels));
            }
        }
        if let Some(inference) = reuse.inference {
            inference.hear(&self.asked);
        }
    }
}

/// Cells left, right, above and below in the block.
fn neighbours(cell: usize) -> impl Iterator<Item = usize> {
    let edge = BLOCK as usize;
    let (x, y) = (cell % edge, cell / edge);
    let left = (x > 0).then(|| cell - 1);
    let right = (x + 1 < edge).then(|| cell + 1);
    let above = (y > 0).then(|| cell - edge);
    let below = (y + 1 < edge).then(|| cell + edge);
    [left, right, above, below].into_iter().flatten()
}

impl ShadingPoint {
    /// The point as reuse sees it.
    fn surface_point(&self, input: &FrameInput) -> SurfacePoint {
        let is_first = self.place.branch == ROOT;
        // Behind mirrors a first guess, as if they were flat.
        let along = match is_first {
            true => (self.si.p - input.camera.eye).dot(input.camera.forward),
            false => (self.si.p - input.camera.eye).length(),
        };
        let direct = is_first && input.camera.is_in_focus(along);
        let cos = -self.ray.dir.dot(self.n) / self.ray.dir.length();
        SurfacePoint {
            p: self.si.p,
            n: self.n.as_vec3(),
            geom_id: self.si.prim.geom_id,
            footprint: (along * input.pixel_size) as f32,
            cos: cos as f32,
            direct,
            samples: 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DVec3, Vec3};

    #[test]
    fn check_rays_of_a_surface_add_up_from_chunk_to_chunk() {
        let point = |z: f64| SurfacePoint {
            p: DVec3::new(0.0, 0.0, z),
            n: Vec3::Z,
            geom_id: 0,
            footprint: 0.1,
            cos: 1.0,
            direct: true,
            samples: 1,
        };
        let mut earlier = Earlier::default();
        earlier.clear();
        let mut add = |pixel, z, rays| {
            let (found, _) = earlier.of(pixel, &point(z), 2, &[]);
            found[1].1 += rays;
            [found[0].1, found[1].1]
        };
        assert_eq!(add(5, 0.0, 4), [0, 4]);
        assert_eq!(add(5, 0.01, 4), [0, 8]);
        // Another surface of the pixel, and another pixel.
        assert_eq!(add(5, 1.0, 4), [0, 4]);
        assert_eq!(add(6, 0.0, 4), [0, 4]);
        assert_eq!(add(5, 0.0, 1), [0, 9]);
        earlier.clear();
        assert_eq!(earlier.of(5, &point(0.0), 2, &[]).0[1].1, 0);
    }
}
