//! The lock of a sequence: held by every process that renders into it, freed by the system when the process
//! ends, however it ends.
//!
//! Jobs of the same settings and the same shot share the lock, since they write equal bytes; any other job is
//! refused meanwhile. It is a lock (`flock`) on a hidden file beside the frames, `.frame.lock` for
//! `frame_####.png`, whose content describes the job. The last process to end removes the file; a file that a
//! killed job leaves has no lock and does no harm.
//!
//! On NFS the kernel makes it a lock of the whole file on the server, so it holds between machines; if
//! a folder is mounted with `nolock` or `local_lock`, it holds only within each machine. On a file system
//! without locks there is none: see [`SequenceLock::is_kept`].

use super::FramePattern;
use super::manifest::{Header, beside};
use crate::error::{Error, Result};
use rustix::fs::{FlockOperation, flock};
use rustix::io::Errno;
use serde::{Deserialize, Serialize};
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Number of attempts to get the lock before this job is refused: the other job may just be ending, and a third
/// job that tries also holds the lock for a moment.
const LOOKS: usize = 10;
/// Pause between two attempts.
const NAP: Duration = Duration::from_millis(30);
/// How long to wait for a job that holds the lock exclusively and has not yet written its description.
const PATIENCE: Duration = Duration::from_secs(10);

/// The lock; dropping it frees it.
#[derive(Debug)]
pub struct SequenceLock {
    path: PathBuf,
    /// `None` where the file system has no locks.
    file: Option<File>,
}

/// The job that holds a lock, as described in the lock file.
#[derive(Serialize, Deserialize)]
struct Holder {
    process: u32,
    machine: String,
    header: Header,
}

/// The result of one attempt to get the lock.
enum Look {
    Kept(File),
    /// Another job holds it; its description, if it is written already.
    Taken(Option<Box<Holder>>),
    /// The file was replaced or removed meanwhile.
    Gone,
    NoLocks,
}

impl SequenceLock {
    /// Takes the lock of the frames at `pattern`, in an existing folder, for a job with `header`.
    ///
    /// # Errors
    /// [`Error::Usage`] if a job of other settings, or of another shot, holds it; [`Error::Io`].
    pub fn take(pattern: &FramePattern, header: &Header) -> Result<Self> {
        let path = path_of(pattern);
        let start = Instant::now();
        let mut others = Vec::new();
        while others.len() < LOOKS && start.elapsed() < PATIENCE {
            match look(&path, header)? {
                Look::Kept(file) => return Ok(Self { path, file: Some(file) }),
                Look::NoLocks => return Ok(Self { path, file: None }),
                Look::Taken(holder) => others.extend(holder),
                Look::Gone => {}
            }
            std::thread::sleep(NAP);
        }
        Err(refusal(pattern, header, others.last().map(|holder| &**holder)))
    }

    /// Whether the file system has locks at all.
    pub fn is_kept(&self) -> bool {
        self.file.is_some()
    }
}

impl Drop for SequenceLock {
    fn drop(&mut self) {
        let Some(file) = &self.file else { return };
        // Only the last one, with nobody waiting on this very file: who opened it before it goes looks
        // whether it still has its name.
        if flock(file, FlockOperation::NonBlockingLockExclusive).is_ok() && is_at(file, &self.path)
        {
            let _ = fs::remove_file(&self.path);
        }
    }
}

fn path_of(pattern: &FramePattern) -> PathBuf {
    let shown = beside(pattern, ".lock");
    let name = shown.file_name().unwrap_or_default().to_string_lossy();
    shown.with_file_name(format!(".{name}"))
}

fn look(path: &Path, header: &Header) -> Result<Look> {
    let io = |action: &'static str| move |e: io::Error| Error::io(action, path, e);
    // Over NFS an exclusive lock needs a file that is open for writing.
    let mut options = OpenOptions::new();
    let file = options.read(true).write(true).create(true).truncate(false).open(path);
    let mut file = file.map_err(io("open"))?;
    match lock(&file, FlockOperation::NonBlockingLockExclusive) {
        Ok(()) => {
            if !is_at(&file, path) {
                return Ok(Look::Gone);
            }
            sign(&mut file, header).map_err(io("write"))?;
        }
        Err(Errno::WOULDBLOCK) => {}
        Err(Errno::NOLCK | Errno::OPNOTSUPP | Errno::NOSYS | Errno::INVAL | Errno::BADF) => {
            return Ok(Look::NoLocks);
        }
        Err(e) => return Err(Error::io("lock", path, e.into())),
    }
    // To share it others must be let in for a moment, so that whose it is now is read once more.
    if lock(&file, FlockOperation::NonBlockingLockShared).is_err() {
        return Ok(Look::Taken(None));
    }
    if !is_at(&file, path) {
        return Ok(Look::Gone);
    }
    // While it is shared nobody writes. Without words whoever had it died before it had written them.
    Ok(match read(&mut file) {
        Some(holder) if is_same_job(&holder.header, header) => Look::Kept(file),
        holder => Look::Taken(holder.map(Box::new)),
    })
}

fn lock(file: &File, operation: FlockOperation) -> std::result::Result<(), Errno> {
    loop {
        match flock(file, operation) {
            Err(Errno::INTR) => {}
            locked => return locked,
        }
    }
}

/// Writes the job's description into the lock file.
fn sign(file: &mut File, header: &Header) -> io::Result<()> {
    let machine = rustix::system::uname().nodename().to_string_lossy().into_owned();
    let holder = Holder { process: std::process::id(), machine, header: header.clone() };
    let line = serde_json::to_vec(&holder)?;
    file.set_len(0)?;
    file.rewind()?;
    // (Not synced: what reads it holds the lock, and a network file system hands on what was written
    // before a lock is given up.)
    file.write_all(&line)
}

fn read(file: &mut File) -> Option<Holder> {
    let mut bytes = Vec::new();
    file.rewind().ok()?;
    file.read_to_end(&mut bytes).ok()?;
    serde_json::from_slice(&bytes).ok()
}

/// Whether two jobs write equal bytes for the same frame.
fn is_same_job(one: &Header, other: &Header) -> bool {
    one.shot_hash == other.shot_hash && one.first_difference(other).is_none()
}

fn is_at(file: &File, path: &Path) -> bool {
    let id = |found: fs::Metadata| (found.dev(), found.ino());
    let there = fs::metadata(path).map(id);
    there.is_ok_and(|there| file.metadata().is_ok_and(|own| id(own) == there))
}

fn refusal(pattern: &FramePattern, header: &Header, holder: Option<&Holder>) -> Error {
    let why = match holder {
        None => "another job".into(),
        Some(Holder { process, machine, header: theirs }) => {
            let what = match theirs.first_difference(header) {
                Some(d) => {
                    format!("of other settings: {}", d.there_and_here())
                }
                None => "of another camera move".into(),
            };
            format!("a job {what} (process {process} on {machine})")
        }
    };
    Error::Usage(format!(
        "{} is being rendered by {why}\n  \
         help: choose another output with -o, or replace that job's frames with --overwrite once it has ended",
        pattern
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Barrier;

    fn header(seed: u32, shot: &str) -> Header {
        let settings = serde_json::json!({ "seed": seed });
        Header { settings, shot_hash: shot.into(), ..Header::default() }
    }

    fn pattern(folder: &Path) -> FramePattern {
        FramePattern::parse(&format!("{}/f_##.png", folder.display()), 9).expect("a pattern")
    }

    #[test]
    fn equal_jobs_share_the_lock_and_others_are_refused_until_the_last_one_ends() {
        let folder = tempfile::tempdir().expect("a folder");
        let pattern = &pattern(folder.path());
        let take = |seed, shot| SequenceLock::take(pattern, &header(seed, shot));
        let (one, two) = (take(0, "a").expect("free"), take(0, "a").expect("shared"));
        drop(one);
        let told = take(1, "a").expect_err("other settings").to_string();
        assert!(told.contains("seed is 0 there, 1 here") && told.contains("f_##.png"), "{told}");
        let told = take(0, "b").expect_err("another shot").to_string();
        assert!(told.contains("of another camera move"), "{told}");
        assert!(path_of(pattern).exists());
        drop(two);
        assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 0);
        drop(take(1, "a").expect("free again"));
    }

    /// Lock files as after a crash: of one job before it wrote its description, of another after it.
    #[test]
    fn an_unlocked_lock_file_blocks_no_job() {
        let folder = tempfile::tempdir().expect("a folder");
        let pattern = pattern(folder.path());
        for words in ["", "{\"process\":", "nonsense"] {
            fs::write(path_of(&pattern), words).expect("written");
            drop(SequenceLock::take(&pattern, &header(0, "a")).expect("free"));
            assert!(!path_of(&pattern).exists());
        }
    }

    #[test]
    fn of_concurrent_jobs_only_equal_ones_hold_the_lock() {
        let folder = tempfile::tempdir().expect("a folder");
        let pattern = &pattern(folder.path());
        for _ in 0..20 {
            let (start, end) = (&Barrier::new(6), &Barrier::new(6));
            let won: Vec<Option<u32>> = std::thread::scope(|scope| {
                let job = |seed| {
                    move || {
                        start.wait();
                        let lock = SequenceLock::take(pattern, &header(seed, "a"));
                        end.wait();
                        lock.ok().map(|_| seed)
                    }
                };
                let jobs: Vec<_> = (0..6).map(|n| scope.spawn(job(n % 3))).collect();
                jobs.into_iter().map(|job| job.join().expect("no panic")).collect()
            });
            let winners: Vec<u32> = won.into_iter().flatten().collect();
            assert!(!winners.is_empty(), "nobody got it");
            assert!(winners.iter().all(|seed| *seed == winners[0]), "{winners:?}");
        }
    }
}
