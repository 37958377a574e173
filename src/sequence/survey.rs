//! The state of a sequence on disk, from its manifest and files; changes nothing.

use crate::error::{Error, Result};
use crate::output::manifest::{Foreign, Manifest, MapRow, Row, folder_of};
use crate::output::{FramePattern, PathKind};
use crate::scene::FrameRange;
use rayon::prelude::*;
use serde::Serialize;
use std::path::Path;

/// The frames of a sequence by their state on disk; each list ascends.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Survey {
    /// Pattern of the frames' paths.
    pub frames: String,
    /// Whether every frame that was asked about is there.
    pub complete: bool,
    /// Frames that were asked about.
    pub total: u32,
    /// Frames that are there, whole, and of this sequence.
    pub done: Vec<u32>,
    /// Frames that are not there.
    pub missing: Vec<u32>,
    /// Frames whose file has another hash than in the manifest, or is not in it.
    pub damaged: Vec<u32>,
    /// Damaged frames whose picture is whole, but one of whose maps is missing or damaged.
    #[serde(skip)]
    pub without_map: Vec<u32>,
    /// Frames of other settings.
    pub other_settings: Vec<u32>,
    /// Frames of another camera move, or of a shorter or longer one.
    pub other_move: Vec<u32>,
    /// Frames in the manifest that the camera move does not have any more.
    pub beyond: Vec<u32>,
}

/// The state of the frames in the manifest at `path`. `range` returns the frames to look at, from the
/// number of frames of the shot; of a file for a single frame, whose name has no number, only that frame is looked at.
///
/// Errors: there is no manifest, or it cannot be read; errors of `range`.
pub fn survey(path: &Path, range: impl Fn(u32) -> Result<FrameRange>) -> Result<Survey> {
    let missing = || Error::Usage(format!("there is no manifest {}", path.display()));
    survey_of(&Manifest::as_of_now(path)?.ok_or_else(missing)?, path, range)
}

/// [`survey`] for a manifest that was read from `path`.
///
/// # Errors
/// A frame cannot be read; errors of `range`.
pub fn survey_of(
    manifest: &Manifest,
    path: &Path,
    range: impl Fn(u32) -> Result<FrameRange>,
) -> Result<Survey> {
    let folder = folder_of(path);
    let asked = range(manifest.header.shot_frames)?;
    let FrameRange { first, last } = single_frame(manifest, asked).unwrap_or(asked);
    let files = folder.join(&manifest.header.files).display().to_string();
    let pattern = FramePattern::parse(&files, last - first + 1)?;
    let stand = |frame| Ok((frame, state_of(&pattern, folder, frame, manifest)?));
    let frames: Vec<Result<(u32, FrameState)>> =
        (first..=last).into_par_iter().map(stand).collect();
    let frames = frames.into_iter().collect::<Result<Vec<_>>>()?;
    let any = |wanted: &[FrameState]| -> Vec<u32> {
        frames.iter().filter(|(_, s)| wanted.contains(s)).map(|(f, _)| *f).collect()
    };
    let all = |wanted| any(&[wanted]);
    let done = all(FrameState::Done);
    let beyond = manifest.rows.values().filter(|row| row.frame > manifest.header.shot_frames);
    let is_there = |row: &&Row| folder.join(&row.file).exists();
    Ok(Survey {
        frames: pattern.to_string(),
        complete: done.len() == frames.len(),
        total: last - first + 1,
        done,
        missing: all(FrameState::Missing),
        damaged: any(&[FrameState::Damaged, FrameState::WithoutMap]),
        without_map: all(FrameState::WithoutMap),
        other_settings: all(FrameState::Foreign(Foreign::OtherSettings)),
        other_move: all(FrameState::Foreign(Foreign::OtherMove)),
        beyond: beyond.filter(is_there).map(|row| row.frame).collect(),
    })
}

/// The frame of a sequence whose file's name has no number, if it is among those that are `asked` about.
fn single_frame(manifest: &Manifest, asked: FrameRange) -> Option<FrameRange> {
    if manifest.header.files.contains('#') {
        return None;
    }
    let frame = *manifest.rows.range(asked.first..=asked.last).next()?.0;
    Some(FrameRange { first: frame, last: frame })
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum FrameState {
    Done,
    Missing,
    Damaged,
    WithoutMap,
    Foreign(Foreign),
}

fn state_of(
    pattern: &FramePattern,
    folder: &Path,
    frame: u32,
    manifest: &Manifest,
) -> Result<FrameState> {
    let path = pattern.path(frame);
    let Some(row) = manifest.rows.get(&frame) else {
        return Ok(if path.exists() { FrameState::Damaged } else { FrameState::Missing });
    };
    let Some(is_whole) = is_whole(&path, Some(row.bytes), &row.blake3)? else {
        return Ok(FrameState::Missing);
    };
    let same_name = path.file_name().is_some_and(|name| name == row.file.as_str());
    let maps = row.maps.iter().map(|map| is_whole_map(folder, map));
    let with_maps = maps.collect::<Result<Vec<bool>>>()?;
    Ok(match row.stray {
        Some(stray) => FrameState::Foreign(stray),
        None if !same_name || !is_whole => FrameState::Damaged,
        None if with_maps.iter().all(|m| *m) => FrameState::Done,
        None => FrameState::WithoutMap,
    })
}

/// Whether a frame's map in `folder` exists and has the hash in its row.
///
/// # Errors
/// The file exists and cannot be read.
pub fn is_whole_map(folder: &Path, map: &MapRow) -> Result<bool> {
    Ok(is_whole(&folder.join(&map.file), None, &map.blake3)? == Some(true))
}

/// Whether `path` is a file of `bytes` bytes (if given) with this hash; `None` if there is no file.
fn is_whole(path: &Path, bytes: Option<u64>, hash: &str) -> Result<Option<bool>> {
    let file = match PathKind::at(path)? {
        PathKind::Nothing => return Ok(None),
        PathKind::Other => return Ok(Some(false)),
        PathKind::File(file) => file,
    };
    let is_as_long = bytes.is_none_or(|bytes| bytes == file.bytes);
    Ok(Some(is_as_long && file.hash(path)? == hash))
}
