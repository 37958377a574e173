//! Images and meshes that the scenes name, made in code.

use image::{Rgb, Rgb32FImage, RgbImage};
use std::f32::consts::{PI, TAU};
use std::path::Path;

/// Edge of the images, texels.
const EDGE: u32 = 512;

/// Writes every file that a scene may name.
pub fn write(folder: &Path) {
    let save =
        |name: &str, at: fn(f32, f32) -> [f32; 3]| paint(at).save(folder.join(name)).unwrap();
    save("tiles.png", tiles);
    save("bricks.png", bricks);
    save("bricks-normal.png", bricks_normal);
    save("lattice.png", lattice);
    save("wear.png", wear);
    save("screen.png", screen);
    studio().save(folder.join("studio.exr")).unwrap();
    std::fs::write(folder.join("shell.ply"), ply(&shell(), true)).unwrap();
    std::fs::write(folder.join("ring.ply"), ply(&ring(), false)).unwrap();
}

/// An image of the codes, from 0 to 1, that `at` gives for u to the right and v upwards.
fn paint(at: fn(f32, f32) -> [f32; 3]) -> RgbImage {
    let place = |i: u32| (i as f32 + 0.5) / EDGE as f32;
    RgbImage::from_fn(EDGE, EDGE, |x, y| {
        Rgb(at(place(x), 1.0 - place(y)).map(|code| (255.0 * code.clamp(0.0, 1.0)).round() as u8))
    })
}

/// Tiles of two colours, four by four.
fn tiles(u: f32, v: f32) -> [f32; 3] {
    let (x, y) = (4.0 * u, 4.0 * v);
    let joint = [x, y].iter().any(|x| !(0.03..0.97).contains(&x.fract()));
    match (joint, (x.floor() + y.floor()) % 2.0 == 0.0) {
        (true, _) => [0.42, 0.4, 0.38],
        (_, true) => [0.88, 0.85, 0.78],
        (_, false) => [0.34, 0.16, 0.12],
    }
}

/// How far a place of a brick wall is from the nearest joint, at most 1, and the brick's number.
fn brick(u: f32, v: f32) -> ([f32; 2], f32) {
    let row = (8.0 * v).floor();
    let x = 4.0 * u + 0.5 * (row % 2.0);
    let from_edge = |x: f32, width: f32| ((0.5 - (x.fract() - 0.5).abs()) / width).min(1.0);
    // A brick is twice as wide as high, so that both joints are as wide.
    ([from_edge(x, 0.06), from_edge(8.0 * v, 0.12)], 7.0 * row + (x.floor() % 4.0))
}

fn bricks(u: f32, v: f32) -> [f32; 3] {
    let ([x, y], number) = brick(u, v);
    let shade = 0.9 + 0.1 * (number * 12.9898).sin();
    if x.min(y) < 0.5 { [0.62, 0.6, 0.56] } else { [0.66, 0.36, 0.27].map(|c| c * shade) }
}

/// Normals of bricks whose edges slope down to the joints.
fn bricks_normal(u: f32, v: f32) -> [f32; 3] {
    let height = |u: f32, v: f32| {
        let ([x, y], _) = brick(u.rem_euclid(1.0), v.rem_euclid(1.0));
        let rise = x.min(y);
        0.012 * rise * rise * (3.0 - 2.0 * rise)
    };
    let step = 1.0 / EDGE as f32;
    let slope = [
        (height(u + step, v) - height(u - step, v)) / (2.0 * step),
        (height(u, v + step) - height(u, v - step)) / (2.0 * step),
    ];
    let length = (1.0 + slope[0] * slope[0] + slope[1] * slope[1]).sqrt();
    [-slope[0] / length, -slope[1] / length, 1.0 / length].map(|n| 0.5 + 0.5 * n)
}

/// White bars, crossing aslant, with round knots; black is a hole.
fn lattice(u: f32, v: f32) -> [f32; 3] {
    let bar = |x: f32| ((4.0 * x).rem_euclid(1.0) - 0.5).abs() > 0.4;
    let knot = |x: f32| 0.5 - ((4.0 * x).rem_euclid(1.0) - 0.5).abs();
    let (a, b) = (u + v, u - v);
    let is_there = bar(a) || bar(b) || knot(a).hypot(knot(b)) < 0.2;
    [if is_there { 1.0 } else { 0.0 }; 3]
}

/// A roughness that has stripes of polish and rings of water.
fn wear(u: f32, v: f32) -> [f32; 3] {
    let stripe = 0.5 + 0.5 * (TAU * 3.0 * (u + 0.15 * (TAU * v).sin())).sin();
    let radius = (u - 0.6).hypot(v - 0.45);
    let ring = (1.0 - ((radius - 0.22).abs() / 0.03)).max(0.0);
    [(0.05 + 0.4 * stripe * stripe + 0.5 * ring).min(0.8); 3]
}

/// A sunset over hills.
fn screen(u: f32, v: f32) -> [f32; 3] {
    // As wide as two of its heights.
    let x = 2.0 * u;
    let hill = |height: f32, wave: f32, shift: f32| height + 0.06 * (wave * x + shift).sin();
    let from_sun = (x - 1.3).hypot(v - 0.42);
    if v < hill(0.16, 5.0, 0.5) {
        [0.05, 0.06, 0.1]
    } else if v < hill(0.32, 3.0, 2.0) {
        [0.22, 0.1, 0.22]
    } else if from_sun < 0.13 {
        [1.0, 0.95, 0.75]
    } else {
        let up = (v - 0.3) / 0.7;
        let glow = (-3.0 * from_sun).exp();
        [0.95 - 0.75 * up + 0.3 * glow, 0.5 - 0.2 * up + 0.3 * glow, 0.25 + 0.4 * up]
    }
}

/// A dim room with a wide window, a small lamp and a warm floor, in latitude and longitude.
fn studio() -> Rgb32FImage {
    Rgb32FImage::from_fn(256, 128, |x, y| {
        let (azimuth, height) =
            ((x as f32 + 0.5) / 256.0 * 360.0 - 180.0, 90.0 - (y as f32 + 0.5) / 128.0 * 180.0);
        let within = |at: [f32; 2], half: [f32; 2]| {
            (azimuth - at[0]).abs() < half[0] && (height - at[1]).abs() < half[1]
        };
        let bars = [-75.0, -45.0].iter().any(|at| (azimuth - at).abs() < 2.0);
        if within([-60.0, 35.0], [38.0, 22.0]) && !bars {
            Rgb([3.2, 3.6, 4.2])
        } else if within([75.0, 50.0], [9.0, 9.0]) {
            Rgb([16.0, 11.0, 6.5])
        } else if height < 0.0 {
            Rgb([0.2, 0.15, 0.11])
        } else {
            let up = (height / 90.0).powi(2);
            Rgb([0.24 + 0.1 * up, 0.23 + 0.12 * up, 0.22 + 0.16 * up])
        }
    })
}

/// A surface by two angles: place, normal and colour.
struct Surface {
    vertices: Vec<([f32; 3], [f32; 3], [f32; 3])>,
    triangles: Vec<[u32; 3]>,
}

/// `columns` around and `rows` along; both close where `is_closed`, else the rows end.
fn grid(
    columns: u32,
    rows: u32,
    is_closed: bool,
    at: impl Fn(f32, f32) -> ([f32; 3], [f32; 3]),
) -> Surface {
    let lines = if is_closed { rows } else { rows + 1 };
    let mut vertices = Vec::new();
    for row in 0..lines {
        for column in 0..columns {
            let place = |a: f32, b: f32| at(a / columns as f32, b / rows as f32);
            let (i, j) = (column as f32, row as f32);
            let (point, colour) = place(i, j);
            let along = |a: f32, b: f32| {
                let (far, near) = (place(i + a, j + b).0, place(i - a, j - b).0);
                [0, 1, 2].map(|k| far[k] - near[k])
            };
            let (a, b) = (along(0.05, 0.0), along(0.0, 0.05));
            let cross =
                [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
            let length = cross.iter().map(|x| x * x).sum::<f32>().sqrt();
            vertices.push((point, cross.map(|x| x / length), colour));
        }
    }
    let mut triangles = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let number = |i: u32, j: u32| (j % lines) * columns + i % columns;
            let (a, b) = (number(column, row), number(column + 1, row));
            let (c, d) = (number(column, row + 1), number(column + 1, row + 1));
            triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    Surface { vertices, triangles }
}

/// A ribbed shell that stands on y = 0, 1.6 high, its colour going from blue to yellow and red with height.
fn shell() -> Surface {
    grid(144, 48, false, |u, v| {
        let (angle, height) = (TAU * u, 1.6 * v);
        let rib = (12.0 * angle + 5.0 * v).cos();
        let radius = 0.25 + 0.45 * (PI * (0.12 + 0.83 * v)).sin().powf(0.8) + 0.035 * rib;
        let colour = [v, 0.35 + 0.45 * (PI * v).sin() + 0.1 * rib, 1.0 - v];
        // Downwards with v, so that normals point outwards.
        ([radius * angle.sin(), height, radius * angle.cos()], colour)
    })
}

/// A ring of radius 1 about z, 0.08 thick.
fn ring() -> Surface {
    grid(12, 48, true, |u, v| {
        let (around, along) = (TAU * u, TAU * v);
        let radius = 1.0 + 0.08 * around.cos();
        ([radius * along.cos(), radius * along.sin(), -0.08 * around.sin()], [1.0; 3])
    })
}

/// A binary PLY file.
fn ply(surface: &Surface, with_colours: bool) -> Vec<u8> {
    let mut header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\n",
        surface.vertices.len()
    );
    for name in ["x", "y", "z", "nx", "ny", "nz"] {
        header += &format!("property float {name}\n");
    }
    for name in ["red", "green", "blue"].iter().filter(|_| with_colours) {
        header += &format!("property uchar {name}\n");
    }
    header += &format!("element face {}\n", surface.triangles.len());
    header += "property list uchar int vertex_indices\nend_header\n";
    let mut bytes = header.into_bytes();
    for (place, normal, colour) in &surface.vertices {
        bytes.extend(place.iter().chain(normal).flat_map(|x| x.to_le_bytes()));
        if with_colours {
            bytes.extend(colour.map(|c| (255.0 * c.clamp(0.0, 1.0)).round() as u8));
        }
    }
    for triangle in &surface.triangles {
        bytes.push(3);
        bytes.extend(triangle.iter().flat_map(|i| i.to_le_bytes()));
    }
    bytes
}
