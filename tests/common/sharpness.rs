//! Sharpness of a slanted edge: the frequency at which its transfer function falls to one half, as
//! ISO 12233 finds it (edge spread at a quarter of a pixel, its derivative, a Fourier transform).

#![allow(dead_code, missing_docs, reason = "the tests and the bench each use their part")]

use super::moves::Set;
use std::f64::consts::{PI, TAU};
use tweenray::film::Film;
use tweenray::math::{DVec3, Rgb, luminance};
use tweenray::scene::{
    CameraPath, KeyPose, Light, Material, Pose, QuadLight, Shot, World, WorldMesh,
};

/// Half the width of the strip around the edge that is looked at, pixels.
const REACH: f64 = 10.0;
/// Bins a pixel.
const BINS: f64 = 4.0;
/// Edge of the lamp, scene units: on the floor its shadow's penumbra is as wide, about a pixel of
/// a picture of 120 rows.
const LAMP: f64 = 0.03;

/// A grey floor seen from above, on which a board far outside the picture throws a slanted shadow
/// edge; the camera slides slowly across, `pixels` of a picture of 120 rows in all.
pub fn shadow_edge(frames: u32, pixels: f64) -> Set {
    let p = DVec3::new;
    let mut world = World::default();
    world.materials.push(Material::diffuse("floor", Rgb::splat(0.5)));
    world.materials.push(Material::black("board"));
    let floor = [p(-6.0, 0.0, 6.0), p(6.0, 0.0, 6.0), p(6.0, 0.0, -6.0), p(-6.0, 0.0, -6.0)];
    world.meshes.push(WorldMesh::quad("floor", floor, 0));
    // Half-way from the lamp to the floor, its edge slanted by five degrees.
    let slant = 4.0 * (5.0 * PI / 180.0).tan();
    let board = [
        p(-9.0, 5.0, 4.0),
        p(-5.0 - slant, 5.0, 4.0),
        p(-5.0 + slant, 5.0, -4.0),
        p(-9.0, 5.0, -4.0),
    ];
    world.meshes.push(WorldMesh::quad("board", board, 1));
    let (a, lamp) = (0.5 * LAMP, p(-10.0, 10.0, 0.0));
    let corners = [(-a, -a), (a, -a), (a, a), (-a, a)].map(|(x, z)| lamp + p(x, 0.0, z));
    let radiance = Rgb::splat((400.0 / (LAMP * LAMP)) as f32);
    world.lights.push(Light::Quad(QuadLight { corners, radiance, two_sided: true }));
    let eye_height = 8.0;
    let vfov_degrees = 25.0f64;
    let pixel = 2.0 * eye_height * (0.5 * vfov_degrees.to_radians()).tan() / 120.0;
    let half = 0.5 * pixels * pixel;
    let key = |at: f64, x: f64| {
        let (eye, target) = (p(x, eye_height, 0.0), p(x, 0.0, 0.0));
        KeyPose { at, pose: Pose { eye, target, up: p(0.0, 0.0, -1.0), roll_degrees: 0.0 } }
    };
    let path = CameraPath::Keys(vec![key(0.0, -half), key(1.0, half)]);
    Set::of(world, Shot::new(path, frames, vfov_degrees))
}

/// The line x = `at` + `slope` · y in pixels.
#[derive(Debug, Clone, Copy)]
pub struct Edge {
    pub at: f64,
    pub slope: f64,
}

fn values(film: &Film) -> Vec<f64> {
    film.rgb.iter().map(|c| f64::from(luminance(*c))).collect()
}

/// The edge of a picture with little noise: a line through the middles of its rows' steps.
pub fn edge_of(film: &Film) -> Edge {
    let (width, values) = (film.width as usize, values(film));
    let (mut n, mut sy, mut syy, mut sx, mut sxy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (y, row) in values.chunks(width).enumerate() {
        let steps = row.windows(2).enumerate().map(|(x, w)| (x as f64 + 1.0, (w[1] - w[0]).abs()));
        let (sum, moment) = steps.fold((0.0, 0.0), |(s, m), (x, d)| (s + d * d, m + d * d * x));
        let (x, y) = (moment / sum, y as f64 + 0.5);
        (n, sy, syy, sx, sxy) = (n + 1.0, sy + y, syy + y * y, sx + x, sxy + x * y);
    }
    let slope = (n * sxy - sx * sy) / (n * syy - sy * sy);
    Edge { at: (sx - slope * sy) / n, slope }
}

/// Cycles a pixel at which the transfer function across `edge` falls to one half.
pub fn mtf50(film: &Film, edge: Edge) -> f64 {
    let lines = line_spread(film, edge);
    let response = |cycles: f64| {
        let terms = lines.iter().enumerate().map(|(k, d)| {
            let (sin, cos) = (TAU * cycles * k as f64 / BINS).sin_cos();
            (d * cos, d * sin)
        });
        let (re, im) = terms.fold((0.0, 0.0), |(a, b), (c, d)| (a + c, b + d));
        re.hypot(im)
    };
    let (whole, step) = (response(0.0), 1e-3);
    let mut before = 1.0;
    for k in 1..2000 {
        let now = response(f64::from(k) * step) / whole;
        if now < 0.5 {
            return step * (f64::from(k) - (0.5 - now) / (before - now));
        }
        before = now;
    }
    f64::INFINITY
}

/// Derivative across the edge, windowed (Hamming), a value each quarter of a pixel.
fn line_spread(film: &Film, edge: Edge) -> Vec<f64> {
    let count = (2.0 * REACH * BINS) as usize;
    let mut bins = vec![(0.0, 0.0); count];
    let across = 1.0 / edge.slope.hypot(1.0);
    for (i, value) in values(film).into_iter().enumerate() {
        let (x, y) = (i % film.width as usize, i / film.width as usize);
        let distance = (x as f64 + 0.5 - edge.at - edge.slope * (y as f64 + 0.5)) * across;
        let bin = ((distance + REACH) * BINS).floor();
        if bin >= 0.0 && (bin as usize) < count {
            let (sum, n) = &mut bins[bin as usize];
            (*sum, *n) = (*sum + value, *n + 1.0);
        }
    }
    let spread: Vec<f64> = bins.iter().map(|(sum, n)| sum / n).collect();
    let window = |k: usize| 0.54 - 0.46 * (TAU * k as f64 / (count - 2) as f64).cos();
    spread.windows(2).enumerate().map(|(k, w)| (w[1] - w[0]) * window(k)).collect()
}
