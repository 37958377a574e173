//! Ranks over MPI: the only place of this room that is unsafe, and the only one that knows rsmpi.
//!
//! MPI is initialised as `Funneled`: every call comes from the main thread, except `MPI_Abort`
//! from the hook of a thread that panics, since a panic must not leave the other ranks waiting
//! (a rank that unwinds hangs the job in `MPI_Finalize`).
#![allow(unsafe_code)]

mod relay;

use crate::error::{Error, Result};
use ::mpi::Threading;
use ::mpi::environment::Universe;
use ::mpi::ffi;
use ::mpi::point_to_point::MatchedReceiveVec;
use ::mpi::topology::SimpleCommunicator;
use ::mpi::traits::{AsRaw, Communicator, CommunicatorCollectives, Destination, Root, Source};
use std::cell::RefCell;
use std::ffi::{c_char, c_void};
use std::fmt::Display;
use std::mem::MaybeUninit;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long a waiting rank sleeps between looks; Open MPI would spin on a core instead.
const NAP: Duration = Duration::from_millis(2);
/// Tag of notes.
const NOTE: i32 = 1;
/// Tag of what `gather` sends.
const GATHERED: i32 = 2;
/// Tag of cargo.
const CARGO: i32 = 3;
/// Largest broadcast or gather in one call; MPI counts in `int`.
const PIECE: usize = 1 << 30;

/// MPI, initialised; finalised when dropped, on the main thread.
pub struct Session {
    outbox: RefCell<Vec<Posted>>,
    world: SimpleCommunicator,
    /// The ranks that share memory with this one, in the order of their numbers.
    node: SimpleCommunicator,
    // Dropped last: it finalises MPI.
    _universe: Universe,
}

/// A message on its way, with the memory that MPI still reads.
struct Posted {
    request: ffi::MPI_Request,
    _bytes: Arc<[u8]>,
}

impl Session {
    /// Initialises MPI and makes every later panic of this process end the job. Rank 0 says of others'
    /// what `words` makes of it.
    pub fn start(words: fn(&dyn Display) -> Vec<u8>) -> Result<Self> {
        let (universe, _) = ::mpi::initialize_with_threading(Threading::Funneled)
            .ok_or_else(|| Error::Failed("MPI was already initialised".into()))?;
        relay::start();
        let is_root = universe.world().rank() == 0;
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            if is_root || !relay::confess(words(panic)) {
                before(panic);
            }
            // SAFETY: MPI is initialised; `MPI_Abort` on the world communicator does not return,
            // and MPI is not used by this process again.
            unsafe { ffi::MPI_Abort(ffi::RSMPI_COMM_WORLD, 1) };
        }));
        wait_for_all_to_start();
        let world = universe.world();
        let node = world.split_shared(world.rank());
        Ok(Self { outbox: RefCell::default(), world, node, _universe: universe })
    }

    pub fn rank(&self) -> u32 {
        self.world.rank() as u32
    }

    pub fn size(&self) -> u32 {
        self.world.size() as u32
    }

    /// Rank 0's `bytes`, on every rank.
    pub fn broadcast(&self, bytes: Vec<u8>) -> Vec<u8> {
        from_first(&self.world, bytes)
    }

    /// The `bytes` of this node's first rank, on every rank of it. All ranks of the node call it.
    pub fn broadcast_in_node(&self, bytes: Vec<u8>) -> Vec<u8> {
        from_first(&self.node, bytes)
    }

    /// This rank's place among the ranks of its node, from 0, and how many these are.
    pub fn place_in_node(&self) -> (u32, u32) {
        (self.node.rank() as u32, self.node.size() as u32)
    }

    /// Every rank's `bytes` on rank 0, nothing elsewhere.
    pub fn gather(&self, bytes: &[u8]) -> Vec<Vec<u8>> {
        if self.rank() != 0 {
            let root = self.world.process_at_rank(0);
            root.send_with_tag(&(bytes.len() as u64), GATHERED);
            bytes.chunks(PIECE).for_each(|piece| root.send_with_tag(piece, GATHERED));
            return Vec::new();
        }
        let mut all = vec![bytes.to_vec()];
        for rank in 1..self.world.size() {
            let from = self.world.process_at_rank(rank);
            let (length, _) = from.receive_with_tag::<u64>(GATHERED);
            let mut theirs = vec![0; length as usize];
            for piece in theirs.chunks_mut(PIECE) {
                from.receive_into_with_tag(piece, GATHERED);
            }
            all.push(theirs);
        }
        all
    }

    /// The lowest of the ranks that share memory with this one, itself included. All ranks call it.
    pub fn node(&self) -> u32 {
        let mut first = self.world.rank();
        self.node.process_at_rank(0).broadcast_into(&mut first);
        first as u32
    }

    /// Starts sending and returns at once.
    pub fn post(&self, to: u32, is_cargo: bool, bytes: Arc<[u8]>) -> Result<()> {
        let length = i32::try_from(bytes.len())
            .map_err(|_| Error::Failed(format!("{} bytes are too much to send", bytes.len())))?;
        let tag = if is_cargo { CARGO } else { NOTE };
        let mut request = MaybeUninit::uninit();
        // SAFETY: `MPI_Isend` reads `bytes` until the request completes; the shared memory is kept
        // beside the request, is not moved or written, and is let go only in `clear_outbox`, after
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
        self.outbox.borrow_mut().push(Posted { request, _bytes: bytes });
        Ok(())
    }

    /// What has arrived, with its senders.
    pub fn arrived(&self, is_cargo: bool) -> Vec<(u32, Vec<u8>)> {
        self.clear_outbox();
        let any = self.world.any_process();
        let tag = if is_cargo { CARGO } else { NOTE };
        std::iter::from_fn(|| any.immediate_matched_probe_with_tag(tag))
            .map(|arrived| arrived.matched_receive_vec())
            .map(|(bytes, status)| (status.source_rank() as u32, bytes))
            .collect()
    }

    /// Whether something is still on its way.
    pub fn is_sending(&self) -> bool {
        !self.clear_outbox()
    }

    /// Waits, asleep, until every rank called this and every note of this rank is on its way.
    pub fn settle(&self, meanwhile: &mut dyn FnMut() -> Result<()>) -> Result<()> {
        while !self.clear_outbox() {
            meanwhile()?;
            std::thread::sleep(NAP);
        }
        let mut barrier = self.world.immediate_barrier();
        while let Err(pending) = barrier.test() {
            barrier = pending;
            if let Err(error) = meanwhile() {
                barrier.wait();
                return Err(error);
            }
            std::thread::sleep(NAP);
        }
        Ok(())
    }

    /// Waits, asleep, until every rank called this; false where somebody is not there after
    /// `patience`, and then nothing is left to do with the others but to end them. `meanwhile` runs at
    /// every look.
    pub fn assemble(&self, patience: Option<Duration>, meanwhile: &dyn Fn()) -> bool {
        let start = Instant::now();
        let mut barrier = self.world.immediate_barrier();
        while let Err(pending) = barrier.test() {
            meanwhile();
            if patience.is_some_and(|patience| start.elapsed() > patience) {
                // (Its request is MPI's until the end, which is near.)
                std::mem::forget(pending);
                return false;
            }
            barrier = pending;
            std::thread::sleep(NAP);
        }
        true
    }

    /// On rank 0: a rank that failed, with its words, which are to be said now. On others: takes along
    /// what a thread of this rank has to say.
    pub fn failure(&self) -> Option<(u32, Vec<u8>)> {
        if self.rank() != 0 {
            relay::pass_on();
            return None;
        }
        let arrived = self.world.any_process().immediate_matched_probe_with_tag(relay::FAILED)?;
        let (words, status) = arrived.matched_receive_vec();
        relay::answer(status.source_rank());
        Some((status.source_rank() as u32, words))
    }

    /// Has rank 0 say `words`; false where it does not hear.
    pub fn confess(&self, words: Vec<u8>) -> bool {
        self.rank() != 0 && relay::confess(words)
    }

    /// Ends all ranks.
    pub fn abort(&self, code: u8) {
        self.world.abort(i32::from(code));
    }

    /// Frees the notes that were sent; true when none is left.
    fn clear_outbox(&self) -> bool {
        let mut outbox = self.outbox.borrow_mut();
        outbox.retain_mut(|posted| {
            let mut done = 0;
            // SAFETY: the request comes from `MPI_Isend` and is active: completed ones are
            // removed here, before anything could test them again.
            unsafe { ffi::MPI_Test(&mut posted.request, &mut done, ffi::RSMPI_STATUS_IGNORE) };
            done == 0
        });
        outbox.is_empty()
    }
}

/// Waits until every rank has left `MPI_Init`, by the launcher's own barrier where it has one. In Open
/// MPI 5 a rank that is still in there crashes where a message of a quicker one reaches it
/// (open-mpi/ompi#12495; met with 5.0.7 over TCP on busy cores).
#[cfg(target_os = "linux")]
fn wait_for_all_to_start() {
    type Fence =
        unsafe extern "C" fn(*const c_void, usize, *const c_void, usize) -> std::ffi::c_int;
    unsafe extern "C" {
        fn dlsym(library: *mut c_void, name: *const c_char) -> *mut c_void;
    }
    // SAFETY: the name is a C string; on Linux the null library is `RTLD_DEFAULT`, all that the
    // program was linked with and what that needs. Open MPI 5 needs PMIx, others may not.
    let found = unsafe { dlsym(std::ptr::null_mut(), c"PMIx_Fence".as_ptr()) };
    if found.is_null() {
        return;
    }
    // SAFETY: `pmix_status_t PMIx_Fence(const pmix_proc_t[], size_t, const pmix_info_t[], size_t)` by
    // the PMIx Standard since 2.0, in which no processes are all of the job. MPI has initialised PMIx.
    let fence = unsafe { std::mem::transmute::<*mut c_void, Fence>(found) };
    // SAFETY: as above; every rank calls it once, here. Where it fails there is nothing to wait for.
    unsafe { fence(std::ptr::null(), 0, std::ptr::null(), 0) };
}

#[cfg(not(target_os = "linux"))]
fn wait_for_all_to_start() {}

/// The `bytes` of the first of some ranks, on all of them.
fn from_first(ranks: &SimpleCommunicator, mut bytes: Vec<u8>) -> Vec<u8> {
    let first = ranks.process_at_rank(0);
    let mut length = bytes.len() as u64;
    first.broadcast_into(&mut length);
    bytes.resize(length as usize, 0);
    for piece in bytes.chunks_mut(PIECE) {
        first.broadcast_into(piece);
    }
    bytes
}
