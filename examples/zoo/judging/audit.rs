//! The program's own audit, held against what came out.

use super::contract::mean;
use super::measure::FrameFigures;
use serde_json::Value;

/// What the audit said, each as estimate, low and high end of its interval, and what is true.
pub struct AuditCheck {
    /// RMSE of all pixels of the in-between frames as shown.
    pub shown: [f64; 3],
    pub shown_truly: f64,
    /// The same had they been traced.
    pub traced: [f64; 3],
    pub traced_truly: f64,
}

impl AuditCheck {
    /// Of a move of `last` frames. Its audit is of all in-between frames together, so there is no check
    /// where only some of them were judged, and none where nothing was audited.
    pub fn new(stats: &Value, frames: &[FrameFigures], last: usize) -> Option<Self> {
        if frames.len() + 2 != last {
            return None;
        }
        let audit = &stats["audit"];
        let triple = |name: &str| -> Option<[f64; 3]> {
            let all: Vec<f64> = audit[name].as_array()?.iter().filter_map(Value::as_f64).collect();
            all.try_into().ok()
        };
        // The audit knows nothing of the truth's noise, which the judged errors hold.
        let truly = |rmse: fn(&FrameFigures) -> f64| {
            mean(frames.iter().map(|f| (rmse(f).powi(2) - f.truth_noise).max(0.0))).sqrt()
        };
        Some(Self {
            shown: triple("rmse")?,
            shown_truly: truly(|f| f.inferred),
            traced: triple("rmse_traced")?,
            traced_truly: truly(|f| f.traced),
        })
    }

    /// Whether the interval of what is shown holds the truth.
    pub fn holds(&self) -> bool {
        let [_, low, high] = self.shown;
        (low..=high).contains(&self.shown_truly)
    }
}
