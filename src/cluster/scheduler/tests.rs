//! Whole jobs run through the scheduler, without processes.

use super::build::owners;
use super::*;
use crate::sequence::{FrameGraph, Pyramid};
use std::collections::BTreeSet;

/// Frames of a pyramid, or independent frames.
struct Frames {
    pyramid: Pyramid,
    is_independent: bool,
    strips: u32,
    on_disk: Vec<u32>,
}

impl FrameGraph for Frames {
    fn batches(&self, frames: &[u32]) -> Vec<Vec<u32>> {
        match self.is_independent {
            true => frames.iter().map(|frame| vec![*frame]).collect(),
            false => self.pyramid.batches(frames),
        }
    }

    fn needs(&self, representative: u32) -> Vec<u32> {
        if self.is_independent { Vec::new() } else { self.pyramid.ancestors(representative) }
    }

    fn rank_batches(&self, representatives: &[u32]) -> Vec<Vec<u32>> {
        if self.is_independent {
            self.batches(representatives)
        } else {
            self.pyramid.rank_batches(representatives)
        }
    }

    fn is_on_disk(&self, representative: u32) -> bool {
        self.on_disk.contains(&representative)
    }

    fn most_strips(&self) -> u32 {
        self.strips
    }
}

/// The result of a simulated job.
#[derive(Default)]
struct Simulated {
    made: Vec<u32>,
    seconds: f64,
    busy: f64,
    sends: usize,
    strips: usize,
}

/// Simulates a job. Rank `r` takes `pace[r]` seconds for a key frame and a quarter for another. Asserts
/// that a rank holds all references that its tasks take.
fn simulate(frames: &Frames, wanted: &[u32], pace: &[f64]) -> Simulated {
    let rank_order: Vec<u32> = (0..pace.len() as u32).collect();
    let mut scheduler = Scheduler::new(frames, wanted, &rank_order);
    let mut run = Simulated::default();
    let mut queues: Vec<Vec<Assignment>> = vec![Vec::new(); pace.len()];
    let mut until: Vec<Option<f64>> = vec![None; pace.len()];
    let mut has: Vec<BTreeSet<u32>> = vec![BTreeSet::new(); pace.len()];
    loop {
        for decision in scheduler.assign() {
            match decision {
                Decision::Send { from, to, representative } => {
                    assert!(
                        has[from as usize].contains(&representative),
                        "{from} lacks {representative}"
                    );
                    assert!(has[to as usize].insert(representative), "{to} has {representative}");
                    run.sends += 1;
                }
                Decision::Assign(rank, assignment) => {
                    for representative in &assignment.drops {
                        assert!(has[rank as usize].remove(representative));
                    }
                    queues[rank as usize].push(assignment);
                }
            }
        }
        for (rank, queue) in queues.iter().enumerate() {
            if let (Some(next), None) = (queue.first(), until[rank]) {
                let representative = next.task.representative;
                assert!(
                    next.needs.iter().all(|n| has[rank].contains(n)),
                    "{rank} for {representative}"
                );
                let cost = if frames.needs(representative).is_empty() { 1.0 } else { 0.25 };
                let share = match next.task.extent {
                    Extent::Strip { of, .. } => 1.0 / f64::from(of),
                    Extent::Whole { strips: 0, .. } => 1.0,
                    Extent::Whole { .. } => 0.0,
                };
                until[rank] = Some(run.seconds + cost * share * pace[rank]);
                run.busy += cost * share * pace[rank];
            }
        }
        let ends = until.iter().enumerate().filter_map(|(r, t)| Some((r, (*t)?)));
        let Some((rank, end)) = ends.min_by(|a, b| a.1.total_cmp(&b.1)) else { break };
        let took = end - run.seconds;
        (run.seconds, until[rank]) = (end, None);
        let Assignment { task, .. } = queues[rank].remove(0);
        match &task.extent {
            Extent::Strip { .. } => run.strips += 1,
            Extent::Whole { frames, .. } => {
                run.made.extend(frames);
                if task.is_source {
                    has[rank].insert(task.representative);
                }
            }
        }
        scheduler.complete(rank as u32, &task, took);
    }
    assert!(scheduler.is_done());
    run.made.sort_unstable();
    run
}

fn segments(segment: u32, frames: u32) -> Frames {
    Frames {
        pyramid: Pyramid { segment, frames },
        is_independent: false,
        strips: 16,
        on_disk: Vec::new(),
    }
}

#[test]
fn every_frame_is_made_once_on_any_number_of_ranks() {
    for (segment, count) in [(8, 9), (8, 50), (64, 64), (1, 5), (16, 200)] {
        for ranks in [1, 2, 3, 5, 8, 16, 40] {
            for is_independent in [false, true] {
                let frames = Frames { is_independent, ..segments(segment, count) };
                let all: Vec<u32> = (1..=count).collect();
                let pace: Vec<f64> = (0..ranks).map(|r| 1.0 + f64::from(r % 3)).collect();
                assert_eq!(simulate(&frames, &all, &pace).made, all, "{segment} {count} {ranks}");
            }
        }
    }
    // Only some frames are wanted: the frames that they need are made, but not written.
    let run = simulate(&segments(8, 50), &[3, 4, 20, 49], &[1.0; 3]);
    assert_eq!(run.made, [3, 4, 20, 49]);
    assert_eq!(simulate(&segments(8, 50), &[], &[1.0; 3]).made, [0; 0]);
}

#[test]
fn a_slow_rank_does_not_delay_the_job() {
    let (frames, all) = (segments(16, 1025), (1..=1025).collect::<Vec<_>>());
    let mut pace = [1.0; 8];
    pace[5] = 4.0;
    let run = simulate(&frames, &all, &pace);
    // 65 key frames and 960 others, on seven full ranks and one at a quarter of the speed.
    let ideal = (65.0 + 960.0 * 0.25) / 7.25;
    assert!(run.seconds < 1.05 * ideal, "{} s, {ideal} s at best", run.seconds);
}

#[test]
fn ranks_without_a_segment_help_with_other_ranks_segments() {
    let all: Vec<u32> = (1..=65).collect();
    for (ranks, least) in [(2, 0.95), (4, 0.9), (8, 0.75)] {
        let run = simulate(&segments(64, 65), &all, &vec![1.0; ranks]);
        let balance = run.busy / ranks as f64 / run.seconds;
        assert!(balance > least, "{ranks} ranks: {balance}");
        assert!(ranks == 2 || run.strips > 0);
    }
    // More ranks than frames: frames are cut into strips.
    let few = Frames { is_independent: true, ..segments(1, 3) };
    assert!(simulate(&few, &[1, 2, 3], &[1.0; 8]).seconds < 0.5);
    let whole = Frames { strips: 1, ..few };
    assert!((simulate(&whole, &[1, 2, 3], &[1.0; 8]).seconds - 1.0).abs() < 1e-9);
}

#[test]
fn a_reference_on_disk_is_neither_split_nor_made_again() {
    let made_anew = simulate(&segments(64, 65), &[2], &[1.0; 4]);
    assert!(made_anew.strips > 0);
    let on_disk = vec![1, 65, 33, 17, 9, 5, 3];
    let frames = Frames { on_disk, ..segments(64, 65) };
    let run = simulate(&frames, &[2], &[1.0; 4]);
    assert_eq!((run.made, run.strips), (vec![2], 0));
    // The rank reads some of the seven references itself.
    assert!(run.sends < 7, "{}", run.sends);
    // A wanted frame is rendered, although its reference is on disk.
    let again = simulate(&frames, &[1, 2], &[1.0; 4]);
    assert_eq!(again.made, [1, 2]);
}

#[test]
fn references_are_sent_between_neighbouring_runs_and_hardly_elsewhere() {
    for ranks in [2, 4, 16, 64] {
        let frames = segments(16, 16 * 4 * ranks as u32 + 1);
        let all: Vec<u32> = (1..=frames.pyramid.frames).collect();
        let run = simulate(&frames, &all, &vec![1.0; ranks]);
        // One send for each pair of neighbouring runs; the others follow work stolen near the end.
        assert!(run.sends >= ranks - 1, "{ranks} ranks: {}", run.sends);
        assert!(run.sends <= 3 * ranks, "{ranks} ranks: {}", run.sends);
    }
}

#[test]
fn neighbouring_batches_go_to_neighbouring_ranks() {
    let batches: Vec<Vec<u32>> = (1..=8).map(|frame| vec![frame]).collect();
    assert_eq!(owners(&batches, &[0, 2, 1, 3]), [0, 0, 2, 2, 1, 1, 3, 3]);
    assert_eq!(owners(&[vec![1, 2, 3], vec![4, 5, 6], vec![7, 8]], &[0, 1]), [0, 1, 1]);
}
