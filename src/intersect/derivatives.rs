//! Texture coordinates of every set, and how they and normals change along a surface.

use super::SurfaceInteraction;
use super::interaction::uv_at;
use crate::math::{DVec3, Vec2};
use crate::scene::{Mesh, Scene};
use std::f64::consts::{PI, TAU};

/// Texture coordinates of set number `set` at `si`, which holds those of set 0 itself; zero where the mesh lacks the set. An
/// exact sphere has the same in every set.
#[inline]
pub fn uv_of_set(scene: &Scene, si: &SurfaceInteraction, set: u8) -> Vec2 {
    if set == 0 { si.uv } else { further_uv(scene, si, set) }
}

/// By the point's place in its triangle: a hit's own weights would take room at every point of every scene.
#[inline(never)]
fn further_uv(scene: &Scene, si: &SurfaceInteraction, set: u8) -> Vec2 {
    let Some(mesh) = scene.meshes.get(si.prim.geom_id as usize) else { return si.uv };
    let Some(uvs) = mesh.uv_set(set) else { return Vec2::ZERO };
    let prim = si.prim.prim_id as usize;
    let weights = corner_weights(mesh.corners(prim), si.p);
    uv_at(uvs.get(prim, mesh.triangles[prim]), weights)
}

/// Gradients of the texture coordinates u and v of set number `set` along the surface at `si`, per unit of length of scene
/// space. Zero where there are no such coordinates; not finite on triangles without area and at a sphere's poles.
pub fn uv_gradients(scene: &Scene, si: &SurfaceInteraction, set: u8) -> [DVec3; 2] {
    match scene.meshes.get(si.prim.geom_id as usize) {
        Some(mesh) => on_triangle(mesh, si.prim.prim_id as usize, set),
        None => on_sphere(scene.spheres[si.prim.prim_id as usize].radius, si.ng),
    }
}

/// Curvature at `si` of the surface that the shading normals stand for, the mean of all directions, per unit of length of
/// scene space: positive where it bulges to the outside, 0 where it is flat.
pub fn curvature(scene: &Scene, si: &SurfaceInteraction) -> f64 {
    let Some(mesh) = scene.meshes.get(si.prim.geom_id as usize) else {
        return 1.0 / scene.spheres[si.prim.prim_id as usize].radius;
    };
    let Some(normals) = &mesh.normals else { return 0.0 };
    let prim = si.prim.prim_id as usize;
    let [a, b, c] = mesh.corners(prim);
    let n = normals.get(prim, mesh.triangles[prim]).map(|n| n.as_dvec3());
    // Half of the divergence of the normals.
    let [along1, along2] = dual(b - a, c - a);
    let mean = 0.5 * (along1.dot(n[1] - n[0]) + along2.dot(n[2] - n[0]));
    // Files differ in the side that normals point to.
    let outward = (n[0] + n[1] + n[2]).dot(si.ng);
    if !mean.is_finite() || outward == 0.0 { 0.0 } else { mean * outward.signum() }
}

/// The weights of a triangle's corners at the point `p` of it, scene space: each at least 0, and 1 together.
pub fn corner_weights(corners: [DVec3; 3], p: DVec3) -> [f64; 3] {
    let [a, b, c] = corners.map(|corner| corner - p);
    let n = (b - a).cross(c - a);
    // Of a point beside the edge, as rounding may put it, the nearer weights.
    let parts = [b.cross(c), c.cross(a), a.cross(b)].map(|part| part.dot(n).max(0.0));
    let whole: f64 = parts.iter().sum();
    if whole > 0.0 && whole.is_finite() { parts.map(|part| part / whole) } else { [1.0 / 3.0; 3] }
}

fn on_triangle(mesh: &Mesh, prim: usize, set: u8) -> [DVec3; 2] {
    let Some(uvs) = mesh.uv_set(set) else { return [DVec3::ZERO; 2] };
    let [ta, tb, tc] = uvs.get(prim, mesh.triangles[prim]).map(|t| t.as_dvec2());
    let [a, b, c] = mesh.corners(prim);
    let [along1, along2] = dual(b - a, c - a);
    let (d1, d2) = (tb - ta, tc - ta);
    [along1 * d1.x + along2 * d2.x, along1 * d1.y + along2 * d2.y]
}

/// The vectors in the plane of two edges whose products with them are 1 and 0, and 0 and 1.
fn dual(e1: DVec3, e2: DVec3) -> [DVec3; 2] {
    let n = e1.cross(e2);
    let area = n.length_squared();
    [e2.cross(n) / area, n.cross(e1) / area]
}

/// Of longitude and latitude, as [`SurfaceInteraction::uv`] has them, at the unit normal `n`.
fn on_sphere(radius: f64, n: DVec3) -> [DVec3; 2] {
    let across = (n.x * n.x + n.z * n.z).sqrt();
    let u = DVec3::new(n.z, 0.0, -n.x) / (TAU * radius * across * across);
    let v = (DVec3::Y - n * n.y) / (PI * radius * across);
    [u, v]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intersect::{Intersector, Oracle, Ray};
    use crate::math::{Rgb, Vec3};
    use crate::scene::{Corners, Material, Texture, TextureMap, World, WorldMesh, WorldSphere};
    use crate::stats::RayCounts;

    /// The surface that a ray from `org` along `dir` meets.
    fn meet(scene: &Scene, org: DVec3, dir: DVec3) -> SurfaceInteraction {
        let oracle = Oracle::new(scene);
        let ray = Ray::new(org, dir);
        let hit = oracle.intersect(&ray, &mut RayCounts::default()).expect("a hit");
        SurfaceInteraction::new(scene, &ray, &hit)
    }

    /// Gradients against differences of coordinates of two hits close together.
    fn check(scene: &Scene, (org, target): (DVec3, DVec3), set: u8) {
        let si = meet(scene, org, target - org);
        let gradients = uv_gradients(scene, &si, set);
        for step in [DVec3::X, DVec3::Y, DVec3::Z] {
            let step = (step - si.ng * step.dot(si.ng)) * 1e-3;
            let near = meet(scene, org, si.p + step - org);
            let moved = near.p - si.p;
            let expected = (uv_of_set(scene, &near, set) - uv_of_set(scene, &si, set)).as_dvec2();
            let found = [gradients[0].dot(moved), gradients[1].dot(moved)];
            let error = (found[0] - expected.x).hypot(found[1] - expected.y);
            assert!(error < 2e-3 * expected.length() + 1e-6, "{found:?} {expected:?}");
        }
    }

    #[test]
    fn gradients_tell_how_coordinates_change() {
        let mut world = World::default();
        let one = Texture::from_linear("t", [1, 1], vec![Rgb::ONE]);
        world.textures.push(one);
        let id = world.add_material(Material {
            texture: Some(TextureMap::of(0)),
            roughness_map: Some(TextureMap { uv_set: 2, ..TextureMap::of(0) }),
            ..Material::black("m")
        });
        world.spheres.push(WorldSphere::new("s", DVec3::new(5.0, 0.0, 0.0), 1.5, id));
        let p = vec![DVec3::ZERO, DVec3::new(2.0, 0.1, 0.3), DVec3::new(0.4, 1.8, -0.2)];
        let set = |values: [[f32; 2]; 3]| {
            Some(Corners { values: values.map(Vec2::from_array).to_vec(), corners: None })
        };
        let uvs = set([[0.1, 0.7], [1.3, 0.2], [-0.4, 2.0]]);
        let more_uvs = vec![None, set([[0.9, -0.2], [0.3, 0.8], [3.0, 0.1]])];
        let mesh = WorldMesh::new("t", p, vec![[0, 1, 2]], id);
        world.meshes.push(WorldMesh { uvs, more_uvs, ..mesh });
        let scene = world.into_scene(false).expect("a scene");
        for set in [0, 2] {
            check(&scene, (DVec3::new(0.5, 0.4, 4.0), DVec3::new(0.6, 0.5, 0.0)), set);
            check(&scene, (DVec3::new(4.0, 3.0, 6.0), DVec3::new(4.6, 0.4, 1.0)), set);
        }
        // A set that the mesh lacks.
        let si = meet(&scene, DVec3::new(0.5, 0.4, 4.0), DVec3::new(0.1, 0.1, -4.0));
        for set in [1, 3] {
            assert_eq!(uv_of_set(&scene, &si, set), Vec2::ZERO);
            assert_eq!(uv_gradients(&scene, &si, set), [DVec3::ZERO; 2]);
        }
    }

    #[test]
    fn weights_lead_back_to_the_point() {
        let corners = [DVec3::ZERO, DVec3::new(2.0, 0.1, 0.3), DVec3::new(0.4, 1.8, -0.2)];
        let point = |w: [f64; 3]| corners[0] * w[0] + corners[1] * w[1] + corners[2] * w[2];
        for w in [[0.2, 0.3, 0.5], [1.0, 0.0, 0.0], [0.0, 0.5, 0.5], [0.98, 0.01, 0.01]] {
            let found = corner_weights(corners, point(w));
            assert!(found.iter().zip(w).all(|(found, w)| (found - w).abs() < 1e-14), "{found:?}");
        }
        // A little outside, as an edge's rounding puts it, and a triangle without area.
        let outside = corner_weights(corners, point([-1e-9, 0.4, 0.6 + 1e-9]));
        assert!(outside[0] == 0.0 && (outside.iter().sum::<f64>() - 1.0).abs() < 1e-15);
        assert_eq!(corner_weights([DVec3::X; 3], DVec3::X), [1.0 / 3.0; 3]);
    }

    #[test]
    fn a_cylinder_is_half_as_curved_as_a_ball() {
        let mut world = World::default();
        let id = world.add_material(Material::diffuse("m", Rgb::ONE));
        // Long triangles along the axis y of a cylinder of radius 2.
        let on = |angle: f64| DVec3::new(libm::sin(angle), 0.0, libm::cos(angle));
        let p = [(-0.02, -5.0), (0.02, -5.0), (0.0, 5.0)];
        let positions = p.map(|(angle, y)| on(angle) * 2.0 + DVec3::Y * y).to_vec();
        let values = p.map(|(angle, _)| on(angle).as_vec3()).to_vec();
        let mesh = WorldMesh::new("cylinder", positions, vec![[0, 1, 2]], id);
        world.meshes = vec![WorldMesh { normals: Some(Corners { values, corners: None }), ..mesh }];
        let scene = world.into_scene(false).expect("a scene");
        let si = meet(&scene, DVec3::Z * 9.0, -DVec3::Z);
        assert!((curvature(&scene, &si) - 0.25).abs() < 1e-3, "{}", curvature(&scene, &si));
    }

    #[test]
    fn a_mesh_of_a_ball_is_curved_as_the_ball_is() {
        let mut world = World::default();
        let id = world.add_material(Material::diffuse("m", Rgb::ONE));
        let p = vec![
            DVec3::new(0.1, 0.0, 1.0).normalize() * 2.0,
            DVec3::new(-0.05, 0.1, 1.0).normalize() * 2.0,
            DVec3::new(-0.05, -0.1, 1.0).normalize() * 2.0,
        ];
        for sign in [1.0f32, -1.0] {
            let values = p.iter().map(|p| p.normalize().as_vec3() * sign).collect::<Vec<Vec3>>();
            let mesh = WorldMesh::new("ball", p.clone(), vec![[0, 1, 2]], id);
            world.meshes =
                vec![WorldMesh { normals: Some(Corners { values, corners: None }), ..mesh }];
            let scene = world.clone().into_scene(false).expect("a scene");
            let si = meet(&scene, DVec3::Z * 9.0, -DVec3::Z);
            assert!((curvature(&scene, &si) - 0.5).abs() < 1e-3);
        }
    }
}
