//! Discrete-event simulation of a job on any number of ranks, with the scheduler of real jobs.
//!
//! The model has seconds for each task, latency and bandwidth for each message, communication threads that
//! sleep between polls, and rank 0's communication thread, which handles one control message at a time.
//! Not modelled: failures, waiting for a shared disk, and contention in the network.

mod network;
mod simulator;
#[cfg(test)]
mod tests;

use tweenray::cluster::Traffic;
use tweenray::sequence::{FrameGraph, Pyramid};

/// A job: frames, the dependencies between them, and how references are sent.
#[derive(Debug, Clone, Copy)]
pub struct Job {
    /// The shot and its segments. All frames are rendered.
    pub pyramid: Pyramid,
    /// Most strips that a frame can be cut into.
    pub most_strips: u32,
    /// Whether each frame's discoveries go to all ranks, needed or not, as in the source paper.
    pub sends_to_all: bool,
}

/// The costs of tasks and messages.
pub struct CostModel<'a> {
    /// Core seconds to render and write a representative, by its frame number.
    pub seconds: &'a dyn Fn(u32) -> f64,
    /// Core seconds of these for writing, which strips do not share.
    pub write_seconds: f64,
    /// Core seconds to encode a key frame's reference.
    pub pack_seconds: f64,
    /// Core seconds to decode a key frame's reference.
    pub unpack_seconds: f64,
    /// Bytes of a key frame's encoded reference.
    pub reference_bytes: u64,
    /// Size of another frame's reference, as a share of a key frame's. It holds only the pixels that were
    /// traced.
    pub between_share: f64,
    /// Bytes of all strips of a frame, summed.
    pub strips_bytes: u64,
    /// Bytes of a control message.
    pub message_bytes: u64,
    /// Seconds from sending to arrival of an empty message.
    pub latency: f64,
    /// Bytes per second that a rank can send, and at the same time receive.
    pub bandwidth: f64,
    /// Seconds between two polls of a communication thread.
    pub poll_interval: f64,
    /// Seconds of rank 0's communication thread to write or read a control message.
    pub message_seconds: f64,
    /// Share of a rank's core that its communication thread takes, if there are several ranks.
    pub comm_share: f64,
    /// Seconds that the scheduler takes.
    pub scheduler: SchedulerCost,
    /// Cores that all ranks share evenly; `None`: each rank has a core of its own.
    pub cores: Option<f64>,
}

/// Seconds that the scheduler on rank 0 takes for its decisions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SchedulerCost {
    /// Seconds for each received control message.
    Seconds(f64),
    /// The measured processor time of the scheduler in this simulation, which varies between runs.
    Measured,
}

/// The result of a simulated job.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SimulatedRun {
    /// Seconds from the first assignment to the last frame.
    pub seconds: f64,
    /// Core seconds of all tasks on all ranks.
    pub busy_seconds: f64,
    /// Seconds that rank 0's communication thread handled control messages.
    pub comm_seconds: f64,
    /// Seconds of these that the scheduler took.
    pub scheduler_seconds: f64,
    /// Most seconds that the scheduler took at one time.
    pub longest_pass: f64,
    /// Messages that all ranks sent.
    pub sent: Traffic,
    /// Number of frames rendered.
    pub frames: u64,
}

impl Job {
    /// Simulates the job on `ranks` ranks.
    pub fn simulate(&self, ranks: u32, model: &CostModel) -> SimulatedRun {
        simulator::Simulator::new(self, ranks, model).run()
    }

    /// Core seconds of all frames on one rank, which sends no messages.
    pub fn single_rank_seconds(&self, model: &CostModel) -> f64 {
        (1..=self.pyramid.frames).map(model.seconds).sum()
    }
}

impl FrameGraph for Job {
    fn batches(&self, frames: &[u32]) -> Vec<Vec<u32>> {
        self.pyramid.batches(frames)
    }

    fn needs(&self, representative: u32) -> Vec<u32> {
        self.pyramid.ancestors(representative)
    }

    fn sends_to_all(&self) -> bool {
        self.sends_to_all
    }

    fn most_strips(&self) -> u32 {
        self.most_strips
    }
}
