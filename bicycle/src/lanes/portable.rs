//! Packs in plain Rust, for machines without AVX2 or NEON: the compiler makes of them what the target has.

use super::{Constant, Lanes, SPAN, polynomial};

/// Eight f32 without any instruction beyond the target's baseline.
#[derive(Clone, Copy, Debug)]
pub struct Portable;

/// Adding this and subtracting it again rounds an f32 below 2^22 to a whole number.
const ROUNDER: f32 = 12_582_912.0;

type Pack = [f32; 8];

#[inline(always)]
fn zip(a: Pack, b: Pack, of: impl Fn(f32, f32) -> f32) -> Pack {
    std::array::from_fn(|i| of(a[i], b[i]))
}

impl Lanes for Portable {
    type Value = Pack;
    type Mask = [bool; 8];
    const WIDTH: usize = 8;

    #[inline(always)]
    fn constant(self, value: Constant) -> Pack {
        [value.single(); 8]
    }
    #[inline(always)]
    fn single(self, value: f32) -> Pack {
        [value; 8]
    }
    #[inline(always)]
    fn of_span(self, span: &[f32; SPAN], offset: usize) -> Pack {
        std::array::from_fn(|i| span[offset + i])
    }
    #[inline(always)]
    fn to_span(self, value: Pack, span: &mut [f32; SPAN], offset: usize) {
        span[offset..offset + Self::WIDTH].copy_from_slice(&value);
    }
    #[inline(always)]
    fn add(self, a: Pack, b: Pack) -> Pack {
        zip(a, b, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, a: Pack, b: Pack) -> Pack {
        zip(a, b, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, a: Pack, b: Pack) -> Pack {
        zip(a, b, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, a: Pack, b: Pack) -> Pack {
        zip(a, b, |a, b| a / b)
    }
    #[inline(always)]
    fn mul_add(self, a: Pack, b: Pack, c: Pack) -> Pack {
        self.add(self.mul(a, b), c)
    }
    #[inline(always)]
    fn min(self, a: Pack, b: Pack) -> Pack {
        zip(a, b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, a: Pack, b: Pack) -> Pack {
        zip(a, b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn magnitude(self, a: Pack) -> Pack {
        a.map(f32::abs)
    }
    #[inline(always)]
    fn sqrt(self, a: Pack) -> Pack {
        a.map(|a| if a <= 0.0 { 0.0 } else { a.sqrt() })
    }
    #[inline(always)]
    fn wrap_turns(self, a: Pack) -> Pack {
        a.map(|a| a - ((a + ROUNDER) - ROUNDER))
    }
    #[inline(always)]
    fn less(self, a: Pack, b: Pack) -> [bool; 8] {
        std::array::from_fn(|i| a[i] < b[i])
    }
    #[inline(always)]
    fn exceeds(self, a: Pack, b: Pack) -> [bool; 8] {
        std::array::from_fn(|i| a[i] > b[i] || a[i].is_nan() || b[i].is_nan())
    }
    #[inline(always)]
    fn and(self, a: [bool; 8], b: [bool; 8]) -> [bool; 8] {
        std::array::from_fn(|i| a[i] & b[i])
    }
    #[inline(always)]
    fn or(self, a: [bool; 8], b: [bool; 8]) -> [bool; 8] {
        std::array::from_fn(|i| a[i] | b[i])
    }
    #[inline(always)]
    fn any(self, mask: [bool; 8]) -> bool {
        mask.into_iter().any(|holds| holds)
    }
    #[inline(always)]
    fn select(self, mask: [bool; 8], yes: Pack, no: Pack) -> Pack {
        std::array::from_fn(|i| if mask[i] { yes[i] } else { no[i] })
    }
    #[inline(always)]
    fn add_where(self, mask: [bool; 8], a: Pack, b: Pack) -> Pack {
        self.select(mask, self.add(a, b), a)
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
