//! The maker that infers frames from others of their segment and traces what cannot be inferred.

mod exchange;
mod probing;

use super::checkpoint::Checkpoints;
use super::pyramid::Pyramid;
use super::saved::{Keeps, Saved};
use super::schedule::{ReferencePool, Schedule};
use super::shared::JoinedStrips;
use super::supplied::{ReferenceCache, with_supplied};
use super::{FrameMaker, Made, SaveCost, previous_camera};
use crate::error::{Error, Result};
use crate::inference::{Channels, Inference, TracedPoints};
use crate::output::WriteOptions;
use crate::reuse::evidence::Finding;
use crate::reuse::store::{Compatibility, ReferenceRecord};
use crate::reuse::{self, Judged, Lookup, Reference};
use crate::scene::{Camera, Rect, Shot};
use crate::shade::{FrameJob, Progress, Rendered, Renderer, Reuse};
use probing::Probed;
use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError};

/// Infers in-between frames.
pub struct SurfaceReuse<'a> {
    /// What traces and shades.
    pub renderer: Renderer<'a>,
    /// Where the camera is when.
    pub shot: &'a Shot,
    /// The threads that render.
    pub pool: &'a rayon::ThreadPool,
    /// Whether films get their first-hit records.
    pub with_gbuffer: bool,
    /// Set when the job shall stop.
    pub stop: &'a AtomicBool,
    /// Hears of finished tiles.
    pub progress: &'a dyn Progress,
    /// Which frames depend on which.
    pub pyramid: Pyramid,
    /// Frames of other shots that all frames, key frames too, are inferred from.
    pub supplied: Option<&'a ReferenceCache>,
    /// On which terms frames serve later jobs as references; `None` where none is kept.
    pub terms: Option<Compatibility>,
    /// Where references are kept for a job that goes on after this one; `None` for nowhere.
    pub checkpoints: Option<&'a Checkpoints<'a>>,
    /// On which terms frames serve other ranks as references; `None` where there are none.
    pub exchange: Option<Compatibility>,
    /// Frames that came as strips.
    joined: JoinedStrips,
    pub(super) schedule: Schedule,
    pub(super) channels: Channels,
    state: Mutex<State>,
}

#[derive(Default)]
pub(super) struct State {
    pub(super) references: ReferencePool<Arc<Reference>>,
    /// Originals that were made as references before they were asked for.
    early: BTreeMap<u32, Made>,
    /// The last original that is asked for again, as its copies are.
    again: Option<(u32, Made)>,
    pub(super) saved: Saved,
    most_memory: u64,
    /// The frame whose probes were rendered last.
    probed: Option<(u32, Arc<Probed>)>,
    /// References for other ranks, until they are fetched.
    pub(super) exports: BTreeMap<u32, Arc<[u8]>>,
}

impl<'a> SurfaceReuse<'a> {
    /// A maker of frames of `shot`.
    ///
    /// Errors: those of the shot's cameras.
    pub fn new(
        renderer: Renderer<'a>,
        shot: &'a Shot,
        pool: &'a rayon::ThreadPool,
        stop: &'a AtomicBool,
        progress: &'a dyn Progress,
        pyramid: Pyramid,
    ) -> Result<Self> {
        let channels = reuse::channels(renderer.scene, &renderer.plan, renderer.settings);
        // Where nothing is worth a lookup every frame is a key frame.
        let pyramid = if channels.is_empty() { Pyramid { segment: 1, ..pyramid } } else { pyramid };
        Ok(Self {
            renderer,
            shot,
            pool,
            with_gbuffer: false,
            stop,
            progress,
            supplied: None,
            terms: None,
            checkpoints: None,
            exchange: None,
            joined: JoinedStrips::default(),
            schedule: Schedule::new(pyramid, shot)?,
            pyramid,
            channels,
            state: Mutex::default(),
        })
    }

    /// Renders an original from the references that it depends on, which are made first where they
    /// are not at hand; leaves a reference where one is needed.
    fn frame(&self, frame: u32) -> Result<Option<Made>> {
        let camera = self.camera(frame)?;
        let is_due = self.with_state(|s| s.references.is_due(frame));
        let Some(references) = self.references(&self.schedule.ancestors(frame))? else {
            return Ok(None);
        };
        let rendered = match self.joined.take(frame) {
            Some(rendered) => Some(rendered),
            None => self.rendered(frame, is_due, None, self.progress)?,
        };
        let Some(mut rendered) = rendered else { return Ok(None) };
        let Some(probed) = self.probes(frame, &camera, &references)? else { return Ok(None) };
        let mut audit = None;
        let mut findings = &[][..];
        if let Some(probed) = &probed {
            let shown = self.show_probes(frame, &camera, &references, probed, &mut rendered)?;
            let Some(shown) = shown else { return Ok(None) };
            (audit, findings) = (shown, &probed.findings);
        }
        let Rendered { film, rays, reuse, sources } = rendered;
        // In one order, however the frame was cut for tracing, and as they come back from a file.
        let sources = self.pool.install(|| sources.in_rows());
        let kept = self.kept(frame, &camera, &sources, findings);
        if is_due {
            let own = camera.to_scene(&self.renderer.scene.recentring);
            let channels = self.channels.len();
            let reference = self.pool.install(|| Reference::new(frame, &own, &sources, channels));
            let reference = reference.with_findings(findings.to_vec());
            self.with_state(|s| s.keep(&self.schedule, frame, reference));
            self.leave(frame, &camera, (&sources, findings), kept.as_ref());
        }
        Ok(Some(Made { film, rays, reuse, audit, reference: kept }))
    }

    /// Renders the pixels of an original that `mask` names, or all, but for its probes.
    fn rendered(
        &self,
        frame: u32,
        is_due: bool,
        mask: Option<&[bool]>,
        progress: &dyn Progress,
    ) -> Result<Option<Rendered>> {
        let Some(references) = self.references(&self.schedule.ancestors(frame))? else {
            return Ok(None);
        };
        let camera = self.camera(frame)?;
        let Some(probed) = self.probes(frame, &camera, &references)? else { return Ok(None) };
        let others = probed.as_ref().map(|probed| probed.others(mask));
        let job = FrameJob {
            camera: &camera,
            stream: frame,
            with_gbuffer: self.with_gbuffer,
            reuse: None,
            mask: others.as_deref().or(mask),
            beyond_crop: is_due,
        };
        let Some(probed) = probed.filter(|probed| probed.is_worth_lookups) else {
            return Ok(self.render(job, None, progress));
        };
        self.with_lookup((frame, &camera), &references, |lookup| {
            let evidence = |_| &probed.evidence;
            let tolerance = self.renderer.settings.reuse.tolerance;
            let judged =
                lookup.as_ref().map(|lookup| Judged { lookup, evidence: &evidence, tolerance });
            self.render(job, judged.as_ref().map(|judged| judged as &dyn Inference), progress)
        })
    }

    /// The probes of an original; the inner `None` where nothing can be inferred, the outer one when the
    /// job shall stop.
    fn probes(
        &self,
        frame: u32,
        camera: &Camera,
        references: &[Arc<Reference>],
    ) -> Result<Option<Option<Arc<Probed>>>> {
        if self.renderer.settings.reuse.probes == 0.0 {
            return Ok(Some(None));
        }
        self.with_lookup((frame, camera), references, |lookup| {
            lookup.map_or(Some(None), |lookup| self.probe(frame, camera, &lookup).map(Some))
        })
    }

    /// Lets `act` use what `references`, and those of other shots, tell about `frame`, which `camera` sees;
    /// `None` where there is none.
    fn with_lookup<T>(
        &self,
        (frame, camera): (u32, &Camera),
        references: &[Arc<Reference>],
        act: impl FnOnce(Option<Lookup>) -> T,
    ) -> Result<T> {
        let own = camera.to_scene(&self.renderer.scene.recentring);
        let references = references.iter().map(|r| &**r).filter(|r| !r.is_empty()).collect();
        let nearest = |cache: &ReferenceCache| self.pool.install(|| cache.nearest(&own));
        let supplied = self.supplied.map_or(Ok(Vec::new()), nearest)?;
        let references = with_supplied(references, &supplied);
        let settings = self.renderer.settings;
        let rays: Vec<u32> = self.channels.iter().map(|c| reuse::rays_of(c, settings)).collect();
        let lookup = Lookup { frame, references: &references, rays: &rays };
        Ok(act((!references.is_empty()).then_some(lookup)))
    }

    fn render(
        &self,
        job: FrameJob,
        inference: Option<&dyn Inference>,
        progress: &dyn Progress,
    ) -> Option<Rendered> {
        let reuse = Reuse { channels: &self.channels, inference };
        let job = FrameJob { reuse: (!self.channels.is_empty()).then_some(reuse), ..job };
        self.pool.install(|| self.renderer.render_job(&job, self.stop, progress))
    }

    /// What the file of `frame` keeps for later jobs.
    fn kept(
        &self,
        frame: u32,
        camera: &Camera,
        traced: &TracedPoints,
        findings: &[Finding],
    ) -> Option<Arc<[u8]>> {
        let crop = self.renderer.settings.crop;
        self.encode(self.terms.as_ref()?, frame, camera, crop, (traced, findings))
    }

    pub(super) fn encode(
        &self,
        terms: &Compatibility,
        frame: u32,
        camera: &Camera,
        crop: Option<Rect>,
        (traced, findings): (&TracedPoints, &[Finding]),
    ) -> Option<Arc<[u8]>> {
        let settings = &WriteOptions::of(self.renderer.settings, None).settings;
        let kept = ReferenceRecord { terms, frame, camera, crop, traced, findings, settings };
        self.pool.install(|| kept.encode()).map(Into::into)
    }

    pub(super) fn camera(&self, frame: u32) -> Result<Camera> {
        let settings = self.renderer.settings;
        self.shot.camera(frame, settings.width, settings.height)
    }

    /// The references of `originals`, all of them in use.
    fn references(&self, originals: &[u32]) -> Result<Option<Vec<Arc<Reference>>>> {
        originals.iter().map(|original| self.reference(*original)).collect()
    }

    /// The reference of an original, which is in use.
    fn reference(&self, frame: u32) -> Result<Option<Arc<Reference>>> {
        if let Some(found) = self.with_state(|s| s.references.get(frame).cloned()) {
            return Ok(Some(found));
        }
        if let Some(found) = self.left_on_disk(frame) {
            return Ok(Some(found));
        }
        let Some(made) = self.frame(frame)? else { return Ok(None) };
        self.with_state(|s| {
            if s.references.asked(frame) > 0 {
                s.early.insert(frame, made);
            }
            match s.references.get(frame) {
                Some(reference) => Ok(Some(reference.clone())),
                None => Err(Error::Failed(format!("the reference of frame {frame} is lost"))),
            }
        })
    }

    fn hand_out(&self, original: u32, made: Made) -> Result<Made> {
        self.with_state(|s| s.hand_out(&self.schedule, original, &made));
        self.put_away(false);
        Ok(made)
    }

    /// With what `frame` does not share with its original: its motion.
    fn finished(&self, frame: u32, mut made: Made) -> Result<Made> {
        let previous = previous_camera(self.shot, frame, self.renderer.settings)?;
        let camera = self.camera(frame)?;
        let film = &mut made.film;
        self.pool.install(|| self.renderer.note_motion(&camera, previous.as_ref(), film));
        Ok(made)
    }

    pub(super) fn with_state<T>(&self, act: impl FnOnce(&mut State) -> T) -> T {
        act(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl State {
    pub(super) fn keep(&mut self, schedule: &Schedule, frame: u32, reference: Reference) {
        self.references.keep(schedule, frame, || Arc::new(reference));
        self.note_memory();
    }

    /// Takes in a reference that another rank made.
    fn take(&mut self, frame: u32, reference: Reference) {
        self.references.take(frame, Arc::new(reference));
        self.note_memory();
    }

    fn note_memory(&mut self) {
        let held: u64 = self.references.held().map(|r| r.memory()).sum();
        self.most_memory = self.most_memory.max(held + self.saved.memory());
    }

    /// One more of an original that went out already.
    fn copy_of(&self, frame: u32) -> Option<Made> {
        self.again.as_ref().filter(|(other, _)| *other == frame).map(|(_, made)| made.copy())
    }

    /// An original goes out; it is held while the next copy of it may follow.
    fn hand_out(&mut self, schedule: &Schedule, frame: u32, made: &Made) {
        self.references.done(schedule, frame);
        let is_held = self.again.as_ref().is_some_and(|(other, _)| *other == frame);
        if self.references.asked(frame) == 0 {
            self.again = self.again.take().filter(|(other, _)| *other != frame);
        } else if !is_held {
            self.again = Some((frame, made.copy()));
        }
    }
}

impl FrameMaker for SurfaceReuse<'_> {
    fn make(&self, frame: u32) -> Result<Option<Made>> {
        let original = self.schedule.original(frame);
        let made = self.with_state(|s| {
            if s.references.asked(original) == 0 {
                s.references.expect(&self.schedule, &[frame]);
            }
            (s.early.remove(&original), s.copy_of(original))
        });
        let made = match made {
            (_, Some(copy)) => {
                return self.finished(frame, self.hand_out(original, copy)?).map(Some);
            }
            (Some(made), None) => made,
            (None, None) => match self.frame(original)? {
                Some(made) => made,
                None => return Ok(None),
            },
        };
        if frame == original && self.checkpoints.is_some_and(|c| c.frames_hold_all) {
            // Its own file is about to hold it.
            self.with_state(|s| s.saved.has_file(original));
        }
        self.finished(frame, self.hand_out(original, made)?).map(Some)
    }

    fn batches(&self, frames: &[u32]) -> Vec<Vec<u32>> {
        self.pyramid.batches(frames)
    }

    fn expect(&self, frames: &[u32]) {
        self.with_state(|s| s.references.expect(&self.schedule, frames));
    }

    fn stopped(&self) {
        self.put_away(true);
    }

    fn notes(&self) -> Vec<String> {
        self.checkpoints.map(Checkpoints::notes).unwrap_or_default()
    }

    fn save_cost(&self) -> SaveCost {
        self.with_state(|s| s.saved.cost)
    }

    fn reference_memory(&self) -> u64 {
        let supplied = self.supplied.map_or(0, ReferenceCache::most_memory);
        supplied + self.with_state(|s| s.most_memory)
    }
}
