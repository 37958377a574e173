//! Times as people write them: `25m`, `1h30m`, `90s`, `2d`, or `off`; time limits also as Slurm has them.

use std::time::Duration;

/// How a time is written, for messages.
const HOW: &str = "a time is written with its units, as in 90s, 25m or 1h30m";

/// `25m`, `1h30m`, `90s`, `2d`.
///
/// # Errors
/// How a time is written.
pub fn parse_time(text: &str) -> Result<Duration, String> {
    let wrong = || HOW.to_string();
    let (mut rest, mut seconds) = (text.trim(), 0_u64);
    if rest.is_empty() {
        return Err(wrong());
    }
    while !rest.is_empty() {
        let digits = rest.find(|c: char| !c.is_ascii_digit()).ok_or_else(wrong)?;
        let number: u32 = rest[..digits].parse().map_err(|_| wrong())?;
        let unit = match rest.as_bytes()[digits] {
            b's' => 1,
            b'm' => 60,
            b'h' => 3600,
            b'd' => 86_400,
            _ => return Err(wrong()),
        };
        seconds += u64::from(number) * unit;
        rest = &rest[digits + 1..];
    }
    Ok(Duration::from_secs(seconds))
}

/// How a time limit is written, for messages.
const HOW_LIMIT: &str = "a time limit is written with its units, as in 90s, 25m or 1h30m, or as Slurm's: \
    minutes, minutes:seconds, hours:minutes:seconds, days-hours, days-hours:minutes or \
    days-hours:minutes:seconds";

/// A time limit: what [`parse_time`] takes, or one of the forms of Slurm's `--time`, in which a number
/// alone is minutes: `30`, `00:30`, `00:30:00`, `1-12`, `1-12:30`, `1-00:00:00`.
///
/// # Errors
/// How a time limit is written.
pub fn parse_time_limit(text: &str) -> Result<Duration, String> {
    let text = text.trim();
    if text.ends_with(|c: char| c.is_ascii_alphabetic()) {
        return parse_time(text).map_err(|_| HOW_LIMIT.to_string());
    }
    let (days, rest) = match text.split_once('-') {
        Some((days, rest)) => (Some(clock_part(days)?), rest),
        None => (None, text),
    };
    let parts: Vec<u64> = rest.split(':').map(clock_part).collect::<Result<_, _>>()?;
    // Seconds of a unit of each part, the largest unit first.
    let units: &[u64] = match (days, parts.len()) {
        (None, 1) => &[60],
        (None, 2) => &[60, 1],
        (None, 3) | (Some(_), 1..=3) => &[3600, 60, 1],
        _ => return Err(HOW_LIMIT.into()),
    };
    for (place, (part, unit)) in parts.iter().zip(units).enumerate() {
        let most = if *unit == 3600 { 23 } else { 59 };
        // The largest unit of all may be any number: 90:00 is an hour and a half.
        if (place > 0 || days.is_some()) && *part > most {
            return Err(format!("{part} in {text} is more than {most}; {HOW_LIMIT}"));
        }
    }
    let clock: u64 = parts.iter().zip(units).map(|(part, unit)| part * unit).sum();
    match days.unwrap_or(0) * 86_400 + clock {
        0 => {
            Err("a limit of 0 is none for Slurm, and here would stop at once: leave it out".into())
        }
        seconds => Ok(Duration::from_secs(seconds)),
    }
}

fn clock_part(text: &str) -> Result<u64, String> {
    let is_number = !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    let number = text.parse::<u32>().ok().filter(|_| is_number);
    number.map(u64::from).ok_or_else(|| HOW_LIMIT.to_string())
}

/// How often something is done, if ever.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SaveInterval(pub Option<Duration>);

impl SaveInterval {
    /// A time, or `off`.
    ///
    /// # Errors
    /// How a time is written.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text.trim() {
            "off" => Ok(Self(None)),
            text => parse_time(text).map(|time| Self(Some(time))).map_err(|how| how + ", or off"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_units() {
        let seconds = |text| parse_time(text).map(|t| t.as_secs());
        assert_eq!(seconds("25m"), Ok(1500));
        assert_eq!(seconds("1h30m"), Ok(5400));
        assert_eq!(seconds("0s"), Ok(0));
        assert_eq!(seconds("2d4h"), Ok(187_200));
        for text in ["", "25", "m", "1.5h", "-3s", "5 m x", "99999999999s", "5é", "1h30"] {
            assert!(parse_time(text).is_err(), "{text}");
        }
        assert_eq!(SaveInterval::parse("off"), Ok(SaveInterval(None)));
        assert_eq!(SaveInterval::parse("30s"), Ok(SaveInterval(Some(Duration::from_secs(30)))));
        assert!(SaveInterval::parse("never").is_err_and(|how| how.ends_with("or off")));
    }
    /// The forms of sbatch's manual, each with what it means there.
    #[test]
    fn time_limits_may_be_in_slurms_notation() {
        let seconds = |text| parse_time_limit(text).map(|t| t.as_secs());
        for (text, is) in [
            ("30", 30 * 60),
            ("90", 90 * 60),
            ("00:30", 30),
            ("90:00", 90 * 60),
            ("00:30:00", 30 * 60),
            ("100:00:01", 360_001),
            ("2-12", 60 * 3600),
            ("1-0", 86_400),
            ("1-12:30", 131_400),
            ("1-00:00:00", 86_400),
            ("0-00:00:05", 5),
            ("25m", 1500),
            ("1h30m", 5400),
            ("0s", 0),
        ] {
            assert_eq!(seconds(text), Ok(is), "{text}");
        }
        for text in [
            "",
            "-",
            ":",
            "-5",
            "1-",
            "1:",
            ":30",
            "1:2:3:4",
            "1-2:3:4:5",
            "1-2-3",
            "+5",
            "1.5",
            "1:-2",
            "99999999999",
            "5 m",
            "1-2h",
            "UNLIMITED",
            "00h:30",
            "٣",
        ] {
            let told = parse_time_limit(text).expect_err(text);
            assert!(told.contains("hours:minutes:seconds"), "{text}: {told}");
        }
        for (text, names) in
            [("0:60", "60 in 0:60"), ("1:60:00", "60 in 1:60:00"), ("1-24", "24 in 1-24")]
        {
            let told = parse_time_limit(text).expect_err(text);
            assert!(told.starts_with(names), "{told}");
        }
        for text in ["0", "00:00", "0-0"] {
            assert!(
                parse_time_limit(text).is_err_and(|told| told.contains("leave it out")),
                "{text}"
            );
        }
    }
}
