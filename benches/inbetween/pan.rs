//! Figures 3 and 4: whole pans, by effects.

use super::moves::{self, Set, Stage};
use super::{Choice, support};
use tweenray::scene::{Policy, Settings, Shot};

/// Frames of the pan.
const FRAMES: u32 = 128;
/// Frames that are traced to tell what all of them take.
const TRACED: [u32; 4] = [10, 48, 86, 124];
/// The paper's table 5: shadow samples, bounces, seconds of sixteen ranks.
const PAPER: [(u32, u32, f64); 5] =
    [(0, 0, 265.9), (10, 1, 279.8), (25, 2, 296.1), (50, 4, 321.4), (100, 8, 368.8)];

fn with(set: &Set, size: (u32, u32), samples: u32, bounces: u32, policy: Policy) -> Settings {
    let mut settings = set.settings(size, 1, samples);
    (settings.bounces, settings.reuse.policy) = (bounces, policy);
    settings
}

/// Mean seconds of a traced frame, from a few of `shot`.
fn traced(stage: &Stage, settings: &Settings, shot: &Shot) -> f64 {
    let frame = |k: &u32| (k * shot.frames).div_ceil(FRAMES);
    let maker = stage.maker(settings, shot, &[]);
    let seconds = TRACED.iter().map(|k| support::seconds(|| moves::make(&*maker, frame(k))));
    seconds.sum::<f64>() / TRACED.len() as f64
}

/// Surface against off at 100 shadow samples and 8 bounces.
pub fn speed(choice: &Choice) {
    let size = choice.size.unwrap_or((640, 360));
    let set = Set::load("spheres_on_terrain", |_| ());
    let stage = set.stage(choice.threads);
    let [surface, off] =
        [Policy::Surface, Policy::Off].map(|policy| with(&set, size, 100, 8, policy));
    println!(
        "spheres_on_terrain, {} x {}, 100 shadow samples, 8 bounces, audit as set;",
        size.0, size.1
    );
    println!("off: {} frames timed, before and after, times the frames of the pan", TRACED.len());
    println!("wanted: 20 times at 128 frames, 6 at 16");
    let mut rows = Vec::new();
    for frames in [16, FRAMES] {
        let shot = set.shot(frames);
        let before = traced(&stage, &off, &shot);
        let all: Vec<u32> = (1..=frames).collect();
        let maker = stage.maker(&surface, &shot, &all);
        let order = maker.batches(&all).concat();
        let ours = support::seconds(|| order.iter().for_each(|f| _ = moves::make(&*maker, *f)));
        let each = 0.5 * (before + traced(&stage, &off, &shot));
        rows.push(vec![
            frames.to_string(),
            format!("{ours:.2} s"),
            format!("{:.1} s", each * f64::from(frames)),
            format!("{:.2}", each * f64::from(frames) / ours),
        ]);
    }
    support::table(&["frames", "surface", "off", "times faster"], &rows);
}

/// What effects add to a pan, beside the paper's table 5. The five take turns, frame by frame.
pub fn effects(choice: &Choice) {
    let size = choice.size.unwrap_or((640, 360));
    let set = Set::load("spheres_on_terrain", |_| ());
    let stage = set.stage(choice.threads);
    let shot = set.shot(FRAMES);
    let all: Vec<u32> = (1..=FRAMES).collect();
    let settings =
        PAPER.map(|(samples, bounces, _)| with(&set, size, samples, bounces, Policy::Surface));
    let makers = settings.each_ref().map(|settings| stage.maker(settings, &shot, &all));
    let orders = makers.each_ref().map(|maker| maker.batches(&all).concat());
    let mut seconds = [0.0; PAPER.len()];
    for turn in 0..all.len() {
        for ((maker, order), seconds) in makers.iter().zip(&orders).zip(&mut seconds) {
            *seconds += support::seconds(|| moves::make(&**maker, order[turn]));
        }
    }
    let off = with(&set, size, 100, 8, Policy::Off);
    let each = traced(&stage, &off, &shot);
    println!("spheres_on_terrain, {FRAMES} frames of {} x {}, one camera sample", size.0, size.1);
    let rows: Vec<Vec<String>> = PAPER
        .iter()
        .zip(seconds)
        .map(|((samples, bounces, paper), ours)| {
            vec![
                format!("{samples}, {bounces}"),
                format!("{paper:.1}"),
                format!("{ours:.1}"),
                format!("{:.2}", (paper - PAPER[0].2) / (PAPER[0].2 / f64::from(FRAMES))),
                format!("{:.2}", (ours - seconds[0]) / each),
            ]
        })
        .collect();
    let head = [
        "samples, bounces",
        "paper, s",
        "ours, s",
        "added: paper's (0, 0) frames",
        "ours in traced (100, 8) frames",
    ];
    support::table(&head, &rows);
    println!("\na traced frame takes {each:.2} s; wanted: at most 6 of them added");
}
