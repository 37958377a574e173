//! Files that exist are whole: written under a temporary name in the same folder, synced, renamed,
//! and the folder synced.
//!
//! The temporary name of `frame_0001.png` is `.frame_0001.png.tmp-<machine>-<pid>-<n>`. A failed write
//! removes it; [`clean_temporaries`] removes files that a killed run left.

use crate::error::{Error, Result};
use serde::Serialize;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Size and hash of a file that was written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Written {
    /// Size of the file.
    pub bytes: u64,
    /// BLAKE3 of the file's bytes.
    pub hash: blake3::Hash,
}

/// Writes or replaces the file at `path`; `fill` gets a buffered writer for its content. After success the file is
/// whole and on disk; after an error `path` is unchanged.
///
/// # Errors
/// [`Error::Io`] with the path and the failed action.
pub fn write(
    path: impl AsRef<Path>,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<Written> {
    let (temporary, file) = Temporary::create(path.as_ref())?;
    let (file, written) = fill_file(file, fill).map_err(|e| temporary.error("write", e))?;
    file.sync_all().map_err(|e| temporary.error("sync", e))?;
    temporary.rename()?;
    Ok(written)
}

/// Writes `value` as JSON, with a line end, to the file at `path`.
///
/// # Errors
/// [`Error::Io`], as [`write()`]; a value that JSON cannot hold.
pub fn write_json(path: &Path, value: &impl Serialize) -> Result<()> {
    let text = serde_json::to_vec_pretty(value).map_err(|e| Error::io("write", path, e.into()))?;
    write(path, |w| w.write_all(&text).and_then(|()| w.write_all(b"\n"))).map(drop)
}

/// Creates a folder and those above it, where missing.
///
/// # Errors
/// [`Error::Io`] with the folder's name.
pub fn create_folder(folder: impl AsRef<Path>) -> Result<()> {
    let folder = folder.as_ref();
    fs::create_dir_all(folder).map_err(|e| Error::io("create the folder", folder, e))
}

/// Makes sure, before long work, that [`write()`] can put a file at `path`: makes its folder and
/// tries a temporary file there.
///
/// # Errors
/// [`Error::Io`] with the path, also where a folder has that name.
pub fn make_room(path: impl AsRef<Path>) -> Result<()> {
    let path = path.as_ref();
    if path.is_dir() {
        return Err(Error::io("write", path, io::ErrorKind::IsADirectory.into()));
    }
    if let Some(folder) = path.parent() {
        create_folder(folder)?;
    }
    Temporary::create(path).map(drop)
}

/// Removes temporary files of dead runs from `folder` (not below it) and returns their paths.
///
/// A file of a process of this machine is removed if that process has ended. A file of another machine, in a shared
/// folder, is removed if it did not change for `min_age`; a minute is ample. A folder that does not
/// exist is no error.
///
/// # Errors
/// [`Error::Io`] when the folder cannot be read or a file cannot be removed.
pub fn clean_temporaries(folder: impl AsRef<Path>, min_age: Duration) -> Result<Vec<PathBuf>> {
    let folder = folder.as_ref();
    let entries = match fs::read_dir(folder) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries.map_err(|e| Error::io("read the folder", folder, e))?,
    };
    let mut removed = Vec::new();
    for entry in entries {
        let entry = entry.map_err(|e| Error::io("read the folder", folder, e))?;
        let name = entry.file_name();
        let Some((machine, process)) = name.to_str().and_then(maker_of) else { continue };
        let age = entry.metadata().and_then(|m| m.modified()).map(|t| t.elapsed());
        // A time in the future counts as just now; a file that has gone meanwhile is no matter.
        let is_old = || age.is_ok_and(|age| age.unwrap_or_default() >= min_age);
        let is_left = if is_here(machine) { !is_alive(process) } else { is_old() };
        if is_left {
            match fs::remove_file(entry.path()) {
                Err(e) if e.kind() == io::ErrorKind::NotFound => {}
                Err(e) => return Err(Error::io("remove", entry.path(), e)),
                Ok(()) => removed.push(entry.path()),
            }
        }
    }
    removed.sort();
    Ok(removed)
}

/// The machine and the process in a temporary file's name; `None` for any other name.
fn maker_of(name: &str) -> Option<(&str, u32)> {
    let (_, tail) = name.strip_prefix('.')?.rsplit_once(".tmp-")?;
    let (machine, tail) = tail.split_once('-')?;
    let (pid, n) = tail.split_once('-')?;
    n.parse::<u64>().ok()?;
    Some((machine, pid.parse().ok()?))
}

fn is_here(machine: &str) -> bool {
    machine == this_machine() && machine != UNKNOWN
}

const UNKNOWN: &str = "0";

/// Hash of the machine, its boot and its container; equal for all processes that can see each other.
fn this_machine() -> &'static str {
    static MACHINE: OnceLock<String> = OnceLock::new();
    MACHINE.get_or_init(|| {
        let boot = fs::read("/proc/sys/kernel/random/boot_id");
        let processes = fs::read_link("/proc/self/ns/pid");
        let (Ok(boot), Ok(processes)) = (boot, processes) else { return UNKNOWN.into() };
        let hash = blake3::Hasher::new()
            .update(&boot)
            .update(processes.as_os_str().as_encoded_bytes())
            .finalize();
        hash.to_hex()[..8].to_string()
    })
}

/// Whether process `pid` of this machine runs. Without `/proc` only this process is known to run. A killed process
/// stays in `/proc` as a zombie until its parent reads its exit code, in a container perhaps forever; it counts as
/// ended.
fn is_alive(pid: u32) -> bool {
    if pid == std::process::id() {
        return true;
    }
    match fs::read(format!("/proc/{pid}/stat")) {
        Err(e) => e.kind() != io::ErrorKind::NotFound,
        Ok(stat) => {
            // The name, which may hold anything, ends with a bracket; the state follows.
            let state = stat.iter().rposition(|b| *b == b')').and_then(|at| stat.get(at + 2));
            !matches!(state, Some(b'Z' | b'X'))
        }
    }
}

/// The file behind `target`, following links, since a rename would replace a link by a file. Errors if it is not a
/// regular file.
fn resolve(target: &Path) -> Result<PathBuf> {
    let Ok(found) = fs::symlink_metadata(target) else { return Ok(target.to_path_buf()) };
    let real = match found.is_symlink() {
        true => fs::canonicalize(target).map_err(|e| Error::io("follow the link", target, e))?,
        false => target.to_path_buf(),
    };
    let special = fs::metadata(&real).is_ok_and(|m| !m.is_file() && !m.is_dir());
    if special {
        return Err(Error::Usage(format!("{} is not a regular file", target.display())));
    }
    Ok(real)
}

/// A temporary file's name, removed when dropped before [`Temporary::rename`].
pub(super) struct Temporary {
    path: PathBuf,
    target: PathBuf,
    renamed: bool,
}

impl Temporary {
    /// Creates the temporary file that is to become `target`.
    pub(super) fn create(target: &Path) -> Result<(Self, File)> {
        static COUNTER: AtomicU64 = AtomicU64::new(0);
        let target = &resolve(target)?;
        let Some(name) = target.file_name() else {
            return Err(Error::Usage(format!("{} does not name a file", target.display())));
        };
        loop {
            let n = COUNTER.fetch_add(1, Ordering::Relaxed);
            let mut hidden = std::ffi::OsString::from(".");
            hidden.push(name);
            hidden.push(format!(".tmp-{}-{}-{n}", this_machine(), std::process::id()));
            let path = target.with_file_name(hidden);
            // Another machine's process of the same id may hold the name: take the next one.
            match OpenOptions::new().write(true).create_new(true).open(&path) {
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
                Err(e) => return Err(Error::io("create", target, e)),
                Ok(file) => {
                    let target = target.to_path_buf();
                    return Ok((Self { path, target, renamed: false }, file));
                }
            }
        }
    }

    /// Path of the temporary file.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Renames the file, which is already synced, to its final name, and syncs the folder.
    pub(super) fn rename(mut self) -> Result<()> {
        fs::rename(&self.path, &self.target).map_err(|e| self.error("rename a file to", e))?;
        self.renamed = true;
        let folder = match self.target.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        match File::open(folder).and_then(|f| f.sync_all()) {
            // Some network file systems cannot sync a folder; the rename itself has happened.
            Err(e) if e.kind() == io::ErrorKind::InvalidInput => Ok(()),
            result => result.map_err(|e| Error::io("sync the folder", folder, e)),
        }
    }

    /// An error about the target file.
    pub(super) fn error(&self, action: &'static str, source: io::Error) -> Error {
        Error::io(action, &self.target, source)
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if !self.renamed {
            // Nothing can be done about a failure here, and the first error is the one to report.
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Runs `fill` on a buffered, hashing writer over `file` and flushes it.
fn fill_file(
    file: File,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<(File, Written)> {
    let mut writer = Hashing { inner: file, hasher: blake3::Hasher::new(), bytes: 0 };
    let mut buffered = BufWriter::with_capacity(1 << 16, &mut writer);
    fill(&mut buffered)?;
    buffered.flush()?;
    drop(buffered);
    let written = Written { bytes: writer.bytes, hash: writer.hasher.finalize() };
    Ok((writer.inner, written))
}

/// Hashes what the inner writer accepted.
struct Hashing<W> {
    inner: W,
    hasher: blake3::Hasher,
    bytes: u64,
}

impl<W: Write> Write for Hashing<W> {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let n = self.inner.write(buffer)?;
        self.hasher.update(&buffer[..n]);
        self.bytes += n as u64;
        Ok(n)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("a folder");
        let names = entries.map(|e| e.expect("an entry").file_name().into_string().expect("UTF-8"));
        let mut names: Vec<String> = names.collect();
        names.sort();
        names
    }

    #[test]
    fn the_file_and_its_hash() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.bin");
        let data = vec![7u8; 300_000];
        let written = write(&path, |w| w.write_all(&data)).expect("written");
        assert_eq!(fs::read(&path).expect("there"), data);
        assert_eq!(written, Written { bytes: 300_000, hash: blake3::hash(&data) });
        write(&path, |w| w.write_all(b"second")).expect("replaced");
        assert_eq!(fs::read(&path).expect("there"), b"second");
        assert_eq!(names(folder.path()), ["a.bin"]);
    }

    #[test]
    fn a_torn_write_leaves_nothing_and_keeps_what_was() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("frame.png");
        let torn = |w: &mut dyn Write| {
            w.write_all(&vec![1; 200_000])?;
            Err(io::Error::other("torn"))
        };
        let error = write(&path, torn).expect_err("torn");
        assert_eq!(error.to_string(), format!("cannot write {}: torn", path.display()));
        assert_eq!(names(folder.path()), Vec::<String>::new());
        fs::write(&path, b"old").expect("written");
        write(&path, torn).expect_err("torn");
        assert_eq!(fs::read(&path).expect("there"), b"old");
        assert_eq!(names(folder.path()), ["frame.png"]);
    }

    #[test]
    fn a_panic_in_the_writer_leaves_nothing() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("frame.png");
        let run = || write(&path, |_| panic!("on purpose"));
        std::panic::catch_unwind(std::panic::AssertUnwindSafe(run)).expect_err("panicked");
        assert_eq!(names(folder.path()), Vec::<String>::new());
    }

    #[test]
    fn a_folder_that_is_none() {
        for path in ["/proc/no/frame.png", "/dev/null/frame.png", "no/such/folder/a.png"] {
            let error = write(path, |_| Ok(())).expect_err("cannot be");
            assert!(error.to_string().starts_with(&format!("cannot create {path}: ")), "{error}");
        }
        assert!(matches!(write("/", |_| Ok(())), Err(Error::Usage(_))));
    }

    #[test]
    fn a_folder_in_the_files_place() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("frame.png");
        fs::create_dir(&path).expect("made");
        let error = write(&path, |w| w.write_all(b"x")).expect_err("a folder is in the way");
        assert!(error.to_string().contains("rename"), "{error}");
        assert_eq!(names(folder.path()), ["frame.png"]);
    }

    #[test]
    fn a_full_disk_is_an_error() {
        let Ok(full) = OpenOptions::new().write(true).open("/dev/full") else {
            eprintln!("skipped: no /dev/full here");
            return;
        };
        // Small enough to stay in the buffer until it is flushed.
        let error = fill_file(full, |w| w.write_all(b"x")).expect_err("full");
        assert_eq!(error.kind(), io::ErrorKind::StorageFull);
    }

    #[test]
    fn a_zombie_process_counts_as_ended() {
        let mut child = std::process::Command::new("cat")
            .stdin(std::process::Stdio::piped())
            .stdout(std::process::Stdio::null())
            .spawn()
            .expect("it starts");
        assert!(is_alive(child.id()));
        drop(child.stdin.take());
        let start = std::time::Instant::now();
        while is_alive(child.id()) {
            assert!(start.elapsed() < Duration::from_secs(20));
            std::thread::sleep(Duration::from_millis(1));
        }
        assert!(Path::new("/proc").join(child.id().to_string()).exists());
        child.wait().expect("asked");
    }

    #[test]
    fn temporary_files_of_ended_processes_are_removed_and_no_others() {
        let folder = tempfile::tempdir().expect("a folder");
        let here = this_machine();
        let own = format!(".frame_0001.png.tmp-{here}-{}-3", std::process::id());
        // No Linux process has an id beyond 2^22.
        let dead = format!(".frame_0001.png.tmp-{here}-4194999-12");
        let elsewhere = ".frame_0002.png.tmp-elsewhere-1-12";
        let others = [".frame.png.tmp-a-x-1", ".frame.png.tmp-4194999-1", "a.tmp-a-1-1", ".hidden"];
        for name in others.iter().chain([&dead.as_str(), &own.as_str(), &elsewhere]) {
            fs::write(folder.path().join(name), b"").expect("written");
        }
        let clean = |age| clean_temporaries(folder.path(), age).expect("readable");
        // Of who is dead here nothing is waited for.
        assert_eq!(clean(Duration::from_secs(60)), [folder.path().join(dead)]);
        assert_eq!(clean(Duration::ZERO), [folder.path().join(elsewhere)]);
        assert_eq!(names(folder.path()).len(), others.len() + 1);
        let none = clean_temporaries("no/such/folder", Duration::ZERO).expect("nothing there");
        assert!(none.is_empty());
    }
}
