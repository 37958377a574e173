//! How far inferred frames are off: PSNR, policies side by side, flicker, sharpness.

use super::moves::{self, SCENES, Set, Stage, psnr_of};
use super::{Choice, per_cent, sharpness, support};
use tweenray::film::Film;
use tweenray::scene::{Policy, ReuseSettings, Settings, Shot};
use tweenray::stats::ReuseCounts;

/// Frames of the moves that are judged.
const FRAMES: u32 = 33;
/// Samples of the frames that are taken for the truth.
const BEST: u32 = 1024;
/// Frames that are judged unless all are: beside a key frame, in the middle, in the last quarter.
const SOME: [u32; 3] = [2, 16, 27];

fn judged(choice: &Choice) -> Vec<u32> {
    if choice.all { (2..FRAMES).collect() } else { SOME.to_vec() }
}

/// `settings` with a policy, and without an audit: that changes no pixel.
fn with(settings: &Settings, policy: Policy) -> Settings {
    let reuse = ReuseSettings { policy, ..settings.reuse };
    Settings { reuse, ..settings.clone() }
}

/// Figure 1: every inferred frame against the same frame traced, with the shares inferred.
pub fn quality(choice: &Choice) {
    let size = choice.size((320, 180));
    println!(
        "{FRAMES} frames of {} x {}, {} camera samples a pixel; PSNR against {BEST} samples, dB",
        size.0, size.1, choice.spp
    );
    println!("wanted: no frame below traced, 96 % of direct and 90 % of other points inferred");
    for scene in SCENES.into_iter().filter(|scene| choice.takes(scene)) {
        report(choice, scene, &Set::load(scene, |_| ()), size);
        if scene == "spheres_on_terrain" {
            let near = Set::load(scene, |world| moves::lower(world, 2.5));
            report(choice, "the same, light 2.5 units up", &near, size);
        }
    }
}

fn report(choice: &Choice, name: &str, set: &Set, size: (u32, u32)) {
    let stage = set.stage(choice.threads);
    let shot = set.shot(FRAMES);
    let frames = judged(choice);
    let truth = |f: &u32| stage.converged(&set.settings(size, choice.spp, 1), &shot, *f, BEST);
    let truths: Vec<Film> = frames.iter().map(truth).collect();
    let mut rows = Vec::new();
    for samples in [16, 100] {
        let settings = with(&set.settings(size, choice.spp, samples), Policy::Surface);
        let made = stage.frames(&settings, &shot, &(1..=FRAMES).collect::<Vec<_>>());
        let counts = sum(made[1..FRAMES as usize - 1].iter().map(|m| m.reuse));
        for (frame, truth) in frames.iter().zip(&truths) {
            let traced = stage.traced(&settings, &shot, *frame, *frame);
            let ours = psnr_of(&settings, &made[*frame as usize - 1].film, truth);
            let theirs = psnr_of(&settings, &traced, truth);
            rows.push(vec![
                format!("{name}, {samples} samples"),
                frame.to_string(),
                format!("{ours:.2}"),
                format!("{theirs:.2}"),
                format!("{:+.2}", ours - theirs),
                per_cent(counts.direct_inferred, counts.direct),
                per_cent(counts.specular_inferred, counts.specular),
            ]);
        }
    }
    let head = ["", "frame", "inferred", "traced", "more", "direct, all frames", "specular"];
    support::table(&head, &rows);
}

fn sum(counts: impl Iterator<Item = ReuseCounts>) -> ReuseCounts {
    counts.fold(ReuseCounts::default(), |mut sum, counts| {
        sum += counts;
        sum
    })
}

/// The three policies: time, PSNR, share traced.
pub fn policies(choice: &Choice) {
    let size = choice.size((320, 180));
    let set = Set::load("spheres_on_terrain", |_| ());
    let stage = set.stage(choice.threads);
    let shot = set.shot(FRAMES);
    let settings = set.settings(size, 1, 16);
    let all = [Policy::Off, Policy::Surface, Policy::Colour].map(|p| with(&settings, p));
    let runs = side_by_side(&stage, &shot, &all);
    let frames = judged(choice);
    let truth = |f: &u32| stage.converged(&settings, &shot, *f, BEST);
    let truths: Vec<Film> = frames.iter().map(truth).collect();
    let pixels = u64::from(size.0 * size.1) * u64::from(FRAMES - 2);
    let row = |(name, (seconds, made)): (&str, &(f64, Vec<moves::Numbered>))| {
        let film = |f: &u32| &made.iter().find(|(n, _)| n == f).expect("made").1.film;
        let psnrs = frames.iter().zip(&truths).map(|(f, t)| psnr_of(&settings, film(f), t));
        let psnrs: Vec<f64> = psnrs.collect();
        let between = made.iter().filter(|(n, _)| *n > 1 && *n < FRAMES);
        let counts = sum(between.map(|(_, m)| m.reuse));
        let points = counts.direct + counts.specular;
        let known = counts.direct_inferred + counts.specular_inferred;
        let traced = match name {
            "off" => per_cent(pixels, pixels),
            _ => per_cent(points - known, points),
        };
        vec![
            name.into(),
            format!("{:.3}", seconds / runs[0].0),
            format!("{:.2}", psnrs.iter().sum::<f64>() / psnrs.len() as f64),
            format!("{:.2}", psnrs.iter().copied().fold(f64::INFINITY, f64::min)),
            traced,
        ]
    };
    let rows = ["off", "surface", "colour"].into_iter().zip(&runs).map(row);
    println!(
        "spheres_on_terrain, {FRAMES} frames of {} x {}, 16 samples; time with key frames over off's,",
        size.0, size.1
    );
    println!(
        "PSNR of {} in-between frames, share of in-between points (colour: pixels) traced",
        frames.len()
    );
    support::table(&["policy", "time", "PSNR", "worst", "traced"], &rows.collect::<Vec<_>>());
}

/// All frames by each of `settings`, which take turns, with their seconds.
fn side_by_side(
    stage: &Stage,
    shot: &Shot,
    settings: &[Settings],
) -> Vec<(f64, Vec<moves::Numbered>)> {
    let frames: Vec<u32> = (1..=shot.frames).collect();
    let makers: Vec<_> = settings.iter().map(|s| stage.maker(s, shot, &frames)).collect();
    let orders: Vec<Vec<u32>> = makers.iter().map(|m| m.batches(&frames).concat()).collect();
    let mut runs: Vec<(f64, Vec<moves::Numbered>)> =
        makers.iter().map(|_| (0.0, Vec::new())).collect();
    for k in 0..frames.len() {
        for ((maker, order), run) in makers.iter().zip(&orders).zip(&mut runs) {
            let (made, seconds) = support::timed(|| moves::make(&**maker, order[k]));
            run.0 += seconds;
            run.1.push((order[k], made));
        }
    }
    runs
}

/// Figure 5: the error of the change from frame to frame.
pub fn flicker(choice: &Choice) {
    const SEGMENT: u32 = 8;
    let size = choice.size((160, 90));
    let frames: Vec<u32> = (1..=2 * SEGMENT + 1).collect();
    println!(
        "frames 1 to {} of 128 with a key frame every {SEGMENT}, {} x {}, 16 samples; RMSE of the change,",
        frames.len(),
        size.0,
        size.1
    );
    println!("display steps of 255; wanted: surface over off at most 1, the worst pair included");
    let mut rows = Vec::new();
    for scene in SCENES.into_iter().filter(|scene| choice.takes(scene)) {
        let set = Set::load(scene, |_| ());
        let stage = set.stage(choice.threads);
        let shot = set.shot(128);
        let mut settings = with(&set.settings(size, 1, 16), Policy::Surface);
        settings.reuse.segment = SEGMENT;
        let truth = |f: &u32| stage.converged(&settings, &shot, *f, BEST);
        let truths: Vec<Film> = frames.iter().map(truth).collect();
        let changes = [Policy::Surface, Policy::Off].map(|policy| {
            let made = stage.frames(&with(&settings, policy), &shot, &frames);
            let films: Vec<&Film> = made.iter().map(|made| &made.film).collect();
            moves::flicker(&settings, &films, &truths.iter().collect::<Vec<_>>())
        });
        let pooled = |c: &[f64]| (c.iter().sum::<f64>() / c.len() as f64).sqrt();
        let [ours, theirs] = [&changes[0], &changes[1]].map(|c| pooled(c));
        let ratios = changes[0].iter().zip(&changes[1]).map(|(a, b)| (a / b).sqrt());
        rows.push(vec![
            scene.into(),
            format!("{:.3}", 255.0 * ours),
            format!("{:.3}", 255.0 * theirs),
            format!("{:.3}", ours / theirs),
            format!("{:.3}", ratios.fold(0.0, f64::max)),
        ]);
    }
    support::table(&["scene", "surface", "off", "ratio", "worst pair"], &rows);
}

/// Figure 6: a slanted shadow edge through a slow pan of a hundred frames.
pub fn sharp(choice: &Choice) {
    const SLOW: u32 = 100;
    /// An edge is fitted to hundreds of pixels, so that fewer samples tell it as well.
    const ENOUGH: u32 = 128;
    let size = choice.size((320, 240));
    println!(
        "{SLOW} frames of {} x {}, 4 camera samples, one key frame at each end;",
        size.0, size.1
    );
    println!("MTF50 over that of the converged frame; wanted: 0.98 to 1.02");
    let mut rows = Vec::new();
    for pixels in [2.0, 20.0, 60.0] {
        let set = sharpness::shadow_edge(SLOW, pixels);
        let stage = set.stage(choice.threads);
        let mut settings = with(&set.settings(size, 4, 16), Policy::Surface);
        settings.reuse.segment = SLOW;
        let made = stage.frames(&settings, &set.shot, &(1..=SLOW).collect::<Vec<_>>());
        let (mut ratios, mut control) = (Vec::new(), Vec::new());
        for frame in (2..SLOW).step_by(if choice.all { 1 } else { 7 }) {
            let truth = stage.converged(&settings, &set.shot, frame, ENOUGH);
            let edge = sharpness::edge_of(&truth);
            let sharpest = sharpness::mtf50(&truth, edge);
            let traced = stage.traced(&settings, &set.shot, frame, frame);
            let film = &made[frame as usize - 1].film;
            ratios.push(sharpness::mtf50(film, edge) / sharpest);
            control.push(sharpness::mtf50(&traced, edge) / sharpest);
        }
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
        let furthest = |v: &[f64]| v.iter().map(|r| (r - 1.0).abs()).fold(0.0, f64::max);
        rows.push(vec![
            format!("{:.2} pixels a frame", pixels / f64::from(SLOW) * f64::from(size.1) / 120.0),
            format!("{:.4}", mean(&ratios)),
            format!("{:.4}", furthest(&ratios)),
            format!("{:.4}", mean(&control)),
            format!("{:.4}", furthest(&control)),
        ]);
    }
    support::table(
        &["pan", "inferred, mean", "furthest from 1", "traced, mean", "furthest"],
        &rows,
    );
}
