//! A. Intersection.

mod accuracy;
mod coincident;
mod crossings;
mod fields;
mod garbage;
mod holes;
mod invariance;
pub mod isa;
mod open;
mod ranges;
mod refused;
mod scale;
mod slivers;
mod ways;
mod wide;

use crate::shapes::{self, FAR};
use crate::suite::{self, Outcome, Size, cases};
use rand::Rng;
use tweenray::intersect::{EmbreeIntersector, Ray};
use tweenray::math::DVec3;
use tweenray::scene::{HitRules, Scene};
use ways::OneByOne;

cases! {
    1 watertight_random "Embree allows 2e-5 of 10,875 rays" => watertight_random;
    2 watertight_vertex "stock ROBUST misses 2.1e-2" => watertight_vertex;
    3 watertight_edge "stock ROBUST, compact, misses 2.5e-7" => watertight_edge;
    4 vertex_perspective "stock: 21,524 of 65,025 miss, with ROBUST 951" => fields::vertex_perspective;
    5 structured_grid "mitsuba #1149, tinybvh #168: axis-parallel rays fall through" => fields::structured_grid;
    6 bunny_holes "naive f32: 8.5 % holes at an epsilon of 1e-6, all at 1e-5" => holes::bunny_holes;
    7 phantom_hit "stock ROBUST: 13 per 3e6, up to 140 units off" => slivers::phantom_hit;
    8 grazing_t "stock ROBUST: t up to 2.57 units off" => slivers::grazing_t;
    9 sliver_balance "stock ROBUST: 1,350 false and 1,042 missed per 3e6" => slivers::sliver_balance;
    10 hit_accuracy "Embree allows 16 ulp, 256 rays on one triangle" => accuracy::hit_accuracy;
    11 small_triangle_far "Embree's own test of this is commented out" => accuracy::small_triangle_far;
    12 translation_invariance "raw f32 Embree at 1e6: 43 % of hits on the wrong triangle" => invariance::translation;
    13 scale_invariance "LuxCore #79 fails at 10 cm" => invariance::scale;
    14 range_guard "Embree: 49 % holes at a radius of 1e-18, 21 % at 2e18" => ranges::range_guard;
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
    63 open_meshes "no public test" => open::open_meshes;
}

/// Leaks of closed spheres at the origin and far away, by both ways to trace. `aim` gives the
/// target of ray `i`.
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
            let embree =
                EmbreeIntersector::new(&scene, HitRules::default(), suite::isa(), 4).unwrap();
            let make = |i| {
                let mut rng = suite::rng(1, i);
                let eye = shapes::in_ball(&mut rng, 0.4);
                Ray::new(eye, aim(&scene, &mut rng) - eye)
            };
            // Half in packets, half one by one.
            let half = each / 2;
            outcome.count(half, suite::misses(&embree, half, make));
            let rest = |i| make(half + i);
            outcome.count(each - half, suite::misses(&OneByOne(&embree), each - half, rest));
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
