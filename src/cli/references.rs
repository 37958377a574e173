//! `--references`: frames of an earlier job of the same scene.

use super::exit::as_input;
use super::machine;
use crate::cluster::Communicator;
use crate::error::{Error, Result, counted};
use crate::output::FramePattern;
use crate::reuse;
use crate::reuse::store::Compatibility;
use crate::scene::{Policy, Scene, Settings};
use crate::sequence::{ReferenceCache, ReferenceInfo};
use std::ffi::OsString;
use std::fs;
use std::os::unix::ffi::OsStringExt;
use std::path::{Path, PathBuf};

/// References that the user supplies.
pub struct References {
    /// The references, which are read when frames need them; `None` for none.
    pub cache: Option<ReferenceCache>,
    /// Hash of the set of references; `none` for none.
    pub hash: String,
}

/// The compatibility that references must have for this job, in a world with the hash `world`.
pub fn terms(world: &str, scene: &Scene, settings: &Settings) -> Compatibility {
    let channels = reuse::channels(scene, settings);
    Compatibility::of(world, &channels, settings)
}

impl References {
    /// Checks all exr files in `folders`, for a job whose frames go to `pattern`. Each rank checks a
    /// part of them, so that each file is checked once before the first frame. Later, ranks read the
    /// files that their frames need. All ranks call it.
    ///
    /// Errors: a folder without such files or with the job's own; a file that cannot be used, by name.
    pub fn survey(
        comm: &Communicator,
        folders: &[PathBuf],
        pattern: &FramePattern,
        (scene, settings, terms): (&Scene, &Settings, &Compatibility),
    ) -> Result<Self> {
        if folders.is_empty() {
            return Ok(Self::none());
        }
        refuse_policy(settings)?;
        // (Names as they are, which may be no text.)
        let names = || Ok(list(folders, pattern)?.into_iter().map(bytes_of).collect());
        let names: Vec<Vec<u8>> = comm.from_root(names)?;
        let count = names.len();
        let files = names.into_iter().map(|name| OsString::from_vec(name).into()).collect();
        let most = machine::memory().map_or(u64::MAX, |memory| memory / 2);
        let budget = most / u64::from(comm.node_size());
        let mut cache = ReferenceCache::new(files, terms.clone(), scene.recentring, budget);
        // Alone it needs them itself, as long as there is room.
        let is_kept = comm.size() == 1;
        let look = |file| cache.look(file, is_kept).map_err(as_input);
        let own: Result<Vec<ReferenceInfo>> = own_part(count, comm).map(look).collect();
        let mut infos = comm.all_gather(comm.agree(own)?)?.concat();
        infos.sort_by_key(|info| info.hash);
        infos.dedup_by_key(|info| info.hash);
        let hash = name_of(&infos);
        cache.serve(infos);
        Ok(Self { cache: Some(cache), hash })
    }

    /// No references.
    pub fn none() -> Self {
        Self { cache: None, hash: "none".into() }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.cache.is_none()
    }
}

/// Checks that `folders` have exr frames and are not where the job's own frames go, `pattern`.
pub fn check(folders: &[PathBuf], pattern: &FramePattern, settings: &Settings) -> Result<()> {
    if folders.is_empty() {
        return Ok(());
    }
    refuse_policy(settings)?;
    list(folders, pattern).map(drop)
}

fn refuse_policy(settings: &Settings) -> Result<()> {
    match settings.reuse.policy {
        Policy::Surface => Ok(()),
        _ => Err(Error::Usage("--references needs --policy surface".into())),
    }
}

/// The range of `count` files that this rank checks.
fn own_part(count: usize, comm: &Communicator) -> std::ops::Range<usize> {
    let edge = |rank: u32| count * rank as usize / comm.size() as usize;
    edge(comm.rank())..edge(comm.rank() + 1)
}

fn bytes_of(path: PathBuf) -> Vec<u8> {
    path.into_os_string().into_vec()
}

fn name_of(infos: &[ReferenceInfo]) -> String {
    let mut all = blake3::Hasher::new();
    infos.iter().for_each(|info| _ = all.update(&info.hash));
    format!("{}, {}", counted(infos.len(), "frame"), &all.finalize().to_hex()[..16])
}

/// The exr files of all folders.
fn list(folders: &[PathBuf], pattern: &FramePattern) -> Result<Vec<PathBuf>> {
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
        let named = folder.display();
        let io = |e| Error::Usage(format!("--references {named}: cannot read the folder: {e}"));
        let entries = fs::read_dir(folder).map_err(io)?;
        let paths = entries.map(|e| e.map(|e| e.path())).collect::<std::io::Result<Vec<_>>>();
        let is_exr = |p: &PathBuf| p.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
        let is_shown = |p: &PathBuf| p.file_name().is_none_or(|n| n.as_encoded_bytes()[0] != b'.');
        let mut paths: Vec<_> =
            paths.map_err(io)?.into_iter().filter(|p| is_exr(p) && is_shown(p)).collect();
        if paths.is_empty() {
            return Err(Error::Usage(format!("--references {named}: no exr frame is in there")));
        }
        paths.sort();
        all.append(&mut paths);
    }
    Ok(all)
}
