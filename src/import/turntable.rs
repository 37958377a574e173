//! A bare mesh as a scene: the camera orbits it once, under a default light.
//!
//! The mesh stands on a neutral floor that fills the image behind it, lit by a bright sky and a
//! soft key light from the upper left of where the camera starts. A file with lights of its own
//! (the course's dialect, glTF) keeps them and gets a plain backdrop instead of floor, sky light and key. A file with a
//! camera of its own (glTF) is seen by that, and nothing is added but light where it has none.

use super::framing::{self, Lens};
use super::scene_file::to_y_up;
use super::{
    AddedStage, CameraChoice, FileCamera, LoadOptions, Loaded, Model, ModelOptions, emission,
    untextured,
};
use crate::error::{Diagnostic, Result};
use crate::math::{DAffine3, DVec3, Rgb};
use crate::scene::{
    CameraPath, DirectionalLight, Easing, Light, Material, NormalPolicy, QuadLight, Settings, Shot,
    ShotLens, Sky, World, WorldMesh, limits,
};
use std::path::Path;

/// Frames of the turn: 7.5 degrees each, two seconds of video.
const FRAMES: u32 = 48;
/// A longish lens, as for portraits.
const VFOV_DEGREES: f64 = 30.0;
/// Looking down by more than half the field of view keeps the horizon out of the image.
const ELEVATION_DEGREES: f64 = 22.0;
/// Sky of the course's scenes, as the source paper rendered them.
const BACKDROP: Rgb = Rgb::new(0.5, 0.6, 0.9);

/// Sky over a mesh without lights.
const STUDIO_SKY: Sky =
    Sky { radiance: Rgb::new(0.42, 0.45, 0.50), lights: true, ambient: Rgb::ZERO };
/// Irradiance of the key light at the middle, whatever the size, on a surface that faces it.
const KEY_IRRADIANCE: f64 = 2.4;
/// Its warm white.
const KEY_COLOUR: Rgb = Rgb::new(1.0, 0.96, 0.9);

/// Towards the key light: to the upper left of a camera that looks along -z.
fn key_direction() -> DVec3 {
    DVec3::new(-0.45, 0.75, 0.5).normalize()
}

/// Reads a mesh file and puts it on the turntable.
///
/// Errors: as [`super::load_model`]; a scale that moves the mesh out of range.
pub(super) fn load(path: &Path, options: &LoadOptions) -> Result<Loaded> {
    let policy = NormalPolicy::Auto { crease_degrees: super::DEFAULT_CREASE_DEGREES };
    let of_file = ModelOptions {
        camera: options.camera.clone().map_or(CameraChoice::First, CameraChoice::Named),
        time: options.time.unwrap_or(0.0),
        fps: options.fps,
    };
    let Model { mut world, mut warnings, warnings_alone, files, mut camera, has_lamps, repeats } =
        super::load_model_with(path, policy, &of_file)?;
    warnings.extend(warnings_alone);
    let transform = DAffine3::from_scale(DVec3::splat(options.scale)) * to_y_up(options.up);
    world.apply_transform(&transform)?;
    if let Some(camera) = &mut camera {
        camera.shot.apply_transform(&transform);
    }
    // What glows is no reason to leave out the lamp.
    let own_lights = has_lamps || !world.lights.is_empty();
    let glow = match &camera {
        Some(_) if !own_lights => emission::irradiance(&world),
        _ => 0.0,
    };
    for note in emission::adopt(&mut world, 0, 0) {
        warnings.push(Diagnostic::new(path, note.message()).help(note.help()));
    }
    for found in untextured::find(&world, 0) {
        warnings.push(Diagnostic::new(path, found.message()).help(found.help()));
    }
    let mut settings = Settings::for_files();
    let aspect = camera.as_ref().and_then(|camera| camera.aspect);
    if let Some((width, height)) = options.size {
        (settings.width, settings.height) = (width, height);
    } else if let Some(aspect) = aspect {
        settings.width = (aspect * f64::from(settings.height))
            .round()
            .clamp(1.0, f64::from(limits::MAX_EDGE)) as u32;
    }
    let aspect = f64::from(settings.width.max(1)) / f64::from(settings.height.max(1));
    let (shot, stage) = match camera {
        Some(FileCamera { shot, .. }) => {
            if !own_lights && glow < emission::DIM {
                warnings.push(light_up(&mut world, path, glow));
            }
            (shot, None)
        }
        None => put_on_stage(&mut world, own_lights, aspect),
    };
    Ok(Loaded { warnings, files, stage, repeats, ..Loaded::new(world, shot, settings) })
}

/// Lights a scene that has a camera and nothing that shines on more than itself, and says so.
fn light_up(world: &mut World, path: &Path, glow: f64) -> Diagnostic {
    world.sky = STUDIO_SKY;
    let irradiance = KEY_COLOUR * KEY_IRRADIANCE as f32;
    let to_light = key_direction();
    world.lights.push(Light::Directional(DirectionalLight { to_light, irradiance }));
    let what = if glow > 0.0 { "but what glows dimly" } else { "at all" };
    let message = format!(
        "the file has a camera and no light {what}: a bright sky and a light from the upper left were added"
    );
    Diagnostic::new(path, message).help("export the lights of the scene with it")
}

/// Adds floor and lights to `world`, where the file has no lights of its own, and gives the camera's orbit.
fn put_on_stage(world: &mut World, own_lights: bool, aspect: f64) -> (Shot, Option<AddedStage>) {
    let lens = Lens { vfov_degrees: VFOV_DEGREES, aspect };
    let (target, eye) = if own_lights && !world.spheres.is_empty() {
        frame_spheres(world, &lens)
    } else {
        framing::orbit(world, None, DVec3::Y, ELEVATION_DEGREES, &lens)
    };
    let stage = if own_lights {
        let ambient = Rgb::splat(0.1);
        world.sky = Sky { radiance: BACKDROP, lights: false, ambient };
        None
    } else {
        Some(Studio::around(world, target, eye, &lens).build(world))
    };
    let shot = Shot {
        path: CameraPath::Orbit { target, eye, axis: DVec3::Y, degrees: 360.0, roll_degrees: 0.0 },
        easing: Easing::Linear,
        frames: FRAMES,
        vfov_degrees: VFOV_DEGREES,
        projections: Vec::new(),
        lens: ShotLens::Pinhole,
    };
    (shot, stage)
}

/// In the course's scenes spheres stand on a plane that is far wider than what is to be seen.
fn frame_spheres(world: &World, lens: &Lens) -> (DVec3, DVec3) {
    let spheres = World { spheres: world.spheres.clone(), ..World::default() };
    let (target, eye) = framing::orbit(&spheres, None, DVec3::Y, ELEVATION_DEGREES, lens);
    // Room around them for their shadows and for the plane.
    (target, target + (eye - target) * 1.6)
}

/// Floor and lights, sized by what stands between them.
struct Studio {
    floor_height: f64,
    floor_half: f64,
    middle: DVec3,
    lamp_distance: f64,
}

impl Studio {
    /// A studio whose floor fills the image of a camera that orbits from `eye`.
    fn around(world: &World, target: DVec3, eye: DVec3, lens: &Lens) -> Self {
        let bounds = framing::bounds(world);
        let radius = if bounds.radius() > 0.0 { bounds.radius() } else { 1.0 };
        let middle = bounds.centre();
        let lowest = if bounds.is_empty() { 0.0 } else { bounds.min.y };
        // A hair lower, so that a flat bottom does not fight with the floor.
        let floor_height = lowest - 1e-3 * radius;
        let reach = floor_reach(target, eye, floor_height, lens);
        // As high as the camera or higher: views that only look down never see it.
        let lamp_distance = (5.0 * radius).max((eye - target).length());
        Self { floor_height, floor_half: 1.5 * reach, middle, lamp_distance }
    }

    fn build(&self, world: &mut World) -> AddedStage {
        let stage = AddedStage { floor: world.meshes.len(), lamp: world.lights.len() };
        let floor = self.floor(world.materials.len() as u32);
        world.materials.push(Material::diffuse("floor", Rgb::splat(0.6)));
        world.meshes.push(floor);
        world.lights.push(self.key_light());
        world.sky = STUDIO_SKY;
        stage
    }

    fn floor(&self, material: u32) -> WorldMesh {
        let DVec3 { x, z, .. } = self.middle;
        let h = self.floor_half;
        let corner = |sx: f64, sz: f64| DVec3::new(x + sx * h, self.floor_height, z + sz * h);
        let corners = [corner(-1., 1.), corner(1., 1.), corner(1., -1.), corner(-1., -1.)];
        WorldMesh::quad("floor", corners, material)
    }

    /// A square lamp that faces the middle from the upper left of the first frame's camera, which
    /// stands towards +z.
    fn key_light(&self) -> Light {
        let to_light = key_direction();
        let (distance, side) = (self.lamp_distance, 0.48 * self.lamp_distance);
        let right = DVec3::Y.cross(to_light).normalize() * (0.5 * side);
        let up = to_light.cross(right.normalize()) * (0.5 * side);
        let centre = self.middle + to_light * distance;
        // Counter-clockwise seen from the middle.
        let corners =
            [centre - right - up, centre - right + up, centre + right + up, centre + right - up];
        let radiance = KEY_COLOUR * (KEY_IRRADIANCE * (distance / side).powi(2)) as f32;
        Light::Quad(QuadLight { corners, radiance, two_sided: false })
    }
}

/// How far from the target's axis the upper corners of the image see the floor.
fn floor_reach(target: DVec3, eye: DVec3, floor_height: f64, lens: &Lens) -> f64 {
    let view = (target - eye).normalize_or(DVec3::NEG_Z);
    let right = view.cross(DVec3::Y).normalize_or(DVec3::X);
    let up = right.cross(view);
    let tan = libm::tan(0.5 * lens.vfov_degrees.to_radians());
    let corner = view + up * tan + right * (tan * lens.aspect);
    // Level or rising views see no end of it; a hundred distances must do.
    let far = 100.0 * (target - eye).length();
    let t = if corner.y < 0.0 { ((floor_height - eye.y) / corner.y).min(far) } else { far };
    let seen = eye + corner * t - target;
    libm::hypot(seen.x, seen.z)
}

#[cfg(test)]
mod tests;
