//! Camera samples of a pixel: one number, or the least and the most.

use crate::import::scene_file::number::Int;
use crate::import::scene_file::schema::inline_schema;
use crate::import::scene_file::vector::List;
use crate::scene::limits;
use schemars::json_schema;
use serde::de::value::SeqAccessDeserializer;
use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;

type Count = Int<1, { limits::MAX_SAMPLES as i64 }>;

/// `4`, or `[4, 16]`.
#[derive(Debug, Clone, Copy)]
pub(super) struct CameraSamples {
    pub least: u32,
    /// More than the least, if any.
    pub most: Option<u32>,
}

struct OneOrTwo;

impl<'de> Visitor<'de> for OneOrTwo {
    type Value = CameraSamples;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "a whole number from 1 to {}, or the least and the most, as in [4, 16]",
            limits::MAX_SAMPLES
        )
    }

    fn visit_i64<E: Error>(self, x: i64) -> Result<Self::Value, E> {
        let least = Count::new(x)?.u32();
        Ok(CameraSamples { least, most: None })
    }

    fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Self::Value, A::Error> {
        let List([least, most]) = List::<Count, 2>::deserialize(SeqAccessDeserializer::new(seq))?;
        let (least, most) = (least.u32(), most.u32());
        if least > most {
            return Err(A::Error::custom(format_args!(
                "expected the least and the most camera samples, found [{least}, {most}]"
            )));
        }
        Ok(CameraSamples { least, most: (most > least).then_some(most) })
    }
}

impl<'de> Deserialize<'de> for CameraSamples {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(OneOrTwo)
    }
}

impl Serialize for CameraSamples {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.most {
            None => serializer.serialize_u32(self.least),
            Some(most) => serializer.collect_seq([self.least, most]),
        }
    }
}

inline_schema!(CameraSamples, |generator| {
    let one = generator.subschema_for::<Count>();
    let two = generator.subschema_for::<List<Count, 2>>();
    json_schema!({ "anyOf": [one, two] })
});
