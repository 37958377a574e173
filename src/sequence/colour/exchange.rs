//! What the colour maker gives to other ranks and takes from them: discoveries, all of them to all.

use super::ColourMaker;
use crate::error::Result;
use crate::math::Rgb;
use crate::reuse::colour::{Entry, KnownColours};
use crate::sequence::shared::{Exported, RankMaker};
use crate::sequence::strips::{pack, unpack};
use serde::{Deserialize, Serialize};

/// A frame's discoveries, column by column, which deflates better.
#[derive(Serialize, Deserialize)]
struct Columns {
    pixels: Vec<u32>,
    rgb: Vec<Rgb>,
    distances: Vec<f32>,
}

impl RankMaker for ColourMaker<'_> {
    fn needs(&self, original: u32) -> Vec<u32> {
        self.pyramid.ancestors(original)
    }

    fn sends_to_all(&self) -> bool {
        true
    }

    fn hold(&self, original: u32) {
        self.with_state(|s| s.held.insert(original));
    }

    fn release(&self, original: u32) {
        self.with_state(|s| {
            s.held.remove(&original);
            s.known.remove(&original);
        });
    }

    fn make_reference(&self, original: u32) -> Result<bool> {
        Ok(self.known(original)?.is_some())
    }

    fn is_on_disk(&self, original: u32) -> bool {
        self.checkpoints.is_some_and(|c| c.has(original))
    }

    fn export(&self, original: u32) -> Option<Exported> {
        let known = self.with_state(|s| s.known.get(&original).cloned())?;
        let bytes = self.pool.install(|| encode(&known)).ok()?.into();
        Some(Exported { bytes, discoveries: known.entries.len() as u64 })
    }

    fn import(&self, original: u32, bytes: &[u8]) {
        let Some(known) = self.pool.install(|| decode(original, bytes)) else { return };
        self.with_state(|s| s.held.insert(original));
        self.keep(known);
    }
}

/// A frame's discoveries as bytes.
pub(super) fn encode(known: &KnownColours) -> Result<Vec<u8>> {
    let entries = || known.entries.iter();
    pack(&Columns {
        pixels: entries().map(|e| e.pixel).collect(),
        rgb: entries().map(|e| e.rgb).collect(),
        distances: entries().map(|e| e.distance).collect(),
    })
}

/// What [`encode`] made bytes of; `None` for other bytes.
pub(super) fn decode(frame: u32, bytes: &[u8]) -> Option<KnownColours> {
    let Columns { pixels, rgb, distances } = unpack::<Columns>(bytes).ok()?;
    let rest = rgb.into_iter().zip(distances);
    let entry = |(pixel, (rgb, distance))| Entry { pixel, rgb, distance };
    Some(KnownColours { frame, entries: pixels.into_iter().zip(rest).map(entry).collect() })
}
