//! Tables of the manifest's content.

use super::Job;
use crate::cli::choose::Choice;
use crate::error::counted;
use crate::output::manifest::{AuditRow, Header, Row};
use crate::page::Table;
use crate::page::words::{bytes, count, date, percent, seconds, short, steps};
use crate::reuse::of_frame;
use crate::sequence::audit_row;
use crate::stats::{RayCounts, RayKind};
use serde_json::Value;
use std::collections::BTreeMap;

/// How to read the table of effects.
pub const EFFECTS_NOTE: &str = "Cost is weighed by fixed figures (a camera ray with the look at its \
    surface is 1; a mirror, glossy or glass ray, or a shadow ray followed through glass, 2; another shadow ray 0.25; \
    a lookup 2.5). It is an estimate: effects run interleaved, so their seconds cannot be measured one by one.";

/// Rays by the effect that cast them, with their shares.
pub fn effects(job: &Job) -> Table {
    let rays = job.rays();
    // Copies of other frames have no rays.
    let traced = job.rows.iter().filter(|row| row.rays.total() > 0);
    let lookups = traced.map(|row| row.reuse.looked_up()).sum();
    let none = RayCounts::default();
    let audit = job.audited().map_or(none, |sums| sums.rays);
    let all_cost = of_frame(&rays, lookups) + of_frame(&audit, 0);
    let all_rays = rays.total() + audit.total();
    let row = |name: &str, rays: String, share: f64, cost: f64| {
        vec![name.to_string(), rays, percent(share), percent(cost / all_cost.max(1.0))]
    };
    let share = |n: u64| n as f64 / all_rays.max(1) as f64;
    let mut table = Table::new("Rays by effect", &["", "rays", "share of rays", "share of cost"]);
    for kind in RayKind::traced().filter(|kind| rays[*kind] > 0) {
        let n = rays[kind];
        let mut cells = row(kind.name(), count(n), share(n), of_frame(&RayCounts::of(kind, n), 0));
        // The table of costs has no entry for them.
        if kind == RayKind::Retry {
            cells[3] = "not weighed".into();
        }
        table.rows.push(cells);
    }
    if lookups > 0 {
        let looked_up =
            row("Lookups in other frames", String::new(), 0.0, of_frame(&none, lookups));
        table.rows.push([&looked_up[..1], &["–".into(), "–".into()], &looked_up[3..]].concat());
    }
    if audit.total() > 0 {
        let n = audit.total();
        table.rows.push(row("Audit", count(n), share(n), of_frame(&audit, 0)));
    }
    table.rows.push(row("All", count(all_rays), 1.0, all_cost));
    table
}

/// The audits: all frames together, then the worst frames.
pub fn audit(job: &Job) -> Table {
    let head = ["", "as shown", "inferred pixels alone", "traced", "pixels drawn"];
    let mut table = Table::new("What the audits found", &head);
    let Some(all) = job.audited() else { return table };
    table.rows.push(audit_cells("All frames", &audit_row(&all)));
    let mut audited: Vec<(&Row, AuditRow)> =
        job.rows.iter().filter_map(|row| Some((row, row.audit?))).collect();
    let error = |audit: &AuditRow| audit.rmse.map_or(0.0, |[rmse, ..]| rmse);
    audited.sort_by(|(_, a), (_, b)| error(b).total_cmp(&error(a)));
    for (k, (row, audit)) in audited.iter().take(5).enumerate() {
        let worst = if k == 0 { ", the worst" } else { "" };
        table.rows.push(audit_cells(&format!("Frame {}{worst}", row.frame), audit));
    }
    table
}

fn audit_cells(name: &str, audit: &AuditRow) -> Vec<String> {
    let figure = |rmse: Option<[f64; 3]>| {
        rmse.map_or("–".into(), |r| {
            let [rmse, low, high] = r.map(steps);
            format!("{rmse} ({low}–{high})")
        })
    };
    vec![
        name.into(),
        figure(audit.rmse),
        figure(audit.rmse_inferred_pixels),
        figure(audit.rmse_traced),
        count(audit.sums.drawn),
    ]
}

/// The work of each rank.
pub fn ranks(job: &Job) -> Table {
    let mut table =
        Table::new("Ranks", &["", "frames", "seconds in frames", "rays", "rays a second"]);
    let mut ranks: BTreeMap<u32, (u64, f64, u64)> = BTreeMap::new();
    for row in &job.rows {
        let (frames, busy, rays) = ranks.entry(row.rank).or_default();
        *frames += 1;
        *busy += row.seconds;
        *rays += row.rays.total();
    }
    for (rank, (frames, busy, rays)) in ranks {
        let speed = format!("{} M", short(rays as f64 * 1e-6 / busy.max(1e-9)));
        let name = format!("Rank {rank}");
        table.rows.push(vec![name, count(frames), seconds(busy), count(rays), speed]);
    }
    table
}

/// How the settings were chosen, and the result.
pub fn chosen(job: &Job, choice: &Choice) -> Table {
    let mut table = Table::new("Chosen", &["", ""]);
    let frames = job.rows.len();
    let busy: f64 = job.rows.iter().map(|row| row.seconds).sum();
    let came_out = choice.came_out.as_deref().unwrap_or("not looked at");
    let time = match frames {
        0 => String::new(),
        _ => format!("; {} a frame", seconds(busy / frames as f64)),
    };
    let mut row = |name: &str, value: String| table.rows.push(vec![name.into(), value]);
    row("Wanted", choice.wanted.clone());
    row("Chosen", choice.options());
    row("Predicted", choice.prediction_in_words());
    row("Came out", format!("{came_out}{time}"));
    if let Some(verdict) = choice.verdict() {
        row("Verdict", verdict);
    }
    if choice.tightened > 0 {
        row("Chosen anew, since the target was missed", counted(choice.tightened as usize, "time"));
    }
    table
}

/// The manifest's head.
pub fn manifest(job: &Job) -> Table {
    let Header { tweenray, scene, scene_hash, shot_frames, files, tracer, .. } =
        &job.manifest.header;
    let mut table = Table::new("What the frames share", &["", ""]);
    let ended: Vec<f64> = job.rows.iter().filter_map(|row| row.ended).collect();
    let first = ended.iter().copied().reduce(f64::min).map_or("unknown".into(), date);
    let last = ended.iter().copied().reduce(f64::max).map_or("unknown".into(), date);
    for (name, value) in [
        ("Version of tweenray", tweenray.clone()),
        ("Scene", scene.clone()),
        ("Scene's hash (BLAKE3)", scene_hash.clone()),
        ("Frames of the move", count(u64::from(*shot_frames))),
        ("Files", files.clone()),
        ("Tracer", tracer.clone()),
        ("First frame finished", first),
        ("Last frame finished", last),
    ] {
        table.rows.push(vec![name.into(), value]);
    }
    table
}

/// Every setting, groups one after another.
pub fn settings(job: &Job) -> Table {
    let mut table = Table::new("Settings", &["setting", "value"]);
    let settings = &job.manifest.header.settings;
    flatten(&mut table, "", settings);
    table
}

fn flatten(table: &mut Table, group: &str, value: &Value) {
    for (key, value) in value.as_object().into_iter().flatten() {
        let name = format!("{group}{key}").replace('_', "-");
        match value {
            Value::Object(_) => flatten(table, &format!("{name}: "), value),
            Value::Null => table.rows.push(vec![name, "–".into()]),
            Value::String(text) => table.rows.push(vec![name, text.clone()]),
            other => table.rows.push(vec![name, other.to_string()]),
        }
    }
}

/// Every frame.
pub fn frames(job: &Job) -> Table {
    // The column of means is there only where pixels take different numbers.
    let mut head = vec!["frame", "file", "size", "seconds", "rays"];
    head.extend(job.samples().map(|_| "camera samples"));
    head.extend(["inferred", "error (1/255)", "rank"]);
    let mut table = Table::new("Frames", &head);
    for row in &job.rows {
        let error = row.audit.and_then(|audit| audit.rmse).map_or("–".into(), |[e, ..]| steps(e));
        let mut cells = vec![
            row.frame.to_string(),
            row.file.clone(),
            bytes(row.bytes),
            short(row.seconds),
            count(row.rays.total()),
        ];
        cells.extend(job.samples().map(|_| row.samples.map_or("–".into(), short)));
        let inferred = row.reuse.share().map_or("–".into(), percent);
        cells.extend([inferred, error, row.rank.to_string()]);
        table.rows.push(cells);
    }
    table
}
