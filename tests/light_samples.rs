//! Shadow and sky samples from the least to the most: fewer rays for nearly the same picture, a bound on what is
//! missed, the same bytes however a frame is cut, and inferred frames that are no worse than traced ones.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "shows what it measured")]

mod common;
#[path = "common/moves.rs"]
mod moves;

use common::{job, pose, quad};
use moves::{Set, Stage, codes, mean_square, psnr_of};
use tweenray::film::Film;
use tweenray::intersect;
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::{Light, Material, Policy, QuadLight, Settings, Shot, World};
use tweenray::shade::{FrameJob, Rendered, Renderer};
use tweenray::stats::RayKind;

const SCENES: [&str; 4] = ["cornell", "demo", "reflective_spheres", "spheres_on_terrain"];

/// `settings` with at least so many shadow and sky samples.
fn from(least: u32, settings: &Settings) -> Settings {
    let least = Some(least);
    Settings { least_shadow_samples: least, least_sky_samples: least, ..settings.clone() }
}

fn traced(stage: &Stage, settings: &Settings, shot: &Shot, stream: u32) -> Rendered {
    let camera = shot.camera(8, settings.width, settings.height).unwrap();
    let job = FrameJob::whole(&camera, stream);
    let render = || stage.renderer(settings).render_job(&job, &stage.stop, &());
    stage.pool.install(render).unwrap()
}

#[test]
fn fewer_rays_make_nearly_the_same_picture() {
    for scene in SCENES {
        let set = Set::load(scene, |_| ());
        let (stage, shot) = (set.stage(2), set.shot(16));
        let all = set.settings((160, 90), 4, 16);
        let truth = stage.converged(&all, &shot, 8, 256);
        let of = |settings: &Settings| {
            let Rendered { film, rays, .. } = traced(&stage, settings, &shot, 8);
            (rays[RayKind::ShadowArea], psnr_of(settings, &film, &truth))
        };
        let (rays, psnr) = of(&all);
        for least in [2, 4] {
            let (fewer, close) = of(&from(least, &all));
            let share = fewer as f64 / rays as f64;
            println!(
                "{scene} {least}..16: {share:.2} of the rays, {close:.2} dB, with all {psnr:.2}"
            );
            assert!(share < if least == 2 { 0.8 } else { 0.9 }, "{scene} {least}: {share}");
            // Above 80 dB there is nothing to see.
            assert!(close.min(80.0) > psnr.min(80.0) - 0.5, "{scene} {least}: {close}, {psnr}");
        }
    }
}

/// The figures of `docs/accuracy.md`: with pilots to area lights, then to the sky too, the rays to both and the time of
/// a traced frame as shares of those without, and the errors of light.
#[test]
#[ignore = "a minute; measures time"]
fn figures_of_pilots() {
    let median = |mut all: Vec<f64>| {
        all.sort_by(f64::total_cmp);
        all[all.len() / 2]
    };
    for scene in SCENES {
        let set = Set::load(scene, |_| ());
        let (stage, shot) = (set.stage(1), set.shot(16));
        let all = set.settings((320, 180), 4, 16);
        let truth = stage.converged(&all, &shot, 8, 512);
        let of_lights = |least| Settings { least_shadow_samples: Some(least), ..all.clone() };
        let candidates = [all.clone(), of_lights(1), of_lights(2), of_lights(4), from(2, &all)];
        let timed = |settings: &Settings| {
            let begun = std::time::Instant::now();
            let done = traced(&stage, settings, &shot, 8);
            (begun.elapsed().as_secs_f64(), done)
        };
        let mut shares = [const { Vec::new() }; 5];
        for _ in 0..7 {
            let seconds = candidates.each_ref().map(|settings| timed(settings).0);
            (0..5).for_each(|k| shares[k].push(seconds[k] / seconds[0]));
        }
        let [area, sky] = [RayKind::ShadowArea, RayKind::ShadowSky].map(|kind| {
            candidates.each_ref().map(|settings| timed(settings).1.rays[kind].max(1) as f64)
        });
        for (k, settings) in candidates.iter().enumerate() {
            let psnr = psnr_of(settings, &timed(settings).1.film, &truth);
            println!(
                "{scene} {}, {}: area lights {:.2}, sky {:.2}, time {:.2}, {psnr:.2} dB",
                settings.shadow_sample_range(),
                settings.sky_sample_range(),
                area[k] / area[0],
                sky[k] / sky[0],
                median(shares[k].clone())
            );
        }
    }
}

/// A point whose pilots all reach a light although a share x of it is hidden is off by x. With n pilots in the pixels
/// that count this happens with a probability of at most (1 - x)^n, so the mean error is at most 1 / (e n).
#[test]
fn missed_shadows_stay_below_the_stated_bound() {
    // A small plate just below a light hides the same share of it from every point of a small floor far below.
    let mut world = World::default();
    let white = world.add_material(Material::diffuse("white", Rgb::splat(0.8)));
    let square = |y: f64, half: f64| {
        [(-half, -half), (half, -half), (half, half), (-half, half)]
            .map(|(x, z)| DVec3::new(x, y, z))
    };
    let whole = Settings::default();
    let range = Settings { most_spp: Some(16), ..whole.clone() };
    let cases = [(1, 0.1), (2, 0.05), (2, 0.1), (4, 0.04), (4, 0.2)];
    let cases = cases.map(|(pilots, plate)| (4, &whole, pilots, plate));
    // Pilots are compared four camera samples at a time, so more of these change nothing.
    let many = [(64, &whole, 1, 0.0707), (16, &whole, 2, 0.1), (4, &range, 1, 0.1)];
    for (spp, settings, pilots, plate) in cases.into_iter().chain(many) {
        let mut world = world.clone();
        world.meshes.push(quad(square(0.0, 3.0), white));
        world.meshes.push(quad(square(99.99, plate), white));
        let (corners, radiance) = (square(100.0, 1.0), Rgb::splat(900.0));
        world.lights.push(Light::Quad(QuadLight { corners, radiance, two_sided: true }));
        let mut job = job(world, pose((0.0, 40.0, 0.1), (0.0, 0.0, 0.0)), 64, 64);
        let area = |job: &common::Job| {
            let scene = job.world.clone().into_scene(true).unwrap();
            let intersector = intersect::build(&scene, &job.settings, 1).unwrap();
            let stop = std::sync::atomic::AtomicBool::new(false);
            let renderer = Renderer::new(&scene, &job.settings, &*intersector);
            let mean = |stream: u32| {
                let frame = FrameJob::whole(&job.camera, stream);
                let film = renderer.render_job(&frame, &stop, &()).unwrap().film;
                let own = (8..56).flat_map(|y| (8..56).map(move |x| (x, y)));
                own.map(|(x, y)| f64::from(film.rgb[film.index(x, y)].x)).sum::<f64>()
            };
            (1..9).map(mean).sum::<f64>() / 8.0
        };
        (job.settings.spp, job.settings.shadow_samples) = (spp, 64);
        job.settings.most_spp = settings.most_spp;
        let all = area(&job);
        job.settings.least_shadow_samples = Some(pilots);
        let fewer = area(&job);
        let bias = fewer / all - 1.0;
        // At a block's corner nine pixels count, each with four camera samples.
        let bound = 1.0 / (std::f64::consts::E * f64::from(9 * 4 * pilots));
        let hidden = plate * plate;
        println!(
            "{spp} camera samples, {pilots} pilots, {hidden:.4} hidden: too bright by {bias:.5}, at most {bound:.5}"
        );
        assert!(bias < bound && bias > -1e-4, "{spp} {pilots} {plate}");
    }
}

/// Some rows of blocks, as another rank would render them, have the samples of the whole frame.
#[test]
fn a_part_of_a_frame_has_the_bytes_of_the_whole() {
    let set = Set::load("demo", |_| ());
    let (stage, shot) = (set.stage(2), set.shot(16));
    let settings = from(1, &set.settings((100, 60), 6, 8));
    for settings in [settings.clone(), Settings { most_spp: Some(13), ..settings }] {
        let whole = traced(&stage, &settings, &shot, 8).film;
        let camera = shot.camera(8, 100, 60).unwrap();
        for rows in [0..8, 16..40, 56..60] {
            let mask: Vec<bool> = (0..60 * 100).map(|i| rows.contains(&(i / 100))).collect();
            let job = FrameJob { mask: Some(&mask), ..FrameJob::whole(&camera, 8) };
            let render = || stage.renderer(&settings).render_job(&job, &stage.stop, &());
            let part = stage.pool.install(render).unwrap().film;
            for i in (0..mask.len()).filter(|i| mask[*i]) {
                assert_eq!(part.rgb[i], whole.rgb[i], "{i}");
            }
        }
    }
}

#[test]
fn inferred_frames_are_no_worse_than_traced_ones() {
    for scene in ["cornell", "spheres_on_terrain"] {
        let set = Set::load(scene, |_| ());
        let (stage, shot) = (set.stage(2), set.shot(16));
        let settings = from(2, &set.settings((128, 72), 4, 16));
        let off = |settings: &Settings| {
            let mut settings = settings.clone();
            settings.reuse.policy = Policy::Off;
            settings
        };
        let made = stage.frames(&settings, &shot, &[5, 8]);
        for (made, frame) in made.iter().zip([5, 8]) {
            let truth = stage.converged(&off(&settings), &shot, frame, 256);
            let one = stage.traced(&off(&settings), &shot, frame, frame);
            let error =
                |film: &Film| mean_square(&codes(&settings, film), &codes(&settings, &truth));
            let [inferred, traced] = [&made.film, &one].map(error);
            println!("{scene} {frame}: inferred {inferred:.3e}, traced {traced:.3e}");
            // A quarter of a display step is allowed.
            assert!(inferred < 1.07 * traced + (0.25f64 / 255.0).powi(2), "{scene} {frame}");
        }
    }
}
