//! Times in a scene file: text with units, the same as on the command line.

use super::schema::inline_schema;
use crate::scene::{SaveInterval, parse_time_limit};
use schemars::json_schema;
use serde::de::Error;
use serde::{Deserialize, Deserializer};
use std::time::Duration;

/// A time limit: `"25m"`, `"1h30m"`, or as Slurm has it: `"30"` (minutes), `"1-00:00:00"`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Time(pub Duration);

/// A time, or `"off"`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct TimeOrOff(pub SaveInterval);

impl<'de> Deserialize<'de> for Time {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        parse_time_limit(&text).map(Self).map_err(D::Error::custom)
    }
}

impl<'de> Deserialize<'de> for TimeOrOff {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        SaveInterval::parse(&text).map(Self).map_err(D::Error::custom)
    }
}

inline_schema!(Time, |_| {
    let pattern = "^(([0-9]+[smhd])+|[0-9]+(:[0-9]+){0,2}|[0-9]+-[0-9]+(:[0-9]+){0,2})$";
    json_schema!({ "type": "string", "pattern": pattern })
});

inline_schema!(
    TimeOrOff,
    |_| json_schema!({ "type": "string", "pattern": "^(off|([0-9]+[smhd])+)$" })
);
