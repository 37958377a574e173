//! Images of materials: each file is decoded once, whatever it serves as, and many are on all threads.

use super::{alpha, texture};
use crate::error::Error;
use crate::scene::{AlphaMask, Texture, World};
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What an image serves as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ImageUse {
    /// Colours.
    Texture,
    /// Cut-outs.
    Mask,
}

/// The images of one model or scene file, by path. An image enters the world when a material first asks for it, so the
/// order in which materials ask decides on indices and on which error comes first, not the order of decoding.
#[derive(Default)]
pub(super) struct Images {
    textures: HashMap<PathBuf, Image<Texture>>,
    masks: HashMap<PathBuf, Image<AlphaMask>>,
}

/// An image in one of its uses.
enum Image<T> {
    /// Decoded; no material has asked for it yet.
    Decoded(T),
    /// Number so many of the world's.
    Placed(u32),
    /// Not to be had.
    Refused(Arc<Error>),
}

impl Images {
    /// Decodes what is `wanted` and not yet known, on all threads.
    pub fn read(&mut self, wanted: impl IntoIterator<Item = (PathBuf, ImageUse)>) {
        let mut uses = BTreeMap::<PathBuf, Uses>::new();
        for (path, what) in wanted {
            let uses = uses.entry(path).or_default();
            match what {
                ImageUse::Texture => uses.texture = true,
                ImageUse::Mask => uses.mask = true,
            }
        }
        for (path, uses) in &mut uses {
            uses.texture &= !self.textures.contains_key(path);
            uses.mask &= !self.masks.contains_key(path);
        }
        let decoded: Vec<_> = uses.into_par_iter().map(|(path, uses)| uses.decode(path)).collect();
        for Decoded { path, texture, mask } in decoded {
            self.textures.extend(texture.map(|texture| (path.clone(), texture)));
            self.masks.extend(mask.map(|mask| (path, mask)));
        }
    }

    /// The image's number among the textures or masks of `world`, which takes it when it is first asked for, as `files`
    /// takes its name. Decoded now where it has not been.
    pub fn place(
        &mut self,
        path: &Path,
        what: ImageUse,
        world: &mut World,
        files: &mut Vec<PathBuf>,
    ) -> Result<u32, Arc<Error>> {
        self.read([(path.to_path_buf(), what)]);
        match what {
            ImageUse::Texture => {
                place(self.textures.get_mut(path), path, &mut world.textures, files)
            }
            ImageUse::Mask => place(self.masks.get_mut(path), path, &mut world.masks, files),
        }
    }

    /// Why the image is not to be had, if it was read and is not.
    pub fn refusal(&self, path: &Path, what: ImageUse) -> Option<&Error> {
        match what {
            ImageUse::Texture => self.textures.get(path).and_then(Image::refusal),
            ImageUse::Mask => self.masks.get(path).and_then(Image::refusal),
        }
    }
}

impl<T> Image<T> {
    fn of(decoded: Result<T, Arc<Error>>) -> Self {
        decoded.map_or_else(Self::Refused, Self::Decoded)
    }

    fn refusal(&self) -> Option<&Error> {
        match self {
            Self::Refused(error) => Some(error),
            Self::Decoded(_) | Self::Placed(_) => None,
        }
    }
}

/// The number of an image in `list`, at the end of which it is put if it is not there yet.
fn place<T>(
    image: Option<&mut Image<T>>,
    path: &Path,
    list: &mut Vec<T>,
    files: &mut Vec<PathBuf>,
) -> Result<u32, Arc<Error>> {
    let next = Image::Placed(list.len() as u32);
    let Some(image) = image else {
        return Err(Arc::new(Error::input(path, "the image was not read")));
    };
    match image {
        Image::Placed(id) => return Ok(*id),
        Image::Refused(error) => return Err(error.clone()),
        Image::Decoded(_) => {}
    }
    if let Image::Decoded(decoded) = std::mem::replace(image, next) {
        list.push(decoded);
    }
    if !files.iter().any(|file| file == path) {
        files.push(path.to_path_buf());
    }
    Ok(list.len() as u32 - 1)
}

/// What one image serves as.
#[derive(Debug, Clone, Copy, Default)]
struct Uses {
    texture: bool,
    mask: bool,
}

struct Decoded {
    path: PathBuf,
    texture: Option<Image<Texture>>,
    mask: Option<Image<AlphaMask>>,
}

impl Uses {
    fn decode(self, path: PathBuf) -> Decoded {
        if !(self.texture || self.mask) {
            return Decoded { path, texture: None, mask: None };
        }
        let image = match texture::decode(&path) {
            Ok(image) => image,
            Err(error) => {
                let error = Arc::new(error);
                let texture = self.texture.then(|| Image::Refused(error.clone()));
                let mask = self.mask.then_some(Image::Refused(error));
                return Decoded { path, texture, mask };
            }
        };
        let mask = self.mask.then(|| alpha::mask_of(&path, &image));
        let texture = self.texture.then(|| texture::texture_of(&path, image));
        let texture = texture.map(|texture| Image::of(texture.map_err(Arc::new)));
        Decoded { texture, mask: mask.map(|mask| Image::of(mask.map_err(Arc::new))), path }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_is_decoded_once_for_all_that_it_serves_as() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("leaf.pgm");
        std::fs::write(&path, b"P5 2 1 255\n\x00\xff").expect("written");
        let mut images = Images::default();
        images.read([ImageUse::Mask, ImageUse::Texture].map(|what| (path.clone(), what)));
        // Nobody can read it again.
        std::fs::remove_file(&path).expect("removed");
        let (mut world, mut files) = (World::default(), Vec::new());
        for _ in 0..2 {
            assert_eq!(images.place(&path, ImageUse::Mask, &mut world, &mut files).ok(), Some(0));
            assert_eq!(
                images.place(&path, ImageUse::Texture, &mut world, &mut files).ok(),
                Some(0)
            );
        }
        assert_eq!((world.textures.len(), world.masks.len()), (1, 1));
        assert_eq!(files, [path]);
    }

    #[test]
    fn an_image_that_is_refused_is_so_each_time_and_in_each_use() {
        let path = Path::new("no/such.png");
        let (mut world, mut files) = (World::default(), Vec::new());
        let mut images = Images::default();
        let mut refusal = |what| {
            images.place(path, what, &mut world, &mut files).expect_err("no file").to_string()
        };
        let first = refusal(ImageUse::Texture);
        let others = [ImageUse::Texture, ImageUse::Mask].map(refusal);
        assert!(first.contains("such.png"), "{first}");
        assert_eq!(others, [first.clone(), first]);
        assert!(files.is_empty());
        assert!(images.refusal(path, ImageUse::Mask).is_some());
    }
}
