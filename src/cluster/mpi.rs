//! Ranks over MPI: with `mpi/relay.rs` the only unsafe code of `cluster`, and the only user of rsmpi.
//!
//! MPI is initialised as `Funneled`: every call comes from the main thread. The exception is
//! `MPI_Abort` from the panic hook of any thread, because a rank that unwinds would hang the job in
//! `MPI_Finalize`.
#![allow(unsafe_code)]

mod relay;

use crate::error::{Error, Result};
use ::mpi::Threading;
use ::mpi::environment::Universe;
use ::mpi::ffi;
use ::mpi::point_to_point::MatchedReceiveVec;
use ::mpi::topology::SimpleCommunicator;
use ::mpi::traits::{AsRaw, Communicator as _, CommunicatorCollectives, Destination, Root, Source};
use std::cell::RefCell;
use std::ffi::{c_char, c_void};
use std::fmt::Display;
use std::mem::MaybeUninit;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time between polls of a waiting rank; Open MPI's own wait would spin on a core.
const POLL_INTERVAL: Duration = Duration::from_millis(2);
/// Tag of control messages.
const MESSAGE: i32 = 1;
/// Tag of the messages of `gather`.
const GATHERED: i32 = 2;
/// Tag of payloads.
const PAYLOAD: i32 = 3;
/// Most bytes of one broadcast or gather call, because MPI counts in `int`.
const MAX_BYTES: usize = 1 << 30;

/// Initialised MPI. Dropping it on the main thread finalises MPI.
pub struct Session {
    pending_sends: RefCell<Vec<PendingSend>>,
    world: SimpleCommunicator,
    /// The ranks that share memory with this rank, in rank order.
    node: SimpleCommunicator,
    // Dropped last: it finalises MPI.
    _universe: Universe,
}

/// A send that is not complete, with the memory that MPI still reads.
struct PendingSend {
    request: ffi::MPI_Request,
    _bytes: Arc<[u8]>,
}

impl Session {
    /// Initialises MPI. From then on a panic on any thread ends the job; on ranks other than 0, rank 0 gets
    /// the report that `encode_panic` makes.
    pub fn start(encode_panic: fn(&dyn Display) -> Vec<u8>) -> Result<Self> {
        let (universe, _) = ::mpi::initialize_with_threading(Threading::Funneled)
            .ok_or_else(|| Error::Failed("MPI was already initialised".into()))?;
        relay::start();
        let is_root = universe.world().rank() == 0;
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            if is_root || !relay::report_failure(encode_panic(panic)) {
                before(panic);
            }
            // SAFETY: MPI is initialised; `MPI_Abort` on the world communicator does not return,
            // and MPI is not used by this process again.
            unsafe { ffi::MPI_Abort(ffi::RSMPI_COMM_WORLD, 1) };
        }));
        wait_for_all_to_start();
        let world = universe.world();
        let node = world.split_shared(world.rank());
        Ok(Self { pending_sends: RefCell::default(), world, node, _universe: universe })
    }

    pub fn rank(&self) -> u32 {
        self.world.rank() as u32
    }

    pub fn size(&self) -> u32 {
        self.world.size() as u32
    }

    /// Rank 0's `bytes`, on every rank.
    pub fn broadcast(&self, bytes: Vec<u8>) -> Vec<u8> {
        broadcast_from_first(&self.world, bytes)
    }

    /// The `bytes` of the node's first rank, on every rank of the node. All ranks of the node call it.
    pub fn broadcast_in_node(&self, bytes: Vec<u8>) -> Vec<u8> {
        broadcast_from_first(&self.node, bytes)
    }

    /// This rank's number within its node, from 0, and the number of ranks on the node.
    pub fn node_rank_and_size(&self) -> (u32, u32) {
        (self.node.rank() as u32, self.node.size() as u32)
    }

    /// The `bytes` of all ranks, in rank order, on rank 0; empty on the others.
    pub fn gather(&self, bytes: &[u8]) -> Vec<Vec<u8>> {
        if self.rank() != 0 {
            let root = self.world.process_at_rank(0);
            root.send_with_tag(&(bytes.len() as u64), GATHERED);
            bytes.chunks(MAX_BYTES).for_each(|chunk| root.send_with_tag(chunk, GATHERED));
            return Vec::new();
        }
        let mut all = vec![bytes.to_vec()];
        for rank in 1..self.world.size() {
            let from = self.world.process_at_rank(rank);
            let (length, _) = from.receive_with_tag::<u64>(GATHERED);
            let mut received = vec![0; length as usize];
            for chunk in received.chunks_mut(MAX_BYTES) {
                from.receive_into_with_tag(chunk, GATHERED);
            }
            all.push(received);
        }
        all
    }

    /// The id of this rank's node: the lowest rank on the node. All ranks call it.
    pub fn node_id(&self) -> u32 {
        let mut first = self.world.rank();
        self.node.process_at_rank(0).broadcast_into(&mut first);
        first as u32
    }

    /// Starts a non-blocking send.
    pub fn send(&self, to: u32, is_payload: bool, bytes: Arc<[u8]>) -> Result<()> {
        let length = i32::try_from(bytes.len())
            .map_err(|_| Error::Failed(format!("{} bytes are too much to send", bytes.len())))?;
        let tag = if is_payload { PAYLOAD } else { MESSAGE };
        let mut request = MaybeUninit::uninit();
        // SAFETY: `MPI_Isend` reads `bytes` until the request completes; the shared memory is kept
        // beside the request, is not moved or written, and is freed only in `complete_sends`, after
        // `MPI_Test` said that the request is complete.
        let request = unsafe {
            ffi::MPI_Isend(
                bytes.as_ptr().cast(),
                length,
                ffi::RSMPI_UINT8_T,
                to as i32,
                tag,
                self.world.as_raw(),
                request.as_mut_ptr(),
            );
            request.assume_init()
        };
        self.pending_sends.borrow_mut().push(PendingSend { request, _bytes: bytes });
        Ok(())
    }

    /// All messages that have arrived, with their senders.
    pub fn receive(&self, is_payload: bool) -> Vec<(u32, Vec<u8>)> {
        self.complete_sends();
        let any = self.world.any_process();
        let tag = if is_payload { PAYLOAD } else { MESSAGE };
        std::iter::from_fn(|| any.immediate_matched_probe_with_tag(tag))
            .map(|message| message.matched_receive_vec())
            .map(|(bytes, status)| (status.source_rank() as u32, bytes))
            .collect()
    }

    /// Advances this rank's sends; whether any is not complete yet.
    pub fn has_pending_sends(&self) -> bool {
        !self.complete_sends()
    }

    /// Completes this rank's sends, then waits in a barrier; runs `meanwhile` at every poll. All ranks
    /// call it.
    pub fn flush_and_barrier(&self, meanwhile: &mut dyn FnMut() -> Result<()>) -> Result<()> {
        while !self.complete_sends() {
            meanwhile()?;
            std::thread::sleep(POLL_INTERVAL);
        }
        let mut barrier = self.world.immediate_barrier();
        while let Err(pending) = barrier.test() {
            barrier = pending;
            if let Err(error) = meanwhile() {
                barrier.wait();
                return Err(error);
            }
            std::thread::sleep(POLL_INTERVAL);
        }
        Ok(())
    }

    /// A barrier; false if a rank does not reach it within `timeout`, after which only
    /// [`abort`](Self::abort) may follow. Runs `meanwhile` at every poll.
    pub fn timed_barrier(&self, timeout: Option<Duration>, meanwhile: &dyn Fn()) -> bool {
        let start = Instant::now();
        let mut barrier = self.world.immediate_barrier();
        while let Err(pending) = barrier.test() {
            meanwhile();
            if timeout.is_some_and(|timeout| start.elapsed() > timeout) {
                // (MPI owns the request until the job is aborted.)
                std::mem::forget(pending);
                return false;
            }
            barrier = pending;
            std::thread::sleep(POLL_INTERVAL);
        }
        true
    }

    /// On rank 0: receives and acknowledges a failure report, and returns it with the failed rank. On
    /// other ranks: sends the report of another thread.
    pub fn receive_failure(&self) -> Option<(u32, Vec<u8>)> {
        if self.rank() != 0 {
            relay::send_report();
            return None;
        }
        let message = self.world.any_process().immediate_matched_probe_with_tag(relay::FAILED)?;
        let (report, status) = message.matched_receive_vec();
        relay::acknowledge(status.source_rank());
        Some((status.source_rank() as u32, report))
    }

    /// Reports a failure to rank 0, which prints it; false if rank 0 does not acknowledge in time.
    pub fn report_failure(&self, report: Vec<u8>) -> bool {
        self.rank() != 0 && relay::report_failure(report)
    }

    /// Ends all ranks.
    pub fn abort(&self, code: u8) {
        self.world.abort(i32::from(code));
    }

    /// Frees the memory of completed sends; true when no send is pending.
    fn complete_sends(&self) -> bool {
        let mut pending = self.pending_sends.borrow_mut();
        pending.retain_mut(|send| {
            let mut done = 0;
            // SAFETY: the request comes from `MPI_Isend` and is active: completed ones are
            // removed here, before anything could test them again.
            unsafe { ffi::MPI_Test(&mut send.request, &mut done, ffi::RSMPI_STATUS_IGNORE) };
            done == 0
        });
        pending.is_empty()
    }
}

/// Waits until every rank has left `MPI_Init`, in a PMIx barrier where the launcher has PMIx. In Open MPI 5
/// a rank inside `MPI_Init` crashes when a message of a faster rank arrives (open-mpi/ompi#12495; seen
/// with 5.0.7 over TCP on busy cores).
#[cfg(target_os = "linux")]
fn wait_for_all_to_start() {
    type Fence =
        unsafe extern "C" fn(*const c_void, usize, *const c_void, usize) -> std::ffi::c_int;
    unsafe extern "C" {
        fn dlsym(library: *mut c_void, name: *const c_char) -> *mut c_void;
    }
    // SAFETY: the name is a C string; on Linux the null handle is `RTLD_DEFAULT`, all libraries that
    // the program loaded. Open MPI 5 loads PMIx; other MPIs may not.
    let found = unsafe { dlsym(std::ptr::null_mut(), c"PMIx_Fence".as_ptr()) };
    if found.is_null() {
        return;
    }
    // SAFETY: `pmix_status_t PMIx_Fence(const pmix_proc_t[], size_t, const pmix_info_t[], size_t)` by
    // the PMIx Standard since 2.0; an empty process list means the whole job. MPI has initialised PMIx.
    let fence = unsafe { std::mem::transmute::<*mut c_void, Fence>(found) };
    // SAFETY: as above; every rank calls it once, here. An error means no barrier, and is ignored.
    unsafe { fence(std::ptr::null(), 0, std::ptr::null(), 0) };
}

#[cfg(not(target_os = "linux"))]
fn wait_for_all_to_start() {}

/// The `bytes` of the communicator's first rank, on all its ranks.
fn broadcast_from_first(ranks: &SimpleCommunicator, mut bytes: Vec<u8>) -> Vec<u8> {
    let first = ranks.process_at_rank(0);
    let mut length = bytes.len() as u64;
    first.broadcast_into(&mut length);
    bytes.resize(length as usize, 0);
    for chunk in bytes.chunks_mut(MAX_BYTES) {
        first.broadcast_into(chunk);
    }
    bytes
}
