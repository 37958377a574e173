//! The maker that traces every frame on its own.

use super::{FrameMaker, Made};
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
        let made = self.pool.install(render);
        Ok(made.map(|(film, rays)| Made { film, rays, reuse: ReuseCounts::default(), audit: None }))
    }
}
