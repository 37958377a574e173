//! Normal maps: normals of a finer surface than the one that rays meet.
//!
//! An image holds a normal in the frame of the texture coordinates: red along u, green along v, blue along the surface's
//! shading normal (tangent space, +Y up, as glTF has it). Takes a point and what its ray covers; gives the mapped
//! normal. It changes what lobes send where and what arrives without shadows. Shadows, reused or traced, know
//! nothing of it. Not done: tangents of the mesh file, displacement, what the footprint blurs as roughness.

use super::cone::RayCone;
use super::light::LightSampler;
use super::texture;
use crate::intersect::{SurfaceInteraction, uv_gradients, uv_of_set};
use crate::math::{DVec3, Rgb};
use crate::scene::{NormalMap, Scene, Wrap};

/// The unit normal that `map` says at `si`, on the side of `ng`, as seen towards `wo` (unit) by a ray with this `cone`; the shading
/// normal where the surface has no coordinates for it.
#[inline(never)]
pub(super) fn normal(
    scene: &Scene,
    map: &NormalMap,
    si: &SurfaceInteraction,
    wo: DVec3,
    cone: RayCone,
) -> DVec3 {
    // Of the image's coordinates, so that an image that lies turned has its normals turned.
    let ([u, v], laid) = (uv_gradients(scene, si, map.image.uv_set), map.image.transform.matrix2);
    let gradients = [u * laid.x_axis.x + v * laid.y_axis.x, u * laid.x_axis.y + v * laid.y_axis.y];
    let Some([tangent, bitangent]) = frame(si, gradients) else { return si.ns };
    let shares = texture::shown(scene, &map.image, (si, wo, cone)).as_dvec3();
    let mut local = (shares * 2.0 - DVec3::ONE) * DVec3::new(map.strength, map.strength, 1.0);
    if map.image.wrap.contains(&Wrap::Mirror) {
        // Every other copy of the image lies the other way round, and so do its normals.
        let place = map.image.place(uv_of_set(scene, si, map.image.uv_set));
        let side = |at: f32, wrap| {
            if wrap == Wrap::Mirror { side_of_copy(f64::from(at)) } else { 1.0 }
        };
        local.x *= side(place.x, map.image.wrap[0]);
        local.y *= side(place.y, map.image.wrap[1]);
    }
    let n = tangent * local.x + bitangent * local.y + si.ns * local.z;
    // The mean of opposite normals has no direction. A normal below the facet is no surface's: level with it, at most.
    let Some(n) = n.try_normalize() else { return si.ns };
    let height = n.dot(si.ng);
    if height >= 0.0 { n } else { (n - si.ng * height).try_normalize().unwrap_or(si.ns) }
}

/// -1 in the mirrored copies of an image, 1 in the others, by the coordinate across it.
fn side_of_copy(coordinate: f64) -> f64 {
    if coordinate.rem_euclid(2.0) < 1.0 { 1.0 } else { -1.0 }
}

/// Unit vectors across the shading normal along which u and v grow, from their gradients. They are at right angles, u leading, and
/// left-handed where the image is mirrored. `None` where coordinates do not grow in two directions.
fn frame(si: &SurfaceInteraction, [u, v]: [DVec3; 2]) -> Option<[DVec3; 2]> {
    // Along the edge where v stays the same.
    let along = v.cross(si.ng);
    let turn = along.dot(u);
    let along = along * turn.signum();
    let tangent = (along - si.ns * along.dot(si.ns)).try_normalize()?;
    // Coordinates are f32: those of a line may be off it by rounding, to either side.
    let is_frame = turn.abs() > 1e-5 * u.length() * v.length() && turn.is_finite();
    // On the outside u, v and the normal are right-handed unless the image is mirrored.
    is_frame.then(|| [tangent, si.ns.cross(tangent) * turn.signum()])
}

/// Unshadowed irradiance at `p` with the mapped unit normal `mapped`, of which `n` is the surface's own, per unit of
/// emission.
///
/// By the closed form of the mapped normal, dimmed where the light sinks towards the surface's own horizon, which it
/// would else pass unseen: a cubic of the irradiance on the surface itself over what the tilted one would tell of it
/// (Chiang, Li and Burley, 2019, with irradiances for cosines). It is 0 where none of the light is above the surface, and never more
/// than the closed form.
pub(super) fn unshadowed(sampler: &LightSampler, p: DVec3, n: DVec3, mapped: DVec3) -> f64 {
    let own = sampler.unshadowed(p, n);
    // What is NaN goes on, to be counted at its pixel.
    if own == 0.0 {
        return 0.0;
    }
    let cos = n.dot(mapped);
    dimmed(own, sampler.unshadowed_tilted(p, mapped, cos), cos)
}

/// The same of a light that comes from all around, whose irradiance on the surface itself is `own` and on one with the mapped
/// normal, of cosine `cos` to its own, `tilted`: less the part of a sky that the tilted surface sees below the other's horizon.
pub(super) fn unshadowed_colour(own: Rgb, tilted: Rgb, cos: f64) -> Rgb {
    let of = |own: f32, tilted: f32| match own {
        0.0 => 0.0,
        _ => dimmed(own.into(), f64::from(tilted) * 0.5 * (1.0 + cos), cos) as f32,
    };
    Rgb::new(of(own.x, tilted.x), of(own.y, tilted.y), of(own.z, tilted.z))
}

/// The irradiance `tilted` by the mapped normal, of cosine `cos` to the surface's, as far as the surface's own is not small beside it.
fn dimmed(own: f64, tilted: f64, cos: f64) -> f64 {
    if tilted == 0.0 {
        return 0.0;
    }
    let g = own / (tilted * cos.max(0.0));
    if g < 1.0 { tilted * (g * (1.0 + g * (1.0 - g))) } else { tilted }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intersect::PrimRef;
    use crate::math::Vec2;
    use crate::scene::{DirectionalLight, Light, Sky, SphereLight, Surface};

    fn flat(ns: DVec3) -> SurfaceInteraction {
        SurfaceInteraction {
            p: DVec3::ZERO,
            ng: DVec3::Y,
            ns,
            uv: Vec2::ZERO,
            surface: Surface { material: 0, light: None, always_traced: false },
            prim: PrimRef::NONE,
            offset: 0.0,
        }
    }

    #[test]
    fn the_frame_follows_the_coordinates() {
        // u along x, v along -z: upright seen from above.
        let [t, b] = frame(&flat(DVec3::Y), [DVec3::X * 3.0, DVec3::NEG_Z * 0.5]).expect("a frame");
        assert!((t - DVec3::X).length() < 1e-15 && (b - DVec3::NEG_Z).length() < 1e-15);
        // Mirrored.
        let [t, b] = frame(&flat(DVec3::Y), [DVec3::NEG_X, DVec3::NEG_Z]).expect("a frame");
        assert!((t - DVec3::NEG_X).length() < 1e-15 && (b - DVec3::NEG_Z).length() < 1e-15);
        // Skew coordinates: u grows along the line of constant v.
        let [t, b] =
            frame(&flat(DVec3::Y), [DVec3::X, DVec3::new(-1.0, 0.0, -1.0)]).expect("a frame");
        assert!((t - DVec3::new(1.0, 0.0, -1.0).normalize()).length() < 1e-15);
        assert!(b.dot(t).abs() < 1e-15 && b.dot(DVec3::NEG_Z) > 0.0);
        // About a shading normal the frame is across it.
        let ns = DVec3::new(0.3, 1.0, 0.2).normalize();
        let [t, b] = frame(&flat(ns), [DVec3::X, DVec3::NEG_Z]).expect("a frame");
        assert!(t.dot(ns).abs() < 1e-15 && b.dot(ns).abs() < 1e-15 && t.x > 0.9 && b.z < -0.9);
        for none in [[DVec3::ZERO; 2], [DVec3::X, DVec3::X], [DVec3::splat(f64::NAN), DVec3::X]] {
            assert!(frame(&flat(DVec3::Y), none).is_none(), "{none:?}");
        }
    }

    #[test]
    fn light_sinks_with_the_surface_and_is_never_more_than_the_closed_form() {
        let sphere = |height: f64| {
            let centre = DVec3::new(3.0, height, 0.0);
            LightSampler::new(&Light::Sphere(SphereLight {
                centre,
                radius: 0.5,
                radiance: Rgb::ONE,
            }))
        };
        let sun = |height: f64| {
            let to_light = DVec3::new(3.0, height, 0.0).normalize();
            LightSampler::new(&Light::Directional(DirectionalLight {
                to_light,
                irradiance: Rgb::ONE,
            }))
        };
        let tilted = DVec3::new(0.8, 1.0, 0.1).normalize();
        for light in [&sphere as &dyn Fn(f64) -> LightSampler, &sun] {
            let mut before = 0.0;
            for step in -20..100 {
                let light = light(0.1 * f64::from(step));
                let found = unshadowed(&light, DVec3::ZERO, DVec3::Y, tilted);
                let (own, closed) =
                    [DVec3::Y, tilted].map(|n| light.unshadowed(DVec3::ZERO, n)).into();
                assert!(found >= 0.0 && found <= closed, "{step}: {found} {closed}");
                assert_eq!(found == 0.0, own == 0.0 || closed == 0.0, "{step}");
                assert!((found - before).abs() < 0.15, "{step}: {before} to {found}");
                before = found;
                // The same normal is the same light, to the last bit.
                assert_eq!(unshadowed(&light, DVec3::ZERO, DVec3::Y, DVec3::Y), own);
            }
        }
        // Over a tilted normal part of the sky lies below the surface.
        let sky = LightSampler::of_sky(&Sky::default());
        let found = unshadowed(&sky, DVec3::ZERO, DVec3::Y, tilted);
        assert!((found / std::f64::consts::PI - 0.5 * (1.0 + tilted.y)).abs() < 1e-12);
    }
}
