//! Structs and constants shared with the shaders, under the same names. Every shader begins with
//! the constants; a test compares every offset of the structs.
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

/// Name, offset and size of each member of a struct, and the size of the whole, bytes.
#[cfg(test)]
pub type Layout = (Vec<(String, usize, usize)>, usize);

/// A struct of WGSL with the same layout.
macro_rules! shared_structs {
    ($($(#[$doc:meta])* pub struct $name:ident {
        $($(#[$field_doc:meta])* pub $field:ident: $type:ty,)*
    })*) => {$(
        $(#[$doc])*
        #[repr(C)]
        #[derive(
            Clone, Copy, Debug, Default, PartialEq, ::bytemuck::Pod, ::bytemuck::Zeroable,
        )]
        pub struct $name {
            $($(#[$field_doc])* pub $field: $type,)*
        }

        #[cfg(test)]
        impl $name {
            pub fn layout() -> $crate::backend::gpu::layout::Layout {
                let member = |name: &str, offset, size| (name.to_string(), offset, size);
                let members = vec![$(
                    member(
                        stringify!($field),
                        std::mem::offset_of!($name, $field),
                        size_of::<$type>(),
                    )
                ),*];
                (members, size_of::<$name>())
            }
        }
    )*};
}
#[cfg(test)]
pub(in crate::backend) use shared_structs;

/// Constants of Rust, and their text in WGSL, which has the same literals.
macro_rules! shared_constants {
    ($($(#[$doc:meta])* $name:ident: $type:ident = $value:literal;)*) => {
        $(
            $(#[$doc])*
            #[allow(dead_code, reason = "some are of shaders and of their twins in tests only")]
            pub const $name: $type = $value;
        )*

        macro_rules! constants_wgsl {
            () => {
                concat!($(
                    "const ", stringify!($name), ": ", stringify!($type), " = ",
                    stringify!($value), ";\n"
                ),*)
            };
        }
        pub(super) use constants_wgsl;
    };
}

shared_structs! {
    /// A corner of a triangle, in two parts: see [`super::split_float`].
    pub struct Corner {
        pub high: [f32; 3],
        pub back_is_covered: u32,
        pub low: [f32; 3],
        pub padding: u32,
    }

    /// One face of one hemicube, as `item_buffer.wgsl` draws it.
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
    pub struct TriangleCells {
        pub first: u32,
        pub side: u32,
    }

    /// Parameters of `reduce.wgsl` for a batch.
    pub struct Reduction {
        pub resolution: u32,
        pub slots: u32,
        pub stride: u32,
    }

    /// Two boxes of the hierarchy for rays, and their contents.
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
    pub struct TracedLight {
        pub exitance: [f32; 3],
        pub is_convex: u32,
        pub first: u32,
        pub count: u32,
        pub area: f32,
        pub power_end: f32,
    }

    /// A triangle of a light.
    pub struct Lamp {
        pub triangle: u32,
        pub end: f32,
    }

    /// A gather point.
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
    pub struct TracedPatch {
        pub position: [f32; 3],
        pub near: f32,
        pub position_low: [f32; 3],
        pub own_triangle: u32,
        pub normal: [f32; 3],
        pub rotation: f32,
    }

    /// Parameters of rows.
    pub struct RowSettings {
        pub rays: u32,
        pub slots: u32,
        pub unit: f32,
        pub entries: u32,
    }

    /// A slot of a row with hits.
    pub struct RowEntry {
        pub patch_: u32,
        pub slot: u32,
        pub count: u32,
        pub padding: u32,
        pub passed: [u32; 3],
        pub padding_2: u32,
    }
}

/// Bytes before the entries of `RowEntries`.
pub const ROW_ENTRIES_HEADER_BYTES: u64 = 16;

/// Bytes of a `PointState`, which the host does not read.
pub const POINT_STATE_BYTES: u64 = 576;

/// Bytes of the workgroup counts at the beginning of `Work`: those of rays, those of shadow rays.
pub const WORK_HEADER_BYTES: u64 = 32;

shared_constants! {
    /// Absent node or triangle.
    NOTHING: u32 = 0xffffffff;

    /// A leaf of the hierarchy: this, plus (number of its triangles − 1) << 29, plus the first of
    /// them.
    LEAF: u32 = 0x80000000;

    /// A node of a quadtree with children: this plus the first of the four. A leaf holds its
    /// element.
    INNER: u32 = 0x80000000;

    /// Flag of a traced triangle: rays do not hit its back.
    BACK_IS_COVERED: u32 = 1;

    /// Flag of a traced triangle: a mask defines its solid part.
    HAS_HOLES: u32 = 2;

    /// From this bit of the flags on: 1 plus the row of the transmittance of its material among
    /// the lights, followed by that of its reflectance; 0 if no light leaves its other side.
    ROW_OF_FLAGS: u32 = 2;

    /// Texels per line of textures that are read as arrays, and elements per line of the texture
    /// of their corners' radiosity: WebGPU allows 8192, and lines that are not full cost memory.
    TEXELS_PER_LINE: u32 = 2048;

    /// Item of a pixel and slot of a row without a hit; 0 is the clear value of an item buffer.
    OPEN: u32 = 0;

    /// Item and slot of the backs of triangles.
    BACK: u32 = 1;

    /// Item of the first cell of a front, and slot of the first element.
    FIRST_FRONT: u32 = 2;

    /// Lanes of a workgroup, in all passes but that of `compact_rows.wgsl`.
    LANES: u32 = 64;

    /// Lines of an item buffer that one lane of `reduce.wgsl` adds up. Plain choice.
    STRIP: u32 = 16;

    /// Distance beyond any hit, in units of the scene's size.
    FAR: f32 = 1e30;

    /// Bound of rounding in the triangle test, some eight roundings of 2⁻²⁴ each.
    ROUNDING: f32 = 5e-7;

    /// Light without triangles, for rays to the sun: any hit occludes it.
    ANY_LIGHT: u32 = 0xfffffffe;

    /// Lights below this share of the total unoccluded irradiance are not sampled separately.
    MIN_IRRADIANCE_SHARE: f32 = 1e-3;

    /// Number of points by which the evenness of a light is estimated. Plain choice.
    EVENNESS_POINTS: u32 = 32;

    /// Minimum expected number of rays over the hemisphere that hit a light which has no rays of
    /// its own: of fewer there may be none (with a probability of e⁻⁸ for independent rays).
    MIN_RAYS: f32 = 8.0;

    /// Share of the hemisphere covered by near surfaces above which paths replace the field's
    /// light. Plain choice.
    MIN_COVERED: f32 = 0.5;

    /// Maximum number of vertices of a path: of longer ones a share of the light below albedo¹²⁸
    /// is that of the field although the surface is near.
    MAX_VERTICES: u32 = 128;

    /// Maximum probability of continuation of a path. Plain choice.
    MAX_SURVIVAL: f32 = 0.999;

    /// Height of a path's vertex above its triangle, in units of the scene's size: 2⁻²⁰, some four
    /// times the rounding of coordinates in the triangle test, half of which a ray may have from
    /// there.
    LIFT: f32 = 9.536743e-7;
}

#[cfg(test)]
mod tests {
    use super::super::shaders::SHADERS;
    use super::*;
    use crate::backend::cpu::gather::RAYS_PER_SHADOW_RAY;
    use crate::backend::cpu::twins::gather_state::{
        PointState, RankedLight, RaySums, SUN, Visible,
    };
    use crate::gather::lights::{MAX_EXPLICIT_LIGHTS, NO_LIGHT};
    use crate::scene::Sun;
    use crate::visibility::sah_tree::MAX_LEVELS;

    /// All shaders, parsed and checked: they need no capabilities beyond those of every WebGPU
    /// device.
    fn modules() -> [naga::Module; 9] {
        SHADERS.map(|(_, source)| {
            let module = naga::front::wgsl::parse_str(source).expect("WGSL parses");
            let none = naga::valid::Capabilities::empty();
            naga::valid::Validator::new(naga::valid::ValidationFlags::all(), none)
                .validate(&module)
                .expect("WGSL is valid");
            module
        })
    }

    /// The structs of a name; at least one shader has it.
    fn structs(modules: &[naga::Module], name: &str) -> Vec<Layout> {
        let struct_of = |module: &naga::Module| {
            let (_, ty) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name))?;
            let naga::TypeInner::Struct { members, span } = &ty.inner else { panic!("{name}") };
            let size = |m: &naga::StructMember| module.types[m.ty].inner.size(module.to_ctx());
            let members = members
                .iter()
                .map(|m| (m.name.clone().unwrap(), m.offset as usize, size(m) as usize));
            Some((members.collect(), *span as usize))
        };
        let all: Vec<_> = modules.iter().filter_map(struct_of).collect();
        assert!(!all.is_empty(), "no shader has {name}");
        all
    }

    /// The values of a constant; at least one shader has it.
    fn constants(modules: &[naga::Module], name: &str) -> Vec<naga::Literal> {
        let value_of = |module: &naga::Module| {
            let named = |c: &naga::Constant| c.name.as_deref() == Some(name);
            let (_, constant) = module.constants.iter().find(|(_, c)| named(c))?;
            match module.global_expressions[constant.init] {
                naga::Expression::Literal(value) => Some(value),
                ref other => panic!("{name}: {other:?}"),
            }
        };
        let all: Vec<_> = modules.iter().filter_map(value_of).collect();
        assert!(!all.is_empty(), "no shader has {name}");
        all
    }

    #[test]
    fn shared_structs_have_one_layout() {
        let modules = modules();
        macro_rules! compare {
            ($($name:ident)*) => {$(
                for layout in structs(&modules, stringify!($name)) {
                    assert_eq!(layout, $name::layout(), stringify!($name));
                }
            )*};
        }
        compare!(Corner FaceView TriangleCells Reduction TraceNode TracedTriangle TracedSceneInfo);
        compare!(TracedLight Lamp TracedPoint GatherSettings Sample TracedPatch RowSettings);
        compare!(RowEntry RaySums Visible RankedLight PointState);
        assert_eq!(size_of::<PointState>() as u64, POINT_STATE_BYTES);
        // Lists start after their headers.
        let lists = [
            ("Work", "points", WORK_HEADER_BYTES),
            ("WorkRead", "points", WORK_HEADER_BYTES),
            ("RowEntries", "entries", ROW_ENTRIES_HEADER_BYTES),
        ];
        for (name, list, bytes) in lists {
            for (members, _) in structs(&modules, name) {
                let (last, offset, _) = members.last().unwrap();
                assert_eq!((last.as_str(), *offset as u64), (list, bytes), "{name}");
            }
        }
        // Indirect dispatches read the second count from byte 12 on.
        for (members, _) in structs(&modules, "Work") {
            assert_eq!((members[0].1, members[1].1), (0, 12), "{members:?}");
        }
    }

    /// Constants of shaders that repeat those of other modules.
    #[test]
    fn repeated_constants_have_one_value() {
        let modules = modules();
        let repeated = [
            ("MAX_EXPLICIT_LIGHTS", MAX_EXPLICIT_LIGHTS as u32),
            ("SUN", SUN as u32),
            ("NO_LIGHT", NO_LIGHT),
            ("RAYS_PER_SHADOW_RAY", RAYS_PER_SHADOW_RAY),
            // One node of each level, and the end marker.
            ("STACK", MAX_LEVELS + 2),
        ];
        for (name, value) in repeated {
            for literal in constants(&modules, name) {
                assert_eq!(literal, naga::Literal::U32(value), "{name}");
            }
        }
        // The middle of the sun is above the horizon if its disc is above.
        let sine = naga::Literal::F32(Sun::SINE as f32);
        assert_eq!(constants(&modules, "SINE_OF_SUN"), [sine]);
        // One of each light and the sun, for either half; the shaders have these numbers as
        // literals.
        assert_eq!([SUN + 1, size_of::<PointState>()], [9, 576]);
    }

    /// The host counts workgroups of that size; that of compacting a row is as large as any device
    /// allows.
    #[test]
    fn workgroups_have_the_size_that_the_host_assumes() {
        for entry_point in modules().iter().flat_map(|module| &module.entry_points) {
            if entry_point.stage == naga::ShaderStage::Compute {
                let name = &entry_point.name;
                let lanes = if name.starts_with("compact_rows") { 256 } else { LANES };
                assert_eq!(entry_point.workgroup_size, [lanes, 1, 1], "{name}");
            }
        }
    }

    /// No more bindings and workgroup memory than every WebGPU device has.
    #[test]
    fn shaders_keep_to_the_limits_of_webgpu() {
        for module in modules() {
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
