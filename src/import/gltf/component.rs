//! Types of components: integers and floats, little-endian.

use super::json::Json;
use crate::error::Result;

/// The type of a component.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    /// The type that `componentType` of `json` names.
    ///
    /// Errors: a number that stands for none.
    pub fn of(json: &Json<'_>) -> Result<Self> {
        let code = json.required("componentType")?;
        Ok(match code.as_whole()? {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            other => return Err(code.fault(format!("{other} is no type of a component")).into()),
        })
    }

    /// Its bytes.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The component in the first of `bytes`, as many as its size, at least. Normalised integers are shares.
    #[inline(always)]
    pub fn float(self, bytes: &[u8], normalised: bool) -> f32 {
        let share =
            |value: f32, most: f32| if normalised { (value / most).max(-1.0) } else { value };
        match self {
            Self::I8 => share(f32::from(bytes[0] as i8), 127.0),
            Self::U8 => share(f32::from(bytes[0]), 255.0),
            Self::I16 => share(f32::from(i16::from_le_bytes([bytes[0], bytes[1]])), 32_767.0),
            Self::U16 => share(f32::from(u16::from_le_bytes([bytes[0], bytes[1]])), 65_535.0),
            Self::U32 => self.whole(bytes) as f32,
            Self::F32 => f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
        }
    }

    /// The component as a number that is not negative; of other types 0.
    #[inline(always)]
    pub fn whole(self, bytes: &[u8]) -> u32 {
        match self {
            Self::U8 => u32::from(bytes[0]),
            Self::U16 => u32::from(u16::from_le_bytes([bytes[0], bytes[1]])),
            Self::U32 => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
            Self::I8 | Self::I16 | Self::F32 => 0,
        }
    }
}
