//! Emitting faces as area lights: flat convex quads that cover them exactly.

use super::polygon;
use crate::math::{Bounds3, DVec3, Rgb};
use crate::scene::{Light, QuadLight, WorldMesh};

/// Most lights made of a mesh: each has bounds in the cells of lights, and a surface of its own. A mesh that needs more
/// stays as it is, and the scene makes lights of groups of its faces.
pub(super) const MAX_LIGHTS: usize = 4096;
/// Narrower faces, in widths of their mesh, are left out: together they send next to nothing, and f32 may not hold them beside
/// the rest of the scene.
const LEAST_WIDTH: f64 = 1e-4;

/// Flat convex quads that cover the faces of a mesh, counter-clockwise as these are; `None` if there would be more than
/// [`MAX_LIGHTS`]. Neighbouring triangles that follow one another become one quad where possible; any other
/// triangle is a quad of which two corners are the same. Triangles without area, and faces narrower than
/// [`LEAST_WIDTH`], are left out.
pub(super) fn cover(mesh: &WorldMesh) -> Option<Vec<[DVec3; 4]>> {
    if mesh.triangles.len() > 2 * MAX_LIGHTS {
        return None;
    }
    let corners = |t: &[u32; 3]| t.map(|i| mesh.positions[i as usize]);
    let wide = |quad: &[DVec3; 4]| bounds(quad).extent().max_element();
    let least = LEAST_WIDTH * bounds(&mesh.positions).extent().max_element();
    let mut quads = Vec::new();
    let mut rest = &mesh.triangles[..];
    while let [first, after @ ..] = rest {
        if let Some(quad) =
            after.first().and_then(|second| QuadLight::joined(corners(first), corners(second)))
        {
            quads.push(quad);
            rest = &after[1..];
        } else {
            quads.extend(of_triangle(corners(first)));
            rest = after;
        }
    }
    quads.retain(|quad| wide(quad) >= least);
    (quads.len() <= MAX_LIGHTS).then_some(quads)
}

fn bounds(points: &[DVec3]) -> Bounds3 {
    points.iter().fold(Bounds3::EMPTY, |mut bounds, p| {
        bounds.include(*p);
        bounds
    })
}

/// Lights that replace a mesh whose faces emit `radiance` on both sides; `None` as [`cover`].
pub(super) fn of_mesh(mesh: &WorldMesh, radiance: Rgb) -> Option<Vec<Light>> {
    Some(cover(mesh)?.into_iter().map(|quad| light(quad, radiance)).collect())
}

/// Lights that replace a face of three or more corners; none if it has no area.
///
/// Errors: as [`polygon::triangulate`].
pub(super) fn of_face(corners: &[DVec3], radiance: Rgb) -> Result<Vec<Light>, String> {
    if let [a, b, c, d] = *corners {
        if QuadLight::is_flat_and_convex(&[a, b, c, d]) {
            return Ok(vec![light([a, b, c, d], radiance)]);
        }
    }
    let mut triangles = Vec::new();
    polygon::triangulate(corners, &mut triangles)?;
    let corners = triangles.iter().map(|t| t.map(|i| corners[i as usize]));
    Ok(corners.filter_map(of_triangle).map(|quad| light(quad, radiance)).collect())
}

fn light(corners: [DVec3; 4], radiance: Rgb) -> Light {
    Light::Quad(QuadLight { corners, radiance, two_sided: true })
}

/// A triangle as a quad, of which two corners are the same. `None` if it has no area.
fn of_triangle([a, b, c]: [DVec3; 3]) -> Option<[DVec3; 4]> {
    ((b - a).cross(c - a) != DVec3::ZERO).then_some([a, b, c, c])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn areas(lights: &[Light]) -> DVec3 {
        let area = |light: &Light| match light {
            Light::Quad(quad) => {
                let [.., c, d] = quad.corners;
                assert!(c == d || QuadLight::is_flat_and_convex(&quad.corners));
                0.5 * quad.area_vector()
            }
            other => panic!("{other:?}"),
        };
        lights.iter().map(area).sum()
    }

    const SQUARE: [DVec3; 4] =
        [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::new(0.0, 1.0, 0.0)];

    #[test]
    fn lights_cover_their_face_exactly() {
        let arrow =
            [DVec3::ZERO, DVec3::new(2.0, -1.0, 0.0), DVec3::X * 0.5, DVec3::new(2.0, 1.0, 0.0)];
        let folded = [SQUARE[0], SQUARE[1], SQUARE[2] + DVec3::Z, SQUARE[3]];
        for (face, count, area) in [
            (&SQUARE[..], 1, DVec3::Z),
            (&SQUARE[..3], 1, 0.5 * DVec3::Z),
            (&arrow[..], 2, 0.5 * DVec3::Z),
            (&folded[..], 2, DVec3::new(-0.5, -0.5, 1.0)),
            (&[DVec3::X; 4][..], 0, DVec3::ZERO),
        ] {
            let lights = of_face(face, Rgb::ONE).expect("a small face");
            assert_eq!(lights.len(), count, "{face:?}");
            assert!((areas(&lights) - area).length() < 1e-12, "{face:?}");
        }
    }

    #[test]
    fn split_quads_are_joined_and_large_meshes_refused() {
        let mesh = |triangles: Vec<[u32; 3]>| WorldMesh::new("lamp", SQUARE.to_vec(), triangles, 0);
        for [p, q] in [[[0, 1, 2], [0, 2, 3]], [[1, 2, 0], [3, 0, 2]], [[2, 0, 1], [2, 3, 0]]] {
            let lights = of_mesh(&mesh(vec![p, q]), Rgb::ONE).expect("few");
            assert_eq!((lights.len(), areas(&lights)), (1, DVec3::Z));
        }
        let lights = of_mesh(&mesh(vec![[0, 1, 2], [0, 2, 1]]), Rgb::ONE).expect("few");
        assert_eq!(lights.len(), 2, "front and back are no quad");
        let lights = of_mesh(&mesh(vec![[0, 1, 1], [0, 1, 2]]), Rgb::ONE).expect("few");
        assert_eq!(lights.len(), 1, "one has no area");
        assert!(of_mesh(&mesh(vec![[0, 1, 2]; MAX_LIGHTS + 1]), Rgb::ONE).is_none());
    }
}
