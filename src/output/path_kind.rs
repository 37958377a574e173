//! The kind of file at a path, found before anything is read from it.

use crate::error::{Error, Result};
use std::fs::File;
use std::io::{BufReader, ErrorKind};
use std::path::Path;

/// The kind of file at a path.
pub enum PathKind {
    /// Nothing.
    Nothing,
    /// A regular file, opened.
    File(Regular),
    /// A folder, a pipe, a device: opening one may wait for ever, and reading one need not end.
    Other,
}

/// A regular file, opened for reading.
pub struct Regular {
    /// The file's content.
    pub source: BufReader<File>,
    /// Size of the file, bytes.
    pub bytes: u64,
}

impl PathKind {
    /// The kind of file at `path`.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be determined, or if a regular file cannot be opened.
    pub fn at(path: &Path) -> Result<Self> {
        let about = match std::fs::metadata(path) {
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(Self::Nothing),
            about => about.map_err(|e| Error::io("read", path, e))?,
        };
        if !about.is_file() {
            return Ok(Self::Other);
        }
        match File::open(path) {
            Ok(file) => {
                let source = BufReader::new(file);
                Ok(Self::File(Regular { source, bytes: about.len() }))
            }
            Err(e) if e.kind() == ErrorKind::NotFound => Ok(Self::Nothing),
            Err(e) => Err(Error::io("read", path, e)),
        }
    }
}

impl Regular {
    /// The file at `path`.
    ///
    /// # Errors
    /// [`Error::Io`] if there is no file, [`Error::Input`] if it is not a regular file.
    pub fn at(path: &Path) -> Result<Self> {
        match PathKind::at(path)? {
            PathKind::File(file) => Ok(file),
            PathKind::Nothing => Err(Error::io("read", path, ErrorKind::NotFound.into())),
            PathKind::Other => Err(Error::input(path, "not a regular file")),
        }
    }

    /// BLAKE3 of the rest of the file, in hexadecimal. `path` is for messages.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn hash(self, path: &Path) -> Result<String> {
        let mut hasher = blake3::Hasher::new();
        hasher.update_reader(self.source).map_err(|e| Error::io("read", path, e))?;
        Ok(hasher.finalize().to_hex().to_string())
    }
}

/// Refuses a picture that needs more memory than `limit`; both in bytes.
///
/// # Errors
/// [`Error::Input`] with both figures.
pub(super) fn check_memory(path: &Path, needed: u64, limit: u64) -> Result<()> {
    if needed <= limit {
        return Ok(());
    }
    let mib = |bytes: u64| bytes.div_ceil(1 << 20);
    let (needed, limit) = (mib(needed), mib(limit));
    Err(Error::input(
        path,
        format!("decoding takes {needed} MiB, more than the {limit} MiB allowed"),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_told_from_missing_paths_folders_and_devices() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("frame.png");
        assert!(matches!(PathKind::at(&path), Ok(PathKind::Nothing)));
        assert!(matches!(PathKind::at(folder.path()), Ok(PathKind::Other)));
        assert!(matches!(PathKind::at(Path::new("/dev/zero")), Ok(PathKind::Other)));
        std::fs::write(&path, "twelve bytes").expect("written");
        let file = Regular::at(&path).expect("a file");
        assert_eq!(file.bytes, 12);
        let hash = file.hash(&path).expect("read");
        assert_eq!(hash, blake3::hash(b"twelve bytes").to_hex().as_str());
    }
}
