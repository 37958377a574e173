//! Discoveries between ranks: those of every frame go to all ranks.

use super::ColourMaker;
use crate::error::Result;
use crate::sequence::{Exported, RankMaker};
use std::sync::Arc;

impl RankMaker for ColourMaker<'_> {
    fn hold(&self, original: u32) {
        self.known.lock().hold(&self.schedule, original);
    }

    fn release(&self, original: u32) {
        self.known.lock().release(&self.schedule, original);
    }

    fn make_reference(&self, original: u32) -> Result<()> {
        self.known(original).map(drop)
    }

    fn export(&self, original: u32) -> Option<Exported> {
        let known = self.known.lock().get(original).cloned()?;
        let bytes = self.context.pool.install(|| known.encode())?.into();
        Some(Exported { bytes, discoveries: known.entries.len() as u64 })
    }

    fn import(&self, original: u32, bytes: &[u8]) {
        let Some(known) = self.decode(original, bytes) else { return };
        let mut pool = self.known.lock();
        pool.import(original, Arc::new(known));
        pool.note_memory(|known, _| known.memory());
    }
}
