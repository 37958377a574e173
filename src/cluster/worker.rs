//! The thread of a rank that renders: one order after another, each with all that it takes.

use super::board::{Order, What};
use crate::error::Result;
use crate::output::manifest::Journal;
use crate::sequence::{self, FrameReport, Left, Shared, Strip, Target};
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender};
use std::time::Instant;

/// An order with what came for it from other ranks.
pub struct Job {
    pub order: Order,
    /// References that this rank has not looked at yet, by original.
    pub references: Vec<(u32, Arc<[u8]>)>,
    /// The strips to put together, if any.
    pub strips: Vec<Arc<[u8]>>,
}

/// What the worker tells.
pub enum Told {
    /// A frame is finished, and more of the same order follow.
    Wrote(Box<FrameReport>),
    /// An order is done.
    Done(Box<Done>),
    /// The job was asked to stop before the order was done.
    Stopped,
    /// The order failed.
    Failed(crate::error::Error),
}

/// An order that is done.
pub struct Done {
    pub order: Order,
    /// Of the last frame that was written, if any was.
    pub report: Option<FrameReport>,
    /// For the rank that puts strips together, or for those whose frames are made of this one.
    pub leaves: Left,
    pub seconds: f64,
}

/// Does what comes through `jobs` until nobody sends any more, or something fails.
pub fn work(
    maker: &dyn Shared,
    target: &Target,
    (rank, journal): (u32, &Path),
    jobs: &Receiver<Job>,
    tell: &Sender<Told>,
) {
    let mut desk = Desk { maker, target, rank, path: journal, journal: None, tell };
    for job in jobs {
        let told = match desk.act(job) {
            Ok(Some(done)) => Told::Done(Box::new(done)),
            Ok(None) => Told::Stopped,
            Err(error) => Told::Failed(error),
        };
        let goes_on = matches!(told, Told::Done(_));
        // Nobody listens only where the job ends anyway.
        if tell.send(told).is_err() || !goes_on {
            return;
        }
    }
}

struct Desk<'a> {
    maker: &'a dyn Shared,
    target: &'a Target,
    rank: u32,
    path: &'a Path,
    journal: Option<Journal>,
    tell: &'a Sender<Told>,
}

impl Desk<'_> {
    /// `None` when the job was asked to stop.
    fn act(&mut self, job: Job) -> Result<Option<Done>> {
        let start = Instant::now();
        let Job { order, references, strips } = job;
        references.iter().for_each(|(original, bytes)| self.maker.import(*original, bytes));
        let did = match &order.what {
            What::Strip { number, of, .. } => {
                let strip = Strip { number: *number, of: *of, is_source: order.is_source };
                let bytes = self.maker.strip(order.original, strip)?;
                bytes.map(|bytes| (None, Left { bytes: bytes.into(), discoveries: 0 }))
            }
            What::Whole { frames, .. } => {
                if !strips.is_empty() {
                    self.maker.lay(order.original, &strips)?;
                }
                self.whole(&order, frames)?
            }
        };
        let seconds = start.elapsed().as_secs_f64();
        Ok(did.map(|(report, leaves)| Done { order, report, leaves, seconds }))
    }

    fn whole(
        &mut self,
        order: &Order,
        frames: &[u32],
    ) -> Result<Option<(Option<FrameReport>, Left)>> {
        if order.is_source {
            self.maker.hold(order.original);
        }
        if frames.is_empty() && !self.maker.make_source(order.original)? {
            return Ok(None);
        }
        self.maker.expect(frames);
        let mut last = None;
        for frame in frames {
            let journal = match &mut self.journal {
                Some(journal) => journal,
                none => none.insert(self.target.journal(self.rank, self.path)?),
            };
            let place = (self.rank, journal);
            let report = sequence::render_frame(self.target, *frame, place, self.maker)?;
            let Some(report) = report else { return Ok(None) };
            if let Some(before) = last.replace(report) {
                _ = self.tell.send(Told::Wrote(Box::new(before)));
            }
        }
        let leaves = order.is_source.then(|| self.maker.export(order.original)).flatten();
        Ok(Some((last, leaves.unwrap_or_default())))
    }
}
