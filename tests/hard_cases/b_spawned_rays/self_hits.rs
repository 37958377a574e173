//! Rays that leave a surface do not meet it again, nor the surface they are sent to.

use crate::common;
use crate::shapes;
use crate::suite::{self, Outcome, Size};
use rand::Rng;
use rayon::prelude::*;
use tweenray::intersect::{
    EmbreeIntersector, Hit, Intersector, Oracle, PlaneError, PrimRef, Ray, RayEnd,
    SurfaceInteraction,
};
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::{HitRules, Material, Recheck, Scene, World};
use tweenray::stats::RayCounts;

/// What came of the rays of one pair of triangles.
#[derive(Debug, Default, Clone, Copy)]
struct Tally {
    rays: u64,
    self_hits: u64,
    /// With the offset alone, the primitive not excluded.
    offset_alone: u64,
    /// With neither.
    bare: u64,
    false_occlusions: u64,
    /// Of the same rays without the rule.
    naive_occlusions: u64,
    /// The first pair that fails.
    first: Option<u64>,
}

impl Tally {
    fn plus(self, o: Self) -> Self {
        Self {
            rays: self.rays + o.rays,
            self_hits: self.self_hits + o.self_hits,
            offset_alone: self.offset_alone + o.offset_alone,
            bare: self.bare + o.bare,
            false_occlusions: self.false_occlusions + o.false_occlusions,
            naive_occlusions: self.naive_occlusions + o.naive_occlusions,
            first: self.first.or(o.first),
        }
    }
}

pub fn reintersect(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let (pairs, rays) = size.of((300, 200), (100_000, 1000));
    let tally =
        (0..pairs).into_par_iter().map(|i| pair(i, rays)).reduce(Tally::default, Tally::plus);
    outcome.count(tally.rays, tally.self_hits);
    // The exclusion alone would hide a wrong offset: the offset has to do without it, as pbrt's does.
    // The product's rays also exclude what they leave; the offset alone fails on needles only.
    let alone = tally.offset_alone as f64 / tally.rays as f64;
    outcome.at_most("self-hits by the offset alone, share", alone, 1e-6);
    outcome.count(tally.rays, tally.false_occlusions);
    if let Some(first) = tally.first {
        outcome.example(format!("pair {first}: {:?}", triangles(first)));
    }
    let share = |n: u64| 100.0 * n as f64 / tally.rays as f64;
    outcome.show(format!(
        "{pairs} triangles: {} self-hits; by the offset alone {} ({:.4} %), without both {:.1} %",
        tally.self_hits,
        tally.offset_alone,
        share(tally.offset_alone),
        share(tally.bare),
    ));
    outcome.show(format!(
        "segments between two triangles: {} falsely occluded, {:.1} % without the rule",
        tally.false_occlusions,
        share(tally.naive_occlusions)
    ));
    // Else the case is not hard.
    outcome.at_least("self-hits without offset and exclusion, %", share(tally.bare), 1.0);
    outcome.at_least("occlusions without the rule, %", share(tally.naive_occlusions), 1.0);
    outcome
}

/// Two triangles, coordinates of either sign from 1e-8 to 1e8.
fn triangles(i: u64) -> [[DVec3; 3]; 2] {
    let mut rng = suite::rng(26, i);
    let mut coordinate = || {
        let size = 10f64.powf(rng.random_range(-8.0..=8.0));
        if rng.random() { size } else { -size }
    };
    [0; 2].map(|_| [0; 3].map(|_| DVec3::new(coordinate(), coordinate(), coordinate())))
}

fn pair(i: u64, rays: u64) -> Tally {
    let mut world = World::default();
    world.materials.push(Material::diffuse("white", Rgb::ONE));
    for corners in triangles(i) {
        world.meshes.push(common::mesh(corners.to_vec(), vec![[0, 1, 2]], 0));
    }
    // The world's own coordinates are the harder half, and take the pairs of which one triangle is
    // too small to be told from a point beside the other.
    let recentred = if i % 2 == 0 { world.clone().into_scene(true).ok() } else { None };
    let scene = recentred.unwrap_or_else(|| world.into_scene(false).unwrap());
    let embree = EmbreeIntersector::new(&scene, HitRules::default(), suite::isa(), 1).unwrap();
    let mut rng = suite::rng(27, i);
    let plane_error = PlaneError::of(&scene.meshes[1].corners(0));
    let (mut spawned, mut sent) = (Vec::new(), Vec::new());
    let (mut bare, mut naive) = (Vec::new(), Vec::new());
    for _ in 0..rays {
        let from = point(&scene, 0, &mut rng);
        let to = point(&scene, 1, &mut rng);
        let dir = shapes::direction(&mut rng);
        spawned.push(from.spawn(dir, true));
        bare.push(from.spawn(dir, false));
        let target = RayEnd { point: to.p, normal: to.ng, plane_error };
        sent.push(from.spawn_to(&target, true));
        naive.push(from.spawn_to(&target, false));
    }
    let own = |rays: &[Ray]| {
        let mut hits = vec![None; rays.len()];
        embree.intersect_batch(rays, &mut hits, &mut RayCounts::default());
        hits.iter().flatten().filter(|h: &&Hit| h.prim.geom_id == 0).count() as u64
    };
    let occluded = |rays: &[Ray]| {
        let mut occluded = vec![false; rays.len()];
        embree.occluded_batch(rays, &mut occluded, &mut RayCounts::default());
        occluded.into_iter().filter(|o| *o).count() as u64
    };
    let alone: Vec<Ray> = spawned.iter().map(|r| Ray { exclude: PrimRef::NONE, ..*r }).collect();
    let (self_hits, offset_alone) = (own(&spawned), own(&alone));
    let false_occlusions = occluded(&sent);
    Tally {
        rays,
        self_hits,
        offset_alone,
        bare: own(&bare),
        false_occlusions,
        naive_occlusions: occluded(&naive),
        first: (self_hits + offset_alone + false_occlusions > 0).then_some(i),
    }
}

/// A point of mesh `geom`'s one triangle: inside, on an edge or at a corner.
fn point(scene: &Scene, geom: u32, rng: &mut impl Rng) -> SurfaceInteraction {
    let (a, b) = (rng.random::<f64>(), rng.random::<f64>());
    let (u, v) = match rng.random_range(0..10) {
        0 => (0.0, 0.0),
        1 => (a, 0.0),
        2 => (a, 1.0 - a),
        _ if a + b > 1.0 => (1.0 - a, 1.0 - b),
        _ => (a, b),
    };
    let hit = Hit { t: 1.0, u, v, prim: PrimRef { geom_id: geom, prim_id: 0 }, rough: false };
    SurfaceInteraction::new(scene, &Ray::new(DVec3::ZERO, DVec3::X), &hit)
}

/// Rays that leave a sphere of facets outwards, at the origin and far from it.
pub fn offset_far(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let rays = size.of(20_000, 900_000);
    for offset in [0.0, 100.0, 1e4, 1e6] {
        let mesh = || shapes::sphere(DVec3::splat(offset), 2.0, 200, 100);
        let ours = shapes::scene_of(mesh());
        let embree = EmbreeIntersector::new(&ours, HitRules::default(), suite::isa(), 4).unwrap();
        let oracle = Oracle::new(&ours);
        let hits = spawned_hits(&ours, &embree, rays, |si, dir| si.spawn(dir, true));
        // A sphere of rounded corners is not quite convex: what the oracle sees too is there.
        let real =
            |(ray, _): &&(Ray, Hit)| oracle.intersect(ray, &mut RayCounts::default()).is_some();
        let real = hits.iter().filter(real).count();
        outcome.count(rays, (hits.len() - real) as u64);

        let raw = shapes::world_of(mesh()).into_scene(false).unwrap();
        let off = HitRules {
            robust: true,
            retry: false,
            recheck: Recheck::Off,
            spawn_offset: false,
            recentre: false,
        };
        let stock = EmbreeIntersector::new(&raw, off, suite::isa(), 4).unwrap();
        let naive = spawned_hits(&raw, &stock, rays, |si, dir| {
            let p = (si.p + si.ng * 1e-4).as_vec3().as_dvec3();
            Ray::new(p, dir)
        });
        let share = 100.0 * naive.len() as f64 / rays as f64;
        outcome.show(format!(
            "offset {offset:.0e}: {} self-hits ({real} true hits of a neighbour), naive +1e-4 n {share:.1} %",
            hits.len() - real
        ));
        if offset == 1e4 {
            outcome.at_least("naive self-hits at 1e4, %", share, 10.0);
        }
    }
    outcome
}

/// Hits of rays that `spawn` sends outwards from where rays from outside hit.
fn spawned_hits(
    scene: &Scene,
    tracer: &EmbreeIntersector,
    rays: u64,
    spawn: impl Fn(&SurfaceInteraction, DVec3) -> Ray + Sync,
) -> Vec<(Ray, Hit)> {
    let centre = scene.bounds.centre();
    let radius = 0.5 * scene.bounds.extent().max_element();
    let mut counts = RayCounts::default();
    let (mut first, mut second) = (Vec::new(), Vec::new());
    for i in 0..rays {
        let mut rng = suite::rng(28, i);
        let org = centre + shapes::direction(&mut rng) * 3.0 * radius;
        let target = centre + shapes::in_ball(&mut rng, 0.95 * radius);
        first.push(Ray::new(org, (target - org).normalize()));
    }
    let mut hits = vec![None; first.len()];
    tracer.intersect_batch(&first, &mut hits, &mut counts);
    for (i, (ray, hit)) in first.iter().zip(&hits).enumerate() {
        let Some(hit) = hit else { continue };
        let si = SurfaceInteraction::new(scene, ray, hit);
        let dir = shapes::direction(&mut suite::rng(29, i as u64));
        let dir = if si.is_outside(dir) { dir } else { -dir };
        second.push(spawn(&si, dir));
    }
    let mut hits = vec![None; second.len()];
    tracer.intersect_batch(&second, &mut hits, &mut counts);
    second.into_iter().zip(hits).filter_map(|(ray, hit)| Some((ray, hit?))).collect()
}
