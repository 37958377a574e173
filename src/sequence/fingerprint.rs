//! Hashes of what a sequence shows: of the resolved world and shot, not of the files that they came from.
//!
//! So frames are kept when a comment changes, a file is renamed or a setting moves between scene file and
//! command line, but not when a vertex, a light or a key pose changes.

use crate::scene::{AlphaMask, Corners, Material, Shot, Texture, World, WorldMesh, WorldSphere};
use std::collections::BTreeMap;
use std::fmt::Debug;

/// Most parts of a kind that are listed by name, so that a manifest's first line stays readable.
const MOST_NAMED: usize = 64;

/// BLAKE3 of everything in `world` and `shot` that pixels depend on, hexadecimal.
pub fn fingerprint(world: &World, shot: &Shot) -> String {
    shot_fingerprint(&WorldHash::of(world).whole(), shot)
}

/// [`fingerprint`] of a world with the hash `world`.
pub fn shot_fingerprint(world: &str, shot: &Shot) -> String {
    let mut hash = Hash(blake3::Hasher::new());
    hash.text(&(world, shot));
    hash.hex()
}

/// A world's hash, part by part, so that changed parts can be named. A large world takes a while to
/// hash, so this is done once.
pub struct WorldHash {
    /// Every part in order: its name for messages, and the hash of everything in it that pixels depend on.
    parts: Vec<(String, blake3::Hash)>,
    /// Hash of the meshes and boxes that are traced in every frame; `None` where there are none.
    traced: Option<blake3::Hash>,
}

impl WorldHash {
    /// Hashes everything in `world` that pixels depend on.
    pub fn of(world: &World) -> Self {
        let World {
            meshes,
            spheres,
            materials,
            textures,
            masks,
            lights,
            sky,
            environment,
            fog,
            traced_regions,
        } = world;
        let mut parts = Vec::new();
        // Names are for people.
        for (n, mesh) in (1..).zip(meshes) {
            let shape = Hash::of(|hash| hash.shape(mesh));
            parts.push((format!("mesh {n} `{}`", mesh.name), shape));
        }
        for (n, texture) in (1..).zip(textures) {
            parts.push((format!("texture {n}"), Hash::of(|hash| hash.texture(texture))));
        }
        for (n, mask) in (1..).zip(masks) {
            parts.push((format!("mask {n}"), Hash::of(|hash| hash.mask(mask))));
        }
        for (n, sphere) in (1..).zip(spheres) {
            let WorldSphere { name: _, centre, radius, material: _, always_traced: _ } = sphere;
            let hash = Hash::of(|hash| hash.text(&(centre, radius)));
            parts.push((format!("sphere {n}"), hash));
        }
        for material in materials {
            let unnamed = Material { name: String::new(), ..material.clone() };
            parts.push((format!("material `{}`", material.name), Hash::of(|h| h.text(&unnamed))));
        }
        for (n, light) in (1..).zip(lights) {
            parts.push((format!("light {n}"), Hash::of(|hash| hash.text(light))));
        }
        parts.push(("the sky".into(), Hash::of(|hash| hash.text(sky))));
        if let Some(environment) = environment {
            parts.push(("the environment".into(), Hash::of(|hash| hash.text(environment))));
        }
        if let Some(fog) = fog {
            parts.push(("the fog".into(), Hash::of(|hash| hash.text(fog))));
        }
        let wearers = meshes.iter().map(|mesh| mesh.material);
        let wearers: Vec<u32> = wearers.chain(spheres.iter().map(|s| s.material)).collect();
        parts.push(("which material goes where".into(), Hash::of(|hash| hash.array(&wearers))));
        let flags = meshes.iter().map(|mesh| mesh.always_traced);
        let flags: Vec<bool> = flags.chain(spheres.iter().map(|s| s.always_traced)).collect();
        let names_any = flags.contains(&true) || !traced_regions.is_empty();
        let traced = names_any.then(|| Hash::of(|hash| hash.text(&(flags, traced_regions))));
        Self { parts, traced }
    }

    /// The hash of everything, hexadecimal.
    pub fn whole(&self) -> String {
        self.joined(self.traced.as_ref())
    }

    /// The hash of everything except which meshes and boxes are always traced, hexadecimal. That choice changes
    /// no traced light, so scenes that differ only in it can use one another's references.
    pub fn light(&self) -> String {
        self.joined(None)
    }

    /// The parts by name, each with a short hash; of very many of a kind the last ones share one hash.
    pub fn named(&self) -> BTreeMap<String, String> {
        let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
        let mut rest: BTreeMap<String, blake3::Hasher> = BTreeMap::new();
        let mut named = BTreeMap::new();
        let traced = self.traced.map(|hash| ("what is always traced".to_string(), hash));
        for (name, hash) in self.parts.iter().chain(&traced) {
            let kind = name.split(' ').next().unwrap_or_default();
            let count = seen.entry(kind).or_default();
            *count += 1;
            if *count > MOST_NAMED {
                let others = format!("one of the parts after {kind} {MOST_NAMED}");
                rest.entry(others).or_default().update(hash.as_bytes());
            } else {
                named.insert(name.clone(), short(*hash));
            }
        }
        named.extend(rest.into_iter().map(|(name, hash)| (name, short(hash.finalize()))));
        named
    }

    fn joined(&self, traced: Option<&blake3::Hash>) -> String {
        let mut hash = blake3::Hasher::new();
        for (name, part) in &self.parts {
            // The kind, so that a light is never taken for a sphere; names are for people.
            hash.update(name.split(' ').next().unwrap_or_default().as_bytes());
            hash.update(part.as_bytes());
        }
        traced.map(|traced| hash.update(traced.as_bytes()));
        hash.finalize().to_hex().to_string()
    }
}

fn short(hash: blake3::Hash) -> String {
    hash.to_hex()[..16].to_string()
}

struct Hash(blake3::Hasher);

impl Hash {
    fn of(fill: impl FnOnce(&mut Self)) -> blake3::Hash {
        let mut hash = Self(blake3::Hasher::new());
        fill(&mut hash);
        hash.0.finalize()
    }

    fn hex(&self) -> String {
        self.0.finalize().to_hex().to_string()
    }

    fn shape(&mut self, mesh: &WorldMesh) {
        // The name is for people; the others are parts of their own.
        let WorldMesh {
            name: _,
            positions,
            triangles,
            normals,
            uvs,
            more_uvs,
            colours,
            material: _,
            always_traced: _,
            bare_triangles: _,
        } = mesh;
        self.array(positions);
        self.array(triangles);
        self.attribute(normals.as_ref());
        self.attribute(uvs.as_ref());
        for (set, uvs) in (1..).zip(more_uvs) {
            self.text(&("texture coordinates", set));
            self.attribute(uvs.as_ref());
        }
        if let Some(colours) = colours {
            self.text(&("colours", colours.codes().is_some()));
            self.array(colours.bytes());
        }
    }

    fn attribute<T: bytemuck::NoUninit>(&mut self, attribute: Option<&Corners<T>>) {
        let Some(attribute) = attribute else { return self.text(&"none") };
        let Corners { values, corners } = attribute;
        self.array(values);
        match corners {
            Some(corners) => self.array(corners),
            None => self.text(&"as positions"),
        }
    }

    fn texture(&mut self, texture: &Texture) {
        // Names are for people; the smaller levels follow from the image.
        self.text(&(texture.levels()[0].width, texture.levels()[0].height, texture.kind()));
        self.array(texture.image_bytes());
    }

    fn mask(&mut self, mask: &AlphaMask) {
        let AlphaMask { name: _, width, height, texels } = mask;
        self.text(&(width, height));
        self.array(texels);
    }

    /// The length goes first, so that no two lists of arrays run together into the same bytes.
    fn array<T: bytemuck::NoUninit>(&mut self, values: &[T]) {
        self.0.update(&(values.len() as u64).to_le_bytes());
        self.0.update(bytemuck::cast_slice(values));
    }

    /// Small data by its `Debug` text, which spells every float so that it reads back the same.
    fn text(&mut self, value: &impl Debug) {
        let text = format!("{value:?}");
        self.0.update(&(text.len() as u64).to_le_bytes());
        self.0.update(text.as_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Bounds3, DVec3, Rgb, Vec2, Vec3};
    use crate::scene::{CameraPath, Light, Material, Pose};
    use crate::scene::{PointLight, TextureMap, VertexColours};

    fn world() -> World {
        World {
            meshes: vec![WorldMesh {
                normals: Some(Corners { values: vec![Vec3::Z], corners: Some(vec![[0; 3]]) }),
                ..WorldMesh::new("a", vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![[0, 1, 2]], 0)
            }],
            materials: vec![Material::diffuse("m", Rgb::ONE)],
            masks: vec![AlphaMask {
                name: "leaf".into(),
                width: 2,
                height: 1,
                texels: vec![0, 255],
            }],
            ..World::default()
        }
    }

    fn uvs(u: f32) -> Option<Corners<Vec2>> {
        Some(Corners { values: vec![Vec2::X * u, Vec2::X, Vec2::Y], corners: None })
    }

    fn shot() -> Shot {
        let pose = Pose { eye: DVec3::Z, target: DVec3::ZERO, up: DVec3::Y, roll_degrees: 0.0 };
        let path = CameraPath::Still(pose);
        Shot::new(path, 1, 40.0)
    }

    #[test]
    fn every_visible_change_changes_the_hash_and_a_name_does_not() {
        let base = fingerprint(&world(), &shot());
        let mut renamed = world();
        renamed.meshes[0].name = "b".into();
        renamed.materials[0].name = "n".into();
        renamed.masks[0].name = "frond".into();
        assert_eq!(base, fingerprint(&renamed, &shot()));

        let changes: [fn(&mut World); 16] = [
            |w| w.meshes[0].positions[1].x += 1e-15,
            |w| w.meshes[0].triangles[0] = [0, 2, 1],
            |w| w.meshes[0].normals = None,
            |w| w.meshes[0].uvs = uvs(0.0),
            |w| w.meshes[0].more_uvs = vec![uvs(0.0)],
            |w| w.meshes[0].more_uvs = vec![uvs(1.0)],
            |w| w.meshes[0].more_uvs = vec![None, uvs(0.0)],
            |w| w.meshes[0].colours = Some(VertexColours::from_encoded(&[[1.0; 3]; 3])),
            |w| w.meshes[0].colours = Some(VertexColours::from_encoded(&[[0.5; 3]; 3])),
            |w| w.materials[0].diffuse.x = 0.5,
            |w| w.materials[0].alpha = Some(TextureMap::of(0)),
            |w| w.materials[0].alpha = Some(TextureMap { uv_set: 1, ..TextureMap::of(0) }),
            |w| w.masks[0].texels[1] = 254,
            |w| w.sky.lights = false,
            |w| w.meshes[0].always_traced = true,
            |w| w.traced_regions = vec![Bounds3 { min: DVec3::ZERO, max: DVec3::ONE }],
        ];
        let mut seen = vec![base.clone()];
        for change in changes {
            let mut changed = world();
            change(&mut changed);
            let hash = fingerprint(&changed, &shot());
            assert!(!seen.contains(&hash));
            seen.push(hash);
        }
        assert_ne!(base, fingerprint(&world(), &Shot { vfov_degrees: 41.0, ..shot() }));
    }

    #[test]
    fn always_traced_meshes_do_not_change_the_hash_of_light() {
        let hash = |world: &World| WorldHash::of(world);
        let base = hash(&world()).light();
        assert_eq!(base, hash(&world()).whole());
        let mut named = world();
        named.meshes[0].always_traced = true;
        named.traced_regions = vec![Bounds3 { min: DVec3::ZERO, max: DVec3::ONE }];
        assert_eq!(base, hash(&named).light());
        assert_ne!(base, hash(&named).whole());
        named.lights.push(Light::Point(PointLight { position: DVec3::Y, intensity: Rgb::ONE }));
        assert_ne!(base, hash(&named).light());
    }

    #[test]
    fn parts_have_names_however_many_there_are() {
        let mut many = world();
        let light = Light::Point(PointLight { position: DVec3::Y, intensity: Rgb::ONE });
        many.lights = vec![light; 500];
        let named = WorldHash::of(&many).named();
        assert!(named.contains_key("mesh 1 `a`") && named.contains_key("material `m`"));
        assert!(named.contains_key("light 64") && !named.contains_key("light 65"));
        let last =
            |world: &World| WorldHash::of(world).named()["one of the parts after light 64"].clone();
        let before = last(&many);
        many.lights[499] = Light::Point(PointLight { position: DVec3::X, intensity: Rgb::ONE });
        assert_ne!(last(&many), before);
    }
}
