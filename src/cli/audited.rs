//! What the audits of inferred frames found, in words.

use super::status::runs;
use crate::output::manifest::AuditRow;
use crate::reuse::audit::{Rmse, is_worse_than_traced, rmse};
use crate::stats::AuditSums;

/// The error of the inferred frames together, where up to `tolerance` display steps are allowed; `None` where no pixel was
/// drawn.
pub fn error_of(audit: &AuditRow, tolerance: f32) -> Option<String> {
    let ([rmse, low, high], [traced, _, traced_high]) = (audit.rmse?, audit.rmse_traced?);
    let is_allowed = low > traced_high && low <= tolerance.into();
    let allowed = match is_allowed {
        true => format!(", within --tolerance {tolerance}"),
        false => String::new(),
    };
    Some(format!(
        "inferred frames: RMSE {}/255 ({}–{}){allowed}; tracing each frame: {}/255",
        steps(rmse),
        steps(low),
        steps(high),
        steps(traced)
    ))
}

/// Which inferred frames are less accurate than traced ones by more than `tolerance` display steps, with what to do:
/// all together, or those whose own audits show it. `audits` are those of single frames, by frame. `None` if nothing
/// shows it.
pub fn worse_than_traced(audits: &[(u32, AuditSums)], tolerance: f32) -> Option<String> {
    let is_worse =
        |(_, sums): &&(u32, AuditSums)| is_worse_than_traced(sums, tolerance, audits.len());
    let worse: Vec<&(u32, AuditSums)> = audits.iter().filter(is_worse).collect();
    let all = audits.iter().map(|(_, sums)| *sums).sum();
    let frames: Vec<u32> = worse.iter().map(|(frame, _)| *frame).collect();
    let named = format!("{} {}", if frames.len() == 1 { "frame" } else { "frames" }, runs(&frames));
    let what = match (is_worse_than_traced(&all, tolerance, 1), frames.len()) {
        (false, 0) => return None,
        (true, 0) => {
            format!("inferred frames are less accurate than traced ones ({})", errors(&all)?)
        }
        (true, _) => format!(
            "inferred frames are less accurate than traced ones ({}), above all {}",
            errors(&all)?,
            named
        ),
        (false, n) => {
            let together = worse.iter().map(|(_, sums)| *sums).sum();
            let errors = errors(&together)?;
            match n {
                1 => format!("inferred {named} is less accurate than a traced one ({errors})"),
                _ => format!("inferred {named} are less accurate than traced ones ({errors})"),
            }
        }
    };
    // Frames of other settings cannot lie beside those that are right.
    Some(format!(
        "{what}: render all again with --overwrite, and with --policy off or a larger --probes"
    ))
}

/// The errors of inferred and of traced frames.
fn errors(sums: &AuditSums) -> Option<String> {
    let Rmse { shown, traced, .. } = rmse(sums)?;
    Some(format!("RMSE {}/255 against {}/255", steps(shown.estimate), steps(traced.estimate)))
}

/// Display steps as text, with about two digits.
fn steps(x: f64) -> String {
    match x {
        ..0.0095 => format!("{x:.3}"),
        ..0.095 => format!("{x:.2}"),
        _ => format!("{x:.1}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::DrawnSum;

    /// An audit of `n` pixels with these squared errors.
    fn audit(n: u64, [inferred, traced]: [f64; 2]) -> AuditSums {
        let of = |square: f64| {
            let mut sum = DrawnSum::default();
            (0..n).for_each(|k| sum.add(square * [0.5, 1.5][k as usize % 2], 1.0, 0.0));
            sum
        };
        AuditSums {
            pixels: n,
            inferred_pixels: n,
            drawn: n,
            inferred: of(inferred),
            shown: of(inferred),
            traced: of(traced),
            ..AuditSums::default()
        }
    }

    /// Only what is certainly less accurate than a trace is said to be allowed.
    #[test]
    fn an_error_that_the_tolerance_allows_is_said_to_be() {
        let told = |inferred: [f64; 3], tolerance| {
            let (rmse, rmse_traced) = (Some(inferred), Some([1.2, 1.1, 1.3]));
            let (rmse_inferred_pixels, sums) = (None, AuditSums::default());
            let audit = AuditRow { rmse, rmse_inferred_pixels, rmse_traced, sums };
            error_of(&audit, tolerance).expect("drawn pixels")
        };
        let traced = "; tracing each frame: 1.2/255";
        let worse =
            |allowed: &str| format!("inferred frames: RMSE 2.7/255 (2.1–3.9){allowed}{traced}");
        assert_eq!(told([2.7, 2.1, 3.9], 20.0), worse(", within --tolerance 20"));
        assert_eq!(told([2.7, 2.1, 3.9], 2.0), worse(""));
        let alike = format!("inferred frames: RMSE 1.4/255 (1.2–1.7){traced}");
        assert_eq!(told([1.4, 1.2, 1.7], 20.0), alike);
    }

    fn told(audits: &[AuditSums]) -> String {
        let audits: Vec<(u32, AuditSums)> = (2..).zip(audits.iter().copied()).collect();
        worse_than_traced(&audits, 0.25).unwrap_or_default()
    }

    #[test]
    fn inferred_frames_are_worse_only_beyond_chance_and_tolerance() {
        assert_eq!(told(&[]), "");
        assert_eq!(told(&[audit(1000, [4.4, 4.0])]), "", "chance");
        assert_eq!(told(&[audit(1000, [0.05, 0.01])]), "", "nobody sees it");
        assert_eq!(
            told(&[audit(1000, [16.0, 4.0])]),
            "inferred frames are less accurate than traced ones (RMSE 4.0/255 against 2.0/255), above all frame 2: \
             render all again with --overwrite, and with --policy off or a larger --probes"
        );
    }

    /// Of many frames that are more accurate than traced ones they do not hide a few that are not.
    #[test]
    fn single_frames_that_are_worse_are_named() {
        let mut audits = [audit(1000, [1.0, 4.0]); 40];
        assert_eq!(told(&audits), "");
        audits[5] = audit(1000, [16.0, 4.0]);
        assert!(told(&audits).starts_with(
            "inferred frame 7 is less accurate than a traced one (RMSE 4.0/255 against 2.0/255): render"
        ));
        audits[6] = audits[5];
        audits[30] = audits[5];
        assert!(
            told(&audits).starts_with(
                "inferred frames 7..8, 32 are less accurate than traced ones (RMSE 4.0"
            )
        );
    }

    /// Too little for each frame by itself, and enough for all together.
    #[test]
    fn frames_are_judged_together_too() {
        let audits = [audit(12, [8.0, 4.0]); 40];
        assert!(told(&audits[..1]).is_empty());
        assert!(told(&audits).starts_with(
            "inferred frames are less accurate than traced ones (RMSE 2.8/255 against 2.0/255):"
        ));
    }
}
