//! What there is of each image of a material: its file, or its number in the world.

use crate::error::Result;

/// Something of each image of a material.
pub(super) struct ImagesOf<T> {
    pub texture: Option<T>,
    pub specular_texture: Option<T>,
    pub normals: Option<T>,
    pub coat_normals: Option<T>,
    pub alpha: Option<T>,
    pub emission: Option<T>,
    pub shares: SharesOf<T>,
}

/// Something of each key that may be an image: `roughness`, `metallic`, `specular`, `clearcoat`, `clearcoat_roughness` and
/// `transmission`.
pub(super) type SharesOf<T> = [Option<T>; 6];

impl<T> ImagesOf<T> {
    /// What `of` makes of each, in order; the first error, if any.
    pub fn try_map<U>(self, mut of: impl FnMut(T) -> Result<U>) -> Result<ImagesOf<U>> {
        let mut of = |image: Option<T>| image.map(&mut of).transpose();
        Ok(ImagesOf {
            texture: of(self.texture)?,
            specular_texture: of(self.specular_texture)?,
            normals: of(self.normals)?,
            coat_normals: of(self.coat_normals)?,
            alpha: of(self.alpha)?,
            emission: of(self.emission)?,
            shares: {
                let [a, b, c, d, e, f] = self.shares.map(of);
                [a?, b?, c?, d?, e?, f?]
            },
        })
    }

    /// All that there are.
    pub fn all(self) -> impl Iterator<Item = T> {
        let Self { texture, specular_texture, normals, coat_normals, alpha, emission, shares } =
            self;
        let others = [texture, specular_texture, normals, coat_normals, alpha, emission];
        others.into_iter().chain(shares).flatten()
    }
}
