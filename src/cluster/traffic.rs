//! What a rank sent to others, by kind.

use super::note::Kind;
use serde::{Deserialize, Serialize};

/// Messages of one kind.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sent {
    /// How many.
    pub messages: u64,
    /// Their bytes, without what MPI adds.
    pub bytes: u64,
}

/// Messages sent: the scene before the first frame, the others while rendering.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Traffic {
    /// The scene as it was read, to the other ranks of the node.
    pub scene: Sent,
    /// Orders, reports and the like.
    pub notes: Sent,
    /// References of policy `surface`, to ranks that need them.
    pub references: Sent,
    /// Discoveries of policy `colour`, to all ranks.
    pub discoveries: Sent,
    /// Strips of frames that several ranks made together.
    pub strips: Sent,
}

impl Traffic {
    /// The scene to one more rank.
    pub fn scene(&mut self, bytes: usize) {
        self.scene.count(bytes);
    }

    /// One more note.
    pub fn note(&mut self, bytes: usize) {
        self.notes.count(bytes);
    }

    /// One more cargo.
    pub fn cargo(&mut self, kind: Kind, bytes: usize) {
        match kind {
            Kind::Reference => self.references.count(bytes),
            Kind::Discoveries => self.discoveries.count(bytes),
            Kind::Strip => self.strips.count(bytes),
        }
    }

    /// What was sent since it stood at `before`, and the scene.
    pub fn since(&self, before: &Self) -> Self {
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
