//! Long arrays as the bytes that they are in memory, for `#[serde(with = "...")]`: a scene of millions
//! of triangles travels between processes at the speed of memory. No file holds such bytes, since
//! machines may differ in the order of theirs.

use bytemuck::Pod;
use serde::de::{Error, Visitor};
use serde::{Deserializer, Serializer};
use std::fmt;
use std::marker::PhantomData;

/// `values` as bytes.
///
/// # Errors
/// The serializer's.
pub fn serialize<T: Pod, S: Serializer>(
    values: &[T],
    serializer: S,
) -> std::result::Result<S::Ok, S::Error> {
    serializer.serialize_bytes(bytemuck::cast_slice(values))
}

/// Deserializes the bytes of [`serialize`].
///
/// # Errors
/// The deserializer's, and bytes that are no whole number of values.
pub fn deserialize<'de, T: Pod, D: Deserializer<'de>>(
    deserializer: D,
) -> std::result::Result<Vec<T>, D::Error> {
    deserializer.deserialize_bytes(Bytes(PhantomData))
}

struct Bytes<T>(PhantomData<T>);

impl<T: Pod> Visitor<'_> for Bytes<T> {
    type Value = Vec<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "values of {} bytes each", size_of::<T>())
    }

    fn visit_bytes<E: Error>(self, bytes: &[u8]) -> std::result::Result<Vec<T>, E> {
        if bytes.len() % size_of::<T>() != 0 {
            return Err(E::invalid_length(bytes.len(), &self));
        }
        let mut values = vec![T::zeroed(); bytes.len() / size_of::<T>()];
        bytemuck::cast_slice_mut(&mut values).copy_from_slice(bytes);
        Ok(values)
    }
}

/// The same for arrays that may be absent.
pub mod optional {
    use super::{Deserializer, Pod, Serializer};
    use serde::{Deserialize, Serialize};

    #[derive(Serialize, Deserialize)]
    #[serde(bound = "T: Pod")]
    struct Values<T>(#[serde(with = "super")] Vec<T>);

    #[derive(Serialize)]
    #[serde(bound = "T: Pod")]
    struct Borrowed<'a, T>(#[serde(serialize_with = "super::serialize")] &'a [T]);

    /// As [`super::serialize`].
    ///
    /// # Errors
    /// The serializer's.
    pub fn serialize<T: Pod, S: Serializer>(
        values: &Option<Vec<T>>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        values.as_deref().map(Borrowed).serialize(serializer)
    }

    /// As [`super::deserialize`].
    ///
    /// # Errors
    /// As [`super::deserialize`]'s.
    pub fn deserialize<'de, T: Pod, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Option<Vec<T>>, D::Error> {
        Ok(Option::<Values<T>>::deserialize(deserializer)?.map(|values| values.0))
    }
}

#[cfg(test)]
mod tests {
    use crate::math::Vec3;
    use serde::{Deserialize, Serialize};

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct Holder {
        #[serde(with = "super")]
        some: Vec<Vec3>,
        #[serde(with = "super::optional")]
        perhaps: Option<Vec<[u32; 3]>>,
        last: u8,
    }

    #[test]
    fn arrays_come_back_from_any_place_in_the_bytes() {
        for perhaps in [None, Some(vec![]), Some(vec![[1, 2, 3], [4, 5, u32::MAX]])] {
            let some = vec![Vec3::new(1.0, -0.0, f32::MIN_POSITIVE), Vec3::MAX];
            let whole = Holder { some, perhaps, last: 7 };
            let bytes = postcard::to_stdvec(&whole).expect("bytes");
            // At an odd address too.
            let shifted = [&[0][..], &bytes].concat();
            let back: Holder = postcard::from_bytes(&shifted[1..]).expect("whole");
            assert_eq!(back, whole);
            assert!(postcard::from_bytes::<Holder>(&bytes[..bytes.len() - 1]).is_err());
        }
        let odd = postcard::to_stdvec(&(7_u8, [0_u8; 7])).expect("bytes");
        assert!(postcard::from_bytes::<Holder>(&odd).is_err());
    }
}
