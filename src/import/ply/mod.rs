//! PLY files (Turk, 1994): ASCII and binary in both byte orders.
//!
//! Any elements and properties in any order; `vertex` and `face` or `tristrips` count, the rest
//! is skipped by its size. The header is hostile until checked: no memory is asked for before
//! the file has been seen to be long enough for what it announces.
//!
//! [`header`] reads the header; [`fast`] decodes the usual fixed-size layouts in bulk on all
//! threads; [`fields`] reads everything else value by value; both give the same mesh.
//!
//! Not done: alpha of vertex colours, colours of faces, texture coordinates per face corner, `trifans`.

mod fast;
mod fields;
mod general;
mod header;
mod vertex;

use super::model::Model;
use super::source::Notes;
use super::{colours, normals, polygon, tidy};
use crate::error::{Diagnostic, Error, Result};
use crate::math::{DVec3, Vec3};
use crate::scene::{Corners, VertexColours, WorldMesh};
use header::Header;
use std::path::Path;
use vertex::Vertices;

/// Reads a PLY file. Normals are the file's, or none.
///
/// Errors: `Error::Input` with the line (header, ASCII) or the byte offset.
pub(super) fn read(path: &Path, bytes: Vec<u8>) -> Result<Model> {
    read_by(path, &bytes, true)
}

fn read_by(path: &Path, bytes: &[u8], fast: bool) -> Result<Model> {
    let header = header::read(bytes).map_err(|fault| fault.at(path))?;
    let body = Body { path, bytes, header: &header, fast };
    let mut contents = body.contents()?;
    body.check(&mut contents)?;
    let Contents { vertices, faces, notes } = contents;
    let mut model = Model { files: vec![path.to_path_buf()], ..Model::default() };
    let warnings = notes.into_warnings(path);
    if let Some(mesh) = build(path, vertices, faces, &mut model)? {
        let material = match mesh.colours {
            Some(_) => model.coloured_material(),
            None => model.default_material(),
        };
        model.world.meshes.push(WorldMesh { material, ..mesh });
    }
    model.warnings.extend(warnings);
    Ok(model)
}

/// The data after the header.
struct Body<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    header: &'a Header,
    fast: bool,
}

/// The content of the body, with indices checked to be in range.
#[derive(Default)]
struct Contents {
    vertices: Vertices,
    faces: Faces,
    notes: Notes,
}

/// Faces: bare triangles, or polygons of any size.
enum Faces {
    Triangles(Vec<[u32; 3]>),
    Polygons {
        indices: Vec<u32>,
        /// One past the last corner of each face.
        ends: Vec<u32>,
    },
}

impl Default for Faces {
    fn default() -> Self {
        Self::Triangles(Vec::new())
    }
}

impl Faces {
    fn into_polygons(self) -> (Vec<u32>, Vec<u32>) {
        match self {
            Self::Triangles(triangles) => {
                let ends = (1..=triangles.len() as u32).map(|n| 3 * n).collect();
                (triangles.into_flattened(), ends)
            }
            Self::Polygons { indices, ends } => (indices, ends),
        }
    }
}

impl Body<'_> {
    fn contents(&self) -> Result<Contents> {
        let mut contents = Contents::default();
        let mut at = self.header.body;
        let mut line = self.header.body_line;
        for element in &self.header.elements {
            if let Some(size) =
                self.fast.then(|| fast::read(self, element, at, &mut contents)).flatten()
            {
                at += size;
            } else {
                (at, line) = general::read(self, element, (at, line), &mut contents)
                    .map_err(|fault| fault.at(self.path))?;
            }
        }
        Ok(contents)
    }

    /// Errors: positions, texture coordinates or colours that are not finite, no faces, no vertices.
    fn check(&self, contents: &mut Contents) -> Result<()> {
        let Contents { vertices, faces, notes } = contents;
        let count = vertices.positions.len();
        let none = match faces {
            Faces::Triangles(triangles) => triangles.is_empty(),
            Faces::Polygons { ends, .. } => ends.is_empty(),
        };
        if none {
            let help = "points have no surface to render; make a mesh of them first";
            let message = format!("a point cloud: {count} vertices and no faces");
            return Err(Diagnostic::new(self.path, message).help(help).into());
        }
        if let Some((vertex, what)) = vertices.first_not_finite() {
            let message = format!("the {what} of vertex {vertex} (from 0) is not a finite number");
            let place = Diagnostic::new(self.path, message);
            let line = self.header.vertex_line(vertex);
            return Err(Diagnostic { line, ..place }.into());
        }
        let unusable = vertices.normals.iter().flatten().filter(|n| **n == Vec3::ZERO).count();
        notes.add_many(normals::UNUSABLE, unusable, None);
        notes.add_many(colours::STRAYED, vertices.strayed_colours(), None);
        Ok(())
    }
}

/// An attribute with a value for each vertex.
fn of_vertices<T>(values: Vec<T>) -> Corners<T> {
    Corners { values, corners: None }
}

fn build(
    path: &Path,
    mut vertices: Vertices,
    faces: Faces,
    model: &mut Model,
) -> Result<Option<WorldMesh>> {
    let mut positions = std::mem::take(&mut vertices.positions);
    let mut triangles = match faces {
        Faces::Triangles(triangles) => triangles,
        Faces::Polygons { indices, ends } => triangulate(&positions, &indices, &ends)
            .map_err(|message| Error::input(path, message))?,
    };
    let dropped = tidy::drop_degenerate(&positions, &mut triangles, &mut []);
    model.warnings.extend(tidy::warning(path, dropped));
    if triangles.is_empty() {
        model.warnings.push(Diagnostic::new(path, "no triangle is left: nothing will be seen"));
        return Ok(None);
    }
    let Vertices { positions: _, mut normals, mut uvs, mut more_uvs, mut colours } = vertices;
    if let Some(kept) = tidy::used(positions.len(), &triangles) {
        tidy::retain(&mut positions, &kept);
        normals.iter_mut().for_each(|n| tidy::retain(n, &kept));
        uvs.iter_mut().chain(&mut more_uvs).for_each(|uv| tidy::retain(uv, &kept));
        colours.iter_mut().for_each(|colours| tidy::retain(colours, &kept));
        tidy::renumber(&mut triangles, &kept);
    }
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    Ok(Some(WorldMesh {
        normals: normals.map(of_vertices),
        uvs: uvs.map(of_vertices),
        more_uvs: more_uvs.into_iter().map(|values| Some(of_vertices(values))).collect(),
        colours: colours.map(|shares| VertexColours::from_encoded(&shares)),
        ..WorldMesh::new(name, positions, triangles, 0)
    }))
}

fn triangulate(
    positions: &[DVec3],
    indices: &[u32],
    ends: &[u32],
) -> std::result::Result<Vec<[u32; 3]>, String> {
    let mut triangles = Vec::with_capacity(ends.len());
    let (mut local, mut corners) = (Vec::new(), Vec::new());
    let mut start = 0;
    for (number, end) in ends.iter().enumerate() {
        let face = &indices[start..*end as usize];
        start = *end as usize;
        if let [a, b, c] = *face {
            triangles.push([a, b, c]);
            continue;
        }
        local.clear();
        corners.clear();
        corners.extend(face.iter().map(|i| positions[*i as usize]));
        polygon::triangulate(&corners, &mut local)
            .map_err(|message| format!("face {number} (from 0): {message}"))?;
        triangles.extend(local.iter().map(|t| t.map(|i| face[i as usize])));
    }
    Ok(triangles)
}

#[cfg(test)]
mod tests;
