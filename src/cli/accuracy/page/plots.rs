//! Error against time.

use crate::accuracy::{CandidateRow, Errors, Group, Knob};
use crate::cli::accuracy::Outcome;
use crate::page::words::{seconds, short};
use crate::page::{Point, Scatter};

/// A measure of error: its name, its unit, and how to get it.
pub struct Metric {
    name: &'static str,
    hint: &'static str,
    unit: &'static str,
    of: fn(&Errors) -> Option<f64>,
}

/// All measures of error.
pub const METRICS: [Metric; 5] = [
    Metric {
        name: "RMSE",
        hint: "root mean squared error, display steps of 1/255",
        unit: "",
        of: |e| Some(e.rmse_steps),
    },
    Metric { name: "1 − SSIM", hint: "1 less SSIM", unit: "", of: |e| Some(1.0 - e.ssim) },
    Metric { name: "FLIP", hint: "mean FLIP", unit: "", of: |e| Some(e.flip) },
    Metric {
        name: "Pixels off",
        hint: "share of pixels off by more than 2/255",
        unit: " %",
        of: |e| Some(100.0 * e.share_over_2),
    },
    Metric {
        name: "Flicker",
        hint: "change of the error from frame to frame, display steps of 1/255",
        unit: "",
        of: |e| e.flicker,
    },
];

/// Class and name of a group's colour.
fn colour_of(knob: Knob) -> (&'static str, &'static str) {
    match knob.group() {
        None => ("c0", "default"),
        Some(Group::Combinations) => ("c5", "combinations"),
        Some(Group::Reuse) => ("c1", "reuse"),
        Some(Group::Samples) => ("c2", "samples"),
        Some(Group::Specular) => ("c3", "bounces, cut-off"),
        Some(Group::Tree) => ("c6", "Embree's tree"),
        Some(Group::Denoiser) => ("c7", "denoised"),
        Some(Group::Intersection | Group::Oracle | Group::Writing) => {
            ("c4", "rules of intersection")
        }
    }
}

/// Error by `metric` against time; `None` where no setting has it.
pub fn scatter(outcome: &Outcome, metric: &Metric) -> Option<Scatter> {
    let rows = &outcome.measured.rows;
    let point = |(id, row): (usize, &CandidateRow)| {
        let interval = row.seconds.median.interval;
        let y = (metric.of)(&row.errors)?;
        Some(Point {
            id,
            name: row.name(),
            text: format!(
                "{}, {} {}{}",
                seconds(interval.estimate),
                metric.name,
                short(y),
                metric.unit
            ),
            x: interval.estimate,
            x_ends: [interval.low, interval.high],
            y,
            class: colour_of(row.knob).0.into(),
            is_default: row.knob == Knob::Default,
            is_front: row.on_front,
        })
    };
    let points: Vec<Point> = rows.iter().enumerate().filter_map(point).collect();
    if points.is_empty() {
        return None;
    }
    let mut legend: Vec<(String, String)> = Vec::new();
    for (class, name) in rows.iter().map(|row| colour_of(row.knob)) {
        if legend.iter().all(|(c, _)| c != class) {
            legend.push((class.into(), name.into()));
        }
    }
    Some(Scatter {
        caption: metric.name.into(),
        hint: format!("upwards: {}; to the right: seconds a frame", metric.hint),
        units: [" s".into(), metric.unit.into()],
        points,
        legend,
        metric: metric.name.into(),
    })
}
