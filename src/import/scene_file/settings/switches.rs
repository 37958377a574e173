//! Settings that are a choice: instruction set, bits, AOVs.

use crate::import::scene_file::number::Int;
use crate::import::scene_file::schema::inline_schema;
use crate::scene::{Aovs, limits::ISAS};
use schemars::json_schema;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};

/// Bits a channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(transparent)]
pub(super) struct PngBits(pub u8);

/// An instruction set that Embree can be held to.
#[derive(Debug, Clone, Serialize)]
#[serde(transparent)]
pub(super) struct Isa(pub String);

/// The name of an AOV, or of all or none.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(transparent)]
pub(super) struct AovName(pub Aovs);

inline_schema!(AovName, |_| json_schema!({ "enum": Aovs::NAMES }));

impl<'de> Deserialize<'de> for Isa {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        match ISAS.contains(&name.as_str()) {
            true => Ok(Self(name)),
            false => Err(D::Error::unknown_variant(&name, &ISAS)),
        }
    }
}

inline_schema!(Isa, |_| json_schema!({ "enum": ISAS }));

impl<'de> Deserialize<'de> for PngBits {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        match Int::<0, 64>::deserialize(deserializer)?.u32() {
            8 => Ok(Self(8)),
            16 => Ok(Self(16)),
            bits => Err(D::Error::custom(format_args!("expected 8 or 16, found {bits}"))),
        }
    }
}

inline_schema!(PngBits, |_| json_schema!({ "enum": [8, 16] }));
