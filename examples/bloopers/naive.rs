//! The mistakes, and our own renderer for the other half.

use super::Still;
use super::picture::Picture;
use rayon::prelude::*;
use std::sync::atomic::AtomicBool;
use tweenray::intersect::{self, Hit, Intersector, Ray, SurfaceInteraction};
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::{DirectionalLight, Light, Scene};
use tweenray::shade::Renderer;
use tweenray::stats::RayCounts;

/// Our picture; with `test`, every hit must also pass the naive triangle test.
pub fn render(still: &Still, test: Option<EpsilonTest>) -> Picture {
    let settings = &still.settings;
    let scene = still.world.clone().into_scene(settings.rules.recentre).unwrap();
    let inner = intersect::build(&scene, settings, 4).unwrap();
    let naive = test.map(|test| WithHoles { inner: &*inner, scene: &scene, test });
    let intersector: &dyn Intersector = match &naive {
        Some(naive) => naive,
        None => &*inner,
    };
    let renderer = Renderer::new(&scene, settings, intersector);
    let stop = AtomicBool::new(false);
    let (film, _) = renderer.render(&still.camera, 1, false, &stop, &()).unwrap();
    Picture { width: film.width, height: film.height, rgb: film.rgb }
}

/// Möller and Trumbore's test as it is usually copied: a triangle whose determinant is below a
/// fixed epsilon counts as parallel to the ray, in the user's units and f32.
pub struct EpsilonTest {
    pub epsilon: f32,
}

impl EpsilonTest {
    fn passes(&self, scene: &Scene, ray: &Ray, hit: &Hit) -> bool {
        let Some(mesh) = scene.meshes.get(hit.prim.geom_id as usize) else { return true };
        let world = mesh
            .corners(hit.prim.prim_id as usize)
            .map(|c| scene.recentring.point_to_world(c).as_vec3());
        let (e1, e2) = (world[1] - world[0], world[2] - world[0]);
        let dir = ray.dir.normalize().as_vec3();
        e1.dot(dir.cross(e2)).abs() >= self.epsilon
    }
}

/// An intersector that loses what the naive test rejects.
struct WithHoles<'a> {
    inner: &'a dyn Intersector,
    scene: &'a Scene,
    test: EpsilonTest,
}

impl Intersector for WithHoles<'_> {
    fn intersect(&self, ray: &Ray, counts: &mut RayCounts) -> Option<Hit> {
        let mut ahead = *ray;
        loop {
            let hit = self.inner.intersect(&ahead, counts)?;
            if self.test.passes(self.scene, ray, &hit) {
                return Some(hit);
            }
            ahead = Ray { tnear: hit.t, exclude: hit.prim, ..ahead };
        }
    }

    fn occluded(&self, ray: &Ray, counts: &mut RayCounts) -> bool {
        self.intersect(ray, counts).is_some()
    }

    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], counts: &mut RayCounts) {
        rays.iter().zip(hits).for_each(|(ray, hit)| *hit = self.intersect(ray, counts));
    }

    fn occluded_batch(&self, rays: &[Ray], occluded: &mut [bool], counts: &mut RayCounts) {
        rays.iter().zip(occluded).for_each(|(ray, out)| *out = self.occluded(ray, counts));
    }

    fn describe(&self) -> String {
        "with the naive test".into()
    }

    fn memory(&self) -> u64 {
        self.inner.memory()
    }
}

/// What a careless shader believes of normals.
#[derive(Clone, Copy)]
pub enum NormalMistake {
    /// The side that the winding names is the lit one.
    OneSided,
    /// The file's normals are right, whatever was done to the mesh since.
    TrustTheFile,
}

/// The scene shaded by `max(0, n·l)` with a normal taken on trust.
pub fn shade(still: &Still, mistake: NormalMistake) -> Picture {
    sample(still, |scene, intersector, ray| {
        let mut counts = RayCounts::default();
        let Some(hit) = intersector.intersect(&ray, &mut counts) else { return scene.sky.radiance };
        let si = SurfaceInteraction::new(scene, &ray, &hit);
        let n = match mistake {
            NormalMistake::OneSided => si.ns,
            NormalMistake::TrustTheFile => file_normal(scene, &hit).unwrap_or(si.ns),
        };
        let Light::Directional(DirectionalLight { to_light, irradiance }) = scene.lights[0] else {
            panic!("the still life has one sun")
        };
        let to_shadow = Ray { exclude: hit.prim, ..Ray::new(si.p + si.ng * 1e-5, to_light) };
        let shadowed = intersector.occluded(&to_shadow, &mut counts);
        let lit = if shadowed { 0.0 } else { n.dot(to_light).max(0.0) as f32 };
        let albedo = scene.materials[si.surface.material as usize].diffuse;
        albedo * (irradiance * lit / std::f32::consts::PI + scene.sky.ambient)
    })
}

/// The interpolated normal without a look at the triangle's own.
fn file_normal(scene: &Scene, hit: &Hit) -> Option<DVec3> {
    let mesh = scene.meshes.get(hit.prim.geom_id as usize)?;
    let prim = hit.prim.prim_id as usize;
    let [a, b, c] = mesh.normals.as_ref()?.get(prim, mesh.triangles[prim]).map(|n| n.as_dvec3());
    (a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v).try_normalize()
}

/// Glass whose index is never inverted: a ray that leaves bends as if it entered.
pub fn wrong_glass(still: &Still) -> Picture {
    sample(still, |scene, intersector, mut ray| {
        let mut counts = RayCounts::default();
        for _ in 0..6 {
            let Some(hit) = intersector.intersect(&ray, &mut counts) else { break };
            let si = SurfaceInteraction::new(scene, &ray, &hit);
            let material = &scene.materials[si.surface.material as usize];
            let Some(glass) = &material.glass else {
                return material.diffuse * scene.sky.ambient;
            };
            let towards = ray.dir.normalize();
            let n = if towards.dot(si.ng) < 0.0 { si.ng } else { -si.ng };
            // The mistake: 1/ior on the way in and 1/ior on the way out.
            let eta = 1.0 / glass.ior;
            let cos_i = -towards.dot(n);
            let cos_t = (1.0 - eta * eta * (1.0 - cos_i * cos_i)).max(0.0).sqrt();
            let bent = towards * eta + n * (eta * cos_i - cos_t);
            ray = si.spawn(bent, true);
        }
        scene.sky.radiance
    })
}

/// A picture of one radiance a ray, 3 x 3 rays a pixel.
fn sample(
    still: &Still,
    radiance: impl Fn(&Scene, &dyn Intersector, Ray) -> Rgb + Sync,
) -> Picture {
    let scene = still.world.clone().into_scene(true).unwrap();
    let intersector = intersect::build(&scene, &still.settings, 4).unwrap();
    let camera = still.camera.to_scene(&scene.recentring);
    let (width, height) = (camera.width, camera.height);
    let pixel = |k: u32| {
        let at = |i: u32| (f64::from(i) + 0.5) / 3.0;
        let sum = (0..9).fold(Rgb::ZERO, |sum, i| {
            let (x, y) = (f64::from(k % width) + at(i % 3), f64::from(k / width) + at(i / 3));
            sum + radiance(&scene, &*intersector, Ray::new(camera.eye, camera.direction(x, y)))
        });
        sum / 9.0
    };
    Picture { width, height, rgb: (0..width * height).into_par_iter().map(pixel).collect() }
}
