//! How much evidence the frames of a segment need so that they are as accurate as traced ones.
//!
//! A tolerance of one display step is finer than an eye sees. But where a scene has little noise, traced
//! frames are finer still, and inferred ones shall not be worse. So what evidence allows is at most in
//! proportion to the noise that the segment's middle frame would have if it were traced. That is found out
//! by making some of it from the key frames: whoever makes a frame of the segment finds the same. Key
//! frames, where frames of other shots are supplied, are looked at themselves.

use super::Inferrer;
use crate::error::Result;
use crate::reuse::{Evidence, NoiseMeter};
use crate::sampling::mix;
use crate::scene::Camera;
use crate::sequence::strips::Unheard;
use crate::shade::FrameJob;
use crate::stats::RayCounts;

/// The tolerance is at most so many times tracing's noise.
const OF_NOISE: f32 = 2.0;
/// Nor is it less than this share of what is allowed otherwise: still lights are looked up.
const LEAST: f32 = 1.0 / 256.0;
/// Share of the pixels that are looked at, in blocks: all noise may lie in a hundredth of the picture.
const SHARE: f64 = 0.25;
/// Edge of these blocks, pixels.
const BLOCK: u32 = 8;

/// What is allowed in a segment, or in a key frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Allowed {
    /// What counts as evidence there.
    pub evidence: Evidence,
    /// The original that was looked at, and the rays that this took: they count for that frame, whoever
    /// looked, if it lies in this segment.
    looked_at: Option<(u32, RayCounts)>,
}

impl Allowed {
    /// The rays that finding it out took, if `frame` was looked at.
    pub fn rays_of(&self, frame: u32) -> RayCounts {
        self.looked_at.filter(|(other, _)| *other == frame).map_or_else(RayCounts::default, |l| l.1)
    }
}

impl Inferrer<'_> {
    /// What is allowed in an original, which is found out where nobody asked about its segment yet. `None`
    /// when the job shall stop.
    pub(super) fn allowed(&self, original: u32) -> Result<Option<Allowed>> {
        let is_inferred = self.supplied.is_some() || !self.pyramid.is_key(original);
        if !self.calibrates || !is_inferred {
            return Ok(Some(Allowed { evidence: self.evidence, looked_at: None }));
        }
        let middle = self.pyramid.middle_of(original).unwrap_or(original);
        if let Some(found) = self.with_state(|s| s.allowed.get(&middle).copied()) {
            return Ok(Some(found));
        }
        let found =
            self.calibrate(self.schedule.original(middle), self.schedule.ancestors(middle))?;
        if let Some(found) = found {
            self.with_state(|s| s.allowed.insert(middle, found));
        }
        Ok(found)
    }

    /// Makes some of the pixels of `frame`, an original, from `references`, and sees how noisy they would be
    /// if they were traced.
    fn calibrate(&self, frame: u32, references: Vec<u32>) -> Result<Option<Allowed>> {
        let Some(references) = self.references(&references)? else { return Ok(None) };
        let camera = self.camera(frame)?;
        let mask = blocks(&camera, mix(self.renderer.settings.seed ^ u64::from(frame)));
        let job = FrameJob {
            camera: &camera,
            stream: frame,
            with_gbuffer: false,
            reuse: None,
            mask: Some(&mask),
            beyond_crop: true,
        };
        let evidence = self.evidence;
        self.with_lookup((frame, &camera), &references, evidence, |lookup| {
            let Some(lookup) = lookup else { return Some(Allowed { evidence, looked_at: None }) };
            let meter = NoiseMeter::new(lookup, self.renderer.settings.spp);
            let rays = self.render(job, Some(&meter), &Unheard)?.rays;
            let most = meter.rms().map_or(evidence.tolerance, |rms| OF_NOISE * rms as f32);
            let share = (most / evidence.tolerance).clamp(LEAST, 1.0);
            Some(Allowed { evidence: evidence.shared(share), looked_at: Some((frame, rays)) })
        })
    }
}

/// A mask of blocks that `seed` draws.
fn blocks(camera: &Camera, seed: u64) -> Vec<bool> {
    let below = (SHARE * u64::MAX as f64) as u64;
    let across = camera.width.div_ceil(BLOCK);
    let is_drawn = |x: u32, y: u32| {
        let block = u64::from(y / BLOCK * across + x / BLOCK);
        mix(seed ^ mix(block)) <= below
    };
    (0..camera.height).flat_map(|y| (0..camera.width).map(move |x| is_drawn(x, y))).collect()
}
