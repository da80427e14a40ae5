//! The reference: one number, f64, functions that are the same on every platform.

use super::{Constant, Lanes, SPAN};

/// One f64.
#[derive(Clone, Copy, Debug)]
pub struct Scalar;

impl Lanes for Scalar {
    type Value = f64;
    type Mask = bool;
    const WIDTH: usize = 1;

    fn constant(self, value: Constant) -> f64 {
        value.value()
    }
    fn single(self, value: f32) -> f64 {
        f64::from(value)
    }
    fn of_span(self, span: &[f32; SPAN], offset: usize) -> f64 {
        f64::from(span[offset])
    }
    fn to_span(self, value: f64, span: &mut [f32; SPAN], offset: usize) {
        span[offset] = value as f32;
    }
    fn add(self, a: f64, b: f64) -> f64 {
        a + b
    }
    fn sub(self, a: f64, b: f64) -> f64 {
        a - b
    }
    fn mul(self, a: f64, b: f64) -> f64 {
        a * b
    }
    fn div(self, a: f64, b: f64) -> f64 {
        a / b
    }
    fn mul_add(self, a: f64, b: f64, c: f64) -> f64 {
        a * b + c
    }
    fn min(self, a: f64, b: f64) -> f64 {
        if a < b { a } else { b }
    }
    fn max(self, a: f64, b: f64) -> f64 {
        if a > b { a } else { b }
    }
    fn magnitude(self, a: f64) -> f64 {
        a.abs()
    }
    fn sqrt(self, a: f64) -> f64 {
        if a <= 0.0 { 0.0 } else { a.sqrt() }
    }
    fn wrap_turns(self, a: f64) -> f64 {
        a - a.round_ties_even()
    }
    fn less(self, a: f64, b: f64) -> bool {
        a < b
    }
    fn exceeds(self, a: f64, b: f64) -> bool {
        !matches!(a.partial_cmp(&b), Some(std::cmp::Ordering::Less | std::cmp::Ordering::Equal))
    }
    fn and(self, a: bool, b: bool) -> bool {
        a && b
    }
    fn or(self, a: bool, b: bool) -> bool {
        a || b
    }
    fn any(self, mask: bool) -> bool {
        mask
    }
    fn select(self, mask: bool, yes: f64, no: f64) -> f64 {
        if mask { yes } else { no }
    }
    fn add_where(self, mask: bool, a: f64, b: f64) -> f64 {
        if mask { a + b } else { a }
    }
    fn sin_cos_turns(self, a: f64) -> (f64, f64) {
        libm::sincos(a * std::f64::consts::TAU)
    }
    fn tan(self, a: f64) -> f64 {
        libm::tan(a)
    }
}
