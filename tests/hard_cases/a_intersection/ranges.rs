//! Sizes beyond what f32 can take, alone and side by side: rendered in full, or refused by name.

use super::ways::{stock, to_scene};
use crate::common;
use crate::shapes;
use crate::suite::{self, Outcome, Size};
use rand::Rng;
use tweenray::intersect::{EmbreeIntersector, Hit, Intersector, Ray};
use tweenray::math::{DVec3, Rgb};
use tweenray::output::Display;
use tweenray::scene::{
    DirectionalLight, HitRules, Light, Material, QuadLight, Scene, Sky, ToneCurve, World,
    WorldMesh, WorldSphere,
};

/// Radii that f32 tracers are asked to take, and far beyond.
const RADII: [f64; 16] = [
    1e-300, 1e-40, 1e-31, 1e-29, 1e-25, 1e-20, 1e-18, 1e-15, 1e-12, 1.0, 1e12, 2e18, 1e25, 1e29,
    1e31, 1e160,
];

fn ball(centre: DVec3, radius: f64) -> WorldMesh {
    shapes::sphere(centre, radius, 100, 50)
}

/// Holes of the sphere at the origin, seen from inside at random, at vertices and along edges.
fn holes(scene: &Scene, rules: HitRules, radius: f64, rays: u64) -> u64 {
    let embree = EmbreeIntersector::new(scene, rules, suite::isa(), 4).unwrap();
    let mesh = &scene.meshes[0];
    suite::misses(&embree, rays, |i| {
        let mut rng = suite::rng(14, i);
        let eye = shapes::in_ball(&mut rng, 0.4) * radius;
        let eye = to_scene(&Ray::new(eye, DVec3::X), &scene.recentring).org;
        let target = match i % 3 {
            0 => return Ray::new(eye, shapes::direction(&mut rng)),
            1 => mesh.positions[rng.random_range(0..mesh.vertex_count)].as_dvec3(),
            _ => {
                let corners = mesh.corners(rng.random_range(0..mesh.triangles.len()));
                corners[0].lerp(corners[1], rng.random())
            }
        };
        Ray::new(eye, target - eye)
    })
}

/// The picture of a ball of `radius`, 8 bits; the light's size of the scene does not matter.
fn picture(radius: f64) -> Vec<u8> {
    let mut world = shapes::world_of(ball(DVec3::ZERO, radius));
    let to_light = DVec3::new(1.0, 2.0, 3.0).normalize();
    world.lights.push(Light::Directional(DirectionalLight { to_light, irradiance: Rgb::ONE }));
    world.sky = Sky { radiance: Rgb::splat(0.3), lights: false, ambient: Rgb::splat(0.1) };
    let eye = (0.5 * radius, 1.0 * radius, 3.0 * radius);
    let job = common::job(world, common::pose(eye, (0.0, 0.0, 0.0)), 32, 32);
    let film = common::render(&job).0;
    Display { exposure: 1.0, tone: ToneCurve::Srgb }.encode_8(&film.rgb, film.width)
}

/// One size after another.
pub fn range_guard(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let rays = size.of(10_000, 1_000_000);
    let reference = picture(1.0);
    for radius in RADII {
        let world = shapes::world_of(ball(DVec3::ZERO, radius));
        let scene = match world.clone().into_scene(true) {
            Ok(scene) => scene,
            Err(error) => {
                outcome.show(format!("{radius:e}: refused, \"{error}\""));
                outcome.check(!(1e-29..=1e29).contains(&radius), || format!("{radius:e} refused"));
                continue;
            }
        };
        let missed = holes(&scene, HitRules::default(), radius, rays);
        outcome.count(rays, missed);
        let picture = picture(radius);
        let same = picture.iter().zip(&reference).all(|(a, b)| a.abs_diff(*b) <= 1);
        outcome.check(same, || format!("{radius:e}: the picture differs"));
        if radius.abs().log10().abs() <= 30.0 {
            let raw = world.into_scene(false).unwrap();
            let stock_holes = holes(&raw, stock(true), radius, rays);
            let share = 100.0 * stock_holes as f64 / rays as f64;
            outcome.show(format!("{radius:e}: {missed} holes; stock ROBUST {share:.1} % holes"));
            if radius == 1e-18 || radius == 2e18 {
                outcome.at_least("holes of stock ROBUST, %", share, 5.0);
            }
        }
    }
    mixed(&mut outcome, size);
    lamps(&mut outcome);
    outcome
}

/// Powers of ten that small things go down: below, f64 could not hold their corners apart.
const SMALLEST: f64 = 14.0;

/// What stands small beside something large.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Small {
    Mesh,
    Sphere,
}

/// A small thing `distance` from the middle of a unit ball, outside of it or inside.
fn side_by_side(small: Small, radius: f64, centre: DVec3, turn: f64) -> World {
    let mut world = shapes::world_of(ball(DVec3::ZERO, 1.0));
    match small {
        Small::Mesh => world.meshes.push(ball(centre, radius)),
        Small::Sphere => {
            world.spheres.push(WorldSphere::new("tiny", centre, radius, 0));
        }
    }
    // Not only powers of ten: somewhere the small thing falls between two numbers.
    world.apply_transform(&tweenray::math::DAffine3::from_rotation_y(turn)).unwrap();
    world
}

/// A small thing beside a large one, ever smaller: every ray at its inner half hits it, or the
/// scene is refused by its name.
fn mixed(outcome: &mut Outcome, size: Size) {
    let rays = size.of(500, 20_000);
    for (small, centre) in [
        (Small::Mesh, DVec3::ZERO),
        (Small::Sphere, DVec3::ZERO),
        (Small::Mesh, DVec3::new(0.0, 1.1, 2.0)),
        (Small::Sphere, DVec3::new(0.0, 1.1, 2.0)),
    ] {
        let (mut least, mut refused) = (f64::INFINITY, 0.0f64);
        for step in 0..size.of(40, 160) {
            let radius =
                0.25 * 10f64.powf(-SMALLEST * f64::from(step) / f64::from(size.of(40, 160)));
            let turn = 0.1 * f64::from(step);
            let world = side_by_side(small, radius, centre, turn);
            let place = tweenray::math::DAffine3::from_rotation_y(turn).transform_point3(centre);
            match world.into_scene(true) {
                Ok(scene) => {
                    least = least.min(radius);
                    let missed = missed_small(&scene, small, place, radius, rays);
                    outcome.count(rays, missed);
                    if missed > 0 {
                        let what = format!("{small:?} of {radius:e} at {centre}");
                        outcome.example(format!("{what}: {missed} of {rays} rays miss it"));
                    }
                }
                Err(error) => {
                    refused = refused.max(radius);
                    let name = if small == Small::Mesh { "`sphere`" } else { "`tiny`" };
                    outcome.check(error.to_string().contains(name), || error.to_string());
                }
            }
        }
        outcome.show(format!(
            "{small:?} at {centre} beside a ball of 1: seen down to {least:.1e}, refused from {refused:.1e}"
        ));
        if !least.is_finite() || refused > least {
            outcome.complain(format!("{small:?} at {centre}: refused at {refused:e} already"));
        }
    }
}

/// Rays from three radii away at the inner half of the small thing that do not hit it.
fn missed_small(scene: &Scene, small: Small, centre: DVec3, radius: f64, rays: u64) -> u64 {
    let embree = EmbreeIntersector::new(scene, HitRules::default(), suite::isa(), 2).unwrap();
    let geom = if small == Small::Mesh { 1 } else { scene.sphere_geom_id() };
    let make = |i: u64| {
        let mut rng = suite::rng(15, i);
        let eye = centre + shapes::direction(&mut rng) * (3.0 * radius);
        let target = centre + shapes::in_ball(&mut rng, 0.5 * radius);
        to_scene(&Ray::new(eye, target - eye), &scene.recentring)
    };
    let judge = |_: &[Ray], hits: &[Option<Hit>]| {
        hits.iter().filter(|h| h.is_none_or(|h| h.prim.geom_id != geom)).count() as u64
    };
    suite::trace(&embree as &dyn Intersector, rays, make, judge, |a, b| a + b, || 0)
}

/// A lamp ever smaller beside a ball: a picture without NaN, or a refusal.
fn lamps(outcome: &mut Outcome) {
    for power in 0..=SMALLEST as i32 {
        let half = 0.5 * 10f64.powi(-power);
        let at = |x: f64, z: f64| DVec3::new(2.0 + x * half, 2.0, 1.7 + z * half);
        let mut world = shapes::world_of(ball(DVec3::ZERO, 1.0));
        let corners = [at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)];
        // As bright altogether, however small.
        let radiance = Rgb::splat((5.0 / (half * half)).min(1e30) as f32);
        world.lights.push(Light::Quad(QuadLight { corners, radiance, two_sided: true }));
        world.materials.push(Material::black("unused"));
        match world.clone().into_scene(true) {
            Err(error) => {
                let told = error.to_string().contains("`light 1`");
                outcome.check(told && power > 3, || format!("{half:e}: {error}"));
            }
            Ok(_) => {
                let mut job =
                    common::job(world, common::pose((0.0, 1.0, 4.0), (0.0, 0.0, 0.0)), 32, 32);
                job.settings.shadow_samples = 4;
                let film = common::render(&job).0;
                let finite = film.rgb.iter().all(|c| c.is_finite());
                let lit = film.rgb.iter().filter(|c| c.max_element() > 0.02).count();
                outcome
                    .check(finite && lit > 100, || format!("lamp of {half:e}: {lit} lit pixels"));
            }
        }
    }
}
