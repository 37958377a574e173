//! Glass against closed forms.

use crate::suite::{self, Outcome, Size};
use crate::{common, shapes};
use rand::Rng;
use std::f64::consts::FRAC_PI_2;
use tweenray::intersect::{EmbreeIntersector, Intersector, Ray, SurfaceInteraction};
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::{Glass, HitRules, Material, Scene, Sky, World, WorldSphere};
use tweenray::shade::optics;
use tweenray::stats::{RayCounts, RayKind};

/// The unit direction at `angle` from z.
fn at(angle: f64) -> DVec3 {
    DVec3::new(libm::sin(angle), 0.0, libm::cos(angle))
}

/// Fresnel's reflectance as the textbook has it, from the angles.
fn textbook(cos: f64, eta: f64) -> f64 {
    let sin_t = ((1.0 - cos * cos).max(0.0)).sqrt() / eta;
    if sin_t >= 1.0 {
        return 1.0;
    }
    let cos_t = (1.0 - sin_t * sin_t).sqrt();
    let s = (cos - eta * cos_t) / (cos + eta * cos_t);
    let p = (eta * cos - cos_t) / (eta * cos + cos_t);
    0.5 * (s * s + p * p)
}

pub fn fresnel_snell(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let (mut snell, mut reciprocal, mut against, mut plane) = (0f64, 0f64, 0f64, 0f64);
    let count = size.of(50_000, 5_000_000);
    let etas = [1.5, 1.0 / 1.5, 1.31, 2.42, 1.0 / 1.33, 1.0003, 10.0, 0.1];
    for i in 0..count {
        let eta = etas[(i % etas.len() as u64) as usize];
        let angle = FRAC_PI_2 * i as f64 / (count - 1) as f64;
        let wo = at(angle);
        // Either side's normal must do.
        let n = if i % 3 == 0 { -DVec3::Z } else { DVec3::Z };
        let split = optics::split(wo, n, eta);
        let mut ok = (0.0..=1.0).contains(&split.reflectance);
        against = against.max((split.reflectance - textbook(wo.z, eta)).abs());
        if let Some(t) = split.refracted {
            snell = snell.max((wo.x - eta * t.x.hypot(t.y)).abs());
            plane = plane.max(t.y.abs());
            ok &= t.z < 0.0 && t.x <= 0.0;
            let back = optics::split(t, n, 1.0 / eta);
            // A cosine c is known to 1e-16 / c from the other, and the reflectance changes by up to
            // 4 / c of that where c is small.
            let c = t.z.abs().min(wo.z);
            let off = (back.reflectance - split.reflectance).abs();
            reciprocal = reciprocal.max(off * c * c.min(1.0));
            ok &= back.reflectance.is_finite();
        }
        outcome.check(ok, || format!("eta {eta}, angle {angle}: {split:?}"));
    }
    outcome.at_most("|n1 sin - n2 sin|", snell, 1e-12);
    outcome.at_most("reflectance here and back, times cos²", reciprocal, 1e-14);
    // Near the critical angle the textbook's own form loses half its digits.
    outcome.at_most("against the textbook's form", against, 1e-6);
    outcome.at_most("out of the plane of incidence", plane, 0.0);
    exact(&mut outcome);
    outcome
}

/// Where the answer is known to the bit.
fn exact(outcome: &mut Outcome) {
    for i in 0..=10_000 {
        let wo = at(FRAC_PI_2 * f64::from(i) / 10_000.0);
        let same = optics::split(wo, DVec3::Z, 1.0).reflectance;
        outcome.check(same == 0.0, || format!("eta 1 reflects {same} at step {i}"));
    }
    for eta in [1.5, 1.0 / 1.5, 1.0003, 2.42] {
        let grazing = optics::split(DVec3::X, DVec3::Z, eta).reflectance;
        outcome.check(grazing == 1.0, || format!("grazing at eta {eta} reflects {grazing}"));
    }
    for n in [1.31, 1.33, 1.5, 2.42] {
        let critical = libm::asin(1.0 / n);
        for ulp in -4i64..=4 {
            let angle = f64::from_bits((critical.to_bits() as i64 + ulp) as u64);
            let s = optics::split(at(angle), DVec3::Z, 1.0 / n);
            let t_ok =
                s.refracted.is_none_or(|t| t.is_finite() && (t.length() - 1.0).abs() < 1e-12);
            // (eta cos_t)² is a difference of numbers near 1: 1e-15 of it is 3e-8 of the cosine, so
            // the reflectance at the angle itself is 1 to some 1e-7.
            let ok = s.reflectance > 1.0 - 1e-6 && s.reflectance <= 1.0 && t_ok;
            outcome.check(ok, || format!("critical angle {ulp:+} ulp, n {n}: {s:?}"));
        }
        let beyond = optics::split(at(critical + 1e-7), DVec3::Z, 1.0 / n);
        outcome.check(beyond.reflectance == 1.0 && beyond.refracted.is_none(), || {
            format!("{beyond:?}")
        });
    }
}

/// What a ball of glass is made of in this case.
struct Ball {
    scene: Scene,
    centre: DVec3,
    radius: f64,
    ior: f64,
}

fn ball(centre: DVec3, radius: f64, mesh: Option<(u32, u32)>, ior: f64) -> Ball {
    let mut world = World::default();
    let glass = Glass::clear(ior);
    world.materials.push(Material { glass: Some(glass), ..Material::black("glass") });
    if let Some((columns, rows)) = mesh {
        world.meshes.push(shapes::smooth_sphere(centre, radius, columns, rows));
    } else {
        world.spheres.push(WorldSphere::new("ball", centre, radius, 0));
    }
    Ball { scene: world.into_scene(true).unwrap(), centre, radius, ior }
}

/// Through the ball by the product's intersector, spawn and optics: two refractions.
fn through(ball: &Ball, embree: &EmbreeIntersector, org: DVec3, dir: DVec3) -> Option<DVec3> {
    let mut counts = RayCounts::default();
    let mut ray = Ray::new(ball.scene.recentring.point_to_scene(org), dir);
    for _ in 0..2 {
        let hit = embree.intersect(&ray, &mut counts)?;
        let si = SurfaceInteraction::new(&ball.scene, &ray, &hit);
        let wo = -ray.dir.normalize();
        let outside = si.is_outside(wo);
        let eta = if outside { ball.ior } else { 1.0 / ball.ior };
        let refracted = optics::split(wo, si.ns, eta).refracted?;
        ray = si.spawn(optics::keep_side(refracted, si.ng, !outside), true);
    }
    Some(ray.dir)
}

/// Where a ray along `dir` at `offset` from the centre's line leaves: turned by twice the
/// difference of the two angles, towards the axis.
fn closed_form(dir: DVec3, across: DVec3, b: f64, ior: f64) -> DVec3 {
    let turn = 2.0 * (libm::asin(b) - libm::asin(b / ior));
    dir * libm::cos(turn) - across * libm::sin(turn)
}

/// The largest angle from the closed form and the rays that did not go through.
fn worst(ball: &Ball, count: u64, most_b: f64) -> (f64, u64) {
    let embree = EmbreeIntersector::new(&ball.scene, HitRules::default(), None, 1).unwrap();
    let (mut worst, mut lost) = (0f64, 0);
    for i in 0..count {
        let mut rng = suite::rng(36, i);
        let b = match i {
            0 => 0.0,
            1 => most_b,
            _ => most_b * rng.random::<f64>().sqrt(),
        };
        let dir = shapes::direction(&mut rng);
        let across = dir.cross(shapes::direction(&mut rng)).normalize();
        let org = ball.centre + (across * b - dir * 3.0) * ball.radius;
        match through(ball, &embree, org, dir) {
            Some(out) => {
                // Far away the origin is rounded by more than 1e-6 rad of the way out allows:
                // the impact parameter is that of the ray as it is.
                let from = org - ball.centre;
                let off = from - dir * from.dot(dir);
                let (across, b) = match off.length() / ball.radius {
                    0.0 => (across, 0.0),
                    b => (off.normalize(), b),
                };
                let expected = closed_form(dir, across, b, ball.ior);
                worst = worst.max(2.0 * (0.5 * (out - expected).length()).min(1.0).asin());
            }
            None => lost += 1,
        }
    }
    (worst, lost)
}

pub fn glass_ball(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let count = size.of(20_000, 1_000_000);
    let far = DVec3::new(1e6, -3e5, 2e6);
    for (name, centre, radius) in [
        ("unit ball", DVec3::ZERO, 1.0),
        ("a million units away", far, 1.0),
        ("a micron wide", DVec3::splat(1e-7), 1e-6),
        ("a million wide", DVec3::splat(3e5), 1e6),
    ] {
        let (worst, lost) = worst(&ball(centre, radius, None, 1.5), count, 1.0 - 1e-7);
        outcome.count(count, lost);
        outcome.at_most(&format!("{name}, rad from the closed form"), worst, 1e-6);
    }
    // Of triangles: the chord of an edge is d = 2 pi / columns wide, its facet up to d²/8 deep, and
    // the normal interpolated along it off by up to d²/8 too (measured at the middle of an edge).
    let (columns, rows) = size.of((200, 100), (400, 101));
    let d = std::f64::consts::TAU / f64::from(columns);
    // A shift s of the impact parameter turns the way out by 2 s (1/cos - 1/(n cos')), at most
    // 2 s / cos; both surfaces shift, and so does the normal. b up to 0.9.
    let bound = 4.0 * 2.0 * d * d / 8.0 / (1.0f64 - 0.81).sqrt();
    let mesh = ball(DVec3::ZERO, 1.0, Some((columns, rows)), 1.5);
    let triangles = mesh.scene.triangle_count();
    let (worst, lost) = worst(&mesh, count, 0.9);
    outcome.count(count, lost);
    outcome.at_most(&format!("{triangles} triangles, rad from the closed form"), worst, bound);
    outcome
}

/// Light goes in at the end of a glass slab, is reflected totally at its sides a hundred times and
/// leaves at the other end, all in a furnace of radiance 1.
pub fn light_guide(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let mut world = World::default();
    let glass = Glass::clear(1.5);
    world.materials.push(Material { glass: Some(glass), ..Material::black("glass") });
    let mut slab = common::cube(DVec3::ZERO, 1.0, 0);
    // 160 long, 1 thick, 40 wide: a ray in at 60 degrees meets the sides some 113 times.
    slab.positions.iter_mut().for_each(|p| *p *= DVec3::new(80.0, 0.5, 20.0));
    world.meshes.push(slab);
    world.sky = Sky { radiance: Rgb::ONE, ..Sky::default() };
    let end = DVec3::new(-80.0, 0.0, 0.0);
    let eye = end + DVec3::new(-1.0, 3f64.sqrt(), 0.05) * 5.0;
    let pose = tweenray::scene::Pose { eye, target: end, up: DVec3::Y, roll_degrees: 0.0 };
    let edge = size.of(16, 128);
    let mut job = common::job(world, pose, edge, edge);
    job.camera = tweenray::scene::Camera::new(&pose, 2.0, edge, edge).unwrap();
    job.settings.bounces = 1000;
    job.settings.cutoff = 1e-6;
    let (film, counts) = common::render(&job);
    let mut worst = 0f64;
    for (x, y, rgb) in common::pixels(&film) {
        let error = f64::from((rgb - Rgb::ONE).abs().max_element());
        worst = worst.max(error);
        outcome.check(error <= 1e-4, || format!("pixel {x},{y}: {rgb}"));
    }
    outcome.at_most("largest error of radiance 1", worst, 1e-4);
    outcome.at_least(
        "glass rays a camera ray",
        counts[RayKind::Glass] as f64 / counts[RayKind::Camera] as f64,
        100.0,
    );
    outcome
}
