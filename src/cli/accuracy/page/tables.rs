//! All figures.

use super::{median_of, name_of, with_ends};
use crate::accuracy::{Goal, fastest_reaching, is_by_few_turns};
use crate::cli::accuracy::Outcome;
use crate::measure::Median;
use crate::page::Table;
use crate::page::words::{bytes, change, count, percent, short};

/// The fastest setting for errors that one may want.
pub fn goals(outcome: &Outcome) -> Table {
    let head = ["wanted", "fastest setting measured", "seconds a frame", "comes to"];
    let mut table = Table::new("The fastest setting for an error", &head);
    let psnr = |db: f64| (format!("PSNR {db} dB"), Goal::Psnr(db));
    let goals = [
        psnr(30.0),
        psnr(35.0),
        psnr(40.0),
        psnr(45.0),
        psnr(50.0),
        ("SSIM 0.99".into(), Goal::Ssim(0.99)),
        ("FLIP 0.01".into(), Goal::Flip(0.01)),
        ("0.1 % of pixels off by more than 2/255".into(), Goal::MaxShare(0.001)),
    ];
    for (wanted, goal) in goals {
        let cells = match fastest_reaching(&outcome.measured, goal) {
            None => [wanted, "none of them".into(), "–".into(), "–".into()],
            Some(row) => {
                let e = &row.errors;
                let reached = match goal {
                    Goal::Psnr(_) => format!("{} dB", short(e.psnr)),
                    Goal::Ssim(_) => format!("{:.4}", e.ssim),
                    Goal::Flip(_) => short(e.flip),
                    Goal::MaxShare(_) => percent(e.share_over_2),
                };
                let few = if is_by_few_turns(row) { ", by so few turns" } else { "" };
                let name = name_of(&row.options) + few;
                [wanted, name, short(median_of(row)), reached]
            }
        };
        table.rows.push(cells.into());
    }
    table
}

/// Every setting's errors.
pub fn figures(outcome: &Outcome) -> Table {
    let head = [
        "",
        "seconds",
        "RMSE /255",
        "PSNR dB",
        "SSIM",
        "FLIP",
        "off > 2/255",
        "flicker /255",
        "rays a frame",
        "memory",
        "front",
    ];
    let mut table = Table::new("Errors", &head);
    for row in &outcome.measured.rows {
        let e = &row.errors;
        table.rows.push(vec![
            name_of(&row.options),
            short(median_of(row)),
            short(e.rmse_steps),
            short(e.psnr),
            format!("{:.5}", e.ssim),
            short(e.flip),
            percent(e.share_over_2),
            e.flicker.map_or("–".into(), short),
            count(row.rays_per_frame.round() as u64),
            bytes(row.memory_bytes),
            if row.on_front { "yes" } else { "" }.into(),
        ]);
    }
    table
}

/// Every setting's times, with their intervals.
pub fn times(outcome: &Outcome) -> Table {
    let head = [
        "",
        "wall seconds",
        "against default",
        "beyond noise",
        "CPU seconds",
        "against default",
        "beyond noise",
    ];
    let mut table = Table::new("Times, with their intervals", &head);
    for row in &outcome.measured.rows {
        let [wall, beyond] = against(row.time_ratio.as_ref());
        let [cpu, cpu_beyond] = against(row.cpu_ratio.as_ref());
        table.rows.push(vec![
            name_of(&row.options),
            with_ends(&row.seconds.median, short),
            wall,
            beyond,
            with_ends(&row.cpu_seconds.median, short),
            cpu,
            cpu_beyond,
        ]);
    }
    table
}

/// A ratio to the default's, and whether it is more than noise.
fn against(ratio: Option<&Median>) -> [String; 2] {
    let Some(ratio) = ratio else { return ["–".into(), "–".into()] };
    let i = ratio.interval;
    let [is, low, high] = [i.estimate, i.low, i.high].map(change);
    let beyond = match ratio.is_sure() {
        true if ratio.differs_from(1.0) => "yes",
        true => "no",
        false => "too few turns",
    };
    [format!("{is} ({low} to {high})"), beyond.into()]
}
