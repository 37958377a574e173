use super::*;
use crate::scene::{CameraPath, Shot, WorldMesh, WorldSphere};

/// A box of points without triangles.
fn cloud(min: DVec3, max: DVec3) -> WorldMesh {
    let mut positions = Vec::new();
    for x in [min.x, max.x] {
        for y in [min.y, max.y] {
            positions.extend([min.z, max.z].map(|z| DVec3::new(x, y, z)));
        }
    }
    WorldMesh::new("cloud", positions, vec![], 0)
}

/// How far from the image's middle the world comes in any of many frames: 1 is the edge.
fn fill(world: &World, target: DVec3, eye: DVec3, axis: DVec3, lens: &Lens) -> f64 {
    let frames = 720;
    let path = CameraPath::Orbit { target, eye, axis, degrees: 360.0, roll_degrees: 0.0 };
    let shot = Shot::new(path, frames, lens.vfov_degrees);
    let (width, height) = ((1000.0 * lens.aspect) as u32, 1000);
    let mut points: Vec<DVec3> = world.meshes.iter().flat_map(|m| m.positions.clone()).collect();
    for s in &world.spheres {
        for i in 0..400 {
            let (z, turn) = (f64::from(i) / 199.5 - 1.0, f64::from(i) * 2.4);
            let r = (1.0 - z * z).max(0.0).sqrt();
            points.push(s.centre + s.radius * DVec3::new(r * turn.cos(), z, r * turn.sin()));
        }
    }
    let mut most = 0f64;
    for frame in 1..=frames {
        let camera = shot.camera(frame, width, height).expect("a camera");
        for p in &points {
            let (x, y, _) = camera.project(*p).expect("in front of the camera");
            most = most.max((2.0 * x / f64::from(width) - 1.0).abs());
            most = most.max((2.0 * y / f64::from(height) - 1.0).abs());
        }
    }
    most
}

fn shapes() -> Vec<World> {
    let mesh = |min: [f64; 3], max: [f64; 3]| World {
        meshes: vec![cloud(min.into(), max.into())],
        ..World::default()
    };
    let ball = |x: f64, radius: f64| WorldSphere::new("ball", DVec3::new(x, 0.3, 0.0), radius, 0);
    vec![
        mesh([-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]),
        mesh([-5.0, 0.0, -0.1], [5.0, 0.2, 0.1]),
        mesh([99.9, 7.0, -3.1], [100.1, 12.0, -3.0]),
        mesh([1e-7, 0.0, 0.0], [2e-7, 3e-7, 1e-7]),
        World { spheres: vec![ball(1.0, 0.5), ball(-1.0, 2.0)], ..World::default() },
    ]
}

#[test]
fn every_frame_holds_the_whole_scene_and_little_more() {
    for world in shapes() {
        for aspect in [0.4, 1.0, 16.0 / 9.0] {
            for (elevation, vfov_degrees) in [(20.0, 40.0), (-10.0, 10.0), (60.0, 90.0)] {
                let lens = Lens { vfov_degrees, aspect };
                let (target, eye) = orbit(&world, None, DVec3::Y, elevation, &lens);
                let fill = fill(&world, target, eye, DVec3::Y, &lens);
                // Points on a sphere's outline are only sampled.
                assert!(fill < 0.901 && fill > 0.88, "{fill} {aspect} {elevation} {world:?}");
            }
        }
    }
}

#[test]
fn other_axes_and_targets_hold_it_too() {
    let lens = Lens { vfov_degrees: 30.0, aspect: 1.5 };
    for axis in [DVec3::X, DVec3::Z, DVec3::NEG_Y, DVec3::new(1.0, 2.0, -2.0) / 3.0] {
        for world in shapes() {
            let (target, eye) = orbit(&world, None, axis, 20.0, &lens);
            assert!(fill(&world, target, eye, axis, &lens) < 0.901);
            let aside = bounds(&world).max;
            let (target, eye) = orbit(&world, Some(aside), axis, 20.0, &lens);
            assert_eq!(target, aside);
            assert!(fill(&world, target, eye, axis, &lens) < 0.901);
        }
    }
}

#[test]
fn the_first_eye_is_in_front_and_above() {
    let lens = Lens { vfov_degrees: 30.0, aspect: 1.5 };
    for world in shapes() {
        let (target, eye) = orbit(&world, None, DVec3::Y, 20.0, &lens);
        let arm = (eye - target).normalize();
        assert!(arm.x.abs() < 1e-9 && arm.z > 0.9);
        assert!((arm.y.asin().to_degrees() - 20.0).abs() < 1e-6);
    }
}

#[test]
fn an_empty_scene_and_a_single_point_have_an_orbit() {
    let lens = Lens { vfov_degrees: 30.0, aspect: 1.5 };
    let point = cloud(DVec3::ONE, DVec3::ONE);
    for world in [World::default(), World { meshes: vec![point], ..World::default() }] {
        let (target, eye) = orbit(&world, None, DVec3::Y, 20.0, &lens);
        assert!(target.is_finite() && eye.is_finite() && (eye - target).length() >= 1.0);
    }
}
