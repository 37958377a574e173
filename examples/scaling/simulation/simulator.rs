//! The simulator: the clock, the queue of events, and the state of each rank.

use super::{CostModel, Job, SchedulerCost, SimulatedRun};
use std::cmp::{Ordering, Reverse};
use std::collections::{BTreeSet, BinaryHeap, HashMap, HashSet, VecDeque};
use tweenray::cluster::scheduler::{Assignment, Decision, Extent, Scheduler, Task};
use tweenray::sequence::Pyramid;

/// A job that is being simulated. Times are in seconds since its start.
pub struct Simulator<'a> {
    pub(super) model: &'a CostModel<'a>,
    pyramid: Pyramid,
    sends_to_all: bool,
    scheduler: Scheduler,
    pub(super) ranks: Vec<RankState>,
    pub(super) now: f64,
    /// Events to come, by time.
    pub(super) events: BinaryHeap<Reverse<Timed<Event>>>,
    /// Running tasks, by the value of `worked` at which they end.
    running: BinaryHeap<Reverse<Timed<RunningTask>>>,
    /// Core seconds that each busy rank has had so far; ranks that share cores get fewer per second.
    worked: f64,
    /// Number of the last event or task.
    pub(super) sequence_number: u64,
    /// Reports that rank 0 has not read: rank, task and seconds.
    inbox: Vec<(u32, Task, f64)>,
    /// Time at which rank 0's communication thread is idle again.
    comm_idle_at: f64,
    /// If discoveries go to all ranks: the time at which the last are received.
    pub(super) broadcast_until: f64,
    /// Representatives whose discoveries all ranks have.
    known: HashSet<u32>,
    /// Ranks that wait for the discoveries of a representative.
    waiting: HashMap<u32, Vec<u32>>,
    pub(super) run: SimulatedRun,
}

/// The state of a rank.
#[derive(Default)]
pub(super) struct RankState {
    assignments: VecDeque<Assignment>,
    is_busy: bool,
    /// Representatives whose references are decoded.
    imported: BTreeSet<u32>,
    /// Representatives whose references arrived and are not decoded.
    received: BTreeSet<u32>,
    /// Number of strips that arrived, by representative.
    strips: HashMap<u32, u32>,
    /// Time at which the rank's last payload is sent.
    pub(super) sent_until: f64,
    /// Time at which the last payload to the rank is received.
    pub(super) received_until: f64,
}

pub(super) enum Event {
    /// Rank 0 receives the report of a task.
    Done { rank: u32, task: Task, seconds: f64 },
    /// The rank receives an assignment.
    Assign { rank: u32, assignment: Assignment },
    /// Rank `from` receives the instruction to send a reference.
    Send { from: u32, to: u32, representative: u32 },
    /// The rank receives a reference.
    Reference { rank: u32, representative: u32 },
    /// The rank receives a strip.
    Strip { rank: u32, representative: u32 },
    /// All ranks have received the discoveries of a representative.
    Known { representative: u32 },
    /// Rank 0 reads its inbox.
    Poll,
}

struct RunningTask {
    rank: u32,
    task: Task,
    start: f64,
}

/// An event or task with its time. Equal times are ordered by number, so that runs are reproducible.
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

impl<'a> Simulator<'a> {
    pub fn new(job: &Job, ranks: u32, model: &'a CostModel<'a>) -> Self {
        let frames: Vec<u32> = (1..=job.pyramid.frames).collect();
        let rank_order: Vec<u32> = (0..ranks).collect();
        Self {
            model,
            pyramid: job.pyramid,
            sends_to_all: job.sends_to_all,
            scheduler: Scheduler::new(job, &frames, &rank_order),
            ranks: (0..ranks).map(|_| RankState::default()).collect(),
            now: 0.0,
            events: BinaryHeap::new(),
            running: BinaryHeap::new(),
            worked: 0.0,
            sequence_number: 0,
            inbox: Vec::new(),
            comm_idle_at: 0.0,
            broadcast_until: 0.0,
            known: HashSet::new(),
            waiting: HashMap::new(),
            run: SimulatedRun::default(),
        }
    }

    pub(super) fn rank_count(&self) -> u32 {
        self.ranks.len() as u32
    }

    /// Simulates the whole job.
    pub fn run(mut self) -> SimulatedRun {
        self.poll();
        while !self.scheduler.is_done() {
            let pace = self.pace();
            let task_end =
                self.running.peek().map(|Reverse(e)| self.now + (e.at - self.worked) / pace);
            let event = self.events.peek().map(|Reverse(e)| e.at);
            match (task_end, event) {
                (Some(end), event) if event.is_none_or(|at| end <= at) => {
                    let Some(Reverse(task)) = self.running.pop() else { break };
                    (self.worked, self.now) = (task.at, end);
                    self.finish(task.what);
                }
                (_, Some(at)) => {
                    self.worked += (at - self.now) * pace;
                    self.now = at;
                    let Some(Reverse(event)) = self.events.pop() else { break };
                    self.handle(event.what);
                }
                _ => break,
            }
        }
        debug_assert!(self.scheduler.is_done(), "no event is left, but frames are");
        self.run.seconds = self.now;
        self.run
    }

    /// Core seconds that a busy rank gets per second.
    fn pace(&self) -> f64 {
        let busy = self.running.len().max(1) as f64;
        let core = self.model.cores.map_or(1.0, |cores| (cores / busy).min(1.0));
        let comm = if self.ranks.len() > 1 { self.model.comm_share } else { 0.0 };
        core * (1.0 - comm)
    }

    fn handle(&mut self, event: Event) {
        match event {
            Event::Done { rank, task, seconds } => {
                self.inbox.push((rank, task, seconds));
                self.schedule(self.now.max(self.comm_idle_at), Event::Poll);
            }
            Event::Poll => self.poll(),
            Event::Assign { rank, assignment } => self.accept(rank, assignment),
            Event::Send { from, to, representative } => {
                let bytes = self.model.reference_bytes as f64 * self.weight(representative);
                let at = self.send_payload(from, to, |sent| &mut sent.references, bytes as u64);
                self.schedule(at, Event::Reference { rank: to, representative });
            }
            Event::Reference { rank, representative } => {
                self.ranks[rank as usize].received.insert(representative);
                self.start_task(rank);
            }
            Event::Strip { rank, representative } => {
                *self.ranks[rank as usize].strips.entry(representative).or_default() += 1;
                self.start_task(rank);
            }
            Event::Known { representative } => {
                self.known.insert(representative);
                for rank in self.waiting.remove(&representative).unwrap_or_default() {
                    self.start_task(rank);
                }
            }
        }
    }

    /// Rank 0 reads its inbox and sends the scheduler's decisions.
    fn poll(&mut self) {
        if self.comm_idle_at > self.now {
            let at = self.comm_idle_at;
            return self.schedule(at, Event::Poll);
        }
        let inbox = std::mem::take(&mut self.inbox);
        if inbox.is_empty() && self.now > 0.0 {
            return;
        }
        let start = thread_seconds();
        for (rank, task, seconds) in &inbox {
            self.scheduler.complete(*rank, task, *seconds);
        }
        let decisions = self.scheduler.assign();
        let took = match self.model.scheduler {
            SchedulerCost::Seconds(each) => each * inbox.len() as f64,
            SchedulerCost::Measured => thread_seconds() - start,
        };
        self.run.scheduler_seconds += took;
        self.run.longest_pass = self.run.longest_pass.max(took);
        self.comm_idle_at = self.now + took + self.model.message_seconds * inbox.len() as f64;
        for decision in decisions {
            self.comm_idle_at += self.model.message_seconds;
            let (to, event) = match decision {
                Decision::Assign(rank, assignment) => (rank, Event::Assign { rank, assignment }),
                Decision::Send { from, to, representative } => {
                    (from, Event::Send { from, to, representative })
                }
            };
            let at = self.send_message(self.comm_idle_at, 0, to);
            self.schedule(at, event);
        }
        self.run.comm_seconds += self.comm_idle_at - self.now;
    }

    fn accept(&mut self, rank: u32, assignment: Assignment) {
        let state = &mut self.ranks[rank as usize];
        for representative in &assignment.drops {
            state.imported.remove(representative);
            state.received.remove(representative);
        }
        state.assignments.push_back(assignment);
        self.start_task(rank);
    }

    /// Starts the first assignment whose references and strips are all here, if the rank is idle.
    fn start_task(&mut self, rank: u32) {
        let state = &self.ranks[rank as usize];
        if state.is_busy {
            return;
        }
        let lacks = |need: &&u32| {
            !state.imported.contains(need)
                && !state.received.contains(need)
                && !self.known.contains(need)
        };
        let has_strips = |task: &Task| match task.extent {
            Extent::Whole { strips, .. } if strips > 0 => {
                state.strips.get(&task.representative) == Some(&strips)
            }
            _ => true,
        };
        let ready = |a: &Assignment| has_strips(&a.task) && !a.needs.iter().any(|n| lacks(&n));
        let Some(at) = state.assignments.iter().position(ready) else {
            if self.sends_to_all {
                for need in state.assignments.iter().flat_map(|a| a.needs.iter().filter(lacks)) {
                    self.waiting.entry(*need).or_default().push(rank);
                }
            }
            return;
        };
        let state = &mut self.ranks[rank as usize];
        let Some(Assignment { task, needs, .. }) = state.assignments.remove(at) else { return };
        let mut unpacked = Vec::new();
        for need in needs {
            state.received.remove(&need);
            unpacked.extend(state.imported.insert(need).then_some(need));
        }
        state.is_busy = true;
        let unpacked: f64 = unpacked.into_iter().map(|need| self.weight(need)).sum();
        let seconds = self.cost(&task) + unpacked * self.model.unpack_seconds;
        self.run.busy_seconds += seconds;
        self.sequence_number += 1;
        let what = RunningTask { rank, task, start: self.now };
        let timed = Timed { at: self.worked + seconds, number: self.sequence_number, what };
        self.running.push(Reverse(timed));
    }

    /// Size of a representative's reference, as a share of a key frame's.
    fn weight(&self, representative: u32) -> f64 {
        if self.pyramid.is_key(representative) { 1.0 } else { self.model.between_share }
    }

    /// Core seconds of a task, encoding of its reference included.
    fn cost(&self, task: &Task) -> f64 {
        let all = (self.model.seconds)(task.representative);
        let write = self.model.write_seconds.min(all);
        let is_packed = task.is_source && self.ranks.len() > 1;
        let weight = if is_packed { self.weight(task.representative) } else { 0.0 };
        let pack = weight * self.model.pack_seconds;
        match task.extent {
            Extent::Strip { of, .. } => (all - write) / f64::from(of),
            Extent::Whole { strips: 0, .. } => all + pack,
            Extent::Whole { .. } => write + pack,
        }
    }

    /// A task ends: its result is sent to other ranks, and its report to rank 0.
    fn finish(&mut self, ended: RunningTask) {
        let RunningTask { rank, task, start } = ended;
        let representative = task.representative;
        let state = &mut self.ranks[rank as usize];
        state.is_busy = false;
        match &task.extent {
            Extent::Strip { leader, of, .. } => {
                let (leader, bytes) = (*leader, self.model.strips_bytes / u64::from(*of));
                let at = self.send_payload(rank, leader, |sent| &mut sent.strips, bytes);
                self.schedule(at, Event::Strip { rank: leader, representative });
            }
            Extent::Whole { frames, .. } => {
                self.run.frames += frames.len() as u64;
                if task.is_source {
                    state.imported.insert(representative);
                    if self.sends_to_all {
                        self.broadcast(representative);
                    }
                }
            }
        }
        let seconds = self.now - start;
        let at = self.send_message(self.now, rank, 0);
        self.schedule(at, Event::Done { rank, task, seconds });
        self.start_task(rank);
    }
}

/// Processor seconds of this thread so far, which do not depend on the load of the machine.
fn thread_seconds() -> f64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    now.tv_sec as f64 + now.tv_nsec as f64 * 1e-9
}
