//! What the inner loops need of a machine beyond [`Lanes`]: bits, loads, stores and table lookups, and how work
//! is run on the instruction set that was chosen.
//!
//! Two modules below hold the crate's `unsafe`: [`lookup`] reads tables at indices that it has clamped itself, and
//! [`workers`] lends a borrowed job to threads that outlive it.

mod avx2;
mod avx512;
pub(crate) mod functions;
#[allow(unsafe_code)]
mod lookup;
mod neon;
mod portable;
mod primitives;
#[allow(unsafe_code)]
pub(crate) mod workers;

use bicycle::lanes::{Instructions, Lanes, Portable, Real};
use traversability::{Ground, Risk};

/// Rollouts that are stored side by side and handed to a thread together.
pub(crate) const CHUNK: usize = 64;

/// One number for every rollout of a chunk.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Row(pub(crate) [f32; CHUNK]);

impl Row {
    pub(crate) const ZERO: Self = Self([0.0; CHUNK]);
}

/// Instructions of the inner loops.
pub(crate) trait Kernel: Lanes {
    /// A pack of 32-bit words.
    type Bits: Copy;
    /// Packs that the rollout keeps in flight to hide latency.
    const IN_FLIGHT: usize;

    /// The pack that starts at `offset` of a row; panics beyond the row.
    fn load(self, row: &Row, offset: usize) -> Self::Value;
    /// Writes a pack to a row from `offset` on; panics beyond the row.
    fn store(self, row: &mut Row, offset: usize, value: Self::Value);
    /// The first `WIDTH` of these sixteen values.
    fn load_lanes(self, values: &[f32; 16]) -> Self::Value;
    /// first, first + 1, ... in the lanes.
    fn count_from(self, first: u32) -> Self::Bits;
    /// The same word in every lane.
    fn word(self, value: u32) -> Self::Bits;
    /// a + b, wrapping.
    fn add_bits(self, a: Self::Bits, b: Self::Bits) -> Self::Bits;
    /// a b, wrapping.
    fn mul_bits(self, a: Self::Bits, b: Self::Bits) -> Self::Bits;
    /// a ^ b.
    fn xor_bits(self, a: Self::Bits, b: Self::Bits) -> Self::Bits;
    /// a | b.
    fn or_bits(self, a: Self::Bits, b: Self::Bits) -> Self::Bits;
    /// a & b.
    fn and_bits(self, a: Self::Bits, b: Self::Bits) -> Self::Bits;
    /// a << N.
    fn shl<const N: u32>(self, a: Self::Bits) -> Self::Bits;
    /// a >> N, zeros enter.
    fn shr<const N: u32>(self, a: Self::Bits) -> Self::Bits;
    /// The words as f32 bit patterns.
    fn as_value(self, bits: Self::Bits) -> Self::Value;
    /// The f32 bit patterns as words.
    fn as_bits(self, value: Self::Value) -> Self::Bits;
    /// Towards zero; NaN and what does not fit give some word.
    fn truncate(self, value: Self::Value) -> Self::Bits;
    /// Towards zero and at most `last`, a whole number; of a negative number or of NaN, some word that is.
    #[inline(always)]
    fn truncate_up_to(self, value: Self::Value, last: Self::Value) -> Self::Bits {
        self.truncate(self.min(value, last))
    }
    /// Towards zero, at least 0 and at most `last`, a whole number; of NaN, 0.
    #[inline(always)]
    fn truncate_within(self, value: Self::Value, last: Self::Value) -> Self::Bits {
        // In this order NaN becomes a place too.
        self.truncate(self.min(self.max(value, self.single(0.0)), last))
    }
    /// Signed words as numbers.
    fn convert(self, bits: Self::Bits) -> Self::Value;
    /// Linear traction, angular traction, roll, pitch at these indices; beyond the table, of its last entry.
    fn risks(self, table: &[Risk], indices: Self::Bits) -> [Self::Value; 4];
    /// Entries at these indices; beyond the table, the last one.
    fn gather(self, table: &[f32], indices: Self::Bits) -> Self::Value;
    /// The words; beyond the first `WIDTH`, anything.
    fn words(self, bits: Self::Bits) -> [u32; 16];
    /// Sum of the lanes, the upper half added to the lower until one is left.
    fn sum(self, value: Self::Value) -> f32;
    /// [`Kernel::sum`] of four at once, to the bit.
    #[inline(always)]
    fn sums(self, values: [Self::Value; 4]) -> [f32; 4] {
        values.map(|value| self.sum(value))
    }
    /// Smallest of the lanes.
    fn smallest(self, value: Self::Value) -> f32;

    /// Gradient east, gradient north, class and friction at these indices; beyond the table, of its last entry.
    #[inline(always)]
    fn grounds(self, table: &[Ground], indices: Self::Bits) -> [Self::Value; 4] {
        let rows = lookup::grounds(table, self.words(indices));
        [0, 1, 2, 3].map(|column| self.load_lanes(&rows.map(|row| row[column])))
    }

    /// Fastest speed that the ground at these indices allows [m/s]; beyond the table, of its last entry.
    #[inline(always)]
    fn fastest_mps(self, table: &[Ground], indices: Self::Bits) -> Self::Value {
        self.load_lanes(&lookup::fastest_mps(table, self.words(indices)))
    }

    /// Exponent and mantissa less one: value = 2^exponent (1 + rest), for normal value > 0.
    #[inline(always)]
    fn split(self, value: Self::Value) -> (Self::Value, Self::Value) {
        let bits = self.as_bits(value);
        let exponent = Real(self, self.convert(self.shr::<23>(bits))) - self.real(127.0);
        let mantissa = self.or_bits(self.and_bits(bits, self.word(0x007f_ffff)), self.word(0x3f80_0000));
        (exponent.1, (Real(self, self.as_value(mantissa)) - self.real(1.0)).1)
    }

    /// a <<< N, bits that leave enter on the right; N + M must be 32.
    #[inline(always)]
    fn rotate<const N: u32, const M: u32>(self, a: Self::Bits) -> Self::Bits {
        self.or_bits(self.shl::<N>(a), self.shr::<M>(a))
    }
}

/// A piece of work written for any instruction set.
pub(crate) trait Work {
    type Output;
    fn run<K: Kernel>(self, kernel: K) -> Self::Output;
}

#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
struct Vectorized<K, W>(K, W);

#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
impl<K: Kernel, W: Work> pulp::NullaryFnOnce for Vectorized<K, W> {
    type Output = W::Output;
    #[inline(always)]
    fn call(self) -> W::Output {
        self.1.run(self.0)
    }
}

/// Runs the work with these instructions. Work that does not depend on the model has a function of its own that calls
/// this, so that its loops are compiled in this crate and once.
#[inline]
pub(crate) fn run<W: Work>(instructions: Instructions, work: W) -> W::Output {
    match instructions {
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx512(kernel) => kernel.vectorize(Vectorized(kernel, work)),
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx2(kernel) => kernel.vectorize(Vectorized(kernel, work)),
        #[cfg(target_arch = "aarch64")]
        Instructions::Neon(kernel) => kernel.vectorize(Vectorized(kernel, work)),
        Instructions::Portable => work.run(Portable),
    }
}
