//! What ranks send each other: notes, which are short, and cargo, which is not.

use super::board::{Errand, Order};
use crate::error::{Error, Result};
use crate::sequence::FrameReport;
use serde::{Deserialize, Serialize};

/// A note.
#[derive(Debug, Serialize, Deserialize)]
pub enum Note {
    /// To rank 0: these frames are finished.
    Wrote(Vec<FrameReport>),
    /// To rank 0: this order is done.
    Done { order: Order, reports: Vec<FrameReport>, seconds: f64 },
    /// From rank 0: what to do next.
    Do(Errand),
    /// From rank 0: send what this original left to that rank.
    Send { original: u32, to: u32 },
    /// Somebody was asked to stop: to rank 0, and from there to all.
    Stop,
    /// From rank 0: all is made.
    End,
}

/// What a cargo is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Kind {
    /// What a frame left, for frames that are made of it.
    Reference,
    /// The same, to all ranks whether they need it or not.
    Discoveries,
    /// A strip of a frame.
    Strip,
}

/// Bytes for another rank's maker.
#[derive(Debug, Clone, PartialEq)]
pub struct Cargo {
    pub kind: Kind,
    pub original: u32,
    /// Of a strip.
    pub number: u32,
    /// Empty where there was nothing to send.
    pub bytes: Vec<u8>,
}

/// Bytes in front of a cargo's own.
const HEAD: usize = 12;

impl Cargo {
    /// As it travels.
    pub fn encode(kind: Kind, original: u32, number: u32, bytes: &[u8]) -> Vec<u8> {
        let mut all = Vec::with_capacity(HEAD + bytes.len());
        for word in [kind as u32, original, number] {
            all.extend(word.to_le_bytes());
        }
        all.extend(bytes);
        all
    }

    /// What [`encode`](Self::encode) made.
    pub fn decode(all: &[u8]) -> Result<Self> {
        let wrong = || Error::Failed("cannot understand another rank's cargo".into());
        let (head, bytes) = all.split_at_checked(HEAD).ok_or_else(wrong)?;
        let word = |i: usize| head[4 * i..4 * i + 4].try_into().map_or(0, u32::from_le_bytes);
        let kinds = [Kind::Reference, Kind::Discoveries, Kind::Strip];
        let kind = *kinds.get(word(0) as usize).ok_or_else(wrong)?;
        Ok(Self { kind, original: word(1), number: word(2), bytes: bytes.to_vec() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cargo_arrives_as_it_was_sent() {
        for kind in [Kind::Reference, Kind::Discoveries, Kind::Strip] {
            let cargo = Cargo { kind, original: 70_000, number: 3, bytes: vec![1, 2] };
            let sent = Cargo::encode(kind, cargo.original, cargo.number, &cargo.bytes);
            assert_eq!(Cargo::decode(&sent).expect("understood"), cargo);
        }
        assert!(Cargo::decode(&[0; 11]).is_err() && Cargo::decode(&[9; 12]).is_err());
    }
}
