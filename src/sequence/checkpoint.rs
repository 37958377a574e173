//! References on disk, so that a job does not trace them again after it was killed.
//!
//! A job needs few references at a time, and only key frames are expensive to trace. Their references are
//! in a hidden folder beside the frames (`.frame.references` for `frame_####.png`), one file each: a line
//! of JSON that names the job and the frame, then the bytes of [`crate::reuse::store`] (policy
//! `surface`) or the frame's discoveries (`colour`). A file is
//! removed when no frame of its job needs it any more, and the folder when the job is complete. An exr
//! frame that holds its own reference is read instead. A file that is damaged or belongs to another
//! job is never used: its frame is traced again.

use super::target::{LEFTOVER_AGE, Target};
use crate::error::{Error, Result, counted};
use crate::output::manifest::{self, Header, Manifest, Row, manifest_path};
use crate::output::{Format, FramePattern, Regular, atomic, exr};
use crate::reuse::Reference;
use crate::reuse::store::{ATTRIBUTE, Compatibility, decode};
use crate::scene::Recentring;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, Read};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::Duration;

/// Version of the files.
const FORMAT: u32 = 3;
/// Ending of the files.
const ENDING: &str = ".reference";
/// Longest first line that is read, bytes.
const LONGEST_HEAD: u64 = 1 << 20;
/// Largest exr frame that is read, bytes.
const LARGEST_FRAME: u64 = 4 << 30;

/// The first line of a file.
#[derive(Serialize, Deserialize)]
struct Head {
    /// [`FORMAT`].
    checkpoint: u32,
    frame: u32,
    /// The frame's [`Recipe::whole`](super::Recipe::whole).
    recipe: String,
    /// Hash of the bytes after this line.
    #[serde(default)]
    blake3: String,
    /// The header that all frames of the job share.
    header: Header,
}

/// The references of a job on disk.
pub struct Checkpoints<'a> {
    /// The job.
    pub target: &'a Target,
    /// Most seconds of tracing that a kill may lose; `None` to write no references, only read them.
    pub every: Option<Duration>,
    /// Compatibility that a reference must have.
    pub terms: &'a Compatibility,
    /// The transform between world and scene space of the job.
    pub recentring: Recentring,
    /// Whether the job's frame files hold the whole references of their frames.
    pub frames_hold_all: bool,
    rows: OnceLock<BTreeMap<u32, Row>>,
    notes: Mutex<Vec<String>>,
    /// Whether a failed write was reported.
    has_noted_unwritten: AtomicBool,
}

impl<'a> Checkpoints<'a> {
    /// The checkpoints of the job at `target`. `whole` says whether its frames, if they are exr, hold their whole
    /// references.
    pub fn new(
        target: &'a Target,
        every: Option<Duration>,
        terms: &'a Compatibility,
        recentring: Recentring,
        whole: bool,
    ) -> Self {
        Self {
            target,
            every,
            terms,
            recentring,
            frames_hold_all: whole && target.pattern.format() == Format::Exr,
            rows: OnceLock::new(),
            notes: Mutex::default(),
            has_noted_unwritten: AtomicBool::default(),
        }
    }

    /// The reference of a representative frame of so many `pixels` and its bytes, if it is on disk, whole and
    /// this job's.
    pub fn read(&self, frame: u32, pixels: u64) -> Option<(Reference, Arc<[u8]>)> {
        let in_file = || self.decode(&self.path(frame), self.read_bytes(frame)?, pixels);
        let (mut found, bytes) = self.in_frame(frame, pixels).or_else(in_file)?;
        found.frame = frame;
        Some((found, bytes))
    }

    /// Whether the reference of a frame seems to be on disk: the manifest lists a frame's file that holds it, or there
    /// is a checkpoint. No file is opened, so [`read`](Self::read) may still give `None`.
    pub fn has(&self, frame: u32) -> bool {
        self.row(frame).is_some() || self.path(frame).exists()
    }

    fn in_frame(&self, frame: u32, pixels: u64) -> Option<(Reference, Arc<[u8]>)> {
        let row = self.row(frame)?;
        let path = self.target.pattern.folder().join(&row.file);
        let is_whole = Regular::at(&path).and_then(|file| file.hash(&path)).ok()? == row.blake3;
        let bytes = is_whole.then(|| exr::read_attribute(&path, ATTRIBUTE, LARGEST_FRAME))?;
        self.decode(&path, bytes.ok()??.bytes.into(), pixels)
    }

    /// The row of a frame whose file holds its reference.
    fn row(&self, frame: u32) -> Option<&Row> {
        let row = self.rows().get(&frame).filter(|_| self.frames_hold_all)?;
        let recipe = self.target.recipes.get(frame)?.whole.to_string();
        (row.stray.is_none() && row.recipe == recipe).then_some(row)
    }

    /// The manifest's rows by frame. Each rank reads the manifest itself, and only if a reference is missing.
    fn rows(&self) -> &BTreeMap<u32, Row> {
        let read = || Manifest::read(&manifest_path(&self.target.pattern)).ok().flatten();
        self.rows.get_or_init(|| read().map(|manifest| manifest.rows).unwrap_or_default())
    }

    /// The bytes that [`write`](Self::write) wrote for a frame, if they are on disk, whole and this job's.
    pub fn read_bytes(&self, frame: u32) -> Option<Arc<[u8]>> {
        let path = self.path(frame);
        let mut source = Regular::at(&path).ok()?.source;
        let head = read_head(&mut source);
        if let Some(why) = refusal(self.target, head.as_ref(), frame) {
            self.note(format!("{} {why}; its frame is traced again", path.display()));
            return None;
        }
        let mut bytes = Vec::new();
        source.read_to_end(&mut bytes).ok()?;
        let hash = blake3::hash(&bytes).to_hex();
        if !matches!(head, Some(FirstLine::Head(head)) if head.blake3 == hash.as_str()) {
            self.note(format!("{} is damaged; its frame is traced again", path.display()));
            return None;
        }
        Some(bytes.into())
    }

    fn decode(&self, path: &Path, bytes: Arc<[u8]>, pixels: u64) -> Option<(Reference, Arc<[u8]>)> {
        match decode(path, &bytes, self.terms, &self.recentring, pixels) {
            Ok((reference, _)) => Some((reference, bytes)),
            Err(why) => {
                self.note(format!("{why}; its frame is traced again"));
                None
            }
        }
    }

    /// Writes the reference of a representative frame to disk.
    pub fn write(&self, frame: u32, bytes: &[u8]) -> Result<()> {
        let path = self.path(frame);
        let recipe = self.target.recipes.get(frame).copied().unwrap_or_default();
        let header = self.target.header.clone();
        let recipe = recipe.whole.to_string();
        let blake3 = blake3::hash(bytes).to_hex().to_string();
        let head = Head { checkpoint: FORMAT, frame, recipe, blake3, header };
        let mut line =
            serde_json::to_vec(&head).map_err(|e| Error::io("write", &path, e.into()))?;
        line.push(b'\n');
        let write = || {
            atomic::create_folder(folder(&self.target.pattern))?;
            atomic::write(&path, |w| w.write_all(&line).and_then(|()| w.write_all(bytes))).map(drop)
        };
        // A job of other frames of this shot may just have ended and removed the folder.
        write().or_else(|_| write())
    }

    /// Removes the reference of a frame that no frame to come needs.
    pub fn remove(&self, frame: u32) {
        // A file that cannot be removed now is removed when the job is complete.
        let _ = fs::remove_file(self.path(frame));
    }

    /// Notes for the user: why references on disk were not used. Each is returned once.
    pub fn notes(&self) -> Vec<String> {
        std::mem::take(&mut *self.notes.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Notes, once, why references cannot be written.
    pub(super) fn note_unwritten(&self, why: &Error) {
        if !self.has_noted_unwritten.swap(true, Ordering::Relaxed) {
            self.note(format!(
                "{why}; a job that goes on after a kill will have to trace it again"
            ));
        }
    }

    fn note(&self, note: String) {
        self.notes.lock().unwrap_or_else(PoisonError::into_inner).push(note);
    }

    fn path(&self, frame: u32) -> PathBuf {
        folder(&self.target.pattern).join(format!("{frame:07}{ENDING}"))
    }
}

/// The folder of a sequence's references.
pub fn folder(pattern: &FramePattern) -> PathBuf {
    let shown = manifest::beside(pattern, ".references");
    let name = shown.file_name().unwrap_or_default().to_string_lossy();
    shown.with_file_name(format!(".{name}"))
}

/// Removes the references on disk of the job at `target`, which the caller knows to be complete, and temporary files of its
/// killed runs. What cannot be removed stays.
pub fn clear(target: &Target) {
    // Processes of other machines that were killed a moment before this job began leave files too young
    // for its start.
    let _ = atomic::clean_temporaries(target.pattern.folder(), LEFTOVER_AGE);
    let folder = folder(&target.pattern);
    files(&folder).iter().for_each(|(_, path)| _ = fs::remove_file(path));
    let _ = atomic::clean_temporaries(&folder, Duration::ZERO);
    // On a network file system the folder stays until the next job if a reader holds a file open.
    let _ = fs::remove_dir(folder);
}

/// Refuses references of other settings, another scene or another version: they may be expensive, and a
/// mistyped option must not delete them.
pub(super) fn refuse_others(target: &Target) -> Result<()> {
    let folder = folder(&target.pattern);
    let heads: Vec<FirstLine> =
        files(&folder).iter().filter_map(|(_, path)| head_of(path)).collect();
    let why = |head: &FirstLine| of_others(target, head);
    let Some(first) = heads.iter().find_map(why) else { return Ok(()) };
    let count = heads.iter().filter_map(why).count();
    Err(Error::Usage(format!(
        "{} holds {} of an earlier job that this job cannot use: the first {first}\n  \
         help: restore the setting, choose another output with -o, or remove the references with --overwrite",
        folder.display(),
        counted(count, "reference"),
    )))
}

/// Removes references that cannot be used for the job at `target`; returns notes about them.
pub(super) fn sweep(target: &Target) -> Result<Vec<String>> {
    let folder = folder(&target.pattern);
    atomic::clean_temporaries(&folder, LEFTOVER_AGE)?;
    let mut removed = Vec::new();
    for (frame, path) in files(&folder) {
        let head = head_of(&path);
        if let Some(why) = refusal(target, head.as_ref(), frame) {
            fs::remove_file(&path).map_err(|e| Error::io("remove", &path, e))?;
            removed.push(why);
        }
    }
    let Some(why) = removed.first() else { return Ok(Vec::new()) };
    let files = counted(removed.len(), "reference");
    Ok(vec![format!("removed {files} from {}: the first {why}", folder.display())])
}

/// The references in a folder, by frame.
fn files(folder: &Path) -> Vec<(u32, PathBuf)> {
    let frame_of = |path: &Path| path.file_name()?.to_str()?.strip_suffix(ENDING)?.parse().ok();
    let entries = fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path());
    let mut found: Vec<_> = entries.filter_map(|path| Some((frame_of(&path)?, path))).collect();
    found.sort();
    found
}

/// The first line of a file, as far as this version can read it.
#[allow(clippy::large_enum_variant, reason = "most are the large one")]
enum FirstLine {
    Head(Head),
    /// Of another version of the files.
    OtherVersion,
}

fn head_of(path: &Path) -> Option<FirstLine> {
    read_head(&mut Regular::at(path).ok()?.source)
}

fn read_head(source: &mut impl BufRead) -> Option<FirstLine> {
    #[derive(Deserialize)]
    struct Version {
        checkpoint: u32,
    }
    let mut line = Vec::new();
    source.take(LONGEST_HEAD).read_until(b'\n', &mut line).ok()?;
    let Version { checkpoint } = serde_json::from_slice(&line).ok()?;
    match checkpoint {
        FORMAT => serde_json::from_slice(&line).ok().map(FirstLine::Head),
        _ => Some(FirstLine::OtherVersion),
    }
}

/// Why a file belongs to a job of other settings than the one at `target`; `None` if it does not.
fn of_others(target: &Target, line: &FirstLine) -> Option<String> {
    let FirstLine::Head(head) = line else {
        return Some("is of another version of tweenray".into());
    };
    let d = head.header.first_difference(&target.header)?;
    Some(format!("is of other settings: {}", d.was_and_is()))
}

/// Why a file cannot be the reference of `frame` in the job at `target`; `None` if it can.
fn refusal(target: &Target, line: Option<&FirstLine>, frame: u32) -> Option<String> {
    let others = line.and_then(|line| of_others(target, line));
    if others.is_some() {
        return others;
    }
    let Some(FirstLine::Head(head)) = line.filter(|line| line.is_of(frame)) else {
        return Some("is damaged".into());
    };
    let recipe = target.recipes.get(frame).map(|recipe| recipe.whole.to_string());
    (recipe.as_deref() != Some(&head.recipe)).then(|| "is of another camera move".into())
}

impl FirstLine {
    fn is_of(&self, frame: u32) -> bool {
        matches!(self, Self::Head(head) if head.frame == frame)
    }
}
