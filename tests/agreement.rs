//! Embree against the f64 oracle, and the bench scene against another renderer's picture of it.

#![allow(clippy::unwrap_used)]

mod common;

use common::{load_job, render, threads};
use std::path::Path;
use std::sync::atomic::AtomicBool;
use tweenray::film::Film;
use tweenray::intersect::{self, Intersector};
use tweenray::math::Rgb;
use tweenray::scene::IntersectorKind;
use tweenray::shade::Renderer;
use tweenray::stats::RayKind;

/// Linear radiance that Embree and the oracle may differ by.
const TOLERANCE: f32 = 1e-5;

/// Both intersectors render the scene; every pixel agrees.
fn both_agree(scene: &str, frame: u32) {
    let mut job = load_job(scene, frame, Some((96, 72)));
    let (embree, embree_rays) = render(&job);
    job.settings.intersector = IntersectorKind::Oracle;
    let (oracle, oracle_rays) = render(&job);
    assert!(embree.rgb.iter().any(|c| c.max_element() > 0.05), "{scene} is dark");
    let apart: Vec<String> = common::pixels(&embree)
        .filter(|(x, y, c)| !c.abs_diff_eq(oracle.rgb[oracle.index(*x, *y)], TOLERANCE))
        .map(|(x, y, c)| format!("({x}, {y}): {c} and {}", oracle.rgb[oracle.index(x, y)]))
        .collect();
    assert!(apart.is_empty(), "{scene}, frame {frame}: {apart:#?}");
    assert_eq!(embree_rays[RayKind::Camera], oracle_rays[RayKind::Camera]);
}

#[test]
fn embree_and_oracle_agree_on_cornell() {
    both_agree("cornell", 1);
}

#[test]
fn embree_and_oracle_agree_on_reflective_spheres() {
    for frame in [1, 7, 16] {
        both_agree("reflective_spheres", frame);
    }
}

/// Frame i = 7 of the bench scene against a 2,048-sample image of another renderer, both clipped
/// to [0, 1]: RMSE over the 85 % of pixels that agree best, and over all.
#[test]
fn bench_scene_agrees_with_another_renderer() {
    let reference = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/peers/reference_07.exr");
    if !reference.exists() {
        eprintln!("SKIPPED: there is no reference image at {}", reference.display());
        return;
    }
    let reference = tweenray::output::read_image(&reference).unwrap();
    let mut job = load_job("spheres_on_terrain", 8, None);
    job.settings.spp = 64;
    job.settings.shadow_samples = 4;
    job.settings.sky_samples = 2;
    job.settings.bounces = 8;
    let film = on_all_cores(&job);
    let mut errors: Vec<f64> =
        film.rgb.iter().zip(&reference.rgb).map(|(a, b)| squared_error(*a, *b)).collect();
    errors.sort_by(f64::total_cmp);
    let rmse = |part: &[f64]| (part.iter().sum::<f64>() / part.len() as f64).sqrt();
    let best = rmse(&errors[..errors.len() * 85 / 100]);
    let all = rmse(&errors);
    println!("RMSE against the reference: {best:.5} over the best 85 %, {all:.5} over all");
    assert!(best <= 0.001, "the best 85 %: {best:.5}");
    assert!(all <= 0.015, "all pixels: {all:.5}");
}

fn squared_error(a: Rgb, b: Rgb) -> f64 {
    let clip = |c: Rgb| c.clamp(Rgb::ZERO, Rgb::ONE).as_dvec3();
    (clip(a) - clip(b)).length_squared() / 3.0
}

fn on_all_cores(job: &common::Job) -> Film {
    let scene = job.world.clone().into_scene(true).unwrap();
    let intersector: Box<dyn Intersector + Send> =
        intersect::build(&scene, &job.settings, threads()).unwrap();
    let renderer = Renderer::new(&scene, &job.settings, &*intersector);
    renderer.render(&job.camera, 8, false, &AtomicBool::new(false), &()).unwrap().0
}
