//! Material libraries (MTL): `tobj` reads them behind [`front`], which checks every field first
//! (tobj 4.0.5 panics on `Kd 0.1 0.2`, accepts NaN and names no line); [`meaning`] turns them
//! into our materials.

mod front;
mod meaning;

use super::alpha::{self, MaskCache};
use super::model::Model;
use super::source;
use super::texture::{self, ImageUse, TextureCache};
use crate::error::{Diagnostic, Result};
use crate::math::Rgb;
use crate::scene::{MaterialId, TextureMap};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// The materials of the libraries of an OBJ file, by name, before use.
#[derive(Default)]
pub(super) struct Libraries {
    entries: HashMap<String, Entry>,
    textures: TextureCache,
    masks: MaskCache,
    loaded: Vec<PathBuf>,
}

struct Entry {
    library: PathBuf,
    source: front::Source,
    parsed: tobj::Material,
}

impl Libraries {
    /// Reads the files of `mtllib NAMES` on `line` of `obj`: one file, whose name may hold
    /// blanks, or else several. A missing file gives a warning.
    ///
    /// Errors: an invalid library, with the line.
    pub fn load(&mut self, obj: &Path, line: usize, names: &str, model: &mut Model) -> Result<()> {
        let whole = source::beside(obj, names);
        let several = !whole.is_file() && names.split_whitespace().count() > 1;
        let files: Vec<PathBuf> = if several {
            names.split_whitespace().map(|name| source::beside(obj, name)).collect()
        } else {
            vec![whole]
        };
        for file in files {
            if self.loaded.contains(&file) {
                continue;
            }
            self.loaded.push(file.clone());
            match source::read(&file) {
                Ok(bytes) => self.parse(&file, &bytes, model)?,
                Err(error) => model.warnings.push(
                    Diagnostic::new(obj, format!("material library left out: {error}")).line(line),
                ),
            }
        }
        Ok(())
    }

    fn parse(&mut self, file: &Path, bytes: &[u8], model: &mut Model) -> Result<()> {
        model.files.push(file.to_path_buf());
        for (source, parsed) in front::read(file, bytes, &mut model.warnings)? {
            let name = source.name.clone();
            let entry = Entry { library: file.to_path_buf(), source, parsed };
            if let Some(other) = self.entries.get(&name) {
                let message = format!(
                    "material `{name}` is defined again; {}:{} holds",
                    other.library.display(),
                    other.source.line
                );
                let place = Diagnostic::new(file, message).line(entry.source.line);
                model.warnings.push(place);
            } else {
                self.entries.insert(name, entry);
            }
        }
        Ok(())
    }

    /// Adds the material that `usemtl NAME` on `line` of `obj` asks for to the model's world,
    /// and its images. An unknown name is a warning, and the default material. A `coloured` mesh shows its
    /// vertex colours, times `Kd`, unless there is a texture.
    pub fn material(
        &mut self,
        obj: &Path,
        line: usize,
        (name, coloured): (&str, bool),
        model: &mut Model,
    ) -> Result<MaterialId> {
        let Some(entry) = self.entries.get(name) else {
            let message = format!("no material `{name}`: plain grey in its place");
            model.warnings.push(Diagnostic::new(obj, message).line(line));
            return Ok(match coloured {
                true => model.coloured_material(),
                false => model.default_material(),
            });
        };
        let place = |message: String| {
            Diagnostic::new(&entry.library, format!("material `{name}`: {message}"))
                .line(entry.source.line)
        };
        let (mut material, notes) = meaning::of(&entry.source, &entry.parsed);
        model.warnings.extend(notes.into_iter().map(place));
        if let Some(image) = &entry.parsed.diffuse_texture {
            let file = source::beside(&entry.library, image);
            match texture::load_cached(&file, ImageUse::Colour, &mut self.textures, model) {
                Ok(id) => {
                    material.texture = Some(TextureMap::of(id));
                    material.diffuse = meaning::textured(&entry.parsed);
                }
                Err(error) => {
                    model.warnings.push(place(format!("texture left out: {error}")));
                }
            }
        }
        let rough = entry.source.roughness_map.as_ref().filter(|_| material.mirror != Rgb::ZERO);
        if let Some((image, channel)) = rough {
            let file = source::beside(&entry.library, image);
            let data = ImageUse::Data(*channel);
            match texture::load_cached(&file, data, &mut self.textures, model) {
                Ok(id) => {
                    material.roughness_map = Some(TextureMap::of(id));
                    material.roughness = 1.0;
                }
                Err(error) => {
                    model.warnings.push(place(format!("roughness map left out: {error}")));
                }
            }
        }
        if coloured && material.texture.is_some() {
            let message = "the texture is shown, the vertex colours are not";
            model.warnings.push(place(message.into()));
        } else if coloured && material.diffuse != Rgb::ZERO {
            material.vertex_colours = true;
            if entry.parsed.diffuse.is_none() {
                material.diffuse = Rgb::ONE;
            }
        }
        if let Some(image) = &entry.parsed.dissolve_texture {
            let file = source::beside(&entry.library, image);
            let is_glass = material.glass.is_some();
            let mask = match is_glass {
                true => Err("glass has none, `map_d` is ignored".into()),
                false => alpha::load_cached(&file, &mut self.masks, model),
            };
            let warn = |error| model.warnings.push(place(format!("cut-outs left out: {error}")));
            material.alpha = mask.map_err(warn).ok().map(TextureMap::of);
        }
        model.world.materials.push(material);
        Ok(model.world.materials.len() as MaterialId - 1)
    }
}
