//! What each hit rule costs: nanoseconds of a camera ray, per cent of a frame.

use crate::suite::Size;
use crate::support::{self, Candidate, Times, camera_rays};
use std::sync::atomic::AtomicBool;
use tweenray::film::Film;
use tweenray::intersect::{EmbreeIntersector, Intersector, Ray, SurfaceInteraction};
use tweenray::scene::{HitRules, Recheck, Scene, Settings, Shot};
use tweenray::shade::Renderer;
use tweenray::stats::RayCounts;

/// All rules together may take this many times the bare camera ray.
const MOST: f64 = 1.2;
/// The frame whose camera it is.
const FRAME: u32 = 8;

/// The rules, each added to those before it; the last is the slow form of the one before.
const STEPS: [(&str, HitRules); 7] = {
    let off = HitRules {
        robust: false,
        retry: false,
        recheck: Recheck::Off,
        spawn_offset: false,
        recentre: false,
    };
    let recentre = HitRules { recentre: true, ..off };
    let robust = HitRules { robust: true, ..recentre };
    let retry = HitRules { retry: true, ..robust };
    let offset = HitRules { spawn_offset: true, ..retry };
    let risky = HitRules { recheck: Recheck::Risky, ..offset };
    let always = HitRules { recheck: Recheck::Always, ..offset };
    [
        ("no rules", off),
        ("+ recentring", recentre),
        ("+ robust", robust),
        ("+ second try", retry),
        ("+ spawn offset", offset),
        ("+ recheck, risky hits at once", risky),
        ("  instead: all hits at once", always),
    ]
};
/// The default, all rules on.
const ALL: usize = 5;

/// Prints the table; whether all rules together keep below their limit.
pub fn report(size: Size) -> bool {
    let loaded = support::bench_scene();
    let settings = loaded.settings;
    let scenes = [false, true].map(|recentre| loaded.world.clone().into_scene(recentre).unwrap());
    let scene_of = |rules: &HitRules| &scenes[usize::from(rules.recentre)];
    let layers: Vec<EmbreeIntersector> = STEPS
        .iter()
        .map(|(_, rules)| EmbreeIntersector::new(scene_of(rules), *rules, None, 2).unwrap())
        .collect();
    let rays: Vec<Vec<Ray>> = scenes
        .iter()
        .map(|scene| {
            let camera = loaded.shot.camera(FRAME, settings.width, settings.height).unwrap();
            camera_rays::all(&camera.to_scene(&scene.recentring))
        })
        .collect();
    let mut candidates: Vec<Candidate> = Vec::new();
    for ((name, rules), layer) in STEPS.iter().zip(&layers) {
        let rays = &rays[usize::from(rules.recentre)];
        candidates.push((name.to_string(), Box::new(move || trace(layer, rays))));
    }
    let primary = support::take_turns(size.of(5, 31), &mut candidates);
    // The recheck of most hits waits until their surface is looked at.
    let mut candidates: Vec<Candidate> = Vec::new();
    for k in [0, ALL] {
        let (name, rules) = STEPS[k];
        let (layer, scene, rays) =
            (&layers[k], scene_of(&rules), &rays[usize::from(rules.recentre)]);
        candidates.push((name.to_string(), Box::new(move || look(scene, layer, rays))));
    }
    let surfaces = support::take_turns(size.of(5, 31), &mut candidates);
    let mut candidates: Vec<Candidate> = Vec::new();
    for ((name, rules), layer) in STEPS.iter().zip(&layers) {
        let settings = Settings { width: 320, height: 180, rules: *rules, ..settings.clone() };
        let (scene, shot) = (scene_of(rules), &loaded.shot);
        candidates.push((
            name.to_string(),
            Box::new(move || _ = frame(scene, shot, settings.clone(), layer)),
        ));
    }
    let frames = support::take_turns(size.of(1, 7), &mut candidates);
    print(&primary, &frames, rays[0].len());
    let [low, ratio, high] = primary[ALL].over(&primary[0]);
    println!(
        "\nall rules over none, camera rays: {ratio:.3} (quartiles {low:.3} to {high:.3}); at most {MOST}"
    );
    let per_ray = |time: &Times| time.median() / rays[0].len() as f64 * 1e9;
    let [low, total, high] = surfaces[1].over(&surfaces[0]);
    println!(
        "with the surface at every hit, where the deferred recheck is done: {:.1} ns a ray with all \
         rules, {:.1} with none: {total:.3} (quartiles {low:.3} to {high:.3})",
        per_ray(&surfaces[1]),
        per_ray(&surfaces[0])
    );
    ratio <= MOST
}

fn trace(layer: &dyn Intersector, rays: &[Ray]) {
    let mut hits = vec![None; camera_rays::BLOCK];
    for block in rays.chunks(camera_rays::BLOCK) {
        layer.intersect_batch(block, &mut hits[..block.len()], &mut RayCounts::default());
        std::hint::black_box(&hits);
    }
}

/// [`trace`], and the surface at every hit.
fn look(scene: &Scene, layer: &dyn Intersector, rays: &[Ray]) {
    let mut hits = vec![None; camera_rays::BLOCK];
    for block in rays.chunks(camera_rays::BLOCK) {
        let hits = &mut hits[..block.len()];
        layer.intersect_batch(block, hits, &mut RayCounts::default());
        for (ray, hit) in block.iter().zip(hits) {
            if let Some(hit) = hit {
                std::hint::black_box(SurfaceInteraction::new(scene, ray, hit));
            }
        }
    }
}

fn frame(scene: &Scene, shot: &Shot, settings: Settings, layer: &dyn Intersector) -> Film {
    let camera = shot.camera(FRAME, settings.width, settings.height).unwrap();
    let renderer = Renderer::new(scene, &settings, layer);
    let stop = AtomicBool::new(false);
    renderer.render(&camera, FRAME, false, &stop, &()).unwrap().0
}

fn print(primary: &[Times], frames: &[Times], rays: usize) {
    let per_ray = |seconds: f64| format!("{:.1}", seconds / rays as f64 * 1e9);
    let share =
        |time: &Times, base: &Times| format!("{:+.1} %", 100.0 * (time.over(base)[1] - 1.0));
    let rows: Vec<Vec<String>> = (0..STEPS.len())
        .map(|k| {
            let (p, f) = (&primary[k], &frames[k]);
            let mut row = vec![STEPS[k].0.to_string(), per_ray(p.median())];
            row.push(format!("±{:.0} %", p.spread()));
            // The last step stands in place of the one before it.
            let before = if k > ALL { ALL - 1 } else { k.max(1) - 1 };
            match k {
                0 => row.extend(["".into(), "".into()]),
                _ => row.extend([per_ray(p.less(&primary[before])), share(p, &primary[before])]),
            }
            row.push(format!("{:.3}", f.median()));
            row.push(format!("±{:.0} %", f.spread()));
            row.push(if k == 0 { "".into() } else { share(f, &frames[before]) });
            row
        })
        .collect();
    let head = ["rule", "ns a ray", "spread", "adds ns", "adds", "frame, s", "spread", "adds"];
    support::table(&head, &rows);
}
