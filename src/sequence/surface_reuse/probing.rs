//! Probes of a frame: rendered before the frame, so that their findings decide which points are inferred.
//!
//! Each probe is estimated and traced twice. The findings, together with those of the frames that this one
//! is inferred from, make the [`Evidence`]. The probes show their first trace, and both traces are
//! sources for other frames. The probes are also the frame's audit: each part of them is inferred by the
//! evidence of the other parts, with random numbers of its own, and compared with its traces. So the audit
//! finds errors that the evidence missed; if probes were judged by their own findings, only those with
//! small errors by chance would stay inferred.

use super::SurfaceReuse;
use crate::error::Result;
use crate::film::Film;
use crate::inference::Inference;
use crate::output::Display;
use crate::reuse::audit::{self, AuditedFrame, AuditedPixel};
use crate::reuse::evidence::{Evidence, Finding, LitCounts, ProbeFindings};
use crate::reuse::{
    Gains, Judged, LookedUp, Lookup, PARTS, Probe, ProbeDraw, Reference, could_be_worth_lookups,
};
use crate::scene::Camera;
use crate::shade::{FrameJob, Known, Rendered, Sampling};
use crate::stats::{AuditSums, RayCounts};
use rayon::prelude::*;
use std::sync::Arc;

/// Added to a frame's number (at most a million) to seed the light samples of the probes' two traces, and of
/// the audit's. The first, which is shown, has the samples of a traced frame.
const STREAMS: [u32; 3] = [0, 1 << 31, 3 << 30];
/// Multiple of the usual share of pixels that is probed, if no, one, or more reference frames have probes.
const MULTIPLES: [f64; 3] = [1.0, 2.0, 1.0];
/// The multiple where no reference frame has probes, once the usual share has found estimates enough: where frames do not
/// overlap there are none.
const FIRST: f64 = 4.0;
/// Frames of fewer pixels get as many probes as a frame of this many pixels.
const LEAST: f64 = 25_000.0;
/// Multiple of the usual share if the findings of other frames say that lookups do not pay.
const HOPELESS: f64 = 0.25;
/// Largest share that is probed.
const MOST: f64 = 0.25;
/// How many reference frames must have had estimates for nearly all of their probed points before a frame is given up without
/// a probe.
const LEAST_KNOWING: usize = 2;
/// How many findings each of them must have: the gain of four or fewer is never more than chance.
const LEAST_FINDINGS: usize = 16;
/// The share of the points that is nearly all. Where fewer have estimates, closer frames could know more, and better.
const LEAST_KNOWN: f64 = 0.9;
/// How many times the findings of reference frames are counted then. With more probes the evidence is less cautious: that there are few of
/// them shall not decide.
const TIMES: f64 = 8.0;
/// A reference frame counts as one in which lookups pay only if its gain is more than this many standard deviations above zero: a few
/// lucky findings shall not keep others from being given up. Points in mirrors and through glass are not looked up if lookups of them lose by more
/// than this many.
const DOUBT: f64 = 2.0;

/// What probes decide for a frame.
#[derive(Clone)]
pub(super) enum Probing {
    /// There is nothing to infer it from, or nothing is to be inferred.
    NoSource,
    /// Probes of other frames show that nothing is to be gained. It is traced whole and is no source of other frames: being
    /// one costs more than its probes would.
    GivenUp,
    /// It has probes of its own.
    Probed(Arc<Probed>),
}

impl Probing {
    /// The frame's own probes, if it has any.
    pub fn probed(&self) -> Option<&Probed> {
        match self {
            Self::Probed(probed) => Some(probed),
            Self::NoSource | Self::GivenUp => None,
        }
    }
}

/// A frame's probes.
pub(super) struct Probed {
    draw: ProbeDraw,
    /// For each pixel whether it is a probe.
    mask: Vec<bool>,
    traces: [Rendered; 2],
    /// The rays of fewer probes that were rendered before, to see whether there are estimates.
    trial: RayCounts,
    /// For each pixel its number of camera samples; empty where all have as many.
    counts: Vec<u32>,
    /// Findings of the probes, which are stored with the frame's reference.
    pub findings: ProbeFindings,
    /// The evidence for the rest of the frame.
    pub evidence: Evidence,
    /// For each part of the probes the evidence from the findings of the other parts.
    crossed: Vec<Evidence>,
    /// The points that are looked up in the frame.
    pub looked_up: LookedUp,
}

impl Probed {
    /// What the probes show: their first trace.
    pub fn shown(&self) -> Known<'_> {
        Known { mask: &self.mask, rendered: &self.traces[0] }
    }

    /// `lookup`, limited to the points that are looked up in the frame.
    pub fn limited<'l>(&self, lookup: Lookup<'l>) -> Lookup<'l> {
        Lookup { specular: self.looked_up == LookedUp::All, ..lookup }
    }

    /// The camera samples of the probes.
    fn sampling(&self) -> Sampling<'_> {
        sampling_of(&self.counts)
    }
}

/// As many camera samples as `counts` has, where pixels have different numbers.
fn sampling_of(counts: &[u32]) -> Sampling<'_> {
    if counts.is_empty() { Sampling::Own } else { Sampling::As(counts) }
}

/// The usual share of the pixels of a frame of so many that is probed.
fn usual_share(probes: f32, pixels: f64) -> f64 {
    f64::from(probes) * (LEAST / pixels).max(1.0)
}

/// The multiple of the usual share that is probed first; `known` reference frames have probes, and `is_hopeless` says that
/// by their findings lookups do not pay.
fn multiple(known: usize, is_hopeless: bool) -> f64 {
    if is_hopeless { HOPELESS } else { MULTIPLES[known.min(MULTIPLES.len() - 1)] }
}

impl SurfaceReuse<'_> {
    /// Whether to trace the frame of `lookup` whole without a probe of its own: where in several of the frames that it
    /// would be inferred from nearly all probes had estimates, and lookups would have paid in none that has probes.
    pub(super) fn is_given_up(&self, lookup: &Lookup) -> bool {
        let r = &self.context.renderer;
        // What other jobs know may tell more than this one's frames tell one another.
        if lookup.references.iter().any(|r| r.frame == Reference::SUPPLIED) {
            return false;
        }
        let all = lookup.references.iter().map(|r| r.findings());
        let probed: Vec<&ProbeFindings> = all.filter(|found| !found.list.is_empty()).collect();
        let is_knowing = |found: &&&ProbeFindings| {
            found.list.len() >= LEAST_FINDINGS && found.lit.known_share() >= LEAST_KNOWN
        };
        if probed.iter().filter(is_knowing).count() < LEAST_KNOWING {
            return false;
        }
        let findings = probed.iter().flat_map(|found| &found.list);
        let evidence = Evidence::counted(findings, TIMES, r.settings.reuse.tolerance);
        let cast = (r.scene, &self.channels, r.settings);
        let pays =
            |list: &[Finding]| Gains::of(&evidence, list.iter(), cast, (0.0, 0.0)).pay(DOUBT);
        !probed.iter().any(|found| pays(&found.list))
    }

    /// Renders the probes of `frame`, seen by `camera`; `lookup` gives their estimates.
    pub(super) fn probe(&self, frame: u32, camera: &Camera, lookup: &Lookup) -> Result<Probed> {
        let r = &self.context.renderer;
        let tolerance = r.settings.reuse.tolerance;
        let cast = (r.scene, &self.channels, r.settings);
        let before = || lookup.references.iter().flat_map(|r| &r.findings().list);
        let known = lookup.references.iter().filter(|r| !r.findings().list.is_empty()).count();
        let pixels = f64::from(camera.width) * f64::from(camera.height);
        let usual = usual_share(r.settings.reuse.probes, pixels);
        let pay = |known: &Evidence| Gains::of(known, before(), cast, (usual, 0.0)).pay(0.0);
        let is_hopeless = known > 0 && !pay(&Evidence::of(before(), tolerance));
        // In mirrors and glass the footprint of a pixel is computed from neighbouring pixels.
        let block = if r.plan().mirror || r.plan().glass { 2 } else { 1 };
        let trace = |mask: &[bool], stream: u32, lookup, sampling| {
            let probe = Probe::new(lookup, self.channels.len(), r.settings.reuse.tolerance);
            let with_gbuffer = self.context.with_gbuffer && stream == STREAMS[0];
            let job = self.job(camera, frame | stream, mask);
            let job = FrameJob { with_gbuffer, sampling, ..job };
            let rendered = self.render(job, true, Some(&probe as &dyn Inference), &())?;
            Result::Ok((rendered, probe))
        };
        let estimated = |multiple: f64| {
            let share = (multiple * usual).min(MOST);
            let draw = ProbeDraw::of(r.settings.seed, frame, share, block);
            let mask = draw.mask(camera.width, camera.height);
            let (rendered, probe) = trace(&mask, STREAMS[0], Some(lookup), Sampling::Own)?;
            Result::Ok((draw, mask, rendered, probe))
        };
        // Points that are seen directly, and others.
        let lit = |probe: &Probe| [true, false].map(|direct| probe.lit(direct));
        let could_be = |[direct, other]: [LitCounts; 2]| {
            let shares = [direct, direct + other].map(LitCounts::known_share);
            shares.iter().any(|known| could_be_worth_lookups(*known, cast))
        };
        let (mut draw, mut mask, mut first, mut own) = estimated(multiple(known, is_hopeless))?;
        let mut trial = RayCounts::default();
        if known == 0 && could_be(lit(&own)) {
            trial = first.rays;
            (draw, mask, first, own) = estimated(FIRST)?;
        }
        let counts = first.sample_counts();
        let (mut second, again) = trace(&mask, STREAMS[1], None, sampling_of(&counts))?;
        // Only the first is gone on with.
        second.spreads = Vec::new();
        let samples = |[x, y]: [u32; 2]| {
            counts.get(first.film.index(x, y)).copied().unwrap_or(r.settings.spp)
        };
        let lit = lit(&own);
        let found = own.findings(again, r.settings.spp, &samples);
        let of_others = |part: usize| {
            let is_in = move |pixel: &[u32; 2]| draw.part(pixel[0], pixel[1]) == part;
            let others = found.iter().filter(move |(pixel, _)| !is_in(pixel));
            Evidence::of(before().chain(others.flat_map(|(_, findings)| findings)), tolerance)
        };
        let crossed =
            self.context.pool.install(|| (0..PARTS).into_par_iter().map(of_others).collect());
        let list: Vec<Finding> = found.iter().flat_map(|(_, f)| f).copied().collect();
        let evidence = Evidence::of(before().chain(&list), tolerance);
        // The frame's own probes are traced in any case, so they cost nothing more.
        let gains = Gains::of(&evidence, list.iter(), cast, (0.0, lit[1].unknown_per_known()));
        let looked_up = if could_be(lit) { gains.looked_up(DOUBT) } else { LookedUp::Nothing };
        Ok(Probed {
            draw,
            mask,
            traces: [first, second],
            trial,
            counts,
            findings: ProbeFindings { list, lit: lit[0] + lit[1] },
            evidence,
            crossed,
            looked_up,
        })
    }

    /// The job that traces the pixels of `mask`, also outside the crop, without records.
    fn job<'j>(&self, camera: &'j Camera, stream: u32, mask: &'j [bool]) -> FrameJob<'j> {
        FrameJob { mask: Some(mask), beyond_crop: true, ..FrameJob::whole(camera, stream) }
    }

    /// Adds the rays, counts and sources of the probes of `frame` to `rendered`, which shows them. Returns the audit
    /// of the inferred pixels; `None` if there are none.
    pub(super) fn add_probes(
        &self,
        frame: u32,
        camera: &Camera,
        references: &[Arc<Reference>],
        probed: &Probed,
        rendered: &mut Rendered,
    ) -> Result<Option<AuditSums>> {
        let [first, second] = &probed.traces;
        let is_inferred = rendered.reuse.is_inferred();
        let drawn = |i: usize| {
            let (index, weight) = (i as u32, probed.draw.weight());
            let group = probed.draw.group(index % camera.width, index / camera.width);
            let samples = rendered.film.samples.as_ref().map(|samples| f64::from(samples[i]));
            let refinement = samples.map_or(1.0, |shown| shown / f64::from(probed.counts[i]));
            AuditedPixel { index, weight, group, refinement }
        };
        let (rays, inferred) = match is_inferred {
            true => self.audit(frame, camera, references, probed)?,
            false => (RayCounts::default(), None),
        };
        let places = probed.mask.iter().enumerate().filter(|(_, is_probe)| **is_probe);
        let places: Vec<usize> =
            places.map(|(i, _)| i).filter(|i| self.is_shown(&rendered.film, *i)).collect();
        let drawn: Vec<AuditedPixel> = places.iter().map(|i| drawn(*i)).collect();
        let film = &mut rendered.film;
        film.bad += first.film.bad;
        rendered.rays += probed.trial;
        rendered.rays += first.rays;
        rendered.reuse += first.reuse;
        for trace in &probed.traces {
            rendered.sources.append(trace.sources.clone());
        }
        let Some(inferred) = inferred else {
            rendered.rays += second.rays;
            return Ok(None);
        };
        let shown = self.shown(&inferred);
        let traces = [&first.film.rgb[..], &second.film.rgb[..]];
        let mut sums = audit::sums(&shown, &drawn, traces);
        sums.pixels = (0..film.rgb.len()).filter(|i| self.is_shown(film, *i)).count() as u64;
        sums.rays = rays;
        sums.rays += second.rays;
        let mut map = vec![f32::NAN; film.rgb.len()];
        for &i in &places {
            let [a, b] = traces.map(|rgb| rgb[i]);
            map[i] = audit::difference(&shown.display, inferred.rgb[i], a, b);
        }
        film.audit = Some(map);
        Ok(Some(sums))
    }

    /// The rays cast to infer each part of the probes by the evidence of the others, and the film of them.
    fn audit(
        &self,
        frame: u32,
        camera: &Camera,
        references: &[Arc<Reference>],
        probed: &Probed,
    ) -> Result<(RayCounts, Option<Film>)> {
        self.with_lookup((frame, camera), references, |lookup| {
            let Some(lookup) = lookup else { return Ok((RayCounts::default(), None)) };
            let lookup = probed.limited(lookup);
            let evidence = |[x, y]: [u32; 2]| &probed.crossed[probed.draw.part(x, y)];
            let tolerance = self.context.renderer.settings.reuse.tolerance;
            let judged = Judged { lookup: &lookup, evidence: &evidence, tolerance };
            let job = self.job(camera, frame | STREAMS[2], &probed.mask);
            let job = FrameJob { sampling: probed.sampling(), ..job };
            // Nothing of it is shown, and the probes are sources already.
            let inferred = self.render(job, false, Some(&judged), &())?;
            Ok((inferred.rays, Some(inferred.film)))
        })
    }

    fn shown<'f>(&self, film: &'f Film) -> AuditedFrame<'f> {
        let settings = self.context.renderer.settings;
        AuditedFrame {
            rgb: &film.rgb,
            provenance: film.provenance.as_deref().unwrap_or_default(),
            display: Display { exposure: settings.exposure, tone: settings.tone },
        }
    }

    /// Whether a pixel lies in the crop.
    fn is_shown(&self, film: &Film, i: usize) -> bool {
        let (x, y) = (i as u32 % film.width, i as u32 / film.width);
        let crop = self.context.renderer.settings.crop;
        crop.is_none_or(|c| (c.x0..c.x1).contains(&x) && (c.y0..c.y1).contains(&y))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_frames_have_as_many_probes_as_larger_ones() {
        for pixels in [1e6, 25_000.0] {
            assert_eq!(usual_share(0.5, pixels), 0.5);
        }
        assert_eq!(usual_share(0.5, 12_500.0), 1.0);
        assert_eq!(usual_share(0.0, 1.0), 0.0);
    }

    #[test]
    fn a_frame_with_one_probed_reference_has_more_probes_and_a_hopeless_one_fewer() {
        assert_eq!([0, 1, 2, 3, 9].map(|known| multiple(known, false)), [1.0, 2.0, 1.0, 1.0, 1.0]);
        assert_eq!([1, 2].map(|known| multiple(known, true)), [0.25; 2]);
    }
}
