//! Whitted radiance (Whitted, 1980) along camera rays, by kernels that [`EffectPlan`] selects.
//!
//! Takes a scene, an intersector and a camera; gives a film. Never looks at other frames.

use crate::effects::EffectPlan;
use crate::film::Film;
use crate::intersect::Intersector;
use crate::scene::{Camera, Scene, Settings};
use crate::stats::RayCounts;
use std::sync::atomic::AtomicBool;

/// What it takes to shade any frame of a job.
pub struct Renderer<'a> {
    /// The scene, scene space.
    pub scene: &'a Scene,
    /// The job's settings.
    pub settings: &'a Settings,
    /// What runs.
    pub plan: EffectPlan,
    /// What traces.
    pub intersector: &'a dyn Intersector,
}

/// Told about finished tiles, from any worker thread.
pub trait Progress: Sync {
    /// A tile is done: its share of the frame in `[0, 1]` and the rays it cast.
    fn tile_done(&self, share: f64, rays: &RayCounts);
}

impl Renderer<'_> {
    /// Renders frame number `frame` (from 1) through `camera` (world space) on the current rayon
    /// pool. `None` when `stop` was set before the frame was finished.
    ///
    /// The bytes depend on scene, settings, camera and frame number only.
    pub fn render(
        &self,
        camera: &Camera,
        frame: u32,
        with_gbuffer: bool,
        stop: &AtomicBool,
        progress: &dyn Progress,
    ) -> Option<(Film, RayCounts)> {
        let _ = (camera, frame, with_gbuffer, stop, progress);
        todo!()
    }
}
