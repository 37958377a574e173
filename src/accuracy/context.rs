//! What every trial shares: the scene, its move, the threads; and which scene and intersector a
//! setting is traced with.

use super::errors::displayed;
use crate::effects::EffectPlan;
use crate::error::{Error, Result};
use crate::film::Image;
use crate::intersect::{self, Intersector};
use crate::scene::{Scene, Settings, Shot};
use crate::shade::{Progress, Renderer};
use crate::stats::RayCounts;
use rayon::ThreadPool;
use std::sync::atomic::AtomicBool;

/// The scene and all that renders it.
pub struct TrialContext<'a> {
    /// As `rules.recentre` of the default wants it.
    pub scene: &'a Scene,
    /// The scene with that rule the other way, where a candidate turns it.
    pub otherwise: Option<&'a Scene>,
    /// The camera's move.
    pub shot: &'a Shot,
    /// The default settings.
    pub base: &'a Settings,
    /// The default's intersector.
    pub intersector: &'a dyn Intersector,
    /// Wall seconds that it took to build.
    pub build_seconds: f64,
    /// The threads that render.
    pub pool: &'a ThreadPool,
    /// Set when the sweep shall stop.
    pub stop: &'a AtomicBool,
}

impl<'a> TrialContext<'a> {
    /// The scene that `settings` are traced on.
    pub fn scene_of(&self, settings: &Settings) -> &'a Scene {
        match self.otherwise {
            Some(other) if settings.rules.recentre != self.base.rules.recentre => other,
            _ => self.scene,
        }
    }

    /// An intersector for `settings`; `None` where the default's serves.
    ///
    /// # Errors
    /// As [`intersect::build`].
    pub fn own_intersector(
        &self,
        settings: &Settings,
    ) -> Result<Option<Box<dyn Intersector + Send + 'a>>> {
        let same =
            |s: &Settings| (s.rules, s.intersector, s.isa.clone(), s.build_quality, s.compact);
        if same(settings) == same(self.base) {
            return Ok(None);
        }
        let (scene, threads) = (self.scene_of(settings), self.pool.current_num_threads());
        self.pool.install(|| intersect::build(scene, settings, threads)).map(Some)
    }

    /// Frame `frame` traced whole on the default's scene, as displayed; and the rays cast.
    ///
    /// # Errors
    /// [`Error::Stopped`]; those of cameras.
    pub fn trace(
        &self,
        settings: &Settings,
        intersector: &dyn Intersector,
        frame: u32,
    ) -> Result<(Image, RayCounts)> {
        let plan = EffectPlan::of(self.scene, settings);
        let renderer = Renderer { scene: self.scene, settings, plan, intersector };
        let camera = self.shot.camera(frame, settings.width, settings.height)?;
        let render = || {
            let (film, rays) = renderer.render(&camera, frame, false, self.stop, &NoProgress)?;
            Some((displayed(&film, settings), rays))
        };
        self.pool.install(render).ok_or(Error::Stopped)
    }
}

/// Nobody watches the tiles of a trial.
pub struct NoProgress;

impl Progress for NoProgress {
    fn tile_done(&self, _: f64, _: &RayCounts) {}
}
