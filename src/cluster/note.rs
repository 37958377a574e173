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
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Kind {
    /// What a frame left, for frames that are made of it.
    Reference,
    /// The same, to all ranks whether they need it or not.
    Discoveries,
    /// A strip of a frame.
    Strip,
}

/// Bytes for another rank's maker, or a piece of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cargo<'a> {
    pub kind: Kind,
    pub original: u32,
    /// Of a strip.
    pub number: u32,
    /// Which piece, from 0.
    pub piece: u32,
    /// How many pieces there are.
    pub of: u32,
    /// Empty where there was nothing to send.
    pub bytes: &'a [u8],
}

/// Bytes in front of a cargo's own.
const HEAD: usize = 20;

impl<'a> Cargo<'a> {
    /// As it travels.
    pub fn encode(&self) -> Vec<u8> {
        let mut all = Vec::with_capacity(HEAD + self.bytes.len());
        for word in [self.kind as u32, self.original, self.number, self.piece, self.of] {
            all.extend(word.to_le_bytes());
        }
        all.extend(self.bytes);
        all
    }

    /// What [`encode`](Self::encode) made.
    pub fn decode(all: &'a [u8]) -> Result<Self> {
        let wrong = || Error::Failed("cannot understand another rank's cargo".into());
        let (head, bytes) = all.split_at_checked(HEAD).ok_or_else(wrong)?;
        let word = |i: usize| head[4 * i..4 * i + 4].try_into().map_or(0, u32::from_le_bytes);
        let kinds = [Kind::Reference, Kind::Discoveries, Kind::Strip];
        let kind = *kinds.get(word(0) as usize).ok_or_else(wrong)?;
        let cargo =
            Self { kind, original: word(1), number: word(2), piece: word(3), of: word(4), bytes };
        if cargo.piece < cargo.of { Ok(cargo) } else { Err(wrong()) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::board::What;
    use super::*;

    #[test]
    fn bytes_on_the_wire_keep_their_names() {
        let json = |note: &Note| serde_json::to_string(note).expect("JSON");
        let strip = What::Strip { number: 1, of: 2, leader: 3 };
        let order = Order { task: 4, original: 5, is_source: true, what: strip };
        let done = Note::Done { order, reports: Vec::new(), seconds: 0.5 };
        let expected = concat!(
            r#"{"Done":{"order":{"task":4,"original":5,"is_source":true,"#,
            r#""what":{"Strip":{"number":1,"of":2,"leader":3}}},"reports":[],"seconds":0.5}}"#
        );
        assert_eq!(json(&done), expected);
        let whole = What::Whole { strips: 0, frames: vec![6] };
        let order = Order { task: 4, original: 6, is_source: false, what: whole };
        let errand = Errand { order, needs: vec![1], drops: vec![2] };
        let expected = concat!(
            r#"{"Do":{"order":{"task":4,"original":6,"is_source":false,"#,
            r#""what":{"Whole":{"strips":0,"frames":[6]}}},"needs":[1],"drops":[2]}}"#
        );
        assert_eq!(json(&Note::Do(errand)), expected);
        assert_eq!(json(&Note::Send { original: 1, to: 2 }), r#"{"Send":{"original":1,"to":2}}"#);
        let kind = Kind::Strip;
        let cargo = Cargo { kind, original: 1, number: 3, piece: 4, of: 5, bytes: &[6] };
        let words: Vec<u8> = [2, 1, 3, 4, 5].map(u32::to_le_bytes).concat();
        assert_eq!(cargo.encode(), [words, vec![6]].concat());
    }

    #[test]
    fn cargo_arrives_as_it_was_sent() {
        for kind in [Kind::Reference, Kind::Discoveries, Kind::Strip] {
            let cargo =
                Cargo { kind, original: 70_000, number: 3, piece: 1, of: 2, bytes: &[1, 2] };
            assert_eq!(Cargo::decode(&cargo.encode()).expect("understood"), cargo);
            assert!(Cargo::decode(&Cargo { piece: 2, ..cargo }.encode()).is_err());
        }
        assert!(Cargo::decode(&[0; HEAD - 1]).is_err() && Cargo::decode(&[9; HEAD]).is_err());
    }
}
