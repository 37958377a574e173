//! The clock, what is on its way, and what each rank has.

use super::super::board::{Board, Errand, Order, Step, What};
use super::super::note::Kind;
use super::{Job, Model, Played, Table};
use crate::sequence::Pyramid;
use std::cmp::{Ordering, Reverse};
use std::collections::{BTreeSet, BinaryHeap, HashMap, HashSet, VecDeque};

/// A job half-way.
pub struct Play<'a> {
    pub(super) model: &'a Model<'a>,
    pyramid: Pyramid,
    pub(super) ranks: u32,
    tells_all: bool,
    board: Board,
    pub(super) desks: Vec<Desk>,
    pub(super) now: f64,
    /// What is on its way, by when it is heard of.
    pub(super) mail: BinaryHeap<Reverse<Timed<Mail>>>,
    /// Orders in hand, by how much work was done per busy rank when they end.
    in_hand: BinaryHeap<Reverse<Timed<Ending>>>,
    /// Seconds of a core that each busy rank has got so far.
    worked: f64,
    pub(super) number: u64,
    /// What rank 0 has not looked at.
    inbox: Vec<(u32, Order, f64)>,
    /// When rank 0's clerk is through with what it looked at.
    clerk_free: f64,
    /// Where all are told everything: when the last of that is received, what is known to all, and
    /// who waits for what is not.
    pub(super) told_until: f64,
    known: HashSet<u32>,
    waiting: HashMap<u32, Vec<u32>>,
    pub(super) played: Played,
}

/// What a rank has.
#[derive(Default)]
pub(super) struct Desk {
    errands: VecDeque<Errand>,
    is_busy: bool,
    has: BTreeSet<u32>,
    /// References that came and were not taken in.
    arrived: BTreeSet<u32>,
    /// Strips that came, by frame.
    strips: HashMap<u32, u32>,
    /// When the last of what it sends is sent, and of what it gets received.
    pub(super) sent_until: f64,
    pub(super) received_until: f64,
}

pub(super) enum Mail {
    Done { rank: u32, order: Order, seconds: f64 },
    Do { rank: u32, errand: Errand },
    Send { from: u32, to: u32, original: u32 },
    Reference { rank: u32, original: u32 },
    Strip { rank: u32, original: u32 },
    Known { original: u32 },
    Look,
}

struct Ending {
    rank: u32,
    order: Order,
    began: f64,
}

/// Something with its time; of equals the one that was thought of first comes first.
pub(super) struct Timed<T> {
    pub(super) at: f64,
    pub(super) number: u64,
    pub(super) what: T,
}

impl<T> Ord for Timed<T> {
    fn cmp(&self, other: &Self) -> Ordering {
        self.at.total_cmp(&other.at).then(self.number.cmp(&other.number))
    }
}

impl<T> PartialOrd for Timed<T> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<T> PartialEq for Timed<T> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl<T> Eq for Timed<T> {}

impl<'a> Play<'a> {
    pub fn new(job: &Job, ranks: u32, model: &'a Model<'a>) -> Self {
        let frames: Vec<u32> = job.pyramid.all().collect();
        let order: Vec<u32> = (0..ranks).collect();
        Self {
            model,
            pyramid: job.pyramid,
            ranks,
            tells_all: job.tells_all,
            board: Board::new(job, &frames, &order),
            desks: (0..ranks).map(|_| Desk::default()).collect(),
            now: 0.0,
            mail: BinaryHeap::new(),
            in_hand: BinaryHeap::new(),
            worked: 0.0,
            number: 0,
            inbox: Vec::new(),
            clerk_free: 0.0,
            told_until: 0.0,
            known: HashSet::new(),
            waiting: HashMap::new(),
            played: Played::default(),
        }
    }

    pub fn run(mut self) -> Played {
        self.look();
        while !self.board.is_done() {
            let pace = self.pace();
            let ending =
                self.in_hand.peek().map(|Reverse(e)| self.now + (e.at - self.worked) / pace);
            let mail = self.mail.peek().map(|Reverse(m)| m.at);
            match (ending, mail) {
                (Some(end), mail) if mail.is_none_or(|at| end <= at) => {
                    let Some(Reverse(ending)) = self.in_hand.pop() else { break };
                    (self.worked, self.now) = (ending.at, end);
                    self.finish(ending.what);
                }
                (_, Some(at)) => {
                    self.worked += (at - self.now) * pace;
                    self.now = at;
                    let Some(Reverse(mail)) = self.mail.pop() else { break };
                    self.hear(mail.what);
                }
                _ => break,
            }
        }
        debug_assert!(self.board.is_done(), "nothing is on its way and frames are left");
        self.played.seconds = self.now;
        self.played
    }

    /// Seconds of a core that a busy rank gets a second.
    fn pace(&self) -> f64 {
        let busy = self.in_hand.len().max(1) as f64;
        let core = self.model.cores.map_or(1.0, |cores| (cores / busy).min(1.0));
        let clerk = if self.ranks > 1 { self.model.clerk_share } else { 0.0 };
        core * (1.0 - clerk)
    }

    fn hear(&mut self, mail: Mail) {
        match mail {
            Mail::Done { rank, order, seconds } => {
                self.inbox.push((rank, order, seconds));
                self.post(self.now.max(self.clerk_free), Mail::Look);
            }
            Mail::Look => self.look(),
            Mail::Do { rank, errand } => self.accept(rank, errand),
            Mail::Send { from, to, original } => {
                let bytes = self.model.reference_bytes as f64 * self.weight(original);
                let at = self.carry(from, to, Kind::Reference, bytes as u64);
                self.post(at, Mail::Reference { rank: to, original });
            }
            Mail::Reference { rank, original } => {
                self.desks[rank as usize].arrived.insert(original);
                self.hand_out(rank);
            }
            Mail::Strip { rank, original } => {
                *self.desks[rank as usize].strips.entry(original).or_default() += 1;
                self.hand_out(rank);
            }
            Mail::Known { original } => {
                self.known.insert(original);
                for rank in self.waiting.remove(&original).unwrap_or_default() {
                    self.hand_out(rank);
                }
            }
        }
    }

    /// Rank 0 reads what came and gives out what can be given out.
    fn look(&mut self) {
        if self.clerk_free > self.now {
            let at = self.clerk_free;
            return self.post(at, Mail::Look);
        }
        let inbox = std::mem::take(&mut self.inbox);
        if inbox.is_empty() && self.now > 0.0 {
            return;
        }
        let start = thread_seconds();
        for (rank, order, seconds) in &inbox {
            self.board.done(*rank, order, *seconds);
        }
        let steps = self.board.give();
        let table = match self.model.table {
            Table::Seconds(each) => each * inbox.len() as f64,
            Table::Measured => thread_seconds() - start,
        };
        self.played.table_seconds += table;
        self.played.longest_look = self.played.longest_look.max(table);
        self.clerk_free = self.now + table + self.model.note_seconds * inbox.len() as f64;
        for step in steps {
            self.clerk_free += self.model.note_seconds;
            let (to, mail) = match step {
                Step::Do(rank, errand) => (rank, Mail::Do { rank, errand }),
                Step::Send { from, to, original } => (from, Mail::Send { from, to, original }),
            };
            let at = self.note(self.clerk_free, 0, to);
            self.post(at, mail);
        }
        self.played.clerk_seconds += self.clerk_free - self.now;
    }

    fn accept(&mut self, rank: u32, errand: Errand) {
        let desk = &mut self.desks[rank as usize];
        for original in &errand.drops {
            desk.has.remove(original);
            desk.arrived.remove(original);
        }
        desk.errands.push_back(errand);
        self.hand_out(rank);
    }

    /// Begins the first order for which everything is there.
    fn hand_out(&mut self, rank: u32) {
        let desk = &self.desks[rank as usize];
        if desk.is_busy {
            return;
        }
        let lacks = |need: &&u32| {
            !desk.has.contains(need) && !desk.arrived.contains(need) && !self.known.contains(need)
        };
        let has_strips = |order: &Order| match order.what {
            What::Whole { strips, .. } if strips > 0 => {
                desk.strips.get(&order.original) == Some(&strips)
            }
            _ => true,
        };
        let ready = |e: &Errand| has_strips(&e.order) && !e.needs.iter().any(|n| lacks(&n));
        let Some(at) = desk.errands.iter().position(ready) else {
            if self.tells_all {
                for need in desk.errands.iter().flat_map(|e| e.needs.iter().filter(lacks)) {
                    self.waiting.entry(*need).or_default().push(rank);
                }
            }
            return;
        };
        let desk = &mut self.desks[rank as usize];
        let Some(Errand { order, needs, .. }) = desk.errands.remove(at) else { return };
        let mut unpacked = Vec::new();
        for need in needs {
            desk.arrived.remove(&need);
            unpacked.extend(desk.has.insert(need).then_some(need));
        }
        desk.is_busy = true;
        let unpacked: f64 = unpacked.into_iter().map(|need| self.weight(need)).sum();
        let seconds = self.cost(&order) + unpacked * self.model.unpack_seconds;
        self.played.busy_seconds += seconds;
        self.number += 1;
        let what = Ending { rank, order, began: self.now };
        let timed = Timed { at: self.worked + seconds, number: self.number, what };
        self.in_hand.push(Reverse(timed));
    }

    /// What an original's reference weighs, of a key frame's.
    fn weight(&self, original: u32) -> f64 {
        if self.pyramid.is_key(original) { 1.0 } else { self.model.between_share }
    }

    /// Seconds of a core for an order.
    fn cost(&self, order: &Order) -> f64 {
        let all = (self.model.seconds)(order.original);
        let write = self.model.write_seconds.min(all);
        let is_packed = order.is_source && self.ranks > 1;
        let weight = if is_packed { self.weight(order.original) } else { 0.0 };
        let pack = weight * self.model.pack_seconds;
        match order.what {
            What::Strip { of, .. } => (all - write) / f64::from(of),
            What::Whole { strips: 0, .. } => all + pack,
            What::Whole { .. } => write + pack,
        }
    }

    fn finish(&mut self, ending: Ending) {
        let Ending { rank, order, began } = ending;
        let original = order.original;
        let desk = &mut self.desks[rank as usize];
        desk.is_busy = false;
        match &order.what {
            What::Strip { leader, of, .. } => {
                let (leader, bytes) = (*leader, self.model.strips_bytes / u64::from(*of));
                let at = self.carry(rank, leader, Kind::Strip, bytes);
                self.post(at, Mail::Strip { rank: leader, original });
            }
            What::Whole { frames, .. } => {
                self.played.frames += frames.len() as u64;
                if order.is_source {
                    desk.has.insert(original);
                    if self.tells_all {
                        self.tell_all(original);
                    }
                }
            }
        }
        let seconds = self.now - began;
        let at = self.note(self.now, rank, 0);
        self.post(at, Mail::Done { rank, order, seconds });
        self.hand_out(rank);
    }
}

/// Processor seconds of this thread so far: what the table takes, however busy the machine is.
fn thread_seconds() -> f64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    now.tv_sec as f64 + now.tv_nsec as f64 * 1e-9
}
