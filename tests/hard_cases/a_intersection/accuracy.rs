//! How exact a hit is: weights and distances of single triangles, and triangles seen from afar.

use super::ways::{OneByOne, stock, to_scene};
use super::wide;
use crate::shapes;
use crate::suite::{self, Outcome, Size};
use rand::Rng;
use rayon::prelude::*;
use tweenray::intersect::court::Line;
use tweenray::intersect::{EmbreeIntersector, Hit, Intersector, Ray};
use tweenray::math::DVec3;
use tweenray::scene::{HitRules, Mesh, WorldMesh};
use tweenray::stats::RayCounts;

/// Rays a triangle.
const RAYS: u64 = 4;
/// ulps of f32 that `t` (of itself), `u` and `v` (of 1) may be off.
const ULPS: f64 = 4.0;
/// ulps of the largest coordinate from an edge within which a hit is anybody's guess.
const BAND: f64 = 4.0;

#[derive(Default)]
struct Accuracy {
    rays: u64,
    hits: u64,
    /// Missed, or hit beside the triangle, away from the edges.
    wrong: u64,
    /// Hits off by more than `ULPS`.
    inexact: u64,
    /// Worst error in ulps of f32: t, u, v.
    worst: [f64; 3],
    example: Option<String>,
}

impl Accuracy {
    fn sum(mut self, other: Self) -> Self {
        self.rays += other.rays;
        self.hits += other.hits;
        self.wrong += other.wrong;
        self.inexact += other.inexact;
        self.worst = std::array::from_fn(|k| self.worst[k].max(other.worst[k]));
        self.example = self.example.or(other.example);
        self
    }
}

/// Triangles in a scene.
const GROUP: u32 = 100;

/// Triangles of scene `i`: each coordinate of either sign and from 1e-4 to 1e4 large.
fn triangles(i: u64) -> WorldMesh {
    let mut rng = suite::rng(10, i);
    let mut coordinate = || {
        let sign = if rng.random() { 1.0 } else { -1.0 };
        sign * 10f64.powf(rng.random_range(-4.0..4.0))
    };
    let positions =
        (0..3 * GROUP).map(|_| DVec3::new(coordinate(), coordinate(), coordinate())).collect();
    let triangles = (0..GROUP).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    WorldMesh::new("many", positions, triangles, 0)
}

/// A scene ray at an inner point of a triangle.
fn ray_at([a, b, c]: &[DVec3; 3], rng: &mut impl Rng) -> Ray {
    let (u, v): (f64, f64) = (rng.random(), rng.random());
    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
    let target = *a + (*b - *a) * u + (*c - *a) * v;
    let size = wide::longest_edge(&[*a, *b, *c]);
    let away = shapes::direction(rng) * size * 10f64.powf(rng.random_range(-1.0..1.0));
    Ray::new(target + away, -away * 10f64.powf(rng.random_range(-2.0..2.0)))
}

fn measure(i: u64, rules: HitRules) -> Accuracy {
    let scene = shapes::world_of(triangles(i)).into_scene(rules.recentre).unwrap();
    let mesh = &scene.meshes[0];
    let embree = EmbreeIntersector::new(&scene, rules, suite::isa(), 1).unwrap();
    let mut found = Accuracy::default();
    for prim in 0..GROUP as usize {
        let aimed = mesh.corners(prim);
        for k in 0..RAYS {
            let mut rng = suite::rng(1000 + i, RAYS * prim as u64 + k);
            let ray = ray_at(&aimed, &mut rng);
            let hit = embree.intersect(&ray, &mut RayCounts::default());
            judge(mesh, &aimed, &ray, hit, &mut found);
        }
    }
    found
}

fn judge(mesh: &Mesh, aimed: &[DVec3; 3], ray: &Ray, hit: Option<Hit>, found: &mut Accuracy) {
    // What is hit may lie before the triangle that was aimed at, but no further behind it than the
    // nearest of two by Embree's f32 distances may be the farther one.
    let line = Line::new(ray, mesh.bounds.largest_coordinate());
    let in_band = |corners: &[DVec3; 3]| line.edge_ulps(corners) <= BAND;
    let wanted = line.meet(aimed).filter(|_| !in_band(aimed));
    let depth = BAND * line.ulp(aimed) / ray.dir.length();
    let mut wrong = wanted.is_some_and(|m| hit.is_none_or(|h| h.t > m.t + depth));
    let mut errors = [0.0; 3];
    if let Some(hit) = hit {
        let corners = mesh.corners(hit.prim.prim_id as usize);
        match wide::meet(ray, &corners).filter(|_| line.meet(&corners).is_some()) {
            Some(met) => {
                errors = [(hit.t - met.t) / met.t, hit.u - met.u, hit.v - met.v]
                    .map(|e| e.abs() / f64::from(f32::EPSILON));
            }
            None => wrong |= !in_band(&corners),
        }
    }
    let inexact = errors.iter().any(|e| e.is_nan() || *e > ULPS);
    found.rays += 1;
    found.hits += u64::from(hit.is_some());
    found.wrong += u64::from(wrong);
    found.inexact += u64::from(inexact);
    found.worst = std::array::from_fn(|k| found.worst[k].max(errors[k]));
    if wrong || inexact {
        found.example.get_or_insert_with(|| {
            format!("{ray:?} aimed at {aimed:?} which it meets at {wanted:?}: {hit:?}")
        });
    }
}

/// `t`, `u` and `v` on random triangles, many of them needles.
pub fn hit_accuracy(size: Size) -> Outcome {
    let all = |count: u64, rules: HitRules| {
        let each = (0..count).into_par_iter().map(|i| measure(i, rules));
        each.reduce(Accuracy::default, Accuracy::sum)
    };
    let mut outcome = Outcome::default();
    let scenes = size.of(100, 10_000);
    let ours = all(scenes, HitRules::default());
    outcome.count(ours.rays, ours.wrong + ours.inexact);
    let [t, u, v] = ours.worst;
    outcome.show(format!(
        "{} hits, worst error in ulps of f32: t {t:.1e}, u {u:.1e}, v {v:.1e}",
        ours.hits
    ));
    ours.example.into_iter().for_each(|e| outcome.example(e));
    let naive = all(scenes / 10, stock(true));
    let [t, u, v] = naive.worst;
    outcome.show(format!(
        "stock ROBUST, {} rays: {} beyond {ULPS} ulp, {} wrong; worst t {t:.1e}, u {u:.1e}, v {v:.1e}",
        naive.rays, naive.inexact, naive.wrong
    ));
    outcome.at_least("inexact hits of stock Embree", naive.inexact as f64, 1.0);
    outcome
}

/// A plane of 100 x 100 cells, seen from a million units away at every triangle's middle.
pub fn small_triangle_far(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let world = shapes::world_of(plane(100));
    let rays = size.of(100_000, 1_000_000);
    let traced = |rules: HitRules, set: Option<&str>, one_by_one: bool| {
        let scene = world.clone().into_scene(rules.recentre).unwrap();
        let embree = EmbreeIntersector::new(&scene, rules, set, 4).unwrap();
        let single = OneByOne(&embree);
        let tracer: &dyn Intersector = if one_by_one { &single } else { &embree };
        let aim = |i: u64| {
            let mut rng = suite::rng(12, i);
            let prim = rng.random_range(0..scene.meshes[0].triangles.len());
            (prim, shapes::direction(&mut rng) * 1e6)
        };
        let make = |i: u64| {
            let (prim, eye) = aim(i);
            let corners = world.meshes[0].triangles[prim];
            let corners = corners.map(|k| world.meshes[0].positions[k as usize]);
            let target = (corners[0] + corners[1] + corners[2]) / 3.0;
            to_scene(&Ray::new(eye, target - eye), &scene.recentring)
        };
        let judge = |rays: &[Ray], hits: &[Option<Hit>]| {
            let (mut missed, mut other) = (0, 0);
            for (ray, hit) in rays.iter().zip(hits) {
                // The triangle whose middle the ray passes.
                let middle = ray.at(1.0);
                match hit {
                    None => missed += 1,
                    Some(hit) => {
                        let [a, b, c] = scene.meshes[0].corners(hit.prim.prim_id as usize);
                        let off = ((a + b + c) / 3.0).distance(middle);
                        other += u64::from(off > 1e-3 * a.distance(b));
                    }
                }
            }
            [missed, other]
        };
        let sum = |a: [u64; 2], b: [u64; 2]| [a[0] + b[0], a[1] + b[1]];
        suite::trace(tracer, rays, make, judge, sum, || [0, 0])
    };
    for set in super::isa::sets_here() {
        for one_by_one in [false, true] {
            let [missed, other] = traced(HitRules::default(), Some(set), one_by_one);
            outcome.count(rays, missed + other);
            let way = if one_by_one { "one by one" } else { "packets" };
            outcome.show(format!("{set}, {way}: {missed} missed, {other} on another triangle"));
        }
    }
    let [missed, other] = traced(stock(true), None, false);
    let share = |count: u64| 100.0 * count as f64 / rays as f64;
    outcome.show(format!("stock ROBUST: {:.2} % missed", share(missed)));
    outcome.at_least("stock ROBUST: % on another triangle", share(other), 1.0);
    outcome
}

/// The square from -1 to 1 in x and y, of `2 · cells²` triangles.
fn plane(cells: u32) -> WorldMesh {
    let at = |i: u32| f64::from(i) * 2.0 / f64::from(cells) - 1.0;
    let mut mesh = super::fields::field(cells, |_, _| 0.0);
    mesh.positions.iter_mut().for_each(|p| *p = DVec3::new(at(p.x as u32), at(p.y as u32), 0.0));
    mesh
}
