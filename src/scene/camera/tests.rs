//! Frames of reference, extreme lenses, errors, and the round trip through a pixel.

use super::*;
use proptest::prelude::*;

fn pose(eye: DVec3, target: DVec3, up: DVec3) -> Pose {
    Pose { eye, target, up, roll_degrees: 0.0 }
}

/// Right, up and backward: unit, perpendicular, right-handed, to rounding.
fn assert_orthonormal(c: &Camera) {
    let (r, u) = (unit(c.half_right), unit(c.half_up));
    assert!(r.is_finite() && u.is_finite() && c.forward.is_finite());
    for (a, b) in [(r, u), (u, c.forward), (c.forward, r)] {
        assert!(a.dot(b).abs() < 4e-16, "{a} · {b} = {:e}", a.dot(b));
    }
    assert!((r.cross(u) + c.forward).length() < 1e-15);
}

#[test]
fn a_plain_camera_looks_where_it_should() {
    let pose = pose(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, DVec3::Y);
    let c = Camera::new(&pose, 90.0, 200, 100).expect("plain");
    assert_eq!(c.direction(100.0, 50.0), DVec3::NEG_Z);
    assert!((c.direction(100.0, 0.0) - DVec3::new(0.0, 1.0, -1.0).normalize()).length() < 1e-15);
    assert!((c.direction(200.0, 50.0) - DVec3::new(2.0, 0.0, -1.0).normalize()).length() < 1e-15);
    assert!(c.project(DVec3::Z * 5.0).is_none() && c.project(DVec3::Z * 6.0).is_none());
    assert!(c.project(DVec3::splat(f64::NAN)).is_none());
}

#[test]
fn positive_roll_tilts_the_camera_clockwise() {
    let pose = Pose { roll_degrees: 90.0, ..pose(DVec3::Z, DVec3::ZERO, DVec3::Y) };
    let c = Camera::new(&pose, 90.0, 10, 10).expect("rolled");
    // The camera's top points right, so the world's top appears on the left.
    assert!((c.half_up - DVec3::X).length() < 1e-15);
    let (x, _, _) = c.project(DVec3::Y * 0.5).expect("in front");
    assert!(x < 5.0);
    let turns = Pose { roll_degrees: 360.0 * 1e6 + 90.0, ..pose };
    let same = Camera::new(&turns, 90.0, 10, 10).expect("rolled");
    assert!((same.half_up - c.half_up).length() < 1e-15);
}

#[test]
fn views_along_up_and_nearly_along_it_have_a_frame() {
    for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
        for sign in [1.0, -1.0] {
            for off in [0.0, 1e-16, 1e-12, 0.9e-9, 1.1e-9, 1e-8, 1e-6, 1e-3] {
                for side in [DVec3::X, DVec3::Y, DVec3::Z, -DVec3::ONE] {
                    let target = axis * sign + side * off;
                    let pose = pose(DVec3::ZERO, target, axis);
                    assert_orthonormal(&Camera::new(&pose, 40.0, 64, 36).expect("allowed"));
                }
            }
        }
    }
    let down = pose(DVec3::Y, DVec3::ZERO, DVec3::Y);
    let c = Camera::new(&down, 40.0, 64, 36).expect("allowed");
    assert!((unit(c.half_up) - DVec3::Z).length() < 1e-15, "z is up where up has no meaning");
    let none = pose_with_up_zero();
    assert_orthonormal(&Camera::new(&none, 40.0, 64, 36).expect("allowed"));
}

fn pose_with_up_zero() -> Pose {
    pose(DVec3::ONE, DVec3::ZERO, DVec3::ZERO)
}

#[test]
fn extreme_sizes_and_lenses_stay_finite() {
    for scale in [1e-300, 1e-30, 1.0, 1e30, 1e150, 1e300] {
        let pose = pose(DVec3::new(1.0, 2.0, 3.0) * scale, DVec3::ZERO, DVec3::Y * scale);
        for vfov in [1e-6, 1e-3, 90.0, 179.0, 180.0 - 1e-6] {
            for (w, h) in [(1, 1), (1, u32::MAX), (u32::MAX, 1)] {
                let c = Camera::new(&pose, vfov, w, h).expect("allowed");
                assert_orthonormal(&c);
                for (x, y) in [(0.0, 0.0), (f64::from(w), 0.0), (0.5, f64::from(h))] {
                    assert!((c.direction(x, y).length() - 1.0).abs() < 1e-15);
                }
            }
        }
    }
}

#[test]
fn invalid_cameras_are_errors() {
    let good = pose(DVec3::Z, DVec3::ZERO, DVec3::Y);
    let bad = |p: Pose| Camera::new(&p, 40.0, 4, 4).is_err();
    assert!(!bad(good));
    assert!(bad(Pose { eye: DVec3::ZERO, ..good }));
    let far = DVec3::splat(1e6);
    assert!(bad(Pose { eye: far, target: far + DVec3::X * 2e-10, ..good }));
    assert!(!bad(Pose { eye: far, target: far + DVec3::X * 1e-8, ..good }));
    assert!(bad(Pose { eye: DVec3::X * 1e308, target: DVec3::X * -1e308, ..good }));
    assert!(bad(Pose { roll_degrees: f64::NAN, ..good }));
    for v in [f64::NAN, f64::INFINITY] {
        assert!(bad(Pose { eye: DVec3::splat(v), ..good }));
        assert!(bad(Pose { target: DVec3::splat(v), ..good }));
        assert!(bad(Pose { up: DVec3::splat(v), ..good }));
    }
    for vfov in [0.0, -1.0, 1e-7, 180.0, 200.0, f64::NAN] {
        assert!(Camera::new(&good, vfov, 4, 4).is_err());
    }
    assert!(Camera::new(&good, 40.0, 0, 4).is_err() && Camera::new(&good, 40.0, 4, 0).is_err());
}

fn point() -> impl Strategy<Value = DVec3> {
    prop::array::uniform3(-10.0f64..10.0).prop_map(DVec3::from_array)
}

proptest! {
    #[test]
    fn projecting_a_direction_gives_its_pixel_back(
        (eye, target, up) in (point(), point(), point()),
        (roll, vfov) in (-400.0f64..400.0, 0.1f64..170.0),
        (w, h) in (1u32..5000, 1u32..5000),
        (u, v, distance) in (0.0f64..1.0, 0.0f64..1.0, 1e-3f64..1e3),
        (right, upwards, pixel_aspect) in (-1.0f64..1.0, -1.0f64..1.0, 0.5f64..2.0),
    ) {
        prop_assume!(eye.distance(target) > 1e-3);
        let pose = Pose { eye, target, up, roll_degrees: roll };
        let projection = Projection { vfov_degrees: vfov, shift: [right, upwards], pixel_aspect };
        let c = Camera::with_projection(&pose, &projection, w, h).expect("an ordinary camera");
        prop_assert_eq!(Camera::decode(&c.encode()), Some(c));
        let (x, y) = (u * f64::from(w), v * f64::from(h));
        let direction = c.direction(x, y);
        prop_assert!((direction.length() - 1.0).abs() < 1e-15);
        let p = eye + direction * distance;
        let (px, py, depth) = c.project(p).expect("in front");
        // Rounding of p against the size of a pixel at its distance, and against its depth, which is small at the edges of a wide picture.
        let pixel = 2.0 * c.half_up.length() / f64::from(h) * depth;
        let reach = eye.length() + distance;
        let edges = f64::from(w + h);
        let bound = 1e-13 * (1.0 + reach / pixel) + edges * (1e-12 + 4e-15 * reach / depth);
        prop_assert!((px - x).abs() < bound && (py - y).abs() < bound, "{px} {py} for {x} {y}");
        prop_assert!((depth - distance * direction.dot(c.forward)).abs() < 1e-12 * (10.0 + distance));
    }

    #[test]
    fn the_target_is_in_the_middle(eye in point(), target in point(), up in point()) {
        prop_assume!(eye.distance(target) > 1e-3);
        let c = Camera::new(&pose(eye, target, up), 50.0, 640, 360).expect("ordinary");
        let (x, y, _) = c.project(target).expect("in front");
        prop_assert!((x - 320.0).abs() < 1e-8 && (y - 180.0).abs() < 1e-8);
    }
}
