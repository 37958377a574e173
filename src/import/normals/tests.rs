use super::*;
use crate::import::uv_sphere;
use crate::scene::Corners;

fn smooth(mesh: &mut WorldMesh, crease_degrees: f64) -> Corners<Vec3> {
    apply(mesh, NormalPolicy::Smooth { crease_degrees });
    mesh.normals.clone().expect("smooth normals")
}

fn mesh(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> WorldMesh {
    WorldMesh::new("test", positions, triangles, 0)
}

/// A cube of eight vertices; face normals are the axes.
fn cube() -> WorldMesh {
    let positions = (0..8u32)
        .map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2 & 1)))
        .collect();
    let quads =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
    mesh(positions, triangles)
}

fn plane(mesh: &WorldMesh, prim: usize) -> Vec3 {
    let [a, b, c] = mesh.triangles[prim].map(|i| mesh.positions[i as usize]);
    unit_or_zero((b - a).cross(c - a))
}

/// Every vertex listed once per triangle, as STL converters write.
fn exploded(mesh: &WorldMesh) -> WorldMesh {
    let positions = mesh.triangles.iter().flatten().map(|i| mesh.positions[*i as usize]).collect();
    let triangles = (0..mesh.triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    self::mesh(positions, triangles.collect())
}

#[test]
fn a_cube_keeps_its_edges_below_90_degrees_and_is_round_above() {
    for mut cube in [cube(), exploded(&cube())] {
        let sharp = smooth(&mut cube, 30.0);
        for (prim, triangle) in cube.triangles.iter().enumerate() {
            assert_eq!(sharp.get(prim, *triangle), [plane(&cube, prim); 3]);
        }
        let round = smooth(&mut cube, 90.0);
        assert!(round.corners.is_none());
        for (prim, triangle) in cube.triangles.iter().enumerate() {
            for (n, i) in round.get(prim, *triangle).iter().zip(triangle) {
                // Angle weights make the three faces count alike, however they are cut.
                let radial = (cube.positions[*i as usize] - 0.5).normalize().as_vec3();
                assert!((*n - radial).length() < 1e-6, "{n} instead of {radial}");
            }
        }
    }
}

#[test]
fn a_sphere_has_radial_normals_also_when_its_vertices_are_split() {
    let sphere = uv_sphere("s", DVec3::ZERO, 1.0, 64, 33, 0).expect("a sphere");
    for mut sphere in [exploded(&sphere), sphere] {
        let normals = smooth(&mut sphere, 30.0);
        assert!(normals.corners.is_none());
        for (n, p) in normals.values.iter().zip(&sphere.positions) {
            assert!(n.as_dvec3().angle_between(*p) < 4e-3, "{n} at {p}");
        }
    }
}

#[test]
fn neighbours_of_opposite_winding_meet_in_a_crease() {
    let corner = |x: f64, y: f64| DVec3::new(x, y, 0.1 * x * x);
    let strip: Vec<DVec3> =
        (0..3).flat_map(|i| [corner(i.into(), 0.0), corner(i.into(), 1.0)]).collect();
    let quads = [[0, 2, 3], [0, 3, 1], [2, 4, 5], [2, 5, 3]];
    let normals = smooth(&mut mesh(strip.clone(), quads.to_vec()), 60.0);
    assert!(normals.corners.is_none() && normals.values.iter().all(|n| n.z > 0.9));
    let reversed = [quads[0], quads[1], [2, 5, 4], [2, 3, 5]];
    let normals = smooth(&mut mesh(strip, reversed.to_vec()), 60.0);
    for (prim, triangle) in reversed.iter().enumerate() {
        let sign = if prim < 2 { 1.0 } else { -1.0 };
        assert!(normals.get(prim, *triangle).iter().all(|n| n.z * sign > 0.9));
    }
}

#[test]
fn both_sides_of_a_doubled_sheet_are_smooth_on_their_own() {
    let mut sphere = uv_sphere("s", DVec3::ZERO, 1.0, 40, 21, 0).expect("a sphere");
    let outside = sphere.triangles.clone();
    sphere.triangles.extend(outside.iter().map(|[a, b, c]| [*a, *c, *b]));
    let normals = smooth(&mut sphere, 30.0);
    for (prim, triangle) in sphere.triangles.iter().enumerate() {
        let sign = if prim < outside.len() { 1.0 } else { -1.0 };
        for (n, i) in normals.get(prim, *triangle).iter().zip(triangle) {
            let p = sign * sphere.positions[*i as usize];
            assert!(n.as_dvec3().angle_between(p) < 1e-2);
        }
    }
}

#[test]
fn a_vertex_of_a_million_triangles_takes_less_than_quadratic_time() {
    let n = 1_000_000u32;
    let rim = |i: u32| {
        let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / f64::from(n)).sin_cos();
        DVec3::new(cos, 0.0, sin)
    };
    let positions = std::iter::once(DVec3::Y).chain((0..n).map(rim)).collect();
    let triangles = (0..n).map(|i| [0, 1 + (i + 1) % n, 1 + i]).collect();
    let normals = smooth(&mut mesh(positions, triangles), 30.0);
    assert!(normals.corners.is_none() && (normals.values[0] - Vec3::Y).length() < 1e-6);
}

#[test]
fn unused_vertices_get_no_normal_and_extreme_sizes_change_none() {
    for scale in [1e-170, 1e-30, 1.0, 1e30, 1e170] {
        let mut cube = cube();
        cube.positions.iter_mut().for_each(|p| *p *= scale);
        cube.positions.push(DVec3::splat(2.0 * scale));
        let normals = smooth(&mut cube, 90.0);
        assert_eq!(normals.values[8], Vec3::ZERO);
        let corner = Vec3::splat(-1.0).normalize();
        assert!((normals.values[0] - corner).length() < 1e-6, "{} at {scale:e}", normals.values[0]);
    }
}

#[test]
fn policies_keep_compute_or_drop_normals() {
    let mut sphere = uv_sphere("s", DVec3::ZERO, 1.0, 8, 5, 0).expect("a sphere");
    let own = sphere.normals.clone();
    apply(&mut sphere, NormalPolicy::Auto { crease_degrees: 30.0 });
    assert_eq!(sphere.normals, own);
    apply(&mut sphere, NormalPolicy::Flat);
    assert_eq!(sphere.normals, None);
    apply(&mut sphere, NormalPolicy::Auto { crease_degrees: 180.0 });
    assert!(sphere.normals.is_some());
}

#[test]
fn only_directions_have_unit_vectors() {
    assert_eq!(unit_or_zero(DVec3::new(0.0, -3e-200, 0.0)), Vec3::NEG_Y);
    assert_eq!(unit_or_zero(DVec3::new(2e300, 0.0, 0.0)), Vec3::X);
    for bad in [DVec3::ZERO, DVec3::new(f64::NAN, 1.0, 0.0), DVec3::INFINITY] {
        assert_eq!(unit_or_zero(bad), Vec3::ZERO);
    }
}
