//! The smaller and the larger number of each lane, where neither is NaN.
//!
//! WebAssembly's own minimum takes eight instructions on x86, for NaN and signed zeros; its
//! pseudo-minimum takes one.

use fearless_simd::{Simd, SimdFloat, f32x4, f32x8};

/// Lanes of 32-bit numbers.
pub(super) trait MinMax<S: Simd>: SimdFloat<S> {
    /// The smaller ones.
    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        self.min(other)
    }

    /// The larger ones.
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        self.max(other)
    }
}

#[cfg(not(all(target_family = "wasm", target_feature = "simd128")))]
impl<S: Simd> MinMax<S> for f32x4<S> {}

#[cfg(not(all(target_family = "wasm", target_feature = "simd128")))]
impl<S: Simd> MinMax<S> for f32x8<S> {}

#[cfg(all(target_family = "wasm", target_feature = "simd128"))]
mod pseudo {
    use core::arch::wasm32::{self as wasm, f32x4_pmax, f32x4_pmin, v128};

    use fearless_simd::SimdBase;

    use super::*;

    #[inline(always)]
    fn of_four<S: Simd>(a: f32x4<S>, b: f32x4<S>, of: impl Fn(v128, v128) -> v128) -> f32x4<S> {
        let simd = a.simd;
        let ([a0, a1, a2, a3], [b0, b1, b2, b3]) = (a.to_array(), b.to_array());
        let both = of(wasm::f32x4(a0, a1, a2, a3), wasm::f32x4(b0, b1, b2, b3));
        let lanes = [
            wasm::f32x4_extract_lane::<0>(both),
            wasm::f32x4_extract_lane::<1>(both),
            wasm::f32x4_extract_lane::<2>(both),
            wasm::f32x4_extract_lane::<3>(both),
        ];
        f32x4::load_array(simd, lanes)
    }

    impl<S: Simd> MinMax<S> for f32x4<S> {
        #[inline(always)]
        fn smaller(self, other: Self) -> Self {
            of_four(self, other, |a, b| f32x4_pmin(a, b))
        }

        #[inline(always)]
        fn larger(self, other: Self) -> Self {
            of_four(self, other, |a, b| f32x4_pmax(a, b))
        }
    }

    impl<S: Simd> MinMax<S> for f32x8<S> {
        #[inline(always)]
        fn smaller(self, other: Self) -> Self {
            let simd = self.simd;
            let ((a, b), (c, d)) = (simd.split_f32x8(self), simd.split_f32x8(other));
            simd.combine_f32x4(a.smaller(c), b.smaller(d))
        }

        #[inline(always)]
        fn larger(self, other: Self) -> Self {
            let simd = self.simd;
            let ((a, b), (c, d)) = (simd.split_f32x8(self), simd.split_f32x8(other));
            simd.combine_f32x4(a.larger(c), b.larger(d))
        }
    }
}
