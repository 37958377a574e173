//! The one seam for tracing: [`Intersector`], with Embree and the f64 oracle behind it.
//!
//! Backends return a [`Hit`] and nothing more; `SurfaceInteraction` expands it, one function for
//! both, so that they can differ in the hit alone. All in scene space.

mod coarse;
mod coincident;
mod conservative;
pub mod court;
pub mod cut_outs;
mod derivatives;
mod embree;
mod facts;
mod interaction;
mod oracle;
mod sphere;
mod triangle;

pub use crate::ray::{Hit, PrimRef, Ray};
pub use derivatives::{corner_weights, curvature, uv_gradients, uv_of_set};
pub use embree::EmbreeIntersector;
pub use interaction::{PlaneError, RayEnd, SpawnPoint, SurfaceInteraction, lift_to_smooth};
pub use oracle::{CourtHit, Oracle};

use crate::error::Result;
use crate::scene::{IntersectorKind, Scene, Settings};
use crate::stats::RayCounts;

/// Closest-hit and any-hit queries, single and in batches. Batches of camera or shadow rays
/// should be coherent: neighbours first. Second tries and refused rays are added to `counts`;
/// the caller counts the rays themselves, since it knows their kind.
///
/// A ray that is not [`Ray::is_valid`] hits nothing and is never occluded.
///
/// ```
/// use tweenray::intersect::{Intersector, Oracle, PrimRef, Ray};
/// use tweenray::math::{DVec3, Rgb};
/// use tweenray::scene::{Material, World, WorldMesh};
/// use tweenray::stats::RayCounts;
///
/// let mut world = World::default();
/// let white = world.add_material(Material::diffuse("white", Rgb::ONE));
/// let corners = vec![DVec3::ZERO, DVec3::X, DVec3::Y];
/// world.meshes.push(WorldMesh::new("triangle", corners, vec![[0, 1, 2]], white));
/// // `false`: in the world's own coordinates.
/// let scene = world.into_scene(false)?;
/// let (oracle, mut counts) = (Oracle::new(&scene), RayCounts::default());
/// let ray = Ray::new(DVec3::new(0.25, 0.5, 2.0), -DVec3::Z);
/// let hit = oracle.intersect(&ray, &mut counts).expect("the triangle is in the way");
/// assert_eq!((hit.t, hit.u, hit.v), (2.0, 0.25, 0.5));
/// assert_eq!(hit.prim, PrimRef { geom_id: 0, prim_id: 0 });
/// // Something beyond the ray's end does not count.
/// assert!(!oracle.occluded(&Ray { tfar: 1.0, ..ray }, &mut counts));
/// # Ok::<(), tweenray::error::Error>(())
/// ```
pub trait Intersector: Sync {
    /// Closest hit, or `None`.
    fn intersect(&self, ray: &Ray, counts: &mut RayCounts) -> Option<Hit>;
    /// Whether anything lies between `tnear` and `tfar`.
    fn occluded(&self, ray: &Ray, counts: &mut RayCounts) -> bool;
    /// [`Self::intersect`] of every ray, into `hits` (same length); their numbers may be left
    /// rough ([`Hit::rough`]). What is hit is the same, but for rays that slip past a vertex onto a
    /// back: there the block decides whether backs are to be expected.
    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], counts: &mut RayCounts);
    /// [`Self::occluded`] of every ray, into `occluded` (same length).
    fn occluded_batch(&self, rays: &[Ray], occluded: &mut [bool], counts: &mut RayCounts);
    /// Description of the intersector, for reports: "Embree 4.3.3, packets of 16" or "f64 oracle".
    fn describe(&self) -> String;
    /// Memory that the acceleration structure holds, bytes.
    fn memory(&self) -> u64;
}

/// Builds the intersector that `settings` ask for: Embree's part with `threads` threads of its own,
/// the rest on those of the current rayon pool.
///
/// Errors: `Error::Embree` when Embree refuses or runs out of memory.
pub fn build<'s>(
    scene: &'s Scene,
    settings: &Settings,
    threads: usize,
) -> Result<Box<dyn Intersector + Send + 's>> {
    Ok(match settings.intersector {
        IntersectorKind::Embree => Box::new(EmbreeIntersector::of(scene, settings, threads)?),
        IntersectorKind::Oracle => Box::new(Oracle::new(scene)),
    })
}
