//! The file of `--stats`: times, rays and memory of a job, as JSON.

use super::machine::{Machine, peak_memory};
use crate::cluster::{Outcome, RankWork};
use crate::error::Result;
use crate::output::atomic;
use crate::output::manifest::{AuditRow, Header};
use crate::sequence::{FrameReport, Plan, audit_row};
use crate::stats::{AuditSums, BadSamples, RayCounts, ReuseCounts};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The statistics of one rank.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct RankStats {
    /// Rendering threads.
    pub threads: usize,
    /// Seconds to read the scene.
    pub load_seconds: f64,
    /// Seconds to build the acceleration structure.
    pub build_seconds: f64,
    /// Seconds from the first frame to the last, waiting for other ranks included.
    pub render_seconds: f64,
    /// Memory of the acceleration structure.
    pub intersector_bytes: u64,
    /// Most memory that reference frames took at a time.
    pub reference_bytes: u64,
    /// Seconds to encode and write references to disk.
    pub checkpoint_seconds: f64,
    /// Bytes of references written to disk.
    pub checkpoint_bytes: u64,
    /// The work of the process from the first frame to the last.
    #[serde(flatten)]
    pub work: RankWork,
    /// Most memory held at once; `None` if the system does not report it.
    pub peak_memory_bytes: Option<u64>,
}

impl RankStats {
    /// The statistics with the peak memory of now.
    pub fn with_peak(self) -> Self {
        Self { peak_memory_bytes: peak_memory(), ..self }
    }
}

#[derive(Serialize)]
struct Stats<'a> {
    tweenray: &'a str,
    scene: &'a str,
    scene_hash: &'a str,
    tracer: &'a str,
    machine: Machine,
    settings: &'a serde_json::Value,
    complete: bool,
    total_seconds: f64,
    load_seconds: f64,
    build_seconds: f64,
    render_seconds: f64,
    busy_seconds: f64,
    waiting_seconds: f64,
    balance: f64,
    peak_memory_bytes: Option<u64>,
    reference_bytes: u64,
    rays: RayCounts,
    reuse: ReuseCounts,
    bad_samples: BadSamples,
    audit: Option<AuditRow>,
    kept: &'a [u32],
    frames: Vec<Frame<'a>>,
    ranks: &'a [RankStats],
}

#[derive(Serialize)]
struct Frame<'a> {
    rank: u32,
    #[serde(flatten)]
    report: &'a FrameReport,
}

/// Invalid samples of all frames asked for, rendered now or kept.
pub fn bad_of(plan: &Plan, outcome: &Outcome) -> BadSamples {
    let mut sum = BadSamples::default();
    plan.kept_bad.iter().for_each(|(_, bad)| sum += *bad);
    outcome.frames.iter().for_each(|(_, report)| sum += report.bad);
    sum
}

/// Surface points of the frames rendered by this job, and those inferred.
pub fn reuse_of(outcome: &Outcome) -> ReuseCounts {
    let mut sum = ReuseCounts::default();
    outcome.frames.iter().for_each(|(_, report)| sum += report.reuse);
    sum
}

/// The audit of all frames asked for together, rendered now or kept; `None` if none
/// was audited.
pub fn audit_of(plan: &Plan, outcome: &Outcome) -> Option<AuditRow> {
    let audits = audits_of(plan, outcome);
    let sums = audits.iter().map(|(_, sums)| *sums).sum();
    (!audits.is_empty()).then(|| audit_row(&sums))
}

/// The audits of the frames asked for, by frame.
pub fn audits_of(plan: &Plan, outcome: &Outcome) -> Vec<(u32, AuditSums)> {
    let audit = |report: &FrameReport| Some((report.frame, report.audit?.sums));
    let rendered = outcome.frames.iter().filter_map(|(_, report)| audit(report));
    let mut audits: Vec<_> = plan.kept_audits.iter().copied().chain(rendered).collect();
    audits.sort_by_key(|(frame, _)| *frame);
    audits
}

/// Writes the file at `path`, whole. `ranks` starts with rank 0, whose times the top level shows.
pub fn write(
    path: &Path,
    header: &Header,
    plan: &Plan,
    outcome: &Outcome,
    ranks: &[RankStats],
    total_seconds: f64,
) -> Result<()> {
    let mut rays = RayCounts::default();
    outcome.frames.iter().for_each(|(_, report)| rays += report.rays);
    // The first pixel of several frames is none's; each frame tells its own.
    let mut bad_samples = bad_of(plan, outcome);
    bad_samples.first = None;
    let slowest = |of: fn(&RankStats) -> f64| ranks.iter().map(of).fold(0.0, f64::max);
    let busy: f64 = ranks.iter().map(|r| r.work.busy_seconds).sum();
    let most = slowest(|r| r.work.busy_seconds);
    let stats = Stats {
        tweenray: &header.tweenray,
        scene: &header.scene,
        scene_hash: &header.scene_hash,
        tracer: &header.tracer,
        machine: Machine::here(),
        settings: &header.settings,
        complete: outcome.unfinished == 0,
        total_seconds,
        load_seconds: slowest(|r| r.load_seconds),
        build_seconds: slowest(|r| r.build_seconds),
        render_seconds: slowest(|r| r.render_seconds),
        busy_seconds: busy,
        waiting_seconds: ranks.iter().map(|r| r.work.waiting_seconds).sum(),
        balance: if most > 0.0 { busy / ranks.len() as f64 / most } else { 1.0 },
        peak_memory_bytes: ranks.iter().filter_map(|r| r.peak_memory_bytes).max(),
        reference_bytes: ranks.iter().map(|r| r.reference_bytes).max().unwrap_or(0),
        rays,
        reuse: reuse_of(outcome),
        bad_samples,
        audit: audit_of(plan, outcome),
        kept: &plan.kept,
        frames: outcome.frames.iter().map(|(rank, report)| Frame { rank: *rank, report }).collect(),
        ranks,
    };
    atomic::write_json(path, &stats)
}
