//! From a [`Hit`] to a surface point, and from there to new rays.

use super::triangle;
use super::{Hit, PrimRef, Ray};
use crate::math::{DVec3, Vec2};
use crate::scene::{Mesh, QuadLight, Scene, Sphere, Surface};
use std::f64::consts::{PI, TAU};

/// A hit expanded, scene space, f64.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceInteraction {
    /// The point, from the triangle's corners and weights (not from `org + t·dir`, which is worse).
    pub p: DVec3,
    /// Unit geometric normal on the outside (counter-clockwise side).
    pub ng: DVec3,
    /// Unit shading normal, on the same side as `ng`.
    pub ns: DVec3,
    /// Texture coordinates of set 0: the mesh's, or an exact sphere's longitude and latitude; zero without, and
    /// on spheres whose material has no image.
    pub uv: Vec2,
    /// Material of the surface.
    pub surface: Surface,
    /// The primitive that was hit.
    pub prim: PrimRef,
    /// How far along `ng` a ray must start so that rounding cannot put it on the wrong side.
    pub offset: f64,
}

/// Half an ulp at 1 in f32: the relative error of rounding a coordinate for Embree.
const ROUNDING: f64 = 1.0 / (1u64 << 24) as f64;

impl SurfaceInteraction {
    /// Expands `hit`; one function for all intersectors.
    pub fn new(scene: &Scene, ray: &Ray, hit: &Hit) -> Self {
        match scene.meshes.get(hit.prim.geom_id as usize) {
            Some(mesh) => on_triangle(mesh, ray, hit),
            None => on_sphere(scene, ray, hit),
        }
    }

    /// Whether `dir` points to the outside of the surface.
    pub fn is_outside(&self, dir: DVec3) -> bool {
        dir.dot(self.ng) > 0.0
    }

    /// A ray from here along `dir`, on the side of the surface that `dir` points to.
    pub fn spawn(&self, dir: DVec3, offset: bool) -> Ray {
        self.towards(dir, offset).along(dir)
    }

    /// A ray from here to `target` that stops short of its surface. `t` runs from 0 to (almost) 1.
    pub fn spawn_to(&self, target: &RayEnd, offset: bool) -> Ray {
        self.towards(target.point - self.p, offset).to(target)
    }

    /// Where the shadow rays of a viewer start who sees the side that the unit normal `front`
    /// (`ng` or `-ng`) points to; `lift` is [`lift_to_smooth`]'s, or zero.
    pub fn shadow_start(&self, front: DVec3, lift: DVec3, offset: bool) -> SpawnPoint {
        let p = self.p + lift;
        let org = if offset { p + front * self.offset } else { p };
        SpawnPoint { p, org, front, prim: self.prim, offset }
    }

    fn towards(&self, dir: DVec3, offset: bool) -> SpawnPoint {
        let front = if self.is_outside(dir) { self.ng } else { -self.ng };
        self.shadow_start(front, DVec3::ZERO, offset)
    }
}

/// Where a ray is to end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayEnd {
    /// A point of a surface, scene space.
    pub point: DVec3,
    /// The surface's unit normal there, to either side.
    pub normal: DVec3,
    /// Error of the plane of the triangle that the point lies on; [`PlaneError::EXACT`] for spheres, which
    /// are tested in f64.
    pub plane_error: PlaneError,
}

/// How far off the plane of a triangle may be in f32 arithmetic.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneError {
    /// Longest edge, scene space.
    longest: f64,
    /// By how much an error of a corner grows along the triangle: about 1, large for slivers, whose
    /// normal is a difference of almost equal products.
    tilt: f64,
}

impl PlaneError {
    /// Not a triangle: no error.
    pub const EXACT: Self = Self { longest: 0.0, tilt: 0.0 };

    /// The error of the plane of a triangle with these corners, scene space.
    pub fn of(corners: &[DVec3; 3]) -> Self {
        let [a, b, c] = *corners;
        let (e1, e2) = ((b - a).length(), (c - a).length());
        let longest = e1.max(e2).max((c - b).length());
        let area = (b - a).cross(c - a).length();
        let most = 0.5 / ROUNDING;
        let tilt = if area > 0.0 { (longest * longest / area).min(most) } else { most };
        Self { longest, tilt }
    }

    /// The worse of the triangles that show a quad light.
    pub fn of_quad(light: &QuadLight) -> Self {
        let of = |t: &[u32; 3]| Self::of(&t.map(|i| light.corners[i as usize]));
        light.triangles().iter().map(of).fold(Self::EXACT, Self::max)
    }

    /// An error bound of both.
    pub fn max(self, o: Self) -> Self {
        Self { longest: self.longest.max(o.longest), tilt: self.tilt.max(o.tilt) }
    }
}

/// A place on one side of a surface from which rays start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpawnPoint {
    /// The place itself.
    p: DVec3,
    /// Origin of the rays, moved by the rounding-error bound.
    org: DVec3,
    /// Unit geometric normal on the side where `org` lies.
    front: DVec3,
    /// The primitive that the rays leave.
    prim: PrimRef,
    /// Whether the spawn rules hold; off, rays are what a naive tracer makes of them.
    offset: bool,
}

impl SpawnPoint {
    /// A point between surfaces.
    pub fn in_space(p: DVec3, offset: bool) -> Self {
        Self { p, org: p, front: DVec3::ZERO, prim: PrimRef::NONE, offset }
    }

    /// The ray along `dir`.
    pub fn along(&self, dir: DVec3) -> Ray {
        Ray { exclude: self.excluded(dir), ..Ray::new(self.org, dir) }
    }

    /// The ray that ends just before `target`, as [`SurfaceInteraction::spawn_to`].
    #[inline(always)] // Once for each shadow ray: a call costs a tenth of a traced frame.
    pub fn to(&self, target: &RayEnd) -> Ray {
        let org = self.org;
        let ray = Ray { tfar: 1.0, ..Ray::new(org, target.point - org) };
        if !self.offset {
            return ray;
        }
        let ray = Ray { exclude: self.excluded(target.point - self.p), ..ray };
        // Embree sees origin and direction rounded and works in f32, so the end moves by some
        // ulp: with 4, one ray in 3,000 still met its own light; with 16, none of 1e8.
        // A sliver's corners, rounded relative to the origin, tilt its plane besides.
        let grain = ROUNDING * (org.abs().max(target.point.abs())).dot(DVec3::ONE);
        let PlaneError { longest, tilt } = target.plane_error;
        let bound = 16.0 * grain + tilt * (2.0 * grain + 4.0 * ROUNDING * longest);
        let height = (org - target.point).dot(target.normal);
        if height.abs() > bound {
            return Ray { tfar: 1.0 - bound / height.abs(), ..ray };
        }
        // The origin itself lies in the target's surface, as far as f32 can tell: nothing fits
        // between the two.
        Ray { org: org + target.normal * bound.copysign(height) * 2.0, tfar: 0.0, ..ray }
    }

    /// A ray that goes below the plane of its own facet (which the shading normal allows) can be
    /// blocked by it; else light would leak into rooms with smooth walls. `dir` is that of the
    /// ideal ray: offsets at both ends may turn a grazing one below the plane.
    fn excluded(&self, dir: DVec3) -> PrimRef {
        let leaves = self.offset && dir.dot(self.front) >= 0.0;
        if leaves { self.prim } else { PrimRef::NONE }
    }
}

/// How far the smooth surface that a mesh's shading normals stand for bulges over `hit` of `ray`, on
/// the outside or the inside: from the point on the facet to there, scene space. Zero where the mesh is
/// flat or hollow there.
///
/// The point's projections onto the planes through the corners, each across its corner's normal,
/// weighted like the corners (Hanika, "Hacking the Shadow Terminator", Ray Tracing Gems II, 2021).
/// Shadow rays that start there clear the neighbouring facets, so that shadows end where the
/// shading does.
pub fn lift_to_smooth(
    scene: &Scene,
    ray: &Ray,
    hit: &Hit,
    si: &SurfaceInteraction,
    outside: bool,
) -> DVec3 {
    let mesh = scene.meshes.get(hit.prim.geom_id as usize);
    let Some((mesh, normals)) = mesh.and_then(|m| m.normals.as_ref().map(|n| (m, n))) else {
        return DVec3::ZERO;
    };
    let prim = hit.prim.prim_id as usize;
    let front = if outside { si.ng } else { -si.ng };
    let corners = mesh.corners(prim);
    let hit = refined(ray, &corners, hit);
    let normals = normals.get(prim, mesh.triangles[prim]);
    let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
    let mut lift = DVec3::ZERO;
    for ((corner, normal), weight) in corners.iter().zip(normals).zip(weights) {
        let normal = on_side_of(normal.as_dvec3(), front);
        let below = (*corner - si.p).dot(normal).max(0.0);
        lift += normal * (weight * below);
    }
    // Normals that have little to do with the facet would move the point through it.
    if lift.dot(front) > 0.0 { lift } else { DVec3::ZERO }
}

fn on_triangle(mesh: &Mesh, ray: &Ray, hit: &Hit) -> SurfaceInteraction {
    let prim = hit.prim.prim_id as usize;
    let corners = mesh.corners(prim);
    let hit = refined(ray, &corners, hit);
    let [a, b, c] = corners;
    let (e1, e2) = (b - a, c - a);
    let p = a + e1 * hit.u + e2 * hit.v;
    let ng = unit_normal(e1, e2);
    let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
    let triangle = mesh.triangles[prim];
    let ns = match &mesh.normals {
        Some(normals) => {
            let [na, nb, nc] = normals.get(prim, triangle).map(|n| n.as_dvec3());
            let sum = na * weights[0] + nb * weights[1] + nc * weights[2];
            on_side_of(sum.try_normalize().unwrap_or(ng), ng)
        }
        None => ng,
    };
    let uv = mesh.uvs.as_ref().map_or(Vec2::ZERO, |uvs| uv_at(uvs.get(prim, triangle), weights));
    // Embree rounds the origin (its error scales with the coordinates) and then works with
    // differences to the corners of this triangle and its neighbours (scales with the edges).
    let size = e1.abs().max(e2.abs()).max_element();
    let offset = ROUNDING * (2.0 * p.abs().dot(ng.abs()) + 2.0 * size);
    SurfaceInteraction { p, ng, ns, uv, surface: mesh.surface, prim: hit.prim, offset }
}

/// Texture coordinates between those of a triangle's corners.
pub(super) fn uv_at([a, b, c]: [Vec2; 3], weights: [f64; 3]) -> Vec2 {
    a * weights[0] as f32 + b * weights[1] as f32 + c * weights[2] as f32
}

/// The hit in f64. A rough one gets here what the recheck gives the others: the corners are at
/// hand, while the intersector would have to fetch them just for that.
fn refined(ray: &Ray, corners: &[DVec3; 3], hit: &Hit) -> Hit {
    if !hit.rough {
        return *hit;
    }
    // A rough hit is one that Embree's error bound has cleared; should f64 doubt it all the same,
    // the nearest point is right.
    let Some(met) = triangle::meet_or_nearest(ray, corners) else { return *hit };
    Hit { t: met.t, u: met.u, v: met.v, rough: false, ..*hit }
}

fn on_sphere(scene: &Scene, ray: &Ray, hit: &Hit) -> SurfaceInteraction {
    let sphere = &scene.spheres[hit.prim.prim_id as usize];
    let ng = sphere_normal(sphere, ray, hit.t);
    let p = sphere.centre + ng * sphere.radius;
    // Spheres are tested in f64 on the f64 ray, and the root where a ray leaves its sphere does not
    // count, so a start on the surface is safe; moved by f32's bound it would be 1e-7 off.
    let offset = 0.0;
    SurfaceInteraction {
        p,
        ng,
        ns: ng,
        uv: if needs_uv(scene, sphere.surface) { sphere_uv(ng) } else { Vec2::ZERO },
        surface: sphere.surface,
        prim: hit.prim,
        offset,
    }
}

/// The unit normal on the outside of `sphere` where `ray` meets it.
pub(super) fn sphere_normal(sphere: &Sphere, ray: &Ray, t: f64) -> DVec3 {
    (ray.at(t) - sphere.centre).normalize()
}

/// Whether anything asks for the texture coordinates of a sphere's point, which cost two arcs.
fn needs_uv(scene: &Scene, surface: Surface) -> bool {
    scene.materials[surface.material as usize].has_image()
}

/// Longitude and latitude of the unit vector `n` as texture coordinates, poles on y: the image's middle
/// faces +z, its side edges meet at -z, and seen from outside it is not mirrored.
pub(super) fn sphere_uv(n: DVec3) -> Vec2 {
    let u = 0.75 - libm::atan2(n.z, n.x) / TAU;
    let v = 1.0 - libm::atan2(libm::hypot(n.x, n.z), n.y) / PI;
    Vec2::new(u as f32, v as f32)
}

/// Unit normal of a triangle with edges `e1`, `e2` of any size.
fn unit_normal(e1: DVec3, e2: DVec3) -> DVec3 {
    let n = e1.cross(e2);
    let largest = n.abs().max_element();
    if largest > 1e-290 {
        return (n / largest).normalize();
    }
    // Edges so short that their product underflows: scale them first.
    let scale = 1.0 / e1.abs().max(e2.abs()).max_element();
    (e1 * scale).cross(e2 * scale).try_normalize().unwrap_or(DVec3::Z)
}

fn on_side_of(n: DVec3, reference: DVec3) -> DVec3 {
    if n.dot(reference) < 0.0 { -n } else { n }
}
