//! Facts about each mesh that the hit rules use, computed once from its triangles.

use crate::math::Vec3;
use crate::sampling::mix;
use crate::scene::{Mesh, NO_VOLUME};
use rayon::prelude::*;

/// Triangles that one task sums up; fixed, so that the sums do not depend on the threads.
const TASK: usize = 1 << 16;

/// Facts of one mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MeshFacts {
    /// Longest edge of its triangles, scene space, or a little more.
    pub longest_edge: f64,
    /// 1 where counter-clockwise sides face outwards, -1 for a closed mesh wound inwards. An open
    /// mesh counts as wound outwards.
    pub sense: f64,
    /// Whether it has an inside: every edge of a triangle has a partner that runs the other way, and the triangles enclose
    /// something.
    pub closed: bool,
    /// Whether it would be closed but for its cut-outs, through which rays come out of it and see its backs.
    pub perforated: bool,
}

/// Sums over triangles.
#[derive(Clone, Copy, Default)]
struct Sums {
    longest2: f64,
    border: u64,
    volume: f64,
    /// The largest volume that these triangles could enclose.
    most: f64,
}

/// A fingerprint of the edges of a triangle. An edge counts with the opposite sign if it runs the other way, so the
/// fingerprints of a closed mesh add up to 0, and those of any other do so with a chance of about 2^-60. Vertices that are
/// the same after adding and subtracting `coarse` are one: a seam's vertices may differ in the last bits, and few of these
/// lie on either side of a rounding step.
fn border(corners: [Vec3; 3], coarse: Vec3) -> u64 {
    let [a, b, c] = corners.map(|p| {
        let [x, y, z] = (p + coarse - coarse).to_array().map(|x| u64::from(x.to_bits()));
        let first = mix(x << 32 | y).wrapping_add(z);
        [mix(first), mix(!first)]
    });
    let edge = |[a0, a1]: [u64; 2], [b0, b1]: [u64; 2]| {
        a0.wrapping_mul(b1).wrapping_sub(a1.wrapping_mul(b0))
    };
    edge(a, b).wrapping_add(edge(b, c)).wrapping_add(edge(c, a))
}

impl MeshFacts {
    /// The facts of `mesh`, whatever is cut out of it.
    pub fn of(mesh: &Mesh) -> Self {
        let middle = mesh.bounds.centre();
        let coarse = Vec3::splat(3.0 * mesh.bounds.largest_coordinate() as f32);
        let parts = mesh.triangles.par_chunks(TASK).map(|triangles| {
            triangles.iter().fold(Sums::default(), |sums, triangle| {
                let corners = triangle.map(|i| mesh.positions[i as usize]);
                let [a, b, c] = corners.map(|p| p.as_dvec3() - middle);
                let normal = (b - a).cross(c - a);
                let edges = [b - a, c - b, a - c].map(|edge| edge.length_squared());
                Sums {
                    longest2: edges.into_iter().fold(sums.longest2, f64::max),
                    border: sums.border.wrapping_add(border(corners, coarse)),
                    volume: sums.volume + a.dot(normal),
                    most: sums.most + a.length() * normal.length(),
                }
            })
        });
        let sums = parts.collect::<Vec<_>>().into_iter().fold(Sums::default(), |a, b| Sums {
            longest2: a.longest2.max(b.longest2),
            border: a.border.wrapping_add(b.border),
            volume: a.volume + b.volume,
            most: a.most + b.most,
        });
        let closed = sums.border == 0 && sums.volume.abs() > NO_VOLUME * sums.most;
        let inwards = closed && sums.volume < 0.0;
        Self {
            longest_edge: sums.longest2.sqrt() * (1.0 + f64::from(f32::EPSILON)),
            sense: if inwards { -1.0 } else { 1.0 },
            closed,
            perforated: false,
        }
    }

    /// The same facts of a mesh with cut-outs: it is as good as open.
    pub fn with_holes(self) -> Self {
        Self { closed: false, perforated: self.closed, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DVec3, Rgb};
    use crate::scene::{Material, World, WorldMesh};

    fn facts_of_mesh(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> MeshFacts {
        let mut world = World::default();
        world.materials.push(Material::diffuse("white", Rgb::ONE));
        world.meshes.push(WorldMesh::new("mesh", positions, triangles, 0));
        MeshFacts::of(&world.into_scene(false).expect("a scene").meshes[0])
    }

    /// The facts of some faces of a tetrahedron.
    fn facts_of(triangles: Vec<[u32; 3]>) -> MeshFacts {
        facts_of_mesh(vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z], triangles)
    }

    #[test]
    fn the_sign_follows_the_winding() {
        let outwards = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let inwards: Vec<[u32; 3]> = outwards.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
        assert_eq!(facts_of(outwards.clone()).sense, 1.0);
        assert_eq!(facts_of(inwards.clone()).sense, -1.0);
        // Open: nobody can tell.
        assert_eq!(facts_of(inwards[..3].to_vec()).sense, 1.0);
        assert!(facts_of(outwards.clone()).closed && !facts_of(inwards[..3].to_vec()).closed);
        let edge = facts_of(outwards).longest_edge;
        assert!(edge >= 2f64.sqrt() && edge < 1.000_001 * 2f64.sqrt());
    }

    /// The facts of a mesh of loose triangles.
    fn facts_of_corners(corners: &[[DVec3; 3]]) -> MeshFacts {
        let triangles = (0..corners.len() as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
        facts_of_mesh(corners.as_flattened().to_vec(), triangles)
    }

    /// A strip around the y axis of so many quads, from the last one to `end`, which is the first again or differs a little.
    fn tube(end: f64) -> Vec<[DVec3; 3]> {
        let at = |k: u32, y: f64| {
            let angle = std::f64::consts::TAU * f64::from(k) / 8.0;
            DVec3::new(libm::cos(angle), y, if k == 8 { end } else { libm::sin(angle) })
        };
        let quad = |k: u32| {
            let [a, b, c, d] = [at(k, 0.0), at(k, 1.0), at(k + 1, 0.0), at(k + 1, 1.0)];
            let caps = [[a, c, DVec3::ZERO], [d, b, DVec3::Y]];
            [[a, b, d], [a, d, c], caps[0], caps[1]]
        };
        (0..8).flat_map(quad).collect()
    }

    #[test]
    fn a_mesh_is_closed_by_its_edges() {
        let sheet = |angle: f64| {
            let across = DVec3::new(libm::cos(angle), 0.0, libm::sin(angle));
            [[DVec3::ZERO, DVec3::Y, across], [DVec3::Y, across + DVec3::Y, across]]
        };
        let third = std::f64::consts::TAU / 3.0;
        let fins: Vec<[DVec3; 3]> = (0..3).flat_map(|k| sheet(f64::from(k) * third)).collect();
        assert!(!facts_of_corners(&fins).closed, "area vectors cancel");
        let walls: Vec<[DVec3; 3]> = tube(0.0).chunks(4).flat_map(|q| [q[0], q[1]]).collect();
        assert!(!facts_of_corners(&walls).closed, "area vectors of a tube cancel");
        let twice: Vec<[DVec3; 3]> = fins.iter().flat_map(|t| [*t, [t[1], t[0], t[2]]]).collect();
        assert!(!facts_of_corners(&twice).closed, "nothing is inside");
        for end in [0.0, -0.0, -2.4e-16] {
            assert!(facts_of_corners(&tube(end)).closed, "{end:e}");
        }
    }
}
