//! `--references`: frames of an earlier job of the same scene.

use super::exit::as_input;
use super::machine;
use crate::effects::EffectPlan;
use crate::error::{Error, Result, counted};
use crate::output::{FramePattern, exr};
use crate::reuse::store::{ATTRIBUTE, Terms, decode};
use crate::reuse::{self, Reference};
use crate::scene::{Policy, Scene, Settings};
use std::fs;
use std::path::{Path, PathBuf};

/// Largest file that is read.
const LARGEST: u64 = 2 << 30;

/// What the user supplies.
pub struct References {
    /// Sorted by content, so that names and folders do not matter.
    pub list: Vec<Reference>,
    /// What tells this set from others; `none` for none.
    pub hash: String,
}

/// On which terms this job's frames and others serve one another.
pub fn terms(world: &str, scene: &Scene, settings: &Settings) -> Terms {
    let channels = reuse::channels(scene, &EffectPlan::of(scene, settings), settings);
    Terms::of(world, &channels, settings)
}

impl References {
    /// Reads all exr files in `folders` for a job whose frames go to `pattern`.
    ///
    /// Errors: a folder without such files or with the job's own, a file that cannot serve, by name;
    /// more of them than memory holds.
    pub fn read(
        folders: &[PathBuf],
        pattern: &FramePattern,
        scene: &Scene,
        settings: &Settings,
        terms: &Terms,
    ) -> Result<Self> {
        if !folders.is_empty() && settings.reuse.policy != Policy::Surface {
            return Err(Error::Usage("--references needs --policy surface".into()));
        }
        let most = machine::memory().map_or(u64::MAX, |memory| memory / 2);
        let mut found = Vec::new();
        let mut held = 0;
        for file in files(folders, pattern)? {
            let (reference, hash) = read_one(&file, scene, terms).map_err(as_input)?;
            held += reference.memory();
            if held > most {
                return Err(Error::Usage(format!(
                    "the references take more than half of this machine's memory\n  \
                     help: supply fewer of them; {} and the files before it fit nearly",
                    file.display()
                )));
            }
            found.push((hash, reference));
        }
        found.sort_by_key(|(hash, _)| *hash);
        found.dedup_by_key(|(hash, _)| *hash);
        let hash = name_of(&found);
        let known = found.into_iter().map(|(_, reference)| reference);
        Ok(Self { list: known.filter(|r| !r.is_empty()).collect(), hash })
    }
}

impl References {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }
}

fn name_of(found: &[([u8; 32], Reference)]) -> String {
    if found.is_empty() {
        return "none".into();
    }
    let mut all = blake3::Hasher::new();
    for (hash, _) in found {
        all.update(hash);
    }
    format!("{}, {}", counted(found.len(), "frame"), &all.finalize().to_hex()[..16])
}

fn read_one(file: &Path, scene: &Scene, terms: &Terms) -> Result<(Reference, [u8; 32])> {
    let bytes = exr::read_attribute(file, ATTRIBUTE, LARGEST)?.ok_or_else(|| {
        Error::input(
            file,
            "cannot serve as a reference: it holds no traced points\n  \
             help: frames rendered to exr with --policy surface do",
        )
    })?;
    decode(file, &bytes, terms, &scene.recentring)
}

/// The exr files of all folders.
fn files(folders: &[PathBuf], pattern: &FramePattern) -> Result<Vec<PathBuf>> {
    let own = match pattern.folder() {
        folder if folder == Path::new("") => Path::new("."),
        folder => folder,
    };
    let mut all = Vec::new();
    for folder in folders {
        let real = |path: &Path| fs::canonicalize(path).ok();
        if real(folder).is_some_and(|folder| real(own) == Some(folder)) {
            return Err(Error::Usage(format!(
                "--references {} is where this job's own frames go\n  \
                 help: choose another output with -o",
                folder.display()
            )));
        }
        let io = |e| as_input(Error::io("read the folder", folder, e));
        let entries = fs::read_dir(folder).map_err(io)?;
        let paths = entries.map(|e| e.map(|e| e.path())).collect::<std::io::Result<Vec<_>>>();
        let is_exr = |p: &PathBuf| p.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
        let is_shown = |p: &PathBuf| p.file_name().is_none_or(|n| n.as_encoded_bytes()[0] != b'.');
        let mut paths: Vec<_> =
            paths.map_err(io)?.into_iter().filter(|p| is_exr(p) && is_shown(p)).collect();
        if paths.is_empty() {
            let folder = folder.display();
            return Err(Error::Usage(format!("--references {folder}: no exr frame is in there")));
        }
        paths.sort();
        all.append(&mut paths);
    }
    Ok(all)
}
