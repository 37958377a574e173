//! The `vertex` element: which of its properties count, and where they go.

use super::header::{Element, Kind, Type};
use crate::import::colours;
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
    /// Further sets of texture coordinates, from number 1 on.
    pub more_uvs: Vec<Vec<Vec2>>,
    /// Shares of the largest sRGB code, as the file has them: any number.
    pub colours: Option<Vec<[f32; 3]>>,
}

/// Which properties hold what, by their number in the element.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Columns {
    pub position: [usize; 3],
    pub normal: Option<[usize; 3]>,
    pub uv: Option<[usize; 2]>,
    /// Of further sets of texture coordinates, from number 1 on.
    pub more_uvs: Vec<[usize; 2]>,
    pub colour: Option<ColourColumns>,
}

/// Which properties hold the vertices' colours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ColourColumns {
    pub at: [usize; 3],
    /// The value of each that stands for full light.
    full: [f64; 3],
}

/// Names that texture coordinates go by. Those of further sets have the set's number after them: `s1` and `t1`.
const UV_NAMES: [[&str; 2]; 4] =
    [["u", "v"], ["s", "t"], ["texture_u", "texture_v"], ["texture_s", "texture_t"]];

/// Names that colours go by.
const COLOUR_NAMES: [[&str; 3]; 3] =
    [["red", "green", "blue"], ["diffuse_red", "diffuse_green", "diffuse_blue"], ["r", "g", "b"]];

impl ColourColumns {
    /// The columns of `element`, and a note of some that lack others.
    fn of(element: &Element, notes: &mut Notes) -> Option<Self> {
        let find = |name: &str| {
            let mut all = element.properties.iter().enumerate();
            all.find_map(|(at, p)| match p.kind {
                Kind::Scalar(t) if p.name == name => Some((at, full(t))),
                _ => None,
            })
        };
        for names in COLOUR_NAMES {
            match names.map(find) {
                [Some(r), Some(g), Some(b)] => {
                    return Some(Self { at: [r.0, g.0, b.0], full: [r.1, g.1, b.1] });
                }
                [None, None, None] => {}
                found => {
                    let missing = names.iter().zip(found).find(|(_, found)| found.is_none());
                    let missing = missing.map_or("", |(name, _)| name);
                    let note = format!("vertex colours without `{missing}` were ignored");
                    notes.add(&note, element.line);
                }
            }
        }
        None
    }

    /// The colour of the values of its columns.
    pub fn share(&self, values: [f64; 3]) -> [f32; 3] {
        std::array::from_fn(|k| (values[k] / self.full[k]) as f32)
    }
}

/// The value that stands for full light. Whole numbers are codes of 8 bits, whatever room they have, but for those
/// of `ushort`; so other programs write and read them.
fn full(t: Type) -> f64 {
    match t {
        Type::F32 | Type::F64 => 1.0,
        Type::U16 => 65_535.0,
        Type::I8 | Type::U8 | Type::I16 | Type::I32 | Type::U32 => 255.0,
    }
}

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
        let set = |names: [String; 2]| Some([scalar(&names[0])?, scalar(&names[1])?]);
        let set = |number: &str| {
            UV_NAMES.iter().find_map(|names| set(names.map(|name| format!("{name}{number}"))))
        };
        let position = three(["x", "y", "z"])
            .ok_or_else(|| Fault::new(element.line, "the vertices have no x, y and z"))?;
        Ok(Self {
            position,
            normal: three(["nx", "ny", "nz"]),
            uv: set(""),
            more_uvs: (1..=u8::MAX).map_while(|number| set(&number.to_string())).collect(),
            colour: ColourColumns::of(element, notes),
        })
    }

    /// The columns of all sets of texture coordinates, in their order.
    fn uv_sets(&self) -> impl Iterator<Item = [usize; 2]> {
        self.uv.iter().chain(&self.more_uvs).copied()
    }
}

impl Vertices {
    /// Room for `count` vertices.
    pub fn with_capacity(columns: &Columns, count: usize) -> Self {
        Self {
            positions: Vec::with_capacity(count),
            normals: columns.normal.map(|_| Vec::with_capacity(count)),
            uvs: columns.uv.map(|_| Vec::with_capacity(count)),
            more_uvs: columns.more_uvs.iter().map(|_| Vec::with_capacity(count)).collect(),
            colours: columns.colour.map(|_| Vec::with_capacity(count)),
        }
    }

    /// Adds the vertex with the given values, one a property (0 for lists).
    pub fn push(&mut self, columns: &Columns, values: &[f64]) {
        let vector = |at: [usize; 3]| DVec3::from_array(at.map(|i| values[i]));
        self.positions.push(vector(columns.position));
        if let (Some(normals), Some(at)) = (&mut self.normals, columns.normal) {
            normals.push(unit_or_zero(vector(at)));
        }
        let sets = self.uvs.iter_mut().chain(&mut self.more_uvs);
        for (uvs, [u, v]) in sets.zip(columns.uv_sets()) {
            uvs.push(Vec2::new(values[u] as f32, values[v] as f32));
        }
        if let (Some(colours), Some(columns)) = (&mut self.colours, &columns.colour) {
            colours.push(columns.share(columns.at.map(|i| values[i])));
        }
    }

    /// The first vertex with a position, texture coordinate or colour that is not finite.
    pub fn first_not_finite(&self) -> Option<(usize, &'static str)> {
        let position = self.positions.par_iter().position_first(|p| !p.is_finite());
        let sets = self.uvs.iter().chain(&self.more_uvs);
        let uv = sets.filter_map(|uvs| uvs.iter().position(|uv| !uv.is_finite())).min();
        let is_bad = |c: &[f32; 3]| c.iter().any(|c| !c.is_finite());
        let colour = self.colours.as_ref().and_then(|c| c.par_iter().position_first(is_bad));
        let found = [(position, "position"), (uv, "texture coordinate"), (colour, "colour")];
        let found = found.into_iter().filter_map(|(at, what)| Some((at?, what)));
        found.min_by_key(|(at, _)| *at)
    }

    /// How many vertices have a colour outside of 0 to 1.
    pub fn strayed_colours(&self) -> usize {
        let colours = self.colours.as_deref().unwrap_or_default();
        colours.par_iter().filter(|c| colours::strays(c)).count()
    }
}
