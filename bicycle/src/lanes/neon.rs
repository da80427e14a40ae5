//! Packs of two NEON registers, so that every operation has two chains to work on.
#![cfg(target_arch = "aarch64")]

use super::{Constant, Lanes, SPAN, polynomial};
use pulp::aarch64::Neon;
use pulp::{cast, f32x4, m32x4, u32x4};
use std::array::from_fn;

type Pack = [f32x4; 2];
type Mask = [m32x4; 2];

impl Lanes for Neon {
    type Value = Pack;
    type Mask = Mask;
    const WIDTH: usize = 8;

    #[inline(always)]
    fn constant(self, value: Constant) -> Pack {
        self.single(value.single())
    }
    #[inline(always)]
    fn single(self, value: f32) -> Pack {
        [cast!(self.neon.vdupq_n_f32(value)); 2]
    }
    #[inline(always)]
    fn of_span(self, span: &[f32; SPAN], offset: usize) -> Pack {
        cast!(span.as_chunks::<8>().0[offset / 8])
    }
    #[inline(always)]
    fn to_span(self, value: Pack, span: &mut [f32; SPAN], offset: usize) {
        span.as_chunks_mut::<8>().0[offset / 8] = cast!(value);
    }
    #[inline(always)]
    fn add(self, a: Pack, b: Pack) -> Pack {
        from_fn(|half| cast!(self.neon.vaddq_f32(cast!(a[half]), cast!(b[half]))))
    }
    #[inline(always)]
    fn sub(self, a: Pack, b: Pack) -> Pack {
        from_fn(|half| cast!(self.neon.vsubq_f32(cast!(a[half]), cast!(b[half]))))
    }
    #[inline(always)]
    fn mul(self, a: Pack, b: Pack) -> Pack {
        from_fn(|half| cast!(self.neon.vmulq_f32(cast!(a[half]), cast!(b[half]))))
    }
    #[inline(always)]
    fn div(self, a: Pack, b: Pack) -> Pack {
        from_fn(|half| cast!(self.neon.vdivq_f32(cast!(a[half]), cast!(b[half]))))
    }
    #[inline(always)]
    fn mul_add(self, a: Pack, b: Pack, c: Pack) -> Pack {
        from_fn(|half| cast!(self.neon.vfmaq_f32(cast!(c[half]), cast!(a[half]), cast!(b[half]))))
    }
    #[inline(always)]
    fn min(self, a: Pack, b: Pack) -> Pack {
        self.select(self.less(a, b), a, b)
    }
    #[inline(always)]
    fn max(self, a: Pack, b: Pack) -> Pack {
        self.select(self.less(b, a), a, b)
    }
    #[inline(always)]
    fn clamp(self, a: Pack, low: Pack, high: Pack) -> Pack {
        // One instruction each, where `min` and `max` take two to choose between NaN and a number.
        from_fn(|half| {
            cast!(
                self.neon.vminq_f32(cast!(high[half]), self.neon.vmaxq_f32(cast!(low[half]), cast!(a[half])))
            )
        })
    }
    #[inline(always)]
    fn polynomial<const N: usize>(self, z: Pack, coefficients: &[f32; N]) -> Pack {
        // The sum of a multiply-add is overwritten, so that a coefficient which is added to has to be copied before: in
        // pairs, half of them. And half as many instructions wait for one another.
        let pair = |i: usize| {
            let low = self.single(coefficients[i]);
            if i + 1 < N { self.mul_add(z, self.single(coefficients[i + 1]), low) } else { low }
        };
        let square = self.mul(z, z);
        let last = (N - 1) / 2 * 2;
        (0..last).step_by(2).rev().fold(pair(last), |sum, i| self.mul_add(sum, square, pair(i)))
    }
    #[inline(always)]
    fn magnitude(self, a: Pack) -> Pack {
        a.map(|a| cast!(self.neon.vabsq_f32(cast!(a))))
    }
    #[inline(always)]
    fn sqrt(self, a: Pack) -> Pack {
        // Of NaN and a number this instruction gives NaN.
        let zero = self.neon.vdupq_n_f32(0.0);
        a.map(|a| cast!(self.neon.vsqrtq_f32(self.neon.vmaxq_f32(cast!(a), zero))))
    }
    #[inline(always)]
    fn wrap_turns(self, a: Pack) -> Pack {
        self.sub(a, a.map(|a| cast!(self.neon.vrndnq_f32(cast!(a)))))
    }
    #[inline(always)]
    fn less(self, a: Pack, b: Pack) -> Mask {
        from_fn(|half| cast!(self.neon.vcltq_f32(cast!(a[half]), cast!(b[half]))))
    }
    #[inline(always)]
    fn exceeds(self, a: Pack, b: Pack) -> Mask {
        from_fn(|half| cast!(self.neon.vmvnq_u32(self.neon.vcleq_f32(cast!(a[half]), cast!(b[half])))))
    }
    #[inline(always)]
    fn and(self, a: Mask, b: Mask) -> Mask {
        from_fn(|half| cast!(self.neon.vandq_u32(cast!(a[half]), cast!(b[half]))))
    }
    #[inline(always)]
    fn or(self, a: Mask, b: Mask) -> Mask {
        from_fn(|half| cast!(self.neon.vorrq_u32(cast!(a[half]), cast!(b[half]))))
    }
    #[inline(always)]
    fn any(self, mask: Mask) -> bool {
        self.neon.vmaxvq_u32(self.neon.vorrq_u32(cast!(mask[0]), cast!(mask[1]))) != 0
    }
    #[inline(always)]
    fn select(self, mask: Mask, yes: Pack, no: Pack) -> Pack {
        from_fn(|half| cast!(self.neon.vbslq_f32(cast!(mask[half]), cast!(yes[half]), cast!(no[half]))))
    }
    #[inline(always)]
    fn add_where(self, mask: Mask, a: Pack, b: Pack) -> Pack {
        let kept: [u32x4; 2] = from_fn(|half| cast!(self.neon.vandq_u32(cast!(mask[half]), cast!(b[half]))));
        self.add(a, cast!(kept))
    }
    #[inline(always)]
    fn sin_cos_turns(self, a: Pack) -> (Pack, Pack) {
        polynomial::sin_cos_turns(self, a)
    }
    #[inline(always)]
    fn tan(self, a: Pack) -> Pack {
        polynomial::tan(self, a)
    }
}
