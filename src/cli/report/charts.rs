//! Charts of figures that change from frame to frame.

use super::Job;
use crate::output::manifest::Row;
use crate::page::{Chart, Series, Span, Timeline};
use crate::stats::RayKind;

/// All charts that have data.
pub fn all(job: &Job) -> Vec<Chart> {
    let charts = [Some(seconds(job)), reuse(job), samples(job), Some(rays(job)), audit(job)];
    charts.into_iter().flatten().filter(|_| !job.rows.is_empty()).collect()
}

/// Whether no point of the frame was inferred.
fn is_traced(row: &Row) -> bool {
    !row.reuse.is_inferred()
}

fn frames(job: &Job) -> Vec<u32> {
    job.rows.iter().map(|row| row.frame).collect()
}

fn series(job: &Job, name: &str, value: impl Fn(&Row) -> Option<f64>) -> Series {
    Series { name: name.into(), values: job.rows.iter().map(value).collect() }
}

fn seconds(job: &Job) -> Chart {
    let of = |traced: bool| move |row: &Row| (is_traced(row) == traced).then_some(row.seconds);
    Chart {
        caption: "Seconds per frame".into(),
        unit: " s".into(),
        frames: frames(job),
        bars: vec![series(job, "traced whole", of(true)), series(job, "inferred", of(false))],
        ..Chart::default()
    }
}

fn reuse(job: &Job) -> Option<Chart> {
    let per_cent = |share: Option<f64>| share.map(|s| 100.0 * s);
    let all = series(job, "all surface points", |row| per_cent(row.reuse.share()));
    all.values.iter().flatten().next()?;
    let mut lines = vec![all];
    let specular = series(job, "in mirrors, glass and out of focus", |row| {
        per_cent(row.reuse.specular_share())
    });
    if specular.values.iter().any(Option::is_some) {
        lines.push(specular);
    }
    Some(Chart {
        caption: "Lit surface points inferred from other frames".into(),
        unit: " %".into(),
        frames: frames(job),
        lines,
        most: Some(100.0),
        ..Chart::default()
    })
}

fn samples(job: &Job) -> Option<Chart> {
    job.samples()?;
    Some(Chart {
        caption: "Camera samples a pixel, mean of a frame".into(),
        frames: frames(job),
        lines: vec![series(job, "camera samples", |row| row.samples)],
        ..Chart::default()
    })
}

fn rays(job: &Job) -> Chart {
    let millions = |count: u64| (count > 0).then_some(count as f64 * 1e-6);
    let bars =
        RayKind::traced().map(|kind| series(job, kind.name(), |row| millions(row.rays[kind])));
    let cast = bars.filter(|s| s.values.iter().any(Option::is_some));
    Chart {
        caption: "Rays per frame".into(),
        unit: " M".into(),
        frames: frames(job),
        bars: cast.collect(),
        ..Chart::default()
    }
}

fn audit(job: &Job) -> Option<Chart> {
    let shown = series(job, "as shown", |row| row.audit?.rmse.map(|[rmse, ..]| rmse));
    shown.values.iter().flatten().next()?;
    let traced =
        series(job, "had it been traced", |row| row.audit?.rmse_traced.map(|[rmse, ..]| rmse));
    let band = job.rows.iter().map(|row| row.audit?.rmse.map(|[_, low, high]| [low, high]));
    Some(Chart {
        caption: "Error by the audit, display steps of 1/255 (grey: 95 %)".into(),
        frames: frames(job),
        lines: vec![shown, traced],
        band: band.collect(),
        ..Chart::default()
    })
}

/// When each rank rendered which frame; `None` if the manifest has no times.
pub fn timeline(job: &Job) -> Option<Timeline> {
    let started = |row: &Row| row.ended.map(|ended| ended - row.seconds);
    let start = job.rows.iter().filter_map(started).reduce(f64::min)?;
    let span = |row: &Row| {
        let ended = row.ended? - start;
        let seconds = [ended - row.seconds, ended];
        Some(Span { rank: row.rank, frame: row.frame, seconds, is_traced: is_traced(row) })
    };
    Some(Timeline {
        caption: "When each rank rendered which frame".into(),
        spans: job.rows.iter().filter_map(span).collect(),
    })
}
