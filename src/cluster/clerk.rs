//! What the main thread of a rank does while another renders: it takes in what other ranks send,
//! hands orders to the rendering thread once all that they take is there, and sends on what comes of
//! them. On rank 0 it keeps the [`Board`] too.
//!
//! So nothing that is sent has to wait for a frame to be finished, and tracing never waits for a
//! message that is on its way while there is anything else to trace. It sleeps between looks:
//! Open MPI would spin on a core.

use super::World;
use super::board::{Board, Errand, Step, What};
use super::note::{Cargo, Kind, Note};
use super::parcel::{Arriving, Parcel};
use super::worker::{Done, Job, Told};
use crate::error::{Error, Result};
use crate::sequence::{FrameReport, Shared};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender};
use std::time::Duration;

/// How long it sleeps between looks for messages; the rendering thread wakes it.
const NAP: Duration = Duration::from_millis(1);
/// The same while it sends: MPI moves long messages on only while it is looked at.
const SENDING: Duration = Duration::from_micros(200);

/// What it knows.
pub struct Clerk<'a> {
    world: &'a World,
    maker: &'a dyn Shared,
    stop: &'a AtomicBool,
    /// Hears on rank 0 of every finished frame.
    done: &'a dyn Fn(&FrameReport),
    /// On rank 0.
    board: Option<Board>,
    jobs: Sender<Job>,
    errands: VecDeque<Errand>,
    is_busy: bool,
    /// Originals whose references the maker has.
    has: BTreeSet<u32>,
    /// References that the maker has not been given.
    arrived: BTreeMap<u32, Arc<[u8]>>,
    /// References as they travel, as long as anybody may need them.
    packed: BTreeMap<u32, Parcel>,
    /// What came in part.
    arriving: Arriving,
    /// Originals whose references nobody needs.
    dropped: BTreeSet<u32>,
    /// Of frames that are put together here: strips by number.
    strips: BTreeMap<u32, BTreeMap<u32, Arc<[u8]>>>,
    has_told_stop: bool,
    is_over: bool,
    /// Frames that this rank finished.
    pub finished: Vec<FrameReport>,
    /// Seconds that the rendering thread was at work.
    pub busy_seconds: f64,
}

impl<'a> Clerk<'a> {
    /// One that hands orders out through `jobs`; `board` on rank 0.
    pub fn new(
        world: &'a World,
        maker: &'a dyn Shared,
        stop: &'a AtomicBool,
        done: &'a dyn Fn(&FrameReport),
        board: Option<Board>,
        jobs: Sender<Job>,
    ) -> Self {
        Self {
            world,
            maker,
            stop,
            done,
            board,
            jobs,
            errands: VecDeque::new(),
            is_busy: false,
            has: BTreeSet::new(),
            arrived: BTreeMap::new(),
            packed: BTreeMap::new(),
            arriving: Arriving::default(),
            dropped: BTreeSet::new(),
            strips: BTreeMap::new(),
            has_told_stop: false,
            is_over: false,
            finished: Vec::new(),
            busy_seconds: 0.0,
        }
    }

    /// Works until all is made, or the job was asked to stop and the order in hand has ended.
    pub fn run(&mut self, told: &Receiver<Told>) -> Result<()> {
        self.deal()?;
        loop {
            self.hear()?;
            self.pass_on_stop()?;
            self.hand_out()?;
            if !self.is_busy && (self.is_over || self.stop.load(Ordering::Relaxed)) {
                return Ok(());
            }
            let nap = if self.world.is_sending() { SENDING } else { NAP };
            match told.recv_timeout(nap) {
                Ok(told) => self.heed(told)?,
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(Error::Failed("the rendering thread is gone".into()));
                }
            }
        }
    }

    /// Takes in what other ranks sent.
    pub fn hear(&mut self) -> Result<()> {
        self.world.heed_failures();
        let notes: Vec<(u32, Note)> = self.world.notes()?;
        let is_news = !notes.is_empty();
        for (from, note) in notes {
            self.take(from, note)?;
        }
        for bytes in self.world.cargo() {
            self.unload(&Cargo::decode(&bytes)?);
        }
        if is_news { self.deal() } else { Ok(()) }
    }

    /// On rank 0: gives out what can be given out.
    fn deal(&mut self) -> Result<()> {
        let Some(board) = &mut self.board else { return Ok(()) };
        let steps = board.give();
        let is_done = board.is_done();
        for step in steps {
            match step {
                Step::Do(rank, errand) => self.tell(rank, Note::Do(errand))?,
                Step::Send { from, to, original } => {
                    self.tell(from, Note::Send { original, to })?;
                }
            }
        }
        if is_done && !self.is_over {
            self.is_over = true;
            self.tell_others(&Note::End)?;
        }
        Ok(())
    }

    fn tell(&mut self, to: u32, note: Note) -> Result<()> {
        match to == self.world.rank() {
            true => self.take(to, note),
            false => self.world.post(to, &note),
        }
    }

    fn tell_others(&self, note: &Note) -> Result<()> {
        self.others().try_for_each(|rank| self.world.post(rank, note))
    }

    fn others(&self) -> impl Iterator<Item = u32> + use<> {
        let own = self.world.rank();
        (0..self.world.size()).filter(move |rank| *rank != own)
    }

    fn take(&mut self, from: u32, note: Note) -> Result<()> {
        match note {
            Note::Wrote(reports) => reports.iter().for_each(self.done),
            Note::Done { order, reports, seconds } => {
                reports.iter().for_each(self.done);
                if let Some(board) = &mut self.board {
                    board.done(from, &order, seconds);
                }
            }
            Note::Do(errand) => {
                errand.drops.iter().for_each(|original| self.let_go(*original));
                self.errands.push_back(errand);
            }
            Note::Send { original, to } => {
                let parcel = self.packed.get(&original).cloned().unwrap_or_default();
                self.world.ship(&[to], Kind::Reference, original, 0, &parcel)?;
            }
            Note::Stop => self.stop.store(true, Ordering::Relaxed),
            Note::End => self.is_over = true,
        }
        Ok(())
    }

    fn unload(&mut self, cargo: &Cargo) {
        let Some(parcel) = self.arriving.take(cargo) else { return };
        let original = cargo.original;
        match cargo.kind {
            Kind::Strip => {
                self.strips.entry(original).or_default().insert(cargo.number, parcel.bytes());
            }
            // (What goes to all may come after the frames that needed it are made.)
            Kind::Reference | Kind::Discoveries if self.dropped.contains(&original) => {}
            Kind::Reference | Kind::Discoveries => {
                self.arrived.insert(original, parcel.bytes());
                self.packed.insert(original, parcel);
            }
        }
    }

    fn let_go(&mut self, original: u32) {
        self.packed.remove(&original);
        self.arrived.remove(&original);
        self.dropped.insert(original);
        if self.has.remove(&original) {
            self.maker.let_go(original);
        }
    }

    /// Gives the rendering thread the first order for which everything is there.
    fn hand_out(&mut self) -> Result<()> {
        if self.is_busy || self.stop.load(Ordering::Relaxed) {
            return Ok(());
        }
        let Some(at) = self.errands.iter().position(|errand| self.is_ready(errand)) else {
            return Ok(());
        };
        let Some(Errand { order, needs, .. }) = self.errands.remove(at) else { return Ok(()) };
        let mut references = Vec::new();
        for need in needs {
            if let Some(bytes) = self.arrived.remove(&need) {
                self.has.insert(need);
                references.push((need, bytes));
            }
        }
        let strips = match order.what {
            What::Whole { strips, .. } if strips > 0 => {
                self.strips.remove(&order.original).unwrap_or_default().into_values().collect()
            }
            _ => Vec::new(),
        };
        self.is_busy = true;
        let sent = self.jobs.send(Job { order, references, strips });
        sent.map_err(|_| Error::Failed("the rendering thread is gone".into()))
    }

    fn is_ready(&self, errand: &Errand) -> bool {
        let there = match errand.order.what {
            What::Whole { strips, .. } if strips > 0 => {
                let there = self.strips.get(&errand.order.original).map_or(0, BTreeMap::len);
                there == strips as usize
            }
            _ => true,
        };
        let is_here = |need| self.has.contains(need) || self.arrived.contains_key(need);
        there && errand.needs.iter().all(is_here)
    }

    /// Takes in what the rendering thread says.
    fn heed(&mut self, told: Told) -> Result<()> {
        match told {
            Told::Wrote(report) => {
                self.finished.push((*report).clone());
                self.tell(0, Note::Wrote(vec![*report]))
            }
            Told::Done(done) => self.finish(*done),
            Told::Stopped => {
                self.is_busy = false;
                // Nobody else gives up in the middle of an order.
                self.stop.store(true, Ordering::Relaxed);
                Ok(())
            }
            Told::Failed(error) => Err(error),
        }
    }

    fn finish(&mut self, done: Done) -> Result<()> {
        let Done { order, report, leaves, seconds } = done;
        self.is_busy = false;
        self.busy_seconds += seconds;
        let original = order.original;
        match &order.what {
            What::Strip { number, leader, .. } => {
                if *leader == self.world.rank() {
                    self.strips.entry(original).or_default().insert(*number, leaves.bytes);
                } else {
                    let strip = Parcel::whole(leaves.bytes);
                    self.world.ship(&[*leader], Kind::Strip, original, *number, &strip)?;
                }
            }
            What::Whole { .. } if order.is_source => {
                self.has.insert(original);
                let parcel = self.world.parcel(leaves.bytes, leaves.discoveries);
                if self.maker.tells_all() {
                    let others: Vec<u32> = self.others().collect();
                    self.world.ship(&others, Kind::Discoveries, original, 0, &parcel)?;
                } else {
                    self.packed.insert(original, parcel);
                }
            }
            What::Whole { .. } => {}
        }
        self.finished.extend(report.clone());
        self.tell(0, Note::Done { order, reports: report.into_iter().collect(), seconds })?;
        self.deal()
    }

    /// Who is asked to stop tells rank 0, and rank 0 tells all.
    fn pass_on_stop(&mut self) -> Result<()> {
        if self.has_told_stop || !self.stop.load(Ordering::Relaxed) {
            return Ok(());
        }
        self.has_told_stop = true;
        match &mut self.board {
            Some(board) => {
                board.stop();
                self.tell_others(&Note::Stop)
            }
            None => self.world.post(0, &Note::Stop),
        }
    }
}
