//! The maker that traces every frame on its own.

use super::shared::{JoinedStrips, RankMaker, Strip};
use super::strips::{self, NoProgress};
use super::{FrameMaker, Made, previous_camera};
use crate::error::Result;
use crate::scene::{Camera, Settings, Shot};
use crate::shade::{FrameJob, Progress, Rendered, Renderer};
use crate::stats::ReuseCounts;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Traces each frame through the shot's camera.
pub struct Tracer<'a> {
    /// What renders a film.
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
    /// Frames that came as strips.
    pub joined: JoinedStrips,
}

impl Tracer<'_> {
    fn render(
        &self,
        camera: &Camera,
        frame: u32,
        mask: Option<&[bool]>,
        progress: &dyn Progress,
    ) -> Option<Rendered> {
        let job = FrameJob {
            camera,
            stream: frame,
            with_gbuffer: self.with_gbuffer,
            reuse: None,
            mask,
            beyond_crop: false,
        };
        self.pool.install(|| self.renderer.render_job(&job, self.stop, progress))
    }

    fn camera(&self, frame: u32) -> Result<Camera> {
        let settings = self.renderer.settings;
        self.shot.camera(frame, settings.width, settings.height)
    }
}

impl FrameMaker for Tracer<'_> {
    fn make(&self, frame: u32) -> Result<Option<Made>> {
        let camera = self.camera(frame)?;
        let joined = self.joined.take(frame);
        let rendered = joined.or_else(|| self.render(&camera, frame, None, self.progress));
        let Some(Rendered { mut film, rays, .. }) = rendered else { return Ok(None) };
        let previous = previous_camera(self.shot, frame, self.renderer.settings)?;
        let note = || self.renderer.note_motion(&camera, previous.as_ref(), &mut film);
        self.pool.install(note);
        Ok(Some(Made { film, rays, reuse: ReuseCounts::default(), audit: None, reference: None }))
    }
}

impl RankMaker for Tracer<'_> {
    fn most_strips(&self) -> u32 {
        strips::most(self.renderer.settings.height)
    }

    fn render_strip(&self, original: u32, strip: Strip) -> Result<Option<Vec<u8>>> {
        let camera = self.camera(original)?;
        let mask = strips::mask(strip, camera.width, camera.height);
        let rendered = self.render(&camera, original, Some(&mask), &NoProgress);
        rendered.map(|rendered| strips::encode(rendered, strip)).transpose()
    }

    fn join_strips(&self, original: u32, strips: &[Arc<[u8]>]) -> Result<()> {
        let Settings { width, height, .. } = *self.renderer.settings;
        self.joined.put(original, strips::join(strips, width, height)?);
        Ok(())
    }
}
