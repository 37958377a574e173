//! Bytes for other ranks, cut into as many messages as they travel in.

use super::note::{Cargo, Kind};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Most bytes in one message, however many discoveries were allowed: MPI counts in `int`.
const LARGEST: usize = 1 << 30;

/// What goes from one rank to another.
#[derive(Debug, Clone, Default)]
pub struct Parcel {
    bytes: Arc<[u8]>,
    /// In how many messages it travels.
    of: u32,
}

impl Parcel {
    /// In one message.
    pub fn whole(bytes: Arc<[u8]>) -> Self {
        Self::cut(bytes, 0, u64::MAX)
    }

    /// Bytes that stand for so many discoveries, of which a message carries `most`.
    pub fn cut(bytes: Arc<[u8]>, discoveries: u64, most: u64) -> Self {
        let by_discoveries = discoveries.div_ceil(most.max(1));
        let by_bytes = bytes.len().div_ceil(LARGEST) as u64;
        // A message with nothing in it tells nobody anything, but for the first.
        let of = by_discoveries.max(by_bytes).min(bytes.len() as u64).max(1);
        Self { bytes, of: of as u32 }
    }

    /// Its messages.
    pub fn messages(
        &self,
        kind: Kind,
        original: u32,
        number: u32,
    ) -> impl Iterator<Item = Vec<u8>> + '_ {
        let edge = |piece: u32| {
            (self.bytes.len() as u64 * u64::from(piece) / u64::from(self.of.max(1))) as usize
        };
        (0..self.of.max(1)).map(move |piece| {
            let bytes = &self.bytes[edge(piece)..edge(piece + 1)];
            Cargo { kind, original, number, piece, of: self.of.max(1), bytes }.encode()
        })
    }

    /// All of its bytes.
    pub fn bytes(&self) -> Arc<[u8]> {
        Arc::clone(&self.bytes)
    }
}

/// Parcels of which some messages have come.
#[derive(Default)]
pub struct Arriving(BTreeMap<(Kind, u32, u32), BTreeMap<u32, Vec<u8>>>);

impl Arriving {
    /// One more message; the parcel, if it was the last.
    pub fn take(&mut self, cargo: &Cargo) -> Option<Parcel> {
        if cargo.of == 1 {
            return Some(Parcel { bytes: cargo.bytes.into(), of: 1 });
        }
        let key = (cargo.kind, cargo.original, cargo.number);
        let pieces = self.0.entry(key).or_default();
        pieces.insert(cargo.piece, cargo.bytes.to_vec());
        if pieces.len() < cargo.of as usize {
            return None;
        }
        let pieces = self.0.remove(&key)?;
        let bytes: Vec<u8> = pieces.into_values().flatten().collect();
        Some(Parcel { bytes: bytes.into(), of: cargo.of })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parcel(bytes: usize, discoveries: u64, most: u64) -> (Vec<u8>, Parcel) {
        let all: Vec<u8> = (0..bytes).map(|i| i as u8).collect();
        (all.clone(), Parcel::cut(all.into(), discoveries, most))
    }

    #[test]
    fn a_parcel_travels_in_as_many_messages_as_its_discoveries_take() {
        for (bytes, discoveries, most, expected) in [
            (1000, 50, 100, 1),
            (1000, 100, 100, 1),
            (1000, 101, 100, 2),
            (1000, 950, 100, 10),
            (1000, 0, 1, 1),
            (0, 0, 100, 1),
            (3, 1000, 1, 3),
        ] {
            let (_, parcel) = parcel(bytes, discoveries, most);
            let count = parcel.messages(Kind::Reference, 7, 0).count();
            assert_eq!(count, expected, "{bytes} {discoveries} {most}");
        }
    }

    #[test]
    fn it_is_whole_when_the_last_message_came_in_whatever_order() {
        let (all, parcel) = parcel(1003, 70, 10);
        let messages: Vec<_> = parcel.messages(Kind::Discoveries, 7, 0).collect();
        let others: Vec<_> = parcel.messages(Kind::Discoveries, 8, 0).collect();
        let mut arriving = Arriving::default();
        for i in [3, 0, 6, 1, 5, 2] {
            for message in [&messages[i], &others[i]] {
                assert!(arriving.take(&Cargo::decode(message).expect("understood")).is_none());
            }
        }
        let last = arriving.take(&Cargo::decode(&messages[4]).expect("understood"));
        let last = last.expect("whole");
        assert_eq!(&*last.bytes(), &all[..]);
        // Who passes it on cuts it as it came.
        assert_eq!(last.messages(Kind::Discoveries, 7, 0).collect::<Vec<_>>(), messages);
    }
}
