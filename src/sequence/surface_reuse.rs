//! The maker that infers frames from others of their segment and traces what cannot be inferred.

mod exchange;
mod probing;

use super::checkpoint::Checkpoints;
use super::context::FrameContext;
use super::pool::SharedPool;
use super::pyramid::Pyramid;
use super::schedule::Schedule;
use super::strips::{self, JoinedStrips};
use super::supplied::{ReferenceCache, with_supplied};
use super::{FrameGraph, FrameMaker, Made, SaveCost};
use crate::error::{Error, Result};
use crate::inference::{Channels, Inference, TracedPoints};
use crate::output::WriteOptions;
use crate::reuse::evidence::ProbeFindings;
use crate::reuse::store::{Compatibility, ReferenceRecord};
use crate::reuse::{self, Judged, LookedUp, Lookup, LookupChannel, Reference};
use crate::scene::{Camera, Rect};
use crate::shade::{FrameJob, Progress, Rendered, Reuse};
use probing::Probing;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

/// Infers in-between frames.
pub struct SurfaceReuse<'a> {
    /// References from other jobs, from which all frames, key frames too, are inferred.
    pub supplied: Option<&'a ReferenceCache>,
    /// Compatibility of the references in the frames' files, for later jobs; `None` if files hold no
    /// references.
    pub terms: Option<Compatibility>,
    /// Saves references for a job that resumes this one; `None` saves none.
    pub checkpoints: Option<&'a Checkpoints<'a>>,
    /// Compatibility of the references that are sent to other ranks; `None` if there are no other ranks.
    pub exchange: Option<Compatibility>,
    context: FrameContext<'a>,
    pyramid: Pyramid,
    schedule: Schedule,
    channels: Channels,
    joined: JoinedStrips,
    references: SharedPool<Arc<Reference>>,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    /// Representatives that were made for their references and not yet returned.
    early: BTreeMap<u32, Made>,
    /// The last representative of which a copy is still to be returned.
    again: Option<(u32, Made)>,
    /// What was decided last, and for which frame.
    probing: Option<(u32, Probing)>,
}

impl<'a> SurfaceReuse<'a> {
    /// A maker of the frames of `context`, with the key frames of `pyramid`.
    ///
    /// # Errors
    /// Errors of the shot's cameras.
    pub fn new(context: FrameContext<'a>, pyramid: Pyramid) -> Result<Self> {
        let renderer = &context.renderer;
        let channels = reuse::channels(renderer.scene, renderer.settings);
        // If no light is worth a lookup, every frame is a key frame.
        let pyramid = if channels.is_empty() { Pyramid { segment: 1, ..pyramid } } else { pyramid };
        Ok(Self {
            supplied: None,
            terms: None,
            checkpoints: None,
            exchange: None,
            schedule: Schedule::new(pyramid, context.shot)?,
            context,
            pyramid,
            channels,
            joined: JoinedStrips::default(),
            references: SharedPool::default(),
            state: Mutex::default(),
        })
    }

    /// Makes a representative from the references that it needs, which are made first if they are missing. Keeps
    /// its own reference if that is in use.
    fn frame(&self, frame: u32) -> Result<Made> {
        let camera = self.context.camera(frame)?;
        let is_due = self.references.lock().is_due(frame);
        let references = self.references(&self.schedule.ancestors(frame))?;
        let mut rendered = match self.joined.take(frame) {
            Some(rendered) => rendered,
            None => self.rendered(frame, is_due, None, self.context.progress)?,
        };
        let probing = self.probing(frame, &camera, &references)?;
        let mut audit = None;
        let mut findings = &ProbeFindings::default();
        if let Some(probed) = probing.probed() {
            audit = self.add_probes(frame, &camera, &references, probed, &mut rendered)?;
            findings = &probed.findings;
        }
        let Rendered { film, rays, reuse, sources, .. } = rendered;
        // The same order however the frame was cut for tracing, and as points are read from a file.
        let sources = self.context.pool.install(|| sources.in_rows());
        let kept = self.kept(frame, &camera, &sources, findings);
        if is_due {
            self.keep_own(frame, &camera, (&sources, findings), kept.as_ref());
        }
        Ok(Made { film, rays, reuse, audit, reference: kept })
    }

    /// Keeps the reference of a frame, as far as it is in use; `kept` is what the frame's file will hold of it.
    fn keep_own(
        &self,
        frame: u32,
        camera: &Camera,
        (sources, findings): (&TracedPoints, &ProbeFindings),
        kept: Option<&Arc<[u8]>>,
    ) {
        let own = camera.to_scene(&self.context.renderer.scene.recentring);
        let new = || Reference::new(frame, &own, sources, self.channels.len());
        let reference = self.context.pool.install(new).with_findings(findings.clone());
        self.keep(frame, reference);
        self.save_later(frame, camera, (sources, findings), kept);
    }

    /// Renders the pixels of `mask` of a representative, or all. Its probes show their first trace.
    fn rendered(
        &self,
        frame: u32,
        is_due: bool,
        mask: Option<&[bool]>,
        progress: &dyn Progress,
    ) -> Result<Rendered> {
        let references = self.references(&self.schedule.ancestors(frame))?;
        let camera = self.context.camera(frame)?;
        let probing = self.probing(frame, &camera, &references)?;
        let is_given_up = matches!(probing, Probing::GivenUp);
        let probed = probing.probed();
        let known = probed.map(|probed| probed.shown());
        let beyond_crop = is_due && !is_given_up;
        let is_source = !is_given_up && (is_due || self.terms.is_some());
        let job = FrameJob { mask, known, beyond_crop, ..self.context.job(frame, &camera) };
        let Some(probed) = probed.filter(|probed| probed.looked_up != LookedUp::Nothing) else {
            return self.render(job, is_source, None, progress);
        };
        self.with_lookup((frame, &camera), &references, |lookup| {
            let lookup = lookup.map(|lookup| probed.limited(lookup));
            let evidence = |_| &probed.evidence;
            let tolerance = self.context.renderer.settings.reuse.tolerance;
            let judged =
                lookup.as_ref().map(|lookup| Judged { lookup, evidence: &evidence, tolerance });
            let judged = judged.as_ref().map(|judged| judged as &dyn Inference);
            self.render(job, is_source, judged, progress)
        })
    }

    /// What probes decide for a representative.
    fn probing(
        &self,
        frame: u32,
        camera: &Camera,
        references: &[Arc<Reference>],
    ) -> Result<Probing> {
        if self.context.renderer.settings.reuse.probes == 0.0 {
            return Ok(Probing::NoSource);
        }
        let known = self.with_state(|s| s.probing.clone()).filter(|known| known.0 == frame);
        if let Some((_, probing)) = known {
            return Ok(probing);
        }
        let probing = self.with_lookup((frame, camera), references, |lookup| match lookup {
            None => Ok(Probing::NoSource),
            Some(lookup) if self.is_given_up(&lookup) => Ok(Probing::GivenUp),
            Some(lookup) => Ok(Probing::Probed(Arc::new(self.probe(frame, camera, &lookup)?))),
        })?;
        self.with_state(|s| s.probing = Some((frame, probing.clone())));
        Ok(probing)
    }

    /// Calls `act` with the lookup of `frame`, seen by `camera` (world space), in `references` and in
    /// those of other jobs; with `None` if there are no references.
    fn with_lookup<T>(
        &self,
        (frame, camera): (u32, &Camera),
        references: &[Arc<Reference>],
        act: impl FnOnce(Option<Lookup>) -> Result<T>,
    ) -> Result<T> {
        let own = camera.to_scene(&self.context.renderer.scene.recentring);
        let references = references.iter().map(|r| &**r).filter(|r| !r.is_empty()).collect();
        let nearest = |cache: &ReferenceCache| self.context.pool.install(|| cache.nearest(&own));
        let supplied = self.supplied.map_or(Ok(Vec::new()), nearest)?;
        let references = with_supplied(references, &supplied);
        let settings = self.context.renderer.settings;
        let channels = LookupChannel::all(&self.channels, settings);
        let lookup = Lookup { frame, references: &references, channels: &channels, specular: true };
        act((!references.is_empty()).then_some(lookup))
    }

    fn render(
        &self,
        job: FrameJob,
        is_source: bool,
        inference: Option<&dyn Inference>,
        progress: &dyn Progress,
    ) -> Result<Rendered> {
        let reuse = Reuse { channels: &self.channels, inference, is_source };
        let reuse = (!self.channels.is_empty()).then_some(reuse);
        self.context.render(&FrameJob { reuse, ..job }, progress)
    }

    /// The bytes of the reference that the file of `frame` holds for later jobs; `None` if it holds none.
    fn kept(
        &self,
        frame: u32,
        camera: &Camera,
        traced: &TracedPoints,
        findings: &ProbeFindings,
    ) -> Option<Arc<[u8]>> {
        let crop = self.context.renderer.settings.crop;
        self.encode(self.terms.as_ref()?, frame, camera, crop, (traced, findings))
    }

    fn encode(
        &self,
        terms: &Compatibility,
        frame: u32,
        camera: &Camera,
        crop: Option<Rect>,
        (traced, findings): (&TracedPoints, &ProbeFindings),
    ) -> Option<Arc<[u8]>> {
        let settings = &WriteOptions::of(self.context.renderer.settings, None).settings;
        let record = ReferenceRecord { terms, frame, camera, crop, traced, findings, settings };
        self.context.pool.install(|| record.encode()).map(Into::into)
    }

    /// The references of `representatives`, which are all in use.
    fn references(&self, representatives: &[u32]) -> Result<Vec<Arc<Reference>>> {
        representatives.iter().map(|representative| self.reference(*representative)).collect()
    }

    /// The reference of a representative, which is in use: from memory, from disk, or made.
    fn reference(&self, frame: u32) -> Result<Arc<Reference>> {
        let found = self.references.lock().get(frame).cloned();
        if let Some(found) = found.or_else(|| self.read_from_disk(frame)) {
            return Ok(found);
        }
        let is_asked = self.references.lock().asked(frame) > 0;
        let references = self.references(&self.schedule.ancestors(frame))?;
        let camera = self.context.camera(frame)?;
        match (self.probing(frame, &camera, &references)?, is_asked) {
            // Nobody wants its pixels, and it has no points. Ranks may have traced strips of it, since who plans them does
            // not know the findings.
            (Probing::GivenUp, false) => {
                drop(self.joined.take(frame));
                let nothing = (&TracedPoints::default(), &ProbeFindings::default());
                self.keep_own(frame, &camera, nothing, None);
            }
            (_, false) => drop(self.frame(frame)?),
            (_, true) => {
                let made = self.frame(frame)?;
                self.with_state(|s| s.early.insert(frame, made));
            }
        }
        let pool = self.references.lock();
        let lost = || Error::Failed(format!("the reference of frame {frame} is lost"));
        pool.get(frame).cloned().ok_or_else(lost)
    }

    /// The reference of a representative that an earlier run saved; `None` if the representative itself is asked
    /// for, since it is made anyway.
    fn read_from_disk(&self, frame: u32) -> Option<Arc<Reference>> {
        let checkpoints = self.checkpoints?;
        if self.references.lock().asked(frame) > 0 {
            return None;
        }
        let pixels = self.context.renderer.settings.pixel_count();
        let (reference, bytes) = self.context.pool.install(|| checkpoints.read(frame, pixels))?;
        self.keep(frame, reference);
        let mut pool = self.references.lock();
        pool.note_on_disk(frame);
        if self.exchange.is_some() {
            pool.set_export(frame, bytes);
        }
        pool.get(frame).cloned()
    }

    /// Keeps a reference in memory if it is in use.
    fn keep(&self, frame: u32, reference: Reference) {
        let mut pool = self.references.lock();
        pool.keep(&self.schedule, frame, || Arc::new(reference));
        pool.note_memory(memory);
    }

    /// Keeps the bytes of a frame's new reference for other ranks and for the disk, as far as needed.
    /// Only references of key frames are written to disk: they are expensive and used for long. Writing the
    /// others, one for every other frame, would take more time than making the few again that a kill
    /// loses. `kept` is the reference that the frame's file will hold.
    fn save_later(
        &self,
        frame: u32,
        camera: &Camera,
        traced: (&TracedPoints, &ProbeFindings),
        kept: Option<&Arc<[u8]>>,
    ) {
        let saves = |c: &&Checkpoints| c.every.is_some() && self.pyramid.is_key(frame);
        let saved = self.checkpoints.filter(saves);
        let Some(terms) = self.exchange.as_ref().or(saved.map(|c| c.terms)) else {
            return;
        };
        let start = Instant::now();
        // A cropped frame's file holds less.
        let bytes = match kept.filter(|_| self.context.renderer.settings.crop.is_none()) {
            Some(bytes) => Some(Arc::clone(bytes)),
            None => self.encode(terms, frame, camera, None, traced),
        };
        let Some(bytes) = bytes else { return };
        let mut pool = self.references.lock();
        if self.exchange.is_some() {
            pool.set_export(frame, Arc::clone(&bytes));
        }
        if saved.is_some() {
            pool.set_unsaved(frame, Some(bytes));
            pool.save_cost.seconds += start.elapsed().as_secs_f64();
            drop(pool);
            self.save(false);
        }
    }

    fn save(&self, is_stopping: bool) {
        self.references.save(self.checkpoints, is_stopping, |bytes| Some(Arc::clone(bytes)));
    }

    fn with_state<T>(&self, act: impl FnOnce(&mut State) -> T) -> T {
        act(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// Bytes of a reference and of what is to be written of it.
fn memory(reference: &Arc<Reference>, unsaved: Option<&Arc<[u8]>>) -> u64 {
    reference.memory() + unsaved.map_or(0, |bytes| bytes.len() as u64)
}

impl State {
    /// The representative if it was made early, or a copy of it if it was returned last.
    fn take(&mut self, representative: u32) -> Option<Made> {
        let early = self.early.remove(&representative);
        let again = self.again.as_ref().filter(|(other, _)| *other == representative);
        again.map(|(_, made)| made.copy()).or(early)
    }

    /// Notes that a representative was returned and that `asked` copies are still to be returned. It is kept for
    /// the next copy.
    fn hand_out(&mut self, representative: u32, made: &Made, asked: u32) {
        let is_held = self.again.as_ref().is_some_and(|(other, _)| *other == representative);
        if asked == 0 && is_held {
            self.again = None;
        } else if asked > 0 && !is_held {
            self.again = Some((representative, made.copy()));
        }
    }
}

impl FrameGraph for SurfaceReuse<'_> {
    fn representative(&self, frame: u32) -> u32 {
        self.schedule.representative(frame)
    }

    fn needs(&self, representative: u32) -> Vec<u32> {
        self.schedule.ancestors(representative)
    }

    fn batches(&self, frames: &[u32]) -> Vec<Vec<u32>> {
        self.pyramid.batches(frames)
    }

    fn rank_batches(&self, representatives: &[u32]) -> Vec<Vec<u32>> {
        self.pyramid.rank_batches(representatives)
    }

    fn is_on_disk(&self, representative: u32) -> bool {
        self.checkpoints.is_some_and(|c| c.has(representative))
    }

    fn most_strips(&self) -> u32 {
        strips::most(self.context.renderer.settings.height)
    }
}

impl FrameMaker for SurfaceReuse<'_> {
    fn make(&self, frame: u32) -> Result<Made> {
        let representative = self.schedule.representative(frame);
        self.references.lock().expect_once(&self.schedule, frame);
        let mut made = match self.with_state(|s| s.take(representative)) {
            Some(made) => made,
            None => self.frame(representative)?,
        };
        let mut pool = self.references.lock();
        if frame == representative && self.checkpoints.is_some_and(|c| c.frames_hold_all) {
            // The frame's own file will hold the reference.
            pool.set_unsaved(representative, None);
        }
        pool.done(&self.schedule, representative);
        let asked = pool.asked(representative);
        drop(pool);
        self.with_state(|s| s.hand_out(representative, &made, asked));
        self.save(false);
        // Motion differs from the representative's.
        self.context.note_motion(frame, &mut made.film)?;
        Ok(made)
    }

    fn expect(&self, frames: &[u32]) {
        self.references.lock().expect(&self.schedule, frames);
    }

    fn stopped(&self) {
        self.save(true);
    }

    fn notes(&self) -> Vec<String> {
        self.checkpoints.map(Checkpoints::notes).unwrap_or_default()
    }

    fn save_cost(&self) -> SaveCost {
        self.references.lock().save_cost
    }

    fn reference_memory(&self) -> u64 {
        let supplied = self.supplied.map_or(0, ReferenceCache::most_memory);
        supplied + self.references.lock().most_memory
    }
}
