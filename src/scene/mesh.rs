//! Meshes and spheres, before (`World…`) and after recentring.

use super::{FaceLights, MaterialId, VertexColours};
use crate::math::{Bounds3, DVec3, Vec2, Vec3, bulk};
use bytemuck::Pod;
use serde::{Deserialize, Serialize};

/// A per-corner attribute: values, and which value each triangle's corners use.
///
/// `corners: None` means that the attribute is indexed like the positions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(bound = "T: Pod")]
pub struct Corners<T> {
    /// The values.
    #[serde(with = "bulk")]
    pub values: Vec<T>,
    /// Three indices into `values` a triangle, or `None` for the triangle's own.
    #[serde(with = "bulk::optional")]
    pub corners: Option<Vec<[u32; 3]>>,
}

impl<T: Copy> Corners<T> {
    /// The three values at the corners of triangle `prim`, whose position indices are `triangle`.
    pub fn get(&self, prim: usize, triangle: [u32; 3]) -> [T; 3] {
        let at = self.corners.as_ref().map_or(triangle, |c| c[prim]);
        at.map(|i| self.values[i as usize])
    }
}

/// How shading normals come about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NormalPolicy {
    /// The file's normals where it has them, else smooth with the crease angle.
    Auto {
        /// Edges sharper than this stay sharp; degrees.
        crease_degrees: f64,
    },
    /// The triangle's own plane.
    Flat,
    /// Area- and angle-weighted vertex normals, split at edges sharper than the crease angle.
    Smooth {
        /// Edges sharper than this stay sharp; degrees.
        crease_degrees: f64,
    },
}

/// The material of a mesh's or sphere's surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Surface {
    /// Its material.
    pub material: MaterialId,
    /// The area light whose emitting surface this is: an index into `Scene::lights`.
    pub light: Option<u32>,
    /// Whether its light is traced in every frame, never reused.
    pub always_traced: bool,
}

/// A mesh in world space, f64. Invariant: every index is in range and every number finite.
#[derive(Debug, Clone)]
pub struct WorldMesh {
    /// Name for messages and AOVs.
    pub name: String,
    /// Vertex positions, world units.
    pub positions: Vec<DVec3>,
    /// Vertex indices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Shading normals (unit, or zero where the file's was unusable); `None` shades flat.
    pub normals: Option<Corners<Vec3>>,
    /// Texture coordinates, origin at the image's lower left: set number 0.
    pub uvs: Option<Corners<Vec2>>,
    /// Triangles that the mesh's file gives no texture coordinates, though it gives some to others: they have (0, 0).
    pub bare_triangles: usize,
    /// Further sets of texture coordinates, from number 1 on; `None` is one that the mesh lacks.
    pub more_uvs: Vec<Option<Corners<Vec2>>>,
    /// A colour for each position, which its material may show.
    pub colours: Option<VertexColours>,
    /// The material of all its triangles.
    pub material: MaterialId,
    /// Whether its light is traced in every frame, never reused.
    pub always_traced: bool,
}

impl WorldMesh {
    /// A mesh that shades flat, without texture coordinates and colours. `triangles` index `positions`,
    /// counter-clockwise seen from outside; all numbers must be finite.
    pub fn new(
        name: impl Into<String>,
        positions: Vec<DVec3>,
        triangles: Vec<[u32; 3]>,
        material: MaterialId,
    ) -> Self {
        Self {
            name: name.into(),
            positions,
            triangles,
            normals: None,
            uvs: None,
            bare_triangles: 0,
            more_uvs: Vec::new(),
            colours: None,
            material,
            always_traced: false,
        }
    }

    /// The two triangles between four corners, which run counter-clockwise seen from outside.
    pub fn quad(name: impl Into<String>, corners: [DVec3; 4], material: MaterialId) -> Self {
        Self::new(name, corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]], material)
    }

    /// The texture coordinates of set number `set`, if the mesh has them.
    pub fn uv_set(&self, set: u8) -> Option<&Corners<Vec2>> {
        numbered(&self.uvs, &self.more_uvs, set)
    }

    /// All sets of texture coordinates that the mesh has.
    pub fn uv_sets_mut(&mut self) -> impl Iterator<Item = &mut Corners<Vec2>> {
        self.uvs.iter_mut().chain(self.more_uvs.iter_mut().flatten())
    }
}

/// A mesh in scene space, f32: the very numbers that Embree holds.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Mesh {
    /// Name for messages and AOVs.
    pub name: String,
    /// Vertex positions, scene space. One spare element follows the last vertex in memory
    /// (Embree reads 16 bytes a vertex); `vertex_count` is the true number.
    #[serde(with = "bulk")]
    pub positions: Vec<Vec3>,
    /// Vertices without the spare one.
    pub vertex_count: usize,
    /// Vertex indices.
    #[serde(with = "bulk")]
    pub triangles: Vec<[u32; 3]>,
    /// Shading normals, or `None` to shade flat.
    pub normals: Option<Corners<Vec3>>,
    /// Texture coordinates: set number 0.
    pub uvs: Option<Corners<Vec2>>,
    /// Further sets of texture coordinates, from number 1 on; `None` is one that the mesh lacks, or that its material
    /// does not use. Apart from the first, so that meshes with one set find it without a search.
    pub more_uvs: Vec<Option<Corners<Vec2>>>,
    /// A colour for each vertex; `None` where its material shows none.
    pub colours: Option<VertexColours>,
    /// Material.
    pub surface: Surface,
    /// The lights that its faces are; `None` of most meshes, and of those that are the surface of one light.
    pub lights: Option<FaceLights>,
    /// Bounds of the f32 positions that triangles use.
    pub bounds: Bounds3,
}

impl Mesh {
    /// The f32 corners of triangle `prim`, widened: what every f64 computation starts from.
    pub fn corners(&self, prim: usize) -> [DVec3; 3] {
        self.triangles[prim].map(|i| self.positions[i as usize].as_dvec3())
    }

    /// The texture coordinates of set number `set`, if the mesh has them.
    #[inline]
    pub fn uv_set(&self, set: u8) -> Option<&Corners<Vec2>> {
        numbered(&self.uvs, &self.more_uvs, set)
    }
}

/// Set number `set` of texture coordinates, of which number 0 is `first`, and number 1 the first of `more`.
#[inline]
fn numbered<'m>(
    first: &'m Option<Corners<Vec2>>,
    more: &'m [Option<Corners<Vec2>>],
    set: u8,
) -> Option<&'m Corners<Vec2>> {
    match set {
        0 => first.as_ref(),
        _ => more.get(usize::from(set) - 1)?.as_ref(),
    }
}

/// An analytic sphere in world space.
#[derive(Debug, Clone)]
pub struct WorldSphere {
    /// Name for messages and AOVs.
    pub name: String,
    /// Centre, world units.
    pub centre: DVec3,
    /// Radius, world units, positive.
    pub radius: f64,
    /// Its material.
    pub material: MaterialId,
    /// Whether its light is traced in every frame, never reused.
    pub always_traced: bool,
}

impl WorldSphere {
    /// A sphere, world units; the radius is positive.
    pub fn new(name: impl Into<String>, centre: DVec3, radius: f64, material: MaterialId) -> Self {
        Self { name: name.into(), centre, radius, material, always_traced: false }
    }
}

/// An analytic sphere in scene space, f64.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Sphere {
    /// Name for messages and AOVs.
    pub name: String,
    /// Centre, scene space.
    pub centre: DVec3,
    /// Radius, scene space.
    pub radius: f64,
    /// Material.
    pub surface: Surface,
}
