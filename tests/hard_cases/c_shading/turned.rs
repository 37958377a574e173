//! The same picture by another way: the world turned or the camera, faces wound either way.

use crate::common::{self, Job};
use crate::shapes;
use crate::suite::{Outcome, Size};
use tweenray::film::Film;
use tweenray::math::{DAffine3, DMat3, DVec3, Rgb};
use tweenray::scene::{
    Camera, DirectionalLight, Glass, Light, Material, PointLight, Pose, QuadLight, Sky,
    SphereLight, World, WorldMesh,
};

const EYE: DVec3 = DVec3::new(1.0, 1.2, 4.0);

/// Smooth ball, cube, glass ball of triangles and mirror quad over a floor; every kind of light.
fn world() -> World {
    let mut world = World::default();
    let glass = Glass { tint: Rgb::new(0.9, 1.0, 0.95), ..Glass::clear(1.5) };
    world.materials = vec![
        Material::diffuse("floor", Rgb::new(0.7, 0.6, 0.5)),
        Material::diffuse("ball", Rgb::new(0.3, 0.6, 0.9)),
        Material { glass: Some(glass), ..Material::black("glass") },
        Material { mirror: Rgb::splat(0.8), ..Material::black("mirror") },
    ];
    let p = DVec3::new;
    let floor = [p(-3.0, -1.0, 3.0), p(3.0, -1.0, 3.0), p(3.0, -1.0, -3.0), p(-3.0, -1.0, -3.0)];
    let back = [p(-3.0, -1.0, -2.5), p(3.0, -1.0, -2.5), p(3.0, 2.0, -2.5), p(-3.0, 2.0, -2.5)];
    world.meshes = vec![
        common::quad(floor, 0),
        smooth(DVec3::new(-1.0, -0.3, 0.0), 0.7, 1),
        common::cube(DVec3::new(0.9, -0.6, -0.9), 0.4, 1),
        smooth(DVec3::new(0.8, -0.4, 0.9), 0.6, 2),
        common::quad(back, 3),
    ];
    let lamp = [p(-0.5, 3.0, -0.5), p(0.5, 3.0, -0.5), p(0.5, 3.0, 0.5), p(-0.5, 3.0, 0.5)];
    let radiance = Rgb::splat(6.0);
    world.lights = vec![
        Light::Quad(QuadLight { corners: lamp, radiance, two_sided: false }),
        Light::Sphere(SphereLight { centre: p(-2.0, 2.0, 2.0), radius: 0.3, radiance }),
        Light::Point(PointLight { position: p(2.0, 1.0, 1.0), intensity: Rgb::splat(2.0) }),
        Light::Directional(DirectionalLight {
            to_light: p(1.0, 2.0, 1.0).normalize(),
            irradiance: Rgb::splat(0.3),
        }),
    ];
    world.sky = Sky { radiance: Rgb::new(0.2, 0.3, 0.4), lights: false, ambient: Rgb::splat(0.05) };
    world
}

fn smooth(centre: DVec3, radius: f64, material: u32) -> WorldMesh {
    WorldMesh { material, ..shapes::smooth_sphere(centre, radius, 64, 32) }
}

fn job(world: World, edge: u32, by: &DMat3) -> Job {
    let pose = Pose {
        eye: *by * EYE,
        target: *by * DVec3::new(0.0, -0.3, 0.0),
        up: *by * DVec3::Y,
        roll_degrees: 0.0,
    };
    let mut job = common::job(world, pose, edge, edge);
    job.settings.bounces = 6;
    job.settings.shadow_samples = 4;
    job.settings.spp = 1;
    job
}

/// The 24 turns that map the axes to axes: exact in f64.
fn turns() -> Vec<DMat3> {
    let axes = [DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, -DVec3::Z];
    let pairs = axes.iter().flat_map(|x| axes.iter().map(move |y| (*x, *y)));
    let square = pairs.filter(|(x, y)| x.dot(*y) == 0.0);
    square.map(|(x, y)| DMat3::from_cols(x, y, x.cross(y))).collect()
}

/// 8-bit sRGB, as a png holds it.
fn bytes(film: &Film) -> Vec<[u8; 3]> {
    let level =
        |x: f32| (tweenray::math::srgb_encode(f64::from(x).clamp(0.0, 1.0)) * 255.0).round() as u8;
    film.rgb.iter().map(|c| c.to_array().map(level)).collect()
}

/// Pixels that differ by more than 1 LSB, and the largest difference.
fn differences(a: &Film, b: &Film) -> (u64, u8) {
    let apart = bytes(a)
        .into_iter()
        .zip(bytes(b))
        .map(|(a, b)| (0..3).map(|c| a[c].abs_diff(b[c])).max().unwrap());
    apart.fold((0, 0), |(n, most), d| (n + u64::from(d > 1), most.max(d)))
}

/// Mesh, camera and lights turned together, by the product's own transform, against untouched.
///
/// Samples on lights are the same points, since they hang on the corners, but for the sphere
/// light, whose cone has a frame of its own in space: where it is partly hidden, another sample
/// may be hidden. So the pixels that the sphere light shades softly are left to the statistics,
/// and the images are compared with that light replaced by a second lamp.
pub fn turned_mesh_or_camera(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let edge = size.of(48, 256);
    let mut still = world();
    still.lights.remove(1);
    let (reference, _) = common::render(&job(still.clone(), edge, &DMat3::IDENTITY));
    let mut most = 0;
    for turn in turns() {
        let mut turned = still.clone();
        turned.apply_transform(&DAffine3::from_mat3(turn)).unwrap();
        let (film, _) = common::render(&job(turned, edge, &turn));
        let (apart, largest) = differences(&reference, &film);
        outcome.count(u64::from(edge * edge), apart);
        if apart > 0 {
            outcome.example(format!("{turn}: {apart} pixels apart, most {largest} LSB"));
        }
        most = most.max(largest);
    }
    outcome.at_most("largest difference over 24 turns, LSB", most.into(), 1.0);
    // The blooper: the mesh is turned, its normals are not.
    let turn = turns()[5];
    let mut half = still.clone();
    half.apply_transform(&DAffine3::from_mat3(turn)).unwrap();
    for (mesh, before) in half.meshes.iter_mut().zip(&still.meshes) {
        mesh.normals.clone_from(&before.normals);
    }
    let (film, _) = common::render(&job(half, edge, &turn));
    let (apart, _) = differences(&reference, &film);
    let share = apart as f64 / f64::from(edge * edge);
    outcome.at_least("share of pixels wrong with normals left behind", share, 0.02);
    outcome
}

/// Reverses every face for which `which` says so.
fn wind(mesh: &mut WorldMesh, which: impl Fn(usize) -> bool) {
    let reversed = mesh.triangles.iter_mut().enumerate().filter(|(i, _)| which(*i));
    reversed.for_each(|(_, t)| t.swap(1, 2));
}

/// Diffuse and glass meshes with all faces reversed, and mirrored twice, must be the picture of the
/// right mesh; mixed winding too, for what has an outside without it (diffuse).
pub fn reversed_winding(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let edge = size.of(64, 256);
    let identity = DMat3::IDENTITY;
    let (right, _) = common::render(&job(world(), edge, &identity));
    let mut compare = |name: &str, changed: World| {
        let (film, _) = common::render(&job(changed, edge, &identity));
        let apart = film.rgb.iter().zip(&right.rgb).filter(|(a, b)| a != b).count();
        outcome.count(u64::from(edge * edge), apart as u64);
        outcome.show(format!("{name}: {apart} pixels differ"));
        if apart > 0 {
            outcome.example(format!("{name}: {apart} pixels differ in some bit"));
        }
    };
    let mut reversed = world();
    reversed.meshes.iter_mut().for_each(|m| wind(m, |_| true));
    compare("reversed, normals kept", reversed);
    let mut all = world();
    for mesh in &mut all.meshes {
        wind(mesh, |_| true);
        let normals = mesh.normals.iter_mut().flat_map(|n| &mut n.values);
        normals.for_each(|n| *n = -*n);
    }
    compare("reversed with their normals", all);
    let mut mixed = world();
    let diffuse = |m: &&mut WorldMesh| m.material != 2;
    mixed.meshes.iter_mut().filter(diffuse).for_each(|m| wind(m, |i| i % 3 == 0));
    compare("mixed winding, diffuse and mirror", mixed);
    let mut glass = world();
    glass.meshes.iter_mut().filter(|m| m.material == 2).for_each(|m| wind(m, |i| i % 3 == 0));
    compare("mixed winding, glass", glass);
    // Mirrored on the way in, mirrored back on placing: what a placement with a negative scale is.
    let flip = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let mut placed = world();
    for mesh in &mut placed.meshes {
        mesh.apply_transform(&flip).unwrap();
        mesh.apply_transform(&flip).unwrap();
    }
    let (film, _) = common::render(&job(placed, edge, &identity));
    // Normals were rounded to f32 twice: bits may differ, not levels.
    let (apart, most) = differences(&right, &film);
    outcome.count(u64::from(edge * edge), apart);
    outcome.show(format!("mirrored and back: {apart} pixels beyond 1 LSB, most {most}"));
    mirror_image(&mut outcome, edge);
    outcome
}

/// A world placed by a mirror image, seen by the mirrored camera, is the mirrored picture.
fn mirror_image(outcome: &mut Outcome, edge: u32) {
    let flip = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let mut still = world();
    // One light without samples: those on an area light are not mirrored with it.
    still.lights.drain(..2);
    let here = job(still.clone(), edge, &DMat3::IDENTITY);
    let (right, _) = common::render(&here);
    still.apply_transform(&flip).unwrap();
    let pose = Pose {
        eye: flip.transform_point3(EYE),
        target: DVec3::new(0.0, -0.3, 0.0),
        up: DVec3::Y,
        roll_degrees: 0.0,
    };
    let camera = Camera::new(&pose, 40.0, edge, edge).unwrap();
    let (film, _) = common::render(&Job { world: still, camera, settings: here.settings });
    let mut mirrored = right.clone();
    for row in mirrored.rgb.chunks_mut(edge as usize) {
        row.reverse();
    }
    let (apart, most) = differences(&mirrored, &film);
    outcome.count(u64::from(edge * edge), apart);
    outcome.show(format!("mirrored placement: {apart} pixels beyond 1 LSB, most {most}"));
    if apart > 0 {
        outcome.example(format!("mirrored placement: {apart} pixels beyond 1 LSB, most {most}"));
    }
}
