//! A drawing with HTML labels over it: what every plot comes down to.

use super::axis::Tick;
use askama::Template;

/// A plot, ready to be set.
#[derive(Debug, Clone, Default, Template)]
#[template(path = "plot.html")]
pub struct Plot {
    pub(super) caption: String,
    /// Description of the axes.
    pub(super) hint: String,
    /// Class of the figure, by which scripts and styles know it.
    pub(super) kind: &'static str,
    /// The drawing: SVG elements in a square of 1000 x 1000, origin at the upper left, which is
    /// stretched to the plot's size.
    pub(super) drawing: String,
    /// HTML placed over the drawing in per cent: points.
    pub(super) over: String,
    pub(super) x: Vec<Tick>,
    pub(super) y: Vec<Tick>,
    /// Class and name of each thing drawn.
    pub(super) legend: Vec<(String, String)>,
    /// Attributes of the figure for scripts, as HTML.
    pub(super) data: String,
}
