//! Least squares without negative amounts.

/// The `N` amounts, none of them negative, whose weighted sums `rows · amounts` come nearest to
/// `measured`: least squares of the misses, each as a share of what was measured.
///
/// Each amount in turn is set to its best value given the others. The problem is convex, so this ends at
/// the best of all (coordinate descent: Franc, Hlaváč and Navara, 2005).
pub fn fit<const N: usize>(rows: &[[f64; N]], measured: &[f64]) -> [f64; N] {
    const ROUNDS: usize = 200;
    const LEAST: f64 = 1e-12;
    let scaled: Vec<[f64; N]> =
        rows.iter().zip(measured).map(|(row, value)| row.map(|x| x / value.max(LEAST))).collect();
    let mut amounts = [0.0; N];
    let mut left = vec![1.0; scaled.len()];
    for _ in 0..ROUNDS {
        for k in 0..N {
            let square: f64 = scaled.iter().map(|row| row[k] * row[k]).sum();
            if square <= 0.0 {
                continue;
            }
            let product: f64 = scaled.iter().zip(&left).map(|(row, left)| row[k] * left).sum();
            let better = (amounts[k] + product / square).max(0.0);
            let step = better - amounts[k];
            scaled.iter().zip(&mut left).for_each(|(row, left)| *left -= row[k] * step);
            amounts[k] = better;
        }
    }
    amounts
}

#[cfg(test)]
mod tests {
    use super::fit;

    #[test]
    fn amounts_are_found_and_none_is_negative() {
        let rows = [[1.0, 0.0], [1.0, 2.0], [1.0, 5.0]];
        let amounts = fit(&rows, &[3.0, 7.0, 13.0]);
        assert!((amounts[0] - 3.0).abs() < 1e-6 && (amounts[1] - 2.0).abs() < 1e-6);
        let amounts = fit(&rows, &[3.0, 2.0, 1.0]);
        assert!(amounts[0] > 1.0 && amounts[1] == 0.0);
    }
}
