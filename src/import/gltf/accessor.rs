//! Accessors: arrays of numbers in buffers, with strides, normalised integers and sparse changes.
//!
//! An accessor is hostile until it is opened: offsets, strides and counts are held against the bytes that are there before
//! memory is taken.

use super::component::Component;
use super::document::Document;
use super::json::Json;
use crate::error::{Error, Result};
use crate::math::DVec3;
use rayon::prelude::*;

/// Bytes of the largest element.
const MOST_SIZE: usize = 16 * 4;

/// An opened accessor: all of its elements are there.
pub(super) struct Accessor<'d> {
    json: Json<'d>,
    /// Elements.
    pub count: usize,
    /// Components of an element.
    pub width: usize,
    component: Component,
    normalised: bool,
    /// Elements as they lie; without any, all are zero.
    dense: Option<Elements<'d>>,
    sparse: Option<Sparse<'d>>,
}

/// Elements in a buffer view.
#[derive(Clone, Copy)]
struct Elements<'d> {
    bytes: &'d [u8],
    stride: usize,
    size: usize,
}

/// Elements that take the place of others.
struct Sparse<'d> {
    indices: Elements<'d>,
    index: Component,
    values: Elements<'d>,
    count: usize,
}

impl<'d> Elements<'d> {
    /// `count` elements of `size` bytes in the view that `json` names, from its `byteOffset` on; `None` without a view.
    ///
    /// Errors: elements that go beyond the view, or overlap.
    fn of(
        document: &'d Document<'_>,
        json: &Json<'_>,
        count: usize,
        size: usize,
    ) -> Result<Option<Self>> {
        let Some((view, stride)) = document.view(json, "bufferView")? else { return Ok(None) };
        let offset = json.whole("byteOffset")?.unwrap_or(0);
        let stride = stride.filter(|stride| *stride != 0).unwrap_or(size);
        if stride < size {
            let message = format!("elements of {size} bytes that lie {stride} bytes apart");
            return Err(json.fault(message).into());
        }
        // The last element need not be as long as the stride.
        let span = (count.max(1) - 1).checked_mul(stride).and_then(|all| all.checked_add(size));
        let span = if count == 0 { Some(0) } else { span };
        let bytes = view.get(offset..).and_then(|rest| rest.get(..span?));
        let Some(bytes) = bytes else {
            let has = view.len();
            let message = format!(
                "{count} elements of {size} bytes, {stride} bytes apart from byte {offset} on, do not fit into a buffer view of {has} bytes"
            );
            return Err(json.fault(message).into());
        };
        Ok(Some(Self { bytes, stride, size }))
    }

    /// Element number `at`, which is there.
    #[inline(always)]
    fn get(&self, at: usize) -> &'d [u8] {
        &self.bytes[at * self.stride..][..self.size]
    }
}

impl<'d> Accessor<'d> {
    /// The accessor whose number is `index`.
    ///
    /// Errors: types that glTF does not have, elements that are not there.
    pub fn open(document: &'d Document<'d>, index: &Json<'_>) -> Result<Self> {
        let at = index.as_index(document.accessors.len(), "accessor")?;
        let json = document.accessors[at].clone();
        let component = Component::of(&json)?;
        let kind = json.required("type")?;
        let width = match kind.as_text()? {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            // Columns of its smallest components need no padding.
            "MAT4" => 16,
            _ => return Err(kind.fault("expected SCALAR, VEC2, VEC3, VEC4 or MAT4").into()),
        };
        let count = json.required("count")?.as_whole()?;
        if count > document.bytes() {
            let has = document.bytes();
            let message = format!("{count} elements; the file's buffers have {has} bytes together");
            return Err(json.fault(message).into());
        }
        let size = width * component.size();
        let dense = Elements::of(document, &json, count, size)?;
        let sparse = Sparse::of(document, &json, count, size)?;
        let normalised = json.truth("normalized")?.unwrap_or(false);
        Ok(Self { json, count, width, component, normalised, dense, sparse })
    }

    /// A message about this accessor.
    pub fn fault(&self, message: impl AsRef<str>) -> crate::error::Diagnostic {
        self.json.fault(message)
    }

    /// Its elements, of `N` components each, as they stand; numbers may be not finite.
    ///
    /// Errors: elements of another width.
    pub fn floats<const N: usize>(&self) -> Result<Vec<[f32; N]>> {
        self.converted(|element| element)
    }

    /// What `make` makes of its elements, of `N` components each; numbers may be not finite.
    ///
    /// Errors: elements of another width.
    fn converted<const N: usize, T: Copy + Send>(
        &self,
        make: impl Fn([f32; N]) -> T + Sync + Send,
    ) -> Result<Vec<T>> {
        self.check_width(N)?;
        let (component, normalised) = (self.component, self.normalised);
        // Each type has a loop of its own.
        macro_rules! all {
            ($component:path) => {
                self.read(|bytes| {
                    make(std::array::from_fn(|k| {
                        $component.float(&bytes[k * $component.size()..], normalised)
                    }))
                })
            };
        }
        match component {
            Component::I8 => all!(Component::I8),
            Component::U8 => all!(Component::U8),
            Component::I16 => all!(Component::I16),
            Component::U16 => all!(Component::U16),
            Component::U32 => all!(Component::U32),
            Component::F32 => all!(Component::F32),
        }
    }

    /// As [`floats`](Self::floats), of finite numbers.
    ///
    /// Errors: a number that is not finite.
    pub fn finite<const N: usize>(&self) -> Result<Vec<[f32; N]>> {
        let floats = self.floats::<N>()?;
        let is_good = |element: &[f32; N]| element.iter().all(|x| x.is_finite());
        match floats.par_iter().all(is_good) {
            true => Ok(floats),
            false => Err(self.not_finite(floats.iter().position(|element| !is_good(element)))),
        }
    }

    /// Its elements as finite vectors.
    ///
    /// Errors: as [`finite`](Self::finite).
    pub fn vectors(&self) -> Result<Vec<DVec3>> {
        let vectors = self.converted(|v: [f32; 3]| DVec3::from_array(v.map(f64::from)))?;
        match vectors.par_iter().all(|v| v.is_finite()) {
            true => Ok(vectors),
            false => Err(self.not_finite(vectors.iter().position(|v| !v.is_finite()))),
        }
    }

    fn not_finite(&self, at: Option<usize>) -> Error {
        let at = at.unwrap_or_default();
        self.fault(format!("element {at} (from 0) is not a finite number")).into()
    }

    /// Its numbers one by one, finite; any width.
    pub fn scalars(&self) -> Result<Vec<f32>> {
        Ok(match self.width {
            1 => self.finite::<1>()?.into_flattened(),
            2 => self.finite::<2>()?.into_flattened(),
            3 => self.finite::<3>()?.into_flattened(),
            4 => self.finite::<4>()?.into_flattened(),
            _ => self.finite::<16>()?.into_flattened(),
        })
    }

    /// Its elements as whole numbers that are not negative, of `N` components each.
    ///
    /// Errors: another width, fractions and signed numbers.
    pub fn wholes<const N: usize>(&self) -> Result<Vec<[u32; N]>> {
        self.check_width(N)?;
        self.check_whole()?;
        let component = self.component;
        self.read(move |bytes| {
            std::array::from_fn(|k| component.whole(&bytes[k * component.size()..]))
        })
    }

    /// Triples of its whole numbers, of one component each; what is left over at the end is dropped.
    ///
    /// Errors: as [`wholes`](Self::wholes).
    pub fn triples(&self) -> Result<Vec<[u32; 3]>> {
        let dense = self.dense.filter(|all| all.stride == all.size && self.sparse.is_none());
        let (Some(elements), 1) = (dense, self.width) else {
            let all = self.wholes::<1>()?.into_flattened();
            return Ok(all.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect());
        };
        self.check_whole()?;
        macro_rules! all {
            ($component:path) => {{
                let size = $component.size();
                let triple =
                    |bytes: &[u8]| std::array::from_fn(|k| $component.whole(&bytes[k * size..]));
                elements.bytes.par_chunks_exact(3 * size).map(triple).collect()
            }};
        }
        Ok(match self.component {
            Component::U8 => all!(Component::U8),
            Component::U16 => all!(Component::U16),
            _ => all!(Component::U32),
        })
    }

    fn check_width(&self, wanted: usize) -> Result<()> {
        match self.width {
            width if width == wanted => Ok(()),
            width => Err(self
                .fault(format!("elements of {width} components where {wanted} are needed"))
                .into()),
        }
    }

    fn check_whole(&self) -> Result<()> {
        match self.component {
            Component::U8 | Component::U16 | Component::U32 => Ok(()),
            _ => Err(self
                .fault("numbers that may be negative or fractions, where indices are needed")
                .into()),
        }
    }

    fn read<T: Copy + Send>(&self, of: impl Fn(&[u8]) -> T + Sync + Send) -> Result<Vec<T>> {
        let of = &of;
        let mut all: Vec<T> = match &self.dense {
            Some(elements) if elements.stride == elements.size => {
                let packed = &elements.bytes[..self.count * elements.size];
                packed.par_chunks_exact(elements.size).map(of).collect()
            }
            Some(elements) => {
                (0..self.count).into_par_iter().map(|at| of(elements.get(at))).collect()
            }
            // The bytes of the number zero, of every type.
            None => vec![of(&[0; MOST_SIZE]); self.count],
        };
        if let Some(sparse) = &self.sparse {
            for change in 0..sparse.count {
                let at = sparse.index.whole(sparse.indices.get(change)) as usize;
                let Some(element) = all.get_mut(at) else {
                    let count = self.count;
                    let message = format!("the sparse index {at} is beyond the {count} elements");
                    return Err(self.fault(message).into());
                };
                *element = of(sparse.values.get(change));
            }
        }
        Ok(all)
    }
}

impl<'d> Sparse<'d> {
    fn of(
        document: &'d Document<'_>,
        accessor: &Json<'_>,
        most: usize,
        size: usize,
    ) -> Result<Option<Self>> {
        let Some(json) = accessor.get("sparse") else { return Ok(None) };
        let count = json.required("count")?.as_whole()?;
        if count > most {
            let message = format!("{count} changed elements of {most}");
            return Err(json.fault(message).into());
        }
        let (indices, values) = (json.required("indices")?, json.required("values")?);
        let index = Component::of(&indices)?;
        if !matches!(index, Component::U8 | Component::U16 | Component::U32) {
            return Err(indices
                .fault("sparse indices are whole numbers that are not negative")
                .into());
        }
        let no_view = |json: &Json<'_>| json.fault("`bufferView` is missing");
        let of = |json: &Json<'_>, size| -> Result<Elements<'d>> {
            Elements::of(document, json, count, size)?.ok_or_else(|| no_view(json).into())
        };
        let (at, changed) = (of(&indices, index.size())?, of(&values, size)?);
        Ok(Some(Self { indices: at, index, values: changed, count }))
    }
}
