//! The results of `verify`, as a table or as JSON.

use super::{VerifyArgs, replay_command};
use crate::cli::say;
use crate::error::Result;
use crate::verify::{
    BAND_ULPS, Check, Class, ClassRow, EDGE_ON_LIMIT, Kind, NARROW_LIMIT, OPEN_VERTEX_LIMIT,
    PAST_VERTEX_LIMIT, Tally,
};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write;

/// The JSON document; `docs/verify.md` describes it.
#[derive(Serialize)]
struct Report {
    scene: String,
    product: String,
    oracle: String,
    triangles: usize,
    seed: u64,
    band_ulps: f64,
    rays: BTreeMap<Kind, u64>,
    /// Whether all requested rays were compared.
    complete: bool,
    passed: bool,
    unexplained: u64,
    /// Share of the vertex rays that may be `past-vertex`; then the number of rays that it allows.
    past_vertex_limit: f64,
    past_vertex_allowed: u64,
    /// The same for vertices of open meshes.
    open_vertex_limit: f64,
    open_vertex_allowed: u64,
    /// The same for triangles seen edge on: a share of the edge rays, and one of those that see the triangle at which they are
    /// aimed edge on.
    edge_on_limit: f64,
    edge_on_rays: u64,
    edge_on_rays_limit: f64,
    edge_on_allowed: u64,
    classes: Vec<ClassReport>,
}

#[derive(Serialize)]
struct ClassReport {
    #[serde(flatten)]
    row: ClassRow,
    replay: Option<String>,
}

/// Prints the results, also of a run that was stopped.
pub fn print(args: &VerifyArgs, check: &Check, tally: &Tally, complete: bool) -> Result<()> {
    let classes = tally
        .rows()
        .into_iter()
        .map(|row| ClassReport { replay: row.worst.map(|worst| replay_command(worst.ray)), row });
    let report = Report {
        scene: args.scene.scene.display().to_string(),
        product: check.product.describe(),
        oracle: crate::intersect::Intersector::describe(check.oracle),
        triangles: check.scene.triangle_count(),
        seed: check.settings.seed,
        band_ulps: BAND_ULPS,
        rays: Kind::ALL.map(|kind| (kind, tally.rays(kind))).into(),
        complete,
        passed: complete && tally.passed(),
        unexplained: tally.unexplained(),
        past_vertex_limit: PAST_VERTEX_LIMIT,
        past_vertex_allowed: tally.past_vertex_allowed(),
        open_vertex_limit: OPEN_VERTEX_LIMIT,
        open_vertex_allowed: tally.open_vertex_allowed(),
        edge_on_limit: EDGE_ON_LIMIT,
        edge_on_rays: tally.edge_on(),
        edge_on_rays_limit: NARROW_LIMIT,
        edge_on_allowed: tally.edge_on_allowed(),
        classes: classes.collect(),
    };
    if args.json {
        return say::json(&report);
    }
    say::text(&report.to_text())
}

/// The meaning of a class in a few words.
pub fn meaning(class: Class) -> &'static str {
    match class {
        Class::Tie => "another primitive at the same place",
        Class::EdgeBand => "within the band of an edge",
        Class::PastVertex => "past a vertex, onto a front",
        Class::PastOpenVertex => "past an open mesh's vertex",
        Class::PastEdgeOn => "past a triangle seen edge on",
        Class::RayEnd => "at the ray's own start or end",
        Class::Phantom => "phantom hit",
        Class::Missed => "missed hit",
        Class::WrongDistance => "wrong distance",
        Class::ShadowLeak => "shadow leak",
        Class::FalseShadow => "false shadow",
    }
}

impl Report {
    fn to_text(&self) -> String {
        let mut text = String::new();
        let kinds = self.rays.iter().map(|(kind, rays)| format!("{} {rays}", kind.name()));
        let kinds: Vec<String> = kinds.collect();
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{} against the {}", self.product, self.oracle);
        let _ = writeln!(text, "rays: {}", kinds.join(", "));
        let _ = writeln!(
            text,
            "band: {} ulp (2^-23) of the largest scene-space coordinate involved\n",
            self.band_ulps
        );
        let _ = writeln!(
            text,
            "{:<36} {:>9} {:>12} {:>10} {:>10}  worst ray",
            "difference", "count", "rays", "95 % bound", "worst ulp"
        );
        for explained in [true, false] {
            let _ = writeln!(text, "{}", if explained { "explained" } else { "unexplained" });
            for class in self.classes.iter().filter(|c| c.row.explained == explained) {
                let ClassRow { class, count, rays, bound, worst, .. } = &class.row;
                let ulps = worst.map_or("-".into(), |w| format!("{:.3}", w.ulps));
                let ray = worst.map_or("-".into(), |w| w.ray.to_string());
                let _ = writeln!(
                    text,
                    "  {:<34} {count:>9} {rays:>12} {bound:>10.1e} {ulps:>10}  {ray}",
                    meaning(*class)
                );
            }
        }
        let replays = self.classes.iter().filter_map(|c| c.replay.as_ref());
        let replays: Vec<String> = replays.map(|line| format!("  {line}\n")).collect();
        if !replays.is_empty() {
            let _ = write!(text, "\nto trace the worst rays again:\n{}", replays.concat());
        }
        let _ = match self.unexplained {
            _ if self.passed => writeln!(text, "\npassed: every difference is explained"),
            0 if !self.complete => writeln!(text, "\nnot complete: stopped before the end"),
            0 => writeln!(
                text,
                "\nFAILED: too many rays slipped through; the limits are {} past vertices of closed meshes \
                 ({PAST_VERTEX_LIMIT} of the vertex rays), {} past those of open ones ({OPEN_VERTEX_LIMIT}) and {} past \
                 triangles seen edge on ({EDGE_ON_LIMIT} of the edge rays, {NARROW_LIMIT} of the {} that are aimed at such \
                 triangles, and chance)",
                self.past_vertex_allowed,
                self.open_vertex_allowed,
                self.edge_on_allowed,
                self.edge_on_rays
            ),
            n => writeln!(text, "\nFAILED: {n} unexplained"),
        };
        text
    }
}
