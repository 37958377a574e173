//! Mean numbers of lights over a scene's surfaces.

use super::{LightCells, MeanLights};
use crate::math::{DVec3, Vec3};
use crate::scene::{Mesh, Scene};
use std::f64::consts::PI;

/// Number of points at which lights are counted.
const POINTS: u32 = 1024;

impl LightCells {
    /// The means over points that are spread evenly over the area of all surfaces.
    pub(super) fn count(&self, scene: &Scene) -> MeanLights {
        let of_mesh = |mesh: &Mesh| -> f64 { triangles(mesh).map(|corners| area(&corners)).sum() };
        let spheres = scene.spheres.iter();
        let of_spheres: f64 = spheres.map(|s| 4.0 * PI * s.radius * s.radius).sum();
        let total = scene.meshes.iter().map(of_mesh).sum::<f64>() + of_spheres;
        let step = total / f64::from(POINTS);
        let mut means = MeanLights::default();
        let (mut passed, mut next) = (0.0, 0);
        let mut visit = |area: f64, point: &dyn Fn(f64) -> DVec3| {
            passed += area;
            while next < POINTS && (f64::from(next) + 0.5) * step < passed {
                next += 1;
                self.count_at(point(f64::from(next)), scene, &mut means);
            }
        };
        for corners in scene.meshes.iter().flat_map(triangles) {
            visit(area(&corners), &|k| inside(&corners, k));
        }
        for sphere in &scene.spheres {
            visit(4.0 * PI * sphere.radius * sphere.radius, &|k| {
                let (z, turn) = (2.0 * fraction(k * GOLDEN) - 1.0, fraction(k * SILVER) - 0.5);
                // Any spread over the sphere does; this one needs no sine.
                let across = DVec3::new(turn, fraction(k * BRONZE) - 0.5, z);
                sphere.centre + across.normalize_or_zero() * sphere.radius
            });
        }
        let share = 1.0 / f64::from(next.max(1));
        let MeanLights { main, area, tail, tails, tail_samples } = means;
        let [main, area, tail, tails, tail_samples] =
            [main, area, tail, tails, tail_samples].map(|sum| sum * share);
        MeanLights { main, area, tail, tails, tail_samples }
    }

    fn count_at(&self, p: DVec3, scene: &Scene, sums: &mut MeanLights) {
        let lights = self.lights(self.cell(p), 0.0);
        let is_area = |light: &u32| scene.lights[*light as usize].is_area();
        sums.main += lights.main().len() as f64;
        sums.area += lights.main().filter(is_area).count() as f64;
        let tail = lights.tail();
        sums.tail += tail.len() as f64;
        if !tail.is_empty() {
            sums.tails += 1.0;
            sums.tail_samples += tail.samples_share();
        }
    }
}

/// Irrational numbers whose multiples are spread evenly.
const GOLDEN: f64 = 0.618_033_988_749_895;
const SILVER: f64 = 0.414_213_562_373_095;
const BRONZE: f64 = 0.302_775_637_731_995;

fn fraction(x: f64) -> f64 {
    x - x.floor()
}

fn triangles(mesh: &Mesh) -> impl Iterator<Item = [Vec3; 3]> + '_ {
    mesh.triangles.iter().map(|corners| corners.map(|i| mesh.positions[i as usize]))
}

fn area(corners: &[Vec3; 3]) -> f64 {
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    0.5 * (b - a).cross(c - a).length()
}

/// The `k`th point of a triangle.
fn inside(corners: &[Vec3; 3], k: f64) -> DVec3 {
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    let (mut u, mut v) = (fraction(k * GOLDEN), fraction(k * SILVER));
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    a + (b - a) * u + (c - a) * v
}
