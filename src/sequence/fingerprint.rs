//! What a sequence shows, as hashes: the resolved world and shot, not the files they came from.
//!
//! So a comment, a renamed file or a setting that moves between scene file and command line keeps
//! the frames, while a vertex, a light or a key pose that changes does not.

use crate::scene::{Corners, Shot, Texture, World, WorldMesh};
use std::fmt::Debug;

/// BLAKE3 of everything in `world` and `shot` that reaches a pixel, hexadecimal.
pub fn fingerprint(world: &World, shot: &Shot) -> String {
    shot_fingerprint(&world_fingerprint(world), shot)
}

/// [`fingerprint`] of a world with the hash `world`.
pub fn shot_fingerprint(world: &str, shot: &Shot) -> String {
    let mut hash = Hash(blake3::Hasher::new());
    hash.text(&(world, shot));
    hash.0.finalize().to_hex().to_string()
}

/// BLAKE3 of everything in `world` that reaches a pixel, hexadecimal.
pub fn world_fingerprint(world: &World) -> String {
    fingerprint_of(world, true)
}

/// The same, but for what is to be traced in every frame: that changes nothing of what was traced,
/// so frames that name other things serve one another as references. `whole` is the hash with all: that of
/// most worlds, and a large one takes a while to hash.
pub fn light_fingerprint(world: &World, whole: &str) -> String {
    let names_any = world.meshes.iter().any(|mesh| mesh.always_traced)
        || world.spheres.iter().any(|sphere| sphere.always_traced)
        || !world.traced_regions.is_empty();
    if names_any { fingerprint_of(world, false) } else { whole.into() }
}

fn fingerprint_of(world: &World, with_traced: bool) -> String {
    let mut hash = Hash(blake3::Hasher::new());
    hash.text(&world.meshes.len());
    world.meshes.iter().for_each(|mesh| hash.mesh(mesh, with_traced));
    world.textures.iter().for_each(|texture| hash.texture(texture));
    for sphere in &world.spheres {
        let always_traced = sphere.always_traced && with_traced;
        hash.text(&(sphere.centre, sphere.radius, sphere.material, always_traced));
    }
    for material in &world.materials {
        // Names are for people.
        hash.text(&crate::scene::Material { name: String::new(), ..material.clone() });
    }
    let regions = if with_traced { &world.traced_regions[..] } else { &[] };
    hash.text(&(&world.lights, &world.sky, regions));
    hash.0.finalize().to_hex().to_string()
}

struct Hash(blake3::Hasher);

impl Hash {
    fn mesh(&mut self, mesh: &WorldMesh, with_traced: bool) {
        self.array(&mesh.positions);
        self.array(&mesh.triangles);
        self.attribute(mesh.normals.as_ref());
        self.attribute(mesh.uvs.as_ref());
        self.text(&(mesh.material, mesh.always_traced && with_traced));
    }

    fn attribute<T: bytemuck::NoUninit>(&mut self, attribute: Option<&Corners<T>>) {
        let Some(attribute) = attribute else { return self.text(&"none") };
        self.array(&attribute.values);
        match &attribute.corners {
            Some(corners) => self.array(corners),
            None => self.text(&"as positions"),
        }
    }

    fn texture(&mut self, texture: &Texture) {
        self.text(&(texture.width, texture.height));
        self.array(&texture.texels);
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
    use crate::math::{Bounds3, DVec3, Rgb, Vec3};
    use crate::scene::{CameraPath, Easing, Light, Material, Pose};

    fn world() -> World {
        World {
            meshes: vec![WorldMesh {
                name: "a".into(),
                positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y],
                triangles: vec![[0, 1, 2]],
                normals: Some(Corners { values: vec![Vec3::Z], corners: Some(vec![[0; 3]]) }),
                uvs: None,
                material: 0,
                always_traced: false,
            }],
            materials: vec![Material::diffuse("m", Rgb::ONE)],
            ..World::default()
        }
    }

    fn shot() -> Shot {
        let pose = Pose { eye: DVec3::Z, target: DVec3::ZERO, up: DVec3::Y, roll_degrees: 0.0 };
        let path = CameraPath::Still(pose);
        Shot { path, easing: Easing::Linear, frames: 1, vfov_degrees: 40.0 }
    }

    #[test]
    fn every_change_that_shows_changes_the_hash_and_a_name_does_not() {
        let base = fingerprint(&world(), &shot());
        let mut renamed = world();
        renamed.meshes[0].name = "b".into();
        renamed.materials[0].name = "n".into();
        assert_eq!(base, fingerprint(&renamed, &shot()));

        let changes: [fn(&mut World); 7] = [
            |w| w.meshes[0].positions[1].x += 1e-15,
            |w| w.meshes[0].triangles[0] = [0, 2, 1],
            |w| w.meshes[0].normals = None,
            |w| w.materials[0].diffuse.x = 0.5,
            |w| w.sky.lights = false,
            |w| w.meshes[0].always_traced = true,
            |w| w.traced_regions = vec![Bounds3 { min: DVec3::ZERO, max: DVec3::ONE }],
        ];
        for change in changes {
            let mut changed = world();
            change(&mut changed);
            assert_ne!(base, fingerprint(&changed, &shot()));
        }
        assert_ne!(base, fingerprint(&world(), &Shot { vfov_degrees: 41.0, ..shot() }));
    }

    #[test]
    fn what_is_always_traced_is_nothing_to_the_light() {
        let light_fingerprint = |world: &World| light_fingerprint(world, &world_fingerprint(world));
        let base = light_fingerprint(&world());
        assert_eq!(base, world_fingerprint(&world()));
        assert_eq!(base, fingerprint_of(&world(), false));
        let mut named = world();
        named.meshes[0].always_traced = true;
        named.traced_regions = vec![Bounds3 { min: DVec3::ZERO, max: DVec3::ONE }];
        assert_eq!(base, light_fingerprint(&named));
        named.lights.push(Light::Point { position: DVec3::Y, intensity: Rgb::ONE });
        assert_ne!(base, light_fingerprint(&named));
    }
}
