//! Failure reports to rank 0, which prints the error. In a large job the output of other ranks may go to
//! separate files, or be mixed with rank 0's lines.
//!
//! Only the main thread may call MPI. So a thread that panics stores its report here, and the main
//! thread, which polls every millisecond while frames are rendered, sends it.

use ::mpi::ffi;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::thread::ThreadId;
use std::time::{Duration, Instant};

/// Tag of a failure report.
pub const FAILED: i32 = 4;
/// Tag of rank 0's empty acknowledgement, sent before rank 0 prints the error.
pub const ACKNOWLEDGED: i32 = 5;
/// How long a failed rank waits for the acknowledgement; rank 0 may not poll, because
/// it reads files or traces on its main thread.
const ACKNOWLEDGE_TIMEOUT: Duration = Duration::from_millis(1500);
/// How long a failed rank then waits for rank 0 to abort the job.
const ABORT_TIMEOUT: Duration = Duration::from_millis(1500);
const POLL_INTERVAL: Duration = Duration::from_millis(2);

static MAIN: OnceLock<ThreadId> = OnceLock::new();
static REPORT: Mutex<Option<Vec<u8>>> = Mutex::new(None);
static HAS_FAILED: AtomicBool = AtomicBool::new(false);
static IS_SENT: AtomicBool = AtomicBool::new(false);
static IS_ACKNOWLEDGED: AtomicBool = AtomicBool::new(false);

/// Records the calling thread as the one that may call MPI.
pub fn start() {
    _ = MAIN.set(std::thread::current().id());
}

/// Reports a failure to rank 0 and waits for the job to be aborted; false if rank 0 does not
/// acknowledge in time, so that this rank must print the error. If several threads fail, only the first is
/// reported; the others get true.
pub fn report_failure(report: Vec<u8>) -> bool {
    let is_first = !HAS_FAILED.swap(true, Ordering::SeqCst);
    if is_first {
        *REPORT.lock().unwrap_or_else(PoisonError::into_inner) = Some(report);
    }
    let is_main = MAIN.get() == Some(&std::thread::current().id());
    let timeout = if is_first { ACKNOWLEDGE_TIMEOUT } else { ACKNOWLEDGE_TIMEOUT + ABORT_TIMEOUT };
    let start = Instant::now();
    while start.elapsed() < timeout {
        // The main thread sends the report of whichever thread failed first.
        if is_main {
            send_report();
        }
        if IS_ACKNOWLEDGED.load(Ordering::SeqCst) {
            std::thread::sleep(ABORT_TIMEOUT);
            return true;
        }
        std::thread::sleep(POLL_INTERVAL);
    }
    !is_first
}

/// On the main thread: sends a stored report, and looks for rank 0's acknowledgement.
pub fn send_report() {
    if !HAS_FAILED.load(Ordering::SeqCst) {
        return;
    }
    let report = REPORT.lock().unwrap_or_else(PoisonError::into_inner).take();
    if let Some(report) = report {
        send(0, FAILED, report);
        IS_SENT.store(true, Ordering::SeqCst);
    }
    if IS_SENT.load(Ordering::SeqCst) && has_arrived(0, ACKNOWLEDGED) {
        IS_ACKNOWLEDGED.store(true, Ordering::SeqCst);
    }
}

/// On rank 0: acknowledges the report of rank `to`.
pub fn acknowledge(to: i32) {
    send(to, ACKNOWLEDGED, Vec::new());
}

/// Starts a non-blocking send. The bytes are leaked and the request is never tested, because the process
/// ends soon.
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

fn has_arrived(from: i32, tag: i32) -> bool {
    let mut flag = 0;
    // SAFETY: as in `send`; the status is ignored.
    unsafe {
        ffi::MPI_Iprobe(from, tag, ffi::RSMPI_COMM_WORLD, &mut flag, ffi::RSMPI_STATUS_IGNORE)
    };
    flag != 0
}
