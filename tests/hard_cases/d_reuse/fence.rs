//! Holes behind thin things, and what reuse saves where nothing is wrong.

use crate::common;
use crate::moves::{self, Set, Stage};
use crate::suite::{Outcome, Size};
use tweenray::film::Film;
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::{
    CameraPath, Light, Material, Policy, QuadLight, ReuseSettings, Settings, Shot, World, WorldMesh,
};

/// Traces of a frame that tell how far its pixels scatter.
const TRACES: u32 = 8;
/// Added to their frame's number, one after another.
const STREAM: u32 = 1 << 24;
/// What every pixel may be off by, two of 255 display steps: rounding, and noise of the reference.
const ALWAYS: f64 = 2.0 / 255.0;

/// And times the furthest of the traces' pixels around it: of eight and nine traces the ninth is now
/// and then the furthest, but not by so much.
const SCATTER: f64 = 2.0;

/// Edge of a pixel at the fence in a picture of `rows` rows.
fn pixel(rows: u32) -> f64 {
    2.0 * 8.0 * 20f64.to_radians().tan() / f64::from(rows)
}

/// A fence of pickets, one pixel wide in a picture of `rows` rows, before a wall of coloured strips,
/// on which it throws the shadows of a lamp `lamp` wide; the camera slides past.
fn fence(rows: u32, lamp: f64) -> Set {
    let p = DVec3::new;
    let mut world = World::default();
    let strips = [[0.8, 0.1, 0.1], [0.1, 0.7, 0.1], [0.1, 0.2, 0.8], [0.8, 0.8, 0.2]];
    for (k, colour) in strips.iter().enumerate() {
        world.materials.push(Material::diffuse(format!("strip {k}"), Rgb::from_array(*colour)));
    }
    let pixel = pixel(rows);
    let wide = 5.0 * pixel;
    // One mesh of each colour; the pickets are of the first, so that only place and normal tell
    // them from its strips.
    let mut meshes: [Vec<WorldMesh>; 4] = Default::default();
    for k in -60..60 {
        let (x0, x1) = (f64::from(k) * wide, f64::from(k + 1) * wide);
        let strip = [p(x0, -3.0, -1.0), p(x1, -3.0, -1.0), p(x1, 4.0, -1.0), p(x0, 4.0, -1.0)];
        meshes[(k + 60) as usize % 4].push(common::quad(strip, 0));
    }
    for k in -30..30 {
        let x = f64::from(k) * 4.0 * pixel;
        meshes[0].push(block(p(x, -3.0, 0.0), p(x + pixel, 1.5, pixel)));
    }
    world.meshes.extend(meshes.iter().zip(0..).map(|(parts, material)| joined(parts, material)));
    let a = 0.5 * lamp;
    let corners = [p(-a, 3.0, 4.0), p(a, 3.0, 4.0), p(a, 4.0, 4.0), p(-a, 4.0, 4.0)];
    let radiance = Rgb::splat((100.0 / lamp) as f32);
    world.lights.push(Light::Quad(QuadLight { corners, radiance, two_sided: true }));
    let path = CameraPath::Pan {
        from: p(-0.5, 0.3, 8.0),
        to: p(0.6, 0.3, 8.0),
        target: p(0.0, 0.2, 0.0),
        up: DVec3::Y,
        roll_degrees: 0.0,
    };
    Set::of(world, Shot::new(path, 9, 40.0))
}

/// The box between two corners, faces outwards.
fn block(min: DVec3, max: DVec3) -> WorldMesh {
    let mut mesh = common::cube(DVec3::splat(0.5), 0.5, 0);
    mesh.positions.iter_mut().for_each(|q| *q = min + *q * (max - min));
    mesh
}

/// One mesh of several.
fn joined(parts: &[WorldMesh], material: u32) -> WorldMesh {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for part in parts {
        let first = positions.len() as u32;
        positions.extend(&part.positions);
        triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + first)));
    }
    common::mesh(positions, triangles, material)
}

/// A pixel that is much further from the truth than traces are around it.
struct BadPixel {
    index: usize,
    /// How far it is off, and how far it may be, of 1.
    off: f64,
    most: f64,
}

/// The pixels of `film` much further from `truth` than any trace is in the pixels around.
fn bad_pixels(settings: &Settings, film: &Film, truth: &Film, traces: &[Film]) -> Vec<BadPixel> {
    let truth_codes = moves::codes(settings, truth);
    let off = |film: &Film| -> Vec<f64> {
        let pairs = moves::codes(settings, film).into_iter().zip(&truth_codes);
        pairs.map(|(a, b)| (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max)).collect()
    };
    let scatter: Vec<Vec<f64>> = traces.iter().map(off).collect();
    let (width, height) = (film.width as usize, film.height as usize);
    let around = |i: usize| {
        let (x, y) = (i % width, i / width);
        let columns = x.saturating_sub(1)..(x + 2).min(width);
        let rows = y.saturating_sub(1)..(y + 2).min(height);
        let near = rows.flat_map(|y| columns.clone().map(move |x| y * width + x));
        near.map(|j| scatter.iter().map(|s| s[j]).fold(0.0, f64::max)).fold(0.0, f64::max)
    };
    let own = off(film);
    let judged =
        |index| BadPixel { index, off: own[index], most: ALWAYS + SCATTER * around(index) };
    (0..own.len()).map(judged).filter(|pixel| pixel.off > pixel.most).collect()
}

/// What is bad in each of `films` of a frame, and in one more trace of it.
fn judge(
    stage: &Stage,
    settings: &Settings,
    shot: &Shot,
    frame: u32,
    films: &[&Film],
) -> (Vec<Vec<BadPixel>>, usize) {
    let truth = stage.converged(settings, shot, frame, 1024);
    let trace = |k: u32| stage.traced(settings, shot, frame, k * STREAM + frame);
    let traces: Vec<Film> = (1..=TRACES).map(trace).collect();
    let bad = |film: &Film| bad_pixels(settings, film, &truth, &traces);
    (films.iter().map(|film| bad(film)).collect(), bad(&trace(TRACES + 1)).len())
}

fn in_one_segment(settings: Settings) -> Settings {
    let reuse = ReuseSettings { segment: 64, ..settings.reuse };
    Settings { reuse, ..settings }
}

/// Width of a lamp in whose light the fence's shadows melt together: only a ratio of another
/// surface would be wrong.
pub const WIDE: f64 = 4.0;
/// Width, in pickets, of one in whose light they are nearly as fine as the pickets: penumbras of two
/// pixels.
const NARROW: f64 = 8.0;

/// No pixel behind a picket shows what another frame had there.
pub fn disocclusion(size: Size) -> Outcome {
    let mut outcome = behind_pickets(size, WIDE, |_| ());
    if size == Size::Full {
        outcome.merge(behind_pickets(size, NARROW * pixel(192), |_| ()));
    }
    outcome
}

/// The same in the light of one lamp, after a `change`.
pub fn behind_pickets(size: Size, lamp: f64, change: impl FnOnce(&mut Set)) -> Outcome {
    let mut outcome = Outcome::default();
    let (width, height) = size.of((64, 48), (256, 192));
    let mut set = fence(height, lamp);
    change(&mut set);
    let stage = set.stage(common::threads());
    // As many rays as make it worth a look: by the narrow lamp all but what is above the shadows is traced.
    let settings = in_one_segment(set.settings((width, height), 1, 64));
    // With loose epsilons, so that it does take over what it should not.
    let by_colour = ReuseSettings {
        policy: Policy::Colour,
        colour_epsilon: 1.0,
        distance_epsilon: 1.0,
        ..settings.reuse
    };
    let by_colour = Settings { reuse: by_colour, ..settings.clone() };
    let all: Vec<u32> = (1..=9).collect();
    let made = stage.frames(&settings, &set.shot, &all);
    let others = stage.frames(&by_colour, &set.shot, &all);
    let (mut control, mut stale, mut inferred, mut points) = (0, 0, 0, 0);
    for frame in size.of(&[5, 2][..], &[2, 5, 8]) {
        let [made, other] = [&made, &others].map(|all| &all[*frame as usize - 1]);
        let films = [&made.film, &other.film];
        let (bad, traced) = judge(&stage, &settings, &set.shot, *frame, &films);
        outcome.count(u64::from(width * height), bad[0].len() as u64);
        for BadPixel { index, off, most } in &bad[0] {
            let (x, y) = (*index as u32 % width, *index as u32 / width);
            let source = made.film.provenance.as_ref().unwrap()[*index];
            outcome.example(format!(
                "lamp {lamp:.2}, frame {frame}, pixel {x},{y}: off by {:.1} of 255, at most {:.1}; {source:?}",
                255.0 * off,
                255.0 * most
            ));
        }
        (control, stale) = (control + traced, stale + bad[1].len());
        (inferred, points) = (inferred + made.reuse.direct_inferred, points + made.reuse.direct);
    }
    let (failed, tried) = (outcome.failures, outcome.trials);
    outcome.show(format!(
        "lamp {lamp:.2} wide: {failed} of {tried} pixels off; as far off in one more trace {control}"
    ));
    // Else these pickets were no trial.
    let stale = stale as f64 / tried as f64;
    outcome.at_least("share off by a loose policy colour, which has stale pixels", stale, 0.01);
    outcome.at_least("share inferred", inferred as f64 / points as f64, 0.2);
    outcome
}

/// Rays that in-between frames cast, of those that tracing them would, where no pixel is wrong.
pub fn exactness_and_savings(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let pixels = size.of((64, 64), (320, 240));
    for (scene, most) in [("cornell", 0.45), ("reflective_spheres", f64::INFINITY)] {
        let set = Set::load(scene, |world| {
            if scene == "cornell" {
                // Diffuse throughout.
                world.materials.iter_mut().for_each(|m| m.mirror = Rgb::ZERO);
            }
        });
        let stage = set.stage(common::threads());
        let shot = set.shot(33);
        let settings = in_one_segment(set.settings(pixels, 1, 100));
        let made = stage.frames(&settings, &shot, &[1, 3, 5, 9, 17, 33]);
        let cast = made[1].rays.total() as f64;
        let all = made[0].rays.total() as f64;
        outcome.show(format!("{scene}: {:.2} % of the rays", 100.0 * cast / all));
        let (bad, traced) = judge(&stage, &settings, &shot, 3, &[&made[1].film]);
        let bad = bad[0].len();
        outcome.count(u64::from(pixels.0 * pixels.1), bad as u64);
        outcome.show(format!("{scene}: {bad} bad pixels; in one more trace {traced}"));
        if most.is_finite() {
            outcome.at_most("share of rays", cast / all, most);
        }
    }
    outcome
}
