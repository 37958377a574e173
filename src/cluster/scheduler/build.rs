//! The scheduler at the start of a job: the dependency graph, and the initial queue of each rank.

use super::{RankRecord, Scheduler, State, TaskRecord};
use crate::sequence::FrameGraph;
use std::collections::{BTreeMap, BTreeSet};

impl Scheduler {
    /// The schedule of `frames` and of all frames that they are inferred from, by `graph`; each rank's queue starts with a contiguous run of whole batches.
    /// `rank_order` lists the ranks so that neighbours share a node.
    ///
    /// # Panics
    /// `rank_order` is no permutation of 0 to n − 1, or `graph` names needs that are in none of its batches.
    pub fn new(graph: &(impl FrameGraph + ?Sized), frames: &[u32], rank_order: &[u32]) -> Self {
        let mut outputs: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for frame in frames {
            outputs.entry(graph.representative(*frame)).or_default().push(*frame);
        }
        let mut users: Vec<u32> = outputs.keys().copied().collect();
        let mut read = BTreeSet::new();
        while let Some(user) = users.pop() {
            if outputs[&user].is_empty() && graph.is_on_disk(user) {
                read.insert(user);
                continue;
            }
            for need in graph.needs(user) {
                outputs.entry(need).or_insert_with(|| {
                    users.push(need);
                    Vec::new()
                });
            }
        }
        let representatives: Vec<u32> = outputs.keys().copied().collect();
        let batches = graph.rank_batches(&representatives);
        let owners = owners(&batches, rank_order);
        let mut scheduler = Self {
            tasks: Vec::new(),
            batches: Vec::new(),
            ranks: rank_order.iter().map(|_| RankRecord::default()).collect(),
            ready: BTreeSet::new(),
            split: BTreeSet::new(),
            to_merge: Vec::new(),
            idle: rank_order.iter().copied().collect(),
            next_thief: 0,
            changed: BTreeSet::new(),
            remaining: representatives.len(),
            most_strips: graph.most_strips(),
            empty_queues: rank_order.len(),
            sends_to_all: graph.sends_to_all(),
            is_stopped: false,
        };
        for (batch, (list, owner)) in batches.into_iter().zip(owners).enumerate() {
            let first = scheduler.tasks.len();
            for representative in list {
                let frames = outputs.remove(&representative).unwrap_or_default();
                scheduler.add(
                    representative,
                    representative_first(frames, representative),
                    batch,
                    owner,
                );
            }
            scheduler.batches.push(first..scheduler.tasks.len());
        }
        let needs = |representative| {
            if read.contains(&representative) { Vec::new() } else { graph.needs(representative) }
        };
        scheduler.connect(needs);
        scheduler
            .tasks
            .iter_mut()
            .for_each(|task| task.is_read = read.contains(&task.representative));
        scheduler
    }

    fn add(&mut self, representative: u32, frames: Vec<u32>, batch: usize, owner: u32) {
        self.enqueue(owner, self.tasks.len());
        self.tasks.push(TaskRecord {
            representative,
            frames,
            batch,
            owner,
            is_read: false,
            needs: Vec::new(),
            users: Vec::new(),
            unmet_needs: 0,
            unmade_users: 0,
            state: State::Waiting,
            holders: BTreeSet::new(),
            senders: BTreeMap::new(),
        });
    }

    /// Adds the edges of the dependency graph: `needs` names the representatives that a representative takes.
    fn connect(&mut self, needs: impl Fn(u32) -> Vec<u32>) {
        let indices = self.tasks.iter().enumerate().map(|(t, task)| (task.representative, t));
        let indices: BTreeMap<u32, usize> = indices.collect();
        for t in 0..self.tasks.len() {
            let list: Vec<usize> =
                needs(self.tasks[t].representative).iter().map(|need| indices[need]).collect();
            for need in &list {
                self.tasks[*need].users.push(t);
                self.tasks[*need].unmade_users += 1;
            }
            self.tasks[t].unmet_needs = list.len();
            self.tasks[t].needs = list;
            if self.tasks[t].unmet_needs == 0 {
                self.ready.insert(t);
            }
        }
    }
}

/// `frames` in ascending order, except that `representative`, if it is among them, comes first.
fn representative_first(mut frames: Vec<u32>, representative: u32) -> Vec<u32> {
    frames.sort_by_key(|frame| (*frame != representative, *frame));
    frames
}

/// The initial owner of each batch: contiguous runs with as even a number of frames as batches allow.
pub(super) fn owners(batches: &[Vec<u32>], rank_order: &[u32]) -> Vec<u32> {
    let count: u64 = batches.iter().map(|batch| batch.len() as u64).sum();
    let mut before = 0;
    let owner = |batch: &Vec<u32>| {
        // A batch belongs to the rank whose even share contains the middle of the batch.
        let middle = 2 * before + batch.len() as u64 - 1;
        before += batch.len() as u64;
        rank_order[(middle * rank_order.len() as u64 / (2 * count)) as usize]
    };
    batches.iter().map(owner).collect()
}
