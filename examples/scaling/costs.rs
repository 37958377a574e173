//! What frames and messages take, as measured.

use crate::real::{Line, Ran, Stage};
use crate::simulation::{CostModel, SchedulerCost};
use tweenray::sequence::Pyramid;

/// What is given, not measured: a cluster whose nodes have 64 ranks and 100 Gbit/s each.
pub const LATENCY: f64 = 10e-6;
pub const BANDWIDTH: f64 = 12.5e9 / 64.0;
/// Seconds between polls of a communication thread, as in `src/cluster/comm_thread.rs`.
const POLL_INTERVAL: f64 = 1e-3;
/// Seconds to write or read a control message of some hundred bytes and hand it to MPI.
const MESSAGE_SECONDS: f64 = 10e-6;

/// What was measured of a job.
#[derive(Clone)]
pub struct Costs {
    /// Seconds of a core by frame of the measured shot.
    pub frames: Vec<f64>,
    /// The measured shot.
    pub pyramid: Pyramid,
    pub write_seconds: f64,
    /// To make a key frame's reference ready to travel.
    pub pack_seconds: f64,
    pub reference_bytes: u64,
    /// What other frames' references hold, of a key frame's.
    pub between_share: f64,
    pub discovery_bytes: u64,
    pub strips_bytes: u64,
    pub message_bytes: u64,
    /// Share of its core that a rank spends on looking for messages.
    pub comm_share: f64,
}

impl Costs {
    /// Those of a job that one rank made, `cpu` seconds of a core without its start.
    pub fn of(ran: &Ran, pyramid: Pyramid, cpu: f64) -> Self {
        let walls = ran.frames();
        let mut frames: Vec<f64> = walls.iter().map(|(trace, write)| trace + write).collect();
        // Alone, a rank makes the key frame at a segment's end with the first frame that needs it,
        // the middle one, and what is reported of the key frame is its writing.
        for end in (2..=pyramid.frames).filter(|f| pyramid.is_key(*f)) {
            let start = (end - 2) / pyramid.segment * pyramid.segment + 1;
            let middle = start + (end - start) / 2;
            if middle > start {
                let key = frames[0].min(frames[middle as usize - 1]);
                frames[middle as usize - 1] -= key;
                frames[end as usize - 1] += key;
            }
        }
        // The machine is shared: wall times tell how frames compare, the core's seconds what they take.
        let scale = cpu / frames.iter().sum::<f64>();
        frames.iter_mut().for_each(|seconds| *seconds *= scale);
        let writes = walls.iter().map(|(_, write)| write).sum::<f64>();
        let write_seconds = scale * writes / walls.len() as f64;
        Self {
            frames,
            pyramid,
            write_seconds,
            pack_seconds: 0.0,
            reference_bytes: 0,
            between_share: ran.traced_share(),
            discovery_bytes: 0,
            strips_bytes: 0,
            message_bytes: 400,
            comm_share: 0.0,
        }
    }

    /// What references take to be made ready, by a rank that puts two of key frames on disk; bytes of
    /// references and of the paper's discoveries, by two ranks that make a few frames.
    pub fn weigh(&mut self, stage: &Stage, words: &str) {
        let frames = self.pyramid.frames;
        let line = |ranks, words: String| Line { ranks, threads: 1, frames, words };
        let ran = stage.run(&line(1, format!("{words} --segment 2 --frames 1..3 --checkpoint 0s")));
        self.pack_seconds = ran.checkpoint_seconds() / 2.0;
        let ran = stage.run(&line(2, format!("{words} --segment 2 --frames 1..5")));
        self.reference_bytes = ran.size("references");
        // A reference holds what was traced, so strips hold as much and the colours beside it.
        self.strips_bytes = 2 * self.reference_bytes;
        let ran = stage.run(&line(2, format!("{words} --policy colour --frames 1..9")));
        self.discovery_bytes = ran.size("discoveries");
    }

    /// Seconds for a frame of another shot: those of some measured frame of its kind, drawn by its
    /// number. `swing`: by how much stretches of the path are heavier and lighter than the mean.
    pub fn seconds(&self, shot: Pyramid, swing: f64) -> impl Fn(u32) -> f64 + use<> {
        let keys: Vec<f64> = self.pick(|p, f| p.is_key(f));
        let others: Vec<f64> = self.pick(|p, f| !p.is_key(f));
        move |frame| {
            let kind = if shot.is_key(frame) { &keys } else { &others };
            let seconds = kind[mixed(frame) as usize % kind.len()];
            let along = f64::from(frame) / f64::from(shot.frames);
            seconds * (1.0 + swing * (along * 40.0).sin())
        }
    }

    fn pick(&self, of: impl Fn(&Pyramid, u32) -> bool) -> Vec<f64> {
        let frames = (1..).zip(&self.frames).filter(|(f, _)| of(&self.pyramid, *f));
        frames.map(|(_, seconds)| *seconds).collect()
    }

    /// The measured frames themselves.
    pub fn as_measured(&self) -> impl Fn(u32) -> f64 + use<> {
        let frames = self.frames.clone();
        move |frame| frames[frame as usize - 1]
    }

    pub fn model<'a>(&self, seconds: &'a dyn Fn(u32) -> f64) -> CostModel<'a> {
        CostModel {
            seconds,
            write_seconds: self.write_seconds,
            pack_seconds: self.pack_seconds,
            // Assumed.
            unpack_seconds: self.pack_seconds,
            reference_bytes: self.reference_bytes,
            between_share: self.between_share,
            strips_bytes: self.strips_bytes,
            message_bytes: self.message_bytes,
            latency: LATENCY,
            bandwidth: BANDWIDTH,
            poll_interval: POLL_INTERVAL,
            message_seconds: MESSAGE_SECONDS,
            comm_share: self.comm_share,
            scheduler: SchedulerCost::Measured,
            cores: None,
        }
    }
}

/// Numbers that look like chance and are the same every time.
fn mixed(frame: u32) -> u32 {
    let mixed = frame.wrapping_mul(0x9e37_79b1);
    (mixed ^ (mixed >> 15)).wrapping_mul(0x85eb_ca77) >> 8
}
