//! The effects of the gallery do what its page says, and the page is that of the scenes.

#![allow(clippy::unwrap_used, missing_docs)]

#[path = "../examples/gallery/assets.rs"]
mod assets;
#[path = "../examples/gallery/effect.rs"]
mod effect;
#[allow(dead_code)]
#[path = "../examples/gallery/frame.rs"]
mod frame;

use effect::{EFFECTS, Effect};
use frame::Frame;
use std::path::Path;
use tweenray::math::Rgb;
use tweenray::stats::RayKind;

/// Effects whose pictures are the same as without: they save time.
const SAME: [&str; 1] = ["many-lights"];

fn effects() -> Vec<Effect> {
    EFFECTS.iter().map(|(name, text)| Effect::read(name, text)).collect()
}

/// Frames of 64 x 36 pixels, by the mean over all pixels of how far radiance, cut at 1, is apart; where they are the same but for
/// noise, by the mean of all.
#[test]
fn each_effect_changes_its_frame() {
    let folder = tempfile::tempdir().unwrap();
    assets::write(folder.path());
    for effect in effects() {
        let films = [&effect.with, &effect.without].map(|text| {
            let frame = Frame::of_size(folder.path(), text, (64, 36));
            let (film, rays, _) = frame.render(4);
            assert_eq!(rays[RayKind::Invalid], 0, "{}", effect.name);
            assert!(film.rgb.iter().all(|rgb| rgb.is_finite()), "{}", effect.name);
            film.rgb
        });
        let means = films.each_ref().map(|rgb| {
            let sum: f64 = rgb.iter().map(|rgb| f64::from(rgb.min(Rgb::ONE).element_sum())).sum();
            sum / (3.0 * rgb.len() as f64)
        });
        if SAME.contains(&effect.name) {
            assert!((means[0] / means[1] - 1.0).abs() < 0.02, "{}: {means:?}", effect.name);
            continue;
        }
        let pairs = films[0].iter().zip(&films[1]);
        let apart =
            pairs.map(|(a, b)| f64::from((a.min(Rgb::ONE) - b.min(Rgb::ONE)).abs().element_sum()));
        let mean = apart.sum::<f64>() / (3.0 * films[0].len() as f64);
        assert!(mean > 0.0015, "{}: {mean} apart", effect.name);
    }
}

#[test]
fn the_page_shows_every_effect_with_its_lines_and_a_small_picture() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let page = std::fs::read_to_string(docs.join("gallery.md")).unwrap();
    for effect in effects() {
        let told = format!("{}: run ./x gallery", effect.name);
        assert!(page.contains(&format!("\n## {}\n", effect.title)), "{told}");
        assert!(page.contains(&effect.about) && page.contains(&effect.lines), "{told}");
        assert!(!effect.lines.is_empty() && effect.with != effect.without, "{}", effect.name);
        let picture = docs.join("pictures").join(effect.picture());
        let size = std::fs::metadata(&picture).expect(&told).len();
        assert!(size < 60_000, "{}: {size} bytes", effect.name);
    }
    let shown = page.matches("](pictures/gallery-").count();
    assert_eq!(shown, EFFECTS.len(), "run ./x gallery");
}
