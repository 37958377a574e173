//! A. Intersection.

mod coincident;
mod crossings;
mod garbage;
mod isa;
mod refused;
mod scale;

use crate::shapes::{self, FAR};
use crate::suite::{self, Outcome, Size, cases};
use rand::Rng;
use tweenray::intersect::{EmbreeIntersector, Ray};
use tweenray::math::DVec3;
use tweenray::scene::{HitRules, Scene};

cases! {
    1 watertight_random "Embree allows 2e-5 of 10,875 rays" => watertight_random;
    2 watertight_vertex "stock ROBUST misses 2.1e-2" => watertight_vertex;
    3 watertight_edge "stock ROBUST, compact, misses 2.5e-7" => watertight_edge;
    15 scale_ratio "OSPRay's spheres allow an error of 4e-4" => scale::ratio;
    16 far_sphere "b² − ac in f32 loses the sphere (Mitsuba 512, pbrt 265)" => scale::far_sphere_silhouette;
    17 invalid_rays "Embree allows 2.5 times a good ray's cost; stock default 1041 times" => refused::invalid_rays;
    18 ftz_independence "stock Embree's answer to a direction of 1e38 changes" => refused::ftz_independence;
    19 degenerate_geometry "Embree builds it and traces none" => garbage::degenerate;
    20 garbage_fuzz "Embree builds 1,000 such scenes and traces none" => garbage::fuzz;
    21 coincident_faces "no public test" => coincident::faces;
    22 crossing_counts "Embree 188: odd counts at edges" => crossings::parity;
    23 in_plane_ray "Embree 298: it hits or not" => coincident::in_plane;
    24 isa_agreement "Embree 423: answers differ by processor" => isa::agreement;
    25 unrelated_mesh "Embree 181: a far mesh changes near hits" => scale::unrelated_mesh;
}

/// Leaks of closed spheres at the origin and far away. `aim` gives the target of ray `i`.
fn watertight(
    rays: u64,
    columns_rows: &[(u32, u32)],
    aim: impl Fn(&Scene, &mut rand_pcg::Pcg64Mcg) -> DVec3 + Sync,
) -> Outcome {
    let mut outcome = Outcome::default();
    let each = rays / (2 * columns_rows.len() as u64);
    for centre in [DVec3::ZERO, FAR] {
        for (columns, rows) in columns_rows {
            let scene = shapes::scene_of(shapes::sphere(centre, 2.0, *columns, *rows));
            let embree = EmbreeIntersector::new(&scene, HitRules::default(), None, 4).unwrap();
            let leaks = suite::misses(&embree, each, |i| {
                let mut rng = suite::rng(1, i);
                let eye = shapes::in_ball(&mut rng, 0.4);
                Ray::new(eye, aim(&scene, &mut rng) - eye)
            });
            outcome.count(each, leaks);
        }
    }
    outcome
}

fn watertight_random(size: Size) -> Outcome {
    watertight(size.of(400_000, 200_000_000), &[(400, 200)], |_, rng| shapes::direction(rng))
}

fn watertight_vertex(size: Size) -> Outcome {
    let spheres = [(100, 50), (400, 200), (1000, 500)];
    watertight(size.of(300_000, 20_000_000), &spheres, |scene, rng| {
        let mesh = &scene.meshes[0];
        mesh.positions[rng.random_range(0..mesh.vertex_count)].as_dvec3()
    })
}

fn watertight_edge(size: Size) -> Outcome {
    watertight(size.of(300_000, 20_000_000), &[(100, 50), (400, 200)], |scene, rng| {
        let mesh = &scene.meshes[0];
        let corners = mesh.corners(rng.random_range(0..mesh.triangles.len()));
        let k = rng.random_range(0..3);
        corners[k].lerp(corners[(k + 1) % 3], rng.random())
    })
}
