//! Embree behind the seam, with the rules that make its hits trustworthy.
//!
//! * Rays are validated before Embree sees them.
//! * A ray that starts far outside the scene is moved up to the scene's bounds in f64, since its
//!   f32 origin would be too coarse.
//! * A hit's `t, u, v` are recomputed in f64; one that lies beside its triangle is a phantom, and
//!   the ray goes on past it.
//! * Of coincident primitives the lowest `(geom_id, prim_id)` is hit.
//! * A ray that misses although it comes near some triangle is tried again, turned by 4 ulp to one
//!   side and then to the other; and so is one that must have missed something before its hit,
//!   until a try finds something nearer or hits the same again.
//!
//! Shadow rays report no primitive, so only the first rule reaches them.
//!
//! A batch goes through Embree, the second tries and the recheck a block at a time, so that each
//! step works on arrays; what they leave open is settled ray by ray.

use super::coarse::{Bundle, CoarseTree};
use super::coincident;
use super::triangle::{self, Pairs, PlaneHit};
use super::{Hit, Intersector, PrimRef, Ray, sphere};
use crate::embree::{
    BuildOptions, CommittedScene, Packet, PacketHit, QueryFlags, SceneBuilder, SphereData,
};
use crate::error::Result;
use crate::math::{Bounds3, DVec3, orthonormal_basis};
use crate::scene::{HitRules, Mesh, Recheck, Scene};
use crate::stats::RayCounts;
use rayon::prelude::*;

/// Half an ulp at 1 in f32.
const ROUNDING: f64 = 1.0 / (1u64 << 24) as f64;
/// Largest coordinate of an origin that is not moved: the recentred scene lies within ±1.
const NEAR: f64 = 4.0;
/// Phantoms that one ray may pass.
const MOST_PHANTOMS: usize = 4096;
/// How far beside its triangle a ray may pass, per unit of the largest coordinate: 4 ulp, less the
/// rounding of measuring it. That is what rounding the ray to f32 explains.
const EDGE_BAND: f64 = 7.99 * ROUNDING;
/// Rays that go through the steps together: a block of the renderer's.
const BLOCK: usize = triangle::MOST;

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
    /// Where a miss deserves a second try; spheres need none, since their test is exact.
    coarse: CoarseTree,
    /// Longest edge of each mesh.
    longest_edges: Vec<f64>,
    bounds: Bounds3,
}

/// What Embree says of a ray.
#[derive(Clone, Copy)]
struct Candidate {
    hit: PacketHit,
    /// How far the ray's origin was moved along it before Embree saw it.
    shift: f64,
}

/// How Embree sees a ray's direction: as it is, or turned by a few ulp to one side or the other.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Turn {
    None,
    OneWay,
    OtherWay,
}

/// Lanes of a block, a bit each.
type Lanes = u64;

/// What came of another try.
struct Tried {
    /// These lanes hit something nearer.
    nearer: Lanes,
    /// These hit the same primitive again.
    confirmed: Lanes,
}

fn each(mut lanes: Lanes) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = lanes.trailing_zeros() as usize;
        lanes &= lanes.wrapping_sub(1);
        (lane < BLOCK).then_some(lane)
    })
}

impl<'s> EmbreeIntersector<'s> {
    /// Builds the BVH of `scene` with `threads` threads.
    ///
    /// Errors: `Error::Embree` for an unknown `isa`, or when memory runs out.
    pub fn new(
        scene: &'s Scene,
        rules: HitRules,
        isa: Option<&str>,
        threads: usize,
    ) -> Result<Self> {
        let near = if rules.recentre { NEAR } else { f64::INFINITY };
        let mut builder = SceneBuilder::new(&BuildOptions { threads, isa, robust: rules.robust })?;
        let copies = coincident::copies(scene);
        let copies_in = |geom_id: u32| {
            let first = copies.partition_point(|copy| copy.geom_id < geom_id);
            let end = copies.partition_point(|copy| copy.geom_id <= geom_id);
            copies[first..end].iter().map(|copy| copy.prim_id)
        };
        for (mesh, geom_id) in scene.meshes.iter().zip(0..) {
            let omit = copies_in(geom_id);
            builder.add_triangles(&mesh.positions, mesh.vertex_count, &mesh.triangles, omit)?;
        }
        let spheres = scene.spheres.iter();
        let spheres =
            spheres.map(|s| SphereData { centre: s.centre.to_array(), radius: s.radius }).collect();
        builder.add_spheres(spheres, copies_in(scene.sphere_geom_id()))?;
        let largest = largest_coordinate(&scene.bounds);
        let coarse = CoarseTree::new(scene, margin(largest));
        let longest_edges = scene.meshes.iter().map(longest_edge).collect();
        let bounds = padded(&scene.bounds);
        let committed = builder.commit()?;
        Ok(Self { committed, scene, rules, near, coarse, longest_edges, bounds })
    }

    /// The ray that Embree should see, and by how much its origin was moved along it; `None` for
    /// a ray that passes the scene by.
    fn approach(&self, ray: &Ray) -> Option<(Ray, f64)> {
        if ray.org.abs().max_element() <= self.near {
            return Some((*ray, 0.0));
        }
        let (near, _) = self.bounds.clip(ray.org, 1.0 / ray.dir, ray.tnear, ray.tfar)?;
        let moved =
            Ray { org: ray.at(near), tnear: ray.tnear - near, tfar: ray.tfar - near, ..*ray };
        Some((moved, near))
    }

    fn retries(&self) -> bool {
        self.rules.retry && !PLANTED_NO_RETRY
    }

    // ---- one ray -----------------------------------------------------------------------------

    /// One Embree query that cannot hit the `passed` primitives.
    fn query(&self, ray: &Ray, turn: Turn, passed: &[PrimRef]) -> Option<Candidate> {
        let (mut moved, shift) = self.approach(ray)?;
        // After the approach: from afar, 4 ulp would lead past what is looked at.
        if turn != Turn::None {
            moved = nudged(&moved, turn);
        }
        let mut packet = Packet::<1>::new();
        packet.set(0, &moved);
        let exclude = moved.exclude != PrimRef::NONE;
        let flags = QueryFlags { coherent: false, exclude, passed };
        self.committed.intersect(&[-1], &mut packet, std::slice::from_ref(&moved), flags);
        packet.hit(0).map(|hit| Candidate { hit, shift })
    }

    /// The first true hit of a valid ray.
    fn first_hit(&self, ray: &Ray, counts: &mut RayCounts) -> Option<Hit> {
        let Some(candidate) = self.query(ray, Turn::None, &[]) else {
            return self.settle(ray, None, counts);
        };
        let hit = self.recheck(ray, &candidate);
        if self.retries() && self.is_doubtful(ray, &candidate.hit) {
            for turn in [Turn::OneWay, Turn::OtherWay] {
                counts.retry += 1;
                let again = self.query(ray, turn, &[]);
                if again.is_some_and(|again| again.hit.prim == candidate.hit.prim) {
                    break;
                }
                let again = again.and_then(|again| self.recheck(ray, &again));
                if again.is_some_and(|again| hit.is_none_or(|hit| again.t < hit.t)) {
                    return again;
                }
                // Neither confirmed nor nearer: the turn may have led past an outline.
            }
        }
        hit.or_else(|| self.settle(ray, Some(candidate.hit.prim), counts))
    }

    /// Whether the ray must have met another triangle before: from outside of a closed surface it
    /// meets a front first, and once it went in, in glass say, a back of the same mesh.
    fn is_doubtful(&self, ray: &Ray, hit: &PacketHit) -> bool {
        let left = ray.exclude;
        let inside = self.scene.meshes.get(left.geom_id as usize).is_some_and(|mesh| {
            let [a, b, c] = mesh.corners(left.prim_id as usize);
            (b - a).cross(c - a).dot(ray.dir) < 0.0
        });
        if inside {
            !is_back(ray, hit) && hit.prim.geom_id == left.geom_id
        } else {
            is_back(ray, hit)
        }
    }

    /// The first true hit of `ray`, turned by a second try or not.
    fn pursue(&self, ray: &Ray, turn: Turn, passed: &mut Vec<PrimRef>) -> Option<Hit> {
        while passed.len() < MOST_PHANTOMS {
            let candidate = self.query(ray, turn, passed)?;
            // Judged by the ray that was asked for: the nudge is smaller than the tolerance.
            if let Some(hit) = self.recheck(ray, &candidate) {
                return Some(hit);
            }
            passed.push(candidate.hit.prim);
        }
        None
    }

    /// The hit of a ray whose first query gave the phantom `phantom`, or nothing.
    #[cold]
    fn settle(&self, ray: &Ray, phantom: Option<PrimRef>, counts: &mut RayCounts) -> Option<Hit> {
        let mut passed = Vec::new();
        if let Some(phantom) = phantom {
            passed.push(phantom);
            let hit = self.pursue(ray, Turn::None, &mut passed);
            if hit.is_some() {
                return hit;
            }
        }
        let bundle = Bundle::of([ray])?;
        if !self.retries() || !self.coarse.may_meet(&bundle) {
            return None;
        }
        [Turn::OneWay, Turn::OtherWay].into_iter().find_map(|turn| {
            counts.retry += 1;
            self.pursue(ray, turn, &mut passed)
        })
    }

    // ---- a block -----------------------------------------------------------------------------

    fn intersect_block<const W: usize>(
        &self,
        rays: &[Ray],
        hits: &mut [Option<Hit>],
        counts: &mut RayCounts,
    ) {
        hits.fill(None);
        let valid = valid_lanes(rays);
        counts.invalid += rays.len() as u64 - u64::from(valid.count_ones());
        if rays.iter().any(|ray| ray.org.abs().max_element() > self.near) {
            // Rays of a camera outside the scene: rare enough to go one by one.
            for lane in each(valid) {
                hits[lane] = self.first_hit(&rays[lane], counts);
            }
            return;
        }
        let mut found = [NOTHING; BLOCK];
        let mut hit = self.trace::<W>(rays, valid, &mut found);
        if self.retries() {
            let missed = self.missed_near(rays, valid & !hit);
            let mut doubtful = missed | back_faces(rays, hit, &found);
            for turn in [Turn::OneWay, Turn::OtherWay] {
                let tried = self.try_again::<W>(rays, doubtful, turn, &mut found, counts);
                hit |= tried.nearer;
                doubtful &= !(tried.nearer | tried.confirmed);
            }
        }
        for lane in each(self.recheck_block(rays, hit, &found, hits)) {
            hits[lane] = self.settle(&rays[lane], Some(found[lane].prim), counts);
        }
    }

    /// Sends the `valid` lanes through Embree in packets; returns those that hit.
    fn trace<const W: usize>(
        &self,
        rays: &[Ray],
        valid: Lanes,
        found: &mut [PacketHit; BLOCK],
    ) -> Lanes {
        let mut packet = Packet::<W>::new();
        let mut hit = 0;
        for (k, rays) in rays.chunks(W).enumerate() {
            let mut mask = [0; W];
            let mut exclude = false;
            for (lane, ray) in rays.iter().enumerate() {
                packet.set(lane, ray);
                mask[lane] = -((valid >> (k * W + lane) & 1) as i32);
                exclude |= ray.exclude != PrimRef::NONE;
            }
            let flags = QueryFlags { coherent: true, exclude, passed: &[] };
            self.committed.intersect(&mask, &mut packet, rays, flags);
            for lane in 0..rays.len() {
                if let Some(candidate) = packet.hit(lane) {
                    found[k * W + lane] = candidate;
                    hit |= 1 << (k * W + lane);
                }
            }
        }
        hit
    }

    /// The lanes of `missed` that may all the same have met a triangle.
    fn missed_near(&self, rays: &[Ray], missed: Lanes) -> Lanes {
        let bundle = Bundle::of(each(missed).map(|lane| &rays[lane]));
        if bundle.is_some_and(|bundle| self.coarse.may_meet(&bundle)) { missed } else { 0 }
    }

    /// Gives the `doubtful` lanes another try and keeps what it finds where that is nearer.
    fn try_again<const W: usize>(
        &self,
        rays: &[Ray],
        doubtful: Lanes,
        turn: Turn,
        found: &mut [PacketHit; BLOCK],
        counts: &mut RayCounts,
    ) -> Tried {
        let mut outcome = Tried { nearer: 0, confirmed: 0 };
        let tried = doubtful.count_ones();
        if tried == 0 {
            return outcome;
        }
        counts.retry += u64::from(tried);
        let mut again = [rays[0]; BLOCK];
        for (k, lane) in each(doubtful).enumerate() {
            again[k] = nudged(&rays[lane], turn);
        }
        let mut found_again = [NOTHING; BLOCK];
        let all = Lanes::MAX >> (BLOCK as u32 - tried);
        let hit_again = self.trace::<W>(&again[..tried as usize], all, &mut found_again);
        for (k, lane) in each(doubtful).enumerate() {
            let (was, again) = (found[lane], found_again[k]);
            if hit_again >> k & 1 == 0 {
                continue;
            }
            if again.prim == was.prim {
                outcome.confirmed |= 1 << lane;
            } else if is_well_before(&rays[lane], again.t, was.t) {
                found[lane] = again;
                outcome.nearer |= 1 << lane;
            }
        }
        outcome
    }

    fn occluded_packets<const W: usize>(
        &self,
        rays: &[Ray],
        occluded: &mut [bool],
        counts: &mut RayCounts,
    ) {
        let mut packet = Packet::<W>::new();
        for (rays, occluded) in rays.chunks(W).zip(occluded.chunks_mut(W)) {
            let mut mask = [0; W];
            let mut exclude = false;
            for (lane, ray) in rays.iter().enumerate() {
                packet.set(lane, ray);
                let valid = ray.is_valid();
                mask[lane] = -i32::from(valid);
                counts.invalid += u64::from(!valid);
                exclude |= ray.exclude != PrimRef::NONE;
            }
            let flags = QueryFlags { coherent: false, exclude, passed: &[] };
            self.committed.occluded(&mask, &mut packet, rays, flags);
            for (lane, out) in occluded.iter_mut().enumerate() {
                *out = mask[lane] != 0 && packet.is_occluded(lane);
            }
        }
    }

    // ---- the recheck -------------------------------------------------------------------------

    /// Whether the rules want `hit`, one of a block, recomputed before anybody looks at its triangle.
    #[inline(always)]
    fn is_wanted(&self, ray: &Ray, hit: &PacketHit) -> bool {
        match self.rules.recheck {
            Recheck::Always => true,
            Recheck::Risky => is_risky(ray, hit, self.longest_edges[hit.prim.geom_id as usize]),
            Recheck::Off => false,
        }
    }

    /// Rechecks the hits `found` in the lanes `hit`, many at once; returns the lanes whose hit may
    /// be a phantom.
    fn recheck_block(
        &self,
        rays: &[Ray],
        hit: Lanes,
        found: &[PacketHit; BLOCK],
        hits: &mut [Option<Hit>],
    ) -> Lanes {
        let mut pairs = Pairs::new();
        let mut lanes = [0u8; BLOCK];
        let mut corners = [[0u32; 3]; BLOCK];
        let mut wanted = 0;
        let mut open = 0;
        // Indices first, then vertices: so the processor waits for many cache misses at a time.
        for lane in each(hit) {
            let (ray, candidate) = (&rays[lane], &found[lane]);
            match self.scene.meshes.get(candidate.prim.geom_id as usize) {
                Some(mesh) if self.is_wanted(ray, candidate) => {
                    lanes[wanted] = lane as u8;
                    corners[wanted] = mesh.triangles[candidate.prim.prim_id as usize];
                    wanted += 1;
                }
                Some(_) => hits[lane] = Some(self.as_it_is(candidate, 0.0)),
                None => {
                    hits[lane] = self.recheck_sphere(ray, candidate.prim);
                    open |= Lanes::from(hits[lane].is_none()) << lane;
                }
            }
        }
        for (lane, corners) in lanes[..wanted].iter().zip(&corners) {
            let lane = *lane as usize;
            let mesh = &self.scene.meshes[found[lane].prim.geom_id as usize];
            pairs.push(&rays[lane], &corners.map(|i| mesh.positions[i as usize].as_dvec3()));
        }
        pairs.compute();
        for (k, lane) in lanes[..wanted].iter().map(|lane| *lane as usize).enumerate() {
            let met = pairs.get(k);
            let (ray, prim) = (&rays[lane], found[lane].prim);
            if met.is_inside() && (ray.tnear..=ray.tfar).contains(&met.t) {
                hits[lane] = Some(Hit { t: met.t, u: met.u, v: met.v, prim, rough: false });
            } else {
                hits[lane] = self.recheck(ray, &Candidate { hit: found[lane], shift: 0.0 });
                open |= Lanes::from(hits[lane].is_none()) << lane;
            }
        }
        open
    }

    /// The hit in f64, or `None` for a phantom.
    #[inline]
    fn recheck(&self, ray: &Ray, candidate: &Candidate) -> Option<Hit> {
        let hit = &candidate.hit;
        let Some(mesh) = self.scene.meshes.get(hit.prim.geom_id as usize) else {
            return self.recheck_sphere(ray, hit.prim);
        };
        if self.rules.recheck == Recheck::Off {
            return Some(self.as_it_is(hit, candidate.shift));
        }
        let corners = mesh.corners(hit.prim.prim_id as usize);
        // A ray in the triangle's plane hits nothing, nor is a triangle without an inside hit.
        let met = triangle::meet_plane(ray, &corners)?;
        let met = if met.is_inside() { met } else { beside(ray, &corners, met, candidate.shift)? };
        let PlaneHit { t, u, v } = met;
        (ray.tnear..=ray.tfar).contains(&t).then_some(Hit { t, u, v, prim: hit.prim, rough: false })
    }

    /// Embree's own numbers. Unless the recheck is off they are computed again when the surface is
    /// looked at.
    #[inline(always)]
    fn as_it_is(&self, hit: &PacketHit, shift: f64) -> Hit {
        let (t, u, v) = (f64::from(hit.t) + shift, f64::from(hit.u), f64::from(hit.v));
        Hit { t, u, v, prim: hit.prim, rough: self.rules.recheck != Recheck::Off }
    }

    fn recheck_sphere(&self, ray: &Ray, prim: PrimRef) -> Option<Hit> {
        let s = &self.scene.spheres[prim.prim_id as usize];
        let t = sphere::first_root(ray, s.centre, s.radius, prim == ray.exclude)?;
        Some(Hit { t, u: 0.0, v: 0.0, prim, rough: false })
    }
}

/// What a lane holds before Embree found anything.
const NOTHING: PacketHit = PacketHit {
    t: f32::INFINITY,
    u: 0.0,
    v: 0.0,
    ng: crate::math::Vec3::ZERO,
    prim: PrimRef::NONE,
};

/// The lanes of `hit` that met the back of a triangle, though most of the block's met a front: a ray
/// from outside of a closed surface meets its front first, unless it slipped through at a vertex.
fn back_faces(rays: &[Ray], hit: Lanes, found: &[PacketHit; BLOCK]) -> Lanes {
    let back = each(hit).filter(|lane| is_back(&rays[*lane], &found[*lane]));
    let back: Lanes = back.fold(0, |lanes, lane| lanes | 1 << lane);
    if 2 * back.count_ones() > hit.count_ones() { 0 } else { back }
}

/// Whether `t` lies before `other` on `ray` by more than both may be off.
fn is_well_before(ray: &Ray, t: f32, other: f32) -> bool {
    let length = ray.dir.length();
    let reach = ray.org.length() + f64::from(t) * length;
    f64::from(other - t) * length > 32.0 * ROUNDING * reach
}

fn is_back(ray: &Ray, hit: &PacketHit) -> bool {
    hit.ng.as_dvec3().dot(ray.dir) > 0.0
}

/// The lanes whose rays are valid.
fn valid_lanes(rays: &[Ray]) -> Lanes {
    rays.iter().enumerate().fold(0, |lanes, (k, ray)| lanes | Lanes::from(ray.is_valid()) << k)
}

/// The ray turned by 4 ulp of f32, across: a factor on each component would leave an
/// axis-parallel direction, the likeliest to pass through a vertex, as it is.
fn nudged(ray: &Ray, turn: Turn) -> Ray {
    let length = ray.dir.length();
    let (across, _) = orthonormal_basis(ray.dir / length);
    let by = if turn == Turn::OtherWay { -8.0 } else { 8.0 };
    Ray { dir: ray.dir + across * (by * ROUNDING * length), ..*ray }
}

/// Whether the ray may in truth pass beside the triangle that Embree named.
///
/// Embree's edge functions are off by about 10 half ulp of (edge x distance x direction), rounding
/// of vertices and ray included, and the weights are those over the triangle's area as the ray sees
/// it: grazing hits, slivers and hits near an edge fail the test. `edge` is the longest of the
/// mesh, so that no corner need be fetched.
#[inline(always)]
fn is_risky(ray: &Ray, hit: &PacketHit, edge: f64) -> bool {
    let least = hit.u.min(hit.v).min(1.0 - hit.u - hit.v);
    let length = ray.dir.length();
    let reach = ray.org.length() + f64::from(hit.t) * length;
    let area = hit.ng.as_dvec3().dot(ray.dir).abs();
    // Written so that NaN is risky.
    let is_safe = f64::from(least) * area > 16.0 * ROUNDING * edge * reach * length;
    !is_safe
}

/// Longest edge of a mesh's triangles, or a little more.
fn longest_edge(mesh: &Mesh) -> f64 {
    let longest = mesh.triangles.par_iter().map(|triangle| {
        let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
        let [x, y, z] = [b - a, c - b, a - c].map(|edge| edge.length_squared());
        x.max(y).max(z)
    });
    f64::from(longest.reduce(|| 0.0, f32::max)).sqrt() * (1.0 + 8.0 * ROUNDING)
}

/// Where a ray that meets its triangle's plane at `met`, outside, is nearest to the triangle, if that
/// is within the edge band. `None` for a phantom. The ray's origin was moved by `shift` along it.
fn beside(ray: &Ray, corners: &[DVec3; 3], met: PlaneHit, shift: f64) -> Option<PlaneHit> {
    let (nearest, distance) = triangle::nearest_on_outline(ray, corners)?;
    let largest = |p: DVec3| p.abs().max_element();
    let reach = corners.iter().fold(largest(ray.at(shift)), |reach, c| reach.max(largest(*c)));
    if distance > EDGE_BAND * reach {
        return None;
    }
    // The plane's own t, unless the ray grazes it: then that point may be far away.
    let apart = (met.t - nearest.t).abs() * ray.dir.length();
    Some(PlaneHit { t: if apart <= EDGE_BAND * reach { met.t } else { nearest.t }, ..nearest })
}

/// A box with a margin for the rounding of rays.
fn padded(bounds: &Bounds3) -> Bounds3 {
    let margin = margin(largest_coordinate(bounds));
    Bounds3 { min: bounds.min - margin, max: bounds.max + margin }
}

fn largest_coordinate(bounds: &Bounds3) -> f64 {
    bounds.min.abs().max(bounds.max.abs()).max_element()
}

/// How far rounding a ray to f32 may move it near points of this largest coordinate.
fn margin(largest: f64) -> DVec3 {
    DVec3::splat(16.0 * ROUNDING * largest)
}

impl Intersector for EmbreeIntersector<'_> {
    fn intersect(&self, ray: &Ray, counts: &mut RayCounts) -> Option<Hit> {
        if !ray.is_valid() {
            counts.invalid += 1;
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
