//! Reading the usual binary layouts in bulk: vertices of fixed size, faces that are all triangles.

use super::fields::decode;
use super::general::index_list;
use super::header::{Element, Format, Kind, Type};
use super::vertex::{Columns, Vertices};
use super::{Body, Contents, Faces};
use crate::import::normals::unit_or_zero;
use crate::math::{DVec3, Vec2};
use rayon::prelude::*;

/// Reads `element` at byte `at` and returns its size. `None` for other layouts and for errors: then the general
/// reader is used, which names the place of an error.
pub(super) fn read(
    body: &Body<'_>,
    element: &Element,
    at: usize,
    contents: &mut Contents,
) -> Option<usize> {
    if body.header.format == Format::Ascii || element.count == 0 {
        return None;
    }
    match element.name.as_str() {
        "vertex" => vertices(body, element, at, contents),
        "face" => triangles(body, element, at, contents),
        _ => None,
    }
}

fn vertices(
    body: &Body<'_>,
    element: &Element,
    at: usize,
    contents: &mut Contents,
) -> Option<usize> {
    let record = element.fixed_size()?;
    let size = record.checked_mul(element.count)?;
    let records = body.bytes.get(at..)?.get(..size)?;
    let columns = Columns::of(element, &mut contents.notes).ok()?;
    let mut offset = 0;
    let mut fields = Vec::with_capacity(element.properties.len());
    for property in &element.properties {
        let Kind::Scalar(t) = property.kind else { return None };
        fields.push((offset, t));
        offset += t.size();
    }
    let format = body.header.format;
    let value = |bytes: &[u8], column: usize| {
        let (offset, t) = fields[column];
        decode(t, format, &bytes[offset..offset + t.size()])
    };
    let vector = |bytes: &[u8], at: [usize; 3]| DVec3::from_array(at.map(|c| value(bytes, c)));
    let [x, y, z] = columns.position.map(|c| fields[c]);
    let chunks = records.par_chunks_exact(record);
    let plain = format == Format::Little && [x, y, z].iter().all(|(_, t)| *t == Type::F32);
    let positions = if plain && y.0 == x.0 + 4 && z.0 == x.0 + 8 {
        chunks.map(|bytes| three_floats(&bytes[x.0..])).collect()
    } else {
        chunks.map(|bytes| vector(bytes, columns.position)).collect()
    };
    let chunks = || records.par_chunks_exact(record);
    let normals = columns.normal.map(|n| chunks().map(|b| unit_or_zero(vector(b, n))).collect());
    let uv = |b: &[u8], [u, v]: [usize; 2]| Vec2::new(value(b, u) as f32, value(b, v) as f32);
    let set = |at| chunks().map(|bytes| uv(bytes, at)).collect();
    let (uvs, more_uvs) = (columns.uv.map(set), columns.more_uvs.into_iter().map(set).collect());
    let colours = columns.colour.map(|colour| {
        let share = |bytes: &[u8]| colour.share(colour.at.map(|column| value(bytes, column)));
        chunks().map(share).collect()
    });
    contents.vertices = Vertices { positions, normals, uvs, more_uvs, colours };
    Some(size)
}

#[inline]
fn three_floats(bytes: &[u8]) -> DVec3 {
    let float = |i: usize| {
        f64::from(f32::from_le_bytes([bytes[i], bytes[i + 1], bytes[i + 2], bytes[i + 3]]))
    };
    DVec3::new(float(0), float(4), float(8))
}

/// Faces with no property but the list, a count of one byte and indices of four.
fn triangles(
    body: &Body<'_>,
    element: &Element,
    at: usize,
    contents: &mut Contents,
) -> Option<usize> {
    const RECORD: usize = 13;
    let first = matches!(&contents.faces, Faces::Triangles(t) if t.is_empty());
    let list = Kind::List { count: Type::U8, item: element.properties.first()?.list_item()? };
    index_list(element).ok()?;
    let usual = element.properties.len() == 1
        && element.properties[0].kind == list
        && element.properties[0].list_item()?.size() == 4;
    let size = RECORD.checked_mul(element.count)?;
    let records = body.bytes.get(at..)?.get(..size)?;
    let big = body.header.format == Format::Big;
    let count = body.header.vertex_count();
    if !(first && usual) {
        return None;
    }
    let index = |bytes: &[u8], i: usize| {
        let bytes = [bytes[i], bytes[i + 1], bytes[i + 2], bytes[i + 3]];
        if big { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) }
    };
    let triangles: Vec<[u32; 3]> = records
        .par_chunks_exact(RECORD)
        .map(|bytes| [index(bytes, 1), index(bytes, 5), index(bytes, 9)])
        .collect();
    let good = records.par_chunks_exact(RECORD).all(|bytes| bytes[0] == 3)
        && triangles.par_iter().all(|t| t.iter().all(|i| (*i as usize) < count));
    if !good {
        return None;
    }
    contents.faces = Faces::Triangles(triangles);
    Some(size)
}
