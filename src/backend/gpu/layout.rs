//! Structs and constants shared with the shaders, under the same names; a test compares every
//! offset and value.
//!
//! | pass | reads | writes |
//! |---|---|---|
//! | `item_buffer.wgsl` | [`Corner`] ×3, [`TriangleCells`], [`FaceView`] | u32 a pixel |
//! | `reduce.wgsl` | those, u32 a weight, u32 a slot, [`Reduction`] | u32 a slot of each row |
//! | `rank_lights.wgsl` | [`TracedTriangle`], [`TracedLight`], [`Lamp`], [`TracedPoint`] | states |
//! | `hemisphere_rays.wgsl` | those, [`TraceNode`], [`TracedSceneInfo`], quadtrees | states |
//! | `light_rays.wgsl` | those but for quadtrees | states |
//! | `settle.wgsl` | states, [`GatherSettings`] | [`Sample`] a point, lists of points |
//! | `row_rays.wgsl` | [`TraceNode`], [`TracedTriangle`], quadtrees, [`TracedPatch`] | u32 a slot |
//! | `compact_rows.wgsl` | u32 a slot, [`RowSettings`] | [`RowEntry`] a slot that is not 0 |
//!
//! Members that a shader does not read pad the struct to WGSL's alignment.

use bytemuck::{Pod, Zeroable};

/// A corner of a triangle, in two parts: see [`super::split_float`].
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Corner {
    pub high: [f32; 3],
    pub back_is_covered: u32,
    pub low: [f32; 3],
    pub padding: u32,
}

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
    pub eye_low: [f32; 3],
    pub padding_2: u32,
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

/// Two boxes of the hierarchy that rays descend, and what is in them.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct TraceNode {
    pub low_a: [f32; 3],
    pub child_a: u32,
    pub high_a: [f32; 3],
    pub child_b: u32,
    pub low_b: [f32; 3],
    pub padding: u32,
    pub high_b: [f32; 3],
    pub padding_2: u32,
}

/// A triangle as rays meet it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct TracedTriangle {
    pub corner: [f32; 3],
    pub index: u32,
    pub corner_low: [f32; 3],
    pub flags: u32,
    pub edge_u: [f32; 3],
    pub light: u32,
    pub edge_v: [f32; 3],
    pub extent: f32,
}

/// What there is one of in a scene that rays are cast in.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct TracedSceneInfo {
    pub panes: u32,
    pub lights: u32,
    pub sky_side: u32,
    pub has_sun: u32,
    pub sky: [f32; 3],
    pub padding: u32,
    pub sky_x: [f32; 3],
    pub padding_2: u32,
    pub sky_y: [f32; 3],
    pub padding_3: u32,
    pub sky_z: [f32; 3],
    pub padding_4: u32,
    pub sun: [f32; 3],
    pub padding_5: u32,
    pub sun_middle: [f32; 3],
    pub padding_6: u32,
    pub sun_right: [f32; 3],
    pub padding_7: u32,
    pub sun_up: [f32; 3],
    pub padding_8: u32,
}

/// A light, or what a pane lets through.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct TracedLight {
    pub exitance: [f32; 3],
    pub is_convex: u32,
    pub first: u32,
    pub count: u32,
    pub area: f32,
    pub padding: u32,
}

/// A triangle of a light.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Lamp {
    pub triangle: u32,
    pub end: f32,
}

/// A point that light is gathered at.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct TracedPoint {
    pub position: [f32; 3],
    pub near: f32,
    pub position_low: [f32; 3],
    pub rotation: f32,
    pub normal: [f32; 3],
    pub second_rotation: f32,
    pub luminaires: [f32; 3],
    pub padding: u32,
}

/// How many rays a gather casts.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct GatherSettings {
    pub min_rays: u32,
    pub max_rays: u32,
    pub noise: f32,
    pub dim: f32,
    pub points: u32,
    pub first: u32,
    pub pass_rays: u32,
    pub padding: u32,
}

/// What was gathered at a point.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Sample {
    pub irradiance: [f32; 3],
    pub noise: f32,
    pub direct: [f32; 3],
    pub escaped: f32,
    pub back: f32,
    pub inverse_distance: f32,
    pub rays: u32,
    pub shadow_rays: u32,
}

/// A patch that a row is made of.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct TracedPatch {
    pub position: [f32; 3],
    pub near: f32,
    pub position_low: [f32; 3],
    pub own_triangle: u32,
    pub normal: [f32; 3],
    pub rotation: f32,
}

/// What a row is made with.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct RowSettings {
    pub rays: u32,
    pub slots: u32,
    pub unit: f32,
    pub entries: u32,
}

/// A slot of a row that rays have met.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct RowEntry {
    pub patch_: u32,
    pub slot: u32,
    pub count: u32,
    pub padding: u32,
    pub passed: [u32; 3],
    pub padding_2: u32,
}

/// Bytes before the entries of `RowEntries`.
pub const ROW_ENTRIES_HEADER_BYTES: u64 = 16;

/// Bytes of a `PointState`, which the host never looks into.
pub const POINT_STATE_BYTES: u64 = 544;

/// Bytes of the workgroup counts at the beginning of `Work`: those of rays, those of shadow rays.
pub const WORK_HEADER_BYTES: u64 = 32;

/// In place of a node or a triangle: none.
pub const NOTHING: u32 = u32::MAX;

/// A leaf of the hierarchy: this, its triangles less one << 29, and the first of them.
pub const LEAF: u32 = 1 << 31;

/// Flags of a traced triangle.
pub const BACK_IS_COVERED: u32 = 1;
pub const HAS_HOLES: u32 = 2;

/// Texels side by side in textures that are read as arrays.
pub const TEXELS_A_LINE: u32 = 2048;

/// Elements side by side in the texture of their corners' radiosity.
pub const ELEMENTS_A_LINE: u32 = 2048;

/// A node with children: this plus the first of the four. A leaf holds its element.
pub const INNER: u32 = 1 << 31;

/// What a pixel shows: nothing, the back of a triangle, or from here on a cell of a front. Slots
/// of a row start alike: open, back, then the elements.
pub const OPEN: u32 = 0;
pub const BACK: u32 = 1;
pub const FIRST_CELL: u32 = 2;
pub const FIRST_ELEMENT: u32 = 2;

/// Image lines that one thread of `reduce.wgsl` walks down, and threads in its workgroup.
pub const STRIP: u32 = 16;
pub const WORKGROUP: u32 = 64;

#[cfg(test)]
mod tests {
    use std::mem::offset_of;

    use super::super::shaders::{ITEM_BUFFER_WGSL, REDUCE_WGSL};
    use super::*;

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
            rust_layout!(FaceView {
                eye,
                near,
                right,
                bottom,
                up,
                own_triangle,
                forward,
                padding,
                eye_low,
                padding_2
            })
        );
        assert_eq!(
            wgsl_layout(&item, "TriangleCells"),
            rust_layout!(TriangleCells { first, side })
        );
        assert_eq!(
            wgsl_layout(&reduce, "Reduction"),
            rust_layout!(Reduction { resolution, slots, stride })
        );
        assert_eq!(
            wgsl_layout(&item, "Corner"),
            rust_layout!(Corner { high, back_is_covered, low, padding })
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
