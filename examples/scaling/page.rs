//! The page and its picture.

use crate::costs::{BANDWIDTH, Costs, LATENCY};
use crate::fit::{Fit, Row, Said};
use crate::plot;
use crate::predict::{Curve, FRAMES, WORDS};
use crate::simulation::SimulatedRun;
use std::fmt::Write;
use std::fs;

const DOCS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs");
const TEXT: &str = include_str!("page.md");

/// What stands on it.
pub struct Page<'a> {
    pub machine: &'a str,
    pub fit: &'a Fit,
    pub costs: &'a Costs,
    pub ours: &'a Curve,
    pub all: &'a Curve,
    pub others: &'a [(&'a str, Curve)],
    pub small: &'a Curve,
    pub paper: &'a str,
}

impl Page<'_> {
    /// Writes `docs/scaling.md` and `docs/pictures/scaling.svg`.
    pub fn write(&self) {
        let svg = plot::svg(&[self.ours, self.all]);
        fs::write(format!("{DOCS}/pictures/scaling.svg"), svg).unwrap();
        let mut text = TEXT.to_string();
        for (name, value) in self.figures() {
            let place = format!("{{{name}}}");
            assert!(text.contains(&place), "page.md does not mention {place}");
            text = text.replace(&place, &value);
        }
        fs::write(format!("{DOCS}/scaling.md"), text).unwrap();
        println!("{DOCS}/scaling.md");
    }

    fn figures(&self) -> Vec<(&'static str, String)> {
        let costs = self.costs;
        let mean = |is_key: bool| {
            let frames =
                (1..).zip(&costs.frames).filter(|(f, _)| costs.pyramid.is_key(*f) == is_key);
            let seconds: Vec<f64> = frames.map(|(_, seconds)| *seconds).collect();
            seconds.iter().sum::<f64>() / seconds.len() as f64
        };
        vec![
            ("machine", self.machine.into()),
            ("frames", format!("{FRAMES}")),
            ("words", WORDS.into()),
            ("key", format!("{:.2} s", mean(true))),
            ("between", format!("{:.2} s", mean(false))),
            ("spread", spread_of(costs)),
            ("reference", megabytes(costs.reference_bytes)),
            ("discoveries", megabytes(costs.discovery_bytes)),
            ("share", format!("{:.1} %", 100.0 * self.costs.between_share)),
            ("pack", format!("{:.0} ms", 1e3 * costs.pack_seconds)),
            ("comm", format!("{:.1} %", 100.0 * costs.comm_share)),
            ("latency", format!("{:.0} µs", 1e6 * LATENCY)),
            ("bandwidth", format!("{:.0} MB/s", 1e-6 * BANDWIDTH)),
            ("table", self.table()),
            ("changes", self.changes()),
            ("small", self.small()),
            ("fit", self.fit_table()),
            ("cores", format!("{:.2}", self.fit.cores)),
            ("each", format!("{:.0} ms", 1e3 * self.fit.rank_seconds)),
            ("fit-pack", format!("{:.1} ms", 1e3 * self.fit.costs.pack_seconds)),
            ("errors", self.errors()),
            ("paper", self.paper.into()),
        ]
    }

    fn table(&self) -> String {
        let mut out = String::from(
            "| ranks | time | efficiency | rank 0's communication thread busy | longest scheduler pass | references sent, a \
             rank | control messages a frame | every discovery to every rank |\n\
             |--:|--:|--:|--:|--:|--:|--:|--:|\n",
        );
        for (ranks, efficiency, run) in &self.ours.points {
            let all = self.all.points.iter().find(|(n, ..)| n == ranks);
            let all = all.map_or(String::new(), |(_, efficiency, _)| format!("{efficiency:.3}"));
            let each = f64::from(*ranks);
            _ = writeln!(
                out,
                "| {ranks} | {} | {efficiency:.3} | {:.1} % | {:.0} ms | {:.1} | {:.2} | {all} |",
                time(run.seconds),
                100.0 * run.comm_seconds / run.seconds,
                1e3 * run.longest_pass,
                run.sent.references.messages as f64 / each,
                run.sent.notes.messages as f64 / f64::from(FRAMES),
            );
        }
        out
    }

    fn changes(&self) -> String {
        let mut out = String::from(
            "| 4,096 ranks, with | efficiency | rank 0's communication thread busy |\n|---|--:|--:|\n",
        );
        for (name, curve) in self.others {
            let (_, efficiency, run) = &curve.points[0];
            let busy = 100.0 * run.comm_seconds / run.seconds;
            _ = writeln!(out, "| {name} | {efficiency:.3} | {busy:.1} % |");
        }
        out
    }

    fn small(&self) -> String {
        let point = |(ranks, efficiency, run): &(u32, f64, SimulatedRun)| {
            let busy = 100.0 * run.comm_seconds / run.seconds;
            format!("| {ranks} | {efficiency:.3} | {busy:.1} % |\n")
        };
        let rows: String = self.small.points.iter().map(point).collect();
        format!(
            "| ranks | efficiency | rank 0's communication thread busy |\n|--:|--:|--:|\n{rows}"
        )
    }

    fn fit_table(&self) -> String {
        let mut out = String::from(
            "| ranks | seconds of a core | model | wall seconds | model | references | model | \
             control messages | \
             model |\n|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n",
        );
        for (row, said) in self.fit.rows.iter().zip(&self.fit.said) {
            let Row { ranks, cpu, wall, references, notes } = row;
            _ = writeln!(
                out,
                "| {ranks} | {} | {:.2} | {} | {:.2} | {} | {} | {} | {} |",
                between(cpu, 2),
                said.cpu,
                between(wall, 2),
                said.wall,
                between(references, 0),
                said.references,
                between(notes, 0),
                said.notes
            );
        }
        out
    }

    fn errors(&self) -> String {
        let rows: Vec<(&Row, &Said)> = self.fit.rows.iter().zip(&self.fit.said).collect();
        let Some(((row, said), fitted)) = rows.split_last() else { return String::new() };
        let off = |said: f64, is: f64| format!("{:+.1} %", 100.0 * (said / is - 1.0));
        let walls = fitted.iter().map(|(row, said)| off(said.wall, row.wall[1]));
        let text = format!(
            "seconds of a core {}, wall time {}, references {}, control messages {}. Wall times of 1 to 4, which were \
             fitted: {}",
            off(said.cpu, row.cpu[1]),
            off(said.wall, row.wall[1]),
            off(said.references, row.references[1]),
            off(said.notes, row.notes[1]),
            walls.collect::<Vec<_>>().join(", ")
        );
        println!("off for 8 ranks, fitted on 1 to 4: {text}");
        text
    }
}

/// Median, with least and most.
fn between(values: &[f64; 3], digits: usize) -> String {
    let [least, median, most] = values;
    format!("{median:.digits$} ({least:.digits$} to {most:.digits$})")
}

fn spread_of(costs: &Costs) -> String {
    let frames = (1..).zip(&costs.frames).filter(|(f, _)| !costs.pyramid.is_key(*f));
    let seconds: Vec<f64> = frames.map(|(_, seconds)| *seconds).collect();
    let least = seconds.iter().copied().fold(f64::INFINITY, f64::min);
    let most = seconds.iter().copied().fold(0.0, f64::max);
    format!("{least:.2} to {most:.2} s")
}

fn megabytes(bytes: u64) -> String {
    format!("{:.2} MB", 1e-6 * bytes as f64)
}

fn time(seconds: f64) -> String {
    match seconds {
        s if s > 36_000.0 => format!("{:.1} h", s / 3600.0),
        s if s > 600.0 => format!("{:.1} min", s / 60.0),
        s => format!("{s:.1} s"),
    }
}
