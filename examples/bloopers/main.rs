//! `./x bloopers [MESH]`: what goes wrong in ray tracers that trust too much, each picture beside
//! ours, into `docs/pictures`. The classic mistakes are those of figures 12 and 14 to 16 of
//! "Optimized Ray Tracing for Single Scene Renders" (2023), and acne far from the origin.
//!
//! Every wrong picture is made by the mistake itself, never painted. MESH stands in for the rabbit.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a program for people")]

mod naive;
mod picture;
mod rabbit;

use naive::{EpsilonTest, NormalMistake};
use picture::Picture;
use std::path::Path;
use tweenray::math::{DMat3, DVec3, Rgb};
use tweenray::scene::{
    Camera, DirectionalLight, Glass, HitRules, Light, Material, Pose, Settings, Sky, World,
    WorldMesh, WorldSphere,
};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/pictures");
/// Pixels of one half of a picture.
const WIDTH: u32 = 360;
const HEIGHT: u32 = 300;

fn main() {
    let mesh = match std::env::args().nth(1) {
        Some(file) => rabbit::read(Path::new(&file)),
        None => rabbit::rabbit(),
    };
    save("blooper-12-epsilon", holes(&mesh));
    save("blooper-14-reversed-normals", reversed(&mesh));
    save("blooper-15-rotated-normals", rotated(&mesh));
    save("blooper-16-refraction", refraction());
    save("blooper-acne", acne());
}

fn save(name: &str, [wrong, ours]: [Picture; 2]) {
    let path = Path::new(FOLDER).join(name).with_extension("png");
    picture::save_beside(&path, &wrong, &ours);
    println!("{}", path.display());
}

/// The rabbit on a floor under a lamp and a pale sky; `scale` makes it small.
fn still_life(mesh: &WorldMesh, scale: f64) -> Still {
    let mut world = World::default();
    world.materials.push(Material::diffuse("clay", Rgb::new(0.75, 0.55, 0.4)));
    world.materials.push(Material::diffuse("floor", Rgb::splat(0.5)));
    let mut mesh = mesh.clone();
    mesh.positions.iter_mut().for_each(|p| *p *= scale);
    mesh.material = 0;
    world.meshes.push(mesh);
    let far = 20.0 * scale;
    let floor = [(-far, far), (far, far), (far, -far), (-far, -far)];
    world.meshes.push(WorldMesh::quad("quad", floor.map(|(x, z)| DVec3::new(x, 0.0, z)), 1));
    world.lights.push(Light::Directional(DirectionalLight {
        to_light: DVec3::new(-0.5, 0.8, 0.6).normalize(),
        irradiance: Rgb::splat(2.2),
    }));
    world.sky = Sky { radiance: Rgb::splat(0.25), lights: false, ambient: Rgb::splat(0.25) };
    let (eye, target) = (DVec3::new(0.5, 1.1, 2.9), DVec3::new(0.0, 0.62, 0.0));
    Still::new(world, eye * scale, target * scale)
}

/// What is rendered: a world, a camera, settings.
pub struct Still {
    /// The world.
    pub world: World,
    /// The camera.
    pub camera: Camera,
    /// Size and samples.
    pub settings: Settings,
}

impl Still {
    fn new(world: World, eye: DVec3, target: DVec3) -> Self {
        let pose = Pose { eye, target, up: DVec3::Y, roll_degrees: 0.0 };
        let camera = Camera::new(&pose, 36.0, WIDTH, HEIGHT).unwrap();
        let settings = Settings { width: WIDTH, height: HEIGHT, spp: 9, ..Settings::default() };
        Self { world, camera, settings }
    }
}

/// Figure 12: a rabbit 13 centimetres high, in metres, against a determinant threshold of 1e-6.
fn holes(mesh: &WorldMesh) -> [Picture; 2] {
    let still = still_life(mesh, 0.1);
    [naive::render(&still, Some(EpsilonTest { epsilon: 1e-6 })), naive::render(&still, None)]
}

/// Figure 14: a mesh wound the other way round, shaded by the side its triangles name.
fn reversed(mesh: &WorldMesh) -> [Picture; 2] {
    let mut still = still_life(mesh, 1.0);
    let mesh = &mut still.world.meshes[0];
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    if let Some(normals) = &mut mesh.normals {
        normals.values.iter_mut().for_each(|n| *n = -*n);
        if let Some(corners) = &mut normals.corners {
            corners.iter_mut().for_each(|t| t.swap(1, 2));
        }
    }
    [naive::shade(&still, NormalMistake::OneSided), naive::render(&still, None)]
}

/// Figure 15: the mesh is turned, its normals stay.
fn rotated(mesh: &WorldMesh) -> [Picture; 2] {
    let turn = DMat3::from_rotation_y(2.2);
    let turned = |normals_too: bool| {
        let mut still = still_life(mesh, 1.0);
        let mesh = &mut still.world.meshes[0];
        mesh.positions.iter_mut().for_each(|p| *p = turn * *p);
        if let (true, Some(normals)) = (normals_too, &mut mesh.normals) {
            normals.values.iter_mut().for_each(|n| *n = (turn * n.as_dvec3()).as_vec3());
        }
        still
    };
    [naive::shade(&turned(false), NormalMistake::TrustTheFile), naive::render(&turned(true), None)]
}

/// Figure 16: a glass ball whose rays are refracted on leaving as if they entered.
fn refraction() -> [Picture; 2] {
    let mut world = World::default();
    let glass = Glass::clear(1.5);
    world.materials.push(Material { glass: Some(glass), ..Material::black("glass") });
    world.materials.push(Material::diffuse("dark", Rgb::new(0.12, 0.14, 0.2)));
    world.materials.push(Material::diffuse("light", Rgb::new(0.75, 0.72, 0.65)));
    let (centre, radius) = (DVec3::new(0.2, 1.0, 0.0), 0.8);
    world.spheres.push(WorldSphere::new("ball", centre, radius, 0));
    for i in -8..8 {
        for j in 0..8 {
            let material = if (i + j) % 2 == 0 { 1 } else { 2 };
            let (x, y) = (f64::from(i) * 0.5, f64::from(j) * 0.5);
            let wall = [(x, y), (x + 0.5, y), (x + 0.5, y + 0.5), (x, y + 0.5)];
            world.meshes.push(WorldMesh::quad(
                "quad",
                wall.map(|(x, y)| DVec3::new(x, y, -2.0)),
                material,
            ));
            let z = f64::from(j) * 0.5 - 2.0;
            let floor = [(x, z + 0.5), (x + 0.5, z + 0.5), (x + 0.5, z), (x, z)];
            world.meshes.push(WorldMesh::quad(
                "quad",
                floor.map(|(x, z)| DVec3::new(x, 0.0, z)),
                3 - material,
            ));
        }
    }
    world.sky = Sky { radiance: Rgb::splat(0.6), lights: false, ambient: Rgb::splat(1.0) };
    let still = Still::new(world, DVec3::new(0.0, 1.3, 3.6), DVec3::new(0.0, 1.0, 0.0));
    [naive::wrong_glass(&still), naive::render(&still, None)]
}

/// Acne: a scene far from the origin, f32 world coordinates, shadow rays from the surface itself.
fn acne() -> [Picture; 2] {
    let mut still = still_life(&rabbit::rabbit(), 1.0);
    let away = DVec3::new(4_000.0, 0.0, -6_000.0);
    let world = &mut still.world;
    world.meshes.iter_mut().flat_map(|m| &mut m.positions).for_each(|p| *p += away);
    still.camera.eye += away;
    let ours = naive::render(&still, None);
    still.settings.rules =
        HitRules { spawn_offset: false, recentre: false, ..still.settings.rules };
    [naive::render(&still, None), ours]
}
