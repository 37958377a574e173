//! The table, played through without any ranks.

use super::lay::owners;
use super::*;
use crate::error::Result;
use crate::sequence::{FrameMaker, Made, Pyramid, Shared};
use std::collections::BTreeSet;

/// Frames of a pyramid, or each on its own; makes nothing.
struct Frames {
    pyramid: Pyramid,
    is_lone: bool,
    strips: u32,
    on_disk: Vec<u32>,
}

impl FrameMaker for Frames {
    fn make(&self, _frame: u32) -> Result<Option<Made>> {
        Ok(None)
    }

    fn batches(&self, frames: &[u32]) -> Vec<Vec<u32>> {
        match self.is_lone {
            true => frames.iter().map(|frame| vec![*frame]).collect(),
            false => self.pyramid.batches(frames),
        }
    }
}

impl Shared for Frames {
    fn needs(&self, original: u32) -> Vec<u32> {
        if self.is_lone { Vec::new() } else { self.pyramid.ancestors(original) }
    }

    fn shares(&self, originals: &[u32]) -> Vec<Vec<u32>> {
        if self.is_lone { self.batches(originals) } else { self.pyramid.shares(originals) }
    }

    fn lies_on_disk(&self, original: u32) -> bool {
        self.on_disk.contains(&original)
    }

    fn most_strips(&self) -> u32 {
        self.strips
    }
}

/// What a played job came to.
#[derive(Default)]
struct Played {
    made: Vec<u32>,
    seconds: f64,
    busy: f64,
    sends: usize,
    strips: usize,
}

/// Plays a job on ranks that need `pace` seconds a key frame, and a quarter for another. Checks on the way
/// that everything is made of what is there.
fn play(frames: &Frames, wanted: &[u32], pace: &[f64]) -> Played {
    let order: Vec<u32> = (0..pace.len() as u32).collect();
    let mut board = Board::new(frames, wanted, &order);
    let mut played = Played::default();
    let mut queues: Vec<Vec<Errand>> = vec![Vec::new(); pace.len()];
    let mut until: Vec<Option<f64>> = vec![None; pace.len()];
    let mut has: Vec<BTreeSet<u32>> = vec![BTreeSet::new(); pace.len()];
    loop {
        for step in board.give() {
            match step {
                Step::Send { from, to, original } => {
                    assert!(has[from as usize].contains(&original), "{from} lacks {original}");
                    assert!(has[to as usize].insert(original), "{to} has {original}");
                    played.sends += 1;
                }
                Step::Do(rank, errand) => {
                    for original in &errand.drops {
                        assert!(has[rank as usize].remove(original));
                    }
                    queues[rank as usize].push(errand);
                }
            }
        }
        for (rank, queue) in queues.iter().enumerate() {
            if let (Some(next), None) = (queue.first(), until[rank]) {
                let lacks = next.order.original;
                assert!(next.needs.iter().all(|n| has[rank].contains(n)), "{rank} for {lacks}");
                let cost = if frames.needs(lacks).is_empty() { 1.0 } else { 0.25 };
                let part = match next.order.what {
                    What::Strip { of, .. } => 1.0 / f64::from(of),
                    What::Whole { strips: 0, .. } => 1.0,
                    What::Whole { .. } => 0.0,
                };
                until[rank] = Some(played.seconds + cost * part * pace[rank]);
                played.busy += cost * part * pace[rank];
            }
        }
        let ends = until.iter().enumerate().filter_map(|(r, t)| Some((r, (*t)?)));
        let Some((rank, end)) = ends.min_by(|a, b| a.1.total_cmp(&b.1)) else { break };
        let took = end - played.seconds;
        (played.seconds, until[rank]) = (end, None);
        let Errand { order, .. } = queues[rank].remove(0);
        match &order.what {
            What::Strip { .. } => played.strips += 1,
            What::Whole { frames, .. } => {
                played.made.extend(frames);
                if order.is_source {
                    has[rank].insert(order.original);
                }
            }
        }
        board.done(rank as u32, &order, took);
    }
    assert!(board.is_done());
    played.made.sort_unstable();
    played
}

fn segments(segment: u32, frames: u32) -> Frames {
    Frames { pyramid: Pyramid { segment, frames }, is_lone: false, strips: 16, on_disk: Vec::new() }
}

#[test]
fn every_frame_is_made_once_on_any_number_of_ranks() {
    for (segment, count) in [(8, 9), (8, 50), (64, 64), (1, 5), (16, 200)] {
        for ranks in [1, 2, 3, 5, 8, 16, 40] {
            for is_lone in [false, true] {
                let frames = Frames { is_lone, ..segments(segment, count) };
                let all: Vec<u32> = (1..=count).collect();
                let pace: Vec<f64> = (0..ranks).map(|r| 1.0 + f64::from(r % 3)).collect();
                assert_eq!(play(&frames, &all, &pace).made, all, "{segment} {count} {ranks}");
            }
        }
    }
    // Some frames are there already: what they are made of is made, and not written.
    let played = play(&segments(8, 50), &[3, 4, 20, 49], &[1.0; 3]);
    assert_eq!(played.made, [3, 4, 20, 49]);
    assert_eq!(play(&segments(8, 50), &[], &[1.0; 3]).made, [0; 0]);
}

#[test]
fn a_slow_rank_does_not_hold_the_job() {
    let (frames, all) = (segments(16, 1025), (1..=1025).collect::<Vec<_>>());
    let mut pace = [1.0; 8];
    pace[5] = 4.0;
    let played = play(&frames, &all, &pace);
    // 65 key frames and 960 others: seven ranks and a quarter of one.
    let ideal = (65.0 + 960.0 * 0.25) / 7.25;
    assert!(played.seconds < 1.05 * ideal, "{} s, {ideal} s at best", played.seconds);
}

#[test]
fn ranks_without_a_segment_help_with_those_of_others() {
    let all: Vec<u32> = (1..=65).collect();
    for (ranks, least) in [(2, 0.95), (4, 0.9), (8, 0.75)] {
        let played = play(&segments(64, 65), &all, &vec![1.0; ranks]);
        let balance = played.busy / ranks as f64 / played.seconds;
        assert!(balance > least, "{ranks} ranks: {balance}");
        assert!(ranks == 2 || played.strips > 0);
    }
    // More ranks than frames: these are cut.
    let lone = Frames { is_lone: true, ..segments(1, 3) };
    assert!(play(&lone, &[1, 2, 3], &[1.0; 8]).seconds < 0.5);
    let whole = Frames { strips: 1, ..lone };
    assert!((play(&whole, &[1, 2, 3], &[1.0; 8]).seconds - 1.0).abs() < 1e-9);
}

#[test]
fn what_lies_on_disk_is_neither_cut_nor_made_of_anything() {
    let made_anew = play(&segments(64, 65), &[2], &[1.0; 4]);
    assert!(made_anew.strips > 0);
    let on_disk = vec![1, 65, 33, 17, 9, 5, 3];
    let frames = Frames { on_disk, ..segments(64, 65) };
    let played = play(&frames, &[2], &[1.0; 4]);
    assert_eq!((played.made, played.strips), (vec![2], 0));
    // All but those that the rank read itself.
    assert!(played.sends < 7, "{}", played.sends);
    // What is rendered anyway is not read.
    let again = play(&frames, &[1, 2], &[1.0; 4]);
    assert_eq!(again.made, [1, 2]);
}

#[test]
fn references_are_sent_where_runs_meet_and_hardly_elsewhere() {
    for ranks in [2, 4, 16, 64] {
        let frames = segments(16, 16 * 4 * ranks as u32 + 1);
        let all: Vec<u32> = (1..=frames.pyramid.frames).collect();
        let played = play(&frames, &all, &vec![1.0; ranks]);
        // One for each meeting of two runs, the others where the last of the work changed hands.
        assert!(played.sends >= ranks - 1, "{ranks} ranks: {}", played.sends);
        assert!(played.sends <= 3 * ranks, "{ranks} ranks: {}", played.sends);
    }
}

#[test]
fn neighbours_on_the_path_are_neighbours_in_the_order() {
    let batches: Vec<Vec<u32>> = (1..=8).map(|frame| vec![frame]).collect();
    assert_eq!(owners(&batches, &[0, 2, 1, 3]), [0, 0, 2, 2, 1, 1, 3, 3]);
    assert_eq!(owners(&[vec![1, 2, 3], vec![4, 5, 6], vec![7, 8]], &[0, 1]), [0, 1, 1]);
}
