//! `./x accuracy`: what accuracy costs on five scenes of `scenes/`. Sweeps them with the program, and writes the
//! measured part of `docs/accuracy.md` and its pictures from what came out. Up to 90 minutes a scene; a run
//! that was stopped goes on. The pages of the sweeps lie in `out/accuracy`.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a program for people")]

mod heat;
mod page;
mod plot;
mod sweep;

use sweep::Sweep;

/// The scenes.
const SCENES: [&str; 5] =
    ["cornell", "reflective_spheres", "demo", "spheres_on_terrain", "courtyard"];

fn main() {
    let named: Vec<String> = std::env::args().skip(1).collect();
    let is_meant = |name: &str| named.is_empty() || named.iter().any(|n| n == name);
    let sweeps: Vec<Sweep> =
        SCENES.iter().filter(|name| is_meant(name)).map(|name| Sweep::run(name)).collect();
    assert!(!sweeps.is_empty(), "no such scene: {}", named.join(" "));
    for sweep in &sweeps {
        plot::write(sweep);
        heat::write(sweep);
    }
    let text = page::text(&sweeps);
    println!("{text}");
    page::write(&text);
}
