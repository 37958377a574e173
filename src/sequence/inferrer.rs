//! The maker that infers frames from others of their segment and traces what cannot be inferred.

use super::pyramid::Pyramid;
use super::{FrameMaker, Made};
use crate::error::Result;
use crate::inference::{Channels, Inference};
use crate::reuse::{self, Evidence, Lookup, Reference};
use crate::scene::{Camera, Shot};
use crate::shade::{FrameJob, Progress, Rendered, Renderer, Reuse};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError};

/// Infers in-between frames.
pub struct Inferrer<'a> {
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
    /// What counts as evidence.
    pub evidence: Evidence,
    pub(super) channels: Channels,
    /// Shadow rays of a camera sample, by channel.
    rays: Vec<u32>,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    /// Frames that are still to come.
    to_come: BTreeSet<u32>,
    references: BTreeMap<u32, Arc<Reference>>,
}

impl<'a> Inferrer<'a> {
    /// A maker of frames of `shot`.
    pub fn new(
        renderer: Renderer<'a>,
        shot: &'a Shot,
        pool: &'a rayon::ThreadPool,
        stop: &'a AtomicBool,
        progress: &'a dyn Progress,
        pyramid: Pyramid,
    ) -> Self {
        let channels = reuse::channels(renderer.scene, &renderer.plan, renderer.settings);
        let rays = channels.iter().map(|c| reuse::rays_of(c, renderer.settings)).collect();
        Self {
            renderer,
            shot,
            pool,
            with_gbuffer: false,
            stop,
            progress,
            pyramid,
            evidence: Evidence::default(),
            channels,
            rays,
            state: Mutex::default(),
        }
    }

    /// Renders `frame` from the references that it depends on, which are made first where they are
    /// not at hand.
    fn frame(&self, frame: u32) -> Result<Option<Rendered>> {
        let mut references = Vec::new();
        for other in self.pyramid.ancestors(frame) {
            match self.reference(other)? {
                Some(reference) => references.push(reference),
                None => return Ok(None),
            }
        }
        let camera = self.camera(frame)?;
        let references: Vec<&Reference> =
            references.iter().map(|r| &**r).filter(|r| !r.is_empty()).collect();
        let (rays, evidence) = (&self.rays, self.evidence);
        let lookup = Lookup { frame, references: &references, rays, evidence };
        let inference = (!references.is_empty()).then_some(&lookup as &dyn Inference);
        let job = FrameJob {
            camera: &camera,
            stream: frame,
            with_gbuffer: self.with_gbuffer,
            reuse: Some(Reuse { channels: &self.channels, inference }),
            mask: None,
        };
        let render = || self.renderer.render_job(&job, self.stop, self.progress);
        let Some(rendered) = self.pool.install(render) else { return Ok(None) };
        if self.is_needed(frame) {
            let own = camera.to_scene(&self.renderer.scene.recentring);
            let reference = Reference::new(frame, &own, &rendered.sources, self.channels.len());
            self.with_state(|s| s.references.insert(frame, Arc::new(reference)));
        }
        Ok(Some(rendered))
    }

    pub(super) fn camera(&self, frame: u32) -> Result<Camera> {
        let settings = self.renderer.settings;
        self.shot.camera(frame, settings.width, settings.height)
    }

    fn reference(&self, frame: u32) -> Result<Option<Arc<Reference>>> {
        if let Some(found) = self.with_state(|s| s.references.get(&frame).cloned()) {
            return Ok(Some(found));
        }
        if self.frame(frame)?.is_none() {
            return Ok(None);
        }
        Ok(self.with_state(|s| s.references.get(&frame).cloned()))
    }

    /// Whether a frame to come is inferred from `frame`.
    fn is_needed(&self, frame: u32) -> bool {
        self.with_state(|s| s.to_come.iter().any(|f| self.pyramid.ancestors(*f).contains(&frame)))
    }

    fn with_state<T>(&self, act: impl FnOnce(&mut State) -> T) -> T {
        act(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl FrameMaker for Inferrer<'_> {
    fn make(&self, frame: u32) -> Result<Option<Made>> {
        let Some(mut rendered) = self.frame(frame)? else { return Ok(None) };
        let Some(audit) = self.audit(frame, &mut rendered)? else { return Ok(None) };
        self.with_state(|s| s.to_come.remove(&frame));
        let kept: Vec<u32> = self.with_state(|s| s.references.keys().copied().collect());
        for other in kept.into_iter().filter(|f| !self.is_needed(*f)) {
            self.with_state(|s| s.references.remove(&other));
        }
        let Rendered { film, rays, reuse, .. } = rendered;
        Ok(Some(Made { film, rays, reuse, audit }))
    }

    fn batches(&self, frames: &[u32]) -> Vec<Vec<u32>> {
        self.pyramid.batches(frames)
    }

    fn expect(&self, frames: &[u32]) {
        self.with_state(|s| s.to_come.extend(frames));
    }
}
