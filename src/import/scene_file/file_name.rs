//! Names of files, which are not empty: a folder would be read in their place.

use super::at::At;
use serde::Deserialize;
use serde::de::{Deserializer, Error};

/// The name of a file as a key of the scene file says it.
struct FileName(String);

impl<'de> Deserialize<'de> for FileName {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        checked(&String::deserialize(deserializer)?).map(Self)
    }
}

/// `name` itself.
///
/// Errors: an empty one.
pub(super) fn checked<E: Error>(name: &str) -> Result<String, E> {
    match name {
        "" => Err(E::custom("the name of the file is empty")),
        name => Ok(name.to_owned()),
    }
}

/// For `#[serde(deserialize_with)]` of a key that must be there.
pub(super) fn required<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    FileName::deserialize(deserializer).map(|name| name.0)
}

/// For `#[serde(deserialize_with)]` of a key that may be absent, whose place counts.
pub(super) fn placed<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<At<String>>, D::Error> {
    let At { value, span } = At::<FileName>::deserialize(deserializer)?;
    Ok(Some(At { value: value.0, span }))
}
