//! The difference between two answers, if there is one.

use super::class::Difference;
use super::differ::Closely;
use super::{Answers, Check, TracedRay};

impl Check<'_> {
    /// The difference between the two answers, if there is one.
    pub fn judge(&self, trial: &TracedRay) -> Option<Difference> {
        match trial.answers {
            Answers::Hits { product: None, oracle: None } => None,
            Answers::Occlusion { product, oracle } if product == oracle => None,
            Answers::Hits { product, oracle } => {
                Closely::new(self, &trial.ray).hits(product, oracle)
            }
            Answers::Occlusion { product: true, .. } => {
                Some(Closely::new(self, &trial.ray).false_shadow())
            }
            Answers::Occlusion { product: false, .. } => {
                Some(Closely::new(self, &trial.ray).leak())
            }
        }
    }
}
