//! The page.

use crate::effect::Effect;
use std::fmt::Write;
use std::path::Path;
use tweenray::measure::Median;
use tweenray::stats::{RayCounts, RayKind};

const TEXT: &str = include_str!("page.md");

/// An effect and what it costs.
pub struct Entry {
    pub effect: Effect,
    pub cost: Cost,
}

/// What the frame with the effect takes beside the one without.
pub struct Cost {
    /// CPU time with over without.
    pub ratio: Median,
    /// With and without.
    pub rays: [RayCounts; 2],
    pub pixels: u64,
}

/// Writes `gallery.md`.
pub fn write(docs: &Path, entries: &[Entry]) {
    let rows: String = entries.iter().map(row).collect();
    let parts: Vec<String> = entries.iter().map(part).collect();
    let text = [
        ("{samples}", crate::TIMED_SAMPLES.to_string()),
        ("{pairs}", crate::PAIRS.to_string()),
        ("{picture-samples}", crate::PICTURE_SAMPLES.to_string()),
        ("{table}", rows),
        ("{effects}", parts.join("\n")),
    ];
    let text =
        text.iter().fold(TEXT.to_string(), |page, (place, value)| page.replace(place, value));
    std::fs::write(docs.join("gallery.md"), text).unwrap();
}

/// A row of the table of all effects.
fn row(Entry { effect, cost }: &Entry) -> String {
    let anchor = effect.title.to_lowercase().replace(' ', "-").replace(',', "");
    let [with, without] = cost.rays.map(|rays| rays.total() as f64 / cost.pixels as f64);
    let [ratio, least, most] = cost.ends();
    format!(
        "| [{}](#{anchor}) | {ratio} ({least} to {most}) | {with:.0} | {without:.0} |\n",
        effect.title
    )
}

/// What the page says of an effect.
fn part(Entry { effect, cost }: &Entry) -> String {
    let Effect { title, about, lines, .. } = effect;
    let picture = effect.picture();
    let mut kinds = String::new();
    for kind in RayKind::traced().filter(|kind| cost.rays.iter().any(|rays| rays[*kind] > 0)) {
        let [with, without] = cost.rays.map(|rays| number(rays[kind] as f64 / cost.pixels as f64));
        _ = writeln!(kinds, "| {} | {with} | {without} |", kind.name());
    }
    let [ratio, least, most] = cost.ends();
    format!(
        "## {title}\n\n![with the effect on the left, without it on the right](pictures/{picture})\n\n{about}\n\n\
         ```toml\n{lines}\n```\n\nCPU time: **{ratio} times** that of the frame on the right ({least} to {most}).\n\n\
         | rays a pixel | with | without |\n|---|--:|--:|\n{kinds}"
    )
}

impl Cost {
    /// The ratio with the ends of its interval.
    fn ends(&self) -> [String; 3] {
        let interval = self.ratio.interval;
        [interval.estimate, interval.low, interval.high].map(|x| format!("{x:.2}"))
    }
}

/// Few digits, but none of 0 that is not 0.
fn number(x: f64) -> String {
    match x {
        0.0 => "0".into(),
        x if x < 0.095 => format!("{x:.2}"),
        x if x < 99.5 => format!("{x:.1}"),
        x => format!("{x:.0}"),
    }
}
