//! The large job, played on 1 to 4,096 ranks.

use crate::costs::Costs;
use crate::fit::strips;
use crate::real::{Line, Stage};
use std::time::Instant;
use tweenray::cluster::simulation::{Job, Model, Played, Table};
use tweenray::sequence::Pyramid;

pub const FRAMES: u32 = 262_144;
pub const MOST: u32 = 4096;
/// One for each of the most ranks.
pub const SEGMENT: u32 = 64;
const MEASURED: Pyramid = Pyramid { segment: SEGMENT, frames: SEGMENT + 1 };
/// A frame of a film.
pub const WORDS: &str = "--size 1280x720 --spp 4 --shadow-samples 16";
/// A job of some 10 to 20 seconds.
const CLERK_WORDS: &str = "--size 640x360 --spp 4 --shadow-samples 16 --segment 16";
const HEIGHT: u32 = 720;

/// A way of doing the job.
pub struct Curve {
    pub name: &'static str,
    /// Ranks, efficiency, and all else.
    pub points: Vec<(u32, f64, Played)>,
}

/// What the large job's frames take, measured on one segment.
pub fn measure(stage: &Stage, note_bytes: u64) -> Costs {
    let line = Line { ranks: 1, threads: 1, frames: MEASURED.frames, words: WORDS.into() };
    let ran = stage.run(&line);
    let cpu = ran.cpu - stage.start_of(&line);
    let mut costs = Costs::of(&ran, MEASURED, cpu);
    costs.weigh(stage, WORDS);
    costs.note_bytes = note_bytes;
    let line = Line { ranks: 2, threads: 1, frames: 65, words: CLERK_WORDS.into() };
    costs.clerk_share = stage.clerk_share(&line);
    println!("  clerks take {:.2} % of a core", 100.0 * costs.clerk_share);
    costs
}

/// What to play otherwise than the program does it on the given network.
#[derive(Clone, Copy)]
pub struct Change {
    /// Frames of a segment.
    pub segment: u32,
    pub tells_all: bool,
    pub latency: f64,
    pub bandwidth: f64,
    /// Time of a note.
    pub note: f64,
    /// By how much stretches of the path are heavier or lighter than the mean.
    pub swing: f64,
    /// Does the table take no time.
    pub is_table_free: bool,
}

pub const NONE: Change = Change {
    segment: SEGMENT,
    tells_all: false,
    latency: 1.0,
    bandwidth: 1.0,
    note: 1.0,
    swing: 0.0,
    is_table_free: false,
};

/// The job on `ranks`: efficiency, and what it came to.
pub fn play(costs: &Costs, ranks: u32, change: Change) -> (f64, Played) {
    let start = Instant::now();
    let shot = Pyramid { segment: change.segment, frames: FRAMES };
    let job = Job { pyramid: shot, most_strips: strips(HEIGHT), tells_all: change.tells_all };
    let seconds = costs.seconds(shot, change.swing);
    let plain = costs.model(&seconds);
    let bytes = if change.tells_all { costs.discovery_bytes } else { plain.reference_bytes };
    let model = Model {
        reference_bytes: bytes,
        latency: plain.latency * change.latency,
        bandwidth: plain.bandwidth * change.bandwidth,
        note_seconds: plain.note_seconds * change.note,
        table: if change.is_table_free { Table::Seconds(0.0) } else { Table::Measured },
        ..plain
    };
    let played = job.play(ranks, &model);
    assert_eq!(played.frames, u64::from(FRAMES));
    let efficiency = job.alone(&model) / (f64::from(ranks) * played.seconds);
    println!(
        "  {ranks:5} ranks: {:9.1} s, efficiency {efficiency:.3} (played in {:.1} s)",
        played.seconds,
        start.elapsed().as_secs_f64()
    );
    (efficiency, played)
}

pub fn curve(costs: &Costs, name: &'static str, ranks: &[u32], change: Change) -> Curve {
    println!("{name}");
    let point = |n: &u32| {
        let (efficiency, played) = play(costs, *n, change);
        (*n, efficiency, played)
    };
    Curve { name, points: ranks.iter().map(point).collect() }
}
