//! Files that a job must not replace without `--overwrite`.

use crate::error::{Error, Result, counted};
use crate::output::manifest::{Foreign, Manifest, Row};
use crate::scene::FrameRange;
use crate::sequence::recipe::Recipe;
use crate::sequence::target::Target;
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// Refuses to replace a frame with another camera than this shot's frame of that number.
pub(super) fn refuse_other_view(path: &Path, row: &Row, recipe: Option<&Recipe>) -> Result<()> {
    if recipe.is_some_and(|recipe| recipe.view.to_string() == row.view) {
        return Ok(());
    }
    Err(Error::Usage(format!(
        "{} is of another camera move: frame {} has another camera there\n  \
         help: choose another output with -o, or replace it with --overwrite",
        path.display(),
        row.frame
    )))
}

/// For each file its row; of several rows one of other settings, else the first.
pub(super) fn by_file(rows: &BTreeMap<u32, Row>) -> HashMap<&str, &Row> {
    let mut found = HashMap::new();
    for row in rows.values() {
        let there = found.entry(&*row.file).or_insert(row);
        if row.stray == Some(Foreign::OtherSettings) {
            *there = row;
        }
    }
    found
}

/// Refuses to replace a file that holds a frame of other settings, or another frame.
pub(super) fn refuse_taken(
    path: &Path,
    frame: u32,
    rows: &BTreeMap<u32, Row>,
    files: &HashMap<&str, &Row>,
) -> Result<()> {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let holds = match files.get(name) {
        Some(row) if row.stray == Some(Foreign::OtherSettings) => {
            "a frame of other settings".to_string()
        }
        Some(row) if !rows.contains_key(&frame) => format!("frame {}", row.frame),
        _ => return Ok(()),
    };
    Err(Error::Usage(format!(
        "{} holds {holds}\n  \
         help: choose another output with -o, or replace it with --overwrite",
        path.display()
    )))
}

/// Refuses existing frames that no manifest lists: they may be somebody's work.
///
/// Errors: `Error::Usage` with the first of them.
pub fn refuse_unlisted(target: &Target, frames: FrameRange) -> Result<()> {
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

/// Refuses a manifest of other settings, as long as any of its frames exists.
pub(super) fn refuse_others(
    target: &Target,
    manifest: &Manifest,
    frames: FrameRange,
) -> Result<()> {
    let Some(d) = manifest.header.first_difference(&target.header) else { return Ok(()) };
    let folder = target.pattern.folder();
    let left = manifest.rows.values().filter(|row| folder.join(&row.file).exists()).count();
    if left == 0 {
        return refuse_unlisted(target, frames);
    }
    Err(Error::Usage(format!(
        "{} holds {} of other settings: {}\n  \
         help: restore the setting, choose another output with -o, or replace the frames with --overwrite",
        target.pattern,
        counted(left, "frame"),
        d.was_and_is()
    )))
}
