//! What ends a job early: Ctrl-C, SIGTERM, SIGUSR1, time limits and the death of its launcher ask it to
//! stop; a second Ctrl-C or SIGTERM ends it at once.

use super::exit::Exit;
use super::progress::duration;
use super::say;
use crate::cluster::LauncherProcess;
use crate::error::{Error, Result};
use signal_hook::consts::{SIGINT, SIGTERM, SIGUSR1};
use signal_hook::iterator::Signals;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// How long before the end of its Slurm allocation a job stops: it takes at most ten seconds, and the
/// clocks of two machines differ.
const BEFORE_SLURM_ENDS: Duration = Duration::from_secs(30);

/// How long other ranks wait for rank 0 to end the job while no work watches the stop flag: a batch system signals
/// all ranks, and one message is enough.
const AFTER_RANK_0: Duration = Duration::from_secs(3);

/// How often a rank checks that its launcher is alive.
const LOOK: Duration = Duration::from_millis(500);

/// How long a rank without a launcher may take to stop: longer than a job takes on SIGTERM. Then it
/// ends in any case, since without its launcher MPI may wait forever.
const ORPHANS_GRACE: Duration = Duration::from_secs(15);

/// The default words about how to resume.
const GOES_ON: &str = "; the same command goes on from here";

/// The requests of signals and time limits.
#[derive(Debug, Clone)]
pub struct Interrupt {
    /// Set by the first signal or limit.
    pub stop: Arc<AtomicBool>,
    /// Whether some work watches `stop` and can end cleanly. While none does (loading, building), nothing can be
    /// lost, and the first signal ends the program.
    watched: Arc<AtomicBool>,
    is_root: Arc<AtomicBool>,
    /// Whether the exit code is decided. Then signals print nothing and do not change it: a launcher
    /// sends SIGTERM to the other ranks as soon as one ends with an error. Locked while a signal
    /// ends the program, so that only one of the two happens.
    is_over: Arc<Mutex<bool>>,
    /// Words about how to resume, to follow the reason.
    how: Arc<Mutex<String>>,
    /// Whether SIGINT or SIGTERM has been received; a second one ends the program.
    asked: Arc<AtomicBool>,
    reason: Arc<OnceLock<String>>,
    /// The launcher of this rank.
    launcher: Arc<OnceLock<LauncherProcess>>,
}

impl Interrupt {
    /// No requests, and not listening yet.
    pub fn new() -> Self {
        Self {
            stop: Arc::default(),
            watched: Arc::default(),
            is_root: Arc::default(),
            is_over: Arc::default(),
            how: Arc::new(Mutex::new(GOES_ON.into())),
            asked: Arc::default(),
            reason: Arc::default(),
            launcher: Arc::default(),
        }
    }

    /// Starts to listen, on rank 0 or another.
    pub fn listen(&self, is_root: bool) -> Result<()> {
        self.is_root.store(is_root, Ordering::SeqCst);
        let mut signals = Signals::new([SIGINT, SIGTERM, SIGUSR1])
            .map_err(|e| Error::Failed(format!("cannot listen for signals: {e}")))?;
        let theirs = self.clone();
        std::thread::spawn(move || signals.forever().for_each(|signal| theirs.on(signal)));
        Ok(())
    }

    /// Marks the exit code as decided: from now on signals and limits do nothing, except the
    /// second SIGINT or SIGTERM, which still ends the program at once.
    pub fn over(&self) {
        let mut is_over = self.is_over.lock().unwrap_or_else(PoisonError::into_inner);
        if !std::mem::replace(&mut *is_over, true) {
            self.asked.store(false, Ordering::SeqCst);
        }
    }

    /// Stops when `limit` has passed since `start`.
    pub fn limit(&self, start: Instant, limit: Option<Duration>) {
        let Some(limit) = limit else { return };
        let reason = format!(" at the time limit of {}", duration(limit.as_secs_f64()));
        self.stop_after(limit.saturating_sub(start.elapsed()), reason);
    }

    /// Stops shortly before the end of the Slurm allocation of this process, if it has one.
    pub fn before_slurm_ends(&self) {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let end = std::env::var("SLURM_JOB_END_TIME").ok();
        if let Some(left) = end.and_then(|end| until_slurm_ends(&end, now)) {
            self.stop_after(left, " shortly before the Slurm job ends".into());
        }
    }

    /// Stops when `launcher`, which started this rank, ends: otherwise the ranks would keep
    /// the cores and the folder.
    pub fn end_with(&self, launcher: LauncherProcess) {
        let _ = self.launcher.set(launcher.clone());
        let theirs = self.clone();
        std::thread::spawn(move || {
            while !launcher.is_gone() {
                std::thread::sleep(LOOK);
            }
            let LauncherProcess { name, id, .. } = launcher;
            theirs.stop(format!(" since {name} (process {id}), which started it, has ended"));
            std::thread::sleep(ORPHANS_GRACE);
            signal_hook::low_level::exit(Exit::Orphaned.code().into());
        });
    }

    /// Whether the launcher of this rank has ended, so that MPI cannot be finalised any more. Another
    /// rank may have noticed that first and stopped this one.
    pub fn is_orphan(&self) -> bool {
        self.launcher.get().is_some_and(LauncherProcess::is_gone)
    }

    /// Why the job stops, to follow the word `stopped`.
    pub fn reason(&self) -> String {
        self.reason.get().cloned().unwrap_or_default()
    }

    /// Sets the words about `how` to resume, which the end of the program prints from now on.
    pub fn goes_on(&self, how: String) {
        *self.how.lock().unwrap_or_else(PoisonError::into_inner) = how;
    }

    /// Prints that the job was stopped while no frame was rendered, and how to resume.
    pub fn say_stopped(&self) {
        let how = self.how.lock().unwrap_or_else(PoisonError::into_inner);
        say::aside(format_args!("stopped{}{how}", self.reason()));
    }

    /// Runs `work`, which watches `stop`.
    pub fn watched<T>(&self, work: impl FnOnce() -> T) -> T {
        self.watched.store(true, Ordering::SeqCst);
        let result = work();
        self.watched.store(false, Ordering::SeqCst);
        result
    }

    fn stop_after(&self, time: Duration, reason: String) {
        let theirs = self.clone();
        std::thread::spawn(move || {
            std::thread::sleep(time);
            theirs.stop(reason);
        });
    }

    fn on(&self, signal: i32) {
        // A system may send SIGUSR1 as a first warning, and more than once.
        if signal != SIGUSR1 && self.asked.swap(true, Ordering::SeqCst) {
            let _ = signal_hook::low_level::emulate_default_handler(signal);
        }
        let name = signal_hook::low_level::signal_name(signal).unwrap_or("a signal");
        self.stop(format!(" by {name}"));
    }

    fn stop(&self, reason: String) {
        if *self.is_over.lock().unwrap_or_else(PoisonError::into_inner) {
            return;
        }
        let _ = self.reason.set(reason);
        if self.stop.swap(true, Ordering::SeqCst) {
            // The first request is being followed already.
            return;
        }
        if !self.watched.load(Ordering::SeqCst) {
            if self.is_root.load(Ordering::SeqCst) {
                self.exit();
                return;
            }
            // Not on the thread that hears of the next signal.
            let theirs = self.clone();
            std::thread::spawn(move || {
                std::thread::sleep(AFTER_RANK_0);
                if !theirs.watched.load(Ordering::SeqCst) {
                    theirs.exit();
                }
            });
        }
    }

    /// Ends the program, unless its exit code is decided already.
    fn exit(&self) {
        let is_over = self.is_over.lock().unwrap_or_else(PoisonError::into_inner);
        if !*is_over {
            self.say_stopped();
            if self.is_orphan() {
                signal_hook::low_level::exit(Exit::Orphaned.code().into());
            }
            // Without what runs at exit: the main thread may be freeing the same things.
            signal_hook::low_level::exit(Exit::Stopped.code().into());
        }
    }
}

/// How long a job may run from `now` on if its allocation ends at `end` (seconds since 1970); `None`
/// if the end has passed, since then it is not this process's.
fn until_slurm_ends(end: &str, now: Duration) -> Option<Duration> {
    let left = Duration::from_secs(end.trim().parse().ok()?).checked_sub(now)?;
    Some(left.saturating_sub(BEFORE_SLURM_ENDS))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slurm_job_stops_before_its_end() {
        let left = |end, now| until_slurm_ends(end, Duration::from_secs(now)).map(|d| d.as_secs());
        assert_eq!(left("1000", 700), Some(270));
        assert_eq!(left("1000", 990), Some(0));
        assert_eq!(left("1000", 1001), None);
        assert_eq!(left("soon", 5), None);
    }

    /// (Otherwise the test process would exit here, with code 75.)
    #[test]
    fn nothing_is_stopped_once_the_exit_code_is_known() {
        let interrupt = Interrupt::new();
        interrupt.is_root.store(true, Ordering::SeqCst);
        interrupt.over();
        interrupt.on(SIGTERM);
        interrupt.on(SIGUSR1);
        interrupt.stop(" at a limit".into());
        assert!(!interrupt.stop.load(Ordering::SeqCst));
        assert_eq!(interrupt.reason(), "");
        // Earlier requests do not count: the launcher's signal is the first.
        let interrupt = Interrupt::new();
        interrupt.watched(|| interrupt.on(SIGTERM));
        interrupt.over();
        interrupt.on(SIGTERM);
        assert_eq!(interrupt.reason(), " by SIGTERM");
        // One that was on its way when the code became known.
        interrupt.exit();
    }
}
