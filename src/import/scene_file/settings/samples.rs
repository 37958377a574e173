//! Numbers of samples: one number, or the least and the most.

use crate::import::scene_file::number::Int;
use crate::import::scene_file::schema::inline_schema;
use crate::import::scene_file::vector::List;
use crate::scene::limits;
use schemars::json_schema;
use serde::de::value::SeqAccessDeserializer;
use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;

const MAX: i64 = limits::MAX_SAMPLES as i64;
/// The end of a range.
type Count = Int<1, MAX>;

/// `4`, from `FEWEST` on, or `[4, 16]`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Samples<const FEWEST: i64> {
    pub least: u32,
    /// More than the least, if any.
    pub most: Option<u32>,
}

impl<const FEWEST: i64> Samples<FEWEST> {
    /// From the number that settings have for a light, which is the most, and the least, if any.
    pub fn of_light(all: u32, least: Option<u32>) -> Self {
        let most = least.map(|_| all);
        Self { least: least.unwrap_or(all), most }
    }

    /// The opposite of [`of_light`](Self::of_light).
    pub fn to_light(self) -> (u32, Option<u32>) {
        (self.most.unwrap_or(self.least), self.most.map(|_| self.least))
    }
}

struct OneOrTwo<const FEWEST: i64>;

impl<'de, const FEWEST: i64> Visitor<'de> for OneOrTwo<FEWEST> {
    type Value = Samples<FEWEST>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a whole number from {FEWEST} to {MAX}, or the least and the most, as in [4, 16]")
    }

    fn visit_i64<E: Error>(self, x: i64) -> Result<Self::Value, E> {
        let least = Int::<FEWEST, MAX>::new(x)?.u32();
        Ok(Samples { least, most: None })
    }

    fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Self::Value, A::Error> {
        let List([least, most]) = List::<Count, 2>::deserialize(SeqAccessDeserializer::new(seq))?;
        let (least, most) = (least.u32(), most.u32());
        if least > most {
            return Err(A::Error::custom(format_args!(
                "expected the least and the most samples, found [{least}, {most}]"
            )));
        }
        Ok(Samples { least, most: (most > least).then_some(most) })
    }
}

impl<'de, const FEWEST: i64> Deserialize<'de> for Samples<FEWEST> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(OneOrTwo::<FEWEST>)
    }
}

impl<const FEWEST: i64> Serialize for Samples<FEWEST> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.most {
            None => serializer.serialize_u32(self.least),
            Some(most) => serializer.collect_seq([self.least, most]),
        }
    }
}

inline_schema!(for [const FEWEST: i64] Samples<FEWEST>, |generator| {
    let one = generator.subschema_for::<Int<FEWEST, MAX>>();
    let two = generator.subschema_for::<List<Count, 2>>();
    json_schema!({ "anyOf": [one, two] })
});
