//! Embree behind the seam, with the rules that make its hits trustworthy.
//!
//! * Rays are validated before Embree sees them.
//! * A ray that starts far outside the scene is moved up to the scene's bounds in f64, since its
//!   f32 origin would be too coarse.
//! * A hit's `t, u, v` are recomputed in f64; one that lies beside its triangle is a phantom, and
//!   the ray goes on past it.
//! * Of coincident primitives the lowest `(geom_id, prim_id)` is hit.
//! * A ray that misses although it comes near some triangle (other than the backs of a closed mesh
//!   that it leaves) is tried again, turned by 4 ulp to one side and then to the other; and so is one
//!   that must have missed something before its hit, or met a phantom before it. Where Embree has no fused
//!   multiply-add, its errors are larger: there such a ray is also traced from where it enters boxes of a coarse tree.
//!
//! Shadow rays report no primitive: of these, only validation and coincidence reach them.
//!
//! In a scene with cut-outs a filter takes the holes out of what Embree finds (`cut_outs.rs`), for every ray alike.
//!
//! A batch goes through Embree, the second tries and the recheck a block at a time, so that each
//! step works on arrays; what they leave open is settled ray by ray.

mod block;
mod recheck;

use super::coarse::{Bundle, CoarseTree};
use super::coincident::{self, Copies};
use super::cut_outs::CutOuts;
use super::facts::MeshFacts;
use super::{Hit, Intersector, PrimRef, Ray};
use crate::embree::{
    BuildOptions, CastRays, CommittedScene, Packet, PacketHit, Quality, QueryFlags, SceneBuilder,
    SphereData,
};
use crate::error::Result;
use crate::math::{Bounds3, DVec3, orthonormal_basis};
use crate::scene::{BuildQuality, HitRules, Mesh, Scene, Settings};
use crate::stats::{RayCounts, RayKind};
use recheck::Located;

/// Half an ulp at 1 in f32.
const ROUNDING: f64 = 1.0 / (1u64 << 24) as f64;
/// Largest coordinate of an origin that is not moved: the recentred scene lies within ±1.
const NEAR: f64 = 4.0;
/// By how much of the way to the next start a try from nearby goes on past it.
const OVERLAP: f64 = 1e-2;
/// Phantoms that one ray may pass.
const MOST_PHANTOMS: usize = 4096;
/// Rays that go through the steps together: a block of the renderer's.
const BLOCK: usize = 64;
/// A fault that no build has but one by which `./x faults` shows that `tweenray verify` sees it: no
/// second try.
const PLANTED_NO_RETRY: bool = cfg!(feature = "planted-no-retry");

/// A scene traced by Embree.
pub struct EmbreeIntersector<'s> {
    committed: CommittedScene<'s>,
    scene: &'s Scene,
    rules: HitRules,
    /// Largest coordinate of an origin that is not moved.
    near: f64,
    /// Where a miss deserves a second try; spheres need none, since their test is exact. Empty where
    /// nothing is tried twice.
    coarse: CoarseTree,
    /// Whether what both turns leave in doubt is also traced from the boxes of `coarse`: where Embree rounds
    /// products and sums apart.
    searches: bool,
    meshes: Vec<MeshFacts>,
    bounds: Bounds3,
    /// Whether anything in the scene has cut-outs.
    has_holes: bool,
}

/// Embree's answer for a ray.
#[derive(Clone, Copy)]
struct Candidate {
    hit: PacketHit,
    /// How far the ray's origin was moved along it before Embree saw it.
    shift: f64,
}

/// What is known of a ray before a further try.
#[derive(Default)]
struct Known {
    /// The nearest hit so far.
    hit: Option<Hit>,
    /// What a further try cannot hit: the primitive of that hit, and phantoms.
    passed: Vec<PrimRef>,
}

impl Known {
    fn of(hit: Hit) -> Self {
        Self { hit: Some(hit), passed: vec![hit.prim] }
    }

    /// The part of `ray` in which a nearer hit may lie.
    fn before(&self, ray: &Ray) -> Ray {
        Ray { tfar: self.hit.map_or(ray.tfar, |hit| hit.t), ..*ray }
    }
}

/// How Embree sees a ray's direction: as it is, or turned by a few ulp to one side or the other.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Turn {
    None,
    OneWay,
    OtherWay,
}

/// The turned tries of a ray whose first query found nothing, a phantom, or what it cannot have met first:
/// one turn alone may lead past an outline, or past the vertex as well. (Two more, to the other sides,
/// find one in nine more of lost slivers: docs/decisions/016-vertices-leak.md.)
const TURNS: [Turn; 2] = [Turn::OneWay, Turn::OtherWay];

impl<'s> EmbreeIntersector<'s> {
    /// Builds the BVH of `scene` with `threads` threads, and what stands beside it on those of the
    /// current rayon pool.
    ///
    /// Errors: `Error::Embree` for an unknown `isa`, or when memory runs out.
    pub fn new(
        scene: &'s Scene,
        rules: HitRules,
        isa: Option<&str>,
        threads: usize,
    ) -> Result<Self> {
        Self::of(
            scene,
            &Settings { rules, isa: isa.map(Into::into), ..Settings::default() },
            threads,
        )
    }

    /// [`Self::new`] with the rules, the instruction set and the kind of tree of `settings`.
    ///
    /// Errors: those of [`Self::new`].
    pub fn of(scene: &'s Scene, settings: &Settings, threads: usize) -> Result<Self> {
        let rules = settings.rules;
        let quality = match settings.build_quality {
            BuildQuality::Low => Quality::Low,
            BuildQuality::Medium => Quality::Medium,
            BuildQuality::High => Quality::High,
        };
        let options = BuildOptions {
            threads,
            isa: settings.isa.as_deref(),
            robust: rules.robust,
            quality,
            compact: settings.compact,
        };
        let near = if rules.recentre { NEAR } else { f64::INFINITY };
        let mut builder = SceneBuilder::new(&options)?;
        let Copies { hidden, behind } = coincident::copies(scene);
        let cut_outs = CutOuts::of(scene, behind);
        let has_holes = cut_outs.is_some();
        if let Some(cut_outs) = cut_outs {
            builder.set_holes(Box::new(cut_outs));
        }
        let copies_in = |geom_id: u32| {
            let first = hidden.partition_point(|copy| copy.geom_id < geom_id);
            let end = hidden.partition_point(|copy| copy.geom_id <= geom_id);
            hidden[first..end].iter().map(|copy| copy.prim_id)
        };
        for (mesh, geom_id) in scene.meshes.iter().zip(0..) {
            let omit = copies_in(geom_id);
            builder.add_triangles(&mesh.positions, mesh.vertex_count, &mesh.triangles, omit)?;
        }
        let spheres = scene.spheres.iter();
        let spheres =
            spheres.map(|s| SphereData { centre: s.centre.to_array(), radius: s.radius }).collect();
        builder.add_spheres(spheres, copies_in(scene.sphere_geom_id()))?;
        let margin = rounding_margin(&scene.bounds);
        let meshes: Vec<MeshFacts> = scene.meshes.iter().map(|m| facts_of(scene, m)).collect();
        let coarse = match rules.retry {
            true => CoarseTree::new(scene, &meshes, margin),
            false => CoarseTree::default(),
        };
        let Bounds3 { min, max } = scene.bounds;
        let bounds = Bounds3 { min: min - margin, max: max + margin };
        let committed = builder.commit()?;
        let searches = !options.fuses();
        Ok(Self { committed, scene, rules, near, coarse, searches, meshes, bounds, has_holes })
    }

    /// Whether the ray's f32 origin would be too coarse.
    fn is_far(&self, ray: &Ray) -> bool {
        ray.org.abs().max_element() > self.near
    }

    /// The ray that Embree should see, and by how much its origin was moved along it; `None` for
    /// a ray that passes the scene by.
    fn approach(&self, ray: &Ray) -> Option<(Ray, f64)> {
        if !self.is_far(ray) {
            return Some((*ray, 0.0));
        }
        let (near, _) = self.bounds.clip(ray.org, 1.0 / ray.dir, ray.tnear, ray.tfar)?;
        let moved =
            Ray { org: ray.at(near), tnear: ray.tnear - near, tfar: ray.tfar - near, ..*ray };
        Some((moved, near))
    }

    /// The ray, whose origin the approach moved by `shift`, turned by 4 ulp of f32, across: a factor on
    /// each component would leave an axis-parallel direction, the likeliest to pass through a vertex, as
    /// it is.
    ///
    /// After the approach, since from afar 4 ulp would lead past what is looked at. But a moved origin
    /// may lie within an ulp of a vertex at the scene's rim, and turned about it the ray would go
    /// through that vertex again: such a ray is turned about a point a scene's size before.
    fn nudged(&self, ray: &Ray, shift: f64, turn: Turn) -> Ray {
        let by = match turn {
            Turn::None => return *ray,
            Turn::OneWay => 8.0 * ROUNDING,
            Turn::OtherWay => -8.0 * ROUNDING,
        };
        let length = ray.dir.length();
        let (across, _) = orthonormal_basis(ray.dir / length);
        let before = if shift == 0.0 { 0.0 } else { self.bounds.largest_coordinate() };
        let org = ray.org + across * (by * before);
        Ray { org, dir: ray.dir + across * (by * length), ..*ray }
    }

    fn retries(&self) -> bool {
        self.rules.retry && !PLANTED_NO_RETRY
    }

    /// One Embree query that cannot hit the `passed` primitives.
    fn query(&self, ray: &Ray, turn: Turn, passed: &[PrimRef]) -> Option<Candidate> {
        let (moved, shift) = self.approach(ray)?;
        self.query_as(ray, &self.nudged(&moved, shift, turn), shift, passed)
    }

    /// [`Self::query`] of `ray` as Embree shall see it: `moved` by `shift` along it.
    fn query_as(
        &self,
        ray: &Ray,
        moved: &Ray,
        shift: f64,
        passed: &[PrimRef],
    ) -> Option<Candidate> {
        let mut packet = Packet::<1>::new();
        packet.set(0, moved);
        let exclude = moved.exclude != PrimRef::NONE;
        let cast = CastRays::moved(std::slice::from_ref(moved), std::slice::from_ref(ray));
        let flags = QueryFlags { coherent: false, exclude, passed };
        self.committed.intersect(&[-1], &mut packet, cast, flags);
        packet.hit(0).map(|hit| Candidate { hit, shift })
    }

    /// The first true hit of a valid ray.
    fn first_hit(&self, ray: &Ray, counts: &mut RayCounts) -> Option<Hit> {
        let Some(candidate) = self.query(ray, Turn::None, &[]) else {
            return self.settle(ray, None, counts);
        };
        let prim = candidate.hit.prim;
        let Some(hit) = self.recheck(ray, &candidate) else {
            return self.settle(ray, Some(prim), counts);
        };
        let along = candidate.hit.ng.as_dvec3().dot(ray.dir);
        let is_doubtful =
            || self.is_doubtful(ray, prim, along) || recheck::is_displaced(ray, &candidate, &hit);
        if !self.retries() || !is_doubtful() {
            return Some(hit);
        }
        self.hit_before(ray, Known::of(hit), counts)
    }

    /// Whether the ray must have met another triangle before: from outside of a closed surface it
    /// meets a front first, and once it went in, in glass say, a back of the same mesh. From inside of one with
    /// cut-outs it may have come out through a hole, so that neither proves anything: both are in doubt.
    ///
    /// The hit lies on `prim`; `along` is the product of its normal and the ray's direction (0 for a sphere, into which
    /// nothing slips).
    #[inline(always)]
    fn is_doubtful(&self, ray: &Ray, prim: PrimRef, along: f64) -> bool {
        let left = ray.exclude.geom_id;
        let met = self.meshes.get(prim.geom_id as usize);
        let back = met.is_some_and(|mesh| along * mesh.sense > 0.0);
        // The front of another mesh is right wherever the ray runs; so the triangle that it leaves is
        // mostly not looked at.
        if !back && prim.geom_id != left {
            return false;
        }
        let inside = self.scene.meshes.get(left as usize).is_some_and(|mesh| {
            let [a, b, c] = mesh.corners(ray.exclude.prim_id as usize);
            (b - a).cross(c - a).dot(ray.dir) * self.meshes[left as usize].sense < 0.0
        });
        let perforated = || self.meshes.get(left as usize).is_some_and(|mesh| mesh.perforated);
        inside != back || (inside && perforated())
    }

    /// The first true hit of `ray` that a `query` finds, which cannot hit the passed primitives, if it is nearer than the
    /// `known` one. Phantoms join those that were passed, and so do hits that are not nearer or that Embree displaced: it may
    /// have taken a needle for nearer than what lies before it, and another one next.
    fn pursue(
        &self,
        ray: &Ray,
        known: &mut Known,
        query: impl Fn(&[PrimRef]) -> Option<Candidate>,
    ) -> Option<Hit> {
        let mut found = None;
        while known.passed.len() < MOST_PHANTOMS {
            let Some(candidate) = query(&known.passed) else { break };
            let nearest = found.or(known.hit);
            // All others lie behind it too.
            if nearest.is_some_and(|hit| f64::from(candidate.hit.t) + candidate.shift > hit.t) {
                break;
            }
            // Judged by the ray that was asked for: the nudge is smaller than the tolerance.
            let located = self.locate(ray, &candidate);
            let is_nearer = |again: &Located| nearest.is_none_or(|hit| again.lies_before(hit.t));
            if let Some(Located { hit, .. }) = located.filter(is_nearer) {
                found = Some(hit);
                if !recheck::is_displaced(ray, &candidate, &hit) {
                    break;
                }
            }
            known.passed.push(candidate.hit.prim);
        }
        found
    }

    /// The hit of a ray whose first query gave the phantom `phantom`, or nothing.
    #[cold]
    fn settle(&self, ray: &Ray, phantom: Option<PrimRef>, counts: &mut RayCounts) -> Option<Hit> {
        let mut known = Known { hit: None, passed: Vec::from_iter(phantom) };
        let behind = |passed: &[PrimRef]| self.query(ray, Turn::None, passed);
        let hit = phantom.and_then(|_| self.pursue(ray, &mut known, behind));
        // Embree hit the phantom in place of a triangle beside it: what lies behind is in doubt too.
        if !self.retries() || (hit.is_none() && !self.coarse.may_meet(&Bundle::of([ray])?)) {
            return hit;
        }
        known.passed.extend(hit.map(|hit| hit.prim));
        self.hit_before(ray, Known { hit, ..known }, counts)
    }

    /// The nearest hit: what further tries find before the `known` one, or that.
    #[cold]
    fn hit_before(&self, ray: &Ray, mut known: Known, counts: &mut RayCounts) -> Option<Hit> {
        let before = known.before(ray);
        for turn in TURNS {
            counts[RayKind::Retry] += 1;
            let query = |passed: &[PrimRef]| self.query(&before, turn, passed);
            if let Some(nearer) = self.pursue(&before, &mut known, query) {
                return Some(nearer);
            }
        }
        self.hit_from_nearby(ray, known, counts)
    }

    /// The same for tries from where the ray enters boxes of the coarse tree, each as far as the next one's start:
    /// Embree's errors grow with the distance from the origin.
    #[cold]
    fn hit_from_nearby(&self, ray: &Ray, mut known: Known, counts: &mut RayCounts) -> Option<Hit> {
        if !self.searches {
            return known.hit;
        }
        let before = known.before(ray);
        let mut starts = self.coarse.entries(&before).peekable();
        while let Some(start) = starts.next() {
            counts[RayKind::Retry] += 1;
            // A little further, so that rounding leaves no gap.
            let end = starts.peek().map_or(before.tfar, |next| next + OVERLAP * (next - start));
            let (tnear, tfar) = (before.tnear - start, end.min(before.tfar) - start);
            let moved = Ray { org: before.at(start), tnear, tfar, ..before };
            let query = |passed: &[PrimRef]| self.query_as(&before, &moved, start, passed);
            if let Some(nearer) = self.pursue(&before, &mut known, query) {
                return Some(nearer);
            }
        }
        known.hit
    }
}

fn facts_of(scene: &Scene, mesh: &Mesh) -> MeshFacts {
    let facts = MeshFacts::of(mesh);
    if scene.mesh_mask(mesh).is_some() { facts.with_holes() } else { facts }
}

/// How far rounding a ray to f32 may move it within `bounds`.
fn rounding_margin(bounds: &Bounds3) -> DVec3 {
    DVec3::splat(16.0 * ROUNDING * bounds.largest_coordinate())
}

impl Intersector for EmbreeIntersector<'_> {
    fn intersect(&self, ray: &Ray, counts: &mut RayCounts) -> Option<Hit> {
        if !ray.is_valid() {
            counts[RayKind::Invalid] += 1;
            return None;
        }
        self.first_hit(ray, counts)
    }

    fn occluded(&self, ray: &Ray, counts: &mut RayCounts) -> bool {
        let mut out = [false];
        self.occluded_packets::<1>(std::slice::from_ref(ray), &mut out, counts);
        out[0]
    }

    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], counts: &mut RayCounts) {
        for (rays, hits) in rays.chunks(BLOCK).zip(hits.chunks_mut(BLOCK)) {
            match self.committed.packet_width() {
                8 => self.intersect_block::<8>(rays, hits, counts),
                _ => self.intersect_block::<4>(rays, hits, counts),
            }
        }
    }

    fn occluded_batch(&self, rays: &[Ray], occluded: &mut [bool], counts: &mut RayCounts) {
        match self.committed.packet_width() {
            8 => self.occluded_packets::<8>(rays, occluded, counts),
            _ => self.occluded_packets::<4>(rays, occluded, counts),
        }
    }

    fn describe(&self) -> String {
        let version = self.committed.library_version();
        format!("Embree {version}, packets of {}", self.committed.packet_width())
    }

    fn memory(&self) -> u64 {
        self.committed.memory() + self.coarse.memory()
    }
}

#[cfg(test)]
mod tests;
