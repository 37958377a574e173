//! The maker that traces every frame on its own.

use super::{FrameMaker, Made, previous_camera};
use crate::error::Result;
use crate::scene::Shot;
use crate::shade::{Progress, Renderer};
use crate::stats::ReuseCounts;
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
}

impl FrameMaker for Tracer<'_> {
    fn make(&self, frame: u32) -> Result<Option<Made>> {
        let settings = self.renderer.settings;
        let camera = self.shot.camera(frame, settings.width, settings.height)?;
        let render =
            || self.renderer.render(&camera, frame, self.with_gbuffer, self.stop, self.progress);
        let Some((mut film, rays)) = self.pool.install(render) else { return Ok(None) };
        let previous = previous_camera(self.shot, frame, settings)?;
        let note = || self.renderer.note_motion(&camera, previous.as_ref(), &mut film);
        self.pool.install(note);
        Ok(Some(Made { film, rays, reuse: ReuseCounts::default(), audit: None, reference: None }))
    }
}
