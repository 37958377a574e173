//! Small scenes built in memory, and the shortest way from a world to a film.

#![allow(dead_code, clippy::unwrap_used, missing_docs)]

use std::sync::atomic::AtomicBool;
use tweenray::film::Film;
use tweenray::intersect;
use tweenray::math::{DVec3, Rgb, Vec2};
use tweenray::scene::{
    Camera, Corners, Material, Pose, Scene, Settings, Texture, World, WorldMesh, WorldSphere,
};
use tweenray::shade::Renderer;
use tweenray::stats::RayCounts;

#[derive(Clone)]
pub struct Job {
    pub world: World,
    pub camera: Camera,
    pub settings: Settings,
}

pub fn job(world: World, pose: Pose, width: u32, height: u32) -> Job {
    let camera = Camera::new(&pose, 40.0, width, height).unwrap();
    Job { world, camera, settings: Settings { width, height, spp: 1, ..Settings::default() } }
}

pub fn pose(eye: (f64, f64, f64), target: (f64, f64, f64)) -> Pose {
    Pose { eye: eye.into(), target: target.into(), up: DVec3::Y, roll_degrees: 0.0 }
}

pub fn render(job: &Job) -> (Film, RayCounts) {
    let scene = job.world.clone().into_scene(job.settings.rules.recentre).unwrap();
    render_scene(&scene, job)
}

pub fn render_scene(scene: &Scene, job: &Job) -> (Film, RayCounts) {
    let intersector = intersect::build(scene, &job.settings, 1).unwrap();
    first_frame(&Renderer::new(scene, &job.settings, &*intersector), job)
}

/// By the kernel that leaves no effect out.
pub fn render_with_every_effect(scene: &Scene, job: &Job) -> (Film, RayCounts) {
    let intersector = intersect::build(scene, &job.settings, 1).unwrap();
    let renderer = Renderer::new(scene, &job.settings, &*intersector).with_every_effect();
    first_frame(&renderer, job)
}

fn first_frame(renderer: &Renderer, job: &Job) -> (Film, RayCounts) {
    renderer.render(&job.camera, 1, true, &AtomicBool::new(false), &()).unwrap()
}

pub fn pixels(film: &Film) -> impl Iterator<Item = (u32, u32, Rgb)> + '_ {
    let width = film.width;
    film.rgb.iter().enumerate().map(move |(i, c)| (i as u32 % width, i as u32 / width, *c))
}

/// Where the middle of a pixel meets the plane y = `height`.
pub fn on_plane_y(job: &Job, x: u32, y: u32, height: f64) -> DVec3 {
    let dir = job.camera.direction(f64::from(x) + 0.5, f64::from(y) + 0.5);
    job.camera.eye + dir * ((height - job.camera.eye.y) / dir.y)
}

/// The pixel that a world point falls on.
pub fn pixel_of(job: &Job, p: DVec3) -> (u32, u32) {
    let (x, y, _) = job.camera.project(p).unwrap();
    (x as u32, y as u32)
}

pub fn mesh(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>, material: u32) -> WorldMesh {
    WorldMesh::new("test", positions, triangles, material)
}

pub fn quad(corners: [DVec3; 4], material: u32) -> WorldMesh {
    WorldMesh::quad("test", corners, material)
}

/// A plate in the plane y = 0 of half edge `half`, which faces up.
pub fn plate(material: Material, half: f64) -> World {
    let mut world = World::default();
    world.materials.push(material);
    let corners = [(-half, -half), (-half, half), (half, half), (half, -half)];
    world.meshes.push(quad(corners.map(|(x, z)| DVec3::new(x, 0.0, z)), 0));
    world
}

/// A [`plate`] of half edge `half`, with `image` laid once over it, the one that maps of the material name.
pub fn imaged_plate(material: Material, half: f64, image: Texture) -> World {
    let mut world = plate(material, half);
    let over = 2.0 * half;
    let uv = |p: &DVec3| Vec2::new((p.x / over + 0.5) as f32, (0.5 - p.z / over) as f32);
    let values = world.meshes[0].positions.iter().map(uv).collect();
    world.meshes[0].uvs = Some(Corners { values, corners: None });
    world.textures.push(image);
    world
}

/// The mean of the film's green.
pub fn mean(film: &Film) -> f64 {
    film.rgb.iter().map(|c| f64::from(c.y)).sum::<f64>() / film.rgb.len() as f64
}

/// A cube of half edge `half`, faces outwards.
pub fn cube(centre: DVec3, half: f64, material: u32) -> WorldMesh {
    let corner = |i: u32| {
        let sign = |bit: u32| if i >> bit & 1 == 1 { half } else { -half };
        centre + DVec3::new(sign(0), sign(1), sign(2))
    };
    let faces =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = faces.iter().flat_map(|f| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]]).collect();
    mesh((0..8).map(corner).collect(), triangles, material)
}

/// A unit sphere, analytic or as a fine mesh with smooth normals.
pub fn sphere_world(material: Material, tessellated: bool) -> World {
    let mut world = World::default();
    world.materials.push(material);
    if tessellated {
        let mut m = uv_sphere(64, 32);
        let values = m.positions.iter().map(|p| p.as_vec3().normalize()).collect();
        m.normals = Some(tweenray::scene::Corners { values, corners: None });
        world.meshes.push(m);
    } else {
        world.spheres.push(WorldSphere::new("sphere", DVec3::ZERO, 1.0, 0));
    }
    world
}

pub fn uv_sphere(nu: u32, nv: u32) -> WorldMesh {
    use std::f64::consts::{PI, TAU};
    let mut positions = Vec::new();
    for j in 0..=nv {
        for i in 0..nu {
            let (theta, phi) =
                (PI * f64::from(j) / f64::from(nv), TAU * f64::from(i) / f64::from(nu));
            let r = theta.sin();
            positions.push(DVec3::new(r * phi.cos(), theta.cos(), r * phi.sin()));
        }
    }
    let at = |j: u32, i: u32| j * nu + i % nu;
    let mut triangles = Vec::new();
    for j in 0..nv {
        for i in 0..nu {
            let (a, b, c, d) = (at(j, i), at(j, i + 1), at(j + 1, i), at(j + 1, i + 1));
            if j > 0 {
                triangles.push([a, b, c]);
            }
            if j + 1 < nv {
                triangles.push([b, d, c]);
            }
        }
    }
    mesh(positions, triangles, 0)
}

/// A frame of a scene in `scenes/`, at its own size or another.
pub fn load_job(scene: &str, frame: u32, size: Option<(u32, u32)>) -> Job {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("scenes")
        .join(scene)
        .join("scene.toml");
    let options = tweenray::import::LoadOptions { size, ..Default::default() };
    let loaded = tweenray::import::load(&path, &options).unwrap();
    let mut settings = loaded.settings;
    (settings.width, settings.height) = size.unwrap_or((settings.width, settings.height));
    let camera = loaded.shot.camera(frame, settings.width, settings.height).unwrap();
    Job { world: loaded.world, camera, settings }
}

/// The machine's cores.
pub fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, |n| n.get())
}
