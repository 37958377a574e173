//! Images of materials: each file is decoded once, whatever it serves as, and many are on all threads.

use super::alpha;
use super::texture::{self, ImageChannel};
use crate::error::{Error, Result};
use crate::scene::{AlphaMask, Texture, World};
use image::DynamicImage;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What an image serves as.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) enum ImageUse {
    /// Reflectances, which are at most 1.
    Colour,
    /// Colours of any size: what a surface or the sky emits, and factors.
    Light,
    /// A number from 0 to 1 in one channel.
    Data(ImageChannel),
    /// Normals in tangent space: red, green and blue.
    Normals,
    /// Cut-outs.
    Mask,
}

/// The images of one model or scene file, by path and use. An image enters the world when a material first asks for it, so
/// the order in which materials ask decides on indices and on which error comes first, not the order of decoding.
#[derive(Default)]
pub(super) struct Images(HashMap<(PathBuf, ImageUse), Image>);

/// An image in one of its uses.
struct Image {
    state: State,
    /// Whether it looks like a normal map; `None` of a mask, of data and of what is not to be had.
    looks_like_normals: Option<bool>,
    /// What a warning says of numbers that were cut.
    cut: Option<&'static str>,
}

/// Where an image is.
enum State {
    /// Decoded; no material has asked for it yet.
    Decoded(Texels),
    /// Number so many of the world's textures or masks.
    Placed(u32),
    /// Not to be had.
    Refused(Arc<Error>),
}

/// What the world holds of an image.
enum Texels {
    Texture(Texture),
    Mask(AlphaMask),
}

impl Images {
    /// Decodes what is `wanted` and not yet known, on all threads.
    pub fn read(&mut self, wanted: impl IntoIterator<Item = (PathBuf, ImageUse)>) {
        let mut files = BTreeMap::<PathBuf, BTreeSet<ImageUse>>::new();
        for key in wanted {
            if !self.0.contains_key(&key) {
                files.entry(key.0).or_default().insert(key.1);
            }
        }
        let decoded: Vec<_> = files.into_par_iter().flat_map(decode).collect();
        self.0.extend(decoded);
    }

    /// The image's number among the textures or masks of `world`, which takes it when it is first asked for, as `files`
    /// takes its name. Decoded now where it has not been.
    pub fn place(
        &mut self,
        path: &Path,
        what: ImageUse,
        world: &mut World,
        files: &mut Vec<PathBuf>,
    ) -> std::result::Result<u32, Arc<Error>> {
        let Some(Image { state, .. }) = self.image(path, what) else {
            return Err(Arc::new(Error::input(path, "the image was not read")));
        };
        // Of what is decoded the texels are taken out.
        let number = match std::mem::replace(state, State::Placed(0)) {
            State::Decoded(texels) => Ok(texels.enter(world)),
            State::Placed(number) => Ok(number),
            State::Refused(error) => Err(error),
        };
        if number.is_ok() && !files.iter().any(|file| file == path) {
            files.push(path.to_path_buf());
        }
        *state = number.clone().map_or_else(State::Refused, State::Placed);
        number
    }

    /// An image in one use, decoded now where it has not been.
    fn image(&mut self, path: &Path, what: ImageUse) -> Option<&mut Image> {
        let key = (path.to_path_buf(), what);
        if !self.0.contains_key(&key) {
            self.read([key.clone()]);
        }
        self.0.get_mut(&key)
    }

    /// Why the image is not to be had, if it was read and is not.
    pub fn refusal(&self, path: &Path, what: ImageUse) -> Option<&Error> {
        match &self.0.get(&(path.to_path_buf(), what))?.state {
            State::Refused(error) => Some(error),
            State::Decoded(_) | State::Placed(_) => None,
        }
    }

    /// Whether the image looks like a normal map; `None` of a mask, of data and of what is not to be had. Decoded now where it
    /// has not been.
    pub fn looks_like_normals(&mut self, path: &Path, what: ImageUse) -> Option<bool> {
        self.image(path, what)?.looks_like_normals
    }

    /// Why the image may be meant for another use, or what of it was cut, if anything.
    pub fn doubt(&mut self, path: &Path, what: ImageUse) -> Option<&'static str> {
        let Image { cut, looks_like_normals, .. } = *self.image(path, what)?;
        match (what, looks_like_normals.unwrap_or(false)) {
            (ImageUse::Normals, false) => Some(
                "this does not look like a normal map: few of its texels are unit vectors in tangent space",
            ),
            (ImageUse::Colour, true) => {
                Some("this looks like a normal map, and is shown as a colour")
            }
            _ => cut,
        }
    }
}

impl Texels {
    /// Puts itself at the end of the world's textures or masks; its number there.
    fn enter(self, world: &mut World) -> u32 {
        let count = match self {
            Self::Texture(texture) => {
                world.textures.push(texture);
                world.textures.len()
            }
            Self::Mask(mask) => {
                world.masks.push(mask);
                world.masks.len()
            }
        };
        count as u32 - 1
    }
}

/// The image of a file in each of its uses, on all threads.
fn decode((path, uses): (PathBuf, BTreeSet<ImageUse>)) -> Vec<((PathBuf, ImageUse), Image)> {
    let decoded = texture::decode(&path).map_err(Arc::new);
    let image = |what: ImageUse| match &decoded {
        Ok(image) => what.texels(&path, image).map_err(Arc::new),
        Err(error) => Err(error.clone()),
    };
    let of = |what| {
        let (state, cut) = match image(what) {
            Ok((texels, cut)) => (State::Decoded(texels), cut),
            Err(error) => (State::Refused(error), None),
        };
        let looks_like_normals = match (what, &state) {
            (ImageUse::Colour, State::Decoded(Texels::Texture(texture))) => {
                Some(texture.looks_like_normals())
            }
            (ImageUse::Normals, State::Decoded(Texels::Texture(texture))) => {
                Some(texture.may_be_normals())
            }
            _ => None,
        };
        ((path.clone(), what), Image { state, looks_like_normals, cut })
    };
    uses.into_par_iter().map(of).collect()
}

impl ImageUse {
    /// What the world holds of `image` in this use, and what a warning says of numbers that were cut.
    fn texels(self, path: &Path, image: &DynamicImage) -> Result<(Texels, Option<&'static str>)> {
        let (texture, cut) = match self {
            Self::Colour => texture::reflectances(path, image)?,
            Self::Light => texture::colours(path, image)?,
            Self::Data(channel) => (texture::data(path, image, channel)?, None),
            Self::Normals => (texture::normals(path, image)?, None),
            Self::Mask => return Ok((Texels::Mask(alpha::mask_of(path, image)?), None)),
        };
        Ok((Texels::Texture(texture), cut))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const USES: [ImageUse; 4] =
        [ImageUse::Mask, ImageUse::Colour, ImageUse::Data(ImageChannel::Red), ImageUse::Normals];

    #[test]
    fn an_image_is_decoded_once_for_all_that_it_serves_as() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("leaf.pgm");
        std::fs::write(&path, b"P5 2 1 255\n\x00\xff").expect("written");
        let mut images = Images::default();
        images.read(USES.map(|what| (path.clone(), what)));
        // Nobody can read it again.
        std::fs::remove_file(&path).expect("removed");
        let (mut world, mut files) = (World::default(), Vec::new());
        for _ in 0..2 {
            for (what, number) in USES.into_iter().zip([0, 0, 1, 2]) {
                assert_eq!(images.place(&path, what, &mut world, &mut files).ok(), Some(number));
            }
        }
        assert_eq!((world.textures.len(), world.masks.len()), (3, 1));
        let kinds: Vec<_> = world.textures.iter().map(Texture::kind).collect();
        assert_eq!(kinds, ["sRGB codes", "data of 8 bits", "vectors of 8 bits"]);
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
        let first = refusal(ImageUse::Colour);
        assert!(first.contains("such.png"), "{first}");
        assert!(USES.into_iter().all(|what| refusal(what) == first));
        assert_eq!(refusal(ImageUse::Colour), first);
        assert!(files.is_empty());
        assert!(USES.into_iter().all(|what| images.refusal(path, what).is_some()));
    }

    #[test]
    fn a_use_that_an_image_is_not_fit_for_leaves_the_others() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("grey.pgm");
        std::fs::write(&path, b"P5 1 1 255\n\x80").expect("written");
        let alpha = ImageUse::Data(ImageChannel::Alpha);
        let mut images = Images::default();
        images.read(USES.into_iter().chain([alpha]).map(|what| (path.clone(), what)));
        let refusal = images.refusal(&path, alpha).expect("no alpha").to_string();
        assert!(refusal.contains("no alpha channel"), "{refusal}");
        assert!(USES.into_iter().all(|what| images.refusal(&path, what).is_none()));
    }

    #[test]
    fn an_image_is_doubted_in_the_uses_that_it_does_not_look_like_and_before_and_after_it_is_placed()
     {
        let folder = tempfile::tempdir().expect("a folder");
        let [grey, blue] = ["grey.ppm", "blue.ppm"].map(|name| folder.path().join(name));
        std::fs::write(&grey, b"P6 1 1 255\n\x80\x80\x80").expect("written");
        std::fs::write(&blue, b"P6 1 1 255\n\x80\x80\xff").expect("written");
        let (mut world, mut files) = (World::default(), Vec::new());
        let mut images = Images::default();
        for path in [&grey, &blue] {
            images.read(USES.map(|what| (path.clone(), what)));
        }
        for _ in 0..2 {
            for (path, doubted) in [(&grey, ImageUse::Normals), (&blue, ImageUse::Colour)] {
                for what in USES {
                    let doubt = images.doubt(path, what);
                    assert_eq!(doubt.is_some(), what == doubted, "{what:?}: {doubt:?}");
                    images.place(path, what, &mut world, &mut files).expect("placed");
                }
            }
        }
    }
}
