//! One frame after another: camera, film, whole file, manifest row.
//!
//! [`prepare`] reads the files on disk and decides which frames are kept and which are rendered;
//! [`render_frames`] renders some of these, in order, and a [`FrameWriter`] writes each while the next is made.
//! The maker of films is a parameter ([`FrameMaker`]): [`Tracer`] traces every frame, [`SurfaceReuse`] and
//! [`ColourMaker`] infer. All three have a [`FrameContext`]; the two that infer keep their references in a pool.
//! [`checkpoint`] writes references to disk; [`survey`] reports the state of each frame of a sequence. A row
//! is written after the rename of its frame, so rows always name whole frames, whenever the job ends.

pub mod checkpoint;
mod colour;
mod context;
mod fingerprint;
mod maker;
mod pool;
mod pyramid;
mod recipe;
mod resume;
mod schedule;
mod strips;
mod supplied;
mod surface_reuse;
pub mod survey;
mod target;
mod tracer;
mod writer;

pub use colour::{ColourMaker, check_upload};
pub use context::FrameContext;
pub use fingerprint::{WorldHash, fingerprint, shot_fingerprint};
pub use maker::{Exported, FrameGraph, FrameMaker, Made, RankMaker, SaveCost};
pub use pyramid::Pyramid;
pub use recipe::{Recipe, Recipes, Tag};
pub use resume::{
    FrameFiles, Plan, check_files, has_frames_to_check, prepare, prepare_with, refuse_unlisted,
};
pub use schedule::Schedule;
pub use strips::Strip;
pub use supplied::{ReferenceCache, ReferenceInfo};
pub use surface_reuse::SurfaceReuse;
pub use target::Target;
pub use tracer::Tracer;
pub use writer::{FrameReport, FrameWriter, MadeFrame, WriterContext, audit_row, frame_channel};

#[cfg(test)]
mod tests;

use crate::error::{Error, Result};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::SyncSender;
use std::time::Instant;

/// Renders `frames` in order; each is written as `context` says while the next is made. `done` is called with each
/// finished frame, by the thread that writes. Ends early, without an error, when `maker` was asked to stop;
/// the frames that were made by then are finished. `stop` is what `maker` watches, and is set if a
/// frame cannot be written.
///
/// Errors: those of making or writing a frame; the frames before it are finished.
pub fn render_frames(
    context: WriterContext,
    frames: &[u32],
    maker: &(impl FrameMaker + ?Sized),
    stop: &AtomicBool,
    done: &mut (dyn FnMut(FrameReport) -> Result<()> + Send),
) -> Result<()> {
    if frames.is_empty() {
        return Ok(());
    }
    let mut writer = FrameWriter::new(context)?;
    writer.open_journal()?;
    let (to_writer, made) = frame_channel();
    let (ended, written) = std::thread::scope(|scope| {
        let writing = scope.spawn(|| {
            let written = writer.write_all(made, done);
            if written.is_err() {
                stop.store(true, Ordering::Relaxed);
            }
            written
        });
        // Owned here, so that a panic too drops it, which ends the writer.
        let to_writer = to_writer;
        let ended = frames.iter().try_for_each(|frame| make_frame(*frame, maker, &to_writer));
        drop(to_writer);
        let written = writing.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        (ended, written)
    });
    written?;
    match ended {
        Err(Error::Stopped) => {
            maker.stopped();
            Ok(())
        }
        ended => ended,
    }
}

/// Makes `frame` and hands it to the writer, which first finishes the frame before.
///
/// # Errors
/// Errors of making the frame; [`Error::Stopped`] if the writer has failed.
pub fn make_frame(
    frame: u32,
    maker: &(impl FrameMaker + ?Sized),
    to_writer: &SyncSender<MadeFrame>,
) -> Result<()> {
    let start = Instant::now();
    let made = maker.make(frame)?;
    let trace_seconds = start.elapsed().as_secs_f64();
    to_writer.send(MadeFrame { frame, made, trace_seconds }).map_err(|_| Error::Stopped)
}
