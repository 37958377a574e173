//! Axes: where ticks stand, and where a value lies between 0 and 1.

/// A label at a share of the axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Tick {
    /// Where, per cent of the axis.
    pub at: f64,
    /// Text of the tick.
    pub label: String,
}

/// An axis from `low` to `high`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    low: f64,
    high: f64,
    log: bool,
}

impl Axis {
    /// From 0 to a round number at or above `most`.
    pub fn from_zero(most: f64) -> Self {
        let most = if most.is_finite() && most > 0.0 { most } else { 1.0 };
        let step = round_step(most / 4.0);
        Self { low: 0.0, high: (most / step).ceil() * step, log: false }
    }

    /// Linear, exactly from `low` to `high`.
    pub fn exactly(low: f64, high: f64) -> Self {
        Self { low, high: if high > low { high } else { low + 1.0 }, log: false }
    }

    /// Logarithmic, with some room about the positive ones of `values`.
    pub fn log_about(values: impl Iterator<Item = f64>) -> Self {
        let positive = values.filter(|v| v.is_finite() && *v > 0.0);
        let (low, high) =
            positive.fold((f64::INFINITY, 0f64), |(low, high), v| (low.min(v), high.max(v)));
        if low > high {
            return Self { low: 0.1, high: 1.0, log: true };
        }
        // Points that differ little are not to look far apart: at least a factor of 3 is shown.
        let room = (3.0 / (high / low)).max(1.0).sqrt() * 1.25;
        Self { low: low / room, high: high * room, log: true }
    }

    /// Where `value` lies, per cent; what lies beyond an end, at that end.
    pub fn at(&self, value: f64) -> f64 {
        let part = match self.log {
            true => (value / self.low).ln() / (self.high / self.low).ln(),
            false => (value - self.low) / (self.high - self.low),
        };
        // A NaN, or the logarithm of 0.
        let part = if part.is_nan() { 0.0 } else { part.clamp(0.0, 1.0) };
        (part * 1e5).round() / 1e3
    }

    /// About four ticks, labelled in `unit`.
    pub fn ticks(&self, unit: &str) -> Vec<Tick> {
        let values = if self.log { self.log_values() } else { self.linear_values() };
        let tick =
            |v: f64| Tick { at: self.at(v), label: format!("{}{unit}", super::words::short(v)) };
        values.into_iter().map(tick).collect()
    }

    /// Ticks at whole numbers, for frames.
    pub fn whole_ticks(&self) -> Vec<Tick> {
        let step = round_step((self.high - self.low) / 5.0).max(1.0);
        let mut ticks = Vec::new();
        let mut value = (self.low / step).ceil() * step;
        while value <= self.high {
            ticks.push(Tick { at: self.at(value), label: format!("{value}") });
            value += step;
        }
        ticks
    }

    fn linear_values(&self) -> Vec<f64> {
        let step = round_step((self.high - self.low) / 4.0);
        let first = (self.low / step).ceil() as i64;
        let last = (self.high / step + 1e-9).floor() as i64;
        (first..=last).map(|k| k as f64 * step).collect()
    }

    fn log_values(&self) -> Vec<f64> {
        let decades = self.low.log10().floor() as i32..=self.high.log10().ceil() as i32;
        let with = |digits: &[f64]| -> Vec<f64> {
            let values =
                decades.clone().flat_map(|d| digits.iter().map(move |m| m * 10f64.powi(d)));
            values.filter(|v| (self.low..=self.high).contains(v)).collect()
        };
        let coarse = with(&[1.0]);
        match coarse.len() {
            0 | 1 => with(&[1.0, 2.0, 5.0]),
            2 | 3 => with(&[1.0, 3.0]),
            n => coarse.into_iter().step_by(n.div_ceil(6)).collect(),
        }
    }
}

/// 1, 2 or 5 times a power of ten, at or above `step`.
fn round_step(step: f64) -> f64 {
    let power = 10f64.powf(step.log10().floor());
    let digit = [1.0, 2.0, 5.0].into_iter().find(|d| d * power >= step * (1.0 - 1e-9));
    digit.unwrap_or(10.0) * power
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(ticks: &[Tick]) -> Vec<&str> {
        ticks.iter().map(|t| t.label.as_str()).collect()
    }

    #[test]
    fn linear_axes_end_at_round_numbers() {
        let axis = Axis::from_zero(0.37);
        assert_eq!(labels(&axis.ticks(" s")), ["0 s", "0.1 s", "0.2 s", "0.3 s", "0.4 s"]);
        assert_eq!((axis.at(0.0), axis.at(0.4), axis.at(0.1)), (0.0, 100.0, 25.0));
        assert_eq!(Axis::from_zero(f64::NAN), Axis::from_zero(1.0));
    }

    #[test]
    fn logarithmic_axes_hold_their_values_and_have_a_few_ticks() {
        for (low, high) in [(1.0, 1.0), (0.2, 0.9), (1e-5, 3.0), (1e-9, 1e9)] {
            let axis = Axis::log_about([low, high, 0.0, f64::NAN].into_iter());
            assert!(axis.at(low) > 0.0 && axis.at(high) < 100.0, "{low} {high}");
            assert!((2..=9).contains(&axis.ticks("").len()), "{low} {high}: {:?}", axis.ticks(""));
        }
        assert_eq!(Axis::log_about([1.0, 2.0].into_iter()).at(0.0), 0.0);
        assert!(Axis::log_about(std::iter::empty()).at(0.5) > 0.0);
    }

    #[test]
    fn frames_have_whole_numbers() {
        assert_eq!(labels(&Axis::exactly(1.0, 24.0).whole_ticks()), ["5", "10", "15", "20"]);
        assert_eq!(labels(&Axis::exactly(1.0, 3.0).whole_ticks()), ["1", "2", "3"]);
    }
}
