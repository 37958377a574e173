//! Pairs of synthetic images that the metrics' tests share.

use crate::film::{Encoding, Image};
use crate::math::Rgb;

/// An image whose every channel is `value`.
pub fn constant(width: u32, height: u32, value: f32) -> Image {
    from_fn(width, height, |_, _| Rgb::splat(value))
}

/// An image of sRGB values from a function of column and row.
pub fn from_fn(width: u32, height: u32, f: impl Fn(u32, u32) -> Rgb) -> Image {
    let rgb = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let rgb = rgb.map(|(x, y)| f(x, y)).collect();
    Image { width, height, rgb, encoding: Encoding::Srgb }
}

/// The image rounded to 8 bits, so that an 8-bit oracle sees the very same values.
pub fn to_8_bit(image: &Image) -> (Image, Vec<u8>) {
    let bytes: Vec<u8> = image
        .rgb
        .iter()
        .flat_map(|c| c.to_array())
        .map(|v| (v * 255.0).round().clamp(0.0, 255.0) as u8)
        .collect();
    let rgb =
        bytes.chunks_exact(3).map(|c| Rgb::from_array([0, 1, 2].map(|i| f32::from(c[i]) / 255.0)));
    (Image { rgb: rgb.collect(), ..image.clone() }, bytes)
}

/// A whole-number hash of pixel and channel as noise in [0, 1).
pub fn noise(x: u32, y: u32, channel: u32) -> f32 {
    let mut h = x.wrapping_mul(0x9E37_79B1)
        ^ y.wrapping_mul(0x85EB_CA77)
        ^ channel.wrapping_mul(0xC2B2_AE3D);
    h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
    h = (h ^ (h >> 12)).wrapping_mul(0x297A_2D39);
    ((h ^ (h >> 15)) >> 8) as f32 / 16_777_216.0
}

/// A coloured picture with edges, ramps and texture.
pub fn scene(width: u32, height: u32) -> Image {
    from_fn(width, height, |x, y| {
        let (u, v) = (x as f32 / width as f32, y as f32 / height as f32);
        let disc = f32::from((u - 0.4).powi(2) + (v - 0.5).powi(2) < 0.07);
        let checks = f32::from((x / 6 + y / 9) % 2 == 0);
        Rgb::new(0.9 * u * (1.0 - disc) + 0.7 * disc, 0.3 + 0.5 * v * checks, 0.8 - 0.7 * u * v)
    })
}

/// Ten pairs of very different kinds: noise, shift, blur, colour cast, inversion, black and white,
/// and what renderers do: lone bright pixels, and errors that a display hardly shows.
pub fn pairs() -> Vec<(&'static str, Image, Image)> {
    let base = scene(97, 64);
    let at = |x: u32, y: u32| base.rgb[(y * 97 + x) as usize];
    let noisy = from_fn(97, 64, |x, y| {
        at(x, y)
            + 0.2 * (Rgb::new(noise(x, y, 0), noise(x, y, 1), noise(x, y, 2)) - Rgb::splat(0.5))
    });
    let shifted = from_fn(97, 64, |x, y| at((x + 2).min(96), y));
    let blurred = from_fn(97, 64, |x, y| {
        (at(x.saturating_sub(1), y) + at(x, y) + at((x + 1).min(96), y)) / 3.0
    });
    let fireflies = from_fn(97, 64, |x, y| match noise(x, y, 7) {
        n if n > 0.99 => Rgb::ONE,
        _ => at(x, y),
    });
    let hardly = from_fn(97, 64, |x, y| {
        let step = if noise(x, y, 3) > 0.5 { 1.0 } else { -1.0 };
        (at(x, y) + Rgb::splat(step / 255.0)).clamp(Rgb::ZERO, Rgb::ONE)
    });
    let cast = from_fn(97, 64, |x, y| at(x, y) * Rgb::new(1.0, 0.9, 0.8));
    let inverted = from_fn(97, 64, |x, y| Rgb::ONE - at(x, y));
    vec![
        ("noise", base.clone(), noisy),
        ("shift", base.clone(), shifted),
        ("blur", base.clone(), blurred),
        ("cast", base.clone(), cast),
        ("fireflies", base.clone(), fireflies),
        ("a display step", base.clone(), hardly),
        ("inversion", base, inverted),
        ("black and white", constant(40, 33, 0.0), constant(40, 33, 1.0)),
        ("green and blue", from_fn(23, 19, |_, _| Rgb::Y), from_fn(23, 19, |_, _| Rgb::Z)),
        ("smaller than the filters", scene(7, 5), constant(7, 5, 0.4)),
    ]
}
