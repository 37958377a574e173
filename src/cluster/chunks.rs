//! Payload bytes cut into chunks, one message each, and put together again by the receiver.

use super::message::{Payload, PayloadKind};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Most bytes of a chunk, because MPI counts in `int`.
const MAX_CHUNK_BYTES: usize = 1 << 30;

/// Bytes of one reference, discovery list or strip, and the number of chunks to send.
#[derive(Debug, Clone, Default)]
pub struct Chunks {
    bytes: Arc<[u8]>,
    count: u32,
}

impl Chunks {
    /// All bytes in one chunk, or in as few as MPI allows.
    pub fn whole(bytes: Arc<[u8]>) -> Self {
        Self::split(bytes, 0, u64::MAX)
    }

    /// Bytes of `discoveries` discoveries, at most `most` in a chunk.
    pub fn split(bytes: Arc<[u8]>, discoveries: u64, most: u64) -> Self {
        let by_discoveries = discoveries.div_ceil(most.max(1));
        let by_bytes = bytes.len().div_ceil(MAX_CHUNK_BYTES) as u64;
        // No chunk is empty, except a single one.
        let count = by_discoveries.max(by_bytes).min(bytes.len() as u64).max(1);
        Self { bytes, count: count as u32 }
    }

    /// The encoded [`Payload`] of each chunk. `strip` is the number of the strip, 0 for other kinds.
    pub fn messages(
        &self,
        kind: PayloadKind,
        representative: u32,
        strip: u32,
    ) -> impl Iterator<Item = Vec<u8>> + '_ {
        let chunks = self.count.max(1);
        let edge = move |chunk: u32| {
            (self.bytes.len() as u64 * u64::from(chunk) / u64::from(chunks)) as usize
        };
        (0..chunks).map(move |chunk| {
            let bytes = &self.bytes[edge(chunk)..edge(chunk + 1)];
            Payload { kind, representative, strip, chunk, chunks, bytes }.encode()
        })
    }

    /// All bytes.
    pub fn bytes(&self) -> Arc<[u8]> {
        Arc::clone(&self.bytes)
    }
}

/// Chunks received so far, by kind, representative and strip, then by chunk number.
#[derive(Default)]
pub struct Reassembly(BTreeMap<(PayloadKind, u32, u32), BTreeMap<u32, Vec<u8>>>);

impl Reassembly {
    /// Adds a chunk; returns all of them once the last has arrived.
    pub fn add(&mut self, payload: &Payload) -> Option<Chunks> {
        if payload.chunks == 1 {
            return Some(Chunks { bytes: payload.bytes.into(), count: 1 });
        }
        let key = (payload.kind, payload.representative, payload.strip);
        let received = self.0.entry(key).or_default();
        received.insert(payload.chunk, payload.bytes.to_vec());
        if received.len() < payload.chunks as usize {
            return None;
        }
        let received = self.0.remove(&key)?;
        let bytes: Vec<u8> = received.into_values().flatten().collect();
        Some(Chunks { bytes: bytes.into(), count: payload.chunks })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chunks(bytes: usize, discoveries: u64, most: u64) -> (Vec<u8>, Chunks) {
        let all: Vec<u8> = (0..bytes).map(|i| i as u8).collect();
        (all.clone(), Chunks::split(all.into(), discoveries, most))
    }

    #[test]
    fn the_number_of_chunks_follows_from_the_number_of_discoveries() {
        for (bytes, discoveries, most, expected) in [
            (1000, 50, 100, 1),
            (1000, 100, 100, 1),
            (1000, 101, 100, 2),
            (1000, 950, 100, 10),
            (1000, 0, 1, 1),
            (0, 0, 100, 1),
            (3, 1000, 1, 3),
        ] {
            let (_, chunks) = chunks(bytes, discoveries, most);
            let count = chunks.messages(PayloadKind::Reference, 7, 0).count();
            assert_eq!(count, expected, "{bytes} {discoveries} {most}");
        }
    }

    #[test]
    fn chunks_are_reassembled_in_whatever_order_they_arrive() {
        let (all, chunks) = chunks(1003, 70, 10);
        let messages: Vec<_> = chunks.messages(PayloadKind::Discoveries, 7, 0).collect();
        let others: Vec<_> = chunks.messages(PayloadKind::Discoveries, 8, 0).collect();
        let mut reassembly = Reassembly::default();
        for i in [3, 0, 6, 1, 5, 2] {
            for message in [&messages[i], &others[i]] {
                assert!(reassembly.add(&Payload::decode(message).expect("decoded")).is_none());
            }
        }
        let last = reassembly.add(&Payload::decode(&messages[4]).expect("decoded"));
        let last = last.expect("whole");
        assert_eq!(&*last.bytes(), &all[..]);
        // A rank that forwards the bytes cuts them into the same chunks.
        assert_eq!(last.messages(PayloadKind::Discoveries, 7, 0).collect::<Vec<_>>(), messages);
    }
}
