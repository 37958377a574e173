//! Material libraries (MTL): `tobj` reads them behind [`front`], which checks every field first
//! (tobj 4.0.5 panics on `Kd 0.1 0.2`, accepts NaN and names no line); [`meaning`] turns them
//! into our materials.

mod front;
mod image;
mod meaning;

use super::images::{ImageUse, Images};
use super::model::Model;
use super::source;
use crate::error::{Diagnostic, Error, Result};
use crate::math::Rgb;
use crate::scene::{Material, MaterialId, NormalMap, TextureMap};
use front::BumpImage;
use image::MapImage;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The materials of the libraries of an OBJ file, by name, before use.
#[derive(Default)]
pub(super) struct Libraries {
    entries: HashMap<String, Entry>,
    images: Images,
    loaded: Vec<PathBuf>,
}

struct Entry {
    library: PathBuf,
    source: front::Source,
    parsed: tobj::Material,
}

/// The images that a material takes.
struct Taken<'s> {
    texture: Option<&'s MapImage>,
    roughness: Option<&'s MapImage>,
    metallic: Option<&'s MapImage>,
    emission: Option<&'s MapImage>,
    normals: Option<&'s BumpImage>,
    mask: Option<&'s MapImage>,
}

impl Entry {
    /// The images that count in `material`, as [`meaning::of`] has it: only mirrors, layers and glass are rough, only layers are metal, glass has no texture, no
    /// normal map and no cut-outs.
    fn taken(&self, material: &Material) -> Taken<'_> {
        let front::Source { texture, roughness_map, metallic_map, normal_map, .. } = &self.source;
        let front::Source { emission_map, mask, .. } = &self.source;
        let is_glass = material.glass.is_some();
        Taken {
            texture: texture.as_ref().filter(|_| !is_glass),
            roughness: roughness_map.as_ref().filter(|_| material.mirror != Rgb::ZERO || is_glass),
            metallic: metallic_map.as_ref().filter(|_| material.fresnel.is_some()),
            emission: emission_map.as_ref(),
            normals: normal_map.as_ref().filter(|_| !is_glass),
            mask: mask.as_ref().filter(|_| !is_glass),
        }
    }

    /// The files of the images that the material takes, with what they serve as.
    fn images(&self) -> impl Iterator<Item = (PathBuf, ImageUse)> {
        let Taken { texture, roughness, metallic, emission, normals, mask } =
            self.taken(&meaning::of(&self.source, &self.parsed).0);
        let images = [
            texture.map(|image| (image, ImageUse::Colour)),
            roughness.map(|image| (image, data(image))),
            metallic.map(|image| (image, data(image))),
            emission.map(|image| (image, ImageUse::Light)),
            normals.map(|bump| (&bump.image, ImageUse::Normals)),
            mask.map(|image| (image, ImageUse::Mask)),
        ];
        images.into_iter().flatten().map(|(image, what)| (self.file(image), what))
    }

    /// The file of an image; of one in a folder of another machine the one of its name beside the library.
    fn file(&self, image: &MapImage) -> PathBuf {
        let named = source::beside(&self.library, &image.name);
        let is_whole = image.name.starts_with(['/', '\\']) || image.name.get(1..2) == Some(":");
        let own = image.name.rsplit(['/', '\\']).next().unwrap_or_default();
        let near = source::beside(&self.library, own);
        if is_whole && !named.exists() && near.is_file() { near } else { named }
    }

    /// The image as it lies on the surface, entered in the model's world.
    fn lay(
        &self,
        image: &MapImage,
        what: ImageUse,
        images: &mut Images,
        model: &mut Model,
    ) -> std::result::Result<TextureMap, Arc<Error>> {
        let Model { world, files, .. } = model;
        images.place(&self.file(image), what, world, files).map(|id| image.options.map(id))
    }

    /// The same, or a warning that what `name` names is left out.
    fn lay_or_warn(
        &self,
        image: &MapImage,
        (what, name): (ImageUse, &str),
        images: &mut Images,
        model: &mut Model,
    ) -> Option<TextureMap> {
        let map = self.lay(image, what, images, model);
        let warn = |error| model.warnings.push(self.warning(format!("{name} left out: {error}")));
        map.map_err(warn).ok()
    }

    /// A warning about the material.
    fn warning(&self, message: String) -> Diagnostic {
        let Self { library, source, .. } = self;
        Diagnostic::new(library, format!("material `{}`: {message}", source.name)).line(source.line)
    }

    /// The normal map of an image; `Err` tells why there is none.
    fn normal_map(
        &self,
        bump: &BumpImage,
        images: &mut Images,
        model: &mut Model,
    ) -> std::result::Result<NormalMap, String> {
        let BumpImage { image, is_normal, line } = bump;
        let looks = images.looks_like_normals(&self.file(image), ImageUse::Normals);
        if looks == Some(false) && !is_normal {
            let name = &image.name;
            return Err(format!("{name} of line {line} holds heights, not normals: it is ignored"));
        }
        let map = self.lay(image, ImageUse::Normals, images, model);
        let map = map.map_err(|error| format!("normal map left out: {error}"))?;
        Ok(NormalMap { image: map, strength: image.options.strength })
    }
}

/// What the image of a roughness or of metal serves as.
fn data(image: &MapImage) -> ImageUse {
    ImageUse::Data(image.options.channel)
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

    /// Decodes the images of the materials of these names, each once and on all threads.
    pub fn read_images<'n>(&mut self, names: impl Iterator<Item = &'n str>) {
        let wanted = names.filter_map(|name| self.entries.get(name)).flat_map(Entry::images);
        self.images.read(wanted);
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
        let Self { entries, images, .. } = self;
        let Some(entry) = entries.get(name) else {
            let message = format!("no material `{name}`: plain grey in its place");
            model.warnings.push(Diagnostic::new(obj, message).line(line));
            return Ok(match coloured {
                true => model.coloured_material(),
                false => model.default_material(),
            });
        };
        let (mut material, notes) = meaning::of(&entry.source, &entry.parsed);
        model.warnings.extend(notes.into_iter().map(|note| entry.warning(note)));
        let Taken { texture, roughness, metallic, emission, normals, mask } =
            entry.taken(&material);
        if let Some(image) = texture {
            let what = (ImageUse::Colour, "texture");
            if let Some(map) = entry.lay_or_warn(image, what, images, model) {
                material.texture = Some(map);
                material.diffuse = meaning::textured(&entry.parsed);
                let doubt = images.doubt(&entry.file(image), ImageUse::Colour);
                let warn = |doubt| entry.warning(format!("`map_Kd` {}: {doubt}", image.name));
                model.warnings.extend(doubt.map(warn));
            }
        }
        if let Some(image) = roughness {
            let what = (data(image), "roughness map");
            if let Some(map) = entry.lay_or_warn(image, what, images, model) {
                material.roughness_map = Some(map);
                match &mut material.glass {
                    Some(glass) => glass.roughness = 1.0,
                    None => material.roughness = 1.0,
                }
            }
        }
        if let (Some(image), Some(fresnel)) = (metallic, &mut material.fresnel) {
            let what = (data(image), "metallic map");
            if let Some(map) = entry.lay_or_warn(image, what, images, model) {
                fresnel.metallic_map = Some(map);
                fresnel.metallic = 1.0;
            }
        }
        if let Some(image) = emission {
            let what = (ImageUse::Light, "emission map");
            material.emission_map = entry.lay_or_warn(image, what, images, model);
            if material.emission_map.is_none() {
                material.emission = meaning::emission(&entry.parsed).unwrap_or(Rgb::ZERO);
            }
        }
        if let Some(bump) = normals {
            let normals = entry.normal_map(bump, images, model);
            let doubt = images.doubt(&entry.file(&bump.image), ImageUse::Normals);
            let doubt = doubt.filter(|_| normals.is_ok()).map(|doubt| {
                format!("normal map {} of line {}: {doubt}", bump.image.name, bump.line)
            });
            let mut warn = |message| model.warnings.push(entry.warning(message));
            material.normal_map = normals.map_err(&mut warn).ok();
            doubt.into_iter().for_each(warn);
        }
        if coloured && material.texture.is_some() {
            let message = "the texture is shown, the vertex colours are not";
            model.warnings.push(entry.warning(message.into()));
        } else if coloured && material.diffuse != Rgb::ZERO {
            material.vertex_colours = true;
            if entry.parsed.diffuse.is_none() {
                material.diffuse = Rgb::ONE;
            }
        }
        let scaled = meaning::limit(&mut material);
        model.warnings.extend(scaled.map(|note| entry.warning(note)));
        if let Some(image) = mask {
            let what = (ImageUse::Mask, "cut-outs");
            material.alpha = entry.lay_or_warn(image, what, images, model);
        }
        model.world.materials.push(material);
        Ok(model.world.materials.len() as MaterialId - 1)
    }
}
