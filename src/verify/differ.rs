//! A ray looked at closely: where it passes the primitives that the two intersectors name.

use super::Check;
use super::class::{BAND_ULPS, Class, Difference};
use super::edge_on::{edge_noise, is_narrow};
use crate::intersect::court::{Line, Place};
use crate::intersect::{CourtHit, Hit, PrimRef, Ray, SurfaceInteraction};
use crate::math::{DVec3, orthonormal_basis};

/// Rays around the given one that are tried for a gap: on the band's rim and half-way to it.
const AROUND: u32 = 16;

/// Where Embree's edge functions are rounding noise.
#[derive(Debug, Clone, Copy, Default)]
struct Noise {
    /// At a vertex.
    vertex: bool,
    /// At two edges of a triangle, far from its corners: it is seen edge on.
    edge_on: bool,
}

/// A ray with its line, and the scene to look it up in.
pub struct Closely<'a> {
    check: &'a Check<'a>,
    ray: Ray,
    line: Line,
}

/// Where the ray passes one primitive.
#[derive(Debug, Clone, Copy)]
struct Pass {
    /// Whether the ray's line meets it, by the court.
    met: bool,
    /// Distance from the primitive, in ulp; zero where it is met.
    ulps: f64,
    /// Distance from its nearest edge or silhouette, in ulp.
    edge_ulps: f64,
    /// One ulp, scene space.
    ulp: f64,
    /// Where it meets the primitive's plane, or the sphere.
    t: Option<f64>,
    /// How far along the ray a step of one across it leads.
    slope: f64,
    /// Whether the intersector computes `t` in f64, as it does for spheres.
    is_exact: bool,
}

impl Pass {
    fn in_band(&self) -> bool {
        self.edge_ulps <= BAND_ULPS
    }

    /// Uncertainty along the ray, scene space: of a hit within the band, that of a ray that passes
    /// anywhere in the band.
    fn along(&self) -> f64 {
        BAND_ULPS * self.ulp * if self.in_band() { 1.0 + self.slope } else { 1.0 }
    }

    /// Uncertainty along the ray of the distance in f32, by which the nearest of several hits is found.
    fn depth(&self) -> f64 {
        BAND_ULPS * self.ulp * if self.is_exact { 1.0 } else { 1.0 + self.slope }
    }
}

impl<'a> Closely<'a> {
    pub fn new(check: &'a Check<'a>, ray: &Ray) -> Self {
        Self { check, ray: *ray, line: check.oracle.line(ray) }
    }

    /// Classifies two closest hits.
    pub fn hits(&self, product: Option<Hit>, oracle: Option<Hit>) -> Option<Difference> {
        let Some(hit) = product else {
            return Some(self.missed(self.ray.tfar, &oracle?, None));
        };
        let hit = self.refined(hit);
        let pass = self.pass(hit.prim);
        // A ray that leaves a sphere may meet its far side.
        let leaves_it =
            hit.prim == self.ray.exclude && self.check.oracle.corners(hit.prim).is_some();
        let is_hole = !self.check.oracle.is_there(&self.ray, hit.prim);
        if pass.ulps > BAND_ULPS || leaves_it || is_hole {
            return Some(Difference { class: Class::Phantom, ulps: pass.ulps });
        }
        let length = self.ray.dir.length();
        let off = pass.t.map_or(0.0, |t| (hit.t - t).abs()) * length;
        // So that a t that is no number is wrong too.
        let right = off <= pass.along();
        if !right {
            return Some(Difference { class: Class::WrongDistance, ulps: off / pass.ulp });
        }
        let Some(true_hit) = oracle else {
            return Some(self.extra(&pass));
        };
        if true_hit.prim == hit.prim {
            return None;
        }
        let true_pass = self.pass(true_hit.prim);
        let apart = (hit.t - true_hit.t) * length;
        let ulps = apart.abs() / pass.ulp;
        if apart.abs() <= pass.depth() + true_pass.depth() {
            Some(Difference { class: Class::Tie, ulps })
        } else if apart < 0.0 {
            Some(self.extra(&pass))
        } else {
            Some(self.missed(hit.t - pass.depth() / length, &true_hit, Some(hit.prim)))
        }
    }

    /// Where Embree's edge functions are rounding noise near the hit, in a triangle of the same mesh.
    ///
    /// Triangles that share a vertex do not agree about it as those that share an edge do. At a T-junction the vertex may
    /// be another triangle's than the hit's. A triangle that is seen edge on does not stop the ray that passes beside its
    /// neighbours.
    fn noise_at(&self, hit: &Hit) -> Noise {
        let dir = self.ray.dir.normalize();
        let depth = self.pass(hit.prim).depth();
        let noise = edge_noise(self.line.start, self.ray.at(hit.t));
        let is_there = |prim: &PrimRef, [a, b, c]: &[DVec3; 3]| {
            let pass = self.pass(*prim);
            let all = [a, b, c].map(|p| (*p - self.ray.at(hit.t)).dot(dir));
            // Seen edge on, its plane is met anywhere, but the triangle only between its corners.
            let spans =
                all.iter().any(|along| *along <= depth) && all.iter().any(|along| *along >= -depth);
            let apart = |t: f64| (t - hit.t).abs() * self.ray.dir.length();
            spans && pass.t.is_none_or(|t| apart(t) <= depth + pass.depth())
        };
        let of = |prim: PrimRef| {
            let corners = self.check.oracle.corners(prim)?;
            let [a, b, c] = corners;
            let normal = (b - a).cross(c - a);
            // What rounding has made a line stops no ray at all.
            let stops = prim.geom_id == hit.prim.geom_id && normal != DVec3::ZERO;
            if !stops || !is_there(&prim, &corners) {
                return None;
            }
            let sides = [(a, b), (b, c), (c, a)];
            let is_near = |from, to| self.line.segment_distance(from, to) <= noise;
            let near_sides = sides.iter().filter(|(from, to)| is_near(*from, *to)).count();
            let is_narrow = is_narrow(&corners, dir, noise);
            let vertex = corners.iter().any(|corner| is_near(*corner, *corner));
            Some(Noise { vertex, edge_on: is_narrow || (near_sides > 1 && !vertex) })
        };
        self.near(noise).into_iter().filter_map(of).fold(Noise::default(), |all, own| Noise {
            vertex: all.vertex | own.vertex,
            edge_on: all.edge_on | own.edge_on,
        })
    }

    /// Whether the outside of the primitive faces the ray's start.
    fn faces(&self, prim: PrimRef) -> bool {
        let Some([a, b, c]) = self.check.oracle.corners(prim) else {
            let sphere = &self.check.scene.spheres[prim.prim_id as usize];
            return self.ray.org.distance(sphere.centre) > sphere.radius;
        };
        let along = (b - a).cross(c - a).dot(self.ray.dir);
        if self.check.is_inwards(prim.geom_id) { along > 0.0 } else { along < 0.0 }
    }

    /// A hit whose numbers were left rough, as it is when its surface is looked at.
    fn refined(&self, hit: Hit) -> Hit {
        if !hit.rough {
            return hit;
        }
        let point = SurfaceInteraction::new(self.check.scene, &self.ray, &hit).p;
        let t = (point - self.ray.org).dot(self.ray.dir) / self.ray.dir.length_squared();
        Hit { t, ..hit }
    }

    /// A product's hit, on its primitive, where the oracle has none or a farther one.
    fn extra(&self, pass: &Pass) -> Difference {
        if !pass.met {
            return Difference { class: Class::EdgeBand, ulps: pass.edge_ulps };
        }
        // Met exactly, so the oracle left it out for where it is.
        match pass.t.filter(|t| self.at_end(*t, pass)) {
            Some(_) => Difference { class: Class::RayEnd, ulps: pass.edge_ulps },
            None => Difference { class: Class::Phantom, ulps: pass.ulps },
        }
    }

    fn at_end(&self, t: f64, pass: &Pass) -> bool {
        let along = BAND_ULPS * pass.ulp * (1.0 + pass.slope) / self.ray.dir.length();
        (t - self.ray.tnear).abs() <= along || (t - self.ray.tfar).abs() <= along
    }

    /// A hit that the product does not have: it reported `answer` at about `limit`, or nothing.
    fn missed(&self, limit: f64, hit: &Hit, answer: Option<PrimRef>) -> Difference {
        let ulps = self.pass(hit.prim).edge_ulps;
        let class = self.gap(limit, answer).unwrap_or_else(|| {
            let noise = self.noise_at(hit);
            // A back, or nothing, is tried again.
            if noise.vertex && answer.is_some_and(|prim| self.faces(prim)) {
                match self.check.is_closed(hit.prim.geom_id) {
                    true => Class::PastVertex,
                    false => Class::PastOpenVertex,
                }
            } else if noise.edge_on {
                // Turned rays may slip past it too, since all its edges lie in one line.
                Class::PastEdgeOn
            } else {
                Class::Missed
            }
        });
        Difference { class, ulps }
    }

    /// The product says occluded, the oracle does not.
    pub fn false_shadow(&self) -> Difference {
        let none = Difference { class: Class::FalseShadow, ulps: f64::INFINITY };
        self.near_band()
            .into_iter()
            .filter(|prim| *prim != self.ray.exclude)
            .filter(|prim| self.check.oracle.is_there(&self.ray, *prim))
            .filter_map(|prim| {
                let pass = self.pass(prim);
                let t = pass.t?;
                let ends = self.at_end(t, &pass);
                let within = t >= self.ray.tnear && t <= self.ray.tfar;
                let class = if ends { Class::RayEnd } else { Class::EdgeBand };
                let explains = pass.ulps <= BAND_ULPS && (ends || within);
                explains.then_some(Difference { class, ulps: pass.edge_ulps })
            })
            .min_by(|a, b| a.ulps.total_cmp(&b.ulps))
            .unwrap_or(none)
    }

    /// The oracle says occluded, the product does not.
    pub fn leak(&self) -> Difference {
        let hits = self.check.oracle.all_hits(&self.ray);
        let clearest = hits.iter().map(|h| self.pass(h.hit.prim).edge_ulps).fold(0.0, f64::max);
        let class = self.gap(self.ray.tfar, None).unwrap_or(Class::ShadowLeak);
        Difference { class, ulps: clearest }
    }

    /// Whether nothing before `limit` is hit for certain: by what lies at the ray's ends, where the
    /// surface ends, or since a ray within the band meets nothing there but the product's `answer`, which
    /// a grazing ray, once moved, may meet long before `limit`. Between triangles that share an edge there
    /// is no such ray.
    fn gap(&self, limit: f64, answer: Option<PrimRef>) -> Option<Class> {
        let hits = self.check.oracle.all_hits(&self.ray);
        let nearer = hits.iter().filter(|h| h.hit.t <= limit);
        let (at_end, others): (Vec<&CourtHit>, Vec<&CourtHit>) =
            nearer.partition(|h| self.at_end(h.hit.t, &self.pass(h.hit.prim)));
        if others.is_empty() {
            return (!at_end.is_empty()).then_some(Class::RayEnd);
        }
        if others.iter().any(|h| !self.pass(h.hit.prim).in_band()) {
            return None;
        }
        // Mostly enough, and without a look at all triangles.
        if others.iter().all(|h| self.is_at_border(h.hit.prim)) {
            return Some(Class::EdgeBand);
        }
        let near = self.near_band();
        if others
            .iter()
            .all(|h| self.is_at_border(h.hit.prim) || self.ends_border(h.hit.prim, &near))
        {
            return Some(Class::EdgeBand);
        }
        let width = others.iter().map(|h| self.pass(h.hit.prim).ulp).fold(0.0, f64::max);
        let bars = |prim, by| Some(prim) != answer && self.is_hit_beside(prim, by, limit);
        let free = |by: &DVec3| !near.iter().any(|prim| bars(*prim, *by));
        self.offsets(BAND_ULPS * width, &near).iter().any(free).then_some(Class::EdgeBand)
    }

    /// Whether the ray, moved aside by `by`, certainly hits `prim` before `limit`.
    fn is_hit_beside(&self, prim: PrimRef, by: DVec3, limit: f64) -> bool {
        let pass = self.pass(prim);
        let moved = Ray { org: self.ray.org + by, ..self.ray };
        let t = match self.check.oracle.corners(prim) {
            Some(corners) => self.line.moved(by).meet(&corners).map(|m| m.t),
            None => self.sphere_root(&moved, prim),
        };
        let certain = |t: f64| t >= self.ray.tnear && t <= limit && !self.at_end(t, &pass);
        let is_met = prim != self.ray.exclude && t.is_some_and(certain);
        is_met && self.check.oracle.is_there(&moved, prim)
    }

    /// Ways aside: around on two circles, and straight off the edges of the triangles near by, which
    /// finds the gap beside a sliver.
    fn offsets(&self, radius: f64, near: &[PrimRef]) -> Vec<DVec3> {
        let along = self.ray.dir.normalize();
        let (s, t) = orthonormal_basis(along);
        let mut offsets = Vec::new();
        for step in 0..AROUND {
            let angle = std::f64::consts::TAU * f64::from(step) / f64::from(AROUND);
            let aside = s * libm::cos(angle) + t * libm::sin(angle);
            offsets.extend([aside * radius, aside * (0.5 * radius)]);
        }
        for [a, b, c] in near.iter().filter_map(|prim| self.check.oracle.corners(*prim)) {
            for edge in [b - a, c - b, a - c] {
                if let Some(aside) = edge.cross(along).try_normalize() {
                    offsets.extend([aside * radius, aside * -radius]);
                }
            }
        }
        offsets
    }

    /// Whether the ray passes within the band of an edge of the triangle that no other triangle has. Where
    /// two sheets touch without a common edge, at a T-junction say, rounding may let a ray pass between
    /// them although they overlap by less than an ulp.
    fn is_at_border(&self, prim: PrimRef) -> bool {
        let Some([a, b, c]) = self.check.oracle.corners(prim) else { return false };
        let borders = self.check.borders_of(prim);
        let band = BAND_ULPS * self.line.ulp(&[a, b, c]);
        let edges = [(a, b), (b, c), (c, a)].into_iter().enumerate();
        let mut borders = edges.filter(|(k, _)| borders >> k & 1 == 1);
        borders.any(|(_, (from, to))| self.line.segment_distance(from, to) <= band)
    }

    /// Whether the ray passes within the band of a corner of the triangle at which a border of one of the `near` triangles of its
    /// mesh ends: at a T-junction a triangle may only touch the border.
    fn ends_border(&self, prim: PrimRef, near: &[PrimRef]) -> bool {
        let Some(corners) = self.check.oracle.corners(prim) else { return false };
        let band = BAND_ULPS * self.line.ulp(&corners);
        let mut passed = corners.iter().filter(|p| self.line.segment_distance(**p, **p) <= band);
        let ends_at = |other: &PrimRef, p: &DVec3| {
            let corners = self.check.oracle.corners(*other);
            let at = corners.and_then(|corners| corners.iter().position(|corner| corner == p));
            // Edge k runs from corner k to the next one.
            at.is_some_and(|k| self.check.borders_of(*other) & (1 << k | 1 << ((k + 2) % 3)) != 0)
        };
        let of_mesh = || near.iter().filter(|other| other.geom_id == prim.geom_id);
        passed.any(|p| of_mesh().any(|other| ends_at(other, p)))
    }

    /// Everything that passes the ray within twice the band, spheres included.
    fn near_band(&self) -> Vec<PrimRef> {
        // The largest ulp of any triangle that there can be.
        let largest = self.check.scene.bounds.largest_coordinate();
        let largest = largest.max(self.line.start.abs().max_element());
        self.near(2.0 * BAND_ULPS * largest * f64::from(f32::EPSILON))
    }

    /// The triangles that pass the ray within `margin`, and all spheres.
    fn near(&self, margin: f64) -> Vec<PrimRef> {
        let scene = self.check.scene;
        let mut near = self.check.oracle.near(&self.ray, margin);
        let geom_id = scene.sphere_geom_id();
        near.extend((0..scene.spheres.len() as u32).map(|prim_id| PrimRef { geom_id, prim_id }));
        near
    }

    fn pass(&self, prim: PrimRef) -> Pass {
        match self.check.oracle.corners(prim) {
            Some(corners) => self.pass_triangle(&corners),
            None => self.pass_sphere(prim),
        }
    }

    fn pass_triangle(&self, corners: &[DVec3; 3]) -> Pass {
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let cos = normal.dot(self.ray.dir).abs() / (normal.length() * self.ray.dir.length());
        Pass {
            met: self.line.place(corners) != Place::Outside,
            ulps: self.line.ulps(corners),
            edge_ulps: self.line.edge_ulps(corners),
            ulp: self.line.ulp(corners),
            t: self.line.plane_t(corners),
            slope: if cos > 0.0 { 1.0 / cos } else { f64::INFINITY },
            is_exact: false,
        }
    }

    fn pass_sphere(&self, prim: PrimRef) -> Pass {
        let s = &self.check.scene.spheres[prim.prim_id as usize];
        let along = self.ray.dir.normalize();
        let from = self.ray.org - s.centre;
        let offset = (from - along * from.dot(along)).length();
        let largest = (s.centre.abs() + s.radius).max(self.line.start.abs()).max_element();
        let ulp = largest * f64::from(f32::EPSILON);
        let t = self.sphere_root(&self.ray, prim);
        let silhouette = s.radius - offset;
        Pass {
            met: t.is_some(),
            ulps: if t.is_some() { 0.0 } else { silhouette.abs() / ulp },
            edge_ulps: silhouette.abs() / ulp,
            ulp,
            t,
            slope: s.radius / silhouette.max(0.0).sqrt() / (s.radius + offset).sqrt(),
            is_exact: true,
        }
    }

    fn sphere_root(&self, ray: &Ray, prim: PrimRef) -> Option<f64> {
        self.check.oracle.sphere_root(ray, prim)
    }
}
