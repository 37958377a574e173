//! Where the frames of a job go.

use super::recipe::Recipes;
use crate::error::Result;
use crate::output::manifest::{Header, Journal};
use crate::output::maps::Map;
use crate::output::{Format, FramePattern, WriteOptions};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Temporary files of other machines' processes are cleared away once they are this old: on a shared
/// folder a younger one may belong to one that lives.
pub(super) const LEFTOVER_AGE: Duration = Duration::from_secs(60);

/// Where the frames of a job go, and what they all share.
#[derive(Debug, Clone)]
pub struct Target {
    /// Where frame n lies.
    pub pattern: FramePattern,
    /// What the frames share.
    pub header: Header,
    /// What each frame of the shot is made of.
    pub recipes: Recipes,
    /// How films become files.
    pub write: WriteOptions,
    /// Whether frames that exist are replaced.
    pub overwrite: bool,
}

impl Target {
    /// Whether frames have maps in files of their own.
    pub fn has_map_files(&self) -> bool {
        self.write.maps.is_some() && self.pattern.format() != Format::Exr
    }

    /// Where rank `rank` appends its rows: to the manifest itself, at `path`, or its part of that.
    ///
    /// # Errors
    /// It cannot be opened, or is of other settings.
    pub fn journal(&self, rank: u32, path: &Path) -> Result<Journal> {
        if rank == 0 { Journal::of(path, &self.header) } else { Journal::open(path) }
    }

    /// Every file that frame `frame` has.
    pub(super) fn paths(&self, frame: u32) -> Vec<PathBuf> {
        let frame = self.pattern.path(frame);
        let maps = Map::ALL.iter().filter(|_| self.has_map_files());
        let maps: Vec<PathBuf> = maps.map(|map| map.path(&frame)).collect();
        std::iter::once(frame).chain(maps).collect()
    }
}
