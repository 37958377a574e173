//! Charts over the frames of a shot: stacked bars, lines, bands.

use super::axis::Axis;
use super::plot::Plot;
use std::fmt::Write;

/// Figures of one thing, one a frame.
#[derive(Debug, Clone, Default)]
pub struct Series {
    /// Name of the series.
    pub name: String,
    /// Figures; `None` where there is none.
    pub values: Vec<Option<f64>>,
}

/// A chart: frames to the right, figures upwards from 0.
#[derive(Debug, Clone, Default)]
pub struct Chart {
    /// Caption.
    pub caption: String,
    /// Unit after the figures, with its blank: ` s`.
    pub unit: String,
    /// The frames' numbers, ascending.
    pub frames: Vec<u32>,
    /// Drawn on top of one another.
    pub bars: Vec<Series>,
    /// Drawn as lines over the bars, in the colours after theirs.
    pub lines: Vec<Series>,
    /// Lower and upper end, drawn behind the lines.
    pub band: Vec<Option<[f64; 2]>>,
    /// Where the axis ends, if not at the largest figure.
    pub most: Option<f64>,
}

impl Chart {
    /// The chart as a plot.
    pub fn plot(&self) -> Plot {
        let (first, last) = (self.frames.first(), self.frames.last());
        let (first, last) =
            (first.map_or(1.0, |f| f64::from(*f)), last.map_or(1.0, |f| f64::from(*f)));
        // Half a frame to either side, for the bars.
        let x = Axis::exactly(first - 0.5, last + 0.5);
        let y = Axis::from_zero(self.most.unwrap_or_else(|| self.largest()));
        let mut drawing = String::new();
        self.draw_bars(&mut drawing, &x, &y);
        self.draw_band(&mut drawing, &x, &y);
        for (k, line) in self.lines.iter().enumerate() {
            self.draw_line(&mut drawing, &x, &y, self.bars.len() + k, line);
        }
        let names = self.bars.iter().chain(&self.lines).enumerate();
        let frames: Vec<String> = self.frames.iter().map(u32::to_string).collect();
        Plot {
            caption: self.caption.clone(),
            hint: "frames to the right".into(),
            kind: "chart",
            drawing,
            over: "<i class=\"cursor\"></i>".into(),
            x: x.whole_ticks(),
            y: y.ticks(&self.unit),
            legend: names.map(|(k, s)| (format!("c{k}"), s.name.clone())).collect(),
            data: format!(
                "data-low=\"{}\" data-high=\"{}\" data-frames=\"{}\"",
                first - 0.5,
                last + 0.5,
                frames.join(" ")
            ),
        }
    }

    fn largest(&self) -> f64 {
        let stack = |k: usize| self.bars.iter().filter_map(|s| s.values[k]).sum::<f64>();
        let stacks = (0..self.frames.len()).map(stack);
        let lines = self.lines.iter().flat_map(|s| s.values.iter().flatten().copied());
        let band = self.band.iter().flatten().map(|[_, high]| *high);
        stacks.chain(lines).chain(band).fold(0.0, f64::max)
    }

    // Writing to a String cannot fail.

    fn draw_bars(&self, out: &mut String, x: &Axis, y: &Axis) {
        for (i, frame) in self.frames.iter().enumerate() {
            let middle = f64::from(*frame);
            let (left, right) = (10.0 * x.at(middle - 0.42), 10.0 * x.at(middle + 0.42));
            let mut below = 0.0;
            for (k, bar) in self.bars.iter().enumerate() {
                let Some(value) = bar.values[i].filter(|v| *v > 0.0) else { continue };
                let (low, high) = (10.0 * y.at(below), 10.0 * y.at(below + value));
                below += value;
                let _ = write!(
                    out,
                    "<rect class=\"c{k}\" x=\"{left:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\"/>",
                    1000.0 - high,
                    right - left,
                    high - low
                );
            }
        }
    }

    fn draw_band(&self, out: &mut String, x: &Axis, y: &Axis) {
        for (frame, band) in self.frames.iter().zip(&self.band) {
            let Some([low, high]) = band else { continue };
            let (left, right) = (x.at(f64::from(*frame) - 0.42), x.at(f64::from(*frame) + 0.42));
            let (low, high) = (y.at(*low), y.at(*high));
            let _ = write!(
                out,
                "<rect class=\"band\" x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\"/>",
                10.0 * left,
                1000.0 - 10.0 * high,
                10.0 * (right - left),
                10.0 * (high - low)
            );
        }
    }

    fn draw_line(&self, out: &mut String, x: &Axis, y: &Axis, colour: usize, line: &Series) {
        let figures = self.frames.iter().zip(&line.values);
        let figures: Vec<(u32, f64)> = figures.filter_map(|(f, v)| Some((*f, (*v)?))).collect();
        let (mut lines, mut dots) = (String::new(), String::new());
        // No line over frames that are not there or have no figure.
        for run in figures.chunk_by(|a, b| a.0 + 1 == b.0) {
            let path = if run.len() == 1 { &mut dots } else { &mut lines };
            for (k, (frame, value)) in run.iter().enumerate() {
                let (px, py) = (10.0 * x.at(f64::from(*frame)), 1000.0 - 10.0 * y.at(*value));
                // A dot is a line of no length with round ends.
                let verb = if k == 0 { "M" } else { "L" };
                let _ = write!(path, "{verb}{px:.1} {py:.1}h0");
            }
        }
        for (class, path) in [("line", lines), ("line dot", dots)] {
            let _ = write!(out, "<path class=\"{class} c{colour}\" d=\"{path}\"/>");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_stack_and_lines_break_where_nothing_is() {
        let series =
            |values: &[Option<f64>]| Series { name: "a < b".into(), values: values.to_vec() };
        let chart = Chart {
            frames: vec![1, 2, 4],
            bars: vec![
                series(&[Some(1.0), Some(2.0), None]),
                series(&[Some(1.0), None, Some(0.5)]),
            ],
            lines: vec![series(&[Some(1.0), None, Some(2.0)])],
            ..Chart::default()
        };
        let plot = chart.plot();
        assert_eq!(plot.drawing.matches("<rect").count(), 4);
        assert_eq!(plot.drawing.matches('M').count(), 2);
        // Frame 3 is not there.
        let lines = vec![series(&[Some(1.0), Some(1.5), Some(2.0)])];
        let gap = Chart { lines, ..chart.clone() }.plot();
        assert_eq!((gap.drawing.matches('M').count(), gap.drawing.matches('L').count()), (2, 1));
        assert_eq!(
            gap.drawing.split("line dot").nth(1).map(|dots| dots.matches('M').count()),
            Some(1)
        );
        // The stack of frame 1 ends at the top, its lower half in the middle.
        assert!(plot.drawing.contains("y=\"500.0\"") && plot.drawing.contains("y=\"0.0\""));
        let html = askama::Template::render(&plot).expect("set");
        assert!(html.contains("a &#60; b") && !html.contains("a < b"), "{html}");
    }
}
