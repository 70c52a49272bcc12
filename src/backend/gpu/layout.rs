//! Structs and constants shared with the shaders, under the same names; a test compares every
//! offset and value.
//!
//! | pass | reads | writes |
//! |---|---|---|
//! | `item_buffer.wgsl` | [`Corner`] ×3, [`TriangleCells`], [`FaceView`] | u32 a pixel |
//! | `reduce.wgsl` | those, u32 a weight, u32 a slot, [`Reduction`] | u32 a slot of each row |
//! | `rank_lights.wgsl` | [`TracedTriangle`], [`TracedLight`], [`Lamp`], [`TracedPoint`] | states |
//! | `hemisphere_rays.wgsl` | those, [`TraceNode`], [`TracedSceneInfo`], quadtrees | states |
//! | `near_paths.wgsl` | the same, and states | states |
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

/// First item of a triangle, and number of cells along its edge.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct TriangleCells {
    pub first: u32,
    pub side: u32,
}

/// Parameters of `reduce.wgsl` for a batch.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Reduction {
    pub resolution: u32,
    pub slots: u32,
    pub stride: u32,
}

/// Two boxes of the hierarchy for rays, and their contents.
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

/// A triangle for ray intersection.
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

/// Scene-wide data for ray casting.
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

/// A light, or the transmittance of a pane or of a translucent material, or the latter's
/// reflectance.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct TracedLight {
    pub exitance: [f32; 3],
    pub is_convex: u32,
    pub first: u32,
    pub count: u32,
    pub area: f32,
    pub power_end: f32,
}

/// A triangle of a light.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Lamp {
    pub triangle: u32,
    pub end: f32,
}

/// A gather point.
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

/// Numbers of rays of a gather.
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
    pub near_field: u32,
}

/// The sample of a gather point.
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
    pub covered: u32,
    pub padding: [u32; 3],
}

/// A patch whose row is computed.
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

/// Parameters of rows.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct RowSettings {
    pub rays: u32,
    pub slots: u32,
    pub unit: f32,
    pub entries: u32,
}

/// A slot of a row with hits.
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

/// Bytes of a `PointState`, which the host does not read.
pub const POINT_STATE_BYTES: u64 = 576;

/// Bytes of the workgroup counts at the beginning of `Work`: those of rays, those of shadow rays.
pub const WORK_HEADER_BYTES: u64 = 32;

/// Absent node or triangle.
pub const NOTHING: u32 = u32::MAX;

/// A leaf of the hierarchy: this, plus (number of its triangles − 1) << 29, plus the first of them.
pub const LEAF: u32 = 1 << 31;

/// Flags of a traced triangle.
pub const BACK_IS_COVERED: u32 = 1;
pub const HAS_HOLES: u32 = 2;

/// From this bit of the flags on: 1 plus the row of the transmittance of its material among the
/// lights, followed by that of its reflectance; 0 if no light leaves its other side.
pub const ROW_OF_FLAGS: u32 = 2;

/// Texels side by side in textures that are read as arrays.
pub const TEXELS_A_LINE: u32 = 2048;

/// Elements side by side in the texture of their corners' radiosity.
pub const ELEMENTS_A_LINE: u32 = 2048;

/// A node with children: this plus the first of the four. A leaf holds its element.
pub const INNER: u32 = 1 << 31;

/// Items of a pixel: nothing, the back of a triangle, or from here on a cell of a front. Slots of a
/// row start alike: open, back, then the elements.
pub const OPEN: u32 = 0;
pub const BACK: u32 = 1;
pub const FIRST_CELL: u32 = 2;
pub const FIRST_ELEMENT: u32 = 2;

/// Image lines that one thread of `reduce.wgsl` processes, and threads in its workgroup.
pub const STRIP: u32 = 16;
pub const WORKGROUP: u32 = 64;

#[cfg(test)]
mod tests {
    use std::mem::offset_of;

    use super::super::shaders::{
        COMPACT_ROWS_WGSL, HEMISPHERE_RAYS_WGSL, ITEM_BUFFER_WGSL, LIGHT_RAYS_WGSL,
        NEAR_PATHS_WGSL, RANK_LIGHTS_WGSL, REDUCE_WGSL, ROW_RAYS_WGSL, SETTLE_WGSL,
    };
    use super::*;
    use crate::backend::cpu::gather::RAYS_PER_SHADOW_RAY;
    use crate::backend::cpu::twins::gather_state::{
        LANES, PointState, RankedLight, RaySums, SOURCES, Visible,
    };
    use crate::gather::lights::{MAX_EXPLICIT_LIGHTS, NO_LIGHT};
    use crate::scene::Sun;
    use crate::visibility::sah_tree::MAX_LEVELS;

    /// All ray-casting shaders, and [`COMPACT_ROWS_WGSL`].
    const RAY_SHADERS: [&str; 7] = [
        RANK_LIGHTS_WGSL,
        HEMISPHERE_RAYS_WGSL,
        LIGHT_RAYS_WGSL,
        SETTLE_WGSL,
        ROW_RAYS_WGSL,
        COMPACT_ROWS_WGSL,
        NEAR_PATHS_WGSL,
    ];

    fn parsed(source: &str) -> naga::Module {
        let module = naga::front::wgsl::parse_str(source).expect("WGSL parses");
        // No capabilities beyond those of every WebGPU device.
        let none = naga::valid::Capabilities::empty();
        naga::valid::Validator::new(naga::valid::ValidationFlags::all(), none)
            .validate(&module)
            .expect("WGSL is valid");
        module
    }

    /// Name, offset and size of each member, and the size of the whole.
    type Layout = (Vec<(String, usize, usize)>, usize);

    fn wgsl_layout(module: &naga::Module, name: &str) -> Layout {
        layout_if_there(module, name).unwrap_or_else(|| panic!("no struct {name}"))
    }

    /// `None` if the shader does not have it.
    fn layout_if_there(module: &naga::Module, name: &str) -> Option<Layout> {
        let (_, ty) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name))?;
        let naga::TypeInner::Struct { members, span } = &ty.inner else { panic!("{name}") };
        let size = |m: &naga::StructMember| module.types[m.ty].inner.size(module.to_ctx());
        let list = members
            .iter()
            .map(|m| (m.name.clone().unwrap(), m.offset as usize, size(m) as usize))
            .collect();
        Some((list, *span as usize))
    }

    /// The value of a constant; `None` if the shader does not have it.
    fn constant_if_there(module: &naga::Module, name: &str) -> Option<naga::Literal> {
        let named = |c: &naga::Constant| c.name.as_deref() == Some(name);
        let (_, constant) = module.constants.iter().find(|(_, c)| named(c))?;
        match module.global_expressions[constant.init] {
            naga::Expression::Literal(value) => Some(value),
            ref other => panic!("{name}: {other:?}"),
        }
    }

    fn constant(module: &naga::Module, name: &str) -> u32 {
        match constant_if_there(module, name) {
            Some(naga::Literal::U32(value)) => value,
            other => panic!("{name}: {other:?}"),
        }
    }

    macro_rules! rust_layout {
        ($t:ident { $($field:ident),* }) => {{
            let v = $t::default();
            // Destructured without `..`, so that a new field causes a compile error here.
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
        assert_eq!(constant(&item, "BACK"), BACK);
        assert_eq!(constant(&reduce, "STRIP"), STRIP);
        assert_eq!(reduce.entry_points[0].workgroup_size, [WORKGROUP, 1, 1]);
        // OPEN is the clear value of the item buffer: wgpu clears to zero.
        assert_eq!(OPEN, 0);
    }

    /// A struct shared by ray-casting shaders and the host, by its name in WGSL: at least one
    /// shader has it, and all that have it agree.
    #[test]
    fn structs_of_ray_shaders_have_one_layout() {
        let modules = RAY_SHADERS.map(parsed);
        let shared = [
            (
                "Node",
                rust_layout!(TraceNode {
                    low_a,
                    child_a,
                    high_a,
                    child_b,
                    low_b,
                    padding,
                    high_b,
                    padding_2
                }),
            ),
            (
                "TracedTriangle",
                rust_layout!(TracedTriangle {
                    corner,
                    index,
                    corner_low,
                    flags,
                    edge_u,
                    light,
                    edge_v,
                    extent
                }),
            ),
            (
                "TracedScene",
                rust_layout!(TracedSceneInfo {
                    panes,
                    lights,
                    sky_side,
                    has_sun,
                    sky,
                    padding,
                    sky_x,
                    padding_2,
                    sky_y,
                    padding_3,
                    sky_z,
                    padding_4,
                    sun,
                    padding_5,
                    sun_middle,
                    padding_6,
                    sun_right,
                    padding_7,
                    sun_up,
                    padding_8
                }),
            ),
            (
                "TracedLight",
                rust_layout!(TracedLight { exitance, is_convex, first, count, area, power_end }),
            ),
            ("Lamp", rust_layout!(Lamp { triangle, end })),
            (
                "TracedPoint",
                rust_layout!(TracedPoint {
                    position,
                    near,
                    position_low,
                    rotation,
                    normal,
                    second_rotation,
                    luminaires,
                    padding
                }),
            ),
            (
                "GatherSettings",
                rust_layout!(GatherSettings {
                    min_rays,
                    max_rays,
                    noise,
                    dim,
                    points,
                    first,
                    pass_rays,
                    near_field
                }),
            ),
            (
                "Sample",
                rust_layout!(Sample {
                    irradiance,
                    noise,
                    direct,
                    escaped,
                    back,
                    inverse_distance,
                    rays,
                    shadow_rays,
                    covered,
                    padding
                }),
            ),
            (
                "TracedPatch",
                rust_layout!(TracedPatch {
                    position,
                    near,
                    position_low,
                    own_triangle,
                    normal,
                    rotation
                }),
            ),
            ("RowSettings", rust_layout!(RowSettings { rays, slots, unit, entries })),
            (
                "RowEntry",
                rust_layout!(RowEntry { patch_, slot, count, padding, passed, padding_2 }),
            ),
            (
                "RaySums",
                rust_layout!(RaySums {
                    light,
                    escaped,
                    lamps,
                    back,
                    inverse_distance,
                    largest,
                    near,
                    near_largest,
                    near_light,
                    padding
                }),
            ),
            ("Visible", rust_layout!(Visible { seen, all })),
            ("RankedLight", rust_layout!(RankedLight { light, factor, is_wide, padding })),
            (
                "PointState",
                rust_layout!(PointState {
                    rays,
                    lights,
                    visible,
                    light_count,
                    ray_count,
                    shadow_count,
                    pending,
                    ray_error,
                    shadow_error,
                    covered,
                    padding
                }),
            ),
        ];
        for (name, layout) in shared {
            let found: Vec<_> = modules.iter().filter_map(|m| layout_if_there(m, name)).collect();
            assert!(!found.is_empty(), "no shader has {name}");
            found.iter().for_each(|found| assert_eq!(*found, layout, "{name}"));
        }
        assert_eq!(size_of::<PointState>() as u64, POINT_STATE_BYTES);
        // Lists start after their headers.
        let lists = [
            ("Work", "points", WORK_HEADER_BYTES),
            ("WorkRead", "points", WORK_HEADER_BYTES),
            ("RowEntries", "entries", ROW_ENTRIES_HEADER_BYTES),
        ];
        for (name, list, bytes) in lists {
            let found: Vec<_> = modules.iter().filter_map(|m| layout_if_there(m, name)).collect();
            assert!(!found.is_empty(), "no shader has {name}");
            for (members, _) in found {
                let (last, offset, _) = members.last().unwrap();
                assert_eq!((last.as_str(), *offset as u64), (list, bytes), "{name}");
            }
        }
        // Indirect dispatches read the second count from byte 12 on.
        let (members, _) = wgsl_layout(&modules[3], "Work");
        assert_eq!((members[0].1, members[1].1), (0, 12), "{members:?}");
    }

    #[test]
    fn constants_of_ray_shaders_have_one_value() {
        let modules = RAY_SHADERS.map(parsed);
        let shared = [
            ("NOTHING", NOTHING),
            ("LEAF", LEAF),
            ("BACK_IS_COVERED", BACK_IS_COVERED),
            ("HAS_HOLES", HAS_HOLES),
            ("ROW_OF_FLAGS", ROW_OF_FLAGS),
            ("TEXELS_A_LINE", TEXELS_A_LINE),
            ("ELEMENTS_A_LINE", ELEMENTS_A_LINE),
            ("INNER", INNER),
            ("MAX_EXPLICIT_LIGHTS", MAX_EXPLICIT_LIGHTS as u32),
            ("SUN", MAX_EXPLICIT_LIGHTS as u32),
            ("NO_LIGHT", NO_LIGHT),
            ("LANES", LANES),
            ("RAYS_PER_SHADOW_RAY", RAYS_PER_SHADOW_RAY),
            ("OPEN", OPEN),
            ("BACK", BACK),
            ("FIRST_ELEMENT", FIRST_ELEMENT),
        ];
        for (name, value) in shared {
            let found: Vec<_> = modules.iter().filter_map(|m| constant_if_there(m, name)).collect();
            assert!(!found.is_empty(), "no shader has {name}");
            found.iter().for_each(|&found| assert_eq!(found, naga::Literal::U32(value), "{name}"));
        }
        // The middle of the sun is above the horizon if its disc is above.
        let sine = naga::Literal::F32(Sun::SINE as f32);
        assert_eq!(constant_if_there(&modules[3], "SINE_OF_SUN"), Some(sine));
        // The stack holds one node of each level, and the end marker.
        assert!(constant(&modules[0], "STACK") >= MAX_LEVELS + 2);
        // One of each light and the sun, for either half; the shaders have these numbers as
        // literals.
        assert_eq!([SOURCES, size_of::<PointState>()], [9, 576]);
        // A workgroup serves one point, a lane one ray; the host counts workgroups of that size.
        // The workgroup for compacting a row is as large as any device allows.
        for module in &modules {
            let lanes = match constant_if_there(module, "COMPACT_LANES") {
                Some(lanes) => lanes,
                None => naga::Literal::U32(LANES),
            };
            for entry_point in &module.entry_points {
                let [x, y, z] = entry_point.workgroup_size;
                assert_eq!((naga::Literal::U32(x), y, z), (lanes, 1, 1), "{}", entry_point.name);
                assert!(x <= 256, "{}", entry_point.name);
            }
        }
    }

    /// No more bindings and workgroup memory than every WebGPU device has.
    #[test]
    fn ray_shaders_keep_to_the_limits_of_webgpu() {
        for module in RAY_SHADERS.map(parsed) {
            let of_space = |space: fn(&naga::AddressSpace) -> bool| {
                module.global_variables.iter().filter(move |(_, v)| space(&v.space)).collect()
            };
            let storage: Vec<_> =
                of_space(|space| matches!(space, naga::AddressSpace::Storage { .. }));
            assert!(storage.len() <= 8, "{} storage buffers", storage.len());
            let workgroup: Vec<_> = of_space(|space| *space == naga::AddressSpace::WorkGroup);
            let size = |v: &naga::GlobalVariable| module.types[v.ty].inner.size(module.to_ctx());
            let bytes: u32 = workgroup.iter().map(|(_, v)| size(v)).sum();
            assert!(bytes <= 16_384, "{bytes} bytes of a workgroup");
        }
    }
}
