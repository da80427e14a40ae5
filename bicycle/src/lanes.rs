//! One set of equations for one number or for a pack of them: the arithmetic that the model is written in.
//!
//! [`Scalar`] computes in f64 and is the reference; the packs compute in f32, one vehicle per lane.

mod block;
mod instructions;
mod neon;
mod packs;
mod polynomial;
mod portable;
mod scalar;

pub use block::{BLOCK, Block};
pub use instructions::{Instructions, Isa, IsaAbsent, OnLanes};
pub use portable::Portable;
pub use scalar::Scalar;

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A constant kept in both precisions, so that a kernel loads it without a conversion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Constant {
    double: f64,
    single: f32,
}

impl Constant {
    /// Both forms of a value.
    pub const fn new(value: f64) -> Self {
        Self { double: value, single: value as f32 }
    }

    /// The value as given.
    pub fn value(self) -> f64 {
        self.double
    }

    /// The value rounded to f32.
    pub fn single(self) -> f32 {
        self.single
    }
}

/// Numbers that are read and written at a time: as many as the widest pack has.
pub const SPAN: usize = 16;

/// Arithmetic on packs of numbers. A value of this type proves that the machine has the instructions.
///
/// `min` and `max` return their second operand when either is NaN, on every implementation.
pub trait Lanes: Copy + Send + Sync + 'static {
    /// A pack of numbers.
    type Value: Copy + Send + Sync;
    /// A pack of truth values.
    type Mask: Copy;
    /// Numbers in a pack.
    const WIDTH: usize;

    /// The same number in every lane.
    fn constant(self, value: Constant) -> Self::Value;
    /// The same number in every lane, one that was single from the start.
    fn single(self, value: f32) -> Self::Value;
    /// The pack of [`Lanes::WIDTH`] numbers from `offset` on, a multiple of it.
    fn of_span(self, span: &[f32; SPAN], offset: usize) -> Self::Value;
    /// Writes a pack from `offset` on, a multiple of [`Lanes::WIDTH`].
    fn to_span(self, value: Self::Value, span: &mut [f32; SPAN], offset: usize);
    /// a + b.
    fn add(self, a: Self::Value, b: Self::Value) -> Self::Value;
    /// a - b.
    fn sub(self, a: Self::Value, b: Self::Value) -> Self::Value;
    /// a b.
    fn mul(self, a: Self::Value, b: Self::Value) -> Self::Value;
    /// a / b.
    fn div(self, a: Self::Value, b: Self::Value) -> Self::Value;
    /// a b + c, rounded once where the machine can.
    fn mul_add(self, a: Self::Value, b: Self::Value, c: Self::Value) -> Self::Value;
    /// Smaller of both; `b` where either is NaN.
    fn min(self, a: Self::Value, b: Self::Value) -> Self::Value;
    /// Larger of both; `b` where either is NaN.
    fn max(self, a: Self::Value, b: Self::Value) -> Self::Value;
    /// `a` brought into [low, high]; NaN stays NaN, and bounds that are NaN bound nothing or give NaN.
    #[inline(always)]
    fn clamp(self, a: Self::Value, low: Self::Value, high: Self::Value) -> Self::Value {
        self.min(high, self.max(low, a))
    }
    /// A polynomial by its coefficients, lowest power first; in which order it is summed up is the instructions' choice.
    #[inline(always)]
    fn polynomial<const N: usize>(self, z: Self::Value, coefficients: &[f32; N]) -> Self::Value {
        let mut sum = self.single(coefficients[N - 1]);
        for i in (0..N - 1).rev() {
            sum = self.mul_add(sum, z, self.single(coefficients[i]));
        }
        sum
    }
    /// Magnitude.
    fn magnitude(self, a: Self::Value) -> Self::Value;
    /// Square root, rounded once; of a negative number, 0; of NaN, NaN.
    fn sqrt(self, a: Self::Value) -> Self::Value;
    /// An angle in turns brought to [-1/2, 1/2] by whole turns; |a| < 4 million. Of what is not finite, NaN.
    fn wrap_turns(self, a: Self::Value) -> Self::Value;
    /// [`Lanes::wrap_turns`] of an angle that a rate led to, and a witness: where the rate is finite, the wrapped angle and
    /// the witness as it was; where it is not, NaN in one of the two at least. For instructions that wrap fastest where
    /// they hide infinity.
    #[inline(always)]
    fn wrap_witnessed(self, a: Self::Value, _rate: Self::Value, witness: Self::Value) -> [Self::Value; 2] {
        [self.wrap_turns(a), witness]
    }
    /// Where a < b.
    fn less(self, a: Self::Value, b: Self::Value) -> Self::Mask;
    /// Where a > b or either is NaN.
    fn exceeds(self, a: Self::Value, b: Self::Value) -> Self::Mask;
    /// Where both hold.
    fn and(self, a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Where either holds.
    fn or(self, a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Whether the mask holds in any lane.
    fn any(self, mask: Self::Mask) -> bool;
    /// `yes` where the mask holds, `no` elsewhere.
    fn select(self, mask: Self::Mask, yes: Self::Value, no: Self::Value) -> Self::Value;
    /// a + b where the mask holds, a elsewhere.
    fn add_where(self, mask: Self::Mask, a: Self::Value, b: Self::Value) -> Self::Value;
    /// Sine and cosine of an angle in turns within [-1/2, 1/2]; packs: absolute error below 5e-7.
    fn sin_cos_turns(self, a: Self::Value) -> (Self::Value, Self::Value);
    /// Tangent of an angle of at most [`STEERING_DOMAIN_RAD`]; packs: absolute error below 5e-7.
    fn tan(self, a: Self::Value) -> Self::Value;

    /// A number in every lane.
    #[inline(always)]
    fn real(self, value: f64) -> Real<Self> {
        Real(self, self.constant(Constant::new(value)))
    }

    /// A number in every lane that was single from the start.
    #[inline(always)]
    fn real_single(self, value: f32) -> Real<Self> {
        Real(self, self.single(value))
    }

    /// See [`Lanes::of_span`].
    #[inline(always)]
    fn real_of_span(self, span: &[f32; SPAN], offset: usize) -> Real<Self> {
        Real(self, self.of_span(span, offset))
    }
}

/// Largest steering angle for which [`Lanes::tan`] is exact enough [rad].
pub const STEERING_DOMAIN_RAD: f64 = 0.8;

/// A pack of real numbers with the usual operators.
#[derive(Clone, Copy)]
pub struct Real<L: Lanes>(pub L, pub L::Value);

impl<L: Lanes> Real<L> {
    /// A constant in every lane.
    #[inline(always)]
    pub fn constant(lanes: L, value: Constant) -> Self {
        Self(lanes, lanes.constant(value))
    }

    /// self * by + plus.
    #[inline(always)]
    pub fn mul_add(self, by: Self, plus: Self) -> Self {
        Self(self.0, self.0.mul_add(self.1, by.1, plus.1))
    }

    /// Smaller of both; `other` where either is NaN.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        Self(self.0, self.0.min(self.1, other.1))
    }

    /// Larger of both; `other` where either is NaN.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        Self(self.0, self.0.max(self.1, other.1))
    }

    /// See [`Lanes::clamp`].
    #[inline(always)]
    pub fn clamp(self, low: Self, high: Self) -> Self {
        Self(self.0, self.0.clamp(self.1, low.1, high.1))
    }

    /// See [`Lanes::polynomial`].
    #[inline(always)]
    pub fn polynomial<const N: usize>(self, coefficients: &[f32; N]) -> Self {
        Self(self.0, self.0.polynomial(self.1, coefficients))
    }

    /// Square root, see [`Lanes::sqrt`].
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Self(self.0, self.0.sqrt(self.1))
    }

    /// Magnitude.
    #[inline(always)]
    pub fn abs(self) -> Self {
        Self(self.0, self.0.magnitude(self.1))
    }

    /// See [`Lanes::wrap_turns`].
    #[inline(always)]
    pub fn wrap_turns(self) -> Self {
        Self(self.0, self.0.wrap_turns(self.1))
    }

    /// See [`Lanes::wrap_witnessed`].
    #[inline(always)]
    pub fn wrap_witnessed(self, rate: Self, witness: Self) -> [Self; 2] {
        self.0.wrap_witnessed(self.1, rate.1, witness.1).map(|value| Self(self.0, value))
    }

    /// See [`Lanes::sin_cos_turns`].
    #[inline(always)]
    pub fn sin_cos_turns(self) -> (Self, Self) {
        let (sine, cosine) = self.0.sin_cos_turns(self.1);
        (Self(self.0, sine), Self(self.0, cosine))
    }

    /// See [`Lanes::tan`].
    #[inline(always)]
    pub fn tan(self) -> Self {
        Self(self.0, self.0.tan(self.1))
    }

    /// Where self < other.
    #[inline(always)]
    pub fn less(self, other: Self) -> L::Mask {
        self.0.less(self.1, other.1)
    }

    /// Where self > limit or is NaN.
    #[inline(always)]
    pub fn exceeds(self, limit: Self) -> L::Mask {
        self.0.exceeds(self.1, limit.1)
    }

    /// self + term where the mask holds.
    #[inline(always)]
    pub fn add_where(self, mask: L::Mask, term: Self) -> Self {
        Self(self.0, self.0.add_where(mask, self.1, term.1))
    }

    /// self where the mask holds, `other` elsewhere.
    #[inline(always)]
    pub fn or_else(self, mask: L::Mask, other: Self) -> Self {
        Self(self.0, self.0.select(mask, self.1, other.1))
    }
}

macro_rules! operator {
    ($trait:ident, $method:ident) => {
        impl<L: Lanes> $trait for Real<L> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0, self.0.$method(self.1, other.1))
            }
        }
    };
}
operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);
operator!(Div, div);

impl<L: Lanes> Neg for Real<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.0.real(0.0) - self
    }
}
