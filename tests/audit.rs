//! Probes: as an audit their intervals hold the true error, and they show what tracing would.

#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs)]

#[path = "audit/shots.rs"]
mod shots;

use shots::{Set, Stage, Trial};
use std::sync::atomic::AtomicBool;
use tweenray::math::Rgb;
use tweenray::measure::Interval;
use tweenray::reuse::audit::{is_worse_than_traced, rmse};
use tweenray::scene::{Rect, ReuseSettings, Settings};
use tweenray::sequence::{FrameMaker, Made, Pyramid, SurfaceReuse};
use tweenray::stats::AuditSums;

const SHOTS: u32 = 120;
const SMALL: Trial = Trial { edge: 96, frames: 5, spp: 1, most_spp: None, share: 0.02, best: 128 };

/// Of 120 intervals at 95 % at least 112 hold the truth, 93 %.
#[test]
fn intervals_hold_the_true_error() {
    intervals_hold(&SMALL, SHOTS, 112);
}

/// So they do where pixels take different numbers of camera samples, probes fewer of them than others.
#[test]
fn intervals_hold_the_true_error_with_a_range_of_camera_samples() {
    intervals_hold(&Trial { spp: 2, most_spp: Some(8), ..SMALL }, 30, 27);
}

/// At least `least` intervals of so many shots hold the truth.
fn intervals_hold(trial: &Trial, shots: u32, least: u32) {
    let set = Set::load("cornell");
    let stage = set.stage(2);
    let (mut shown, mut inferred, mut traced, mut width, mut wronged) = (0, 0, 0, 0.0, 0);
    for number in 0..shots {
        let audited = stage.audited(trial, number);
        assert!(audited.sums.drawn >= 20, "too few to say anything");
        let holds =
            |i: Interval, truth: f64| u32::from(i.low <= truth.sqrt() && truth.sqrt() <= i.high);
        shown += holds(audited.rmse.shown, audited.truth.shown);
        inferred += holds(audited.rmse.inferred, audited.truth.inferred);
        traced += holds(audited.rmse.traced, audited.truth.traced);
        let is_worse = audited.truth.shown > audited.truth.traced;
        wronged += u32::from(is_worse_than_traced(&audited.sums, 0.0, 1) && !is_worse);
        width += (audited.rmse.shown.high - audited.rmse.shown.low) / audited.truth.shown.sqrt();
    }
    println!("{shown} {inferred} {traced} of {shots}");
    assert!(shown >= least && inferred >= least && traced >= least, "{shown} {inferred} {traced}");
    // Two intervals of 95 % that lie apart by chance are rare.
    assert!(wronged <= shots / 40, "{wronged} of {shots} are said to be worse than traced");
    // An interval that held everything would say nothing.
    assert!(width / f64::from(shots) < 3.0, "{width}");
}

/// With a light that is not kept any pixel may be off, but for those that nobody rendered.
#[test]
fn a_crop_is_audited_by_its_own_pixels() {
    let set = room_under_a_sky();
    let stage = set.stage(2);
    let trial = Trial { edge: 96, share: 0.1, ..SMALL };
    let crop = Rect { x0: 10, y0: 30, x1: 60, y1: 75 };
    let settings = Settings {
        shadow_samples: 1,
        sky_samples: 64,
        crop: Some(crop),
        ..stage.settings(&trial, 2)
    };
    let mut sums = AuditSums::default();
    for made in frames(&stage, &settings, &trial) {
        let (Some(audit), Some(map)) = (made.audit, made.film.audit) else { continue };
        assert_eq!(audit.pixels, 50 * 45);
        for (i, _) in map.iter().enumerate().filter(|(_, x)| !x.is_nan()) {
            let (x, y) = (i as u32 % 96, i as u32 / 96);
            assert!((10..60).contains(&x) && (30..75).contains(&y), "{x},{y}");
        }
        sums += audit;
    }
    // The lamp's one sample is traced in either case.
    let rmse = rmse(&sums).unwrap();
    let ratio = rmse.shown.estimate / rmse.traced.estimate;
    assert!((0.8..1.2).contains(&ratio), "{rmse:?}");
}

/// With more camera samples than are shaded together, and two lights whose sums could come in another order.
#[test]
fn probes_have_the_surface_points_of_the_frame() {
    let set = room_under_a_sky();
    let stage = set.stage(2);
    let trial = Trial { edge: 60, share: 0.03, spp: 16, ..SMALL };
    let settings = stage.settings(&trial, 2);
    let drawn = probes_as_traced(&stage, &settings, &trial, &frames(&stage, &settings, &trial));
    assert!(drawn > 100, "{drawn}");
}

fn room_under_a_sky() -> Set {
    let mut set = Set::load("cornell");
    set.scene.sky.radiance = Rgb::ONE;
    set.scene.sky.lights = true;
    set
}

/// How many probes the frames show, each as tracing would.
fn probes_as_traced(stage: &Stage, settings: &Settings, trial: &Trial, made: &[Made]) -> usize {
    let shot = stage.shot(trial, 0);
    let order = Pyramid { segment: 64, frames: shot.frames }.order(&[1, 2, 3, 4, 5]);
    let mut drawn = 0;
    for (frame, made) in order.into_iter().zip(made) {
        let Some(map) = &made.film.audit else { continue };
        let camera = shot.camera(frame, trial.edge, trial.edge).unwrap();
        let traced = stage.render(settings, &camera, frame);
        let probes: Vec<usize> = (0..map.len()).filter(|i| !map[*i].is_nan()).collect();
        assert!(probes.iter().all(|i| made.film.rgb[*i] == traced.rgb[*i]), "frame {frame}");
        assert_eq!(probes.len() as u64, made.audit.unwrap().drawn);
        drawn += probes.len();
    }
    drawn
}

fn frames(stage: &Stage, settings: &Settings, trial: &Trial) -> Vec<Made> {
    let shot = stage.shot(trial, 0);
    let stop = AtomicBool::new(false);
    let pyramid = Pyramid { segment: 64, frames: shot.frames };
    let all: Vec<u32> = (1..=pyramid.frames).collect();
    let maker = SurfaceReuse::new(stage.context(settings, &shot, &stop), pyramid).unwrap();
    maker.expect(&all);
    pyramid.order(&all).into_iter().map(|f| maker.make(f).unwrap()).collect()
}

#[test]
fn probes_show_their_trace_and_their_findings_decide_what_is_inferred() {
    let set = Set::load("cornell");
    let stage = set.stage(2);
    let trial = Trial { edge: 96, share: 0.03, ..SMALL };
    let settings = stage.settings(&trial, 2);
    let made = frames(&stage, &settings, &trial);
    let drawn = probes_as_traced(&stage, &settings, &trial, &made);
    assert!(drawn > 500, "{drawn}");
    assert_eq!(made.iter().filter(|m| m.audit.is_some()).count(), 3, "key frames have none");
    let inferred = |settings: &Settings| -> u64 {
        frames(&stage, settings, &trial).iter().map(|m| m.reuse.direct_inferred).sum()
    };
    // Without probes nothing is vouched for, and with a tolerance that excuses all everything known is.
    let with = |tolerance: f32, probes: f32| {
        let reuse = ReuseSettings { tolerance, probes, ..settings.reuse };
        inferred(&Settings { reuse, ..settings.clone() })
    };
    let usual: u64 = made.iter().map(|m| m.reuse.direct_inferred).sum();
    assert_eq!(with(0.25, 0.0), 0);
    assert!(with(255.0, 0.03) > usual && usual > 0, "{usual}");
}

/// What is more than tracing's own error is at most the tolerance, and not always nothing.
#[test]
fn a_tolerance_bounds_the_error_that_it_allows() {
    let set = Set::load("spheres_on_terrain");
    let stage = set.stage(2);
    let trial = Trial { share: 0.05, ..SMALL };
    let excess = [0.25, 1.0, 4.0].map(|tolerance| {
        let usual = stage.settings(&trial, 1);
        let reuse = ReuseSettings { tolerance, ..usual.reuse };
        let settings = Settings { reuse, ..usual };
        let truth = stage.audited_shot(&settings, &stage.shot(&trial, 1), trial.best).truth;
        let excess = (truth.shown - truth.traced).max(0.0).sqrt();
        println!("{tolerance}: {excess:.3}, {} pixels inferred", truth.inferred_pixels);
        assert!(excess <= f64::from(tolerance), "{tolerance}: {excess}");
        (excess, truth.inferred_pixels)
    });
    assert!(excess[0].1 < excess[1].1 && excess[1].1 < excess[2].1, "{excess:?}");
    assert!(excess[2].0 > excess[0].0, "{excess:?}");
}
