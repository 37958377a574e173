//! All figures.

use super::{median_of, with_changes, with_ends};
use crate::accuracy::{Goal, fastest_reaching, perhaps_faster};
use crate::cli::accuracy::Outcome;
use crate::measure::Median;
use crate::page::Table;
use crate::page::words::{bytes, count, percent, seconds, short};
use crate::stats::{RayCounts, RayKind};

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
                let perhaps = perhaps_faster(&outcome.measured, goal, row)
                    .map_or(String::new(), |row| {
                        format!("; perhaps {}, which takes more --turns to tell", row.name())
                    });
                let name = row.name() + &perhaps;
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
        "error against default",
        "off > 2/255 from default",
        "rays a frame",
        "memory",
        "front",
        "front by CPU time",
    ];
    let mut table = Table::new("Errors", &head);
    for row in &outcome.measured.rows {
        let e = &row.errors;
        table.rows.push(vec![
            row.name(),
            short(median_of(row)),
            short(e.rmse_steps),
            short(e.psnr),
            format!("{:.5}", e.ssim),
            short(e.flip),
            percent(e.share_over_2),
            e.flicker.map_or("–".into(), short),
            row.error_ratio.as_ref().map_or("–".into(), with_changes),
            row.change.map_or("–".into(), |change| count(change.over_2)),
            count(row.rays_per_frame.round() as u64),
            bytes(row.memory_bytes),
            yes(row.on_front),
            yes(row.on_cpu_front),
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
        "to build the tree",
    ];
    let mut table = Table::new("Times, with their intervals", &head);
    for row in &outcome.measured.rows {
        let [wall, beyond] = against(row.time_ratio.as_ref());
        let [cpu, cpu_beyond] = against(row.cpu_ratio.as_ref());
        table.rows.push(vec![
            row.name(),
            with_ends(&row.seconds.median, short),
            wall,
            beyond,
            with_ends(&row.cpu_seconds.median, short),
            cpu,
            cpu_beyond,
            seconds(row.build_seconds.median.interval.estimate),
        ]);
    }
    table
}

/// A ratio to the default's, and whether it is more than noise.
fn against(ratio: Option<&Median>) -> [String; 2] {
    let Some(ratio) = ratio else { return ["–".into(), "–".into()] };
    let beyond = match ratio.is_sure() {
        true if ratio.differs_from(1.0) => "yes",
        true => "no",
        false => "too few turns",
    };
    [with_changes(ratio), beyond.into()]
}

/// Every setting's rays.
pub fn rays(outcome: &Outcome) -> Table {
    let of = |rays: &RayCounts| RayKind::ALL.map(|kind| count(rays[kind]));
    let head: Vec<&str> = std::iter::once("").chain(RayKind::ALL.map(RayKind::name)).collect();
    let caption =
        "Rays of a turn by kind: of the frames looked at and those that they are inferred from";
    let mut table = Table::new(caption, &head);
    for row in &outcome.measured.rows {
        table.rows.push(std::iter::once(row.name()).chain(of(&row.rays)).collect());
    }
    table
}

fn yes(is_so: bool) -> String {
    if is_so { "yes" } else { "" }.into()
}
