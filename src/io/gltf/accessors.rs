//! Numbers of a glTF buffer: accessors of any component type, sparse ones too.

use super::container::{Buffers, View};
use super::document::{Accessor, Document};
use super::fault::Fault;

/// Largest number of items that are 0 since the file has no data of them. Plain choice.
const MOST_WITHOUT_DATA: usize = 1 << 20;

/// The items of an accessor. Nothing is allocated for items that the file only announces.
pub(super) struct Values<'a> {
    /// None if all are zero.
    view: Option<View<'a>>,
    offset: usize,
    stride: usize,
    component: Component,
    components: usize,
    normalized: bool,
    count: usize,
    /// Indices of items that differ, ascending, each with its place in `replacements`.
    replaced: Vec<(usize, usize)>,
    replacements: &'a [u8],
}

#[derive(Clone, Copy, PartialEq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(number: u32) -> Result<Component, Fault> {
        Ok(match number {
            5120 => Component::I8,
            5121 => Component::U8,
            5122 => Component::I16,
            5123 => Component::U16,
            5125 => Component::U32,
            5126 => Component::F32,
            other => {
                let found = format!("component type {other}");
                return Err(Fault::new(found, "must be 5120 to 5123, 5125 or 5126"));
            }
        })
    }

    fn bytes(self) -> usize {
        match self {
            Component::I8 | Component::U8 => 1,
            Component::I16 | Component::U16 => 2,
            Component::U32 | Component::F32 => 4,
        }
    }

    /// The number at the start of `bytes`, of which there are enough.
    fn number(self, bytes: &[u8]) -> f64 {
        match self {
            Component::I8 => f64::from(bytes[0] as i8),
            Component::U8 => f64::from(bytes[0]),
            Component::I16 => f64::from(i16::from_le_bytes([bytes[0], bytes[1]])),
            Component::U16 => f64::from(u16::from_le_bytes([bytes[0], bytes[1]])),
            Component::U32 => f64::from(u32::from_le_bytes(first_four(bytes))),
            Component::F32 => f64::from(f32::from_le_bytes(first_four(bytes))),
        }
    }

    /// The number that stands for 1 where integers are normalised.
    fn one(self) -> f64 {
        match self {
            Component::I8 => 127.0,
            Component::U8 => 255.0,
            Component::I16 => 32767.0,
            Component::U16 => 65535.0,
            Component::U32 => f64::from(u32::MAX),
            Component::F32 => 1.0,
        }
    }
}

fn first_four(bytes: &[u8]) -> [u8; 4] {
    [bytes[0], bytes[1], bytes[2], bytes[3]]
}

impl<'a> Values<'a> {
    /// The accessor `k`, checked against the buffers.
    pub fn new(
        document: &Document,
        buffers: &'a Buffers<'_>,
        k: usize,
    ) -> Result<Values<'a>, Fault> {
        let count = document.accessors.len();
        let accessor =
            document.accessors.get(k).ok_or_else(|| Fault::index("accessor", k, count))?;
        let component = Component::of(accessor.component_type)?;
        let components = components(&accessor.kind)?;
        let size = components * component.bytes();
        let view = accessor.buffer_view.map(|view| buffers.view(view)).transpose()?;
        let stride = view.and_then(|view| view.stride).unwrap_or(size);
        if let Some(view) = view {
            let last = accessor.count.saturating_sub(1).checked_mul(stride);
            let end =
                last.and_then(|last| last.checked_add(accessor.byte_offset)?.checked_add(size));
            if accessor.count > 0 && end.is_none_or(|end| end > view.bytes.len()) {
                let found = format!(
                    "accessor {k} announces {} items of {stride} bytes from byte {} on, and its \
                     buffer view has {} bytes",
                    accessor.count,
                    accessor.byte_offset,
                    view.bytes.len()
                );
                return Err(Fault::new(found, "give the whole buffer"));
            }
        }
        if view.is_none() && accessor.count > MOST_WITHOUT_DATA {
            let found = format!("accessor {k} announces {} items without data", accessor.count);
            return Err(Fault::new(found, "give their buffer view"));
        }
        let mut values = Values {
            view,
            offset: accessor.byte_offset,
            stride,
            component,
            components,
            normalized: accessor.normalized,
            count: accessor.count,
            replaced: vec![],
            replacements: &[],
        };
        values.read_sparse(k, accessor, buffers)?;
        Ok(values)
    }

    fn read_sparse(
        &mut self,
        k: usize,
        accessor: &Accessor,
        buffers: &'a Buffers<'_>,
    ) -> Result<(), Fault> {
        let Some(sparse) = &accessor.sparse else { return Ok(()) };
        let size = self.components * self.component.bytes();
        let part = |view: usize, offset: usize, size: usize| {
            let bytes = buffers.view(view)?.bytes;
            let end = sparse.count.checked_mul(size).and_then(|length| length.checked_add(offset));
            end.and_then(|end| bytes.get(offset..end)).ok_or_else(|| {
                let found = format!("sparse accessor {k} announces {} items", sparse.count);
                Fault::new(found + ", more than its buffer views have", "give the whole buffer")
            })
        };
        let index = Component::of(sparse.indices.component_type)?;
        let indices = part(sparse.indices.buffer_view, sparse.indices.byte_offset, index.bytes())?;
        self.replacements = part(sparse.values.buffer_view, sparse.values.byte_offset, size)?;
        let places = indices.chunks_exact(index.bytes()).map(|bytes| index.number(bytes) as usize);
        self.replaced = places.zip(0..).collect();
        self.replaced.sort_unstable();
        Ok(())
    }

    pub fn count(&self) -> usize {
        self.count
    }

    /// Whether all items are equal, since the file has no data of them.
    pub fn is_without_data(&self) -> bool {
        self.view.is_none() && self.replaced.is_empty()
    }

    /// Whether items have at least this many components.
    pub fn has_components(&self, least: usize) -> bool {
        self.components >= least
    }

    fn bytes(&self, item: usize) -> Option<&[u8]> {
        let size = self.item_bytes();
        let at = self.replaced.partition_point(|&(index, _)| index < item);
        match (self.replaced.get(at), self.view) {
            (Some(&(index, place)), _) if index == item => {
                self.replacements.get(place * size..(place + 1) * size)
            }
            (_, Some(view)) => {
                let start = item.checked_mul(self.stride)?.checked_add(self.offset)?;
                view.bytes.get(start..start.checked_add(size)?)
            }
            _ => None,
        }
    }

    /// Bytes of an item.
    pub fn item_bytes(&self) -> usize {
        self.components * self.component.bytes()
    }

    /// The bytes of item `item`: zeros where it has none.
    #[cfg(feature = "light-map")]
    pub fn raw(&self, item: usize) -> Vec<u8> {
        self.bytes(item).map_or_else(|| vec![0; self.item_bytes()], <[u8]>::to_vec)
    }

    /// Item `item` as the numbers that the file has, without normalisation.
    #[cfg(feature = "light-map")]
    pub fn raw_numbers<const N: usize>(&self, item: usize) -> [f64; N] {
        self.scaled(item, false)
    }

    /// Item `item`, as floats; components that it does not have are 0.
    pub fn get<const N: usize>(&self, item: usize) -> [f64; N] {
        self.scaled(item, self.normalized)
    }

    /// The same, with integers always normalised: colours.
    pub fn get_normalized<const N: usize>(&self, item: usize) -> [f64; N] {
        self.scaled(item, true)
    }

    fn scaled<const N: usize>(&self, item: usize, normalized: bool) -> [f64; N] {
        let mut numbers = [0.0; N];
        let Some(bytes) = self.bytes(item) else { return numbers };
        let one = if normalized { self.component.one() } else { 1.0 };
        let all = bytes.chunks_exact(self.component.bytes());
        for (number, bytes) in numbers.iter_mut().zip(all) {
            // Both ends of a signed range are -1.
            let value = self.component.number(bytes) / one;
            *number = if one == 1.0 { value } else { value.max(-1.0) };
        }
        numbers
    }

    /// Item `item` of an accessor of indices.
    pub fn index(&self, item: usize) -> usize {
        self.bytes(item).map_or(0, |bytes| self.component.number(bytes) as usize)
    }
}

/// Number of components of an accessor type.
fn components(kind: &str) -> Result<usize, Fault> {
    Ok(match kind {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" | "MAT2" => 4,
        "MAT3" => 9,
        "MAT4" => 16,
        other => {
            let found = format!("accessor type {}", crate::error::quoted(&[other]));
            return Err(Fault::new(found, "must be SCALAR, VEC2 to VEC4, or MAT2 to MAT4"));
        }
    })
}
