//! `./x figures [MESH]`: figures 3 to 6, 13 and 17 of "Optimized Ray Tracing for Single Scene
//! Renders" (2023), made by its algorithm (policy `colour`), with ours (policy `surface`) beside
//! them, into `docs/pictures`; and how far each is from the converged frame. MESH stands in for the
//! rabbit.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a program for people")]

mod picture;
#[path = "../bloopers/rabbit.rs"]
mod rabbit;
mod shots;

use picture::{by_difference, hit_or_traced, painted, save_grid};
use shots::{FRAMES, Filmed};
use std::path::Path;
use tweenray::film::{Encoding, Film, Image, Provenance, ProvenanceKind};
use tweenray::measure::{mse, psnr};
use tweenray::reuse::colour::{AgreementRule, distance_difference};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/pictures");
/// A frame well between any two samples of the figures.
const FRAME: u32 = 7;
/// That of `--policy colour`.
const USUAL: AgreementRule = AgreementRule { colour_epsilon: 0.02, distance_epsilon: 0.02 };
/// What the paper's figures show is made by larger ones.
const LENIENT: AgreementRule = AgreementRule { colour_epsilon: 0.1, distance_epsilon: 0.2 };
const NO_COLOUR: AgreementRule =
    AgreementRule { colour_epsilon: f32::INFINITY, distance_epsilon: 0.2 };

fn main() {
    let mesh = match std::env::args().nth(1) {
        Some(file) => rabbit::read(Path::new(&file)),
        None => rabbit::rabbit(),
    };
    println!("PSNR in dB against the converged frame, and the share of the pixels that was traced");
    let spheres = shots::spheres();
    let truth = spheres.converged(FRAME);
    distances(&spheres);
    uploads(&spheres, &truth);
    hits(&spheres, &truth);
    no_colour_epsilon(&spheres, &truth);
    wide_pan(&shots::rabbit(mesh));
}

fn save(name: &str, columns: u32, panels: &[Film]) {
    let path = Path::new(FOLDER).join(name).with_extension("png");
    save_grid(&path, columns, panels);
    println!("{}", path.display());
}

/// Prints a row of the table; gives the film back.
fn measured(name: &str, truth: &Film, film: Film) -> Film {
    let shown = |film| Image::of_film(film).clipped(Encoding::Srgb);
    let db = psnr(mse(&shown(truth), &shown(&film)));
    let sources = film.provenance.as_deref();
    let traced = |s: &[Provenance]| s.iter().filter(|s| is_traced(s)).count() as f64;
    let share = sources.map_or(1.0, |s| traced(s) / s.len() as f64);
    println!("  {name:<52} {db:5.1} dB  {:5.1} %", 100.0 * share);
    film
}

fn is_traced(source: &Provenance) -> bool {
    source.kind == ProvenanceKind::Traced
}

/// Figures 3 and 4: where the distance differs from the first sample's; what is traced again.
fn distances(spheres: &Filmed) {
    let (first, frame) = (spheres.traced(1), spheres.traced(FRAME));
    let depth = |film: &Film, i: usize| film.gbuffer.as_ref().unwrap().depth[i];
    let differences =
        painted(&frame, |i| by_difference(distance_difference(depth(&first, i), depth(&frame, i))));
    let lenient = spheres.colour(FRAME, LENIENT, &[]);
    let sources = lenient.provenance.as_ref().unwrap();
    let traced =
        painted(&lenient, |i| hit_or_traced(&sources[i]).filter(|_| is_traced(&sources[i])));
    save("figure-3-4-distances", 2, &[differences, traced]);
}

/// Figure 5: traced; three, one and no uploaded pictures; what the last of these traced; ours.
fn uploads(spheres: &Filmed, truth: &Film) {
    let upload = |frame| (frame, Image::of_film(&spheres.traced(frame)).clipped(Encoding::Srgb));
    let [three, one] = [[5, 9, 13].as_slice(), &[9]].map(|frames| {
        let uploads: Vec<_> = frames.iter().map(|f| upload(*f)).collect();
        let name = format!("figure 5: colour, {} uploaded", frames.len());
        measured(&name, truth, spheres.colour(FRAME, LENIENT, &uploads))
    });
    let none = measured("figure 5: colour, none", truth, spheres.colour(FRAME, LENIENT, &[]));
    let ours = measured("figure 5: surface", truth, spheres.surface(FRAME));
    let traced = measured("figure 5: every pixel traced", truth, spheres.traced(FRAME));
    let sources = none.provenance.clone().unwrap();
    let map = painted(&none, |i| hit_or_traced(&sources[i]).filter(|_| is_traced(&sources[i])));
    save("figure-5-uploads", 3, &[traced, three, one, none, map, ours]);
}

/// Figure 6: the frame and where its pixels come from, for the paper's policy and for ours.
fn hits(spheres: &Filmed, truth: &Film) {
    let colour = measured("figure 6: colour", truth, spheres.colour(FRAME, USUAL, &[]));
    let surface = measured("figure 6: surface", truth, spheres.surface(FRAME));
    let sources = colour.provenance.as_ref().unwrap();
    // Where first and last frame agree, no frame between is ever traced.
    let middle = spheres.colour(FRAMES.div_ceil(2), USUAL, &[]).provenance.unwrap();
    let map = painted(&colour, |i| match middle[i].kind {
        ProvenanceKind::Both => None,
        _ => hit_or_traced(&sources[i]),
    });
    let sources = surface.provenance.clone().unwrap_or_default();
    let ours = painted(&surface, |i| sources.get(i).and_then(hit_or_traced));
    save("figure-6-hits", 2, &[colour, map, surface, ours]);
}

/// Figure 13: colours that need not agree.
fn no_colour_epsilon(spheres: &Filmed, truth: &Film) {
    let blurred = spheres.colour(FRAME, NO_COLOUR, &[]);
    let blurred = measured("figure 13: colour, no colour epsilon", truth, blurred);
    save("figure-13-blur", 2, &[blurred, spheres.surface(FRAME)]);
}

/// Figure 17: two samples of a pan that is too wide for them.
fn wide_pan(rabbit: &Filmed) {
    let truth = rabbit.converged(FRAME);
    let deformed = rabbit.colour(FRAME, LENIENT, &[]);
    let deformed = measured("figure 17: colour", &truth, deformed);
    let ours = measured("figure 17: surface", &truth, rabbit.surface(FRAME));
    measured("figure 17: every pixel traced", &truth, rabbit.traced(FRAME));
    save("figure-17-wide-pan", 2, &[deformed, ours]);
}
