//! The hole of Möller and Trumbore's determinant epsilon, which no choice of it cures.

use super::ways::{OneByOne, to_scene};
use crate::shapes;
use crate::suite::{self, Outcome, Size};
use rand::Rng;
use rayon::prelude::*;
use std::path::Path;
use tweenray::intersect::{EmbreeIntersector, Hit, Intersector, Oracle, Ray};
use tweenray::math::{DVec3, Vec3};
use tweenray::scene::{HitRules, NormalPolicy, WorldMesh};
use tweenray::stats::RayCounts;

/// Determinants below these are "parallel" to whoever copies the formula with them.
const EPSILONS: [f64; 9] = [0.0, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5];

/// ulps from the outline within which a ray may pass by.
const BAND: f64 = 4.0;

/// The largest |determinant| among the triangles that the ray hits up to `most`, by the formula in
/// one precision; `None` where it hits none. A determinant epsilon above it makes a hole.
macro_rules! largest_determinant {
    ($name:ident, $vector:ty, $number:ty) => {
        fn $name(org: $vector, dir: $vector, most: $number, mesh: &[[$vector; 3]]) -> Option<f64> {
            let mut largest: Option<f64> = None;
            for [a, b, c] in mesh {
                let (e1, e2) = (*b - *a, *c - *a);
                let p = dir.cross(e2);
                let det = e1.dot(p);
                if det == 0.0 {
                    continue;
                }
                let inv = 1.0 / det;
                let s = org - *a;
                let u = s.dot(p) * inv;
                let q = s.cross(e1);
                let (v, t) = (dir.dot(q) * inv, e2.dot(q) * inv);
                if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && t <= most {
                    let det = f64::from(det.abs());
                    largest = Some(largest.map_or(det, |l| l.max(det)));
                }
            }
            largest
        }
    };
}
largest_determinant!(in_f32, Vec3, f32);
largest_determinant!(in_f64, DVec3, f64);

/// The running sum of the triangles' areas.
fn areas(mesh: &WorldMesh) -> Vec<f64> {
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|k| mesh.positions[k as usize]);
        0.5 * (b - a).cross(c - a).length()
    };
    let add = |sum: &mut f64, t: &[u32; 3]| {
        *sum += area(t);
        Some(*sum)
    };
    mesh.triangles.iter().scan(0.0, add).collect()
}

/// A mesh, and rays that each aim at a point of its surface.
struct Subject {
    name: &'static str,
    mesh: WorldMesh,
    areas: Vec<f64>,
    /// Where the eye of a ray is.
    eye: fn(&mut rand_pcg::Pcg64Mcg) -> DVec3,
}

impl Subject {
    fn new(name: &'static str, mesh: WorldMesh, eye: fn(&mut rand_pcg::Pcg64Mcg) -> DVec3) -> Self {
        Self { name, areas: areas(&mesh), mesh, eye }
    }

    /// Ray `i`, direction of unit length, the distance at which it meets its point, and the
    /// triangle of that.
    fn ray(&self, i: u64) -> (Ray, f64, usize) {
        let mut rng = suite::rng(6, i);
        let eye = (self.eye)(&mut rng);
        // Every part of the surface alike.
        let at = rng.random::<f64>() * self.areas.last().unwrap();
        let prim = self.areas.partition_point(|sum| *sum <= at).min(self.areas.len() - 1);
        let [a, b, c] = self.mesh.triangles[prim].map(|k| self.mesh.positions[k as usize]);
        let (u, v): (f64, f64) = (rng.random(), rng.random());
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        let to = a + (b - a) * u + (c - a) * v - eye;
        (Ray::new(eye, to.normalize()), to.length(), prim)
    }

    fn scaled(&self, scale: f64) -> Vec<[DVec3; 3]> {
        let corner = |k: u32| self.mesh.positions[k as usize] * scale;
        self.mesh.triangles.iter().map(|t| t.map(corner)).collect()
    }

    /// Shares of `rays` rays that find a hole, one for each epsilon, in f32 and f64.
    fn naive(&self, scale: f64, rays: u64) -> [[f64; EPSILONS.len()]; 2] {
        let wide = self.scaled(scale);
        let narrow: Vec<[Vec3; 3]> = wide.iter().map(|t| t.map(|p| p.as_vec3())).collect();
        let holes = (0..rays).into_par_iter().map(|i| {
            let (ray, distance, _) = self.ray(i);
            let (org, most) = (ray.org * scale, distance * scale * 1.001);
            let found = [
                in_f32(org.as_vec3(), ray.dir.as_vec3(), most as f32, &narrow),
                in_f64(org, ray.dir, most, &wide),
            ];
            found.map(|det| EPSILONS.map(|e| u64::from(det.is_none_or(|det| det < e))))
        });
        let sum = |a: [[u64; 9]; 2], b: [[u64; 9]; 2]| {
            std::array::from_fn(|p| std::array::from_fn(|e| a[p][e] + b[p][e]))
        };
        let holes = holes.reduce(|| [[0; 9]; 2], sum);
        holes.map(|shares| shares.map(|count| count as f64 / rays as f64))
    }

    /// What the rays find in the product's picture of the mesh at `scale`.
    fn holes(&self, scale: f64, rays: u64, one_by_one: bool) -> Holes {
        let mut world = shapes::world_of(self.mesh.clone());
        world.meshes[0].positions.iter_mut().for_each(|p| *p *= scale);
        let scene = world.into_scene(true).unwrap();
        let embree = EmbreeIntersector::new(&scene, HitRules::default(), suite::isa(), 4).unwrap();
        let oracle = Oracle::new(&scene);
        let single = OneByOne(&embree);
        let tracer: &dyn Intersector = if one_by_one { &single } else { &embree };
        let make = |i: u64| {
            let (ray, distance, _) = self.ray(i);
            // The point that the ray aims at lies at t = 1.
            let ray = Ray::new(ray.org * scale, ray.dir * (distance * scale));
            to_scene(&ray, &scene.recentring)
        };
        let judge = |rays: &[Ray], hits: &[Option<Hit>]| {
            let each = rays.iter().zip(hits).map(|(ray, hit)| judge(&oracle, ray, *hit));
            each.fold(Holes::default(), Holes::plus)
        };
        suite::trace(tracer, rays, make, judge, Holes::plus, Holes::default)
    }
}

/// What rays at a closed mesh find that do not hit it where they should.
#[derive(Debug, Default)]
struct Holes {
    /// The court hits the mesh, and the product nothing or only what lies behind.
    holes: u64,
    /// The same, but the ray touches the outline: within the band it passes faces that look both
    /// ways, so that the last bit of the ray decides whether it meets them.
    outlines: u64,
    example: Option<String>,
}

impl Holes {
    fn plus(self, o: Self) -> Self {
        Self {
            holes: self.holes + o.holes,
            outlines: self.outlines + o.outlines,
            example: self.example.or(o.example),
        }
    }
}

fn judge(oracle: &Oracle, ray: &Ray, hit: Option<Hit>) -> Holes {
    let mut found = Holes::default();
    // The point that the ray aims at, or something before it, is hit by nearly all.
    if hit.is_some_and(|hit| hit.t <= 1.001) {
        return found;
    }
    let Some(exact) = oracle.intersect(ray, &mut RayCounts::default()) else { return found };
    if hit.is_some_and(|hit| hit.t <= exact.t + 1e-3) {
        return found;
    }
    let line = oracle.line(ray);
    let corners = oracle.corners(exact.prim).unwrap();
    let near = oracle.near(ray, BAND * line.ulp(&corners));
    let faces = near.iter().map(|prim| oracle.corners(*prim).unwrap());
    // Faces of one edge or vertex: such as share a corner with what should be hit.
    let around = faces.filter(|face| face.iter().any(|p| corners.contains(p)));
    let fronts = around.map(|[a, b, c]| (b - a).cross(c - a).dot(ray.dir) < 0.0);
    let (mut front, mut back) = (false, false);
    fronts.for_each(|is_front| if is_front { front = true } else { back = true });
    if line.edge_ulps(&corners) <= BAND && front && back {
        found.outlines += 1;
    } else {
        found.holes += 1;
        found.example = Some(format!("{ray:?}: {hit:?}, the court {exact:?}"));
    }
    found
}

/// The meshes: a sphere of radius 0.05 from inside; the bunny from around it, where it is at hand.
fn subjects(outcome: &mut Outcome) -> Vec<Subject> {
    let sphere = shapes::sphere(DVec3::ZERO, 0.05, 200, 100);
    let mut subjects = vec![Subject::new("sphere", sphere, |rng| shapes::in_ball(rng, 0.01))];
    let file = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/meshes"))
        .join("stanford-bunny.obj");
    if file.exists() {
        let model = tweenray::import::load_model(&file, NormalPolicy::Flat).unwrap();
        let mesh = model.world.meshes.into_iter().next().unwrap();
        // 0.16 wide, its middle at about (-0.02, 0.11, 0).
        let eye = |rng: &mut rand_pcg::Pcg64Mcg| {
            DVec3::new(-0.02, 0.11, 0.0) + shapes::direction(rng) * 0.4
        };
        subjects.push(Subject::new("bunny", mesh, eye));
    } else {
        outcome.skip("the bunny: no mesh of it lies beside the project");
    }
    subjects
}

fn percent(shares: &[f64]) -> String {
    let shares: Vec<String> = shares.iter().map(|s| format!("{:.1}", 100.0 * s)).collect();
    shares.join(" ")
}

/// Meshes at scales from 1e-6 to 1e6.
pub fn bunny_holes(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let epsilons: Vec<String> = EPSILONS.iter().map(|e| format!("{e:.0e}")).collect();
    outcome.show(format!("naive formula: % holes at epsilons {}", epsilons.join(" ")));
    let mut outlines = 0;
    for subject in subjects(&mut outcome) {
        for power in (-6..=6).step_by(size.of(6, 1)) {
            let scale = 10f64.powi(power);
            for one_by_one in [false, true] {
                let rays = size.of(20_000, 1_000_000);
                let found = subject.holes(scale, rays, one_by_one);
                outcome.count(rays, found.holes);
                found.example.into_iter().for_each(|line| outcome.example(line));
                outlines += found.outlines;
            }
            let [narrow, wide] = subject.naive(scale, size.of(60, 2000));
            let name = subject.name;
            outcome.show(format!("{name} x 1e{power}, f32: {}", percent(&narrow)));
            outcome.show(format!("{name} x 1e{power}, f64: {}", percent(&wide)));
            if power == 0 && name == "sphere" {
                outcome.at_least("f32, epsilon 1e-6: share of holes", narrow[7], 0.04);
                outcome.at_least("f32, epsilon 1e-5: share of holes", narrow[8], 1.0);
                outcome.at_least("f64, epsilon 1e-5: share of holes", wide[8], 1.0);
            }
        }
    }
    outcome.show(format!("{outlines} rays that touch the outline pass it by"));
    outcome
}
