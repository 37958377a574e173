//! What adaptive camera samples save: rays beside as good uniform samples, on every scene of `scenes/` and in hard cases.
//!
//! Words pick sections: `cargo bench --bench adaptive -- rays hard`. `--size WxH`, `--scene NAME` and `--runs N` (3), of
//! other random numbers each, change what is run. The figures do not depend on the machine's load.
#![allow(clippy::print_stdout, reason = "a bench prints its figures")]

#[path = "../tests/common/adaptive_samples.rs"]
mod adaptive_samples;
#[path = "../tests/common/hard_samples.rs"]
mod hard_samples;
#[path = "../tests/common/moves.rs"]
mod moves;
mod support;

use adaptive_samples::{references, uniform};
use moves::{Set, Stage, codes, mean_square, psnr_of};
use support::sections::{self, Choice, Section};
use tweenray::film::Film;
use tweenray::scene::{Settings, Shot};

const SECTIONS: [Section; 4] =
    [("rays", rays), ("fewest", fewest), ("references", adaptive_references), ("hard", hard)];

/// The scenes of `scenes/`.
const SCENES: [&str; 9] = [
    "cornell",
    "reflective_spheres",
    "demo",
    "spheres_on_terrain",
    "courtyard",
    "street_at_night",
    "foggy_hall",
    "gallery",
    "materials",
];
/// The frame that is judged, of a move of so many.
const FRAME: u32 = 8;
const FRAMES: u32 = 16;

fn main() {
    sections::run("adaptive", &SECTIONS);
}

/// A frame of a scene, beside its truth.
struct Judged<'s> {
    stage: Stage<'s>,
    shot: Shot,
    base: Settings,
    truth: Film,
}

impl<'s> Judged<'s> {
    /// The scene at this size with its own light samples, and a truth of so many camera samples.
    fn new(set: &'s Set, choice: &Choice, samples: u32) -> Self {
        let (width, height) = choice.size((320, 180));
        let base = Settings { width, height, ..set.settings.clone() };
        let (stage, shot) = (set.stage(choice.threads), set.shot(FRAMES));
        let truth = stage.traced(&uniform(&base, samples, 77), &shot, FRAME, FRAME);
        Self { stage, shot, base, truth }
    }

    fn traced(&self, settings: &Settings) -> Film {
        self.stage.traced(settings, &self.shot, FRAME, FRAME)
    }

    /// The PSNR with so many camera samples in every pixel.
    fn uniform(&self, spp: u32, seed: u64) -> f64 {
        self.psnr(&self.traced(&uniform(&self.base, spp, seed)))
    }

    fn psnr(&self, film: &Film) -> f64 {
        psnr_of(&self.base, film, &self.truth)
    }

    /// Mean samples of the range from `least` on that is as accurate as `goal`, dB: between two ranges the logarithm of the
    /// number is interpolated. `None` where even 8 times `count` as the most is less accurate.
    fn as_good(&self, least: u32, count: u32, goal: f64, seed: u64) -> Option<f64> {
        let mut below: Option<[f64; 2]> = None;
        for most in [count, 2 * count, 4 * count, 8 * count] {
            let settings = Settings { spp: least, most_spp: Some(most), seed, ..self.base.clone() };
            let film = self.traced(&settings);
            let (psnr, samples) = (self.psnr(&film), film.mean_samples()?);
            if psnr >= goal {
                let Some([low, few]) = below else { return Some(samples) };
                return Some(few * (samples / few).powf((goal - low) / (psnr - low)));
            }
            below = Some([psnr, samples]);
        }
        None
    }
}

/// Camera rays for the accuracy of uniform samples.
fn rays(choice: &Choice) {
    const TRUTH: u32 = 512;
    /// Uniform samples, and the least numbers of ranges that are tried.
    const GOALS: [(u32, [u32; 2]); 2] = [(16, [2, 4]), (64, [4, 8])];
    println!(
        "camera rays of a range as accurate as uniform samples, per cent of theirs: median (least to most)"
    );
    println!("of {} runs; wanted: 40 beside 16 samples, 20 beside 64", choice.runs);
    let mut rows = Vec::new();
    for scene in SCENES.into_iter().filter(|scene| choice.takes(scene)) {
        let set = Set::load(scene, |_| ());
        let judged = Judged::new(&set, choice, TRUTH);
        let mut row = vec![scene.to_string()];
        for (count, least) in GOALS {
            let goals: Vec<f64> =
                (0..choice.runs).map(|seed| judged.uniform(count, seed)).collect();
            row.push(format!("{:.1} dB", support::quantile(&goals, 0.5)));
            for least in least {
                let share = |(seed, goal): (u64, &f64)| {
                    let samples = judged.as_good(least, count, *goal, seed);
                    samples.map_or(f64::INFINITY, |n| 100.0 * n / f64::from(count))
                };
                row.push(spread(&(0..).zip(&goals).map(share).collect::<Vec<_>>(), 0));
            }
        }
        println!("{}", row.join("  "));
        rows.push(row);
    }
    support::table(&["scene", "16", "2..", "4..", "64", "4..", "8.."], &rows);
}

/// Median, least and most of `values`.
fn spread(values: &[f64], digits: usize) -> String {
    support::quantiles(values, [0.0, 0.5, 1.0], digits)
}

/// Camera rays of a choice that knows how much every pixel's samples differ.
///
/// Some runs tell the error level of each pixel, others what a choice by these levels takes for the error of uniform
/// samples. On the runs that it knows any choice would seem to take fewer, since it would follow their chance too.
fn fewest(choice: &Choice) {
    const COUNTS: [u32; 8] = [2, 4, 8, 16, 32, 64, 128, 256];
    const TRUTH: u32 = 2048;
    /// Numbers of samples that tell levels, each with so many samples in all runs.
    const KNOWN: [u32; 3] = [4, 16, 64];
    const OF_EACH: u32 = 512;
    /// Runs that a choice is measured on.
    const RUNS: u64 = 4;
    /// Powers by which errors may fall with the number of samples: 1 for independent ones; more for strata, as at
    /// edges.
    const POWERS: [f64; 3] = [1.0, 1.25, 1.5];
    println!(
        "camera rays of a choice that knows how much every pixel's samples differ, per cent of"
    );
    println!("those of uniform samples");
    let mut rows = Vec::new();
    for scene in SCENES.into_iter().filter(|scene| choice.takes(scene)) {
        let set = Set::load(scene, |_| ());
        let judged = Judged::new(&set, choice, TRUTH);
        let truth = codes(&judged.base, &judged.truth);
        // Mean squared error of each pixel.
        let errors = |spp: u32, seeds: std::ops::Range<u64>| {
            let runs = seeds.end - seeds.start;
            let mut sums = vec![0.0; truth.len()];
            for seed in seeds {
                let shown = codes(&judged.base, &judged.traced(&uniform(&judged.base, spp, seed)));
                for (sum, pair) in sums.iter_mut().zip(shown.iter().zip(&truth)) {
                    *sum += mean_square(&[*pair.0], &[*pair.1]) / runs as f64;
                }
            }
            sums
        };
        let known = KNOWN.map(|spp| errors(spp, 1001..1001 + u64::from(OF_EACH / spp)));
        let measured = COUNTS.map(|spp| errors(spp, 1..1 + RUNS));
        let mut row = vec![scene.to_string()];
        for (target, least) in [(16, 2), (16, 4), (64, 4), (64, 8)] {
            let share = |power: f64| {
                // The error of a single sample that each number of samples suggests; their mean.
                let level = |i: usize| {
                    let of = |(n, errors): (&u32, &Vec<f64>)| errors[i] * f64::from(*n).powf(power);
                    KNOWN.iter().zip(&known).map(of).sum::<f64>() / KNOWN.len() as f64
                };
                let levels: Vec<f64> = (0..truth.len()).map(level).collect();
                fewest_share(&COUNTS, (&levels, power), &measured, (target, least))
            };
            let least = POWERS.into_iter().map(share).fold(f64::INFINITY, f64::min);
            row.push(format!("{:.0}", 100.0 * least));
        }
        println!("{}", row.join("  "));
        rows.push(row);
    }
    support::table(&["scene", "16: 2 at least", "4", "64: 4 at least", "8"], &rows);
}

/// The share of the rays of `target` samples in every pixel that a choice of at least `least` takes for the same error,
/// where it takes the error of a pixel for its level times the number of samples to the power of minus `power`.
fn fewest_share(
    counts: &[u32],
    (levels, power): (&[f64], f64),
    measured: &[Vec<f64>],
    (target, least): (u32, u32),
) -> f64 {
    let mean =
        |of: &dyn Fn(usize) -> f64| (0..levels.len()).map(of).sum::<f64>() / levels.len() as f64;
    let at = counts.iter().position(|count| *count == target).expect("a count");
    let goal = mean(&|i| measured[at][i]);
    let allowed: Vec<usize> = (0..counts.len()).filter(|k| counts[*k] >= least).collect();
    // The best choice for a price of a sample (Everett, 1963).
    let choose = |price: f64, i: usize| {
        let cost = |k: &usize| {
            let count = f64::from(counts[*k]);
            levels[i] * count.powf(-power) + price * count
        };
        *allowed.iter().min_by(|a, b| cost(a).total_cmp(&cost(b))).expect("a count")
    };
    let (mut low, mut high) = (1e-14f64, 1e6f64);
    for _ in 0..80 {
        let price = (low * high).sqrt();
        let error = mean(&|i| measured[choose(price, i)][i]);
        *(if error > goal { &mut high } else { &mut low }) = price;
    }
    mean(&|i| f64::from(counts[choose(low, i)])) / f64::from(target)
}

/// How accurate the references of `tweenray accuracy` are.
fn adaptive_references(choice: &Choice) {
    let size = choice.size((160, 90));
    println!("PSNR of a reference of MOST / 8..MOST samples, and of MOST / 2 in every pixel");
    let mut rows = Vec::new();
    for scene in SCENES[..5].iter().filter(|scene| choice.takes(scene)) {
        for most in [128, 256, 512] {
            let ([adaptive, uniform], mean) = references(scene, size, most);
            rows.push(vec![
                scene.to_string(),
                format!("{}..{most}", most / 8),
                format!("{mean:.1}"),
                format!("{adaptive:.1} dB"),
                format!("{}: {uniform:.1} dB", most / 2),
            ]);
        }
    }
    support::table(&["scene", "range", "samples", "PSNR", "uniform"], &rows);
}

/// Pixels whose first samples see what matters only by chance.
fn hard(choice: &Choice) {
    const RANGES: [(u32, u32); 5] = [(2, 8), (2, 32), (4, 16), (4, 32), (4, 64)];
    let size = choice.size((192, 108));
    println!(
        "dB by which a range is nearer to the truth than uniform samples of as many rays: median (least to"
    );
    println!("most) of {} runs of two seeds and two frames; wanted: none below 0", choice.runs);
    let mut rows = Vec::new();
    for case in &hard_samples::CASES {
        let run =
            |run: u64| hard_samples::gains(case, size, &[3, 12], &(2 * run..2 * run + 2), &RANGES);
        let runs: Vec<Vec<f64>> = (0..choice.runs).map(run).collect();
        let column = |k: usize| runs.iter().map(|gains| gains[k]).collect::<Vec<_>>();
        let gains = (0..RANGES.len()).map(|k| spread(&column(k), 2));
        rows.push(std::iter::once(case.name.to_string()).chain(gains).collect());
    }
    let ranges = RANGES.map(|(least, most)| format!("{least}..{most}"));
    let head: Vec<&str> =
        std::iter::once("case").chain(ranges.iter().map(String::as_str)).collect();
    support::table(&head, &rows);
}
