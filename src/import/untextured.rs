//! Meshes that lack what their material shows: texture coordinates, so that of an image they show one colour and a mask
//! cuts nothing out of them, or vertex colours.
//!
//! A warning, not an error: files whose materials name images for faces without coordinates are common,
//! and the rest of the picture is right.

use crate::error::counted;
use crate::scene::{Material, TextureMap, World, WorldMesh};

/// A mesh, and what its material shows and it lacks.
pub(super) struct Untextured {
    mesh: String,
    /// Whether it has texture coordinates, but not the set that is asked for.
    has_others: bool,
    material: String,
    lacks: Lacking,
}

/// What a mesh lacks: coordinates for an image, by the name of its file (of a share, after the key that it is of), those of
/// some of its triangles, or colours.
enum Lacking {
    Texture(String),
    Mask(String),
    Share(&'static str, String),
    Normals(&'static str, String),
    Part { bare: usize, all: usize },
    Colours,
}

/// What meshes of `world` from number `first` on lack.
pub(super) fn find(world: &World, first: usize) -> impl Iterator<Item = Untextured> + '_ {
    world.meshes[first..].iter().flat_map(|mesh| {
        let material = &world.materials[mesh.material as usize];
        let is_bare = |map: &TextureMap| mesh.uv_set(map.uv_set).is_none();
        let texture = material.texture.filter(is_bare);
        let texture = texture.map(|map| world.textures[map.image as usize].name.clone());
        let mask = material.alpha.filter(is_bare);
        let mask = mask.map(|map| world.masks[map.image as usize].name.clone());
        let share = |what, map: Option<TextureMap>| {
            let map = map.filter(is_bare)?;
            Some(Lacking::Share(what, world.textures[map.image as usize].name.clone()))
        };
        let roughness = share("roughness", material.roughness_map);
        let emission = share("emission", material.emission_map);
        let shares = material.fresnel.iter().flat_map(|fresnel| fresnel.maps());
        let shares: Vec<Lacking> = shares.filter_map(|(what, map)| share(what, *map)).collect();
        let colours =
            (material.vertex_colours && mesh.colours.is_none()).then_some(Lacking::Colours);
        let normals = material.normal_maps().filter(|(_, map)| is_bare(&map.image));
        let file = |map: &TextureMap| world.textures[map.image as usize].name.clone();
        let normals = normals.map(|(what, map)| Lacking::Normals(what, file(&map.image)));
        let normals: Vec<Lacking> = normals.collect();
        let (texture, mask) = (texture.map(Lacking::Texture), mask.map(Lacking::Mask));
        let lies_by_it = material.images().chain(&material.alpha).any(|map| map.uv_set == 0);
        let part = Lacking::Part { bare: mesh.bare_triangles, all: mesh.triangles.len() };
        let part = (mesh.bare_triangles > 0 && lies_by_it).then_some(part);
        let lacking = [texture, mask, emission, roughness, part, colours];
        lacking
            .into_iter()
            .flatten()
            .chain(normals)
            .chain(shares)
            .map(|lacks| Untextured::new(mesh, material, lacks))
    })
}

impl Untextured {
    fn new(mesh: &WorldMesh, material: &Material, lacks: Lacking) -> Self {
        let has_others = mesh.uvs.is_some() || mesh.more_uvs.iter().any(Option::is_some);
        Self { mesh: mesh.name.clone(), has_others, material: material.name.clone(), lacks }
    }

    /// The text of the warning.
    pub fn message(&self) -> String {
        let Self { mesh, has_others, material, lacks } = self;
        let none = match has_others {
            true => "lacks a set of texture coordinates",
            false => "has no texture coordinates",
        };
        match lacks {
            Lacking::Texture(file) => format!(
                "the mesh `{mesh}` {none}: of the material `{material}` it shows one \
                 colour, that of the lower left corner of {file}"
            ),
            Lacking::Mask(file) => format!(
                "the mesh `{mesh}` {none}: {file} of the material `{material}` cuts \
                 nothing out of it"
            ),
            Lacking::Share(what, file) => format!(
                "the mesh `{mesh}` {none}: of the material `{material}` it has one `{what}`, \
                 that of the lower left corner of {file}"
            ),
            Lacking::Normals(_, file) => format!(
                "the mesh `{mesh}` {none}: {file} of the material `{material}` tilts none of its normals"
            ),
            Lacking::Part { bare, all } => format!(
                "{bare} of {} of the mesh `{mesh}` {} no texture coordinates: of the material `{material}` they show one \
                 colour, that of the lower left corner of its images",
                counted(*all, "triangle"),
                if *bare == 1 { "has" } else { "have" }
            ),
            Lacking::Colours => format!(
                "the mesh `{mesh}` has no vertex colours: the material `{material}` shows its own colour as it is"
            ),
        }
    }

    /// The help line.
    pub fn help(&self) -> String {
        if self.has_others && !matches!(self.lacks, Lacking::Part { .. } | Lacking::Colours) {
            return "say by `uv_set` which of its sets the image lies by: 0 is the first".into();
        }
        let help = match &self.lacks {
            Lacking::Texture(_) | Lacking::Part { .. } => {
                "write the mesh with texture coordinates (`vt` in obj, `s` and `t` in ply), or give it a \
                 material without a texture"
            }
            Lacking::Mask(_) => {
                "write the mesh with texture coordinates (`vt` in obj, `s` and `t` in ply), or give it a \
                 material without `alpha`"
            }
            Lacking::Normals(what, _) => {
                return format!(
                    "write the mesh with texture coordinates (`vt` in obj, `s` and `t` in ply), or give it a \
                     material without a `{what}`"
                );
            }
            Lacking::Share(what, _) => {
                return format!(
                    "write the mesh with texture coordinates (`vt` in obj, `s` and `t` in ply), or give it one `{what}`"
                );
            }
            Lacking::Colours => {
                "write the mesh with vertex colours (`v x y z r g b` in obj, `red`, `green` and `blue` in ply), or \
                 give it a material without `vertex_colours`"
            }
        };
        help.to_owned()
    }
}
