//! Which boxes a ray that leaves a mesh may pass by.

use super::*;
use crate::scene::{Material, World, WorldMesh};
use std::f64::consts::PI;

/// A ball of radius 1 about `centre`, with or without its upper triangles.
fn ball(centre: DVec3, whole: bool) -> WorldMesh {
    let (rings, around) = (24, 24);
    let corner = |ring: u32, k: u32| ring * around + k % around;
    let position = |i: u32| {
        let (polar, turn) = (PI * f64::from(i / around) / f64::from(rings), i % around);
        let turn = 2.0 * PI * f64::from(turn) / f64::from(around);
        // The poles are one place each.
        let sin = if i / around % rings == 0 { 0.0 } else { polar.sin() };
        centre + DVec3::new(sin * turn.sin(), polar.cos(), sin * turn.cos())
    };
    let quad = |ring, k| {
        let [a, b] = [corner(ring, k), corner(ring, k + 1)];
        let [c, d] = [corner(ring + 1, k), corner(ring + 1, k + 1)];
        [[a, c, b], [b, c, d]]
    };
    let first = if whole { 0 } else { rings / 2 };
    let quads = (first..rings).flat_map(|ring| (0..around).map(move |k| (ring, k)));
    let positions = (0..(rings + 1) * around).map(position).collect();
    WorldMesh::new("ball", positions, quads.flat_map(|(ring, k)| quad(ring, k)).collect(), 0)
}

/// Whether a ray that leaves the southern half of the first ball along `dir` may meet a triangle.
fn may_meet(balls: Vec<WorldMesh>, dir: DVec3) -> bool {
    let mut world = World::default();
    world.materials.push(Material::diffuse("white", crate::math::Rgb::ONE));
    world.meshes.extend(balls);
    let scene = world.into_scene(false).expect("a scene");
    let facts: Vec<MeshFacts> = scene.meshes.iter().map(MeshFacts::of).collect();
    let tree = CoarseTree::new(&scene, &facts, DVec3::splat(1e-6));
    let prim_id = scene.meshes[0].triangles.len() as u32 - 400;
    let [a, b, c] = scene.meshes[0].corners(prim_id as usize);
    let exclude = PrimRef { geom_id: 0, prim_id };
    let out = (b - a).cross(c - a).normalize();
    let ray = Ray { exclude, ..Ray::new((a + b + c) / 3.0, dir * out.dot(dir).signum()) };
    assert!(dir != DVec3::ZERO && out.dot(ray.dir) > 0.1);
    let inwards = Ray { dir: -ray.dir, ..ray };
    assert!(tree.may_meet(&Bundle::of([&inwards]).expect("a bundle")));
    tree.may_meet(&Bundle::of([&ray]).expect("a bundle"))
}

#[test]
fn a_ray_that_leaves_a_closed_mesh_meets_only_other_meshes() {
    let own = |whole| ball(DVec3::ZERO, whole);
    let far = |dir: DVec3| ball(dir.normalize() * 5.0, true);
    for dir in [DVec3::new(0.1, -0.3, 1.0), DVec3::new(0.3, -0.6, 1.0)] {
        assert!(!may_meet(vec![own(true)], dir), "{dir}");
        assert!(may_meet(vec![own(false)], dir), "an open one may show its backs: {dir}");
        let both = [1.0, -1.0].map(|side| far(dir * side));
        assert!(may_meet([vec![own(true)], both.into()].concat(), dir), "{dir}");
    }
}
