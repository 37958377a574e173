//! The examples for a user of the library run, and give what they promise.

#![allow(clippy::unwrap_used, missing_docs)]

#[allow(dead_code)]
#[path = "../examples/3_sequence_with_reuse.rs"]
mod sequence_with_reuse;
#[allow(dead_code)]
#[path = "../examples/2_trace_and_compare.rs"]
mod trace_and_compare;

use sequence_with_reuse::one_frame;
use tweenray::math::{DVec3, Rgb, srgb_decode};
use tweenray::output::read_image;
use tweenray::scene::Settings;

/// The picture's linear radiance where `p`, a point of the world, is seen.
fn seen(image: &tweenray::film::Image, settings: &Settings, p: DVec3) -> Rgb {
    let (x, y, _) = one_frame::camera(settings).unwrap().project(p).unwrap();
    let code = image.rgb[y as usize * image.width as usize + x as usize];
    Rgb::from_array(code.to_array().map(|c| srgb_decode(f64::from(c)) as f32))
}

/// Radiance is albedo / pi x intensity x cosine / distance^2; in the shadow and on the backdrop there is
/// nothing of it.
#[test]
fn one_frame_shows_the_effects_of_its_scene() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("one.png");
    let settings = Settings { width: 160, height: 90, ..Settings::default() };
    one_frame::render(&settings, &file).unwrap();
    let image = read_image(&file).unwrap();
    assert_eq!((image.width, image.height), (160, 90));
    let lit = DVec3::new(1.5, 0.0, 2.5);
    let to_lamp = DVec3::new(2.0, 4.0, 2.0) - lit;
    let irradiance = 40.0 * to_lamp.normalize().y / to_lamp.length_squared();
    let expected = Rgb::splat((0.8 / std::f64::consts::PI * irradiance) as f32);
    let near = |a: Rgb, b: Rgb| (a - b).abs().max_element() < 0.02;
    let floor = seen(&image, &settings, lit);
    assert!(near(floor, expected), "{floor}, not {expected}");
    let shadow = seen(&image, &settings, DVec3::new(-1.3, 0.0, -0.6));
    assert!(near(shadow, Rgb::ZERO), "{shadow}");
    let backdrop = seen(&image, &settings, DVec3::new(0.0, 3.0, -20.0));
    assert!(near(backdrop, Rgb::new(0.2, 0.3, 0.5)), "{backdrop}");
    let ball = seen(&image, &settings, DVec3::new(0.5, 1.5, 0.7));
    assert!(ball.x > 0.1 && (ball.x - 7.0 * ball.y).abs() < 0.05, "{ball} is not red");
}

#[test]
fn embree_agrees_with_the_oracle_ray_by_ray() {
    let found = trace_and_compare::compare(120, 80).unwrap();
    assert!(found.hits > 3000 && found.misses > 1000, "{found:?}");
    assert_eq!(found.differences, 0, "{found:?}");
}

#[test]
fn a_sequence_infers_most_shadowing_and_its_audit_has_an_interval() {
    let (reused, audit) = sequence_with_reuse::render(9).unwrap();
    assert!(reused.share() > Some(0.3), "{reused:?}");
    for figure in [audit.shown, audit.traced, audit.inferred] {
        assert!(figure.low <= figure.estimate && figure.estimate <= figure.high, "{audit:?}");
        assert!(figure.high > 0.0 && figure.high < 5.0, "{audit:?}");
    }
    // No less true than frames traced whole, by more than can be seen.
    assert!(audit.shown.low < audit.traced.high + 0.25, "{audit:?}");
}
