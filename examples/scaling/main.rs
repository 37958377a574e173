//! `./x scaling`: what a job would take on 1 to 4,096 ranks. Frames, messages and a few real ranks are
//! measured here, a job is simulated with these costs and the program's own scheduler, and
//! `docs/scaling.md` and its picture are written from that. Several minutes.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a program for people")]

mod costs;
mod fit;
#[path = "../../tests/common/mpirun.rs"]
mod launcher;
mod page;
mod paper;
mod plot;
mod predict;
mod real;
mod simulation;

use predict::{Change, MOST, NONE, curve};

fn main() {
    let before = load();
    let stage = real::Stage::of("reflective_spheres");
    println!("real ranks, oversubscribed");
    let fit = fit::fit(&stage);
    println!("frames of the large job");
    let costs = predict::measure(&stage, fit.costs.message_bytes);
    let ours = curve(&costs, "tweenray", &[1, 4, 16, 64, 256, 1024, 2048, MOST], NONE);
    let others: Vec<(&str, predict::Curve)> = [
        ("a hundred times the latency", Change { latency: 100.0, ..NONE }),
        ("a tenth of the bandwidth", Change { bandwidth: 0.1, ..NONE }),
        ("twice the time for each control message", Change { message: 2.0, ..NONE }),
        ("stretches of the path 30 % heavier and lighter", Change { swing: 0.3, ..NONE }),
        (
            "segments of 128, the default: half of one for each rank",
            Change { segment: 128, ..NONE },
        ),
        ("a scheduler that takes no time", Change { is_scheduler_free: true, ..NONE }),
    ]
    .into_iter()
    .map(|(name, change)| (name, curve(&costs, name, &[MOST], change)))
    .collect();
    let small_costs = costs::Costs { comm_share: costs.comm_share, ..fit.costs.clone() };
    let small = curve(&small_costs, "frames of 400x300", &[64, 256, 1024, MOST], NONE);
    let paper = paper::tables(&stage, &small_costs);
    let to_all = Change { sends_to_all: true, ..NONE };
    let all =
        curve(&costs, "every discovery to every rank", &[1, 4, 16, 64, 256, 1024, MOST], to_all);
    let machine = machine(&before);
    let page = page::Page {
        machine: &machine,
        fit: &fit,
        costs: &costs,
        ours: &ours,
        all: &all,
        others: &others,
        small: &small,
        paper: &paper,
    };
    page.write();
}

/// What it ran on, in words, with the load average of the last minute before it began and now.
fn machine(before: &str) -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let online = info.lines().filter(|line| line.starts_with("processor")).count();
    let own = std::thread::available_parallelism().map_or(1, usize::from);
    let model = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    let model = model.map_or("unknown", |(_, name)| name.trim());
    format!(
        "{own} of {online} cores ({model}), which other work used too: the load average was {before} when it \
         began and {} when it ended",
        load()
    )
}

fn load() -> String {
    let text = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    text.split(' ').next().unwrap_or("unknown").into()
}
