use super::*;
use crate::import::{UpAxis, load};
use std::path::PathBuf;

const CUBE: &str = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nv 0 0 3\nv 2 0 3\nv 2 1 3\nv 0 1 3\n\
                    f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 2 3 7 6\nf 1 5 8 4\n";
const COURSE: &str = "material\ndiffuse 0 0 0\nreflective 0 0 0\nemitted 2 2 2\nroughness 0\n\
                      material\ndiffuse .7 .7 .7\nreflective 0 0 0\nemitted 0 0 0\nroughness 0\n\
                      m 0\nv -6 10 6\nv -6 10 4\nv -4 10 4\nv -4 10 6\nf 1 2 3 4\nm 1\n\
                      v -10 -1 -10\nv -10 -1 10\nv 10 -1 10\nv 10 -1 -10\nf 5 6 7 8\n\
                      s 0.3 0 -1 1\ns -0.5 -0.6 0.2 0.4\n";

fn written(name: &str, text: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    std::fs::write(&path, text).expect("written");
    (folder, path)
}

fn turntable(text: &str, options: &LoadOptions) -> Loaded {
    let (_folder, path) = written("mesh.obj", text);
    load(&path, options).expect("a turntable")
}

/// Every corner of the image, in every frame, sees the floor; the lamp is never in the image.
fn check_studio(loaded: &Loaded) {
    let (width, height) = (loaded.settings.width, loaded.settings.height);
    let floor = loaded.world.meshes.last().expect("a floor");
    let [Light::Quad(lamp)] = &loaded.world.lights[..] else { panic!("one lamp") };
    let (min, max) = (floor.positions[3], floor.positions[1]);
    for frame in 1..=loaded.shot.frames {
        let camera = loaded.shot.camera(frame, width, height).expect("a camera");
        let (w, h) = (f64::from(width), f64::from(height));
        for (x, y) in [(0.0, 0.0), (w, 0.0), (0.0, h), (w, h), (0.5 * w, 0.0)] {
            let dir = camera.direction(x, y);
            assert!(dir.y < 0.0, "frame {frame} sees the horizon");
            let at = camera.eye + dir * ((floor.positions[0].y - camera.eye.y) / dir.y);
            let inside = at.x > min.x.min(max.x) && at.x < min.x.max(max.x);
            assert!(inside && at.z > min.z.min(max.z) && at.z < min.z.max(max.z), "{frame}");
        }
        for corner in lamp.corners {
            if let Some((x, y, _)) = camera.project(corner) {
                assert!(!((0.0..w).contains(&x) && (0.0..h).contains(&y)), "frame {frame}");
            }
        }
    }
}

#[test]
fn a_mesh_stands_on_a_floor_that_fills_every_frame() {
    for size in [None, Some((300, 900)), Some((1200, 300))] {
        let loaded = turntable(CUBE, &LoadOptions { size, ..LoadOptions::default() });
        check_studio(&loaded);
        assert_eq!((loaded.shot.frames, loaded.warnings.len()), (48, 0));
        let floor = loaded.world.meshes.last().expect("a floor");
        assert!(floor.positions[0].y < 0.0 && floor.positions[0].y > -0.01);
        let [a, b, c] = floor.triangles[0].map(|i| floor.positions[i as usize]);
        assert!((b - a).cross(c - a).y > 0.0, "the floor faces up");
    }
}

#[test]
fn the_lamp_shines_on_the_mesh_from_the_upper_left_at_any_size() {
    for scale in [1e-6, 1.0, 1e6] {
        let loaded = turntable(CUBE, &LoadOptions { scale, ..LoadOptions::default() });
        let [Light::Quad(lamp)] = &loaded.world.lights[..] else { panic!("one lamp") };
        let middle = DVec3::new(1.0, 0.5, 1.5) * scale;
        let centre = 0.25 * lamp.corners.iter().sum::<DVec3>();
        let to_middle = middle - centre;
        assert!(lamp.normal().dot(to_middle.normalize()) > 0.999_999);
        let irradiance = f64::from(lamp.radiance.x) * lamp.area() / to_middle.length_squared();
        assert!((irradiance - 2.4).abs() < 1e-3, "{irradiance}");
        let camera = loaded.shot.camera(1, 640, 360).expect("a camera");
        assert!(camera.half_right.dot(centre - middle) < 0.0 && centre.y > middle.y);
        loaded.world.into_scene(true).expect("a scene");
    }
}

#[test]
fn up_and_scale_turn_the_mesh_upright() {
    let options = LoadOptions { up: UpAxis::Z, scale: 2.0, ..LoadOptions::default() };
    let loaded = turntable(CUBE, &options);
    let mut only_mesh = loaded.world.clone();
    only_mesh.meshes.truncate(1);
    let bounds = framing::bounds(&only_mesh);
    assert_eq!(bounds.extent(), DVec3::new(4.0, 6.0, 2.0));
    let wrong = LoadOptions { scale: 0.0, ..LoadOptions::default() };
    assert!(load(std::path::Path::new("mesh.obj"), &wrong).is_err());
    let (_folder, path) = written("scene.toml", "");
    assert!(load(&path, &options).is_err_and(|e| e.to_string().contains("bare meshes")));
}

#[test]
fn a_course_file_keeps_its_own_light_and_plane() {
    let loaded = turntable(COURSE, &LoadOptions::default());
    let world = &loaded.world;
    assert_eq!((world.lights.len(), world.meshes.len(), world.spheres.len()), (1, 1, 2));
    assert_eq!((world.sky.radiance, world.sky.lights), (BACKDROP, false));
    for frame in 1..=loaded.shot.frames {
        let camera = loaded.shot.camera(frame, 640, 360).expect("a camera");
        let from_axis = DVec3::new(camera.eye.x, 0.0, camera.eye.z).length();
        assert!(from_axis > 4.0 && from_axis < 14.0, "the camera is {from_axis} away");
        assert!(camera.eye.y > 0.0 && camera.eye.y < 9.0);
        for s in &world.spheres {
            let (x, y, _) = camera.project(s.centre).expect("in front");
            assert!(x > 0.0 && x < 640.0 && y > 0.0 && y < 360.0);
        }
    }
}

#[test]
fn a_glowing_face_is_the_scenes_own_light() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("m.mtl"), "newmtl glow\nKe 5 5 5\nKd 0 0 0\n").expect("mtl");
    let path = folder.path().join("mesh.obj");
    let odd = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl glow\nf 1 2 3\n";
    std::fs::write(&path, odd).expect("obj");
    let loaded = load(&path, &LoadOptions::default()).expect("a turntable");
    let bright = |l: &&Light| matches!(l, Light::Quad(q) if q.radiance == Rgb::splat(5.0));
    // Three quads make the triangle; whoever brings a light gets no lamp beside it.
    assert!(!loaded.world.lights.is_empty() && loaded.world.lights.iter().all(|l| bright(&l)));
    assert_eq!(loaded.files.len(), 2);
}

#[test]
fn real_meshes_turn() {
    let folder = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/meshes"));
    if !folder.exists() {
        #[allow(clippy::print_stderr)]
        {
            eprintln!("skipped: {} is not on this machine", folder.display());
        }
        return;
    }
    for entry in std::fs::read_dir(folder).expect("readable").flatten() {
        let loaded = load(&entry.path(), &LoadOptions::default()).expect("a turntable");
        check_studio(&loaded);
        loaded.world.into_scene(true).expect("a scene");
    }
}
