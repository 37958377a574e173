//! How a rank that fails has rank 0 say so, since rank 0's words are those that people read: in a large
//! job the others' may go to files of their own, or between its lines.
//!
//! MPI is the main thread's. So a thread that panics leaves its words here, and the main thread, which
//! looks for messages every millisecond while frames are made, takes them along.

use ::mpi::ffi;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::thread::ThreadId;
use std::time::{Duration, Instant};

/// Tag of what a rank that failed has to say.
pub const FAILED: i32 = 4;
/// Tag of rank 0's answer, which is empty: it says it now.
pub const HEARD: i32 = 5;
/// How long a rank that failed waits for that; rank 0 may be reading, or tracing on its own.
const PATIENCE: Duration = Duration::from_millis(1500);
/// How long it waits then to be ended by rank 0.
const GRACE: Duration = Duration::from_millis(1500);
const NAP: Duration = Duration::from_millis(2);

static MAIN: OnceLock<ThreadId> = OnceLock::new();
static WORDS: Mutex<Option<Vec<u8>>> = Mutex::new(None);
static HAS_FAILED: AtomicBool = AtomicBool::new(false);
static IS_SENT: AtomicBool = AtomicBool::new(false);
static IS_HEARD: AtomicBool = AtomicBool::new(false);

/// Makes the calling thread the one that talks to MPI.
pub fn start() {
    _ = MAIN.set(std::thread::current().id());
}

/// Has rank 0 say `words`, and waits to be ended; false where rank 0 does not hear, so that this rank
/// has to say them. Of several threads only the first to fail is told: for the others it is true.
pub fn confess(words: Vec<u8>) -> bool {
    let is_first = !HAS_FAILED.swap(true, Ordering::SeqCst);
    if is_first {
        *WORDS.lock().unwrap_or_else(PoisonError::into_inner) = Some(words);
    }
    let is_main = MAIN.get() == Some(&std::thread::current().id());
    let patience = if is_first { PATIENCE } else { PATIENCE + GRACE };
    let start = Instant::now();
    while start.elapsed() < patience {
        // Whoever failed first: nobody else may talk to MPI.
        if is_main {
            pass_on();
        }
        if IS_HEARD.load(Ordering::SeqCst) {
            std::thread::sleep(GRACE);
            return true;
        }
        std::thread::sleep(NAP);
    }
    !is_first
}

/// On the main thread: sends what another left to say, and looks for rank 0's answer.
pub fn pass_on() {
    if !HAS_FAILED.load(Ordering::SeqCst) {
        return;
    }
    let words = WORDS.lock().unwrap_or_else(PoisonError::into_inner).take();
    if let Some(words) = words {
        send(0, FAILED, words);
        IS_SENT.store(true, Ordering::SeqCst);
    }
    if IS_SENT.load(Ordering::SeqCst) && has_come(0, HEARD) {
        IS_HEARD.store(true, Ordering::SeqCst);
    }
}

/// Rank 0's answer to rank `to`.
pub fn answer(to: i32) {
    send(to, HEARD, Vec::new());
}

/// Sends without waiting. The process ends soon, so nobody looks at the request, and MPI keeps the bytes.
fn send(to: i32, tag: i32, bytes: Vec<u8>) {
    let Ok(length) = i32::try_from(bytes.len()) else { return };
    let bytes: &'static [u8] = Vec::leak(bytes);
    let mut request = std::mem::MaybeUninit::uninit();
    // SAFETY: MPI is initialised and this is its thread; the bytes live as long as the process.
    unsafe {
        ffi::MPI_Isend(
            bytes.as_ptr().cast(),
            length,
            ffi::RSMPI_UINT8_T,
            to,
            tag,
            ffi::RSMPI_COMM_WORLD,
            request.as_mut_ptr(),
        )
    };
}

fn has_come(from: i32, tag: i32) -> bool {
    let mut flag = 0;
    // SAFETY: as above; the status is not asked for.
    unsafe {
        ffi::MPI_Iprobe(from, tag, ffi::RSMPI_COMM_WORLD, &mut flag, ffi::RSMPI_STATUS_IGNORE)
    };
    flag != 0
}
