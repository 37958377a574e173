//! Many lights: what an in-between frame costs beside one of a single light, and a pan beside tracing every light.

use super::moves::{self, Set, Stage};
use super::{Choice, per_cent, quartiles, support};
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::{
    CameraPath, Light, Material, Policy, QuadLight, Settings, Shot, SpotLight, World, WorldMesh,
    WorldSphere,
};

/// Frames of the move whose in-between frames are timed.
const FRAMES: u32 = 33;
/// Frames of the pan.
const PAN: u32 = 128;
/// Frames that are traced to tell what all of them take.
const TRACED: [u32; 2] = [40, 90];
/// Lamps along each side of a square over the terrain, and the distance between them.
const ACROSS: u32 = 8;
const APART: f64 = 20.0 / ACROSS as f64;

/// The middle of lamp `k` of a square grid over the terrain.
fn over_terrain(k: u32, height: f64) -> DVec3 {
    let place = |k: u32| (f64::from(k) + 0.5) * APART - 10.0;
    DVec3::new(place(k % ACROSS), height, place(k / ACROSS))
}

/// 64 spots with a radius over the terrain, close enough that each point lies in the cones of about four.
fn spots(world: &mut World) {
    world.sky.lights = false;
    let spot = |k: u32| SpotLight {
        // A cone over a flat ground 1.13 apart wide holds four of a square grid.
        position: over_terrain(k, 1.13 * APART),
        direction: DVec3::NEG_Y,
        intensity: Rgb::splat(12.0),
        cos_inner: 0.9,
        cos_outer: std::f64::consts::FRAC_1_SQRT_2,
        radius: 0.15,
    };
    world.lights = (0..ACROSS * ACROSS).map(|k| Light::Spot(spot(k))).collect();
}

/// A quad light that faces down.
fn lamp(middle: DVec3, [x, z]: [f64; 2], radiance: f64) -> Light {
    let corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];
    let corners = corners.map(|[s, t]| middle + DVec3::new(s * x, 0.0, t * z));
    Light::Quad(QuadLight { corners, radiance: Rgb::splat(radiance as f32), two_sided: false })
}

/// A box without its lower side, or with it.
fn block([min, max]: [DVec3; 2], is_open: bool, material: u32) -> WorldMesh {
    let corner = |k: u32| {
        let side = |axis: u32| f64::from(k >> axis & 1);
        min + (max - min) * DVec3::new(side(0), side(1), side(2))
    };
    let mut sides = vec![[4, 5, 7, 6], [2, 6, 7, 3], [0, 2, 3, 1], [0, 4, 6, 2], [1, 3, 7, 5]];
    if !is_open {
        sides.push([0, 1, 5, 4]);
    }
    let triangles = sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    WorldMesh::new("block", (0..8).map(corner).collect(), triangles, material)
}

/// 64 quads over the terrain in shades, so that each point sees the light of about four.
fn shaded(world: &mut World) {
    world.sky.lights = false;
    let dark = world.add_material(Material::diffuse("shade", Rgb::splat(0.1)));
    let places = (0..ACROSS * ACROSS).map(|k| over_terrain(k, 1.16 * APART));
    world.lights = places.clone().map(|middle| lamp(middle, [0.3; 2], 90.0)).collect();
    let half = DVec3::new(0.19, 0.03, 0.19);
    let shade = |middle: DVec3| [middle - half - 0.3 * DVec3::Y, middle + half];
    world.meshes.extend(places.map(|middle| block(shade(middle), true, dark)));
}

/// A hall 80 m long with columns, lit by two rows of 32 quads, or by one long lamp.
fn hall(lamps: u32) -> Set {
    let mut world = World::default();
    let wall = world.add_material(Material::diffuse("wall", Rgb::splat(0.7)));
    let red = world.add_material(Material::diffuse("red", Rgb::new(0.6, 0.1, 0.08)));
    let v = DVec3::new;
    let around = [
        [v(-5.2, -0.2, -80.0), v(5.2, 0.0, 4.0)],
        [v(-5.2, 4.0, -80.0), v(5.2, 4.2, 4.0)],
        [v(-5.2, 0.0, -80.0), v(-5.0, 4.0, 4.0)],
        [v(5.0, 0.0, -80.0), v(5.2, 4.0, 4.0)],
        [v(-5.2, 0.0, -80.2), v(5.2, 4.0, -80.0)],
    ];
    world.meshes.extend(around.map(|sides| block(sides, false, wall)));
    for k in 0..32 {
        let (x, z) = (if k % 2 == 0 { -3.6 } else { 3.6 }, -1.2 - 5.0 * f64::from(k / 2));
        let column = [v(x - 0.2, 0.0, z - 0.2), v(x + 0.2, 4.0, z + 0.2)];
        world.meshes.push(block(column, false, wall));
    }
    for k in 0..24 {
        let x = f64::from(k * 7 % 12) * 0.5 - 2.75;
        world.spheres.push(WorldSphere::new(
            "ball",
            v(x, 0.4, -2.0 - 1.6 * f64::from(k)),
            0.4,
            red,
        ));
    }
    let place =
        |k: u32| v(if k % 2 == 0 { -2.2 } else { 2.2 }, 3.6, -1.25 - 2.5 * f64::from(k / 2));
    world.lights = match lamps {
        1 => vec![lamp(v(0.0, 3.8, -10.0), [3.0, 12.0], 6.0)],
        _ => (0..lamps).map(|k| lamp(place(k), [0.6; 2], 20.0)).collect(),
    };
    let (from, to, target) = (v(-1.5, 1.7, 2.5), v(1.5, 1.9, -2.0), v(0.0, 1.0, -14.0));
    let path = CameraPath::Pan { from, to, target, up: DVec3::Y, roll_degrees: 0.0 };
    Set::of(world, Shot::new(path, FRAMES, 60.0))
}

fn settings(set: &Set, size: (u32, u32), policy: Policy) -> Settings {
    let mut settings = set.settings(size, 1, 16);
    settings.reuse.policy = policy;
    settings
}

/// Seconds of a frame that looks at all lights, the mean of a few of `shot`.
fn traced(stage: &Stage, settings: &Settings, shot: &Shot) -> Vec<f64> {
    let maker = stage.maker(settings, shot, &[]);
    TRACED.iter().map(|k| support::seconds(|| moves::make(&*maker, *k))).collect()
}

/// In-between frames of 64 lights over those of one, frame by frame in turns.
fn between(choice: &Choice, size: (u32, u32), name: &str, [one, many]: [&Set; 2]) -> Vec<String> {
    let stages = [one, many].map(|set| set.stage(choice.threads));
    let settings = [one, many].map(|set| settings(set, size, Policy::Surface));
    let shots = [one.shot(FRAMES), many.shot(FRAMES)];
    let all: Vec<u32> = (1..=FRAMES).collect();
    let makers = [0, 1].map(|k| stages[k].maker(&settings[k], &shots[k], &all));
    let (mut ratios, mut lit, mut inferred) = (Vec::new(), 0, 0);
    // In the order of the scene that surely reuses: a single lamp may be cheaper to trace.
    for frame in makers[1].batches(&all).concat() {
        let [(_, one), (made, many)] =
            [0, 1].map(|k| support::timed(|| moves::make(&*makers[k], frame)));
        if frame != 1 && frame != FRAMES {
            ratios.push(many / one);
            lit += made.reuse.direct;
            inferred += made.reuse.direct_inferred;
        }
    }
    vec![name.into(), traced_each(many), per_cent(inferred, lit), quartiles(&ratios)]
}

/// Mean number of lights that a point traces one by one.
fn traced_each(set: &Set) -> String {
    let cells = set.scene.light_cells.as_ref().expect("many lights");
    format!("{:.1}", cells.mean().main)
}

/// A pan over tracing every light in every frame.
fn pan(choice: &Choice, name: &str, set: &Set, size: (u32, u32)) -> Vec<String> {
    let stage = set.stage(choice.threads);
    let shot = set.shot(PAN);
    let ours = settings(set, size, Policy::Surface);
    let off = Settings { all_lights: true, ..settings(set, size, Policy::Off) };
    let mut each = traced(&stage, &off, &shot);
    let all: Vec<u32> = (1..=PAN).collect();
    let maker = stage.maker(&ours, &shot, &all);
    let order = maker.batches(&all).concat();
    let seconds = support::seconds(|| order.iter().for_each(|f| _ = moves::make(&*maker, *f)));
    each.extend(traced(&stage, &off, &shot));
    let times: Vec<f64> = each.iter().map(|each| each * f64::from(PAN) / seconds).collect();
    vec![name.into(), format!("{seconds:.1} s"), quartiles(&each), quartiles(&times)]
}

/// Figure 5 of many lights.
pub fn report(choice: &Choice) {
    let size = choice.size((320, 180));
    println!("{} x {}, 1 camera and 16 shadow samples", size.0, size.1);
    println!("in-between frames of 64 lights beside those of one; wanted: at most 2 times as long");
    let own = Set::load("spheres_on_terrain", |world| world.sky.lights = false);
    let shades = Set::load("spheres_on_terrain", shaded);
    let spots = Set::load("spheres_on_terrain", spots);
    let (hall, one) = (hall(64), hall(1));
    let rows = [
        ("quads in a hall", [&one, &hall]),
        ("quads in shades on terrain", [&own, &shades]),
        ("spots on terrain", [&own, &spots]),
    ];
    let rows: Vec<Vec<String>> = rows.map(|(name, sets)| between(choice, size, name, sets)).into();
    let head = ["scene", "traced one by one at a point", "points inferred", "times as long"];
    support::table(&head, &rows);
    println!(
        "\n{PAN} frames with reuse, beside all lights traced in every frame; wanted: 30 times"
    );
    let street = Set::load("street_at_night", |_| ());
    let rows = [
        ("quads in a hall", &hall),
        ("quads in shades on terrain", &shades),
        ("spots on terrain", &spots),
        ("street_at_night", &street),
    ];
    let rows: Vec<Vec<String>> = rows.map(|(name, set)| pan(choice, name, set, size)).into();
    let head = ["scene", "pan", "s of a frame, all lights", "times faster"];
    support::table(&head, &rows);
}
