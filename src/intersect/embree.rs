//! Embree behind the seam, with the rules that make its hits trustworthy.
//!
//! * Rays are validated before Embree sees them.
//! * A ray that starts far outside the scene is moved up to the scene's bounds in f64, since its
//!   f32 origin would be too coarse.
//! * A hit's `t, u, v` are recomputed in f64; one that lies beside its triangle is a phantom, and
//!   the ray goes on past it.
//! * A ray that misses inside the bounds of some geometry gets one second try, moved by 4 ulp.
//!
//! Shadow rays report no primitive, so only the first two rules reach them.

use super::{Hit, Intersector, PrimRef, Ray, sphere, triangle};
use crate::embree::{
    BuildOptions, CommittedScene, Packet, PacketHit, QueryFlags, SceneBuilder, SphereData,
};
use crate::error::Result;
use crate::math::{Bounds3, DVec3, orthonormal_basis};
use crate::scene::{HitRules, Recheck, Scene};
use crate::stats::RayCounts;

/// Half an ulp at 1 in f32.
const ROUNDING: f64 = 1.0 / (1u64 << 24) as f64;
/// Largest coordinate of an origin that is not moved: the recentred scene lies within ±1.
const NEAR: f64 = 4.0;
/// Phantoms that one ray may pass; each lies behind the one before.
const MOST_PHANTOMS: usize = 64;
/// Scenes of more geometries than this share one box for the retry rule.
const MOST_BOXES: usize = 16;

/// A scene traced by Embree.
pub struct EmbreeIntersector<'s> {
    committed: CommittedScene<'s>,
    scene: &'s Scene,
    rules: HitRules,
    /// Largest coordinate of an origin that is not moved.
    near: f64,
    boxes: Vec<Bounds3>,
    bounds: Bounds3,
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
        for mesh in &scene.meshes {
            builder.add_triangles(&mesh.positions, mesh.vertex_count, &mesh.triangles)?;
        }
        let spheres = scene.spheres.iter();
        let spheres =
            spheres.map(|s| SphereData { centre: s.centre.to_array(), radius: s.radius }).collect();
        builder.add_spheres(spheres)?;
        let (boxes, bounds) = (retry_boxes(scene), padded(&scene.bounds));
        Ok(Self { committed: builder.commit()?, scene, rules, near, boxes, bounds })
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

    fn intersect_packets<const W: usize>(
        &self,
        rays: &[Ray],
        hits: &mut [Option<Hit>],
        counts: &mut RayCounts,
    ) {
        let mut packet = Packet::<W>::new();
        for (rays, hits) in rays.chunks(W).zip(hits.chunks_mut(W)) {
            let lanes = fill(&mut packet, rays, self.near);
            if lanes.far {
                for (ray, hit) in rays.iter().zip(hits) {
                    *hit = self.intersect(ray, counts);
                }
                continue;
            }
            counts.invalid += lanes.invalid;
            let flags = QueryFlags { coherent: true, exclude: lanes.exclude };
            self.committed.intersect(&lanes.valid, &mut packet, rays, flags);
            for (lane, (ray, out)) in rays.iter().zip(hits).enumerate() {
                *out = match packet.hit(lane) {
                    Some(hit) => self.accept(ray, ray, 0.0, &hit),
                    None if lanes.valid[lane] != 0 => self.retry(ray, counts),
                    None => None,
                };
            }
        }
    }

    fn occluded_packets<const W: usize>(
        &self,
        rays: &[Ray],
        occluded: &mut [bool],
        counts: &mut RayCounts,
    ) {
        let mut packet = Packet::<W>::new();
        for (rays, occluded) in rays.chunks(W).zip(occluded.chunks_mut(W)) {
            let lanes = fill(&mut packet, rays, f64::INFINITY);
            counts.invalid += lanes.invalid;
            let flags = QueryFlags { coherent: false, exclude: lanes.exclude };
            self.committed.occluded(&lanes.valid, &mut packet, rays, flags);
            for (lane, out) in occluded.iter_mut().enumerate() {
                *out = lanes.valid[lane] != 0 && packet.is_occluded(lane);
            }
        }
    }

    /// One Embree query, no second try; `shift` leads from the moved ray back to the given one.
    fn query(&self, ray: &Ray) -> Option<(PacketHit, Ray, f64)> {
        let (moved, shift) = self.approach(ray)?;
        let mut packet = Packet::<1>::new();
        packet.set(0, &moved);
        let flags = QueryFlags { coherent: false, exclude: moved.exclude != PrimRef::NONE };
        self.committed.intersect(&[-1], &mut packet, std::slice::from_ref(&moved), flags);
        packet.hit(0).map(|hit| (hit, moved, shift))
    }

    /// The hit in f64, or the next one behind it where it is a phantom.
    #[inline]
    fn accept(&self, ray: &Ray, moved: &Ray, shift: f64, hit: &PacketHit) -> Option<Hit> {
        let accepted = self.recheck(ray, shift, hit);
        if accepted.is_some() { accepted } else { self.pass_phantom(ray, moved, shift, hit) }
    }

    /// The first hit behind `hit` that is none.
    #[cold]
    fn pass_phantom(&self, ray: &Ray, moved: &Ray, shift: f64, hit: &PacketHit) -> Option<Hit> {
        let (mut hit, mut moved, mut shift) = (*hit, *moved, shift);
        for _ in 0..MOST_PHANTOMS {
            let beyond = Ray { tnear: just_beyond(hit.t), ..moved };
            if beyond.tnear > beyond.tfar {
                return None;
            }
            let (next, again, further) = self.query(&beyond)?;
            (hit, moved, shift) = (next, again, shift + further);
            if let Some(accepted) = self.recheck(ray, shift, &hit) {
                return Some(accepted);
            }
        }
        None
    }

    #[inline]
    fn recheck(&self, ray: &Ray, shift: f64, hit: &PacketHit) -> Option<Hit> {
        let Some(mesh) = self.scene.meshes.get(hit.prim.geom_id as usize) else {
            let s = &self.scene.spheres[hit.prim.prim_id as usize];
            let leaving = hit.prim == ray.exclude;
            let t = sphere::first_root(ray, s.centre, s.radius, leaving)?;
            return Some(Hit { t, u: 0.0, v: 0.0, prim: hit.prim });
        };
        let wanted = match self.rules.recheck {
            Recheck::Always => true,
            Recheck::Risky => is_risky(ray, hit),
            Recheck::Off => false,
        };
        if !wanted {
            let (t, u, v) = (f64::from(hit.t) + shift, f64::from(hit.u), f64::from(hit.v));
            return Some(Hit { t, u, v, prim: hit.prim });
        }
        let corners = mesh.corners(hit.prim.prim_id as usize);
        let met = triangle::meet_plane(ray, &corners)?;
        let (u, v, t) = if met.least_weight() >= 0.0 {
            (met.u, met.v, met.t)
        } else {
            let beside = met.clamped();
            let t = nearly_on(ray, &corners, &met, &beside)?;
            (beside.u, beside.v, t)
        };
        (t >= ray.tnear && t <= ray.tfar).then_some(Hit { t, u, v, prim: hit.prim })
    }

    /// One second try for a ray that should perhaps have hit: moved by 4 ulp.
    fn retry(&self, ray: &Ray, counts: &mut RayCounts) -> Option<Hit> {
        if !self.rules.retry {
            return None;
        }
        let inv = 1.0 / ray.dir;
        if !self.boxes.iter().any(|b| b.clip(ray.org, inv, ray.tnear, ray.tfar).is_some()) {
            return None;
        }
        counts.retry += 1;
        let nudged = Ray { dir: nudge(ray.dir), ..*ray };
        let (hit, moved, shift) = self.query(&nudged)?;
        // Judged by the ray that was asked for: the nudge is smaller than the tolerance.
        self.accept(ray, &moved, shift, &hit)
    }
}

/// The next f32 after a hit's `t`, which is not negative.
fn just_beyond(t: f32) -> f64 {
    f64::from(f32::from_bits(t.max(0.0).to_bits() + 1))
}

/// The direction turned by 4 ulp of f32, across: a factor on each component would leave an
/// axis-parallel ray, the likeliest to pass through a vertex, as it is.
fn nudge(dir: DVec3) -> DVec3 {
    let length = dir.length();
    let (across, _) = orthonormal_basis(dir / length);
    dir + across * (8.0 * ROUNDING * length)
}

/// What one look at a packet's rays found out.
struct Lanes<const W: usize> {
    /// Embree's mask: -1 where the ray is valid.
    valid: [i32; W],
    /// Rays refused.
    invalid: u64,
    /// Some origin is further out than `near`.
    far: bool,
    /// Some ray excludes a primitive.
    exclude: bool,
}

#[inline]
fn fill<const W: usize>(packet: &mut Packet<W>, rays: &[Ray], near: f64) -> Lanes<W> {
    let mut lanes = Lanes { valid: [0; W], invalid: 0, far: false, exclude: false };
    for (lane, ray) in rays.iter().enumerate() {
        packet.set(lane, ray);
        let valid = ray.is_valid();
        lanes.valid[lane] = -i32::from(valid);
        lanes.invalid += u64::from(!valid);
        lanes.far |= ray.org.abs().max_element() > near;
        lanes.exclude |= ray.exclude != PrimRef::NONE;
    }
    lanes
}

/// Whether Embree's f32 answer may be far off: near an edge, or grazing.
fn is_risky(ray: &Ray, hit: &PacketHit) -> bool {
    let edge = hit.u.min(hit.v).min(1.0 - hit.u - hit.v);
    let ng = hit.ng.as_dvec3();
    let cos2 = ng.dot(ray.dir).powi(2);
    edge < 1e-5 || cos2 < 0.05 * 0.05 * ng.length_squared() * ray.dir.length_squared()
}

/// A plane point just beside its triangle: where the ray passes the nearest point of the triangle,
/// when that is as near as rounding the ray to f32 explains; `None` for a phantom.
fn nearly_on(
    ray: &Ray,
    corners: &[DVec3; 3],
    met: &triangle::PlaneHit,
    beside: &triangle::PlaneHit,
) -> Option<f64> {
    if met.least_weight() >= -1e-4 {
        return Some(met.t);
    }
    let point =
        corners[0] + (corners[1] - corners[0]) * beside.u + (corners[2] - corners[0]) * beside.v;
    let to_point = point - ray.org;
    let t = to_point.dot(ray.dir) / ray.dir.length_squared();
    let distance = (to_point - ray.dir * t).length();
    let reach = ray.org.abs().max_element() + point.abs().max_element();
    (distance <= 8.0 * ROUNDING * reach).then_some(t)
}

/// Boxes whose rays deserve a second try: one a geometry while there are few.
fn retry_boxes(scene: &Scene) -> Vec<Bounds3> {
    if scene.meshes.len() > MOST_BOXES {
        return vec![padded(&scene.bounds)];
    }
    // Spheres need none: their test is exact.
    scene.meshes.iter().filter(|m| !m.bounds.is_empty()).map(|m| padded(&m.bounds)).collect()
}

/// A box with a margin for the rounding of rays.
fn padded(bounds: &Bounds3) -> Bounds3 {
    let margin = 4.0 * ROUNDING * (bounds.min.abs().max(bounds.max.abs()));
    Bounds3 { min: bounds.min - margin, max: bounds.max + margin }
}

impl Intersector for EmbreeIntersector<'_> {
    fn intersect(&self, ray: &Ray, counts: &mut RayCounts) -> Option<Hit> {
        if !ray.is_valid() {
            counts.invalid += 1;
            return None;
        }
        match self.query(ray) {
            Some((hit, moved, shift)) => self.accept(ray, &moved, shift, &hit),
            None => self.retry(ray, counts),
        }
    }

    fn occluded(&self, ray: &Ray, counts: &mut RayCounts) -> bool {
        let mut out = [false];
        self.occluded_packets::<1>(std::slice::from_ref(ray), &mut out, counts);
        out[0]
    }

    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], counts: &mut RayCounts) {
        match self.committed.packet_width() {
            8 => self.intersect_packets::<8>(rays, hits, counts),
            _ => self.intersect_packets::<4>(rays, hits, counts),
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
        self.committed.memory()
    }
}
