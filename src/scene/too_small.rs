//! Shapes that rounding to f32 would collapse: refused by name, or counted.

use super::light::EmittingShape;
use super::{Recentring, World};
use crate::error::{Error, Result};
use crate::math::{Bounds3, DVec3, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Triangles of a mesh that rounding to f32 made nothing of.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Collapsed {
    /// The mesh's name.
    pub mesh: String,
    /// Triangles that had an area, and have none in scene space.
    pub lost: usize,
    /// All its triangles.
    pub of: usize,
}

/// Errors for what is lost beside the rest of the scene, by its name: rather no picture than one
/// with a hole in it.
pub(super) fn refuse(world: &World, r: &Recentring) -> Result<()> {
    for mesh in &world.meshes {
        let mut bounds = Bounds3::EMPTY;
        mesh.positions.iter().for_each(|p| bounds.include(*p));
        refuse_flattened(&mesh.name, &bounds, r)?;
    }
    // Spheres stay f64, so their place does not matter.
    for s in &world.spheres {
        refuse_narrower(&s.name, 2.0 * s.radius, r, NARROWEST)?;
    }
    for (index, light) in world.lights.iter().enumerate() {
        let name = format!("light {}", index + 1);
        match light.surface().map(|surface| surface.shape) {
            Some(EmittingShape::Triangles(..)) => refuse_flattened(&name, &light.bounds(), r)?,
            Some(EmittingShape::Sphere(_, radius)) => {
                refuse_narrower(&name, 2.0 * radius, r, NARROWEST)?;
            }
            None => {}
        }
    }
    Ok(())
}

/// Widths of scene space: what is narrower has triangles whose determinants underflow in f32.
const NARROWEST: f64 = 1.0 / (1u64 << 32) as f64;
/// Numbers of f32 that must fit across a mesh; with fewer, rounding moves its surface by more than
/// a quarter of its radius.
const FEWEST_STEPS: f64 = 8.0;

/// Errors for triangles within `bounds` (world) whose corners would fall together in f32. What is
/// a point in f64 already is nothing that could be lost.
fn refuse_flattened(name: &str, bounds: &Bounds3, r: &Recentring) -> Result<()> {
    let largest = r.point_to_scene(bounds.min).abs().max(r.point_to_scene(bounds.max).abs());
    let step = f64::from(f32::EPSILON) * largest.max_element();
    let width = bounds.extent().max_element();
    refuse_narrower(name, width, r, NARROWEST.max(FEWEST_STEPS * step))
}

/// Errors for what is wider than nothing (world units) but narrower than `least` (scene units).
fn refuse_narrower(name: &str, width: f64, r: &Recentring, least: f64) -> Result<()> {
    if width == 0.0 || width * r.scale() >= least {
        return Ok(());
    }
    let least = r.length_to_world(least);
    Err(Error::Usage(format!(
        "`{name}` is {width:.1e} units wide, too small to be told from a point beside the rest of \
         the scene, which holds things from {least:.1e} units there. Leave it out, or render it \
         apart"
    )))
}

/// How many of `triangles` have an area between `positions` (world) but none between `rounded`
/// (the same in scene space).
pub(super) fn count_collapsed(
    positions: &[DVec3],
    rounded: &[Vec3],
    triangles: &[[u32; 3]],
) -> usize {
    // Nearly all triangles need only the rounded corners. Of their differences f64 holds each
    // product exactly, so this is zero only where the area is.
    let is_flat = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| rounded[i as usize].as_dvec3());
        (b - a).cross(c - a) == DVec3::ZERO
    };
    let had_area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| positions[i as usize]);
        let (e1, e2) = (b - a, c - a);
        // The corners are themselves rounded: less than this is no area that anybody meant.
        let largest = a.abs().max(b.abs()).max(c.abs()).max_element();
        let longest = e1.length().max(e2.length()).max((c - b).length());
        e1.cross(e2).length() > 4.0 * f64::EPSILON * largest * longest
    };
    triangles.par_iter().with_min_len(1 << 14).filter(|t| is_flat(t) && had_area(t)).count()
}

/// Errors for a mesh of which more than half the triangles are lost.
pub(super) fn refuse_collapsed(mesh: &Collapsed) -> Result<()> {
    let Collapsed { mesh, lost, of } = mesh;
    if 2 * lost <= *of {
        return Ok(());
    }
    Err(Error::Usage(format!(
        "{lost} of the {of} triangles of `{mesh}` are too small to be told from a line or a point \
         beside the rest of the scene. Leave out what is far away from it, or render it apart"
    )))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, WorldMesh};

    #[test]
    fn shapes_that_rounding_would_flatten_are_refused_by_name() {
        const DIRECTIONS: [DVec3; 6] =
            [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
        let with = |radius: f64, at: f64| {
            let mut world = World::default();
            world.materials.push(Material::black("m"));
            for (name, centre, radius) in [("large", 0.0, 1.0), ("tiny", at, radius)] {
                let centre = DVec3::X * centre;
                let corner = |dir: DVec3| centre + dir * radius;
                let (corners, triangles) = (DIRECTIONS.map(corner), vec![[0, 2, 4], [1, 5, 3]]);
                world.meshes.push(WorldMesh::new(name, corners.into(), triangles, 0));
            }
            world.into_scene(true)
        };
        assert!(with(1e-5, 1.0).is_ok());
        assert!(with(0.0, 1.0).is_ok(), "a point is no loss");
        let error = with(1e-7, 1.0).expect_err("too_small").to_string();
        assert!(error.contains("`tiny` is 2.0e-7 units wide"), "{error}");
        // Near the middle numbers are finer.
        assert!(with(1e-7, 0.0).is_ok());
        assert!(with(1e-12, 0.0).is_err());
    }

    /// A grid of `n` x `n` quads over the unit square, and one triangle `far` away.
    fn grid_and_far(n: u32, far: f64) -> World {
        let mut world = World::default();
        world.materials.push(Material::black("m"));
        let place = |i: u32| f64::from(i) / f64::from(n);
        let mut positions: Vec<DVec3> = (0..=n)
            .flat_map(|j| (0..=n).map(move |i| DVec3::new(place(i), place(j), 0.0)))
            .collect();
        let at = |i: u32, j: u32| j * (n + 1) + i;
        let quads = (0..n).flat_map(|j| (0..n).map(move |i| (i, j)));
        let mut triangles: Vec<[u32; 3]> = quads
            .flat_map(|(i, j)| {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect();
        let next = positions.len() as u32;
        triangles.push([next, next + 1, next + 2]);
        let corner = DVec3::X * far;
        positions.extend([corner, corner + DVec3::Y * far, corner + DVec3::Z * far]);
        world.meshes.push(WorldMesh::new("grid", positions, triangles, 0));
        world
    }

    #[test]
    fn lost_triangles_are_counted_and_a_mesh_of_them_refused() {
        let near = grid_and_far(10, 3.0).into_scene(true).expect("renders");
        assert_eq!(near.collapsed, []);
        let error = grid_and_far(10, 1e9).into_scene(true).expect_err("too_small").to_string();
        assert!(error.contains("200 of the 201 triangles of `grid`"), "{error}");
        // Not refused where the rule is off: small coordinates lose nothing as they are.
        let plain = grid_and_far(10, 1e9).into_scene(false).expect("renders");
        assert_eq!(plain.collapsed, []);
        // The same lost among more that are kept.
        let mut world = grid_and_far(10, 1e9);
        let WorldMesh { positions, triangles, .. } = &mut world.meshes[0];
        let far = triangles[200];
        triangles.extend([far; 300]);
        // What had no area before is no loss.
        triangles.push([0, 0, 1]);
        positions.push(DVec3::ZERO);
        let scene = world.into_scene(true).expect("renders");
        let lost = Collapsed { mesh: "grid".into(), lost: 200, of: 502 };
        assert_eq!(scene.collapsed, [lost]);
    }

    /// Prints; the pass must stay far below the time that reading a mesh takes.
    #[test]
    #[ignore = "a measurement"]
    fn counting_is_cheap() {
        let world = grid_and_far(2236, 3.0);
        let mesh = &world.meshes[0];
        let rounded: Vec<Vec3> = mesh.positions.iter().map(|p| p.as_vec3()).collect();
        let start = std::time::Instant::now();
        let lost = count_collapsed(&mesh.positions, &rounded, &mesh.triangles);
        println!("{} triangles, {lost} lost: {:?}", mesh.triangles.len(), start.elapsed());
    }
}
