//! Settings that are a choice: rules on or off, instruction set, bits.

use crate::import::scene_file::number::Int;
use crate::import::scene_file::schema::inline_schema;
use crate::scene::{HitRules, Recheck};
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

/// Instruction sets that Embree can be held to.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, JsonSchema)]
pub(super) enum Isa {
    /// SSE2.
    #[serde(rename = "sse2")]
    Sse2,
    /// SSE4.2.
    #[serde(rename = "sse4.2")]
    Sse42,
    /// AVX.
    #[serde(rename = "avx")]
    Avx,
    /// AVX2.
    #[serde(rename = "avx2")]
    Avx2,
    /// AVX-512.
    #[serde(rename = "avx512")]
    Avx512,
}

impl Isa {
    /// As Embree spells it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sse2 => "sse2",
            Self::Sse42 => "sse4.2",
            Self::Avx => "avx",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        }
    }
}

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
