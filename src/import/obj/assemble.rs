//! Assembling checked chunks into one mesh per material.

use super::face::{Faces, MISSING};
use super::parse::{Part, UNCOLOURED};
use crate::error::{Diagnostic, Result};
use crate::import::model::Model;
use crate::import::source::Fault;
use crate::import::{emission, lamps, mtl, polygon, tidy};
use crate::math::{DVec3, Rgb, Vec2, Vec3};
use crate::scene::{Corners, VertexColours, WorldMesh};
use rayon::prelude::*;
use std::collections::HashMap;
use std::ops::Range;
use std::path::Path;

/// The file's values, whole.
#[derive(Default)]
struct Values {
    positions: Vec<DVec3>,
    /// One for each position, or none at all.
    colours: Vec<[f32; 3]>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
}

/// Triangles as indices into [`Values`]; `vt` and `vn` are as long as `v`, or empty.
#[derive(Default)]
struct Triangles {
    v: Vec<[u32; 3]>,
    vt: Vec<[u32; 3]>,
    vn: Vec<[u32; 3]>,
}

/// Faces `faces` of a part have the group's material.
struct Segment {
    faces: Range<usize>,
    group: usize,
}

/// Materials in order of use; `None` is the default.
#[derive(Default)]
struct Groups {
    names: Vec<Option<(usize, String)>>,
    by_name: HashMap<Option<String>, usize>,
}

/// Adds the meshes and their materials to `model`.
pub(super) fn assemble(
    path: &Path,
    mut parts: Vec<Part>,
    libraries: &mut mtl::Libraries,
    model: &mut Model,
) -> Result<()> {
    let mut groups = Groups::default();
    let segments = groups.segments(&parts);
    let values = take_values(&mut parts);
    let pieces: Vec<Vec<(usize, Triangles)>> = parts
        .into_par_iter()
        .zip(segments)
        .map(|(part, segments)| triangulate(part, segments, &values))
        .collect::<std::result::Result<_, _>>()
        .map_err(|fault| fault.at(path))?;
    let triangles = collect(groups.names.len(), pieces, &values);

    libraries.read_images(groups.names.iter().flatten().map(|(_, name)| name.as_str()));
    let mut dropped = 0;
    let mut meshes = Builder::new(values, triangles.len());
    for (triangles, name) in triangles.into_iter().zip(groups.names) {
        let Some(mut mesh) = meshes.build(triangles, &mut dropped) else { continue };
        let coloured = mesh.colours.is_some();
        mesh.material = match &name {
            Some((line, name)) => libraries.material(path, *line, (name, coloured), model)?,
            None if coloured => model.coloured_material(),
            None => model.default_material(),
        };
        mesh.name = match name {
            Some((_, name)) => name,
            None => path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        };
        add(mesh, model);
    }
    model.warnings.extend(tidy::warning(path, dropped));
    if model.world.meshes.is_empty() && model.world.lights.is_empty() {
        model.warnings.push(Diagnostic::new(path, "no triangle is left: nothing will be seen"));
    }
    Ok(())
}

/// Adds a mesh, or lights in its place where it emits and is simple enough.
fn add(mesh: WorldMesh, model: &mut Model) {
    let material = &model.world.materials[mesh.material as usize];
    let radiance = material.emission;
    if radiance == Rgb::ZERO {
        model.world.meshes.push(mesh);
    } else {
        let lights = emission::is_mere_light(material).then(|| lamps::of_mesh(&mesh, radiance));
        let lights = lights.flatten();
        // Faces of what also reflects are lights; whether those of an image or with holes are, its texels say.
        let has_lit_faces = material.emission_map.is_none() && material.alpha.is_none();
        model.has_lamps |= lights.is_some() || has_lit_faces;
        match lights {
            Some(lights) => model.world.lights.extend(lights),
            None => model.world.meshes.push(mesh),
        }
    }
}

impl Groups {
    fn id(&mut self, name: Option<(usize, String)>) -> usize {
        let key = name.as_ref().map(|(_, name)| name.clone());
        *self.by_name.entry(key).or_insert_with(|| {
            self.names.push(name);
            self.names.len() - 1
        })
    }

    /// For each part the segments of faces with one material; a material stays selected across parts.
    fn segments(&mut self, parts: &[Part]) -> Vec<Vec<Segment>> {
        let mut current = None;
        let mut all = Vec::with_capacity(parts.len());
        for part in parts {
            let mut segments = Vec::new();
            let mut from = 0;
            let faces = part.faces.ends.len();
            let last = std::iter::once((faces, None));
            let changes = part.materials.iter().map(|(at, line, name)| (*at, Some((*line, name))));
            for (at, next) in changes.chain(last) {
                if at > from {
                    segments.push(Segment { faces: from..at, group: self.id(current.clone()) });
                    from = at;
                }
                if let Some((line, name)) = next {
                    current = (!name.is_empty()).then(|| (line, name.clone()));
                }
            }
            all.push(segments);
        }
        all
    }
}

/// Joins the parts' values. If some corners lack an attribute that others have, a value is appended
/// for them; a zero normal means flat shading there.
fn take_values(parts: &mut [Part]) -> Values {
    let mut values = Values::default();
    for part in &mut *parts {
        if !part.colours.is_empty() {
            values.colours.resize(values.positions.len(), UNCOLOURED);
            append(&mut values.colours, &mut part.colours);
        }
        append(&mut values.positions, &mut part.positions);
        append(&mut values.uvs, &mut part.uvs);
        append(&mut values.normals, &mut part.normals);
    }
    if !values.colours.is_empty() {
        values.colours.resize(values.positions.len(), UNCOLOURED);
    }
    values.uvs.push(Vec2::ZERO);
    values.normals.push(Vec3::ZERO);
    values
}

/// Moves `from` to the end of `to`, without a copy where `to` is empty.
fn append<T>(to: &mut Vec<T>, from: &mut Vec<T>) {
    if to.is_empty() {
        std::mem::swap(to, from);
    } else {
        to.append(from);
    }
    from.shrink_to_fit();
}

fn triangulate(
    part: Part,
    segments: Vec<Segment>,
    values: &Values,
) -> std::result::Result<Vec<(usize, Triangles)>, Fault> {
    let (mut local, mut corners) = (Vec::new(), Vec::new());
    let mut pieces: Vec<(usize, Triangles)> = Vec::with_capacity(segments.len());
    for segment in segments {
        let mut out = Triangles::default();
        for face in segment.faces {
            let start = if face == 0 { 0 } else { part.faces.ends[face - 1] as usize };
            let end = part.faces.ends[face] as usize;
            local.clear();
            if end - start == 3 {
                local.push([0, 1, 2]);
            } else {
                corners.clear();
                corners
                    .extend(part.faces.v[start..end].iter().map(|v| values.positions[*v as usize]));
                polygon::triangulate(&corners, &mut local).map_err(|message| {
                    let large = part.faces.large.iter().find(|(number, _)| *number == face);
                    Fault::new(large.map_or(0, |(_, line)| *line), message)
                })?;
            }
            out.extend(&part.faces, start, &local, values);
        }
        pieces.push((segment.group, out));
    }
    Ok(pieces)
}

impl Triangles {
    fn extend(&mut self, faces: &Faces, start: usize, local: &[[u32; 3]], values: &Values) {
        let pick = |list: &[u32], missing: u32, t: &[u32; 3]| {
            t.map(|i| match list[start + i as usize] {
                MISSING => missing,
                index => index,
            })
        };
        self.v.extend(local.iter().map(|t| pick(&faces.v, 0, t)));
        if !faces.vt.is_empty() {
            let missing = values.uvs.len() as u32 - 1;
            self.vt.extend(local.iter().map(|t| pick(&faces.vt, missing, t)));
        }
        if !faces.vn.is_empty() {
            let missing = values.normals.len() as u32 - 1;
            self.vn.extend(local.iter().map(|t| pick(&faces.vn, missing, t)));
        }
    }

    fn append(&mut self, mut more: Self, values: &Values) {
        let lists = [
            (&mut self.vt, &mut more.vt, values.uvs.len() as u32 - 1),
            (&mut self.vn, &mut more.vn, values.normals.len() as u32 - 1),
        ];
        for (list, more_list, missing) in lists {
            if !list.is_empty() || !more_list.is_empty() {
                list.resize(self.v.len(), [missing; 3]);
                more_list.resize(more.v.len(), [missing; 3]);
                append(list, more_list);
            }
        }
        append(&mut self.v, &mut more.v);
    }
}

fn collect(groups: usize, pieces: Vec<Vec<(usize, Triangles)>>, values: &Values) -> Vec<Triangles> {
    let mut all: Vec<Triangles> = (0..groups).map(|_| Triangles::default()).collect();
    for (group, piece) in pieces.into_iter().flatten() {
        all[group].append(piece, values);
    }
    all
}

/// Makes meshes that hold only the values that they use.
struct Builder {
    values: Values,
    /// With one group only, the values are its own: no copy.
    only_one: bool,
    scratch: Vec<u32>,
}

impl Builder {
    fn new(values: Values, groups: usize) -> Self {
        Self { values, only_one: groups == 1, scratch: Vec::new() }
    }

    fn build(&mut self, triangles: Triangles, dropped: &mut usize) -> Option<WorldMesh> {
        let Triangles { mut v, vt, vn } = triangles;
        let mut vt = (!vt.is_empty()).then_some(vt);
        let mut vn = (!vn.is_empty()).then_some(vn);
        *dropped += tidy::drop_degenerate(&self.values.positions, &mut v, &mut [&mut vt, &mut vn]);
        if v.is_empty() {
            return None;
        }
        let Self { values, only_one, scratch } = self;
        let colours = (!values.colours.is_empty()).then(|| {
            let mut v = v.clone();
            tidy::compact(&mut values.colours, &mut v, *only_one, scratch)
        });
        let positions = tidy::compact(&mut values.positions, &mut v, *only_one, scratch);
        let attribute = |corners: Vec<[u32; 3]>| (corners != v).then_some(corners);
        let mut bare_triangles = 0;
        let uvs = vt.and_then(|mut vt| {
            let missing = values.uvs.len() as u32 - 1;
            vt.iter().flatten().any(|i| *i != missing).then(|| {
                bare_triangles = vt.iter().filter(|t| t.contains(&missing)).count();
                let values = tidy::compact(&mut values.uvs, &mut vt, *only_one, scratch);
                Corners { values, corners: attribute(vt) }
            })
        });
        let normals = vn.and_then(|mut vn| {
            let missing = values.normals.len() as u32 - 1;
            vn.iter().flatten().any(|i| *i != missing).then(|| {
                let values = tidy::compact(&mut values.normals, &mut vn, *only_one, scratch);
                Corners { values, corners: attribute(vn) }
            })
        });
        let colours = colours.and_then(known_colours);
        let mesh = WorldMesh::new("", positions, v, 0);
        Some(WorldMesh { normals, uvs, bare_triangles, colours, ..mesh })
    }
}

/// The colours of a mesh whose vertices have any; those that have none are white.
fn known_colours(mut shares: Vec<[f32; 3]>) -> Option<VertexColours> {
    let is_known = |colour: &[f32; 3]| !colour[0].is_nan();
    if !shares.iter().any(is_known) {
        return None;
    }
    shares.iter_mut().filter(|colour| !is_known(colour)).for_each(|colour| *colour = [1.0; 3]);
    Some(VertexColours::from_encoded(&shares))
}
