//! Whole shots: ends, timing, poles and errors.

use super::*;
use proptest::prelude::*;

const UP: DVec3 = DVec3::Y;

fn shot(path: CameraPath, frames: u32) -> Shot {
    Shot::new(path, frames, 40.0)
}

fn pan(from: DVec3, to: DVec3, target: DVec3) -> CameraPath {
    CameraPath::Pan { from, to, target, up: UP, roll_degrees: 0.0 }
}

fn orbit(eye: DVec3, degrees: f64) -> CameraPath {
    CameraPath::Orbit { target: DVec3::ZERO, eye, axis: UP, degrees, roll_degrees: 0.0 }
}

fn b_spline(points: Vec<DVec3>) -> CameraPath {
    CameraPath::BSpline { points, target: DVec3::ZERO, up: UP, roll_degrees: 0.0 }
}

fn pose(eye: DVec3, up: DVec3) -> Pose {
    Pose { eye, target: DVec3::ZERO, up, roll_degrees: 0.0 }
}

fn keys(poses: &[(f64, Pose)]) -> CameraPath {
    CameraPath::Keys(poses.iter().map(|(at, pose)| KeyPose { at: *at, pose: *pose }).collect())
}

fn eyes(shot: &Shot) -> Vec<DVec3> {
    (1..=shot.frames).map(|f| shot.pose(f).expect("a pose").eye).collect()
}

fn message(shot: &Shot) -> String {
    shot.validate().expect_err("must be refused").to_string()
}

/// The largest angle, degrees, that the image's right or up turns from one frame to the next.
fn largest_turn(shot: &Shot) -> f64 {
    let cameras: Vec<Camera> =
        (1..=shot.frames).map(|f| shot.camera(f, 8, 8).expect("a camera")).collect();
    let angle = |a: DVec3, b: DVec3| a.angle_between(b).to_degrees();
    cameras.windows(2).fold(0.0, |most, w| {
        most.max(angle(w[0].half_right, w[1].half_right)).max(angle(w[0].half_up, w[1].half_up))
    })
}

#[test]
fn easings_hit_both_ends_and_never_go_back() {
    for easing in [Easing::Linear, Easing::In, Easing::Out, Easing::InOut] {
        assert_eq!((easing.apply(0.0), easing.apply(1.0)), (0.0, 1.0));
        let values: Vec<f64> = (0..=9999).map(|i| easing.apply(f64::from(i) / 9999.0)).collect();
        assert!(values.windows(2).all(|w| w[0] <= w[1]), "{easing:?}");
    }
    assert_eq!(Easing::In.apply(0.5), 0.25);
    assert_eq!(Easing::Out.apply(0.5), 0.75);
    assert_eq!(Easing::InOut.apply(0.5), 0.5);
}

#[test]
fn a_pan_runs_from_end_to_end_in_equal_steps() {
    let (from, to) = (DVec3::new(5.0, 3.0, 10.0), DVec3::new(-5.0, 3.0, 10.0));
    let eyes = eyes(&shot(pan(from, to, DVec3::ZERO), 16));
    assert_eq!((eyes[0], eyes[15]), (from, to));
    for (i, eye) in eyes.iter().enumerate() {
        assert!((eye.x - (5.0 - 10.0 * i as f64 / 15.0)).abs() < 2e-15);
    }
}

#[test]
fn one_frame_is_the_start_and_a_path_of_no_length_stands_still() {
    let p = DVec3::new(0.1, 0.2, 0.3);
    for path in [
        pan(p, DVec3::X, DVec3::ZERO),
        orbit(p, 360.0),
        b_spline(vec![p, DVec3::X, DVec3::Y, DVec3::Z]),
        keys(&[(0.0, pose(p, UP)), (1.0, pose(DVec3::X, UP))]),
        CameraPath::Still(pose(p, UP)),
    ] {
        let single = shot(path, 1);
        single.validate().expect("valid");
        assert_eq!(eyes(&single), [p]);
    }
    for path in [
        pan(p, p, DVec3::ZERO),
        orbit(p, 0.0),
        b_spline(vec![p; 4]),
        keys(&[(0.0, pose(p, UP)), (0.3, pose(p, UP)), (1.0, pose(p, UP))]),
    ] {
        let still = shot(path, 17);
        still.validate().expect("valid");
        let first = still.camera(1, 64, 36).expect("a camera");
        assert!((2..=17).all(|f| still.camera(f, 64, 36).expect("a camera") == first));
    }
}

#[test]
fn a_closed_orbit_stops_one_step_before_its_start_and_an_open_one_at_its_end() {
    let eye = DVec3::new(3.0, 1.0, 0.0);
    let closed = eyes(&shot(orbit(eye, 360.0), 4));
    let at = |x, z| DVec3::new(x, 1.0, z);
    // Counter-clockwise seen from above: from +x towards -z.
    for (found, exact) in closed.iter().zip([at(3., 0.), at(0., -3.), at(-3., 0.), at(0., 3.)]) {
        assert!(found.distance(exact) < 1e-14, "{found} for {exact}");
    }
    let steps: Vec<f64> = (0..4).map(|i| closed[i].distance(closed[(i + 1) % 4])).collect();
    assert!(steps.iter().all(|s| (s - steps[0]).abs() < 1e-14));
    let open = eyes(&shot(orbit(eye, -90.0), 3));
    assert!(open[0].distance(eye) < 1e-14 && open[2].distance(at(0., 3.)) < 1e-14);
    let twice = eyes(&shot(orbit(eye, 720.0), 4));
    assert!(twice[2].distance(eye) < 1e-14);
}

#[test]
fn a_pan_straight_over_its_target_is_continuous() {
    for frames in [3, 15, 16, 101] {
        for target in [DVec3::ZERO, DVec3::new(1e6, -3e5, 7e5), DVec3::splat(1e9)] {
            let over = |x| target + DVec3::new(x, 10.0, 0.3 * x);
            let path = pan(over(5.0), over(-5.0), target);
            let turn = largest_turn(&shot(path, frames));
            // The view itself turns by 2 atan(1/2), about 55 degrees, in all.
            assert!(turn < 120.0 / f64::from(frames - 1), "{turn} degrees with {frames} frames");
        }
    }
    let end = shot(pan(DVec3::new(5., 10., 0.), DVec3::new(-5., 10., 0.), DVec3::ZERO), 9);
    let camera = |f| end.camera(f, 8, 8).expect("a camera");
    assert!(camera(1).half_up.y > 0.0 && camera(9).half_up.y < 0.0, "over the top, as a crane");
}

#[test]
fn moves_that_start_or_end_at_the_pole_come_from_there_smoothly() {
    let (top, side) = (DVec3::Y * 10.0, DVec3::new(5.0, 10.0, 2.0));
    assert!(largest_turn(&shot(pan(top, side, DVec3::ZERO), 50)) < 2.0);
    assert!(largest_turn(&shot(pan(side, top, DVec3::ZERO), 50)) < 2.0);
    assert!(largest_turn(&shot(pan(-top, -side, DVec3::ZERO), 50)) < 2.0);
    // Straight down the axis: one image throughout.
    assert!(largest_turn(&shot(pan(top, top * 0.1, DVec3::ZERO), 9)) < 1e-6);
}

#[test]
fn splines_and_keys_over_the_pole_are_continuous() {
    let arc = |a: f64| DVec3::new(a.cos(), a.sin(), 0.5 * a.cos()) * 4.0;
    let angles = [0.3, 0.8, 1.3, std::f64::consts::FRAC_PI_2, 1.9, 2.5, 2.8];
    let spline = shot(b_spline(angles.iter().map(|a| arc(*a)).collect()), 121);
    assert!(largest_turn(&spline) < 3.0, "{}", largest_turn(&spline));
    let list: Vec<(f64, Pose)> =
        angles.iter().enumerate().map(|(i, a)| (i as f64 / 6.0, pose(arc(*a), UP))).collect();
    let keyed = shot(keys(&list), 121);
    assert!(largest_turn(&keyed) < 4.0, "{}", largest_turn(&keyed));
    // Not in one plane, but exactly at the pole in one frame: the limit from before.
    let (a, b) = (DVec3::new(1.0, 4.0, 0.0), DVec3::new(0.0, 4.0, 1.0));
    let bent =
        shot(keys(&[(0.0, pose(a, UP)), (0.5, pose(UP * 4.0, UP)), (1.0, pose(b, UP))]), 201);
    let camera = |f| bent.camera(f, 8, 8).expect("a camera");
    assert!(camera(100).half_right.angle_between(camera(101).half_right) < 0.02);
}

#[test]
fn an_ordinary_path_keeps_its_up_and_a_pan_through_its_target_stays_upright() {
    let ordinary = shot(pan(DVec3::new(5., 3., 10.), DVec3::new(-5., 3., 10.), DVec3::ZERO), 16);
    assert!((1..=16).all(|f| ordinary.pose(f).expect("a pose").up == UP));
    let through = shot(pan(DVec3::new(3., 1., 0.), DVec3::new(-3., -1., 0.), DVec3::ZERO), 4);
    assert!((1..=4).all(|f| through.pose(f).expect("a pose").up == UP));
}

#[test]
fn roll_is_interpolated_between_keys() {
    let rolled = |d| Pose { roll_degrees: d, ..pose(DVec3::Z, UP) };
    let s = shot(keys(&[(0.0, rolled(0.0)), (1.0, rolled(720.0))]), 9);
    s.validate().expect("valid");
    assert_eq!(s.pose(2).expect("a pose").roll_degrees, 90.0);
}

#[test]
fn an_eye_on_its_target_names_the_frame() {
    let line = shot(pan(DVec3::X, DVec3::NEG_X, DVec3::ZERO), 5);
    let text = message(&line);
    assert!(text.starts_with("frame 3 of 5:") && text.contains("target"), "{text}");
    line.camera(2, 8, 8).expect("the other frames are fine");
    let opposite = [(0.0, pose(DVec3::Z, UP)), (1.0, pose(DVec3::Z, -UP))];
    let text = message(&shot(keys(&opposite), 3));
    assert!(text.starts_with("frame 2 of 3:") && text.contains("opposite"), "{text}");
}

#[test]
fn invalid_paths_are_errors() {
    let p = DVec3::ONE;
    let text = |path| message(&shot(path, 4));
    assert!(text(b_spline(vec![p; 3])).contains("has 3 control points"));
    assert!(text(b_spline(vec![])).contains("has 0 control points"));
    assert!(text(orbit(DVec3::Y * 3.0, 90.0)).contains("axis"));
    assert!(text(orbit(DVec3::ZERO, 90.0)).contains("axis"));
    assert!(text(orbit(p, f64::INFINITY)).contains("turns by inf"));
    assert!(text(keys(&[])).contains("at least one"));
    assert!(text(keys(&[(0.0, pose(p, UP)), (0.0, pose(p, UP))])).contains("key 2 is at 0"));
    assert!(text(keys(&[(0.5, pose(p, UP)), (0.2, pose(p, UP))])).contains("times must increase"));
    assert!(text(keys(&[(0.0, pose(p, UP)), (1.5, pose(p, UP))])).contains("from 0 to 1"));
    assert!(text(keys(&[(f64::NAN, pose(p, UP))])).contains("from 0 to 1"));
    assert!(text(CameraPath::Still(pose(p, DVec3::ZERO))).contains("up direction"));
    for nan in [DVec3::NAN, DVec3::INFINITY] {
        assert!(text(pan(nan, p, p)).contains("finite"));
        assert!(text(pan(p, nan, p)).contains("finite"));
        assert!(text(pan(p, p, nan)).contains("finite"));
        assert!(text(b_spline(vec![p, nan, p, p])).contains("finite"));
        assert!(text(keys(&[(0.0, pose(nan, UP))])).contains("finite"));
        assert!(text(CameraPath::Still(pose(p, nan))).contains("finite"));
    }
}

#[test]
fn invalid_shots_are_errors() {
    let good = shot(pan(DVec3::X, DVec3::Z, DVec3::ZERO), 4);
    good.validate().expect("valid");
    assert!(message(&Shot { frames: 0, ..good.clone() }).contains("0 frames"));
    let lens = message(&Shot { vfov_degrees: 180.0, ..good.clone() });
    assert!(lens.starts_with("the vertical field of view"), "{lens}");
    for frame in [0, 5] {
        assert!(good.pose(frame).expect_err("no such frame").to_string().contains("1 to 4"));
    }
}

fn rolled_key(at: f64, x: f64, roll: f64) -> KeyPose {
    let pose = Pose { eye: DVec3::X * x, target: DVec3::Z, up: DVec3::Y, roll_degrees: roll };
    KeyPose { at, pose }
}

#[test]
fn keys_are_met_at_their_times_and_two_keys_make_a_line() {
    let keys = [
        rolled_key(0.0, 1.0, 0.0),
        rolled_key(0.1, -3.0, 5.0),
        rolled_key(0.7, 9.0, 0.0),
        rolled_key(1.0, 2.0, 1.0),
    ];
    for k in &keys {
        assert_eq!(key_pose(&keys, k.at), k.pose);
    }
    let line = [rolled_key(0.0, 1.0, 0.0), rolled_key(1.0, 5.0, 90.0)];
    let middle = key_pose(&line, 0.25);
    assert_eq!((middle.eye.x, middle.roll_degrees), (2.0, 22.5));
    assert_eq!(middle.up, DVec3::Y);
    let held = [rolled_key(0.25, 1.0, 0.0), rolled_key(0.5, 5.0, 90.0)];
    assert_eq!(key_pose(&held, 0.1), held[0].pose);
    assert_eq!(key_pose(&held, 0.9), held[1].pose);
    assert_eq!(key_pose(&held[..1], 0.3), held[0].pose);
}

#[test]
fn uneven_key_times_reproduce_a_parabola_inside() {
    // Slopes are those of parabolas: away from the ends quadratic motion is exact.
    let times = [0.0, 0.1, 0.35, 0.4, 0.8, 1.0];
    let keys: Vec<KeyPose> = times.iter().map(|t| rolled_key(*t, t * t - 3.0 * t, *t)).collect();
    for i in 0..=70 {
        let t = 0.1 + 0.01 * f64::from(i);
        let found = key_pose(&keys, t);
        assert!((found.eye.x - (t * t - 3.0 * t)).abs() < 1e-14);
        assert!((found.roll_degrees - t).abs() < 1e-14);
    }
}

proptest! {
    #[test]
    fn key_paths_are_smooth(xs in prop::collection::vec(-10.0f64..10.0, 3..8)) {
        let last = (xs.len() - 1) as f64;
        let time = |i: usize| (i as f64 / last).powi(2);
        let keys: Vec<KeyPose> =
            xs.iter().enumerate().map(|(i, x)| rolled_key(time(i), *x, 0.0)).collect();
        for i in 1..xs.len() - 1 {
            let (t, h) = (time(i), 1e-8);
            let at = |t| key_pose(&keys, t).eye.x;
            let (before, after) = ((at(t) - at(t - h)) / h, (at(t + h) - at(t)) / h);
            prop_assert!((before - after).abs() < 1e-2, "{before} {after} at key {i}");
        }
    }
}
