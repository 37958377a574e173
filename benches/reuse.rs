//! Reuse between frames: how accurate inferred frames are beside traced ones, and how fast.
#![allow(clippy::print_stdout, reason = "a bench prints its figures")]

mod support;

use rayon::ThreadPoolBuilder;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;
use tweenray::effects::EffectPlan;
use tweenray::film::Film;
use tweenray::import::{self, LoadOptions};
use tweenray::intersect::EmbreeIntersector;
use tweenray::math::srgb_encode;
use tweenray::scene::{Settings, Shot};
use tweenray::sequence::{FrameMaker, Inferrer, Pyramid};
use tweenray::shade::{FrameJob, Progress, Renderer};
use tweenray::stats::RayCounts;

struct Quiet;
impl Progress for Quiet {
    fn tile_done(&self, _: f64, _: &RayCounts) {}
}

fn var<T: std::str::FromStr>(name: &str, default: T) -> T {
    std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default)
}

fn main() {
    let scene: String = var("SCENE", "spheres_on_terrain".into());
    let scene_name = scene.clone();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{scene}/scene.toml"));
    let loaded = import::load(&file, &LoadOptions::default()).expect("loads");
    let mut world = loaded.world.clone();
    if var("NEAR", 0) == 1 {
        for light in &mut world.lights {
            if let tweenray::scene::Light::Quad(q) = light {
                q.corners.iter_mut().for_each(|c| c.y = 2.5);
            }
        }
    }
    let shot = Shot { frames: var("FRAMES", 33), ..loaded.shot.clone() };
    let samples = var("SAMPLES", 16);
    let settings = Settings {
        width: var("W", 480),
        height: var("H", 270),
        spp: var("SPP", 1),
        shadow_samples: samples,
        sky_samples: if loaded.settings.sky_samples > 0 { samples } else { 0 },
        reuse: tweenray::scene::ReuseSettings { audit: 0.0, ..loaded.settings.reuse },
        ..loaded.settings.clone()
    };
    let flat = Settings { bounces: 0, ..settings.clone() };
    let best = Settings { shadow_samples: 1024, sky_samples: 1024, ..settings.clone() };
    let scene = world.into_scene(true).expect("a scene");
    let intersector = EmbreeIntersector::new(&scene, settings.rules, None, 4).expect("a BVH");
    let pool = ThreadPoolBuilder::new().num_threads(var("THREADS", 4)).build().expect("threads");
    let stop = AtomicBool::new(false);
    let renderer = |settings| Renderer {
        scene: &scene,
        settings,
        plan: EffectPlan::of(&scene, settings),
        intersector: &intersector,
    };
    let frames: Vec<u32> = (1..=shot.frames).collect();
    let pyramid = Pyramid { segment: var("SEGMENT", 64), frames: shot.frames };
    let mut maker =
        Inferrer::new(renderer(&settings), &shot, &pool, &stop, &Quiet, pyramid).expect("cameras");
    maker.expect(&frames);
    let e = &mut maker.evidence;
    e.least_weight = var("LEAST", e.least_weight);
    e.enough_weight = var("ENOUGH", e.enough_weight);
    e.least_cos = var("COS", e.least_cos);
    e.height = var("HEIGHT", e.height);
    e.slope = var("SLOPE", e.slope);
    e.coarser = var("COARSER", e.coarser);
    e.tolerance = var("TOL", e.tolerance);
    e.noise = var("NOISE", e.noise);
    e.offset = var("OFFSET", e.offset);
    e.offset_saturated = var("OFFSATS", e.offset_saturated);
    e.grazing = var("GRAZING", e.grazing);
    let every: u32 = var("EVERY", 4);
    let order = pyramid.order(&frames);
    let (mut lit, mut spec) = ((0, 0), (0, 0));
    let (mut key_time, mut between_time, mut betweens) = (0.0, 0.0, 0);
    let mut worst = f64::INFINITY;
    for frame in order {
        let start = Instant::now();
        let made = maker.make(frame).expect("made").expect("whole");
        let seconds = start.elapsed().as_secs_f64();
        let r = made.reuse;
        if pyramid.is_key(frame) {
            key_time += seconds;
            continue;
        }
        between_time += seconds;
        betweens += 1;
        lit = (lit.0 + r.direct_inferred, lit.1 + r.direct);
        spec = (spec.0 + r.specular_inferred, spec.1 + r.specular);
        if every == 0 || (frame % every != 0 && frame != 2 && frame != shot.frames - 1) {
            continue;
        }
        let camera = shot.camera(frame, settings.width, settings.height).expect("camera");
        let traced = || {
            let start = Instant::now();
            let film =
                renderer(&settings).render(&camera, frame, false, &stop, &Quiet).expect("x").0;
            (film, start.elapsed().as_secs_f64())
        };
        let (traced, traced_time) = pool.install(traced);
        let job = FrameJob {
            camera: &camera,
            stream: 1 << 30,
            with_gbuffer: false,
            beyond_crop: false,
            reuse: None,
            mask: None,
        };
        let truth =
            pool.install(|| renderer(&best).render_job(&job, &stop, &Quiet)).expect("x").film;
        let (a, b) = (psnr(&made.film, &truth), psnr(&traced, &truth));
        worst = worst.min(a - b);
        println!(
            "frame {frame:3}: inferred {a:.2} dB, traced {b:.2} dB, {:+.2}; direct {:.2} %, specular {:.2} % of {:.2} %; {:.1} of {:.1} ms",
            a - b,
            100.0 * r.direct_inferred as f64 / r.direct.max(1) as f64,
            100.0 * r.specular_inferred as f64 / r.specular.max(1) as f64,
            100.0 * r.specular as f64 / (settings.width * settings.height) as f64,
            1e3 * seconds,
            1e3 * traced_time,
        );
        if std::env::var("PROBE").is_ok() {
            use tweenray::inference::*;
            use tweenray::reuse::*;
            struct Tell<'a>(Lookup<'a>);
            impl Inference for Tell<'_> {
                fn infer(&self, q: &mut Questions) {
                    self.0.infer(q);
                    for (i, p) in q.points.iter().enumerate() {
                        let c = self.0.rays.len();
                        println!(
                            "   {p:?} -> {:?} {:?}",
                            &q.ratios[i * c..(i + 1) * c],
                            q.origins[i]
                        );
                    }
                }
            }
            let channels = channels(&scene, &renderer(&settings).plan, &settings);
            let rays = vec![settings.shadow_samples; channels.len()];
            let reference = |f: u32| {
                let camera = shot.camera(f, settings.width, settings.height).expect("camera");
                let reuse = Some(tweenray::shade::Reuse { channels: &channels, inference: None });
                let job = FrameJob {
                    camera: &camera,
                    stream: f,
                    with_gbuffer: false,
                    beyond_crop: false,
                    reuse,
                    mask: None,
                };
                let made = pool
                    .install(|| renderer(&settings).render_job(&job, &stop, &Quiet))
                    .expect("x");
                Reference::new(
                    f,
                    &camera.to_scene(&scene.recentring),
                    &made.sources,
                    channels.len(),
                )
            };
            let (a, b) = (reference(1), reference(shot.frames));
            let refs = [&a, &b];
            let mut worst: Vec<(f32, usize)> = (0..truth.rgb.len())
                .map(|i| (made.film.rgb[i].distance(truth.rgb[i]), i))
                .collect();
            worst.sort_by(|a, b| b.0.total_cmp(&a.0));
            for (error, i) in &worst[..12] {
                println!(
                    "pixel {},{}: {error} {:?} {:?}",
                    i % settings.width as usize,
                    i / settings.width as usize,
                    made.film.rgb[*i],
                    truth.rgb[*i]
                );
                let mut mask = vec![false; truth.rgb.len()];
                mask[*i] = true;
                let tell = Tell(Lookup {
                    frame,
                    references: &refs,
                    rays: &rays,
                    evidence: maker.evidence,
                });
                for inference in [Some(&tell as &dyn Inference), None] {
                    let reuse = Some(tweenray::shade::Reuse { channels: &channels, inference });
                    let job = FrameJob {
                        camera: &camera,
                        stream: frame,
                        with_gbuffer: false,
                        beyond_crop: false,
                        reuse,
                        mask: Some(&mask),
                    };
                    let r = renderer(&settings).render_job(&job, &stop, &Quiet).expect("x");
                    let c = channels.len();
                    for (k, p) in r.sources.points.iter().enumerate() {
                        println!(
                            "     traced {:?} {:?}",
                            p.point.p,
                            &r.sources.ratios[k * c..(k + 1) * c]
                        );
                    }
                }
            }
        }
        if std::env::var("SPLIT").is_ok() {
            let plain: Film = pool.install(|| {
                renderer(&flat).render(&camera, frame, false, &stop, &Quiet).expect("x").0
            });
            let display = |x: f32| 255.0 * srgb_encode(f64::from(x.clamp(0.0, 1.0)));
            let mut sums = std::collections::BTreeMap::new();
            for i in 0..truth.rgb.len() {
                let specular = plain.rgb[i].distance(traced.rgb[i]) > 0.05;
                let provenance = made.film.sources.as_ref().expect("s")[i].provenance;
                let error = |f: &Film| {
                    let pairs = f.rgb[i].to_array().into_iter().zip(truth.rgb[i].to_array());
                    pairs.map(|(a, b)| (display(a) - display(b)).powi(2)).sum::<f64>() / 3.0
                };
                let entry =
                    sums.entry((specular, provenance as u8)).or_insert((0, 0.0, 0.0, 0.0f64));
                entry.0 += 1;
                entry.1 += error(&made.film);
                entry.2 += error(&traced);
                entry.3 = entry.3.max(error(&made.film));
            }
            for ((specular, provenance), (n, a, b, most)) in sums {
                println!(
                    "    specular {specular:5} provenance {provenance}: {n:6} pixels, squared error {a:9.0} against {b:9.0}; worst {:.1}",
                    most.sqrt()
                );
            }
        }
        if std::env::var("DUMP").is_ok() {
            use tweenray::output::{WriteOptions, write_image};
            let o = WriteOptions::of(&settings, None);
            write_image(format!("/tmp/r_{frame}_inferred.png"), &made.film, &o).expect("w");
            write_image(format!("/tmp/r_{frame}_traced.png"), &traced, &o).expect("w");
            let mut difference = truth.clone();
            for (d, i) in difference.rgb.iter_mut().zip(&made.film.rgb) {
                *d = (*d - *i).abs() * 20.0;
            }
            write_image(format!("/tmp/r_{frame}_difference.png"), &difference, &o).expect("w");
            let mut difference = truth.clone();
            for (d, i) in difference.rgb.iter_mut().zip(&traced.rgb) {
                *d = (*d - *i).abs() * 20.0;
            }
            write_image(format!("/tmp/r_{frame}_noise.png"), &difference, &o).expect("w");
            let mut p = Film::new(truth.width, truth.height, false);
            for (d, s) in p.rgb.iter_mut().zip(made.film.sources.as_ref().expect("s")) {
                use tweenray::film::Provenance::*;
                *d = match s.provenance {
                    Background => tweenray::math::Rgb::ZERO,
                    Traced => tweenray::math::Rgb::new(1.0, 0.3, 0.6),
                    Earlier => tweenray::math::Rgb::new(0.5, 0.0, 0.0),
                    Later => tweenray::math::Rgb::new(0.0, 0.0, 0.5),
                    Both => tweenray::math::Rgb::new(0.2, 0.2, 0.2),
                };
            }
            write_image(format!("/tmp/r_{frame}_map.png"), &p, &o).expect("w");
        }
    }
    println!(
        "direct {:.3} %, specular {:.3} %, worst {worst:+.2} dB, keys {:.1} ms, in-betweens {:.1} ms each",
        100.0 * lit.0 as f64 / lit.1.max(1) as f64,
        100.0 * spec.0 as f64 / spec.1.max(1) as f64,
        1e3 * key_time,
        1e3 * between_time / f64::from(betweens.max(1)),
    );
}

fn psnr(a: &Film, b: &Film) -> f64 {
    let display = |x: f32| srgb_encode(f64::from(x.clamp(0.0, 1.0)));
    let mut sum = 0.0;
    for (a, b) in a.rgb.iter().zip(&b.rgb) {
        for (a, b) in a.to_array().iter().zip(b.to_array()) {
            sum += (display(*a) - display(b)).powi(2);
        }
    }
    -10.0 * (sum / (3 * a.rgb.len()) as f64).log10()
}
