//! Texture lookups.

use crate::math::{Rgb, Vec2};
use crate::scene::Texture;

/// Bilinear lookup, repeating; `(0, 0)` is the image's lower left corner.
pub(super) fn bilinear(texture: &Texture, uv: Vec2) -> Rgb {
    let (x0, x1, fx) = texels(repeat(uv.x), texture.width);
    let (y0, y1, fy) = texels(repeat(1.0 - uv.y), texture.height);
    let at = |x: usize, y: usize| texture.texels[y * texture.width as usize + x];
    let upper = at(x0, y0).lerp(at(x1, y0), fx);
    let lower = at(x0, y1).lerp(at(x1, y1), fx);
    upper.lerp(lower, fy)
}

/// The two texels of `n` in a row between whose middles `u` of [0, 1] lies, and how far from the first.
fn texels(u: f32, n: u32) -> (usize, usize, f32) {
    let x = u * n as f32 - 0.5;
    let whole = floor(x);
    // The row repeats: before the first texel lies the last.
    let last = n as usize - 1;
    let first = if whole < 0.0 { last } else { (whole as usize).min(last) };
    let second = if first < last { first + 1 } else { 0 };
    (first, second, x - whole)
}

/// The fraction of a coordinate; 0 beyond f32's whole numbers, and of what is not a number.
fn repeat(x: f32) -> f32 {
    const WHOLE_FROM: f32 = 8_388_608.0;
    if x.abs() < WHOLE_FROM { x - floor(x) } else { 0.0 }
}

/// The next whole number below `x`, which an `i32` holds. Not `f32::floor`, which is a call where the
/// processor's instruction for it cannot be counted on.
fn floor(x: f32) -> f32 {
    let whole = x as i32 as f32;
    if x < whole { whole - 1.0 } else { whole }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checker() -> Texture {
        let texels = vec![Rgb::ZERO, Rgb::ONE, Rgb::ONE, Rgb::ZERO];
        Texture { name: "checker".into(), width: 2, height: 2, texels }
    }

    #[test]
    fn texel_middles_are_exact_and_v_points_up() {
        // Upper row: black, white.
        assert_eq!(bilinear(&checker(), Vec2::new(0.25, 0.75)), Rgb::ZERO);
        assert_eq!(bilinear(&checker(), Vec2::new(0.75, 0.75)), Rgb::ONE);
        assert_eq!(bilinear(&checker(), Vec2::new(0.25, 0.25)), Rgb::ONE);
    }

    #[test]
    fn coordinates_repeat_and_never_leave_the_image() {
        for uv in [(1.25, 0.75), (-0.75, -0.25), (1e30, 0.0), (f32::NAN, f32::INFINITY)] {
            let c = bilinear(&checker(), Vec2::new(uv.0, uv.1));
            assert!(c.is_finite(), "{uv:?}");
        }
        assert_eq!(bilinear(&checker(), Vec2::new(1.25, 0.75)), Rgb::ZERO);
    }
}
