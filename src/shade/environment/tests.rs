//! Densities of samples, and the figures of decision 031.

use super::*;
use crate::math::DVec2;
use crate::sampling::{PixelSampler, mix};
use crate::scene::{Environment, EnvironmentKind, Scene, SceneEnvironment, SunSky, Texture, World};
use std::f64::consts::{FRAC_PI_4, PI};

fn random(mut seed: u64) -> impl FnMut() -> f64 {
    move || {
        seed = mix(seed);
        (seed >> 11) as f64 / (1u64 << 53) as f64
    }
}

fn direction(next: &mut impl FnMut() -> f64) -> DVec3 {
    let y = 2.0 * next() - 1.0;
    let (sin, cos) = libm::sincos(std::f64::consts::TAU * next());
    let level = (1.0 - y * y).sqrt();
    DVec3::new(level * sin, y, level * cos)
}

fn scene(kind: EnvironmentKind, textures: Vec<Texture>) -> Scene {
    let environment = Some(Environment::new(kind));
    World { environment, textures, ..World::default() }.into_scene(true).expect("a scene")
}

/// A smooth studio, a sky with a tiny sun in it, and a day without its sun, which is a light of its own.
fn scenes() -> [(&'static str, Scene); 3] {
    let image = |size: [u32; 2], radiance: &dyn Fn(DVec3) -> Rgb| {
        let texels = (0..size[0] * size[1]).map(|i| {
            let place = DVec2::new(f64::from(i % size[0]), f64::from(i / size[0])) + 0.5;
            let place = place / DVec2::new(f64::from(size[0]), f64::from(size[1]));
            let (sin, cos) = libm::sincos(std::f64::consts::PI * place.y);
            let (s, c) = libm::sincos(std::f64::consts::TAU * (place.x - 0.5));
            radiance(DVec3::new(sin * s, cos, -sin * c))
        });
        let image = Texture::from_linear("image", size, texels.collect());
        scene(EnvironmentKind::Image(0), vec![image])
    };
    let lamp = |d: DVec3, at: DVec3| libm::exp(8.0 * (d.dot(at.normalize()) - 1.0)) as f32;
    let studio = image([128, 64], &|d| {
        Rgb::new(0.1, 0.12, 0.15)
            + Rgb::new(4.0, 3.0, 2.0) * lamp(d, DVec3::new(1.0, 1.0, -0.5))
            + Rgb::new(0.5, 1.0, 3.0) * lamp(d, DVec3::new(-1.0, 0.5, 0.7))
    });
    let to_sun = DVec3::new(0.5, 0.6, -0.62).normalize();
    let sunny = image([1024, 512], &|d| match d.dot(to_sun) > 0.999_968 {
        true => Rgb::new(24_000.0, 18_000.0, 9_000.0),
        false => Rgb::new(0.15, 0.3, 0.7) * (0.5 + 0.5 * d.y.max(0.0) as f32),
    });
    let day = SunSky { to_sun, turbidity: 3.0, sun_radius: 0.005, ground: Rgb::splat(0.2) };
    [
        ("studio", studio),
        ("sky with a tiny sun", sunny),
        ("day without its sun", scene(EnvironmentKind::SunSky(day), Vec::new())),
    ]
}

fn own(scene: &Scene) -> &SceneEnvironment {
    scene.environment.as_ref().expect("an environment")
}

/// What hides a part of the sky: walls that rise to an angle, and balls.
struct Occluders {
    walls: Vec<DVec3>,
    balls: Vec<(DVec3, f64)>,
}

impl Occluders {
    fn random(next: &mut impl FnMut() -> f64) -> Self {
        let walls = (0..1 + (2.0 * next()) as usize).map(|_| direction(next)).collect();
        let balls = (0..1 + (4.0 * next()) as usize)
            .map(|_| (direction(next), 1.0 - 0.3 * next() * next()))
            .collect();
        Self { walls, balls }
    }

    fn is_open(&self, d: DVec3) -> bool {
        self.walls.iter().all(|wall| wall.dot(d) < 0.5)
            && self.balls.iter().all(|(at, cos)| at.dot(d) < *cos)
    }
}

/// Samples of both kinds add up to the irradiance, whatever the normal: by the standard error of their mean.
#[test]
fn samples_have_the_density_that_they_say() {
    for (name, scene) in &scenes() {
        let light = EnvironmentLight::new(own(scene));
        let mut next = random(11);
        for _ in 0..12 {
            let n = direction(&mut next);
            let (view, exact) = (light.seen_from(n), light.unshadowed(n));
            let (mut sum, mut squares) = (DVec3::ZERO, DVec3::ZERO);
            const COUNT: u32 = 40_000;
            for _ in 0..COUNT {
                let sample = view.sample_li([next(), next()]);
                let cos = sample.wi.dot(n).max(0.0);
                let weight = sample.radiance.as_dvec3() * (cos / sample.density);
                sum += weight;
                squares += weight * weight;
            }
            let mean = sum / f64::from(COUNT);
            let variance = (squares / f64::from(COUNT) - mean * mean).max(DVec3::ZERO);
            let error = (variance / f64::from(COUNT)).map(f64::sqrt);
            let off = (mean - exact.as_dvec3()).abs();
            // The table is off by a little, too.
            let allowed = error * 4.5 + exact.as_dvec3() * 2e-3;
            assert!(off.cmple(allowed).all(), "{name} {n}: {mean} for {exact}, {error}");
        }
    }
}

/// Nine coefficients of real spherical harmonics to order 2 (Ramamoorthi and Hanrahan, 2001).
fn harmonics(d: DVec3) -> [f64; 9] {
    let DVec3 { x, y, z } = d;
    [
        0.282_095,
        0.488_603 * y,
        0.488_603 * z,
        0.488_603 * x,
        1.092_548 * x * y,
        1.092_548 * y * z,
        0.315_392 * (3.0 * z * z - 1.0),
        1.092_548 * x * z,
        0.546_274 * (x * x - y * y),
    ]
}

/// Irradiance by coefficients of radiance.
fn by_harmonics(coefficients: &[DVec3; 9], n: DVec3) -> DVec3 {
    const BANDS: [f64; 3] = [PI, 2.0 / 3.0 * PI, FRAC_PI_4];
    let basis = harmonics(n);
    (0..9).map(|k| coefficients[k] * (BANDS[[0, 1, 1, 1, 2, 2, 2, 2, 2][k]] * basis[k])).sum()
}

fn root(sum: f64, count: u32) -> f64 {
    100.0 * (sum / f64::from(count)).sqrt()
}

/// What a traced point tells of the light at a normal that is turned by an angle, if this or that is kept of it: errors
/// in per cent of the irradiance without shadows there. Also how ratio times exact and plain samples compare where they
/// are traced. The figures of decision 031.
#[test]
#[ignore = "a minute; prints figures"]
#[allow(clippy::print_stdout)]
fn figures() {
    println!(
        "RMS error, per cent: | one ratio | a ratio a colour | harmonics | their ratio | two regions"
    );
    for (name, scene) in &scenes() {
        let tables = own(scene);
        let light = EnvironmentLight::new(tables);
        let [width, height] = tables.radiance.size();
        let mut cells = Vec::new();
        // Every other cell of fine tables, at random, would miss a sun: all cells.
        for cell in 0..width * height {
            let (row, column) = (cell / width, cell % width);
            let y = libm::cos(std::f64::consts::PI * (row as f64 + 0.5) / height as f64);
            let (s, c) =
                libm::sincos(std::f64::consts::TAU * ((column as f64 + 0.5) / width as f64 - 0.5));
            let level = (1.0 - y * y).sqrt();
            let d = DVec3::new(level * s, y, -level * c);
            let solid = tables.radiance.solid_angle(cell);
            let bright = tables.radiance.pdf(cell) > 0.0;
            cells.push((d, tables.radiance.radiance(cell).as_dvec3() * solid, bright));
        }
        for degrees in [2.0, 8.0, 20.0f64] {
            let mut next = random(23);
            let mut sums = [0.0; 5];
            const TRIALS: u32 = 60;
            for _ in 0..TRIALS {
                let occluders = Occluders::random(&mut next);
                let n = (direction(&mut next) + DVec3::Y).normalize();
                let across = n.cross(direction(&mut next)).normalize();
                let (sin, cos) = libm::sincos(degrees.to_radians());
                let turned = n * cos + across * sin;
                // Open and all: at the normal, at the turned one, by region at the normal and turned, as harmonics.
                let mut at = [[DVec3::ZERO; 2]; 2];
                let mut regions = [[[DVec3::ZERO; 2]; 2]; 2];
                let mut bands = [[DVec3::ZERO; 9]; 2];
                for (d, light, bright) in &cells {
                    let open = occluders.is_open(*d);
                    let basis = harmonics(*d);
                    for which in 0..2 {
                        if which == 0 && !open {
                            continue;
                        }
                        for (k, n) in [n, turned].into_iter().enumerate() {
                            let part = *light * n.dot(*d).max(0.0);
                            at[k][which] += part;
                            regions[usize::from(*bright)][k][which] += part;
                        }
                        (0..9).for_each(|k| bands[which][k] += *light * basis[k]);
                    }
                }
                let exact = at[1][1];
                let safe = |a: DVec3, b: DVec3| a / b.max(DVec3::splat(1e-12));
                let ratio = safe(at[0][0], at[0][1]);
                let one = at[0][0].element_sum() / at[0][1].element_sum();
                let [seen, all] = bands.map(|bands| by_harmonics(&bands, turned).max(DVec3::ZERO));
                let by_region: DVec3 =
                    regions.iter().map(|[own, turned]| turned[1] * safe(own[0], own[1])).sum();
                let kept = [
                    exact * one,
                    exact * ratio,
                    seen,
                    exact * safe(seen, all).min(DVec3::ONE),
                    by_region,
                ];
                for (sum, kept) in sums.iter_mut().zip(kept) {
                    *sum += ((kept - at[1][0]) / exact.element_sum() * 3.0).length_squared() / 3.0;
                }
            }
            let errors = sums.map(|sum| format!("{:5.2}", root(sum, TRIALS))).join(" | ");
            println!("{name}, turned by {degrees} degrees: {errors}");
        }
        for count in [4, 16, 64] {
            let mut next = random(31);
            let (mut of_ratio, mut of_plain, mut bias, mut worse, mut open_enough) =
                (0.0, 0.0, 0.0, 0, 0);
            const POINTS: u32 = 60;
            const TRIALS: u32 = 200;
            for point in 0..POINTS {
                let occluders = Occluders::random(&mut next);
                let n = (direction(&mut next) + DVec3::Y).normalize();
                let view = light.seen_from(n);
                let exact = light.unshadowed(n);
                let open = |(d, light, _): &(DVec3, DVec3, bool)| {
                    *light * (n.dot(*d).max(0.0) * f64::from(u8::from(occluders.is_open(*d))))
                };
                let truth: DVec3 = cells.iter().map(open).sum();
                let scale = 3.0 / f64::from(exact.element_sum());
                let (mut own_ratio, mut own_plain, mut mean) = (0.0, 0.0, DVec3::ZERO);
                for trial in 0..TRIALS {
                    let sampler = PixelSampler::new(9, trial, point, 0);
                    let mut u = vec![[0.0; 2]; count];
                    sampler.fill2(0, 0, &mut u);
                    let (mut seen, mut all) = (Rgb::ZERO, Rgb::ZERO);
                    for u in u {
                        let sample = view.sample_li(u.map(f64::from));
                        let cos = sample.wi.dot(n).max(0.0);
                        let weight = sample.radiance * (cos / sample.density) as f32;
                        all += weight;
                        seen += if occluders.is_open(sample.wi) { weight } else { Rgb::ZERO };
                    }
                    if all == Rgb::ZERO {
                        // As tracing does: one direction by the cosine says.
                        let sample = view.by_cosine([next(), next()]);
                        all = sample.radiance;
                        seen = if occluders.is_open(sample.wi) { all } else { seen };
                    }
                    let found = FoundSky { point: 0, rays: 0, open: seen, all };
                    let by_ratio = (exact * found.ratio()).as_dvec3();
                    let plain = seen.as_dvec3() / count as f64;
                    let off = |light: DVec3| ((light - truth) * scale).length_squared() / 3.0;
                    mean += (by_ratio - truth) * scale / f64::from(TRIALS);
                    own_ratio += off(by_ratio) / f64::from(TRIALS);
                    own_plain += off(plain) / f64::from(TRIALS);
                }
                worse += u32::from(own_ratio > 1.1 * own_plain);
                open_enough += u32::from(own_ratio * 1.1 < own_plain);
                of_ratio += own_ratio;
                of_plain += own_plain;
                bias += mean.length_squared() / 3.0;
            }
            println!(
                "{name}, {count} samples: ratio {:.2} %, plain {:.2} %, bias of the ratio {:.2} %; the ratio is worse at {worse} \
                 of {POINTS} points, better at {open_enough}",
                root(of_ratio, POINTS),
                root(of_plain, POINTS),
                root(bias, POINTS)
            );
        }
    }
}
