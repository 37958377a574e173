//! Meshes that need no file: the bench scene's terrain and spheres, at any size.
//!
//! Both follow the public bench scene's generator to the last digit, so that other renderers'
//! pictures of it can be compared: coordinates are rounded to six decimals, halves to even, and
//! vertices and triangles come in the same order. Sine and cosine are `libm`'s, the same on
//! every machine; they may differ from another library's in the last of 53 bits, which
//! the rounding hides but for one coordinate in about 10⁹.

use crate::error::{Error, Result};
use crate::math::DVec3;
use crate::scene::{Corners, MaterialId, WorldMesh};
use libm::{cos, sin};
use rayon::prelude::*;
use std::f64::consts::PI;

/// The largest mesh that the generators make.
pub const MAX_TRIANGLES: u64 = 1_000_000_000;

/// A sphere of `2 · nu · (nv − 1)` triangles about `centre` with smooth normals, poles on y.
///
/// `nu` meridians and `nv` bands. Rows run from the +y pole, triangles wind counter-clockwise
/// seen from outside. `nu = 200, nv = 201` makes the 80,000 triangles of the bench scene's.
///
/// Errors: `nu` below 3, `nv` below 2, more than [`MAX_TRIANGLES`], a radius that is not
/// positive, numbers that are not finite.
pub fn uv_sphere(
    name: &str,
    centre: DVec3,
    radius: f64,
    nu: u32,
    nv: u32,
    material: MaterialId,
) -> Result<WorldMesh> {
    if nu < 3 || nv < 2 || 2 * u128::from(nu) * (u128::from(nv) - 1) > MAX_TRIANGLES.into() {
        return usage(format!(
            "a sphere of {nu} meridians and {nv} bands: 3 and 2 are the least, and \
             {MAX_TRIANGLES} triangles the most"
        ));
    }
    if !(radius > 0.0 && radius.is_finite() && centre.is_finite()) {
        return usage(format!("a sphere of radius {radius} at {centre}: nothing to render"));
    }
    let directions = sphere_directions(nu, nv);
    let positions = directions.iter().map(|n| round6(*n * radius + centre)).collect();
    let values = directions.iter().map(|n| super::normals::unit_or_zero(round6(*n))).collect();
    Ok(WorldMesh {
        normals: Some(Corners { values, corners: None }),
        ..WorldMesh::new(name, positions, sphere_triangles(nu, nv), material)
    })
}

fn sphere_directions(nu: u32, nv: u32) -> Vec<DVec3> {
    let mut directions = vec![DVec3::Y];
    for j in 1..nv {
        let theta = PI * f64::from(j) / f64::from(nv);
        for i in 0..nu {
            let phi = 2.0 * PI * f64::from(i) / f64::from(nu);
            directions.push(DVec3::new(sin(theta) * cos(phi), cos(theta), sin(theta) * sin(phi)));
        }
    }
    directions.push(DVec3::NEG_Y);
    directions
}

fn sphere_triangles(nu: u32, nv: u32) -> Vec<[u32; 3]> {
    let at = |j: u32, i: u32| 1 + (j - 1) * nu + i % nu;
    let last = 1 + (nv - 1) * nu;
    let mut triangles: Vec<[u32; 3]> = (0..nu).map(|i| [0, at(1, i + 1), at(1, i)]).collect();
    for j in 1..nv - 1 {
        for i in 0..nu {
            let [a, b, c, d] = [at(j, i), at(j, i + 1), at(j + 1, i), at(j + 1, i + 1)];
            triangles.extend([[a, b, c], [b, d, c]]);
        }
    }
    triangles.extend((0..nu).map(|i| [at(nv - 1, i), at(nv - 1, i + 1), last]));
    triangles
}

/// The bench scene's terrain: `n · n` vertices over `[-half, half]²`, y up, `2 (n − 1)²`
/// triangles, flat normals. `n = 708, half = 10` is the bench scene's own.
///
/// Errors: `n` below 2, more than [`MAX_TRIANGLES`], `half` not positive and finite.
pub fn bench_terrain(name: &str, n: u32, half: f64, material: MaterialId) -> Result<WorldMesh> {
    if n < 2 || 2 * (u128::from(n) - 1).pow(2) > MAX_TRIANGLES.into() {
        return usage(format!(
            "a terrain of {n} x {n} vertices: 2 x 2 is the least, {MAX_TRIANGLES} triangles the most"
        ));
    }
    if !(half > 0.0 && half.is_finite()) {
        return usage(format!("a terrain that reaches {half} from its centre: nothing to render"));
    }
    // The last one is `half` itself, as numpy's linspace has it.
    let step = 2.0 * half / f64::from(n - 1);
    let at = |i: u32| if i == n - 1 { half } else { f64::from(i) * step - half };
    let positions = (0..n * n)
        .into_par_iter()
        .map(|k| {
            let (x, z) = (at(k % n), at(k / n));
            round6(DVec3::new(x, terrain_height(x, z), z))
        })
        .collect();
    let triangles = (0..(n - 1) * (n - 1))
        .into_par_iter()
        .flat_map_iter(|cell| {
            let k = cell / (n - 1) * n + cell % (n - 1);
            [[k, k + n, k + 1], [k + 1, k + n, k + n + 1]]
        })
        .collect();
    Ok(WorldMesh::new(name, positions, triangles, material))
}

fn usage<T>(message: String) -> Result<T> {
    Err(Error::Usage(message))
}

/// Height of the bench terrain above `(x, z)`.
pub fn terrain_height(x: f64, z: f64) -> f64 {
    0.60 * sin(0.55 * x + 0.3) * cos(0.45 * z - 0.2)
        + 0.25 * sin(1.7 * x + 0.9 * z + 1.0)
        + 0.08 * sin(4.3 * x - 3.1 * z + 0.5)
        + 0.03 * sin(11.0 * x + 7.0 * z) * sin(9.0 * z - 5.0 * x)
        + 0.008 * sin(37.0 * x + 5.0 * z) * sin(41.0 * z - 3.0 * x)
}

/// Rounds as `numpy.round(v, 6)` does: scaled, rounded half to even, scaled back. Coordinates
/// beyond 10⁹ stay as they are: they have no sixth decimal to round.
fn round6(v: DVec3) -> DVec3 {
    let round = |x: f64| if x.abs() < 1e9 { (x * 1e6).round_ties_even() / 1e6 } else { x };
    DVec3::new(round(v.x), round(v.y), round(v.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bench_sphere_is_closed_and_faces_outwards() {
        let centre = DVec3::new(-3.2, 2.2, 0.5);
        let mesh = uv_sphere("mirror", centre, 1.2, 200, 201, 0).expect("a sphere");
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (40_002, 80_000));
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize] - centre);
            assert!((b - a).cross(c - a).dot(a + b + c) > 0.0);
        }
        // Euler: V − E + F = 2 with E = 3F/2.
        assert_eq!(40_002 + 80_000 - 120_000, 2);
        assert_eq!(mesh.positions[1], DVec3::new(-3.181245, 3.399853, 0.5));
    }

    #[test]
    fn sizes_out_of_range_are_errors() {
        for (nu, nv, radius) in [(2, 9, 1.0), (9, 1, 1.0), (u32::MAX, u32::MAX, 1.0), (9, 9, 0.0)] {
            assert!(uv_sphere("s", DVec3::ZERO, radius, nu, nv, 0).is_err());
        }
        for (n, half) in [(1, 1.0), (u32::MAX, 1.0), (9, f64::NAN)] {
            assert!(bench_terrain("t", n, half, 0).is_err());
        }
    }

    #[test]
    fn the_bench_terrain_has_the_published_size_and_faces_up() {
        let mesh = bench_terrain("terrain", 708, 10.0, 0).expect("a terrain");
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (501_264, 999_698));
        assert_eq!(mesh.triangles[1], [1, 708, 709]);
        let last = mesh.positions[501_263];
        assert_eq!((last.x, last.z), (10.0, 10.0));
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            assert!((b - a).cross(c - a).y > 0.0);
        }
    }
}
