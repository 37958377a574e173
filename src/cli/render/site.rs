//! Where frames are rendered: ranks, threads and intersector, ready.

use crate::cli::request::Request;
use crate::cli::signals::Interrupt;
use crate::cli::{machine, say};
use crate::cluster::{self, Binding, Communicator};
use crate::error::{Result, counted};
use crate::intersect::{self, Intersector};
use crate::scene::Settings;
use rayon::ThreadPool;
use std::path::Path;
use std::time::Instant;

/// Where frames are rendered.
pub(super) struct Site<'a> {
    pub comm: &'a Communicator,
    pub interrupt: &'a Interrupt,
    pub intersector: Box<dyn Intersector + Send + 'a>,
    pub pool: ThreadPool,
    /// The ranks, node by node.
    pub order: Vec<u32>,
    /// Description of the intersector, as far as frames depend on it.
    pub tracer: String,
    pub clock: Clock,
    /// Whether messages are suppressed.
    pub quiet: bool,
}

/// When the program started, and when it had loaded and built the scene.
pub(super) struct Clock {
    pub start: Instant,
    pub loaded: Instant,
    pub built: Instant,
}

impl Clock {
    /// Seconds that building the intersector took.
    pub fn build_seconds(&self) -> f64 {
        (self.built - self.loaded).as_secs_f64()
    }
}

impl<'a> Site<'a> {
    /// Starts threads and builds the intersector for `request`. All ranks call it.
    ///
    /// Errors: an invalid rank map or number of threads; errors of building; ranks with different
    /// intersectors.
    pub fn new(
        comm: &'a Communicator,
        interrupt: &'a Interrupt,
        request: &'a Request,
        (start, rank_map, quiet): (Instant, Option<&Path>, bool),
    ) -> Result<Self> {
        let order = cluster::rank_order(comm, rank_map)?;
        let threads = match request.options.threads {
            Some(threads) => threads as usize,
            None => comm.default_threads()?,
        };
        let pool = comm.agree(machine::thread_pool(threads))?;
        let binding = comm.binding(threads)?;
        say::unless(quiet, binding.as_slice(), |binding| say::note(in_words(binding)));
        let loaded = Instant::now();
        let build = || intersect::build(&request.scene, &request.settings, threads);
        let intersector = comm.agree(pool.install(build))?;
        let built = Instant::now();
        let tracer = request.tracer(&intersector.describe())?;
        let tracer = comm.same_everywhere("traces with", tracer)?;
        let clock = Clock { start, loaded, built };
        Ok(Self { comm, interrupt, intersector, pool, order, tracer, clock, quiet })
    }
}

/// Sets every rank to the widest instruction set that all their machines have, unless the user chose one; the
/// last bits of frames depend on it.
pub(super) fn share_isa(comm: &Communicator, settings: &mut Settings, quiet: bool) -> Result<()> {
    let best: Vec<String> = comm.all_gather(machine::best_isa()?.to_string())?;
    let Some(isa) = machine::shared_isa(&best) else { return Ok(()) };
    // Where Embree would choose the same on every machine it may.
    let needed = comm.all_gather(isa != machine::detected_isa())?.contains(&true);
    if settings.isa.is_none() && needed {
        settings.isa = Some(isa.into());
        if best.iter().any(|other| other != isa) {
            let what = "the machines have different instruction sets; all use what they share:";
            say::unless(quiet, &[format!("{what} {isa}")], |note| say::note(note));
        }
    }
    Ok(())
}

/// The note about cores that the launcher leaves idle, with a remedy.
fn in_words(binding: &Binding) -> String {
    let Binding { ranks, cores, threads, of, idle } = *binding;
    let each = if ranks == 1 { "its rank".into() } else { format!("each of its {ranks} ranks") };
    let has = if ranks == 1 { "it has" } else { "a rank has" };
    let idle = if idle == 1 { "1 core idles".into() } else { format!("{idle} cores idle") };
    format!(
        "the launcher binds {each} to {cores} of this machine's {of} cores: {has} {}, and {idle}\n  \
         help: mpirun --bind-to none; with it --map-by ppr:1:node starts one rank a node",
        counted(threads, "thread")
    )
}
