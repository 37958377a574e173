//! Journals: rows appended one by one, safely while other jobs replace the files.

use super::{Header, Manifest, header_at, line_of, read_if_there, rows_in};
use crate::error::{Error, Result};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// Appends rows to a manifest or to a rank's part of it.
///
/// Another job may merge a part into the manifest, or replace the manifest, at any moment. So after
/// appending, the writer checks whether its file still has its name, and if not appends the row again to the
/// file that has that name now. A job that removes a file reads it after removing its name. In either order one of
/// the two has the row, and a row that occurs twice does no harm.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    /// Header that the manifest must have, also after another job replaced it; `None` for a part.
    header: Option<Header>,
}

impl Journal {
    /// The lines of the file at `path` that can be parsed; none if there is no file.
    pub fn lines<T: DeserializeOwned>(path: &Path) -> Result<Vec<T>> {
        Ok(rows_in(&read_if_there(path)?.unwrap_or_default()).collect())
    }

    /// Opens the manifest or part at `path` for appending; ends an incomplete last line.
    pub fn open(path: &Path) -> Result<Self> {
        Ok(Self { path: path.to_path_buf(), file: open(path)?, header: None })
    }

    /// Opens the manifest at `path` of a job with `header` for appending.
    ///
    /// # Errors
    /// The manifest is of other settings.
    pub fn of(path: &Path, header: &Header) -> Result<Self> {
        let mut journal = Self { header: Some(header.clone()), ..Self::open(path)? };
        journal.check()?;
        Ok(journal)
    }

    /// Appends a row, as one line of JSON: one write, then a sync.
    ///
    /// # Errors
    /// It cannot be written, or a job of other settings has replaced the manifest.
    pub fn append(&mut self, row: &impl Serialize) -> Result<()> {
        let line = line_of(&self.path, row)?;
        self.append_bytes(&line)
    }

    pub(super) fn append_bytes(&mut self, lines: &[u8]) -> Result<()> {
        loop {
            let written = self.file.write_all(lines).and_then(|()| self.file.sync_data());
            written.map_err(|e| Error::io("write", &self.path, e))?;
            if has_name(&self.file, &self.path)? {
                return Ok(());
            }
            self.file = open(&self.path)?;
            self.check()?;
        }
    }

    /// Checks that the manifest's header is still the job's: rows after another header would be wrong, and without a
    /// header useless.
    fn check(&mut self) -> Result<()> {
        let Some(header) = &self.header else { return Ok(()) };
        let Some(there) = header_at(&self.path) else {
            Manifest::create(&self.path, header, &[])?;
            self.file = open(&self.path)?;
            return Ok(());
        };
        match there.first_difference(header) {
            None => Ok(()),
            Some(d) => Err(Error::Failed(format!(
                "{} is of another job now: {}",
                self.path.display(),
                d.there_and_here()
            ))),
        }
    }
}

fn open(path: &Path) -> Result<File> {
    let file = OpenOptions::new().read(true).append(true).create(true).open(path);
    let mut file = file.map_err(|e| Error::io("open", path, e))?;
    // It is not cut off: another job may be in the middle of writing it.
    let end = is_torn(&mut file).and_then(|torn| if torn { file.write_all(b"\n") } else { Ok(()) });
    end.map_err(|e| Error::io("mend", path, e))?;
    Ok(file)
}

fn is_torn(file: &mut File) -> io::Result<bool> {
    if file.seek(SeekFrom::End(0))? == 0 {
        return Ok(false);
    }
    let mut last = [0];
    file.seek(SeekFrom::End(-1))?;
    file.read_exact(&mut last)?;
    Ok(last != *b"\n")
}

/// Whether `path` still is the name of `file`. (It opens the path, since a network file system may have cached
/// old metadata of the name.)
fn has_name(file: &File, path: &Path) -> Result<bool> {
    let there = match File::open(path) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(false),
        there => there.and_then(|there| there.metadata()),
    };
    let id = |found: fs::Metadata| (found.dev(), found.ino());
    let there = there.map_err(|e| Error::io("open", path, e))?;
    let own = file.metadata().map_err(|e| Error::io("open", path, e))?;
    Ok(id(there) == id(own))
}
