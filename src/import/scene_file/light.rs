//! `[[light]]`.

use super::at::{At, Span};
use super::number::{Crease, Positive, SunAngle};
use super::quad::{self, QuadShape};
use super::report::Source;
use super::vector::{Direction, Light as Amount, List, Point, Size2};
use crate::error::Result;
use crate::scene::{self, QuadLight};
use schemars::JsonSchema;
use serde::Deserialize;

/// A light: exactly one key, its kind.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case", expecting = "a table")]
pub(super) enum Light {
    /// A point that emits alike in all directions; its shadows are hard.
    Point(PointLight),
    /// Parallel light from infinitely far, such as the sun's; its shadows are hard.
    Directional(DirectionalLight),
    /// A flat rectangle or parallelogram that glows; its shadows are soft.
    Quad(QuadLightTable),
    /// A glowing sphere; its shadows are soft.
    Sphere(SphereLight),
    /// A flat round lamp; its shadows are soft.
    Disk(DiskLight),
    /// A cone of light with a smooth edge; its shadows are hard, or soft where it has a radius.
    Spot(SpotLight),
    /// A disk of the sky, such as the sun's; its shadows are soft.
    Sun(SunLight),
}

/// A point that emits alike in all directions.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct PointLight {
    /// Where it is, world units.
    position: Point,
    /// Radiant intensity, W/sr: at distance d it gives the irradiance intensity / d².
    intensity: Amount,
}

/// Parallel light from infinitely far.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct DirectionalLight {
    /// Vector from the scene towards the light; its length does not matter.
    to_light: Direction,
    /// Irradiance on a surface that faces the light, W/m².
    irradiance: Amount,
}

/// A glowing parallelogram: either `corner` and `edges`, or `centre`, `normal` and `size`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(extend("oneOf" = [
    {"required": ["corner", "edges"]}, {"required": ["centre", "normal", "size"]}
]))]
pub(super) struct QuadLightTable {
    /// One corner, world units.
    corner: Option<Point>,
    /// The two edges that leave the corner, as vectors, world units. The light shines towards
    /// their cross product, first times second.
    edges: Option<List<Point, 2>>,
    /// Middle of the rectangle, world units.
    centre: Option<Point>,
    /// Direction in which the rectangle shines.
    normal: Option<Direction>,
    /// Width and height, world units. The width is level; where the normal is vertical it runs
    /// along x and the height along z.
    size: Option<Size2>,
    /// Emitted radiance, W/(m² sr).
    radiance: Amount,
    /// Whether the back shines too.
    #[serde(default)]
    two_sided: bool,
}

/// A glowing sphere.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct SphereLight {
    /// Centre, world units.
    centre: Point,
    /// Radius, world units.
    radius: Positive,
    /// Emitted radiance, W/(m² sr).
    radiance: Amount,
}

/// A flat round lamp.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct DiskLight {
    /// Centre, world units.
    centre: Point,
    /// Direction in which it shines.
    normal: Direction,
    /// Radius, world units.
    radius: Positive,
    /// Emitted radiance, W/(m² sr).
    radiance: Amount,
    /// Whether the back shines too.
    #[serde(default)]
    two_sided: bool,
}

/// A cone of light with a smooth edge: either `direction` or `target`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(extend("oneOf" = [{"required": ["direction"]}, {"required": ["target"]}]))]
pub(super) struct SpotLight {
    /// Where it is, world units.
    position: Point,
    /// Direction in which it shines.
    direction: Option<Direction>,
    /// A point that it shines at, world units.
    target: Option<Point>,
    /// Radiant intensity along the axis, W/sr: at distance d it gives the irradiance intensity / d².
    intensity: Amount,
    /// Angle from the axis beyond which there is no light, degrees.
    #[serde(default = "outer_angle")]
    outer_angle: Crease,
    /// Angle from the axis up to which the light is full, degrees.
    #[serde(default = "inner_angle")]
    inner_angle: Crease,
    /// Radius of the emitting sphere, world units; without it shadows are hard.
    radius: Option<Positive>,
}

/// A disk of the sky.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct SunLight {
    /// Vector from the scene towards its middle; its length does not matter.
    to_light: Direction,
    /// Irradiance on a surface that faces it, W/m².
    irradiance: Amount,
    /// Angle under which it is seen, degrees.
    #[serde(default = "sun_angle")]
    angle: SunAngle,
}

/// The sun's mean angle.
pub(super) fn sun_angle() -> SunAngle {
    SunAngle(0.533)
}

fn outer_angle() -> Crease {
    Crease(45.0)
}

fn inner_angle() -> Crease {
    Crease(0.0)
}

impl SpotLight {
    /// Errors, at `span`: an inner angle beyond the outer one; an outer angle of 0; both or neither of `direction`
    /// and `target`; a target at the light's own place.
    fn build(&self, source: &Source, span: &Span) -> Result<scene::SpotLight> {
        let position = self.position.vec();
        let direction = match (&self.direction, &self.target) {
            (Some(direction), None) => direction.unit(),
            (None, Some(target)) => {
                let along = target.vec() - position;
                let unit = (along / along.abs().max_element()).try_normalize();
                unit.ok_or_else(|| source.fault(span, "the spot's target is its own position"))?
            }
            _ => {
                let message = "a spot is aimed by either `direction` or `target`";
                return Err(source.fault(span, message).into());
            }
        };
        let [inner, outer] = [self.inner_angle.0, self.outer_angle.0];
        if inner > outer {
            let message =
                format!("the spot's `inner_angle`, {inner}, is beyond its `outer_angle`, {outer}");
            return Err(source.fault(span, message).into());
        }
        if outer == 0.0 {
            let message = "the spot's `outer_angle` is 0, so it sends no light";
            return Err(source.fault(span, message).into());
        }
        let [cos_inner, cos_outer] = [inner, outer].map(|angle| libm::cos(angle.to_radians()));
        let (intensity, radius) = (self.intensity.rgb(), self.radius.map_or(0.0, |r| r.0));
        Ok(scene::SpotLight { position, direction, intensity, cos_inner, cos_outer, radius })
    }
}

impl At<Light> {
    /// As scene data.
    pub fn build(&self, source: &Source) -> Result<scene::Light> {
        Ok(match &self.value {
            Light::Point(p) => scene::Light::Point(scene::PointLight {
                position: p.position.vec(),
                intensity: p.intensity.rgb(),
            }),
            Light::Directional(d) => scene::Light::Directional(scene::DirectionalLight {
                to_light: d.to_light.unit(),
                irradiance: d.irradiance.rgb(),
            }),
            Light::Quad(q) => scene::Light::Quad(QuadLight {
                corners: quad::corners(&q.shape(), source, &self.span)?,
                radiance: q.radiance.rgb(),
                two_sided: q.two_sided,
            }),
            Light::Sphere(s) => scene::Light::Sphere(scene::SphereLight {
                centre: s.centre.vec(),
                radius: s.radius.0,
                radiance: s.radiance.rgb(),
            }),
            Light::Disk(d) => scene::Light::Disk(scene::DiskLight {
                centre: d.centre.vec(),
                normal: d.normal.unit(),
                radius: d.radius.0,
                radiance: d.radiance.rgb(),
                two_sided: d.two_sided,
            }),
            Light::Spot(s) => scene::Light::Spot(s.build(source, &self.span)?),
            Light::Sun(s) => scene::Light::Sun(scene::SunLight::of_irradiance(
                s.to_light.unit(),
                s.angle.radius(),
                s.irradiance.rgb(),
            )),
        })
    }
}

impl QuadLightTable {
    fn shape(&self) -> QuadShape<'_> {
        QuadShape {
            corner: self.corner.as_ref(),
            edges: self.edges.as_ref(),
            centre: self.centre.as_ref(),
            normal: self.normal.as_ref(),
            size: self.size.as_ref(),
        }
    }
}
