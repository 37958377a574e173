//! Where an orbiting camera must stand to keep a whole scene in every frame.
//!
//! Exact, not by a bounding sphere: on a full circle about the axis a point of radius r and
//! height y sweeps a ring, and the ring is in the image if and only if three inequalities hold
//! that are linear in the camera's distance. See [`orbit`].

use crate::math::{Bounds3, DVec3};
use crate::scene::World;

/// Angle by which the camera looks down, degrees.
pub(super) const ELEVATION_DEGREES: f64 = 20.0;

/// Share of the image's half width and height that the scene may fill.
const FILL: f64 = 0.9;

/// The field of view of a camera.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lens {
    /// Vertical field of view, degrees.
    pub vfov_degrees: f64,
    /// Width of the image over its height.
    pub aspect: f64,
}

/// Bounds of meshes and analytic spheres, lights left out.
pub(super) fn bounds(world: &World) -> Bounds3 {
    let mut bounds = Bounds3::EMPTY;
    let mesh_points = world.meshes.iter().flat_map(|m| &m.positions);
    mesh_points.for_each(|p| bounds.include(*p));
    for s in &world.spheres {
        bounds.include(s.centre - DVec3::splat(s.radius));
        bounds.include(s.centre + DVec3::splat(s.radius));
    }
    bounds
}

/// The middle of a world, and how far from it a light counts as.
#[derive(Debug, Clone, Copy)]
pub(super) struct Middle {
    centre: DVec3,
    nearest: f64,
}

impl Middle {
    pub fn of(world: &World) -> Self {
        let bounds = bounds(world);
        Self { centre: bounds.centre(), nearest: 0.25 * (bounds.max - bounds.min).length() }
    }

    /// About 1 over the squared distance of `place`: what is nearer than half a radius of the world counts as that far.
    pub fn falloff(&self, place: DVec3) -> f64 {
        let distance = place.distance(self.centre).max(self.nearest);
        1.0 / (distance * distance)
    }
}

/// `(target, eye)` of an orbit about `axis` (unit) that shows all of `world` in every frame.
///
/// The eye of the first frame is towards +z (towards -y where the axis is z) and `elevation`
/// degrees above the level. Without a `target` the axis runs through the middle of the bounds,
/// and the target's height is the one that lets the camera come closest. Lights are left out.
pub(super) fn orbit(
    world: &World,
    target: Option<DVec3>,
    axis: DVec3,
    elevation_degrees: f64,
    lens: &Lens,
) -> (DVec3, DVec3) {
    let bounds = bounds(world);
    let middle = target.unwrap_or_else(|| bounds.centre());
    let elevation = elevation_degrees.to_radians();
    let (sin, cos) = (libm::sin(elevation), libm::cos(elevation));
    let tan_y = FILL * libm::tan(0.5 * lens.vfov_degrees.to_radians());
    let needs = Needs::of(world, middle, axis, (sin, cos), (tan_y * lens.aspect, tan_y));
    let height = if target.is_some() { 0.0 } else { needs.best_height() };
    let mut distance = needs.distance(height);
    if !(distance.is_finite() && distance > 0.0) {
        // Nothing to see, or a single point of it.
        distance = 4.0;
    }
    let target = middle + axis * height;
    (target, target + (front(axis) * cos + axis * sin) * distance)
}

/// Unit vector across `axis` from which a scene is first seen.
fn front(axis: DVec3) -> DVec3 {
    let along_z = DVec3::Z - axis * axis.z;
    if along_z.length() > 1e-6 { along_z.normalize() } else { DVec3::NEG_Y }
}

/// The camera's least distance as the largest of linear functions of the target's height h:
/// `sides - h·sin`, `top - h·(sin + cos/tan_y)` and `bottom - h·(sin - cos/tan_y)`.
///
/// With the eye at distance d and elevation e, a point of the ring at angle a off the eye's has
/// depth `d - (r cos a cos e + y sin e)`, is `r sin a` to the side and `y cos e - r cos a sin e`
/// up. Its side fits if `depth >= |side|/tan_x`; the largest d over a is at
/// `tan a = 1/(tan_x cos e)`. Up and down fit if `depth >= ±up/tan_y`; there the largest d is at
/// `a = 0` or `a = 180°`. A sphere needs its radius over the sine of the half angle more.
struct Needs {
    sides: f64,
    top: f64,
    bottom: f64,
    /// Slopes in h of the three.
    slopes: [f64; 3],
}

impl Needs {
    fn of(
        world: &World,
        origin: DVec3,
        axis: DVec3,
        (sin, cos): (f64, f64),
        (tan_x, tan_y): (f64, f64),
    ) -> Self {
        let lowest = f64::NEG_INFINITY;
        let slopes = [sin, sin + cos / tan_y, sin - cos / tan_y];
        let mut needs = Self { sides: lowest, top: lowest, bottom: lowest, slopes };
        let reach = libm::hypot(cos, 1.0 / tan_x);
        let (over, under) = ((cos - sin / tan_y).abs(), (cos + sin / tan_y).abs());
        let (round_x, round_y) = (libm::hypot(1.0, 1.0 / tan_x), libm::hypot(1.0, 1.0 / tan_y));
        let mut include = |p: DVec3, radius: f64| {
            let arm = p - origin;
            let y = arm.dot(axis);
            let r = (arm - axis * y).length();
            needs.sides = needs.sides.max(y * slopes[0] + r * reach + radius * round_x);
            needs.top = needs.top.max(y * slopes[1] + r * over + radius * round_y);
            needs.bottom = needs.bottom.max(y * slopes[2] + r * under + radius * round_y);
        };
        world.meshes.iter().flat_map(|m| &m.positions).for_each(|p| include(*p, 0.0));
        world.spheres.iter().for_each(|s| include(s.centre, s.radius));
        needs
    }

    fn distance(&self, height: f64) -> f64 {
        let [a, b, c] = self.slopes;
        (self.sides - height * a).max(self.top - height * b).max(self.bottom - height * c)
    }

    /// The height at which the distance is least: where two of the three lines cross.
    fn best_height(&self) -> f64 {
        let lines = [
            (self.sides, self.slopes[0]),
            (self.top, self.slopes[1]),
            (self.bottom, self.slopes[2]),
        ];
        [(0, 1), (0, 2), (1, 2)]
            .map(|(i, j)| (lines[i].0 - lines[j].0) / (lines[i].1 - lines[j].1))
            .into_iter()
            .filter(|h| h.is_finite())
            .min_by(|a, b| self.distance(*a).total_cmp(&self.distance(*b)))
            .unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests;
