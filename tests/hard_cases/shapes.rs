//! Meshes and worlds of the hard cases.

#![allow(dead_code, reason = "the tests and the stress run each use their part")]

use rand::Rng;
use std::f64::consts::{PI, TAU};
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::{Corners, Material, Scene, World, WorldMesh};

/// The far centre that Embree's own tests use.
pub const FAR: DVec3 = DVec3::new(148_376.0, 1_234.0, -223_423.0);

/// A world of one white diffuse mesh.
pub fn world_of(mesh: WorldMesh) -> World {
    let mut world = World::default();
    world.materials.push(Material::diffuse("white", Rgb::ONE));
    world.meshes.push(mesh);
    world
}

/// A scene of one white diffuse mesh.
pub fn scene_of(mesh: WorldMesh) -> Scene {
    world_of(mesh).into_scene(true).unwrap()
}

/// A closed sphere of `2 · (rows − 1) · columns` triangles, poles on the y axis, faces outwards.
pub fn sphere(centre: DVec3, radius: f64, columns: u32, rows: u32) -> WorldMesh {
    let mut positions = vec![centre + DVec3::Y * radius];
    for row in 1..rows {
        let (sin_t, cos_t) = (PI * f64::from(row) / f64::from(rows)).sin_cos();
        for column in 0..columns {
            let (sin_p, cos_p) = (TAU * f64::from(column) / f64::from(columns)).sin_cos();
            positions.push(centre + DVec3::new(sin_t * cos_p, cos_t, sin_t * sin_p) * radius);
        }
    }
    positions.push(centre - DVec3::Y * radius);
    let last = positions.len() as u32 - 1;
    let at = |row: u32, column: u32| match row {
        0 => 0,
        row if row == rows => last,
        row => 1 + (row - 1) * columns + column % columns,
    };
    let mut triangles = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let (a, b) = (at(row, column), at(row, column + 1));
            let (c, d) = (at(row + 1, column), at(row + 1, column + 1));
            if row > 0 {
                triangles.push([a, b, d]);
            }
            if row + 1 < rows {
                triangles.push([a, d, c]);
            }
        }
    }
    WorldMesh::new("sphere", positions, triangles, 0)
}

/// [`sphere`] with the normals of a true sphere.
pub fn smooth_sphere(centre: DVec3, radius: f64, columns: u32, rows: u32) -> WorldMesh {
    let mut mesh = sphere(centre, radius, columns, rows);
    let values = mesh.positions.iter().map(|p| (*p - centre).normalize().as_vec3()).collect();
    mesh.normals = Some(Corners { values, corners: None });
    mesh
}

/// A direction, uniform over the sphere.
pub fn direction(rng: &mut impl Rng) -> DVec3 {
    let z = rng.random_range(-1.0..=1.0f64);
    let (sin, cos) = (TAU * rng.random::<f64>()).sin_cos();
    let r = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(r * cos, r * sin, z)
}

/// A point, uniform in the ball of `radius` around the origin.
pub fn in_ball(rng: &mut impl Rng, radius: f64) -> DVec3 {
    direction(rng) * radius * rng.random::<f64>().cbrt()
}
