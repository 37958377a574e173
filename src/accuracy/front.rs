//! The settings that nothing beats in both time and error.

use super::table::Row;
use crate::measure::median;
use std::cmp::Ordering;

/// Marks the rows on the front: those that may be recommended and that no other such row beats. Of
/// two neighbours on it, of which the one is not surely faster or the other not surely nearer to the
/// truth, only the better one stays: the difference is noise.
pub fn mark(rows: &mut [Row]) {
    let mut front: Vec<usize> = (0..rows.len()).filter(|k| is_unbeaten(rows, *k)).collect();
    front.sort_by(|a, b| rows[*a].by_time(&rows[*b]));
    while let Some(noise) = front.windows(2).position(|pair| is_noise(rows, pair).is_some()) {
        let pair = [front[noise], front[noise + 1]];
        // The pair was found by this very question.
        let leaves = is_noise(rows, &pair).unwrap_or(pair[1]);
        front.retain(|k| *k != leaves);
    }
    front.iter().for_each(|k| rows[*k].on_front = true);
}

fn is_unbeaten(rows: &[Row], k: usize) -> bool {
    let place = |row: &Row| (row.seconds.median.interval.estimate, row.errors.mse);
    let (seconds, mse) = place(&rows[k]);
    let beats = |(i, other): (usize, &Row)| {
        let (s, e) = place(other);
        // Of two that are equal the first stays.
        let better = s < seconds || e < mse || i < k;
        i != k && other.knob.is_ranked() && s <= seconds && e <= mse && better
    };
    rows[k].knob.is_ranked() && !rows.iter().enumerate().any(beats)
}

/// Which of two neighbours, the faster one first, is there for noise alone, if either is.
fn is_noise(rows: &[Row], pair: &[usize]) -> Option<usize> {
    let (fast, near) = (&rows[pair[0]], &rows[pair[1]]);
    let compared = |a: &[f64], b: &[f64]| {
        let ratios: Vec<f64> = a.iter().zip(b).map(|(a, b)| a / b).collect();
        median(&ratios).filter(|ratio| ratio.is_sure())
    };
    // Too few turns tell nothing: then both stay.
    let errors = compared(&near.rmse_of_turns, &fast.rmse_of_turns)?;
    let times = compared(&fast.seconds.turns, &near.seconds.turns)?;
    if !errors.differs_from(1.0) {
        return Some(pair[1]);
    }
    (!times.differs_from(1.0)).then_some(pair[0])
}

impl Row {
    fn by_time(&self, other: &Self) -> Ordering {
        let seconds = |row: &Self| row.seconds.median.interval.estimate;
        seconds(self).total_cmp(&seconds(other))
    }
}

#[cfg(test)]
mod tests {
    use super::super::knobs::Knob;
    use super::super::table::tests::measured;
    use super::*;

    #[test]
    fn what_is_there_for_noise_alone_leaves() {
        let mut rows = measured(&[
            (Knob::Default, "", 1.0, 2.0),
            (Knob::Tolerance, "--tolerance 2", 0.99, 2.01),
            (Knob::CutOff, "--cutoff 0.01", 0.5, 2.5),
            (Knob::Bounces, "--bounces 8", 1.2, 1.99),
        ])
        .rows;
        let fronts = |rows: &mut [Row]| -> Vec<bool> {
            rows.iter_mut().for_each(|row| row.on_front = false);
            mark(rows);
            rows.iter().map(|row| row.on_front).collect()
        };
        assert_eq!(fronts(&mut rows), [true; 4], "as sure as can be");
        // Its time goes up and down, and so does the other's error.
        rows[1].seconds.turns = vec![0.9, 1.1, 0.95, 1.05, 0.97, 1.03];
        rows[3].rmse_of_turns = vec![1.9, 2.1, 1.95, 2.05, 1.99, 2.0, 2.0];
        assert_eq!(fronts(&mut rows), [true, false, true, false]);
        rows.iter_mut().for_each(|row| row.seconds.turns.truncate(3));
        assert_eq!(fronts(&mut rows), [true, true, true, false], "time: too few turns to tell");
    }
}
