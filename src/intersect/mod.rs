//! The one seam for tracing: [`Intersector`], with Embree and the f64 oracle behind it.
//!
//! Backends return a [`Hit`] and nothing more; `SurfaceInteraction` expands it, one function for
//! both, so that they can differ in the hit alone. All in scene space.

mod ray;

pub use ray::{Hit, PrimRef, Ray};

use crate::error::Result;
use crate::scene::{Scene, Settings};

/// Closest-hit and any-hit queries, single and in batches. Batches of camera or shadow rays
/// should be coherent: neighbours first.
pub trait Intersector: Sync {
    /// Closest hit, or `None`.
    fn intersect(&self, ray: &Ray) -> Option<Hit>;
    /// Whether anything lies between `tnear` and `tfar`.
    fn occluded(&self, ray: &Ray) -> bool;
    /// [`Self::intersect`] of every ray, into `hits` (same length).
    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>]);
    /// [`Self::occluded`] of every ray, into `occluded` (same length).
    fn occluded_batch(&self, rays: &[Ray], occluded: &mut [bool]);
    /// What traces, for reports: "Embree 4.3.3, avx512" or "f64 oracle".
    fn describe(&self) -> String;
    /// Memory that the acceleration structure holds, bytes.
    fn memory(&self) -> u64;
}

/// Builds the intersector that `settings` ask for; `threads` build it.
///
/// Errors: `Error::Embree` when Embree refuses or runs out of memory.
pub fn build<'s>(
    scene: &'s Scene,
    settings: &Settings,
    threads: usize,
) -> Result<Box<dyn Intersector + Send + 's>> {
    let _ = (scene, settings, threads);
    todo!()
}
