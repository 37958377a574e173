//! How images lie on the shapes that a scene file generates: texture coordinates, (0, 0) at the image's
//! lower left corner.
//!
//! Seen from outside every image is upright, as far as the shape has an up, and never mirrored. Shapes
//! have coordinates only where their material has a texture: nothing else looks at them.

use crate::math::Vec2;
use crate::scene::Corners;

/// Coordinates of a quad's corners, in order: the image once over it.
pub(super) fn quad() -> Corners<Vec2> {
    let values = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
    Corners { values: values.map(|(u, v)| Vec2::new(u, v)).to_vec(), corners: None }
}

/// Coordinates of a box's faces: the image once over each. On the four sides it stands upright (+y); on top its
/// upper edge lies towards -z, below towards +z. `faces` are the corners of -x, +x, -y, +y, -z, +z, each
/// a number whose bits 0, 1 and 2 say which end of x, y and z; each face has two triangles: its corners
/// 0, 1, 2 and 0, 2, 3.
pub(super) fn cuboid(faces: &[[u32; 4]; 6]) -> Corners<Vec2> {
    let mut values = Vec::with_capacity(24);
    for (side, face) in faces.iter().enumerate() {
        for corner in face {
            let [x, y, z] = [0, 1, 2].map(|axis| (corner >> axis & 1) as f32);
            let (u, v) = match side {
                0 => (z, y),
                1 => (1.0 - z, y),
                2 => (x, z),
                3 => (x, 1.0 - z),
                4 => (1.0 - x, y),
                _ => (x, y),
            };
            values.push(Vec2::new(u, v));
        }
    }
    let corners = (0..6).flat_map(|side| [[0, 1, 2], [0, 2, 3]].map(|t| t.map(|k| 4 * side + k)));
    Corners { values, corners: Some(corners.collect()) }
}

/// Coordinates of a terrain of `n · n` vertices: the image once over it, its upper edge towards -z.
pub(super) fn terrain(n: u32) -> Corners<Vec2> {
    let share = |k: u32| (f64::from(k) / f64::from(n - 1)) as f32;
    let values = (0..n * n).map(|k| Vec2::new(share(k % n), 1.0 - share(k / n))).collect();
    Corners { values, corners: None }
}

/// Coordinates of a sphere of `nu` meridians and `nv` bands, as [`crate::import::uv_sphere`] orders its
/// triangles: u is the longitude, v the latitude. The image's middle faces +z and its side edges meet at -z; u runs
/// on from there, and the image repeats. A pole has the longitude of each triangle's middle.
pub(super) fn uv_sphere(nu: u32, nv: u32) -> Corners<Vec2> {
    let u = |i: f64| (0.75 - i / f64::from(nu)) as f32;
    let v = |j: u32| (1.0 - f64::from(j) / f64::from(nv)) as f32;
    // A row of nu + 1 values for each ring of vertices, then one for each triangle at either pole.
    let mut values = Vec::new();
    for j in 1..nv {
        values.extend((0..=nu).map(|i| Vec2::new(u(i.into()), v(j))));
    }
    let pole = |v: f32| (0..nu).map(move |i| Vec2::new(u(f64::from(i) + 0.5), v));
    let top = values.len() as u32;
    values.extend(pole(1.0).chain(pole(0.0)));
    let at = |j: u32, i: u32| (j - 1) * (nu + 1) + i;
    let mut corners: Vec<[u32; 3]> = (0..nu).map(|i| [top + i, at(1, i + 1), at(1, i)]).collect();
    for j in 1..nv - 1 {
        for i in 0..nu {
            let [a, b, c, d] = [at(j, i), at(j, i + 1), at(j + 1, i), at(j + 1, i + 1)];
            corners.extend([[a, b, c], [b, d, c]]);
        }
    }
    corners.extend((0..nu).map(|i| [at(nv - 1, i), at(nv - 1, i + 1), top + nu + i]));
    Corners { values, corners: Some(corners) }
}
