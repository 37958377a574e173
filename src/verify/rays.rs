//! The rays: six kinds, each ray a function of seed, kind and index.

use super::Check;
use super::edge_on::{edge_noise, is_narrow};
use crate::intersect::{Hit, PrimRef, Ray, SurfaceInteraction};
use crate::math::DVec3;
use crate::sampling::mix;
use crate::scene::Light;
use crate::shade::ShadowStarts;
use crate::shade::light::{LightSample, LightSampler, SampleSink, ShadowTarget};
use crate::stats::RayCounts;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use serde::Serialize;
use std::f64::consts::TAU;
use std::fmt;

/// Half the grazing rays' range of angles to the plane, radians.
const GRAZING: f64 = 0.02;
/// Triangles among which a grazing ray picks the thinnest.
const CANDIDATES: usize = 8;

/// The kind of a ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Through a random image point of a random frame.
    Camera,
    /// From a surface to a light.
    Shadow,
    /// From a surface, reflected there.
    Mirror,
    /// From inside the bounds in any direction, or from outside to a point inside.
    Random,
    /// At a vertex.
    Vertex,
    /// At a point of an edge; every third grazes a thin triangle.
    Edge,
}

impl Kind {
    /// All kinds, in the order in which they are shot.
    pub const ALL: [Self; 6] =
        [Self::Camera, Self::Shadow, Self::Mirror, Self::Random, Self::Vertex, Self::Edge];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        ["camera", "shadow", "mirror", "random", "vertex", "edge"][self as usize]
    }
}

/// Which ray: `camera:1234`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct RayId {
    /// Its kind.
    pub kind: Kind,
    /// Its number, from 0.
    pub index: u64,
}

impl fmt::Display for RayId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.kind.name(), self.index)
    }
}

impl Serialize for RayId {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// A surface point with the ray that sees it.
struct Seen {
    si: SurfaceInteraction,
    ray: Ray,
    hit: Hit,
}

/// A surface point that waits for light: normals on the viewer's side.
struct Lit {
    p: DVec3,
    /// Shading normal.
    n: DVec3,
    /// Geometric normal.
    ng: DVec3,
    starts: ShadowStarts,
}

/// The sample of a light that was drawn.
struct Drawn(Option<LightSample>);

impl SampleSink for Drawn {
    fn push(&mut self, sample: LightSample) {
        self.0 = Some(sample);
    }
}

impl Lit {
    /// A ray to a random point of the light that the renderer's sampling gives; `None` where the
    /// light does not shine or the point lies below the horizon.
    fn ray_to(&self, light: &Light, rng: &mut Pcg64) -> Option<Ray> {
        let sampler = LightSampler::new(light);
        let seen = sampler.seen_from(self.p, self.n);
        let seen = seen.filter(|_| sampler.unshadowed(self.p, self.n) != 0.0)?;
        let u = if light.is_area() { [rng.random(), rng.random()] } else { [0.5; 2] };
        let mut drawn = Drawn(None);
        seen.sample_li(self.p, &[u], &mut drawn);
        let sample = drawn.0.filter(|sample| sample.pdf.weight(self.n) > 0.0)?;
        Some(self.starts.ray_to(&sample.target))
    }
}

impl Check<'_> {
    /// The ray; `None` where the scene has none of the kind here (nothing hit to start from,
    /// no triangle to aim at).
    pub fn ray(&self, id: RayId) -> Option<Ray> {
        let mut rng = random(self.settings.seed, id);
        let rng = &mut rng;
        let ray = match id.kind {
            Kind::Camera => self.camera_ray(rng)?,
            Kind::Shadow => self.shadow_ray(rng)?,
            Kind::Mirror => self.mirror_ray(rng)?,
            Kind::Random => self.random_ray(rng)?,
            Kind::Vertex => {
                let corners = self.triangle(rng)?;
                self.ray_at(corners[rng.random_range(0..3)], rng)?
            }
            Kind::Edge => self.edge_ray(id.index, rng)?.0,
        };
        ray.is_valid().then_some(ray)
    }

    /// Whether the edge ray of this number sees the triangle at which it is aimed edge on.
    pub(super) fn sees_edge_on(&self, index: u64) -> bool {
        let id = RayId { kind: Kind::Edge, index };
        let aimed = self.edge_ray(index, &mut random(self.settings.seed, id));
        aimed.is_some_and(|(ray, corners)| {
            is_narrow(&corners, ray.dir.normalize(), edge_noise(ray.org, corners[0]))
        })
    }

    /// A ray at a point of an edge, and the triangle of that edge.
    fn edge_ray(&self, index: u64, rng: &mut Pcg64) -> Option<(Ray, [DVec3; 3])> {
        if index % 3 == 2 {
            return self.grazing_ray(rng);
        }
        let corners = self.triangle(rng)?;
        let first = rng.random_range(0..3);
        let (a, b) = (corners[first], corners[(first + 1) % 3]);
        Some((self.ray_at(a + (b - a) * rng.random::<f64>(), rng)?, corners))
    }

    fn camera_ray(&self, rng: &mut Pcg64) -> Option<Ray> {
        let (width, height) = (self.settings.width, self.settings.height);
        let frame = rng.random_range(1..=self.shot.frames);
        let camera = self.shot.camera(frame, width, height).ok()?;
        let camera = camera.to_scene(&self.scene.recentring);
        let at = |rng: &mut Pcg64, size: u32| rng.random::<f64>() * f64::from(size);
        let (x, y) = (at(rng, width), at(rng, height));
        let lens = match camera.lens.is_sampled() {
            true => [rng.random(), rng.random()],
            false => [0.5; 2],
        };
        Some(camera.generate_ray(x, y, lens))
    }

    fn random_ray(&self, rng: &mut Pcg64) -> Option<Ray> {
        let inside = self.inside(rng)?;
        if rng.random() {
            return Some(Ray::new(inside, direction(rng)));
        }
        let bounds = &self.scene.bounds;
        // Up to 1000 radii: further out than Embree gets its rays.
        let distance = bounds.radius() * libm::exp10(rng.random_range(0.1..3.0));
        let org = bounds.centre() + direction(rng) * distance;
        Some(Ray::new(org, inside - org))
    }

    /// A ray to a point inside: from within the bounds, or from just outside.
    fn ray_at(&self, target: DVec3, rng: &mut Pcg64) -> Option<Ray> {
        let org = match rng.random() {
            true => self.inside(rng)?,
            false => {
                let bounds = &self.scene.bounds;
                bounds.centre() + direction(rng) * bounds.radius() * rng.random_range(1.0..3.0)
            }
        };
        Some(Ray::new(org, target - org))
    }

    fn inside(&self, rng: &mut Pcg64) -> Option<DVec3> {
        let bounds = &self.scene.bounds;
        if bounds.is_empty() {
            return None;
        }
        let share = DVec3::from_array([(); 3].map(|()| rng.random()));
        Some(bounds.min + bounds.extent() * share)
    }

    /// Nearly in the plane of the thinnest of a few triangles, through a point of its rim.
    fn grazing_ray(&self, rng: &mut Pcg64) -> Option<(Ray, [DVec3; 3])> {
        let mut thinnest = self.triangle(rng)?;
        for _ in 1..CANDIDATES {
            let other = self.triangle(rng)?;
            if thinness(&other) < thinness(&thinnest) {
                thinnest = other;
            }
        }
        let [a, b, c] = thinnest;
        let normal = (b - a).cross(c - a).try_normalize()?;
        let target = a + (b - a) * rng.random::<f64>();
        let along = (c - a) * rng.random_range(-1.0..1.0) + (b - a) * rng.random_range(-1.0..1.0);
        let along = along.try_normalize()? + normal * rng.random_range(-GRAZING..GRAZING);
        let distance = self.scene.bounds.radius() * rng.random_range(0.01..1.5);
        Some((Ray::new(target - along * distance, along), thinnest))
    }

    fn mirror_ray(&self, rng: &mut Pcg64) -> Option<Ray> {
        let Seen { si, ray, .. } = self.surface_point(rng)?;
        let incoming = ray.dir.normalize();
        let dir = incoming - si.ns * (2.0 * incoming.dot(si.ns));
        Some(si.spawn(dir, self.settings.rules.spawn_offset))
    }

    /// From a lit point to a random light as the renderer sends them; to the sky for one in eight and
    /// where that light does not shine.
    fn shadow_ray(&self, rng: &mut Pcg64) -> Option<Ray> {
        let seen = self.surface_point(rng)?;
        let lit = self.lit(&seen);
        let lights = &self.scene.lights;
        if !lights.is_empty() && !rng.random_ratio(1, 8) {
            let ray = lit.ray_to(&lights[rng.random_range(0..lights.len())], rng);
            if ray.is_some() {
                return ray;
            }
        }
        let dir = direction(rng);
        let above = if dir.dot(lit.ng) < 0.0 { -dir } else { dir };
        Some(lit.starts.ray_to(&ShadowTarget::Sky(above)))
    }

    /// Where the renderer's shadow rays start.
    fn lit(&self, Seen { si, ray, hit }: &Seen) -> Lit {
        let outside = si.is_outside(-ray.dir);
        let (n, ng) = if outside { (si.ns, si.ng) } else { (-si.ns, -si.ng) };
        let starts = ShadowStarts::of(self.scene, self.settings, (si, ray, hit), ng);
        Lit { p: si.p, n, ng, starts }
    }

    /// A surface point that the product sees: half of them by a camera, half by a ray at a random
    /// triangle, so that a shot that looks away tests as well.
    fn surface_point(&self, rng: &mut Pcg64) -> Option<Seen> {
        let by_camera = rng.random();
        let camera = if by_camera { self.camera_ray(rng) } else { None };
        let counts = &mut RayCounts::default();
        let hit = |ray: Ray, counts: &mut RayCounts| {
            let hit = self.product.intersect(&ray, counts)?;
            Some(Seen { si: SurfaceInteraction::new(self.scene, &ray, &hit), ray, hit })
        };
        camera.and_then(|ray| hit(ray, counts)).or_else(|| {
            let target = match self.triangle(rng) {
                Some([a, b, c]) => (a + b + c) / 3.0,
                None => self.inside(rng)?,
            };
            hit(self.ray_at(target, rng)?, counts)
        })
    }

    /// Corners of a random triangle; every mesh is as likely as its share of triangles.
    fn triangle(&self, rng: &mut Pcg64) -> Option<[DVec3; 3]> {
        let count = self.scene.triangle_count();
        if count == 0 {
            return None;
        }
        let mut index = rng.random_range(0..count as u64) as usize;
        for (geom_id, mesh) in self.scene.meshes.iter().enumerate() {
            if index < mesh.triangles.len() {
                let prim = PrimRef { geom_id: geom_id as u32, prim_id: index as u32 };
                return self.oracle.corners(prim);
            }
            index -= mesh.triangles.len();
        }
        None
    }
}

/// Height over the longest edge, up to a factor.
fn thinness([a, b, c]: &[DVec3; 3]) -> f64 {
    let longest = a.distance_squared(*b).max(b.distance_squared(*c)).max(c.distance_squared(*a));
    (*b - *a).cross(*c - *a).length() / longest
}

fn direction(rng: &mut Pcg64) -> DVec3 {
    let z: f64 = rng.random_range(-1.0..=1.0);
    let angle = TAU * rng.random::<f64>();
    let r = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(r * libm::cos(angle), r * libm::sin(angle), z)
}

/// Numbers of their own for every ray.
fn random(seed: u64, id: RayId) -> Pcg64 {
    let mixed = mix(mix(mix(seed) ^ (id.kind as u64 + 1)) ^ id.index);
    Pcg64::seed_from_u64(mixed)
}
