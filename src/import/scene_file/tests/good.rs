//! Good files: defaults, every kind of thing, warnings.

use super::*;
use crate::import::terrain_height;
use crate::math::{DVec3, Rgb};
use crate::scene::{
    BuildQuality, CameraPath, DirectionalLight, Environment, EnvironmentKind, Focus, Lens,
    Light as SceneLight, PointLight, Policy, ReuseSettings, Settings as SceneSettings, ShotLens,
    SkyGradient, SphereLight,
};
use std::time::Duration;

#[test]
fn an_empty_file_is_an_empty_scene_with_all_defaults() {
    let loaded = good("");
    assert_eq!(loaded.settings, SceneSettings::for_files());
    assert_eq!(loaded.settings.camera_samples(), "4..16");
    assert_eq!((loaded.shot.frames, loaded.shot.vfov_degrees), (48, 40.0));
    assert_eq!(
        (loaded.options.fps, loaded.options.frames, loaded.options.output),
        (24.0, None, None)
    );
    assert_eq!(loaded.files.len(), 1);
    assert!(loaded.warnings[0].message.contains("nothing lights the scene"));
    let scene = loaded.world.into_scene(true).expect("an empty scene");
    assert_eq!(scene.triangle_count(), 0);
}

#[test]
fn numbers_of_samples_may_be_the_least_and_the_most() {
    let of = |text: &str| {
        let s = good(&format!("[settings]\n{text}\n")).settings;
        let light = (s.shadow_samples, s.least_shadow_samples, s.sky_samples, s.least_sky_samples);
        ((s.spp, s.most_spp), light)
    };
    let all = of("spp = [2, 8]\nshadow_samples = [3, 9]\nsky_samples = [4, 4]");
    assert_eq!(all, ((2, Some(8)), (9, Some(3), 4, None)));
    assert_eq!(of("shadow_samples = 0").1, (0, None, 16, None));
}

#[test]
fn every_setting_reaches_its_place() {
    let loaded = good(
        "[settings]\nsize = [320, 200]\nspp = 7\nfilter = 'tent'\nshadow_samples = 5\n\
         sky_samples = 6\nall_lights = true\nsmooth_terminator = false\nbounces = 2\ncutoff = 0.25\nseed = 11\n\
         exposure = 1.5\nclamp = 2.5\n\
         tone = 'filmic'\npng_bits = 16\nintersector = 'oracle'\nisa = 'sse4.2'\n\
         build_quality = 'low'\ncompact = true\n\
         rules = { robust = false, retry = false, recheck = 'always', spawn_offset = false, \
         recentre = false }\ncrop = [1, 2, 30, 40]\nframes = [2, 3]\n\
         output = 'out/f_####.exr'\nfps = 30\nvideo = false\noverwrite = true\nthreads = 2\n\
         stats = 's.json'\ntime_limit = '1h30m'\ncheckpoint = 'off'\nexchange = 5000\n[camera]\nframes = 5\n",
    );
    let s = &loaded.settings;
    assert_eq!((s.width, s.height, s.spp, s.seed), (320, 200, 7, 11));
    assert_eq!((s.shadow_samples, s.sky_samples, s.bounces, s.png_bits), (5, 6, 2, 16));
    assert_eq!((s.cutoff, s.exposure, s.isa.as_deref()), (0.25, 1.5, Some("sse4.2")));
    assert_eq!(s.clamp, Some(2.5));
    assert!(!s.smooth_terminator && s.all_lights);
    assert_eq!((s.build_quality, s.compact), (BuildQuality::Low, true));
    // What is left at its default would show here.
    let d = SceneSettings::default();
    assert!(s.filter != d.filter && s.tone != d.tone && s.intersector != d.intersector);
    let (r, rd) = (s.rules, d.rules);
    assert!(r.robust != rd.robust && r.retry != rd.retry && r.recheck != rd.recheck);
    assert!(r.spawn_offset != rd.spawn_offset && r.recentre != rd.recentre);
    let crop = s.crop.expect("a crop");
    assert_eq!((crop.x0, crop.y0, crop.x1, crop.y1), (1, 2, 30, 40));
    let options = loaded.options;
    let frames = options.frames.expect("frames");
    assert_eq!((frames.first, frames.last, options.fps), (2, 3, 30.0));
    assert_eq!(options.output.as_deref(), Some("out/f_####.exr"));
    assert_eq!((options.threads, options.stats), (Some(2), Some("s.json".into())));
    assert!(options.overwrite && !options.video);
    assert_eq!(options.time_limit, Some(Duration::from_secs(5400)));
    assert_eq!((options.checkpoint, options.exchange), (None, 5000));
}

#[test]
fn everything_about_reuse_reaches_its_place() {
    let loaded = good(
        "[reuse]\npolicy = 'colour'\nsegment = 9\ntolerance = 0.5\nprobes = 0.25\n\
         colour_epsilon = 0.125\ndistance_epsilon = 4\n\
         [[reuse.traced]]\nmin = [0, 0, 0]\nmax = [1, 2, 3]\n\
         [[mesh]]\nreuse = false\nbox = { min = [0, 0, 0], max = [9, 9, 9] }\n\
         [[sphere]]\ncentre = [0, 0, 0]\nradius = 1\n\
         [[sphere]]\ncentre = [0, 0, 0]\nradius = 1\nreuse = false\n",
    );
    let reuse = ReuseSettings {
        policy: Policy::Colour,
        segment: 9,
        tolerance: 0.5,
        probes: 0.25,
        colour_epsilon: 0.125,
        distance_epsilon: 4.0,
    };
    assert_eq!(loaded.settings.reuse, reuse);
    let region = loaded.world.traced_regions[0];
    assert_eq!((region.min, region.max), (DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0)));
    let scene = loaded.world.into_scene(true).expect("a scene");
    let region = scene.traced_regions[0];
    let corner = |p| scene.recentring.point_to_world(p);
    assert_eq!((corner(region.min), corner(region.max)), (DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0)));
    let spheres: Vec<bool> = scene.spheres.iter().map(|s| s.surface.always_traced).collect();
    assert_eq!((scene.meshes[0].surface.always_traced, spheres), (true, vec![false, true]));
    assert!(scene.is_always_traced(1, 1, DVec3::splat(9.0)));
    assert!(!scene.is_always_traced(1, 0, DVec3::splat(9.0)));
    assert!(scene.is_always_traced(1, 0, region.centre()));
}

#[test]
fn lights_come_in_kinds_and_quads_and_spots_in_two_forms() {
    let loaded = good(
        "[[light]]\npoint = { position = [1, 2, 3], intensity = 5 }\n\
         [[light]]\ndirectional = { to_light = [0, 10, 0], irradiance = [1, 2, 3] }\n\
         [[light]]\nquad = { centre = [1, 10, 2], normal = '-y', size = [4, 2], radiance = 20 }\n\
         [[light]]\n[light.quad]\ncorner = [0, 0, 0]\nedges = [[1, 0, 0], [0, 1, 0]]\n\
         radiance = 1\ntwo_sided = true\n\
         [[light]]\nsphere = { centre = [0, 9, 0], radius = 0.5, radiance = 3 }\n\
         [[light]]\ndisk = { centre = [0, 9, 0], normal = '-y', radius = 0.5, radiance = 3 }\n\
         [[light]]\nspot = { position = [0, 9, 0], target = [0, 3, 0], intensity = 3 }\n\
         [[light]]\n[light.spot]\nposition = [0, 9, 0]\ndirection = '-y'\nintensity = 3\n\
         outer_angle = 60\ninner_angle = 60\nradius = 0.1\n\
         [[light]]\nsun = { to_light = [0, 2, 0], irradiance = 3, angle = 1 }\n",
    );
    let [point, sun, lamp, window, bulb, disk, torch, lantern, noon] = &loaded.world.lights[..]
    else {
        panic!("9 lights")
    };
    let SceneLight::Sun(noon) = noon else { panic!("a sun") };
    assert_eq!(noon.to_light, DVec3::Y);
    assert!((noon.angular_radius.to_degrees() - 0.5).abs() < 1e-12);
    let sent = f64::from(noon.radiance.x) * std::f64::consts::PI * noon.sin().powi(2);
    assert!((sent - 3.0).abs() < 1e-6);
    assert_eq!(
        *point,
        SceneLight::Point(PointLight {
            position: DVec3::new(1., 2., 3.),
            intensity: Rgb::splat(5.)
        })
    );
    let irradiance = Rgb::new(1.0, 2.0, 3.0);
    assert_eq!(*sun, SceneLight::Directional(DirectionalLight { to_light: DVec3::Y, irradiance }));
    let SceneLight::Quad(lamp) = lamp else { panic!("a quad") };
    assert_eq!((lamp.normal(), lamp.area(), lamp.two_sided), (DVec3::NEG_Y, 8.0, false));
    assert!(lamp.corners.contains(&DVec3::new(-1.0, 10.0, 1.0)));
    let SceneLight::Quad(window) = window else { panic!("a quad") };
    assert_eq!((window.normal(), window.area(), window.two_sided), (DVec3::Z, 1.0, true));
    assert!(matches!(bulb, SceneLight::Sphere(SphereLight { radius: 0.5, .. })));
    let SceneLight::Disk(disk) = disk else { panic!("a disk") };
    assert_eq!((disk.normal, disk.radius, disk.two_sided), (DVec3::NEG_Y, 0.5, false));
    let (SceneLight::Spot(torch), SceneLight::Spot(lantern)) = (torch, lantern) else {
        panic!("two spots")
    };
    assert_eq!((torch.direction, torch.cos_inner, torch.radius), (DVec3::NEG_Y, 1.0, 0.0));
    assert!((torch.cos_outer - 0.5f64.sqrt()).abs() < 1e-15);
    assert_eq!((lantern.direction, lantern.radius), (DVec3::NEG_Y, 0.1));
    assert!((lantern.cos_outer - 0.5).abs() < 1e-15 && lantern.cos_inner == lantern.cos_outer);
    let soft: Vec<bool> = loaded.world.lights.iter().map(SceneLight::is_area).collect();
    assert_eq!(soft, [false, false, true, true, true, true, false, true, true]);
}

#[test]
fn skies_come_in_kinds() {
    let sky = |keys: &str| {
        let world = good(&format!("[sky]\n{keys}\n")).world;
        assert_eq!(world.sky.radiance, Rgb::ZERO);
        world.environment.expect("an environment")
    };
    let gradient = sky("gradient = { zenith = 1, horizon = [2, 3, 4], ground = 0 }\nstrength = 2");
    let [zenith, horizon, ground] = [Rgb::ONE, Rgb::new(2.0, 3.0, 4.0), Rgb::ZERO];
    let kind = EnvironmentKind::Gradient(SkyGradient { zenith, horizon, ground });
    assert_eq!(gradient, Environment { strength: 2.0, ..Environment::new(kind) });
    let day = sky("sun_sky = { to_sun = [0, 3, 4] }\nrotate = 90");
    // A quarter turn, counter-clockwise seen from above, takes +z to +x.
    assert!((day.orientation * DVec3::Z - DVec3::X).length() < 1e-15);
    assert!((day.orientation * DVec3::NEG_Z - DVec3::NEG_X).length() < 1e-15);
    let sun = day.sun().expect("a sun");
    assert!((sun.to_light - DVec3::new(0.8, 0.6, 0.0)).length() < 1e-12);
    let EnvironmentKind::SunSky(day) = day.kind else { panic!("a day") };
    assert_eq!((day.turbidity, day.ground), (3.0, Rgb::splat(0.2)));
    assert!((day.sun_radius.to_degrees() - 0.2665).abs() < 1e-12);
    let plain = good("[sky]\nradiance = 1\n").world;
    assert_eq!((plain.sky.radiance, plain.environment), (Rgb::ONE, None));
}

#[test]
fn fog_that_is_everywhere_is_said_to_hide_the_sky() {
    let warns = |fog: &str| {
        let loaded = good(&format!("[sky]\nradiance = 1\n[fog]\n{fog}"));
        loaded.warnings.iter().any(|w| w.message.contains("hides the sky"))
    };
    assert!(warns("extinction = 0.1"));
    assert!(!warns("extinction = 0.1\nbox = { min = [0, 0, 0], max = [1, 1, 1] }"));
    assert!(!warns("extinction = 0"));
}

#[test]
fn paths_come_in_five_kinds() {
    let path = |text: &str| good(&format!("[camera]\nroll = 5\nup = 'z'\n{text}\n")).shot;
    let still = path("still = { eye = [9, 0, 0], target = [0, 0, 0] }");
    assert_eq!(still.frames, 1);
    let CameraPath::Still(pose) = still.path else { panic!("still") };
    assert_eq!((pose.up, pose.roll_degrees), (DVec3::Z, 5.0));
    let pan = path("pan = { from = [9, 0, 0], to = [0, 9, 0], target = [0, 0, 0] }").path;
    assert!(matches!(pan, CameraPath::Pan { from: DVec3 { x: 9.0, .. }, up: DVec3::Z, .. }));
    let orbit = path("orbit = { eye = [9, 0, 1], degrees = 90, target = [0, 0, 0] }").path;
    assert!(matches!(orbit, CameraPath::Orbit { degrees: 90.0, axis: DVec3::Z, .. }));
    let CameraPath::Keys(keys) = path(
        "keys = [{ eye = [9, 0, 0], target = [0, 0, 0] }, \
         { eye = [8, 0, 0], target = [0, 0, 0], roll = 9, up = [0, 2, 0] }, \
         { eye = [7, 0, 0], target = [0, 0, 0] }]",
    )
    .path
    else {
        panic!("keys")
    };
    assert_eq!(keys.iter().map(|k| k.at).collect::<Vec<_>>(), [0.0, 0.5, 1.0]);
    assert_eq!((keys[1].pose.up, keys[1].pose.roll_degrees), (DVec3::Y, 9.0));
    assert_eq!((keys[2].pose.up, keys[2].pose.roll_degrees), (DVec3::Z, 5.0));
    let points = "points = [[1, 0, 0], [2, 0, 0], [3, 0, 0], [4, 0, 1]], target = [0, 0, 9]";
    let spline = path(&format!("bspline = {{ {points} }}")).path;
    assert!(matches!(spline, CameraPath::BSpline { points, .. } if points.len() == 4));
}

#[test]
fn materials_add_up_and_glass_stands_alone() {
    let loaded = good(
        "[material.m]\ndiffuse = [0.1, 0.2, 0.9]\nmirror = [0.9, 0.8, 0.1]\nroughness = 0.3\nemission = 2\n\
         emits_back = true\n[material.g]\nglass = { tint = [1, 0.9, 0.8], absorption = [0, 2.5, 9] }\n",
    );
    let [glass, m] = &loaded.world.materials[..] else { panic!("two") };
    assert_eq!((m.diffuse, m.mirror), (Rgb::new(0.1, 0.2, 0.9), Rgb::new(0.9, 0.8, 0.1)));
    assert!(m.roughness == 0.3 && m.emits_back && m.emission == Rgb::splat(2.0));
    assert_eq!(glass.glass.map(|g| (g.ior, g.tint)), Some((1.5, Rgb::new(1.0, 0.9, 0.8))));
    assert_eq!(glass.glass.map(|g| g.absorption), Some(Rgb::new(0.0, 2.5, 9.0)));
    let unused: Vec<_> = loaded.warnings.iter().filter(|w| w.message.contains("uses")).collect();
    assert_eq!((unused[0].line, unused[1].line), (Some(7), Some(1)));
}

#[test]
fn transforms_apply_in_order() {
    let loaded = good(
        "[[mesh]]\nbox = { min = [0, 0, 0], max = [1, 1, 1] }\n\
         transform = [{ scale = [2, 1, 1] }, { rotate = { axis = 'z', degrees = 90 } }, \
         { translate = [5, 0, 0] }, { matrix = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 7]] }]\n",
    );
    let bounds = loaded.world.bounds();
    assert_eq!((bounds.min, bounds.max), (DVec3::new(4., 0., 7.), DVec3::new(5., 2., 8.)));
}

#[test]
fn generators_make_what_they_say() {
    let loaded = good(
        "[[mesh]]\nterrain = { vertices = 11, size = 4 }\n\
         [[mesh]]\nname = 'ball'\nuv_sphere = { centre = [0, 5, 0], radius = 2, meridians = 8, \
         bands = 5 }\n[[mesh]]\nuv_sphere = { radius = 1e-7 }\nnormals = 'flat'\n\
         [[mesh]]\nquad = { centre = [0, 0, 0], normal = 'y', size = [1, 2] }\nnormals = 'smooth'\n",
    );
    let [terrain, ball, tiny, quad] = &loaded.world.meshes[..] else { panic!("4 meshes") };
    assert_eq!((terrain.triangles.len(), terrain.normals.is_some()), (200, false));
    let corner = terrain.positions[0];
    assert!((corner.y - terrain_height(-2.0, -2.0)).abs() < 1e-6 && corner.x == -2.0);
    assert_eq!((ball.name.as_str(), ball.triangles.len()), ("ball", 64));
    assert!(ball.normals.is_some() && tiny.normals.is_none() && quad.normals.is_some());
    assert!(tiny.positions.iter().all(|p| (p.length() / 1e-7 - 1.0).abs() < 1e-5));
    let names: Vec<_> = loaded.world.materials.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["default"]);
}

#[test]
fn files_are_read_beside_the_scene_file_once_named_and_listed() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    std::fs::create_dir(at("m")).expect("a folder");
    std::fs::write(at("m/t.obj"), "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n").expect("written");
    std::fs::write(at("white.ppm"), b"P6 1 1 255\n\xff\xff\xff").expect("written");
    let text = "[material.w]\ntexture = 'white.ppm'\n[material.w2]\ntexture = 'white.ppm'\n\
                [[mesh]]\nfile = 'm/t.obj'\nmaterial = 'w'\nname = 'tri'\n\
                [[mesh]]\nfile = 'm/t.obj'\nup = 'z'\n";
    std::fs::write(at("scene.toml"), text).expect("written");
    let loaded = load(&at("scene.toml"), &LoadOptions::default()).expect("a scene");
    assert_eq!(loaded.files, [at("scene.toml"), at("white.ppm"), at("m/t.obj")]);
    let world = &loaded.world;
    assert_eq!(world.textures.len(), 1);
    assert_eq!(world.materials[world.meshes[0].material as usize].name, "w");
    assert_eq!(world.materials[0].diffuse, Rgb::ONE);
    assert_eq!(world.meshes[0].name, "tri");
    assert_eq!(world.meshes[1].positions[2], DVec3::Y);
}

#[test]
fn emitting_surfaces_become_lights() {
    let loaded = good(
        "[material.glow]\nemission = 4\n\
         [[mesh]]\nquad = { centre = [0, 3, 0], normal = '-y', size = [1, 1] }\nmaterial = 'glow'\n\
         [[mesh]]\nbox = { min = [0, 0, 0], max = [1, 1, 1] }\nmaterial = 'glow'\n\
         [[sphere]]\ncentre = [0, 9, 0]\nradius = 1\nmaterial = 'glow'\n\
         [[mesh]]\nuv_sphere = {}\nmaterial = 'glow'\n",
    );
    let lights = &loaded.world.lights;
    assert_eq!(lights.len(), 1 + 6 + 1);
    assert!(matches!(&lights[0], SceneLight::Quad(q) if q.normal() == DVec3::NEG_Y));
    assert!(matches!(&lights[7], SceneLight::Sphere(_)));
    assert_eq!((loaded.world.meshes.len(), loaded.world.spheres.len()), (1, 0));
    assert_eq!(loaded.warnings, []);
    // The last has too many faces to be replaced by lights.
    let lights = lights.len();
    let scene = loaded.world.into_scene(true).expect("a scene");
    assert!(scene.lights.len() > lights && scene.lights.len() <= lights + 4096);
}

#[test]
fn an_image_of_emission_multiplies_it() {
    let emission = |text: &str| {
        let loaded = data_of(text).expect("a scene");
        let material = &loaded.world.materials[0];
        (material.emission, material.emission_map.is_some())
    };
    assert_eq!(emission("emission_texture = 'rgba.png'"), (Rgb::ONE, true));
    assert_eq!(
        emission("diffuse = 0.5\nemission = 3\nemission_texture = 'rgba.png'"),
        (Rgb::splat(3.0), true)
    );
}

/// A scene of a quad of the material `text`, beside the image `rgba.png`.
fn data_of(text: &str) -> crate::error::Result<Loaded> {
    let folder = tempfile::tempdir().expect("a folder");
    let pixel = image::RgbaImage::from_pixel(1, 1, image::Rgba([10, 128, 30, 255]));
    pixel.save(folder.path().join("rgba.png")).expect("written");
    let quad =
        "[[mesh]]\nquad = { centre = [0, 3, 0], normal = '-y', size = [1, 1] }\nmaterial = 'm'\n";
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, format!("{quad}[material.m]\n{text}\n")).expect("written");
    load(&path, &LoadOptions::default())
}

#[test]
fn the_command_line_size_reaches_framing_and_settings() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, "[[sphere]]\ncentre = [0, 0, 0]\nradius = 1\n").expect("written");
    let at = |size| {
        let loaded = load(&path, &LoadOptions { size, ..LoadOptions::default() }).expect("a scene");
        let CameraPath::Orbit { eye, .. } = loaded.shot.path else { panic!("an orbit") };
        (eye.length(), (loaded.settings.width, loaded.settings.height))
    };
    let (wide, size) = at(Some((200, 100)));
    assert_eq!(size, (200, 100));
    assert!(at(Some((100, 200))).0 > 1.5 * wide);
}

#[test]
fn a_lens_has_a_radius_or_an_f_number_and_a_focus() {
    let lens = |camera: &str| good(&format!("[camera]\n{camera}")).shot.lens;
    let thin = |camera: &str| match lens(camera) {
        ShotLens::Thin(path) => path,
        ShotLens::Pinhole => panic!("{camera}: a pinhole"),
    };
    assert_eq!(lens("fov = 30"), ShotLens::Pinhole);
    let plain = thin("lens = { radius = 0.25 }");
    assert_eq!((plain.keys.len(), plain.blades), (1, 0));
    assert_eq!((plain.keys[0].radius, plain.keys[0].focus), (0.25, Focus::Target));
    let shaped = thin("lens = { radius = 1, focus = 3, blades = 6, blade_rotation = 15 }");
    assert_eq!((shaped.blades, shaped.blade_rotation_degrees), (6, 15.0));
    assert_eq!(shaped.keys[0].focus, Focus::Distance(3.0));
    // A 50 mm lens on 24 mm of film at f/2 opens by 12.5 mm to either side.
    let fov = 2.0 * (12.0f64 / 50.0).atan().to_degrees();
    let photo = thin(&format!("fov = {fov}\nlens = {{ f_number = 2, focus = 'target' }}"));
    assert!((photo.keys[0].radius - 0.0125).abs() < 1e-12);
    let film = thin(&format!("fov = {fov}\nlens = {{ f_number = 2, sensor_height = 0.048 }}"));
    assert!((film.keys[0].radius - 0.025).abs() < 1e-12);
}

#[test]
fn keys_change_the_lens_and_keep_what_they_leave_out() {
    let key = |lens: &str| format!("[[camera.keys]]\neye = [0, 0, 5]\ntarget = [0, 0, 0]\n{lens}");
    let text = format!(
        "[camera]\nframes = 3\nlens = {{ radius = 0.5, focus = 2 }}\n{}\n{}\n{}\n",
        key(""),
        key("lens = { focus = 'target' }"),
        key("lens = { radius = 0 }"),
    );
    let shot = good(&text).shot;
    let lens = |frame| shot.camera(frame, 8, 8).expect("a camera").lens;
    let of = |frame| match lens(frame) {
        Lens::Thin(lens) => (lens.radius, lens.focus),
        Lens::Pinhole => panic!("frame {frame}"),
    };
    assert_eq!((of(1), of(2), lens(3)), ((0.5, 2.0), (0.5, 5.0), Lens::Pinhole));
    // A pull of focus by a camera that stands makes frames of its own.
    assert_ne!(
        shot.camera(1, 8, 8).expect("one").encode(),
        shot.camera(2, 8, 8).expect("two").encode()
    );
}

#[test]
fn keys_zoom_and_shift_and_keep_what_they_leave_out() {
    let keys = "keys = [{ eye = [0, 0, 4], target = [0, 0, 0], fov = 20 },\n\
                { eye = [0, 0, 4], target = [0, 0, 0], shift = [0.25, -0.5] }]";
    let shot = good(&format!("[camera]\nfov = 40\nframes = 2\npixel_aspect = 2\n{keys}\n")).shot;
    let camera = |frame| shot.camera(frame, 100, 50).expect("a camera");
    let half_height = |degrees: f64| (0.5 * degrees.to_radians()).tan();
    assert!((camera(1).half_up.length() - half_height(20.0)).abs() < 1e-15);
    assert!((camera(1).half_right.length() - 4.0 * half_height(20.0)).abs() < 1e-14);
    assert!((camera(2).half_up.length() - half_height(40.0)).abs() < 1e-15);
    // The picture lies a quarter of its width to the right: the target is seen that much further left.
    let (x, y, _) = camera(2).project(DVec3::ZERO).expect("in front");
    assert!((x - 25.0).abs() < 1e-9 && (y - 0.0).abs() < 1e-9, "{x} {y}");
    assert!(camera(2).direction(25.0, 0.0).distance(-DVec3::Z) < 1e-12);
    // An f-number follows the key's own field of view.
    let text = format!("[camera]\nfov = 40\nlens = {{ f_number = 2, focus = 1 }}\n{keys}\n");
    let ShotLens::Thin(lens) = good(&text).shot.lens else { panic!("a thin lens") };
    let radius = |degrees: f64| 0.5 * 0.5 * 0.024 / half_height(degrees) / 2.0;
    assert!((lens.keys[0].radius - radius(20.0)).abs() < 1e-15);
    assert!((lens.keys[1].radius - radius(40.0)).abs() < 1e-15);
    assert!(good("[camera]\nfov = 30\n").shot.projections.is_empty());
}
