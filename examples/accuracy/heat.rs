//! The default's frame beside the map of its errors.

use crate::sweep::{ROOT, Sweep};
use image::{RgbImage, imageops};
use tweenray::film::Image;
use tweenray::output::read_image;

/// Display steps at which the map is white.
pub const FULL: f32 = 16.0;
/// The picture is enlarged up to about this width.
const LEAST: u32 = 560;
/// White pixels between the two.
const GAP: u32 = 6;

/// Black through violet and orange to a light yellow, as on the page.
const STOPS: [[f32; 3]; 5] = [
    [0.0, 0.0, 0.0],
    [89.0, 13.0, 153.0],
    [217.0, 51.0, 102.0],
    [255.0, 166.0, 26.0],
    [255.0, 255.0, 204.0],
];

/// Writes `docs/pictures/accuracy-NAME.png`: the frame, and by how much its worst channel is off.
pub fn write(sweep: &Sweep) {
    let frame = read_image(sweep.folder.join("sweep/setting_000.png")).unwrap();
    let truth = reference(sweep);
    assert_eq!((frame.width, frame.height), (truth.width, truth.height));
    let mut out = RgbImage::from_pixel(2 * frame.width + GAP, frame.height, image::Rgb([255; 3]));
    for (i, (a, b)) in (0..).zip(frame.rgb.iter().zip(&truth.rgb)) {
        let (x, y) = (i % frame.width, i / frame.width);
        let level = |v: f32| (v * 255.0 + 0.5).clamp(0.0, 255.0) as u8;
        out.put_pixel(x, y, image::Rgb(a.to_array().map(level)));
        let off = 255.0 * (*a - *b).abs().max_element();
        out.put_pixel(x + frame.width + GAP, y, image::Rgb(heat(off / FULL)));
    }
    // Small frames would hardly be seen; pixels stay pixels.
    let times = (LEAST / out.width()).max(1);
    let (width, height) = (out.width() * times, out.height() * times);
    let out = imageops::resize(&out, width, height, imageops::FilterType::Nearest);
    out.save(format!("{ROOT}/docs/pictures/accuracy-{}.png", sweep.name)).unwrap();
}

/// The reference's frame of the same number, display values.
fn reference(sweep: &Sweep) -> Image {
    let frames = sweep.json["frames"].as_array().unwrap();
    let shown = frames[frames.len() / 2].as_u64().unwrap();
    let begins = format!("reference_{shown:04}_");
    let entries = std::fs::read_dir(sweep.folder.join("sweep")).unwrap().flatten();
    let found = entries
        .map(|entry| entry.path())
        .find(|path| path.file_name().unwrap().to_string_lossy().starts_with(&begins));
    read_image(found.expect("a reference")).unwrap()
}

fn heat(share: f32) -> [u8; 3] {
    let place = share.clamp(0.0, 1.0) * 4.0;
    let low = (place as usize).min(3);
    let mix = |c: usize| STOPS[low][c] + (place - low as f32) * (STOPS[low + 1][c] - STOPS[low][c]);
    [0, 1, 2].map(|c| mix(c) as u8)
}
