//! Numbers into the registers of an instruction set, and out of them.

use super::WIDEST;
use bicycle::lanes::{Lanes, Portable, Real};
#[cfg(target_arch = "x86_64")]
use pulp::{f32x8, f32x16};

/// Packs that can be filled from numbers and read.
pub(super) trait Pack: Lanes {
    fn pack(values: &[f32; WIDEST]) -> Self::Value;
    fn unpack(value: Self::Value) -> [f32; WIDEST];
}

#[inline(always)]
fn first_eight(values: &[f32; WIDEST]) -> [f32; 8] {
    let mut eight = [0.0; 8];
    eight.copy_from_slice(&values[..8]);
    eight
}

#[inline(always)]
fn widened(values: [f32; 8]) -> [f32; WIDEST] {
    let mut wide = [0.0; WIDEST];
    wide[..8].copy_from_slice(&values);
    wide
}

impl Pack for Portable {
    #[inline(always)]
    fn pack(values: &[f32; WIDEST]) -> [f32; 8] {
        first_eight(values)
    }
    #[inline(always)]
    fn unpack(value: [f32; 8]) -> [f32; WIDEST] {
        widened(value)
    }
}

#[cfg(target_arch = "x86_64")]
impl Pack for pulp::x86::V3 {
    #[inline(always)]
    fn pack(values: &[f32; WIDEST]) -> f32x8 {
        pulp::cast(first_eight(values))
    }
    #[inline(always)]
    fn unpack(value: f32x8) -> [f32; WIDEST] {
        widened(pulp::cast(value))
    }
}

#[cfg(target_arch = "aarch64")]
impl Pack for pulp::aarch64::Neon {
    #[inline(always)]
    fn pack(values: &[f32; WIDEST]) -> [pulp::f32x4; 2] {
        pulp::cast(first_eight(values))
    }
    #[inline(always)]
    fn unpack(value: [pulp::f32x4; 2]) -> [f32; WIDEST] {
        widened(pulp::cast(value))
    }
}

#[cfg(target_arch = "x86_64")]
impl Pack for pulp::x86::V4 {
    #[inline(always)]
    fn pack(values: &[f32; WIDEST]) -> f32x16 {
        pulp::cast(*values)
    }
    #[inline(always)]
    fn unpack(value: f32x16) -> [f32; WIDEST] {
        pulp::cast(value)
    }
}

/// What is told of every lane: in a loop, which is compiled in place, as `array::map` is not always.
#[inline(always)]
pub(super) fn packed<L: Pack>(lanes: L, told: impl Fn(usize) -> f32) -> Real<L> {
    let mut values = [0.0; WIDEST];
    for (lane, value) in values.iter_mut().enumerate().take(L::WIDTH) {
        *value = told(lane);
    }
    Real(lanes, L::pack(&values))
}
