//! The rules between Embree and a trusted hit, on cases that are hard without them.

#![allow(clippy::unwrap_used)]

mod common;

use common::{job, pose, render};
use rand::Rng;
use rand_pcg::Pcg64Mcg;
use tweenray::intersect::{EmbreeIntersector, Hit, Intersector, Oracle};
use tweenray::math::{Bounds3, DVec3, Rgb};
use tweenray::ray::Ray;
use tweenray::scene::{HitRules, Light, Material, PointLight, Recheck, Scene, World, WorldMesh};
use tweenray::stats::{RayCounts, RayKind};

fn tessellated_sphere() -> Scene {
    let world = common::sphere_world(Material::diffuse("white", Rgb::ONE), true);
    world.into_scene(true).unwrap()
}

/// Rays from inside the closed sphere at each of its vertices that miss it, over many eyes.
fn leaks(scene: &Scene, rules: HitRules) -> usize {
    let intersector = EmbreeIntersector::new(scene, rules, None, 1).unwrap();
    let mesh = &scene.meshes[0];
    let mut counts = RayCounts::default();
    let mut missed = 0;
    for i in 0..60 {
        let a = f64::from(i);
        let eye = DVec3::new(a.sin(), (1.3 * a).cos(), (0.7 * a).sin()) * 0.3;
        let targets = mesh.positions[..mesh.vertex_count].iter();
        let rays: Vec<Ray> = targets.map(|v| Ray::new(eye, v.as_dvec3() - eye)).collect();
        let mut hits: Vec<Option<Hit>> = vec![None; rays.len()];
        intersector.intersect_batch(&rays, &mut hits, &mut counts);
        missed += hits.iter().filter(|h| h.is_none()).count();
        missed += rays.iter().filter(|r| intersector.intersect(r, &mut counts).is_none()).count();
    }
    missed
}

#[test]
fn no_ray_leaks_through_a_vertex() {
    let scene = tessellated_sphere();
    let without = leaks(&scene, HitRules { retry: false, ..HitRules::default() });
    assert!(without > 0, "the case is not hard: nothing leaks without a second try");
    assert_eq!(leaks(&scene, HitRules::default()), 0, "{without} leak without a second try");
}

/// A coarse ball, of any size.
fn ball(columns: u32, rows: u32) -> Scene {
    let mut ball = common::uv_sphere(columns, rows);
    let radius = 1.0 + 0.0123 * f64::from(columns * rows);
    ball.positions.iter_mut().for_each(|p| *p *= radius);
    let mut world = World::default();
    world.materials.push(Material::diffuse("white", Rgb::ONE));
    world.meshes.push(ball);
    world.into_scene(true).unwrap()
}

/// Rays from afar at the vertices on the scene's bounds that do not meet them, in blocks and one by one.
fn leaks_from_afar(scene: &Scene, rules: HitRules) -> usize {
    let intersector = EmbreeIntersector::new(scene, rules, None, 1).unwrap();
    let Bounds3 { min, max } = scene.bounds;
    let mesh = &scene.meshes[0];
    let vertices = mesh.positions[..mesh.vertex_count].iter().map(|p| p.as_dvec3());
    let mut counts = RayCounts::default();
    let mut missed = 0;
    for vertex in vertices.filter(|p| p.cmpeq(min).any() || p.cmpeq(max).any()) {
        for a in (0..200).map(f64::from) {
            let aside = DVec3::new(a.sin(), (1.3 * a).cos(), (0.7 * a).sin()) * 0.3;
            let eye = (vertex.normalize() + aside) * (8.0 + a);
            let ray = Ray::new(eye, vertex - eye);
            // In a block of backs alone nothing is tried again: one that meets a front beside it.
            let mut hits = [None; 2];
            intersector.intersect_batch(&[ray, Ray::new(eye, -eye)], &mut hits, &mut counts);
            hits[1] = intersector.intersect(&ray, &mut counts);
            let is_there = |hit: &Hit| (ray.at(hit.t) - vertex).length() < 1e-5;
            missed += hits.iter().filter(|hit| !hit.as_ref().is_some_and(is_there)).count();
        }
    }
    missed
}

/// Embree sees a ray from afar begin where it enters the scene's bounds: for a vertex on the bounds, at
/// the vertex itself, and no turn about that point leads past it.
#[test]
fn no_ray_from_afar_leaks_through_a_vertex_on_the_bounds() {
    let leaks = |rules: HitRules| -> usize {
        let balls = (3..24).flat_map(|columns| (2..10).map(move |rows| ball(columns, rows)));
        balls.map(|scene| leaks_from_afar(&scene, rules)).sum()
    };
    let without = leaks(HitRules { retry: false, ..HitRules::default() });
    assert!(without > 10, "the case is not hard: {without} leak without a second try");
    assert_eq!(leaks(HitRules::default()), 0, "{without} leak without a second try");
}

/// The square from -1 to 1 in x and y, of 2 · 50² triangles whose fronts face +z.
fn sheet() -> Scene {
    let cells = 50;
    let at = |i: u32| f64::from(i) * 2.0 / f64::from(cells) - 1.0;
    let row = cells + 1;
    let positions = (0..row * row).map(|k| DVec3::new(at(k % row), at(k / row), 0.0)).collect();
    let cell = |k: u32| k / cells * row + k % cells;
    let triangles = (0..cells * cells)
        .map(cell)
        .flat_map(|k| [[k, k + 1, k + row], [k + 1, k + row + 1, k + row]])
        .collect();
    let mut world = World::default();
    world.materials.push(Material::diffuse("white", Rgb::ONE));
    world.meshes.push(WorldMesh::new("sheet", positions, triangles, 0));
    world.into_scene(true).unwrap()
}

/// Seen edge on, all triangles of a sheet lie within the band of one another. From its back, every hit
/// asks for a second try, and turned the ray meets a neighbour: nearer, but beside where it was asked for.
#[test]
fn a_true_hit_is_not_given_up_for_a_neighbour_seen_edge_on() {
    let scene = sheet();
    let mesh = &scene.meshes[0];
    let intersector = EmbreeIntersector::new(&scene, HitRules::default(), None, 1).unwrap();
    let mut counts = RayCounts::default();
    let (mut rays, mut wrong) = (0, 0);
    for prim in (0..mesh.triangles.len()).step_by(41) {
        let [a, b, c] = mesh.corners(prim);
        let middle = (a + b + c) / 3.0;
        for k in (0..64).map(f64::from) {
            let height = -2e-5 - 1e-6 * k;
            let away = DVec3::new((1.7 * k).cos(), (1.7 * k).sin(), height);
            let ray = Ray::new(middle + away * 1e6, -away * 1e6);
            // In a block of backs alone nothing is tried again: one that meets the front beside it.
            let front = Ray::new(DVec3::new(0.0, 0.0, 3.0), middle - DVec3::new(0.0, 0.0, 3.0));
            let mut hits = [None; 2];
            intersector.intersect_batch(&[ray, front], &mut hits, &mut counts);
            hits[1] = intersector.intersect(&ray, &mut counts);
            rays += hits.len();
            let is_it = |hit: &Hit| hit.prim.prim_id as usize == prim;
            wrong += hits.iter().filter(|hit| !hit.as_ref().is_some_and(is_it)).count();
        }
    }
    assert_eq!(wrong, 0, "of {rays} rays at the middles of triangles");
    assert!(
        counts[RayKind::Retry] as usize > rays / 2,
        "the case is not hard: {} tries",
        counts[RayKind::Retry]
    );
}

/// Slivers strewn in a cube, and rays that graze them, in scene space.
fn slivers_and_rays() -> (Scene, Vec<Ray>) {
    let mut rng = Pcg64Mcg::new(0x511e);
    let mut random = |most: f64| DVec3::from_array([(); 3].map(|()| rng.random_range(-most..most)));
    let mut world = World::default();
    world.materials.push(Material::diffuse("white", Rgb::ONE));
    for _ in 0..100 {
        let (middle, along) = (random(300.0), random(1.0).normalize());
        let across = along.cross(random(1.0)).normalize();
        let corners = [-along * 5.0, along * 6.0, across * 0.3].map(|p| middle + p);
        world.meshes.push(common::mesh(corners.to_vec(), vec![[0, 1, 2]], 0));
    }
    let scene = world.into_scene(true).unwrap();
    // As they are in f32, which turns their planes by more than a ray grazes them at.
    let rays = (0..400_000).map(|i| {
        let [a, b, c] = scene.meshes[i % 100].corners(0);
        let (along, normal) = ((b - a).normalize(), (b - a).cross(c - a).normalize());
        let [far, turn, tilt] = random(1.0).to_array();
        let dir = along * (3.0 * turn).sin() + along.cross(normal) * (3.0 * turn).cos();
        let dir = (dir + normal * (3e-4 * tilt)).normalize();
        Ray::new((a + b + c) / 3.0 - dir * (1.0 + 0.98 * far), dir)
    });
    let rays = rays.collect();
    (scene, rays)
}

#[test]
fn no_grazing_ray_misses_a_sliver_where_embree_rounds_twice() {
    let (scene, rays) = slivers_and_rays();
    let oracle = Oracle::new(&scene);
    let mut counts = RayCounts::default();
    for set in ["sse4.2", "avx"] {
        let Ok(embree) = EmbreeIntersector::new(&scene, HitRules::default(), Some(set), 1) else {
            println!("skipped: no {set} here");
            continue;
        };
        let mut together: Vec<Option<Hit>> = vec![None; rays.len()];
        embree.intersect_batch(&rays, &mut together, &mut counts);
        let mut met = 0;
        for (ray, hit) in rays.iter().zip(&together) {
            let Some(exact) = oracle.intersect(ray, &mut counts) else { continue };
            if oracle.line(ray).edge_ulps(&oracle.corners(exact.prim).unwrap()) > 4.0 {
                met += 1;
                assert!(hit.is_some(), "{set}, in a block: {ray:?}");
                assert!(embree.intersect(ray, &mut counts).is_some(), "{set}, alone: {ray:?}");
            }
        }
        assert!(met > 10_000, "the rays pass the slivers by: {met} do not");
    }
}

#[test]
fn a_far_eye_sees_what_a_near_one_does() {
    let scene = tessellated_sphere();
    let intersector = EmbreeIntersector::new(&scene, HitRules::default(), None, 1).unwrap();
    let mesh = &scene.meshes[0];
    let mut counts = RayCounts::default();
    for prim in (0..mesh.triangles.len()).step_by(7) {
        let [a, b, c] = mesh.corners(prim);
        let middle = (a + b + c) / 3.0;
        let away = (b - a).cross(c - a).normalize();
        for distance in [2.0, 1e3, 1e6] {
            let ray = Ray::new(middle + away * distance, -away);
            let hit = intersector.intersect(&ray, &mut counts).unwrap();
            assert_eq!(hit.prim.prim_id as usize, prim, "from {distance}");
            assert!((hit.t - distance).abs() < 1e-9 * distance);
        }
    }
}

#[test]
fn a_translated_scene_looks_the_same() {
    let at = |offset: DVec3| {
        let mut world = common::sphere_world(Material::diffuse("white", Rgb::splat(0.8)), true);
        world.meshes[0].positions.iter_mut().for_each(|p| *p += offset);
        let position = offset + DVec3::new(2.0, 3.0, 2.0);
        world.lights.push(Light::Point(PointLight { position, intensity: Rgb::splat(12.0) }));
        let mut job = job(world, pose((0.0, 1.0, 3.0), (0.0, 0.0, 0.0)), 64, 64);
        job.camera.eye += offset;
        render(&job).0.rgb
    };
    let here = at(DVec3::ZERO);
    for offset in [1e3, 1e5, 1e6] {
        let there = at(DVec3::new(offset, -offset, 0.5 * offset));
        let most = here.iter().zip(&there).map(|(a, b)| (*a - *b).abs().max_element());
        let most = most.fold(0.0, f32::max);
        assert!(most < 1.0 / 255.0, "at {offset}: {most}");
    }
}

#[test]
fn invalid_rays_hit_nothing_and_are_counted() {
    let scene = tessellated_sphere();
    let intersector = EmbreeIntersector::new(&scene, HitRules::default(), None, 1).unwrap();
    let good = Ray::new(DVec3::ZERO, DVec3::X);
    let bad = [
        Ray { org: DVec3::NAN, ..good },
        Ray { dir: DVec3::ZERO, ..good },
        Ray { dir: DVec3::INFINITY, ..good },
        Ray { tnear: 2.0, tfar: 1.0, ..good },
    ];
    // Among good neighbours in one packet.
    let rays: Vec<Ray> = bad.iter().flat_map(|b| [good, *b, good]).collect();
    let mut hits = vec![None; rays.len()];
    let mut counts = RayCounts::default();
    intersector.intersect_batch(&rays, &mut hits, &mut counts);
    let mut occluded = vec![false; rays.len()];
    intersector.occluded_batch(&rays, &mut occluded, &mut counts);
    for (i, (hit, occluded)) in hits.iter().zip(&occluded).enumerate() {
        assert_eq!((hit.is_some(), *occluded), (i % 3 != 1, i % 3 != 1), "ray {i}");
    }
    assert_eq!(counts[RayKind::Invalid], 2 * bad.len() as u64);
}

/// A light outside of a closed room lights nothing inside, not even along the corners.
#[test]
fn a_closed_room_is_dark() {
    let mut world = World::default();
    world.materials.push(Material::diffuse("wall", Rgb::splat(0.8)));
    world.meshes.push(common::cube(DVec3::ZERO, 1.0, 0));
    let position = DVec3::new(1.7, 2.9, 2.3);
    world.lights.push(Light::Point(PointLight { position, intensity: Rgb::splat(1e6) }));
    // Towards the walls that face the light from inside.
    for target in [(-1.0, -1.0, -1.0), (-1.0, -0.999, 0.0), (-1.0, -1.0, 0.3)] {
        let (film, counts) = render(&job(world.clone(), pose((0.0, 0.0, 0.0), target), 160, 120));
        assert!(
            counts[RayKind::ShadowDelta] > 160 * 120 / 2,
            "few points face the light: {counts:?}"
        );
        for (x, y, rgb) in common::pixels(&film) {
            assert_eq!(rgb, Rgb::ZERO, "{x},{y} towards {target:?}");
        }
    }
}

/// Rechecking only what may be wrong gives the bits of rechecking everything.
#[test]
fn risky_hits_are_the_only_ones_that_need_the_recheck_at_once() {
    for (scene, frame) in [("reflective_spheres", 7), ("cornell", 1), ("demo", 3)] {
        let films = [Recheck::Risky, Recheck::Always].map(|recheck| {
            let mut job = common::load_job(scene, frame, Some((160, 90)));
            job.settings.rules.recheck = recheck;
            (job.settings.spp, job.settings.shadow_samples) = (1, 1);
            render(&job).0
        });
        assert!(films[0].rgb == films[1].rgb, "{scene}");
    }
}

/// A thousand copies with two materials: the first one's picture, whatever the threads.
#[test]
fn of_coincident_faces_the_lowest_number_is_seen() {
    let world_of = |copies: u32| {
        let mut world = World::default();
        world.materials.push(Material::diffuse("red", Rgb::new(0.8, 0.1, 0.1)));
        world.materials.push(Material::diffuse("blue", Rgb::new(0.1, 0.1, 0.8)));
        for copy in 0..copies {
            world.meshes.push(common::cube(DVec3::ZERO, 1.0, copy % 2));
        }
        world.lights.push(Light::Point(PointLight {
            position: DVec3::new(3.0, 5.0, 4.0),
            intensity: Rgb::splat(80.0),
        }));
        world
    };
    let picture = |copies: u32, threads: usize| {
        let job = job(world_of(copies), pose((2.0, 3.0, 4.0), (0.0, 0.0, 0.0)), 64, 64);
        let scene = job.world.clone().into_scene(true).unwrap();
        let embree = EmbreeIntersector::new(&scene, job.settings.rules, None, threads).unwrap();
        let renderer = tweenray::shade::Renderer::new(&scene, &job.settings, &embree);
        let stop = std::sync::atomic::AtomicBool::new(false);
        let (film, _) = renderer.render(&job.camera, 1, false, &stop, &()).unwrap();
        film.rgb
    };
    let one = picture(1, 1);
    assert!(one.iter().any(|c| c.x > c.z && c.x > 0.1), "the cube is red");
    for threads in [1, 2, 8] {
        assert!(picture(1000, threads) == one, "{threads} threads");
    }
}
