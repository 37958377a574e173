//! `verify` catches faults: rules switched off, and an intersector with faults.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use rand::SeedableRng;
use rand_pcg::Pcg64;
use std::sync::atomic::AtomicBool;
use tweenray::intersect::{EmbreeIntersector, Hit, Intersector, Oracle, PrimRef, Ray};
use tweenray::math::DVec3;
use tweenray::scene::{CameraPath, HitRules, Pose, Recheck, Scene, Settings, Shot, WorldMesh};
use tweenray::stats::RayCounts;
use tweenray::verify::{Answers, Check, Class, Kind, RayId, Tally, TracedRay};

#[path = "hard_cases/shapes.rs"]
mod shapes;

/// From inside a closed sphere, where every ray hits.
fn shot() -> Shot {
    let (eye, target, up) = (DVec3::new(0.1, 0.2, 0.3), DVec3::X, DVec3::Y);
    let pose = Pose { eye, target, up, roll_degrees: 0.0 };
    Shot::new(CameraPath::Still(pose), 1, 60.0)
}

fn sphere() -> Scene {
    shapes::scene_of(shapes::sphere(DVec3::ZERO, 2.0, 60, 40))
}

fn tally(scene: &Scene, product: &dyn Intersector, rays: u64) -> Tally {
    let (settings, shot, oracle) = (Settings::default(), shot(), Oracle::new(scene));
    let check = Check::new(scene, &settings, &shot, product, &oracle);
    check.run(rays, &AtomicBool::new(false), &|_| ())
}

fn embree(scene: &Scene, rules: HitRules) -> EmbreeIntersector<'_> {
    EmbreeIntersector::new(scene, rules, None, 1).unwrap()
}

#[test]
fn the_oracle_agrees_with_itself() {
    let scene = sphere();
    let tally = tally(&scene, &Oracle::new(&scene), 256);
    assert!(Kind::ALL.iter().all(|kind| tally.rays(*kind) == 256));
    assert!(Class::ALL.iter().all(|class| tally.count(*class) == 0), "{tally:?}");
}

/// Every ray that should hit a vertex of the sphere from within does so only by the second try.
#[test]
fn without_a_second_try_hits_are_missed() {
    let scene = sphere();
    let misses = |retry| {
        let product = embree(&scene, HitRules { retry, ..HitRules::default() });
        let (settings, shot, oracle) = (Settings::default(), shot(), Oracle::new(&scene));
        let check = Check::new(&scene, &settings, &shot, &product, &oracle);
        let mut rng = Pcg64::seed_from_u64(1);
        let counts = &mut RayCounts::default();
        let mut missed = 0;
        for vertex in &scene.meshes[0].positions[..scene.meshes[0].vertex_count] {
            for _ in 0..4 {
                let org = shapes::in_ball(&mut rng, 0.3);
                let ray = Ray::new(org, vertex.as_dvec3() - org);
                let (product, oracle) =
                    (product.intersect(&ray, counts), oracle.intersect(&ray, counts));
                let difference =
                    check.judge(&TracedRay { ray, answers: Answers::Hits { product, oracle } });
                if let Some(difference) = difference.filter(|d| !d.class.is_explained()) {
                    assert_eq!(difference.class, Class::Missed);
                    missed += 1;
                }
            }
        }
        missed
    };
    assert_eq!(misses(true), 0);
    assert!(misses(false) > 0);
}

#[test]
fn without_the_recheck_distances_are_wrong() {
    let scene = sphere();
    let rules = HitRules { recheck: Recheck::Off, ..HitRules::default() };
    let found = tally(&scene, &embree(&scene, rules), 4096);
    assert!(found.count(Class::WrongDistance) > 0, "{found:?}");
}

/// What a lying intersector makes of the oracle's answers.
#[derive(Clone, Copy)]
enum Fault {
    Nothing,
    Neighbour,
    Nearer,
    Behind,
    NotOccluded,
    Occluded,
    /// At every vertex, where something shows its outside behind: that.
    PastVertex,
}

/// The oracle, but for one ray in eight, or for the rays at vertices.
struct FaultyIntersector<'s>(Oracle<'s>, Fault);

impl FaultyIntersector<'_> {
    /// What lies behind the vertex that the ray hits, if it is the outside of a ball.
    fn past_vertex(&self, ray: &Ray, hit: &Hit) -> Option<Hit> {
        let dir = ray.dir.normalize();
        let off = |corner: DVec3| (corner - ray.org).cross(dir).length();
        let at_vertex = self.0.corners(hit.prim)?.into_iter().any(|corner| off(corner) < 1e-7);
        let hits = self.0.all_hits(ray);
        let behind = hits.iter().find(|h| h.hit.t > hit.t * (1.0 + 1e-5))?.hit;
        let corners = self.0.corners(behind.prim)?;
        // The balls are about the scene's origin.
        let shows_outside = (corners[0] + corners[1] + corners[2]).dot(dir) < 0.0;
        (at_vertex && shows_outside).then_some(behind)
    }

    fn is_faulty(ray: &Ray) -> bool {
        ray.dir.x.to_bits().wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 61 == 0
    }
}

impl Intersector for FaultyIntersector<'_> {
    fn intersect(&self, ray: &Ray, counts: &mut RayCounts) -> Option<Hit> {
        let hit = self.0.intersect(ray, counts)?;
        if let Fault::PastVertex = self.1 {
            return self.past_vertex(ray, &hit).or(Some(hit));
        }
        if !Self::is_faulty(ray) {
            return Some(hit);
        }
        match self.1 {
            Fault::Nothing => None,
            Fault::Neighbour => {
                let count = [4680, 440][hit.prim.geom_id as usize];
                let prim_id = (hit.prim.prim_id + count / 4) % count;
                Some(Hit { prim: PrimRef { prim_id, ..hit.prim }, ..hit })
            }
            Fault::Nearer => Some(Hit { t: hit.t * (1.0 - 1e-5), ..hit }),
            Fault::Behind => self.0.all_hits(ray).get(1).map(|h| h.hit),
            Fault::NotOccluded | Fault::Occluded | Fault::PastVertex => Some(hit),
        }
    }

    fn occluded(&self, ray: &Ray, counts: &mut RayCounts) -> bool {
        match (self.1, Self::is_faulty(ray)) {
            (Fault::NotOccluded, true) => false,
            (Fault::Occluded, true) => true,
            _ => self.0.occluded(ray, counts),
        }
    }

    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], counts: &mut RayCounts) {
        rays.iter().zip(hits).for_each(|(ray, hit)| *hit = self.intersect(ray, counts));
    }

    fn occluded_batch(&self, rays: &[Ray], occluded: &mut [bool], counts: &mut RayCounts) {
        rays.iter().zip(occluded).for_each(|(ray, out)| *out = self.occluded(ray, counts));
    }

    fn describe(&self) -> String {
        "a liar".into()
    }

    fn memory(&self) -> u64 {
        0
    }
}

/// Each fault is counted in its own class, and in no other that is unexplained.
#[test]
fn planted_faults_are_found_and_classified() {
    let inner = shapes::sphere(DVec3::new(0.3, 0.2, 0.1), 0.5, 20, 12);
    let mut world = shapes::world_of(shapes::sphere(DVec3::ZERO, 2.0, 60, 40));
    world.meshes.push(inner);
    let scene = world.into_scene(true).unwrap();
    for (fault, class) in [
        (Fault::Nothing, Class::Missed),
        (Fault::Neighbour, Class::Phantom),
        (Fault::Nearer, Class::WrongDistance),
        (Fault::Behind, Class::Missed),
        (Fault::NotOccluded, Class::ShadowLeak),
        (Fault::Occluded, Class::FalseShadow),
    ] {
        let found = tally(&scene, &FaultyIntersector(Oracle::new(&scene), fault), 512);
        assert!(found.count(class) > 10, "{class:?}: {found:?}");
        assert_eq!(found.unexplained(), found.count(class), "{class:?}: {found:?}");
        let row = found.rows().into_iter().find(|row| row.class == class).unwrap();
        let (share, worst) = (row.count as f64 / row.rays as f64, row.worst.unwrap());
        assert!(row.bound > share && row.bound < 2.0 * share, "{row:?}");
        assert!(worst.ulps > 4.0 || class == Class::Missed, "{row:?}");
    }
}

/// Whichever way round closed meshes are wound, what slips past a vertex onto an outside is known
/// as that; and so many of them fail.
#[test]
fn slipping_past_every_vertex_is_explained_but_fails() {
    let ball = |radius| shapes::sphere(DVec3::ZERO, radius, 60, 40);
    let mut shares = Vec::new();
    for inwards in [false, true] {
        let mut world = shapes::world_of(ball(2.0));
        world.meshes.push(ball(1.5));
        if inwards {
            let triangles = world.meshes.iter_mut().flat_map(|mesh| &mut mesh.triangles);
            triangles.for_each(|t| t.swap(1, 2));
        }
        let scene = world.into_scene(true).unwrap();
        let found = tally(&scene, &FaultyIntersector(Oracle::new(&scene), Fault::PastVertex), 8192);
        assert_eq!(found.unexplained(), 0, "{inwards}: {found:?}");
        assert_eq!(found.past_vertex_allowed(), 8);
        assert!(found.count(Class::PastVertex) > 100 && !found.passed(), "{inwards}: {found:?}");
        assert!(tally(&scene, &embree(&scene, HitRules::default()), 512).passed());
        shares.push(found.count(Class::PastVertex) as f64);
    }
    assert!((shares[0] / shares[1] - 1.0).abs() < 0.3, "{shares:?}");
}

/// Past the vertices of an open mesh more rays may slip, since less tells of it; they are counted by
/// themselves.
#[test]
fn slipping_past_vertices_of_an_open_mesh_has_a_class_of_its_own() {
    let mut outer = shapes::sphere(DVec3::ZERO, 2.0, 60, 40);
    outer.triangles.truncate(4000);
    let mut world = shapes::world_of(outer);
    world.meshes.push(shapes::sphere(DVec3::ZERO, 1.5, 60, 40));
    let scene = world.into_scene(true).unwrap();
    let found = tally(&scene, &FaultyIntersector(Oracle::new(&scene), Fault::PastVertex), 4096);
    let slipped = found.count(Class::PastOpenVertex);
    assert_eq!((found.unexplained(), found.count(Class::PastVertex)), (0, 0), "{found:?}");
    assert!(slipped > 50, "{found:?}");
    let ours = tally(&scene, &embree(&scene, HitRules::default()), 4096);
    assert!(ours.passed() && ours.count(Class::PastOpenVertex) < slipped, "{ours:?}");
}

/// Between two sheets that nearly touch is a gap narrower than the band, such as f32 leaves where a vertex
/// lies on another triangle's edge: a ray that should meet one sheet's border may go through.
#[test]
fn a_ray_on_the_border_of_a_mesh_may_miss() {
    let mut sheet = shapes::sphere(DVec3::ZERO, 1.0, 3, 2);
    let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
    sheet.positions = corners.map(|(x, y)| DVec3::new(x, y, 0.3 * x)).to_vec();
    // Behind the border, seen through the gap of two ulp to the next sheet: a floor.
    sheet.positions.extend(corners.map(|(x, y)| DVec3::new(1.0 + 3e-7 + x, y, 0.3)));
    sheet.positions.extend(corners.map(|(x, y)| DVec3::new(3.0 * x - 0.5, 2.0 * y - 0.5, -1.0)));
    sheet.triangles =
        (0..3).flat_map(|k| [[0, 1, 2], [0, 2, 3]].map(|t| t.map(|i| 4 * k + i))).collect();
    let scene = shapes::scene_of(sheet);
    let (settings, shot, oracle) = (Settings::default(), shot(), Oracle::new(&scene));
    let check = Check::new(&scene, &settings, &shot, &oracle, &oracle);
    let mut told = 0;
    for k in 0..64 {
        let share = (f64::from(k) + 0.5) / 64.0;
        // Inside of the border by a thousandth of an ulp.
        let border = scene.meshes[0].positions[1].lerp(scene.meshes[0].positions[2], share as f32);
        let target = border.as_dvec3() - DVec3::X * 1e-10;
        let ray = Ray::new(target + DVec3::new(0.1, 0.2, 1.0), DVec3::new(-0.1, -0.2, -1.0));
        let hits = oracle.all_hits(&ray);
        let Some(behind) = hits.iter().find(|h| h.hit.t > 1.1) else { continue };
        if hits[0].hit.t > 1.1 {
            continue;
        }
        let answers = Answers::Hits { product: Some(behind.hit), oracle: Some(hits[0].hit) };
        let difference = check.judge(&TracedRay { ray, answers }).unwrap();
        assert_eq!(difference.class, Class::EdgeBand, "{share}: {difference:?}");
        told += 1;
    }
    assert!(told > 10, "{told}");
}

/// A ray that passes a silhouette within the band may go on, although the surface behind it is so nearly parallel to the
/// ray that one beside it ends long before. One that is further from the silhouette may not.
#[test]
fn a_ray_at_a_silhouette_may_pass_onto_a_grazed_floor() {
    let corner = |k: u32| [k, k >> 1, k >> 2].map(|k| f64::from(k & 1));
    let corners = (0..8).map(|k| DVec3::from(corner(k)) * DVec3::new(1.0, 1.0, -1.0)).collect();
    let split = |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]];
    let sides =
        [[0, 1, 3, 2], [5, 4, 6, 7], [4, 0, 2, 6], [1, 5, 7, 3], [2, 3, 7, 6], [4, 5, 1, 0]];
    let block = WorldMesh::new("block", corners, sides.map(split).concat(), 0);
    let at = |x, z| DVec3::new(x, -1e-4, z);
    let positions = vec![at(-9.0, 9.0), at(9.0, 9.0), at(9.0, -9.0), at(-9.0, -9.0)];
    let floor = WorldMesh::new("floor", positions, split([0, 1, 2, 3]).to_vec(), 0);
    let mut world = shapes::world_of(block);
    world.meshes.push(floor);
    let scene = world.into_scene(true).unwrap();
    let (settings, shot, oracle) = (Settings::default(), shot(), Oracle::new(&scene));
    let check = Check::new(&scene, &settings, &shot, &oracle, &oracle);
    let edge = [0, 1].map(|k| scene.meshes[0].positions[k].as_dvec3());
    let dir = DVec3::new(0.01, -2e-4, -1.0);
    let class = |target: DVec3, mesh| {
        let ray = Ray::new(target - dir, dir);
        let hits = oracle.all_hits(&ray);
        assert_eq!(hits[0].hit.prim.geom_id, 0);
        let behind = hits.iter().find(|h| h.hit.prim.geom_id == mesh && h.hit.t > 1.01).unwrap();
        let answers = Answers::Hits { product: Some(behind.hit), oracle: Some(hits[0].hit) };
        check.judge(&TracedRay { ray, answers }).unwrap().class
    };
    let above = |y| edge[0].lerp(edge[1], 0.37) + DVec3::Y * y;
    assert_eq!([1e-10, 1e-8].map(|y| class(above(y), 1)), [Class::EdgeBand; 2]);
    assert_eq!(class(above(1e-6), 1), Class::Missed);
    // Through the diagonal of the front onto the back of the bottom.
    let diagonal = [0, 3].map(|k| scene.meshes[0].positions[k].as_dvec3());
    assert_eq!(class(diagonal[0].lerp(diagonal[1], 1e-4), 0), Class::Missed);
}

#[test]
fn a_ray_depends_on_seed_kind_and_number_alone() {
    let scene = sphere();
    let oracle = Oracle::new(&scene);
    let shot = shot();
    let ray = |seed, kind, index| {
        let settings = Settings { seed, ..Settings::default() };
        let check = Check::new(&scene, &settings, &shot, &oracle, &oracle);
        let replay = check.replay(RayId { kind, index }).unwrap();
        assert_eq!(Some(replay.trial.ray), check.ray(RayId { kind, index }));
        replay.trial.ray
    };
    for kind in Kind::ALL {
        assert_eq!(ray(1, kind, 77), ray(1, kind, 77));
        assert_ne!(ray(1, kind, 77), ray(1, kind, 78));
        assert_ne!(ray(1, kind, 77), ray(2, kind, 77));
    }
}

#[test]
fn tallies_do_not_depend_on_threads_and_stop_when_told() {
    let scene = sphere();
    let product = embree(&scene, HitRules { retry: false, ..HitRules::default() });
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| tally(&scene, &product, 500))
    };
    assert_eq!(with(1), with(3));
    let (settings, shot, oracle) = (Settings::default(), shot(), Oracle::new(&scene));
    let check = Check::new(&scene, &settings, &shot, &product, &oracle);
    assert_eq!(check.run(500, &AtomicBool::new(true), &|_| ()).total(), 0);
}
