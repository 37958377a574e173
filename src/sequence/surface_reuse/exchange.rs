//! References, encoded as in exr files, and strips of frames between ranks.

use super::{SurfaceReuse, memory};
use crate::error::Result;
use crate::reuse::store;
use crate::sequence::strips::{self, Strip};
use crate::sequence::{Exported, RankMaker};
use std::path::Path;
use std::sync::Arc;

impl RankMaker for SurfaceReuse<'_> {
    fn hold(&self, original: u32) {
        self.references.lock().hold(&self.schedule, original);
    }

    fn release(&self, original: u32) {
        self.references.lock().release(&self.schedule, original);
    }

    fn make_reference(&self, original: u32) -> Result<()> {
        self.reference(original).map(drop)
    }

    fn export(&self, original: u32) -> Option<Exported> {
        let mut pool = self.references.lock();
        let bytes = pool.take_export(original)?;
        Some(Exported { bytes, discoveries: pool.get(original)?.len() as u64 })
    }

    /// Bytes that are no reference are as good as none: the frame that needs it makes it.
    fn import(&self, original: u32, bytes: &[u8]) {
        let Some(terms) = &self.exchange else { return };
        let recentring = &self.context.renderer.scene.recentring;
        let pixels = self.context.renderer.settings.pixel_count();
        let decode = || store::decode(Path::new("another rank"), bytes, terms, recentring, pixels);
        if let Ok((mut reference, _)) = self.context.pool.install(decode) {
            reference.frame = original;
            let mut pool = self.references.lock();
            pool.import(original, Arc::new(reference));
            pool.note_memory(memory);
        }
    }

    fn render_strip(&self, original: u32, strip: Strip) -> Result<Vec<u8>> {
        let mask = strips::mask(strip, self.context.renderer.settings);
        self.references.lock().expect(&self.schedule, &[original]);
        let rendered = self.rendered(original, strip.is_source, Some(&mask), &());
        self.references.lock().done(&self.schedule, original);
        strips::encode(rendered?, strip)
    }

    fn join_strips(&self, original: u32, strips: &[Arc<[u8]>]) -> Result<()> {
        self.joined.join(original, strips, self.context.renderer.settings)
    }
}
