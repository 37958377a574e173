//! Discoveries on disk, for a job that goes on after this one: of all frames that frames to come need.
//! These are few, about as many as the shot's length has binary digits. A rank puts there what it made
//! itself.

use super::{ColourMaker, exchange};
use crate::reuse::colour::KnownColours;
use crate::sequence::checkpoint::Checkpoints;
use crate::sequence::saved::{Keeps, Saved};
use std::sync::Arc;

impl ColourMaker<'_> {
    /// What `frame` discovered in an earlier run, where that left it.
    pub(super) fn left_on_disk(&self, frame: u32) -> Option<Arc<KnownColours>> {
        let bytes = self.checkpoints?.read_bytes(frame)?;
        let known = exchange::decode(frame, &bytes)?;
        self.with_state(|s| s.saved.found(frame));
        Some(self.keep(known))
    }
}

impl Keeps for ColourMaker<'_> {
    type Left = Arc<KnownColours>;

    fn checkpoints(&self) -> Option<&Checkpoints<'_>> {
        self.checkpoints
    }

    fn with_saved<R>(
        &self,
        act: impl FnOnce(&mut Saved<Arc<KnownColours>>, &dyn Fn(u32) -> bool) -> R,
    ) -> R {
        self.with_state(|s| act(&mut s.saved, &|frame| s.known.contains_key(&frame)))
    }

    fn bytes(&self, known: &Arc<KnownColours>) -> Option<Arc<[u8]>> {
        self.pool.install(|| exchange::encode(known)).ok().map(Into::into)
    }
}
