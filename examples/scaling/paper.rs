//! The source paper's Tables 1 to 4, with ours beside them.

use crate::costs::Costs;
use crate::fit::strips;
use crate::real::{Line, Stage};
use crate::simulation::Job;
use std::fmt::Write;
use tweenray::sequence::Pyramid;

/// Table 1: ranks, then seconds for 32, 64 and 128 frames.
const STRONG: [(u32, [f64; 3]); 4] = [
    (4, [56.7, 104.8, 341.7]),
    (8, [38.2, 66.9, 130.3]),
    (16, [30.9, 49.8, 84.0]),
    (32, [28.9, 42.9, 72.7]),
];
/// Table 2: as many frames as ranks, on several nodes; `None` where the job timed out.
const WEAK: [(u32, Option<f64>); 5] =
    [(16, Some(13.3)), (32, Some(29.8)), (64, None), (128, None), (256, None)];
/// Table 3: frames on one rank.
const ALONE: [(u32, f64); 9] = [
    (1, 14.2),
    (2, 17.7),
    (4, 25.3),
    (8, 39.9),
    (16, 70.9),
    (32, 129.9),
    (64, 242.7),
    (128, 479.33),
    (256, 1065.98),
];
/// Table 4: frames on 32 ranks.
const THIRTY_TWO: [(u32, f64); 4] = [(32, 30.9), (64, 41.6), (128, 69.2), (256, 146.5)];
/// The paper's settings; one camera sample a pixel, since it does not say.
const WORDS: &str = "--size 400x300 --spp 1 --shadow-samples 1 --segment 64";
const SEGMENT: u32 = 64;

/// Ours, as measured and as simulated.
struct Ours {
    costs: Costs,
    /// By number of frames: wall seconds with start, seconds of a core without.
    alone: Vec<(u32, f64, f64)>,
}

impl Ours {
    /// The pan in so many frames on so many ranks with a core each.
    fn simulated(&self, ranks: u32, frames: u32) -> f64 {
        let shot = Pyramid { segment: SEGMENT, frames };
        let seconds = self.costs.seconds(shot, 0.0);
        let model = self.costs.model(&seconds);
        Job { pyramid: shot, most_strips: strips(300), sends_to_all: false }
            .simulate(ranks, &model)
            .seconds
    }
}

/// The four tables as Markdown. `small` has the weights of references of frames of that size.
pub fn tables(stage: &Stage, small: &Costs) -> String {
    println!("the paper's tables");
    let ours = measure(stage, small);
    let mut out = String::new();
    strong(&mut out, stage, &ours);
    weak(&mut out, &ours);
    alone(&mut out, &ours);
    thirty_two(&mut out, &ours);
    out
}

fn measure(stage: &Stage, small: &Costs) -> Ours {
    let mut costs = None;
    let mut all = Vec::new();
    for (frames, _) in ALONE {
        let line = Line { ranks: 1, threads: 1, frames, words: WORDS.into() };
        let ran = stage.run(&line);
        let cpu = ran.cpu - stage.start_of(&line);
        all.push((frames, ran.total(), cpu));
        if frames == 128 {
            let pyramid = Pyramid { segment: SEGMENT, frames };
            costs = Some(Costs::of(&ran, pyramid, cpu));
        }
    }
    let costs = costs.unwrap();
    let messages = small.clone();
    let costs = Costs {
        frames: costs.frames,
        pyramid: costs.pyramid,
        write_seconds: costs.write_seconds,
        ..messages
    };
    Ours { costs, alone: all }
}

fn strong(out: &mut String, stage: &Stage, ours: &Ours) {
    out.push_str(
        "### Table 1: more ranks for the same frames\n\n\
         | ranks | paper: 32 frames | 64 | 128 | ours, simulated: 32 | 64 | 128 | \
         ours, run: 128, seconds of a core |\n|--:|--:|--:|--:|--:|--:|--:|--:|\n",
    );
    for (ranks, paper) in STRONG {
        let line = Line { ranks, threads: 1, frames: 128, words: WORDS.into() };
        let ran = stage.run(&line);
        let cpu = ran.cpu - stage.start_of(&line);
        let [a, b, c] = [32, 64, 128].map(|frames| ours.simulated(ranks, frames));
        let [p, q, r] = paper;
        _ = writeln!(
            out,
            "| {ranks} | {p} s | {q} s | {r} s | {a:.2} s | {b:.2} s | {c:.2} s | {cpu:.1} s |"
        );
    }
}

fn weak(out: &mut String, ours: &Ours) {
    out.push_str(
        "\n### Table 2: as many frames as ranks, over several nodes\n\n\
         | ranks and frames | paper | ours, simulated |\n|--:|--:|--:|\n",
    );
    for (ranks, paper) in WEAK {
        let paper = paper.map_or("timed out".into(), |seconds| format!("{seconds} s"));
        _ = writeln!(out, "| {ranks} | {paper} | {:.2} s |", ours.simulated(ranks, ranks));
    }
}

fn alone(out: &mut String, ours: &Ours) {
    out.push_str(
        "\n### Table 3: one rank\n\n| frames | paper | ours, run: wall | seconds of a core |\n\
         |--:|--:|--:|--:|\n",
    );
    for ((frames, paper), (_, wall, cpu)) in ALONE.into_iter().zip(&ours.alone) {
        _ = writeln!(out, "| {frames} | {paper} s | {wall:.2} s | {cpu:.2} s |");
    }
}

fn thirty_two(out: &mut String, ours: &Ours) {
    out.push_str(
        "\n### Table 4: 32 ranks\n\n| frames | paper | ours, simulated |\n|--:|--:|--:|\n",
    );
    for (frames, paper) in THIRTY_TWO {
        _ = writeln!(out, "| {frames} | {paper} s | {:.2} s |", ours.simulated(32, frames));
    }
}
