//! One vertex list for a mesh whose attributes have indices of their own.

use crate::math::{DVec3, Rgb, Vec2, Vec3};
use crate::scene::{VertexColours, WorldMesh};
use std::borrow::Cow;

/// A mesh with one index per corner.
pub(super) struct Flat<'a> {
    pub positions: Cow<'a, [DVec3]>,
    /// Normals, one per position; `None` if the mesh has none.
    pub normals: Option<Cow<'a, [Vec3]>>,
    pub uvs: Option<Cow<'a, [Vec2]>>,
    /// Colours of the mesh's own vertices.
    colours: Option<&'a VertexColours>,
    /// Which of these each position was; `None` if all stayed.
    sources: Option<Vec<u32>>,
    pub triangles: Cow<'a, [[u32; 3]]>,
}

const NONE: u32 = u32::MAX;

/// A vertex of the result: indices of its normal and texture coordinate, and the next vertex of the same position.
struct Vertex {
    position: u32,
    normal: u32,
    uv: u32,
    next: u32,
}

/// Splits vertices at which several normals or texture coordinates meet; borrows all arrays
/// if there are none. Takes linear time.
pub(super) fn flatten(mesh: &WorldMesh) -> Flat<'_> {
    let normal_corners = mesh.normals.as_ref().and_then(|n| n.corners.as_deref());
    let uv_corners = mesh.uvs.as_ref().and_then(|uv| uv.corners.as_deref());
    if normal_corners.is_none() && uv_corners.is_none() {
        return Flat {
            positions: Cow::Borrowed(&mesh.positions),
            normals: mesh.normals.as_ref().map(|n| Cow::Borrowed(&n.values[..])),
            uvs: mesh.uvs.as_ref().map(|uv| Cow::Borrowed(&uv.values[..])),
            colours: mesh.colours.as_ref(),
            sources: None,
            triangles: Cow::Borrowed(&mesh.triangles),
        };
    }
    let mut first = vec![NONE; mesh.positions.len()];
    let mut vertices: Vec<Vertex> = Vec::with_capacity(mesh.positions.len());
    let mut triangles = mesh.triangles.clone();
    for (prim, triangle) in triangles.iter_mut().enumerate() {
        let normals = normal_corners.map_or(*triangle, |c| c[prim]);
        let uvs = uv_corners.map_or(*triangle, |c| c[prim]);
        for (k, corner) in triangle.iter_mut().enumerate() {
            *corner = vertex(&mut first, &mut vertices, [*corner, normals[k], uvs[k]]);
        }
    }
    let all = vertices.iter();
    let normal = |v: &Vertex, values: &[Vec3]| values[v.normal as usize];
    let uv = |v: &Vertex, values: &[Vec2]| values[v.uv as usize];
    Flat {
        positions: all.clone().map(|v| mesh.positions[v.position as usize]).collect(),
        normals: mesh.normals.as_ref().map(|n| all.clone().map(|v| normal(v, &n.values)).collect()),
        uvs: mesh.uvs.as_ref().map(|t| all.clone().map(|v| uv(v, &t.values)).collect()),
        colours: mesh.colours.as_ref(),
        sources: Some(all.map(|v| v.position).collect()),
        triangles: Cow::Owned(triangles),
    }
}

impl Flat<'_> {
    /// Whether its vertices have colours, and whether these are sRGB codes of 8 bits.
    pub fn has_colours(&self) -> Option<bool> {
        self.colours.map(|colours| colours.codes().is_some())
    }

    /// The colour of the vertex at position number `at`, linear RGB; white without any.
    pub fn colour(&self, at: usize) -> Rgb {
        let vertex = self.sources.as_ref().map_or(at as u32, |sources| sources[at]);
        self.colours.map_or(Rgb::ONE, |colours| colours.of_vertex(vertex))
    }
}

/// The vertex of the given position, normal and texture coordinate; made if it does not exist.
fn vertex(first: &mut [u32], vertices: &mut Vec<Vertex>, [position, normal, uv]: [u32; 3]) -> u32 {
    let mut at = first[position as usize];
    while at != NONE {
        let v = &vertices[at as usize];
        if v.normal == normal && v.uv == uv {
            return at;
        }
        at = v.next;
    }
    let next = std::mem::replace(&mut first[position as usize], vertices.len() as u32);
    vertices.push(Vertex { position, normal, uv, next });
    vertices.len() as u32 - 1
}
