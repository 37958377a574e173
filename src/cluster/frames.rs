//! The frames of a sequence, divided among the ranks.

use super::World;
use crate::error::Result;
use crate::output::manifest::{Manifest, manifest_path, part_path};
use crate::sequence::{self, FrameMaker, FrameReport, Plan, Target};
use serde::{Deserialize, Serialize};
use std::cell::Cell;
use std::sync::atomic::{AtomicBool, Ordering};

/// What became of a plan, known on rank 0.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// Every finished frame, by number, with the rank that rendered it.
    pub frames: Vec<(u32, FrameReport)>,
    /// Frames that the job did not get to.
    pub unfinished: usize,
}

/// What ranks tell each other while they render.
#[derive(Serialize, Deserialize)]
enum Note {
    /// A frame is finished.
    Done(Box<FrameReport>),
    /// Somebody was asked to stop.
    Stop,
}

/// Renders `plan.render`: each rank a contiguous run of the maker's batches, its rows in its own
/// journal; rank 0 joins the journals. `done` hears on rank 0 of every finished frame of any rank. A rank on which
/// `stop` was set tells the others, which stop after the frame in flight. All ranks call it.
///
/// Errors are this rank's own; other ranks may still be at work, and [`World::abort`] ends them.
pub fn render(
    world: &World,
    target: &Target,
    plan: &Plan,
    maker: &dyn FrameMaker,
    stop: &AtomicBool,
    done: &dyn Fn(&FrameReport),
) -> Result<Outcome> {
    let manifest = manifest_path(&target.pattern);
    let journal = match world.rank() {
        0 => manifest.clone(),
        rank => part_path(&manifest, rank),
    };
    let mine = run_of(maker.batches(&plan.render), world.size(), world.rank());
    maker.expect(&mine);
    let mut finished = Vec::new();
    let told = Cell::new(false);
    let hear = || hear(world, stop, &told, done);
    let mut after_frame = |report: &FrameReport| {
        finished.push(report.clone());
        if world.is_root() {
            done(report);
        } else {
            world.post(0, &Note::Done(Box::new(report.clone())))?;
        }
        hear()
    };
    let place = (world.rank(), journal.as_path());
    sequence::render_frames(target, &mine, place, maker, &mut after_frame)?;
    if finished.len() < mine.len() && !told.get() {
        let mut others = (0..world.size()).filter(|rank| *rank != world.rank());
        others.try_for_each(|rank| world.post(rank, &Note::Stop))?;
    }
    world.settle(&mut || hear())?;
    join(world, target, plan, &finished)
}

/// Takes in what other ranks said.
fn hear(
    world: &World,
    stop: &AtomicBool,
    told: &Cell<bool>,
    done: &dyn Fn(&FrameReport),
) -> Result<()> {
    for note in world.notes()? {
        match note {
            Note::Done(report) => done(&report),
            Note::Stop => {
                told.set(true);
                stop.store(true, Ordering::Relaxed);
            }
        }
    }
    Ok(())
}

/// Joins journals and reports on rank 0.
fn join(world: &World, target: &Target, plan: &Plan, mine: &[FrameReport]) -> Result<Outcome> {
    let by_rank = world.gather(&mine.to_vec())?;
    if !world.is_root() {
        return Ok(Outcome::default());
    }
    if world.size() > 1 {
        Manifest::merge_parts(&manifest_path(&target.pattern))?;
    }
    let ranks = by_rank.into_iter().enumerate();
    let mut frames: Vec<(u32, FrameReport)> =
        ranks.flat_map(|(rank, list)| list.into_iter().map(move |r| (rank as u32, r))).collect();
    frames.sort_by_key(|(_, report)| report.frame);
    Ok(Outcome { unfinished: plan.render.len() - frames.len(), frames })
}

/// The frames that rank `rank` of `size` renders: a contiguous run of whole `batches`, cut where the
/// frames are divided most evenly.
fn run_of(batches: Vec<Vec<u32>>, size: u32, rank: u32) -> Vec<u32> {
    let count: u64 = batches.iter().map(|batch| batch.len() as u64).sum();
    let mut before = 0;
    let mine = batches.into_iter().filter(|batch| {
        // A batch belongs to the rank in whose even share its middle lies.
        let middle = 2 * before + batch.len() as u64 - 1;
        before += batch.len() as u64;
        middle * u64::from(size) / (2 * count) == u64::from(rank)
    });
    mine.flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::run_of;

    fn runs(sizes: &[u32], ranks: u32) -> Vec<Vec<u32>> {
        let mut next = 1..;
        let batch = |size: &u32| next.by_ref().take(*size as usize).collect::<Vec<u32>>();
        let batches: Vec<Vec<u32>> = sizes.iter().map(batch).collect();
        (0..ranks).map(|rank| run_of(batches.clone(), ranks, rank)).collect()
    }

    #[test]
    fn runs_cover_every_frame_once_and_lone_frames_differ_by_one_at_most() {
        for (count, ranks) in [(16, 1), (16, 3), (2, 8), (0, 4), (262_144, 64)] {
            let runs = runs(&vec![1; count], ranks);
            assert_eq!(runs.concat(), (1..=count as u32).collect::<Vec<_>>());
            let lengths = || runs.iter().map(Vec::len);
            assert!(lengths().max() <= lengths().min().map(|least| least + 1), "{count} {ranks}");
        }
    }

    #[test]
    fn batches_stay_whole() {
        assert_eq!(runs(&[3, 3, 2], 2), [vec![1, 2, 3], vec![4, 5, 6, 7, 8]]);
        assert_eq!(runs(&[64, 64, 64, 64, 1], 2).iter().map(Vec::len).max(), Some(129));
        assert_eq!(runs(&[9], 3).iter().map(Vec::len).sum::<usize>(), 9);
        let most = runs(&[10, 1, 10, 1, 10, 1], 3).iter().map(Vec::len).max();
        assert_eq!(most, Some(11));
    }
}
