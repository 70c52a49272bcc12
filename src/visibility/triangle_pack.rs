//! Packs of four triangles, tested against a ray in 32 bits before the exact test.
//!
//! ```text
//!            c             The ray hits the plane at o + t d. With the edges a and b, and s from
//!           ╱ ╲            the corner to o, by Cramer's rule (Möller, Trumbore 1997):
//!        b ╱ · ╲
//!         ╱     ╲            D = d·(b×a)    u D = d·(b×s)    v D = d·(s×a)    t D = b·(s×a)
//!        ●───────
//!      corner  a             hit where u ≥ 0, v ≥ 0, u + v ≤ 1, start ≤ t ≤ end
//! ```
//!
//! Here these hold within a margin above all rounding, and nothing is divided by D, which may be 0.
//! With h = 2⁻²⁴ for one rounding, r for the scene's size and the largest coordinate of o, and e
//! for the longer edge: positions are off by 2√3 h r, products of three factors by some 6 h of
//! them, and the direction and s are no longer than √3 and √3 r; so u D and v D are off by 24 h r
//! e, and D by 14 h e². A wrong sign of D, if it is smaller than that, adds up to 25 h r e: in
//! total within 64 h r e. t D is off by 14 h r e², and by D's error times t, which no hit in the
//! scene has above 2 r: within twice 64 h r e².

use fearless_simd::{Select, Simd, SimdBase, SimdFloat, SimdMask, f32x4};
use glam::{DVec3, Vec3A};

use super::min_max::MinMax;
use super::ray32::{Ray32, SCENE_SIZE, splat};
use super::sah_tree::MAX_LEAF_SIZE;

/// Four 32-bit lanes in memory, aligned for one load.
#[derive(Clone, Copy, Debug)]
#[repr(align(16))]
struct Lanes([f32; MAX_LEAF_SIZE]);

/// Up to four triangles in the hierarchy's unit; unused slots are NaN and never hit.
#[derive(Clone, Copy, Debug)]
pub(super) struct TrianglePack {
    corner: [Lanes; 3],
    edges: [[Lanes; 3]; 2],
    /// Length of the longest edge at a corner.
    longest: f32,
    /// Index of the first triangle in the order of the tree.
    pub first: u32,
}

/// Terms shared by all rays from one origin.
pub(super) struct PackSeen<S: Simd> {
    /// Coefficients of the direction: D, u D and v D.
    normal: [f32x4<S>; 3],
    u: [f32x4<S>; 3],
    v: [f32x4<S>; 3],
    /// t D.
    rise: f32x4<S>,
    /// Margins of u D and v D, and of t D.
    margins: [f32x4<S>; 2],
}

impl TrianglePack {
    /// A pack of at most four `triangles`, given by their corners.
    pub fn new(first: usize, triangles: impl Iterator<Item = [DVec3; 3]>) -> TrianglePack {
        let nothing = [Lanes([f32::NAN; MAX_LEAF_SIZE]); 3];
        let (mut corner, mut edges, mut longest) = (nothing, [nothing; 2], 0.0_f32);
        for (lane, [a, b, c]) in triangles.take(MAX_LEAF_SIZE).enumerate() {
            // In 64 bits, so that edges far shorter than the scene are exact relative to their own
            // length.
            let [a, u, v] = [a, b - a, c - a].map(DVec3::as_vec3a);
            longest = longest.max(u.length()).max(v.length());
            for axis in 0..3 {
                corner[axis].0[lane] = a[axis];
                edges[0][axis].0[lane] = u[axis];
                edges[1][axis].0[lane] = v[axis];
            }
        }
        TrianglePack { corner, edges, longest, first: first as u32 }
    }

    #[inline(always)]
    pub fn seen_from<S: Simd>(&self, simd: S, origin: Vec3A) -> PackSeen<S> {
        let load = |lanes: &Lanes| f32x4::load_array_ref(simd, &lanes.0);
        let load = |[x, y, z]: &[Lanes; 3]| [load(x), load(y), load(z)];
        let (o, corner): ([f32x4<S>; 3], _) = (splat(simd, origin), load(&self.corner));
        let s = [o[0] - corner[0], o[1] - corner[1], o[2] - corner[2]];
        let (a, b) = (load(&self.edges[0]), load(&self.edges[1]));
        let v = cross(&s, &a);
        // 64 roundings.
        let margin = 32.0 * f32::EPSILON * (SCENE_SIZE + origin.abs().max_element()) * self.longest;
        let rise_margin = 2.0 * margin * self.longest;
        PackSeen {
            normal: cross(&b, &a),
            u: cross(&b, &s),
            rise: dot(&b, &v),
            v,
            margins: [f32x4::splat(simd, margin), f32x4::splat(simd, rise_margin)],
        }
    }
}

impl<S: Simd> PackSeen<S> {
    /// Calls `may_meet` with each triangle that `ray` may hit before its end, by their indices in
    /// the order of the tree, where the `first` of the pack is known. It may return a new end.
    #[inline(always)]
    pub fn trace(
        &self,
        simd: S,
        first: u32,
        ray: &mut Ray32,
        mut may_meet: impl FnMut(usize) -> Option<f32>,
    ) {
        let mut hits = self.may_meet(simd, ray);
        while hits != 0 {
            let lane = hits.trailing_zeros() as usize;
            if let Some(end) = may_meet(first as usize + lane) {
                ray.end = end;
            }
            hits &= hits - 1;
        }
    }

    /// Mask of the triangles that `ray` may hit, one bit each.
    #[inline(always)]
    fn may_meet(&self, simd: S, ray: &Ray32) -> u32 {
        let d: [f32x4<S>; 3] = splat(simd, ray.direction);
        let (facing, u, v) = (dot(&d, &self.normal), dot(&d, &self.u), dot(&d, &self.v));
        let front = facing.simd_ge(f32x4::splat(simd, 0.0));
        let (u, v) = (front.select(u, -u), front.select(v, -v));
        let (rise, steep) = (front.select(self.rise, -self.rise), front.select(facing, -facing));
        let [margin, rise_margin] = self.margins;
        let inside = u.smaller(v).simd_ge(-margin) & (u + v).simd_le(steep + margin + margin);
        let within = rise.simd_ge(steep.mul_sub(f32x4::splat(simd, ray.start), rise_margin))
            & rise.simd_le(steep.mul_add(f32x4::splat(simd, ray.end), rise_margin));
        (inside & within).to_bitmask() as u32
    }
}

#[inline(always)]
fn cross<S: Simd>(a: &[f32x4<S>; 3], b: &[f32x4<S>; 3]) -> [f32x4<S>; 3] {
    let component = |i: usize, j: usize| a[i].mul_sub(b[j], a[j] * b[i]);
    [component(1, 2), component(2, 0), component(0, 1)]
}

#[inline(always)]
fn dot<S: Simd>(a: &[f32x4<S>; 3], b: &[f32x4<S>; 3]) -> f32x4<S> {
    a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]))
}
