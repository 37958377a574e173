//! What lies close behind a surface is still seen through it.

use crate::common;
use crate::shapes;
use crate::suite::{self, Outcome, Size};
use rand::Rng;
use tweenray::intersect::{EmbreeIntersector, Intersector, Ray, SurfaceInteraction};
use tweenray::math::{DQuat, DVec3, Rgb};
use tweenray::scene::{HitRules, Material, Scene, World, WorldSphere};
use tweenray::stats::RayCounts;

/// Gaps tried, ulp of the largest coordinate.
const MOST_ULP: u32 = 64;

pub fn minimum_visible(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let rays = size.of(200, 20_000);
    for x in [1e-3, 1.0, 100.0, 1e4] {
        for (how, turn) in [
            ("facing x", DQuat::IDENTITY),
            ("askew", DQuat::from_euler(glam::EulerRot::XYZ, 0.4, 0.7, -0.9)),
        ] {
            let smallest = smallest_gap(x, turn, rays, |si, dir| si.spawn(dir, true));
            outcome.at_most(&format!("|x| = {x:e}, {how}: ulp"), smallest, 8.0);
            outcome.trials += rays;
        }
    }
    // An offset for all scenes hides whatever lies within it.
    let fixed = |si: &SurfaceInteraction, dir: DVec3| Ray::new(si.p - si.ng * 1e-4, dir);
    let naive = smallest_gap(1.0, DQuat::IDENTITY, rays, fixed);
    outcome.show(format!("a fixed offset of 1e-4 at |x| = 1: above {naive} ulp"));
    for gap in [4e-5, 1e-6] {
        for facets in [false, true] {
            outcome.merge(concentric(gap, facets, rays));
        }
    }
    outcome
}

/// The smallest gap, ulp at `x`, from which on every second sheet is seen; `MOST_ULP + 1` if none.
fn smallest_gap(
    x: f64,
    turn: DQuat,
    rays: u64,
    through: impl Fn(&SurfaceInteraction, DVec3) -> Ray,
) -> f64 {
    let mut smallest = f64::from(MOST_ULP + 1);
    for gap in (1..=MOST_ULP).rev() {
        if !all_seen(&sheets(x, turn, f64::from(gap) * ulp(x)), turn, rays, &through) {
            break;
        }
        smallest = f64::from(gap);
    }
    smallest
}

fn ulp(x: f64) -> f64 {
    let x = x as f32;
    f64::from(f32::from_bits(x.to_bits() + 1)) - f64::from(x)
}

/// Two square sheets as wide as they are away from the origin, in their own coordinates: no
/// recentring helps.
fn sheets(x: f64, turn: DQuat, gap: f64) -> Scene {
    let mut world = World::default();
    world.materials.push(Material::diffuse("white", Rgb::ONE));
    let half = 0.5 * x;
    for x in [x, x - gap] {
        let corner = |y: f64, z: f64| turn * DVec3::new(x, y * half, z * half);
        let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        world.meshes.push(common::quad(corners, 0));
    }
    world.into_scene(false).unwrap()
}

fn all_seen(
    scene: &Scene,
    turn: DQuat,
    rays: u64,
    through: impl Fn(&SurfaceInteraction, DVec3) -> Ray,
) -> bool {
    let embree = EmbreeIntersector::new(scene, HitRules::default(), suite::isa(), 1).unwrap();
    let x = scene.meshes[0].corners(0)[0].length() / 1.5f64.sqrt();
    (0..rays).all(|i| {
        let mut rng = suite::rng(28, i);
        let mut within = |most: f64| rng.random_range(-most..most) * x;
        let target = turn * DVec3::new(x, within(0.4), within(0.4));
        let org = target + turn * DVec3::new(x, within(1.0), within(1.0));
        let ray = Ray::new(org, (target - org).normalize());
        let mut counts = RayCounts::default();
        let Some(first) = embree.intersect(&ray, &mut counts) else { return false };
        let si = SurfaceInteraction::new(scene, &ray, &first);
        let next = through(&si, ray.dir);
        // The first sheet must be the first, and the second be behind it.
        let second = embree.intersect(&next, &mut counts);
        first.prim.geom_id == 0 && second.is_some_and(|h| h.prim.geom_id == 1)
    })
}

/// Spheres of radius 1 and 1 + `gap`: both are seen, from outside and from within.
fn concentric(gap: f64, facets: bool, rays: u64) -> Outcome {
    let mut world = World::default();
    world.materials.push(Material::diffuse("white", Rgb::ONE));
    for (name, radius) in [("inner", 1.0), ("outer", 1.0 + gap)] {
        if facets {
            world.meshes.push(shapes::sphere(DVec3::ZERO, radius, 60, 30));
        } else {
            world.spheres.push(WorldSphere::new(name, DVec3::ZERO, radius, 0));
        }
    }
    let scene = world.into_scene(true).unwrap();
    let embree = EmbreeIntersector::new(&scene, HitRules::default(), suite::isa(), 1).unwrap();
    let scale = scene.recentring.scale();
    let mut outcome = Outcome::default();
    for i in 0..rays {
        let mut rng = suite::rng(30, i);
        let dir = shapes::direction(&mut rng);
        // Towards the middle, off it by up to half: no ray leaves between the two.
        let off = shapes::in_ball(&mut rng, 0.5);
        for outside in [true, false] {
            let org = if outside { dir * -3.0 + off } else { off * 0.5 };
            let mut next = Ray::new(org * scale, dir);
            let mut seen = Vec::new();
            while let Some(hit) = embree.intersect(&next, &mut RayCounts::default()) {
                let si = SurfaceInteraction::new(&scene, &next, &hit);
                seen.push(si);
                next = si.spawn(dir, true);
                if seen.len() > 8 {
                    break;
                }
            }
            let radii: Vec<f64> = seen.iter().map(|si| si.p.length() / scale).collect();
            let expected = if outside { 4 } else { 2 };
            outcome.check(seen.len() == expected, || {
                format!("gap {gap:e}, facets {facets}: {org} {dir}: radii {radii:?}")
            });
        }
    }
    outcome.show(format!(
        "gap {gap:e}, facets {facets}: {} of {} wrong",
        outcome.failures, outcome.trials
    ));
    outcome
}
