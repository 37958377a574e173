//! Times as people write them: `25m`, `1h30m`, `90s`, `2d`, or `off`.

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

/// How often something is done, if ever.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interval(pub Option<Duration>);

impl Interval {
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
        assert_eq!(Interval::parse("off"), Ok(Interval(None)));
        assert_eq!(Interval::parse("30s"), Ok(Interval(Some(Duration::from_secs(30)))));
        assert!(Interval::parse("never").is_err_and(|how| how.ends_with("or off")));
    }
}
