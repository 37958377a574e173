//! Exchange of discoveries between ranks: those of every frame go to all ranks.

use super::ColourMaker;
use crate::error::Result;
use crate::sequence::{Exported, RankMaker};
use std::sync::Arc;

impl RankMaker for ColourMaker<'_> {
    fn hold(&self, representative: u32) {
        self.known.lock().hold(&self.schedule, representative);
    }

    fn release(&self, representative: u32) {
        self.known.lock().release(&self.schedule, representative);
    }

    fn make_reference(&self, representative: u32) -> Result<()> {
        self.known(representative).map(drop)
    }

    fn export(&self, representative: u32) -> Option<Exported> {
        let known = self.known.lock().get(representative).cloned()?;
        let bytes = self.context.pool.install(|| known.encode())?.into();
        Some(Exported { bytes, discoveries: known.entries.len() as u64 })
    }

    fn import(&self, representative: u32, bytes: &[u8]) {
        let Some(known) = self.decode(representative, bytes) else { return };
        let mut pool = self.known.lock();
        pool.import(representative, Arc::new(known));
        pool.note_memory(|known, _| known.memory());
    }
}
