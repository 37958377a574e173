//! The frames of a sequence, divided among the ranks.

use super::board::Board;
use super::clerk::Clerk;
use super::traffic::Traffic;
use super::{World, worker};
use crate::error::Result;
use crate::output::manifest::{Manifest, manifest_path, part_path};
use crate::output::{SequenceLock, atomic};
use crate::scene::FrameRange;
use crate::sequence::{self, FrameReport, Plan, Shared, Target};
use rayon::ThreadPool;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::time::Instant;

/// What became of a plan.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// Every finished frame, by number, with the rank that rendered it; known on rank 0.
    pub frames: Vec<(u32, FrameReport)>,
    /// Frames that the job did not get to; known on rank 0.
    pub unfinished: usize,
    /// What there is to tell about the frames; what several ranks have to tell, once. Known on rank 0.
    pub notes: Vec<String>,
    /// What this rank did.
    pub own: Duty,
}

/// What one rank did for a plan.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Duty {
    /// Seconds that it made or wrote frames, or parts of them.
    pub busy_seconds: f64,
    /// Seconds that it had nothing to do, or waited for what another rank had to send.
    pub waiting_seconds: f64,
    /// What it sent.
    pub sent: Traffic,
}

/// Takes the lock of the sequence at `target` on every rank: it is kept as long as any of them lives. All ranks
/// call it.
///
/// # Errors
/// Those of [`SequenceLock::take`]; its folder cannot be made.
pub fn lock(world: &World, target: &Target) -> Result<SequenceLock> {
    // A rank that still keeps the lock of an earlier round, of other settings, would be in the way.
    world.agree(Ok(()))?;
    let take = || SequenceLock::take(&target.pattern, &target.header);
    let mut roots = None;
    // Rank 0 decides which of two jobs was first; the others of its job then find a lock like theirs.
    world.from_root(|| {
        atomic::create_folder(target.pattern.folder())?;
        roots = Some(take()?);
        Ok(())
    })?;
    world.agree(roots.map_or_else(take, Ok))
}

/// What [`sequence::prepare`] decides, on every rank. The files that are there are read by all ranks, each
/// a part of them, on the threads of `pool`. All ranks call it.
///
/// # Errors
/// Those of `prepare`.
pub fn prepare(
    world: &World,
    pool: &ThreadPool,
    target: &Target,
    frames: FrameRange,
) -> Result<Plan> {
    if world.size() == 1 {
        return pool.install(|| sequence::prepare(target, frames));
    }
    let mut found = None;
    if world.from_root(|| sequence::is_worth_a_look(target))? {
        let own = own_part(frames, world.rank(), world.size());
        let own = world.agree(pool.install(|| sequence::look(target, own)))?;
        found = Some(world.gather(&own)?.concat());
    }
    world.from_root(|| pool.install(|| sequence::prepare_with(target, frames, found)))
}

/// Which of `frames` rank `rank` looks at: a run of them, so that all together come in order.
fn own_part(frames: FrameRange, rank: u32, ranks: u32) -> Range<u32> {
    let count = u64::from(frames.last - frames.first + 1);
    let edge = |rank: u32| frames.first + (count * u64::from(rank) / u64::from(ranks)) as u32;
    edge(rank)..edge(rank + 1)
}

/// Renders `plan.render`, on as many ranks as there are: rank 0 deals frames out, see `board.rs`; each
/// rank writes the frames that it made, and rows in its own journal; rank 0 joins the journals.
/// `order` lists the ranks, those of a node side by side. `done` hears on rank 0 of every finished
/// frame of any rank. A rank on which `stop` was set tells the others, which stop after the blocks in
/// flight. All ranks call it.
///
/// # Errors
/// This rank's own; other ranks may still be at work, and [`World::fail`] ends them.
pub fn render(
    world: &World,
    order: &[u32],
    target: &Target,
    plan: &Plan,
    maker: &dyn Shared,
    stop: &AtomicBool,
    done: &dyn Fn(&FrameReport),
) -> Result<Outcome> {
    let (mine, own) = match world.size() {
        1 => alone(target, plan, maker, done)?,
        _ => together(world, order, target, plan, maker, stop, done)?,
    };
    join(world, target, plan, (mine, maker.notes()), own)
}

fn alone(
    target: &Target,
    plan: &Plan,
    maker: &dyn Shared,
    done: &dyn Fn(&FrameReport),
) -> Result<(Vec<FrameReport>, Duty)> {
    let start = Instant::now();
    let frames = maker.batches(&plan.render).concat();
    maker.expect(&frames);
    let mut finished = Vec::new();
    let mut after_frame = |report: &FrameReport| {
        finished.push(report.clone());
        done(report);
        Ok(())
    };
    let journal = manifest_path(&target.pattern);
    sequence::render_frames(target, &frames, (0, &journal), maker, &mut after_frame)?;
    let busy_seconds = start.elapsed().as_secs_f64();
    Ok((finished, Duty { busy_seconds, ..Duty::default() }))
}

#[allow(clippy::too_many_arguments, reason = "those of `render`")]
fn together(
    world: &World,
    order: &[u32],
    target: &Target,
    plan: &Plan,
    maker: &dyn Shared,
    stop: &AtomicBool,
    done: &dyn Fn(&FrameReport),
) -> Result<(Vec<FrameReport>, Duty)> {
    let manifest = manifest_path(&target.pattern);
    let rank = world.rank();
    let journal = match rank {
        0 => manifest,
        rank => part_path(&manifest, &target.header, rank),
    };
    let start = Instant::now();
    let before = world.sent();
    let board = world.is_root().then(|| Board::new(maker, &plan.render, order));
    let (jobs, to_do) = mpsc::channel();
    let (tell, told) = mpsc::channel();
    let mut clerk = Clerk::new(world, maker, stop, done, board, jobs);
    let (mine, busy_seconds, seconds) = std::thread::scope(|scope| {
        scope.spawn(move || worker::work(maker, target, (rank, &journal), &to_do, &tell));
        let ran = clerk.run(&told);
        let seconds = start.elapsed().as_secs_f64();
        if ran.is_ok() && stop.load(Ordering::Relaxed) {
            maker.stopped();
        }
        let ran = ran.and_then(|()| world.settle(&mut || clerk.hear()));
        if ran.is_err() {
            // Whatever the other thread traces now is for nobody.
            stop.store(true, Ordering::Relaxed);
        }
        // With the clerk its end of the channel goes, and with that the other thread.
        let Clerk { finished, busy_seconds, .. } = clerk;
        ran.map(|()| (finished, busy_seconds, seconds))
    })?;
    let waiting_seconds = (seconds - busy_seconds).max(0.0);
    Ok((mine, Duty { busy_seconds, waiting_seconds, sent: world.sent().since(&before) }))
}

/// Joins journals and reports on rank 0.
fn join(
    world: &World,
    target: &Target,
    plan: &Plan,
    mine: (Vec<FrameReport>, Vec<String>),
    own: Duty,
) -> Result<Outcome> {
    let by_rank = world.gather(&mine)?;
    if !world.is_root() {
        return Ok(Outcome { own, ..Outcome::default() });
    }
    if world.size() > 1 {
        Manifest::merge_parts(&manifest_path(&target.pattern), &target.header)?;
    }
    let (frames, notes) = pooled(by_rank);
    Ok(Outcome { unfinished: plan.render.len() - frames.len(), frames, notes, own })
}

/// What ranks finished, in the order of the frames and with the rank, and what they have to tell.
fn pooled(by_rank: Vec<(Vec<FrameReport>, Vec<String>)>) -> (Vec<(u32, FrameReport)>, Vec<String>) {
    let (mut frames, mut notes) = (Vec::new(), Vec::new());
    for (rank, (list, told)) in (0..).zip(by_rank) {
        frames.extend(list.into_iter().map(|report| (rank, report)));
        for note in told {
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
    fn every_frame_is_looked_at_by_one_rank() {
        for (first, last, ranks) in [(1, 20, 3), (5, 5, 4), (1, 1_000_000, 4096), (7, 9, 64)] {
            let frames = FrameRange { first, last };
            let parts: Vec<u32> = (0..ranks).flat_map(|r| own_part(frames, r, ranks)).collect();
            assert!(parts.into_iter().eq(first..=last), "{first} {last} {ranks}");
        }
    }
    #[test]
    fn what_ranks_have_to_tell_is_told_once() {
        let told = |notes: &[&str]| (Vec::new(), notes.iter().map(|n| (*n).to_string()).collect());
        let (_, notes) = pooled(vec![told(&["a", "b"]), told(&[]), told(&["b", "c"])]);
        assert_eq!(notes, ["a", "b", "c"]);
    }
}
