//! Work that changes hands: a rank without any takes from the one that will be busy longest.

use super::{Board, Member, State};
use std::collections::BTreeSet;

/// Frames of a batch, as far as a search goes that need not find anything.
pub const FEW: usize = 64;
/// Members from whom work is taken at a time.
const VICTIMS: usize = 32;

impl Board {
    /// A task for a rank that has none of its own that is ready: with it come the second half of the
    /// untouched batches of the first of `victims` that has any, or else what depends on it.
    pub fn take_for(&mut self, rank: u32, victims: &[u32]) -> Option<usize> {
        victims.iter().filter(|victim| **victim != rank).find_map(|victim| {
            self.take_batches(*victim, rank).or_else(|| self.take_tree(*victim, rank))
        })
    }

    /// The few members that will be busy longest, the slowest first.
    pub fn busiest(&self) -> Vec<u32> {
        let mean = self.mean_seconds();
        let members = (0..).zip(&self.members).filter(|(_, m)| !m.own.is_empty());
        let mut left: Vec<(f64, u32)> = members.map(|(r, m)| (m.seconds_left(mean), r)).collect();
        let by_left = |a: &(f64, u32), b: &(f64, u32)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
        if left.len() > VICTIMS {
            left.select_nth_unstable_by(VICTIMS, by_left);
            left.truncate(VICTIMS);
        }
        left.sort_by(by_left);
        left.into_iter().map(|(_, rank)| rank).collect()
    }

    fn mean_seconds(&self) -> f64 {
        let seconds: f64 = self.members.iter().map(|m| m.busy_seconds).sum();
        let finished: u32 = self.members.iter().map(|m| m.finished).sum();
        if finished > 0 { seconds / f64::from(finished) } else { 1.0 }
    }

    /// Takes the second half of the batches of which `victim` has not begun to infer anything.
    fn take_batches(&mut self, victim: u32, rank: u32) -> Option<usize> {
        let mut untouched: Vec<usize> = Vec::new();
        for t in &self.members[victim as usize].own {
            let batch = self.tasks[*t].batch;
            if untouched.last() != Some(&batch) && self.is_untouched(batch, victim) {
                untouched.push(batch);
            }
        }
        let taken = &untouched[untouched.len() / 2..];
        let first = taken.iter().flat_map(|b| self.batches[*b].clone());
        let first = first.filter(|t| self.ready.contains(t)).min()?;
        let moved = taken.iter().flat_map(|b| self.batches[*b].clone());
        let moved: Vec<usize> =
            moved.filter(|t| matches!(self.tasks[*t].state, State::Waiting)).collect();
        self.change_hands(&moved, victim, rank);
        Some(first)
    }

    /// Whether nothing of the batch is in hand or made, but for its first frame, which another batch
    /// may have needed too, and all the rest is the victim's.
    fn is_untouched(&self, batch: usize, victim: u32) -> bool {
        let range = self.batches[batch].clone();
        range.clone().all(|t| {
            let task = &self.tasks[t];
            let waits = matches!(task.state, State::Waiting) && task.owner == victim;
            waits || (t == range.start && matches!(task.state, State::Made))
        })
    }

    /// Takes the ready task of `victim` that most of its batch depends on, with all that does: where
    /// it is worth sending the references about that the rank lacks.
    fn take_tree(&mut self, victim: u32, rank: u32) -> Option<usize> {
        let own = self.members[victim as usize].own.iter().take(2 * FEW);
        let ready: Vec<usize> = own.copied().filter(|t| self.ready.contains(t)).collect();
        let trees = ready.into_iter().map(|t| (self.tree(t, victim), t));
        // Of equals the later one: the victim goes on from the front.
        let (tree, t) = trees.max_by_key(|(tree, t)| (tree.len(), *t))?;
        let lacks = |need: &&usize| !self.tasks[**need].at.contains(&rank);
        let lacking = self.tasks[t].needs.iter().filter(lacks).count();
        if lacking > tree.len() + 1 {
            return None;
        }
        self.change_hands(&tree, victim, rank);
        Some(t)
    }

    /// `t` and what waits in its batch for it, as far as it is the victim's.
    pub fn tree(&self, t: usize, victim: u32) -> Vec<usize> {
        let mut found = BTreeSet::from([t]);
        let mut next = vec![t];
        while let Some(task) = next.pop() {
            for user in &self.tasks[task].users {
                let other = &self.tasks[*user];
                let waits = matches!(other.state, State::Waiting) && other.owner == victim;
                if waits && other.batch == self.tasks[t].batch && found.insert(*user) {
                    next.push(*user);
                }
            }
        }
        found.into_iter().collect()
    }

    fn change_hands(&mut self, tasks: &[usize], from: u32, to: u32) {
        for t in tasks {
            self.tasks[*t].owner = to;
            self.take_from(from, *t);
            self.give_to(to, *t);
        }
    }
}

impl Member {
    /// How long it will need for what is its own, by what it needed so far; `mean` is what a task
    /// takes on any rank.
    fn seconds_left(&self, mean: f64) -> f64 {
        let each = match self.finished {
            0 => mean,
            n => self.busy_seconds / f64::from(n),
        };
        each * self.own.len() as f64
    }
}
