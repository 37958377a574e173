//! A rank that panics, or fails alone, ends the whole job, and rank 0 says why, once. Nothing in the program
//! is known to panic, so this starts itself under mpirun, with a maker of frames that does: on the
//! thread that renders, on one that it traces with, or on the main one.
#![allow(clippy::print_stdout, clippy::print_stderr)]
#![cfg_attr(not(feature = "mpi"), allow(dead_code, unused_imports))]

#[path = "common/mpirun.rs"]
mod launcher;

use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};
use tweenray::cluster::{self, Communicator, RankJob};
use tweenray::error::{Error, Result};
use tweenray::film::Film;
use tweenray::output::manifest::{FORMAT, Header};
use tweenray::output::{FramePattern, WriteOptions};
use tweenray::scene::{FrameRange, Settings};
use tweenray::sequence::{self, FrameGraph, FrameMaker, Made, RankMaker, Recipes, Target};
use tweenray::stats::{RayCounts, ReuseCounts};

/// First word of a rank's command line.
const AS_RANK: &str = "--as-rank";
const FRAMES: u32 = 60;
const SETTINGS: (u32, u32) = (8, 8);

/// Makes black frames of a tenth of a second; from frame 20 on, which are rank 1's, it fails where it is
/// told to.
struct Lemon {
    place: String,
}

impl FrameMaker for Lemon {
    fn make(&self, frame: u32) -> Result<Made> {
        std::thread::sleep(Duration::from_millis(100));
        let is_due = (20..40).contains(&frame);
        match &*self.place {
            "rendering" if is_due => panic!("the rendering thread met a lemon"),
            "pool" if is_due => rayon::join(|| (), || panic!("the pool met a lemon")),
            "error" if is_due => return Err(Error::Failed("a frame met a lemon".into())),
            "everywhere" => return Err(Error::Failed("all met a lemon".into())),
            _ => ((), ()),
        };
        Ok(Made {
            film: Film::new(SETTINGS.0, SETTINGS.1, false),
            rays: RayCounts::default(),
            reuse: ReuseCounts::default(),
            audit: None,
            reference: None,
        })
    }
}

impl FrameGraph for Lemon {}

impl RankMaker for Lemon {}

fn target(folder: &Path) -> Target {
    let settings = Settings { width: SETTINGS.0, height: SETTINGS.1, ..Settings::default() };
    let name = folder.join("f_##.png").display().to_string();
    Target {
        pattern: FramePattern::parse(&name, FRAMES).expect("a pattern"),
        header: Header { manifest: FORMAT, ..Header::default() },
        recipes: Recipes::default(),
        write: WriteOptions::of(&settings, None),
        overwrite: false,
    }
}

/// One rank of a job that will not end well.
fn be_a_rank(place: &str, folder: &Path) {
    let comm = Communicator::init(say).expect("a job");
    if let Some(busy) = place.strip_prefix("agreeing while rank ") {
        return fail_while_another_is_busy(&comm, busy.parse().expect("a rank"));
    }
    let target = target(folder);
    let frames = FrameRange { first: 1, last: FRAMES };
    let plan = comm.from_root(|| sequence::prepare(&target, frames)).expect("a plan");
    let order: Vec<u32> = (0..comm.size()).collect();
    let maker = Lemon { place: place.into() };
    let stop = AtomicBool::new(false);
    let done = |_: &_| assert!(place != "main", "the main thread met a lemon");
    let job = RankJob {
        comm: &comm,
        rank_order: &order,
        target: &target,
        plan: &plan,
        maker: &maker,
        stop: &stop,
        threads: 1,
        done: &done,
    };
    match cluster::render(&job) {
        Ok(outcome) => assert_eq!(outcome.unfinished, 0),
        Err(error) => comm.abort(&error),
    }
}

fn say(error: &Error) -> u8 {
    eprintln!("rank {} says: {error}", std::env::var("OMPI_COMM_WORLD_RANK").expect("a number"));
    7
}

/// Rank 1 fails, and not all others come to hear of it.
fn fail_while_another_is_busy(comm: &Communicator, busy: u32) {
    let outcome = match comm.rank() {
        1 => Err(Error::Failed("it met a lemon".into())),
        rank => {
            std::thread::sleep(Duration::from_secs(if rank == busy { 60 } else { 0 }));
            Ok(())
        }
    };
    if let Err(error) = comm.agree(outcome) {
        assert!(comm.has_unreported_failure());
        comm.abort(&error);
    }
}

/// Whether there is an mpirun to try it with.
fn a_failure_ends_the_job(place: &str, says: &str) -> bool {
    let folder = tempfile::tempdir().expect("a folder");
    let own = std::env::current_exe().expect("a path");
    let mut command = launcher::mpirun();
    command.args(["-n", "3"]).arg(own).args([AS_RANK, place]).arg(folder.path());
    let start = Instant::now();
    let Ok(output) = command.output() else { return false };
    let words = String::from_utf8_lossy(&output.stderr);
    assert!(start.elapsed() < Duration::from_secs(5), "{place}: {:?}", start.elapsed());
    match says {
        "" => assert!(output.status.success(), "{words}"),
        says => {
            assert!(!output.status.success(), "{place}: the job ended as if it were done");
            assert!(words.contains(says), "{place}: {words}");
            assert_eq!(words.matches("met a lemon").count(), 1, "{place}: {words}");
            // What was finished stays finished, and whole.
            let names = fs::read_dir(folder.path()).expect("a folder").flatten();
            let frames = names.filter(|n| n.file_name().to_string_lossy().ends_with(".png"));
            let all_whole = frames.map(|f| fs::read(f.path()).expect("a file"));
            assert!(all_whole.into_iter().all(|bytes| bytes.ends_with(b"IEND\xaeB`\x82")));
        }
    }
    true
}

#[cfg(not(feature = "mpi"))]
fn main() {}

#[cfg(feature = "mpi")]
fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    if let [first, place, folder] = &words[..] {
        if first == AS_RANK {
            return be_a_rank(place, Path::new(folder));
        }
    }
    // `cargo test -- --list` and the like ask for no run.
    if words.iter().any(|word| word == "--list" || word == "--ignored") {
        return;
    }
    for (place, says) in [
        ("rendering", "rank 0 says: rank 1: this is a fault in tweenray"),
        ("pool", "rank 0 says: rank 1: this is a fault in tweenray"),
        ("error", "rank 0 says: rank 1: a frame met a lemon"),
        ("everywhere", "rank 0 says: "),
        ("main", "the main thread met a lemon"),
        ("agreeing while rank 2", "rank 0 says: rank 1: it met a lemon"),
        ("agreeing while rank 0", "rank 1 says: it met a lemon"),
        ("nowhere", ""),
    ] {
        if !a_failure_ends_the_job(place, says) {
            println!("no mpirun: nothing to test");
            return;
        }
        println!("ends the job: {place} ... ok");
    }
}
