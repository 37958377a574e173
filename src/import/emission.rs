//! Lights in place of surfaces that emit and do nothing else.
//!
//! An analytic sphere becomes a sphere light; the faces of a mesh become quad lights, at most [`MAX_LIGHTS`]. [`World::into_scene`]
//! gives lights their surface, so the sphere or mesh itself leaves the world. A mesh that reflects too, emits by an image,
//! has cut-outs or needs more lights stays, and the scene makes lights of its faces. A sphere by an image or with cut-outs casts no light.

use super::framing::Middle;
use super::lamps::cover;
use crate::math::Rgb;
use crate::scene::{Light, Material, QuadLight, SphereLight, World};

/// Irradiance of a white surface that is seen as 25 of 255: less leaves all dark.
pub(super) const DIM: f64 = 0.03;

/// A note about an emitting surface, for a warning.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Note {
    /// The sphere of this name is visible but lights nothing, since it emits by an image.
    CastsNoLight(String),
    /// The sphere of this name is visible but lights nothing, since it has cut-outs.
    HasHoles(String),
    /// The sphere of this name became a light, which reflects nothing.
    ReflectsNothing(String),
}

impl Note {
    /// The text of the warning.
    pub fn message(&self) -> String {
        match self {
            Self::CastsNoLight(name) => {
                format!(
                    "`{name}` is a sphere that emits by an image: it is seen, but casts no light"
                )
            }
            Self::HasHoles(name) => {
                format!(
                    "`{name}` is a sphere that emits and has cut-outs: it is seen, but casts no light"
                )
            }
            Self::ReflectsNothing(name) => {
                format!("`{name}` became a light: its reflectance is ignored")
            }
        }
    }

    /// The help line of the warning.
    pub fn help(&self) -> String {
        match self {
            Self::CastsNoLight(_) | Self::HasHoles(_) => "take a mesh, as `uv_sphere`".into(),
            Self::ReflectsNothing(_) => "give it a material with `emission` alone".into(),
        }
    }
}

/// About the most irradiance that the emitting meshes of `world` send to its middle.
pub(super) fn irradiance(world: &World) -> f64 {
    let middle = Middle::of(world);
    let emission = |material: &Material| {
        let mean = material.emission_map.map(|map| &world.textures[map.image as usize]);
        let mean = mean.and_then(|image| image.levels().last());
        material.emission * mean.map_or(Rgb::ONE, |level| level.texel(0, 0))
    };
    let mut sum = 0.0;
    for mesh in &world.meshes {
        let radiance = f64::from(emission(&world.materials[mesh.material as usize]).max_element());
        if radiance == 0.0 {
            continue;
        }
        let sent = mesh.triangles.iter().map(|triangle| {
            let [a, b, c] = triangle.map(|corner| mesh.positions[corner as usize]);
            let area = 0.5 * (b - a).cross(c - a).length();
            area * middle.falloff((a + b + c) / 3.0)
        });
        sum += radiance * sent.sum::<f64>();
    }
    sum
}

/// Turns emitting meshes from `first_mesh` on and spheres from `first_sphere` on into
/// lights; returns notes about them.
pub(super) fn adopt(world: &mut World, first_mesh: usize, first_sphere: usize) -> Vec<Note> {
    let mut notes = Vec::new();
    let materials = &world.materials;
    for mesh in world.meshes.split_off(first_mesh) {
        let material = &materials[mesh.material as usize];
        match is_mere_light(material).then(|| cover(&mesh)).flatten() {
            Some(quads) => {
                let light = |corners| {
                    let (radiance, two_sided) = (material.emission, material.emits_back);
                    Light::Quad(QuadLight { corners, radiance, two_sided })
                };
                world.lights.extend(quads.into_iter().map(light));
            }
            None => world.meshes.push(mesh),
        }
    }
    for sphere in world.spheres.split_off(first_sphere) {
        let material = &materials[sphere.material as usize];
        if material.emits() && is_even(material) {
            notes.extend(material.reflects().then_some(Note::ReflectsNothing(sphere.name)));
            let (centre, radius, radiance) = (sphere.centre, sphere.radius, material.emission);
            world.lights.push(Light::Sphere(SphereLight { centre, radius, radiance }));
        } else {
            notes.extend(material.emits().then(|| dark(material, sphere.name.clone())));
            world.spheres.push(sphere);
        }
    }
    notes
}

fn is_even(material: &Material) -> bool {
    material.alpha.is_none() && material.emission_map.is_none()
}

/// Whether lights may replace a mesh, which loses nothing else by it.
pub(super) fn is_mere_light(material: &Material) -> bool {
    material.emits() && is_even(material) && material.glass.is_none() && !material.reflects()
}

/// The note about an emitting sphere that becomes none.
fn dark(material: &Material, name: String) -> Note {
    if material.alpha.is_some() { Note::HasHoles(name) } else { Note::CastsNoLight(name) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::lamps::MAX_LIGHTS;
    use crate::math::{DVec3, Rgb};
    use crate::scene::{WorldMesh, WorldSphere};

    fn lamp(triangles: Vec<[u32; 3]>, raise: f64) -> WorldMesh {
        let positions =
            vec![DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, raise), DVec3::Y, DVec3::Z];
        WorldMesh::new("lamp", positions, triangles, 0)
    }

    fn world(mesh: WorldMesh) -> World {
        let emission = Rgb::splat(3.0);
        let glow = Material { emission, emits_back: true, ..Material::black("glow") };
        World { meshes: vec![mesh], materials: vec![glow], ..World::default() }
    }

    #[test]
    fn a_flat_pair_of_triangles_is_a_quad_light_whatever_its_diagonal() {
        for second in [[0, 2, 3], [2, 3, 0], [3, 0, 2]] {
            for first in [[0, 1, 2], [1, 2, 0], [2, 0, 1]] {
                let mut world = world(lamp(vec![first, second], 0.0));
                assert_eq!(adopt(&mut world, 0, 0), []);
                let [Light::Quad(light)] = &world.lights[..] else { panic!("a quad light") };
                assert_eq!((light.area(), light.normal()), (1.0, DVec3::Z));
                assert!(light.two_sided && world.meshes.is_empty());
            }
        }
    }

    #[test]
    fn other_triangles_are_lights_of_their_own() {
        let apart = lamp(vec![[0, 1, 2], [0, 3, 2]], 0.0);
        let bent = lamp(vec![[0, 1, 2], [0, 2, 3]], 0.1);
        let odd = lamp(vec![[0, 1, 2], [1, 1, 2]], 0.0);
        for (mesh, count) in [(apart, 2), (bent, 2), (odd, 1)] {
            let area: f64 = mesh.triangles.iter().map(|t| area(&mesh, t)).sum();
            let mut world = world(mesh);
            assert_eq!(adopt(&mut world, 0, 0), []);
            let areas = world.lights.iter().map(|light| match light {
                Light::Quad(light) => light.area(),
                other => panic!("{other:?}"),
            });
            assert!((areas.sum::<f64>() - area).abs() < 1e-12);
            assert_eq!((world.meshes.len(), world.lights.len()), (0, count));
        }
    }

    #[test]
    fn a_mesh_of_too_many_faces_stays() {
        let mut world = world(lamp(vec![[0, 1, 2]; MAX_LIGHTS + 1], 0.0));
        assert_eq!(adopt(&mut world, 0, 0), []);
        assert_eq!((world.meshes.len(), world.lights.len()), (1, 0));
    }

    fn area(mesh: &WorldMesh, triangle: &[u32; 3]) -> f64 {
        let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
        0.5 * (b - a).cross(c - a).length()
    }

    #[test]
    fn an_emitting_sphere_is_a_light_and_no_surface_twice() {
        let mut world = world(lamp(vec![[0, 1, 2]], 0.0));
        world.materials.push(Material::diffuse("grey", Rgb::splat(0.5)));
        world.meshes[0].material = 1;
        let (centre, radius) = (DVec3::X, 0.5);
        for material in [0, 1] {
            world.spheres.push(WorldSphere::new("ball", centre, radius, material));
        }
        assert_eq!(adopt(&mut world, 0, 0), []);
        assert_eq!((world.spheres.len(), world.lights.len(), world.meshes.len()), (1, 1, 1));
        let scene = world.into_scene(true).expect("a scene");
        assert_eq!(scene.spheres.len(), 2);
    }

    #[test]
    fn a_sphere_with_cut_outs_glows_and_is_no_light() {
        let mut world = world(lamp(vec![[0, 1, 2], [0, 2, 3]], 0.0));
        world.materials[0].alpha = Some(crate::scene::TextureMap::of(0));
        world.spheres.push(WorldSphere::new("ball", DVec3::X, 0.5, 0));
        assert_eq!(adopt(&mut world, 0, 0), [Note::HasHoles("ball".into())]);
        assert_eq!((world.spheres.len(), world.lights.len(), world.meshes.len()), (1, 0, 1));
    }
}
