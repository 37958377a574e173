//! Patches of frames at their full size, traced alone: what a whole frame's error is told from.
//!
//! A small picture will not do in their place: the smaller, the more of it is edges.

use super::errors::displayed_rgb;
use super::stage::Stage;
use crate::effects::EffectPlan;
use crate::error::{Error, Result};
use crate::film::{Encoding, Image};
use crate::math::Rgb;
use crate::sampling::mix;
use crate::scene::Settings;
use crate::shade::Renderer;

/// Square patches, one in each cell of a grid over the frame.
#[derive(Debug, Clone)]
pub struct Patches {
    edge: u32,
    frames: Vec<(u32, Vec<(u32, u32)>)>,
}

/// The patches of each frame, as displayed: one image a patch.
pub type Seen = Vec<Vec<Image>>;

impl Patches {
    /// About `pixels` pixels of each of `frames`, in patches of `edge` pixels at places that `lot`
    /// draws.
    pub fn new(settings: &Settings, frames: &[u32], edge: u32, pixels: u32, lot: u64) -> Self {
        let edge = edge.min(settings.width).min(settings.height);
        let places =
            |frame: &u32| (*frame, places(settings, edge, pixels, mix(lot ^ u64::from(*frame))));
        Self { edge, frames: frames.iter().map(places).collect() }
    }

    /// Traces the patches under `settings`.
    ///
    /// # Errors
    /// [`Error::Stopped`]; those of cameras.
    pub fn trace(&self, stage: &Stage, settings: &Settings) -> Result<Seen> {
        let plan = EffectPlan::of(stage.scene, settings);
        let renderer =
            Renderer { scene: stage.scene, settings, plan, intersector: stage.intersector };
        let one = |(frame, corners): &(u32, Vec<(u32, u32)>)| {
            let camera = stage.shot.camera(*frame, settings.width, settings.height)?;
            let places: Vec<(u32, u32)> = corners.iter().flat_map(|c| self.pixels(*c)).collect();
            let trace = || renderer.render_scattered(&camera, *frame, &places, stage.stop);
            let (rgb, _) = stage.pool.install(trace).ok_or(Error::Stopped)?;
            Ok(self.cut(&displayed_rgb(&rgb, settings)))
        };
        self.frames.iter().map(one).collect()
    }

    /// The patches of whole images of the frames, which `image` gives as displayed.
    ///
    /// # Errors
    /// Those of `image`.
    pub fn of_images(&self, image: &dyn Fn(u32) -> Result<Image>) -> Result<Seen> {
        let one = |(frame, corners): &(u32, Vec<(u32, u32)>)| {
            let image = image(*frame)?;
            let at = |(x, y): (u32, u32)| image.rgb[(y * image.width + x) as usize];
            let rgb: Vec<Rgb> = corners.iter().flat_map(|c| self.pixels(*c)).map(at).collect();
            Ok(self.cut(&rgb))
        };
        self.frames.iter().map(one).collect()
    }

    fn pixels(&self, (x, y): (u32, u32)) -> impl Iterator<Item = (u32, u32)> + use<> {
        let edge = self.edge;
        (0..edge * edge).map(move |i| (x + i % edge, y + i / edge))
    }

    fn cut(&self, rgb: &[Rgb]) -> Vec<Image> {
        let (width, height) = (self.edge, self.edge);
        let image =
            |rgb: &[Rgb]| Image { width, height, rgb: rgb.to_vec(), encoding: Encoding::Srgb };
        rgb.chunks((self.edge * self.edge) as usize).map(image).collect()
    }
}

fn places(settings: &Settings, edge: u32, pixels: u32, lot: u64) -> Vec<(u32, u32)> {
    let (width, height) = (settings.width, settings.height);
    let wanted = f64::from(pixels) / f64::from(edge * edge);
    let columns = (wanted * f64::from(width) / f64::from(height)).sqrt().round() as u32;
    let columns = columns.clamp(1, width / edge);
    let rows = ((wanted / f64::from(columns)).round() as u32).clamp(1, height / edge);
    let place = |k: u32, cells: u32, length: u32, random: u64| {
        let (from, to) = (length * k / cells, length * (k + 1) / cells);
        from + (random % u64::from(to - from - edge + 1)) as u32
    };
    let cells = (0..rows * columns).map(|cell| {
        let random = mix(lot ^ u64::from(cell));
        let x = place(cell % columns, columns, width, random);
        (x, place(cell / columns, rows, height, random >> 32))
    });
    cells.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patches_lie_in_the_picture_apart_and_are_as_many_as_wanted() {
        for (width, height, edge, pixels) in
            [(640, 360, 1, 3000), (37, 91, 8, 2000), (16, 9, 1, 3000), (5, 7, 64, 100)]
        {
            let settings = Settings { width, height, ..Settings::default() };
            let patches = Patches::new(&settings, &[1, 9], edge, pixels, 3);
            let (_, corners) = &patches.frames[0];
            let all = || corners.iter().flat_map(|c| patches.pixels(*c));
            assert!(all().all(|(x, y)| x < width && y < height), "{width}x{height}");
            let distinct: std::collections::BTreeSet<_> = all().collect();
            assert_eq!(distinct.len(), all().count(), "{width}x{height}");
            let most = f64::from(pixels.min(width * height));
            assert!(distinct.len() as f64 > 0.4 * most, "{} of {most}", distinct.len());
            assert_ne!(patches.frames[0].1.len(), 0);
        }
    }
}
