//! Error against CPU time, as an SVG that reads on white and on black.

use crate::sweep::{ROOT, Row, Sweep};
use std::fmt::Write;
use tweenray::page::Axis;
use tweenray::page::words::short;

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 400.0;
const LEFT: f64 = 64.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 16.0;
const BOTTOM: f64 = 84.0;

/// An axis from pixel to pixel.
struct Scale {
    axis: Axis,
    from: f64,
    to: f64,
}

impl Scale {
    /// Where a share of the axis, per cent, stands.
    fn place(&self, percent: f64) -> f64 {
        self.from + 0.01 * percent * (self.to - self.from)
    }

    fn at(&self, value: f64) -> f64 {
        self.place(self.axis.at(value))
    }

    fn ticks(&self, unit: &str) -> impl Iterator<Item = (f64, String)> {
        self.axis.ticks(unit).into_iter().map(|tick| (self.place(tick.at), tick.label))
    }
}

/// Colour and name of what a knob belongs to.
fn kind(row: &Row) -> (&'static str, &'static str) {
    match row.knob.as_str() {
        "default" => ("#3b6fc9", "default"),
        "policy" | "tolerance" | "segment" | "probes" => ("#d9801a", "reuse"),
        "camera-samples" | "shadow-samples" | "sky-samples" => ("#2f9a78", "samples"),
        "bounces" | "cut-off" => ("#c2528a", "bounces, cut-off"),
        "combination" => ("#94853f", "samples and reuse"),
        _ => ("#8468cc", "rules, tree"),
    }
}

/// Writes `docs/pictures/accuracy-NAME.svg`.
pub fn write(sweep: &Sweep) {
    let seconds = sweep.rows.iter().flat_map(|r| [r.cpu_seconds.low, r.cpu_seconds.high]);
    let x = Scale { axis: Axis::log_about(seconds), from: LEFT, to: WIDTH - RIGHT };
    let errors = sweep.rows.iter().map(|r| r.rmse);
    let y = Scale { axis: Axis::log_about(errors), from: HEIGHT - BOTTOM, to: TOP };
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" \
         font-family=\"sans-serif\" font-size=\"13\">\n\
         <rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"#fff\"/>\n"
    );
    grid(&mut out, &x, &y);
    front(&mut out, sweep, &x, &y);
    sweep.rows.iter().for_each(|row| point(&mut out, row, &x, &y));
    numbers(&mut out, sweep, &x, &y);
    legend(&mut out, sweep);
    out.push_str("</svg>\n");
    std::fs::write(format!("{ROOT}/docs/pictures/accuracy-{}.svg", sweep.name), out).unwrap();
}

fn grid(out: &mut String, x: &Scale, y: &Scale) {
    for (at, label) in x.ticks(" s") {
        _ = writeln!(
            out,
            "<path d=\"M{at:.1} {TOP}V{:.1}\" stroke=\"#ddd\"/>\
             <text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{label}</text>",
            HEIGHT - BOTTOM,
            HEIGHT - BOTTOM + 18.0
        );
    }
    for (at, label) in y.ticks("") {
        _ = writeln!(
            out,
            "<path d=\"M{LEFT} {at:.1}H{:.1}\" stroke=\"#ddd\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>",
            WIDTH - RIGHT,
            LEFT - 8.0,
            at + 4.0
        );
    }
    _ = writeln!(
        out,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">CPU seconds a frame</text>\n\
         <text transform=\"translate(15 {:.1}) rotate(-90)\" text-anchor=\"middle\">\
         RMSE, steps of 1/255</text>",
        f64::midpoint(LEFT, WIDTH - RIGHT),
        HEIGHT - BOTTOM + 36.0,
        f64::midpoint(TOP, HEIGHT - BOTTOM)
    );
}

/// Steps through what nothing beats.
fn front(out: &mut String, sweep: &Sweep, x: &Scale, y: &Scale) {
    let mut path = String::new();
    for (k, row) in sweep.front().into_iter().enumerate() {
        let (px, py) = (x.at(row.cpu_seconds.estimate), y.at(row.rmse));
        _ = match k {
            0 => write!(path, "M{px:.1} {TOP}V{py:.1}"),
            _ => write!(path, "H{px:.1}V{py:.1}"),
        };
    }
    _ = writeln!(
        out,
        "<path d=\"{path}H{:.1}\" fill=\"none\" stroke=\"#777\" stroke-dasharray=\"5 4\"/>",
        WIDTH - RIGHT
    );
}

fn point(out: &mut String, row: &Row, x: &Scale, y: &Scale) {
    let (px, py) = (x.at(row.cpu_seconds.estimate), y.at(row.rmse));
    let [low, high] = [row.cpu_seconds.low, row.cpu_seconds.high].map(|s| x.at(s));
    let (colour, _) = kind(row);
    let size = if row.on_front || row.options.is_empty() { 5.5 } else { 4.0 };
    _ = writeln!(
        out,
        "<path d=\"M{low:.1} {py:.1}H{high:.1}\" stroke=\"{colour}\"/>\
         <circle cx=\"{px:.1}\" cy=\"{py:.1}\" r=\"{size}\" fill=\"{colour}\" stroke=\"#fff\">\
         <title>{}: {} s, {}/255</title></circle>",
        row.name(),
        short(row.cpu_seconds.estimate),
        short(row.rmse)
    );
}

/// Numbers of the front's points, as in the table below the picture.
fn numbers(out: &mut String, sweep: &Sweep, x: &Scale, y: &Scale) {
    for (number, row) in (1..).zip(sweep.front()) {
        _ = writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\" font-weight=\"bold\" font-size=\"12\">\
             {number}</text>",
            x.at(row.cpu_seconds.estimate) - 7.0,
            y.at(row.rmse) + 13.0
        );
    }
}

fn legend(out: &mut String, sweep: &Sweep) {
    let mut kinds: Vec<(&str, &str)> = Vec::new();
    for kind in sweep.rows.iter().map(kind) {
        if !kinds.contains(&kind) {
            kinds.push(kind);
        }
    }
    let mut left = LEFT;
    for (colour, name) in kinds {
        _ = writeln!(
            out,
            "<circle cx=\"{left:.1}\" cy=\"{:.1}\" r=\"5\" fill=\"{colour}\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" font-size=\"12\">{name}</text>",
            HEIGHT - 18.0,
            left + 9.0,
            HEIGHT - 14.0
        );
        left += 24.0 + 6.1 * name.len() as f64;
    }
}
