//! What a ray-triangle pair costs the brute-force oracle, on one thread.
#![allow(clippy::print_stdout, reason = "a bench prints its figures")]

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use std::time::Instant;
use tweenray::intersect::{Intersector, Oracle, Ray};
use tweenray::math::DVec3;
use tweenray::scene::{Material, World, WorldMesh};
use tweenray::stats::RayCounts;

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    for side in [100u32, 700, 2300] {
        let scene = terrain(side);
        let oracle = Oracle::new(&scene);
        let rays = rays((400_000_000 / scene.triangle_count()).clamp(64, 4096) / 64 * 64);
        let mut hits = vec![None; rays.len()];
        let best = (0..5).map(|_| {
            let start = Instant::now();
            pool.install(|| oracle.intersect_batch(&rays, &mut hits, &mut RayCounts::default()));
            start.elapsed().as_secs_f64()
        });
        let seconds = best.fold(f64::INFINITY, f64::min);
        let pairs = rays.len() as f64 * scene.triangle_count() as f64;
        println!(
            "{:>9} triangles, {:>4} rays: {:.2} ns a pair, {} MB, {} hits",
            scene.triangle_count(),
            rays.len(),
            seconds * 1e9 / pairs,
            oracle.memory() / 1_000_000,
            hits.iter().flatten().count()
        );
    }
}

/// A bumpy square of `2·side²` triangles.
fn terrain(side: u32) -> tweenray::scene::Scene {
    let mut rng = Pcg64::seed_from_u64(1);
    let at = |x: u32, z: u32| x + z * (side + 1);
    let grid = |n: u32| (0..n).flat_map(move |z| (0..n).map(move |x| (x, z)));
    let mut height = || rng.random_range(0.0..0.5);
    let positions =
        grid(side + 1).map(|(x, z)| DVec3::new(f64::from(x), height(), f64::from(z))).collect();
    let triangles = grid(side).flat_map(|(x, z)| {
        let [a, b, c, d] = [at(x, z), at(x + 1, z), at(x, z + 1), at(x + 1, z + 1)];
        [[a, c, d], [a, d, b]]
    });
    let mesh = WorldMesh::new("terrain", positions, triangles.collect(), 0);
    let materials = vec![Material::diffuse("white", tweenray::math::Rgb::ONE)];
    let world = World { meshes: vec![mesh], materials, ..World::default() };
    world.into_scene(true).expect("a scene")
}

fn rays(count: usize) -> Vec<Ray> {
    let mut rng = Pcg64::seed_from_u64(2);
    let mut point =
        |y: f64| DVec3::new(rng.random_range(-0.9..0.9), y, rng.random_range(-0.9..0.9));
    (0..count)
        .map(|_| point(1.0))
        .collect::<Vec<_>>()
        .into_iter()
        .map(|org| {
            let aim = point(0.0);
            Ray::new(org, aim - org)
        })
        .collect()
}
