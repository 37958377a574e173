//! Spheres at one place, with holes and without.

use crate::{hold_to_oracle, leaves, leaving};
use rand::SeedableRng;
use rand_pcg::Pcg64;
use tweenray::intersect::Ray;
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::{AlphaMask, Material, Scene, TextureMap, World, WorldSphere};

/// Spheres at one place and of one size, each with stripes of so many texels cut out, 0 for none.
fn nest(stripes: &[u32], centre: DVec3, radius: f64) -> Scene {
    let mut world = World::default();
    for count in stripes {
        let white = Material::diffuse("white", Rgb::ONE);
        let material = match count {
            0 => white,
            count => {
                let texels = [0, 255].repeat(*count as usize / 2);
                let (width, height) = (*count, 1);
                world.masks.push(AlphaMask { name: count.to_string(), width, height, texels });
                Material { alpha: Some(TextureMap::of(world.masks.len() as u32 - 1)), ..white }
            }
        };
        let material = world.add_material(material);
        world.spheres.push(WorldSphere::new("ball", centre, radius, material));
    }
    let white = world.add_material(Material::diffuse("white", Rgb::ONE));
    world.spheres.push(WorldSphere::new("far", DVec3::splat(-3.0), 0.1, white));
    world.into_scene(false).unwrap()
}

#[test]
fn what_leaves_one_of_several_spheres_at_one_place_meets_none_where_it_starts() {
    for stripes in [&[8, 0][..], &[8, 6], &[8, 6, 0], &[0, 8], &[0, 0], &[6, 10, 8, 0]] {
        for (centre, radius) in [(DVec3::ZERO, 1.0), (DVec3::new(0.3, 0.7, -0.1), 0.013)] {
            let scene = nest(stripes, centre, radius);
            let mut rng = Pcg64::seed_from_u64(5);
            let mut towards = |_| {
                let org = centre + leaves::in_ball(&mut rng) * (2.0 * radius);
                Ray::new(org, centre + leaves::in_ball(&mut rng) * radius - org)
            };
            let mut rays: Vec<Ray> = (0..3000).map(&mut towards).collect();
            let mut hits = hold_to_oracle(&scene, &rays);
            for seed in 1..3 {
                rays = leaving(&scene, &rays, &hits, seed);
                hits = hold_to_oracle(&scene, &rays);
                assert!(rays.len() > 500, "{}", rays.len());
                for (ray, hit) in rays.iter().zip(&hits) {
                    // What goes inwards goes along the whole chord, or out through a hole at its end.
                    let chord = 2.0 * (centre - ray.org).dot(ray.dir) / ray.dir.length_squared();
                    let t = hit.filter(|hit| hit.prim.prim_id as usize != stripes.len());
                    let whole = t.is_none_or(|hit| (hit.t - chord).abs() < 1e-9 * (1.0 + chord));
                    assert!(whole, "{stripes:?}: {ray:?}: {hit:?}, not {chord}");
                }
            }
        }
    }
}
