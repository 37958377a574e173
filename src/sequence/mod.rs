//! One frame after another: camera, film, whole file, manifest row.
//!
//! [`prepare`] looks at what is on disk and decides which frames are kept and which rendered;
//! [`render_frames`] renders some of these, in order. What makes a film is a parameter
//! ([`FrameMaker`]); [`Tracer`] is the maker that traces every frame. [`checkpoint`] keeps what frames
//! to come need on disk; [`survey`] says how a sequence stands. A row follows the rename of
//! its frame, so whatever moment the job ends at, rows name whole frames only.
//!
//! Not done: writing a frame does not overlap tracing the next; every frame is traced alone.

pub mod checkpoint;
mod colour;
mod fingerprint;
mod pyramid;
mod recipe;
mod resume;
mod saved;
mod schedule;
mod shared;
mod strips;
mod supplied;
mod surface_reuse;
pub mod survey;
mod tracer;

pub use colour::{ColourMaker, check_upload};
pub use fingerprint::{WorldHash, fingerprint, shot_fingerprint};
pub use pyramid::Pyramid;
pub use recipe::{Recipe, Recipes, Tag};
pub use resume::{
    FrameFiles, Plan, Target, check_files, has_frames_to_check, prepare, prepare_with,
    refuse_unlisted,
};
pub use schedule::Schedule;
pub use shared::{Exported, JoinedStrips, RankMaker, Strip};
pub use supplied::{ReferenceCache, ReferenceInfo};
pub use surface_reuse::SurfaceReuse;
pub use tracer::Tracer;

#[cfg(test)]
mod tests;

use crate::error::Result;
use crate::film::Film;
use crate::output::manifest::{AuditRow, Journal, MapRow, Row};
use crate::output::maps::Map;
use crate::output::{WriteOptions, write_image};
use crate::reuse::audit::rmse;
use crate::reuse::store::ATTRIBUTE;
use crate::scene::{Camera, Settings, Shot};
use crate::stats::{AuditSums, BadSamples, RayCounts, ReuseCounts};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// Makes the film of a frame.
pub trait FrameMaker {
    /// Frame `frame` (from 1), or `None` when the job was asked to stop first.
    fn make(&self, frame: u32) -> Result<Option<Made>>;

    /// `frames` (ascending) in the order in which they are best made, cut into lists that have
    /// little to do with one another.
    fn batches(&self, frames: &[u32]) -> Vec<Vec<u32>> {
        frames.iter().map(|frame| vec![*frame]).collect()
    }

    /// Hears which frames it will be asked for, before the first of them.
    fn expect(&self, _frames: &[u32]) {}

    /// Hears that no more frames will be asked for although some are not made: puts away what it
    /// takes to go on later.
    fn stopped(&self) {}

    /// Notes for the user about the frames made so far; each is given once.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }

    /// What it took to put references on disk so far.
    fn save_cost(&self) -> SaveCost {
        SaveCost::default()
    }

    /// The most memory that references took at a time so far, bytes.
    fn reference_memory(&self) -> u64 {
        0
    }
}

/// What putting references on disk takes.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SaveCost {
    /// Wall seconds to encode, write and sync them.
    pub seconds: f64,
    /// Bytes written.
    pub bytes: u64,
}

/// A frame as it was made.
pub struct Made {
    /// Its film.
    pub film: Film,
    /// Rays cast for it.
    pub rays: RayCounts,
    /// How much of it was inferred.
    pub reuse: ReuseCounts,
    /// How good the inferred part is, where that was looked at.
    pub audit: Option<AuditSums>,
    /// What its exr file keeps for later jobs, see [`crate::reuse::store`].
    pub reference: Option<Arc<[u8]>>,
}

impl Made {
    /// The same frame once more: no ray was cast for it, and all of it was known.
    fn copy(&self) -> Self {
        let reuse = ReuseCounts {
            direct_inferred: self.reuse.direct,
            specular_inferred: self.reuse.specular,
            ..self.reuse
        };
        Self {
            film: self.film.clone(),
            rays: RayCounts::default(),
            reuse,
            audit: None,
            reference: self.reference.clone(),
        }
    }
}

/// What a finished frame took.
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
    /// How much was inferred.
    #[serde(default, skip_serializing_if = "ReuseCounts::is_none")]
    pub reuse: ReuseCounts,
    /// How good the inferred part is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub audit: Option<AuditRow>,
    /// Invalid camera samples.
    #[serde(default, skip_serializing_if = "BadSamples::is_none")]
    pub bad: BadSamples,
}

/// Renders `frames` in order into `target` as rank `rank`; rows go to the journal at `journal`.
/// `done` hears of each finished frame. Ends early, without an error, when `maker` gives no film.
///
/// Errors: whatever making or writing a frame met; the frames before it are finished.
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
        let Some(report) = render_frame(target, frame, (rank, &mut journal), maker)? else {
            maker.stopped();
            return Ok(());
        };
        done(&report)?;
    }
    Ok(())
}

/// Renders `frame` into `target`, its row, as one of rank `rank`, into `journal`; `None` when `maker` gives no film.
///
/// # Errors
/// Whatever making or writing the frame met.
pub fn render_frame(
    target: &Target,
    frame: u32,
    (rank, journal): (u32, &mut Journal),
    maker: &(impl FrameMaker + ?Sized),
) -> Result<Option<FrameReport>> {
    let start = Instant::now();
    let Some(made) = maker.make(frame)? else { return Ok(None) };
    let trace_seconds = start.elapsed().as_secs_f64();
    let audit = made.audit.map(|sums| audit_row(&sums));
    let row = Row { audit, rank, ..write_frame(target, frame, &made, start)? };
    journal.append(&row)?;
    let write_seconds = start.elapsed().as_secs_f64() - trace_seconds;
    let Row { bytes, bad, rays, reuse, .. } = row;
    Ok(Some(FrameReport { frame, trace_seconds, write_seconds, bytes, rays, reuse, audit, bad }))
}

/// What an audit found, with the figures that it amounts to.
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

/// The camera of the frame before `frame`, world space; `None` where there is none.
///
/// Errors: the camera's.
fn previous_camera(shot: &Shot, frame: u32, settings: &Settings) -> Result<Option<Camera>> {
    let camera = |frame| shot.camera(frame, settings.width, settings.height);
    (frame > 1).then(|| camera(frame - 1)).transpose()
}

/// Writes the frame's file whole; gives its row.
fn write_frame(target: &Target, frame: u32, made: &Made, start: Instant) -> Result<Row> {
    let Made { film, rays, reuse, .. } = made;
    let path = target.pattern.path(frame);
    let attribute = made.reference.as_ref().map(|bytes| (ATTRIBUTE, bytes.clone()));
    // No frame number: a still camera is to give the same bytes in every frame.
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
        // A clock before 1970 tells no time.
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
