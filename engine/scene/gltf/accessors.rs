//! Typed reading of accessors: every layout checked against its view, every float checked to be finite.

use super::{
    buffers::Buffers,
    document::{Document, item},
    types::Accessor,
};
use crate::{Error, Result, scene::budget::Budget};

/// Component types (glTF 2.0, section 3.6.2.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(code: u32) -> Result<Self> {
        Ok(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return Err(Error::input(format!("componentType {code} is unknown"))),
        })
    }

    fn size(self) -> u64 {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The number at the start of `bytes`; integers of at most 16 bits are exact.
    fn float(self, bytes: &[u8], normalized: bool) -> f32 {
        let scaled = |value: f32, max: f32| if normalized { (value / max).max(-1.0) } else { value };
        match (self, bytes) {
            (Self::I8, &[a, ..]) => scaled(f32::from(a as i8), 127.0),
            (Self::U8, &[a, ..]) => scaled(f32::from(a), 255.0),
            (Self::I16, &[a, b, ..]) => scaled(f32::from(i16::from_le_bytes([a, b])), 32767.0),
            (Self::U16, &[a, b, ..]) => scaled(f32::from(u16::from_le_bytes([a, b])), 65535.0),
            (Self::U32, &[a, b, c, d, ..]) => u32::from_le_bytes([a, b, c, d]) as f32,
            (Self::F32, &[a, b, c, d, ..]) => f32::from_le_bytes([a, b, c, d]),
            _ => 0.0,
        }
    }

    /// The unsigned integer at the start of `bytes`.
    fn integer(self, bytes: &[u8]) -> u32 {
        match (self, bytes) {
            (Self::U8, &[a, ..]) => a.into(),
            (Self::U16, &[a, b, ..]) => u16::from_le_bytes([a, b]).into(),
            (Self::U32, &[a, b, c, d, ..]) => u32::from_le_bytes([a, b, c, d]),
            _ => 0,
        }
    }
}

/// Numbers in an element of type `kind`, and the bytes from one matrix column to the next.
fn shape(kind: &str, component: Component) -> Result<(usize, u64)> {
    let columns = |columns: u64, rows: u64| {
        // Columns of matrices begin at multiples of four bytes.
        let pitch = (rows * component.size()).next_multiple_of(4);
        ((columns * rows) as usize, pitch * (columns - 1) + rows * component.size())
    };
    Ok(match kind {
        "SCALAR" => (1, component.size()),
        "VEC2" => (2, 2 * component.size()),
        "VEC3" => (3, 3 * component.size()),
        "VEC4" => (4, 4 * component.size()),
        "MAT2" => columns(2, 2),
        "MAT3" => columns(3, 3),
        "MAT4" => columns(4, 4),
        _ => return Err(Error::input(format!("type {kind:?} is unknown"))),
    })
}

/// What a use of an accessor allows.
#[derive(Clone, Copy, Debug)]
pub struct Format {
    pub kinds: &'static [&'static str],
    pub components: &'static [Component],
}

use Component::{F32, I8, I16, U8, U16, U32};

impl Format {
    /// Positions; integers by KHR_mesh_quantization.
    pub const POINT: Self = Self { kinds: &["VEC3"], components: &[F32, I8, U8, I16, U16] };
    pub const DIRECTION: Self = Self { kinds: &["VEC3"], components: &[F32, I8, I16] };
    pub const TANGENT: Self = Self { kinds: &["VEC4"], components: &[F32, I8, I16] };
    pub const UV: Self = Self { kinds: &["VEC2"], components: &[F32, I8, U8, I16, U16] };
    pub const COLOR: Self = Self { kinds: &["VEC3", "VEC4"], components: &[F32, U8, U16] };
    pub const JOINTS: Self = Self { kinds: &["VEC4"], components: &[U8, U16] };
    pub const WEIGHTS: Self = Self { kinds: &["VEC4"], components: &[F32, U8, U16] };
    pub const INDICES: Self = Self { kinds: &["SCALAR"], components: &[U8, U16, U32] };
    pub const MATRIX: Self = Self { kinds: &["MAT4"], components: &[F32] };
    pub const TIME: Self = Self { kinds: &["SCALAR"], components: &[F32] };
    pub const KEY_VECTOR: Self = Self { kinds: &["VEC3"], components: &[F32] };
    pub const KEY_ROTATION: Self = Self { kinds: &["VEC4"], components: &[F32, I8, U8, I16, U16] };
    pub const KEY_WEIGHT: Self = Self { kinds: &["SCALAR"], components: &[F32, I8, U8, I16, U16] };
    /// Differences of morph targets may be signed where the base is not.
    pub const MORPH_COLOR: Self = Self { kinds: &["VEC3", "VEC4"], components: &[F32, I8, U8, I16, U16] };
}

/// Where the elements of an accessor lie.
#[derive(Debug)]
struct Layout<'a> {
    component: Component,
    width: usize,
    count: usize,
    stride: usize,
    /// From the first element on; `None`: all zero.
    bytes: Option<&'a [u8]>,
    sparse: Option<(Vec<u32>, &'a [u8])>,
    element: usize,
}

/// Reads accessors of a document.
#[derive(Debug)]
pub struct Accessors<'a> {
    pub document: &'a Document,
    pub buffers: &'a Buffers<'a>,
    pub budget: &'a Budget,
}

impl Accessors<'_> {
    /// Elements of an accessor, checked to exist.
    pub fn count(&self, index: u32) -> Result<u64> {
        Ok(item(&self.document.accessors, "accessors", index)?.count)
    }

    /// Checks what can be checked of every accessor, used or not, without reading its elements.
    pub fn check_all(&self) -> Result<()> {
        for (i, accessor) in self.document.accessors.iter().enumerate() {
            self.check(accessor).map_err(|error| error.at(format!("accessors[{i}]")))?;
        }
        Ok(())
    }

    fn check(&self, accessor: &Accessor) -> Result<()> {
        let component = Component::of(accessor.component_type)?;
        if accessor.count == 0 {
            return Err(Error::input("0 elements, at least 1 is needed").at("count"));
        }
        // Types may be added to the format; they matter only where they are used.
        let element = shape(&accessor.kind, component).map_or(0, |(_, element)| element);
        if let Some(index) = accessor.buffer_view {
            let view = item(&self.document.views, "bufferViews", index)?;
            let stride = view.byte_stride.unwrap_or(element);
            self.fits(index, accessor.byte_offset, accessor.count, stride, element)?;
        }
        if let Some(sparse) = &accessor.sparse {
            let check = || {
                if sparse.count == 0 || sparse.count > accessor.count {
                    return Err(Error::input(format!("{} of {} elements", sparse.count, accessor.count)).at("count"));
                }
                let index = Component::of(sparse.indices.component_type)?.size();
                self.fits(sparse.indices.buffer_view, sparse.indices.byte_offset, sparse.count, index, index)
                    .map_err(|error| error.at("indices"))?;
                self.fits(sparse.values.buffer_view, sparse.values.byte_offset, sparse.count, element, element)
                    .map_err(|error| error.at("values"))
            };
            check().map_err(|error| error.at("sparse"))?;
        }
        Ok(())
    }

    /// Checks that `count` elements lie inside a view.
    fn fits(&self, view: u32, offset: u64, count: u64, stride: u64, element: u64) -> Result<()> {
        let length = item(&self.document.views, "bufferViews", view)?.byte_length;
        if stride < element {
            return Err(Error::input(format!("{stride} bytes, elements have {element}"))
                .at(format!("bufferViews[{view}].byteStride")));
        }
        let end =
            count.checked_sub(1).and_then(|last| last.checked_mul(stride)?.checked_add(element)?.checked_add(offset));
        match end.filter(|&end| end <= length) {
            Some(_) => Ok(()),
            None => Err(Error::input(format!(
                "{count} elements of {stride} bytes from byte {offset} on do not fit into the {length} bytes of \
                 bufferViews[{view}]"
            ))),
        }
    }

    /// Rows of floats. Elements with fewer than `N` components are filled up with ones (colours without alpha).
    pub fn floats<const N: usize>(&self, index: u32, format: Format) -> Result<Vec<[f32; N]>> {
        let accessor = item(&self.document.accessors, "accessors", index)?;
        let read = || {
            let layout = self.layout(accessor, format)?;
            self.budget.take(accessor.count, 4 * N as u64)?;
            let size = layout.component.size() as usize;
            let mut out = Vec::with_capacity(layout.count);
            layout.each(|i, bytes| {
                let mut row = [1.0; N];
                for (j, value) in row.iter_mut().take(layout.width).enumerate() {
                    *value = layout.component.float(&bytes[(j * size).min(bytes.len())..], accessor.normalized);
                    if !value.is_finite() {
                        return Err(Error::input(format!("element {i} is {value}, which is not finite")));
                    }
                }
                out.push(row);
                Ok(())
            })?;
            Ok(out)
        };
        read().map_err(|error: Error| error.at(format!("accessors[{index}]")))
    }

    /// Rows of unsigned integers, with the number that would be a primitive restart.
    pub fn integers<const N: usize>(&self, index: u32, format: Format) -> Result<(Vec<[u32; N]>, u32)> {
        let accessor = item(&self.document.accessors, "accessors", index)?;
        let read = || {
            let layout = self.layout(accessor, format)?;
            self.budget.take(accessor.count, 4 * N as u64)?;
            let size = layout.component.size() as usize;
            let mut out = Vec::with_capacity(layout.count);
            layout.each(|_, bytes| {
                out.push(std::array::from_fn(|j| layout.component.integer(&bytes[(j * size).min(bytes.len())..])));
                Ok(())
            })?;
            let restart = match layout.component {
                U8 | I8 => u8::MAX.into(),
                U16 | I16 => u16::MAX.into(),
                U32 | F32 => u32::MAX,
            };
            Ok((out, restart))
        };
        read().map_err(|error: Error| error.at(format!("accessors[{index}]")))
    }

    fn layout(&self, accessor: &Accessor, format: Format) -> Result<Layout<'_>> {
        let component = Component::of(accessor.component_type)?;
        let (width, element) = shape(&accessor.kind, component)?;
        if !format.kinds.contains(&accessor.kind.as_str()) || !format.components.contains(&component) {
            return Err(Error::input(format!(
                "{} of {component:?} cannot be used here, only {} of {:?}",
                accessor.kind,
                format.kinds.join(" or "),
                format.components
            )));
        }
        // Before anything is allocated: what the scene may take at all.
        self.budget.could_take(accessor.count, 4).map_err(|error| error.at("count"))?;
        self.check(accessor)?;
        let count = accessor.count as usize;
        let mut stride = element;
        let bytes = match accessor.buffer_view {
            None => None,
            Some(index) => {
                stride = item(&self.document.views, "bufferViews", index)?.byte_stride.unwrap_or(element);
                // The view has the length that it says, so that what was checked against that holds.
                Some(&self.buffers.view(index)?[accessor.byte_offset as usize..])
            }
        };
        let sparse = self.sparse(accessor, element).map_err(|error| error.at("sparse"))?;
        Ok(Layout { component, width, count, stride: stride as usize, bytes, sparse, element: element as usize })
    }

    /// Indices that replace elements, and the bytes that replace them.
    fn sparse(&self, accessor: &Accessor, element: u64) -> Result<Option<(Vec<u32>, &[u8])>> {
        let Some(sparse) = &accessor.sparse else { return Ok(None) };
        let count = sparse.count;
        let range = |view: u32, offset: u64, size: u64, place: &str| {
            let bytes = self.buffers.view(view).map_err(|error| error.at(place))?;
            Ok::<_, Error>(&bytes[offset as usize..(offset + count * size) as usize])
        };
        let component = Component::of(sparse.indices.component_type).map_err(|error| error.at("indices"))?;
        if !matches!(component, U8 | U16 | U32) {
            return Err(Error::input(format!("{component:?} cannot be an index")).at("indices"));
        }
        let bytes = range(sparse.indices.buffer_view, sparse.indices.byte_offset, component.size(), "indices")?;
        let values = range(sparse.values.buffer_view, sparse.values.byte_offset, element, "values")?;
        self.budget.take(count, 4)?;
        let mut indices: Vec<u32> = Vec::with_capacity(count as usize);
        for chunk in bytes.chunks_exact(component.size() as usize) {
            let index = component.integer(chunk);
            if u64::from(index) >= accessor.count || indices.last().is_some_and(|&last| index <= last) {
                return Err(Error::input(format!(
                    "index {index} (at {}) must be larger than the one before and below {}",
                    indices.len(),
                    accessor.count
                ))
                .at("indices"));
            }
            indices.push(index);
        }
        Ok(Some((indices, values)))
    }
}

impl Layout<'_> {
    /// Calls `element` with the number and the bytes of each element in turn.
    fn each(&self, mut element: impl FnMut(usize, &[u8]) -> Result<()>) -> Result<()> {
        // The longest element, a 4×4 matrix of floats.
        let zeros = [0; 64];
        let mut replaced = self.sparse.iter().flat_map(|(indices, values)| {
            indices.iter().map(|&index| index as usize).zip(values.chunks_exact(self.element))
        });
        let mut next = replaced.next();
        for i in 0..self.count {
            let bytes = match (next, self.bytes) {
                (Some((index, value)), _) if index == i => {
                    next = replaced.next();
                    value
                }
                (_, Some(bytes)) => &bytes[i * self.stride..i * self.stride + self.element],
                (_, None) => &zeros[..self.element],
            };
            element(i, bytes)?;
        }
        Ok(())
    }
}
