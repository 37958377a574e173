//! The error of the worst frame, where each frame's is estimated from some of its pixels.

/// The least spread of the true errors of a move's frames, as a share of their mean: that of scenes of the zoo is
/// 0.06 to 0.09.
const SPREAD: f64 = 0.1;
/// An estimate beyond this many times the median counts as far as it is sure.
const WILD: f64 = 3.0;

/// The squared error of the worst frame, by those `found` in each and their standard errors `doubts`, as
/// shares of them: the largest of [`estimates`], each with the standard error that is left of it.
pub fn worst(found: &[f64], doubts: &[f64]) -> f64 {
    estimates(found, doubts).into_iter().map(|(x, error)| x + error).fold(0.0, f64::max)
}

/// The squared error of each frame, by those `found` in all and their standard errors `doubts`, as shares of
/// them; and the standard error that is left of it.
///
/// The largest of some uncertain figures is mostly the one that came out too large by chance. So each is
/// moved towards the mean of all, the more the less their spread is beyond what chance alone makes
/// (empirical Bayes: Efron and Morris, 1973). Where a
/// single pixel makes most of a frame's error, that error is uncertain by all of it: it does not make all
/// other frames look bad.
pub fn estimates(found: &[f64], doubts: &[f64]) -> Vec<(f64, f64)> {
    // Alone, a frame has no others to be compared with.
    if let ([only], [doubt]) = (found, doubts) {
        return vec![(*only, only * doubt)];
    }
    let n = found.len().max(1) as f64;
    let wild = WILD * median(found);
    let found = found.iter().zip(doubts).map(|(x, d)| x.min(wild.max(x * (1.0 - d))));
    let found: Vec<f64> = found.collect();
    let mean = found.iter().sum::<f64>() / n;
    let chances: Vec<f64> =
        found.iter().zip(doubts).map(|(x, d)| (x.max(mean) * d) * (x.max(mean) * d)).collect();
    let apart = found.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (n - 1.0).max(1.0);
    let chance = chances.iter().sum::<f64>() / n;
    let true_spread = (apart - chance).max((SPREAD * mean) * (SPREAD * mean));
    let each = found.iter().zip(&chances).map(|(x, chance)| {
        let kept = true_spread / (true_spread + chance).max(1e-300);
        // The mean is in doubt itself.
        let left = kept * chance + (1.0 - kept) * chance / n;
        (mean + kept * (x - mean), left.sqrt())
    });
    each.collect()
}

/// The upper median; 0 of none.
fn median(all: &[f64]) -> f64 {
    let mut sorted = all.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::worst;

    #[test]
    fn the_worst_frame_is_told_apart_from_the_unluckiest() {
        let near = |x: f64, y: f64| (x - y).abs() < 1e-9;
        // What is sure stays.
        assert!(near(worst(&[1.0, 2.0, 9.0], &[0.0; 3]), 9.0));
        assert!(near(worst(&[4.0], &[0.25]), 5.0));
        // Frames that differ no more than by chance are much the same.
        let alike = worst(&[3.0, 4.0, 5.0, 4.0], &[0.5; 4]);
        assert!(alike > 4.5 && alike < 6.5, "{alike}");
        // A frame that is surely worse is hardly moved.
        let one = worst(&[1.0, 1.1, 0.9, 9.0], &[0.1; 4]);
        assert!((8.0..10.5).contains(&one), "{one}");
        // A single pixel that may be chance.
        let wild = worst(&[1.0, 1.1, 0.9, 50.0], &[0.1, 0.1, 0.1, 0.98]);
        assert!(wild < 5.0, "{wild}");
        // More doubt of frames that are alike is never less error.
        let by = |doubt| worst(&[3.9, 4.0, 4.1, 4.0], &[doubt; 4]);
        assert!(by(0.05) < by(0.3) && by(0.3) < by(0.5), "{} {}", by(0.05), by(0.3));
    }
}
