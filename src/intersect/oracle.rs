//! The f64 oracle: every ray against every triangle, nothing to trust but the formula.
//!
//! Slow on purpose. Of hits at the same `t` the lowest `(geom_id, prim_id)` wins.
//! Not done: exact predicates for edge ties.

use super::{Hit, Intersector, PrimRef, Ray, sphere, triangle};
use crate::math::DVec3;
use crate::scene::Scene;
use crate::stats::RayCounts;

/// Brute force over a scene.
pub struct Oracle<'s> {
    scene: &'s Scene,
    /// Corners of all triangles, mesh after mesh, widened once.
    corners: Vec<([DVec3; 3], PrimRef)>,
}

impl<'s> Oracle<'s> {
    /// An oracle for `scene`; 80 bytes a triangle.
    pub fn new(scene: &'s Scene) -> Self {
        let corners = scene.meshes.iter().enumerate().flat_map(|(geom, mesh)| {
            (0..mesh.triangles.len()).map(move |prim| {
                let prim_ref = PrimRef { geom_id: geom as u32, prim_id: prim as u32 };
                (mesh.corners(prim), prim_ref)
            })
        });
        Self { scene, corners: corners.collect() }
    }

    fn closest(&self, ray: &Ray) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        let mut offer = |hit: Hit| {
            let better = best.is_none_or(|b| (hit.t, hit.prim) < (b.t, b.prim));
            if better {
                best = Some(hit);
            }
        };
        for (corners, prim) in &self.corners {
            if let Some(hit) = meet(ray, corners, *prim) {
                offer(hit);
            }
        }
        let geom_id = self.scene.sphere_geom_id();
        for (index, s) in self.scene.spheres.iter().enumerate() {
            let prim = PrimRef { geom_id, prim_id: index as u32 };
            if let Some(t) = sphere::first_root(ray, s.centre, s.radius, prim == ray.exclude) {
                offer(Hit { t, u: 0.0, v: 0.0, prim, rough: false });
            }
        }
        best
    }
}

fn meet(ray: &Ray, corners: &[DVec3; 3], prim: PrimRef) -> Option<Hit> {
    if prim == ray.exclude {
        return None;
    }
    let hit = triangle::meet_plane(ray, corners)?;
    let inside = hit.u >= 0.0 && hit.v >= 0.0 && hit.u + hit.v <= 1.0;
    (inside && hit.t >= ray.tnear && hit.t <= ray.tfar).then_some(Hit {
        t: hit.t,
        u: hit.u,
        v: hit.v,
        prim,
        rough: false,
    })
}

impl Intersector for Oracle<'_> {
    fn intersect(&self, ray: &Ray, counts: &mut RayCounts) -> Option<Hit> {
        if ray.is_valid() {
            self.closest(ray)
        } else {
            counts.invalid += 1;
            None
        }
    }

    fn occluded(&self, ray: &Ray, counts: &mut RayCounts) -> bool {
        self.intersect(ray, counts).is_some()
    }

    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], counts: &mut RayCounts) {
        for (ray, hit) in rays.iter().zip(hits) {
            *hit = self.intersect(ray, counts);
        }
    }

    fn occluded_batch(&self, rays: &[Ray], occluded: &mut [bool], counts: &mut RayCounts) {
        for (ray, out) in rays.iter().zip(occluded) {
            *out = self.occluded(ray, counts);
        }
    }

    fn describe(&self) -> String {
        "f64 Möller–Trumbore oracle".into()
    }

    fn memory(&self) -> u64 {
        (self.corners.len() * size_of::<([DVec3; 3], PrimRef)>()) as u64
    }
}
