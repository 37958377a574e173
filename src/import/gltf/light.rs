//! KHR_lights_punctual: point lights, spots and directional lights.

use super::document::Document;
use super::json::Json;
use crate::error::{Diagnostic, Result};
use crate::import::emission::DIM;
use crate::import::framing::Middle;
use crate::import::source::Notes;
use crate::math::{DAffine3, DVec3, Rgb};
use crate::scene::{DirectionalLight, Light, PointLight, SpotLight, World};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};
use std::path::Path;

/// Lumens of a watt: candela and lux of the file over this are W/sr and W/m² here. It is the luminous efficacy of green
/// light, by which the candela is defined and by which Blender converts when it writes glTF.
pub(super) const LUMENS_PER_WATT: f64 = 683.0;

/// The light of `node`, whose place in the world is `world`; `None` of a node without one, or with one that is black.
///
/// Errors: unknown kinds, angles and amounts that are out of range.
pub(super) fn read(
    document: &Document<'_>,
    node: &Json<'_>,
    world: &DAffine3,
    notes: &mut Notes,
) -> Result<Option<Light>> {
    let Some(of_node) = node.extension("KHR_lights_punctual") else { return Ok(None) };
    let lights = &document.lights;
    let json = &lights[of_node.required("light")?.as_index(lights.len(), "light")?];
    let colour = json.numbers::<3>("color")?.unwrap_or([1.0; 3]);
    let amount = json.number_within("intensity", [0.0, 1e30], 1.0)? / LUMENS_PER_WATT;
    let emitted = Rgb::from_array(colour.map(|c| (c.clamp(0.0, 1e30) * amount).min(1e30) as f32));
    if emitted == Rgb::ZERO {
        return Ok(None);
    }
    if json.get("range").is_some() {
        notes.add(
            "the range of lights is ignored: light falls with the square of the distance",
            None,
        );
    }
    let position = world.translation;
    // Lights shine along -z; scales are no matter.
    let direction = (-world.matrix3.z_axis).normalize_or(DVec3::NEG_Z);
    let kind = json.required("type")?;
    Ok(Some(match kind.as_text()? {
        "point" => Light::Point(PointLight { position, intensity: emitted }),
        "directional" => {
            Light::Directional(DirectionalLight { to_light: -direction, irradiance: emitted })
        }
        "spot" => {
            let [cos_inner, cos_outer] = cone(json)?;
            let intensity = emitted;
            Light::Spot(SpotLight {
                position,
                direction,
                intensity,
                cos_inner,
                cos_outer,
                radius: 0.0,
            })
        }
        _ => return Err(kind.fault("a light is `point`, `spot` or `directional`").into()),
    }))
}

/// Takes the numbers of lights that would leave all dark as W/sr and W/m², and says so: many programs write their own
/// for candela and lux.
pub(super) fn brighten(world: &mut World, path: &Path) -> Option<Diagnostic> {
    if world.lights.is_empty() || world.meshes.is_empty() {
        return None;
    }
    let middle = Middle::of(world);
    let from =
        |place: DVec3, intensity: Rgb| f64::from(intensity.max_element()) * middle.falloff(place);
    let irradiance = |light: &Light| match light {
        Light::Point(light) => from(light.position, light.intensity),
        Light::Spot(light) => from(light.position, light.intensity),
        Light::Directional(light) => f64::from(light.irradiance.max_element()),
        _ => 0.0,
    };
    let all: f64 = world.lights.iter().map(irradiance).sum();
    if all >= DIM || !all.is_finite() {
        return None;
    }
    for light in &mut world.lights {
        match light {
            Light::Point(PointLight { intensity: amount, .. })
            | Light::Spot(SpotLight { intensity: amount, .. })
            | Light::Directional(DirectionalLight { irradiance: amount, .. }) => {
                *amount *= LUMENS_PER_WATT as f32;
            }
            _ => {}
        }
    }
    let message = format!(
        "the lights of the file are dim as candela and lux ({all:.2e} W/m² in the middle of the scene, where 3 show white as white): their numbers are taken as W/sr and W/m², as many viewers do"
    );
    Some(
        Diagnostic::new(path, message)
            .help("give the lights in a scene file where they are meant to be so dim"),
    )
}

/// Cosines of the angles up to which a spot is full and beyond which there is no light.
fn cone(light: &Json<'_>) -> Result<[f64; 2]> {
    let spot = light.required("spot")?;
    let outer = spot.number_within("outerConeAngle", [0.0, FRAC_PI_2 + 1e-6], FRAC_PI_4)?;
    let inner = spot.number_within("innerConeAngle", [0.0, FRAC_PI_2 + 1e-6], 0.0)?;
    if inner > outer {
        let message = format!("the inner angle {inner} is larger than the outer one {outer}");
        return Err(spot.fault(message).into());
    }
    Ok([libm::cos(inner), libm::cos(outer)])
}
