//! From primitives to meshes in the world.

use super::deform::Shape;
use super::json::Json;
use super::primitive::Primitive;
use crate::error::{Error, Result};
use crate::import::source::Notes;
use crate::import::{normals, tidy};
use crate::math::{DAffine3, DVec3, Rgb, Vec2, Vec3};
use crate::scene::{Corners, VertexColours, WorldMesh};
use rayon::prelude::*;

/// Largest coordinate, as in scene files.
pub(super) const LARGEST: f64 = 1e30;

/// A mesh of a primitive in the coordinates of its `shape`, counter-clockwise seen from outside. `None` where no triangle
/// has an area, as far as that is noted.
pub(super) fn mesh(
    primitive: Primitive,
    shape: Shape,
    name: &str,
    notes: &mut Notes,
) -> Option<WorldMesh> {
    let Primitive { uvs, colours, mut triangles, .. } = primitive;
    let Shape { mut positions, normals, mirrored } = shape;
    if mirrored {
        triangles.par_iter_mut().for_each(|t| t.swap(1, 2));
    }
    let dropped = tidy::drop_degenerate(&positions, &mut triangles, &mut []);
    notes.add_many("a triangle without area was dropped", dropped, None);
    if triangles.is_empty() {
        return None;
    }
    let mut normals = normals.map(|all| unit_normals(all, notes));
    // The image's origin is at its upper left in glTF, at its lower left here.
    let flipped = |uv: &[f32; 2]| Vec2::new(uv[0], 1.0 - uv[1]);
    let flipped = |all: Vec<[f32; 2]>| all.par_iter().map(flipped).collect();
    let mut uvs: Vec<Option<Vec<Vec2>>> = uvs.into_iter().map(|set| set.map(flipped)).collect();
    let mut colours: Option<Vec<Rgb>> =
        colours.map(|all| all.into_par_iter().map(Rgb::from_array).collect());
    if let Some(kept) = tidy::used(positions.len(), &triangles) {
        tidy::retain(&mut positions, &kept);
        normals.iter_mut().for_each(|n| tidy::retain(n, &kept));
        uvs.iter_mut().flatten().for_each(|uv| tidy::retain(uv, &kept));
        colours.iter_mut().for_each(|c| tidy::retain(c, &kept));
        tidy::renumber(&mut triangles, &kept);
    }
    let mut uvs = uvs.into_iter().map(|set| Some(Corners { values: set?, corners: None }));
    Some(WorldMesh {
        normals: normals.map(|values| Corners { values, corners: None }),
        uvs: uvs.next().flatten(),
        more_uvs: uvs.collect(),
        colours: colours.map(VertexColours::from_linear),
        ..WorldMesh::new(name, positions, triangles, 0)
    })
}

fn unit_normals(all: Vec<DVec3>, notes: &mut Notes) -> Vec<Vec3> {
    let all: Vec<Vec3> = all.into_par_iter().map(normals::unit_or_zero).collect();
    let unusable = all.par_iter().filter(|n| **n == Vec3::ZERO).count();
    notes.add_many(normals::UNUSABLE, unusable, None);
    all
}

/// `mesh` at each of `places`, as one mesh.
///
/// Errors, at `json`: places that are not finite, or move a vertex beyond [`LARGEST`].
pub(super) fn at_all(
    mut mesh: WorldMesh,
    places: &[DAffine3],
    json: &Json<'_>,
    notes: &mut Notes,
) -> Result<Option<WorldMesh>> {
    if let [place] = places {
        move_to(&mut mesh, place, json, notes)?;
        check_size(&mesh, json)?;
        return Ok((!mesh.triangles.is_empty()).then_some(mesh));
    }
    let mut all: Option<WorldMesh> = None;
    let colours: Option<Vec<Rgb>> = mesh.colours.take().map(|colours| {
        (0..colours.count() as u32).map(|vertex| colours.of_vertex(vertex)).collect()
    });
    let mut count = 0;
    for place in places {
        let mut copy = mesh.clone();
        move_to(&mut copy, place, json, notes)?;
        check_size(&copy, json)?;
        count += 1;
        match &mut all {
            Some(all) => append(all, copy),
            None => all = Some(copy),
        }
    }
    let colours = colours.map(|colours| VertexColours::from_linear(colours.repeat(count)));
    Ok(all.map(|all| WorldMesh { colours, ..all }).filter(|all| !all.triangles.is_empty()))
}

/// Refuses vertices that lie far beyond what can be rendered, or nowhere.
fn check_size(mesh: &WorldMesh, json: &Json<'_>) -> Result<()> {
    // What is no number is not within.
    if mesh.positions.par_iter().all(|p| p.abs().max_element() <= LARGEST && p.is_finite()) {
        return Ok(());
    }
    Err(json.fault(format!("a vertex lies beyond {LARGEST:e} in the world, or nowhere")).into())
}

/// Moves a mesh. Where a place flattens it, what is left of it has the normals of its planes.
fn move_to(
    mesh: &mut WorldMesh,
    place: &DAffine3,
    json: &Json<'_>,
    notes: &mut Notes,
) -> Result<()> {
    if *place == DAffine3::IDENTITY {
        return Ok(());
    }
    let at = |error: Error| Error::from(json.fault(error.to_string()));
    let size = place.matrix3.to_cols_array().iter().fold(0f64, |size, x| size.max(x.abs()));
    let flattens =
        place.is_finite() && (size == 0.0 || (place.matrix3 * (1.0 / size)).determinant() == 0.0);
    if !flattens {
        return mesh.apply_transform(place).map_err(at);
    }
    mesh.positions.par_iter_mut().for_each(|p| *p = place.transform_point3(*p));
    // Normals of one length have no direction: those of the planes count, with or without a file's.
    if let Some(normals) = &mut mesh.normals {
        normals.values.fill(Vec3::ZERO);
    }
    let dropped = tidy::drop_degenerate(&mesh.positions, &mut mesh.triangles, &mut []);
    notes.add_many("a triangle without area was dropped", dropped, None);
    Ok(())
}

/// Adds the triangles of `other`, which has the same attributes but for colours.
fn append(mesh: &mut WorldMesh, mut other: WorldMesh) {
    let first = mesh.positions.len() as u32;
    mesh.positions.append(&mut other.positions);
    mesh.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + first)));
    if let (Some(normals), Some(more)) = (&mut mesh.normals, &mut other.normals) {
        normals.values.append(&mut more.values);
    }
    for (uvs, more) in mesh.uv_sets_mut().zip(other.uv_sets_mut()) {
        uvs.values.append(&mut more.values);
    }
}
