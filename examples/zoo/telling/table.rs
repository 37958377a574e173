//! The table by family.

use super::record::{Frame, Told};
use std::collections::BTreeSet;
use std::fmt::Write;

/// A row for each family, in the order of their first scenes, and one for all.
pub fn table(told: &[Told]) -> String {
    let mut text = String::from(
        "family          scenes frames  strict  kept   worst dB  median  worst tile   flicker inferred  speed     CPU seconds\n",
    );
    let mut seen = BTreeSet::new();
    for family in told.iter().map(|t| &t.label.family).filter(|family| seen.insert(*family)) {
        let of: Vec<&Told> = told.iter().filter(|t| t.label.family == *family).collect();
        row(&mut text, family, &of);
    }
    row(&mut text, "all", &told.iter().collect::<Vec<_>>());
    text
}

fn row(text: &mut String, name: &str, told: &[&Told]) {
    let frames: Vec<&Frame> = told.iter().flat_map(|t| &t.frames).collect();
    let kept = |keeps: fn(&Frame) -> bool| frames.iter().filter(|f| keeps(f)).count();
    let db: Vec<f64> = frames.iter().map(|f| f.db).collect();
    let tile = told.iter().max_by(|a, b| a.tile_excess().total_cmp(&b.tile_excess()));
    let tile = tile
        .and_then(|t| t.worst_tile.as_ref())
        .map_or(String::new(), |t| format!("{:.1}/{:.1}", t.rmse_inferred, t.rmse_traced));
    let flicker: Vec<f64> = told.iter().filter_map(|t| t.flicker_ratio).collect();
    let shares: Vec<f64> = told.iter().filter_map(|t| t.inferred[0]).collect();
    let speeds: Vec<f64> = told.iter().map(|t| t.speed).collect();
    let seconds = |job: usize| told.iter().map(|t| t.cpu_seconds[job]).sum::<f64>();
    let worst = db.iter().copied().fold(f64::INFINITY, f64::min);
    let share = match shares.is_empty() {
        true => "-".to_string(),
        false => format!("{:.0}", 100.0 * median(&shares)),
    };
    let _ = writeln!(
        text,
        "{name:15} {:6} {:6}  {:6}  {:4}  {worst:+9.2}  {:+6.2}  {tile:>10}  {:4.2} {:4.2}  {share:>5}  {:6.2} {:7.1}/{:.1}",
        told.len(),
        frames.len(),
        kept(|f| f.keeps_strictly),
        kept(|f| f.keeps),
        median(&db),
        median(&flicker),
        flicker.iter().copied().fold(0.0, f64::max),
        median(&speeds),
        seconds(0),
        seconds(1),
    );
}

/// The middle one, of an even number the upper of the two; NaN of none.
pub fn median(numbers: &[f64]) -> f64 {
    let mut sorted = numbers.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}
