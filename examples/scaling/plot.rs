//! Efficiency against ranks, as an SVG.

use crate::predict::{Curve, MOST};
use std::fmt::Write;

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 360.0;
const LEFT: f64 = 60.0;
const RIGHT: f64 = 20.0;
const TOP: f64 = 20.0;
const BOTTOM: f64 = 50.0;
const COLOURS: [&str; 3] = ["#1a6faf", "#c0392b", "#7f8c8d"];

fn x(ranks: u32) -> f64 {
    LEFT + f64::from(ranks).log2() / f64::from(MOST).log2() * (WIDTH - LEFT - RIGHT)
}

fn y(efficiency: f64) -> f64 {
    TOP + (1.0 - efficiency / 1.05) * (HEIGHT - TOP - BOTTOM)
}

/// The picture.
pub fn svg(curves: &[&Curve]) -> String {
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" \
         font-family=\"sans-serif\" font-size=\"13\">\n\
         <rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"white\"/>\n"
    );
    grid(&mut out);
    for (curve, colour) in curves.iter().zip(COLOURS) {
        line(&mut out, curve, colour);
    }
    legend(&mut out, curves);
    out.push_str("</svg>\n");
    out
}

fn grid(out: &mut String) {
    let (left, right) = (x(1), x(MOST));
    for tenth in [0, 2, 4, 6, 8, 9, 10] {
        let at = y(f64::from(tenth) / 10.0);
        let colour = if tenth == 9 { "#2a2" } else { "#ddd" };
        let label = f64::from(tenth) / 10.0;
        _ = writeln!(
            out,
            "<path d=\"M{left:.1} {at:.1}H{right:.1}\" stroke=\"{colour}\"/>\n\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{label:.1}</text>",
            left - 8.0,
            at + 4.0
        );
    }
    for power in (0..=12).step_by(2) {
        let ranks = 1 << power;
        _ = writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{ranks}</text>",
            x(ranks),
            HEIGHT - BOTTOM + 20.0
        );
    }
    _ = writeln!(
        out,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">ranks</text>\n\
         <text transform=\"translate(16 {:.1}) rotate(-90)\" text-anchor=\"middle\">efficiency</text>",
        f64::midpoint(left, right),
        HEIGHT - 10.0,
        f64::midpoint(y(0.0), y(1.0))
    );
}

fn line(out: &mut String, curve: &Curve, colour: &str) {
    let places: Vec<String> = curve
        .points
        .iter()
        .map(|(ranks, efficiency, _)| format!("{:.1},{:.1}", x(*ranks), y(*efficiency)))
        .collect();
    let places = places.join("L");
    _ = writeln!(
        out,
        "<path d=\"M{places}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>"
    );
    for (ranks, efficiency, _) in &curve.points {
        let (x, y) = (x(*ranks), y(*efficiency));
        _ = writeln!(out, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.5\" fill=\"{colour}\"/>");
    }
}

fn legend(out: &mut String, curves: &[&Curve]) {
    for (i, (curve, colour)) in curves.iter().zip(COLOURS).enumerate() {
        let at = y(0.36) + 20.0 * i as f64;
        _ = writeln!(
            out,
            "<path d=\"M{:.1} {at:.1}h24\" stroke=\"{colour}\" stroke-width=\"2\"/>\n\
             <text x=\"{:.1}\" y=\"{:.1}\">{}</text>",
            LEFT + 20.0,
            LEFT + 52.0,
            at + 4.0,
            curve.name
        );
    }
}
