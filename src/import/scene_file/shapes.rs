//! Small meshes that the scene file gives in full: quads and boxes.

use crate::math::DVec3;
use crate::scene::{MaterialId, WorldMesh};

/// Two triangles; `corners` run counter-clockwise seen from the front.
/// Corners of a box's faces -x, +x, -y, +y, -z, +z, counter-clockwise seen from outside: bit 0 of a
/// number says which end of x, bit 1 of y, bit 2 of z.
pub(super) const FACES: [[u32; 4]; 6] =
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

/// Twelve triangles that face outwards.
pub(super) fn cuboid(name: String, (min, max): (DVec3, DVec3), material: MaterialId) -> WorldMesh {
    // Bit 0 of a vertex's index says x, bit 1 y, bit 2 z.
    let pick =
        |index: usize, axis: usize| if index >> axis & 1 == 0 { min[axis] } else { max[axis] };
    let positions = (0..8).map(|i| DVec3::new(pick(i, 0), pick(i, 1), pick(i, 2))).collect();
    let triangles = FACES.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    WorldMesh::new(name, positions, triangles, material)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_faces_outwards_and_encloses_its_volume() {
        let (min, max) = (DVec3::new(-1.0, 2.0, 3.0), DVec3::new(1.0, 5.0, 7.0));
        let mesh = cuboid("box".into(), (min, max), 0);
        let middle = 0.5 * (min + max);
        let mut volume = 0.0;
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            let normal = (b - a).cross(c - a);
            assert!(normal.dot(a - middle) > 0.0);
            assert_eq!(normal.to_array().iter().filter(|x| **x != 0.0).count(), 1);
            volume += normal.dot(a - middle) / 6.0;
        }
        assert!((volume - 24.0).abs() < 1e-12);
    }
}
