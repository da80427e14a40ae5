//! Packs on the instruction sets that `pulp` detects at run time.
#![cfg(target_arch = "x86_64")]

use super::{Constant, Lanes, SPAN, polynomial};
use pulp::x86::{V3, V4};
use pulp::{Simd, b16, bytemuck, cast, f32x8, f32x16, m32x8, u32x8};

macro_rules! arithmetic_of_pulp {
    () => {
        #[inline(always)]
        fn constant(self, value: Constant) -> Self::Value {
            self.splat_f32s(value.single())
        }
        #[inline(always)]
        fn single(self, value: f32) -> Self::Value {
            self.splat_f32s(value)
        }
        #[inline(always)]
        fn of_span(self, span: &[f32; SPAN], offset: usize) -> Self::Value {
            let packs: [Self::Value; SPAN / <Self as Lanes>::WIDTH] = bytemuck::cast(*span);
            packs[offset / Self::WIDTH]
        }
        #[inline(always)]
        fn to_span(self, value: Self::Value, span: &mut [f32; SPAN], offset: usize) {
            let pack: [f32; <Self as Lanes>::WIDTH] = cast!(value);
            span[offset..offset + Self::WIDTH].copy_from_slice(&pack);
        }
        #[inline(always)]
        fn add(self, a: Self::Value, b: Self::Value) -> Self::Value {
            self.add_f32s(a, b)
        }
        #[inline(always)]
        fn sub(self, a: Self::Value, b: Self::Value) -> Self::Value {
            self.sub_f32s(a, b)
        }
        #[inline(always)]
        fn mul(self, a: Self::Value, b: Self::Value) -> Self::Value {
            self.mul_f32s(a, b)
        }
        #[inline(always)]
        fn div(self, a: Self::Value, b: Self::Value) -> Self::Value {
            self.div_f32s(a, b)
        }
        #[inline(always)]
        fn mul_add(self, a: Self::Value, b: Self::Value, c: Self::Value) -> Self::Value {
            self.mul_add_f32s(a, b, c)
        }
        #[inline(always)]
        fn min(self, a: Self::Value, b: Self::Value) -> Self::Value {
            self.min_f32s(a, b)
        }
        #[inline(always)]
        fn max(self, a: Self::Value, b: Self::Value) -> Self::Value {
            self.max_f32s(a, b)
        }
        #[inline(always)]
        fn less(self, a: Self::Value, b: Self::Value) -> Self::Mask {
            self.less_than_f32s(a, b)
        }
        #[inline(always)]
        fn select(self, mask: Self::Mask, yes: Self::Value, no: Self::Value) -> Self::Value {
            self.select_f32s(mask, yes, no)
        }
        #[inline(always)]
        fn sin_cos_turns(self, a: Self::Value) -> (Self::Value, Self::Value) {
            polynomial::sin_cos_turns(self, a)
        }
        #[inline(always)]
        fn tan(self, a: Self::Value) -> Self::Value {
            polynomial::tan(self, a)
        }
    };
}

/// Comparison "not less than or equal", true for NaN, quiet.
const NOT_LESS_EQUAL: i32 = 22;
const ZERO: Constant = Constant { double: 0.0, single: 0.0 };

impl Lanes for V4 {
    type Value = f32x16;
    type Mask = b16;
    const WIDTH: usize = 16;
    arithmetic_of_pulp!();

    #[inline(always)]
    fn magnitude(self, a: f32x16) -> f32x16 {
        // Not `abs_f32s`, which is called where it is not inlined, without these instructions.
        cast!(self.avx512dq._mm512_andnot_ps(cast!(self.splat_f32s(-0.0)), cast!(a)))
    }
    #[inline(always)]
    fn sqrt(self, a: f32x16) -> f32x16 {
        self.sqrt_f32s(self.max(self.constant(ZERO), a))
    }
    #[inline(always)]
    fn wrap_turns(self, a: f32x16) -> f32x16 {
        // Not `_mm512_reduce_ps`, for which the rest of infinity is 0.
        self.sub(a, cast!(self.avx512f._mm512_roundscale_ps::<8>(cast!(a))))
    }
    #[inline(always)]
    fn wrap_witnessed(self, a: f32x16, rate: f32x16, witness: f32x16) -> [f32x16; 2] {
        // One instruction on the way that every step waits for instead of two, and the rest of infinity is 0. But nothing
        // times infinity is NaN, and nothing times what is finite leaves the witness as it was. The angle, at most half a
        // turn before the step and changed by the rate times a time below a second, is finite where the rate is.
        let turns = cast!(self.avx512dq._mm512_reduce_ps::<8>(cast!(a)));
        [turns, self.mul_add(rate, self.constant(ZERO), witness)]
    }
    #[inline(always)]
    fn exceeds(self, a: f32x16, b: f32x16) -> b16 {
        b16(self.avx512f._mm512_cmp_ps_mask::<NOT_LESS_EQUAL>(cast!(a), cast!(b)))
    }
    #[inline(always)]
    fn and(self, a: b16, b: b16) -> b16 {
        b16(a.0 & b.0)
    }
    #[inline(always)]
    fn or(self, a: b16, b: b16) -> b16 {
        b16(a.0 | b.0)
    }
    #[inline(always)]
    fn any(self, mask: b16) -> bool {
        mask.0 != 0
    }
    #[inline(always)]
    fn add_where(self, mask: b16, a: f32x16, b: f32x16) -> f32x16 {
        cast!(self.avx512f._mm512_mask_add_ps(cast!(a), mask.0, cast!(a), cast!(b)))
    }
}

impl Lanes for V3 {
    type Value = f32x8;
    type Mask = m32x8;
    const WIDTH: usize = 8;
    arithmetic_of_pulp!();

    #[inline(always)]
    fn magnitude(self, a: f32x8) -> f32x8 {
        // Not `abs_f32s`: see the wider packs.
        cast!(self.avx._mm256_andnot_ps(cast!(self.splat_f32s(-0.0)), cast!(a)))
    }
    #[inline(always)]
    fn sqrt(self, a: f32x8) -> f32x8 {
        self.sqrt_f32s(self.max(self.constant(ZERO), a))
    }
    #[inline(always)]
    fn wrap_turns(self, a: f32x8) -> f32x8 {
        self.sub(a, cast!(self.avx._mm256_round_ps::<8>(cast!(a))))
    }
    #[inline(always)]
    fn exceeds(self, a: f32x8, b: f32x8) -> m32x8 {
        let words: u32x8 = cast!(self.avx._mm256_cmp_ps::<NOT_LESS_EQUAL>(cast!(a), cast!(b)));
        self.greater_than_u32s(words, self.splat_u32s(0))
    }
    #[inline(always)]
    fn and(self, a: m32x8, b: m32x8) -> m32x8 {
        self.and_m32s(a, b)
    }
    #[inline(always)]
    fn or(self, a: m32x8, b: m32x8) -> m32x8 {
        self.or_m32s(a, b)
    }
    #[inline(always)]
    fn any(self, mask: m32x8) -> bool {
        self.avx._mm256_movemask_ps(cast!(mask)) != 0
    }
    #[inline(always)]
    fn add_where(self, mask: m32x8, a: f32x8, b: f32x8) -> f32x8 {
        let kept = self.avx._mm256_and_ps(cast!(mask), cast!(b));
        self.add(a, cast!(kept))
    }
}
