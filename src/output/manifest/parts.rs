//! Part files of the manifest: every rank other than 0 writes one, and rank 0 of any job of the same settings merges
//! them.

use super::{Header, Journal, Manifest, Row, folder_of, line_of, read_if_there, rows_in};
use crate::error::{Error, Result};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

/// Path of the part file of rank `rank` (not 0) of a job with `header`, for the manifest at `path`.
///
/// The name has the hash of the header, so that rows are never merged under the header of other settings.
pub fn part_path(path: &Path, header: &Header, rank: u32) -> PathBuf {
    path.with_extension(format!("rank{rank:04}-{}.jsonl", header.key()))
}

/// A part of a manifest.
pub(super) struct Part {
    path: PathBuf,
    /// [`Header::key`] of the job's header.
    key: String,
    rank: String,
}

impl Part {
    /// The rows in the file.
    pub fn rows(&self) -> Result<Vec<Row>> {
        Ok(rows_in(&read_if_there(&self.path)?.unwrap_or_default()).collect())
    }

    /// Whether the part is of a job with `header`.
    pub fn is_of(&self, header: &Header) -> bool {
        self.key == header.key()
    }

    /// Renames the file so that no rank appends to it any more; `None` if another process has just done so.
    fn take(self, manifest: &Path) -> Result<Option<Self>> {
        static COUNTER: AtomicU64 = AtomicU64::new(0);
        // Processes of other machines must not come to the same name.
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos();
        let (id, n) = (std::process::id(), COUNTER.fetch_add(1, Ordering::Relaxed));
        let Self { key, rank, .. } = &self;
        let path = manifest.with_extension(format!("rank{rank}-{key}-{now}-{id}-{n}.jsonl"));
        match fs::rename(&self.path, &path) {
            Ok(()) => Ok(Some(Self { path, ..self })),
            Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(e) => Err(Error::io("rename", self.path, e)),
        }
    }

    fn remove(&self) -> Result<()> {
        match fs::remove_file(&self.path) {
            Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(()),
            removed => removed.map_err(|e| Error::io("remove", &self.path, e)),
        }
    }
}

/// All parts of the manifest at `path`, also those that a process is merging.
pub(super) fn parts(path: &Path) -> Result<Vec<Part>> {
    let folder = folder_of(path);
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned() + ".rank";
    let part = |entry: fs::DirEntry| {
        let name = entry.file_name();
        let middle = name.to_str()?.strip_prefix(&stem)?.strip_suffix(".jsonl")?;
        let mut words = middle.split('-');
        let (rank, key) = (words.next()?.to_string(), words.next()?.to_string());
        let is_number = |word: &str| !word.is_empty() && word.bytes().all(|b| b.is_ascii_digit());
        let is_part = is_number(&rank) && words.all(is_number);
        is_part.then(|| Part { path: entry.path(), key, rank })
    };
    let entries = fs::read_dir(folder).map_err(|e| Error::io("read", folder, e))?;
    let mut parts: Vec<_> = entries.filter_map(io::Result::ok).filter_map(part).collect();
    parts.sort_by(|a, b| a.path.cmp(&b.path));
    Ok(parts)
}

impl Manifest {
    /// Merges the rows of all part files of jobs with `header` into their manifest at `path`. Such a job
    /// may be running: see [`Journal`] for why no row is lost. A crash leaves parts that the next
    /// start merges.
    pub fn merge_parts(path: &Path, header: &Header) -> Result<()> {
        let mut taken = Vec::new();
        let mut lines = Vec::new();
        for part in parts(path)?.into_iter().filter(|part| part.is_of(header)) {
            let Some(part) = part.take(path)? else { continue };
            for row in part.rows()? {
                lines.extend(line_of(path, &row)?);
            }
            taken.push(part);
        }
        if !lines.is_empty() {
            Journal::of(path, header)?.append_bytes(&lines)?;
        }
        taken.iter().try_for_each(Part::remove)
    }

    /// Removes the parts of jobs of other settings than `header`'s.
    pub(super) fn remove_strange_parts(path: &Path, header: &Header) -> Result<()> {
        let parts = parts(path)?;
        parts.iter().filter(|part| !part.is_of(header)).try_for_each(Part::remove)
    }
}
