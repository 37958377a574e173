//! Error against time, both axes logarithmic, with the points that no other one beats.

use super::axis::{Axis, Tick};
use super::escaped;
use super::plot::Plot;
use std::fmt::Write;

/// A setting.
#[derive(Debug, Clone)]
pub struct Point {
    /// Its number, which the page's other parts know it by.
    pub id: usize,
    /// Name of the point.
    pub name: String,
    /// Text beside the name.
    pub text: String,
    /// Time.
    pub x: f64,
    /// Ends of the time's interval.
    pub x_ends: [f64; 2],
    /// Error; none at all (0) is shown at the bottom.
    pub y: f64,
    /// Class that gives the colour: `c0`, `c1`, …
    pub class: String,
    /// Whether it is the setting that the others are compared with.
    pub is_default: bool,
    /// Whether no other point is both faster and better.
    pub is_front: bool,
}

/// The plot.
#[derive(Debug, Clone, Default)]
pub struct Scatter {
    /// Caption.
    pub caption: String,
    /// Description of the axes.
    pub hint: String,
    /// Units of time and error, with their blanks.
    pub units: [String; 2],
    /// The points.
    pub points: Vec<Point>,
    /// Class and name of each colour.
    pub legend: Vec<(String, String)>,
    /// Name of the figure for scripts.
    pub metric: String,
}

impl Scatter {
    /// The scatter as a plot.
    pub fn plot(&self) -> Plot {
        let x = Axis::log_about(self.points.iter().flat_map(|p| [p.x, p.x_ends[0], p.x_ends[1]]));
        let y = Axis::log_about(self.points.iter().map(|p| p.y));
        let (mut drawing, mut over) = (String::new(), String::new());
        self.draw_front(&mut drawing, &x, &y);
        for point in &self.points {
            self.draw_point(&mut drawing, &mut over, &x, &y, point);
        }
        let mut y_ticks = y.ticks(&self.units[1]);
        if self.points.iter().all(|p| p.y <= 0.0) {
            y_ticks.clear();
        }
        let mut hint = self.hint.clone();
        if self.points.iter().any(|p| p.y <= 0.0) {
            // No error at all has no place on a logarithmic axis, and must not be read off it.
            y_ticks.retain(|tick| tick.at > 5.0);
            y_ticks.push(Tick { at: 0.0, label: "none".into() });
            hint += "; at the bottom: none at all";
        }
        Plot {
            caption: self.caption.clone(),
            hint,
            kind: "scatter",
            drawing,
            over,
            x: x.ticks(&self.units[0]),
            y: y_ticks,
            legend: self.legend.clone(),
            data: format!("data-metric=\"{}\"", escaped(&self.metric)),
        }
    }

    /// Steps through the front: right along what is reached, then down.
    fn draw_front(&self, out: &mut String, x: &Axis, y: &Axis) {
        let mut front: Vec<&Point> = self.points.iter().filter(|p| p.is_front).collect();
        front.sort_by(|a, b| a.x.total_cmp(&b.x));
        let mut path = String::new();
        for (k, point) in front.iter().enumerate() {
            let (px, py) = (10.0 * x.at(point.x), 1000.0 - 10.0 * y.at(point.y));
            // Writing to a String cannot fail.
            let _ = match k {
                0 => write!(path, "M{px:.1} 0V{py:.1}"),
                _ => write!(path, "H{px:.1}V{py:.1}"),
            };
        }
        if !path.is_empty() {
            let _ = write!(out, "<path class=\"front\" d=\"{path}H1000\"/>");
        }
    }

    fn draw_point(&self, drawing: &mut String, over: &mut String, x: &Axis, y: &Axis, p: &Point) {
        let (left, bottom) = (x.at(p.x), y.at(p.y));
        let height = 1000.0 - 10.0 * bottom;
        let [low, high] = p.x_ends.map(|s| 10.0 * x.at(s));
        let _ = write!(
            drawing,
            "<path class=\"whisker {}\" d=\"M{low:.1} {height:.1}H{high:.1}\"/>",
            p.class
        );
        if p.is_default {
            // Lines of equal time and of equal error.
            let _ = write!(
                drawing,
                "<path class=\"equal\" d=\"M{:.1} 0V1000M0 {height:.1}H1000\"/>",
                10.0 * left
            );
        }
        let mut class = p.class.clone();
        class += if p.is_front { " on-front" } else { "" };
        class += if p.is_default { " default" } else { "" };
        let _ = write!(
            over,
            "<button type=\"button\" class=\"point {class}\" data-id=\"{}\" \
             style=\"left:{left}%;bottom:{bottom}%\" aria-label=\"{}: {}\"></button>",
            p.id,
            escaped(&p.name),
            escaped(&p.text)
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_goes_down_in_steps_and_names_are_escaped() {
        let point = |id, x: f64, y, is_front| Point {
            id,
            name: format!("\"{id}\" <b>"),
            text: String::new(),
            x,
            x_ends: [x * 0.9, x * 1.1],
            y,
            class: "c0".into(),
            is_default: id == 0,
            is_front,
        };
        let points =
            vec![point(0, 1.0, 1.0, true), point(1, 2.0, 2.0, false), point(2, 4.0, 0.0, true)];
        let plot = Scatter { points, ..Scatter::default() }.plot();
        assert_eq!(plot.drawing.matches("class=\"front\"").count(), 1);
        assert_eq!(plot.drawing.matches("class=\"equal\"").count(), 1);
        assert_eq!(plot.over.matches("<button").count(), 3);
        assert!(plot.over.contains("&quot;2&quot; &lt;b&gt;"), "{}", plot.over);
        // No error at all stands at the bottom.
        assert!(plot.over.contains("bottom:0%"), "{}", plot.over);
        let at_the_bottom = |plot: &Plot| -> Vec<String> {
            plot.y.iter().filter(|t| t.at < 5.0).map(|t| t.label.clone()).collect()
        };
        assert_eq!(at_the_bottom(&plot), ["none"]);
        assert!(plot.hint.ends_with("at the bottom: none at all"), "{}", plot.hint);
        let none = Scatter { points: vec![point(0, 1.0, 0.0, true)], ..Scatter::default() }.plot();
        assert_eq!(none.y.iter().map(|t| &*t.label).collect::<Vec<_>>(), ["none"]);
        let some = Scatter { points: vec![point(0, 1.0, 1.0, true)], ..Scatter::default() }.plot();
        assert!(at_the_bottom(&some).is_empty() && some.hint.is_empty());
    }
}
