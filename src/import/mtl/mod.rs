//! Material libraries (MTL): `tobj` reads them behind [`front`], which checks every field first
//! (tobj 4.0.5 panics on `Kd 0.1 0.2`, accepts NaN and names no line); [`meaning`] turns them
//! into our materials.

mod front;
mod meaning;

use super::alpha::{self, MaskCache};
use super::model::Model;
use super::source::{self, Notes};
use super::texture::{self, ImageUse, TextureCache};
use crate::error::{Diagnostic, Result};
use crate::math::Rgb;
use crate::scene::{MaterialId, NormalMap, TextureMap};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// The note on a roughness that says nothing of the picture.
const ROUGHNESS_ALONE: &str =
    "`Pr` or `map_Pr` of what is no mirror (`illum 3` with `Ks`) is ignored";

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
        let mut notes = Notes::default();
        for (source, parsed) in front::read(file, bytes, &mut model.warnings)? {
            let has_roughness = source.roughness.is_some() || source.roughness_map.is_some();
            if has_roughness && meaning::mirror(&parsed).is_none() {
                notes.add(ROUGHNESS_ALONE, source.line);
            }
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
        model.warnings.extend(notes.into_warnings(file));
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
        let Self { entries, textures, masks, .. } = self;
        let Some(entry) = entries.get(name) else {
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
            match texture::load_cached(&file, ImageUse::Colour, textures, model) {
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
            match texture::load_cached(&file, data, textures, model) {
                Ok(id) => {
                    material.roughness_map = Some(TextureMap::of(id));
                    material.roughness = 1.0;
                }
                Err(error) => {
                    model.warnings.push(place(format!("roughness map left out: {error}")));
                }
            }
        }
        if let Some(bump) = entry.source.normal_map.as_ref() {
            let is_glass = material.glass.is_some();
            let normals = normal_map(&entry.library, bump, is_glass, textures, model);
            let warn = |message| model.warnings.push(place(message));
            material.normal_map = normals.map_err(warn).ok();
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
                false => alpha::load_cached(&file, masks, model),
            };
            let warn = |error| model.warnings.push(place(format!("cut-outs left out: {error}")));
            material.alpha = mask.map_err(warn).ok().map(TextureMap::of);
        }
        model.world.materials.push(material);
        Ok(model.world.materials.len() as MaterialId - 1)
    }
}

/// The normal map of an image; `Err` tells why there is none.
fn normal_map(
    library: &Path,
    bump: &front::BumpImage,
    is_glass: bool,
    textures: &mut TextureCache,
    model: &mut Model,
) -> std::result::Result<NormalMap, String> {
    let front::BumpImage { name, strength, is_normal, line } = bump;
    if is_glass {
        return Err(format!("glass has no normal map: that of line {line} is ignored"));
    }
    let file = source::beside(library, name);
    let before = model.world.textures.len();
    let id = texture::load_cached(&file, ImageUse::Normals, textures, model)
        .map_err(|error| format!("normal map left out: {error}"))?;
    let looks_like_normals = model.world.textures[id as usize].looks_like_normals();
    if !(looks_like_normals || *is_normal) {
        if model.world.textures.len() > before {
            model.world.textures.pop();
            textures.remove(&(file, ImageUse::Normals));
        }
        return Err(format!("{name} of line {line} holds heights, not normals: it is ignored"));
    }
    Ok(NormalMap { image: TextureMap::of(id), strength: *strength })
}
