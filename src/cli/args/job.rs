//! Options of a job: which frames, where they go, for how long.

use super::{put, whole};
use crate::cli::values::{self, FrameRequest};
use crate::error::{Error, Result};
use crate::scene::{JobOptions, SaveInterval, limits};
use clap::Args;
use std::path::PathBuf;
use std::time::Duration;

/// Frames and output, for `render`.
#[derive(Debug, Args)]
pub struct JobArgs {
    /// Where frames go; #### is the frame number, the ending chooses png, exr (linear; see --aovs)
    /// or ppm [default: out/<scene>/frame_####.png]
    #[arg(short, long, value_name = "PATTERN")]
    pub output: Option<String>,
    /// Frames to render, counted from 1, both ends included: 7, 1..16, 5.. [default: all]
    #[arg(long, value_name = "RANGE", value_parser = values::frames)]
    pub frames: Option<FrameRequest>,
    /// Replace frames that exist
    #[arg(long)]
    pub overwrite: bool,
    /// Fail (exit code 1, frames written) where a sample is NaN, infinite or negative, or where inferred
    /// frames are less accurate than traced ones and off by more than --tolerance
    #[arg(long)]
    pub strict: bool,
    /// Make no video of the sequence
    #[arg(long, overrides_with = "video")]
    pub no_video: bool,
    /// Make a video even where the scene file says not to
    #[arg(long)]
    pub video: bool,
    /// Write maps of where each frame's light comes from (traced or inferred, from which frame, at what
    /// distance), of its audited errors, and with --spp MIN..MAX of the numbers of camera samples; as pictures
    /// beside png and ppm frames, as channels of exr frames
    #[arg(long, help_heading = "Reuse")]
    pub maps: bool,
    /// Surface policy: infer also from the exr frames in this folder, made by an earlier job of the same
    /// scene; repeatable
    #[arg(long, value_name = "DIR", help_heading = "Reuse")]
    pub references: Vec<PathBuf>,
    /// Colour policy: take this picture (png, ppm, jpeg, exr) for frame FRAME, and infer others
    /// from it too; repeatable
    #[arg(long, value_name = "FRAME=FILE", help_heading = "Reuse", value_parser = values::upload)]
    pub upload: Vec<(u32, PathBuf)>,
    /// Stop after this long and exit with code 75: 25m, 1h30m, 90s, or as Slurm writes it: 30 (minutes),
    /// 00:30:00, 1-12; counted from the program's start. In a Slurm job at the latest 30 s before its end
    #[arg(long, value_name = "TIME", value_parser = values::time_limit)]
    pub time_limit: Option<Duration>,
    /// How often references that later frames need are written to disk, so that they need not be traced
    /// again after a kill: 30s, 5m, off [default: 30s]
    #[arg(long, value_name = "TIME", value_parser = values::time_or_off)]
    pub checkpoint: Option<SaveInterval>,
    /// In an MPI job: most discoveries (points or pixels that one rank traced and others use) in one
    /// message [default: 100000]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(1, limits::MAX_EXCHANGE))]
    pub exchange: Option<u32>,
    /// Write times, rays and memory of the job to this file, as JSON
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,
    /// Rendering threads [default: the cores this process may use]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(1, limits::MAX_THREADS))]
    pub threads: Option<u32>,
    /// Which ranks of an MPI job share a node: a file with a line `RANK NODE` for each; neighbouring
    /// segments stay on one node [default: as the ranks share memory]
    #[arg(long, value_name = "FILE")]
    pub rank_map: Option<PathBuf>,
    /// Print nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
}

impl JobArgs {
    /// Overrides `options` with the options that were given, for a shot of `count` frames.
    ///
    /// Errors: `Error::Usage` for frames that the shot does not have.
    pub fn apply(&self, options: &mut JobOptions, count: u32) -> Result<()> {
        let o = options;
        if let Some(request) = self.frames {
            o.frames = Some(request.of_shot(count).map_err(Error::Usage)?);
        }
        if self.output.is_some() {
            o.output.clone_from(&self.output);
        }
        if self.stats.is_some() {
            o.stats.clone_from(&self.stats);
        }
        o.overwrite |= self.overwrite;
        o.strict |= self.strict;
        o.video = self.video || (o.video && !self.no_video);
        o.maps |= self.maps;
        o.references.extend_from_slice(&self.references);
        o.uploads.extend_from_slice(&self.upload);
        o.time_limit = self.time_limit.or(o.time_limit);
        put(&mut o.checkpoint, self.checkpoint.map(|SaveInterval(time)| time));
        put(&mut o.exchange, self.exchange);
        o.threads = self.threads.or(o.threads);
        Ok(())
    }
}
