//! EXT_mesh_gpu_instancing: one mesh at many places of a node.

use super::accessor::Accessor;
use super::animation::unit_rotation;
use super::document::Document;
use super::json::Json;
use crate::error::Result;
use crate::math::{DAffine3, DQuat, DVec3};

/// How many instances of its mesh a node has; `None` without the extension.
pub(super) fn count(document: &Document<'_>, node: &Json<'_>) -> Result<Option<usize>> {
    let Some(attributes) = attributes(node)? else { return Ok(None) };
    let mut count = None;
    for key in ["TRANSLATION", "ROTATION", "SCALE"] {
        let Some(json) = attributes.get(key) else { continue };
        let own = Accessor::open(document, &json)?.count;
        if count.is_some_and(|count| count != own) {
            return Err(json
                .fault(format!("{own} instances; other attributes have another number"))
                .into());
        }
        count = Some(own);
    }
    Ok(Some(count.unwrap_or(0)))
}

/// The places of a node's instances in its own coordinates.
///
/// Errors: those of [`count`]; numbers that are not finite.
pub(super) fn places(document: &Document<'_>, node: &Json<'_>) -> Result<Option<Vec<DAffine3>>> {
    let (Some(attributes), Some(count)) = (attributes(node)?, count(document, node)?) else {
        return Ok(None);
    };
    let open = |key| -> Result<Option<Accessor<'_>>> {
        attributes.get(key).map(|json| Accessor::open(document, &json)).transpose()
    };
    let translations = open("TRANSLATION")?.map(|all| all.finite::<3>()).transpose()?;
    let rotations: Option<Vec<[f32; 4]>> =
        open("ROTATION")?.map(|all| all.finite::<4>()).transpose()?;
    let scales = open("SCALE")?.map(|all| all.finite::<3>()).transpose()?;
    let vector = |list: &Option<Vec<[f32; 3]>>, at: usize, default: DVec3| {
        list.as_ref().map_or(default, |list| DVec3::from_array(list[at].map(f64::from)))
    };
    let place = |at: usize| {
        let rotation = rotations
            .as_ref()
            .map_or(DQuat::IDENTITY, |list| unit_rotation(list[at].map(f64::from)));
        let (translation, scale) =
            (vector(&translations, at, DVec3::ZERO), vector(&scales, at, DVec3::ONE));
        DAffine3::from_scale_rotation_translation(scale, rotation, translation)
    };
    Ok(Some((0..count).map(place).collect()))
}

fn attributes<'d>(node: &Json<'d>) -> Result<Option<Json<'d>>> {
    node.extension("EXT_mesh_gpu_instancing").map(|json| json.required("attributes")).transpose()
}
