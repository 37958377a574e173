//! Meshes whose material has an image that nothing says how to lay on: they show one colour of it.
//!
//! A warning, not an error: files whose materials name images for faces without coordinates are common,
//! and the rest of the picture is right.

use crate::scene::World;

/// A mesh without texture coordinates and its material's texture.
pub(super) struct Untextured {
    mesh: String,
    material: String,
    texture: String,
}

/// Meshes of `world` from number `first` on that lack texture coordinates for their texture.
pub(super) fn find(world: &World, first: usize) -> impl Iterator<Item = Untextured> + '_ {
    let bare = world.meshes[first..].iter().filter(|mesh| mesh.uvs.is_none());
    bare.filter_map(|mesh| {
        let material = &world.materials[mesh.material as usize];
        let texture = &world.textures[material.texture?.image as usize];
        Some(Untextured {
            mesh: mesh.name.clone(),
            material: material.name.clone(),
            texture: texture.name.clone(),
        })
    })
}

impl Untextured {
    /// The text of the warning.
    pub fn message(&self) -> String {
        let Self { mesh, material, texture } = self;
        format!(
            "the mesh `{mesh}` has no texture coordinates: of the material `{material}` it shows one \
             colour, that of the lower left corner of {texture}"
        )
    }

    /// The help line.
    pub fn help(&self) -> &'static str {
        "write the mesh with texture coordinates (`vt` in obj, `s` and `t` in ply), or give it a \
         material without a texture"
    }
}
