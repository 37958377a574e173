//! Work stealing: a rank without ready tasks takes tasks from the queue of the busiest rank.

use super::{RankRecord, Scheduler, State};
use std::collections::BTreeSet;

/// Most tasks of a queue that a search looks at.
pub(super) const SEARCH_DEPTH: usize = 128;
/// Most ranks to steal from in one pass.
const MAX_VICTIMS: usize = 32;

impl Scheduler {
    /// A ready task for `rank`, stolen from the first of `victims` that has one. The queue of `rank`
    /// also gets the second half of the victim's untouched batches, or else the task's dependents.
    pub(super) fn steal_for(&mut self, rank: u32, victims: &[u32]) -> Option<usize> {
        victims.iter().filter(|victim| **victim != rank).find_map(|victim| {
            self.steal_batches(*victim, rank).or_else(|| self.steal_dependents(*victim, rank))
        })
    }

    /// The ranks with most seconds of work in their queues, the busiest first.
    pub(super) fn busiest(&self) -> Vec<u32> {
        let mean = self.mean_seconds();
        let ranks = (0..).zip(&self.ranks).filter(|(_, r)| !r.queue.is_empty());
        let mut left: Vec<(f64, u32)> =
            ranks.map(|(n, rank)| (rank.seconds_left(mean), n)).collect();
        let by_left = |a: &(f64, u32), b: &(f64, u32)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
        if left.len() > MAX_VICTIMS {
            left.select_nth_unstable_by(MAX_VICTIMS, by_left);
            left.truncate(MAX_VICTIMS);
        }
        left.sort_by(by_left);
        left.into_iter().map(|(_, rank)| rank).collect()
    }

    /// Mean seconds of a whole task on any rank; 1 before the first is done.
    fn mean_seconds(&self) -> f64 {
        let seconds: f64 = self.ranks.iter().map(|r| r.busy_seconds).sum();
        let finished: u32 = self.ranks.iter().map(|r| r.finished).sum();
        if finished > 0 { seconds / f64::from(finished) } else { 1.0 }
    }

    /// Moves the second half of the victim's untouched batches to `rank`, if a task of them is ready.
    fn steal_batches(&mut self, victim: u32, rank: u32) -> Option<usize> {
        let mut untouched: Vec<usize> = Vec::new();
        for t in &self.ranks[victim as usize].queue {
            let batch = self.tasks[*t].batch;
            if untouched.last() != Some(&batch) && self.is_untouched(batch, victim) {
                untouched.push(batch);
            }
        }
        let stolen = &untouched[untouched.len() / 2..];
        let first = stolen.iter().flat_map(|b| self.batches[*b].clone());
        let first = first.filter(|t| self.ready.contains(t)).min()?;
        let moved = stolen.iter().flat_map(|b| self.batches[*b].clone());
        let moved: Vec<usize> =
            moved.filter(|t| matches!(self.tasks[*t].state, State::Waiting)).collect();
        self.move_tasks(&moved, victim, rank);
        Some(first)
    }

    /// Whether `victim` owns all tasks of the batch and has started none of them. Only the first task may be finished
    /// already, by any rank: it is a key frame, which another batch may have needed.
    fn is_untouched(&self, batch: usize, victim: u32) -> bool {
        let range = self.batches[batch].clone();
        range.clone().all(|t| {
            let task = &self.tasks[t];
            let waits = matches!(task.state, State::Waiting) && task.owner == victim;
            waits || (t == range.start && matches!(task.state, State::Made))
        })
    }

    /// Moves the victim's ready task with the most dependents to `rank`, dependents included, unless
    /// `rank` lacks more references than tasks would move.
    fn steal_dependents(&mut self, victim: u32, rank: u32) -> Option<usize> {
        let queue = self.ranks[victim as usize].queue.iter().take(SEARCH_DEPTH);
        let ready: Vec<usize> = queue.copied().filter(|t| self.ready.contains(t)).collect();
        let candidates = ready.into_iter().map(|t| (self.dependents(t, victim), t));
        // Of equals the last: the victim goes on from the front of its queue.
        let (moved, t) = candidates.max_by_key(|(tasks, t)| (tasks.len(), *t))?;
        let lacks = |need: &&usize| !self.tasks[**need].holders.contains(&rank);
        let missing = self.tasks[t].needs.iter().filter(lacks).count();
        if missing > moved.len() + 1 {
            return None;
        }
        self.move_tasks(&moved, victim, rank);
        Some(t)
    }

    /// `t`, and all waiting tasks of its batch and `owner` that need it, directly or through others.
    pub(super) fn dependents(&self, t: usize, owner: u32) -> Vec<usize> {
        let mut found = BTreeSet::from([t]);
        let mut next = vec![t];
        while let Some(task) = next.pop() {
            for user in &self.tasks[task].users {
                let other = &self.tasks[*user];
                let waits = matches!(other.state, State::Waiting) && other.owner == owner;
                if waits && other.batch == self.tasks[t].batch && found.insert(*user) {
                    next.push(*user);
                }
            }
        }
        found.into_iter().collect()
    }

    fn move_tasks(&mut self, tasks: &[usize], from: u32, to: u32) {
        for t in tasks {
            self.tasks[*t].owner = to;
            self.dequeue(from, *t);
            self.enqueue(to, *t);
        }
    }
}

impl RankRecord {
    /// Estimated seconds for the queue, by the rank's own mean; by `mean` of all ranks before the rank's
    /// first task is done.
    fn seconds_left(&self, mean: f64) -> f64 {
        let each = match self.finished {
            0 => mean,
            n => self.busy_seconds / f64::from(n),
        };
        each * self.queue.len() as f64
    }
}
