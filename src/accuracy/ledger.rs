//! What a sweep has measured so far, on disk, so that one that was stopped or killed goes on.
//!
//! A folder of its own:
//!
//! * `sweep.json` says what the figures are of; a sweep of anything else is refused;
//! * `reference.json` and `reference_NNNN.exr`: the reference so far, as display values;
//! * `trials.jsonl`: a line a trial, appended and synced when the trial is over. A crash can tear the
//!   last line alone, which is dropped;
//! * `setting_NNN.png`: each setting's picture of the frame that pictures are shown of.
//!
//! Not done: no lock keeps two sweeps from writing into the same folder at once.

use super::change::Change;
use super::errors::{Errors, Frames};
use super::reference::Doubling;
use crate::error::{Error, Result};
use crate::film::{Encoding, Image};
use crate::output::manifest::Journal;
use crate::output::{atomic, exr, read_image_within};
use crate::page::Picture;
use crate::stats::RayCounts;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Largest picture that is read, bytes.
const LARGEST: u64 = 4 << 30;

/// How old a temporary file of a dead process is before it is removed.
const LEFTOVER_AGE: Duration = Duration::from_secs(60);

/// A trial that is over.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct TrialRecord {
    /// Which run of the program measured it, from 1.
    pub run: u32,
    /// Which turn; 0 warms up.
    pub turn: u32,
    /// Index of the candidate.
    pub candidate: usize,
    /// Wall seconds a frame.
    pub seconds: f64,
    /// The default's, of the same turn and run.
    pub default_seconds: f64,
    /// CPU seconds a frame.
    pub cpu_seconds: f64,
    /// Wall seconds to build the intersector.
    pub build_seconds: f64,
    /// Wall seconds of the whole trial.
    pub took: f64,
    /// Rays a frame.
    pub rays_per_frame: f64,
    /// Rays by kind, of all frames made.
    pub rays: RayCounts,
    /// Camera samples a pixel, mean of the move; `None` where all pixels take as many.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera_samples: Option<f64>,
    /// Memory of the intersector and of the references, bytes.
    pub memory: u64,
    /// How far off its frames are.
    pub errors: StoredErrors,
    /// How its pixels differ from the default's.
    pub change: Change,
}

/// [`Errors`] without what follows from the mean squared error: JSON knows no infinity.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub struct StoredErrors {
    mse: f64,
    ssim: f64,
    flip: f64,
    share_over_2: f64,
    flicker: Option<f64>,
}

impl From<Errors> for StoredErrors {
    fn from(e: Errors) -> Self {
        let Errors { mse, ssim, flip, share_over_2, flicker, .. } = e;
        Self { mse, ssim, flip, share_over_2, flicker }
    }
}

impl From<StoredErrors> for Errors {
    fn from(e: StoredErrors) -> Self {
        let StoredErrors { mse, ssim, flip, share_over_2, flicker } = e;
        let (rmse_steps, psnr) = (mse.sqrt() * 255.0, crate::measure::psnr(mse));
        Self { mse, rmse_steps, psnr, ssim, flip, share_over_2, flicker }
    }
}

/// `reference.json`.
#[derive(Serialize, Deserialize)]
struct StoredReference {
    number: u32,
    spp: u32,
    change: Option<f64>,
    wanted: f64,
    frames: Vec<u32>,
}

/// The folder, and what lies in it.
pub struct Ledger {
    folder: PathBuf,
    journal: Journal,
    entries: Vec<TrialRecord>,
    run: u32,
}

impl Ledger {
    /// Opens the sweep of `terms`, which are all that its figures depend on, by name; begins one where
    /// there is none, or where it shall be measured `anew`.
    ///
    /// # Errors
    /// [`Error::Usage`] where a sweep of other terms is there; those of reading and writing.
    pub fn open(folder: &Path, terms: &Map<String, Value>, anew: bool) -> Result<Self> {
        let path = folder.join("sweep.json");
        atomic::clean_temporaries(folder, LEFTOVER_AGE)?;
        let found: Option<Map<String, Value>> = if anew { None } else { read_json(&path)? };
        match found {
            Some(found) => check(folder, &found, terms)?,
            None => {
                clear(folder)?;
                atomic::create_folder(folder)?;
                atomic::write_json(&path, terms)?;
            }
        }
        let trials = folder.join("trials.jsonl");
        let journal = Journal::open(&trials)?;
        let entries: Vec<TrialRecord> = Journal::lines(&trials)?;
        let run = entries.iter().map(|entry| entry.run).max().unwrap_or(0) + 1;
        Ok(Self { folder: folder.to_path_buf(), journal, entries, run })
    }

    /// All trials that are over.
    pub fn entries(&self) -> &[TrialRecord] {
        &self.entries
    }

    /// How many runs of the program have measured any of them.
    pub fn runs(&self) -> u32 {
        self.entries.iter().map(|entry| entry.run).max().unwrap_or(0)
    }

    /// Whether this run has measured any.
    pub fn is_running(&self) -> bool {
        self.runs() == self.run
    }

    /// Whether the candidate's trial of the turn is over.
    pub fn has(&self, turn: u32, candidate: usize) -> bool {
        self.entries.iter().any(|entry| (entry.turn, entry.candidate) == (turn, candidate))
    }

    /// Keeps a trial.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn append(&mut self, entry: TrialRecord) -> Result<()> {
        let entry = TrialRecord { run: self.run, ..entry };
        self.journal.append(&entry)?;
        self.entries.push(entry);
        Ok(())
    }

    /// Keeps a candidate's picture.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn keep_picture(&self, candidate: usize, picture: &Picture) -> Result<()> {
        let bytes = picture.bytes()?;
        atomic::write(self.picture_path(candidate), |w| w.write_all(&bytes)).map(drop)
    }

    /// A candidate's picture, if there is one.
    pub fn picture(&self, candidate: usize) -> Option<Picture> {
        Picture::of_png(&fs::read(self.picture_path(candidate)).ok()?).ok()
    }

    fn picture_path(&self, candidate: usize) -> PathBuf {
        self.folder.join(format!("setting_{candidate:03}.png"))
    }

    /// Keeps the reference so far, which is to come nearer than `wanted`.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn keep_reference(&self, reference: &Doubling, wanted: f64) -> Result<()> {
        let Doubling { number, spp, change, .. } = *reference;
        // The frames go first, under names of their own doubling: whatever `reference.json` names is
        // whole.
        for (frame, image) in &reference.frames {
            let bytes = encode(image)?;
            atomic::write(self.frame_path(number, *frame), |w| w.write_all(&bytes))?;
        }
        let frames: Vec<u32> = reference.frames.keys().copied().collect();
        let stored = StoredReference { number, spp, change, wanted, frames };
        atomic::write_json(&self.folder.join("reference.json"), &stored)?;
        if let Some(before) = number.checked_sub(1) {
            // Whatever is left takes room, no more.
            let path = |frame: &u32| self.frame_path(before, *frame);
            stored.frames.iter().for_each(|frame| _ = fs::remove_file(path(frame)));
        }
        Ok(())
    }

    /// The reference so far, and how near it is to come; `None` where there is none that can be read.
    pub fn reference(&self) -> Option<(Doubling, f64)> {
        let stored: StoredReference = read_json(&self.folder.join("reference.json")).ok()??;
        let StoredReference { number, spp, change, wanted, frames } = stored;
        let mut images = Frames::new();
        for frame in frames {
            let image = read_image_within(self.frame_path(number, frame), LARGEST).ok()?;
            images.insert(frame, Image { encoding: Encoding::Srgb, ..image });
        }
        Some((Doubling { number, spp, change, frames: images }, wanted))
    }

    fn frame_path(&self, number: u32, frame: u32) -> PathBuf {
        self.folder.join(format!("reference_{frame:04}_{number}.exr"))
    }

    /// What is kept under `name`, if it can be read.
    pub fn note<T: DeserializeOwned>(&self, name: &str) -> Option<T> {
        read_json(&self.folder.join(name)).ok()?
    }

    /// Keeps something under `name`.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn keep_note(&self, name: &str, value: &impl Serialize) -> Result<()> {
        atomic::write_json(&self.folder.join(name), value)
    }
}

/// Removes what a sweep left in `folder`, and nothing else.
fn clear(folder: &Path) -> Result<()> {
    let entries = match fs::read_dir(folder) {
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(()),
        entries => entries.map_err(|e| Error::io("read the folder", folder, e))?,
    };
    let is_ours = |name: &str| {
        let ends = [".json", ".jsonl", ".png", ".exr"].iter().any(|end| name.ends_with(end));
        let begins = ["sweep", "trials", "setting_", "reference", "oracle", "writing", "load"];
        ends && begins.iter().any(|begin| name.starts_with(begin))
    };
    for path in entries.flatten().map(|entry| entry.path()) {
        if path.file_name().and_then(|name| name.to_str()).is_some_and(is_ours) {
            fs::remove_file(&path).map_err(|e| Error::io("remove", &path, e))?;
        }
    }
    Ok(())
}

fn check(folder: &Path, found: &Map<String, Value>, wanted: &Map<String, Value>) -> Result<()> {
    let names = wanted.keys().chain(found.keys());
    let differs = |name: &&String| found.get(*name) != wanted.get(*name);
    let Some(name) = names.into_iter().find(differs) else { return Ok(()) };
    let text = |of: &Map<String, Value>| match of.get(name) {
        None => "unknown".to_string(),
        Some(Value::String(text)) => text.clone(),
        Some(value) => value.to_string(),
    };
    let (was, is) = (text(found), text(wanted));
    let told = match was.len().max(is.len()) {
        0..80 => format!(": {name} was {was}, now it is {is}"),
        _ => format!(" ({name})"),
    };
    Err(Error::Usage(format!(
        "{} holds a sweep of something else{told}\n  \
         help: choose another folder, or measure anew with --overwrite",
        folder.display()
    )))
}

fn encode(image: &Image) -> Result<Vec<u8>> {
    let channel = |name: &str, of: fn(&crate::math::Rgb) -> f32| exr::ExrChannel {
        name: name.into(),
        samples: exr::ExrSamples::F32(image.rgb.iter().map(of).collect()),
    };
    let channels = [channel("R", |c| c.x), channel("G", |c| c.y), channel("B", |c| c.z)];
    exr::encode(image.width, image.height, &channels, "display values, not radiance")
}

fn read_json<T: DeserializeOwned>(path: &Path) -> Result<Option<T>> {
    match fs::read(path) {
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(None),
        Err(e) => Err(Error::io("read", path, e)),
        // What cannot be understood is as good as absent: it is measured again.
        Ok(bytes) => Ok(serde_json::from_slice(&bytes).ok()),
    }
}

#[cfg(test)]
mod tests;
