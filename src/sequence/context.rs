//! The parts that every maker of frames has, and the steps that all makers share.

use crate::error::{Error, Result};
use crate::film::Film;
use crate::scene::{Camera, Shot};
use crate::shade::{FrameJob, Progress, Rendered, Renderer};
use std::sync::atomic::AtomicBool;

/// The parts that every maker of frames has.
#[derive(Clone, Copy)]
pub struct FrameContext<'a> {
    /// Traces and shades.
    pub renderer: Renderer<'a>,
    /// The camera of each frame.
    pub shot: &'a Shot,
    /// The threads that render.
    pub pool: &'a rayon::ThreadPool,
    /// Whether films get first-hit records, which AOVs of exr frames need.
    pub with_gbuffer: bool,
    /// Set to true when the job is to stop.
    pub stop: &'a AtomicBool,
    /// Receives events about finished tiles.
    pub progress: &'a dyn Progress,
}

impl FrameContext<'_> {
    /// The camera of `frame`, world space.
    pub(super) fn camera(&self, frame: u32) -> Result<Camera> {
        let settings = self.renderer.settings;
        self.shot.camera(frame, settings.width, settings.height)
    }

    /// The job that traces all pixels of `frame` and gathers no points for other frames.
    pub(super) fn job<'j>(&self, frame: u32, camera: &'j Camera) -> FrameJob<'j> {
        FrameJob { with_gbuffer: self.with_gbuffer, ..FrameJob::whole(camera, frame) }
    }

    /// Renders `job` on the threads of the context.
    ///
    /// # Errors
    /// [`Error::Stopped`].
    pub(super) fn render(&self, job: &FrameJob, progress: &dyn Progress) -> Result<Rendered> {
        let render = || self.renderer.render_job(job, self.stop, progress);
        self.pool.install(render).ok_or(Error::Stopped)
    }

    /// Fills in the motion of the pixels of `frame` since the frame before, where `film` has first-hit
    /// records.
    ///
    /// # Errors
    /// Errors of the two frames' cameras.
    pub(super) fn note_motion(&self, frame: u32, film: &mut Film) -> Result<()> {
        let camera = self.camera(frame)?;
        let previous = (frame > 1).then(|| self.camera(frame - 1)).transpose()?;
        self.pool.install(|| self.renderer.note_motion(&camera, previous.as_ref(), film));
        Ok(())
    }
}
