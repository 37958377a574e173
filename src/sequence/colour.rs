//! The maker of policy `colour`, the source paper's algorithm: frames from the colours that other
//! frames have at the same pixels ([`reuse::colour`](crate::reuse::colour)).
//!
//! The first and the last frame of the shot are traced, and uploaded pictures are taken
//! as they are. The frames between are made in the order of the pyramid
//! over the whole shot: the middle one from both ends, then the quarters, and so on. The paper's
//! ranks make their frames in parallel and send each other their discoveries, so that a
//! frame depends on which rank was faster. Here it depends only on its ancestors; if a single
//! frame is asked for, its ancestors are made first.
//!
//! With several ranks every frame's discoveries go to all of them, as in the paper.
//!
//! Not done: inferred pixels have no first-hit records; theirs say that nothing is hit.
//! Meshes and boxes that the scene says to trace always may be inferred, since an inferred pixel does
//! not know which surface it shows.

mod exchange;
mod pixels;
mod upload;

pub use upload::check_upload;

use super::checkpoint::Checkpoints;
use super::context::FrameContext;
use super::pool::SharedPool;
use super::pyramid::Pyramid;
use super::schedule::Schedule;
use super::{FrameGraph, FrameMaker, Made, SaveCost};
use crate::error::{Error, Result};
use crate::film::{Film, Image};
use crate::math::Vec2;
use crate::reuse::colour::{AgreementRule, InferredColour, KnownColours};
use crate::shade::{FrameJob, Sampling};
use pixels::{discoveries, fill};
use std::collections::BTreeSet;
use std::sync::Arc;
use upload::known_of_upload;

/// Infers frames from colours.
pub struct ColourMaker<'a> {
    /// Saves discoveries for a job that resumes this one; `None` saves none. Few frames
    /// are needed at a time, about as many as the shot's length has binary digits. Each rank saves the
    /// frames that it made.
    pub checkpoints: Option<&'a Checkpoints<'a>>,
    context: FrameContext<'a>,
    rule: AgreementRule,
    pyramid: Pyramid,
    schedule: Schedule,
    uploads: Vec<KnownColours>,
    /// The colours that each frame traced, for as long as later frames need them.
    known: SharedPool<Arc<KnownColours>, Arc<KnownColours>>,
}

impl<'a> ColourMaker<'a> {
    /// A maker of the frames of `context`, which takes `uploads` for the frames that they name.
    ///
    /// # Errors
    /// [`check_upload`]'s, and a frame that has two `uploads`.
    pub fn new(
        context: FrameContext<'a>,
        rule: AgreementRule,
        uploads: &[(u32, Image)],
    ) -> Result<Self> {
        let settings = context.renderer.settings;
        let mut seen = BTreeSet::new();
        let mut known = Vec::new();
        for (frame, image) in uploads {
            check_upload(*frame, image, context.shot, settings)?;
            if !seen.insert(*frame) {
                return Err(Error::Usage(format!("frame {frame} has two uploaded pictures")));
            }
            known.push(known_of_upload(*frame, image, settings));
        }
        let pyramid = Pyramid::whole(context.shot.frames);
        let schedule = Schedule::without_copies(pyramid);
        let (checkpoints, uploads) = (None, known);
        let known = SharedPool::default();
        Ok(Self { checkpoints, context, rule, pyramid, schedule, uploads, known })
    }

    /// Makes `frame` from the discoveries of its ancestors, which are made first if they are missing.
    /// Keeps the discoveries of `frame` if later frames need them.
    fn frame(&self, frame: u32) -> Result<Made> {
        let ancestors = self.pyramid.ancestors(frame).into_iter().map(|other| self.known(other));
        let ancestors = ancestors.collect::<Result<Vec<_>>>()?;
        let known: Vec<&KnownColours> =
            ancestors.iter().map(|k| &**k).chain(&self.uploads).collect();
        let settings = self.context.renderer.settings;
        let camera = self.context.camera(frame)?;
        let pixels = settings.width as usize * settings.height as usize;
        let inferred = self.rule.infer(&known, frame, pixels);
        let mask: Vec<bool> = inferred.iter().map(Option::is_none).collect();
        // Distances come from first-hit records.
        let (with_gbuffer, mask) = (true, Some(&mask[..]));
        let sampling = Sampling::Alone;
        let job = FrameJob { with_gbuffer, mask, sampling, ..self.context.job(frame, &camera) };
        let mut traced = self.context.render(&job, self.context.progress)?;
        let discoveries = discoveries(frame, &traced.film, &inferred, &camera, settings);
        let reuse = fill(&mut traced.film, frame, &inferred, settings);
        if self.context.with_gbuffer {
            self.note_motion(frame, &mut traced.film, &inferred)?;
        } else {
            traced.film.gbuffer = None;
        }
        let discoveries = Arc::new(discoveries);
        self.keep(&discoveries);
        self.known.lock().set_unsaved(frame, Some(discoveries));
        Ok(Made { film: traced.film, rays: traced.rays, reuse, audit: None, reference: None })
    }

    /// Fills in the motion of the traced pixels; the others have no first hits.
    fn note_motion(
        &self,
        frame: u32,
        film: &mut Film,
        inferred: &[Option<InferredColour>],
    ) -> Result<()> {
        self.context.note_motion(frame, film)?;
        let motion = film.gbuffer.iter_mut().flat_map(|g| &mut g.motion);
        motion.zip(inferred).filter(|(_, i)| i.is_some()).for_each(|(m, _)| *m = Vec2::ZERO);
        Ok(())
    }

    /// The discoveries of `frame`, which the pool has in use: from memory, from disk, or newly made.
    fn known(&self, frame: u32) -> Result<Arc<KnownColours>> {
        let found = self.known.lock().get(frame).cloned();
        if let Some(found) = found.or_else(|| self.read_from_disk(frame)) {
            return Ok(found);
        }
        self.frame(frame)?;
        let lost = || Error::Failed(format!("the discoveries of frame {frame} are lost"));
        self.known.lock().get(frame).cloned().ok_or_else(lost)
    }

    /// The discoveries of `frame` that an earlier run saved.
    fn read_from_disk(&self, frame: u32) -> Option<Arc<KnownColours>> {
        let bytes = self.checkpoints?.read_bytes(frame)?;
        let known = Arc::new(self.decode(frame, &bytes)?);
        self.keep(&known);
        self.known.lock().note_on_disk(frame);
        Some(known)
    }

    fn decode(&self, frame: u32, bytes: &[u8]) -> Option<KnownColours> {
        let settings = self.context.renderer.settings;
        let pixels = settings.width * settings.height;
        self.context.pool.install(|| KnownColours::decode(frame, bytes, pixels))
    }

    /// Keeps discoveries in memory if later frames need them.
    fn keep(&self, known: &Arc<KnownColours>) {
        let mut pool = self.known.lock();
        pool.keep(&self.schedule, known.frame, || Arc::clone(known));
        pool.note_memory(|known, _| known.memory());
    }

    fn save(&self, is_stopping: bool) {
        let encode = |known: &Arc<KnownColours>| self.context.pool.install(|| known.encode());
        self.known.save(self.checkpoints, is_stopping, |known| encode(known).map(Into::into));
    }
}

impl FrameGraph for ColourMaker<'_> {
    fn needs(&self, representative: u32) -> Vec<u32> {
        self.pyramid.ancestors(representative)
    }

    /// One list: the first and the last frame, then each frame between them after its ancestors.
    fn batches(&self, frames: &[u32]) -> Vec<Vec<u32>> {
        let mut ordered = self.pyramid.order(frames);
        ordered.sort_by_key(|frame| !self.pyramid.is_key(*frame));
        ordered.into_iter().map(|frame| vec![frame]).collect()
    }

    fn is_on_disk(&self, representative: u32) -> bool {
        self.checkpoints.is_some_and(|c| c.has(representative))
    }

    fn sends_to_all(&self) -> bool {
        true
    }
}

impl FrameMaker for ColourMaker<'_> {
    fn make(&self, frame: u32) -> Result<Made> {
        self.known.lock().expect_once(&self.schedule, frame);
        let made = self.frame(frame)?;
        self.known.lock().done(&self.schedule, frame);
        self.save(false);
        Ok(made)
    }

    fn expect(&self, frames: &[u32]) {
        self.known.lock().expect(&self.schedule, frames);
    }

    fn stopped(&self) {
        self.save(true);
    }

    fn notes(&self) -> Vec<String> {
        self.checkpoints.map(Checkpoints::notes).unwrap_or_default()
    }

    fn save_cost(&self) -> SaveCost {
        self.known.lock().save_cost
    }

    fn reference_memory(&self) -> u64 {
        let uploads: u64 = self.uploads.iter().map(KnownColours::memory).sum();
        uploads + self.known.lock().most_memory
    }
}
