//! Which frames of a sequence are finished on disk, and which are left to render.

mod refuse;

use super::checkpoint;
use super::recipe::Recipe;
use super::target::{LEFTOVER_AGE, Target};
use crate::error::{Error, Result, counted};
use crate::output::manifest::{Foreign, Header, Manifest, MapRow, Row, Turn, manifest_path};
use crate::output::{PathKind, atomic};
use crate::scene::FrameRange;
use crate::stats::{AuditSums, BadSamples};
use rayon::prelude::*;
pub use refuse::refuse_unlisted;
use refuse::{by_file, refuse_other_view, refuse_others, refuse_taken};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashMap};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Which frames of a job are kept and which rendered.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Frames that exist whole, of the same settings and recipe.
    pub kept: Vec<u32>,
    /// Kept frames with invalid samples, with their numbers of samples.
    pub kept_bad: Vec<(u32, BadSamples)>,
    /// Kept frames that were audited, with the sums of their audits.
    pub kept_audits: Vec<(u32, AuditSums)>,
    /// Frames to render.
    pub render: Vec<u32>,
    /// Notes for the user about frames that are rendered again, damaged ones and others.
    pub notes: Vec<String>,
}

/// Decides which of `frames` are rendered, and makes the manifest ready for their rows.
///
/// A frame with the same camera that is inferred from other frames than before is rendered again, as
/// happens when a shot gets longer.
///
/// Errors: `Error::Usage` if there are frames or references of other settings, or frames of another
/// camera move or without a row, and `target` does not say to replace them.
pub fn prepare(target: &Target, frames: FrameRange) -> Result<Plan> {
    prepare_with(target, frames, None)
}

/// [`prepare`], with the results of [`check_files`] if they are known.
///
/// # Errors
/// As [`prepare`].
pub fn prepare_with(
    target: &Target,
    frames: FrameRange,
    found: Option<Vec<FrameFiles>>,
) -> Result<Plan> {
    atomic::create_folder(target.pattern.folder())?;
    atomic::clean_temporaries(target.pattern.folder(), LEFTOVER_AGE)?;
    let mut plan = plan(target, frames, found)?;
    plan.notes.extend(checkpoint::sweep(target)?);
    Ok(plan)
}

/// Hashes of the files of a frame and its maps on disk.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct FrameFiles {
    frame: u32,
    /// Hash of the frame's file; `None` where there is none.
    hash: Option<String>,
    /// Names of the frame's maps, with their hashes.
    maps: Vec<(String, String)>,
}

/// Whether there may be frames on disk that [`prepare`] has to read.
///
/// # Errors
/// The manifest cannot be read.
pub fn has_frames_to_check(target: &Target) -> Result<bool> {
    if target.overwrite {
        return Ok(false);
    }
    let found = Manifest::read(&manifest_path(&target.pattern))?;
    Ok(found.is_some_and(|manifest| manifest.header.first_difference(&target.header).is_none()))
}

/// Reads and hashes the files of `frames`.
///
/// # Errors
/// A file that is there and cannot be read.
pub fn check_files(target: &Target, frames: Range<u32>) -> Result<Vec<FrameFiles>> {
    let found: Vec<Result<FrameFiles>> =
        frames.into_par_iter().map(|frame| check_file(target, frame)).collect();
    // Of several errors the first frame's is returned, whichever thread was quicker.
    found.into_iter().collect()
}

fn check_file(target: &Target, frame: u32) -> Result<FrameFiles> {
    let paths = target.paths(frame);
    let hash = |path: &PathBuf| match PathKind::at(path)? {
        PathKind::Nothing => Ok(None),
        PathKind::File(file) => file.hash(path).map(Some),
        PathKind::Other => {
            let why = format!("{} is in the way: it is not a regular file", path.display());
            Err(Error::Usage(why))
        }
    };
    let own = hash(&paths[0])?;
    let mut maps = Vec::new();
    for path in paths[1..].iter().filter(|_| own.is_some()) {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        maps.extend(hash(path)?.map(|hash| (name, hash)));
    }
    Ok(FrameFiles { frame, hash: own, maps })
}

fn plan(
    target: &Target,
    frames: FrameRange,
    found_on_disk: Option<Vec<FrameFiles>>,
) -> Result<Plan> {
    let path = manifest_path(&target.pattern);
    let turn = Turn::take(&path)?;
    let found = match Manifest::read(&path) {
        Err(_) if target.overwrite => None,
        read => read?,
    };
    let Some(manifest) = found else {
        refuse_unlisted(target, frames)?;
        if !target.overwrite {
            checkpoint::refuse_others(target)?;
        }
        Manifest::create(&path, &target.header, &[])?;
        return Ok(Plan::all(frames));
    };
    if !target.overwrite {
        refuse_others(target, &manifest, frames)?;
        checkpoint::refuse_others(target)?;
    }
    if manifest.header.first_difference(&target.header).is_some() {
        Manifest::create(&path, &target.header, &left_over(target, &manifest, frames))?;
        return Ok(Plan::all(frames));
    }
    drop(turn);
    Manifest::merge_parts(&path, &target.header)?;
    let rows = Manifest::read(&path)?.map(|m| m.rows).unwrap_or_default();
    let plan = match target.overwrite {
        true => Plan::all(frames),
        false => {
            let found = match found_on_disk {
                Some(found) => found,
                None => check_files(target, frames.first..frames.last + 1)?,
            };
            let files = by_file(&rows);
            let states =
                found.iter().map(|found| Ok((found.frame, state(target, found, (&rows, &files))?)));
            Plan::of(states.collect::<Result<_>>()?, target, manifest.header.shot_frames)
        }
    };
    mark_strays(target, &manifest.header, &rows)?;
    Ok(plan)
}

/// Marks the manifest's rows of frames that are not of this shot, if any mark has changed.
fn mark_strays(target: &Target, before: &Header, rows: &BTreeMap<u32, Row>) -> Result<()> {
    let same_shot = before.shot_hash == target.header.shot_hash;
    if same_shot && rows.values().all(|row| marked(target, row) == *row) {
        return Ok(());
    }
    Manifest::rewrite(&manifest_path(&target.pattern), |found| {
        let rows = found.rows.values().map(|row| marked(target, row)).collect();
        (target.header.clone(), rows)
    })
}

fn marked(target: &Target, row: &Row) -> Row {
    let stray = match row.stray {
        Some(Foreign::OtherSettings) => row.stray,
        _ => (!is_made_of(row, target.recipes.get(row.frame))).then_some(Foreign::OtherMove),
    };
    Row { stray, ..row.clone() }
}

fn is_made_of(row: &Row, recipe: Option<&Recipe>) -> bool {
    recipe.is_some_and(|recipe| recipe.whole.to_string() == row.recipe)
}

/// The state of a frame on disk.
#[allow(clippy::large_enum_variant, reason = "most are the large one")]
enum State {
    Whole(BadSamples, Option<AuditSums>),
    Missing,
    Damaged(Damage),
    /// Whole and of the same camera, but inferred from other frames than it would be now.
    Outdated,
}

/// Why a frame whose file exists is rendered again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Damage {
    Unlisted,
    OtherHash,
    LacksMaps,
}

impl Damage {
    /// A note about frame `first` and `more` others. (If a job was stopped while it replaced frames, the frames
    /// that it had not yet replaced are not in the manifest.)
    fn note(self, first: &Path, more: usize) -> String {
        let why = match (self, more) {
            (Self::Unlisted, 0) => "is not in the manifest",
            (Self::Unlisted, _) => "are not in the manifest",
            (Self::OtherHash, 0) => "is damaged: its hash is not the manifest's",
            (Self::OtherHash, _) => "are damaged: their hashes are not the manifest's",
            (Self::LacksMaps, 0) => "lacks its maps",
            (Self::LacksMaps, _) => "lack their maps",
        };
        let and = if more > 0 { format!(" and {more} more") } else { String::new() };
        format!("{}{and} {why}; rendered again", first.display())
    }
}

fn state(
    target: &Target,
    found: &FrameFiles,
    (rows, files): (&BTreeMap<u32, Row>, &HashMap<&str, &Row>),
) -> Result<State> {
    let frame = found.frame;
    let path = target.pattern.path(frame);
    let Some(hash) = &found.hash else { return Ok(State::Missing) };
    refuse_taken(&path, frame, rows, files)?;
    let Some(row) = rows.get(&frame) else { return Ok(State::Damaged(Damage::Unlisted)) };
    let recipe = target.recipes.get(frame);
    refuse_other_view(&path, row, recipe)?;
    let whole = *hash == row.blake3;
    if whole && !has_maps(target, found, row) {
        return Ok(State::Damaged(Damage::LacksMaps));
    }
    Ok(match whole {
        false => State::Damaged(Damage::OtherHash),
        true if !is_made_of(row, recipe) => State::Outdated,
        true => State::Whole(row.bad, row.audit.map(|a| a.sums)),
    })
}

/// Whether all maps of a frame that the job has exist and have the hashes in its row.
fn has_maps(target: &Target, found: &FrameFiles, row: &Row) -> bool {
    let is_whole = |map: &MapRow| found.maps.contains(&(map.file.clone(), map.blake3.clone()));
    match target.map_files().count() {
        0 => true,
        count => row.maps.len() == count && row.maps.iter().all(is_whole),
    }
}

/// Rows of frames of another sequence that a job over `frames` does not replace.
fn left_over(target: &Target, manifest: &Manifest, frames: FrameRange) -> Vec<Row> {
    let folder = target.pattern.folder();
    let stays = |row: &&Row| {
        let replaced = (frames.first..=frames.last).contains(&row.frame)
            && target.pattern.path(row.frame) == folder.join(&row.file);
        !replaced && folder.join(&row.file).exists()
    };
    let mark = |row: &Row| Row { stray: Some(Foreign::OtherSettings), ..row.clone() };
    manifest.rows.values().filter(stays).map(mark).collect()
}

impl Plan {
    fn all(frames: FrameRange) -> Self {
        Self { render: (frames.first..=frames.last).collect(), ..Self::default() }
    }

    /// `before`: how many frames the shot had when its manifest was written.
    fn of(states: Vec<(u32, State)>, target: &Target, before: u32) -> Self {
        let pattern = &target.pattern;
        let mut plan = Self::default();
        let mut outdated = Vec::new();
        let mut damaged: BTreeMap<Damage, Vec<u32>> = BTreeMap::new();
        for (frame, state) in states {
            match state {
                State::Whole(bad, audit) => {
                    plan.kept_audits.extend(audit.map(|sums| (frame, sums)));
                    plan.kept.push(frame);
                    if !bad.is_none() {
                        plan.kept_bad.push((frame, bad));
                    }
                }
                State::Missing => plan.render.push(frame),
                State::Outdated => {
                    plan.render.push(frame);
                    outdated.push(frame);
                }
                State::Damaged(why) => {
                    plan.render.push(frame);
                    damaged.entry(why).or_default().push(frame);
                }
            }
        }
        let notes = damaged.iter().filter_map(|(why, frames)| {
            frames.first().map(|first| why.note(&pattern.path(*first), frames.len() - 1))
        });
        plan.notes.extend(notes);
        if let [first, ..] = outdated[..] {
            let frames = counted(outdated.len(), "frame");
            let now = target.header.shot_frames;
            // Under policy colour the whole move is one segment.
            let has_segments = target.header.settings["reuse"]["policy"] == "surface";
            let help = match has_segments {
                true => "\n  help: with a smaller --segment from the start more frames stay",
                false => "",
            };
            plan.notes.push(match before == now {
                true => format!(
                    "the camera move has changed: {frames} from frame {first} on, inferred from other \
                     frames before, will be rendered again"
                ),
                false => format!(
                    "the move has {now} frames, not {before}: {frames} from frame {first} on, inferred \
                     from its last one before, will be rendered again{help}"
                ),
            });
        }
        plan
    }
}
