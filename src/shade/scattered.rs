//! A few pixels of a frame, wherever they lie: eight of them make a block, which fills packets and leaves
//! enough blocks for all threads; no film is made for them.

use super::adaptive::Until;
use super::kernel::Scratch;
use super::pixels::{BlockPixels, SampleLimits};
use super::{FrameJob, Left, Renderer, Sampling};
use crate::math::Rgb;
use crate::scene::Camera;
use crate::stats::RayCounts;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// Pixels traced together.
const TOGETHER: usize = 8;

impl Renderer<'_> {
    /// Traces the pixels at `places` (column, row) of the frame seen by `camera` (world space), with
    /// the random numbers of `stream`, on the current rayon pool: their radiance, in order. `None`
    /// when `stop` was set before all were finished.
    pub fn render_scattered(
        &self,
        camera: &Camera,
        stream: u32,
        places: &[(u32, u32)],
        stop: &AtomicBool,
    ) -> Option<(Vec<Rgb>, RayCounts)> {
        let input =
            self.input(&FrameJob { sampling: Sampling::Alone, ..FrameJob::whole(camera, stream) });
        let kernel = self.kernel();
        let until = Until::Count(self.settings.spp);
        let limits = SampleLimits { most: self.settings.most_radiance(), spread: None };
        let start = || (BlockPixels::new(false, limits), Scratch::default());
        let one = |state: &mut (BlockPixels, Scratch), group: &[(u32, u32)]| {
            if stop.load(Ordering::Relaxed) {
                return None;
            }
            let (pixels, scratch) = state;
            pixels.start_scattered(group, self.settings.seed, stream);
            let rays = kernel(self, &input, &until, pixels, scratch, &mut Left::default());
            let finished = pixels.finished(self.settings.flag_bad);
            Some((finished.map(|p| p.rgb).collect::<Vec<_>>(), rays))
        };
        let done: Option<Vec<_>> = places.par_chunks(TOGETHER).map_init(start, one).collect();
        let mut radiance = Vec::with_capacity(places.len());
        let mut rays = RayCounts::default();
        for (part, cast) in done? {
            radiance.extend(part);
            rays += cast;
        }
        Some((radiance, rays))
    }
}
