//! Amounts that are never negative, fitted to measurements.

/// The `N` amounts, none of them negative, whose weighted sums `rows · amounts` come nearest to
/// `measured`, every miss as a share of what was measured; and the root mean square of these.
///
/// Each amount in turn is put where it is best given the others, which for such a convex problem ends
/// at the best of all (coordinate descent: Franc, Hlaváč and Navara, 2005).
pub fn fit<const N: usize>(rows: &[[f64; N]], measured: &[f64]) -> ([f64; N], f64) {
    const ROUNDS: usize = 200;
    const LEAST: f64 = 1e-12;
    let scaled: Vec<[f64; N]> =
        rows.iter().zip(measured).map(|(row, value)| row.map(|x| x / value.max(LEAST))).collect();
    let mut amounts = [0.0; N];
    let mut left = vec![1.0; scaled.len()];
    for _ in 0..ROUNDS {
        let mut moved = 0.0_f64;
        for k in 0..N {
            let square: f64 = scaled.iter().map(|row| row[k] * row[k]).sum();
            if square <= 0.0 {
                continue;
            }
            let product: f64 = scaled.iter().zip(&left).map(|(row, left)| row[k] * left).sum();
            let better = (amounts[k] + product / square).max(0.0);
            let step = better - amounts[k];
            scaled.iter().zip(&mut left).for_each(|(row, left)| *left -= row[k] * step);
            moved = moved.max(step.abs() * square.sqrt());
            amounts[k] = better;
        }
        if moved < 1e-9 {
            break;
        }
    }
    let squares: f64 = left.iter().map(|left| left * left).sum();
    (amounts, (squares / left.len().max(1) as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::fit;

    #[test]
    fn amounts_are_found_and_none_is_negative() {
        let rows = [[1.0, 0.0], [1.0, 2.0], [1.0, 5.0]];
        let (amounts, misfit) = fit(&rows, &[3.0, 7.0, 13.0]);
        assert!((amounts[0] - 3.0).abs() < 1e-6 && (amounts[1] - 2.0).abs() < 1e-6);
        assert!(misfit < 1e-6);
        let (amounts, misfit) = fit(&rows, &[3.0, 2.0, 1.0]);
        assert_eq!(amounts[1], 0.0);
        assert!(amounts[0] > 1.0 && misfit > 0.1);
    }
}
