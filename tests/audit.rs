//! The audit of inferred frames: its intervals hold the true error, it changes no byte of a frame,
//! and a bound on the error has tiles traced.

#![allow(clippy::unwrap_used, missing_docs)]

#[path = "audit/shots.rs"]
mod shots;

use shots::{Quiet, Set, Stage, Trial};
use std::sync::atomic::AtomicBool;
use tweenray::film::Provenance;
use tweenray::math::Rgb;
use tweenray::measure::Interval;
use tweenray::output::Display;
use tweenray::reuse::audit::rmse;
use tweenray::scene::{Rect, Settings};
use tweenray::sequence::{FrameMaker, Inferrer, Made, Pyramid};
use tweenray::stats::AuditSums;

const SHOTS: u32 = 60;
const SMALL: Trial = Trial { edge: 40, frames: 5, spp: 1, share: 0.1, best: 128 };

/// Of 60 intervals at 95 % at least 56 hold the truth, 93 %.
#[test]
fn intervals_hold_the_true_error() {
    let set = Set::load("cornell");
    let stage = set.stage(2);
    let (mut shown, mut inferred, mut traced, mut width) = (0, 0, 0, 0.0);
    for number in 0..SHOTS {
        let audited = stage.audited(&SMALL, number);
        assert!(audited.sums.drawn >= 20, "too few to say anything");
        let holds =
            |i: Interval, truth: f64| u32::from(i.low <= truth.sqrt() && truth.sqrt() <= i.high);
        shown += holds(audited.rmse.shown, audited.truth.shown);
        inferred += holds(audited.rmse.inferred, audited.truth.inferred);
        traced += holds(audited.rmse.traced, audited.truth.traced);
        width += (audited.rmse.shown.high - audited.rmse.shown.low) / audited.truth.shown.sqrt();
    }
    let least = 56;
    assert!(shown >= least && inferred >= least && traced >= least, "{shown} {inferred} {traced}");
    // An interval that held everything would say nothing.
    assert!(width / f64::from(SHOTS) < 3.0, "{width}");
}

/// With a light that is not kept any pixel may be off, but for those that nobody rendered.
#[test]
fn a_crop_is_audited_by_its_own_pixels() {
    let mut set = Set::load("cornell");
    set.scene.sky.radiance = Rgb::ONE;
    set.scene.sky.lights = true;
    let stage = set.stage(2);
    let trial = Trial { edge: 96, share: 0.1, ..SMALL };
    let crop = Rect { x0: 10, y0: 30, x1: 60, y1: 75 };
    let settings = Settings {
        shadow_samples: 1,
        sky_samples: 16,
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

fn frames(stage: &Stage, settings: &Settings, trial: &Trial) -> Vec<Made> {
    let shot = stage.shot(trial, 0);
    let stop = AtomicBool::new(false);
    let pyramid = Pyramid { segment: 64, frames: shot.frames };
    let all: Vec<u32> = pyramid.all().collect();
    let maker = Inferrer::new(stage.renderer(settings), &shot, &stage.pool, &stop, &Quiet, pyramid)
        .unwrap();
    maker.expect(&all);
    pyramid.order(&all).into_iter().map(|f| maker.make(f).unwrap().unwrap()).collect()
}

#[test]
fn an_audit_changes_no_frame_and_costs_its_share() {
    let set = Set::load("cornell");
    let stage = set.stage(2);
    let trial = Trial { edge: 96, share: 0.03, ..SMALL };
    let on = stage.settings(&trial, 2);
    let mut off = on.clone();
    off.reuse.audit = 0.0;
    let (with, without) = (frames(&stage, &on, &trial), frames(&stage, &off, &trial));
    let (mut rays, mut audit) = (0, 0);
    for (a, b) in with.iter().zip(&without) {
        assert_eq!(a.film.rgb, b.film.rgb);
        assert_eq!(a.film.sources, b.film.sources);
        assert_eq!(a.rays, b.rays);
        assert!(b.audit.is_none() && b.film.audit.is_none());
        let Some(sums) = a.audit else { continue };
        let map = a.film.audit.as_ref().unwrap();
        let seen = map.iter().filter(|x| !x.is_nan()).count() as u64;
        assert_eq!(seen, sums.drawn);
        // Shadow rays are most of either cost; the frame's lookups are left out here.
        rays += a.rays.total() + (1.5 * a.reuse.direct as f64) as u64;
        audit += sums.rays.total();
    }
    let share = audit as f64 / rays as f64;
    assert!((0.02..0.04).contains(&share), "{share}");
    assert_eq!(with.iter().filter(|m| m.audit.is_some()).count(), 3, "key frames need none");
}

#[test]
fn a_bound_has_bad_tiles_traced_and_is_repeatable() {
    let set = Set::load("cornell");
    let stage = set.stage(2);
    let trial = Trial { edge: 96, ..SMALL };
    // Much is inferred that tracing knows better.
    let mut plain = Settings { shadow_samples: 64, ..stage.settings(&trial, 2) };
    plain.reuse.tolerance = Some(20.0);
    let tiles = |most: f32| {
        let mut settings = plain.clone();
        settings.reuse.max_rmse = Some(most);
        let made = frames(&stage, &settings, &trial);
        let count: u64 = made.iter().filter_map(|m| Some(m.audit?.tiles_traced)).sum();
        (count, made)
    };
    let unbound = frames(&stage, &plain, &trial);
    let (none, same) = tiles(200.0);
    assert_eq!(none, 0);
    assert!(same.iter().zip(&unbound).all(|(a, b)| a.film.rgb == b.film.rgb));
    let (some, bound) = tiles(0.5);
    let (again, repeated) = tiles(0.5);
    assert_eq!(some, again);
    assert!((1..20).contains(&some), "{some} of 27 tiles");
    for ((bound, repeated), unbound) in bound.iter().zip(&repeated).zip(&unbound) {
        assert_eq!(bound.film.rgb, repeated.film.rgb);
        let sources = |m: &Made| m.film.sources.clone().unwrap();
        for (i, (now, before)) in sources(bound).iter().zip(sources(unbound)).enumerate() {
            if now.provenance == before.provenance {
                assert_eq!(bound.film.rgb[i], unbound.film.rgb[i]);
            } else {
                assert_eq!(now.provenance, Provenance::Traced);
            }
        }
    }
    assert!(tiles(0.0).0 > some);
}

/// With four shadow samples tracing is mostly worse than inferring, however low the bound.
#[test]
fn a_bound_makes_no_frame_worse_and_counts_what_it_traces() {
    let set = Set::load("cornell");
    let stage = set.stage(2);
    let trial = Trial { edge: 96, ..SMALL };
    let plain = stage.settings(&trial, 0);
    let mut strict = plain.clone();
    strict.reuse.max_rmse = Some(0.0);
    let best = Settings { shadow_samples: 256, ..plain.clone() };
    let shot = stage.shot(&trial, 0);
    let order = Pyramid { segment: 64, frames: shot.frames }.order(&[1, 2, 3, 4, 5]);
    let made = frames(&stage, &plain, &trial).into_iter().zip(frames(&stage, &strict, &trial));
    let (mut before, mut after, mut replaced) = (0.0, 0.0, 0);
    for (frame, (plain_made, strict_made)) in order.into_iter().zip(made) {
        let camera = shot.camera(frame, 96, 96).unwrap();
        let traced = stage.render(&plain, &camera, frame);
        let truth = stage.render(&best, &camera, frame | 5 << 27);
        let display = Display { exposure: plain.exposure, tone: plain.tone };
        let error = |rgb: Rgb, i: usize| {
            let (a, b) = (display.code(rgb), display.code(truth.rgb[i]));
            (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>()
        };
        let mut here = 0;
        let sources = |m: &Made| m.film.sources.clone().unwrap();
        for (i, (a, b)) in sources(&plain_made).iter().zip(sources(&strict_made)).enumerate() {
            before += error(plain_made.film.rgb[i], i);
            after += error(strict_made.film.rgb[i], i);
            if a.provenance != b.provenance {
                assert_eq!(strict_made.film.rgb[i], traced.rgb[i], "the traced frame's own");
                here += 1;
            }
        }
        let (a, b) = (plain_made.reuse, strict_made.reuse);
        assert_eq!((a.direct, a.specular), (b.direct, b.specular));
        let direct = a.direct_inferred - b.direct_inferred;
        let specular = a.specular_inferred - b.specular_inferred;
        // One camera sample sees one point directly, and none or more in the mirror.
        assert!(direct <= here && direct + specular >= here, "{direct}, {specular} of {here}");
        replaced += here;
    }
    assert!(replaced > 0 && after < 1.05 * before, "{replaced} pixels: {after}, {before} before");
}
