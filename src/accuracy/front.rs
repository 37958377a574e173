//! The settings that nothing beats in both time and error.

use super::knobs::Knob;
use super::row::{CandidateRow, Spread};
use crate::measure::{Median, median};

/// The rows on the front, by `time`, the fastest first: those that may be recommended and that no other
/// such row beats; the default only by what surely beats it, and never by what has its pixels. Of two
/// neighbours on it, of which the one is not surely faster or the other not surely nearer to the truth,
/// only the better one stays: the difference is noise.
pub fn of(rows: &[CandidateRow], time: fn(&CandidateRow) -> &Spread) -> Vec<usize> {
    let seconds = |k: &usize| time(&rows[*k]).median.interval.estimate;
    let mut front: Vec<usize> = (0..rows.len()).filter(|k| is_unbeaten(rows, time, *k)).collect();
    front.sort_by(|a, b| seconds(a).total_cmp(&seconds(b)));
    let noise = |front: &[usize]| front.windows(2).find_map(|pair| noise_of(rows, time, pair));
    while let Some(leaves) = noise(&front) {
        front.retain(|k| *k != leaves);
    }
    front
}

fn is_unbeaten(rows: &[CandidateRow], time: fn(&CandidateRow) -> &Spread, k: usize) -> bool {
    let place = |row: &CandidateRow| (time(row).median.interval.estimate, row.errors.mse);
    let row = &rows[k];
    let (seconds, mse) = place(row);
    // Whether `a` is surely less than `b`, in turns.
    let surely = |a: &[f64], b: &[f64]| {
        compared(a, b).is_some_and(|r| r.differs_from(1.0) && r.interval.estimate < 1.0)
    };
    let faster = |a: &CandidateRow, b: &CandidateRow| surely(&time(a).turns, &time(b).turns);
    let nearer = |a: &CandidateRow, b: &CandidateRow| surely(&a.rmse_of_turns, &b.rmse_of_turns);
    let beats = |(i, other): (usize, &CandidateRow)| {
        let (s, e) = place(other);
        if i == k || !other.knob.is_ranked() {
            return false;
        }
        if other.knob == Knob::Default && row.has_pixels_of_default() {
            return !faster(row, other);
        }
        let better = match row.knob {
            Knob::Default => {
                !other.has_pixels_of_default() && (faster(other, row) || nearer(other, row))
            }
            // Of two that are equal the first stays.
            _ => s < seconds || e < mse || i < k,
        };
        s <= seconds && e <= mse && better
    };
    row.knob.is_ranked() && !rows.iter().enumerate().any(beats)
}

/// Which of two neighbours, the faster one first, is there for noise alone, if either is.
fn noise_of(
    rows: &[CandidateRow],
    time: fn(&CandidateRow) -> &Spread,
    pair: &[usize],
) -> Option<usize> {
    let (fast, near) = (&rows[pair[0]], &rows[pair[1]]);
    // Too few turns tell nothing: then both stay.
    let errors = compared(&near.rmse_of_turns, &fast.rmse_of_turns)?;
    let times = compared(&time(fast).turns, &time(near).turns)?;
    // The default leaves for noise in neither: only what is surely better beats it.
    let [errors, times] = [errors, times].map(|ratio| ratio.differs_from(1.0));
    match (errors, times) {
        (true, true) => None,
        (false, true) => (near.knob != Knob::Default).then_some(pair[1]),
        (true, false) => (fast.knob != Knob::Default).then_some(pair[0]),
        (false, false) => Some(pair[usize::from(near.knob != Knob::Default)]),
    }
}

/// `a` over `b`, turn by turn; `None` where too few turns tell.
fn compared(a: &[f64], b: &[f64]) -> Option<Median> {
    let ratios: Vec<f64> = a.iter().zip(b).map(|(a, b)| a / b).collect();
    median(&ratios).filter(|ratio| ratio.is_sure())
}

#[cfg(test)]
mod tests {
    use super::super::change::Change;
    use super::super::table::tests::measured;
    use super::*;

    #[test]
    fn candidates_on_the_front_by_noise_alone_leave() {
        let mut rows = measured(&[
            (Knob::Default, "", 1.0, 2.0),
            (Knob::Tolerance, "--tolerance 2", 0.99, 2.01),
            (Knob::CutOff, "--cutoff 0.01", 0.5, 2.5),
            (Knob::Bounces, "--bounces 8", 1.2, 1.99),
        ])
        .rows;
        let fronts = |rows: &[CandidateRow]| -> Vec<bool> {
            let front = of(rows, |row| &row.seconds);
            (0..rows.len()).map(|k| front.contains(&k)).collect()
        };
        assert_eq!(fronts(&rows), [true; 4], "as sure as can be");
        // Its time goes up and down, and so does the other's error.
        rows[1].seconds.turns = vec![0.9, 1.1, 0.95, 1.05, 0.97, 1.03];
        rows[3].rmse_of_turns = vec![1.9, 2.1, 1.95, 2.05, 1.99, 2.0, 2.0];
        assert_eq!(fronts(&rows), [true, false, true, false]);
        rows.iter_mut().for_each(|row| row.seconds.turns.truncate(3));
        assert_eq!(fronts(&rows), [true; 4], "too few turns to tell");
    }

    #[test]
    fn chance_does_not_push_the_default_off() {
        let mut rows = measured(&[
            (Knob::Default, "", 1.0, 2.0),
            (Knob::CutOff, "--cutoff 0.0001", 0.99, 2.0),
            (Knob::Tolerance, "--tolerance 2", 0.98, 1.999),
        ])
        .rows;
        rows[1].change = Some(Change { pixels: 9000, ..Change::default() });
        rows[2].change = Some(Change { pixels: 9000, differing: 9, ..Change::default() });
        let fronts = |rows: &[CandidateRow]| -> Vec<bool> {
            let front = of(rows, |row| &row.seconds);
            (0..rows.len()).map(|k| front.contains(&k)).collect()
        };
        assert_eq!(fronts(&rows), [false, false, true], "what surely beats it does");
        for row in &mut rows[1..] {
            row.seconds.turns = vec![0.9, 1.1, 0.95, 1.05, 0.97, 1.03];
        }
        rows[2].rmse_of_turns = vec![1.9, 2.1, 1.95, 2.05, 1.99, 2.0, 2.0];
        assert_eq!(fronts(&rows), [true, false, false], "neither is surely better");
        rows[2].seconds.turns = vec![0.98; 6];
        assert_eq!(fronts(&rows), [false, false, true], "surely faster, and no farther");
        rows[2].errors.mse *= 1.01;
        assert_eq!(fronts(&rows), [true, false, true], "surely faster, and nobody knows how far");
        rows.truncate(2);
        assert_eq!(fronts(&rows), [true, false]);
        rows[1].seconds.turns = vec![0.99; 6];
        assert_eq!(fronts(&rows), [true, true], "the same pixels in surely less time");
        // Surely nearer, but by its times perhaps three times as slow.
        rows[1].errors.mse *= 0.5;
        rows[1].rmse_of_turns = vec![1.4; 7];
        rows[1].change = None;
        rows[1].seconds.median.interval.estimate = 3.0;
        rows[1].seconds.turns = vec![0.9, 9.0, 3.0, 4.0, 2.0, 3.0];
        assert_eq!(fronts(&rows), [true, true], "it does not surely beat the default");
    }
}
