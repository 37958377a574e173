//! Leaf cards: squares of two triangles, turned at random, out of which a mask cuts a round leaf each.

#![allow(dead_code, reason = "tests and bench each use their part")]

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use tweenray::math::{DQuat, DVec3, Rgb, Vec2};
use tweenray::scene::{AlphaMask, Corners, Material, TextureMap, World, WorldMesh};

/// A leaf of `edge` x `edge` texels: a disk that covers half of the image, in steps from 0 to 255 at its rim.
pub fn mask(edge: u32) -> AlphaMask {
    let middle = 0.5 * f64::from(edge);
    let radius = (0.5 / std::f64::consts::PI).sqrt() * f64::from(edge);
    let texel = |k: u32| {
        let (x, y) = (f64::from(k % edge) + 0.5 - middle, f64::from(k / edge) + 0.5 - middle);
        (255.0 * (radius - x.hypot(y) + 0.5).clamp(0.0, 1.0)) as u8
    };
    let texels = (0..edge * edge).map(texel).collect();
    AlphaMask { name: "leaf".into(), width: edge, height: edge, texels }
}

/// The texture coordinates of cards: the image once over each.
pub fn uvs(cards: usize) -> Corners<Vec2> {
    let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(u, v)| Vec2::new(u, v));
    Corners { values: corners.repeat(cards), corners: None }
}

/// Cards of the given half edge around each of `middles`, of material 0.
pub fn cards(middles: &[DVec3], half: f64, rng: &mut Pcg64) -> WorldMesh {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for (middle, first) in middles.iter().zip((0u32..).step_by(4)) {
        let turn = DQuat::from_euler(
            glam::EulerRot::XYZ,
            rng.random_range(0.0..6.3),
            rng.random_range(0.0..6.3),
            rng.random_range(0.0..6.3),
        );
        for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
            positions.push(*middle + turn * DVec3::new(x, y, 0.0) * half);
        }
        triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    let uvs = Some(uvs(middles.len()));
    WorldMesh { uvs, ..WorldMesh::new("leaves", positions, triangles, 0) }
}

/// A point of the unit ball.
pub fn in_ball(rng: &mut Pcg64) -> DVec3 {
    loop {
        let p = DVec3::from_array([(); 3].map(|()| rng.random_range(-1.0..1.0)));
        if p.length_squared() < 1.0 {
            return p;
        }
    }
}

/// `trees` x `trees` crowns of `leaves` cards each on a white floor; the cards are whole or `cut`.
pub fn forest(trees: u32, leaves: u32, cut: bool) -> World {
    let mut rng = Pcg64::seed_from_u64(7);
    let mut middles = Vec::new();
    for k in 0..trees * trees {
        let at = |k: u32| 3.0 * (f64::from(k) - 0.5 * f64::from(trees - 1));
        let crown = DVec3::new(at(k % trees), 2.5, at(k / trees));
        middles.extend((0..leaves).map(|_| crown + in_ball(&mut rng) * 1.2));
    }
    let mut world = World::default();
    let leaf = Material::diffuse("leaf", Rgb::new(0.2, 0.5, 0.1));
    world.add_material(Material { alpha: cut.then(|| TextureMap::of(0)), ..leaf });
    let white = world.add_material(Material::diffuse("floor", Rgb::splat(0.7)));
    world.masks.push(mask(64));
    world.meshes.push(cards(&middles, 0.06, &mut rng));
    let edge = 3.0 * f64::from(trees);
    let floor = [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)];
    let floor = floor.map(|(x, z)| DVec3::new(x, 0.0, z) * edge);
    world.meshes.push(WorldMesh::quad("floor", floor, white));
    world
}
