//! Faces in the same place, and rays in a face's plane.

use crate::common::{self, Job};
use crate::shapes;
use crate::suite::{self, Outcome, Size};
use rand::Rng;
use tweenray::intersect::{EmbreeIntersector, Hit, Intersector, Oracle, PrimRef, Ray};
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::{HitRules, Light, Material, PointLight, Scene, SphereLight, World};
use tweenray::shade::Renderer;
use tweenray::stats::RayCounts;

/// Copies of the same faces.
const COPIES: usize = 1000;

/// `COPIES` bumpy sheets in one place, materials in turn, `first` first.
fn stack(first: u32, copies: usize) -> World {
    let mut world = World::default();
    world.materials.push(Material::diffuse("red", Rgb::new(0.9, 0.1, 0.1)));
    world.materials.push(Material::diffuse("blue", Rgb::new(0.1, 0.1, 0.9)));
    for copy in 0..copies as u32 {
        let mut sheet = shapes::sphere(DVec3::new(0.1, 0.2, 0.3), 1.0, 9, 6);
        sheet.material = (first + copy) % 2;
        world.meshes.push(sheet);
    }
    let (position, intensity) = (DVec3::new(2.0, 3.0, 4.0), Rgb::splat(40.0));
    world.lights.push(Light::Point(PointLight { position, intensity }));
    let (centre, radiance) = (DVec3::new(-3.0, 3.0, 2.0), Rgb::splat(4.0));
    world.lights.push(Light::Sphere(SphereLight { centre, radius: 0.4, radiance }));
    world
}

pub fn faces(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    lowest_wins(&mut outcome, size);
    same_image(&mut outcome, size);
    outcome
}

/// Of faces at one distance the lowest (geom_id, prim_id) is named, whoever asks and how.
fn lowest_wins(outcome: &mut Outcome, size: Size) {
    let mut doubled = shapes::sphere(DVec3::ZERO, 1.0, 9, 6);
    let faces = doubled.triangles.len();
    for _ in 1..COPIES {
        doubled.triangles.extend_from_within(..faces);
    }
    let stacked = stack(0, COPIES).into_scene(true).unwrap();
    let doubled = shapes::scene_of(doubled);
    for (name, scene) in [("meshes", &stacked), ("faces of a mesh", &doubled)] {
        let embree = EmbreeIntersector::new(scene, HitRules::default(), suite::isa(), 4).unwrap();
        let oracle = Oracle::new(scene);
        let rays = size.of(4_000, 200_000);
        let make = |i: u64| {
            let mut rng = suite::rng(21, i);
            let org = shapes::direction(&mut rng) * 2.0;
            Ray::new(org, shapes::in_ball(&mut rng, 0.7) - org)
        };
        let lowest = |prim: PrimRef| {
            prim.geom_id == 0 && (prim.prim_id as usize) < faces
                || scene.meshes.len() as u32 <= prim.geom_id
        };
        let judge = |rays: &[Ray], hits: &[Option<Hit>]| {
            let mut wrong = Outcome::default();
            for (ray, hit) in rays.iter().zip(hits) {
                let single = embree.intersect(ray, &mut RayCounts::default());
                let named = |h: &Option<Hit>| h.is_none_or(|h| lowest(h.prim));
                wrong.check(named(hit), || format!("{name}, in a batch: {ray:?}: {hit:?}"));
                wrong.check(named(&single), || format!("{name}, alone: {ray:?}: {single:?}"));
            }
            // The oracle is slow: one ray in a batch.
            let truth = oracle.intersect(&rays[0], &mut RayCounts::default());
            let agree = truth.map(|h| h.prim) == hits[0].map(|h| h.prim);
            wrong.check(agree, || format!("{name}: {:?}, oracle {truth:?}", hits[0]));
            wrong
        };
        let wrong = suite::trace(&embree, rays, make, judge, Outcome::merged, Outcome::default);
        outcome.show(format!("{COPIES} {name}: {} answers not the lowest", wrong.failures));
        outcome.merge(wrong);
    }
}

/// 1, 2 and 8 threads, for the tree and for the frame; materials in both orders.
fn same_image(outcome: &mut Outcome, size: Size) {
    let edge = size.of(48, 192);
    let pose = || common::pose((0.5, 1.5, 4.0), (0.1, 0.2, 0.3));
    for first in [0, 1] {
        let job = common::job(stack(first, COPIES), pose(), edge, edge);
        // One sheet alone is what the picture must show.
        let alone = common::job(stack(first, 1), pose(), edge, edge);
        let expected = image(&alone, &alone.world.clone().into_scene(true).unwrap(), 1);
        let scene = job.world.clone().into_scene(true).unwrap();
        for threads in [1, 2, 8] {
            let found = image(&job, &scene, threads);
            let differ = found.iter().zip(&expected).filter(|(a, b)| a != b).count();
            outcome.count(found.len() as u64, differ as u64);
            let colour = ["red", "blue"][first as usize];
            outcome.show(format!("{colour} first, {threads} threads: {differ} pixels differ"));
        }
    }
}

fn image(job: &Job, scene: &Scene, threads: usize) -> Vec<Rgb> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let isa = suite::isa().map(Into::into);
    let settings = tweenray::scene::Settings { isa, ..job.settings.clone() };
    let intersector = tweenray::intersect::build(scene, &settings, threads).unwrap();
    let renderer = Renderer::new(scene, &settings, &*intersector);
    let never = std::sync::atomic::AtomicBool::new(false);
    pool.install(|| renderer.render(&job.camera, 1, false, &never, &())).unwrap().0.rgb
}

/// A ray in a face's plane hits nothing but what lies behind: the convention of both tracers.
pub fn in_plane(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    // Planes through the origin in which f64 directions lie exactly, each spanned by two vectors.
    let planes = [
        [DVec3::X, DVec3::Y],
        [DVec3::X, DVec3::Z],
        [DVec3::Y, DVec3::Z],
        [DVec3::new(1.0, 1.0, 0.0), DVec3::Z],
        [DVec3::new(1.0, 0.0, 1.0), DVec3::Y],
        [DVec3::new(0.0, 1.0, -1.0), DVec3::X],
    ];
    for [e1, e2] in planes {
        for wall in [false, true] {
            let scene = sheet(e1, e2, wall);
            let embree =
                EmbreeIntersector::new(&scene, HitRules::default(), suite::isa(), 1).unwrap();
            let oracle = Oracle::new(&scene);
            for i in 0..size.of(400, 100_000) {
                // Multiples of 1/64 keep every point and direction exactly in the plane.
                let mut rng = suite::rng(23, i);
                let mut step = |most: i32| f64::from(rng.random_range(-most..=most)) / 64.0;
                let org = e1 * step(48) + e2 * step(48);
                let dir = e1 * step(64) + e2 * step(64);
                if dir == DVec3::ZERO {
                    continue;
                }
                let ray = Ray::new(org, dir);
                let truth = oracle.intersect(&ray, &mut RayCounts::default());
                let by_oracle = truth.map(|h| h.prim.geom_id);
                for (hit, how) in both_ways(&embree, &ray) {
                    let geom = hit.map(|h| h.prim.geom_id);
                    outcome.check(geom != Some(0) && geom == by_oracle, || {
                        format!("{how}: {ray:?}: {hit:?}, oracle {truth:?}")
                    });
                }
                outcome.check(by_oracle != Some(0), || format!("oracle: {ray:?}"));
                let occluded = embree.occluded(&ray, &mut RayCounts::default());
                outcome.check(occluded == truth.is_some(), || {
                    format!("occluded {occluded}: {ray:?}, oracle {truth:?}")
                });
            }
        }
    }
    outcome
}

fn both_ways(embree: &EmbreeIntersector, ray: &Ray) -> [(Option<Hit>, &'static str); 2] {
    let mut hits = [None];
    embree.intersect_batch(std::slice::from_ref(ray), &mut hits, &mut RayCounts::default());
    [(embree.intersect(ray, &mut RayCounts::default()), "alone"), (hits[0], "in a batch")]
}

/// A grid of faces in the plane of `e1` and `e2`, within ±1/2; with `wall` a large box around it.
fn sheet(e1: DVec3, e2: DVec3, wall: bool) -> Scene {
    let mut world = World::default();
    world.materials.push(Material::diffuse("white", Rgb::ONE));
    let at = |i: u32, j: u32| e1 * (f64::from(i) / 8.0 - 0.5) + e2 * (f64::from(j) / 8.0 - 0.5);
    let positions = (0..81).map(|k| at(k % 9, k / 9)).collect();
    let faces = (0..64).flat_map(|k| {
        let a = k % 8 + k / 8 * 9;
        [[a, a + 1, a + 10], [a, a + 10, a + 9]]
    });
    world.meshes.push(common::mesh(positions, faces.collect(), 0));
    if wall {
        world.meshes.push(common::cube(DVec3::ZERO, 4.0, 0));
    }
    world.into_scene(true).unwrap()
}
