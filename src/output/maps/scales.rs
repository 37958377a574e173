//! What is black and what is white in maps.

use crate::scene::{Policy, Settings};

/// The maps that a job's frames can have, and the figures that are painted black and white.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapScales {
    /// The distance that is white, in the unit of [`Provenance::distance`](crate::film::Provenance::distance); `None` where nothing is inferred.
    pub farthest: Option<f32>,
    /// The least and the most camera samples of a pixel; `None` where all pixels take as many.
    pub samples: Option<[u32; 2]>,
}

impl MapScales {
    /// The scales of a job's frames.
    pub fn of(settings: &Settings) -> Self {
        Self {
            farthest: (settings.reuse.policy != Policy::Off).then(|| settings.reuse.farthest()),
            samples: settings.most_spp.map(|most| [settings.spp, most]),
        }
    }

    /// Where `count` camera samples lie from the least, 0, to the most, 1, by their logarithms: the error falls with
    /// the ratio of the counts.
    pub(super) fn share_of(self, count: u32) -> f32 {
        let Some([least, most]) = self.samples else { return 0.0 };
        let log = |n: u32| libm::log2f(n.max(1) as f32);
        (log(count) - log(least)) / (log(most) - log(least)).max(f32::MIN_POSITIVE)
    }
}
