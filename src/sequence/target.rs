//! The target of a job: paths of its frames, and the header and recipes that decide what they hold.

use super::recipe::Recipes;
use crate::error::Result;
use crate::output::manifest::{Header, Journal};
use crate::output::maps::{Map, MapScales};
use crate::output::{Format, FramePattern, WriteOptions};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Age from which temporary files of other machines' processes are removed: in a shared folder a younger file
/// may belong to a process that still runs.
pub(super) const LEFTOVER_AGE: Duration = Duration::from_secs(60);

/// Where the frames of a job go, and the data that they share.
#[derive(Debug, Clone)]
pub struct Target {
    /// Path of each frame.
    pub pattern: FramePattern,
    /// The manifest's header, which the frames share.
    pub header: Header,
    /// The recipe of each frame of the shot.
    pub recipes: Recipes,
    /// How films become files.
    pub write: WriteOptions,
    /// Whether frames that exist are replaced.
    pub overwrite: bool,
}

impl Target {
    /// The maps that frames have in files of their own.
    pub fn map_files(&self) -> impl Iterator<Item = Map> {
        let scales = self.write.maps.filter(|_| self.pattern.format() != Format::Exr);
        scales.into_iter().flat_map(MapScales::maps)
    }

    /// The journal to which rank `rank` appends its rows: rank 0 to the manifest at `path`, others to their part
    /// file.
    ///
    /// # Errors
    /// The file cannot be opened, or is of other settings.
    pub fn journal(&self, rank: u32, path: &Path) -> Result<Journal> {
        if rank == 0 { Journal::of(path, &self.header) } else { Journal::open(path) }
    }

    /// Paths of all files of frame `frame`: the picture and its maps.
    pub(super) fn paths(&self, frame: u32) -> Vec<PathBuf> {
        let frame = self.pattern.path(frame);
        let maps: Vec<PathBuf> = self.map_files().map(|map| map.path(&frame)).collect();
        std::iter::once(frame).chain(maps).collect()
    }
}
