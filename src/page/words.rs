//! Figures as people read them.

/// Three digits or so: `0.0041`, `0.41`, `41`, `4,100`, `4.1e-7`.
pub fn short(x: f64) -> String {
    let size = x.abs();
    match size {
        _ if !x.is_finite() => if x.is_nan() { "–" } else { "∞" }.into(),
        0.0 => "0".into(),
        _ if !(1e-3..1e9).contains(&size) => trimmed(&format!("{x:.1e}"), 'e'),
        _ if size >= 999.5 => thousands(x.round() as i64),
        _ => {
            let digits = (2 - size.log10().floor() as i32).clamp(0, 6) as usize;
            trimmed(&format!("{x:.digits$}"), ' ')
        }
    }
}

/// Without zeros at the end of the fraction, which ends before `end`.
fn trimmed(text: &str, end: char) -> String {
    let (number, rest) = text.split_at(text.find(end).unwrap_or(text.len()));
    let number = match number.contains('.') {
        true => number.trim_end_matches('0').trim_end_matches('.'),
        false => number,
    };
    format!("{number}{rest}")
}

fn thousands(n: i64) -> String {
    let digits = n.unsigned_abs().to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i) % 3 == 0 {
            text.push(',');
        }
        text.push(digit);
    }
    if n < 0 { format!("-{text}") } else { text }
}

/// `1,280,000`.
pub fn count(n: u64) -> String {
    thousands(i64::try_from(n).unwrap_or(i64::MAX))
}

/// `41 %`, `0.41 %`.
pub fn percent(share: f64) -> String {
    format!("{} %", short(share * 100.0))
}

/// `+6 %`, `−0.4 %`: how far a ratio is from 1.
pub fn change(ratio: f64) -> String {
    let more = (ratio - 1.0) * 100.0;
    let digits = if more.abs() < 9.95 { 1 } else { 0 };
    let text = format!("{:.digits$}", more.abs());
    let text = trimmed(&text, ' ');
    let sign = if more < 0.0 && text != "0" { "−" } else { "+" };
    format!("{sign}{text} %")
}

/// `1.3 GB`, `27 MB`.
pub fn bytes(n: u64) -> String {
    match n {
        0..1_000_000 => format!("{} kB", short(n as f64 * 1e-3)),
        1_000_000..1_000_000_000 => format!("{} MB", short(n as f64 * 1e-6)),
        _ => format!("{} GB", short(n as f64 * 1e-9)),
    }
}

/// Display steps of 1/255, to a thousandth: `1.2`, `0.004`; less is as good as none.
pub fn steps(x: f64) -> String {
    short(if x.abs() < 5e-4 { 0.0 } else { x })
}

/// `4.1 ms`, `0.41 s`, `25 s`, `3 min 20 s`, `2 h 5 min`.
pub fn seconds(s: f64) -> String {
    let whole = s.round() as u64;
    match whole {
        0 if s > 0.0 && s < 0.0995 => format!("{} ms", short(s * 1e3)),
        0..60 => format!("{} s", short(s)),
        60..3600 => format!("{} min {} s", whole / 60, whole % 60),
        _ => format!("{} h {} min", whole / 3600, whole % 3600 / 60),
    }
}

/// `21 November 2026, 17:14 UTC`, of seconds since 1970 (the days by Howard Hinnant's
/// `civil_from_days`).
pub fn date(unix: f64) -> String {
    const MONTHS: [&str; 12] = [
        "January",
        "February",
        "March",
        "April",
        "May",
        "June",
        "July",
        "August",
        "September",
        "October",
        "November",
        "December",
    ];
    let second = unix.max(0.0) as i64;
    let days = second / 86_400 + 719_468;
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted + 2) / 5 + 1;
    let month = (shifted + 2) % 12;
    let year = era * 400 + year_of_era + i64::from(month < 2);
    let (hour, minute) = (second % 86_400 / 3600, second % 3600 / 60);
    format!("{day} {} {year}, {hour:02}:{minute:02} UTC", MONTHS[month as usize])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_have_about_three_digits() {
        let cases = [
            (0.0, "0"),
            (0.00412, "0.00412"),
            (0.5, "0.5"),
            (41.26, "41.3"),
            (412.6, "413"),
            (4126.0, "4,126"),
            (1_280_000.0, "1,280,000"),
            (4.1e-7, "4.1e-7"),
            (1e-5, "1e-5"),
            (-2.5, "-2.5"),
            (f64::NAN, "–"),
            (f64::INFINITY, "∞"),
            (999.7, "1,000"),
        ];
        for (x, text) in cases {
            assert_eq!(short(x), text);
        }
        assert_eq!((change(1.063), change(0.5)), ("+6.3 %".into(), "−50 %".into()));
        assert_eq!((change(0.9999), change(0.9)), ("+0 %".into(), "−10 %".into()));
        assert_eq!((change(1.0), change(3.5)), ("+0 %".into(), "+250 %".into()));
        assert_eq!((seconds(0.0041), seconds(0.41)), ("4.1 ms".into(), "0.41 s".into()));
        assert_eq!((steps(7.4e-8), steps(0.012)), ("0".into(), "0.012".into()));
        assert_eq!((bytes(27_300_000), seconds(200.0)), ("27.3 MB".into(), "3 min 20 s".into()));
    }

    #[test]
    fn dates() {
        assert_eq!(date(0.0), "1 January 1970, 00:00 UTC");
        assert_eq!(date(951_782_400.0), "29 February 2000, 00:00 UTC");
        assert_eq!(date(1_795_281_246.0), "21 November 2026, 17:14 UTC");
        assert_eq!(date(1_767_225_599.0), "31 December 2025, 23:59 UTC");
    }
}
