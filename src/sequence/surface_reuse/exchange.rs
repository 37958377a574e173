//! What the inferring maker gives to other ranks and takes from them: references, encoded as in exr
//! files, and strips of frames.

use super::SurfaceReuse;
use crate::error::Result;
use crate::reuse::store;
use crate::sequence::shared::{Exported, RankMaker, Strip};
use crate::sequence::strips::{self, NoProgress};
use std::path::Path;
use std::sync::Arc;

impl RankMaker for SurfaceReuse<'_> {
    fn original(&self, frame: u32) -> u32 {
        self.schedule.original(frame)
    }

    fn needs(&self, original: u32) -> Vec<u32> {
        self.schedule.ancestors(original)
    }

    fn rank_batches(&self, originals: &[u32]) -> Vec<Vec<u32>> {
        self.pyramid.rank_batches(originals)
    }

    fn is_on_disk(&self, original: u32) -> bool {
        self.checkpoints.is_some_and(|c| c.has(original))
    }

    fn most_strips(&self) -> u32 {
        strips::most(self.renderer.settings.height)
    }

    fn hold(&self, original: u32) {
        self.with_state(|s| s.references.hold(&self.schedule, original));
    }

    fn release(&self, original: u32) {
        self.with_state(|s| {
            s.exports.remove(&original);
            s.references.release(&self.schedule, original);
        });
    }

    fn make_reference(&self, original: u32) -> Result<bool> {
        Ok(self.reference(original)?.is_some())
    }

    fn export(&self, original: u32) -> Option<Exported> {
        self.with_state(|s| {
            let bytes = s.exports.remove(&original)?;
            let discoveries = s.references.get(original).map_or(0, |r| r.len() as u64);
            Some(Exported { bytes, discoveries })
        })
    }

    /// Bytes that are no reference are as good as none: the frame that needs it makes it.
    fn import(&self, original: u32, bytes: &[u8]) {
        let Some(terms) = &self.exchange else { return };
        let recentring = &self.renderer.scene.recentring;
        let decode = || store::decode(Path::new("another rank"), bytes, terms, recentring);
        if let Ok((mut reference, _)) = self.pool.install(decode) {
            reference.frame = original;
            self.with_state(|s| s.take(original, reference));
        }
    }

    fn render_strip(&self, original: u32, strip: Strip) -> Result<Option<Vec<u8>>> {
        let camera = self.camera(original)?;
        let mask = strips::mask(strip, camera.width, camera.height);
        self.with_state(|s| s.references.expect(&self.schedule, &[original]));
        let rendered = self.rendered(original, strip.is_source, Some(&mask), &NoProgress);
        self.with_state(|s| s.references.done(&self.schedule, original));
        rendered?.map(|rendered| strips::encode(rendered, strip)).transpose()
    }

    fn join_strips(&self, original: u32, strips: &[Arc<[u8]>]) -> Result<()> {
        let settings = self.renderer.settings;
        self.joined.put(original, strips::join(strips, settings.width, settings.height)?);
        Ok(())
    }
}
