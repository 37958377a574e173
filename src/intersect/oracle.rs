//! The f64 oracle: every ray against every triangle, each close call settled by the exact court.
//!
//! Of hits at the same `t` the lowest `(geom_id, prim_id)` wins; the conventions for edges, planes and
//! degenerate triangles are the court's ([`super::court`]). Holes are those of [`super::cut_outs`]. No tree: about a nanosecond a pair.

use super::conservative::{BLOCK, Block, ShearedRay, Triangles};
use super::court::{Line, Meeting, Place};
use super::{Hit, Intersector, PrimRef, Ray, cut_outs};
use crate::math::DVec3;
use crate::scene::Scene;
use crate::stats::{RayCounts, RayKind};
use rayon::prelude::*;

/// Rays that share one pass over the triangles.
const GROUP: usize = 64;

/// Brute force over a scene.
pub struct Oracle<'s> {
    scene: &'s Scene,
    triangles: Triangles,
    /// First triangle of each mesh, and one past the last.
    starts: Vec<usize>,
    /// Largest coordinate of any triangle.
    reach: f64,
    /// Whether any mesh has cut-outs.
    has_holes: bool,
}

/// A hit with the court's view of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CourtHit {
    /// The hit.
    pub hit: Hit,
    /// `Edge` where the ray passes exactly through an edge or vertex.
    pub place: Place,
}

impl<'s> Oracle<'s> {
    /// An oracle for `scene`; 36 bytes a triangle.
    pub fn new(scene: &'s Scene) -> Self {
        let corners = scene.meshes.iter().flat_map(|mesh| {
            let corner = |i: &u32| mesh.positions[*i as usize].to_array();
            mesh.triangles.iter().map(move |[a, b, c]| [corner(a), corner(b), corner(c)])
        });
        let mut starts = vec![0];
        for mesh in &scene.meshes {
            starts.push(starts[starts.len() - 1] + mesh.triangles.len());
        }
        let reach = scene
            .meshes
            .iter()
            .filter(|m| !m.bounds.is_empty())
            .fold(0f64, |reach, m| reach.max(m.bounds.largest_coordinate()));
        let triangles = Triangles::new(scene.triangle_count(), corners);
        let has_holes = scene.meshes.iter().any(|mesh| scene.mesh_mask(mesh).is_some());
        Self { scene, triangles, starts, reach, has_holes }
    }

    /// `ray` (valid) as the court sees it in this scene.
    pub fn line(&self, ray: &Ray) -> Line {
        Line::new(ray, self.reach)
    }

    /// Corners of a triangle; `None` for a sphere.
    pub fn corners(&self, prim: PrimRef) -> Option<[DVec3; 3]> {
        let mesh = self.scene.meshes.get(prim.geom_id as usize)?;
        Some(mesh.corners(prim.prim_id as usize))
    }

    /// Whether the triangle is there where `ray` meets it, and not a hole.
    pub fn is_there(&self, ray: &Ray, prim: PrimRef) -> bool {
        !self.has_holes || cut_outs::is_there(self.scene, ray, prim)
    }

    /// Where `ray` first hits a sphere between its ends; a hole is no hit.
    ///
    /// # Panics
    /// When `prim` is no sphere.
    pub fn sphere_root(&self, ray: &Ray, prim: PrimRef) -> Option<f64> {
        cut_outs::sphere_root(self.scene, ray, prim)
    }

    /// All hits of `ray` between its ends, nearest first, ties by primitive: a ray exactly through
    /// an edge hits all triangles there. Spheres count once, with their first root.
    pub fn all_hits(&self, ray: &Ray) -> Vec<CourtHit> {
        let mut hits = Vec::new();
        if ray.is_valid() {
            self.each_hit(std::slice::from_ref(ray), |_, hit| {
                hits.push(hit);
                true
            });
        }
        hits.sort_by(|a, b| a.hit.t.total_cmp(&b.hit.t).then(a.hit.prim.cmp(&b.hit.prim)));
        hits
    }

    /// All triangles that the line of `ray` meets or passes within `margin` (scene space), whatever
    /// the ray's ends, excluded primitive and holes.
    pub fn near(&self, ray: &Ray, margin: f64) -> Vec<PrimRef> {
        if !ray.is_valid() {
            return Vec::new();
        }
        let line = self.line(ray);
        let sheared = [ShearedRay::new(&line, margin)];
        let (mut work, mut passed, mut near) = (Block::default(), Vec::new(), Vec::new());
        for block in 0..self.triangles.blocks() {
            passed.clear();
            self.triangles.filter(block, &sheared, &mut work, &mut passed);
            let within = |t: &usize| line.distance(&self.triangles.corners(*t)) <= margin;
            let triangles = passed.iter().map(|(_, triangle)| *triangle as usize).filter(within);
            near.extend(triangles.map(|t| self.prim(t)));
        }
        near
    }

    fn prim(&self, triangle: usize) -> PrimRef {
        let geom = self.starts.partition_point(|start| *start <= triangle) - 1;
        PrimRef { geom_id: geom as u32, prim_id: (triangle - self.starts[geom]) as u32 }
    }

    /// Calls `on_hit(index of ray, hit)` for every hit of valid `rays`, in no order; a ray for which
    /// it returns false wants no more.
    fn each_hit(&self, rays: &[Ray], mut on_hit: impl FnMut(usize, CourtHit) -> bool) {
        let mut wants = vec![true; rays.len()];
        let lines: Vec<Line> = rays.iter().map(|ray| self.line(ray)).collect();
        let sheared: Vec<ShearedRay> =
            lines.iter().map(|line| ShearedRay::new(line, 0.0)).collect();
        self.sphere_hits(rays, &mut wants, &mut on_hit);
        let (mut work, mut passed) = (Block::default(), Vec::new());
        for block in 0..self.triangles.blocks() {
            if wants.iter().all(|wants| !wants) {
                break;
            }
            passed.clear();
            self.triangles.filter(block, &sheared, &mut work, &mut passed);
            for (index, triangle) in &passed {
                let (index, triangle) = (*index as usize, *triangle as usize);
                if !wants[index] {
                    continue;
                }
                let Some(meeting) = lines[index].meet(&self.triangles.corners(triangle)) else {
                    continue;
                };
                let (ray, prim) = (&rays[index], self.prim(triangle));
                let hit = counts(ray, &meeting, prim).filter(|_| self.is_there(ray, prim));
                if let Some(hit) = hit {
                    wants[index] = on_hit(index, hit);
                }
            }
        }
    }

    fn sphere_hits(
        &self,
        rays: &[Ray],
        wants: &mut [bool],
        on_hit: &mut impl FnMut(usize, CourtHit) -> bool,
    ) {
        let geom_id = self.scene.sphere_geom_id();
        for (index, ray) in rays.iter().enumerate() {
            for prim_id in 0..self.scene.spheres.len() as u32 {
                let prim = PrimRef { geom_id, prim_id };
                let Some(t) = self.sphere_root(ray, prim) else { continue };
                let hit = Hit { t, u: 0.0, v: 0.0, prim, rough: false };
                wants[index] &= on_hit(index, CourtHit { hit, place: Place::Inside });
            }
        }
    }

    /// Groups of rays on all threads, or on this one where it is a worker of a busy pool. Either
    /// way each ray's answer depends on nothing else.
    fn in_groups<T: Send>(
        &self,
        rays: &[Ray],
        out: &mut [T],
        answer: impl Fn(&[Ray], &mut [T]) + Sync,
    ) {
        let work = rays.len() * self.triangles.len();
        if rayon::current_thread_index().is_some() || work < GROUP * BLOCK {
            rays.chunks(GROUP).zip(out.chunks_mut(GROUP)).for_each(|(r, o)| answer(r, o));
        } else {
            // Few rays in many triangles: smaller groups, so that all threads have some.
            let group = rays.len().div_ceil(rayon::current_num_threads()).clamp(1, GROUP);
            let groups = rays.par_chunks(group).zip(out.par_chunks_mut(group));
            groups.for_each(|(r, o)| answer(r, o));
        }
    }
}

/// The hit, unless it lies beyond the ray's ends or on what the ray leaves.
fn counts(ray: &Ray, meeting: &Meeting, prim: PrimRef) -> Option<CourtHit> {
    let Meeting { t, u, v, place } = *meeting;
    let valid = prim != ray.exclude && (ray.tnear..=ray.tfar).contains(&t);
    valid.then_some(CourtHit { hit: Hit { t, u, v, prim, rough: false }, place })
}

/// The valid ones of `rays`, and where each came from; the others are counted.
fn valid(rays: &[Ray], counts: &mut RayCounts) -> (Vec<Ray>, Vec<usize>) {
    let valid = rays.iter().enumerate().filter(|(_, ray)| ray.is_valid());
    let (places, valid): (Vec<usize>, Vec<Ray>) = valid.map(|(i, ray)| (i, *ray)).unzip();
    counts[RayKind::Invalid] += (rays.len() - valid.len()) as u64;
    (valid, places)
}

impl Intersector for Oracle<'_> {
    fn intersect(&self, ray: &Ray, counts: &mut RayCounts) -> Option<Hit> {
        let mut hits = [None];
        self.intersect_batch(std::slice::from_ref(ray), &mut hits, counts);
        hits[0]
    }

    fn occluded(&self, ray: &Ray, counts: &mut RayCounts) -> bool {
        let mut occluded = [false];
        self.occluded_batch(std::slice::from_ref(ray), &mut occluded, counts);
        occluded[0]
    }

    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], counts: &mut RayCounts) {
        let (valid, places) = valid(rays, counts);
        let mut found = vec![None; valid.len()];
        self.in_groups(&valid, &mut found, |rays, hits: &mut [Option<Hit>]| {
            self.each_hit(rays, |index, CourtHit { hit, .. }| {
                if hits[index].is_none_or(|b| (hit.t, hit.prim) < (b.t, b.prim)) {
                    hits[index] = Some(hit);
                }
                true
            });
        });
        hits.fill(None);
        places.iter().zip(found).for_each(|(place, hit)| hits[*place] = hit);
    }

    fn occluded_batch(&self, rays: &[Ray], occluded: &mut [bool], counts: &mut RayCounts) {
        let (valid, places) = valid(rays, counts);
        let mut found = vec![false; valid.len()];
        self.in_groups(&valid, &mut found, |rays, occluded| {
            self.each_hit(rays, |index, _| {
                occluded[index] = true;
                false
            });
        });
        occluded.fill(false);
        places.iter().zip(found).for_each(|(place, hit)| occluded[*place] = hit);
    }

    fn describe(&self) -> String {
        "f64 oracle with an exact court".into()
    }

    fn memory(&self) -> u64 {
        self.triangles.memory()
    }
}

#[cfg(test)]
mod tests;
