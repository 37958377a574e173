//! Waiting for other programs that this one starts.

use crate::error::{Error, Result};
use std::ffi::OsStr;
use std::io::{self, Read};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Pause between two checks whether the program has ended or is to be stopped.
const NAP: Duration = Duration::from_millis(1);

/// The end of another program.
pub struct Ran {
    /// Whether it succeeded.
    pub is_done: bool,
    stderr: Vec<u8>,
}

impl Ran {
    /// The last lines that it wrote to stderr, at most some 1,000 characters.
    pub fn last_words(&self) -> String {
        let text = String::from_utf8_lossy(&self.stderr);
        let text = text.trim();
        let skip = text.chars().count().saturating_sub(1000);
        text.chars().skip(skip).collect()
    }
}

/// Starts `program`, whose stdout is dropped and whose stderr is for [`watch`].
///
/// # Errors
/// [`Error::Io`].
pub fn start(
    program: &OsStr,
    args: impl IntoIterator<Item = impl AsRef<OsStr>>,
    stdin: Stdio,
) -> Result<Child> {
    let mut command = Command::new(program);
    command.args(args).stdin(stdin).stdout(Stdio::null()).stderr(Stdio::piped());
    command.spawn().map_err(|e| Error::io("run", program, e))
}

/// Waits for `child`, and kills it when `stop` is set. Reads its stderr meanwhile, since a full pipe would block
/// it.
///
/// # Errors
/// Those of waiting and of killing.
pub fn watch(child: &mut Child, stop: &AtomicBool) -> io::Result<Ran> {
    let said = child.stderr.take();
    let reader = std::thread::spawn(move || {
        let mut stderr = Vec::new();
        // Half of its words are better than none.
        let _ = said.map(|mut said| said.read_to_end(&mut stderr));
        stderr
    });
    let status = loop {
        if let Some(status) = child.try_wait()? {
            break status;
        }
        if stop.load(Ordering::Relaxed) {
            child.kill()?;
        }
        std::thread::sleep(NAP);
    };
    // It may leave another behind, as a script does, that holds the pipe open.
    while !reader.is_finished() && !stop.load(Ordering::Relaxed) {
        std::thread::sleep(NAP);
    }
    let is_over = reader.is_finished();
    let stderr = if is_over { reader.join().unwrap_or_default() } else { Vec::new() };
    Ok(Ran { is_done: status.success(), stderr })
}
