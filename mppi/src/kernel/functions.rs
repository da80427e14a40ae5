//! Exponential, logarithm and normal numbers in lanes.

use super::Kernel;
use bicycle::lanes::Real;

/// log2(1 + q) / q in q, 0 <= q <= 1; absolute error of the logarithm below 1.7e-5, which changes a normal number by
/// less than a part in 10^4 (own Remez fit).
const LOG2: [f32; 5] = [1.442_094_7, -0.710_751, 0.420_602_8, -0.199_636_4, 0.047_706_24];
/// sin(2 pi r) / r in r^2, |r| <= 1/2; absolute error of the sine below 7.4e-6, enough for noise (own Remez fit).
const SIN_TURNS: [f32; 5] = [6.283_091, -41.332_71, 81.385_82, -74.571_49, 32.938_44];
/// cos(2 pi r) in r^2, |r| <= 1/2; absolute error below 7.8e-7 (own Remez fit).
const COS_TURNS: [f32; 6] = [0.999_999_2, -19.738_983, 64.928_73, -85.272_4, 58.794_04, -21.076_782];
/// 2^t, |t| <= 1/2; relative error below 7.5e-8 (own Remez fit).
const EXP2: [f32; 6] = [1.0, 0.693_146_94, 0.240_221_2, 0.055_507_134, 0.009_675_541, 0.001_327_647_2];
/// Below this a weight counts as zero: exp(-60) is beyond what an f32 sum of weights can hold.
const NEGLIGIBLE: f64 = -60.0;

/// exp(x) for x <= 0; exactly 0 below -60 and for NaN.
#[inline(always)]
pub(crate) fn exp_of_negative<K: Kernel>(x: Real<K>) -> Real<K> {
    let kernel = x.0;
    let floor = kernel.real(NEGLIGIBLE);
    let scaled = x.max(floor) * kernel.real(std::f64::consts::LOG2_E);
    let rest = scaled.wrap_turns();
    let whole = kernel.truncate((scaled - rest).1);
    let power = kernel.shl::<23>(kernel.add_bits(whole, kernel.word(127)));
    let value = rest.polynomial(&EXP2) * Real(kernel, kernel.as_value(power));
    value.or_else(floor.less(x), kernel.real(0.0))
}

/// Blackman and Vigna's xoshiro128+, one stream per lane.
pub(crate) struct Generator<K: Kernel> {
    kernel: K,
    state: [K::Bits; 4],
}

impl<K: Kernel> Generator<K> {
    /// Streams number first, first + 1, ... under a key: four hashed words each.
    #[inline(always)]
    pub(crate) fn new(kernel: K, key: [u32; 4], first: u32) -> Self {
        let spread = kernel.mul_bits(kernel.count_from(first), kernel.word(0x9e37_79b9));
        let mut state = key.map(|word| mix(kernel, kernel.add_bits(spread, kernel.word(word))));
        // The all-zero state is the one that xoshiro never leaves.
        state[0] = kernel.or_bits(state[0], kernel.word(1));
        Self { kernel, state }
    }

    #[inline(always)]
    pub(crate) fn kernel(&self) -> K {
        self.kernel
    }

    #[inline(always)]
    fn next(&mut self) -> K::Bits {
        let k = self.kernel;
        let [a, b, c, d] = self.state;
        let result = k.add_bits(a, d);
        let shifted = k.shl::<9>(b);
        let (c, d) = (k.xor_bits(c, a), k.xor_bits(d, b));
        let (b, a) = (k.xor_bits(b, c), k.xor_bits(a, d));
        self.state = [a, b, k.xor_bits(c, shifted), k.rotate::<11, 21>(d)];
        result
    }

    /// Uniform in [1, 2).
    #[inline(always)]
    fn uniform(&mut self) -> Real<K> {
        let k = self.kernel;
        let word = self.next();
        Real(k, k.as_value(k.or_bits(k.shr::<9>(word), k.word(0x3f80_0000))))
    }

    /// Two independent standard normal numbers (Box and Muller).
    #[inline(always)]
    pub(crate) fn normals(&mut self) -> [Real<K>; 2] {
        let k = self.kernel;
        let (exponent, rest) = k.split((k.real(2.0) - self.uniform()).1);
        let rest = Real(k, rest);
        let log2 = rest.polynomial(&LOG2).mul_add(rest, Real(k, exponent));
        let radius = (log2 * k.real(-2.0 * std::f64::consts::LN_2)).sqrt();
        let turns = self.uniform().wrap_turns();
        let square = turns * turns;
        [radius * square.polynomial(&COS_TURNS), radius * (turns * square.polynomial(&SIN_TURNS))]
    }
}

/// Appleby's 32-bit finalizer: every input bit moves every output bit.
#[inline(always)]
fn mix<K: Kernel>(k: K, word: K::Bits) -> K::Bits {
    let word = k.mul_bits(k.xor_bits(word, k.shr::<16>(word)), k.word(0x85eb_ca6b));
    let word = k.mul_bits(k.xor_bits(word, k.shr::<13>(word)), k.word(0xc2b2_ae35));
    k.xor_bits(word, k.shr::<16>(word))
}

/// Splits a seed and a counter into the four words that key a cycle's noise (Steele's splitmix64).
pub(crate) fn key(seed: u64, counter: u64) -> [u32; 4] {
    let mut state = seed ^ counter.wrapping_mul(0xd134_2543_de82_ef95);
    let mut next = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 32) as u32
    };
    [next(), next(), next(), next()]
}
