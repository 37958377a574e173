//! Traces rays with Embree and holds every hit against the f64 oracle, which tests each ray against
//! each triangle: `cargo run --example 2_trace_and_compare`.

#![allow(clippy::print_stdout, reason = "a program for people")]

use tweenray::error::Result;
use tweenray::intersect::{EmbreeIntersector, Intersector, Oracle};
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::{Camera, Material, Pose, Settings, World, WorldMesh};
use tweenray::stats::RayCounts;

/// Rays that hit something, by the oracle; that miss; and of which Embree says otherwise.
#[derive(Debug, Default)]
#[allow(missing_docs)]
pub struct Agreement {
    pub hits: u32,
    pub misses: u32,
    pub differences: u32,
}

fn main() -> Result<()> {
    println!("{:?}", compare(160, 90)?);
    Ok(())
}

/// A square of hills, `edge` x `edge` vertices.
pub fn hills(edge: u32) -> World {
    let mut world = World::default();
    let sand = world.add_material(Material::diffuse("sand", Rgb::splat(0.5)));
    let at = |i: u32| 8.0 * f64::from(i) / f64::from(edge - 1) - 4.0;
    let height = |x: f64, z: f64| 0.4 * (1.7 * x).sin() * (2.3 * z).cos();
    let grid = (0..edge * edge).map(|k| (at(k % edge), at(k / edge)));
    let positions = grid.map(|(x, z)| DVec3::new(x, height(x, z), z)).collect();
    // Two triangles for each cell, whose first corner is vertex k.
    let cells = (0..edge * (edge - 1)).filter(|k| k % edge + 1 < edge);
    let triangles = cells.flat_map(|k| [[k, k + edge, k + 1], [k + 1, k + edge, k + edge + 1]]);
    world.meshes.push(WorldMesh::new("hills", positions, triangles.collect(), sand));
    world
}

/// Traces a ray through the middle of every pixel of a `width` x `height` image.
pub fn compare(width: u32, height: u32) -> Result<Agreement> {
    let scene = hills(60).into_scene(true)?;
    let embree = EmbreeIntersector::of(&scene, &Settings::default(), 1)?;
    let oracle = Oracle::new(&scene);
    // Rays and hits are in scene space, so the camera goes there too.
    let pose = Pose::look_at(DVec3::new(0.0, 2.0, 7.0), DVec3::ZERO);
    let camera = Camera::new(&pose, 40.0, width, height)?.to_scene(&scene.recentring);
    let (mut found, mut counts) = (Agreement::default(), RayCounts::default());
    for (x, y) in (0..width * height).map(|k| (f64::from(k % width), f64::from(k / width))) {
        let ray = camera.generate_ray(x + 0.5, y + 0.5, [0.5; 2]);
        let [a, b] = [&embree as &dyn Intersector, &oracle].map(|i| i.intersect(&ray, &mut counts));
        let same = a.zip(b).is_some_and(|(a, b)| a.prim == b.prim && (a.t - b.t).abs() < 1e-12);
        found.hits += u32::from(b.is_some());
        found.misses += u32::from(b.is_none());
        found.differences += u32::from(!same && (a.is_some() || b.is_some()));
    }
    Ok(found)
}
