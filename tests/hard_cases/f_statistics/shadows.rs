//! The mean of many noisy soft shadows is the soft shadow.

use crate::common::{self, Job};
use crate::suite::{Outcome, Size};
use rayon::prelude::*;
use std::f64::consts::PI;
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::{Camera, Light, Material, Pose, QuadLight, World};

/// Half edge of the square light, and its height above the floor.
const LIGHT: (f64, f64) = (0.15, 2.0);
/// Height of the board that hides x > 0.
const BOARD: f64 = 1.0;
/// A right pixel is refused once in 10,000 times.
const Z: f64 = 3.89;

/// A floor under a square light, of which a board hides a part; the camera looks at the penumbra.
fn job(edge: u32) -> Job {
    let mut world = World::default();
    world.materials.push(Material::diffuse("floor", Rgb::ONE));
    world.materials.push(Material::black("board"));
    let p = DVec3::new;
    let level =
        |x0: f64, x1: f64, z: f64, y: f64| [p(x0, y, z), p(x1, y, z), p(x1, y, -z), p(x0, y, -z)];
    world.meshes.push(common::quad(level(-4.0, 4.0, 4.0, 0.0), 0));
    world.meshes.push(common::quad(level(0.0, 4.0, 4.0, BOARD), 1));
    let (a, h) = LIGHT;
    let corners = [p(-a, h, -a), p(a, h, -a), p(a, h, a), p(-a, h, a)];
    let radiance = Rgb::splat(PI as f32 / (4.0 * a * a) as f32);
    world.lights.push(Light::Quad(QuadLight { corners, radiance, two_sided: false }));
    // From the open side, under the board's edge.
    let pose =
        Pose { eye: p(-1.6, 0.8, 0.0), target: DVec3::ZERO, up: DVec3::Y, roll_degrees: 0.0 };
    let mut job = common::job(world, pose, edge, edge);
    job.camera = Camera::new(&pose, 20.0, edge, edge).unwrap();
    job
}

/// Radiance of the floor at `q`: Lambert's contour integral over the part of the light that the
/// board leaves open.
fn exact(q: DVec3) -> f64 {
    let (a, h) = LIGHT;
    // A straight way to the light passes the board's height half-way, at the mean of the two x.
    let open = (-q.x * (h - BOARD) / BOARD).clamp(-a, a);
    let corners = [(-a, -a), (open, -a), (open, a), (-a, a)];
    let to = corners.map(|(x, z)| (DVec3::new(x, h, z) - q).normalize());
    let edges = (0..4).map(|i| (to[i], to[(i + 1) % 4]));
    let sum = edges.map(|(u, v)| {
        let across = u.cross(v);
        let angle = libm::atan2(across.length(), u.dot(v));
        if across.length() > 0.0 { angle * across.y / across.length() } else { 0.0 }
    });
    0.5 * sum.sum::<f64>().abs() / (4.0 * a * a)
}

/// The exact picture: of pixel middles, or the mean over `n` x `n` places of each pixel.
fn reference(job: &Job, n: u32) -> Vec<f64> {
    let (w, h) = (job.camera.width, job.camera.height);
    let floor = |x: f64, y: f64| {
        let d = job.camera.direction(x, y);
        exact(job.camera.eye - d * (job.camera.eye.y / d.y))
    };
    let at = |i: u32, k: u32| f64::from(i) + (f64::from(k) + 0.5) / f64::from(n);
    let pixel = |i: u32| {
        let (x, y) = (i % w, i / w);
        let places = (0..n * n).map(|k| floor(at(x, k % n), at(y, k / n)));
        places.sum::<f64>() / f64::from(n * n)
    };
    (0..w * h).into_par_iter().map(pixel).collect()
}

/// Red of every pixel, for `runs` seeds.
fn runs(job: &Job, spp: u32, shadow_samples: u32, runs: u64) -> Vec<Vec<f64>> {
    let one = |seed| {
        let mut settings = job.settings.clone();
        (settings.spp, settings.shadow_samples, settings.seed) = (spp, shadow_samples, seed);
        let job = Job { world: job.world.clone(), camera: job.camera, settings };
        let (film, _) = common::render(&job);
        film.rgb.iter().map(|c| f64::from(c.x)).collect()
    };
    // One after another: a frame is rendered on all threads, and one that waited for its tiles would start
    // the next run meanwhile, deeper and deeper in its stack.
    (0..runs).map(one).collect()
}

fn rmse(runs: &[Vec<f64>], reference: &[f64]) -> f64 {
    let squares =
        runs.iter().flat_map(|run| run.iter().zip(reference).map(|(a, b)| (a - b).powi(2)));
    (squares.sum::<f64>() / (runs.len() * reference.len()) as f64).sqrt()
}

/// Slope of a straight line through the logarithms.
fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let (mx, my) = logs.iter().fold((0.0, 0.0), |m, p| (m.0 + p.0 / n, m.1 + p.1 / n));
    let xy: f64 = logs.iter().map(|(x, y)| (x - mx) * (y - my)).sum();
    xy / logs.iter().map(|(x, _)| (x - mx).powi(2)).sum::<f64>()
}

pub fn soft_shadows(size: Size) -> Outcome {
    let mut outcome = Outcome { allowed: 0.001, ..Outcome::default() };
    let job = job(size.of(12, 64));
    let middles = reference(&job, 1);
    let count = 500;
    // The z-test, at the middle of each pixel, where the truth is a formula.
    let samples = 16;
    let films = runs(&job, 1, samples, count);
    let (mut penumbra, mut mean_z2) = (0u64, 0.0);
    for (i, truth) in middles.iter().enumerate() {
        let n = films.len() as f64;
        let mean = films.iter().map(|f| f[i]).sum::<f64>() / n;
        let variance = films.iter().map(|f| (f[i] - mean).powi(2)).sum::<f64>() / (n - 1.0);
        // f32 pixels and light corners.
        let rounding = 1e-6 * truth.max(1e-3);
        let off = ((mean - truth).abs() - rounding).max(0.0);
        let z = off / (variance / n).sqrt().max(1e-12);
        if variance > 0.0 {
            penumbra += 1;
            mean_z2 += z * z;
        }
        outcome.check(z <= Z, || format!("pixel {i}: {mean} for {truth}, z {z:.1}"));
    }
    outcome.show(format!("{penumbra} pixels of {} in the penumbra", middles.len()));
    // 1 for right answers; far above where all are off by a little.
    let mean_z2 = mean_z2 / penumbra as f64;
    outcome.at_most(
        "mean of z² in the penumbra",
        mean_z2,
        1.0 + 5.0 * (2.0 / penumbra as f64).sqrt(),
    );
    // Error against samples. Scrambled Sobol points converge faster than random ones, so the mark
    // is a least steepness.
    let each = size.of(20, 100);
    let shadow: Vec<(f64, f64)> = [4u32, 8, 16, 32, 64, 128]
        .map(|n| (f64::from(n), rmse(&runs(&job, 1, n, each), &middles)))
        .to_vec();
    // One camera sample stands at the middle and converges to that, so two are the first.
    let areas = reference(&job, 16);
    let camera: Vec<(f64, f64)> = [2u32, 4, 8, 16, 32]
        .map(|n| (f64::from(n), rmse(&runs(&job, n, 16, each), &areas)))
        .to_vec();
    for (name, points) in [("shadow samples", shadow), ("camera samples", camera)] {
        let list: Vec<String> = points.iter().map(|(n, e)| format!("{n}: {e:.2e}")).collect();
        outcome.show(format!("rms error by {name}: {}", list.join(", ")));
        outcome.at_most(&format!("slope over {name}"), slope(&points), -0.47);
    }
    outcome
}
