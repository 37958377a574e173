//! Which frame is worst, where each is known but by some of its pixels.

/// The squared error of the worst frame, by what was found in each and how far that may be off, a share.
///
/// The largest of some uncertain figures is mostly that which came out too large by chance. So each is
/// moved towards the mean of all, the more the less their spread is beyond what chance alone makes
/// (empirical Bayes: Efron and Morris, 1973); one and a half times the standard error that is
/// left of it is added. Frames of a move always differ somewhat, whether or not that shows.
pub fn worst(found: &[f64], doubts: &[f64]) -> f64 {
    const SPREAD: f64 = 0.5;
    const SURE: f64 = 1.5;
    let n = found.len().max(1) as f64;
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
        mean + kept * (x - mean) + SURE * left.sqrt()
    });
    // Alone, a frame has no others to be held against.
    match found {
        [only] => only * (1.0 + SURE * doubts.first().unwrap_or(&0.0)),
        _ => each.fold(0.0, f64::max),
    }
}

#[cfg(test)]
mod tests {
    use super::worst;

    #[test]
    fn the_worst_frame_is_told_apart_from_the_unluckiest() {
        let near = |x: f64, y: f64| (x - y).abs() < 1e-9;
        // What is sure stays.
        assert!(near(worst(&[1.0, 2.0, 9.0], &[0.0; 3]), 9.0));
        assert!(near(worst(&[4.0], &[0.25]), 5.5));
        // Frames that differ no more than by chance are much the same.
        let alike = worst(&[3.0, 4.0, 5.0, 4.0], &[0.5; 4]);
        assert!(alike > 5.0 && alike < 7.4, "{alike}");
        // A frame that is surely worse is hardly moved.
        let one = worst(&[1.0, 1.1, 0.9, 9.0], &[0.1; 4]);
        assert!((9.0..10.5).contains(&one), "{one}");
        // More doubt is never less error.
        let by = |doubt| worst(&[3.0, 4.0, 5.0, 4.0], &[doubt; 4]);
        assert!(by(0.05) < by(0.3) && by(0.3) < by(0.5), "{} {}", by(0.05), by(0.3));
    }
}
