//! The `vertex` element: which of its properties count, and where they go.

use super::header::{Element, Kind};
use crate::import::normals::unit_or_zero;
use crate::import::source::Fault;
use crate::import::source::Notes;
use crate::math::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

/// The vertices of a file.
#[derive(Default)]
pub(super) struct Vertices {
    pub positions: Vec<DVec3>,
    /// Unit, or zero where the file's is unusable.
    pub normals: Option<Vec<Vec3>>,
    pub uvs: Option<Vec<Vec2>>,
}

/// Which properties hold what, by their number in the element.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Columns {
    pub position: [usize; 3],
    pub normal: Option<[usize; 3]>,
    pub uv: Option<[usize; 2]>,
}

/// Names that texture coordinates go by.
const UV_NAMES: [[&str; 2]; 4] =
    [["u", "v"], ["s", "t"], ["texture_u", "texture_v"], ["texture_s", "texture_t"]];

impl Columns {
    /// Finds the columns of `element`, and notes the properties that are ignored.
    ///
    /// Errors: no x, y, z.
    pub fn of(element: &Element, notes: &mut Notes) -> Result<Self, Fault> {
        let scalar = |name: &str| {
            let is =
                |p: &super::header::Property| p.name == name && matches!(p.kind, Kind::Scalar(_));
            element.properties.iter().position(is)
        };
        let three = |names: [&str; 3]| {
            let [a, b, c] = names.map(scalar);
            Some([a?, b?, c?])
        };
        let two = |names: &[&str; 2]| Some([scalar(names[0])?, scalar(names[1])?]);
        let position = three(["x", "y", "z"])
            .ok_or_else(|| Fault::new(element.line, "the vertices have no x, y and z"))?;
        if scalar("red").is_some() || scalar("diffuse_red").is_some() {
            notes.add("vertex colours were ignored", element.line);
        }
        Ok(Self { position, normal: three(["nx", "ny", "nz"]), uv: UV_NAMES.iter().find_map(two) })
    }
}

impl Vertices {
    /// Room for `count` vertices.
    pub fn with_capacity(columns: &Columns, count: usize) -> Self {
        Self {
            positions: Vec::with_capacity(count),
            normals: columns.normal.map(|_| Vec::with_capacity(count)),
            uvs: columns.uv.map(|_| Vec::with_capacity(count)),
        }
    }

    /// Adds the vertex with the given values, one a property (0 for lists).
    pub fn push(&mut self, columns: &Columns, values: &[f64]) {
        let vector = |at: [usize; 3]| DVec3::from_array(at.map(|i| values[i]));
        self.positions.push(vector(columns.position));
        if let (Some(normals), Some(at)) = (&mut self.normals, columns.normal) {
            normals.push(unit_or_zero(vector(at)));
        }
        if let (Some(uvs), Some([u, v])) = (&mut self.uvs, columns.uv) {
            uvs.push(Vec2::new(values[u] as f32, values[v] as f32));
        }
    }

    /// The first vertex with a position or texture coordinate that is not finite.
    pub fn first_not_finite(&self) -> Option<(usize, &'static str)> {
        let position = self.positions.par_iter().position_first(|p| !p.is_finite());
        let uv = self.uvs.as_ref().and_then(|uvs| uvs.iter().position(|uv| !uv.is_finite()));
        match (position, uv) {
            (Some(p), Some(t)) if t < p => Some((t, "texture coordinate")),
            (None, Some(t)) => Some((t, "texture coordinate")),
            (p, _) => p.map(|p| (p, "position")),
        }
    }
}
