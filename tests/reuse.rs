//! Frames inferred from others: no worse than traced ones in every scene of `scenes/`, without
//! flicker, and the traced frame itself where there is nothing to infer from.
//!
//! Still cameras, fences, sharpness and independence of the order are hard cases (letter d); the
//! audit has `tests/audit.rs`, ranks and stopped jobs `tests/command_line`.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "shows what it measured")]

mod common;
#[path = "common/moves.rs"]
mod moves;

use moves::{Set, psnr_of};
use tweenray::film::Film;
use tweenray::math::{DVec3, Rgb, Vec2};
use tweenray::scene::{
    CameraPath, Corners, Easing, Environment, EnvironmentKind, KeyPose, Material, NormalMap,
    Policy, Pose, ReuseSettings, Settings, SunSky, Texture, TextureMap, World,
};
use tweenray::sequence::Made;
use tweenray::stats::ReuseCounts;

/// As large as the figures of `docs/performance.md` allow in seconds: a move of 33 frames, of which
/// the first segment is rendered.
const SIZE: (u32, u32) = (128, 72);
const FRAMES: u32 = 33;
const SEGMENT: u32 = 8;
/// By how much a frame may be further from the truth than the worst of its traces, dB.
const WORSE: f64 = 0.3;
/// An error that nobody sees, a root mean square of a quarter of a display step, dB.
const UNSEEN: f64 = 60.2;
/// How many traces of a frame, each with other random numbers, its own are compared with.
const TRACES: u32 = 4;
/// Samples of the frames that are taken for the truth.
const BEST: u32 = 256;

/// The first segment and the frame after it.
fn segment() -> Vec<u32> {
    (1..=SEGMENT + 2).collect()
}

fn with_segment(settings: Settings) -> Settings {
    let reuse = ReuseSettings { segment: SEGMENT, ..settings.reuse };
    Settings { reuse, ..settings }
}

fn total(made: &[Made]) -> ReuseCounts {
    made.iter().fold(ReuseCounts::default(), |mut sum, made| {
        sum += made.reuse;
        sum
    })
}

/// Every inferred frame has at least the PSNR that traces of it have, but for [`WORSE`], or shows no
/// error, and at least `direct` and `specular` of the points seen directly and in mirror or glass are inferred.
fn is_no_worse_than_traced(scene: &str, shares: [f64; 2]) {
    is_no_worse_than_traced_after(scene, |_| (), shares);
}

/// The same of a scene after a `change`.
fn is_no_worse_than_traced_after(
    scene: &str,
    change: impl FnOnce(&mut World),
    [direct, specular]: [f64; 2],
) {
    let set = Set::load(scene, change);
    let stage = set.stage(2);
    let shot = set.shot(FRAMES);
    let settings = with_segment(set.settings(SIZE, 1, 16));
    let made = stage.frames(&settings, &shot, &segment());
    let mut worse = Vec::new();
    for frame in 2..=SEGMENT {
        let truth = stage.converged(&settings, &shot, frame, BEST);
        let ours = psnr_of(&settings, &made[frame as usize - 1].film, &truth);
        let trace = |k: u32| stage.traced(&settings, &shot, frame, frame | k << 26);
        let traced = (0..TRACES).map(|k| psnr_of(&settings, &trace(k), &truth));
        let theirs = traced.fold(f64::INFINITY, f64::min);
        println!("{scene}, frame {frame}: {ours:.2} dB inferred, {theirs:.2} dB traced");
        if ours < theirs - WORSE && ours < UNSEEN {
            worse.push(frame);
        }
    }
    assert!(worse.is_empty(), "{scene}: frames {worse:?} are worse than traced");
    let shares = shares_inferred(&made);
    println!("{scene}: {:.3} of direct points inferred, {:.3} of others", shares[0], shares[1]);
    assert!(shares[0] >= direct && shares[1] >= specular, "{shares:?}");
}

/// The shares of the points seen directly and in mirror or glass that are inferred between the first two key frames.
fn shares_inferred(made: &[Made]) -> [f64; 2] {
    let counts = total(&made[1..SEGMENT as usize]);
    let share = |part: u64, all: u64| if all == 0 { 1.0 } else { part as f64 / all as f64 };
    [share(counts.direct_inferred, counts.direct), share(counts.specular_inferred, counts.specular)]
}

#[test]
fn spheres_on_terrain_is_no_worse_than_traced() {
    is_no_worse_than_traced("spheres_on_terrain", [0.15, 0.08]);
}

#[test]
fn cornell_is_no_worse_than_traced() {
    is_no_worse_than_traced("cornell", [0.8, 0.05]);
}

/// Its traced frames have 88 dB, where 8 bits hold 59: what nobody sees is inferred all the same.
#[test]
fn reflective_spheres_is_no_worse_than_traced() {
    is_no_worse_than_traced("reflective_spheres", [0.85, 0.3]);
}

#[test]
fn demo_is_no_worse_than_traced() {
    is_no_worse_than_traced("demo", [0.6, 0.11]);
}

/// Larger frames have more probes.
#[test]
fn larger_frames_of_demo_infer_more() {
    let set = Set::load("demo", |_| ());
    let settings = with_segment(set.settings((320, 180), 1, 16));
    let made = set.stage(2).frames(&settings, &set.shot(FRAMES), &segment());
    let shares = shares_inferred(&made);
    assert!(shares[0] >= 0.85 && shares[1] >= 0.25, "{shares:?}");
}

#[test]
fn street_at_night_is_no_worse_than_traced() {
    is_no_worse_than_traced("street_at_night", [0.3, 0.0]);
}

/// Under sun and sky instead of lamp and sky.
#[test]
fn a_day_is_no_worse_than_traced() {
    let under_a_day = |world: &mut World| {
        let to_sun = DVec3::new(-0.5, 0.7, 0.5).normalize();
        let day = SunSky { to_sun, turbidity: 3.0, sun_radius: 0.02, ground: Rgb::splat(0.2) };
        let environment = Environment::new(EnvironmentKind::SunSky(day));
        world.environment = Some(Environment { strength: 0.3, ..environment });
        world.sky.radiance = Rgb::ZERO;
        world.lights.clear();
    };
    is_no_worse_than_traced_after("demo", under_a_day, [0.4, 0.0]);
}

/// An image with a warm window and a cold one, without any other light.
#[test]
fn an_image_is_no_worse_than_traced() {
    let in_a_studio = |world: &mut World| {
        let texels = (0..64 * 32).map(|i| match (i % 64, i / 64) {
            (8..=13, 6..=13) => Rgb::new(9.0, 6.0, 3.0),
            (40..=44, 8..=12) => Rgb::new(3.0, 6.0, 9.0),
            _ => Rgb::splat(0.15),
        });
        world.textures.push(Texture::from_linear("studio", [64, 32], texels.collect()));
        let image = EnvironmentKind::Image(world.textures.len() as u32 - 1);
        world.environment = Some(Environment::new(image));
        world.sky.radiance = Rgb::ZERO;
        world.sky.lights = true;
        world.lights.clear();
    };
    is_no_worse_than_traced_after("reflective_spheres", in_a_studio, [0.2, 0.0]);
}

/// The floor of `world` with coordinates, made of `material`.
fn lay_floor(world: &mut World, material: Material) {
    let id = world.add_material(material);
    let floor = world.meshes.iter_mut().find(|mesh| mesh.name == "floor").expect("a floor");
    let values = floor.positions.iter().map(|p| Vec2::new(p.x as f32, -p.z as f32)).collect();
    (floor.material, floor.uvs) = (id, Some(Corners { values, corners: None }));
}

/// A satin floor whose gloss is traced in every frame, while its diffuse part is inferred.
#[test]
fn a_roughness_map_is_no_worse_than_traced() {
    let change = |world: &mut World| {
        let texels = (0..64).map(|i| [40, 160][(i / 4 + i / 32) % 2]).collect();
        let image = world.textures.len() as u32;
        world.textures.push(Texture::from_data8("tiles", [8, 8], texels));
        let (mirror, roughness_map) = (Rgb::splat(0.3), Some(TextureMap::of(image)));
        let satin = Material::diffuse("satin", Rgb::splat(0.5));
        lay_floor(world, Material { mirror, roughness: 1.0, roughness_map, ..satin });
    };
    is_no_worse_than_traced_after("cornell", change, [0.75, 0.05]);
}

/// The shadowing of a floor of bumps is that of the plain floor; what arrives on the bumps is computed in each frame.
#[test]
fn a_normal_map_is_no_worse_than_traced() {
    let change = |world: &mut World| {
        let texel = |i: u32| {
            let tilt = |k: u32| if k % 8 < 4 { 60 } else { 195 };
            [tilt(i % 16), tilt(i / 16), 210]
        };
        let image = world.textures.len() as u32;
        let texels = (0..256).map(texel).collect();
        world.textures.push(Texture::from_vectors8("bumps", [16, 16], texels));
        let normal_map = Some(NormalMap { image: TextureMap::of(image), strength: 1.0 });
        let bumpy = Material::diffuse("bumpy", Rgb::splat(0.7));
        lay_floor(world, Material { normal_map, ..bumpy });
    };
    is_no_worse_than_traced_after("cornell", change, [0.75, 0.05]);
}

#[test]
fn inferred_frames_flicker_no_more_than_traced_ones() {
    let set = Set::load("cornell", |_| ());
    let stage = set.stage(2);
    let shot = set.shot(FRAMES);
    let settings = with_segment(set.settings((72, 72), 1, 16));
    let off = ReuseSettings { policy: Policy::Off, ..settings.reuse };
    let off = Settings { reuse: off, ..settings.clone() };
    let truths: Vec<Film> =
        segment().into_iter().map(|f| stage.converged(&settings, &shot, f, BEST)).collect();
    let changes = |settings: &Settings| {
        let made = stage.frames(settings, &shot, &segment());
        let films: Vec<&Film> = made.iter().map(|made| &made.film).collect();
        moves::flicker(settings, &films, &truths.iter().collect::<Vec<_>>())
    };
    let (ours, theirs) = (changes(&settings), changes(&off));
    println!("{ours:?}\n{theirs:?}");
    // From and to key frames too.
    for (k, (ours, theirs)) in ours.iter().zip(&theirs).enumerate() {
        assert!(ours <= theirs, "from frame {} to {}: {ours} against {theirs}", k + 1, k + 2);
    }
}

/// With one sample a pixel the clamp of the sample is that of the picture: in traced and inferred frames.
#[test]
fn a_sample_is_clamped_alike_in_traced_and_inferred_frames() {
    const MOST: f32 = 0.25;
    let set = Set::load("cornell", |_| ());
    let stage = set.stage(2);
    let shot = set.shot(FRAMES);
    let settings = with_segment(set.settings((64, 64), 1, 64));
    let plain = stage.frames(&settings, &shot, &segment());
    let clamped = Settings { clamp: Some(MOST * settings.exposure), ..settings };
    let mut inferred = 0;
    for (frame, (a, b)) in
        segment().iter().zip(plain.iter().zip(stage.frames(&clamped, &shot, &segment())))
    {
        let limited = a.film.rgb.iter().map(|c| c.min(Rgb::splat(MOST)));
        assert!(limited.eq(b.film.rgb.iter().copied()), "frame {frame}");
        assert!(a.film.rgb.iter().any(|c| c.max_element() > MOST));
        inferred += b.reuse.direct_inferred;
    }
    assert!(inferred > 1000, "{inferred}");
}

#[test]
fn a_cut_reuses_nothing_from_the_other_side() {
    // Two views of the closed room that share no surface; the cut lies between frames 3 and 4.
    let p = DVec3::new;
    let mut set = Set::load("cornell", |_| ());
    let (up, roll_degrees) = (DVec3::Y, 0.0);
    let key = |at: f64, eye, target| KeyPose { at, pose: Pose { eye, target, up, roll_degrees } };
    let (left, right) = (p(-0.2, 1.2, 1.8), p(0.2, 1.2, 1.8));
    // One key a frame: a spline would overshoot at the cut.
    let views = [
        (left, p(-1.5, 1.2, 1.80)),
        (left, p(-1.5, 1.2, 1.82)),
        (left, p(-1.5, 1.2, 1.84)),
        (right, p(1.5, 1.2, 1.84)),
        (right, p(1.5, 1.2, 1.82)),
        (right, p(1.5, 1.2, 1.80)),
    ];
    let path = |views: &[(DVec3, DVec3)]| {
        let last = (views.len() - 1) as f64;
        let at = views.iter().enumerate().map(|(k, view)| (k as f64 / last, view));
        CameraPath::Keys(at.map(|(at, (eye, target))| key(at, *eye, *target)).collect())
    };
    set.shot.path = path(&views);
    set.shot.easing = Easing::Linear;
    set.shot.vfov_degrees = 30.0;
    let stage = set.stage(2);
    let shot = set.shot(6);
    let settings = set.settings((64, 64), 1, 64);
    let whole = stage.frames(&settings, &shot, &(1..=6).collect::<Vec<_>>());
    for (frame, made) in (1..).zip(&whole) {
        let others = made.film.provenance.as_ref().unwrap().iter().map(|s| s.frame);
        let across = others.filter(|f| *f > 0 && (*f <= 3) != (frame <= 3)).count();
        assert_eq!(across, 0, "frame {frame}");
        assert!(frame == 1 || frame == 6 || made.reuse.direct_inferred > 1000);
    }
    // Three frames with the cut before and after the middle one: nothing to infer it from.
    let mut alone = shot;
    alone.frames = 3;
    alone.path = path(&[views[0], views[4], views[1]]);
    let made = stage.frames(&settings, &alone, &[1, 2, 3]);
    assert_eq!((made[1].reuse.direct_inferred, made[1].reuse.specular_inferred), (0, 0));
    assert!(made[1].reuse.direct > 1000);
    assert!(made[1].film.rgb == stage.traced(&settings, &alone, 2, 2).rgb);
}
