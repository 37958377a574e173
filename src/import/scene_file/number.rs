//! Numbers that are in range by construction: one place for the range, its message and its
//! schema.
//!
//! A value out of range is refused while it is read, so the error points at the value itself.
//! All floats are finite. Lengths and coordinates stay within 1e30, so that squares of them do
//! not overflow and colours fit an f32.

use super::schema::inline_schema;
use crate::scene::limits;
use schemars::json_schema;
use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;

struct FloatVisitor {
    expected: &'static str,
    holds: fn(f64) -> bool,
}

impl Visitor<'_> for FloatVisitor {
    type Value = f64;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.expected)
    }

    fn visit_f64<E: Error>(self, x: f64) -> Result<f64, E> {
        if (self.holds)(x) {
            Ok(x)
        } else {
            Err(E::custom(format_args!("expected {}, found {x:?}", self.expected)))
        }
    }

    fn visit_i64<E: Error>(self, x: i64) -> Result<f64, E> {
        if (self.holds)(x as f64) {
            Ok(x as f64)
        } else {
            Err(E::custom(format_args!("expected {}, found {x}", self.expected)))
        }
    }
}

macro_rules! number {
    ($(#[$doc:meta])* $name:ident: $expected:literal, $holds:expr, $schema:tt) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Serialize)]
        #[serde(transparent)]
        pub(super) struct $name(pub f64);

        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let visitor = FloatVisitor { expected: $expected, holds: $holds };
                deserializer.deserialize_f64(visitor).map($name)
            }
        }

        inline_schema!($name, |_| json_schema!($schema));
    };
}

number!(
    /// A coordinate, world units.
    Coordinate: "a number from -1e30 to 1e30", |x| x.abs() <= 1e30,
    { "type": "number", "minimum": -1e30, "maximum": 1e30 }
);
number!(
    /// A length or factor.
    Positive: "a number from 1e-30 to 1e30", |x| limits::FACTOR.contains(&x),
    { "type": "number", "minimum": limits::FACTOR.start(), "maximum": limits::FACTOR.end() }
);
number!(
    /// A length that may be nothing.
    NotNegative: "a number from 0 to 1e30", |x| (0.0..=1e30).contains(&x),
    { "type": "number", "minimum": 0, "maximum": 1e30 }
);
number!(
    /// A moment of an animation, seconds.
    Moment: "a number of seconds from -1e6 to 1e6", |x| x.abs() <= 1e6,
    { "type": "number", "minimum": -1e6, "maximum": 1e6 }
);
number!(
    /// An amount of light in one channel.
    Amount: "a number from 0 to 1e30", |x| limits::AMOUNT.contains(&x),
    { "type": "number", "minimum": 0, "maximum": 1e30 }
);
number!(
    /// A share.
    Share: "a number from 0 to 1", |x| limits::SHARE.contains(&x),
    { "type": "number", "minimum": 0, "maximum": 1 }
);
number!(
    /// A difference in display steps of 1/255.
    Steps: "a number from 0 to 255", |x| limits::STEPS.contains(&x),
    { "type": "number", "minimum": 0, "maximum": 255 }
);
number!(
    /// Frames per second.
    FrameRate: "a number from 1 to 1000", |x| limits::FPS.contains(&x),
    { "type": "number", "minimum": limits::FPS.start(), "maximum": limits::FPS.end() }
);
number!(
    /// Any angle, degrees.
    Degrees: "an angle in degrees from -1e6 to 1e6", |x| x.abs() <= 1e6,
    { "type": "number", "minimum": -1e6, "maximum": 1e6 }
);
number!(
    /// A field of view, degrees.
    FieldOfView: "an angle in degrees above 0 and below 180", |x| x > 0.0 && x < 180.0,
    { "type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 180 }
);
number!(
    /// How far the picture lies off the view axis, as a share of its width or height.
    Shift: "a number from -1000 to 1000", |x| x.abs() <= 1e3,
    { "type": "number", "minimum": -1e3, "maximum": 1e3 }
);
number!(
    /// Width of a pixel over its height.
    PixelAspect: "a number from 0.001 to 1000", |x| (1e-3..=1e3).contains(&x),
    { "type": "number", "minimum": 1e-3, "maximum": 1e3 }
);
number!(
    /// An angle between faces, degrees.
    Crease: "an angle in degrees from 0 to 180", |x| (0.0..=180.0).contains(&x),
    { "type": "number", "minimum": 0, "maximum": 180 }
);
number!(
    /// The angle under which a sun is seen, degrees.
    SunAngle: "an angle in degrees from 0.02 to 90", |x| (0.02..=90.0).contains(&x),
    { "type": "number", "minimum": 0.02, "maximum": 90 }
);
number!(
    /// Mean cosine of a scattering angle.
    Anisotropy: "a number from -0.99 to 0.99", |x| (-0.99..=0.99).contains(&x),
    { "type": "number", "minimum": -0.99, "maximum": 0.99 }
);
number!(
    /// How hazy air is.
    Turbidity: "a turbidity from 1.7 to 10", |x| (1.7..=10.0).contains(&x),
    { "type": "number", "minimum": 1.7, "maximum": 10 }
);
number!(
    /// An index of refraction.
    Ior: "an index of refraction from 0.1 to 10", |x| (0.1..=10.0).contains(&x),
    { "type": "number", "minimum": 0.1, "maximum": 10 }
);
number!(
    /// A factor on coordinates; negative mirrors.
    Factor: "a number from 1e-30 to 1e30, or the negative of one",
    |x| (1e-30..=1e30).contains(&x.abs()),
    { "type": "number", "minimum": -1e30, "maximum": 1e30, "not": { "const": 0 } }
);

impl SunAngle {
    /// Half of it, radians.
    pub fn radius(self) -> f64 {
        0.5 * self.0.to_radians()
    }
}

/// A whole number from `MIN` to `MAX`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Int<const MIN: i64, const MAX: i64>(i64);

impl<const MIN: i64, const MAX: i64> Int<MIN, MAX> {
    /// `x`, if it is in range.
    pub fn new<E: Error>(x: i64) -> Result<Self, E> {
        Self(MIN).visit_i64(x)
    }

    /// `x`, or the nearest end of the range.
    pub fn clamped(x: i64) -> Self {
        Self(x.clamp(MIN, MAX))
    }

    /// As u32; saturates where `MAX` exceeds it.
    pub fn u32(self) -> u32 {
        u32::try_from(self.0.max(0)).unwrap_or(u32::MAX)
    }

    /// As u64.
    pub fn u64(self) -> u64 {
        self.0.unsigned_abs()
    }
}

impl<'de, const MIN: i64, const MAX: i64> Visitor<'de> for Int<MIN, MAX> {
    type Value = Self;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a whole number from {MIN} to {MAX}")
    }

    fn visit_i64<E: Error>(self, x: i64) -> Result<Self, E> {
        if (MIN..=MAX).contains(&x) {
            return Ok(Self(x));
        }
        Err(E::custom(format_args!("expected a whole number from {MIN} to {MAX}, found {x}")))
    }

    fn visit_u64<E: Error>(self, x: u64) -> Result<Self, E> {
        self.visit_i64(i64::try_from(x).unwrap_or(i64::MAX))
    }
}

impl<'de, const MIN: i64, const MAX: i64> Deserialize<'de> for Int<MIN, MAX> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_i64(Self(MIN))
    }
}

impl<const MIN: i64, const MAX: i64> Serialize for Int<MIN, MAX> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_i64(self.0)
    }
}

inline_schema!(for [const MIN: i64, const MAX: i64] Int<MIN, MAX>, |_| {
    json_schema!({ "type": "integer", "minimum": MIN, "maximum": MAX })
});
