//! How an image lies on a surface: sampler, set of coordinates, KHR_texture_transform.

use super::document::Document;
use super::extensions;
use super::json::Json;
use crate::error::Result;
use crate::import::source::Notes;
use crate::math::{DAffine2, DMat2, DVec2};
use crate::scene::{TextureMap, Wrap};

/// Textures and samplers of a file.
pub(super) struct TextureTable<'d> {
    textures: Vec<Json<'d>>,
    samplers: Vec<Json<'d>>,
    images: usize,
}

/// The image that a material names, and how it lies.
#[derive(Debug, Clone, Copy)]
pub(super) struct LaidImage {
    /// Number of the file's image.
    pub image: usize,
    /// Set of texture coordinates, by the file's number.
    pub set: usize,
    wrap: [Wrap; 2],
    transform: DAffine2,
}

impl LaidImage {
    /// As scene data, with the numbers there of the image and of the set of texture coordinates.
    pub fn map(&self, image: u32, uv_set: u8) -> TextureMap {
        TextureMap { image, wrap: self.wrap, uv_set, transform: self.transform }
    }
}

impl<'d> TextureTable<'d> {
    pub fn of(document: &Document<'d>) -> Result<Self> {
        let list = |key| document.top.list(key);
        Ok(Self {
            textures: list("textures")?,
            samplers: list("samplers")?,
            images: list("images")?.len(),
        })
    }

    /// The image that the texture info `key` of `json` names; `None` where there is no such key.
    ///
    /// Errors: numbers of textures, samplers and images that there are not; a texture without an image.
    pub fn laid(&self, json: &Json<'_>, key: &str, notes: &mut Notes) -> Result<Option<LaidImage>> {
        let Some(info) = json.get(key) else { return Ok(None) };
        let texture = info.required("index")?.as_index(self.textures.len(), "texture")?;
        let texture = &self.textures[texture];
        let Some(image) = texture.index("source", self.images, "image")? else {
            let message = "the texture has no `source`, so no image";
            let help = "export the file again with png or jpeg images";
            let unnamed = || texture.fault(message).help(help);
            return Err(extensions::packed(texture).unwrap_or_else(unnamed).into());
        };
        let sampler = texture.index("sampler", self.samplers.len(), "sampler")?;
        let wrap = match sampler {
            Some(at) => wraps(&self.samplers[at], notes)?,
            None => [Wrap::Repeat; 2],
        };
        let mut set = info.whole("texCoord")?.unwrap_or(0);
        let mut transform = DAffine2::IDENTITY;
        if let Some(json) = info.extension("KHR_texture_transform") {
            set = json.whole("texCoord")?.unwrap_or(set);
            transform = transformed(&json)?;
        }
        Ok(Some(LaidImage { image, set, wrap, transform }))
    }
}

/// What is seen beyond an image's sides, and above and below.
fn wraps(sampler: &Json<'_>, notes: &mut Notes) -> Result<[Wrap; 2]> {
    // What far away is the nearest texel is a mean here: magnification shows it.
    if sampler.whole("magFilter")? == Some(9728) {
        notes.add("the filter NEAREST of a texture is read as LINEAR", None);
    }
    let wrap = |key| -> Result<Wrap> {
        match sampler.whole(key)? {
            None | Some(10_497) => Ok(Wrap::Repeat),
            Some(33_071) => Ok(Wrap::Clamp),
            Some(33_648) => Ok(Wrap::Mirror),
            Some(other) => {
                Err(sampler.fault(format!("`{key}` is {other}, which is no wrap mode")).into())
            }
        }
    };
    Ok([wrap("wrapS")?, wrap("wrapT")?])
}

/// The transform of KHR_texture_transform, which is of coordinates with v downwards: here v is upwards.
fn transformed(json: &Json<'_>) -> Result<DAffine2> {
    let [x, y] = json.numbers::<2>("offset")?.unwrap_or_default();
    let [sx, sy] = json.numbers::<2>("scale")?.unwrap_or([1.0; 2]);
    let angle = json.number("rotation")?.unwrap_or(0.0);
    let (sin, cos) = (libm::sin(angle), libm::cos(angle));
    let linear = DMat2::from_cols(DVec2::new(cos, sin) * sx, DVec2::new(-sin, cos) * sy);
    let offset = DVec2::new(x + sy * sin, 1.0 - y - sy * cos);
    Ok(DAffine2 { matrix2: linear, translation: offset })
}
