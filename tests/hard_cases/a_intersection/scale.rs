//! Very small beside very large, very far, and what far things do to near ones.

use crate::common;
use crate::shapes;
use crate::suite::{self, Outcome, Size};
use rand::Rng;
use tweenray::intersect::{EmbreeIntersector, Hit, Intersector, Oracle, Ray, SurfaceInteraction};
use tweenray::math::{DVec3, Rgb, orthonormal_basis, srgb_encode};
use tweenray::scene::{HitRules, Light, Material, PointLight, Scene, World, WorldSphere};
use tweenray::stats::RayCounts;

/// A small cube on wide ground, and OSPRay's spheres near and far.
pub fn ratio(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    for (eye_distance, spread) in [(4e-3, 1e-3), (1.0, 2e-3), (5e5, 4e5)] {
        outcome.merge(cube_on_ground(eye_distance, spread, size.of(20_000, 1_000_000)));
    }
    for radius in [1e-3, 3e5] {
        for distance in [3.0, 8000.0, 2e5] {
            for sphere_moves in [false, true] {
                let error = disc_error(radius, distance, sphere_moves, size.of(64, 512));
                let name = format!("sphere of radius {radius:e} at {distance:e} radii, radiance");
                outcome.at_most(&name, error, 1e-4);
            }
        }
    }
    outcome
}

/// A cube of edge 1e-3 on ground 1e6 wide: what is hit, and where, as the oracle has it.
fn cube_on_ground(distance: f64, spread: f64, rays: u64) -> Outcome {
    const HALF: f64 = 5e-4;
    const GROUND: f64 = 5e5;
    let mut world = World::default();
    world.materials.push(Material::diffuse("white", Rgb::ONE));
    let corner = |x: f64, z: f64| DVec3::new(x * GROUND, 0.0, z * GROUND);
    let corners = [corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)];
    world.meshes.push(common::quad(corners, 0));
    world.meshes.push(common::cube(DVec3::Y * HALF, HALF, 0));
    let scene = world.into_scene(true).unwrap();
    let embree = EmbreeIntersector::new(&scene, HitRules::default(), suite::isa(), 1).unwrap();
    let oracle = Oracle::new(&scene);
    let eye = DVec3::new(0.5, 0.4, 0.7).normalize() * distance;
    let make = |i: u64| {
        let mut rng = suite::rng(15, i);
        // Half of the rays at the cube, half at the ground around it.
        let aim = if i % 2 == 0 {
            DVec3::new(rng.random_range(-HALF..HALF), 2.0 * HALF, rng.random_range(-HALF..HALF))
        } else {
            DVec3::new(rng.random_range(-spread..spread), 0.0, rng.random_range(-spread..spread))
        };
        let place = |p: DVec3| scene.recentring.point_to_scene(p);
        Ray::new(place(eye), (aim - eye).normalize())
    };
    let same = |hit: &Option<Hit>, ray: &Ray, tolerance: f64| {
        match (hit, oracle.intersect(ray, &mut RayCounts::default())) {
            // Where the cube meets the ground either may be named, at the same distance.
            (Some(a), Some(b)) => (a.t - b.t).abs() <= tolerance * b.t,
            (a, b) => a.is_none() && b.is_none(),
        }
    };
    // At an edge f32 may take the ray for one turned by up to 4 ulp.
    let at_edge = |hit: &Option<Hit>, ray: &Ray| {
        let (u, v) = orthonormal_basis(ray.dir.normalize());
        (0..16).any(|k| {
            let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 8.0).sin_cos();
            let turn = if k < 8 { 4.0 } else { 1.0 } * f64::from(f32::EPSILON);
            same(hit, &Ray { dir: ray.dir + (u * cos + v * sin) * turn, ..*ray }, 1e-6)
        })
    };
    let judge = |rays: &[Ray], hits: &[Option<Hit>]| {
        let (mut swaps, mut edges) = (Outcome::default(), 0);
        for (ray, hit) in rays.iter().zip(hits) {
            let exact = same(hit, ray, 1e-12);
            let edge = !exact && at_edge(hit, ray);
            edges += u64::from(edge);
            swaps.check(exact || edge, || format!("{ray:?}: {hit:?}"));
        }
        (swaps, edges)
    };
    let sum = |a: (Outcome, u64), b: (Outcome, u64)| (a.0.merged(b.0), a.1 + b.1);
    let (mut outcome, edges) =
        suite::trace(&embree, rays, make, judge, sum, || (Outcome::default(), 0));
    let swaps = outcome.failures;
    outcome.show(format!(
        "cube 1e-3 on ground 1e6, eye at {distance:e}: {swaps} of {rays} swapped, {edges} within \
         4 ulp of an edge"
    ));
    outcome
}

/// A scene of one analytic sphere, and the eye (scene space) that sees it along -z.
fn far_sphere(radius: f64, distance: f64, sphere_moves: bool) -> (Scene, DVec3) {
    let away = DVec3::Z * radius * distance;
    let (centre, eye) = if sphere_moves { (-away, DVec3::ZERO) } else { (DVec3::ZERO, away) };
    let mut world = World::default();
    world.materials.push(Material::diffuse("white", Rgb::ONE));
    world.spheres.push(WorldSphere::new("sphere", centre, radius, 0));
    let scene = world.into_scene(true).unwrap();
    let eye = scene.recentring.point_to_scene(eye);
    (scene, eye)
}

/// Largest difference of a lit sphere's radiance, pixel by pixel, to the closed form: at the angle
/// α off the axis the normal leans by asin(d/r · sin α) − α.
fn disc_error(radius: f64, distance: f64, sphere_moves: bool, edge: u32) -> f64 {
    let (scene, eye) = far_sphere(radius, distance, sphere_moves);
    let embree = EmbreeIntersector::new(&scene, HitRules::default(), suite::isa(), 1).unwrap();
    let to_light = DVec3::new(0.3, 0.5, 0.8).normalize();
    let rim = (1.0 / distance).asin();
    let mut most = 0f64;
    for y in 0..edge {
        for x in 0..edge {
            let at = |i: u32| (2.0 * f64::from(i) + 1.0) / f64::from(edge) - 1.0;
            let (px, py) = (at(x) * 1.05, at(y) * 1.05);
            let off = px.hypot(py);
            // Half a pixel at the rim is left to case 16.
            if (off - 1.0).abs() < 0.5 / f64::from(edge) {
                continue;
            }
            let around = DVec3::new(px / off, py / off, 0.0);
            let alpha = off * rim;
            let dir = around * alpha.sin() - DVec3::Z * alpha.cos();
            let lean = (distance * alpha.sin()).asin() - alpha;
            let expected = if off < 1.0 {
                (around * lean.sin() + DVec3::Z * lean.cos()).dot(to_light).max(0.0)
            } else {
                0.0
            };
            let ray = Ray::new(eye, dir);
            let found = embree.intersect(&ray, &mut RayCounts::default()).map_or(0.0, |hit| {
                SurfaceInteraction::new(&scene, &ray, &hit).ns.dot(to_light).max(0.0)
            });
            most = most.max((found - expected).abs());
        }
    }
    most
}

/// Radius of a sphere's image, pixels.
const RADIUS: f64 = 500.0;

/// Silhouettes of far analytic spheres, beside a naive f32 test of the same rays.
pub fn far_sphere_silhouette(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    for power in 1..=7 {
        let distance = 10f64.powi(power);
        let (scene, eye) = far_sphere(1.0, distance, false);
        let embree = EmbreeIntersector::new(&scene, HitRules::default(), suite::isa(), 1).unwrap();
        let scale = scene.recentring.scale();
        let sphere = &scene.spheres[0];
        let (centre, radius) = (sphere.centre, sphere.radius);
        // Image plane coordinates: a pixel is this much tangent of the angle off the axis.
        let pixel = (1.0 / distance).asin().tan() / RADIUS;
        let (mut ours, mut naive) = (0f64, 0f64);
        let spokes = size.of(24, 720);
        for spoke in 0..spokes {
            let (sin, cos) =
                (std::f64::consts::TAU * (f64::from(spoke) + 0.3) / f64::from(spokes)).sin_cos();
            let ray = |off: f64| {
                let across = off * pixel;
                Ray::new(eye, DVec3::new(cos * across, sin * across, -1.0).normalize())
            };
            let hits = |off: f64| embree.intersect(&ray(off), &mut RayCounts::default()).is_some();
            let error = (outermost(hits) - RADIUS).abs();
            outcome.check(error < 0.01, || format!("distance {distance:e}: {error} px"));
            ours = ours.max(error);
            let naive_hits = |off: f64| naive_sphere(&ray(off), centre, radius);
            naive = naive.max((outermost(naive_hits) - RADIUS).abs());
        }
        // Rings would show in the shading.
        let rings = disc_error(1.0, distance, false, size.of(48, 256));
        outcome.show(format!(
            "distance {distance:.0e} (scene scale {scale:e}): silhouette off by {ours:.1e} px, \
             naive f32 {naive:.1e} px; shading off by {rings:.1e}"
        ));
        outcome.check(rings < 1e-4, || format!("distance {distance:e}: rings of {rings:e}"));
        if power == 7 {
            outcome.at_least("naive f32 silhouette error at 1e7, px", naive, 1.0);
        }
    }
    outcome
}

/// The outermost hit along a spoke, pixels from the middle; 0 without any.
fn outermost(hits: impl Fn(f64) -> bool) -> f64 {
    // Scan from outside for the first hit, then bisect.
    let (mut outside, step) = (2.0 * RADIUS, RADIUS / 40.0);
    while outside > 0.0 && !hits(outside - step) {
        outside -= step;
    }
    let (mut inside, mut outside) = ((outside - step).max(0.0), outside);
    while outside - inside > 1e-4 {
        let middle = 0.5 * (inside + outside);
        if hits(middle) { inside = middle } else { outside = middle }
    }
    inside
}

/// The schoolbook test, b² − ac in f32.
fn naive_sphere(ray: &Ray, centre: DVec3, radius: f64) -> bool {
    let (org, dir) = ((ray.org - centre).as_vec3(), ray.dir.as_vec3());
    let (a, b) = (dir.length_squared(), org.dot(dir));
    let c = org.length_squared() - (radius * radius) as f32;
    let discriminant = b * b - a * c;
    discriminant >= 0.0 && (-b + discriminant.sqrt()) / a > 0.0
}

/// What a mesh far away does to the picture of a near one.
pub fn unrelated_mesh(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let edge = size.of(96, 512);
    let image = |far: Option<f64>, recentre: bool| {
        let mut world = shapes::world_of(shapes::sphere(DVec3::ZERO, 1.0, 60, 40));
        if let Some(far) = far {
            // Behind the camera.
            world.meshes.push(shapes::sphere(DVec3::new(0.2, 0.1, 1.0) * far, 0.5, 20, 10));
        }
        let (position, intensity) = (DVec3::new(2.0, 3.0, 2.0), Rgb::splat(12.0));
        world.lights.push(Light::Point(PointLight { position, intensity }));
        let pose = common::pose((0.0, 1.0, 3.0), (0.0, 0.0, 0.0));
        let mut job = common::job(world, pose, edge, edge);
        job.settings.rules.recentre = recentre;
        common::render(&job).0.rgb
    };
    let pixels = u64::from(edge) * u64::from(edge);
    // In the world's own coordinates nothing may change at all.
    let alone = image(None, false);
    for far in [10.0, 1e3, 1e6, 1e9] {
        let changed = image(Some(far), false).iter().zip(&alone).filter(|(a, b)| a != b).count();
        outcome.count(pixels, changed as u64);
        outcome.show(format!("own coordinates, mesh at {far:.0e}: {changed} pixels changed"));
    }
    // Recentred, the far mesh decides how fine f32 is at the near one, and outlines move by so much:
    // docs/decisions/012-far-meshes-coarsen-near-ones.md.
    let alone = image(None, true);
    for (far, must) in [(10.0, true), (1e3, false), (1e5, false)] {
        let with = image(Some(far), true);
        let steps = |c: f32| (srgb_encode(f64::from(c).clamp(0.0, 1.0)) * 255.0).round() as i32;
        let differences = with.iter().zip(&alone).map(|(a, b)| (steps(a.x) - steps(b.x)).abs());
        let most = differences.clone().max().unwrap_or(0);
        let more_than_one = differences.filter(|d| *d > 1).count() as u64;
        outcome.show(format!(
            "recentred, mesh at {far:.0e}: at most {most} of 255, {more_than_one} pixels above 1"
        ));
        if must {
            outcome.count(pixels, more_than_one);
        }
    }
    outcome
}
