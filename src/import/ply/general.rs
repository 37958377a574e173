//! Any element of any layout, record by record.

use super::fields::Fields;
use super::header::{Element, Format, Kind, Property, Type};
use super::vertex::{Columns, Vertices};
use super::{Body, Contents, Faces};
use crate::import::source::Fault;

/// Names of the list of a face's or strip's vertices.
pub(super) const INDEX_NAMES: [&str; 2] = ["vertex_indices", "vertex_index"];

/// Reads `element` from byte and line `at`; gives the place after it.
pub(super) fn read(
    body: &Body<'_>,
    element: &Element,
    at: (usize, usize),
    contents: &mut Contents,
) -> Result<(usize, usize), Fault> {
    let mut fields = Fields::new(body.bytes, body.header.format, at);
    match element.name.as_str() {
        "vertex" => vertices(&mut fields, element, contents)?,
        "face" => lists(&mut fields, element, body, contents, push_face)?,
        "tristrips" => lists(&mut fields, element, body, contents, push_strip)?,
        name => {
            contents.notes.add(&format!("element `{name}` was skipped"), element.line);
            skip(&mut fields, element, body.header.format)?;
        }
    }
    Ok(fields.place())
}

fn vertices(
    fields: &mut Fields<'_>,
    element: &Element,
    contents: &mut Contents,
) -> Result<(), Fault> {
    let columns = Columns::of(element, &mut contents.notes)?;
    let mut out = Vertices::with_capacity(&columns, element.count);
    let mut values = vec![0.0; element.properties.len()];
    for _ in 0..element.count {
        fields.start()?;
        for (value, property) in values.iter_mut().zip(&element.properties) {
            match property.kind {
                Kind::Scalar(t) => *value = fields.value(t)?,
                Kind::List { count, item } => skip_list(fields, count, item)?,
            }
        }
        fields.end()?;
        out.push(&columns, &values);
    }
    contents.vertices = out;
    Ok(())
}

fn skip(fields: &mut Fields<'_>, element: &Element, format: Format) -> Result<(), Fault> {
    if let (Some(size), true) = (element.fixed_size(), format != Format::Ascii) {
        return fields.skip(Type::U8, size * element.count);
    }
    for _ in 0..element.count {
        fields.start()?;
        for property in &element.properties {
            skip_property(fields, property)?;
        }
        fields.end()?;
    }
    Ok(())
}

fn skip_property(fields: &mut Fields<'_>, property: &Property) -> Result<(), Fault> {
    match property.kind {
        Kind::Scalar(t) => fields.skip(t, 1),
        Kind::List { count, item } => skip_list(fields, count, item),
    }
}

fn skip_list(fields: &mut Fields<'_>, count: Type, item: Type) -> Result<(), Fault> {
    let length = fields.list_length(count, item)?;
    fields.skip(item, length)
}

type Push = fn(&[i64], usize, &mut Vec<u32>, &mut Vec<u32>) -> Result<(), String>;

/// Reads the vertex lists of an element; `push` makes faces of each.
fn lists(
    fields: &mut Fields<'_>,
    element: &Element,
    body: &Body<'_>,
    contents: &mut Contents,
    push: Push,
) -> Result<(), Fault> {
    let at = index_list(element)?;
    let vertices = body.header.vertex_count();
    let (mut indices, mut ends) = std::mem::take(&mut contents.faces).into_polygons();
    let mut list = Vec::new();
    for _ in 0..element.count {
        fields.start()?;
        for (number, property) in element.properties.iter().enumerate() {
            let Kind::List { count, item } = property.kind else {
                skip_property(fields, property)?;
                continue;
            };
            let length = fields.list_length(count, item)?;
            if number != at {
                fields.skip(item, length)?;
                continue;
            }
            list.clear();
            for _ in 0..length {
                list.push(whole(fields.value(item)?).map_err(|m| fields.fault(m))?);
            }
            push(&list, vertices, &mut indices, &mut ends).map_err(|m| fields.fault(m))?;
        }
        fields.end()?;
        if indices.len() >= u32::MAX as usize {
            return Err(fields.fault("more than 4294967294 face corners"));
        }
    }
    if element.name == "face" && element.properties.iter().any(|p| p.name == "texcoord") {
        contents.notes.add("texture coordinates of face corners were ignored", element.line);
    }
    if element.name == "face" && element.properties.iter().any(|p| p.name == "red") {
        contents.notes.add("colours of faces were ignored", element.line);
    }
    contents.faces = Faces::Polygons { indices, ends };
    Ok(())
}

/// Which property is the list of vertices.
///
/// Errors: none, or one of fractions.
pub(super) fn index_list(element: &Element) -> Result<usize, Fault> {
    let is = |p: &Property| INDEX_NAMES.contains(&p.name.as_str());
    let at = element.properties.iter().position(is).ok_or_else(|| {
        Fault::new(element.line, format!("`{}` has no list `vertex_indices`", element.name))
    })?;
    let property = &element.properties[at];
    match property.kind {
        Kind::List { item, .. } if item.is_integer() => Ok(at),
        _ => Err(Fault::new(
            property.line,
            format!("`{}` is no list of whole numbers", property.name),
        )),
    }
}

fn whole(value: f64) -> Result<i64, String> {
    if value.fract() != 0.0 || value.abs() > 1e15 {
        return Err(format!("{value} is no vertex index"));
    }
    Ok(value as i64)
}

fn vertex(index: i64, vertices: usize) -> Result<u32, String> {
    if (0..vertices as i64).contains(&index) {
        return Ok(index as u32);
    }
    Err(format!("vertex index {index}, but the file has only {vertices} (from 0)"))
}

fn push_face(
    list: &[i64],
    vertices: usize,
    indices: &mut Vec<u32>,
    ends: &mut Vec<u32>,
) -> Result<(), String> {
    if list.len() < 3 {
        return Err(format!("a face with {} corners; 3 is the least", list.len()));
    }
    for index in list {
        indices.push(vertex(*index, vertices)?);
    }
    ends.push(indices.len() as u32);
    Ok(())
}

/// Strips: each vertex makes a triangle with the two before it, every other one reversed; −1
/// starts anew. Triangles that repeat a vertex only join strips and count as nothing.
fn push_strip(
    list: &[i64],
    vertices: usize,
    indices: &mut Vec<u32>,
    ends: &mut Vec<u32>,
) -> Result<(), String> {
    for strip in list.split(|i| *i == -1) {
        for index in strip {
            vertex(*index, vertices)?;
        }
        for (number, window) in strip.windows(3).enumerate() {
            let [a, b, c] = [window[0], window[1], window[2]].map(|i| i as u32);
            if a == b || b == c || a == c {
                continue;
            }
            indices.extend(if number % 2 == 0 { [a, b, c] } else { [b, a, c] });
            ends.push(indices.len() as u32);
        }
    }
    Ok(())
}
