//! What further tries find.

use super::*;
use crate::scene::{Material, World, WorldMesh};

/// Edges of the sheet along one side.
const EDGES: u32 = 40;

/// An uneven sheet over a floor.
fn sheet_and_floor() -> Scene {
    let height = |i: u32| 0.1 * f64::from(i * i % 37).sin();
    let place = |i: u32| {
        let [x, z] = [i % (EDGES + 1), i / (EDGES + 1)].map(|k| f64::from(k) / 20.3 - 1.0);
        DVec3::new(x, height(i), z)
    };
    let squares = (0..EDGES * EDGES).flat_map(|k| {
        let a = k / EDGES * (EDGES + 1) + k % EDGES;
        let [b, c, d] = [a + 1, a + EDGES + 1, a + EDGES + 2];
        [[a, c, b], [b, c, d]]
    });
    let positions = (0..(EDGES + 1) * (EDGES + 1)).map(place).collect();
    let mut world = World::default();
    world.materials.push(Material::diffuse("white", crate::math::Rgb::ONE));
    world.meshes.push(WorldMesh::new("sheet", positions, squares.collect(), 0));
    let [x, z] = [DVec3::X, DVec3::Z].map(|axis| axis * 9.0);
    let corners = [-x - z, x - z, z].map(|p| p - DVec3::Y);
    world.meshes.push(WorldMesh::new("floor", corners.to_vec(), vec![[0, 2, 1]], 0));
    world.into_scene(true).expect("a scene")
}

#[test]
fn what_lies_behind_a_phantom_is_in_doubt() {
    let scene = sheet_and_floor();
    let embree = EmbreeIntersector::new(&scene, HitRules::default(), None, 1).expect("Embree");
    let sheet = &scene.meshes[0];
    let inner = |i: &u32| (1..EDGES).contains(&(i % (EDGES + 1)));
    let inner = (EDGES + 1..EDGES * (EDGES + 1)).filter(inner);
    let (mut lost, mut found_again) = (0, 0);
    for (vertex, k) in inner.flat_map(|vertex| (0..20).map(move |k| (vertex, k))) {
        let turn = f64::from(k);
        let eye = DVec3::new(0.3 * turn.sin(), 0.5, 0.3 * (1.3 * turn).cos());
        let ray = Ray::new(eye, sheet.positions[vertex as usize].as_dvec3() - eye);
        let found = embree.query(&ray, Turn::None, &[]);
        if found.is_some_and(|found| found.hit.prim.geom_id == 1) {
            lost += 1;
            // A triangle that has nothing to do with it, as if Embree had met it in place of one at the vertex.
            let far = if vertex < EDGES * EDGES / 2 { 2 * EDGES * EDGES - 1 } else { 0 };
            let phantom = PrimRef { geom_id: 0, prim_id: far };
            let hit = embree.settle(&ray, Some(phantom), &mut RayCounts::default());
            found_again += usize::from(hit.is_some_and(|hit| (hit.t - 1.0).abs() < 1e-5));
        }
    }
    assert!(lost > 20, "the case is not hard: {lost} rays are lost at vertices");
    assert!(found_again * 10 >= lost * 9, "of {lost} lost rays {found_again} are found again");
}
