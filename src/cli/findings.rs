//! Warnings of `inspect`, from a few hundred rays, without rendering.

use crate::error::Result;
use crate::intersect::{Hit, Intersector, Ray};
use crate::math::{Bounds3, DVec3};
use crate::scene::{Camera, Scene, Settings, Shot};
use crate::stats::RayCounts;

/// Number of frames that are checked, spread over the shot, both ends included.
const FRAMES: u32 = 9;
/// Number of rays in all directions from the eye; a Fibonacci lattice spreads them evenly.
const AROUND: usize = 128;
/// Columns and rows of camera rays in a frame.
const GRID: (u32, u32) = (24, 16);
/// Share of the rays from the eye that hit back faces from which on a warning is given. Under an open terrain the
/// share is about a half; outside of closed meshes it is nearly 0.
const INSIDE: f64 = 0.4;

/// Warnings about the scene as this shot shows it.
pub fn findings(
    scene: &Scene,
    settings: &Settings,
    shot: &Shot,
    intersector: &dyn Intersector,
) -> Result<Vec<String>> {
    let mut warnings: Vec<String> = no_light(scene, settings).into_iter().collect();
    warnings.extend(empty_regions(scene));
    let mut inside = Vec::new();
    let mut blank = Vec::new();
    let frames = sampled_frames(shot.frames);
    for &frame in &frames {
        let camera = shot.camera(frame, settings.width, settings.height)?;
        let camera = camera.to_scene(&scene.recentring);
        if share_of_back_faces(scene, &camera, intersector) >= INSIDE {
            inside.push(frame);
        }
        if sees_nothing(&camera, intersector) {
            blank.push(frame);
        }
    }
    if !inside.is_empty() {
        warnings.push(format!(
            "the camera is inside geometry, or normals point the wrong way ({}): most rays from \
             the eye meet back faces first",
            list(&inside)
        ));
    }
    if blank.len() == frames.len() {
        warnings
            .push("nothing is visible: no camera ray of any frame looked at hits anything".into());
    } else if !blank.is_empty() {
        warnings.push(format!("nothing is visible in some frames ({})", list(&blank)));
    }
    Ok(warnings)
}

/// Boxes of `[[reuse.traced]]` in which there is nothing to trace.
fn empty_regions(scene: &Scene) -> impl Iterator<Item = String> {
    let bounds = scene.bounds;
    let misses = move |region: &Bounds3| {
        region.min.cmpgt(bounds.max).any() || region.max.cmplt(bounds.min).any()
    };
    let regions = scene.traced_regions.iter().enumerate();
    let missing = regions.filter(move |(_, region)| misses(region));
    missing.map(|(i, _)| format!("box {} of [[reuse.traced]] holds nothing of the scene", i + 1))
}

/// Up to [`FRAMES`] frames of `1..=count`.
fn sampled_frames(count: u32) -> Vec<u32> {
    let steps = FRAMES.min(count).max(1);
    let at =
        |i: u32| 1 + (u64::from(i) * u64::from(count - 1) / u64::from((steps - 1).max(1))) as u32;
    (0..steps).map(at).collect()
}

fn list(frames: &[u32]) -> String {
    let word = if frames.len() == 1 { "frame" } else { "frames" };
    let numbers: Vec<String> = frames.iter().map(u32::to_string).collect();
    format!("{word} {}", numbers.join(", "))
}

/// Why every surface would be black though the scene has something bright. (Import warns itself
/// where nothing at all is bright.)
fn no_light(scene: &Scene, settings: &Settings) -> Option<String> {
    let sky = &scene.sky;
    let sky_bright = sky.radiance.max_element() > 0.0 || scene.environment.is_some();
    let sky_lights = sky_bright && sky.lights && settings.sky_samples > 0;
    let has_area_lights = !scene.lights.is_empty();
    if sky_lights
        || sky.ambient.max_element() > 0.0
        || scene.lights.iter().any(|light| !light.is_area())
        || (has_area_lights && settings.shadow_samples > 0)
    {
        return None;
    }
    let mut why = Vec::new();
    if has_area_lights {
        why.push("shadow-samples is 0, which leaves area lights out");
    }
    if sky_bright && !sky.lights {
        why.push("the sky is only a backdrop");
    }
    if sky_bright && sky.lights {
        why.push("sky-samples is 0, which leaves the sky out");
    }
    (!why.is_empty()).then(|| format!("no light reaches any surface: {}", why.join("; ")))
}

/// Share of rays in all directions from the eye whose first hit is a surface seen from behind.
fn share_of_back_faces(scene: &Scene, camera: &Camera, intersector: &dyn Intersector) -> f64 {
    let rays: Vec<Ray> = (0..AROUND).map(|i| Ray::new(camera.eye, fibonacci(i))).collect();
    let hits = trace(&rays, intersector);
    let behind = rays.iter().zip(&hits).filter(|(ray, hit)| {
        hit.as_ref().is_some_and(|hit| outward_normal(scene, ray, hit).dot(ray.dir) > 0.0)
    });
    behind.count() as f64 / AROUND as f64
}

fn sees_nothing(camera: &Camera, intersector: &dyn Intersector) -> bool {
    let (columns, rows) = GRID;
    let at = |i: u32, n: u32, size: u32| (f64::from(i) + 0.5) / f64::from(n) * f64::from(size);
    let pixel = |k: u32| {
        let x = at(k % columns, columns, camera.width);
        let y = at(k / columns, rows, camera.height);
        camera.generate_ray(x, y, [0.5; 2])
    };
    let rays: Vec<Ray> = (0..columns * rows).map(pixel).collect();
    trace(&rays, intersector).iter().all(Option::is_none)
}

fn trace(rays: &[Ray], intersector: &dyn Intersector) -> Vec<Option<Hit>> {
    let mut hits = vec![None; rays.len()];
    intersector.intersect_batch(rays, &mut hits, &mut RayCounts::default());
    hits
}

/// Normal of the side that a triangle's corners run counter-clockwise on; away from a sphere's
/// centre. Not unit.
fn outward_normal(scene: &Scene, ray: &Ray, hit: &Hit) -> DVec3 {
    let prim = hit.prim.prim_id as usize;
    if hit.prim.geom_id == scene.sphere_geom_id() {
        return ray.at(hit.t) - scene.spheres[prim].centre;
    }
    let [a, b, c] = scene.meshes[hit.prim.geom_id as usize].corners(prim);
    (b - a).cross(c - a)
}

/// Direction `i` of [`AROUND`], spread evenly over the sphere.
fn fibonacci(i: usize) -> DVec3 {
    let z = 1.0 - (2.0 * i as f64 + 1.0) / AROUND as f64;
    let radius = (1.0 - z * z).sqrt();
    let phi = i as f64 * std::f64::consts::PI * (3.0 - 5f64.sqrt());
    DVec3::new(radius * phi.cos(), radius * phi.sin(), z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sampled_frames_hold_both_ends_once() {
        assert_eq!(sampled_frames(1), [1]);
        assert_eq!(sampled_frames(3), [1, 2, 3]);
        let many = sampled_frames(1000);
        assert_eq!((many.len(), many[0], many[8]), (9, 1, 1000));
        assert!(many.windows(2).all(|pair| pair[0] < pair[1]));
    }

    #[test]
    fn directions_about_the_eye_are_unit_and_balanced() {
        let sum: DVec3 = (0..AROUND).map(fibonacci).sum();
        assert!(sum.length() < 1.0, "{sum}");
        assert!((0..AROUND).all(|i| (fibonacci(i).length() - 1.0).abs() < 1e-12));
    }
}
