//! What samples of an environment find.

use crate::math::Rgb;

/// Buffers of samples.
#[derive(Default)]
pub(super) struct EnvironmentScratch {
    pub u: Vec<[f32; 2]>,
    pub found: Vec<FoundSky>,
}

/// What rays from a shading point have found.
#[derive(Debug, Clone, Copy)]
pub(super) struct FoundSky {
    /// The point's number in the chunk.
    pub point: u32,
    pub rays: u32,
    /// Weights of the rays that reached the environment, and of all.
    pub open: Rgb,
    pub all: Rgb,
}

impl FoundSky {
    /// The part of each colour that arrives. Of a colour that no ray has found, as of all together.
    pub fn ratio(&self) -> Rgb {
        let together = self.open.element_sum() / self.all.element_sum();
        let part = |open: f32, all: f32| if all > 0.0 { open / all } else { together };
        let (open, all) = (self.open, self.all);
        Rgb::new(part(open.x, all.x), part(open.y, all.y), part(open.z, all.z))
    }
}
