//! What a surface point emits and reflects: material parameters, textures looked up.

use crate::intersect::SurfaceInteraction;
use crate::math::{Rgb, Vec2};
use crate::scene::{Material, Scene, Texture};

/// Emitted radiance towards the outside or inside.
pub(super) fn emitted(material: &Material, outside: bool) -> Rgb {
    if outside || material.emits_back { material.emission } else { Rgb::ZERO }
}

/// Diffuse reflectance at the point, textures included.
pub(super) fn albedo(scene: &Scene, material: &Material, si: &SurfaceInteraction) -> Rgb {
    match material.texture {
        Some(id) => material.diffuse * bilinear(&scene.textures[id as usize], si.uv),
        None => material.diffuse,
    }
}

/// Bilinear lookup, repeating; `(0, 0)` is the image's lower left corner.
fn bilinear(texture: &Texture, uv: Vec2) -> Rgb {
    let (w, h) = (texture.width as usize, texture.height as usize);
    let x = repeat(uv.x) * w as f32 - 0.5;
    let y = repeat(1.0 - uv.y) * h as f32 - 0.5;
    let (fx, fy) = (x - x.floor(), y - y.floor());
    let wrap = |i: f32, n: usize| (i as isize).rem_euclid(n as isize) as usize;
    let (x0, x1) = (wrap(x.floor(), w), wrap(x.floor() + 1.0, w));
    let (y0, y1) = (wrap(y.floor(), h), wrap(y.floor() + 1.0, h));
    let at = |x: usize, y: usize| texture.texels[y * w + x];
    let upper = at(x0, y0).lerp(at(x1, y0), fx);
    let lower = at(x0, y1).lerp(at(x1, y1), fx);
    upper.lerp(lower, fy)
}

fn repeat(x: f32) -> f32 {
    let fraction = x - x.floor();
    // A coordinate beyond f32's whole numbers, or not a number, has no fraction.
    if fraction.is_finite() { fraction } else { 0.0 }
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
