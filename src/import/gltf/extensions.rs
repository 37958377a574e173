//! Extensions: which are read, which say nothing about the picture, and what to do about the rest.

use super::json::Json;
use super::uri::shortened;
use crate::error::{Diagnostic, Result};
use crate::import::source::Notes;
use std::collections::BTreeSet;

/// Extensions that are read.
const READ: [&str; 13] = [
    "EXT_mesh_gpu_instancing",
    "KHR_animation_pointer",
    "KHR_lights_punctual",
    "KHR_materials_clearcoat",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_texture_transform",
];

/// Extensions that say nothing about the picture.
const NOT_SEEN: [&str; 19] = [
    "AGI_articulations",
    "AGI_stk_metadata",
    "EXT_instance_features",
    "EXT_mesh_features",
    "EXT_structural_metadata",
    "FB_ngon_encoding",
    "KHR_audio",
    "KHR_audio_emitter",
    "KHR_implicit_shapes",
    "KHR_interactivity",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "KHR_physics_rigid_bodies",
    "KHR_xmp",
    "KHR_xmp_json_ld",
    // Coarser meshes and materials for what is far away.
    "MSFT_lod",
    "MSFT_packing_normalRoughnessMetallic",
    "MSFT_packing_occlusionRoughnessMetallic",
    "OMI_physics_body",
];

/// Choices of materials, of which the file's own first one is shown.
const VARIANTS: &str = "KHR_materials_variants";

/// Extensions that hold what the file may have in a readable form too, and how to get it so.
const PACKED: [(&str, &str); 7] = [
    (
        "KHR_draco_mesh_compression",
        "export it again without Draco: untick Compression in the exporter",
    ),
    (
        "EXT_meshopt_compression",
        "export it again without meshopt compression (gltfpack: without -c)",
    ),
    (
        "KHR_meshopt_compression",
        "export it again without meshopt compression (gltfpack: without -c)",
    ),
    (
        "KHR_texture_basisu",
        "export it again with png or jpeg images, not KTX2 (gltfpack: without -tc)",
    ),
    ("EXT_texture_webp", "export it again with png or jpeg images: untick WebP in the exporter"),
    ("EXT_texture_avif", "export it again with png or jpeg images, not AVIF"),
    ("MSFT_texture_dds", "export it again with png or jpeg images, not DDS"),
];

/// Extensions of which what is lost can be told.
const LOST: [(&str, &str); 3] = [
    (
        "KHR_materials_pbrSpecularGlossiness",
        "colours and images of such materials are lost unless they have `pbrMetallicRoughness` too: convert the file to metallic-roughness",
    ),
    (
        "EXT_lights_image_based",
        "the environment that lights the scene is lost: give it by `sky` in a scene file",
    ),
    ("EXT_lights_ies", "the profiles of its lights are lost"),
];

/// Refuses extensions that the file requires and that are not read.
pub(super) fn check_required(top: &Json<'_>) -> Result<()> {
    for json in top.list("extensionsRequired")? {
        let name = json.as_text()?;
        if READ.contains(&name) || NOT_SEEN.contains(&name) || name == VARIANTS {
            continue;
        }
        let message =
            format!("the file requires the extension `{}`, which is not read", shortened(name));
        let help = how_to_avoid(name).unwrap_or("export it again without this extension");
        return Err(json.fault(message).help(help).into());
    }
    Ok(())
}

/// Notes the extensions that objects of the file have and that are not read, whatever its list of them says.
pub(super) fn note_unread(top: &Json<'_>, notes: &mut Notes) -> Result<()> {
    let mut names = BTreeSet::new();
    top.collect_extensions(&mut names);
    for name in names {
        if READ.contains(&name) || NOT_SEEN.contains(&name) || how_to_avoid(name).is_some() {
            continue;
        }
        if name == VARIANTS {
            note_variants(top, notes)?;
            continue;
        }
        let lost = LOST.iter().find(|(lost, _)| *lost == name);
        let lost = lost.map_or("the picture may differ", |(_, lost)| lost);
        notes.add(&format!("the extension `{}` is not read: {lost}", shortened(name)), None);
    }
    Ok(())
}

/// What to do about `json`, which has none of what it needs but in a packed form; `None` of what has no such form.
pub(super) fn packed(json: &Json<'_>) -> Option<Diagnostic> {
    let (name, help) = PACKED.iter().find(|(name, _)| json.extension(name).is_some())?;
    Some(json.fault(format!("`{name}` is not read, and there is nothing else")).help(*help))
}

/// What to do about the image `bytes` of `json` in a format that is not read; `None` of others.
pub(super) fn packed_image(json: &Json<'_>, bytes: &[u8]) -> Option<Diagnostic> {
    let (format, extension) = match bytes {
        [0xab, b'K', b'T', b'X', ..] => ("KTX", "KHR_texture_basisu"),
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => {
            ("WebP", "EXT_texture_webp")
        }
        [_, _, _, _, b'f', b't', b'y', b'p', b'a', b'v', b'i', ..] => ("AVIF", "EXT_texture_avif"),
        [b'D', b'D', b'S', b' ', ..] => ("DDS", "MSFT_texture_dds"),
        _ => return None,
    };
    let fault = json.fault(format!("the image is {format}, which is not read"));
    Some(fault.help(how_to_avoid(extension).unwrap_or_default()))
}

fn how_to_avoid(name: &str) -> Option<&'static str> {
    PACKED.iter().find(|(packed, _)| *packed == name).map(|(_, help)| *help)
}

/// Most variants that a note names.
const MOST_NAMES: usize = 10;

fn note_variants(top: &Json<'_>, notes: &mut Notes) -> Result<()> {
    let variants = top.extension(VARIANTS).map(|json| json.list("variants"));
    let variants = variants.transpose()?.unwrap_or_default();
    let mut names = Vec::new();
    for variant in variants.iter().take(MOST_NAMES) {
        names.push(shortened(variant.text("name")?.unwrap_or_default()));
    }
    if names.is_empty() {
        return Ok(());
    }
    let more = if variants.len() > MOST_NAMES { ", …" } else { "" };
    let names = names.join(", ");
    let note = format!(
        "materials have variants ({names}{more}), which are not read: each mesh has its own material, or is grey where it has only variants"
    );
    notes.add(&note, None);
    Ok(())
}
