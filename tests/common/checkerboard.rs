//! A checkerboard to the horizon whose picture is its albedo: it is lit by an ambient term alone.

#![allow(dead_code)]

use tweenray::math::{DVec3, Rgb, Vec2};
use tweenray::scene::{Corners, Material, Sky, Texture, TextureMap, World, WorldMesh};

/// Half of the floor's edge.
const REACH: f64 = 400.0;
/// Edge of the image on the floor: of 8 by 8 squares.
const IMAGE: f64 = 4.0;
/// Texels of the image's edge.
const TEXELS: u32 = 256;

/// Black and white squares of edge 0.5 in the plane y = 0.
pub fn colour_at(p: DVec3) -> Rgb {
    let square = |x: f64| (2.0 * x).floor() as i64;
    Rgb::splat((square(p.x) + square(-p.z)).rem_euclid(2) as f32)
}

/// The floor alone.
pub fn floor() -> World {
    let mut world = World::default();
    let squares = (0..TEXELS * TEXELS).map(|i| {
        let (x, y) = (i % TEXELS, TEXELS - 1 - i / TEXELS);
        [255 * ((x * 8 / TEXELS + y * 8 / TEXELS) % 2) as u8; 3]
    });
    world.textures.push(Texture::from_srgb("squares", [TEXELS; 2], squares.collect()));
    let white = Material::diffuse("floor", Rgb::ONE);
    world.materials.push(Material { texture: Some(TextureMap::of(0)), ..white });
    let corners = [(-REACH, REACH), (REACH, REACH), (REACH, -REACH), (-REACH, -REACH)];
    let quad = WorldMesh::quad("floor", corners.map(|(x, z)| DVec3::new(x, 0.0, z)), 0);
    let uv = |p: &DVec3| Vec2::new((p.x / IMAGE) as f32, (-p.z / IMAGE) as f32);
    let values = quad.positions.iter().map(uv).collect();
    world.meshes.push(WorldMesh { uvs: Some(Corners { values, corners: None }), ..quad });
    world.sky = Sky { ambient: Rgb::ONE, ..Sky::default() };
    world
}

/// The floor under a grey sky, that what looks upwards is not black.
pub fn hall() -> World {
    let mut world = floor();
    world.sky = Sky { radiance: Rgb::splat(0.5), lights: false, ..world.sky };
    world
}
