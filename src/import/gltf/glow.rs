//! Emission by an image: the triangles on which the image is bright become a mesh that emits its mean there.
//!
//! The renderer has no images of emission, and a mean over all of a mesh would make a whole model glow of which only lamps do.
//! A surface that emits reflects nothing, so what would emit little emits nothing.

use crate::import::tidy;
use crate::math::{Rgb, Vec2};
use crate::scene::{Corners, Texture, TextureMap, VertexColours, WorldMesh};
use rayon::prelude::*;

/// Triangles glow that are brighter than this share of the brightest one, and than this radiance.
const BRIGHT: f32 = 0.1;
const LEAST: f32 = 0.5;

/// The triangles of `mesh` on which `factor` times the image is bright, apart from the others, and the mean of that there.
/// Either part may have no triangles.
pub(super) fn split(
    mesh: WorldMesh,
    image: &Texture,
    (map, factor): (&TextureMap, Rgb),
) -> (WorldMesh, Option<(WorldMesh, Rgb)>) {
    let Some(uvs) = mesh.uv_set(map.uv_set) else { return (mesh, None) };
    let colour = |triangle: &[u32; 3]| {
        let corners =
            triangle.map(|i| map.transform.transform_point2(uvs.values[i as usize].as_dvec2()));
        factor * mean(image, map, corners.map(|uv| uv.as_vec2()))
    };
    let colours: Vec<Rgb> = mesh.triangles.par_iter().map(colour).collect();
    let most = colours.par_iter().map(|c| c.max_element()).reduce(|| 0.0, f32::max);
    let least = LEAST.max(BRIGHT * most);
    if most < least {
        return (mesh, None);
    }
    let glows: Vec<bool> = colours.par_iter().map(|c| c.max_element() >= least).collect();
    let (mut sum, mut weight) = (Rgb::ZERO, 0.0);
    for (at, colour) in colours.iter().enumerate().filter(|(at, _)| glows[*at]) {
        let [a, b, c] = mesh.triangles[at].map(|i| mesh.positions[i as usize]);
        let area = (b - a).cross(c - a).length() as f32;
        sum += *colour * area;
        weight += area;
    }
    let mean = if weight > 0.0 && weight.is_finite() { sum / weight } else { Rgb::splat(most) };
    let glowing = part(&mesh, &glows);
    let dark: Vec<bool> = glows.iter().map(|glows| !glows).collect();
    (part(&mesh, &dark), Some((glowing, mean)))
}

/// The mean of what the image shows between the corners `uv`, roughly: of seven texels of the level that has few there.
fn mean(image: &Texture, map: &TextureMap, uv: [Vec2; 3]) -> Rgb {
    let levels = image.levels();
    let (first, last) = (&levels[0], levels.len() - 1);
    let size = Vec2::new(first.width as f32, first.height as f32);
    let [a, b, c] = uv.map(|uv| uv * size);
    // Texels of the triangle, of which a level down has a quarter.
    let texels = 0.5 * (b - a).perp_dot(c - a).abs();
    let level = (0..last).find(|level| texels / 4f32.powi(*level as i32) <= 16.0).unwrap_or(last);
    let level = &levels[level];
    let texel = |weights: [f32; 3]| {
        let at = uv[0] * weights[0] + uv[1] * weights[1] + uv[2] * weights[2];
        let (x, ..) = map.wrap[0].two_texels(at.x, level.width);
        let (y, ..) = map.wrap[1].two_texels(1.0 - at.y, level.height);
        level.texel(x, y)
    };
    let third = 1.0 / 3.0;
    let (far, near) = (0.6, 0.2);
    let places = [
        [third; 3],
        [far, near, near],
        [near, far, near],
        [near, near, far],
        [0.45, 0.45, 0.1],
        [0.1, 0.45, 0.45],
        [0.45, 0.1, 0.45],
    ];
    places.iter().map(|weights| texel(*weights)).sum::<Rgb>() / places.len() as f32
}

/// The triangles of `mesh` that are `kept`, with the vertices that they use.
fn part(mesh: &WorldMesh, kept: &[bool]) -> WorldMesh {
    let mut triangles = mesh.triangles.clone();
    tidy::retain(&mut triangles, kept);
    let all = tidy::used(mesh.positions.len(), &triangles);
    let all = all.unwrap_or_else(|| vec![true; mesh.positions.len()]);
    tidy::renumber(&mut triangles, &all);
    let mut positions = mesh.positions.clone();
    tidy::retain(&mut positions, &all);
    let colours = mesh.colours.as_ref().map(|colours| {
        let used = (0..all.len()).filter(|at| all[*at]);
        VertexColours::from_linear(used.map(|at| colours.of_vertex(at as u32)).collect())
    });
    WorldMesh {
        normals: mesh.normals.as_ref().map(|normals| picked(normals, &all)),
        uvs: mesh.uvs.as_ref().map(|uvs| picked(uvs, &all)),
        more_uvs: mesh.more_uvs.iter().map(|set| Some(picked(set.as_ref()?, &all))).collect(),
        colours,
        always_traced: mesh.always_traced,
        ..WorldMesh::new(mesh.name.clone(), positions, triangles, mesh.material)
    }
}

/// Values of the vertices that are `kept`; of glTF all have one for each vertex.
fn picked<T: Copy>(corners: &Corners<T>, kept: &[bool]) -> Corners<T> {
    let mut values = corners.values.clone();
    tidy::retain(&mut values, kept);
    Corners { values, corners: None }
}
