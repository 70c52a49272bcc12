//! Structs shared with the shaders, under the same names; a test compares every offset.

use bytemuck::{Pod, Zeroable};

/// One face of one hemicube, as `item_buffer.wgsl` draws it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct FaceView {
    pub eye: [f32; 3],
    pub near: f32,
    pub right: [f32; 3],
    pub bottom: f32,
    pub up: [f32; 3],
    pub own_triangle: u32,
    pub forward: [f32; 3],
    pub padding: u32,
}

/// Where a triangle's items start, and how many cells lie along its edge.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct TriangleCells {
    pub first: u32,
    pub side: u32,
}

/// What `reduce.wgsl` needs to know of a batch.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Reduction {
    pub resolution: u32,
    pub slots: u32,
    pub stride: u32,
}

/// What a pixel shows: nothing, the back of a triangle, or from here on a cell of a front. Slots
/// of a row start alike: open, back, then the elements.
pub const OPEN: u32 = 0;
pub const BACK: u32 = 1;
pub const FIRST_CELL: u32 = 2;
pub const FIRST_ELEMENT: u32 = 2;

/// Image lines that one thread of `reduce.wgsl` walks down, and threads in its workgroup.
pub const STRIP: u32 = 16;
pub const WORKGROUP: u32 = 64;

pub const ITEM_BUFFER_WGSL: &str = include_str!("../../shaders/item_buffer.wgsl");
pub const REDUCE_WGSL: &str = include_str!("../../shaders/reduce.wgsl");

#[cfg(test)]
mod tests {
    use super::*;
    use std::mem::offset_of;

    fn parsed(source: &str) -> naga::Module {
        let module = naga::front::wgsl::parse_str(source).expect("WGSL parses");
        // Nothing beyond what every WebGPU device has.
        let none = naga::valid::Capabilities::empty();
        naga::valid::Validator::new(naga::valid::ValidationFlags::all(), none)
            .validate(&module)
            .expect("WGSL is valid");
        module
    }

    /// Name, offset and size of each member, and the size of the whole.
    fn wgsl_layout(module: &naga::Module, name: &str) -> (Vec<(String, usize, usize)>, usize) {
        let (_, ty) = module
            .types
            .iter()
            .find(|(_, t)| t.name.as_deref() == Some(name))
            .unwrap_or_else(|| panic!("no struct {name}"));
        let naga::TypeInner::Struct { members, span } = &ty.inner else { panic!("{name}") };
        let size = |m: &naga::StructMember| module.types[m.ty].inner.size(module.to_ctx());
        let list = members
            .iter()
            .map(|m| (m.name.clone().unwrap(), m.offset as usize, size(m) as usize))
            .collect();
        (list, *span as usize)
    }

    macro_rules! rust_layout {
        ($t:ident { $($field:ident),* }) => {{
            let v = $t::default();
            // Destructured without `..`, so that a new field cannot be forgotten here.
            let $t { $($field),* } = v;
            (
                vec![$((
                    stringify!($field).to_string(),
                    offset_of!($t, $field),
                    size_of_val(&$field),
                )),*],
                size_of::<$t>(),
            )
        }};
    }

    #[test]
    fn shared_structs_have_one_layout() {
        let (item, reduce) = (parsed(ITEM_BUFFER_WGSL), parsed(REDUCE_WGSL));
        assert_eq!(
            wgsl_layout(&item, "FaceView"),
            rust_layout!(FaceView { eye, near, right, bottom, up, own_triangle, forward, padding })
        );
        assert_eq!(
            wgsl_layout(&item, "TriangleCells"),
            rust_layout!(TriangleCells { first, side })
        );
        assert_eq!(
            wgsl_layout(&reduce, "Reduction"),
            rust_layout!(Reduction { resolution, slots, stride })
        );
    }

    #[test]
    fn shared_constants_have_one_value() {
        let (item, reduce) = (parsed(ITEM_BUFFER_WGSL), parsed(REDUCE_WGSL));
        let constant = |module: &naga::Module, name: &str| {
            let (_, c) =
                module.constants.iter().find(|(_, c)| c.name.as_deref() == Some(name)).unwrap();
            match module.global_expressions[c.init] {
                naga::Expression::Literal(naga::Literal::U32(value)) => value,
                ref other => panic!("{name}: {other:?}"),
            }
        };
        assert_eq!(constant(&item, "BACK"), BACK);
        assert_eq!(constant(&reduce, "STRIP"), STRIP);
        assert_eq!(reduce.entry_points[0].workgroup_size, [WORKGROUP, 1, 1]);
        // OPEN is the clear value of the item buffer: wgpu clears to zero.
        assert_eq!(OPEN, 0);
    }
}
