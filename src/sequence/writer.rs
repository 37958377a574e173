//! Frames to files, beside tracing: one thread encodes, writes and lists the frames that another has made.
//!
//! The thread that makes frames hands each to a [`FrameWriter`] through [`frame_channel`], which holds none: it
//! waits until the frame before is written. So while one frame is traced, at most one other is in memory to be
//! written. Frames are written in the order in which they were made, and each is listed after its rename,
//! as if one thread did all.

use super::maker::Made;
use super::target::Target;
use crate::error::{Error, Result};
use crate::output::manifest::{AuditRow, Journal, MapRow, Row};
use crate::output::{WriteOptions, write_image};
use crate::reuse::audit::rmse;
use crate::reuse::store::ATTRIBUTE;
use crate::stats::{AuditSums, BadSamples, RayCounts, ReuseCounts};
use rayon::{ThreadPool, ThreadPoolBuilder};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// The costs and counts of a finished frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameReport {
    /// Frame number, from 1.
    pub frame: u32,
    /// Wall seconds from the camera to the film.
    pub trace_seconds: f64,
    /// Wall seconds to encode, write and sync the file and its row, while the next frame is traced.
    pub write_seconds: f64,
    /// Size of the file.
    pub bytes: u64,
    /// Rays cast.
    pub rays: RayCounts,
    /// Mean number of camera samples of a pixel; `None` where all pixels take as many.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub samples: Option<f64>,
    /// Surface points inferred.
    #[serde(default, skip_serializing_if = "ReuseCounts::is_none")]
    pub reuse: ReuseCounts,
    /// The audit of the inferred pixels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub audit: Option<AuditRow>,
    /// Invalid camera samples.
    #[serde(default, skip_serializing_if = "BadSamples::is_none")]
    pub bad: BadSamples,
}

/// A frame to be written.
pub struct MadeFrame {
    /// Its number, from 1.
    pub frame: u32,
    /// The film, and what was counted.
    pub made: Made,
    /// Wall seconds that it took to make.
    pub trace_seconds: f64,
}

/// The two ends of the way from the thread that makes frames to its [`FrameWriter`].
pub fn frame_channel() -> (SyncSender<MadeFrame>, Receiver<MadeFrame>) {
    sync_channel(0)
}

/// Where a rank's frames go, and the threads that encode them.
#[derive(Clone, Copy)]
pub struct WriterContext<'a> {
    /// The job.
    pub target: &'a Target,
    /// The number of the rank.
    pub rank: u32,
    /// Path of the rank's journal.
    pub journal: &'a Path,
    /// How many threads encode. They are beside those that trace.
    pub threads: usize,
}

/// Writes the frames of a rank.
pub struct FrameWriter<'a> {
    context: WriterContext<'a>,
    /// The threads that encode: those that trace would not come to it before the next frame is traced.
    pool: ThreadPool,
    /// The journal; `None` before the first frame.
    journal: Option<Journal>,
}

impl<'a> FrameWriter<'a> {
    /// A writer, which opens its journal for the first frame.
    ///
    /// # Errors
    /// The system has no more threads.
    pub fn new(context: WriterContext<'a>) -> Result<Self> {
        let threads = context.threads;
        let pool = ThreadPoolBuilder::new().num_threads(threads).build();
        let pool =
            pool.map_err(|e| Error::Failed(format!("cannot start {threads} threads: {e}")))?;
        Ok(Self { context, pool, journal: None })
    }

    /// Opens the journal now.
    ///
    /// # Errors
    /// The file cannot be opened, or is of other settings.
    pub fn open_journal(&mut self) -> Result<&mut Journal> {
        let WriterContext { target, rank, journal, .. } = self.context;
        Ok(match &mut self.journal {
            Some(journal) => journal,
            none => none.insert(target.journal(rank, journal)?),
        })
    }

    /// Writes all frames of `frames` until no more can come, and calls `done` after each.
    ///
    /// # Errors
    /// The first error of writing a frame; the frames before it are finished, and no more are taken.
    pub fn write_all(
        mut self,
        frames: Receiver<MadeFrame>,
        done: &mut dyn FnMut(FrameReport) -> Result<()>,
    ) -> Result<()> {
        frames.into_iter().try_for_each(|made| done(self.write(made)?))
    }

    /// Writes a frame's maps, then its image, and appends its row to this rank's journal. Returns its times and counts.
    fn write(
        &mut self,
        MadeFrame { frame, made, trace_seconds }: MadeFrame,
    ) -> Result<FrameReport> {
        let start = Instant::now();
        let files = self.pool.install(|| write_files(self.context.target, frame, &made))?;
        let audit = made.audit.map(|sums| audit_row(&sums));
        let seconds = trace_seconds + start.elapsed().as_secs_f64();
        let row = Row { audit, rank: self.context.rank, seconds, ..files };
        self.open_journal()?.append(&row)?;
        let write_seconds = start.elapsed().as_secs_f64();
        let Row { bytes, bad, rays, samples, reuse, .. } = row;
        Ok(FrameReport {
            frame,
            trace_seconds,
            write_seconds,
            bytes,
            rays,
            samples,
            reuse,
            audit,
            bad,
        })
    }
}

/// The row of an audit: its sums, and the errors that follow from them.
pub fn audit_row(sums: &AuditSums) -> AuditRow {
    let of = |i: crate::measure::Interval| [i.estimate, i.low, i.high];
    let rmse = rmse(sums);
    AuditRow {
        rmse: rmse.map(|r| of(r.shown)),
        rmse_inferred_pixels: rmse.map(|r| of(r.inferred)),
        rmse_traced: rmse.map(|r| of(r.traced)),
        sums: *sums,
    }
}

/// Writes the frame's file and maps; returns its row, without rank, seconds and audit.
fn write_files(target: &Target, frame: u32, made: &Made) -> Result<Row> {
    let Made { film, rays, reuse, .. } = made;
    let path = target.pattern.path(frame);
    let attribute = made.reference.as_ref().map(|bytes| (ATTRIBUTE, bytes.clone()));
    // The file has no frame number, so that a still camera gives the same bytes in every frame.
    let options = WriteOptions { attribute, ..target.write.clone() };
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut maps = Vec::new();
    for map in target.map_files() {
        let (path, written) = map.write(&path, film, &options)?;
        maps.push(MapRow { file: name(&path), blake3: written.hash.to_hex().to_string() });
    }
    let written = write_image(&path, film, &options)?;
    let file = name(&path);
    let recipe = target.recipes.get(frame).copied().unwrap_or_default();
    Ok(Row {
        view: recipe.view.to_string(),
        recipe: recipe.whole.to_string(),
        frame,
        file,
        blake3: written.hash.to_hex().to_string(),
        bytes: written.bytes,
        seconds: 0.0,
        // `None` if the clock is before 1970.
        ended: SystemTime::now().duration_since(UNIX_EPOCH).ok().map(|t| t.as_secs_f64()),
        rank: 0,
        rays: *rays,
        samples: film.mean_samples(),
        reuse: *reuse,
        audit: None,
        bad: film.bad,
        maps,
        stray: None,
    })
}
