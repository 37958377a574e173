//! Renders one frame of a scene that is built in code, and writes it as a png:
//! `cargo run --example 1_one_frame` writes `one_frame.png` into the current folder.

#![allow(clippy::print_stdout, reason = "a program for people")]

use std::path::Path;
use std::sync::atomic::AtomicBool;
use tweenray::error::{Error, Result};
use tweenray::intersect;
use tweenray::math::{DVec3, Rgb};
use tweenray::output::{WriteOptions, write_image};
use tweenray::scene::{Camera, Light, Material, PointLight, Pose, Settings, Sky};
use tweenray::scene::{World, WorldMesh, WorldSphere};
use tweenray::shade::Renderer;

fn main() -> Result<()> {
    // What is not set has its default, as the 640 x 360 pixels. A number of samples means that number in every pixel.
    let settings = Settings { spp: 16, ..Settings::default() };
    render(&settings, Path::new("one_frame.png"))
}

/// A red ball on a white floor under `light`, f64, in whatever unit one likes, with y up.
pub fn world_under(light: Light) -> World {
    let mut world = World::default();
    let white = world.add_material(Material::diffuse("white", Rgb::splat(0.8)));
    let red = world.add_material(Material::diffuse("red", Rgb::new(0.7, 0.1, 0.1)));
    // Counter-clockwise seen from above: that side is outside.
    let corners = [(-4.0, 4.0), (4.0, 4.0), (4.0, -4.0), (-4.0, -4.0)];
    let floor = corners.map(|(x, z)| DVec3::new(x, 0.0, z));
    world.meshes.push(WorldMesh::quad("floor", floor, white));
    world.spheres.push(WorldSphere::new("ball", DVec3::Y, 1.0, red));
    world.lights.push(light);
    // A backdrop that lights nothing.
    world.sky = Sky { radiance: Rgb::new(0.2, 0.3, 0.5), lights: false, ..Sky::default() };
    world
}

/// The camera of an image of the settings' size, with a vertical field of view of 40 degrees.
pub fn camera(settings: &Settings) -> Result<Camera> {
    let pose = Pose::look_at(DVec3::new(0.0, 2.5, 7.0), DVec3::new(0.0, 0.8, 0.0));
    Camera::new(&pose, 40.0, settings.width, settings.height)
}

/// Renders the world to `file`, whose ending (png, exr or ppm) is its format.
pub fn render(settings: &Settings, file: &Path) -> Result<()> {
    // The world is moved to its own centre and rounded to f32, once; Embree then builds its tree.
    let (position, intensity) = (DVec3::new(2.0, 4.0, 2.0), Rgb::splat(40.0));
    let lamp = Light::Point(PointLight { position, intensity });
    let scene = world_under(lamp).into_scene(true)?;
    let intersector = intersect::build(&scene, settings, 1)?;
    let renderer = Renderer::new(&scene, settings, &*intersector);
    // Frame 1, the picture alone; nobody stops the frame or watches it grow.
    let (camera, never) = (camera(settings)?, AtomicBool::new(false));
    let (film, rays) = renderer.render(&camera, 1, false, &never, &()).ok_or(Error::Stopped)?;
    write_image(file, &film, &WriteOptions::of(settings, None))?;
    println!("{}: {} rays by {}", file.display(), rays.total(), intersector.describe());
    Ok(())
}
