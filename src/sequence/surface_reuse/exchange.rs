//! References, encoded as in exr files, and strips of frames between ranks.

use super::{SurfaceReuse, memory};
use crate::error::Result;
use crate::reuse::store;
use crate::sequence::strips::{self, Strip};
use crate::sequence::{Exported, RankMaker};
use std::path::Path;
use std::sync::Arc;

impl RankMaker for SurfaceReuse<'_> {
    fn hold(&self, representative: u32) {
        self.references.lock().hold(&self.schedule, representative);
    }

    fn release(&self, representative: u32) {
        self.references.lock().release(&self.schedule, representative);
    }

    fn make_reference(&self, representative: u32) -> Result<()> {
        self.reference(representative).map(drop)
    }

    fn export(&self, representative: u32) -> Option<Exported> {
        let mut pool = self.references.lock();
        let bytes = pool.take_export(representative)?;
        Some(Exported { bytes, discoveries: pool.get(representative)?.len() as u64 })
    }

    /// Bytes that cannot be decoded are ignored: the frame that needs the reference makes it.
    fn import(&self, representative: u32, bytes: &[u8]) {
        let Some(terms) = &self.exchange else { return };
        let recentring = &self.context.renderer.scene.recentring;
        let pixels = self.context.renderer.settings.pixel_count();
        let decode = || store::decode(Path::new("another rank"), bytes, terms, recentring, pixels);
        if let Ok((mut reference, _)) = self.context.pool.install(decode) {
            reference.frame = representative;
            let mut pool = self.references.lock();
            pool.import(representative, Arc::new(reference));
            pool.note_memory(memory);
        }
    }

    fn render_strip(&self, representative: u32, strip: Strip) -> Result<Vec<u8>> {
        let mask = strips::mask(strip, self.context.renderer.settings);
        self.references.lock().expect(&self.schedule, &[representative]);
        let rendered = self.rendered(representative, strip.is_source, Some(&mask), &());
        self.references.lock().done(&self.schedule, representative);
        strips::encode(rendered?, strip)
    }

    fn join_strips(&self, representative: u32, strips: &[Arc<[u8]>]) -> Result<()> {
        self.joined.join(representative, strips, self.context.renderer.settings)
    }
}
