//! Messages and bytes that a rank sent to other ranks, by kind.

use super::message::PayloadKind;
use serde::{Deserialize, Serialize};

/// Number and size of the messages of one kind.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sent {
    /// Number of messages.
    pub messages: u64,
    /// Bytes of the messages, without MPI's own headers.
    pub bytes: u64,
}

/// Messages sent, by kind: the scene before the first frame, the other kinds while rendering. The names
/// are those of `sent` in `--stats`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Traffic {
    /// The scene, from the rank that read it to the other ranks of the node.
    pub scene: Sent,
    /// Control messages: assignments and reports.
    pub notes: Sent,
    /// References of policy `surface`, to the ranks whose frames take them.
    pub references: Sent,
    /// Discoveries of policy `colour`, to all ranks.
    pub discoveries: Sent,
    /// Strips of frames that several ranks rendered together.
    pub strips: Sent,
}

impl Traffic {
    /// Counts a scene of `bytes` sent to one rank.
    pub(super) fn scene(&mut self, bytes: usize) {
        self.scene.count(bytes);
    }

    /// Counts a control message.
    pub(super) fn message(&mut self, bytes: usize) {
        self.notes.count(bytes);
    }

    /// Counts a payload.
    pub(super) fn payload(&mut self, kind: PayloadKind, bytes: usize) {
        match kind {
            PayloadKind::Reference => self.references.count(bytes),
            PayloadKind::Discoveries => self.discoveries.count(bytes),
            PayloadKind::Strip => self.strips.count(bytes),
        }
    }

    /// Traffic since `before`. The scene, sent earlier, is kept whole.
    pub(super) fn since(&self, before: &Self) -> Self {
        Self {
            scene: self.scene,
            notes: self.notes.since(before.notes),
            references: self.references.since(before.references),
            discoveries: self.discoveries.since(before.discoveries),
            strips: self.strips.since(before.strips),
        }
    }
}

impl Sent {
    fn count(&mut self, bytes: usize) {
        self.messages += 1;
        self.bytes += bytes as u64;
    }

    fn since(self, before: Self) -> Self {
        Self { messages: self.messages - before.messages, bytes: self.bytes - before.bytes }
    }
}
