use super::*;
use crate::math::DVec3;
use crate::scene::{Material, World, WorldMesh, WorldSphere};
use crate::stats::RayKind;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use std::f64::consts::{PI, TAU};

/// A closed bumpy sphere about the origin, poles on z.
fn bumpy(columns: u32, rows: u32, seed: u64) -> WorldMesh {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut positions = Vec::new();
    for row in 0..=rows {
        let (sin, z) = (PI * f64::from(row) / f64::from(rows)).sin_cos();
        let ring = if row == 0 || row == rows { 1 } else { columns };
        for column in 0..ring {
            let (y, x) = (TAU * f64::from(column) / f64::from(columns)).sin_cos();
            positions.push(DVec3::new(x * sin, y * sin, z) * rng.random_range(0.9..1.1));
        }
    }
    let last = positions.len() as u32 - 1;
    let at = |row: u32, column: u32| match row {
        0 => 0,
        row if row == rows => last,
        row => 1 + (row - 1) * columns + column % columns,
    };
    let mut triangles = Vec::new();
    for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        let [a, b] = [at(row, column), at(row, column + 1)];
        let [c, d] = [at(row + 1, column), at(row + 1, column + 1)];
        triangles.extend([[a, c, d], [a, d, b]].into_iter().filter(|[a, b, c]| a != b && b != c));
    }
    WorldMesh::new("bumpy", positions, triangles, 0)
}

fn scene(meshes: Vec<WorldMesh>) -> Scene {
    let materials = vec![Material::diffuse("white", crate::math::Rgb::ONE)];
    World { meshes, materials, ..World::default() }.into_scene(true).unwrap()
}

fn inside(rng: &mut Pcg64) -> DVec3 {
    DVec3::from_array([(); 3].map(|()| rng.random_range(-0.2..0.2)))
}

/// Random rays, and rays aimed at vertices and edges of the first mesh, from inside.
fn rays(scene: &Scene, count: usize, seed: u64) -> Vec<Ray> {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mesh = &scene.meshes[0];
    let aim = |rng: &mut Pcg64, kind: usize| {
        let [a, b, _] = mesh.corners(rng.random_range(0..mesh.triangles.len()));
        match kind {
            0 => DVec3::from_array([(); 3].map(|()| rng.random_range(-1.0..1.0))),
            1 => a,
            _ => a + (b - a) * rng.random::<f64>(),
        }
    };
    let mut ray = |i: usize| {
        let (org, aim) = (inside(&mut rng), aim(&mut rng, i % 3));
        Ray::new(org, aim - org)
    };
    (0..count).map(&mut ray).collect()
}

#[test]
fn no_ray_leaves_a_closed_mesh_and_crossings_are_odd() {
    let scene = scene(vec![bumpy(37, 23, 1)]);
    let oracle = Oracle::new(&scene);
    let mut through_edges = 0;
    for ray in rays(&scene, 3000, 2) {
        let hits = oracle.all_hits(&ray);
        assert!(!hits.is_empty(), "leak: {ray:?}");
        if hits.iter().any(|h| h.place == Place::Edge) {
            through_edges += 1;
        } else {
            assert_eq!(hits.len() % 2, 1, "crossings: {ray:?}");
        }
        assert!(hits.is_sorted_by(|a, b| (a.hit.t, a.hit.prim) <= (b.hit.t, b.hit.prim)));
        let first = oracle.intersect(&ray, &mut RayCounts::default());
        assert_eq!(first, hits.first().map(|h| h.hit));
    }
    // Rays aimed in f64 seldom pass exactly through what they were aimed at.
    assert!(through_edges < 1000, "{through_edges}");
}

#[test]
fn the_conservative_filter_loses_no_triangle_that_the_exact_predicate_accepts() {
    let far_off = |mut mesh: WorldMesh, by: f64| {
        mesh.positions.iter_mut().for_each(|p| *p = *p * 1e-3 + DVec3::splat(by));
        mesh
    };
    let scene = scene(vec![bumpy(19, 11, 3), far_off(bumpy(19, 11, 4), 1.5)]);
    let oracle = Oracle::new(&scene);
    let mut rng = Pcg64::seed_from_u64(5);
    let mut all = rays(&scene, 600, 6);
    // From far away, and through the small mesh.
    for i in 0..600 {
        let mesh = &scene.meshes[i % 2];
        let [a, b, _] = mesh.corners(rng.random_range(0..mesh.triangles.len()));
        let org = inside(&mut rng) * 10f64.powi(i as i32 % 12);
        all.push(Ray::new(org, a + (b - a) * f64::from(i as u32 % 3) * 0.5 - org));
    }
    for ray in all {
        let line = oracle.line(&ray);
        let mut expected = Vec::new();
        for (geom, mesh) in scene.meshes.iter().enumerate() {
            for prim in 0..mesh.triangles.len() {
                let prim_ref = PrimRef { geom_id: geom as u32, prim_id: prim as u32 };
                let met = line.meet(&mesh.corners(prim));
                expected.extend(met.filter(|m| m.t >= 0.0).map(|m| (m.t, prim_ref)));
            }
        }
        expected.sort_by(|a, b| a.partial_cmp(b).unwrap());
        let found: Vec<_> = oracle.all_hits(&ray).iter().map(|h| (h.hit.t, h.hit.prim)).collect();
        assert_eq!(found, expected, "{ray:?}");
    }
}

#[test]
fn near_finds_triangles_within_the_margin() {
    let scene = scene(vec![bumpy(29, 17, 7)]);
    let oracle = Oracle::new(&scene);
    for (ray, margin) in rays(&scene, 60, 8).into_iter().zip([1e-6, 1e-3, 0.05].into_iter().cycle())
    {
        let line = oracle.line(&ray);
        let within = |prim: &u32| line.distance(&scene.meshes[0].corners(*prim as usize)) <= margin;
        let expected: Vec<u32> = (0..scene.triangle_count() as u32).filter(within).collect();
        let found: Vec<u32> = oracle.near(&ray, margin).iter().map(|p| p.prim_id).collect();
        assert_eq!(found, expected);
    }
}

#[test]
fn of_coincident_triangles_the_lowest_wins_and_an_excluded_one_never() {
    let scene = scene(vec![bumpy(11, 7, 9), bumpy(11, 7, 9)]);
    let oracle = Oracle::new(&scene);
    for ray in rays(&scene, 300, 10) {
        let counts = &mut RayCounts::default();
        let first = oracle.intersect(&ray, counts).unwrap();
        assert_eq!(first.prim.geom_id, 0);
        let second = oracle.intersect(&Ray { exclude: first.prim, ..ray }, counts).unwrap();
        assert!(second.prim > first.prim && second.t == first.t, "{ray:?}");
        let end = Ray { tfar: first.t, ..ray };
        assert!(oracle.occluded(&end, counts), "the end belongs to the ray");
        assert!(!oracle.occluded(&Ray { tfar: first.t * (1.0 - 1e-15), ..ray }, counts));
    }
}

#[test]
fn batches_single_rays_and_pools_agree() {
    let mut world_sphere = scene(vec![bumpy(31, 19, 11)]);
    let ball = WorldSphere::new("ball", DVec3::X * 3.0, 1.0, 0);
    world_sphere.spheres = World {
        spheres: vec![ball],
        materials: vec![Material::diffuse("white", crate::math::Rgb::ONE)],
        ..World::default()
    }
    .into_scene(false)
    .unwrap()
    .spheres;
    let oracle = Oracle::new(&world_sphere);
    let mut rays = rays(&world_sphere, 500, 12);
    rays[17].dir = DVec3::ZERO;
    let batch = |rays: &[Ray]| {
        let mut hits = vec![None; rays.len()];
        let mut counts = RayCounts::default();
        oracle.intersect_batch(rays, &mut hits, &mut counts);
        assert_eq!(counts[RayKind::Invalid], 1);
        let mut occluded = vec![false; rays.len()];
        oracle.occluded_batch(rays, &mut occluded, &mut RayCounts::default());
        assert!(hits.iter().zip(&occluded).all(|(hit, occluded)| hit.is_some() == *occluded));
        hits
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let (outside, inside) = (batch(&rays), pool.install(|| batch(&rays)));
    let single = |ray: &Ray| oracle.intersect(ray, &mut RayCounts::default());
    assert_eq!(outside, inside);
    assert_eq!(outside, rays.iter().map(single).collect::<Vec<_>>());
}
