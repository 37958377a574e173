//! A block of rays: through Embree in packets, the further tries and the recheck, each step on arrays.

use super::super::coarse::Bundle;
use super::super::triangle::{Pairs, STEP};
use super::recheck::{is_displaced, is_risky};
use super::{BLOCK, Candidate, EmbreeIntersector, Known, ROUNDING, TURNS, Turn};
use crate::embree::{CastRays, Packet, PacketHit, QueryFlags};
use crate::math::Vec3;
use crate::ray::{Hit, PrimRef, Ray};
use crate::scene::Recheck;
use crate::stats::{RayCounts, RayKind};

/// Rays of a block that are asked about together, whether they come near a triangle.
const PART: usize = 16;

/// Lanes of a block, a bit each.
type Lanes = u64;

fn each(mut lanes: Lanes) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = lanes.trailing_zeros() as usize;
        lanes &= lanes.wrapping_sub(1);
        (lane < BLOCK).then_some(lane)
    })
}

/// A block after Embree.
struct Block<'b> {
    /// As they were asked for.
    rays: &'b [Ray],
    /// How far each was moved along itself before Embree saw it.
    shifts: &'b [f64; BLOCK],
    found: &'b [PacketHit; BLOCK],
}

impl EmbreeIntersector<'_> {
    pub(super) fn intersect_block<const W: usize>(
        &self,
        rays: &[Ray],
        hits: &mut [Option<Hit>],
        counts: &mut RayCounts,
    ) {
        hits.fill(None);
        let mut valid = valid_lanes(rays);
        counts[RayKind::Invalid] += rays.len() as u64 - u64::from(valid.count_ones());
        // A camera more than a scene's size away: what Embree sees is moved up to the scene.
        let (mut moved, mut shifts, mut cast);
        (cast, shifts) = (rays, [0.0; BLOCK]);
        if each(valid).any(|lane| self.is_far(&rays[lane])) {
            moved = [rays[0]; BLOCK];
            for lane in each(valid) {
                match self.approach(&rays[lane]) {
                    Some((ray, shift)) => (moved[lane], shifts[lane]) = (ray, shift),
                    None => valid &= !(1 << lane),
                }
            }
            cast = &moved[..rays.len()];
        }
        let mut found = [NOTHING; BLOCK];
        let mut hit = self.trace::<W>(CastRays::moved(cast, rays), valid, &mut found);
        let (doubtful, mut at_once) = self.appraise(cast, hit, &found);
        if self.retries() {
            let mut doubtful = doubtful | self.missed_near(cast, valid & !hit);
            for turn in TURNS {
                let moved = CastRays::moved(cast, rays);
                let nearer =
                    self.try_again::<W>(moved, &shifts, doubtful, turn, &mut found, counts);
                hit |= nearer;
                at_once = at_once & !nearer | self.appraise(cast, nearer, &found).1;
                doubtful &= !nearer;
            }
            if self.searches {
                hit &= !self.search_nearby(rays, &shifts, doubtful, &found, hits, counts);
            }
        }
        let block = Block { rays, shifts: &shifts, found: &found };
        let (open, displaced) = self.recheck_block(&block, hit, at_once, hits);
        for lane in each(open) {
            hits[lane] = self.settle(&rays[lane], Some(found[lane].prim), counts);
        }
        if self.retries() {
            for lane in each(displaced) {
                let before = |hit| self.hit_before(&rays[lane], Known::of(hit), counts);
                hits[lane] = hits[lane].and_then(before);
            }
        }
    }

    /// Sends the `valid` lanes through Embree in packets; returns those that hit.
    fn trace<const W: usize>(
        &self,
        cast: CastRays,
        valid: Lanes,
        found: &mut [PacketHit],
    ) -> Lanes {
        let mut packet = Packet::<W>::new();
        let mut hit = 0;
        for (k, cast) in cast.chunks(W).enumerate() {
            let mask = fill(&mut packet, cast.rays(), valid >> (k * W));
            let flags = QueryFlags { coherent: true, exclude: false, passed: &[] };
            self.committed.intersect(&mask, &mut packet, cast, flags);
            self.trace_past_own(cast, &mut packet);
            for lane in 0..cast.rays().len() {
                if let Some(candidate) = packet.hit(lane) {
                    found[k * W + lane] = candidate;
                    hit |= 1 << (k * W + lane);
                }
            }
        }
        hit
    }

    /// Traces those rays again that met the triangle which they leave. Few do, since they start off
    /// it, and a filter on every ray's candidates costs more.
    fn trace_past_own<const W: usize>(&self, cast: CastRays, packet: &mut Packet<W>) {
        let mut mask = [0; W];
        for (lane, ray) in cast.rays().iter().enumerate() {
            let is_triangle = (ray.exclude.geom_id as usize) < self.meshes.len();
            if is_triangle && packet.hit(lane).is_some_and(|hit| hit.prim == ray.exclude) {
                packet.set(lane, ray);
                mask[lane] = -1;
            }
        }
        if mask != [0; W] {
            let flags = QueryFlags { coherent: false, exclude: true, passed: &[] };
            self.committed.intersect(&mask, packet, cast, flags);
        }
    }

    /// The lanes of `missed` that may all the same have met a triangle.
    fn missed_near(&self, rays: &[Ray], missed: Lanes) -> Lanes {
        let come_near = |lanes: Lanes| {
            let bundle = Bundle::of(each(lanes).map(|lane| &rays[lane]));
            bundle.is_some_and(|bundle| self.coarse.may_meet(&bundle))
        };
        if !come_near(missed) {
            return 0;
        }
        // Smaller bundles are slimmer.
        let parts = (0..BLOCK / PART).map(|k| missed & Lanes::MAX >> (BLOCK - PART) << (k * PART));
        parts.filter(|part| come_near(*part)).fold(0, |near, part| near | part)
    }

    /// The lanes of `hit` that must have met something before, and those to be rechecked before anybody looks
    /// at their surface.
    fn appraise(&self, rays: &[Ray], hit: Lanes, found: &[PacketHit; BLOCK]) -> (Lanes, Lanes) {
        let (mut doubtful, mut at_once) = (0, 0);
        for lane in each(hit) {
            let (ray, candidate) = (&rays[lane], &found[lane]);
            let prim = candidate.prim;
            // Spheres have no facts, and no normal here; their root is found in f64 whatever the rules.
            let Some(mesh) = self.meshes.get(prim.geom_id as usize) else {
                at_once |= 1 << lane;
                continue;
            };
            let along = candidate.ng.as_dvec3().dot(ray.dir);
            let is_doubtful = self.retries() && self.is_doubtful(ray, prim, along);
            doubtful |= Lanes::from(is_doubtful) << lane;
            let recheck = match self.rules.recheck {
                Recheck::Always => true,
                Recheck::Risky => is_risky(ray, candidate, along.abs(), mesh.longest_edge),
                Recheck::Off => false,
            };
            at_once |= Lanes::from(recheck) << lane;
        }
        // A camera inside of a surface sees backs only, and they are no sign of anything.
        let is_camera = |lane: usize| rays[lane].exclude == PrimRef::NONE;
        let sees_backs_only = doubtful == hit && each(hit).all(is_camera);
        (if sees_backs_only { 0 } else { doubtful }, at_once)
    }

    /// Gives the `doubtful` lanes another try and keeps what it finds where that is nearer; returns
    /// those that hit.
    fn try_again<const W: usize>(
        &self,
        cast: CastRays,
        shifts: &[f64; BLOCK],
        doubtful: Lanes,
        turn: Turn,
        found: &mut [PacketHit; BLOCK],
        counts: &mut RayCounts,
    ) -> Lanes {
        let rays = cast.rays();
        counts[RayKind::Retry] += u64::from(doubtful.count_ones());
        let mut hit = 0;
        let mut left = doubtful;
        // Few are, mostly: arrays for all of a block would be expensive to make.
        while left != 0 {
            let mut lanes = [0; PART];
            let mut again = [rays[0]; PART];
            let mut asked = self.has_holes.then_some(again);
            let mut tried = 0;
            for (k, lane) in each(left).take(PART).enumerate() {
                (lanes[k], again[k]) = (lane, self.nudged(&rays[lane], shifts[lane], turn));
                if let Some(asked) = &mut asked {
                    asked[k] = cast.asked()[lane];
                }
                left &= !(1 << lane);
                tried = k + 1;
            }
            let mut found_again = [NOTHING; PART];
            // Without holes in the scene nobody looks at what was asked for.
            let turned = CastRays::moved(&again[..tried], asked.as_ref().unwrap_or(&again));
            let hit_again = self.trace::<W>(turned, Lanes::MAX, &mut found_again);
            for (k, lane) in lanes[..tried].iter().enumerate() {
                let is_hit = hit_again >> k & 1 == 1;
                if is_hit && self.is_nearer(&rays[*lane], &found_again[k], &found[*lane]) {
                    found[*lane] = found_again[k];
                    hit |= 1 << *lane;
                }
            }
        }
        hit
    }

    /// Traces the `doubtful` lanes from nearby; returns those whose hit, or miss, is final.
    fn search_nearby(
        &self,
        rays: &[Ray],
        shifts: &[f64; BLOCK],
        doubtful: Lanes,
        found: &[PacketHit; BLOCK],
        hits: &mut [Option<Hit>],
        counts: &mut RayCounts,
    ) -> Lanes {
        let mut settled = 0;
        for lane in each(doubtful) {
            let (ray, hit) = (&rays[lane], found[lane]);
            let mut known = Known::default();
            if hit.prim != PrimRef::NONE {
                match self.recheck(ray, &Candidate { hit, shift: shifts[lane] }) {
                    Some(hit) => known = Known::of(hit),
                    // A phantom, to be settled.
                    None => continue,
                }
            }
            hits[lane] = self.hit_from_nearby(ray, known, counts);
            settled |= 1 << lane;
        }
        settled
    }

    /// Whether what a turned ray found lies before what the ray found as it was asked for.
    fn is_nearer(&self, ray: &Ray, again: &PacketHit, former: &PacketHit) -> bool {
        if former.prim == PrimRef::NONE {
            return true;
        }
        // The ray is the one that Embree saw: none of its shift is left.
        let locate = || self.locate(ray, &Candidate { hit: *again, shift: 0.0 });
        is_well_before(ray, again.t, former.t)
            && locate().is_some_and(|again| again.lies_before(former.t.into()))
    }

    pub(super) fn occluded_packets<const W: usize>(
        &self,
        rays: &[Ray],
        occluded: &mut [bool],
        counts: &mut RayCounts,
    ) {
        let mut packet = Packet::<W>::new();
        for (rays, occluded) in rays.chunks(W).zip(occluded.chunks_mut(W)) {
            let valid = valid_lanes(rays);
            counts[RayKind::Invalid] += rays.len() as u64 - u64::from(valid.count_ones());
            let mask = fill(&mut packet, rays, valid);
            let exclude = rays.iter().any(|ray| ray.exclude != PrimRef::NONE);
            let flags = QueryFlags { coherent: false, exclude, passed: &[] };
            self.committed.occluded(&mask, &mut packet, CastRays::as_asked(rays), flags);
            for (lane, out) in occluded.iter_mut().enumerate() {
                *out = mask[lane] != 0 && packet.is_occluded(lane);
            }
        }
    }

    /// Writes the hits of the lanes `hit`, those of `at_once` rechecked, many together; returns the lanes whose
    /// hit may be a phantom, and those whose hit Embree displaced ([`is_displaced`]).
    fn recheck_block(
        &self,
        block: &Block,
        hit: Lanes,
        at_once: Lanes,
        hits: &mut [Option<Hit>],
    ) -> (Lanes, Lanes) {
        let Block { rays, shifts, found } = *block;
        for lane in each(hit & !at_once) {
            hits[lane] = Some(self.as_it_is(&found[lane], shifts[lane]));
        }
        let mut lanes = [0u8; BLOCK];
        let mut corners = [[0u32; 3]; BLOCK];
        let mut wanted = 0;
        let (mut open, mut displaced) = (0, 0);
        // Indices first, then vertices: so the processor waits for many cache misses at a time.
        for lane in each(hit & at_once) {
            let prim = found[lane].prim;
            if let Some(mesh) = self.scene.meshes.get(prim.geom_id as usize) {
                lanes[wanted] = lane as u8;
                corners[wanted] = mesh.triangles[prim.prim_id as usize];
                wanted += 1;
            } else {
                hits[lane] = self.recheck_sphere(&rays[lane], prim);
                open |= Lanes::from(hits[lane].is_none()) << lane;
            }
        }
        for (lanes, corners) in lanes[..wanted].chunks(STEP).zip(corners.chunks(STEP)) {
            let mut pairs = Pairs::new();
            for (lane, corners) in lanes.iter().map(|lane| *lane as usize).zip(corners) {
                let mesh = &self.scene.meshes[found[lane].prim.geom_id as usize];
                pairs.push(&rays[lane], &corners.map(|i| mesh.positions[i as usize].as_dvec3()));
            }
            pairs.compute();
            for (k, lane) in lanes.iter().map(|lane| *lane as usize).enumerate() {
                let met = pairs.get(k);
                let (ray, prim) = (&rays[lane], found[lane].prim);
                if met.is_inside() && (ray.tnear..=ray.tfar).contains(&met.t) {
                    hits[lane] = Some(Hit { t: met.t, u: met.u, v: met.v, prim, rough: false });
                } else {
                    hits[lane] =
                        self.recheck(ray, &Candidate { hit: found[lane], shift: shifts[lane] });
                    open |= Lanes::from(hits[lane].is_none()) << lane;
                }
                let candidate = Candidate { hit: found[lane], shift: shifts[lane] };
                let is_displaced =
                    hits[lane].is_some_and(|hit| is_displaced(ray, &candidate, &hit));
                displaced |= Lanes::from(is_displaced) << lane;
            }
        }
        (open, displaced)
    }
}

/// The initial hit of a lane, before Embree finds one.
const NOTHING: PacketHit =
    PacketHit { t: f32::INFINITY, u: 0.0, v: 0.0, ng: Vec3::ZERO, prim: PrimRef::NONE };

/// The lanes whose rays are valid.
fn valid_lanes(rays: &[Ray]) -> Lanes {
    rays.iter().enumerate().fold(0, |lanes, (k, ray)| lanes | Lanes::from(ray.is_valid()) << k)
}

/// Puts `rays` into `packet`; gives Embree's mask of the `valid` ones.
#[inline(always)]
fn fill<const W: usize>(packet: &mut Packet<W>, rays: &[Ray], valid: Lanes) -> [i32; W] {
    let mut mask = [0; W];
    for (lane, ray) in rays.iter().enumerate() {
        packet.set(lane, ray);
        mask[lane] = -((valid >> lane & 1) as i32);
    }
    mask
}

/// Whether `t` lies before `other` on `ray` by more than both may be off.
fn is_well_before(ray: &Ray, t: f32, other: f32) -> bool {
    let length = ray.dir.length();
    let reach = ray.org.length() + f64::from(t) * length;
    f64::from(other - t) * length > 32.0 * ROUNDING * reach
}
