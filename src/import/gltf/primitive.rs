//! Primitives: what of a mesh has one material, in the mesh's own coordinates.

use super::accessor::Accessor;
use super::document::Document;
use super::extensions;
use super::json::Json;
use crate::error::Result;
use crate::import::source::Notes;
use crate::math::DVec3;
use rayon::prelude::*;

/// Most vertices, and most triangles, of all that a file places in its scene: some 8 GB of memory.
pub(super) const MOST_PLACED: usize = 100_000_000;
/// Most primitives and morph targets of all that a file places, for they take time even where they are empty.
pub(super) const MOST_PIECES: usize = 4_000_000;

/// Triangles with what their vertices have, as the file has it.
pub(super) struct Primitive {
    pub positions: Vec<DVec3>,
    pub normals: Option<Vec<[f32; 3]>>,
    /// Sets of texture coordinates, (0, 0) at the upper left corner; `None` is one that the file lacks.
    pub uvs: Vec<Option<Vec<[f32; 2]>>>,
    /// Linear RGB.
    pub colours: Option<Vec<[f32; 3]>>,
    pub triangles: Vec<[u32; 3]>,
    /// Joints and weights of a skin, in sets of four a vertex.
    pub joints: Vec<JointSet>,
}

/// Four joints of each vertex, and their weights.
pub(super) type JointSet = (Vec<[u32; 4]>, Vec<[f32; 4]>);

/// Most sets of joints: 32 joints a vertex.
const MOST_SETS: usize = 8;

/// What is added to vertices in proportion to a weight.
pub(super) struct MorphTarget {
    pub positions: Option<Vec<[f32; 3]>>,
    pub normals: Option<Vec<[f32; 3]>>,
}

/// The kind of a primitive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mode {
    Triangles,
    Strip,
    Fan,
}

/// What a primitive takes before it is read.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Size {
    /// Vertices; each morph target has its own.
    pub vertices: usize,
    pub triangles: usize,
    /// Primitives and morph targets.
    pub pieces: usize,
}

impl Size {
    /// Both sizes.
    pub fn plus(self, other: Self) -> Self {
        Self {
            vertices: self.vertices.saturating_add(other.vertices),
            triangles: self.triangles.saturating_add(other.triangles),
            pieces: self.pieces.saturating_add(other.pieces),
        }
    }

    /// So many times this size.
    pub fn times(self, times: usize) -> Self {
        Self {
            vertices: self.vertices.saturating_mul(times),
            triangles: self.triangles.saturating_mul(times),
            pieces: self.pieces.saturating_mul(times),
        }
    }
}

/// The size of a primitive; points and lines count as a piece without vertices.
pub(super) fn size(document: &Document<'_>, json: &Json<'_>) -> Result<Size> {
    let empty = Size { pieces: 1, ..Size::default() };
    let Some(mode) = mode(json)? else { return Ok(empty) };
    let Some(position) = json.required("attributes")?.get("POSITION") else { return Ok(empty) };
    let accessor = &document.accessors[position.as_index(document.accessors.len(), "accessor")?];
    let is_there = accessor.get("bufferView").or(accessor.get("sparse")).is_some();
    // Without bytes all vertices would be zero.
    if let Some(fault) = extensions::packed(json).filter(|_| !is_there) {
        return Err(fault.into());
    }
    let vertices = Accessor::open(document, &position)?.count;
    let indices = match json.get("indices") {
        Some(indices) => Accessor::open(document, &indices)?.count,
        None => vertices,
    };
    let triangles = match mode {
        Mode::Triangles => indices / 3,
        Mode::Strip | Mode::Fan => indices.saturating_sub(2),
    };
    let pieces = 1 + json.list("targets")?.len();
    Ok(Size { vertices: vertices.saturating_mul(pieces), triangles, pieces })
}

fn mode(json: &Json<'_>) -> Result<Option<Mode>> {
    match json.whole("mode")? {
        None | Some(4) => Ok(Some(Mode::Triangles)),
        Some(5) => Ok(Some(Mode::Strip)),
        Some(6) => Ok(Some(Mode::Fan)),
        Some(0..=3) => Ok(None),
        Some(other) => Err(json.fault(format!("{other} is no mode of a primitive")).into()),
    }
}

/// Reads a primitive, with the sets `uv_sets` of its texture coordinates, in their order. `None` of what has no triangles, which is noted.
///
/// Errors: attributes of different lengths, indices that are out of range, numbers that are not finite.
pub(super) fn read(
    document: &Document<'_>,
    json: &Json<'_>,
    uv_sets: &[usize],
    notes: &mut Notes,
) -> Result<Option<Primitive>> {
    let Some(mode) = mode(json)? else {
        notes.add("points and lines have no surface to render: left out", None);
        return Ok(None);
    };
    let attributes = json.required("attributes")?;
    let Some(position) = attributes.get("POSITION") else {
        notes.add("a primitive without positions was left out", None);
        return Ok(None);
    };
    let reader = Reader { document, count: Accessor::open(document, &position)?.count };
    let material = json.index("material", document.materials.len(), "material")?;
    let mode_of_alpha = material.map(|at| document.materials[at].text("alphaMode")).transpose()?;
    // In glTF alpha does nothing to what is opaque.
    let has_alpha = mode_of_alpha.flatten().is_some_and(|mode| mode != "OPAQUE");
    let colours = reader.colours(&attributes, has_alpha, notes)?;
    let uv_set = |set: &usize| {
        let uvs = reader.accessor(&attributes, &format!("TEXCOORD_{set}"))?;
        uvs.map(|uv| uv.finite()).transpose()
    };
    Ok(Some(Primitive {
        positions: reader.required(&position)?.vectors()?,
        normals: reader.accessor(&attributes, "NORMAL")?.map(|n| n.floats()).transpose()?,
        uvs: uv_sets.iter().map(uv_set).collect::<Result<_>>()?,
        colours,
        triangles: reader.triangles(json, mode)?,
        joints: reader.joints(&attributes)?,
    }))
}

/// The morph target `json` of a primitive of `count` vertices.
///
/// Errors: attributes of another length, numbers that are not finite.
pub(super) fn target(
    document: &Document<'_>,
    json: &Json<'_>,
    count: usize,
) -> Result<MorphTarget> {
    let reader = Reader { document, count };
    let of = |name| reader.accessor(json, name)?.map(|accessor| accessor.finite()).transpose();
    Ok(MorphTarget { positions: of("POSITION")?, normals: of("NORMAL")? })
}

/// Reads attributes of as many elements as there are vertices.
struct Reader<'d> {
    document: &'d Document<'d>,
    count: usize,
}

impl<'d> Reader<'d> {
    fn required(&self, json: &Json<'_>) -> Result<Accessor<'d>> {
        let accessor = Accessor::open(self.document, json)?;
        if accessor.count != self.count {
            let (is, wanted) = (accessor.count, self.count);
            let message = format!("an attribute of {is} elements for {wanted} vertices");
            return Err(json.fault(message).into());
        }
        Ok(accessor)
    }

    fn accessor(&self, attributes: &Json<'_>, name: &str) -> Result<Option<Accessor<'d>>> {
        attributes.get(name).map(|json| self.required(&json)).transpose()
    }

    /// Vertex colours without their alpha, cut to 0 to 1.
    fn colours(
        &self,
        attributes: &Json<'_>,
        has_alpha: bool,
        notes: &mut Notes,
    ) -> Result<Option<Vec<[f32; 3]>>> {
        let Some(accessor) = self.accessor(attributes, "COLOR_0")? else { return Ok(None) };
        let colours = if accessor.width == 4 {
            let colours = accessor.finite::<4>()?;
            if has_alpha && colours.par_iter().any(|[.., alpha]| *alpha < 1.0) {
                notes.add("the alpha of vertex colours is ignored", None);
            }
            colours.into_par_iter().map(|[r, g, b, _]| [r, g, b]).collect()
        } else {
            accessor.finite::<3>()?
        };
        let strays = |colour: &&[f32; 3]| colour.iter().any(|c| !(0.0..=1.0).contains(c));
        let strayed = colours.par_iter().filter(strays).count();
        notes.add_many("vertex colours outside of 0 to 1 were cut to that", strayed, None);
        Ok(Some(colours.into_par_iter().map(|c| c.map(|c| c.clamp(0.0, 1.0))).collect()))
    }

    fn joints(&self, attributes: &Json<'_>) -> Result<Vec<JointSet>> {
        let mut sets = Vec::new();
        while let Some(joints) = self.accessor(attributes, &format!("JOINTS_{}", sets.len()))? {
            let name = format!("WEIGHTS_{}", sets.len());
            let weights = self.required(&attributes.required(&name)?)?;
            sets.push((joints.wholes()?, weights.finite()?));
            if sets.len() == MOST_SETS {
                break;
            }
        }
        Ok(sets)
    }

    /// Triangles, counter-clockwise seen from outside.
    fn triangles(&self, json: &Json<'_>, mode: Mode) -> Result<Vec<[u32; 3]>> {
        let count = self.count as u32;
        let Some(indices) = json.get("indices") else {
            return Ok(match mode {
                Mode::Triangles => {
                    (0..count / 3).into_par_iter().map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect()
                }
                Mode::Strip => strip(&(0..count).collect::<Vec<_>>()),
                Mode::Fan => fan(&(0..count).collect::<Vec<_>>()),
            });
        };
        let accessor = Accessor::open(self.document, &indices)?;
        let triangles = match mode {
            Mode::Triangles => accessor.triples()?,
            Mode::Strip => strip(&accessor.wholes::<1>()?.into_flattened()),
            Mode::Fan => fan(&accessor.wholes::<1>()?.into_flattened()),
        };
        let most = triangles.par_iter().map(|t| t[0].max(t[1]).max(t[2])).max();
        if most.is_none_or(|most| most < count) {
            return Ok(triangles);
        }
        let stray = triangles.iter().flatten().find(|index| **index >= count).unwrap_or(&count);
        Err(indices.fault(format!("there is no vertex {stray} (from 0), of {count}")).into())
    }
}

/// Triangles of a strip: every other one is turned, so that all face the same side.
fn strip(indices: &[u32]) -> Vec<[u32; 3]> {
    let triangle = |(at, t): (usize, &[u32])| match at % 2 {
        0 => [t[0], t[1], t[2]],
        _ => [t[1], t[0], t[2]],
    };
    indices.windows(3).enumerate().map(triangle).collect()
}

/// Triangles of a fan about its first vertex.
fn fan(indices: &[u32]) -> Vec<[u32; 3]> {
    let Some((first, rest)) = indices.split_first() else { return Vec::new() };
    rest.windows(2).map(|pair| [*first, pair[0], pair[1]]).collect()
}
