//! Message types between ranks: [`Message`] for control, [`Payload`] for references and strips.

use super::scheduler::{Assignment, Task};
use crate::error::{Error, Result};
use crate::sequence::FrameReport;
use serde::{Deserialize, Serialize};

/// A control message, sent as JSON of some hundred bytes.
#[derive(Debug, Serialize, Deserialize)]
pub enum Message {
    /// To rank 0: these frames are written.
    Wrote(Vec<FrameReport>),
    /// To rank 0: this task is done, and its frames will be written; these reports are of frames that are.
    /// (Message bytes keep the key `order`.)
    Done {
        #[serde(rename = "order")]
        task: Task,
        reports: Vec<FrameReport>,
        seconds: f64,
    },
    /// From rank 0: the receiver's next task.
    Do(Assignment),
    /// From rank 0: send the reference of `representative` to rank `to`. (Message bytes keep the key
    /// `original`.)
    Send {
        #[serde(rename = "original")]
        representative: u32,
        to: u32,
    },
    /// A rank was asked to stop: sent to rank 0, and from rank 0 to all ranks.
    Stop,
    /// From rank 0: all tasks are done.
    End,
}

/// What the bytes of a payload are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum PayloadKind {
    /// A reference of policy `surface`, for ranks whose frames take it.
    Reference,
    /// Discoveries of policy `colour`, for all ranks.
    Discoveries,
    /// A rendered strip of a frame.
    Strip,
}

/// One chunk of a reference, of discoveries or of a strip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Payload<'a> {
    pub kind: PayloadKind,
    /// The representative frame that the bytes belong to.
    pub representative: u32,
    /// Number of the strip; 0 for other kinds.
    pub strip: u32,
    /// Number of the chunk, from 0.
    pub chunk: u32,
    /// Number of chunks that belong together.
    pub chunks: u32,
    /// The chunk; empty if the sender had nothing.
    pub bytes: &'a [u8],
}

/// Bytes of the header: five little-endian `u32`.
const HEADER: usize = 20;

impl<'a> Payload<'a> {
    /// Header and bytes.
    pub fn encode(&self) -> Vec<u8> {
        let mut all = Vec::with_capacity(HEADER + self.bytes.len());
        for word in [self.kind as u32, self.representative, self.strip, self.chunk, self.chunks] {
            all.extend(word.to_le_bytes());
        }
        all.extend(self.bytes);
        all
    }

    /// The inverse of [`encode`](Self::encode).
    pub fn decode(all: &'a [u8]) -> Result<Self> {
        let wrong = || Error::Failed("cannot decode another rank's payload".into());
        let (header, bytes) = all.split_at_checked(HEADER).ok_or_else(wrong)?;
        let word = |i: usize| header[4 * i..4 * i + 4].try_into().map_or(0, u32::from_le_bytes);
        let kinds = [PayloadKind::Reference, PayloadKind::Discoveries, PayloadKind::Strip];
        let kind = *kinds.get(word(0) as usize).ok_or_else(wrong)?;
        let (representative, strip, chunk, chunks) = (word(1), word(2), word(3), word(4));
        let payload = Self { kind, representative, strip, chunk, chunks, bytes };
        if chunk < chunks { Ok(payload) } else { Err(wrong()) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::scheduler::Extent;
    use super::*;

    #[test]
    fn bytes_on_the_wire_keep_their_names() {
        let json = |message: &Message| serde_json::to_string(message).expect("JSON");
        let extent = Extent::Strip { number: 1, of: 2, leader: 3 };
        let task = Task { id: 4, representative: 5, is_source: true, extent };
        let done = Message::Done { task, reports: Vec::new(), seconds: 0.5 };
        let expected = concat!(
            r#"{"Done":{"order":{"task":4,"original":5,"is_source":true,"#,
            r#""what":{"Strip":{"number":1,"of":2,"leader":3}}},"reports":[],"seconds":0.5}}"#
        );
        assert_eq!(json(&done), expected);
        let extent = Extent::Whole { strips: 0, frames: vec![6] };
        let task = Task { id: 4, representative: 6, is_source: false, extent };
        let assignment = Assignment { task, needs: vec![1], drops: vec![2] };
        let expected = concat!(
            r#"{"Do":{"order":{"task":4,"original":6,"is_source":false,"#,
            r#""what":{"Whole":{"strips":0,"frames":[6]}}},"needs":[1],"drops":[2]}}"#
        );
        assert_eq!(json(&Message::Do(assignment)), expected);
        let send = Message::Send { representative: 1, to: 2 };
        assert_eq!(json(&send), r#"{"Send":{"original":1,"to":2}}"#);
        let kind = PayloadKind::Strip;
        let payload =
            Payload { kind, representative: 1, strip: 3, chunk: 4, chunks: 5, bytes: &[6] };
        let words: Vec<u8> = [2, 1, 3, 4, 5].map(u32::to_le_bytes).concat();
        assert_eq!(payload.encode(), [words, vec![6]].concat());
    }

    #[test]
    fn a_payload_is_decoded_as_it_was_encoded() {
        for kind in [PayloadKind::Reference, PayloadKind::Discoveries, PayloadKind::Strip] {
            let bytes = &[1, 2];
            let payload =
                Payload { kind, representative: 70_000, strip: 3, chunk: 1, chunks: 2, bytes };
            assert_eq!(Payload::decode(&payload.encode()).expect("decoded"), payload);
            assert!(Payload::decode(&Payload { chunk: 2, ..payload }.encode()).is_err());
        }
        let is_refused = |bytes: &[u8]| Payload::decode(bytes).is_err();
        assert!(is_refused(&[0; HEADER - 1]) && is_refused(&[9; HEADER]));
    }
}
