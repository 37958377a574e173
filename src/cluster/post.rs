//! What a rank sends to others and gets from them while frames are made; nothing of it waits.

use super::note::Kind;
use super::parcel::Parcel;
use super::traffic::Traffic;
use super::{Ranks, World};
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

impl World {
    /// What stands for so many discoveries, as it will travel.
    pub(super) fn parcel(&self, bytes: Arc<[u8]>, discoveries: u64) -> Parcel {
        Parcel::cut(bytes, discoveries, self.exchange.get())
    }

    /// Sends a note to rank `to` without waiting for it to be read.
    pub(super) fn post<T: Serialize>(&self, to: u32, note: &T) -> Result<()> {
        let bytes = encode(note)?;
        self.count(|sent| sent.note(bytes.len()));
        self.send(to, false, bytes.into())
    }

    /// Sends a parcel to the ranks `to` without waiting for it to be taken in.
    pub(super) fn ship(
        &self,
        to: &[u32],
        kind: Kind,
        original: u32,
        number: u32,
        parcel: &Parcel,
    ) -> Result<()> {
        for bytes in parcel.messages(kind, original, number) {
            // One copy for all of them.
            let bytes: Arc<[u8]> = bytes.into();
            for rank in to {
                self.count(|sent| sent.cargo(kind, bytes.len()));
                self.send(*rank, true, Arc::clone(&bytes))?;
            }
        }
        Ok(())
    }

    pub(super) fn count(&self, count: impl FnOnce(&mut Traffic)) {
        let mut sent = self.sent.get();
        count(&mut sent);
        self.sent.set(sent);
    }

    /// What this rank sent while rendering, so far.
    pub(super) fn sent(&self) -> Traffic {
        self.sent.get()
    }

    fn send(&self, to: u32, is_cargo: bool, bytes: Arc<[u8]>) -> Result<()> {
        match &self.ranks {
            // There is nobody to send to.
            Ranks::Solo => {
                _ = (to, is_cargo, bytes);
                Ok(())
            }
            #[cfg(feature = "mpi")]
            Ranks::Mpi(session) => session.post(to, is_cargo, bytes),
        }
    }

    /// The notes that have arrived for this rank since it last asked, with their senders.
    pub(super) fn notes<T: for<'de> Deserialize<'de>>(&self) -> Result<Vec<(u32, T)>> {
        let notes: Vec<(u32, Vec<u8>)> = match &self.ranks {
            Ranks::Solo => Vec::new(),
            #[cfg(feature = "mpi")]
            Ranks::Mpi(session) => session.arrived(false),
        };
        notes.iter().map(|(from, bytes)| Ok((*from, decode(bytes)?))).collect()
    }

    /// The cargo that has arrived for this rank since it last asked.
    pub(super) fn cargo(&self) -> Vec<Vec<u8>> {
        match &self.ranks {
            Ranks::Solo => Vec::new(),
            #[cfg(feature = "mpi")]
            Ranks::Mpi(session) => {
                session.arrived(true).into_iter().map(|(_, bytes)| bytes).collect()
            }
        }
    }

    /// Whether something is still on its way to others.
    pub(super) fn is_sending(&self) -> bool {
        match &self.ranks {
            Ranks::Solo => false,
            #[cfg(feature = "mpi")]
            Ranks::Mpi(session) => session.is_sending(),
        }
    }
}

pub(super) fn encode<T: Serialize>(value: &T) -> Result<Vec<u8>> {
    serde_json::to_vec(value).map_err(|e| Error::Failed(format!("cannot tell other ranks: {e}")))
}

pub(super) fn decode<T: for<'de> Deserialize<'de>>(bytes: &[u8]) -> Result<T> {
    serde_json::from_slice(bytes)
        .map_err(|e| Error::Failed(format!("cannot understand another rank: {e}")))
}
