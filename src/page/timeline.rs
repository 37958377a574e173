//! When each rank rendered which frame.

use super::axis::Axis;
use super::plot::Plot;
use super::words;
use std::fmt::Write;

/// A frame's time on a rank.
#[derive(Debug, Clone, Copy)]
pub struct Span {
    /// Which rank.
    pub rank: u32,
    /// Which frame.
    pub frame: u32,
    /// First and last second, since the job's start.
    pub seconds: [f64; 2],
    /// Whether it was traced whole.
    pub is_traced: bool,
}

/// A row a rank, time to the right.
#[derive(Debug, Clone, Default)]
pub struct Timeline {
    /// Caption.
    pub caption: String,
    /// Frames, in any order.
    pub spans: Vec<Span>,
}

impl Timeline {
    /// The timeline as a plot.
    pub fn plot(&self) -> Plot {
        let end = self.spans.iter().map(|s| s.seconds[1]).fold(0.0, f64::max);
        let ranks = self.spans.iter().map(|s| s.rank + 1).max().unwrap_or(1);
        let x = Axis::exactly(0.0, end);
        let y = Axis::exactly(0.0, f64::from(ranks));
        let mut drawing = String::new();
        for span in &self.spans {
            let top = f64::from(ranks - span.rank);
            let [left, right] = span.seconds.map(|s| 10.0 * x.at(s));
            // Writing to a String cannot fail.
            let _ = write!(
                drawing,
                "<rect class=\"span c{}\" x=\"{left:.2}\" y=\"{:.1}\" width=\"{:.2}\" height=\"{:.1}\">\
                 <title>frame {}: {}</title></rect>",
                u32::from(!span.is_traced),
                1000.0 - 10.0 * y.at(top - 0.1),
                (right - left).max(0.5),
                10.0 * (y.at(top - 0.1) - y.at(top - 0.9)),
                span.frame,
                words::seconds(span.seconds[1] - span.seconds[0]),
            );
        }
        let step = ranks.div_ceil(12);
        let rank = |r: u32| super::axis::Tick {
            at: y.at(f64::from(ranks - r) - 0.5),
            label: format!("rank {r}"),
        };
        Plot {
            caption: self.caption.clone(),
            hint: "time since the first frame was begun".into(),
            kind: "timeline",
            drawing,
            x: x.ticks(" s"),
            y: (0..ranks).step_by(step as usize).map(rank).collect(),
            legend: vec![("c0".into(), "traced whole".into()), ("c1".into(), "inferred".into())],
            ..Plot::default()
        }
    }
}
