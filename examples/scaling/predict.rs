//! The large job, simulated on 1 to 4,096 ranks.

use crate::costs::Costs;
use crate::fit::strips;
use crate::real::{Line, Stage};
use crate::simulation::{CostModel, Job, SchedulerCost, SimulatedRun};
use std::time::Instant;
use tweenray::sequence::Pyramid;

pub const FRAMES: u32 = 262_144;
pub const MOST: u32 = 4096;
/// One for each of the most ranks.
pub const SEGMENT: u32 = 64;
const MEASURED: Pyramid = Pyramid { segment: SEGMENT, frames: SEGMENT + 1 };
/// A frame of a film.
pub const WORDS: &str = "--size 1280x720 --spp 4 --shadow-samples 16";
/// A job of some 10 to 20 seconds.
const COMM_WORDS: &str = "--size 640x360 --spp 4 --shadow-samples 16 --segment 16";
const HEIGHT: u32 = 720;

/// A way of doing the job.
pub struct Curve {
    pub name: &'static str,
    /// Ranks, efficiency, and all else.
    pub points: Vec<(u32, f64, SimulatedRun)>,
}

/// What the large job's frames take, measured on one segment.
pub fn measure(stage: &Stage, message_bytes: u64) -> Costs {
    let line = Line { ranks: 1, threads: 1, frames: MEASURED.frames, words: WORDS.into() };
    let ran = stage.run(&line);
    let cpu = ran.cpu - stage.start_of(&line);
    let mut costs = Costs::of(&ran, MEASURED, cpu);
    costs.weigh(stage, WORDS);
    costs.message_bytes = message_bytes;
    let line = Line { ranks: 2, threads: 1, frames: 65, words: COMM_WORDS.into() };
    costs.comm_share = stage.comm_share(&line);
    println!("  communication threads take {:.2} % of a core", 100.0 * costs.comm_share);
    costs
}

/// Changes to the simulated program or network; factors are relative to the given network.
#[derive(Clone, Copy)]
pub struct Change {
    /// Frames of a segment.
    pub segment: u32,
    pub sends_to_all: bool,
    pub latency: f64,
    pub bandwidth: f64,
    /// Time of a control message.
    pub message: f64,
    /// By how much stretches of the path are heavier or lighter than the mean.
    pub swing: f64,
    /// Whether the scheduler takes no time.
    pub is_scheduler_free: bool,
}

pub const NONE: Change = Change {
    segment: SEGMENT,
    sends_to_all: false,
    latency: 1.0,
    bandwidth: 1.0,
    message: 1.0,
    swing: 0.0,
    is_scheduler_free: false,
};

/// The job on `ranks`: efficiency, and the simulated run.
pub fn simulate(costs: &Costs, ranks: u32, change: Change) -> (f64, SimulatedRun) {
    let start = Instant::now();
    let shot = Pyramid { segment: change.segment, frames: FRAMES };
    let job = Job { pyramid: shot, most_strips: strips(HEIGHT), sends_to_all: change.sends_to_all };
    let seconds = costs.seconds(shot, change.swing);
    let plain = costs.model(&seconds);
    let bytes = if change.sends_to_all { costs.discovery_bytes } else { plain.reference_bytes };
    let model = CostModel {
        reference_bytes: bytes,
        latency: plain.latency * change.latency,
        bandwidth: plain.bandwidth * change.bandwidth,
        message_seconds: plain.message_seconds * change.message,
        scheduler: match change.is_scheduler_free {
            true => SchedulerCost::Seconds(0.0),
            false => SchedulerCost::Measured,
        },
        ..plain
    };
    let run = job.simulate(ranks, &model);
    assert_eq!(run.frames, u64::from(FRAMES));
    let efficiency = job.single_rank_seconds(&model) / (f64::from(ranks) * run.seconds);
    println!(
        "  {ranks:5} ranks: {:9.1} s, efficiency {efficiency:.3} (simulated in {:.1} s)",
        run.seconds,
        start.elapsed().as_secs_f64()
    );
    (efficiency, run)
}

pub fn curve(costs: &Costs, name: &'static str, ranks: &[u32], change: Change) -> Curve {
    println!("{name}");
    let point = |n: &u32| {
        let (efficiency, run) = simulate(costs, *n, change);
        (*n, efficiency, run)
    };
    Curve { name, points: ranks.iter().map(point).collect() }
}
