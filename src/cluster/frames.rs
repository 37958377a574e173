//! Rendering the frames of a sequence on all ranks of the job.

use super::comm_thread::CommThread;
use super::render_thread::Event;
use super::scheduler::Scheduler;
use super::traffic::Traffic;
use super::{Communicator, render_thread};
use crate::error::Result;
use crate::output::manifest::{Manifest, manifest_path, part_path};
use crate::output::{SequenceLock, atomic};
use crate::scene::FrameRange;
use crate::sequence::{
    self, FrameReport, FrameWriter, Plan, RankMaker, Target, WriterContext, frame_channel,
};
use rayon::ThreadPool;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::time::Instant;

/// The result of rendering a plan.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// The reports of all finished frames, in frame order, each with its rank. On rank 0 only.
    pub frames: Vec<(u32, FrameReport)>,
    /// Number of frames that were not rendered; 0 on ranks other than 0.
    pub unfinished: usize,
    /// Notes of all ranks for the user, without duplicates. On rank 0 only.
    pub notes: Vec<String>,
    /// The work of this rank.
    pub own: RankWork,
}

/// The work of one rank for a plan.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct RankWork {
    /// Seconds in which the rank rendered frames or strips, or wrote frames, or did both at once.
    pub busy_seconds: f64,
    /// Seconds in which the rank had no task, or waited for references.
    pub waiting_seconds: f64,
    /// Messages that the rank sent.
    pub sent: Traffic,
}

/// Takes the lock of the sequence at `target` on every rank, so the lock holds while any rank lives.
/// All ranks call it.
///
/// # Errors
/// As for [`SequenceLock::take`]; or the folder cannot be made.
pub fn lock(comm: &Communicator, target: &Target) -> Result<SequenceLock> {
    // All ranks must have released the lock of an earlier round, which had other settings.
    comm.agree(Ok(()))?;
    let take = || SequenceLock::take(&target.pattern, &target.header);
    let mut roots = None;
    // Rank 0 competes with other jobs for the lock; the ranks of its own job then share it.
    comm.from_root(|| {
        atomic::create_folder(target.pattern.folder())?;
        roots = Some(take()?);
        Ok(())
    })?;
    comm.agree(roots.map_or_else(take, Ok))
}

/// The plan of [`sequence::prepare`], on every rank. Each rank checks a share of the existing files, on
/// the threads of `pool`. All ranks call it.
///
/// # Errors
/// As for [`sequence::prepare`].
pub fn prepare(
    comm: &Communicator,
    pool: &ThreadPool,
    target: &Target,
    frames: FrameRange,
) -> Result<Plan> {
    if comm.size() == 1 {
        return pool.install(|| sequence::prepare(target, frames));
    }
    let mut found = None;
    if comm.from_root(|| sequence::has_frames_to_check(target))? {
        let own = own_share(frames, comm.rank(), comm.size());
        let own = comm.agree(pool.install(|| sequence::check_files(target, own)))?;
        found = Some(comm.gather(&own)?.concat());
    }
    comm.from_root(|| pool.install(|| sequence::prepare_with(target, frames, found)))
}

/// The run of `frames` whose files `rank` checks. The runs of all ranks are in frame order.
fn own_share(frames: FrameRange, rank: u32, ranks: u32) -> Range<u32> {
    let count = u64::from(frames.last - frames.first + 1);
    let edge = |rank: u32| frames.first + (count * u64::from(rank) / u64::from(ranks)) as u32;
    edge(rank)..edge(rank + 1)
}

/// What the ranks of a job need to render its frames.
pub struct RankJob<'a> {
    /// All ranks.
    pub comm: &'a Communicator,
    /// The ranks, node by node.
    pub rank_order: &'a [u32],
    /// Where the frames go.
    pub target: &'a Target,
    /// Which frames are rendered.
    pub plan: &'a Plan,
    /// Makes the frames.
    pub maker: &'a dyn RankMaker,
    /// Set when the job is to stop; the maker watches it.
    pub stop: &'a AtomicBool,
    /// How many threads of this rank encode files, beside those that trace.
    pub threads: usize,
    /// Called on rank 0 for every finished frame of the job.
    pub done: &'a (dyn Fn(&FrameReport) + Sync),
}

/// Renders the frames to render on all ranks. The scheduler on rank 0 assigns frames; each rank
/// writes its frames, while it traces the next, and a journal of them; rank 0 merges the journals into
/// the manifest. If `stop` is set on any rank, all ranks stop after the blocks in flight. All ranks call it.
///
/// # Errors
/// The error of this rank. Other ranks may still be rendering, and [`Communicator::abort`] ends them.
pub fn render(job: &RankJob) -> Result<Outcome> {
    let RankJob { comm, target, plan, maker, .. } = *job;
    let (reports, own) = match comm.size() {
        1 => render_single(job)?,
        _ => render_on_ranks(job)?,
    };
    merge(comm, target, plan, (reports, maker.notes()), own)
}

fn render_single(job: &RankJob) -> Result<(Vec<FrameReport>, RankWork)> {
    let RankJob { target, plan, maker, stop, threads, done, .. } = *job;
    let start = Instant::now();
    let frames = maker.batches(&plan.render).concat();
    maker.expect(&frames);
    let mut finished = Vec::new();
    let mut after_frame = |report: FrameReport| {
        done(&report);
        finished.push(report);
        Ok(())
    };
    let journal = manifest_path(&target.pattern);
    let context = WriterContext { target, rank: 0, journal: &journal, threads };
    sequence::render_frames(context, &frames, maker, stop, &mut after_frame)?;
    let busy_seconds = start.elapsed().as_secs_f64();
    Ok((finished, RankWork { busy_seconds, ..RankWork::default() }))
}

fn render_on_ranks(job: &RankJob) -> Result<(Vec<FrameReport>, RankWork)> {
    let RankJob { comm, rank_order, target, plan, maker, stop, threads, done } = *job;
    let manifest = manifest_path(&target.pattern);
    let rank = comm.rank();
    let journal = match rank {
        0 => manifest,
        rank => part_path(&manifest, &target.header, rank),
    };
    let start = Instant::now();
    let before = comm.sent();
    let scheduler = comm.is_root().then(|| Scheduler::new(maker, &plan.render, rank_order));
    let writer = FrameWriter::new(WriterContext { target, rank, journal: &journal, threads })?;
    let (to_writer, made) = frame_channel();
    let (tasks, inputs) = mpsc::channel();
    let (to_comm, events) = mpsc::channel();
    let from_writer = to_comm.clone();
    let mut thread = CommThread::new(comm, maker, stop, done, scheduler, tasks);
    let (reports, busy_seconds, seconds) = std::thread::scope(|scope| {
        scope.spawn(move || render_thread::run(maker, &inputs, to_writer, &to_comm));
        // The channel of events is closed only when the job ends.
        scope.spawn(move || {
            let mut wrote = |report| {
                _ = from_writer.send(Event::Wrote(Box::new(report)));
                Ok(())
            };
            if let Err(error) = writer.write_all(made, &mut wrote) {
                _ = from_writer.send(Event::Failed(error));
            }
        });
        let ran = thread.run(&events);
        let seconds = start.elapsed().as_secs_f64();
        if ran.is_ok() && stop.load(Ordering::Relaxed) {
            maker.stopped();
        }
        let ran = ran.and_then(|()| comm.flush_and_barrier(&mut || thread.poll()));
        if ran.is_err() {
            // The job ends, so the render thread stops tracing.
            stop.store(true, Ordering::Relaxed);
        }
        // Dropping the rest closes the channel of tasks, which ends the render thread, and with it the writer.
        let CommThread { finished, busy_seconds, .. } = thread;
        ran.map(|()| (finished, busy_seconds, seconds))
    })?;
    let waiting_seconds = (seconds - busy_seconds).max(0.0);
    Ok((reports, RankWork { busy_seconds, waiting_seconds, sent: comm.sent().since(&before) }))
}

/// Merges the journals and reports of all ranks, on rank 0.
fn merge(
    comm: &Communicator,
    target: &Target,
    plan: &Plan,
    reports_and_notes: (Vec<FrameReport>, Vec<String>),
    own: RankWork,
) -> Result<Outcome> {
    let by_rank = comm.gather(&reports_and_notes)?;
    if !comm.is_root() {
        return Ok(Outcome { own, ..Outcome::default() });
    }
    if comm.size() > 1 {
        Manifest::merge_parts(&manifest_path(&target.pattern), &target.header)?;
    }
    let (frames, notes) = merge_reports(by_rank);
    Ok(Outcome { unfinished: plan.render.len() - frames.len(), frames, notes, own })
}

/// Reports of all ranks in frame order, each with its rank, and notes without duplicates.
fn merge_reports(
    by_rank: Vec<(Vec<FrameReport>, Vec<String>)>,
) -> (Vec<(u32, FrameReport)>, Vec<String>) {
    let (mut frames, mut notes) = (Vec::new(), Vec::new());
    for (rank, (reports, rank_notes)) in (0..).zip(by_rank) {
        frames.extend(reports.into_iter().map(|report| (rank, report)));
        for note in rank_notes {
            if !notes.contains(&note) {
                notes.push(note);
            }
        }
    }
    frames.sort_by_key(|(_, report): &(u32, FrameReport)| report.frame);
    (frames, notes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_frame_is_checked_by_one_rank() {
        for (first, last, ranks) in [(1, 20, 3), (5, 5, 4), (1, 1_000_000, 4096), (7, 9, 64)] {
            let frames = FrameRange { first, last };
            let shares: Vec<u32> = (0..ranks).flat_map(|r| own_share(frames, r, ranks)).collect();
            assert!(shares.into_iter().eq(first..=last), "{first} {last} {ranks}");
        }
    }

    #[test]
    fn a_note_of_several_ranks_is_kept_once() {
        let of_rank =
            |notes: &[&str]| (Vec::new(), notes.iter().map(|n| (*n).to_string()).collect());
        let (_, notes) =
            merge_reports(vec![of_rank(&["a", "b"]), of_rank(&[]), of_rank(&["b", "c"])]);
        assert_eq!(notes, ["a", "b", "c"]);
    }
}
