//! A world, moved to scene space.

use super::{
    Collapsed, Corners, Light, LightCells, Material, Mesh, Recentring, Scene, SceneEnvironment,
    Sphere, Surface, World, WorldMesh, WorldSphere,
    emitting_mesh::face_lights,
    environment,
    light::{EmittingShape, EmittingSurface},
    too_small, winding,
};
use crate::error::{Error, Result};
use crate::math::{Bounds3, DVec3, Vec2, Vec3};

impl World {
    /// Bounds of all geometry and of lights that are seen, world space.
    pub fn bounds(&self) -> Bounds3 {
        let mut bounds = Bounds3::EMPTY;
        for mesh in &self.meshes {
            mesh.positions.iter().for_each(|p| bounds.include(*p));
        }
        for s in &self.spheres {
            bounds.include(s.centre - DVec3::splat(s.radius));
            bounds.include(s.centre + DVec3::splat(s.radius));
        }
        for light in &self.lights {
            bounds = bounds.union(light.bounds());
        }
        bounds
    }

    /// Moves the world to scene space and rounds positions to f32, once. Area lights get their
    /// emitting surface. With `recentre` false the world's own coordinates are rounded as they
    /// are: that shows what the rule is worth.
    ///
    /// Errors: an index of a material or vertex that does not exist; a scene whose longest edge lies outside
    /// `[1e-30, 1e30]` world units; a light or sphere whose place is not finite; a mesh, sphere or area light so small
    /// beside the scene that rounding to f32 would collapse it, or a mesh of which it would collapse most triangles
    /// (`recentre` only).
    pub fn into_scene(mut self, recentre: bool) -> Result<Scene> {
        self.check()?;
        let bounds = self.bounds();
        let size = bounds.extent().max_element();
        let renders = size == 0.0 || (1e-30..=1e30).contains(&size);
        if !renders {
            let size = match size.is_finite() {
                true => format!("{size:e} units"),
                false => "more units than a number can hold".into(),
            };
            return Err(Error::Usage(format!(
                "the scene is {size} wide; from 1e-30 to 1e30 can be rendered. Use `scale`"
            )));
        }
        let recentring = if recentre { Recentring::of(&bounds) } else { Recentring::IDENTITY };
        if recentre {
            too_small::refuse(&self, &recentring)?;
        }
        let lights: Vec<Light> = std::mem::take(&mut self.lights)
            .into_iter()
            .map(|light| light.into_scene(&recentring))
            .collect();
        let mut lights = environment::with_sun(lights, self.environment.as_ref(), self.sky.lights);
        let to_scene_box = |b: &Bounds3| Bounds3 {
            min: recentring.point_to_scene(b.min),
            max: recentring.point_to_scene(b.max),
        };
        let traced_regions = self.traced_regions.iter().map(to_scene_box).collect();

        let mut meshes = Vec::with_capacity(self.meshes.len());
        let (mut collapsed, mut open_glass) = (Vec::new(), Vec::new());
        for mesh in std::mem::take(&mut self.meshes) {
            let (mesh, Reported { lost, is_open_glass }) =
                to_scene_mesh(mesh, &self.materials, &recentring);
            open_glass.extend(is_open_glass.then(|| mesh.name.clone()));
            let lost = Collapsed { mesh: mesh.name.clone(), lost, of: mesh.triangles.len() };
            if recentre {
                too_small::refuse_collapsed(&lost)?;
            }
            if lost.lost > 0 {
                collapsed.push(lost);
            }
            meshes.push(mesh);
        }
        for mesh in &mut meshes {
            let material = &self.materials[mesh.surface.material as usize];
            let first = lights.len() as u32;
            if let Some((own, more)) =
                face_lights(mesh, material, (&self.textures, &self.masks), first)
            {
                mesh.lights = Some(own);
                lights.extend(more);
            }
        }
        let mut spheres: Vec<Sphere> =
            self.spheres.into_iter().map(|s| to_scene_sphere(s, &recentring)).collect();
        for (index, light) in lights.iter().enumerate() {
            add_emitting_surface(
                index as u32,
                light,
                &mut self.materials,
                &mut meshes,
                &mut spheres,
            );
        }
        let mut scene_bounds = meshes.iter().fold(Bounds3::EMPTY, |b, m| b.union(m.bounds));
        for s in &spheres {
            scene_bounds.include(s.centre - DVec3::splat(s.radius));
            scene_bounds.include(s.centre + DVec3::splat(s.radius));
        }
        let mut scene = Scene {
            recentring,
            meshes,
            spheres,
            materials: self.materials,
            textures: self.textures,
            masks: self.masks,
            lights,
            sky: self.sky,
            environment: None,
            fog: self.fog.map(|fog| fog.into_scene(&recentring)),
            traced_regions,
            bounds: scene_bounds,
            collapsed,
            open_glass,
            light_cells: None,
        };
        scene.light_cells = LightCells::of(&scene);
        scene.environment = self.environment.map(|sky| SceneEnvironment::of(sky, &scene.textures));
        Ok(scene)
    }
}

fn to_scene_sphere(s: WorldSphere, r: &Recentring) -> Sphere {
    Sphere {
        name: s.name,
        centre: r.point_to_scene(s.centre),
        radius: s.radius * r.scale(),
        surface: Surface { material: s.material, light: None, always_traced: s.always_traced },
    }
}

/// What of a mesh in scene space is reported.
struct Reported {
    /// How many of its triangles rounding took.
    lost: usize,
    /// Whether it bounds a body of glass and is open, so that light that enters it never leaves.
    is_open_glass: bool,
}

/// The mesh in scene space.
fn to_scene_mesh(mesh: WorldMesh, materials: &[Material], r: &Recentring) -> (Mesh, Reported) {
    let WorldMesh {
        name,
        positions,
        mut triangles,
        mut normals,
        mut uvs,
        mut more_uvs,
        colours,
        material,
        always_traced,
        bare_triangles: _,
    } = mesh;
    let made_of = &materials[material as usize];
    let colours = colours.filter(|_| made_of.vertex_colours);
    for (set, uvs) in (1..).zip(&mut more_uvs) {
        let is_used =
            made_of.images().chain(&made_of.alpha).any(|map| usize::from(map.uv_set) == set);
        *uvs = uvs.take().filter(|_| is_used);
    }
    let mut all_uvs: Vec<_> = uvs.iter_mut().chain(more_uvs.iter_mut().flatten()).collect();
    let mut is_open_glass = false;
    // A thin pane has no inside.
    if made_of.glass.as_ref().is_some_and(|glass| !glass.thin) {
        // Glass tells inside from outside by the winding; a file with reversed faces, some or all,
        // would otherwise refract as a hole in glass.
        let mut volume = winding::closed_volume(&positions, &triangles);
        if volume.is_none() {
            let strays = winding::strays(&positions, &triangles);
            let strays = strays.into_iter().flatten().enumerate().filter(|(_, stray)| *stray);
            strays.for_each(|(i, _)| reverse_one(i, &mut triangles, &mut normals, &mut all_uvs));
            volume = winding::closed_volume(&positions, &triangles);
        }
        is_open_glass = volume.is_none() && !triangles.is_empty();
        if volume.is_some_and(|volume| volume < 0.0) {
            reverse(&mut triangles, &mut normals, &mut all_uvs);
        }
    }
    let rounded: Vec<Vec3> = positions.iter().map(|p| r.point_to_scene(*p).as_vec3()).collect();
    let lost = too_small::count_collapsed(&positions, &rounded, &triangles);
    let surface = Surface { material, light: None, always_traced };
    let mesh = scene_mesh(name, rounded, triangles, surface);
    (Mesh { normals, uvs, more_uvs, colours, ..mesh }, Reported { lost, is_open_glass })
}

fn scene_mesh(
    name: String,
    mut positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    surface: Surface,
) -> Mesh {
    let mut bounds = Bounds3::EMPTY;
    for t in &triangles {
        t.iter().for_each(|i| bounds.include(positions[*i as usize].as_dvec3()));
    }
    let vertex_count = positions.len();
    positions.push(Vec3::ZERO);
    Mesh {
        name,
        positions,
        vertex_count,
        triangles,
        normals: None,
        uvs: None,
        more_uvs: Vec::new(),
        colours: None,
        surface,
        lights: None,
        bounds,
    }
}

fn reverse_one(
    index: usize,
    triangles: &mut [[u32; 3]],
    normals: &mut Option<Corners<Vec3>>,
    uvs: &mut [&mut Corners<Vec2>],
) {
    triangles[index].swap(1, 2);
    let normals = normals.as_mut().and_then(|n| n.corners.as_mut());
    let uvs = uvs.iter_mut().filter_map(|uv| uv.corners.as_mut());
    normals.into_iter().chain(uvs).for_each(|corners| corners[index].swap(1, 2));
}

fn reverse(
    triangles: &mut [[u32; 3]],
    normals: &mut Option<Corners<Vec3>>,
    uvs: &mut [&mut Corners<Vec2>],
) {
    triangles.iter_mut().for_each(|t| t.swap(1, 2));
    if let Some(n) = normals {
        n.values.iter_mut().for_each(|v| *v = -*v);
        n.corners.iter_mut().flatten().for_each(|t| t.swap(1, 2));
    }
    for uv in uvs {
        uv.corners.iter_mut().flatten().for_each(|t| t.swap(1, 2));
    }
}

fn add_emitting_surface(
    index: u32,
    light: &Light,
    materials: &mut Vec<Material>,
    meshes: &mut Vec<Mesh>,
    spheres: &mut Vec<Sphere>,
) {
    let Some(emitting) = light.surface() else { return };
    let name = format!("light {}", index + 1);
    let EmittingSurface { shape, radiance, two_sided } = emitting;
    materials.push(Material {
        emission: radiance,
        emits_back: two_sided,
        ..Material::black(name.clone())
    });
    let material = materials.len() as u32 - 1;
    let surface = Surface { material, light: Some(index), always_traced: false };
    match shape {
        EmittingShape::Triangles(corners, triangles) => {
            meshes.push(scene_mesh(name, corners, triangles, surface));
        }
        EmittingShape::Sphere(centre, radius) => {
            spheres.push(Sphere { name, centre, radius, surface });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Fresnel, Glass, Texture, TextureMap};

    #[test]
    fn glass_that_is_inside_out_is_turned_with_all_that_its_corners_have() {
        let corners = |first: u32| Corners {
            values: vec![Vec2::ZERO; 24],
            corners: Some((0..4).map(|t| [0, 1, 2].map(|k| first + 3 * t + k)).collect()),
        };
        let p = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let inwards = vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]];
        let mesh = WorldMesh {
            uvs: Some(corners(0)),
            more_uvs: vec![Some(corners(6)), Some(corners(12))],
            ..WorldMesh::new("glass", p.to_vec(), inwards, 0)
        };
        let mut world = World::default();
        world.textures.push(Texture::from_linear("t", [1, 1], vec![crate::math::Rgb::ONE]));
        let fresnel = Fresnel { transmission: 1.0, ..Fresnel::PLASTIC };
        world.add_material(Material {
            texture: Some(TextureMap { uv_set: 2, ..TextureMap::of(0) }),
            fresnel: Some(fresnel),
            glass: Some(Glass::clear(1.5)),
            ..Material::black("glass")
        });
        world.meshes.push(mesh);
        let mesh = world.into_scene(true).expect("a scene").meshes.remove(0);
        assert_eq!(mesh.triangles[0], [0, 2, 1]);
        let first = |set| mesh.uv_set(set).and_then(|uvs| uvs.corners.as_ref()).map(|c| c[0]);
        // No image lies by set 1.
        assert_eq!([first(0), first(1), first(2)], [Some([0, 2, 1]), None, Some([12, 14, 13])]);
    }

    #[test]
    fn bodies_of_glass_that_are_open_are_reported() {
        let p = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let closed = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let mut world = World::default();
        for thin in [false, true] {
            let glass = Some(Glass { thin, ..Glass::clear(1.5) });
            world.add_material(Material { glass, ..Material::black("glass") });
        }
        world.add_material(Material::diffuse("paint", crate::math::Rgb::ONE));
        for (name, faces, material) in
            [("whole", 4, 0), ("open", 3, 0), ("pane", 3, 1), ("painted", 3, 2)]
        {
            let faces = closed[..faces].to_vec();
            world.meshes.push(WorldMesh::new(name, p.to_vec(), faces, material));
        }
        assert_eq!(world.into_scene(true).expect("a scene").open_glass, ["open"]);
    }
}
