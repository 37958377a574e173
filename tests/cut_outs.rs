//! Alpha cut-outs: a hole is a hole to every kind of ray and to both intersectors.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

#[path = "cut_outs/closed.rs"]
mod closed;
#[path = "cut_outs/coincident.rs"]
mod coincident;
mod common;
#[path = "common/leaves.rs"]
mod leaves;

use common::{Job, job, pose};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use std::sync::atomic::AtomicBool;
use tweenray::effects::EffectPlan;
use tweenray::film::Film;
use tweenray::intersect::{
    self, EmbreeIntersector, Hit, Intersector, Oracle, Ray, SurfaceInteraction,
};
use tweenray::math::{DVec3, Rgb, Vec2};
use tweenray::scene::{
    AlphaMask, CameraPath, Glass, GlassShadows, HitRules, IntersectorKind, Light, Material,
    PointLight, Pose, QuadLight, Scene, Settings, Shot, Sky, TextureMap, World, WorldMesh,
    WorldSphere,
};
use tweenray::stats::RayCounts;
use tweenray::verify::{Check, Class};

/// A checker of `edge` x `edge` texels; the lower left one is a hole.
fn checker(edge: u32) -> AlphaMask {
    let texel = |k: u32| if (k % edge + k / edge + edge) % 2 == 1 { 0 } else { 255 };
    let texels = (0..edge * edge).map(texel).collect();
    AlphaMask { name: "checker".into(), width: edge, height: edge, texels }
}

/// Whether [`checker`] is there at `(u, v)` of [0, 1], and how far that is from the nearest edge of its texels.
fn at_checker(edge: u32, u: f64, v: f64) -> (bool, f64) {
    let (x, y) = (u * f64::from(edge), v * f64::from(edge));
    let off = |x: f64| (x - x.round()).abs();
    ((x.floor() + y.floor()) as i64 % 2 == 1, off(x).min(off(y)) / f64::from(edge))
}

/// A card with the checker on it.
fn card(corners: [DVec3; 4], material: u32) -> WorldMesh {
    WorldMesh { uvs: Some(leaves::uvs(1)), ..WorldMesh::quad("card", corners, material) }
}

const EDGE: u32 = 4;

/// A black card with holes at z = -2, from -1 to 1 in x and y, before a wall that glows.
fn card_before_a_wall() -> World {
    let mut world = World::default();
    world.masks.push(checker(EDGE));
    let black =
        world.add_material(Material { alpha: Some(TextureMap::of(0)), ..Material::black("card") });
    let glow = Material { emission: Rgb::ONE, emits_back: true, ..Material::black("wall") };
    let glow = world.add_material(glow);
    let square = |half: f64, z: f64| {
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| DVec3::new(x * half, y * half, z))
    };
    world.meshes.push(card(square(1.0, -2.0), black));
    world.meshes.push(WorldMesh::quad("wall", square(20.0, -4.0), glow));
    world
}

/// What is seen along a ray by [`card_before_a_wall`], and how sure that is: the distance on the card from the
/// nearest edge.
fn seen(org: DVec3, dir: DVec3) -> (f32, f64) {
    let p = org + dir * ((-2.0 - org.z) / dir.z);
    let (u, v) = (0.5 * (p.x + 1.0), 0.5 * (p.y + 1.0));
    let rim = u.min(1.0 - u).min(v).min(1.0 - v);
    if rim < 0.0 {
        return (1.0, -rim);
    }
    let (there, off) = at_checker(EDGE, u, v);
    (if there { 0.0 } else { 1.0 }, off.min(rim))
}

/// Renders with both intersectors and holds each pixel to `expected(its direction)`, but for those within
/// `unsure` of an edge of the card. Gives the share of pixels that were held.
fn hold(mut job: Job, unsure: f64, expected: impl Fn(DVec3) -> (f32, f64)) -> f64 {
    job.settings.bounces = 4;
    let mut held = 0;
    for intersector in [IntersectorKind::Embree, IntersectorKind::Oracle] {
        job.settings.intersector = intersector;
        let (film, _) = common::render(&job);
        for (x, y, colour) in common::pixels(&film) {
            let dir = job.camera.direction(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let (light, off) = expected(dir);
            if off > unsure {
                assert!((colour.x - light).abs() < 1e-4, "{intersector:?} {x} {y}: {colour}");
                held += 1;
            }
        }
    }
    f64::from(held) / f64::from(2 * job.settings.width * job.settings.height)
}

#[test]
fn the_camera_sees_through_holes() {
    let eye = DVec3::new(0.1, -0.2, 2.0);
    let job = job(card_before_a_wall(), pose(eye.into(), (0.0, 0.0, -2.0)), 96, 96);
    assert!(hold(job, 1e-6, |dir| seen(eye, dir)) > 0.999);
}

#[test]
fn a_mirror_shows_what_is_behind_holes() {
    // A mirror at z = 3 behind a camera at the origin that looks at it.
    for (roughness, unsure) in [(0.0, 1e-6), (0.001, 0.03)] {
        let mut world = card_before_a_wall();
        // A sky in place of the wall, which is a light that a rough mirror samples: with noise.
        world.meshes.pop();
        world.sky = Sky { radiance: Rgb::ONE, lights: false, ..world.sky };
        let mirror = Material { roughness, ..Material::mirror("mirror", Rgb::ONE) };
        let mirror = world.add_material(mirror);
        let corners = [(-9.0, -9.0), (-9.0, 9.0), (9.0, 9.0), (9.0, -9.0)];
        let corners = corners.map(|(x, y)| DVec3::new(x, y, 3.0));
        world.meshes.push(WorldMesh::quad("mirror", corners, mirror));
        let job = job(world, pose((0.0, 0.0, 0.0), (0.05, 0.1, 3.0)), 96, 96);
        let turned = |p: DVec3| DVec3::new(p.x, p.y, -p.z);
        let held = hold(job, unsure, |dir| seen(DVec3::new(0.0, 0.0, 6.0), turned(dir)));
        assert!(held > 0.5, "{held}");
    }
}

#[test]
fn glass_shows_what_is_behind_holes() {
    // Of air's index of refraction, so that nothing is bent or reflected.
    let mut world = card_before_a_wall();
    let glass = world.add_material(Material::glass("pane", 1.0));
    world.meshes.push(common::cube(DVec3::new(0.0, 0.0, -0.5), 1.2, glass));
    let eye = DVec3::new(0.1, -0.2, 2.0);
    let job = job(world, pose(eye.into(), (0.0, 0.0, -2.0)), 96, 96);
    assert!(hold(job, 1e-4, |dir| seen(eye, dir)) > 0.99);
}

#[test]
fn a_thin_pane_has_holes() {
    let eye = DVec3::new(0.1, -0.2, 2.0);
    for roughness in [0.0, 0.3] {
        let mut world = card_before_a_wall();
        // Of air's index of refraction, so that nothing is reflected.
        let tint = Rgb::splat(0.25);
        let pane = Glass { tint, roughness, thin: true, ..Glass::clear(1.0) };
        world.materials[0].glass = Some(pane);
        let job = job(world, pose(eye.into(), (0.0, 0.0, -2.0)), 96, 96);
        // A rough pane scatters light of the lamp, with noise: its holes alone are held.
        let unsure = |(light, off): (f32, f64)| match (light, roughness) {
            (1.0, _) => (1.0, off),
            (_, 0.0) => (0.25, off),
            _ => (0.25, 0.0),
        };
        assert!(hold(job, 1e-6, |dir| unsure(seen(eye, dir))) > 0.6);
    }
}

/// A white floor, a card at half the lamp's height, and a camera that looks at the floor below it.
fn card_above_a_floor(light: Light) -> Job {
    let mut world = World::default();
    world.masks.push(checker(EDGE));
    let black =
        world.add_material(Material { alpha: Some(TextureMap::of(0)), ..Material::black("card") });
    let white = world.add_material(Material::diffuse("floor", Rgb::ONE));
    let square = |half: f64, y: f64| {
        [(-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)]
            .map(|(x, z)| DVec3::new(x * half, y, z * half))
    };
    world.meshes.push(card(square(1.0, 2.0), black));
    world.meshes.push(WorldMesh::quad("floor", square(9.0, 0.0), white));
    world.lights.push(light);
    job(world, pose((0.0, 1.8, 3.5), (0.0, 0.0, 0.0)), 96, 96)
}

#[test]
fn light_falls_through_holes() {
    light_falls_through_holes_and(0.0, None);
}

#[test]
fn light_that_goes_straight_through_a_thin_pane_is_whole_where_it_has_holes() {
    let pane = Glass { tint: Rgb::splat(0.25), thin: true, ..Glass::clear(1.0) };
    light_falls_through_holes_and(0.25, Some(pane));
}

/// Holds the floor below a card of this glass, or a black one, which lets the share `passed` of light through.
fn light_falls_through_holes_and(passed: f32, glass: Option<Glass>) {
    let lamp = DVec3::new(0.0, 4.0, 0.0);
    let light = PointLight { position: lamp, intensity: Rgb::splat(16.0) };
    let mut job = card_above_a_floor(Light::Point(light));
    job.world.materials[0].glass = glass;
    job.settings.glass_shadows = GlassShadows::Straight;
    let eye = job.camera.eye;
    let held = hold(job, 1e-4, |dir| {
        if dir.y > -0.1 {
            return (0.0, 0.0);
        }
        let p = eye - dir * (eye.y / dir.y);
        if p.abs().max_element() > 8.0 {
            return (0.0, 0.0);
        }
        // The card's shadow is twice its size.
        let (u, v) = (0.25 * (p.x + 2.0), 0.25 * (2.0 - p.z));
        let rim = u.min(1.0 - u).min(v).min(1.0 - v);
        let (there, off) = at_checker(EDGE, u, v);
        let to_lamp = lamp - p;
        let lit = 16.0 * to_lamp.normalize().y / to_lamp.length_squared();
        let light = lit / std::f64::consts::PI;
        let share = if rim > 0.0 && there { passed } else { 1.0 };
        (share * light as f32, off.min(rim.abs()))
    });
    assert!(held > 0.5, "{held}");
}

#[test]
fn the_shadow_of_an_area_light_is_that_of_the_card_without_its_holes() {
    // The same card, its holes left out of the mesh: sixteen squares, eight of them there.
    let light = || {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let corners = corners.map(|(x, z)| DVec3::new(0.3 * x, 4.0, 0.3 * z));
        Light::Quad(QuadLight { corners, radiance: Rgb::splat(9.0), two_sided: true })
    };
    let mut masked = card_above_a_floor(light());
    masked.settings.shadow_samples = 64;
    let mut cut = masked.clone();
    cut.world.meshes.remove(0);
    cut.world.materials[0].alpha = None;
    let size = 2.0 / f64::from(EDGE);
    for k in (0..EDGE * EDGE).filter(|k| (k % EDGE + k / EDGE) % 2 == 1) {
        let (x, z) = (f64::from(k % EDGE) * size - 1.0, 1.0 - f64::from(k / EDGE) * size);
        let corners = [(x, z), (x + size, z), (x + size, z - size), (x, z - size)];
        cut.world.meshes.push(common::quad(corners.map(|(x, z)| DVec3::new(x, 2.0, z)), 0));
    }
    let (masked, cut) = (common::render(&masked).0, common::render(&cut).0);
    let differ = masked.rgb.iter().zip(&cut.rgb).filter(|(a, b)| (**a - **b).length() > 0.01);
    // A sample ray through the very edge of a square may go either way.
    assert!(differ.count() <= masked.rgb.len() / 1000);
    assert!(masked.rgb.iter().any(|c| c.x > 0.01), "something is lit");
}

/// The same, of which each mesh has its texture coordinates as set 1, by which the masks lie, and none of use as set 0.
fn by_the_second_set(mut job: Job) -> Job {
    for mesh in &mut job.world.meshes {
        let uvs = mesh.uvs.take();
        mesh.uvs = uvs.clone().map(|mut uvs| {
            uvs.values.fill(Vec2::splat(0.3));
            uvs
        });
        mesh.more_uvs = vec![uvs];
    }
    job.world.materials.iter_mut().flat_map(|m| &mut m.alpha).for_each(|map| map.uv_set = 1);
    job
}

#[test]
fn holes_lie_by_the_set_that_the_mask_names() {
    let before = job(card_before_a_wall(), pose((0.1, -0.2, 2.0), (0.0, 0.0, -2.0)), 48, 48);
    let mut mirrored = job(card_before_a_wall(), pose((0.0, 0.0, 0.0), (0.05, 0.1, 3.0)), 48, 48);
    let mirror = mirrored.world.add_material(Material::mirror("mirror", Rgb::ONE));
    let corners = [(-9.0, -9.0), (-9.0, 9.0), (9.0, 9.0), (9.0, -9.0)];
    let corners = corners.map(|(x, y)| DVec3::new(x, y, 3.0));
    mirrored.world.meshes.push(WorldMesh::quad("mirror", corners, mirror));
    let light = PointLight { position: DVec3::new(0.0, 4.0, 0.0), intensity: Rgb::splat(16.0) };
    let shadowed = card_above_a_floor(Light::Point(light));
    for first in [before, mirrored, shadowed] {
        let mut second = by_the_second_set(first.clone());
        let mut none = second.clone();
        none.world.meshes.iter_mut().for_each(|mesh| mesh.more_uvs.clear());
        for intersector in [IntersectorKind::Embree, IntersectorKind::Oracle] {
            let shown = |job: &mut Job| {
                job.settings.intersector = intersector;
                common::render(job).0.rgb
            };
            let expected = shown(&mut first.clone());
            assert!(shown(&mut second) == expected, "{intersector:?}");
            // Not vacuous: without the set there are no holes.
            assert!(shown(&mut none) != expected, "{intersector:?}");
        }
    }
}

/// A cube of leaf cards around the origin, and a sphere and a closed mesh with leaves cut out.
fn thicket(cut: bool) -> Scene {
    let mut rng = Pcg64::seed_from_u64(3);
    let middles: Vec<DVec3> = (0..600).map(|_| leaves::in_ball(&mut rng) * 3.0).collect();
    let mut world = World::default();
    let white = Material::diffuse("leaf", Rgb::ONE);
    let leaf = world.add_material(Material { alpha: cut.then(|| TextureMap::of(0)), ..white });
    world.masks.push(leaves::mask(32));
    world.meshes.push(leaves::cards(&middles, 0.4, &mut rng));
    world.spheres.push(WorldSphere::new("ball", DVec3::new(0.5, 0.2, -0.3), 1.0, leaf));
    let white = world.add_material(Material::diffuse("white", Rgb::ONE));
    world.spheres.push(WorldSphere::new("core", DVec3::new(-1.0, 0.0, 0.5), 0.5, white));
    world.into_scene(true).unwrap()
}

fn rays(seed: u64, count: usize) -> Vec<Ray> {
    let mut rng = Pcg64::seed_from_u64(seed);
    let ray = |_| {
        // From within, from beside and from so far that Embree sees the ray moved.
        let far = [0.5, 3.0, 5000.0][rng.random_range(0..3)];
        let org = leaves::in_ball(&mut rng) * far;
        let dir = leaves::in_ball(&mut rng) * 0.8 - org;
        Ray { tfar: if rng.random() { f64::INFINITY } else { 0.9 }, ..Ray::new(org, dir) }
    };
    (0..count).map(ray).collect()
}

fn hits_of(intersector: &dyn Intersector, rays: &[Ray]) -> Vec<Option<Hit>> {
    let mut hits = vec![None; rays.len()];
    intersector.intersect_batch(rays, &mut hits, &mut RayCounts::default());
    hits
}

/// Holds Embree for two instruction sets to the oracle, ray by ray, alone and in a batch. Gives the oracle's hits.
fn hold_to_oracle(scene: &Scene, rays: &[Ray]) -> Vec<Option<Hit>> {
    let oracle = Oracle::new(scene);
    let expected = hits_of(&oracle, rays);
    let mut blocked = vec![false; rays.len()];
    let counts = &mut RayCounts::default();
    oracle.occluded_batch(rays, &mut blocked, counts);
    for isa in [None, Some("sse2")] {
        let embree = EmbreeIntersector::new(scene, HitRules::default(), isa, 1).unwrap();
        let found = hits_of(&embree, rays);
        let mut occluded = vec![false; rays.len()];
        embree.occluded_batch(rays, &mut occluded, counts);
        for (k, (ray, expected)) in rays.iter().zip(&expected).enumerate() {
            let alone = embree.intersect(ray, counts);
            for found in [&found[k], &alone] {
                let same = found.map(|h| h.prim) == expected.map(|h| h.prim);
                assert!(same, "{isa:?} {k}: {ray:?}: {found:?}, not {expected:?}");
                if let (Some(found), Some(expected)) = (found, expected) {
                    let [a, b] =
                        [found, expected].map(|h| SurfaceInteraction::new(scene, ray, h).p);
                    assert!(a.distance(b) < 1e-9, "{isa:?} {k}: {ray:?}: {a} and {b}");
                }
            }
            assert_eq!(occluded[k], blocked[k], "{isa:?} {k}: {ray:?}");
            assert_eq!(embree.occluded(ray, counts), blocked[k], "{isa:?} {k}: {ray:?}");
        }
    }
    expected
}

/// The rays that leave what `rays` hit, each in a random direction.
fn leaving(scene: &Scene, rays: &[Ray], hits: &[Option<Hit>], seed: u64) -> Vec<Ray> {
    let mut rng = Pcg64::seed_from_u64(seed);
    let leave = |(ray, hit): (&Ray, &Option<Hit>)| {
        let si = SurfaceInteraction::new(scene, ray, hit.as_ref()?);
        Some(si.spawn(leaves::in_ball(&mut rng), true))
    };
    rays.iter().zip(hits).filter_map(leave).collect()
}

#[test]
fn both_intersectors_see_the_same_holes() {
    let scene = thicket(true);
    let rays = rays(11, 12_000);
    let expected = hold_to_oracle(&scene, &rays);
    // Not vacuous: without the holes every other ray hits something else.
    let whole = thicket(false);
    let others = hits_of(&Oracle::new(&whole), &rays);
    let differ =
        others.iter().zip(&expected).filter(|(a, b)| a.map(|h| h.prim) != b.map(|h| h.prim));
    assert!(differ.count() > rays.len() / 5);
}

#[test]
fn verify_finds_no_fault_and_sees_an_intersector_without_holes() {
    let scene = thicket(true);
    let (settings, oracle) = (Settings::default(), Oracle::new(&scene));
    let pose = Pose {
        eye: DVec3::new(0.1, 0.2, 5.0),
        target: DVec3::ZERO,
        up: DVec3::Y,
        roll_degrees: 0.0,
    };
    let shot = Shot::new(CameraPath::Still(pose), 1, 60.0);
    let tally = |product: &dyn Intersector| {
        let check = Check::new(&scene, &settings, &shot, product, &oracle);
        check.run(1024, &AtomicBool::new(false), &|_| ())
    };
    let embree = EmbreeIntersector::new(&scene, HitRules::default(), None, 1).unwrap();
    let right = tally(&embree);
    for class in Class::ALL.into_iter().filter(|class| !class.is_explained()) {
        assert_eq!(right.count(class), 0, "{class:?}");
    }
    let whole = thicket(false);
    let blind = EmbreeIntersector::new(&whole, HitRules::default(), None, 1).unwrap();
    let wrong = tally(&blind);
    assert!(wrong.count(Class::Phantom) > 500 && wrong.count(Class::FalseShadow) > 20, "{wrong:?}");
}

#[test]
fn of_cards_at_one_place_the_lowest_that_is_there_is_hit() {
    // Three cards and two without holes, in one place, wound alike and not: the first has the checker, the second
    // the checker's negative in its lower half, the third nothing but holes.
    let mut world = World::default();
    let negative = |y: u32, x: u32| if y >= 2 && (x + y) % 2 == 1 { 255 } else { 0 };
    let half = (0..16).map(|k| negative(k / 4, k % 4)).collect();
    world.masks.push(checker(EDGE));
    world.masks.push(AlphaMask { name: "half".into(), width: 4, height: 4, texels: half });
    world.masks.push(AlphaMask { name: "none".into(), width: 1, height: 1, texels: vec![0] });
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let corners = corners.map(|(x, y)| DVec3::new(x, y, 0.0));
    for alpha in [Some(0), Some(1), Some(2), None, None] {
        let white =
            Material { alpha: alpha.map(TextureMap::of), ..Material::diffuse("white", Rgb::ONE) };
        let material = world.add_material(white);
        world.meshes.push(card(corners, material));
    }
    let scene = world.into_scene(true).unwrap();
    let oracle = Oracle::new(&scene);
    let embree = EmbreeIntersector::new(&scene, HitRules::default(), None, 1).unwrap();
    let counts = &mut RayCounts::default();
    let scale = scene.meshes[0].bounds.extent().x / 2.0;
    let mut seen = [0; 5];
    for k in 0..1600 {
        let (x, y) = (f64::from(k % 40) / 20.0 - 0.973, f64::from(k / 40) / 20.0 - 0.979);
        for side in [1.0, -1.0] {
            let ray = Ray::new(DVec3::new(x * scale, y * scale, side), DVec3::Z * -side);
            let expected = oracle.intersect(&ray, counts).unwrap();
            assert_eq!(embree.intersect(&ray, counts).unwrap().prim, expected.prim, "{x} {y}");
            seen[expected.prim.geom_id as usize] += 1;
            // What leaves the card meets none of the others, on either side.
            let si = SurfaceInteraction::new(&scene, &ray, &expected);
            for dir in [ray.dir, -ray.dir] {
                let leaving = si.spawn(dir, true);
                assert!(!embree.occluded(&leaving, counts) && !oracle.occluded(&leaving, counts));
            }
        }
    }
    assert!(seen[0] == 1600 && seen[1] > 400 && seen[3] > 500, "{seen:?}");
    assert_eq!((seen[2], seen[4]), (0, 0));
}

#[test]
fn a_ray_through_a_hole_of_a_sphere_meets_its_far_side() {
    // Longitudes in eight stripes: the first from -z towards -x is a hole.
    let mut world = World::default();
    let texels = [0, 255].repeat(4);
    world.masks.push(AlphaMask { name: "stripes".into(), width: 8, height: 1, texels });
    let white = Material { alpha: Some(TextureMap::of(0)), ..Material::diffuse("white", Rgb::ONE) };
    let white = world.add_material(white);
    world.spheres.push(WorldSphere::new("ball", DVec3::ZERO, 1.0, white));
    let scene = world.into_scene(true).unwrap();
    let embree = EmbreeIntersector::new(&scene, HitRules::default(), None, 1).unwrap();
    let oracle = Oracle::new(&scene);
    let counts = &mut RayCounts::default();
    let radius = scene.spheres[0].radius;
    let (mut far, mut through) = (0, 0);
    for k in 0..3600 {
        let angle = f64::from(k).to_radians() / 10.0 + 1e-3;
        // Past the middle, so that entry and exit lie in stripes of either kind.
        let towards = DVec3::new(angle.cos(), 0.1, angle.sin()) * radius;
        let aside = DVec3::new(-angle.sin(), 0.0, angle.cos()) * (0.3 * radius);
        let ray = Ray::new(towards * 3.0 + aside, -towards);
        let there = |t: f64| {
            let p = ray.at(t);
            let u = 0.75 - p.z.atan2(p.x) / std::f64::consts::TAU;
            (u.rem_euclid(1.0) * 8.0) as u32 % 2 == 1
        };
        let (a, b) = (ray.dir.length_squared(), ray.org.dot(ray.dir));
        let root = (b * b - a * (ray.org.length_squared() - radius * radius)).sqrt();
        let roots = [(-b - root) / a, (-b + root) / a];
        let expected = roots.into_iter().find(|t| there(*t));
        for intersector in [&embree as &dyn Intersector, &oracle] {
            let found = intersector.intersect(&ray, counts).map(|hit| hit.t);
            let same = match (found, expected) {
                (Some(a), Some(b)) => (a - b).abs() < 1e-9,
                (a, b) => a == b,
            };
            assert!(same, "{k}: {found:?} {expected:?}");
            assert_eq!(intersector.occluded(&ray, counts), expected.is_some());
        }
        far += u32::from(expected == Some(roots[1]));
        through += u32::from(expected.is_none());
    }
    assert!(far > 500 && through > 200, "{far} {through}");
}

#[test]
fn a_mesh_without_coordinates_has_no_holes() {
    let mut world = card_before_a_wall();
    world.masks[0].texels.fill(0);
    world.meshes[0].uvs = None;
    let scene = world.into_scene(true).unwrap();
    let embree = EmbreeIntersector::new(&scene, HitRules::default(), None, 1).unwrap();
    let p = scene.meshes[0].bounds.centre() + DVec3::new(0.01, 0.02, 0.0);
    let ray = Ray::new(p + DVec3::Z, DVec3::NEG_Z);
    for intersector in [&embree as &dyn Intersector, &Oracle::new(&scene)] {
        let hit = intersector.intersect(&ray, &mut RayCounts::default()).unwrap();
        assert_eq!(hit.prim.geom_id, 0);
    }
}

fn forest_job(cut: bool) -> Job {
    let mut world = leaves::forest(2, 150, cut);
    world.sky.radiance = Rgb::new(0.3, 0.4, 0.6);
    world.sky.lights = true;
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let corners = corners.map(|(x, z)| DVec3::new(x, 9.0, z));
    let radiance = Rgb::splat(20.0);
    world.lights.push(Light::Quad(QuadLight { corners, radiance, two_sided: false }));
    let mut job = job(world, pose((0.5, 3.0, 7.0), (0.0, 1.5, 0.0)), 72, 40);
    (job.settings.spp, job.settings.shadow_samples, job.settings.sky_samples) = (2, 4, 2);
    job
}

fn on_threads(job: &Job, threads: usize) -> Film {
    let scene = job.world.clone().into_scene(true).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let intersector = intersect::build(&scene, &job.settings, threads).unwrap();
    let renderer = tweenray::shade::Renderer::new(&scene, &job.settings, &*intersector);
    let stop = AtomicBool::new(false);
    pool.install(|| renderer.render(&job.camera, 1, true, &stop, &())).unwrap().0
}

#[test]
fn any_number_of_threads_cuts_the_same_bytes() {
    let job = forest_job(true);
    let one = on_threads(&job, 1);
    assert_ne!(one, on_threads(&forest_job(false), 1), "the holes are seen");
    for threads in [2, 3, 5] {
        assert_eq!(one, on_threads(&job, threads), "{threads} threads");
    }
}

#[test]
fn a_mask_without_holes_changes_no_byte() {
    let whole = on_threads(&forest_job(false), 1);
    let mut masked = forest_job(true);
    masked.world.masks[0].texels.fill(255);
    assert_eq!(whole, on_threads(&masked, 2));
}

#[test]
fn the_effect_plan_says_whether_rays_pass_through_holes() {
    let pose = Pose { eye: DVec3::Z, target: DVec3::ZERO, up: DVec3::Y, roll_degrees: 0.0 };
    let lens = Shot::new(CameraPath::Still(pose), 1, 60.0).lens;
    for (cut, why) in
        [(true, "1 material with alpha in use, holes in 2 of 3 surfaces"), (false, "0 ")]
    {
        let reasons = EffectPlan::reasons(&thicket(cut), &Settings::default(), &lens);
        let reason = reasons.iter().find(|reason| reason.effect == "alpha cut-outs").unwrap();
        assert_eq!(reason.runs, cut);
        assert!(reason.why.starts_with(why), "{}", reason.why);
    }
}

#[test]
fn the_floating_point_mode_is_what_it_was() {
    let scene = thicket(true);
    let embree = EmbreeIntersector::new(&scene, HitRules::default(), None, 1).unwrap();
    let before = tweenray::embree::floating_point_mode();
    hits_of(&embree, &rays(5, 500));
    assert_eq!(tweenray::embree::floating_point_mode(), before);
}
