//! Ctrl-C and SIGTERM: the first asks the job to stop, the second ends it at once.

use super::exit::Exit;
use super::say;
use crate::error::{Error, Result};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// What signals have asked for.
#[derive(Debug, Clone)]
pub struct Interrupt {
    /// Set by the first signal.
    pub stop: Arc<AtomicBool>,
    /// Whether somebody watches `stop`, so that work in hand can be finished cleanly. While
    /// nobody does (loading, building), nothing is at risk and the first signal ends the program.
    watched: Arc<AtomicBool>,
}

impl Interrupt {
    /// Starts to listen.
    pub fn listen() -> Result<Self> {
        let interrupt = Self { stop: Arc::default(), watched: Arc::default() };
        let mut signals = Signals::new([SIGINT, SIGTERM])
            .map_err(|e| Error::Failed(format!("cannot listen for signals: {e}")))?;
        let theirs = interrupt.clone();
        std::thread::spawn(move || signals.forever().for_each(|signal| theirs.on(signal)));
        Ok(interrupt)
    }

    /// Runs `work`, which watches `stop`.
    pub fn watched<T>(&self, work: impl FnOnce() -> T) -> T {
        self.watched.store(true, Ordering::SeqCst);
        let result = work();
        self.watched.store(false, Ordering::SeqCst);
        result
    }

    fn on(&self, signal: i32) {
        let again = self.stop.swap(true, Ordering::SeqCst);
        if again {
            let _ = signal_hook::low_level::emulate_default_handler(signal);
        }
        if !self.watched.load(Ordering::SeqCst) {
            say::aside(Error::Stopped);
            std::process::exit(Exit::Stopped.code().into());
        }
    }
}
