//! The same rays on different instruction sets.

use crate::shapes;
use crate::suite::{self, BATCH, Outcome, Size};
use rand::Rng;
use rayon::prelude::*;
use tweenray::intersect::{EmbreeIntersector, Hit, Intersector, Ray};
use tweenray::math::DVec3;
use tweenray::scene::{HitRules, Recheck, Scene};
use tweenray::stats::RayCounts;

const SETS: [&str; 3] = ["sse4.2", "avx2", "avx512"];
/// A ray that passes an edge of its triangle closer than this is in the edge band: 4 ulp of f32 at
/// the largest distance, 4.
const BAND: f64 = 4.0 * 4.0 * 1.2e-7;

/// Differences between two instruction sets.
#[derive(Default, Clone, Copy)]
struct Differences {
    /// The neighbour across an edge, with the point within the edge band of both.
    ties: u64,
    /// One passes the outline of the mesh by, where the other's hit lies within the edge band.
    outlines: u64,
    /// Anything else.
    others: u64,
    /// The same primitive, but another t, u or v.
    values: u64,
}

impl Differences {
    fn plus(self, o: Self) -> Self {
        Self {
            ties: self.ties + o.ties,
            outlines: self.outlines + o.outlines,
            others: self.others + o.others,
            values: self.values + o.values,
        }
    }
}

pub fn agreement(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let scene = shapes::scene_of(shapes::sphere(DVec3::ZERO, 1.0, 400, 200));
    let sets: Vec<&str> = SETS.into_iter().filter(|set| runs_here(set)).collect();
    outcome.show(format!("instruction sets here: {}", sets.join(", ")));
    for (kind, share) in [("random", 1e-6), ("edge-aimed", 1.0)] {
        let rays = size.of(100_000, 4_000_000);
        let make = |i: u64| aimed(&scene, i, kind == "edge-aimed");
        for recheck in [Recheck::Always, Recheck::Off] {
            let rules = HitRules { recheck, ..HitRules::default() };
            let with = |set: &&str| EmbreeIntersector::new(&scene, rules, Some(set), 4).unwrap();
            let tracers: Vec<EmbreeIntersector> = sets.iter().map(with).collect();
            for (set, tracer) in sets.iter().zip(&tracers).skip(1) {
                let d = compare(&scene, &tracers[0], tracer, rays, make);
                let first = sets[0];
                outcome.show(format!(
                    "{kind}, recheck {recheck:?}, {set} against {first}: {} ties at edges, {} at \
                     outlines, {} other primitives, {} other values of {rays}",
                    d.ties, d.outlines, d.others, d.values
                ));
                if recheck == Recheck::Always {
                    outcome.count(rays, d.others + d.values);
                    // Ties at random rays are rare.
                    let most = (share * rays as f64).max(1.0);
                    let name = format!("{kind}, {set}: ties");
                    outcome.at_most(&name, (d.ties + d.outlines) as f64, most);
                }
            }
        }
    }
    outcome
}

/// Whether the processor, and the Embree at hand, have this instruction set.
fn runs_here(set: &str) -> bool {
    let has = match set {
        #[cfg(target_arch = "x86_64")]
        "sse4.2" => is_x86_feature_detected!("sse4.2"),
        #[cfg(target_arch = "x86_64")]
        "avx2" => is_x86_feature_detected!("avx2"),
        #[cfg(target_arch = "x86_64")]
        "avx512" => is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512vl"),
        _ => false,
    };
    let scene = || shapes::scene_of(shapes::sphere(DVec3::ZERO, 1.0, 4, 3));
    has && EmbreeIntersector::new(&scene(), HitRules::default(), Some(set), 1).is_ok()
}

fn aimed(scene: &Scene, i: u64, at_edge: bool) -> Ray {
    let mut rng = suite::rng(24, i);
    let org = shapes::direction(&mut rng) * rng.random_range(0.0..3.0);
    if !at_edge {
        return Ray::new(org, shapes::direction(&mut rng));
    }
    let mesh = &scene.meshes[0];
    let corners = mesh.corners(rng.random_range(0..mesh.triangles.len()));
    let k = rng.random_range(0..3);
    let along = if i % 3 == 0 { 0.0 } else { rng.random() };
    Ray::new(org, corners[k].lerp(corners[(k + 1) % 3], along) - org)
}

fn compare(
    scene: &Scene,
    a: &EmbreeIntersector,
    b: &EmbreeIntersector,
    rays: u64,
    make: impl Fn(u64) -> Ray + Sync,
) -> Differences {
    let batches = (0..rays.div_ceil(BATCH)).into_par_iter();
    let one = |batch: u64| {
        let rays: Vec<Ray> = (batch * BATCH..((batch + 1) * BATCH).min(rays)).map(&make).collect();
        let hits = |tracer: &EmbreeIntersector| {
            let mut hits = vec![None; rays.len()];
            tracer.intersect_batch(&rays, &mut hits, &mut RayCounts::default());
            hits
        };
        let pairs = rays.iter().zip(hits(a).into_iter().zip(hits(b)));
        pairs.fold(Differences::default(), |sum, (ray, (a, b))| {
            sum.plus(difference(scene, ray, a, b))
        })
    };
    batches.map(one).reduce(Differences::default, Differences::plus)
}

fn difference(scene: &Scene, ray: &Ray, a: Option<Hit>, b: Option<Hit>) -> Differences {
    let at_edge = |h: &Hit| edge_distance(scene, ray, h) < BAND;
    let mut d = Differences::default();
    match (a, b) {
        (Some(a), Some(b)) if a.prim == b.prim => d.values += u64::from(a != b),
        (Some(a), Some(b)) => {
            let (near, far) = if a.t <= b.t { (a, b) } else { (b, a) };
            let neighbours = (far.t - near.t) * ray.dir.length() < 1e-4;
            if neighbours && at_edge(&near) && at_edge(&far) {
                d.ties += 1;
            } else if at_edge(&near) {
                d.outlines += 1;
            } else {
                d.others += 1;
            }
        }
        (Some(hit), None) | (None, Some(hit)) if at_edge(&hit) => d.outlines += 1,
        (None, None) => {}
        _ => d.others += 1,
    }
    d
}

/// How close the line of `ray` passes the nearest edge of what it hits.
fn edge_distance(scene: &Scene, ray: &Ray, hit: &Hit) -> f64 {
    let corners = scene.meshes[0].corners(hit.prim.prim_id as usize);
    let distance = |k: usize| {
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        let across = ray.dir.cross(b - a);
        ((a - ray.org).dot(across) / across.length()).abs()
    };
    distance(0).min(distance(1)).min(distance(2))
}
