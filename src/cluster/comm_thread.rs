//! The communication thread of a rank, which is its main thread: receives messages, starts tasks on
//! the render thread once their references have arrived, and sends the results. On rank 0 it also runs
//! the [`Scheduler`].
//!
//! Communication overlaps with rendering: no message waits for the end of a frame, and no core idles
//! while a task is ready. The thread sleeps between polls, because Open MPI would spin on a core.

use super::Communicator;
use super::chunks::{Chunks, Reassembly};
use super::message::{Message, Payload, PayloadKind};
use super::render_thread::{Event, Finished, TaskInput};
use super::scheduler::{Assignment, Decision, Extent, Scheduler};
use crate::error::{Error, Result};
use crate::sequence::{FrameReport, RankMaker};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender};
use std::time::{Duration, Instant};

/// Time between polls for messages; an event of the render thread ends the wait.
const POLL_INTERVAL: Duration = Duration::from_millis(1);
/// Time between polls while sends are pending, because MPI advances long messages only inside calls.
const SENDING_POLL_INTERVAL: Duration = Duration::from_micros(200);
/// Longest time that the report of a written frame waits for the end of a task, whose message takes it along.
const REPORT_DELAY: Duration = Duration::from_secs(1);

/// The state of a rank's communication thread.
pub struct CommThread<'a> {
    comm: &'a Communicator,
    maker: &'a dyn RankMaker,
    /// Set when the job was asked to stop.
    stop: &'a AtomicBool,
    /// Called on rank 0 for every finished frame of the job.
    done: &'a dyn Fn(&FrameReport),
    /// On rank 0 only.
    scheduler: Option<Scheduler>,
    /// Starts a task on the render thread.
    tasks: Sender<TaskInput>,
    /// Assignments that were not started.
    assignments: VecDeque<Assignment>,
    /// Whether the render thread has a task.
    is_busy: bool,
    /// Number of frames of the tasks so far that are not written.
    unwritten: usize,
    /// Reports of written frames that rank 0 has not got.
    reports: Vec<FrameReport>,
    /// When the first of these frames was written.
    reports_since: Instant,
    /// Since when the render thread has a task or frames are to be written.
    working_since: Option<Instant>,
    /// Representatives whose references the maker holds.
    imported: BTreeSet<u32>,
    /// References that arrived and were not given to the maker, by representative.
    received: BTreeMap<u32, Arc<[u8]>>,
    /// Encoded references to send on, by representative, until the scheduler drops them.
    encoded: BTreeMap<u32, Chunks>,
    reassembly: Reassembly,
    /// Representatives whose references no task needs again.
    dropped: BTreeSet<u32>,
    /// Rendered strips that this rank will merge: by representative, then by number.
    strips: BTreeMap<u32, BTreeMap<u32, Arc<[u8]>>>,
    has_sent_stop: bool,
    /// Whether all tasks of the job are done.
    is_over: bool,
    /// Frames that this rank finished.
    pub finished: Vec<FrameReport>,
    /// Seconds in which the render thread had a task or a frame was to be written.
    pub busy_seconds: f64,
}

impl<'a> CommThread<'a> {
    /// A thread that starts tasks through `tasks`. `scheduler` is `Some` on rank 0.
    pub fn new(
        comm: &'a Communicator,
        maker: &'a dyn RankMaker,
        stop: &'a AtomicBool,
        done: &'a dyn Fn(&FrameReport),
        scheduler: Option<Scheduler>,
        tasks: Sender<TaskInput>,
    ) -> Self {
        Self {
            comm,
            maker,
            stop,
            done,
            scheduler,
            tasks,
            assignments: VecDeque::new(),
            is_busy: false,
            unwritten: 0,
            reports: Vec::new(),
            reports_since: Instant::now(),
            working_since: None,
            imported: BTreeSet::new(),
            received: BTreeMap::new(),
            encoded: BTreeMap::new(),
            reassembly: Reassembly::default(),
            dropped: BTreeSet::new(),
            strips: BTreeMap::new(),
            has_sent_stop: false,
            is_over: false,
            finished: Vec::new(),
            busy_seconds: 0.0,
        }
    }

    /// Runs until all tasks of the job are done, or the job was asked to stop and this rank's task ended, and
    /// this rank's frames are written.
    pub fn run(&mut self, events: &Receiver<Event>) -> Result<()> {
        self.dispatch()?;
        loop {
            self.poll()?;
            self.propagate_stop()?;
            self.start_task()?;
            self.send_reports()?;
            self.note_work();
            let is_at_work = self.working_since.is_some();
            if !is_at_work && (self.is_over || self.stop.load(Ordering::Relaxed)) {
                return Ok(());
            }
            let is_sending = self.comm.has_pending_sends();
            let interval = if is_sending { SENDING_POLL_INTERVAL } else { POLL_INTERVAL };
            match events.recv_timeout(interval) {
                Ok(event) => self.handle_event(event)?,
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(Error::Failed("the rendering thread is gone".into()));
                }
            }
        }
    }

    /// Sends reports that no task's end will take along soon.
    fn send_reports(&mut self) -> Result<()> {
        let is_due =
            self.comm.is_root() || !self.is_busy || self.reports_since.elapsed() >= REPORT_DELAY;
        if self.reports.is_empty() || !is_due {
            return Ok(());
        }
        let reports = std::mem::take(&mut self.reports);
        self.send(0, Message::Wrote(reports))
    }

    /// Counts the seconds of work.
    fn note_work(&mut self) {
        let is_at_work = self.is_busy || self.unwritten > 0;
        match self.working_since {
            None if is_at_work => self.working_since = Some(Instant::now()),
            Some(since) if !is_at_work => {
                self.busy_seconds += since.elapsed().as_secs_f64();
                self.working_since = None;
            }
            _ => {}
        }
    }

    /// Receives all messages that have arrived.
    pub fn poll(&mut self) -> Result<()> {
        self.comm.poll_failures();
        let messages: Vec<(u32, Message)> = self.comm.receive_messages()?;
        let has_messages = !messages.is_empty();
        for (from, message) in messages {
            self.handle_message(from, message)?;
        }
        for bytes in self.comm.receive_payloads() {
            self.handle_payload(&Payload::decode(&bytes)?);
        }
        if has_messages { self.dispatch() } else { Ok(()) }
    }

    /// On rank 0: sends the scheduler's decisions.
    fn dispatch(&mut self) -> Result<()> {
        let Some(scheduler) = &mut self.scheduler else { return Ok(()) };
        let decisions = scheduler.assign();
        let is_done = scheduler.is_done();
        for decision in decisions {
            match decision {
                Decision::Assign(rank, assignment) => self.send(rank, Message::Do(assignment))?,
                Decision::Send { from, to, representative } => {
                    self.send(from, Message::Send { representative, to })?;
                }
            }
        }
        if is_done && !self.is_over {
            self.is_over = true;
            self.send_to_others(&Message::End)?;
        }
        Ok(())
    }

    /// Sends a control message; one to this rank itself is handled at once.
    fn send(&mut self, to: u32, message: Message) -> Result<()> {
        match to == self.comm.rank() {
            true => self.handle_message(to, message),
            false => self.comm.send_message(to, &message),
        }
    }

    fn send_to_others(&self, message: &Message) -> Result<()> {
        self.others().try_for_each(|rank| self.comm.send_message(rank, message))
    }

    fn others(&self) -> impl Iterator<Item = u32> + use<> {
        let own = self.comm.rank();
        (0..self.comm.size()).filter(move |rank| *rank != own)
    }

    fn handle_message(&mut self, from: u32, message: Message) -> Result<()> {
        match message {
            Message::Wrote(reports) => reports.iter().for_each(self.done),
            Message::Done { task, reports, seconds } => {
                reports.iter().for_each(self.done);
                if let Some(scheduler) = &mut self.scheduler {
                    scheduler.complete(from, &task, seconds);
                }
            }
            Message::Do(assignment) => {
                assignment
                    .drops
                    .iter()
                    .for_each(|representative| self.drop_reference(*representative));
                self.assignments.push_back(assignment);
            }
            Message::Send { representative, to } => {
                let chunks = self.encoded.get(&representative).cloned().unwrap_or_default();
                self.comm.send_chunks(&[to], PayloadKind::Reference, representative, 0, &chunks)?;
            }
            Message::Stop => self.stop.store(true, Ordering::Relaxed),
            Message::End => self.is_over = true,
        }
        Ok(())
    }

    fn handle_payload(&mut self, payload: &Payload) {
        let Some(chunks) = self.reassembly.add(payload) else { return };
        let representative = payload.representative;
        match payload.kind {
            PayloadKind::Strip => {
                self.strips
                    .entry(representative)
                    .or_default()
                    .insert(payload.strip, chunks.bytes());
            }
            PayloadKind::Reference | PayloadKind::Discoveries => {
                // Discoveries may arrive after the scheduler dropped them.
                if !self.dropped.contains(&representative) {
                    self.received.insert(representative, chunks.bytes());
                    self.encoded.insert(representative, chunks);
                }
            }
        }
    }

    fn drop_reference(&mut self, representative: u32) {
        self.encoded.remove(&representative);
        self.received.remove(&representative);
        self.dropped.insert(representative);
        if self.imported.remove(&representative) {
            self.maker.release(representative);
        }
    }

    /// Starts the first assignment whose references and strips are all here, if the render thread is idle.
    fn start_task(&mut self) -> Result<()> {
        if self.is_busy || self.stop.load(Ordering::Relaxed) {
            return Ok(());
        }
        let Some(at) = self.assignments.iter().position(|a| self.is_ready(a)) else {
            return Ok(());
        };
        let Some(Assignment { task, needs, .. }) = self.assignments.remove(at) else {
            return Ok(());
        };
        let mut references = Vec::new();
        for need in needs {
            if let Some(bytes) = self.received.remove(&need) {
                self.imported.insert(need);
                references.push((need, bytes));
            }
        }
        let strips = match task.extent {
            Extent::Whole { strips, .. } if strips > 0 => {
                self.strips.remove(&task.representative).unwrap_or_default().into_values().collect()
            }
            _ => Vec::new(),
        };
        self.is_busy = true;
        self.unwritten += task.frames().len();
        let sent = self.tasks.send(TaskInput { task, references, strips });
        sent.map_err(|_| Error::Failed("the rendering thread is gone".into()))
    }

    fn is_ready(&self, assignment: &Assignment) -> bool {
        let has_strips = match assignment.task.extent {
            Extent::Whole { strips, .. } if strips > 0 => {
                let received =
                    self.strips.get(&assignment.task.representative).map_or(0, BTreeMap::len);
                received == strips as usize
            }
            _ => true,
        };
        let is_here = |need| self.imported.contains(need) || self.received.contains_key(need);
        has_strips && assignment.needs.iter().all(is_here)
    }

    /// Handles an event of the render thread or the writing thread.
    fn handle_event(&mut self, event: Event) -> Result<()> {
        match event {
            Event::Wrote(report) => {
                self.unwritten -= 1;
                self.finished.push((*report).clone());
                if self.reports.is_empty() {
                    self.reports_since = Instant::now();
                }
                self.reports.push(*report);
                Ok(())
            }
            Event::Finished(finished) => self.complete_task(*finished),
            Event::Stopped { unmade } => {
                self.is_busy = false;
                self.unwritten -= unmade;
                // A task ends early only because the job was asked to stop.
                self.stop.store(true, Ordering::Relaxed);
                Ok(())
            }
            Event::Failed(error) => Err(error),
        }
    }

    /// Sends the result of a task to the ranks that take it, and reports the task to rank 0.
    fn complete_task(&mut self, finished: Finished) -> Result<()> {
        let Finished { task, output, seconds } = finished;
        self.is_busy = false;
        let representative = task.representative;
        match &task.extent {
            Extent::Strip { number, leader, .. } => {
                if *leader == self.comm.rank() {
                    self.strips.entry(representative).or_default().insert(*number, output.bytes);
                } else {
                    let strip = Chunks::whole(output.bytes);
                    let kind = PayloadKind::Strip;
                    self.comm.send_chunks(&[*leader], kind, representative, *number, &strip)?;
                }
            }
            Extent::Whole { .. } if task.is_source => {
                self.imported.insert(representative);
                let chunks = self.comm.chunks(output.bytes, output.discoveries);
                if self.maker.sends_to_all() {
                    let others: Vec<u32> = self.others().collect();
                    let kind = PayloadKind::Discoveries;
                    self.comm.send_chunks(&others, kind, representative, 0, &chunks)?;
                } else {
                    self.encoded.insert(representative, chunks);
                }
            }
            Extent::Whole { .. } => {}
        }
        let reports = std::mem::take(&mut self.reports);
        self.send(0, Message::Done { task, reports, seconds })?;
        self.dispatch()
    }

    /// Sends a request to stop, once: from any rank to rank 0, and from rank 0 to all ranks.
    fn propagate_stop(&mut self) -> Result<()> {
        if self.has_sent_stop || !self.stop.load(Ordering::Relaxed) {
            return Ok(());
        }
        self.has_sent_stop = true;
        match &mut self.scheduler {
            Some(scheduler) => {
                scheduler.stop();
                self.send_to_others(&Message::Stop)
            }
            None => self.comm.send_message(0, &Message::Stop),
        }
    }
}
