//! The scheduler on rank 0: which rank makes which frame, and which ranks hold which reference.
//!
//! A task is one *representative*, the frame that stands for all frames with its camera, or a strip of it. A rank asks
//! for work by reporting a finished task, and gets tasks one by one. So no assignment is ever revoked:
//! an unassigned task moves between ranks inside this table only. The scheduler is plain bookkeeping,
//! without messages and clocks. Its decisions depend on the speed of the ranks; the bytes of a frame do
//! not depend on its decisions (`docs/decisions/019-ranks.md`).

mod assign;
mod build;
mod steal;
#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// All tasks of a job, all ranks, and their queues. Tasks are named by their index.
pub struct Scheduler {
    tasks: Vec<TaskRecord>,
    /// For each batch, the range of its tasks.
    batches: Vec<std::ops::Range<usize>>,
    ranks: Vec<RankRecord>,
    /// Waiting tasks whose needs are all made.
    ready: BTreeSet<usize>,
    /// Tasks cut into strips, while strips are unassigned.
    split: BTreeSet<usize>,
    /// Tasks whose strips are all rendered, for their leaders to merge.
    to_merge: Vec<usize>,
    /// Ranks without an assigned task.
    idle: BTreeSet<u32>,
    /// The idle rank that steals first in the next pass.
    next_thief: u32,
    /// Ranks whose assigned tasks changed since the last pass.
    changed: BTreeSet<u32>,
    /// Number of tasks that are not made.
    remaining: usize,
    /// Most strips that a frame can be cut into.
    most_strips: u32,
    /// Number of ranks with an empty queue.
    empty_queues: usize,
    /// Whether every made reference goes to all ranks, needed or not.
    sends_to_all: bool,
    is_stopped: bool,
}

/// A task and its place in the dependency graph.
struct TaskRecord {
    representative: u32,
    /// The frames to write: the representative and its copies, as far as they are asked for.
    frames: Vec<u32>,
    batch: usize,
    /// The rank whose queue holds the task while it waits.
    owner: u32,
    /// Whether the reference is read from disk; no frame is written then.
    is_read: bool,
    /// Tasks whose references this task takes.
    needs: Vec<usize>,
    /// Tasks that take this task's reference.
    users: Vec<usize>,
    /// Number of needs that are not made.
    unmet_needs: usize,
    /// Number of users that are not made.
    unmade_users: usize,
    state: State,
    /// Ranks that hold the reference, or to which it is being sent.
    holders: BTreeSet<u32>,
    /// Holders that certainly have the reference, each with the number of sends assigned to it.
    senders: BTreeMap<u32, u32>,
}

enum State {
    Waiting,
    Assigned(u32),
    Split(Split),
    Made,
}

/// A task cut into strips, and the rank that merges the strips.
struct Split {
    leader: u32,
    strips: u32,
    assigned: u32,
    rendered: u32,
}

/// A rank's queue and load.
#[derive(Default)]
struct RankRecord {
    /// Waiting tasks that this rank owns.
    queue: BTreeSet<usize>,
    /// Number of assigned tasks that are not done.
    assigned: u32,
    /// Representatives whose references the rank can free, sent with its next assignment.
    drops: Vec<u32>,
    /// Seconds of rendering so far.
    busy_seconds: f64,
    /// Whole tasks done so far.
    finished: u32,
}

/// Rank 0's instruction to a rank: a task, and the references that the task takes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Assignment {
    /// What to make. (Message bytes keep the key `order`.)
    #[serde(rename = "order")]
    pub task: Task,
    /// Representatives whose references the task takes.
    pub needs: Vec<u32>,
    /// Representatives whose references the rank can free.
    pub drops: Vec<u32>,
}

/// A frame to make, whole or in part. (Message bytes keep the keys `task`, `original` and `what`.)
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Task {
    /// The scheduler's index of the task.
    #[serde(rename = "task")]
    pub id: usize,
    /// The number of the frame to make: a representative.
    #[serde(rename = "original")]
    pub representative: u32,
    /// Whether other frames take its reference.
    pub is_source: bool,
    /// The whole frame, or one strip.
    #[serde(rename = "what")]
    pub extent: Extent,
}

impl Task {
    /// The frames that it writes.
    pub fn frames(&self) -> &[u32] {
        match &self.extent {
            Extent::Whole { frames, .. } => frames,
            Extent::Strip { .. } => &[],
        }
    }
}

/// How much of its frame a task makes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Extent {
    /// The whole frame.
    Whole {
        /// Number of strips to merge it from; 0: it is rendered.
        strips: u32,
        /// Frames to write from it.
        frames: Vec<u32>,
    },
    /// A strip of the frame.
    Strip {
        /// Number of the strip, from 0.
        number: u32,
        /// Number of strips.
        of: u32,
        /// The rank that merges the strips.
        leader: u32,
    },
}

/// A decision of the scheduler, to be sent to a rank.
#[derive(Debug, Clone, PartialEq)]
pub enum Decision {
    /// The rank gets this assignment.
    Assign(u32, Assignment),
    /// A rank that holds a reference sends it to another.
    Send {
        /// The rank that holds it.
        from: u32,
        /// The rank that needs it.
        to: u32,
        /// The representative frame of the reference.
        representative: u32,
    },
}

impl Scheduler {
    /// Puts task `t` into the queue of `rank`.
    fn enqueue(&mut self, rank: u32, t: usize) {
        let queue = &mut self.ranks[rank as usize].queue;
        self.empty_queues -= usize::from(queue.is_empty());
        queue.insert(t);
    }

    /// Removes task `t` from the queue of `rank`.
    fn dequeue(&mut self, rank: u32, t: usize) {
        let queue = &mut self.ranks[rank as usize].queue;
        if queue.remove(&t) {
            self.empty_queues += usize::from(queue.is_empty());
        }
    }

    /// Whether all tasks are made.
    pub fn is_done(&self) -> bool {
        self.remaining == 0
    }

    /// Assigns no more tasks.
    pub fn stop(&mut self) {
        self.is_stopped = true;
    }

    /// Records that `rank` has done `task` in `seconds`.
    ///
    /// # Panics
    /// The scheduler has fewer ranks or tasks.
    pub fn complete(&mut self, rank: u32, task: &Task, seconds: f64) {
        let record = &mut self.ranks[rank as usize];
        record.assigned -= 1;
        record.busy_seconds += seconds;
        if record.assigned == 0 {
            self.idle.insert(rank);
        }
        self.changed.insert(rank);
        let t = task.id;
        self.record_senders(rank, t);
        match (&task.extent, &mut self.tasks[t].state) {
            (Extent::Strip { .. }, State::Split(split)) => {
                split.rendered += 1;
                if split.rendered == split.strips {
                    self.to_merge.push(t);
                }
            }
            _ => {
                self.ranks[rank as usize].finished += 1;
                self.record_made(rank, t);
            }
        }
    }

    /// `rank` has done a task of `t`, so the references that `t` takes have certainly arrived there.
    fn record_senders(&mut self, rank: u32, t: usize) {
        for i in 0..self.tasks[t].needs.len() {
            let need = self.tasks[t].needs[i];
            let need = &mut self.tasks[need];
            if need.holders.contains(&rank) {
                need.senders.entry(rank).or_default();
            }
        }
    }

    /// Task `t` was made by `rank`: its users may become ready, and references without users are freed.
    fn record_made(&mut self, rank: u32, t: usize) {
        self.remaining -= 1;
        let all_ranks = 0..self.ranks.len() as u32;
        let task = &mut self.tasks[t];
        task.state = State::Made;
        task.holders = if self.sends_to_all { all_ranks.collect() } else { [rank].into() };
        task.senders.insert(rank, 0);
        let (needs, users) = (task.needs.clone(), task.users.clone());
        for user in users {
            self.tasks[user].unmet_needs -= 1;
            if self.tasks[user].unmet_needs == 0 && matches!(self.tasks[user].state, State::Waiting)
            {
                self.ready.insert(user);
            }
        }
        for need in needs {
            let need = &mut self.tasks[need];
            need.unmade_users -= 1;
            if need.unmade_users == 0 {
                for holder in std::mem::take(&mut need.holders) {
                    self.ranks[holder as usize].drops.push(need.representative);
                }
            }
        }
    }
}
