//! Every scene in `scenes/` loads without a warning, becomes a scene to trace, and holds what its
//! README says.

use std::path::{Path, PathBuf};
use tweenray::import::{LoadOptions, Loaded, load, schema};
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::{CameraPath, Filter, Light, NormalPolicy, Scene};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes")
}

fn loaded(name: &str) -> Loaded {
    let path = folder().join(name).join("scene.toml");
    let loaded = load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(loaded.warnings, [], "{name}");
    // The gallery has images and meshes, the other scenes are whole in one file.
    if name == "gallery" {
        assert!(loaded.files.iter().all(|file| file.starts_with(folder().join(name))), "{name}");
    } else {
        assert_eq!(loaded.files, [path], "{name}");
    }
    loaded
}

fn scene(loaded: &Loaded) -> Scene {
    loaded.world.clone().into_scene(true).expect("a scene")
}

/// No camera stands in or close to an exact sphere.
fn cameras_stand_free(loaded: &Loaded) {
    for frame in 1..=loaded.shot.frames {
        let camera = loaded.shot.camera(frame, 64, 36).expect("a camera");
        for s in &loaded.world.spheres {
            assert!((camera.eye - s.centre).length() > 1.2 * s.radius, "frame {frame}");
        }
    }
}

#[test]
fn every_folder_has_a_scene_that_loads_and_has_a_description() {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder()).expect("scenes").flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let readme = std::fs::read_to_string(entry.path().join("README.md")).expect("a README.md");
        assert!(readme.starts_with(&format!("# {name}\n")), "{name}");
        let loaded = loaded(&name);
        assert!(scene(&loaded).bounds.radius() > 0.5, "{name}");
        cameras_stand_free(&loaded);
        names.push(name);
    }
    for name in [
        "spheres_on_terrain",
        "reflective_spheres",
        "cornell",
        "demo",
        "street_at_night",
        "courtyard",
        "foggy_hall",
        "materials",
        "gallery",
    ] {
        assert!(names.iter().any(|n| n == name), "{name}");
    }
}

#[test]
fn spheres_on_terrain_is_the_published_bench_scene() {
    let loaded = loaded("spheres_on_terrain");
    let settings = &loaded.settings;
    assert_eq!((settings.width, settings.height, settings.filter), (640, 360, Filter::Box));
    assert_eq!((loaded.shot.frames, loaded.shot.vfov_degrees), (16, 40.0));
    for i in 0..16u32 {
        let pose = loaded.shot.pose(i + 1).expect("a pose");
        let eye = DVec3::new(-6.0 + 12.0 * f64::from(i) / 15.0, 4.0, 11.0);
        assert!((pose.eye - eye).length() < 1e-12 && pose.target == DVec3::new(0.0, 1.2, 0.0));
        assert_eq!((pose.up, pose.roll_degrees), (DVec3::Y, 0.0));
    }
    let world = &loaded.world;
    let [Light::Quad(lamp)] = &world.lights[..] else { panic!("one lamp") };
    assert_eq!((lamp.area(), lamp.normal(), lamp.two_sided), (16.0, DVec3::NEG_Y, false));
    assert_eq!((lamp.radiance, lamp.corners[0].y), (Rgb::splat(20.0), 10.0));
    let centre = 0.25 * lamp.corners.iter().sum::<DVec3>();
    assert_eq!(centre, DVec3::new(1.0, 10.0, 2.0));
    assert_eq!((world.sky.radiance, world.sky.lights), (Rgb::new(0.05, 0.06, 0.08), true));
    assert_eq!(world.sky.ambient, Rgb::ZERO);
    let material = |mesh: usize| &world.materials[world.meshes[mesh].material as usize];
    assert_eq!(material(0).diffuse, Rgb::new(0.35, 0.42, 0.33));
    assert_eq!(material(1).mirror, Rgb::ONE);
    assert_eq!(material(2).glass.map(|g| (g.ior, g.tint)), Some((1.5, Rgb::ONE)));
    assert_eq!(material(3).diffuse, Rgb::new(0.60, 0.08, 0.06));
    let smooth: Vec<bool> = world.meshes.iter().map(|m| m.normals.is_some()).collect();
    assert_eq!(smooth, [false, true, true, true]);

    let scene = scene(&loaded);
    assert_eq!(scene.triangle_count(), 999_698 + 3 * 80_000 + 2);
    let sizes: Vec<usize> = scene.meshes.iter().map(|m| m.triangles.len()).collect();
    assert_eq!(sizes, [999_698, 80_000, 80_000, 80_000, 2]);
}

#[test]
fn reflective_spheres_says_what_the_course_file_says() {
    let ours = loaded("reflective_spheres");
    assert_eq!((ours.settings.width, ours.settings.height), (400, 300));
    assert_eq!((ours.settings.shadow_samples, ours.settings.bounces), (1, 3));
    assert_eq!(ours.world.sky.radiance, Rgb::new(0.5, 0.6, 0.9));
    let CameraPath::Pan { from, to, target, .. } = ours.shot.path else { panic!("a pan") };
    assert_eq!((from, to), (DVec3::new(5.0, 3.0, 10.0), DVec3::new(-5.0, 3.0, 10.0)));
    assert_eq!((target, ours.shot.frames), (DVec3::new(0.5, 0.0, -0.5), 16));

    let path =
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/course/reflective_spheres.obj"));
    if !path.exists() {
        #[allow(clippy::print_stderr)]
        {
            eprintln!("skipped the comparison: {} is not on this machine", path.display());
        }
        return;
    }
    let theirs = tweenray::import::load_model(path, NormalPolicy::Flat).expect("the course file");
    let material = |w: &tweenray::scene::World, id: u32| {
        let m = &w.materials[id as usize];
        (m.diffuse, m.mirror)
    };
    for (a, b) in ours.world.spheres.iter().zip(&theirs.world.spheres) {
        assert_eq!((a.centre, a.radius), (b.centre, b.radius));
        assert_eq!(material(&ours.world, a.material), material(&theirs.world, b.material));
    }
    let sorted = |positions: &[DVec3]| {
        let mut all: Vec<String> = positions.iter().map(DVec3::to_string).collect();
        all.sort();
        all
    };
    let corners = |l: &Light| match l {
        Light::Quad(q) => (sorted(&q.corners), q.radiance),
        _ => panic!("a quad light"),
    };
    assert_eq!(corners(&ours.world.lights[0]), corners(&theirs.world.lights[0]));
    let [plane, their_plane] = [&ours.world.meshes[0], &theirs.world.meshes[0]];
    assert_eq!(sorted(&plane.positions), sorted(&their_plane.positions));
    let of = |w, m: &tweenray::scene::WorldMesh| material(w, m.material);
    assert_eq!(of(&ours.world, plane), of(&theirs.world, their_plane));
}

/// Signed solid angle of a triangle seen from `eye` over 4 pi (Van Oosterom and Strackee, 1983).
fn winding(eye: DVec3, corners: [DVec3; 3]) -> f64 {
    let [a, b, c] = corners.map(|p| p - eye);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * a.dot(b.cross(c)).atan2(below) / (4.0 * std::f64::consts::PI)
}

#[test]
fn cornell_is_a_closed_room_and_the_camera_stays_inside() {
    let loaded = loaded("cornell");
    for frame in 1..=loaded.shot.frames {
        let eye = loaded.shot.pose(frame).expect("a pose").eye;
        let turns = |meshes: &[tweenray::scene::WorldMesh]| -> f64 {
            let corners = meshes
                .iter()
                .flat_map(|m| m.triangles.iter().map(|t| t.map(|i| m.positions[i as usize])));
            corners.map(|c| winding(eye, c)).sum()
        };
        // All round and facing inwards, then outside both boxes.
        let (room, boxes) = loaded.world.meshes.split_at(6);
        assert!((turns(room) + 1.0).abs() < 1e-9, "{}", turns(room));
        assert!(turns(boxes).abs() < 1e-9);
    }
    let [Light::Quad(lamp)] = &loaded.world.lights[..] else { panic!("one lamp") };
    assert_eq!(lamp.normal(), DVec3::NEG_Y);
    assert_eq!((loaded.world.sky.radiance, loaded.world.meshes.len()), (Rgb::ZERO, 8));
}

#[test]
fn the_demo_uses_much_and_stays_above_the_ground() {
    let loaded = loaded("demo");
    assert_eq!(scene(&loaded).triangle_count(), 1_280_000 + 2);
    for frame in 1..=loaded.shot.frames {
        let eye = loaded.shot.pose(frame).expect("a pose").eye;
        assert!(eye.y > tweenray::import::terrain_height(eye.x, eye.z) + 1.0, "frame {frame}");
    }
    let materials = &loaded.world.materials;
    assert!(materials.iter().any(|m| m.glass.is_some()));
    assert!(materials.iter().any(|m| m.mirror != Rgb::ZERO));
    assert!(loaded.world.sky.lights && !loaded.world.lights.is_empty());
}

#[test]
fn a_few_of_the_lights_of_street_at_night_matter_at_a_point() {
    let loaded = loaded("street_at_night");
    assert_eq!(loaded.world.lights.len(), 64);
    let scene = scene(&loaded);
    let cells = scene.light_cells.as_ref().expect("many lights");
    let mean = cells.mean();
    assert!((1.0..10.0).contains(&mean.main), "{mean:?}");
    assert!(cells.memory() < 32 << 20, "{} bytes", cells.memory());
}

#[test]
fn the_schema_is_public_json() {
    let text = serde_json::to_string_pretty(&schema()).expect("json");
    assert!(text.contains("https://json-schema.org/draft/2020-12/schema"));
}
