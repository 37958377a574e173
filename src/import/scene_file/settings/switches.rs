//! Settings that are a choice: rules on or off, instruction set, bits, AOVs.

use crate::import::scene_file::number::Int;
use crate::import::scene_file::schema::inline_schema;
use crate::scene::{Aovs, HitRules, Recheck, limits::ISAS};
use schemars::{JsonSchema, json_schema};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};

/// The rules that make hits trustworthy: each can be switched off to see what it is worth.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub(super) struct Rules {
    /// Watertight traversal of Embree.
    pub robust: bool,
    /// A second try for a camera or specular ray that misses near a triangle, or hits a back from
    /// outside.
    pub retry: bool,
    /// Which hits are recomputed in f64 at once: "risky" (grazing, slivers, near an edge; the others
    /// when shaded), "always", "off".
    pub recheck: Recheck,
    /// Start secondary rays outside the rounding error of their hit.
    pub spawn_offset: bool,
    /// Trace the scene about its own centre at unit size.
    pub recentre: bool,
}

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

impl Default for Rules {
    fn default() -> Self {
        let HitRules { robust, retry, recheck, spawn_offset, recentre } = HitRules::default();
        Self { robust, retry, recheck, spawn_offset, recentre }
    }
}
