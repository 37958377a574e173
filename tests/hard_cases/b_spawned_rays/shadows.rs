//! Shadow rays: no light through walls, no gap at the foot of a shadow.

use crate::common;
use crate::shapes;
use crate::suite::{self, Outcome, Size};
use rand::Rng;
use rayon::prelude::*;
use tweenray::intersect::{
    EmbreeIntersector, Hit, Intersector, PlaneError, PrimRef, Ray, RayEnd, SpawnPoint,
    SurfaceInteraction, lift_to_smooth,
};
use tweenray::math::{DQuat, DVec3, Rgb};
use tweenray::scene::{
    Corners, DirectionalLight, HitRules, Light, Material, Scene, SphereLight, World, WorldMesh,
};
use tweenray::stats::RayCounts;

/// Hits that are made up have no ray.
const ANY_RAY: Ray = Ray {
    org: DVec3::ZERO,
    dir: DVec3::X,
    tnear: 0.0,
    tfar: f64::INFINITY,
    exclude: PrimRef::NONE,
};

/// Shadow rays from the walls of closed rooms to lights outside: all are blocked.
pub fn closed_box(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let rays = size.of(30_000, 8_400_000);
    let askew = DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -2.0);
    for (how, turn) in [("straight", DQuat::IDENTITY), ("askew", askew)] {
        let room = room(turn, Some(1e-3));
        let lit = lit(&room, rays, |scene, hit, si, _| {
            si.shadow_start(inwards(si), lift_to_smooth(scene, &ANY_RAY, hit, si, false), true)
        });
        outcome.show(format!("box with walls of 1e-3, {how}: {} of {} lit", lit.0, lit.1));
        outcome.count(lit.1, lit.0);
        // Without thickness a corner may be seen through: only shown.
        let paper = self::room(turn, None);
        let thin =
            self::lit(&paper, rays, |_, _, si, _| si.shadow_start(inwards(si), DVec3::ZERO, true));
        outcome.show(format!("walls without thickness, {how}: {} of {} lit", thin.0, thin.1));
    }
    // Smooth normals let a light shine from below a facet's plane. Both kinds of room have walls
    // without thickness here.
    for (columns, rows) in [(8, 8), (64, 32)] {
        let dome = dome(columns, rows);
        let ours = lit(&dome, rays, |scene, hit, si, _| {
            si.shadow_start(inwards(si), lift_to_smooth(scene, &ANY_RAY, hit, si, false), true)
        });
        let naive = lit(&dome, rays, |_, _, si, dir| {
            let front = if si.is_outside(dir) { si.ng } else { -si.ng };
            si.shadow_start(front, DVec3::ZERO, true)
        });
        // Shadow rays have no second try, so a wall without thickness leaks at its edges now and then.
        let leak = ours.0 as f64 / ours.1 as f64;
        outcome.at_most(&format!("lit in a dome of {columns} x {rows}, share"), leak, 2e-6);
        let share = 100.0 * naive.0 as f64 / naive.1 as f64;
        outcome.show(format!(
            "smooth dome of {columns} x {rows}: {} of {} lit; started on the light's side {share:.3} %",
            ours.0, ours.1
        ));
        if columns == 8 {
            outcome.at_least("lit where rays start on the light's side, %", share, 0.01);
        }
    }
    outcome
}

/// The normal into the room: all meshes here face outwards.
fn inwards(si: &SurfaceInteraction) -> DVec3 {
    -si.ng
}

/// A closed cube of half edge 1, `wall` thick outwards.
fn room(turn: DQuat, wall: Option<f64>) -> Scene {
    let mut world = World::default();
    world.materials.push(Material::diffuse("white", Rgb::ONE));
    world.meshes.push(grid_cube(turn, 1.0));
    if let Some(wall) = wall {
        world.meshes.push(grid_cube(turn, 1.0 + wall));
    }
    world.into_scene(true).unwrap()
}

/// A cube of 6 · 4 · 4 squares, faces outwards, welded.
fn grid_cube(turn: DQuat, half: f64) -> WorldMesh {
    const N: i32 = 4;
    let mut positions: Vec<DVec3> = Vec::new();
    let mut index = std::collections::HashMap::new();
    let mut triangles = Vec::new();
    let mut at = |p: [i32; 3]| {
        *index.entry(p).or_insert_with(|| {
            positions.push(turn * DVec3::from_array(p.map(|c| f64::from(c) / f64::from(N) * half)));
            positions.len() as u32 - 1
        })
    };
    for axis in 0..3 {
        for side in [-N, N] {
            for i in (-N..N).step_by(2) {
                for j in (-N..N).step_by(2) {
                    let mut corner = |a: i32, b: i32| {
                        let mut p = [0; 3];
                        (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side, a, b);
                        at(p)
                    };
                    let quad =
                        [corner(i, j), corner(i + 2, j), corner(i + 2, j + 2), corner(i, j + 2)];
                    let [a, b, c, d] = quad;
                    let faces = [[a, b, c], [a, c, d]];
                    let flip = |[a, b, c]: [u32; 3]| [a, c, b];
                    triangles.extend(if side > 0 { faces } else { faces.map(flip) });
                }
            }
        }
    }
    common::mesh(positions, triangles, 0)
}

/// A closed sphere with the normals of a true one.
fn dome(columns: u32, rows: u32) -> Scene {
    let mut mesh = shapes::sphere(DVec3::ZERO, 1.0, columns, rows);
    let values = mesh.positions.iter().map(|p| p.normalize().as_vec3()).collect();
    mesh.normals = Some(Corners { values, corners: None });
    shapes::scene_of(mesh)
}

/// Shadow rays that are not blocked, of how many: from points of the first mesh, those at corners
/// and edges among them, to points outside that the shading normal sees.
fn lit(
    scene: &Scene,
    rays: u64,
    start: impl Fn(&Scene, &Hit, &SurfaceInteraction, DVec3) -> SpawnPoint + Sync,
) -> (u64, u64) {
    let embree = EmbreeIntersector::new(scene, HitRules::default(), suite::isa(), 4).unwrap();
    let mesh = &scene.meshes[0];
    let radius = scene.bounds.extent().length();
    let batch = |batch: u64| {
        let mut shadow = Vec::new();
        for i in batch * suite::BATCH..((batch + 1) * suite::BATCH).min(rays) {
            let mut rng = suite::rng(29, i);
            let (a, b) = (rng.random::<f64>(), rng.random::<f64>());
            let (u, v) = match i % 6 {
                0 => (0.0, 0.0),
                1 => (1.0, 0.0),
                2 => (a, 0.0),
                3 => (a, 1.0 - a),
                _ if a + b > 1.0 => (1.0 - a, 1.0 - b),
                _ => (a, b),
            };
            let prim =
                PrimRef { geom_id: 0, prim_id: rng.random_range(0..mesh.triangles.len()) as u32 };
            let hit = Hit { t: 1.0, u, v, prim, rough: false };
            let si = SurfaceInteraction::new(scene, &ANY_RAY, &hit);
            let target = shapes::direction(&mut rng) * radius;
            if (target - si.p).dot(-si.ns) > 0.0 {
                let end = RayEnd {
                    point: target,
                    normal: target.normalize(),
                    plane_error: PlaneError::EXACT,
                };
                shadow.push(start(scene, &hit, &si, target - si.p).to(&end));
            }
        }
        let mut occluded = vec![false; shadow.len()];
        embree.occluded_batch(&shadow, &mut occluded, &mut RayCounts::default());
        (occluded.iter().filter(|o| !**o).count() as u64, shadow.len() as u64)
    };
    let batches = (0..rays.div_ceil(suite::BATCH)).into_par_iter();
    batches.map(batch).reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1))
}

/// A cube on a plane, from far to near: its shadow begins at its foot.
pub fn contact(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let edge = size.of(64, 256);
    let directional = |up: f64| {
        Light::Directional(DirectionalLight {
            to_light: DVec3::new(-1.0, up, 0.2).normalize(),
            irradiance: Rgb::splat(3.0),
        })
    };
    let sphere = Light::Sphere(SphereLight {
        centre: DVec3::new(-6.0, 5.0, 1.0),
        radius: 0.3,
        radiance: Rgb::splat(50.0),
    });
    let lights = [("low sun", directional(0.2)), ("high sun", directional(1.5)), ("lamp", sphere)];
    for (name, light) in lights {
        let (mut widest, mut pixels, mut lit_elsewhere) = (0, 0u64, 0u64);
        // From far away the sunlit ground shows.
        lit_elsewhere += gap_at_foot(&light, 0.05, edge.max(128)).2;
        for zoom in 0..8 {
            // Metres a pixel, whatever the image's size: 1e-4, 2e-4, ... 1.28e-2.
            let pixel = 1e-4 * f64::from(1 << zoom);
            let (gap, checked, _) = gap_at_foot(&light, pixel, edge);
            outcome.check(gap <= 1, || format!("{name}, {pixel:e} m/px: a gap of {gap} px"));
            widest = widest.max(gap);
            pixels += checked;
        }
        outcome.show(format!("{name}: widest gap {widest} px at 8 zooms ({pixels} pixels)"));
        // Else the light does not shine at all.
        outcome.at_least(
            &format!("{name}: pixels lit beyond the shadow"),
            lit_elsewhere as f64,
            1.0,
        );
    }
    outcome
}

/// The widest lit gap in any column between the cube's foot and its shadow, how many pixels of
/// shadow were looked at, and how many pixels are lit.
fn gap_at_foot(light: &Light, pixel: f64, edge: u32) -> (u32, u64, u64) {
    let mut world = World::default();
    world.materials.push(Material::diffuse("white", Rgb::ONE));
    let ground = |x: f64, z: f64| DVec3::new(x * 1000.0, 0.0, z * 1000.0);
    let corners = [ground(-1.0, -1.0), ground(-1.0, 1.0), ground(1.0, 1.0), ground(1.0, -1.0)];
    world.meshes.push(common::quad(corners, 0));
    world.meshes.push(common::cube(DVec3::Y * 0.5, 0.5, 0));
    world.lights.push(light.clone());
    let distance = pixel * f64::from(edge) / (2.0 * 20f64.to_radians().tan());
    let foot = DVec3::new(0.5, 0.0, 0.0);
    let eye = foot + DVec3::new(0.8, 0.6, 0.0) * distance;
    let pose = common::pose(eye.into(), foot.into());
    let job = common::job(world, pose, edge, edge);
    let (film, _) = common::render(&job);
    let (mut widest, mut checked, mut lit) = (0, 0, 0);
    for x in 0..edge {
        let mut gap = 0;
        // Downwards, away from the foot.
        for y in 0..edge {
            let at = common::on_plane_y(&job, x, y, 0.0);
            let bright = film.rgb[film.index(x, y)].max_element() > 0.0;
            lit += u64::from(bright);
            // Within the shadow of all these lights, and of what the image shows of the ground.
            let in_shadow = at.x > 0.5 && at.x < 0.9 && at.z.abs() < 0.25;
            if in_shadow {
                checked += 1;
                gap += u32::from(bright);
            }
        }
        widest = widest.max(gap);
    }
    (widest, checked, lit)
}
