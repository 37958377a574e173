//! A job on any number of ranks, played through without one of them: the table that deals out frames is
//! the program's own, and time is counted, not spent (a discrete-event simulation).
//!
//! What is modelled is what stands about the table: ranks that take so long for an order, notes and
//! references that take so long to arrive, clerks that sleep between looks, and rank 0's clerk, which
//! handles one note after the other. Not modelled: failures, files that wait for a shared disk, and
//! messages that cross in the network.

mod play;
#[cfg(test)]
mod tests;
mod wire;

use super::traffic::Traffic;
use crate::error::Result;
use crate::sequence::{FrameMaker, Made, Pyramid, Shared};

/// A job: its frames, and which of them are made of which.
#[derive(Debug, Clone, Copy)]
pub struct Job {
    /// The shot and its segments; all of its frames are made.
    pub pyramid: Pyramid,
    /// Into how many strips a frame can be cut at most.
    pub most_strips: u32,
    /// Whether what a frame leaves goes to all ranks, needed or not, as the source paper has it.
    pub tells_all: bool,
}

/// What things take.
pub struct Model<'a> {
    /// Seconds of a core to make an original and write it, by its number.
    pub seconds: &'a dyn Fn(u32) -> f64,
    /// Those of them that go into writing, which is not shared among strips.
    pub write_seconds: f64,
    /// Seconds of a core to make a key frame's reference ready to travel.
    pub pack_seconds: f64,
    /// Seconds of a core to take one in that came.
    pub unpack_seconds: f64,
    /// Bytes of one on its way.
    pub reference_bytes: u64,
    /// Share of these that other frames' references take: they hold what had to be traced there.
    pub between_share: f64,
    /// Bytes of all strips of a frame together.
    pub strips_bytes: u64,
    /// Bytes of a note.
    pub note_bytes: u64,
    /// Seconds that a message takes whatever its length.
    pub latency: f64,
    /// Bytes a second that a rank can send, and as many that it can receive.
    pub bandwidth: f64,
    /// Seconds that a clerk sleeps between looks.
    pub nap: f64,
    /// Seconds of rank 0's clerk to write or read a note.
    pub note_seconds: f64,
    /// Share of its core that each of several ranks spends on looking for messages.
    pub clerk_share: f64,
    /// What the table itself takes.
    pub table: Table,
    /// Cores that all ranks share evenly; each has one of its own without.
    pub cores: Option<f64>,
}

/// How long rank 0 thinks about what to give out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Table {
    /// So many seconds a note that comes in.
    Seconds(f64),
    /// As long as the program's own table takes here and now: two runs differ a little.
    Measured,
}

/// What a job came to.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Played {
    /// Seconds from the first order to the last frame.
    pub seconds: f64,
    /// Seconds of a core that all ranks worked, what was done for others included.
    pub busy_seconds: f64,
    /// Seconds that rank 0's clerk had notes in hand.
    pub clerk_seconds: f64,
    /// Those of them that the table took.
    pub table_seconds: f64,
    /// The longest that the table took at one look.
    pub longest_look: f64,
    /// What all ranks sent.
    pub sent: Traffic,
    /// Frames that were made.
    pub frames: u64,
}

impl Job {
    /// The job on so many ranks.
    pub fn play(&self, ranks: u32, model: &Model) -> Played {
        play::Play::new(self, ranks, model).run()
    }

    /// Seconds of a core for all frames when one rank makes them.
    pub fn alone(&self, model: &Model) -> f64 {
        self.pyramid.all().map(model.seconds).sum()
    }
}

impl FrameMaker for Job {
    fn make(&self, _frame: u32) -> Result<Option<Made>> {
        Ok(None)
    }

    fn batches(&self, frames: &[u32]) -> Vec<Vec<u32>> {
        self.pyramid.batches(frames)
    }
}

impl Shared for Job {
    fn needs(&self, original: u32) -> Vec<u32> {
        self.pyramid.ancestors(original)
    }

    fn tells_all(&self) -> bool {
        self.tells_all
    }

    fn most_strips(&self) -> u32 {
        self.most_strips
    }
}
