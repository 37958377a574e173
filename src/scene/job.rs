//! How a job runs: which frames, where they go, for how long. What decides a frame's bytes stands in
//! [`super::Settings`].

use super::FrameRange;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::time::Duration;

/// The options of a job: the scene file's, and the command line's over them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JobOptions {
    /// Frames to render; `None` for all of the shot.
    pub frames: Option<FrameRange>,
    /// Pattern of the frames' names, relative to the current folder; `None` for the default.
    pub output: Option<String>,
    /// Whether frames that exist are replaced.
    pub overwrite: bool,
    /// Whether an invalid sample makes the job fail, or frames that reuse made worse than traced ones.
    pub strict: bool,
    /// Whether a video is made.
    pub video: bool,
    /// Frames per second of the video.
    pub fps: f64,
    /// Whether frames get maps of reuse.
    pub maps: bool,
    /// Folders of an earlier job's frames.
    pub references: Vec<PathBuf>,
    /// Pictures that are taken for frames, by frame number.
    pub uploads: Vec<(u32, PathBuf)>,
    /// How long the program may run, from its start.
    pub time_limit: Option<Duration>,
    /// How much time of tracing a killed job may lose; `None` for any.
    pub checkpoint: Option<Duration>,
    /// How many discoveries a message between ranks carries at most.
    pub exchange: u32,
    /// File for what the job took, relative to the current folder.
    pub stats: Option<PathBuf>,
    /// Rendering threads; `None` for the cores that the process may use.
    pub threads: Option<u32>,
}

impl Default for JobOptions {
    fn default() -> Self {
        Self {
            frames: None,
            output: None,
            overwrite: false,
            strict: false,
            video: true,
            fps: 24.0,
            maps: false,
            references: Vec::new(),
            uploads: Vec::new(),
            time_limit: None,
            // Measured: docs/resume.md, docs/decisions/019-ranks.md.
            checkpoint: Some(Duration::from_secs(30)),
            exchange: 100_000,
            stats: None,
            threads: None,
        }
    }
}
