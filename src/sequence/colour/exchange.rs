//! What the colour maker gives to other ranks and takes from them: discoveries, all of them to all.

use super::ColourMaker;
use crate::error::Result;
use crate::math::Rgb;
use crate::reuse::colour::{Entry, Known};
use crate::sequence::shared::Shared;
use crate::sequence::strips::{pack, unpack};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A frame's discoveries, column by column, which deflates better.
#[derive(Serialize, Deserialize)]
struct Columns {
    pixels: Vec<u32>,
    rgb: Vec<Rgb>,
    distances: Vec<f32>,
}

impl Shared for ColourMaker<'_> {
    fn needs(&self, original: u32) -> Vec<u32> {
        self.pyramid.ancestors(original)
    }

    fn tells_all(&self) -> bool {
        true
    }

    fn hold(&self, original: u32) {
        self.with_state(|s| s.held.insert(original));
    }

    fn let_go(&self, original: u32) {
        self.with_state(|s| {
            s.held.remove(&original);
            s.known.remove(&original);
        });
    }

    fn make_source(&self, original: u32) -> Result<bool> {
        Ok(self.known(original)?.is_some())
    }

    fn export(&self, original: u32) -> Option<Arc<[u8]>> {
        let known = self.with_state(|s| s.known.get(&original).cloned())?;
        let entries = || known.entries.iter();
        let columns = Columns {
            pixels: entries().map(|e| e.pixel).collect(),
            rgb: entries().map(|e| e.rgb).collect(),
            distances: entries().map(|e| e.distance).collect(),
        };
        pack(&columns).ok().map(Into::into)
    }

    fn import(&self, original: u32, bytes: &[u8]) {
        let Ok(Columns { pixels, rgb, distances }) = unpack::<Columns>(bytes) else { return };
        let rest = rgb.into_iter().zip(distances);
        let entry = |(pixel, (rgb, distance))| Entry { pixel, rgb, distance };
        let entries = pixels.into_iter().zip(rest).map(entry).collect();
        self.with_state(|s| s.held.insert(original));
        self.keep(Known { frame: original, entries });
    }
}
