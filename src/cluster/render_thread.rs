//! The render thread of a rank: one task after another, each with the references that it takes. Its frames are
//! written by another thread.

use super::scheduler::{Extent, Task};
use crate::error::{Error, Result};
use crate::sequence::{self, Exported, FrameReport, MadeFrame, RankMaker, Strip};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, SyncSender};
use std::time::Instant;

/// A task, and its inputs from other ranks.
pub struct TaskInput {
    pub task: Task,
    /// References for the maker to import, by representative.
    pub references: Vec<(u32, Arc<[u8]>)>,
    /// Strips to merge, in order; empty unless the task is a merge.
    pub strips: Vec<Arc<[u8]>>,
}

/// An event on the render thread or the writing thread, for the communication thread.
pub enum Event {
    /// A frame is written.
    Wrote(Box<FrameReport>),
    /// The task is done, and the writing thread has its frames.
    Finished(Box<Finished>),
    /// The job was asked to stop, and the task is not done.
    Stopped {
        /// How many frames of the task the writing thread does not get.
        unmade: usize,
    },
    /// The task failed, or a frame could not be written.
    Failed(Error),
}

/// A task that is done.
pub struct Finished {
    pub task: Task,
    /// The strip, or the reference if other frames take it; otherwise empty.
    pub output: Exported,
    /// Seconds that the task took.
    pub seconds: f64,
}

/// Runs the tasks of `inputs` until that channel closes, a task fails, or the job is asked to stop. Hands frames
/// `to_writer`.
pub fn run(
    maker: &dyn RankMaker,
    inputs: &Receiver<TaskInput>,
    to_writer: SyncSender<MadeFrame>,
    events: &Sender<Event>,
) {
    let mut thread = RenderThread { maker, to_writer, unmade: 0 };
    for input in inputs {
        let event = match thread.run_task(input) {
            Ok(finished) => Event::Finished(Box::new(finished)),
            Err(Error::Stopped) => Event::Stopped { unmade: thread.unmade },
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
    to_writer: SyncSender<MadeFrame>,
    /// How many frames of the task the writing thread has not got.
    unmade: usize,
}

impl RenderThread<'_> {
    /// Runs one task.
    fn run_task(&mut self, input: TaskInput) -> Result<Finished> {
        let start = Instant::now();
        let TaskInput { task, references, strips } = input;
        self.unmade = task.frames().len();
        references
            .iter()
            .for_each(|(representative, bytes)| self.maker.import(*representative, bytes));
        let output = match &task.extent {
            Extent::Strip { number, of, .. } => {
                let strip = Strip { number: *number, of: *of, is_source: task.is_source };
                let bytes = self.maker.render_strip(task.representative, strip)?;
                Exported { bytes: bytes.into(), discoveries: 0 }
            }
            Extent::Whole { frames, .. } => {
                if !strips.is_empty() {
                    self.maker.join_strips(task.representative, &strips)?;
                }
                self.whole(&task, frames)?
            }
        };
        let seconds = start.elapsed().as_secs_f64();
        Ok(Finished { task, output, seconds })
    }

    /// Makes a representative and hands `frames` to the writing thread.
    fn whole(&mut self, task: &Task, frames: &[u32]) -> Result<Exported> {
        if task.is_source {
            self.maker.hold(task.representative);
        }
        if frames.is_empty() {
            self.maker.make_reference(task.representative)?;
        }
        self.maker.expect(frames);
        for frame in frames {
            sequence::make_frame(*frame, self.maker, &self.to_writer)?;
            self.unmade -= 1;
        }
        let output = task.is_source.then(|| self.maker.export(task.representative)).flatten();
        Ok(output.unwrap_or_default())
    }
}
