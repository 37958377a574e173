//! What depends on the view is never taken from another frame.

use crate::common;
use crate::moves::Set;
use crate::suite::{Outcome, Size};
use tweenray::film::Film;
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::{
    CameraPath, Light, Material, QuadLight, ReuseSettings, Settings, Shot, World, WorldSphere,
};

const FRAMES: u32 = 9;
/// Radiance of the lamp that is seen in the ball.
const LAMP: f32 = 40.0;

/// A mirror ball on a matte floor; the lamp over it is seen in the ball, and its image runs across.
fn scene() -> Set {
    let p = DVec3::new;
    let mut world = World::default();
    world.materials.push(Material::diffuse("floor", Rgb::splat(0.5)));
    world.materials.push(Material { mirror: Rgb::splat(0.9), ..Material::black("ball") });
    let radiance = Rgb::splat(LAMP);
    world.materials.push(Material {
        emission: radiance,
        emits_back: true,
        ..Material::black("lamp")
    });
    let floor = [p(-8.0, 0.0, 8.0), p(8.0, 0.0, 8.0), p(8.0, 0.0, -8.0), p(-8.0, 0.0, -8.0)];
    world.meshes.push(common::quad(floor, 0));
    let (name, centre, always_traced) = ("ball".into(), p(0.0, 1.0, 0.0), false);
    world.spheres.push(WorldSphere { name, centre, radius: 1.0, material: 1, always_traced });
    let corners = [p(-0.4, 4.0, 1.6), p(0.4, 4.0, 1.6), p(0.4, 4.0, 2.4), p(-0.4, 4.0, 2.4)];
    world.lights.push(Light::Quad(QuadLight { corners, radiance, two_sided: true }));
    let lamp = corners.map(|c| c + DVec3::Y * 0.01);
    world.meshes.push(common::quad(lamp, 2));
    let (from, to) = (p(-5.0, 2.0, 4.0), p(5.0, 2.0, 4.0));
    let (target, up, roll_degrees) = (p(0.0, 1.0, 0.0), DVec3::Y, 0.0);
    let path = CameraPath::Pan { from, to, target, up, roll_degrees };
    Set::of(world, Shot::new(path, FRAMES, 30.0))
}

/// Mean place of the pixels that show the lamp in the ball, and how many they are.
fn highlight(film: &Film) -> ((f64, f64), f64) {
    let mut sums = (0.0, 0.0, 0.0);
    for (x, y, rgb) in common::pixels(film).filter(|(_, _, c)| c.x > 0.2 * LAMP) {
        let weight = f64::from(rgb.x);
        sums = (sums.0 + weight * f64::from(x), sums.1 + weight * f64::from(y), sums.2 + weight);
    }
    ((sums.0 / sums.2, sums.1 / sums.2), sums.2)
}

/// The lamp's image in a ball: its centroid is where tracing has it, in every frame.
pub fn moving_highlight(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let set = scene();
    let stage = set.stage(common::threads());
    let reuse = ReuseSettings { segment: 64, ..ReuseSettings::default() };
    let settings = Settings { reuse, ..set.settings(size.of((96, 72), (384, 288)), 4, 16) };
    let made = stage.frames(&settings, &set.shot, &(1..=FRAMES).collect::<Vec<_>>());
    let (mut furthest, mut least_step, mut last) = (0.0f64, f64::INFINITY, None::<(f64, f64)>);
    for (frame, made) in (1..).zip(&made) {
        let truth = stage.traced(&settings, &set.shot, frame, frame);
        let ((x, y), weight) = highlight(&made.film);
        let ((tx, ty), _) = highlight(&truth);
        outcome.check(weight > 0.0, || format!("frame {frame}: no highlight"));
        furthest = furthest.max((x - tx).hypot(y - ty));
        if let Some((lx, ly)) = last.replace((tx, ty)) {
            least_step = least_step.min((tx - lx).hypot(ty - ly));
        }
    }
    outcome.at_most("centroid off by, pixels", furthest, 0.1);
    outcome.at_least("it moves from frame to frame by, pixels", least_step, size.of(1.0, 4.0));
    let counts = &made[FRAMES as usize / 2].reuse;
    outcome.show(format!(
        "inferred in the middle frame: {:.1} % of direct points, {:.1} % of those in the ball",
        100.0 * counts.direct_inferred as f64 / counts.direct as f64,
        100.0 * counts.specular_inferred as f64 / counts.specular.max(1) as f64,
    ));
    outcome
}
