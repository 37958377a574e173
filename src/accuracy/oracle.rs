//! Embree against the oracle on a small crop: what trusting Embree is worth.

use super::change::Change;
use super::context::TrialContext;
use super::errors::Frames;
use crate::error::Result;
use crate::intersect::{Intersector, Oracle};
use crate::scene::{Policy, Rect, Settings};
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// Seconds that the oracle may take, roughly.
const SECONDS: f64 = 10.0;
/// Seconds that it holds one ray against one triangle, on one thread, roughly.
const PER_TRIANGLE: f64 = 1e-8;
/// Rays that a pixel casts with one sample of everything, roughly: glass branches.
const RAYS: f64 = 10.0;
/// The least and the most edge of the crop, pixels.
const EDGE: (f64, f64) = (8.0, 96.0);

/// How the crop came out.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct OracleCrop {
    /// Columns and rows.
    pub size: [u32; 2],
    /// The frame.
    pub frame: u32,
    /// Triangles of the scene.
    pub triangles: usize,
    /// Rays that Embree cast.
    pub rays: u64,
    /// Wall seconds of Embree.
    pub embree_seconds: f64,
    /// Wall seconds of the oracle.
    pub oracle_seconds: f64,
    /// How the pixels differ.
    pub change: Change,
}

/// Renders a crop amid `frame` with the default's intersector and with the oracle, one camera sample a pixel and one
/// sample of each light, and compares the two. `None` where even the smallest crop would take the oracle longer than
/// about ten seconds, or where the default is the oracle.
///
/// # Errors
/// As [`TrialContext::trace`].
pub fn on_a_crop(context: &TrialContext, frame: u32) -> Result<Option<OracleCrop>> {
    let triangles = context.scene.triangle_count();
    let threads = context.pool.current_num_threads() as f64;
    let pixels = SECONDS * threads / (PER_TRIANGLE * RAYS * triangles.max(1) as f64);
    let is_oracle = context.base.intersector == crate::scene::IntersectorKind::Oracle;
    if pixels.sqrt() < EDGE.0 || is_oracle {
        return Ok(None);
    }
    let edge = pixels.sqrt().min(EDGE.1) as u32;
    let (width, height) = (context.base.width.min(edge), context.base.height.min(edge));
    let (x0, y0) = ((context.base.width - width) / 2, (context.base.height - height) / 2);
    let crop = Rect { x0, y0, x1: x0 + width, y1: y0 + height };
    let mut settings = context.base.clone();
    (settings.spp, settings.shadow_samples, settings.sky_samples) = (1, 1, 1);
    settings.most_spp = None;
    (settings.least_shadow_samples, settings.least_sky_samples) = (None, None);
    settings.crop = Some(crop);
    settings.reuse.policy = Policy::Off;
    let oracle = Oracle::new(context.scene);
    let (embree, rays, embree_seconds) = timed(context, &settings, context.intersector, frame)?;
    let (truth, _, oracle_seconds) = timed(context, &settings, &oracle, frame)?;
    let change =
        Change { pixels: u64::from(width) * u64::from(height), ..Change::between(&truth, &embree) };
    let size = [width, height];
    Ok(Some(OracleCrop { size, frame, triangles, rays, embree_seconds, oracle_seconds, change }))
}

/// The frame by `intersector`; rays, and wall seconds.
fn timed(
    context: &TrialContext,
    settings: &Settings,
    intersector: &dyn Intersector,
    frame: u32,
) -> Result<(Frames, u64, f64)> {
    let start = Instant::now();
    let (image, rays) = context.trace(settings, intersector, frame)?;
    Ok((Frames::from([(frame, image)]), rays.total(), start.elapsed().as_secs_f64()))
}
