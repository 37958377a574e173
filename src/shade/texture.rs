//! Texture lookups, filtered by what the ray covers.
//!
//! The ellipse that a ray covers is cut into as many round pieces as it is longer than wide, side by side
//! along its longer axis (McCormack, Perry, Farkas and Jouppi, 1999), and each is looked up in the two mip levels whose
//! texels are about as large (Williams, 1983).

use super::cone::RayCone;
use crate::intersect::{SurfaceInteraction, uv_of_set};
use crate::math::{DVec2, DVec3, Rgb, Vec2};
use crate::scene::{PointRow, Scene, Texture, TextureMap, Wrap};

/// Most pieces of an ellipse. A longer one is taken to be wider.
const MOST_PIECES: f64 = 16.0;

/// The mean of what `map` shows of the point `si`, seen towards `wo` (unit), over what a ray with this `cone` covers there.
pub(super) fn shown(
    scene: &Scene,
    map: &TextureMap,
    (si, wo, cone): (&SurfaceInteraction, DVec3, RayCone),
) -> Rgb {
    let footprint = cone.footprint(scene, si, wo, map.uv_set);
    mapped(scene, map, uv_of_set(scene, si, map.uv_set), footprint)
}

/// The mean of what `map` shows over the ellipse around `uv` with the conjugate diameters `footprint`, both in the
/// surface's texture coordinates of the map's set.
fn mapped(scene: &Scene, map: &TextureMap, uv: Vec2, footprint: [DVec2; 2]) -> Rgb {
    let TextureMap { image, wrap, uv_set: _, transform } = map;
    let uv = map.place(uv);
    let footprint = footprint.map(|axis| transform.transform_vector2(axis));
    filtered(&scene.textures[*image as usize], *wrap, uv, footprint)
}

/// What an image of shares says at a point, its mean over what the ray covers; 1 without an image. An image that was made
/// in code may hold any number.
pub(super) fn share(
    scene: &Scene,
    map: Option<&TextureMap>,
    seen: (&SurfaceInteraction, DVec3, RayCone),
) -> f64 {
    let Some(map) = map else { return 1.0 };
    let share = f64::from(shown(scene, map, seen).x);
    // Not `min`, which would hide what is NaN.
    if share > 1.0 { 1.0 } else { share }
}

/// The mean of `texture` over the ellipse around `uv` with the conjugate diameters `footprint`, both in the image's
/// coordinates, of which `(0, 0)` is the lower left corner. Beyond its sides and beyond its upper and lower edges the image
/// goes on as the two of `wrap` say.
pub(super) fn filtered(texture: &Texture, wrap: [Wrap; 2], uv: Vec2, footprint: [DVec2; 2]) -> Rgb {
    let levels = texture.levels();
    let size = DVec2::new(f64::from(levels[0].width), f64::from(levels[0].height));
    let ellipse = Ellipse::of(footprint.map(|axis| axis * size));
    // Else texels are larger than what the ray covers, or coordinates have no gradient that could say how large it is.
    let is_minified = ellipse.major > 1.0 && ellipse.major < f64::MAX;
    if !is_minified {
        return levels[0].bilinear(wrap, uv);
    }
    let minor = ellipse.minor.max(ellipse.major / MOST_PIECES).max(1.0);
    let longer = ellipse.major / minor;
    // Rounded up. (Not `ceil`, which is a call where the processor's instruction for it cannot be counted on.)
    let pieces = longer as u32 + u32::from(longer.fract() > 0.0);
    // From the middle of the first piece to that of the last.
    let reach = ellipse.axis / size * (ellipse.major - minor);
    let step = reach / f64::from(pieces - 1).max(1.0);
    let row = PointRow { first: uv - (0.5 * reach).as_vec2(), step: step.as_vec2(), count: pieces };
    // The level with the largest texels that are no larger than a piece, and how much larger the piece is.
    let level = (minor as u32).ilog2() as usize;
    if level + 1 >= levels.len() {
        return texture.mean(wrap, row, (levels.len() - 1, 0.0));
    }
    texture.mean(wrap, row, (level, (minor / f64::from(1u32 << level) - 1.0) as f32))
}

/// Principal diameters of an ellipse, texels.
struct Ellipse {
    major: f64,
    minor: f64,
    /// Unit direction of the longer one.
    axis: DVec2,
}

impl Ellipse {
    /// The ellipse with the conjugate diameters `a` and `b`: the image of a circle under the matrix of these columns, so its
    /// diameters are the singular values.
    fn of([a, b]: [DVec2; 2]) -> Self {
        let (x, y, xy) = (a.x * a.x + b.x * b.x, a.y * a.y + b.y * b.y, a.x * a.y + b.x * b.y);
        let (mean, half) = (0.5 * (x + y), 0.5 * (x - y));
        let apart = (half * half + xy * xy).sqrt();
        let major = (mean + apart).sqrt();
        let minor = if major > 0.0 { a.perp_dot(b).abs() / major } else { 0.0 };
        // Of two forms of the eigenvector the one that is not a difference of equal numbers.
        let axis =
            if half >= 0.0 { DVec2::new(half + apart, xy) } else { DVec2::new(xy, apart - half) };
        Self { major, minor, axis: axis.try_normalize().unwrap_or(DVec2::X) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DAffine2;
    use crate::scene::World;

    const POINT: [DVec2; 2] = [DVec2::ZERO; 2];

    fn checker(edge: u32) -> Texture {
        let texels = (0..edge * edge).map(|i| Rgb::splat(((i % edge + i / edge) % 2) as f32));
        Texture::from_linear("checker", [edge, edge], texels.collect())
    }

    #[test]
    fn texel_middles_are_exact_and_v_points_up() {
        // Upper row: black, white.
        let at = |u, v| filtered(&checker(2), [Wrap::Repeat; 2], Vec2::new(u, v), POINT);
        assert_eq!(at(0.25, 0.75), Rgb::ZERO);
        assert_eq!(at(0.75, 0.75), Rgb::ONE);
        assert_eq!(at(0.25, 0.25), Rgb::ONE);
    }

    #[test]
    fn coordinates_repeat_and_never_leave_the_image() {
        let tiny = [DVec2::splat(1e-300), DVec2::ZERO];
        let unknown = [DVec2::splat(f64::NAN), DVec2::X];
        let wide = [DVec2::splat(1e200), DVec2::splat(f64::INFINITY)];
        let huge = [DVec2::splat(1e30), DVec2::new(1.0, -1e30)];
        for uv in [(1.25, 0.75), (-0.75, -0.25), (1e30, 0.0), (f32::NAN, f32::INFINITY)] {
            for footprint in [POINT, tiny, unknown, wide, huge] {
                for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
                    let c = filtered(&checker(2), [wrap; 2], Vec2::new(uv.0, uv.1), footprint);
                    assert!(c.is_finite(), "{uv:?} {footprint:?} {wrap:?}");
                }
            }
        }
        let once_more = filtered(&checker(2), [Wrap::Repeat; 2], Vec2::new(1.25, 0.75), POINT);
        assert_eq!(once_more, Rgb::ZERO);
    }

    #[test]
    fn beyond_its_edges_an_image_goes_on_as_it_is_told() {
        let ramp = (0..4).map(|i| Rgb::splat(i as f32)).collect();
        let texture = Texture::from_linear("ramp", [4, 1], ramp);
        let at = |wrap, u| filtered(&texture, [wrap; 2], Vec2::new(u, 0.5), POINT).x;
        let middles = [-0.375, -0.125, 0.125, 0.875, 1.125, 1.375, 1.875, 2.125];
        for (wrap, expected) in [
            (Wrap::Repeat, [2.0, 3.0, 0.0, 3.0, 0.0, 1.0, 3.0, 0.0]),
            (Wrap::Clamp, [0.0, 0.0, 0.0, 3.0, 3.0, 3.0, 3.0, 3.0]),
            (Wrap::Mirror, [1.0, 0.0, 0.0, 3.0, 3.0, 2.0, 0.0, 0.0]),
        ] {
            assert_eq!(middles.map(|u| at(wrap, u)), expected, "{wrap:?}");
        }
        // Texels on both sides of an edge are mixed as those of the image that follows.
        assert_eq!(at(Wrap::Repeat, 1.0), 1.5);
        assert_eq!(at(Wrap::Mirror, 1.0), 3.0);
    }

    #[test]
    fn an_ellipse_has_its_principal_diameters() {
        for turn in [0.0, 0.3, 1.0, 2.0, 3.0] {
            let (sin, cos) = (libm::sin(turn), libm::cos(turn));
            let (major, minor) = (DVec2::new(cos, sin) * 5.0, DVec2::new(-sin, cos) * 2.0);
            // Conjugate diameters of the same ellipse.
            for phase in [0.0, 0.7, 2.5] {
                let (s, c) = (libm::sin(phase), libm::cos(phase));
                let ellipse = Ellipse::of([major * c + minor * s, minor * c - major * s]);
                assert!((ellipse.major - 5.0).abs() < 1e-12);
                assert!((ellipse.minor - 2.0).abs() < 1e-12);
                assert!(ellipse.axis.perp_dot(major).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn what_lies_far_away_has_the_mean_colour() {
        let texture = checker(64);
        for (u, v) in [(0.1, 0.2), (0.77, 0.5)] {
            let far = [DVec2::new(0.5, 0.1), DVec2::new(0.0, 0.06)];
            let seen = filtered(&texture, [Wrap::Repeat; 2], Vec2::new(u, v), far);
            assert!((seen - Rgb::splat(0.5)).abs().max_element() < 1e-6, "{seen}");
        }
    }

    #[test]
    fn pieces_cover_the_ellipse_from_end_to_end() {
        // One white column far from the next: it is seen from as far as half of the ellipse and of a texel.
        let white = |i: u32| Rgb::splat(if i % 64 == 32 { 1.0 } else { 0.0 });
        let texture = Texture::from_linear("line", [64, 64], (0..4096).map(white).collect());
        let seen = |texels: f64| {
            let long = [DVec2::new(8.0 / 64.0, 0.0), DVec2::new(0.0, 1.0 / 64.0)];
            let u = (32.5 + texels) / 64.0;
            filtered(&texture, [Wrap::Repeat; 2], Vec2::new(u as f32, 0.5), long).x
        };
        assert!(seen(0.0) > 0.12 && seen(3.4) > 0.12, "{} {}", seen(0.0), seen(3.4));
        assert!(seen(4.6) == 0.0);
    }

    #[test]
    fn coordinates_far_away_keep_their_fraction() {
        let scene = |image| Scene {
            textures: vec![image],
            ..World::default().into_scene(false).expect("a scene")
        };
        let ramp = (0..64).map(|i| Rgb::splat(i as f32)).collect();
        let scene = scene(Texture::from_linear("ramp", [64, 1], ramp));
        let transform = DAffine2::from_scale(DVec2::splat(100.0));
        for (wrap, expected) in [(Wrap::Repeat, 12.3), (Wrap::Mirror, 12.3)] {
            let map = TextureMap { wrap: [wrap; 2], transform, ..TextureMap::of(0) };
            // 100 · 1.25 = 125 is odd, so what is mirrored runs backwards: at 1.24 it does not.
            let u = (124.0 + (12.3 + 0.5) / 64.0) / 100.0;
            let seen = mapped(&scene, &map, Vec2::new(u as f32, 0.5), POINT).x;
            let rounding = 64.0 * 100.0 * f32::EPSILON;
            assert!((seen - expected).abs() < rounding, "{wrap:?}: {seen}");
        }
    }

    #[test]
    fn a_long_footprint_blurs_along_itself_alone() {
        // Stripes of four texels across u.
        let stripe = |i: u32| Rgb::splat(((i % 64 / 4) % 2) as f32);
        let texture = Texture::from_linear("stripes", [64, 64], (0..4096).map(stripe).collect());
        let (long, short) = (DVec2::splat(0.25), DVec2::splat(1.0 / 64.0));
        let at = |axes| filtered(&texture, [Wrap::Repeat; 2], Vec2::new(6.0 / 64.0, 0.4), axes);
        assert_eq!(at([long * DVec2::Y, short * DVec2::X]), Rgb::ONE);
        assert!((at([long * DVec2::X, short * DVec2::Y]) - Rgb::splat(0.5)).abs().x < 0.05);
    }
}
