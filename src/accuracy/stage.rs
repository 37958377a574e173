//! What every trial shares: the scene, its move, the threads; and which scene and intersector a
//! setting is traced with.

use crate::error::Result;
use crate::intersect::{self, Intersector};
use crate::scene::{Scene, Settings, Shot};
use rayon::ThreadPool;
use std::sync::atomic::AtomicBool;

/// The scene and all that renders it.
pub struct Stage<'a> {
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
    /// The threads that render.
    pub pool: &'a ThreadPool,
    /// Set when the sweep shall stop.
    pub stop: &'a AtomicBool,
}

impl<'a> Stage<'a> {
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
    /// Those of [`intersect::build`].
    pub fn own_intersector(
        &self,
        settings: &Settings,
    ) -> Result<Option<Box<dyn Intersector + Send + 'a>>> {
        let same = |s: &Settings| (s.rules, s.intersector, s.isa.clone());
        if same(settings) == same(self.base) {
            return Ok(None);
        }
        let (scene, threads) = (self.scene_of(settings), self.pool.current_num_threads());
        self.pool.install(|| intersect::build(scene, settings, threads)).map(Some)
    }
}
