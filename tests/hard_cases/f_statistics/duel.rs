//! Embree with its rules against brute force with the exact court, on scenes small enough for it.

use crate::common;
use crate::shapes;
use crate::suite::{self, Outcome, Size};
use rand::Rng;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use tweenray::intersect::{EmbreeIntersector, Hit, Intersector, Oracle, Ray};
use tweenray::math::DVec3;
use tweenray::scene::{HitRules, Scene, WorldMesh};
use tweenray::stats::RayCounts;

/// Rays a scene.
const RAYS: u64 = 4096;
/// Width of the band along edges in which either answer is right, f32 ulp of the largest
/// coordinate: what rounding a ray to f32 moves it.
const BAND: f64 = 4.0;
/// Shares of `t` by which the two may differ.
const SAME_T: f64 = 1e-6;

/// A random mesh of some ten to some hundred triangles: a closed ball, a soup, slivers, a grid of
/// whole numbers, a flat sheet, a stack of sheets.
fn mesh(rng: &mut Pcg64Mcg) -> WorldMesh {
    let centre = if rng.random() { DVec3::ZERO } else { shapes::in_ball(rng, 1e3) };
    match rng.random_range(0..6) {
        0 => {
            let (columns, rows) = (rng.random_range(3..24), rng.random_range(2..10));
            shapes::sphere(centre, 10f64.powf(rng.random_range(-3.0..=3.0)), columns, rows)
        }
        1 => soup(rng, centre, 1.0),
        2 => soup(rng, centre, 1e-4),
        3 => sheets(centre, 8, 1, |i, j| f64::from((i * 7 + j * 3) % 5)),
        4 => sheets(centre, 8, 1, |_, _| 0.0),
        _ => sheets(centre, 4, 6, |_, _| 0.0),
    }
}

/// Triangles anywhere in the unit ball; `width` below 1 makes slivers.
fn soup(rng: &mut Pcg64Mcg, centre: DVec3, width: f64) -> WorldMesh {
    let count = rng.random_range(1..100);
    let mut positions = Vec::new();
    for _ in 0..count {
        let [a, b] = [(); 2].map(|()| centre + shapes::in_ball(rng, 1.0));
        positions.extend([a, b, a.lerp(b, rng.random()) + shapes::in_ball(rng, width)]);
    }
    let triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    common::mesh(positions, triangles, 0)
}

/// `layers` square sheets of `n` x `n` cells on whole numbers, `height` above each other's corner.
fn sheets(centre: DVec3, n: u32, layers: u32, height: impl Fn(u32, u32) -> f64) -> WorldMesh {
    let centre = centre.round();
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for layer in 0..layers {
        let base = positions.len() as u32;
        for j in 0..=n {
            for i in 0..=n {
                let z = f64::from(layer) + height(i, j);
                positions.push(centre + DVec3::new(f64::from(i), f64::from(j), z));
            }
        }
        for j in 0..n {
            for i in 0..n {
                let k = base + j * (n + 1) + i;
                triangles.extend([[k, k + 1, k + n + 2], [k, k + n + 2, k + n + 1]]);
            }
        }
    }
    common::mesh(positions, triangles, 0)
}

/// A ray in scene space: from inside, near or far; at nothing, a vertex, an edge or along an axis.
fn ray(scene: &Scene, rng: &mut Pcg64Mcg) -> Ray {
    let mesh = &scene.meshes[0];
    let corners = mesh.corners(rng.random_range(0..mesh.triangles.len()));
    let out = [1.0, 3.0, 10.0, 1e3][rng.random_range(0..4)];
    let org = shapes::in_ball(rng, out);
    let target = match rng.random_range(0..5) {
        0 => corners[0],
        1 => corners[0].lerp(corners[1], rng.random()),
        2 => {
            let axis = [DVec3::X, DVec3::Y, DVec3::Z][rng.random_range(0..3)];
            let sign = if rng.random() { out } else { -out };
            return Ray::new(corners[rng.random_range(0..3)] + axis * sign, axis * -sign);
        }
        3 => {
            let (u, v): (f64, f64) = (rng.random(), rng.random());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v
        }
        _ => shapes::in_ball(rng, 1.0),
    };
    let scale = 10f64.powf(rng.random_range(-2.0..=2.0));
    Ray::new(org, (target - org) * scale)
}

/// How the two answers go together.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Verdict {
    /// The same primitive at the same place, or none.
    Same,
    /// Another primitive at the same `t`, or an edge within the band.
    Band,
    /// One of them is wrong.
    Apart,
}

fn judge(oracle: &Oracle, ray: &Ray, embree: Option<Hit>, court: Option<Hit>) -> Verdict {
    let line = oracle.line(ray);
    let corners = |hit: &Hit| oracle.corners(hit.prim).unwrap();
    // Embree may see what the line passes by within the band, and may pass what it meets there.
    let grazed = |hit: &Hit| line.ulps(&corners(hit)) <= BAND;
    let missable = |hit: &Hit| line.edge_ulps(&corners(hit)) <= BAND;
    match (embree, court) {
        (None, None) => Verdict::Same,
        (Some(e), None) if grazed(&e) => Verdict::Band,
        (None, Some(c)) if missable(&c) => Verdict::Band,
        (Some(e), Some(c)) => {
            let near = (e.t - c.t).abs() <= SAME_T * c.t.abs();
            match e.prim == c.prim {
                true if near => Verdict::Same,
                // At an edge-on triangle the place along the ray is not defined to 1e-6.
                true if missable(&c) => Verdict::Band,
                false if near => Verdict::Band,
                false if e.t < c.t && grazed(&e) => Verdict::Band,
                false if e.t > c.t && missable(&c) => Verdict::Band,
                _ => Verdict::Apart,
            }
        }
        _ => Verdict::Apart,
    }
}

struct Tally {
    rays: u64,
    band: u64,
    hits: u64,
    apart: Vec<String>,
    wrong: u64,
}

fn duel(number: u64) -> Tally {
    let mut rng = suite::rng(60, number);
    let mesh = mesh(&mut rng);
    let Ok(scene) = shapes::world_of(mesh.clone()).into_scene(true) else {
        return Tally { rays: 0, band: 0, hits: 0, apart: Vec::new(), wrong: 0 };
    };
    let rays: Vec<Ray> = (0..RAYS).map(|_| ray(&scene, &mut rng)).collect();
    let embree = EmbreeIntersector::new(&scene, HitRules::default(), None, 1).unwrap();
    let oracle = Oracle::new(&scene);
    let mut found = [vec![None; rays.len()], vec![None; rays.len()]];
    let mut counts = RayCounts::default();
    embree.intersect_batch(&rays, &mut found[0], &mut counts);
    oracle.intersect_batch(&rays, &mut found[1], &mut counts);
    let mut tally = Tally { rays: RAYS, band: 0, hits: 0, apart: Vec::new(), wrong: 0 };
    for (i, ray) in rays.iter().enumerate() {
        let (e, c) = (found[0][i], found[1][i]);
        tally.hits += u64::from(c.is_some());
        match judge(&oracle, ray, e, c) {
            Verdict::Same => {}
            Verdict::Band => tally.band += 1,
            Verdict::Apart => {
                tally.wrong += 1;
                if tally.apart.len() < 2 {
                    tally.apart.push(format!("scene {number}: {}", minimised(&scene, ray)));
                }
            }
        }
    }
    tally
}

/// The fewest triangles, found by leaving out one after the other, on which the two are apart.
fn minimised(scene: &Scene, ray: &Ray) -> String {
    let apart = |scene: &Scene| {
        let embree = EmbreeIntersector::new(scene, HitRules::default(), None, 1).unwrap();
        let oracle = Oracle::new(scene);
        let mut counts = RayCounts::default();
        let (e, c) = (embree.intersect(ray, &mut counts), oracle.intersect(ray, &mut counts));
        (judge(&oracle, ray, e, c) == Verdict::Apart).then_some((e, c))
    };
    let mut scene = scene.clone();
    let Some(mut answers) = apart(&scene) else {
        return format!("apart in the batch only: {ray:?}");
    };
    let mut at = 0;
    while at < scene.meshes[0].triangles.len() {
        let mut fewer = scene.clone();
        fewer.meshes[0].triangles.remove(at);
        match apart(&fewer) {
            Some(found) => (scene, answers) = (fewer, found),
            None => at += 1,
        }
    }
    let mesh = &scene.meshes[0];
    let corners: Vec<[DVec3; 3]> = (0..mesh.triangles.len()).map(|i| mesh.corners(i)).collect();
    let (e, c) = answers;
    format!("{ray:?} on {corners:?} in {:?}: Embree {e:?}, court {c:?}", scene.bounds)
}

pub fn oracle_duel(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let scenes = size.of(200_000, 100_000_000) / RAYS + 1;
    let tallies: Vec<Tally> = (0..scenes).into_par_iter().map(duel).collect();
    let sum = |of: fn(&Tally) -> u64| tallies.iter().map(of).sum::<u64>();
    let rays = sum(|t| t.rays);
    outcome.count(rays, sum(|t| t.wrong));
    outcome.show(format!(
        "{scenes} scenes, {:.1} % of rays hit",
        100.0 * sum(|t| t.hits) as f64 / rays as f64
    ));
    outcome.show(format!(
        "within the band of {BAND} ulp along edges: {:.2e} of the rays differ",
        sum(|t| t.band) as f64 / rays as f64
    ));
    tallies.into_iter().flat_map(|t| t.apart).for_each(|line| outcome.example(line));
    outcome
}
