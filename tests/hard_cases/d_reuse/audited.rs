//! Whether the audit tells the truth about moves of every kind.

use crate::common;
use crate::shots::{Set, Trial};
use crate::suite::{Outcome, Size};
use tweenray::math::DVec3;
use tweenray::measure::Interval;
use tweenray::scene::{CameraPath, Easing, KeyPose, Pose, Shot};

/// Share of intervals at 95 % that must hold the truth.
const HELD: f64 = 0.93;

/// Moves through the closed room, whose tall box is a mirror.
fn room() -> Vec<(&'static str, CameraPath)> {
    let p = DVec3::new;
    let (up, roll_degrees) = (DVec3::Y, 0.0);
    let pose = |eye: DVec3, target: DVec3| Pose { eye, target, up, roll_degrees };
    let key = |at: f64, eye, target| KeyPose { at, pose: pose(eye, target) };
    let (back, side) = (p(0.0, 1.0, -1.4), p(1.4, 0.6, 0.4));
    let (left, right) = (p(-0.9, 1.6, 2.4), p(0.9, 1.2, 2.4));
    let target = p(0.1, 0.6, 0.0);
    vec![
        (
            "orbit",
            CameraPath::Orbit {
                target,
                eye: p(0.0, 1.3, 2.3),
                axis: up,
                degrees: 20.0,
                roll_degrees,
            },
        ),
        (
            "dolly",
            CameraPath::Keys(vec![
                key(0.0, p(0.0, 1.3, 2.8), back),
                key(1.0, p(0.1, 1.2, 1.6), back),
            ]),
        ),
        (
            "cut",
            CameraPath::Keys(vec![
                key(0.0, left, back),
                key(0.49, left + p(0.05, 0.0, 0.0), back),
                key(0.51, right, side),
                key(1.0, right - p(0.05, 0.0, 0.0), side),
            ]),
        ),
        ("fast pan", CameraPath::Pan { from: left, to: right, target: back, up, roll_degrees }),
        (
            "box sweeps by",
            CameraPath::Pan {
                from: p(-0.9, 0.5, 1.9),
                to: p(0.9, 0.5, 1.9),
                target: p(0.3, 0.4, -0.6),
                up,
                roll_degrees,
            },
        ),
        (
            "highlight in the mirror",
            CameraPath::Pan {
                from: p(0.0, 0.9, 1.2),
                to: p(0.4, 1.0, 1.2),
                target: p(-0.6, 0.9, -0.6),
                up,
                roll_degrees,
            },
        ),
    ]
}

/// Ten shots of each move, or one: the audit's intervals hold the true error, and inferring is no
/// worse than tracing.
pub fn audited_reuse(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let trial = Trial {
        edge: size.of(80, 96),
        frames: size.of(5, 9),
        spp: 1,
        most_spp: None,
        share: size.of(0.05, 0.03),
        best: size.of(128, 256),
    };
    let set = Set::load("cornell");
    let stage = set.stage(common::threads());
    let (mut shots, mut held) = (0, [0; 2]);
    for (name, path) in room() {
        let shot = Shot { path, easing: Easing::Linear, ..stage.shot(&trial, 0) };
        let (mut inferred, mut traced) = (0.0, 0.0);
        for number in 0..size.of(1, 10) {
            let settings = stage.settings(&trial, number);
            let audited = stage.audited_shot(&settings, &shot, trial.best);
            let holds = |i: Interval, truth: f64| {
                u32::from((i.low..=i.high).contains(&truth.max(0.0).sqrt()))
            };
            shots += 1;
            held[0] += holds(audited.rmse.shown, audited.truth.shown);
            held[1] += holds(audited.rmse.traced, audited.truth.traced);
            (inferred, traced) = (inferred + audited.truth.shown, traced + audited.truth.traced);
        }
        let ratio = (inferred / traced).sqrt();
        // After the cut nearly all is traced, so equal but for chance.
        outcome.check(ratio <= 1.005, || format!("{name}: inferred {ratio:.3} times as far off"));
        outcome.show(format!("{name}: error over that of tracing {ratio:.3}"));
    }
    let share = |held: u32| f64::from(held) / f64::from(shots);
    // Of six intervals one may miss.
    let least = size.of(5.0 / 6.0, HELD);
    outcome.at_least("intervals that hold the frames' error", share(held[0]), least);
    outcome.at_least("intervals that hold tracing's error", share(held[1]), least);
    outcome
}
