//! Assigning tasks to ranks.

use super::{Assignment, Decision, Extent, Scheduler, Split, State, Task};

/// Strips for each rank that shares a frame; more than one, so that a slow rank does not delay the rest.
const STRIPS_PER_RANK: usize = 2;
/// Most idle ranks that search other queues in vain in one pass.
const MAX_FAILED_STEALS: usize = 8;

impl Scheduler {
    /// All decisions that can be made now.
    pub fn assign(&mut self) -> Vec<Decision> {
        let mut decisions = Vec::new();
        if self.is_stopped {
            return decisions;
        }
        for t in std::mem::take(&mut self.to_merge) {
            self.assign_merge(t, &mut decisions);
        }
        self.assign_idle(&mut decisions);
        for rank in std::mem::take(&mut self.changed) {
            // A second task hides the latency of messages. Where few tasks are ready, it would only
            // keep work from idle ranks.
            if self.ready.len() >= self.ranks.len() {
                self.assign_ahead(rank, &mut decisions);
            }
        }
        decisions
    }

    /// Each idle rank gets a strip of a split frame, else a ready task of its own queue, else a stolen
    /// task. After a few failed steals the other ranks wait for the next pass.
    fn assign_idle(&mut self, decisions: &mut Vec<Decision>) {
        let mut victims = None;
        let mut failed_steals = 0;
        let first = self.next_thief.min(self.ranks.len() as u32);
        let idle: Vec<u32> =
            self.idle.range(first..).chain(self.idle.range(..first)).copied().collect();
        for rank in idle {
            if self.ready.is_empty() && self.split.is_empty() {
                break;
            }
            if let Some(t) = self.split_for(rank) {
                self.assign_strip(rank, t, decisions);
                continue;
            }
            let is_ready = |t: &&usize| self.tasks[**t].unmet_needs == 0;
            let mut found = self.ranks[rank as usize].queue.iter().find(is_ready).copied();
            if found.is_none() && failed_steals < MAX_FAILED_STEALS {
                let victims = victims.get_or_insert_with(|| self.busiest());
                found = self.steal_for(rank, victims);
                failed_steals += usize::from(found.is_none());
                self.next_thief = rank + 1;
            }
            if let Some(t) = found {
                self.assign_or_split(rank, t, decisions);
            }
        }
    }

    /// `rank` gets all of task `t`, or its first strip and the merge.
    fn assign_or_split(&mut self, rank: u32, t: usize, decisions: &mut Vec<Decision>) {
        match self.strip_count(t) {
            1 => self.assign_whole(rank, t, decisions),
            strips => {
                self.no_longer_waits(t);
                let leader = rank;
                self.tasks[t].state =
                    State::Split(Split { leader, strips, assigned: 0, rendered: 0 });
                self.split.insert(t);
                self.assign_strip(rank, t, decisions);
            }
        }
    }

    /// A second task from the rank's own queue, to follow the assigned one. It may need the result of
    /// that one.
    fn assign_ahead(&mut self, rank: u32, decisions: &mut Vec<Decision>) {
        let record = &self.ranks[rank as usize];
        if record.assigned != 1 {
            return;
        }
        let is_made_or_next = |need: &usize| match &self.tasks[*need].state {
            State::Made => true,
            State::Assigned(other) => *other == rank,
            _ => false,
        };
        // In a batch that waits for another rank's reference no task fits, so the search is short.
        let mut queue = record.queue.iter().take(super::steal::SEARCH_DEPTH);
        let fits = |t: &&usize| {
            self.tasks[**t].needs.iter().all(is_made_or_next) && self.strip_count(**t) == 1
        };
        let next = queue.find(fits).copied();
        if let Some(t) = next {
            self.assign_whole(rank, t, decisions);
        }
    }

    /// A frame with unassigned strips: best one that `rank` leads, then one whose references it holds.
    fn split_for(&self, rank: u32) -> Option<usize> {
        let preference = |t: &usize| {
            let task = &self.tasks[*t];
            let leads = matches!(&task.state, State::Split(split) if split.leader == rank);
            let has = |need: &&usize| self.tasks[**need].holders.contains(&rank);
            (!leads, task.needs.len() - task.needs.iter().filter(has).count(), *t)
        };
        self.split.iter().copied().min_by_key(preference)
    }

    /// Number of strips to cut task `t` into: 1 where every helper has a ready task. A key frame is
    /// expensive and takes no references, so ranks with an empty queue help. Another frame is split
    /// where more tasks wait for it than references must be sent to the helpers.
    fn strip_count(&self, t: usize) -> u32 {
        let task = &self.tasks[t];
        if task.is_read {
            return 1;
        }
        let ready = self.ready.len().max(1);
        let helpers = match task.needs.is_empty() {
            // A rank with a queue keeps to its own frames.
            true => 1 + self.empty_queues,
            false => self.idle.len(),
        };
        if helpers <= ready {
            return 1;
        }
        let ranks = helpers.div_ceil(ready);
        let dependents = self.dependents(t, task.owner).len();
        if self.missing_references(t, ranks) >= dependents && !task.needs.is_empty() {
            return 1;
        }
        self.most_strips.min((STRIPS_PER_RANK * ranks) as u32).max(1)
    }

    /// Number of references of task `t` that the first `ranks` idle ranks lack, summed.
    fn missing_references(&self, t: usize, ranks: usize) -> usize {
        let needs = || self.tasks[t].needs.iter();
        let lack = |rank: &u32| needs().filter(|n| !self.tasks[**n].holders.contains(rank)).count();
        self.idle.iter().take(ranks).map(lack).sum()
    }

    fn assign_whole(&mut self, rank: u32, t: usize, decisions: &mut Vec<Decision>) {
        self.no_longer_waits(t);
        self.tasks[t].state = State::Assigned(rank);
        let extent = Extent::Whole { strips: 0, frames: self.tasks[t].frames.clone() };
        self.assign_to(rank, t, extent, decisions);
    }

    fn assign_strip(&mut self, rank: u32, t: usize, decisions: &mut Vec<Decision>) {
        let State::Split(split) = &mut self.tasks[t].state else { return };
        let extent =
            Extent::Strip { number: split.assigned, of: split.strips, leader: split.leader };
        split.assigned += 1;
        if split.assigned == split.strips {
            self.split.remove(&t);
        }
        self.assign_to(rank, t, extent, decisions);
    }

    fn assign_merge(&mut self, t: usize, decisions: &mut Vec<Decision>) {
        let State::Split(Split { strips, leader: rank, .. }) = self.tasks[t].state else { return };
        self.tasks[t].state = State::Assigned(rank);
        let extent = Extent::Whole { strips, frames: self.tasks[t].frames.clone() };
        self.assign_to(rank, t, extent, decisions);
    }

    fn no_longer_waits(&mut self, t: usize) {
        self.ready.remove(&t);
        self.dequeue(self.tasks[t].owner, t);
    }

    fn assign_to(&mut self, rank: u32, t: usize, extent: Extent, decisions: &mut Vec<Decision>) {
        // A merge takes no references: its leader rendered a strip.
        let is_merge = matches!(extent, Extent::Whole { strips, .. } if strips > 0);
        let needs = if is_merge { Vec::new() } else { self.tasks[t].needs.clone() };
        for need in &needs {
            self.send_reference(*need, rank, decisions);
        }
        let record = &mut self.ranks[rank as usize];
        record.assigned += 1;
        self.idle.remove(&rank);
        self.changed.insert(rank);
        let drops = std::mem::take(&mut record.drops);
        let needs = needs.iter().map(|need| self.tasks[*need].representative).collect();
        let record = &self.tasks[t];
        let (representative, is_source) = (record.representative, !record.users.is_empty());
        let task = Task { id: t, representative, is_source, extent };
        decisions.push(Decision::Assign(rank, Assignment { task, needs, drops }));
    }

    /// Has the reference of a made task sent to `rank`, unless `rank` is a holder. The sender with the
    /// fewest sends is taken.
    fn send_reference(&mut self, t: usize, rank: u32, decisions: &mut Vec<Decision>) {
        let task = &mut self.tasks[t];
        if !matches!(task.state, State::Made) || !task.holders.insert(rank) {
            return;
        }
        let least = task.senders.iter_mut().min_by_key(|(_, sends)| **sends);
        if let Some((from, sends)) = least {
            *sends += 1;
            decisions.push(Decision::Send {
                from: *from,
                to: rank,
                representative: task.representative,
            });
        }
    }
}
