//! How a figure goes with the squared error.

use serde::{Deserialize, Serialize};

/// Where a figure rises by a smaller power of the squared error, a small doubt of it is any error.
const LEAST: f64 = 0.1;

/// A figure as a power of the squared error in display steps: both of its logarithms' line.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PowerLaw {
    /// Logarithm of the figure where the squared error is 1.
    pub at_one: f64,
    /// Its rise with the logarithm of the squared error.
    pub rise: f64,
}

impl PowerLaw {
    /// The line nearest to pairs of squared error and figure; `None` where they do not rise together, or so
    /// little that the figure tells nothing of the error.
    pub fn through(pairs: &[(f64, f64)]) -> Option<Self> {
        let logs =
            || pairs.iter().filter(|(x, y)| *x > 0.0 && *y > 0.0).map(|(x, y)| (x.ln(), y.ln()));
        let n = logs().count() as f64;
        let (x, y) = logs().fold((0.0, 0.0), |(x, y), (a, b)| (x + a / n, y + b / n));
        let (xx, xy) = logs()
            .fold((0.0, 0.0), |(xx, xy), (a, b)| (xx + (a - x) * (a - x), xy + (a - x) * (b - y)));
        let rise = xy / xx;
        (n >= 2.0 && rise > LEAST).then_some(Self { at_one: y - rise * x, rise })
    }

    /// The line with the same rise through `(squared_error, figure)`.
    pub fn shifted_to(self, (squared_error, figure): (f64, f64)) -> Self {
        if squared_error <= 0.0 || figure <= 0.0 {
            return self;
        }
        Self { at_one: figure.ln() - self.rise * squared_error.ln(), ..self }
    }

    /// The figure where the squared error is `squared_error`.
    pub fn figure(&self, squared_error: f64) -> f64 {
        (self.at_one + self.rise * squared_error.ln()).exp()
    }

    /// The squared error at which the figure is `figure`.
    pub fn squared_error(&self, figure: f64) -> f64 {
        ((figure.ln() - self.at_one) / self.rise).exp()
    }
}
