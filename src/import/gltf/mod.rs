//! glTF 2.0 (Khronos Group, 2017; ISO/IEC 12113): `.gltf` with files or data URIs, and `.glb`.
//!
//! Takes the bytes of a file and a time; gives the meshes, materials and lights of its scene in its own coordinates
//! (metres, y up), and the camera that it has. `docs/gltf.md` says what is read of it. The file is hostile until checked:
//! [`json`] gives every value a place for errors, [`accessor`] holds lengths against the bytes that are there, and what
//! is placed is counted before it is made.
//!
//! Tangents are not read: the renderer makes its own from texture coordinates, triangle by triangle.
//!
//! Not done: points and lines, compressed meshes and images, animation of anything but the camera.

mod accessor;
mod animation;
mod assemble;
mod camera;
mod component;
mod container;
mod deform;
mod document;
mod extensions;
mod image;
mod instances;
mod json;
mod light;
mod material;
mod node;
mod place;
mod primitive;
mod texture_info;
mod uri;

use super::model::{Model, ModelOptions};
use super::source::Notes;
use crate::error::{Diagnostic, Result};
use animation::Animations;
use assemble::Assembly;
use document::Document;
use node::Nodes;
use std::path::Path;

/// Whether a file of this name is taken for glTF.
pub(super) fn is_named(path: &Path) -> bool {
    path.extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("glb") || e.eq_ignore_ascii_case("gltf"))
}

/// Reads the glTF file `path`, which holds `bytes`. Normals are the file's, or none.
///
/// Errors: `Error::Input` with the place in the JSON; `Error::Io` for files beside it.
pub(super) fn read(path: &Path, bytes: &[u8], options: &ModelOptions) -> Result<Model> {
    let container = container::open(path, bytes)?;
    let value = document::parse(path, &container)?;
    let mut files = vec![path.to_path_buf()];
    let document = Document::open(path, &value, container.bin, &mut files)?;
    let mut notes = Notes::default();
    extensions::note_unread(&document.top, &mut notes)?;
    let nodes = Nodes::read(&document)?;
    node::note_scenes(&document, &mut notes)?;
    let animations = Animations::read(&document, &mut notes)?;
    let mut of_camera = Notes::default();
    let camera = camera::read(&document, &nodes, &animations, options, &mut of_camera)?;
    camera::note_moving(&document, &nodes, &animations, options.time, &mut notes)?;
    let model = Model { files, camera, ..Model::default() };
    let mut model =
        Assembly::of(&document, &nodes, (&animations, options.time), model, &mut notes)?.build()?;
    model.warnings_alone = of_camera.into_warnings(path);
    model.warnings.extend(light::brighten(&mut model.world, path));
    let is_empty = model.world.meshes.is_empty();
    if is_empty {
        model
            .warnings
            .push(Diagnostic::new(path, "the scene has no triangle: nothing will be seen"));
    }
    model.warnings.extend(notes.into_warnings(path));
    Ok(model)
}
