//! KHR_lights_punctual.

use super::build::{File, warns};
use serde_json::json;
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::Light;

#[test]
fn candela_and_lux_become_watts_by_the_efficacy_of_683_lumens() {
    let mut file = File::triangle();
    file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "point", "intensity": 683, "color": [1, 0.5, 0]},
        {"type": "spot", "intensity": 1366, "spot": {"innerConeAngle": 0.25, "outerConeAngle": 0.5}},
        {"type": "directional", "intensity": 2049},
        {"type": "point", "intensity": 0},
    ]}});
    let light = |number: usize| json!({"KHR_lights_punctual": {"light": number}});
    // A quarter turn about x: what shone along -z shines along y.
    let turn = json!([std::f64::consts::FRAC_1_SQRT_2, 0, 0, std::f64::consts::FRAC_1_SQRT_2]);
    for number in 0..4 {
        file.add("nodes", json!({
            "translation": [1, 2, 3], "rotation": turn, "scale": [9, 9, 9], "extensions": light(number),
        }));
    }
    let model = file.model();
    let [Light::Point(point), Light::Spot(spot), Light::Directional(sun)] = &model.world.lights[..]
    else {
        panic!("{:?}", model.world.lights)
    };
    let place = DVec3::new(1.0, 2.0, 3.0);
    assert_eq!((point.position, point.intensity), (place, Rgb::new(1.0, 0.5, 0.0)));
    assert_eq!((spot.position, spot.intensity, spot.radius), (place, Rgb::splat(2.0), 0.0));
    assert!(spot.direction.distance(DVec3::Y) < 1e-12);
    assert_eq!((spot.cos_inner, spot.cos_outer), (libm::cos(0.25), libm::cos(0.5)));
    assert_eq!(sun.irradiance, Rgb::splat(3.0));
    assert!(sun.to_light.distance(DVec3::NEG_Y) < 1e-12);
}

#[test]
fn a_file_with_lights_gets_no_lamp_and_one_with_a_glow_does() {
    let mut file = File::triangle();
    file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "point"}]}});
    file.add("nodes", json!({"extensions": {"KHR_lights_punctual": {"light": 0}}}));
    let loaded = file.loaded();
    assert!(loaded.stage.is_none() && loaded.world.lights.len() == 1);
    let glow = File::triangle().with_material(json!({"emissiveFactor": [0, 1, 0]}));
    let loaded = glow.loaded();
    assert!(loaded.stage.is_some());
    let lights = loaded.world.into_scene(true).unwrap().lights;
    assert_eq!(lights.iter().filter(|light| matches!(light, Light::Face(_))).count(), 1);
}

#[test]
fn lights_that_would_leave_all_dark_are_as_bright_as_their_numbers() {
    let read = |kind: &str, intensity: f64, material: serde_json::Value| {
        let mut file = File::triangle().with_material(material);
        let light = json!({"type": kind, "intensity": intensity, "spot": {}});
        file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [light]}});
        let of_node = json!({"KHR_lights_punctual": {"light": 0}});
        file.add("nodes", json!({"translation": [0, 0, 4], "extensions": of_node}));
        let loaded = file.loaded();
        let amount = match &loaded.world.lights[0] {
            Light::Point(light) => light.intensity.x,
            Light::Spot(light) => light.intensity.x,
            Light::Directional(light) => light.irradiance.x,
            other => panic!("{other:?}"),
        };
        (f64::from(amount), warns(&loaded.warnings, "the lights of the file are dim"))
    };
    let is = |(amount, told): (f64, bool), expected: f64, is_dim| {
        assert!((amount / expected - 1.0).abs() < 1e-6 && told == is_dim, "{amount} {expected}");
    };
    for (kind, dim, bright) in
        [("point", 5.0, 5000.0), ("spot", 5.0, 5000.0), ("directional", 1.0, 1000.0)]
    {
        is(read(kind, dim, json!({})), dim, true);
        is(read(kind, dim, json!({"emissiveFactor": [0.02, 0, 0]})), dim, true);
        is(read(kind, bright, json!({})), bright / 683.0, false);
    }
}

#[test]
fn a_range_that_is_ignored_is_said() {
    let mut file = File::triangle();
    let light = json!({"type": "point", "range": 3});
    file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [light]}});
    file.add("nodes", json!({"extensions": {"KHR_lights_punctual": {"light": 0}}}));
    assert!(warns(&file.model().warnings, "the range of lights is ignored"));
}
