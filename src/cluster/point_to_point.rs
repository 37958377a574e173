//! Point-to-point messages while frames are rendered. No call blocks.

use super::chunks::Chunks;
use super::message::PayloadKind;
use super::traffic::Traffic;
use super::{Backend, Communicator};
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

impl Communicator {
    /// The bytes of `discoveries` discoveries, cut as `--exchange` says.
    pub(super) fn chunks(&self, bytes: Arc<[u8]>, discoveries: u64) -> Chunks {
        Chunks::split(bytes, discoveries, self.exchange.get())
    }

    /// Starts to send a control message to rank `to`.
    pub(super) fn send_message<T: Serialize>(&self, to: u32, message: &T) -> Result<()> {
        let bytes = encode(message)?;
        self.count(|sent| sent.message(bytes.len()));
        self.send(to, false, bytes.into())
    }

    /// Starts to send chunks to the ranks `to`.
    pub(super) fn send_chunks(
        &self,
        to: &[u32],
        kind: PayloadKind,
        representative: u32,
        strip: u32,
        chunks: &Chunks,
    ) -> Result<()> {
        for bytes in chunks.messages(kind, representative, strip) {
            // All receivers share one copy in memory.
            let bytes: Arc<[u8]> = bytes.into();
            for rank in to {
                self.count(|sent| sent.payload(kind, bytes.len()));
                self.send(*rank, true, Arc::clone(&bytes))?;
            }
        }
        Ok(())
    }

    /// Lets `count` add to the messages and bytes that this rank sent.
    pub(super) fn count(&self, count: impl FnOnce(&mut Traffic)) {
        let mut sent = self.sent.get();
        count(&mut sent);
        self.sent.set(sent);
    }

    /// Messages and bytes that this rank sent so far.
    pub(super) fn sent(&self) -> Traffic {
        self.sent.get()
    }

    fn send(&self, to: u32, is_payload: bool, bytes: Arc<[u8]>) -> Result<()> {
        match &self.backend {
            // A single process has no receiver.
            Backend::Single => {
                _ = (to, is_payload, bytes);
                Ok(())
            }
            #[cfg(feature = "mpi")]
            Backend::Mpi(session) => session.send(to, is_payload, bytes),
        }
    }

    /// Control messages received since the last call, with their senders.
    pub(super) fn receive_messages<T: for<'de> Deserialize<'de>>(&self) -> Result<Vec<(u32, T)>> {
        let messages: Vec<(u32, Vec<u8>)> = match &self.backend {
            Backend::Single => Vec::new(),
            #[cfg(feature = "mpi")]
            Backend::Mpi(session) => session.receive(false),
        };
        messages.iter().map(|(from, bytes)| Ok((*from, decode(bytes)?))).collect()
    }

    /// Encoded payloads received since the last call.
    pub(super) fn receive_payloads(&self) -> Vec<Vec<u8>> {
        match &self.backend {
            Backend::Single => Vec::new(),
            #[cfg(feature = "mpi")]
            Backend::Mpi(session) => {
                session.receive(true).into_iter().map(|(_, bytes)| bytes).collect()
            }
        }
    }

    /// Whether a send of this rank is not complete.
    pub(super) fn has_pending_sends(&self) -> bool {
        match &self.backend {
            Backend::Single => false,
            #[cfg(feature = "mpi")]
            Backend::Mpi(session) => session.has_pending_sends(),
        }
    }
}

/// A control message as JSON.
pub(super) fn encode<T: Serialize>(value: &T) -> Result<Vec<u8>> {
    serde_json::to_vec(value)
        .map_err(|e| Error::Failed(format!("cannot encode a message to other ranks: {e}")))
}

/// The inverse of [`encode`].
pub(super) fn decode<T: for<'de> Deserialize<'de>>(bytes: &[u8]) -> Result<T> {
    serde_json::from_slice(bytes)
        .map_err(|e| Error::Failed(format!("cannot decode a message from another rank: {e}")))
}
