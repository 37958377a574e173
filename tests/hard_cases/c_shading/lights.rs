//! Area lights at their limits.

use crate::common;
use crate::suite::{Outcome, Size};
use std::f64::consts::{PI, TAU};
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::{Camera, Light, Material, Pose, QuadLight, SphereLight, World};

/// A light, what may hide it, a floor point, and the exact irradiance there per unit radiance.
struct Extreme {
    name: String,
    light: Light,
    blocker: Option<[DVec3; 4]>,
    point: DVec3,
    eye: DVec3,
    exact: f64,
}

const UP: DVec3 = DVec3::Y;

fn extreme(name: impl Into<String>, light: Light, exact: f64) -> Extreme {
    let (point, eye) = (DVec3::ZERO, DVec3::new(0.3, 1.7, 1.1));
    Extreme { name: name.into(), light, blocker: None, point, eye, exact }
}

fn ball(centre: DVec3, radius: f64) -> Light {
    Light::Sphere(SphereLight { centre, radius, radiance: Rgb::ONE })
}

fn quad(corners: [DVec3; 4]) -> Light {
    Light::Quad(QuadLight { corners, radiance: Rgb::ONE, two_sided: true })
}

/// A level square of half edge `a` at height `h`, facing down.
fn square(a: f64, h: f64) -> [DVec3; 4] {
    [(-a, -a), (a, -a), (a, a), (-a, a)].map(|(x, z)| DVec3::new(x, h, z))
}

/// Irradiance at the origin from a sphere, with the horizon: at each height above the horizon the
/// arc that lies in the sphere's cone, summed over heights.
fn by_heights(centre: DVec3, radius: f64) -> f64 {
    let half_angle = libm::asin(radius / centre.length());
    let axis = libm::asin(centre.normalize().dot(UP));
    let (low, high) = ((axis - half_angle).max(0.0), (axis + half_angle).min(PI / 2.0));
    let n = 2_000_000;
    let mut sum = 0.0;
    for i in 0..n {
        // Steps that narrow towards both ends, where the arc has roots.
        let x = (f64::from(i) + 0.5) / f64::from(n);
        let height = low + (high - low) * 0.5 * (1.0 - (PI * x).cos());
        let step = (high - low) * 0.5 * PI * (PI * x).sin() / f64::from(n);
        // cos(half angle) - sin h sin a = cos h cos a cos phi, as a difference of angles: sin² of
        // half the arc without cancellation.
        let (u, v) = (0.5 * (half_angle + height - axis), 0.5 * (half_angle - height + axis));
        let sin2 = u.sin() * v.sin() / (height.cos() * axis.cos());
        let arc = if sin2 >= 1.0 { TAU } else { 4.0 * sin2.max(0.0).sqrt().asin() };
        sum += height.sin() * height.cos() * arc * step;
    }
    sum
}

/// Irradiance at the origin from a parallelogram, by the midpoint rule, with the horizon.
fn by_area(corner: DVec3, u: DVec3, v: DVec3) -> f64 {
    let normal = u.cross(v);
    let n = 2000;
    let mut sum = 0.0;
    for i in 0..n {
        for j in 0..n {
            let at = |k: i32| (f64::from(k) + 0.5) / f64::from(n);
            let p = corner + u * at(i) + v * at(j);
            let d2 = p.length_squared();
            sum += p.dot(UP).max(0.0) * p.dot(normal).abs() / (d2 * d2);
        }
    }
    sum / f64::from(n * n)
}

/// Irradiance under the middle of a level square: integral of Lambert's formula.
fn under_square(a: f64, h: f64) -> f64 {
    let s = a / (a * a + h * h).sqrt();
    4.0 * s * libm::atan(s)
}

fn extremes() -> Vec<Extreme> {
    let p = DVec3::new;
    let mut list = Vec::new();
    for (radius, height) in [(1e-6, 1.0), (1e-9, 1.0), (1e-3, 2.0), (0.999_999, 1.0)] {
        let exact = PI * (radius / height) * (radius / height);
        list.push(extreme(
            format!("radius {radius:e}, {height} above"),
            ball(UP * height, radius),
            exact,
        ));
    }
    list.push(extreme("radius 0", ball(UP, 0.0), 0.0));
    // Inside a light that shines outwards there is no light.
    let inside = Extreme { eye: p(0.2, 0.5, 0.1), ..extreme("inside", ball(UP * 0.3, 1.5), 0.0) };
    list.push(inside);
    // Across the horizon, from nearly whole to a sliver.
    for height in [0.5, 0.2, 0.0, -0.2, -0.45, -0.499] {
        let centre = p(1.5, height, 0.2);
        list.push(extreme(
            format!("ball at height {height}"),
            ball(centre, 0.5),
            by_heights(centre, 0.5),
        ));
    }
    list.push(extreme("ball below the horizon", ball(p(1.5, -0.6, 0.2), 0.5), 0.0));
    // An upright quad that the floor's plane cuts, and one that lies in it.
    for low in [0.1, -0.5, -0.999] {
        let corner = p(1.0, low, -0.5);
        let corners = [corner, corner + DVec3::Z, corner + DVec3::Z + UP, corner + UP];
        // By the part above: the midpoint rule has no step across the horizon then.
        let cut = p(1.0, f64::max(low, 0.0), -0.5);
        let exact = by_area(cut, DVec3::Z, UP * (low + 1.0 - cut.y));
        list.push(extreme(format!("upright quad from {low}"), quad(corners), exact));
    }
    let flat = square(0.5, 0.0).map(|c| c + p(1.5, 0.0, 0.0));
    list.push(extreme("quad in the plane of the surface", quad(flat), 0.0));
    for (a, h) in [(0.5, 1e-3), (1.0, 1e-5), (1e-6, 1.0), (1.9, 0.5)] {
        let e = extreme(format!("square {a} at {h}"), quad(square(a, h)), under_square(a, h));
        let eye = if h <= 0.5 { p(0.0, 0.4 * h, 0.9 * h) } else { e.eye };
        list.push(Extreme { eye, ..e });
    }
    // No area at all.
    let line =
        [DVec3::X, DVec3::X * 2.0, DVec3::X * 2.0 + UP, DVec3::X + UP].map(|c| p(c.x, 1.0, 0.0));
    list.push(extreme("quad without area", quad(line), 0.0));
    // Half hidden: the blocker's edge passes between the middle of the light and the point.
    let half = [p(0.0, 0.5, -3.0), p(3.0, 0.5, -3.0), p(3.0, 0.5, 3.0), p(0.0, 0.5, 3.0)];
    let open = under_square(0.4, 2.0);
    let hidden = extreme("square, half hidden", quad(square(0.4, 2.0)), 0.5 * open);
    list.push(Extreme { blocker: Some(half), eye: p(-0.8, 0.3, 0.1), ..hidden });
    let exact = 0.5 * PI * 0.04;
    let hidden = extreme("ball, half hidden", ball(UP * 2.0, 0.4), exact);
    list.push(Extreme { blocker: Some(half), eye: p(-0.8, 0.3, 0.1), ..hidden });
    list
}

/// Radiance times pi of one pixel, for a seed.
fn irradiance(extreme: &Extreme, seed: u64, shadow_samples: u32) -> (f64, u64) {
    let mut world = World::default();
    world.materials.push(Material::diffuse("floor", Rgb::ONE));
    world.materials.push(Material::black("blocker"));
    world.meshes.push(common::quad(square(2.0, 0.0).map(|c| DVec3::new(-c.x, c.y, c.z)), 0));
    if let Some(corners) = extreme.blocker {
        world.meshes.push(common::quad(corners, 1));
    }
    world.lights.push(extreme.light.clone());
    let Extreme { eye, point, .. } = *extreme;
    let pose = Pose { eye, target: point, up: DVec3::Y, roll_degrees: 0.0 };
    let mut job = common::job(world, pose, 1, 1);
    job.camera = Camera::new(&pose, 1e-4, 1, 1).unwrap();
    job.settings.seed = seed;
    job.settings.shadow_samples = shadow_samples;
    let (film, _) = common::render(&job);
    (f64::from(film.rgb[0].x) * PI, film.bad.total())
}

pub fn area_light_extremes(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let seeds = size.of(60, 2000);
    for extreme in extremes() {
        let runs: Vec<(f64, u64)> = (0..seeds).map(|seed| irradiance(&extreme, seed, 16)).collect();
        let n = runs.len() as f64;
        let bad: u64 = runs.iter().map(|(_, bad)| bad).sum();
        let mean = runs.iter().map(|(e, _)| e).sum::<f64>() / n;
        let variance = runs.iter().map(|(e, _)| (e - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let sigma = (variance / n).sqrt();
        // f32 pixels, and positions: floor and corners are rounded by 1e-7, which is 1e-4 of a
        // sliver of 1e-3; its light goes with the power 2.5 of that.
        let rounding = extreme.exact * if extreme.exact < 1e-6 { 1e-3 } else { 2e-5 };
        let off = (mean - extreme.exact).abs();
        let ok = bad == 0 && mean.is_finite() && off <= 3.0 * sigma + rounding;
        let Extreme { name, exact, .. } = &extreme;
        outcome.check(ok, || format!("{name}: {mean:e} ± {sigma:.1e} for {exact:e}, {bad} bad"));
        outcome.show(format!("{name}: {mean:.6e}, sigma {sigma:.1e}, exact {exact:.6e}"));
    }
    outcome
}
