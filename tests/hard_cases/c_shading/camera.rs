//! Cameras at their limits: an orthonormal frame, or an error that says what is wrong.

use crate::suite::{Outcome, Size};
use tweenray::error::{Error, Result};
use tweenray::math::DVec3;
use tweenray::scene::{Camera, Pose};

/// What is wrong with a camera's frame, if anything.
fn fault(camera: &Camera) -> Option<String> {
    let (r, u, f) = (camera.half_right.normalize(), camera.half_up.normalize(), camera.forward);
    let finite = camera.half_right.is_finite() && camera.half_up.is_finite() && f.is_finite();
    let skew = [r.dot(u), u.dot(f), f.dot(r), f.length() - 1.0].map(f64::abs);
    let skew = skew.into_iter().fold(0.0, f64::max);
    let hand = r.cross(u).dot(-f);
    let (w, h) = (f64::from(camera.width), f64::from(camera.height));
    let corners = [(0.0, 0.0), (w, 0.0), (0.0, h), (w, h), (0.5 * w, 0.5 * h)];
    let rays = corners.map(|(x, y)| camera.direction(x, y));
    let good = rays.iter().all(|d| d.is_finite() && (d.length() - 1.0).abs() < 1e-12);
    let middle = (rays[4] - f).length();
    let ok = finite && skew < 1e-12 && (hand - 1.0).abs() < 1e-12 && good && middle < 1e-12;
    (!ok).then(|| format!("skew {skew:e}, hand {hand}, rays {rays:?}"))
}

fn judge(outcome: &mut Outcome, what: &str, made: Result<Camera>, wanted: bool) {
    match made {
        Ok(camera) => {
            let fault = if wanted { fault(&camera) } else { Some("accepted".into()) };
            outcome.check(fault.is_none(), || format!("{what}: {}", fault.unwrap()));
        }
        Err(Error::Usage(message)) => {
            outcome.check(!wanted && !message.is_empty(), || format!("{what}: {message}"));
        }
        Err(other) => outcome.check(false, || format!("{what}: an untyped error, {other}")),
    }
}

pub fn camera_degeneracies(_: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let pose = |eye: DVec3, target: DVec3, up: DVec3| Pose { eye, target, up, roll_degrees: 0.0 };
    let diagonals = [DVec3::new(1.0, 1.0, 0.0), DVec3::new(1.0, -1.0, 1.0)];
    let axes = [DVec3::X, DVec3::Y, DVec3::Z].into_iter().chain(diagonals);
    let axes: Vec<DVec3> = axes.flat_map(|a| [a.normalize(), -a.normalize()]).collect();
    // Up along the view, and off it by next to nothing, in every direction and size.
    for view in &axes {
        for along in [*view, -*view, *view * 1e-200, *view * 1e200, DVec3::ZERO] {
            for off in [0.0, 1e-300, 1e-17, 1e-12, 1e-10, 1e-9, 1e-6] {
                for side in &axes {
                    for eye in [DVec3::ZERO, DVec3::splat(1e6), DVec3::new(1e-9, -1e9, 3.0)] {
                        let up = along + *side * (off * along.abs().max_element());
                        let made = Camera::new(&pose(eye, eye + *view, up), 40.0, 64, 48);
                        judge(&mut outcome, &format!("view {view}, up {up}"), made, true);
                    }
                }
            }
        }
    }
    // Eye on the target, and next to it.
    for p in [DVec3::ZERO, DVec3::ONE, DVec3::splat(1e12)] {
        let made = Camera::new(&pose(p, p, DVec3::Y), 40.0, 64, 48);
        judge(&mut outcome, "eye on target", made, false);
    }
    let near = |x: f64| pose(DVec3::ZERO, DVec3::X * x, DVec3::Y);
    for (x, wanted) in [(1e-300, true), (5e-324, true), (1e300, true), (f64::INFINITY, false)] {
        judge(
            &mut outcome,
            &format!("target at {x:e}"),
            Camera::new(&near(x), 40.0, 64, 48),
            wanted,
        );
    }
    let ulp = pose(DVec3::ONE, DVec3::new(1.0 + f64::EPSILON, 1.0, 1.0), DVec3::Y);
    judge(&mut outcome, "target one ulp away", Camera::new(&ulp, 40.0, 64, 48), false);
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for made in [
            pose(DVec3::splat(bad), DVec3::Z, DVec3::Y),
            pose(DVec3::ZERO, DVec3::Z, DVec3::X * bad),
            Pose { roll_degrees: bad, ..near(1.0) },
        ] {
            judge(&mut outcome, "not finite", Camera::new(&made, 40.0, 64, 48), false);
        }
        judge(&mut outcome, "fov", Camera::new(&near(1.0), bad, 64, 48), false);
    }
    // Fields of view and shapes.
    for vfov in [1e-6, 1e-4, 1.0, 90.0, 179.0, 179.9, 179.999_999] {
        for (width, height) in [(1, 1), (1, 32_768), (32_768, 1), (3, 2)] {
            let made = Camera::new(&near(1.0), vfov, width, height);
            judge(&mut outcome, &format!("{vfov} degrees, {width}x{height}"), made, true);
        }
    }
    for vfov in [0.0, -1.0, 1e-7, 180.0, 360.0] {
        judge(&mut outcome, "fov", Camera::new(&near(1.0), vfov, 64, 48), false);
    }
    for (width, height) in [(0, 48), (64, 0)] {
        judge(&mut outcome, "no pixels", Camera::new(&near(1.0), 40.0, width, height), false);
    }
    // Neighbouring pixels stay apart at the narrowest view of the widest image.
    let camera = Camera::new(&near(1.0), 1e-4, 32_768, 32_768).unwrap();
    let step = (camera.direction(1.0, 0.5) - camera.direction(0.0, 0.5)).length();
    outcome.at_least("radians between neighbours at 1e-4 degrees and 32768 rows", step, 1e-12);
    outcome
}
