//! Meshes whose material has an image that nothing says how to lay on: of a texture they show one colour, and
//! a mask cuts nothing out of them.
//!
//! A warning, not an error: files whose materials name images for faces without coordinates are common,
//! and the rest of the picture is right.

use crate::scene::{Material, World, WorldMesh};

/// A mesh without texture coordinates and an image of its material's.
pub(super) struct Untextured {
    mesh: String,
    material: String,
    image: Image,
}

/// An image by the name of its file.
enum Image {
    Texture(String),
    Mask(String),
}

/// Images of meshes of `world` from number `first` on that lack texture coordinates.
pub(super) fn find(world: &World, first: usize) -> impl Iterator<Item = Untextured> + '_ {
    let bare = world.meshes[first..].iter().filter(|mesh| mesh.uvs.is_none());
    bare.flat_map(|mesh| {
        let material = &world.materials[mesh.material as usize];
        let texture = material.texture.map(|map| world.textures[map.image as usize].name.clone());
        let mask = material.alpha.map(|map| world.masks[map.image as usize].name.clone());
        let images = texture.map(Image::Texture).into_iter().chain(mask.map(Image::Mask));
        images.map(|image| Untextured::new(mesh, material, image))
    })
}

impl Untextured {
    fn new(mesh: &WorldMesh, material: &Material, image: Image) -> Self {
        Self { mesh: mesh.name.clone(), material: material.name.clone(), image }
    }

    /// The text of the warning.
    pub fn message(&self) -> String {
        let Self { mesh, material, image } = self;
        match image {
            Image::Texture(file) => format!(
                "the mesh `{mesh}` has no texture coordinates: of the material `{material}` it shows one \
                 colour, that of the lower left corner of {file}"
            ),
            Image::Mask(file) => format!(
                "the mesh `{mesh}` has no texture coordinates: {file} of the material `{material}` cuts \
                 nothing out of it"
            ),
        }
    }

    /// The help line.
    pub fn help(&self) -> &'static str {
        match self.image {
            Image::Texture(_) => {
                "write the mesh with texture coordinates (`vt` in obj, `s` and `t` in ply), or give it a \
                 material without a texture"
            }
            Image::Mask(_) => {
                "write the mesh with texture coordinates (`vt` in obj, `s` and `t` in ply), or give it a \
                 material without `alpha`"
            }
        }
    }
}
