//! The naive way, shown beside ours, and rays between spaces.

use tweenray::intersect::{Hit, Intersector, Ray, SurfaceInteraction};
use tweenray::scene::{HitRules, Recentring, Recheck, Scene};
use tweenray::stats::RayCounts;

/// Embree as it comes, with or without its ROBUST traversal.
pub fn stock(robust: bool) -> HitRules {
    HitRules { robust, retry: false, recheck: Recheck::Off, spawn_offset: false, recentre: false }
}

/// A world ray in scene space; `t` stays what it was.
pub fn to_scene(ray: &Ray, recentring: &Recentring) -> Ray {
    Ray { org: recentring.point_to_scene(ray.org), dir: ray.dir * recentring.scale(), ..*ray }
}

/// A hit's distance as the renderer uses it: that of a rough hit follows from the point that the
/// surface gives it.
pub fn distance(scene: &Scene, ray: &Ray, hit: &Hit) -> f64 {
    if !hit.rough {
        return hit.t;
    }
    let p = SurfaceInteraction::new(scene, ray, hit).p;
    (p - ray.org).dot(ray.dir) / ray.dir.length_squared()
}

/// Rays one by one, as mirrors and glass trace them, instead of in packets.
pub struct OneByOne<'a>(pub &'a dyn Intersector);

impl Intersector for OneByOne<'_> {
    fn intersect(&self, ray: &Ray, counts: &mut RayCounts) -> Option<Hit> {
        self.0.intersect(ray, counts)
    }

    fn occluded(&self, ray: &Ray, counts: &mut RayCounts) -> bool {
        self.0.occluded(ray, counts)
    }

    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], counts: &mut RayCounts) {
        for (ray, hit) in rays.iter().zip(hits) {
            *hit = self.0.intersect(ray, counts);
        }
    }

    fn occluded_batch(&self, rays: &[Ray], occluded: &mut [bool], counts: &mut RayCounts) {
        for (ray, out) in rays.iter().zip(occluded) {
            *out = self.0.occluded(ray, counts);
        }
    }

    fn describe(&self) -> String {
        self.0.describe()
    }

    fn memory(&self) -> u64 {
        self.0.memory()
    }
}
