//! The same rays on different instruction sets, around and inside a closed sphere.
//!
//! Where two sets hit different triangles the exact court decides what it means.

use super::wide;
use crate::shapes;
use crate::suite::{self, BATCH, Outcome, Size};
use rand::Rng;
use rayon::prelude::*;
use tweenray::intersect::court::Line;
use tweenray::intersect::{EmbreeIntersector, Hit, Intersector, Oracle, PrimRef, Ray};
use tweenray::math::DVec3;
use tweenray::scene::{HitRules, Recheck, Scene};
use tweenray::stats::RayCounts;

const SETS: [&str; 4] = ["sse4.2", "avx", "avx2", "avx512"];

/// The instruction sets that the processor has, of those that Embree is built for.
pub fn sets_here() -> Vec<&'static str> {
    SETS.into_iter().filter(|set| runs_here(set)).collect()
}

/// ulps from an edge within which a ray may be said to meet either triangle.
const BAND: f64 = 4.0;

/// Differences between two instruction sets.
#[derive(Default, Clone)]
struct Differences {
    /// Two triangles that the ray passes within the band, at the same distance to what that leaves
    /// open.
    ties: u64,
    /// From one hit to the other the ray keeps to the surface within the band: it runs along an edge.
    along: u64,
    /// The ray touches the outline: within the band it passes faces that look both ways, at the
    /// nearer hit. Going on from there, or hitting nothing, is as right as hitting it.
    outlines: u64,
    /// One set goes through the closed surface where the other hits it.
    holes: u64,
    /// The same primitive, but another t, u or v.
    values: u64,
    example: Option<String>,
}

impl Differences {
    fn plus(self, o: Self) -> Self {
        Self {
            ties: self.ties + o.ties,
            along: self.along + o.along,
            outlines: self.outlines + o.outlines,
            holes: self.holes + o.holes,
            values: self.values + o.values,
            example: self.example.or(o.example),
        }
    }
}

pub fn agreement(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let scene = shapes::scene_of(shapes::sphere(DVec3::ZERO, 1.0, 400, 200));
    let sets = sets_here();
    outcome.show(format!("instruction sets here: {}", sets.join(", ")));
    let oracle = Oracle::new(&scene);
    for kind in ["random", "edge-aimed"] {
        let rays = size.of(100_000, 4_000_000);
        let make = |i: u64| aimed(&scene, i, kind == "edge-aimed");
        for recheck in [Recheck::Always, Recheck::Off] {
            let rules = HitRules { recheck, ..HitRules::default() };
            let with = |set: &&str| EmbreeIntersector::new(&scene, rules, Some(set), 4).unwrap();
            let tracers: Vec<EmbreeIntersector> = sets.iter().map(with).collect();
            for (set, tracer) in sets.iter().zip(&tracers).skip(1) {
                let d = compare(&oracle, &tracers[0], tracer, rays, make);
                let first = sets[0];
                outcome.show(format!(
                    "{kind}, recheck {recheck:?}, {set} against {first}: {} ties at edges, {} along \
                     edges, {} touch the outline, {} holes, {} other values of {rays}",
                    d.ties, d.along, d.outlines, d.holes, d.values
                ));
                if recheck == Recheck::Always {
                    outcome.count(rays, d.holes + d.values);
                    d.example.into_iter().for_each(|line| outcome.example(line));
                    if kind == "random" {
                        let name = format!("{kind}, {set}: other triangles");
                        let most = (5e-6 * rays as f64).max(1.0);
                        outcome.at_most(&name, (d.ties + d.along + d.outlines) as f64, most);
                    }
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
        "avx" => is_x86_feature_detected!("avx"),
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
    // A block is inside or outside as a whole, as the renderer's blocks are: of one that is half
    // inside no hit can be told to be the wrong side's (docs/decisions/016-vertices-leak.md).
    let inside = i / BATCH % 3 == 0;
    let distance = if inside { 0.0..0.95 } else { 1.05..3.0 };
    let org = shapes::direction(&mut rng) * rng.random_range(distance);
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
    oracle: &Oracle,
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
            sum.plus(difference(oracle, ray, a, b))
        })
    };
    batches.map(one).reduce(Differences::default, Differences::plus)
}

fn difference(oracle: &Oracle, ray: &Ray, a: Option<Hit>, b: Option<Hit>) -> Differences {
    let mut d = Differences::default();
    let (near, far) = match (a, b) {
        (None, None) => return d,
        (Some(a), Some(b)) if a.prim == b.prim => {
            d.values += u64::from(a != b);
            return d;
        }
        (Some(a), Some(b)) if b.t < a.t => (b, Some(a)),
        (Some(a), b) => (a, b),
        (None, Some(b)) => (b, None),
    };
    let line = oracle.line(ray);
    if far.is_some_and(|far| is_tie(oracle, &line, ray, &near, &far)) {
        d.ties += 1;
    } else if far.is_some_and(|far| runs_along(oracle, &line, ray, &near, &far)) {
        d.along += 1;
    } else if touches_outline(oracle, &line, ray, &near) {
        d.outlines += 1;
    } else {
        d.holes += 1;
        let met = oracle.all_hits(ray);
        d.example = Some(format!("{ray:?}: {a:?} or {b:?}; the court: {met:?}"));
    }
    d
}

/// How far apart the ray may be said to meet a plane that it passes at an angle of this cosine.
fn slack(line: &Line, corners: &[DVec3; 3], cosine: f64) -> f64 {
    2.0 * BAND * line.ulp(corners) / cosine.abs().max(1e-3)
}

/// The cosine between the ray and the triangle's normal; negative where it meets the front.
fn cosine([a, b, c]: &[DVec3; 3], ray: &Ray) -> f64 {
    (*b - *a).cross(*c - *a).normalize().dot(ray.dir.normalize())
}

fn is_tie(oracle: &Oracle, line: &Line, ray: &Ray, near: &Hit, far: &Hit) -> bool {
    let corners = [near, far].map(|hit| oracle.corners(hit.prim).unwrap());
    let slack = corners.map(|c| slack(line, &c, cosine(&c, ray)));
    corners.iter().all(|c| line.edge_ulps(c) <= BAND)
        && (far.t - near.t) * ray.dir.length() <= slack[0] + slack[1]
}

/// Whether every part of the ray between the two hits lies within the band of the surface, so that
/// it went through nothing.
fn runs_along(oracle: &Oracle, line: &Line, ray: &Ray, near: &Hit, far: &Hit) -> bool {
    let band = BAND * line.ulp(&oracle.corners(near.prim).unwrap());
    let around = oracle.near(ray, band);
    let around: Vec<_> = around.into_iter().map(|prim| oracle.corners(prim).unwrap()).collect();
    const PARTS: u32 = 16;
    (0..=PARTS).all(|k| {
        let p = ray.at(near.t + (far.t - near.t) * f64::from(k) / f64::from(PARTS));
        around.iter().any(|corners| wide::point_to_triangle(p, corners) <= band)
    })
}

/// Whether the ray passes, within the band and around `near`, faces that look both ways.
fn touches_outline(oracle: &Oracle, line: &Line, ray: &Ray, near: &Hit) -> bool {
    let corners = oracle.corners(near.prim).unwrap();
    if line.edge_ulps(&corners) > BAND {
        return false;
    }
    // Faces of one edge or vertex: such as share a corner with what was hit.
    let shares = |c: &[DVec3; 3]| c.iter().any(|p| corners.contains(p));
    let around: Vec<PrimRef> = oracle.near(ray, BAND * line.ulp(&corners));
    let cosines = around.into_iter().filter_map(|prim| {
        let corners = oracle.corners(prim)?;
        shares(&corners).then(|| cosine(&corners, ray))
    });
    let (front, back) = cosines.fold((false, false), |(f, b), c| (f || c < 0.0, b || c >= 0.0));
    front && back
}
