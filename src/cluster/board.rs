//! Who makes what, as rank 0 decides it: the frames of a job, who has been given which, and where the
//! references are that others need.
//!
//! Ranks ask for work by telling that they finished some, and get frames one by one, so nothing ever
//! has to be taken back: a frame that was not given out yet changes hands in this table alone. Pure
//! bookkeeping: no messages, no clocks. What it decides depends on who was quicker; what the
//! frames look like does not depend on what it decides.

mod give;
mod lay;
mod take;
#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// The job's table.
pub struct Board {
    tasks: Vec<Task>,
    /// By batch, its tasks.
    batches: Vec<std::ops::Range<usize>>,
    members: Vec<Member>,
    /// Tasks that wait for nothing but somebody to make them.
    ready: BTreeSet<usize>,
    /// Tasks that are cut into strips, and not all of these given out.
    cut: BTreeSet<usize>,
    /// Tasks whose strips are all made, for their leaders to put together.
    to_join: Vec<usize>,
    /// Members with nothing in hand.
    idle: BTreeSet<u32>,
    /// The member that is next to look for work of others.
    turn: u32,
    /// Members whose hands changed since work was last given out.
    touched: BTreeSet<u32>,
    /// Tasks that are not made.
    left: usize,
    most_strips: u32,
    /// Members of whose own tasks none is left.
    without_own: usize,
    tells_all: bool,
    is_stopped: bool,
}

/// One original, with the frames to write of it.
struct Task {
    original: u32,
    frames: Vec<u32>,
    batch: usize,
    owner: u32,
    /// Whether it lies on disk, and no frame is written of it.
    is_read: bool,
    needs: Vec<usize>,
    users: Vec<usize>,
    /// Needs that are not made.
    unmet: usize,
    /// Users that are not made.
    unused: usize,
    state: State,
    /// Ranks that have what it left behind, or to which it is on its way.
    at: BTreeSet<u32>,
    /// Those of them that surely have it, with how often each was told to send it.
    holders: BTreeMap<u32, u32>,
}

enum State {
    Waiting,
    Given(u32),
    Cut(Cut),
    Made,
}

struct Cut {
    leader: u32,
    of: u32,
    given: u32,
    made: u32,
}

/// A rank, as the table sees it.
#[derive(Default)]
struct Member {
    /// Its tasks that nobody was given.
    own: BTreeSet<usize>,
    in_hand: u32,
    drops: Vec<u32>,
    busy_seconds: f64,
    finished: u32,
}

/// What a rank is to do next.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Errand {
    /// What to make.
    pub order: Order,
    /// Originals whose references it takes.
    pub needs: Vec<u32>,
    /// Originals whose references nobody will need again.
    pub drops: Vec<u32>,
}

/// Something to make.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Order {
    /// Number of the task, to be told when it is done.
    pub task: usize,
    /// The original to make.
    pub original: u32,
    /// Whether other frames are made of it.
    pub is_source: bool,
    /// All of it or a part.
    pub what: What,
}

/// How much of an original is to be made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum What {
    /// All of it, put together from so many strips if not 0; these frames are written of it.
    Whole { strips: u32, frames: Vec<u32> },
    /// One strip of several, for the rank that puts them together.
    Strip { number: u32, of: u32, leader: u32 },
}

/// What the table wants done.
#[derive(Debug, Clone, PartialEq)]
pub enum Step {
    /// The rank shall do this.
    Do(u32, Errand),
    /// Rank `from` shall send rank `to` what `original` left.
    Send { from: u32, to: u32, original: u32 },
}

impl Board {
    /// `rank` is the one to make `t`, as it looks.
    fn give_to(&mut self, rank: u32, t: usize) {
        let own = &mut self.members[rank as usize].own;
        self.without_own -= usize::from(own.is_empty());
        own.insert(t);
    }

    fn take_from(&mut self, rank: u32, t: usize) {
        let own = &mut self.members[rank as usize].own;
        if own.remove(&t) {
            self.without_own += usize::from(own.is_empty());
        }
    }

    /// Whether all is made.
    pub fn is_done(&self) -> bool {
        self.left == 0
    }

    /// Nothing more is given out.
    pub fn stop(&mut self) {
        self.is_stopped = true;
    }

    /// Rank `rank` did `order`, in so many seconds.
    pub fn done(&mut self, rank: u32, order: &Order, seconds: f64) {
        let member = &mut self.members[rank as usize];
        member.in_hand -= 1;
        member.busy_seconds += seconds;
        if member.in_hand == 0 {
            self.idle.insert(rank);
        }
        self.touched.insert(rank);
        let t = order.task;
        self.note_arrivals(rank, t);
        match (&order.what, &mut self.tasks[t].state) {
            (What::Strip { .. }, State::Cut(cut)) => {
                cut.made += 1;
                if cut.made == cut.of {
                    self.to_join.push(t);
                }
            }
            _ => {
                self.members[rank as usize].finished += 1;
                self.made(rank, t);
            }
        }
    }

    /// What a task was made of is surely where it was made.
    fn note_arrivals(&mut self, rank: u32, t: usize) {
        for i in 0..self.tasks[t].needs.len() {
            let need = self.tasks[t].needs[i];
            let need = &mut self.tasks[need];
            if need.at.contains(&rank) {
                need.holders.entry(rank).or_default();
            }
        }
    }

    fn made(&mut self, rank: u32, t: usize) {
        self.left -= 1;
        let everybody = 0..self.members.len() as u32;
        let task = &mut self.tasks[t];
        task.state = State::Made;
        task.at = if self.tells_all { everybody.collect() } else { [rank].into() };
        task.holders.insert(rank, 0);
        let (needs, users) = (task.needs.clone(), task.users.clone());
        for user in users {
            self.tasks[user].unmet -= 1;
            if self.tasks[user].unmet == 0 && matches!(self.tasks[user].state, State::Waiting) {
                self.ready.insert(user);
            }
        }
        for need in needs {
            let need = &mut self.tasks[need];
            need.unused -= 1;
            if need.unused == 0 {
                for holder in std::mem::take(&mut need.at) {
                    self.members[holder as usize].drops.push(need.original);
                }
            }
        }
    }
}
