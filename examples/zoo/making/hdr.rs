//! Images of skies in Radiance's format (Ward, 1991), uncompressed.

use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Columns and rows.
const SIZE: [usize; 2] = [512, 256];

/// A sky of the colours of zenith, horizon and ground, with a lamp of the last colour towards `to_lamp`, which is that much of a
/// radian wide. Small lamps are brighter.
pub fn sky([zenith, horizon, ground, lamp]: [DVec3; 4], to_lamp: DVec3, width: f64) -> Vec<u8> {
    let [columns, rows] = SIZE;
    let mut bytes =
        format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {rows} +X {columns}\n").into_bytes();
    let lamp = lamp * (0.1 / width).powi(2).clamp(0.02, 50.0);
    for row in 0..rows {
        let (level, y) = (PI * (row as f64 + 0.5) / rows as f64).sin_cos();
        for column in 0..columns {
            let (sin, cos) = (TAU * ((column as f64 + 0.5) / columns as f64 - 0.5)).sin_cos();
            let d = DVec3::new(level * sin, y, -level * cos);
            let plain = horizon.lerp(if y < 0.0 { ground } else { zenith }, y.abs());
            let is_lamp = d.dot(to_lamp) > width.max(0.012).cos();
            bytes.extend(rgbe(if is_lamp { plain + lamp } else { plain }));
        }
    }
    bytes
}

/// A colour as three mantissas and an exponent.
fn rgbe(colour: DVec3) -> [u8; 4] {
    let most = colour.max_element();
    let exponent = most.log2().floor() as i32 + 1;
    let scale = 256.0 / f64::from(exponent).exp2();
    // Three ones would begin a run.
    let [r, g, b] = (colour * scale).to_array().map(|c| c.clamp(2.0, 255.0) as u8);
    [r, g, b, (exponent + 128).clamp(1, 255) as u8]
}
