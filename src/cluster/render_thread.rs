//! The render thread of a rank: one task after another, each with the references that it takes.

use super::scheduler::{Extent, Task};
use crate::error::{Error, Result};
use crate::output::manifest::Journal;
use crate::sequence::{self, Exported, FrameReport, RankMaker, Strip, Target};
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender};
use std::time::Instant;

/// A task, and its inputs from other ranks.
pub struct TaskInput {
    pub task: Task,
    /// References for the maker to import, by representative.
    pub references: Vec<(u32, Arc<[u8]>)>,
    /// Strips to merge, in order; empty unless the task is a merge.
    pub strips: Vec<Arc<[u8]>>,
}

/// An event on the render thread, for the communication thread.
pub enum Event {
    /// A frame is written, and the task goes on.
    Wrote(Box<FrameReport>),
    /// The task is done.
    Finished(Box<Finished>),
    /// The job was asked to stop, and the task is not done.
    Stopped,
    /// The task failed.
    Failed(Error),
}

/// A task that is done.
pub struct Finished {
    pub task: Task,
    /// Report of the last frame that the task wrote, if any; those of the frames before it were sent at once.
    pub report: Option<FrameReport>,
    /// The strip, or the reference if other frames take it; otherwise empty.
    pub output: Exported,
    /// Seconds that the task took.
    pub seconds: f64,
}

/// Runs the tasks of `inputs` until that channel closes, a task fails, or the job is asked to stop.
/// `journal` is the path of the journal of `rank`.
pub fn run(
    maker: &dyn RankMaker,
    target: &Target,
    (rank, journal): (u32, &Path),
    inputs: &Receiver<TaskInput>,
    events: &Sender<Event>,
) {
    let path = journal;
    let mut thread = RenderThread { maker, target, rank, path, journal: None, events };
    for input in inputs {
        let event = match thread.run_task(input) {
            Ok(finished) => Event::Finished(Box::new(finished)),
            Err(Error::Stopped) => Event::Stopped,
            Err(error) => Event::Failed(error),
        };
        let goes_on = matches!(event, Event::Finished(_));
        // The channel is closed only when the job ends.
        if events.send(event).is_err() || !goes_on {
            return;
        }
    }
}

/// The state of a rank's render thread.
struct RenderThread<'a> {
    maker: &'a dyn RankMaker,
    target: &'a Target,
    rank: u32,
    /// Path of the journal.
    path: &'a Path,
    /// The journal, open from this rank's first frame on.
    journal: Option<Journal>,
    events: &'a Sender<Event>,
}

impl RenderThread<'_> {
    /// Runs one task.
    fn run_task(&mut self, input: TaskInput) -> Result<Finished> {
        let start = Instant::now();
        let TaskInput { task, references, strips } = input;
        references
            .iter()
            .for_each(|(representative, bytes)| self.maker.import(*representative, bytes));
        let (report, output) = match &task.extent {
            Extent::Strip { number, of, .. } => {
                let strip = Strip { number: *number, of: *of, is_source: task.is_source };
                let bytes = self.maker.render_strip(task.representative, strip)?;
                (None, Exported { bytes: bytes.into(), discoveries: 0 })
            }
            Extent::Whole { frames, .. } => {
                if !strips.is_empty() {
                    self.maker.join_strips(task.representative, &strips)?;
                }
                self.whole(&task, frames)?
            }
        };
        let seconds = start.elapsed().as_secs_f64();
        Ok(Finished { task, report, output, seconds })
    }

    /// Makes a representative and writes `frames`. The report of the last frame is returned, and an event
    /// is sent for each of the others.
    fn whole(&mut self, task: &Task, frames: &[u32]) -> Result<(Option<FrameReport>, Exported)> {
        if task.is_source {
            self.maker.hold(task.representative);
        }
        if frames.is_empty() {
            self.maker.make_reference(task.representative)?;
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
            if let Some(before) = last.replace(report) {
                _ = self.events.send(Event::Wrote(Box::new(before)));
            }
        }
        let output = task.is_source.then(|| self.maker.export(task.representative)).flatten();
        Ok((last, output.unwrap_or_default()))
    }
}
