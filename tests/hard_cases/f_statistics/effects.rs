//! Effects that a scene does not call for: no ray, no instruction, no bit.
//!
//! The kernel for such a scene is compiled without them. What a reader may doubt is whether the rest
//! of the program makes up for it, so whole renders are counted, each in a process of its own: the
//! scene as it is; the same with glass, mirror and lamp materials that nothing uses; and with the
//! kernel that leaves nothing out, which is what a renderer pays that asks at every hit.

use crate::common::{self, Job};
use crate::shapes;
use crate::suite::{Outcome, Size};
use std::process::Command;
use tweenray::effects::EffectPlan;
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::{DirectionalLight, Glass, Light, Material, Sky, World};
use tweenray::stats::RayKind;

/// Says which render the process is to do; unset, it runs the case.
const RENDER: &str = "TWEENRAY_CASE_62";

/// A bumpy ball on a floor under the sun, matte.
fn plain() -> World {
    let mut world = shapes::world_of(shapes::sphere(DVec3::new(0.0, 1.0, 0.0), 1.0, 200, 100));
    let p = DVec3::new;
    let floor = [p(-4.0, 0.0, 4.0), p(4.0, 0.0, 4.0), p(4.0, 0.0, -4.0), p(-4.0, 0.0, -4.0)];
    world.meshes.push(common::quad(floor, 0));
    world.lights.push(Light::Directional(DirectionalLight {
        to_light: p(1.0, 2.0, 1.0).normalize(),
        irradiance: Rgb::splat(2.0),
    }));
    world.sky = Sky { radiance: Rgb::splat(0.4), lights: false, ambient: Rgb::splat(0.1) };
    world
}

fn with_unused(mut world: World) -> World {
    let glass = Glass { priority: Some(1), ..Glass::clear(1.5) };
    world.materials.extend([
        Material { mirror: Rgb::ONE, ..Material::black("mirror") },
        Material { glass: Some(glass), ..Material::black("glass") },
        Material { glass: Some(Glass { priority: None, ..glass }), ..Material::black("pane") },
        Material { emission: Rgb::ONE, ..Material::black("lamp") },
    ]);
    world
}

fn job(world: World, edge: u32) -> Job {
    let camera = common::pose((0.0, 2.0, 5.0), (0.0, 0.7, 0.0));
    let mut job = common::job(world, camera, edge, edge);
    job.settings.spp = 4;
    job
}

/// What the child process does: builds, and renders some times.
fn render(which: &str, edge: u32, times: u32) {
    let world = if which == "unused" { with_unused(plain()) } else { plain() };
    let job = job(world, edge);
    let scene = job.world.clone().into_scene(true).unwrap();
    let render = match which {
        "everything" => common::render_with_every_effect,
        _ => common::render_scene,
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    for _ in 0..times {
        pool.install(|| render(&scene, &job));
    }
}

/// User instructions of a child process that renders, by `perf stat` or, where the processor's
/// counters are out of reach and time allows, by valgrind; `None` where neither counts.
fn instructions(which: &str, edge: u32, times: u32, size: Size) -> Option<f64> {
    let run = |tool: &[&str]| {
        // The test binary takes the test's name, the stress binary the case's: this serves both.
        let mut command = Command::new(tool[0]);
        command.args(&tool[1..]).arg(std::env::current_exe().unwrap()).arg("effects_cost_nothing");
        command.env(RENDER, format!("{which} {edge} {times}"));
        let out = command.output().ok()?;
        Some(String::from_utf8_lossy(&out.stderr).into_owned())
    };
    let number = |text: &str| text.trim().parse::<f64>().ok();
    let perf = run(&["perf", "stat", "-x,", "-e", "instructions:u"]).and_then(|text| {
        let line = text.lines().find(|line| line.contains("instructions:u"))?;
        number(line.split(',').next()?)
    });
    if perf.is_some() || size == Size::Small {
        return perf;
    }
    let callgrind = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null"];
    let text = run(&callgrind)?;
    number(text.lines().find_map(|line| line.split("Collected :").nth(1))?)
}

/// Instructions of one render: the difference between `times` + 1 and 1, so that starting the
/// process and building the scene do not count.
fn of_one_render(which: &str, edge: u32, times: u32, size: Size) -> Option<f64> {
    let more = instructions(which, edge, times + 1, size)?;
    Some((more - instructions(which, edge, 1, size)?) / f64::from(times))
}

pub fn effects_cost_nothing(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    if let Ok(request) = std::env::var(RENDER) {
        let words: Vec<&str> = request.split(' ').collect();
        render(words[0], words[1].parse().unwrap(), words[2].parse().unwrap());
        outcome.count(1, 0);
        return outcome;
    }
    let job = job(plain(), size.of(64, 512));
    let scene = job.world.clone().into_scene(true).unwrap();
    let plan = EffectPlan::of(&scene, &job.settings);
    let off =
        !(plan.mirror || plan.glass || plan.nested_glass || plan.area_lights || plan.sky_light);
    outcome.check(off, || format!("{plan:?}"));
    let (film, counts) = common::render_scene(&scene, &job);
    let none = counts[RayKind::Mirror]
        + counts[RayKind::Glass]
        + counts[RayKind::ShadowArea]
        + counts[RayKind::ShadowSky];
    outcome.check(none == 0 && counts[RayKind::ShadowDelta] > 0, || format!("{counts:?}"));
    let (all, all_counts) = common::render_with_every_effect(&scene, &job);
    outcome.check(film == all, || "other bytes with everything on".into());
    outcome.check(counts == all_counts, || format!("{counts:?} and {all_counts:?}"));
    let unused = with_unused(plain()).into_scene(true).unwrap();
    let (same, _) = common::render_scene(&unused, &job);
    outcome.check(film == same, || "other bytes with unused materials".into());
    count_instructions(&mut outcome, size);
    outcome
}

fn count_instructions(outcome: &mut Outcome, size: Size) {
    let (edge, times) = size.of((96, 2), (128, 2));
    let Some(plain) = of_one_render("plain", edge, times, size) else {
        outcome.skip("the count of instructions: neither perf nor valgrind counts them in time");
        return;
    };
    let ratio = |which| of_one_render(which, edge, times, size).map_or(f64::NAN, |n| n / plain);
    let samples = f64::from(edge * edge * 4);
    outcome.show(format!("instructions a camera sample: {:.0}", plain / samples));
    let again = (ratio("plain") - 1.0).abs();
    outcome.show(format!("counted twice: {:.3} % apart", 100.0 * again));
    let unused = ratio("unused") - 1.0;
    outcome.at_most("share more with materials that nothing uses", unused, 0.01);
    let everything = ratio("everything") - 1.0;
    outcome.show(format!("with everything on: {:+.2} %", 100.0 * everything));
}
