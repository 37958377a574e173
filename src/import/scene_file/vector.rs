//! Points, directions, colours: short arrays of checked numbers.

use super::number::{Amount, Coordinate, Factor, Positive, Share};
use super::schema::inline_schema;
use crate::math::{DVec3, Rgb};
use schemars::{JsonSchema, json_schema};
use serde::de::value::{F64Deserializer, I64Deserializer, SeqAccessDeserializer};
use serde::de::{Error, IntoDeserializer, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::marker::PhantomData;

/// Exactly `N` values of type `T`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct List<T, const N: usize>(pub [T; N]);

/// A point or displacement `[x, y, z]`, world units.
pub(super) type Point = List<Coordinate, 3>;

impl Point {
    /// As a vector.
    pub fn vec(&self) -> DVec3 {
        DVec3::from_array(self.0.map(|c| c.0))
    }
}

struct ListVisitor<T, const N: usize>(PhantomData<T>);

impl<'de, T: Deserialize<'de>, const N: usize> Visitor<'de> for ListVisitor<T, N> {
    type Value = List<T, N>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "an array of {N} values")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
        let mut values = Vec::with_capacity(N);
        while let Some(value) = seq.next_element()? {
            values.push(value);
        }
        let wrong = |v: Vec<T>| {
            A::Error::custom(format_args!("expected an array of {N} values, found {}", v.len()))
        };
        values.try_into().map(List).map_err(wrong)
    }
}

impl<'de, T: Deserialize<'de>, const N: usize> Deserialize<'de> for List<T, N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(ListVisitor(PhantomData))
    }
}

impl<T: Serialize, const N: usize> Serialize for List<T, N> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(&self.0)
    }
}

inline_schema!(for [T: JsonSchema, const N: usize] List<T, N>, |generator| {
    let items = generator.subschema_for::<T>();
    json_schema!({ "type": "array", "items": items, "minItems": N, "maxItems": N })
});

/// One value for all `N`, or an array of `N`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct OneOr<T, const N: usize>(pub [T; N]);

/// Radiance, intensity, irradiance: linear RGB, or one number for grey.
pub(super) type Light = OneOr<Amount, 3>;
/// Reflectance or transmittance: linear RGB, or one number for grey.
pub(super) type Reflectance = OneOr<Share, 3>;
/// Scale factors along x, y, z, or one for all.
pub(super) type Scale = OneOr<Factor, 3>;

impl Default for Light {
    fn default() -> Self {
        Self([Amount(0.0); 3])
    }
}

impl Light {
    /// As a colour.
    pub fn rgb(&self) -> Rgb {
        Rgb::from_array(self.0.map(|c| c.0 as f32))
    }
}

impl Reflectance {
    /// All of the light.
    pub fn white() -> Self {
        Self::grey(1.0)
    }

    /// The same share of each colour.
    pub fn grey(share: f64) -> Self {
        Self([Share(share); 3])
    }

    /// As a colour.
    pub fn rgb(&self) -> Rgb {
        Rgb::from_array(self.0.map(|c| c.0 as f32))
    }
}

struct OneOrVisitor<T, const N: usize>(PhantomData<T>);

impl<'de, T: Deserialize<'de> + Copy, const N: usize> Visitor<'de> for OneOrVisitor<T, N> {
    type Value = OneOr<T, N>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a number or an array of {N} numbers")
    }

    fn visit_f64<E: Error>(self, x: f64) -> Result<Self::Value, E> {
        let number: F64Deserializer<E> = x.into_deserializer();
        T::deserialize(number).map(|v| OneOr([v; N]))
    }

    fn visit_i64<E: Error>(self, x: i64) -> Result<Self::Value, E> {
        let number: I64Deserializer<E> = x.into_deserializer();
        T::deserialize(number).map(|v| OneOr([v; N]))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Self::Value, A::Error> {
        List::<T, N>::deserialize(SeqAccessDeserializer::new(seq)).map(|list| OneOr(list.0))
    }
}

impl<'de, T: Deserialize<'de> + Copy, const N: usize> Deserialize<'de> for OneOr<T, N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(OneOrVisitor(PhantomData))
    }
}

impl<T: Serialize + PartialEq, const N: usize> Serialize for OneOr<T, N> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match &self.0[..] {
            [first, others @ ..] if others.iter().all(|other| other == first) => {
                first.serialize(serializer)
            }
            all => serializer.collect_seq(all),
        }
    }
}

inline_schema!(for [T: JsonSchema, const N: usize] OneOr<T, N>, |generator| {
    let one = generator.subschema_for::<T>();
    let all = generator.subschema_for::<List<T, N>>();
    json_schema!({ "anyOf": [one, all] })
});

/// A direction: any vector but zero, or the name of an axis; `"-y"` points down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Direction(pub DVec3);

const AXES: [(&str, DVec3); 6] = [
    ("x", DVec3::X),
    ("y", DVec3::Y),
    ("z", DVec3::Z),
    ("-x", DVec3::NEG_X),
    ("-y", DVec3::NEG_Y),
    ("-z", DVec3::NEG_Z),
];
const AXIS_NAMES: [&str; 6] = ["x", "y", "z", "-x", "-y", "-z"];

impl Direction {
    /// As a unit vector; the largest component is taken out first, so that no square of it
    /// overflows or vanishes.
    pub fn unit(&self) -> DVec3 {
        (self.0 / self.0.abs().max_element()).normalize()
    }
}

struct DirectionVisitor;

impl<'de> Visitor<'de> for DirectionVisitor {
    type Value = Direction;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a direction: an array of 3 numbers, or an axis such as \"y\" or \"-y\"")
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<Direction, E> {
        let axis = AXES.iter().find(|(axis, _)| *axis == name);
        axis.map(|(_, v)| Direction(*v)).ok_or_else(|| E::unknown_variant(name, &AXIS_NAMES))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Direction, A::Error> {
        let vec = Point::deserialize(SeqAccessDeserializer::new(seq))?.vec();
        if vec == DVec3::ZERO {
            return Err(A::Error::custom("a direction cannot be [0, 0, 0]"));
        }
        Ok(Direction(vec))
    }
}

impl<'de> Deserialize<'de> for Direction {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(DirectionVisitor)
    }
}

impl Serialize for Direction {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match AXES.iter().find(|(_, v)| *v == self.0) {
            Some((name, _)) => serializer.serialize_str(name),
            None => serializer.collect_seq(self.0.to_array()),
        }
    }
}

inline_schema!(Direction, |generator| {
    let vector = generator.subschema_for::<Point>();
    json_schema!({ "anyOf": [vector, { "enum": AXIS_NAMES }] })
});

/// Width and height, world units.
pub(super) type Size2 = List<Positive, 2>;
