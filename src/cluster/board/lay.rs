//! The table as it is at first.

use super::{Board, Member, State, Task};
use crate::sequence::Shared;
use std::collections::{BTreeMap, BTreeSet};

impl Board {
    /// The table for `frames`, dealt to ranks in contiguous runs of whole batches. `order` lists the
    /// ranks so that neighbours share a node.
    pub fn new(maker: &(impl Shared + ?Sized), frames: &[u32], order: &[u32]) -> Self {
        let mut outputs: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for frame in frames {
            outputs.entry(maker.original(*frame)).or_default().push(*frame);
        }
        let mut users: Vec<u32> = outputs.keys().copied().collect();
        let mut read = BTreeSet::new();
        while let Some(user) = users.pop() {
            if outputs[&user].is_empty() && maker.lies_on_disk(user) {
                read.insert(user);
                continue;
            }
            for need in maker.needs(user) {
                outputs.entry(need).or_insert_with(|| {
                    users.push(need);
                    Vec::new()
                });
            }
        }
        let originals: Vec<u32> = outputs.keys().copied().collect();
        let batches = maker.shares(&originals);
        let owners = owners(&batches, order);
        let mut board = Self {
            tasks: Vec::new(),
            batches: Vec::new(),
            members: order.iter().map(|_| Member::default()).collect(),
            ready: BTreeSet::new(),
            cut: BTreeSet::new(),
            to_join: Vec::new(),
            idle: order.iter().copied().collect(),
            turn: 0,
            touched: BTreeSet::new(),
            left: originals.len(),
            most_strips: maker.most_strips(),
            without_own: order.len(),
            tells_all: maker.tells_all(),
            is_stopped: false,
        };
        for (batch, (list, owner)) in batches.into_iter().zip(owners).enumerate() {
            let first = board.tasks.len();
            for original in list {
                let frames = outputs.remove(&original).unwrap_or_default();
                board.add(original, first_itself(frames, original), batch, owner);
            }
            board.batches.push(first..board.tasks.len());
        }
        let needs = |original| {
            if read.contains(&original) { Vec::new() } else { maker.needs(original) }
        };
        board.connect(needs);
        board.tasks.iter_mut().for_each(|task| task.is_read = read.contains(&task.original));
        board
    }

    fn add(&mut self, original: u32, frames: Vec<u32>, batch: usize, owner: u32) {
        self.give_to(owner, self.tasks.len());
        self.tasks.push(Task {
            original,
            frames,
            batch,
            owner,
            is_read: false,
            needs: Vec::new(),
            users: Vec::new(),
            unmet: 0,
            unused: 0,
            state: State::Waiting,
            at: BTreeSet::new(),
            holders: BTreeMap::new(),
        });
    }

    fn connect(&mut self, needs: impl Fn(u32) -> Vec<u32>) {
        let numbers = self.tasks.iter().enumerate().map(|(t, task)| (task.original, t));
        let numbers: BTreeMap<u32, usize> = numbers.collect();
        for t in 0..self.tasks.len() {
            let list: Vec<usize> =
                needs(self.tasks[t].original).iter().map(|need| numbers[need]).collect();
            for need in &list {
                self.tasks[*need].users.push(t);
                self.tasks[*need].unused += 1;
            }
            self.tasks[t].unmet = list.len();
            self.tasks[t].needs = list;
            if self.tasks[t].unmet == 0 {
                self.ready.insert(t);
            }
        }
    }
}

/// `frames` with `original` in front, if it is one of them.
fn first_itself(mut frames: Vec<u32>, original: u32) -> Vec<u32> {
    frames.sort_by_key(|frame| (*frame != original, *frame));
    frames
}

/// For each batch the rank that it belongs to at first: contiguous runs, cut where the frames are
/// divided most evenly.
pub(super) fn owners(batches: &[Vec<u32>], order: &[u32]) -> Vec<u32> {
    let count: u64 = batches.iter().map(|batch| batch.len() as u64).sum();
    let mut before = 0;
    let owner = |batch: &Vec<u32>| {
        // A batch belongs to the rank in whose even share its middle lies.
        let middle = 2 * before + batch.len() as u64 - 1;
        before += batch.len() as u64;
        order[(middle * order.len() as u64 / (2 * count)) as usize]
    };
    batches.iter().map(owner).collect()
}
