//! One frame after another: camera, film, whole file, manifest row.
//!
//! [`prepare`] reads the files on disk and decides which frames are kept and which are rendered;
//! [`render_frames`] renders some of these, in order. The maker of films is a parameter
//! ([`FrameMaker`]): [`Tracer`] traces every frame, [`SurfaceReuse`] and [`ColourMaker`] infer. All three
//! have a [`FrameContext`]; the two that infer keep their references in a pool.
//! [`checkpoint`] writes references to disk; [`survey`] reports the state of each frame of a sequence. A row
//! is written after the rename of its frame, so rows always name whole frames, whenever the job ends.
//!
//! Not done: writing a frame does not overlap tracing the next; every frame is traced alone.

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

#[cfg(test)]
mod tests;

use crate::error::{Error, Result};
use crate::output::manifest::{AuditRow, Journal, MapRow, Row};
use crate::output::maps::Map;
use crate::output::{WriteOptions, write_image};
use crate::reuse::audit::rmse;
use crate::reuse::store::ATTRIBUTE;
use crate::stats::{AuditSums, BadSamples, RayCounts, ReuseCounts};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// The costs and counts of a finished frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameReport {
    /// Frame number, from 1.
    pub frame: u32,
    /// Wall seconds from the camera to the film.
    pub trace_seconds: f64,
    /// Wall seconds to encode, write and sync the file and its row.
    pub write_seconds: f64,
    /// Size of the file.
    pub bytes: u64,
    /// Rays cast.
    pub rays: RayCounts,
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

/// Renders `frames` in order into `target` as rank `rank`; rows go to the journal at `journal`.
/// `done` is called with each finished frame. Ends early, without an error, when `maker` was asked to stop.
///
/// Errors: those of making or writing a frame; the frames before it are finished.
pub fn render_frames(
    target: &Target,
    frames: &[u32],
    (rank, journal): (u32, &Path),
    maker: &(impl FrameMaker + ?Sized),
    done: &mut dyn FnMut(&FrameReport) -> Result<()>,
) -> Result<()> {
    if frames.is_empty() {
        return Ok(());
    }
    let mut journal = target.journal(rank, journal)?;
    for &frame in frames {
        match render_frame(target, frame, (rank, &mut journal), maker) {
            Err(Error::Stopped) => {
                maker.stopped();
                return Ok(());
            }
            report => done(&report?)?,
        }
    }
    Ok(())
}

/// Renders `frame` into `target` and appends its row, of rank `rank`, to `journal`.
///
/// # Errors
/// Errors of making or writing the frame.
pub fn render_frame(
    target: &Target,
    frame: u32,
    (rank, journal): (u32, &mut Journal),
    maker: &(impl FrameMaker + ?Sized),
) -> Result<FrameReport> {
    let start = Instant::now();
    let made = maker.make(frame)?;
    let trace_seconds = start.elapsed().as_secs_f64();
    let audit = made.audit.map(|sums| audit_row(&sums));
    let row = Row { audit, rank, ..write_frame(target, frame, &made, start)? };
    journal.append(&row)?;
    let write_seconds = start.elapsed().as_secs_f64() - trace_seconds;
    let Row { bytes, bad, rays, reuse, .. } = row;
    Ok(FrameReport { frame, trace_seconds, write_seconds, bytes, rays, reuse, audit, bad })
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

/// Writes the frame's file and maps; returns its row.
fn write_frame(target: &Target, frame: u32, made: &Made, start: Instant) -> Result<Row> {
    let Made { film, rays, reuse, .. } = made;
    let path = target.pattern.path(frame);
    let attribute = made.reference.as_ref().map(|bytes| (ATTRIBUTE, bytes.clone()));
    // The file has no frame number, so that a still camera gives the same bytes in every frame.
    let options = WriteOptions { attribute, ..target.write.clone() };
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut maps = Vec::new();
    if target.has_map_files() {
        for map in Map::ALL {
            let (path, written) = map.write(&path, film, &options)?;
            maps.push(MapRow { file: name(&path), blake3: written.hash.to_hex().to_string() });
        }
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
        seconds: start.elapsed().as_secs_f64(),
        // `None` if the clock is before 1970.
        ended: SystemTime::now().duration_since(UNIX_EPOCH).ok().map(|t| t.as_secs_f64()),
        rank: 0,
        rays: *rays,
        reuse: *reuse,
        audit: None,
        bad: film.bad,
        maps,
        stray: None,
    })
}
