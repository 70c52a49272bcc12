//! Structs and constants shared with the shaders, under the same names: every shader begins with
//! their text in WGSL.
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
//! Members that no shader reads pad the struct to WGSL's alignment.

use crate::backend::cpu::gather;
use crate::gather::lights;
use crate::scene::Sun;
use crate::visibility::sah_tree;

/// Structs of Rust, and their text in WGSL.
macro_rules! shared_structs {
    ($($(#[$doc:meta])* pub struct $name:ident {
        $($(#[$field_doc:meta])* pub $field:ident: $type:tt,)*
    })*) => {
        $(
            $(#[$doc])*
            #[repr(C)]
            #[derive(
                Clone, Copy, Debug, Default, PartialEq, ::bytemuck::Pod, ::bytemuck::Zeroable,
            )]
            pub struct $name {
                $($(#[$field_doc])* pub $field: $type,)*
            }

            // All members are aligned as in WGSL: it adds no padding.
            const _: () = {
                let mut align = 4;
                $(
                    assert!(std::mem::offset_of!($name, $field).is_multiple_of(wgsl_align!($type)));
                    align = if align < wgsl_align!($type) { wgsl_align!($type) } else { align };
                )*
                assert!(size_of::<$name>().is_multiple_of(align));
            };
        )*

        macro_rules! structs_wgsl {
            () => {
                concat!($(
                    "struct ", stringify!($name), " {\n",
                    $("    ", stringify!($field), ": ", wgsl_type!($type), ",\n",)*
                    "}\n"
                ),*)
            };
        }
        pub(super) use structs_wgsl;
    };
}

/// The text of a type in WGSL.
macro_rules! wgsl_type {
    ([f32; 3]) => {
        "vec3f"
    };
    ([u32; 3]) => {
        "vec3u"
    };
    ([$inner:tt; $count:literal]) => {
        concat!("array<", wgsl_type!($inner), ", ", stringify!($count), ">")
    };
    ($name:ident) => {
        stringify!($name)
    };
}
pub(super) use wgsl_type;

/// The alignment of a type in WGSL, bytes; that of structs is at most this.
macro_rules! wgsl_align {
    (f32) => {
        4
    };
    (u32) => {
        4
    };
    ($vector_or_struct:tt) => {
        16
    };
}

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
        /// Relative to the middle of the scene, in units of its size.
        pub high: [f32; 3],
        /// 1: coinciding fronts cover its triangle's back.
        pub back_is_covered: u32,
        /// Rounding remainder of `high`.
        pub low: [f32; 3],
        pub padding: u32,
    }

    /// One face of one hemicube, as `item_buffer.wgsl` draws it.
    pub struct FaceView {
        /// Patch centre, relative to the middle of the scene, in units of its size.
        pub eye: [f32; 3],
        /// Near plane, same unit.
        pub near: f32,
        /// Unit vectors of the view, right × up = −forward.
        pub right: [f32; 3],
        /// Tangent of the lowest line's elevation: -1 or 0.
        pub bottom: f32,
        pub up: [f32; 3],
        /// Position of the patch's own triangle in the drawing order: never drawn.
        pub own_triangle: u32,
        pub forward: [f32; 3],
        pub padding: u32,
        /// Rounding remainder of `eye`.
        pub eye_low: [f32; 3],
        pub padding_2: u32,
    }

    /// The lattice of a triangle.
    pub struct TriangleCells {
        /// Item of its first cell.
        pub first: u32,
        /// Cells along an edge, a power of two.
        pub side: u32,
    }

    /// Parameters of `reduce.wgsl` for a batch.
    pub struct Reduction {
        /// N: an item buffer is N wide and 3N high.
        pub resolution: u32,
        /// Words of a row: open, back, then one per element.
        pub slots: u32,
        /// Words per line of an item buffer, at least N.
        pub stride: u32,
    }

    /// Two boxes of the hierarchy for rays, and their contents: nodes, or leaves.
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
        /// The first corner.
        pub corner: [f32; 3],
        /// Its index in the scene.
        pub index: u32,
        /// Rounding remainder of `corner`.
        pub corner_low: [f32; 3],
        pub flags: u32,
        /// From there to the second corner.
        pub edge_u: [f32; 3],
        /// The light that it belongs to, or the row of a pane's transmittance.
        pub light: u32,
        /// To the third corner.
        pub edge_v: [f32; 3],
        /// Maximum edge length.
        pub extent: f32,
    }

    /// Scene-wide data for ray casting. The first four come together: where conditions depend on
    /// single words, lavapipe (Mesa 22.3) compiles a shader for each of their values anew.
    pub struct TracedSceneInfo {
        /// Root of the hierarchy of clear panes, or [`NOTHING`].
        pub panes: u32,
        /// Number of lights.
        pub lights: u32,
        /// Pieces of the sky along the edge of a square; 0 if it is uniform.
        pub sky_side: u32,
        pub has_sun: u32,
        /// Radiosity of a surface as bright as a uniform sky.
        pub sky: [f32; 3],
        pub padding: u32,
        /// The axes of the sky's pieces.
        pub sky_x: [f32; 3],
        pub padding_2: u32,
        pub sky_y: [f32; 3],
        pub padding_3: u32,
        pub sky_z: [f32; 3],
        pub padding_4: u32,
        /// Irradiance of a surface that faces the sun.
        pub sun: [f32; 3],
        pub padding_5: u32,
        /// Towards the sun, unit length.
        pub sun_middle: [f32; 3],
        pub padding_6: u32,
        /// Across, with the tangent of its radius as length.
        pub sun_right: [f32; 3],
        pub padding_7: u32,
        pub sun_up: [f32; 3],
        pub padding_8: u32,
    }

    /// A light. Rows after the lights: the transmittance of a pane; that of a translucent material,
    /// and in the next row its reflectance.
    pub struct TracedLight {
        /// Per channel, in units of about the brightest.
        pub exitance: [f32; 3],
        /// Whether no part of it hides another.
        pub is_convex: u32,
        /// Its first triangle in `lamps`.
        pub first: u32,
        pub count: u32,
        pub area: f32,
        /// Cumulative share of the power of all lights up to its end.
        pub power_end: f32,
    }

    /// A triangle of a light.
    pub struct Lamp {
        /// Its index in `triangles`.
        pub triangle: u32,
        /// Cumulative share of the light's area up to its end.
        pub end: f32,
    }

    /// A gather point.
    pub struct TracedPoint {
        pub position: [f32; 3],
        pub near: f32,
        pub position_low: [f32; 3],
        /// Of the directions about the normal, in turns.
        pub rotation: f32,
        pub normal: [f32; 3],
        /// Of the other coordinate.
        pub second_rotation: f32,
        /// Irradiance from luminaires.
        pub luminaires: [f32; 3],
        pub padding: u32,
    }

    /// Sums over rays.
    pub struct RaySums {
        /// Light reflected by surfaces and from the sky, except for near surfaces and lights
        /// sampled separately.
        pub light: [f32; 3],
        pub escaped: f32,
        /// Exitance of the other lights.
        pub lamps: [f32; 3],
        pub back: f32,
        pub inverse_distance: f32,
        /// The largest contribution of one ray to `light`: its length over the channels.
        pub largest: f32,
        /// Number of rays that meet near surfaces.
        pub near: f32,
        /// The same as `largest` of `near_light`.
        pub near_largest: f32,
        /// Light of near surfaces by the field: it counts where paths do not find it.
        pub near_light: [f32; 3],
        pub padding: f32,
    }

    /// Sums of form factors of points on a light, or of rays towards it: the visible ones, and all.
    pub struct Visible {
        pub seen: [f32; 3],
        pub all: f32,
    }

    /// A light that is sampled separately.
    pub struct RankedLight {
        pub light: u32,
        /// Unoccluded form factor to all of it.
        pub factor: f32,
        /// Whether rays over the hemisphere estimate its visible share.
        pub is_wide: u32,
        pub padding: u32,
    }

    /// A point of a gather between passes. The host does not read it.
    pub struct PointState {
        /// The first half, or all earlier rays; the second half.
        pub rays: [RaySums; 2],
        pub lights: [RankedLight; 8],
        /// For the first half and the second, by light and sun.
        pub visible: [[Visible; 9]; 2],
        pub light_count: u32,
        /// Number of rays over the hemisphere.
        pub ray_count: u32,
        /// Number of rays to each light.
        pub shadow_count: u32,
        /// 1: rays were doubled; 2: rays to lights were doubled; 3: these are the first of both.
        pub pending: u32,
        pub ray_error: f32,
        pub shadow_error: f32,
        /// Whether paths found the light of near surfaces for earlier rays.
        pub covered: u32,
        pub padding: u32,
    }

    /// Numbers of rays of a gather.
    pub struct GatherSettings {
        pub min_rays: u32,
        pub max_rays: u32,
        /// Allowed, as a share of the irradiance.
        pub noise: f32,
        /// Irradiance below which `noise` is a share of this.
        pub dim: f32,
        pub points: u32,
        /// Number of rays of a half cast by preceding passes.
        pub first: u32,
        /// Number of rays cast by one pass.
        pub pass_rays: u32,
        /// Whether paths find the light of near surfaces.
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
        /// Number of rays over the hemisphere.
        pub rays: u32,
        /// Number of rays to each light.
        pub shadow_rays: u32,
        /// Whether paths found the light of near surfaces.
        pub covered: u32,
        pub padding: u32,
        pub padding_2: u32,
        pub padding_3: u32,
    }

    /// A patch whose row is computed.
    pub struct TracedPatch {
        pub position: [f32; 3],
        pub near: f32,
        pub position_low: [f32; 3],
        /// Rays do not hit it.
        pub own_triangle: u32,
        pub normal: [f32; 3],
        /// Of the directions about the normal, in turns.
        pub rotation: f32,
    }

    /// Parameters of rows.
    pub struct RowSettings {
        /// Of a patch.
        pub rays: u32,
        /// Of a row.
        pub slots: u32,
        /// Value of a ray in sums of transmittances.
        pub unit: f32,
        /// Capacity.
        pub entries: u32,
    }

    /// A slot of a row with hits.
    pub struct RowEntry {
        /// In its batch.
        pub patch_: u32,
        pub slot: u32,
        /// Number of rays.
        pub count: u32,
        pub padding: u32,
        /// Sum of transmittances, in units of 1/[`RowSettings::unit`]; 0 without panes.
        pub passed: [u32; 3],
        pub padding_2: u32,
    }
}

/// Bytes before the entries of `RowEntries`.
pub const ROW_ENTRIES_HEADER_BYTES: u64 = 16;

/// Bytes of the workgroup counts at the beginning of `Work`: those of rays, those of shadow rays.
pub const WORK_HEADER_BYTES: u64 = 32;

shared_constants! {
    /// Absent node or triangle.
    NOTHING: u32 = 0xffffffff;

    /// Size of the stack of a ray: one node of each level of the hierarchy, and the end marker.
    STACK: u32 = 33;

    /// Maximum number of lights of a point that are sampled separately.
    MAX_EXPLICIT_LIGHTS: u32 = 8;

    /// Index of the sun in the visibilities of a point, after the lights.
    SUN: u32 = 8;

    /// Of a triangle that belongs to no light.
    NO_LIGHT: u32 = 0xffffffff;

    /// Rays over the hemisphere per ray to a light.
    RAYS_PER_SHADOW_RAY: u32 = 4;

    /// Sine of the sun's angular radius: its middle is this high if its whole disc is visible.
    SINE_OF_SUN: f32 = 0.0046524;

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

const _: () = assert!(
    STACK == sah_tree::MAX_LEVELS + 2
        && MAX_EXPLICIT_LIGHTS as usize == lights::MAX_EXPLICIT_LIGHTS
        && SUN == MAX_EXPLICIT_LIGHTS
        && NO_LIGHT == lights::NO_LIGHT
        && RAYS_PER_SHADOW_RAY == gather::RAYS_PER_SHADOW_RAY
        && SINE_OF_SUN == Sun::SINE as f32
);

#[cfg(test)]
mod tests {
    use super::super::shaders::SHADERS;
    use super::*;

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

    /// Lists begin after their headers; indirect dispatches read the counts of workgroups from
    /// bytes 0 and 12 on.
    #[test]
    fn lists_begin_where_the_host_assumes() {
        let lists = [
            ("Work", vec![0, 12, 24, WORK_HEADER_BYTES]),
            ("WorkRead", vec![0, WORK_HEADER_BYTES]),
            ("RowEntries", vec![0, 4, ROW_ENTRIES_HEADER_BYTES]),
        ];
        for (name, expected) in lists {
            let modules = modules();
            let types = modules.iter().flat_map(|module| module.types.iter());
            let named = types.filter(|(_, ty)| ty.name.as_deref() == Some(name));
            let offsets = named.map(|(_, ty)| match &ty.inner {
                naga::TypeInner::Struct { members, .. } => {
                    members.iter().map(|m| u64::from(m.offset)).collect::<Vec<_>>()
                }
                other => panic!("{name}: {other:?}"),
            });
            let offsets: Vec<_> = offsets.collect();
            assert!(!offsets.is_empty() && offsets.iter().all(|o| *o == expected), "{offsets:?}");
        }
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
