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

/// The scene of `meshes`, and its tree.
fn scene_and_tree(meshes: Vec<WorldMesh>) -> (Scene, CoarseTree) {
    let mut world = World::default();
    world.materials.push(Material::diffuse("white", crate::math::Rgb::ONE));
    world.meshes = meshes;
    let scene = world.into_scene(false).expect("a scene");
    let facts: Vec<MeshFacts> = scene.meshes.iter().map(MeshFacts::of).collect();
    let tree = CoarseTree::new(&scene, &facts, DVec3::splat(1e-6));
    (scene, tree)
}

/// Whether a ray that leaves the southern half of the first ball along `dir` may meet a triangle.
fn may_meet(balls: Vec<WorldMesh>, dir: DVec3) -> bool {
    let (scene, tree) = scene_and_tree(balls);
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

/// Where a ray along z, from `z`, enters the boxes of `count` triangles at 10, 20, ...
fn entries(z: f64, count: u32) -> Vec<f64> {
    let triangle = |k: u32| {
        let z = 10.0 * f64::from(k);
        let corners = [(0.0, 0.0), (1.0, 0.0), (0.5, 1.0)].map(|(x, y)| DVec3::new(x, y, z));
        WorldMesh::new("triangle", corners.to_vec(), vec![[0, 1, 2]], 0)
    };
    let (_, tree) = scene_and_tree((1..=count).map(triangle).collect());
    let ray = Ray::new(DVec3::new(0.5, 0.5, z), DVec3::Z);
    let aside = Ray { org: ray.org - DVec3::X, ..ray };
    assert_eq!(tree.entries(&aside).count(), 0, "it passes all");
    tree.entries(&ray).map(f64::round).collect()
}

#[test]
fn a_ray_is_traced_anew_from_the_boxes_that_it_enters() {
    assert_eq!(entries(0.0, 2), [10.0, 20.0]);
    assert_eq!(entries(10.0, 2), [10.0], "not from the box that it starts in");
    let many = entries(0.0, 64);
    assert_eq!((many.len(), many[0]), (STARTS, 10.0));
    assert!(many.windows(2).all(|w| (60.0..=100.0).contains(&(w[1] - w[0]))), "{many:?}");
}
