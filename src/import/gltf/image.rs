//! Images of materials: embedded or beside the file, decoded once each, on all threads.

use super::document::{Document, read_beside};
use super::extensions;
use super::json::Json;
use super::uri::{self, Resource};
use crate::error::Result;
use crate::import::texture::{self, ImageChannel};
use crate::scene::{AlphaMask, World};
use image::DynamicImage;
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};

/// Most pixels of all images of a file: 4 GB of 8 bits.
const MOST_PIXELS: u64 = 1 << 30;

/// What an image serves as.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Role {
    /// Reflectances, which are at most 1.
    Colour,
    /// Colours of any size: emission, and factors.
    Light,
    /// One channel.
    Share(ImageChannel),
    Normals,
    /// Cut-outs: the surface is where alpha is this or more, as the bits of an f64.
    Mask(u64),
}

/// The images of a file, by their number.
#[derive(Default)]
pub(super) struct ImageStore {
    decoded: HashMap<usize, (PathBuf, DynamicImage)>,
    placed: HashMap<(usize, Role), Option<u32>>,
    /// What a warning says of images of which reflectances were cut.
    cut: HashMap<usize, &'static str>,
}

impl ImageStore {
    /// Decodes the images `wanted`; names of files are added to `files`.
    ///
    /// Errors: images that cannot be read, and too many pixels, before they are decoded.
    pub fn decode(
        document: &Document<'_>,
        wanted: &BTreeSet<usize>,
        files: &mut Vec<PathBuf>,
    ) -> Result<Self> {
        let images = document.top.list("images")?;
        let mut pixels = 0u64;
        let mut encoded = Vec::new();
        for at in wanted {
            let json = &images[*at];
            let (name, bytes) = read(document, json, files)?;
            if let Some(fault) = extensions::packed_image(json, &bytes) {
                return Err(fault.into());
            }
            pixels += texture::pixels(&name, &bytes)?;
            if pixels > MOST_PIXELS {
                let message = format!(
                    "the images up to this one have {pixels} pixels; {MOST_PIXELS} can be decoded"
                );
                return Err(json.fault(message).help("make the images smaller").into());
            }
            encoded.push((*at, name, bytes));
        }
        let decode = |(at, name, bytes): (usize, PathBuf, Cow<'_, [u8]>)| {
            let image = texture::decode_bytes(&name, &bytes)?;
            Ok((at, (name, image)))
        };
        // Of several that cannot be read the first one is the error, whatever the threads.
        let decoded: Vec<Result<_>> = encoded.into_par_iter().map(decode).collect();
        let decoded = decoded.into_iter().collect::<Result<HashMap<_, _>>>()?;
        Ok(Self { decoded, ..Self::default() })
    }

    /// The number of an image, which was decoded, among the textures or masks of `world`, which takes it when it is first
    /// asked for. `None` of a mask that cuts nothing.
    ///
    /// Errors: pixels that are no light, or no share.
    pub fn place(&mut self, image: usize, role: Role, world: &mut World) -> Result<Option<u32>> {
        let Some((name, decoded)) = self.decoded.get(&image) else { return Ok(None) };
        // Only floats may be above 1: of all others one texture serves as both.
        let is_same = role == Role::Light && decoded.as_flat_samples_f32().is_none();
        let role = if is_same { Role::Colour } else { role };
        if let Some(number) = self.placed.get(&(image, role)) {
            return Ok(*number);
        }
        let texture = match role {
            Role::Colour => {
                let (texture, cut) = texture::reflectances(name, decoded)?;
                self.cut.extend(cut.map(|cut| (image, cut)));
                Some(texture)
            }
            Role::Light => Some(texture::colours(name, decoded)?.0),
            Role::Share(channel) => Some(texture::data(name, decoded, channel)?),
            Role::Normals => Some(texture::normals(name, decoded)?),
            Role::Mask(_) => None,
        };
        let number = match (role, texture) {
            (_, Some(texture)) => {
                world.textures.push(texture);
                Some(world.textures.len() as u32 - 1)
            }
            (Role::Mask(cutoff), None) => mask(name, decoded, f64::from_bits(cutoff)).map(|mask| {
                world.masks.push(mask);
                world.masks.len() as u32 - 1
            }),
            (_, None) => None,
        };
        self.placed.insert((image, role), number);
        Ok(number)
    }

    /// The name of an image of which reflectances were cut, and what a warning says of it.
    pub fn cut(&self, image: usize) -> Option<(&Path, &'static str)> {
        let (name, _) = self.decoded.get(&image)?;
        Some((name, *self.cut.get(&image)?))
    }

    /// Whether an image has an alpha channel with anything that is not opaque.
    pub fn has_alpha(&self, image: usize) -> bool {
        let decoded = self.decoded.get(&image);
        decoded.is_some_and(|(_, image)| {
            image.color().has_alpha() && alpha(image).any(|alpha| alpha < 1.0)
        })
    }
}

/// The name and the bytes of an image.
fn read<'d>(
    document: &'d Document<'_>,
    json: &Json<'_>,
    files: &mut Vec<PathBuf>,
) -> Result<(PathBuf, Cow<'d, [u8]>)> {
    let inside = || PathBuf::from(format!("{}: {}", document.file.display(), json.path()));
    if let Some(uri) = json.text("uri")? {
        return Ok(match uri::resolve(json, uri, document.file)? {
            Resource::Data(bytes) => (inside(), bytes.into()),
            Resource::File(path) => {
                let bytes = read_beside(json, &path)?;
                if !files.contains(&path) {
                    files.push(path.clone());
                }
                (path, bytes.into())
            }
        });
    }
    match document.view(json, "bufferView")? {
        Some((bytes, _)) => Ok((inside(), bytes.into())),
        None => Err(json.fault("the image has neither `uri` nor `bufferView`").into()),
    }
}

/// Alpha of all pixels, from 0 to 1.
fn alpha(image: &DynamicImage) -> Box<dyn Iterator<Item = f64> + '_> {
    let channels = usize::from(image.color().channel_count());
    let last = channels - 1;
    if let Some(flat) = image.as_flat_samples_u8() {
        Box::new(
            flat.samples.chunks_exact(channels).map(move |pixel| f64::from(pixel[last]) / 255.0),
        )
    } else if let Some(flat) = image.as_flat_samples_u16() {
        Box::new(
            flat.samples.chunks_exact(channels).map(move |pixel| f64::from(pixel[last]) / 65_535.0),
        )
    } else {
        Box::new(image.to_rgba32f().into_raw().into_iter().skip(3).step_by(4).map(f64::from))
    }
}

/// The mask of what has an alpha of `cutoff` or more; `None` where that is everything.
///
/// Masks are cut at a half. Alpha is moved and scaled so that the cutoff becomes a half: outlines between the middles of
/// texels stay, since that is linear.
fn mask(name: &Path, image: &DynamicImage, cutoff: f64) -> Option<AlphaMask> {
    const HALF: f64 = 127.5;
    let has_alpha = image.color().has_alpha();
    let is_there = |alpha: f64| alpha >= cutoff;
    if !has_alpha || cutoff > 1.0 {
        // Every texel is there, or none is.
        let (width, height) = (1, 1);
        let texels = vec![0];
        return (cutoff > 1.0).then(|| AlphaMask {
            name: name.display().to_string(),
            width,
            height,
            texels,
        });
    }
    if alpha(image).all(is_there) {
        return None;
    }
    let scale = 0.5 / cutoff.max(1.0 - cutoff);
    let code = |alpha: f64| {
        let code = (HALF + 255.0 * scale * (alpha - cutoff)).clamp(0.0, 255.0);
        // No rounding crosses the cutoff.
        if is_there(alpha) { code.round().max(128.0) as u8 } else { code.floor().min(127.0) as u8 }
    };
    let texels = alpha(image).map(code).collect();
    let (width, height) = (image.width(), image.height());
    Some(AlphaMask { name: name.display().to_string(), width, height, texels })
}
