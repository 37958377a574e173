//! Many lights: what an in-between frame costs beside one of a single light, and a pan beside tracing every light.

use super::moves::{self, Set, Stage};
use super::{Choice, quartiles, support};
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::{Light, Policy, Settings, Shot, SpotLight, World};

/// Frames of the move whose in-between frames are timed.
const FRAMES: u32 = 33;
/// Frames of the pan.
const PAN: u32 = 128;
/// Frames that are traced to tell what all of them take.
const TRACED: [u32; 3] = [20, 64, 108];
/// Lamps along each side of the square.
const ACROSS: u32 = 8;

/// 64 spots with a radius over the terrain, close enough that each point lies in the cones of about four.
fn lamps(world: &mut World) {
    world.sky.lights = false;
    let apart = 20.0 / f64::from(ACROSS);
    let place = |k: u32| (f64::from(k) + 0.5) * apart - 10.0;
    // A cone over a flat ground 1.13 apart wide holds four of a square grid.
    let height = 1.13 * apart;
    let spot = |k: u32| SpotLight {
        position: DVec3::new(place(k % ACROSS), height, place(k / ACROSS)),
        direction: DVec3::NEG_Y,
        intensity: Rgb::splat(12.0),
        cos_inner: 0.9,
        cos_outer: std::f64::consts::FRAC_1_SQRT_2,
        radius: 0.15,
    };
    world.lights = (0..ACROSS * ACROSS).map(|k| Light::Spot(spot(k))).collect();
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
fn between(choice: &Choice, size: (u32, u32)) {
    let one = Set::load("spheres_on_terrain", |world| world.sky.lights = false);
    let many = Set::load("spheres_on_terrain", lamps);
    let cells = many.scene.light_cells.as_ref().expect("many lights");
    println!(
        "spheres_on_terrain, {} x {}, 1 camera and 16 shadow samples: 64 spots, of which {:.1} matter at a point,",
        size.0,
        size.1,
        cells.mean().main
    );
    println!("beside its own one lamp; wanted: at most 2");
    let stages = [one.stage(choice.threads), many.stage(choice.threads)];
    let settings = [&one, &many].map(|set| settings(set, size, Policy::Surface));
    let shots = [one.shot(FRAMES), many.shot(FRAMES)];
    let all: Vec<u32> = (1..=FRAMES).collect();
    let makers = [0, 1].map(|k| stages[k].maker(&settings[k], &shots[k], &all));
    let mut ratios = Vec::new();
    for frame in makers[0].batches(&all).concat() {
        let [one, many] = [0, 1].map(|k| support::seconds(|| moves::make(&*makers[k], frame)));
        if frame != 1 && frame != FRAMES {
            ratios.push(many / one);
        }
    }
    println!("an in-between frame takes {} times as long", quartiles(&ratios));
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
    between(choice, size);
    println!(
        "\n{PAN} frames with reuse, beside all lights traced in every frame; wanted: 30 times"
    );
    let many = Set::load("spheres_on_terrain", lamps);
    let street = Set::load("street_at_night", |_| ());
    let rows = [("64 spots on terrain", &many), ("street_at_night", &street)];
    let rows: Vec<Vec<String>> = rows.map(|(name, set)| pan(choice, name, set, size)).into();
    let head = ["scene", "pan", "s of a frame, all lights", "times faster"];
    support::table(&head, &rows);
}
