//! The scene as plain immutable data with indices, in two forms.
//!
//! [`World`] is what import makes: f64, in the user's units. [`World::into_scene`] moves it to
//! its own centre, scales it by a power of two to about unit size and rounds positions to f32
//! once: that is the [`Scene`] that Embree, the f64 recheck and the oracle all see. Everything
//! downstream of here works in *scene space*; [`Recentring`] leads back to the world.
//!
//! Not done: instances share no memory; every placed mesh is its own copy
//! (`docs/decisions`).

mod alpha;
mod aovs;
mod camera;
mod check;
mod emitting_mesh;
mod environment;
mod face_lights;
mod fog;
mod job;
mod lens;
mod light;
mod light_cells;
pub mod limits;
mod material;
mod mesh;
mod path;
mod place;
mod projection;
mod recentre;
mod recentring;
mod reuse;
mod settings;
mod spline;
mod texture;
mod time;
mod tints;
mod too_small;
mod vertex_colours;
mod weld;
mod winding;

pub use alpha::{AlphaMask, LaidMask, MaskId};
pub use aovs::{Aov, Aovs};
pub use camera::{Camera, Pose};
pub(crate) use environment::brightest;
pub use environment::{
    Daylight, Environment, EnvironmentKind, EnvironmentRadiance, IrradianceTable, RadianceTable,
    SceneEnvironment, SkyGradient, SunSky, brightness, image_place,
};
pub use face_lights::FaceLights;
pub use fog::Fog;
pub use job::JobOptions;
pub use lens::{Focus, Lens, LensKey, ShotLens, ThinLens, ThinLensPath};
pub use light::{
    DirectionalLight, DiskLight, FaceLight, FarField, Light, PointLight, QuadLight, Sky,
    SphereLight, SpotLight, SunLight,
};
pub(crate) use light_cells::FEW_LIGHTS;
pub use light_cells::{CellLight, CellLights, LightCells, MeanLights, Tail};
pub use material::{Fresnel, Glass, Material, MaterialId, NormalMap};
pub use mesh::{Corners, Mesh, NormalPolicy, Sphere, Surface, WorldMesh, WorldSphere};
pub use path::{CameraPath, Easing, FramePose, KeyPose, Shot};
pub use projection::{Projection, ProjectionKey};
pub use recentring::Recentring;
pub use reuse::{Policy, ReuseSettings};
pub use settings::{
    BuildQuality, Filter, FrameRange, GlassShadows, HitRules, IntersectorKind, Recheck, Rect,
    Settings, ToneCurve,
};
pub use texture::{PointRow, Texture, TextureId, TextureLevel, TextureMap, Wrap};
pub use time::{SaveInterval, parse_time, parse_time_limit};
pub use tints::{PRIMARIES, part, ratio_count, tints};
pub use too_small::Collapsed;
pub use vertex_colours::VertexColours;
pub(crate) use weld::weld;
pub(crate) use winding::{NO_VOLUME, borders, closed_volume};

use crate::math::{Bounds3, DVec3};
use serde::{Deserialize, Serialize};

/// A scene as read or built: f64 positions in world units (y up unless the file says otherwise).
///
/// ```
/// use tweenray::math::{DVec3, Rgb};
/// use tweenray::scene::{Material, World, WorldSphere};
///
/// let mut world = World::default();
/// let red = world.add_material(Material::diffuse("red", Rgb::new(0.7, 0.1, 0.1)));
/// world.spheres.push(WorldSphere::new("ball", DVec3::new(100.0, 0.0, 0.0), 8.0, red));
/// // Scene space has its origin in the middle, and about unit size.
/// let scene = world.into_scene(true)?;
/// assert_eq!(scene.spheres[0].centre, DVec3::ZERO);
/// assert_eq!(scene.spheres[0].radius, 1.0);
/// assert_eq!(scene.recentring.point_to_world(DVec3::ZERO), DVec3::new(100.0, 0.0, 0.0));
/// # Ok::<(), tweenray::error::Error>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct World {
    /// Placed meshes (transforms already applied).
    pub meshes: Vec<WorldMesh>,
    /// Placed analytic spheres.
    pub spheres: Vec<WorldSphere>,
    /// Materials, named by [`MaterialId`].
    pub materials: Vec<Material>,
    /// Decoded images, named by [`TextureId`].
    pub textures: Vec<Texture>,
    /// Masks of cut-outs, named by [`MaskId`].
    pub masks: Vec<AlphaMask>,
    /// Lights. None has a surface in `meshes` or `spheres` yet.
    /// Area lights get their emitting surface from [`World::into_scene`].
    pub lights: Vec<Light>,
    /// The light of rays that hit nothing.
    pub sky: Sky,
    /// Light from outside that differs by direction, in place of the sky's radiance. The sky says whether it lights surfaces.
    pub environment: Option<Environment>,
    /// What fills the space between surfaces, world space.
    pub fog: Option<Fog>,
    /// Boxes in which light is traced in every frame, never reused; world space.
    pub traced_regions: Vec<Bounds3>,
}

/// A scene ready to trace: immutable, in scene space (see [`Recentring`]).
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Scene {
    /// How world and scene space belong together.
    pub recentring: Recentring,
    /// Triangle meshes; a mesh's index is its `geom_id`.
    pub meshes: Vec<Mesh>,
    /// Analytic spheres; together they are the geometry after the last mesh.
    pub spheres: Vec<Sphere>,
    /// Materials.
    pub materials: Vec<Material>,
    /// Textures.
    pub textures: Vec<Texture>,
    /// Masks of cut-outs.
    pub masks: Vec<AlphaMask>,
    /// Lights, area lights included.
    pub lights: Vec<Light>,
    /// The light of rays that hit nothing.
    pub sky: Sky,
    /// Light from outside that differs by direction, in place of the sky's radiance.
    pub environment: Option<SceneEnvironment>,
    /// What fills the space between surfaces.
    pub fog: Option<Fog>,
    /// Boxes in which light is traced in every frame, never reused.
    pub traced_regions: Vec<Bounds3>,
    /// Bounds of all geometry, f64, scene space.
    pub bounds: Bounds3,
    /// Meshes that lost triangles to rounding. Tracing does not use it; it is reported.
    pub collapsed: Vec<Collapsed>,
    /// Names of meshes that bound bodies of glass and are open. Reported, as `collapsed` is.
    pub open_glass: Vec<String>,
    /// Which lights matter where; `None` of a scene with few lights, all of which are looked at everywhere.
    pub light_cells: Option<LightCells>,
}

impl Scene {
    /// The `geom_id` under which the analytic spheres are traced.
    pub fn sphere_geom_id(&self) -> u32 {
        self.meshes.len() as u32
    }

    /// The area light whose surface was met at the weights `u` and `v` of the second and third corner of triangle `prim_id` of
    /// mesh `geom_id`, or on sphere number `prim_id`.
    pub fn light_at(&self, (geom_id, prim_id): (u32, u32), (u, v): (f64, f64)) -> Option<u32> {
        match self.meshes.get(geom_id as usize) {
            Some(mesh) => match &mesh.lights {
                Some(lights) => lights.light(prim_id, u, v),
                None => mesh.surface.light,
            },
            None => self.spheres[prim_id as usize].surface.light,
        }
    }

    /// Whether any light must be traced in every frame.
    pub fn has_always_traced(&self) -> bool {
        !self.traced_regions.is_empty()
            || self.meshes.iter().any(|m| m.surface.always_traced)
            || self.spheres.iter().any(|s| s.surface.always_traced)
    }

    /// Whether the light at `p`, on mesh `geom_id` or on sphere number `prim_id`, must be.
    pub fn is_always_traced(&self, geom_id: u32, prim_id: u32, p: DVec3) -> bool {
        let surface = match self.meshes.get(geom_id as usize) {
            Some(mesh) => &mesh.surface,
            None => &self.spheres[prim_id as usize].surface,
        };
        surface.always_traced || self.traced_regions.iter().any(|region| region.contains(p))
    }

    /// The cells that lights are selected by; `None` where all are looked at everywhere.
    pub fn selected_lights(&self, settings: &Settings) -> Option<&LightCells> {
        self.light_cells.as_ref().filter(|_| !settings.all_lights)
    }

    /// The mask of a surface, if its material has one.
    pub fn mask(&self, surface: Surface) -> Option<LaidMask<'_>> {
        let map = self.materials[surface.material as usize].alpha.as_ref()?;
        Some(LaidMask { mask: &self.masks[map.image as usize], map })
    }

    /// The mask that cuts holes into `mesh`: none without the texture coordinates that say where they lie.
    pub fn mesh_mask(&self, mesh: &Mesh) -> Option<LaidMask<'_>> {
        self.mask(mesh.surface).filter(|mask| mask.uvs(mesh).is_some())
    }

    /// Triangles in all meshes.
    pub fn triangle_count(&self) -> usize {
        self.meshes.iter().map(|m| m.triangles.len()).sum()
    }
}
