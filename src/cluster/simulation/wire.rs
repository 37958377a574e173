//! What messages take.

use super::super::note::Kind;
use super::play::{Mail, Play, Timed};
use std::cmp::Reverse;

impl Play<'_> {
    pub(super) fn post(&mut self, at: f64, what: Mail) {
        self.number += 1;
        self.mail.push(Reverse(Timed { at, number: self.number, what }));
    }

    /// When a note that leaves `from` at `leaves` is heard of by `to`.
    pub(super) fn note(&mut self, leaves: f64, from: u32, to: u32) -> f64 {
        if from == to {
            return leaves;
        }
        self.played.sent.note(self.model.note_bytes as usize);
        let arrives = leaves + self.model.latency + self.seconds_of(self.model.note_bytes);
        self.next_look(to, arrives)
    }

    /// When cargo that leaves `from` now is heard of by `to`.
    pub(super) fn carry(&mut self, from: u32, to: u32, kind: Kind, bytes: u64) -> f64 {
        if from == to {
            return self.now;
        }
        self.played.sent.cargo(kind, bytes as usize);
        let seconds = self.seconds_of(bytes);
        let sender = &mut self.desks[from as usize];
        sender.sent_until = sender.sent_until.max(self.now) + seconds;
        let leaves = sender.sent_until;
        let receiver = &mut self.desks[to as usize];
        receiver.received_until = leaves.max(receiver.received_until + seconds);
        let arrives = receiver.received_until + self.model.latency;
        self.next_look(to, arrives)
    }

    /// What `original` left goes to all ranks, as quickly as can be: along a tree in which each
    /// rank passes it on once while it receives it. Each rank has to receive everything, one after
    /// the other, which is what holds it up.
    pub(super) fn tell_all(&mut self, original: u32) {
        let bytes = self.model.reference_bytes;
        let others = u64::from(self.ranks - 1);
        self.played.sent.discoveries.messages += others;
        self.played.sent.discoveries.bytes += others * bytes;
        let seconds = self.seconds_of(bytes) + self.model.latency;
        self.told_until = self.told_until.max(self.now) + seconds;
        let depth = f64::from(self.ranks.next_power_of_two().ilog2());
        let at = self.told_until + (depth - 1.0).max(0.0) * self.model.latency + self.model.nap;
        self.post(at, Mail::Known { original });
    }

    fn seconds_of(&self, bytes: u64) -> f64 {
        bytes as f64 / self.model.bandwidth
    }

    /// When `rank`, which sleeps between looks, next looks at or after `at`. Ranks do not look all at
    /// once.
    pub(super) fn next_look(&self, rank: u32, at: f64) -> f64 {
        let nap = self.model.nap;
        if nap <= 0.0 {
            return at;
        }
        let first = nap * (f64::from(rank) * 0.618_033_988_749).fract();
        first + ((at - first) / nap).ceil() * nap
    }
}
