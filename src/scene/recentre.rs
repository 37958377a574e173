//! From world space (f64, the user's units) to scene space (f32, about unit size).

use super::{
    Collapsed, Corners, Light, Material, Mesh, Scene, Sphere, Surface, World, WorldMesh,
    WorldSphere,
    light::{EmittingShape, EmittingSurface},
    too_small, winding,
};
use crate::error::{Error, Result};
use crate::math::{Bounds3, DVec3, Rgb, Vec3};
use serde::{Deserialize, Serialize};

/// `scene = (world − centre) · 2^log2_scale`. A power of two, so scaling rounds nothing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Recentring {
    /// World point that becomes the scene's origin.
    pub centre: DVec3,
    /// Exponent of the scale.
    pub log2_scale: i32,
}

impl Recentring {
    /// World and scene space are the same.
    pub const IDENTITY: Self = Self { centre: DVec3::ZERO, log2_scale: 0 };

    /// The recentring that brings `bounds` (world) to the origin and its longest half edge
    /// into `(0.5, 1]`.
    pub fn of(bounds: &Bounds3) -> Self {
        let half = 0.5 * bounds.extent().max_element();
        // Exact, unlike a logarithm: a scene twice as large gets a scale half as large, always.
        let (mantissa, exponent) = libm::frexp(half);
        let log2_scale = match half {
            half if half <= 0.0 => 0,
            _ if mantissa == 0.5 => 1 - exponent,
            _ => -exponent,
        };
        Self { centre: bounds.centre(), log2_scale }
    }

    /// Scene units in a world unit: a power of two.
    pub fn scale(&self) -> f64 {
        libm::ldexp(1.0, self.log2_scale)
    }

    /// A world point in scene space.
    pub fn point_to_scene(&self, p: DVec3) -> DVec3 {
        (p - self.centre) * self.scale()
    }

    /// A scene point in world space.
    pub fn point_to_world(&self, p: DVec3) -> DVec3 {
        p / self.scale() + self.centre
    }

    /// Radiant intensity in scene units, so that the irradiance intensity/d² stays what it was in world units.
    pub fn intensity_to_scene(&self, intensity: Rgb) -> Rgb {
        let scale = self.scale();
        (intensity.as_dvec3() * scale * scale).as_vec3()
    }

    /// A scene length in world units.
    pub fn length_to_world(&self, length: f64) -> f64 {
        length / self.scale()
    }
}

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
    /// Errors: an index of a material or vertex that there is not; a scene whose longest edge lies outside `[1e-30, 1e30]` world units; a light or
    /// sphere whose place is not finite; a mesh, sphere or area light so small beside the scene
    /// that f32 would crush it, or a mesh of which it would crush most triangles (`recentre` only).
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
        let to_scene_box = |b: &Bounds3| Bounds3 {
            min: recentring.point_to_scene(b.min),
            max: recentring.point_to_scene(b.max),
        };
        let traced_regions = self.traced_regions.iter().map(to_scene_box).collect();

        let mut meshes = Vec::with_capacity(self.meshes.len());
        let mut collapsed = Vec::new();
        for mesh in std::mem::take(&mut self.meshes) {
            let (mesh, lost) = to_scene_mesh(mesh, &self.materials, &recentring);
            let lost = Collapsed { mesh: mesh.name.clone(), lost, of: mesh.triangles.len() };
            if recentre {
                too_small::refuse_collapsed(&lost)?;
            }
            if lost.lost > 0 {
                collapsed.push(lost);
            }
            meshes.push(mesh);
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
        Ok(Scene {
            recentring,
            meshes,
            spheres,
            materials: self.materials,
            textures: self.textures,
            lights,
            sky: self.sky,
            traced_regions,
            bounds: scene_bounds,
            collapsed,
        })
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

/// The mesh in scene space, and how many of its triangles rounding took.
fn to_scene_mesh(mesh: WorldMesh, materials: &[Material], r: &Recentring) -> (Mesh, usize) {
    let WorldMesh { name, positions, mut triangles, mut normals, mut uvs, material, always_traced } =
        mesh;
    if materials[material as usize].glass.is_some() {
        // Glass tells inside from outside by the winding; a file with reversed faces, some or all,
        // would otherwise refract as a hole in glass.
        let mut volume = winding::closed_volume(&positions, &triangles);
        if volume.is_none() {
            let strays = winding::strays(&positions, &triangles);
            let strays = strays.into_iter().flatten().enumerate().filter(|(_, stray)| *stray);
            strays.for_each(|(i, _)| reverse_one(i, &mut triangles, &mut normals, &mut uvs));
            volume = winding::closed_volume(&positions, &triangles);
        }
        if volume.is_some_and(|volume| volume < 0.0) {
            reverse(&mut triangles, &mut normals, &mut uvs);
        }
    }
    let rounded: Vec<Vec3> = positions.iter().map(|p| r.point_to_scene(*p).as_vec3()).collect();
    let lost = too_small::count_collapsed(&positions, &rounded, &triangles);
    let surface = Surface { material, light: None, always_traced };
    (scene_mesh(name, rounded, triangles, normals, uvs, surface), lost)
}

fn scene_mesh(
    name: String,
    mut positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    normals: Option<Corners<Vec3>>,
    uvs: Option<Corners<crate::math::Vec2>>,
    surface: Surface,
) -> Mesh {
    let mut bounds = Bounds3::EMPTY;
    for t in &triangles {
        t.iter().for_each(|i| bounds.include(positions[*i as usize].as_dvec3()));
    }
    let vertex_count = positions.len();
    positions.push(Vec3::ZERO);
    Mesh { name, positions, vertex_count, triangles, normals, uvs, surface, bounds }
}

fn reverse_one(
    index: usize,
    triangles: &mut [[u32; 3]],
    normals: &mut Option<Corners<Vec3>>,
    uvs: &mut Option<Corners<crate::math::Vec2>>,
) {
    triangles[index].swap(1, 2);
    let normals = normals.as_mut().and_then(|n| n.corners.as_mut());
    let uvs = uvs.as_mut().and_then(|uv| uv.corners.as_mut());
    normals.into_iter().chain(uvs).for_each(|corners| corners[index].swap(1, 2));
}

fn reverse(
    triangles: &mut [[u32; 3]],
    normals: &mut Option<Corners<Vec3>>,
    uvs: &mut Option<Corners<crate::math::Vec2>>,
) {
    triangles.iter_mut().for_each(|t| t.swap(1, 2));
    if let Some(n) = normals {
        n.values.iter_mut().for_each(|v| *v = -*v);
        n.corners.iter_mut().flatten().for_each(|t| t.swap(1, 2));
    }
    if let Some(uv) = uvs {
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
            meshes.push(scene_mesh(name, corners, triangles, None, None, surface));
        }
        EmittingShape::Sphere(centre, radius) => {
            spheres.push(Sphere { name, centre, radius, surface });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scale_of(half: f64) -> f64 {
        let bounds = Bounds3 { min: DVec3::splat(-half), max: DVec3::splat(half) };
        Recentring::of(&bounds).scale()
    }

    #[test]
    fn the_scale_follows_the_size_exactly() {
        // Just above a power of two: a logarithm rounds to the power itself, but not near 1.
        for half in [1.0, 1.0 + f64::EPSILON, 1.5, 2.0 - f64::EPSILON] {
            assert!((0.5..=1.0).contains(&(half * scale_of(half))) && half * scale_of(half) > 0.5);
            for k in -90..=90 {
                let power = libm::ldexp(1.0, k);
                assert_eq!(scale_of(half * power) * power, scale_of(half), "{half} times 2^{k}");
            }
        }
        assert_eq!(scale_of(0.0), 1.0);
    }
}
