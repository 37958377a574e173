//! What all trials share: the scene, the camera's move, the threads; and the scene and intersector that a
//! setting is traced with.

use super::errors::displayed;
use crate::error::{Error, Result};
use crate::film::Image;
use crate::intersect::{self, Intersector};
use crate::scene::{Scene, Settings, Shot};
use crate::shade::Renderer;
use crate::stats::RayCounts;
use rayon::ThreadPool;
use std::sync::atomic::AtomicBool;

/// The scene and everything needed to render it.
pub struct TrialContext<'a> {
    /// The scene, recentred or not as `rules.recentre` of the default says.
    pub scene: &'a Scene,
    /// The scene with the opposite value of `rules.recentre`; `None` where no candidate needs it.
    pub otherwise: Option<&'a Scene>,
    /// The camera's move.
    pub shot: &'a Shot,
    /// The default settings.
    pub base: &'a Settings,
    /// The intersector of the default settings.
    pub intersector: &'a dyn Intersector,
    /// Wall seconds that `intersector` took to build.
    pub build_seconds: f64,
    /// The threads that render.
    pub pool: &'a ThreadPool,
    /// Set from outside to stop rendering.
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

    /// An intersector for `settings`; `None` where they need no other than [`Self::intersector`].
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

    /// Frame `frame` of [`Self::scene`], traced whole, as displayed; and the rays cast.
    ///
    /// # Errors
    /// [`Error::Stopped`]; errors of the camera's move.
    pub fn trace(
        &self,
        settings: &Settings,
        intersector: &dyn Intersector,
        frame: u32,
    ) -> Result<(Image, RayCounts)> {
        let renderer = Renderer::new(self.scene, settings, intersector);
        let camera = self.shot.camera(frame, settings.width, settings.height)?;
        let render = || {
            let (film, rays) = renderer.render(&camera, frame, false, self.stop, &())?;
            Some((displayed(&film, settings), rays))
        };
        self.pool.install(render).ok_or(Error::Stopped)
    }
}
