//! The figures as a page.

use super::{AccuracyArgs, Outcome};
use crate::accuracy::{
    Errors, Goal, Group, Knob, Row, about_knob, about_oracle, best_within, fastest_reaching,
};
use crate::error::Result;
use crate::measure::Median;
use crate::output::video::shell_line;
use crate::page::accuracy::{AccuracyPage, Detail, KnobText, Named};
use crate::page::words::{bytes, change, count, date, percent, seconds, short};
use crate::page::{Picture, Point, Scatter, Table};
use std::time::{SystemTime, UNIX_EPOCH};

/// Most pictures in the page.
const MOST_PICTURES: usize = 14;

/// The page of `outcome`, measured by `command`.
pub fn page(args: &AccuracyArgs, outcome: &Outcome, command: &[String]) -> Result<AccuracyPage> {
    let scene = args.scene.scene.display().to_string();
    let now = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |t| t.as_secs_f64());
    Ok(AccuracyPage {
        title: scene.clone(),
        summary: summary(outcome),
        facts: facts(args, outcome),
        warnings: warnings(args, outcome),
        scatters: METRICS.iter().filter_map(|metric| scatter(outcome, metric)).collect(),
        details: details(outcome, &scene),
        goals: goals(outcome),
        knobs: knobs(outcome),
        pictures: pictures(outcome)?,
        pictured: format!("Frame {}, as a display shows it in 8 bits.", outcome.shown_frame),
        tables: vec![figures(outcome), times(outcome)],
        command: shell_line(command),
        version: env!("CARGO_PKG_VERSION").into(),
        made: date(now),
    })
}

/// A candidate's name.
pub fn name_of(options: &str) -> String {
    if options.is_empty() { "default".into() } else { options.into() }
}

fn median_of(row: &Row) -> f64 {
    row.seconds.median.interval.estimate
}

fn summary(outcome: &Outcome) -> Vec<String> {
    let default = outcome.measured.default_row();
    let (time, e) = (median_of(default), &default.errors);
    let mut lines = vec![format!(
        "By default a frame takes {} and is {}/255 off (RMSE; PSNR {} dB, FLIP {}), mean over the \
         move.",
        seconds(time),
        short(e.rmse_steps),
        short(e.psnr),
        short(e.flip)
    )];
    let half = best_within(&outcome.measured, time * 1.02).filter(|row| row.knob != Knob::Default);
    if let Some(row) = half.filter(|row| row.errors.mse < 0.9 * e.mse) {
        lines.push(format!(
            "In the same time {} comes nearer: {}/255.",
            row.options,
            short(row.errors.rmse_steps)
        ));
    }
    let same = fastest_reaching(&outcome.measured, Goal::Psnr(e.psnr));
    if let Some(row) = same.filter(|row| row.knob != Knob::Default && median_of(row) < 0.95 * time)
    {
        lines.push(format!(
            "{} is as near in {} of the time.",
            row.options,
            percent(median_of(row) / time)
        ));
    }
    lines
}

fn facts(args: &AccuracyArgs, outcome: &Outcome) -> Vec<(String, String)> {
    let frames: Vec<String> = outcome.frames.iter().map(u32::to_string).collect();
    let confidence = outcome.measured.default_row().seconds.median.confidence;
    let load = outcome.load.map(|l| l.map_or("?".into(), short));
    let base = &outcome.base;
    let fact = |name: &str, value: String| (name.to_string(), value);
    vec![
        fact("Size", format!("{} × {}", base.width, base.height)),
        fact("Frames looked at", format!("{} of {}", frames.join(", "), outcome.shot_frames)),
        fact("Settings compared", count(outcome.measured.rows.len() as u64)),
        fact("Timed", format!("{} times each, after a warm-up", args.turns)),
        fact("Intervals", format!("of {}", percent(confidence))),
        fact(
            "Reference",
            format!(
                "{} camera and {} shadow samples, {}/255 away from half as many",
                outcome.truth.settings.spp,
                outcome.truth.settings.shadow_samples,
                short(outcome.truth.change)
            ),
        ),
        fact("Threads", outcome.threads.to_string()),
        fact("Machine's load", format!("{} before, {} after", load[0], load[1])),
        fact("Tracer", outcome.tracer.clone()),
        fact("Whole sweep", seconds(outcome.seconds)),
    ]
}

fn warnings(args: &AccuracyArgs, outcome: &Outcome) -> Vec<String> {
    let mut warnings = Vec::new();
    let rows = &outcome.measured.rows;
    let best = rows.iter().map(|row| row.errors.rmse_steps).fold(f64::INFINITY, f64::min);
    let change = outcome.truth.change;
    if change > best / 4.0 {
        warnings.push(format!(
            "The reference is not far enough ahead: its last doubling changed {}/255, more than a \
             quarter of the best setting's error, {}/255. Errors near that are too large here. \
             --reference-spp lets it converge longer.",
            short(change),
            short(best)
        ));
    }
    let before = outcome.load[0].unwrap_or(0.0);
    if before > 0.5 {
        warnings.push(format!(
            "The machine was busy when this began (load {}): times are less sure than they could be.",
            short(before)
        ));
    }
    if args.turns < 6 {
        warnings.push(format!(
            "With {} timed turns the intervals hold the truth in {} of cases, not in 95 %.",
            args.turns,
            percent(outcome.measured.default_row().seconds.median.confidence)
        ));
    }
    warnings
}

/// A measure of error: what it is called, its unit, its figure.
struct Metric {
    name: &'static str,
    hint: &'static str,
    unit: &'static str,
    of: fn(&Errors) -> Option<f64>,
}

const METRICS: [Metric; 5] = [
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
        Some(Group::Intersection | Group::Oracle) => ("c4", "rules of intersection"),
    }
}

fn scatter(outcome: &Outcome, metric: &Metric) -> Option<Scatter> {
    let rows = &outcome.measured.rows;
    let point = |(id, row): (usize, &Row)| {
        let interval = row.seconds.median.interval;
        let y = (metric.of)(&row.errors)?;
        Some(Point {
            id,
            name: name_of(&row.options),
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

fn with_ends(m: &Median, word: fn(f64) -> String) -> String {
    let i = m.interval;
    format!("{} ({}–{})", word(i.estimate), word(i.low), word(i.high))
}

fn details(outcome: &Outcome, scene: &str) -> Vec<Detail> {
    let detail = |(id, row): (usize, &Row)| {
        let e = &row.errors;
        let mut figures = vec![
            ("Seconds a frame", with_ends(&row.seconds.median, short)),
            ("CPU seconds", short(row.cpu_seconds.median.interval.estimate)),
        ];
        if let Some(ratio) = &row.time_ratio {
            let word = if ratio.differs_from(1.0) { "" } else { ", within noise" };
            let i = ratio.interval;
            let [is, low, high] = [i.estimate, i.low, i.high].map(change);
            figures.push(("Time against default", format!("{is} ({low} to {high}){word}")));
        }
        figures.extend([
            ("RMSE", format!("{}/255", short(e.rmse_steps))),
            ("PSNR", format!("{} dB", short(e.psnr))),
            ("SSIM", format!("{:.5}", e.ssim)),
            ("FLIP", short(e.flip)),
            ("Off by more than 2/255", percent(e.share_over_2)),
            ("Rays a frame", count(row.rays_per_frame.round() as u64)),
            ("Memory", bytes(row.memory_bytes)),
        ]);
        let figures = figures.into_iter().map(|(name, value)| (name.to_string(), value)).collect();
        let options = if row.options.is_empty() { "" } else { " " };
        let command = format!("tweenray render {scene}{options}{}", row.options);
        Detail { id, name: name_of(&row.options), figures, command }
    };
    outcome.measured.rows.iter().enumerate().map(detail).collect()
}

fn goals(outcome: &Outcome) -> Table {
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
                [wanted, name_of(&row.options), short(median_of(row)), reached]
            }
        };
        table.rows.push(cells.into());
    }
    table
}

fn knobs(outcome: &Outcome) -> Vec<KnobText> {
    let mut seen: Vec<Knob> = Vec::new();
    for row in &outcome.measured.rows {
        let alone = !matches!(row.knob, Knob::Default | Knob::Combination);
        if alone && !seen.contains(&row.knob) {
            seen.push(row.knob);
        }
    }
    let text = |knob: Knob| KnobText {
        name: knob.name().into(),
        sentences: about_knob(&outcome.measured, knob),
    };
    let mut all: Vec<KnobText> = seen.into_iter().map(text).collect();
    if let Some(crop) = &outcome.oracle {
        all.push(KnobText { name: "Oracle".into(), sentences: vec![about_oracle(crop)] });
    }
    all
}

/// The default, the reference, then what is on the front, then the rest, as many as there is room for.
fn pictures(outcome: &Outcome) -> Result<Vec<Named>> {
    let rows = &outcome.measured.rows;
    let named = |candidate: usize| {
        let found = outcome.pictures.iter().find(|p| p.candidate == candidate);
        found.map(|p| Named {
            name: name_of(&rows[candidate].options),
            id: Some(candidate),
            picture: p.picture.clone(),
        })
    };
    let front = (1..rows.len()).filter(|k| rows[*k].on_front);
    let rest = (1..rows.len()).filter(|k| !rows[*k].on_front && rows[*k].knob != Knob::Combination);
    let order: Vec<usize> = std::iter::once(0).chain(front).chain(rest).collect();
    let mut all: Vec<Named> = order.into_iter().filter_map(named).take(MOST_PICTURES - 1).collect();
    let truth = Picture::png(&outcome.truth.frames[&outcome.shown_frame])?;
    all.insert(1.min(all.len()), Named { name: "reference".into(), id: None, picture: truth });
    Ok(all)
}

fn figures(outcome: &Outcome) -> Table {
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

fn times(outcome: &Outcome) -> Table {
    let head = ["", "wall seconds", "CPU seconds", "against default", "beyond noise"];
    let mut table = Table::new("Times, with their intervals", &head);
    for row in &outcome.measured.rows {
        let ratio = row.time_ratio.as_ref();
        let against = ratio.map_or("–".into(), |r| {
            let [is, low, high] =
                [r.interval.estimate, r.interval.low, r.interval.high].map(change);
            format!("{is} ({low} to {high})")
        });
        let beyond = match ratio {
            None => "–",
            Some(r) if r.differs_from(1.0) => "yes",
            Some(_) => "no",
        };
        table.rows.push(vec![
            name_of(&row.options),
            with_ends(&row.seconds.median, short),
            with_ends(&row.cpu_seconds.median, short),
            against,
            beyond.into(),
        ]);
    }
    table
}
