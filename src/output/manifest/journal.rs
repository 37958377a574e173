//! Rows are appended one by one, whatever other jobs do to the files meanwhile.

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
/// Another job may take a part into the manifest, or replace the manifest, at any moment. So who
/// appends looks afterwards whether its file still has its name, and if not appends once more to what
/// has that name now; and who takes a file away reads it after that. Whichever comes first, one of
/// the two has the row, and a row that is there twice does no harm.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    /// Of a manifest: what it has to be of, also where somebody put another in its place.
    header: Option<Header>,
}

impl Journal {
    /// The lines at `path` that can be understood; none where there is no file.
    pub fn lines<T: DeserializeOwned>(path: &Path) -> Result<Vec<T>> {
        Ok(rows_in(&read_if_there(path)?.unwrap_or_default()).collect())
    }

    /// Opens the manifest or part at `path` for appending; a torn last line is ended.
    pub fn open(path: &Path) -> Result<Self> {
        Ok(Self { path: path.to_path_buf(), file: open(path)?, header: None })
    }

    /// The same for the manifest of a job with `header`.
    ///
    /// # Errors
    /// It is of other settings.
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

    /// Rows under the header of other settings would be wrong, and without any header useless.
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

/// Whether `path` still leads to `file`. (By opening it: what a network file system remembers of a name
/// may be old.)
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
