//! Facts about each mesh that the hit rules use, computed once from its triangles.

use crate::math::DVec3;
use crate::scene::Mesh;
use rayon::prelude::*;

/// Triangles that one task sums up; fixed, so that the sums do not depend on the threads.
const TASK: usize = 1 << 16;
/// A mesh whose area vectors cancel to this share of its area counts as closed.
const CLOSED: f64 = 1e-9;

/// Facts of one mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MeshFacts {
    /// Longest edge of its triangles, scene space, or a little more.
    pub longest_edge: f64,
    /// 1 where counter-clockwise sides face outwards, -1 for a closed mesh wound inwards. An open
    /// mesh counts as wound outwards.
    pub sense: f64,
    /// Whether it has an inside, as far as its area vectors tell.
    pub closed: bool,
    /// Whether it would be closed but for its cut-outs, through which rays come out of it and see its backs.
    pub perforated: bool,
}

/// Sums over triangles.
#[derive(Clone, Copy, Default)]
struct Sums {
    longest2: f64,
    area: f64,
    area_vector: DVec3,
    volume: f64,
}

impl MeshFacts {
    /// The facts of `mesh`, whatever is cut out of it.
    pub fn of(mesh: &Mesh) -> Self {
        let middle = mesh.bounds.centre();
        let parts = mesh.triangles.par_chunks(TASK).map(|triangles| {
            triangles.iter().fold(Sums::default(), |sums, triangle| {
                let [a, b, c] = triangle.map(|i| mesh.positions[i as usize].as_dvec3() - middle);
                let normal = (b - a).cross(c - a);
                let edges = [b - a, c - b, a - c].map(|edge| edge.length_squared());
                Sums {
                    longest2: edges.into_iter().fold(sums.longest2, f64::max),
                    area: sums.area + normal.length(),
                    area_vector: sums.area_vector + normal,
                    volume: sums.volume + a.dot(normal),
                }
            })
        });
        let sums = parts.collect::<Vec<_>>().into_iter().fold(Sums::default(), |a, b| Sums {
            longest2: a.longest2.max(b.longest2),
            area: a.area + b.area,
            area_vector: a.area_vector + b.area_vector,
            volume: a.volume + b.volume,
        });
        // The area vectors of a closed surface cancel.
        let closed = sums.area_vector.length() <= CLOSED * sums.area;
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
    use crate::math::Rgb;
    use crate::scene::{Material, World, WorldMesh};

    fn facts_of(triangles: Vec<[u32; 3]>) -> MeshFacts {
        let positions = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let mut world = World::default();
        world.materials.push(Material::diffuse("white", Rgb::ONE));
        world.meshes.push(WorldMesh::new("tetrahedron", positions, triangles, 0));
        MeshFacts::of(&world.into_scene(false).expect("a scene").meshes[0])
    }

    #[test]
    fn the_sign_follows_the_winding() {
        let outwards = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let inwards: Vec<[u32; 3]> = outwards.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
        assert_eq!(facts_of(outwards.clone()).sense, 1.0);
        assert_eq!(facts_of(inwards.clone()).sense, -1.0);
        // Open: nobody can tell.
        assert_eq!(facts_of(inwards[..3].to_vec()).sense, 1.0);
        let edge = facts_of(outwards).longest_edge;
        assert!(edge >= 2f64.sqrt() && edge < 1.000_001 * 2f64.sqrt());
    }
}
