//! How often the audit's intervals hold the true error, over 60 shots of each scene at the default
//! share, and how wide they are: the full size of `tests/audit.rs`.
//!
//! `SCENE`, `SHOTS`, `EDGE`, `FRAMES`, `SPP`, `MOST` (most camera samples of a pixel), `SHARE`, `BEST` and `THREADS` change what
//! is run.
#![allow(clippy::print_stdout, reason = "a bench prints its figures")]

#[allow(dead_code, missing_docs, reason = "the tests use all of it")]
#[path = "../tests/audit/shots.rs"]
mod shots;
mod support;

use shots::{Set, Trial};
use tweenray::measure::Interval;

fn var<T: std::str::FromStr>(name: &str, default: T) -> T {
    std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default)
}

const HEAD: [&str; 12] = [
    "scene", "drawn", "RMSE", "shown", "width", "est.", "inferred", "width", "est.", "traced",
    "width", "est.",
];

/// How the intervals of one figure did.
#[derive(Default)]
struct Score {
    below: u32,
    above: u32,
    width: f64,
    estimate: f64,
}

impl Score {
    fn count(&mut self, interval: Interval, truth: f64) {
        let truth = truth.max(0.0).sqrt();
        self.below += u32::from(truth < interval.low);
        self.above += u32::from(truth > interval.high);
        self.width += (interval.high - interval.low) / truth;
        self.estimate += interval.estimate / truth;
    }

    fn cells(&self, shots: u32) -> [String; 3] {
        let n = f64::from(shots);
        [
            format!("{} (-{} +{})", shots - self.below - self.above, self.below, self.above),
            format!("{:.2}", self.width / n),
            format!("{:.2}", self.estimate / n),
        ]
    }
}

fn main() {
    support::title("audit");
    let shots = var("SHOTS", 60);
    let trial = Trial {
        edge: var("EDGE", 64),
        frames: var("FRAMES", 9),
        spp: var("SPP", 1),
        most_spp: Some(var("MOST", 0)).filter(|most| *most > 0),
        share: var("SHARE", 0.03),
        best: var("BEST", 128),
    };
    println!("{shots} shots of each scene, {trial:?}; shown, inferred and traced:");
    println!("shots whose interval holds the truth, its width and estimate over the truth");
    let scenes = ["cornell", "reflective_spheres", "spheres_on_terrain", "demo"];
    let wanted: String = var("SCENE", scenes.join(" "));
    for scene in wanted.split_whitespace() {
        let set = Set::load(scene);
        let stage = set.stage(var("THREADS", 2));
        let mut scores: [Score; 3] = Default::default();
        let (mut drawn, mut true_rmse) = (0, 0.0);
        for number in 0..shots {
            let audited = stage.audited(&trial, number);
            scores[0].count(audited.rmse.shown, audited.truth.shown);
            scores[1].count(audited.rmse.inferred, audited.truth.inferred);
            scores[2].count(audited.rmse.traced, audited.truth.traced);
            drawn += audited.sums.drawn;
            true_rmse += audited.truth.shown.max(0.0).sqrt() / f64::from(shots);
        }
        let mut row = vec![scene.into(), format!("{:.0}", drawn as f64 / f64::from(shots))];
        row.push(format!("{true_rmse:.2}"));
        scores.iter().for_each(|s| row.extend(s.cells(shots)));
        // A scene takes minutes: nobody waits for the last one to see the first.
        support::table(&HEAD, &[row]);
    }
}
