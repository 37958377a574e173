//! Arrival times of messages.

use super::simulator::{Event, Simulator, Timed};
use std::cmp::Reverse;
use tweenray::cluster::{Sent, Traffic};

impl Simulator<'_> {
    /// Adds an event at time `at`.
    pub(super) fn schedule(&mut self, at: f64, what: Event) {
        self.sequence_number += 1;
        self.events.push(Reverse(Timed { at, number: self.sequence_number, what }));
    }

    /// The time at which `to` reads a control message that `from` sends at time `sent`.
    pub(super) fn send_message(&mut self, sent: f64, from: u32, to: u32) -> f64 {
        if from == to {
            return sent;
        }
        count(&mut self.run.sent.notes, 1, self.model.message_bytes);
        let arrives = sent + self.model.latency + self.seconds_of(self.model.message_bytes);
        self.next_poll(to, arrives)
    }

    /// The time at which `to` reads a payload that `from` sends now. A rank sends one payload at a time, and
    /// receives one at a time. `kind` is where the payload counts.
    pub(super) fn send_payload(
        &mut self,
        from: u32,
        to: u32,
        kind: fn(&mut Traffic) -> &mut Sent,
        bytes: u64,
    ) -> f64 {
        if from == to {
            return self.now;
        }
        count(kind(&mut self.run.sent), 1, bytes);
        let seconds = self.seconds_of(bytes);
        let sender = &mut self.ranks[from as usize];
        sender.sent_until = sender.sent_until.max(self.now) + seconds;
        let sent = sender.sent_until;
        let receiver = &mut self.ranks[to as usize];
        receiver.received_until = sent.max(receiver.received_until + seconds);
        let arrives = receiver.received_until + self.model.latency;
        self.next_poll(to, arrives)
    }

    /// Sends the discoveries of `representative` to all ranks, at the speed of an ideal broadcast: along a
    /// binary tree, forwarded while they are received. The limit is that each rank receives the
    /// discoveries of all representatives, one after the other.
    pub(super) fn broadcast(&mut self, representative: u32) {
        let bytes = self.model.reference_bytes;
        let others = u64::from(self.rank_count() - 1);
        count(&mut self.run.sent.discoveries, others, bytes);
        let seconds = self.seconds_of(bytes) + self.model.latency;
        self.broadcast_until = self.broadcast_until.max(self.now) + seconds;
        let depth = f64::from(self.rank_count().next_power_of_two().ilog2());
        let at = self.broadcast_until
            + (depth - 1.0).max(0.0) * self.model.latency
            + self.model.poll_interval;
        self.schedule(at, Event::Known { representative });
    }

    /// Seconds to send `bytes`, without latency.
    fn seconds_of(&self, bytes: u64) -> f64 {
        bytes as f64 / self.model.bandwidth
    }

    /// The time of the first poll of `rank` at or after `at`. The ranks' polls are spread over the
    /// interval.
    pub(super) fn next_poll(&self, rank: u32, at: f64) -> f64 {
        let interval = self.model.poll_interval;
        if interval <= 0.0 {
            return at;
        }
        let first = interval * (f64::from(rank) * 0.618_033_988_749).fract();
        first + ((at - first) / interval).ceil() * interval
    }
}

/// Counts `messages` of `bytes` each.
fn count(sent: &mut Sent, messages: u64, bytes: u64) {
    sent.messages += messages;
    sent.bytes += messages * bytes;
}
