//! The examples for a user of the library run, and give what they promise.

#![allow(clippy::unwrap_used, missing_docs)]

#[allow(dead_code)]
#[path = "../examples/4_data_set.rs"]
mod data_set;
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

/// Two poses of a COLMAP model above the origin of a floor: the depth is the height above it, the normal is up.
#[test]
fn a_data_set_has_depth_normals_and_ids_for_each_pose() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("cameras.txt", "1 PINHOLE 32 16 30 30 15 9\n");
    // A quarter turn about x: the camera looks straight down, from as high as the translation says.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let image =
        |id: u32, height: f64| format!("{id} {half} -{half} 0 0 0 0 {height} 1 {id}.png\n\n");
    write("images.txt", &(image(1, 3.0) + &image(2, 5.0)));
    write(
        "scene.toml",
        "camera = { poses = 'images.txt' }\nsky = { radiance = 1 }\n\
         mesh = [{ quad = { centre = [0, 0, 0], normal = 'y', size = [90, 90] } }]\n\
         settings = { size = [32, 16], spp = 1, sky_samples = 1 }\n",
    );
    let out = folder.path().join("out");
    assert_eq!(data_set::render(&folder.path().join("scene.toml"), &out).unwrap(), 2);
    for (frame, height) in [(1, 3.0f32), (2, 5.0)] {
        let file = std::fs::File::open(out.join(format!("frame_{frame:04}.exr"))).unwrap();
        let image = exr_channels(file);
        assert!(image["Z"].iter().all(|z| (z - height).abs() < 1e-4), "{:?}", image["Z"][0]);
        assert!(image["N.Y"].iter().all(|y| (y - 1.0).abs() < 1e-6));
        assert!(
            image.keys().any(|name| name.to_lowercase().contains("mesh")),
            "{:?}",
            image.keys()
        );
    }
}

/// The samples of each channel of an exr file.
fn exr_channels(file: std::fs::File) -> std::collections::BTreeMap<String, Vec<f32>> {
    use exr::prelude::{ReadChannels, ReadLayers, read};
    let reader = read().no_deep_data().largest_resolution_level().all_channels();
    let reader = reader.first_valid_layer().all_attributes();
    let image = reader.from_buffered(std::io::BufReader::new(file)).unwrap();
    let channels = image.layer_data.channel_data.list;
    channels.iter().map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect())).collect()
}
