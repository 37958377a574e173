//! What a sequence already holds on disk, and what that leaves to render.

use super::checkpoint;
use super::recipe::{Recipe, Recipes};
use crate::error::{Error, Result, counted};
use crate::output::manifest::{Header, Manifest, MapRow, Row, Stray, manifest_path};
use crate::output::maps::Map;
use crate::output::{Format, FramePattern, WriteOptions, atomic};
use crate::scene::FrameRange;
use crate::stats::{AuditSums, BadSamples};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Temporary files of dead jobs are cleared away once they are this old: on a shared folder a
/// younger one may belong to a process on another machine.
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

    /// Every file that frame `frame` has.
    fn paths(&self, frame: u32) -> Vec<PathBuf> {
        let frame = self.pattern.path(frame);
        let maps = Map::ALL.iter().filter(|_| self.has_map_files());
        let maps: Vec<PathBuf> = maps.map(|map| map.path(&frame)).collect();
        std::iter::once(frame).chain(maps).collect()
    }
}

/// What there is to do.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Frames that exist whole, with the same settings, made of the same.
    pub kept: Vec<u32>,
    /// Those of the kept frames that have samples which are no radiance.
    pub kept_bad: Vec<(u32, BadSamples)>,
    /// What the audits of the kept frames found, if any was audited.
    pub kept_audit: Option<AuditSums>,
    /// Frames to render.
    pub render: Vec<u32>,
    /// What the user should know: damaged frames, and others that are rendered again.
    pub notes: Vec<String>,
}

/// Decides which of `frames` are rendered, and makes the manifest ready for their rows.
///
/// A frame whose camera is the same, but not what it is inferred from, is rendered again: a longer
/// shot goes on where a shorter one ended.
///
/// Errors: `Error::Usage` where frames of other settings, of another camera move, or of unknown
/// origin, are in the way and `target` does not say to replace them.
pub fn prepare(target: &Target, frames: FrameRange) -> Result<Plan> {
    atomic::create_folder(target.pattern.folder())?;
    atomic::clean_temporaries(target.pattern.folder(), LEFTOVER_AGE)?;
    let mut plan = plan(target, frames)?;
    plan.notes.extend(checkpoint::sweep(target)?);
    Ok(plan)
}

fn plan(target: &Target, frames: FrameRange) -> Result<Plan> {
    let path = manifest_path(&target.pattern);
    let found = match Manifest::read(&path) {
        Err(_) if target.overwrite => None,
        read => read?,
    };
    let Some(manifest) = found else {
        refuse_strangers(target, frames)?;
        Manifest::create(&path, &target.header, &[])?;
        return Ok(Plan::all(frames));
    };
    if !target.overwrite {
        refuse_others(target, &manifest, frames)?;
    }
    if manifest.header.first_difference(&target.header).is_some() {
        Manifest::create(&path, &target.header, &left_over(target, &manifest, frames))?;
        return Ok(Plan::all(frames));
    }
    Manifest::merge_parts(&path)?;
    let rows = Manifest::read(&path)?.map(|m| m.rows).unwrap_or_default();
    let plan = match target.overwrite {
        true => Plan::all(frames),
        false => Plan::of(states(target, frames, &rows)?),
    };
    mark_strays(target, &manifest.header, &rows)?;
    Ok(plan)
}

/// Says in the manifest which of its frames are not of this shot, where that is new.
fn mark_strays(target: &Target, before: &Header, rows: &BTreeMap<u32, Row>) -> Result<()> {
    let same_shot = before.shot_hash == target.header.shot_hash;
    let marked: Vec<Row> = rows.values().map(|row| marked(target, row)).collect();
    if same_shot && marked.iter().eq(rows.values()) {
        return Ok(());
    }
    Manifest::create(&manifest_path(&target.pattern), &target.header, &marked)
}

fn marked(target: &Target, row: &Row) -> Row {
    let stray = match row.stray {
        Some(Stray::OtherSettings) => row.stray,
        _ => (!is_made_of(row, target.recipes.get(row.frame))).then_some(Stray::OtherMove),
    };
    Row { stray, ..row.clone() }
}

fn is_made_of(row: &Row, recipe: Option<&Recipe>) -> bool {
    recipe.is_some_and(|recipe| recipe.whole.to_string() == row.recipe)
}

fn states(
    target: &Target,
    frames: FrameRange,
    rows: &BTreeMap<u32, Row>,
) -> Result<Vec<(u32, State)>> {
    let states: Vec<Result<(u32, State)>> = (frames.first..=frames.last)
        .into_par_iter()
        .map(|frame| Ok((frame, state(target, frame, rows)?)))
        .collect();
    // Of several refusals the first frame's is told, whichever thread was quicker.
    states.into_iter().collect()
}

/// How a frame stands on disk.
enum State {
    Whole(BadSamples, Option<AuditSums>),
    Missing,
    Damaged(String),
    /// Seen by the same camera, but inferred from other frames.
    Outdated,
}

fn state(target: &Target, frame: u32, rows: &BTreeMap<u32, Row>) -> Result<State> {
    let path = target.pattern.path(frame);
    let name = path.display();
    let row = rows.get(&frame);
    let bytes = match fs::read(&path) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(State::Missing),
        read => read.map_err(|e| Error::io("read", &path, e))?,
    };
    refuse_taken(&path, frame, rows)?;
    let Some(row) = row else {
        return Ok(State::Damaged(format!("{name} is not in the manifest; rendered again")));
    };
    let recipe = target.recipes.get(frame);
    refuse_other_view(&path, row, recipe)?;
    let whole = blake3::hash(&bytes).to_hex().as_str() == row.blake3;
    let note = || format!("{name} is damaged: its hash is not the manifest's; rendered again");
    if whole && target.has_map_files() && !has_maps(target, row) {
        return Ok(State::Damaged(format!("{name} lacks its maps; rendered again")));
    }
    Ok(match whole {
        false => State::Damaged(note()),
        true if !is_made_of(row, recipe) => State::Outdated,
        true => State::Whole(row.bad, row.audit.map(|a| a.sums)),
    })
}

/// Refuses to replace a frame that shows something else than this shot's frame of that number.
fn refuse_other_view(path: &Path, row: &Row, recipe: Option<&Recipe>) -> Result<()> {
    if recipe.is_some_and(|recipe| recipe.view.to_string() == row.view) {
        return Ok(());
    }
    Err(Error::Usage(format!(
        "{} is of another camera move: frame {} stands elsewhere there\n  \
         help: choose another output with -o, or replace it with --overwrite",
        path.display(),
        row.frame
    )))
}

/// Whether all maps of a frame are there, as they were written.
fn has_maps(target: &Target, row: &Row) -> bool {
    let is_whole = |map: &MapRow| {
        let bytes = fs::read(target.pattern.folder().join(&map.file));
        bytes.is_ok_and(|b| blake3::hash(&b).to_hex().as_str() == map.blake3)
    };
    row.maps.len() == Map::ALL.len() && row.maps.iter().all(is_whole)
}

/// Frames of another sequence that a job over `frames` does not replace.
fn left_over(target: &Target, manifest: &Manifest, frames: FrameRange) -> Vec<Row> {
    let folder = target.pattern.folder();
    let stays = |row: &&Row| {
        let replaced = (frames.first..=frames.last).contains(&row.frame)
            && target.pattern.path(row.frame) == folder.join(&row.file);
        !replaced && folder.join(&row.file).exists()
    };
    let mark = |row: &Row| Row { stray: Some(Stray::OtherSettings), ..row.clone() };
    manifest.rows.values().filter(stays).map(mark).collect()
}

/// Refuses to replace a file that holds a frame of other settings, or another frame.
fn refuse_taken(path: &Path, frame: u32, rows: &BTreeMap<u32, Row>) -> Result<()> {
    let here = |row: &&Row| path.file_name().is_some_and(|name| name == row.file.as_str());
    let is_taken = |row: &&Row| here(row) && row.stray == Some(Stray::OtherSettings);
    let holds = match rows.values().find(is_taken) {
        Some(_) => "a frame of other settings".to_string(),
        None if rows.contains_key(&frame) => return Ok(()),
        None => match rows.values().find(here) {
            Some(row) => format!("frame {}", row.frame),
            None => return Ok(()),
        },
    };
    Err(Error::Usage(format!(
        "{} holds {holds}\n  \
         help: choose another output with -o, or replace it with --overwrite",
        path.display()
    )))
}

impl Plan {
    fn all(frames: FrameRange) -> Self {
        Self { render: (frames.first..=frames.last).collect(), ..Self::default() }
    }

    fn of(states: Vec<(u32, State)>) -> Self {
        let mut plan = Self::default();
        let mut outdated = Vec::new();
        for (frame, state) in states {
            match state {
                State::Whole(bad, audit) => {
                    if let Some(sums) = audit {
                        *plan.kept_audit.get_or_insert_default() += sums;
                    }
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
                State::Damaged(note) => {
                    plan.render.push(frame);
                    plan.notes.push(note);
                }
            }
        }
        if let [first, ..] = outdated[..] {
            plan.notes.push(format!(
                "the camera move has changed: {} from frame {first} on, inferred from other frames \
                 before, will be rendered again",
                counted(outdated.len(), "frame")
            ));
        }
        plan
    }
}

/// Refuses frames that no manifest vouches for: they may be somebody's work.
fn refuse_strangers(target: &Target, frames: FrameRange) -> Result<()> {
    let mut in_the_way = (frames.first..=frames.last).flat_map(|f| target.paths(f));
    match in_the_way.find(|path| path.exists()) {
        Some(path) if !target.overwrite => Err(Error::Usage(format!(
            "{} exists, and no manifest beside it says how it was made\n  \
             help: choose another output with -o, or replace it with --overwrite",
            path.display()
        ))),
        _ => Ok(()),
    }
}

/// Refuses frames of other settings, as long as any is left.
fn refuse_others(target: &Target, manifest: &Manifest, frames: FrameRange) -> Result<()> {
    let Some(d) = manifest.header.first_difference(&target.header) else { return Ok(()) };
    let folder = target.pattern.folder();
    let left = manifest.rows.values().filter(|row| folder.join(&row.file).exists()).count();
    if left == 0 {
        return refuse_strangers(target, frames);
    }
    Err(Error::Usage(format!(
        "{} holds {} of other settings: {} was {}, now it is {}\n  \
         help: set it back, choose another output with -o, or replace the frames with --overwrite",
        target.pattern,
        counted(left, "frame"),
        d.name,
        d.before,
        d.now
    )))
}
