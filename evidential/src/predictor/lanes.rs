//! The functions that the networks need of numbers of several footprints side by side.
//!
//! Everything is written in registers of any instruction set. What is no matrix product keeps products and sums apart,
//! so that every instruction set gives the same bits.

use bicycle::lanes::Block;
use pulp::Simd;

/// a b + c, rounded once by the sets that do both in one instruction; registers of one number have none.
#[inline(always)]
pub(crate) fn mul_add<S: Simd>(simd: S, a: S::f32s, b: S::f32s, c: S::f32s) -> S::f32s {
    if S::F32_LANES > 1 { simd.mul_add_f32s(a, b, c) } else { simd.add_f32s(simd.mul_f32s(a, b), c) }
}

/// ln 2 in two parts, the first exact in few bits.
const LN_2: [f32; 2] = [355.0 / 512.0, -2.121_944_4e-4];

/// Largest argument of [`exp`] and, negated, the smallest: e^87 and e^-87 are normal numbers in f32.
const EXP_MAX: f32 = 87.0;

/// Exponential function, relative error below 2e-7; arguments are cut to [-87, 87].
#[inline(always)]
pub(crate) fn exp<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    // 1.5 * 2^23: adding it rounds to an integer, which stands in the low bits.
    const ROUND: f32 = 12_582_912.0;
    // Minimax of (e^r - 1 - r) / r^2 on |r| <= ln 2 / 2 (Cephes).
    const COEFFICIENTS: [f32; 6] =
        [1.987_569_1e-4, 1.398_199_9e-3, 8.333_452e-3, 4.166_579_5e-2, 1.666_666_5e-1, 0.5];
    let real = |value: f32| simd.splat_f32s(value);
    let x = simd.min_f32s(simd.max_f32s(x, real(-EXP_MAX)), real(EXP_MAX));
    let rounded = simd.add_f32s(simd.mul_f32s(x, real(std::f32::consts::LOG2_E)), real(ROUND));
    let power = simd.sub_f32s(rounded, real(ROUND));
    let r = simd.sub_f32s(x, simd.mul_f32s(power, real(LN_2[0])));
    let r = simd.sub_f32s(r, simd.mul_f32s(power, real(LN_2[1])));
    let series = polynomial(simd, r, &COEFFICIENTS);
    let near = simd.add_f32s(simd.mul_f32s(series, simd.mul_f32s(r, r)), simd.add_f32s(r, real(1.0)));
    let bits = simd.wrapping_dyn_shl_u32s(simd.transmute_u32s_f32s(rounded), simd.splat_u32s(23));
    let two_to_power = simd.transmute_f32s_u32s(simd.add_u32s(bits, simd.splat_u32s(127 << 23)));
    simd.mul_f32s(near, two_to_power)
}

/// Natural logarithm of a normal positive number, absolute error below 2e-7 times one or the result; what is smaller
/// counts as the smallest normal number.
#[inline(always)]
pub(crate) fn ln<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    // Minimax of (ln(1 + m) - m + m^2 / 2) / m^3 on sqrt(1/2) <= 1 + m <= sqrt(2) (Cephes).
    const COEFFICIENTS: [f32; 9] = [
        7.037_683_6e-2,
        -1.151_461e-1,
        1.167_699_9e-1,
        -1.242_014_1e-1,
        1.424_932_3e-1,
        -1.666_805_8e-1,
        2.000_071_5e-1,
        -2.499_999_4e-1,
        3.333_333e-1,
    ];
    // sqrt(1/2), below which the mantissa takes its factor 2 from the exponent.
    const SPLIT: u32 = 0x3f35_04f3;
    // The bits of 2^23, whose last digit counts ones.
    const COUNTER: u32 = 0x4b00_0000;
    let (real, word) = (|value: f32| simd.splat_f32s(value), |value: u32| simd.splat_u32s(value));
    let bits = simd.transmute_u32s_f32s(simd.max_f32s(x, real(f32::MIN_POSITIVE)));
    let shifted = simd.sub_u32s(bits, word(SPLIT));
    let biased = simd.wrapping_dyn_shr_u32s(simd.add_u32s(shifted, word(127 << 23)), word(23));
    let exponent = simd.transmute_f32s_u32s(simd.or_u32s(biased, word(COUNTER)));
    let exponent = simd.sub_f32s(exponent, real(8_388_608.0 + 127.0));
    let mantissa = simd.add_u32s(simd.and_u32s(shifted, word(0x007f_ffff)), word(SPLIT));
    let m = simd.sub_f32s(simd.transmute_f32s_u32s(mantissa), real(1.0));
    let series = polynomial(simd, m, &COEFFICIENTS);
    let squared = simd.mul_f32s(m, m);
    let small =
        simd.sub_f32s(simd.mul_f32s(simd.mul_f32s(series, m), squared), simd.mul_f32s(squared, real(0.5)));
    let small = simd.add_f32s(small, simd.mul_f32s(exponent, real(LN_2[1])));
    simd.add_f32s(simd.add_f32s(m, small), simd.mul_f32s(exponent, real(LN_2[0])))
}

/// A polynomial by its coefficients, highest power first.
#[inline(always)]
fn polynomial<S: Simd, const N: usize>(simd: S, x: S::f32s, coefficients: &[f32; N]) -> S::f32s {
    let mut sum = simd.splat_f32s(coefficients[0]);
    for coefficient in &coefficients[1..] {
        sum = simd.add_f32s(simd.mul_f32s(sum, x), simd.splat_f32s(*coefficient));
    }
    sum
}

/// 1 / (1 + e^-x).
#[inline(always)]
pub(crate) fn sigmoid<S: Simd>(simd: S, x: S::f32s) -> S::f32s {
    let one = simd.splat_f32s(1.0);
    simd.div_f32s(one, simd.add_f32s(one, exp(simd, simd.neg_f32s(x))))
}

/// Turns one number per bin into probabilities.
#[inline(always)]
pub(crate) fn softmax<S: Simd, const N: usize>(simd: S, logits: &mut [Block; N]) {
    for register in 0..Block::n_registers::<S>() {
        let mut largest = logits[0].get::<S>(register);
        for logit in &logits[1..] {
            largest = simd.max_f32s(largest, logit.get::<S>(register));
        }
        let mut sum = simd.splat_f32s(0.0);
        for logit in logits.iter_mut() {
            let weight = exp(simd, simd.sub_f32s(logit.get::<S>(register), largest));
            sum = simd.add_f32s(sum, weight);
            logit.set::<S>(register, weight);
        }
        let per_sum = simd.div_f32s(simd.splat_f32s(1.0), sum);
        for logit in logits.iter_mut() {
            logit.set::<S>(register, simd.mul_f32s(logit.get::<S>(register), per_sum));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In the one lane of the plainest instruction set.
    fn exp(x: f32) -> f32 {
        super::exp(pulp::Scalar, x)
    }

    fn ln(x: f32) -> f32 {
        super::ln(pulp::Scalar, x)
    }

    #[test]
    fn the_exponential_agrees_with_the_library() {
        for step in -870_000..=870_000 {
            let x = step as f32 * 1e-4;
            let (found, expected) = (f64::from(exp(x)), f64::from(x).exp());
            assert!((found / expected - 1.0).abs() < 2e-7, "{x}: {found} {expected}");
        }
        for x in [1e30, f32::INFINITY] {
            assert_eq!((exp(x), exp(-x)), (exp(87.0), exp(-87.0)));
        }
    }

    #[test]
    fn the_logarithm_agrees_with_the_library() {
        for step in -87_000..=88_000 {
            let x = (step as f32 * 1e-3).exp();
            let (found, expected) = (f64::from(ln(x)), f64::from(x).ln());
            assert!((found - expected).abs() < 2e-7 * expected.abs().max(1.0), "{x}: {found} {expected}");
        }
        assert_eq!(ln(1.0), 0.0);
        assert_eq!((ln(0.0), ln(-3.0)), (ln(f32::MIN_POSITIVE), ln(f32::MIN_POSITIVE)));
    }

    #[test]
    fn probabilities_follow_from_logits_of_any_size() {
        let mut logits = [Block::filled(-1e6), Block::filled(3.0), Block::filled(3.0 + 2f32.ln())];
        logits[0].0[1] = 1e6;
        softmax(pulp::Scalar, &mut logits);
        for (found, expected) in [(logits[0].0[0], 0.0), (logits[1].0[0], 1.0 / 3.0), (logits[0].0[1], 1.0)] {
            assert!((found - expected).abs() < 1e-6, "{found} {expected}");
        }
    }

    /// All functions of some numbers.
    struct Functions<'a>(&'a mut [Block; 3]);

    impl pulp::WithSimd for Functions<'_> {
        type Output = ();

        fn with_simd<S: Simd>(self, simd: S) {
            for register in 0..Block::n_registers::<S>() {
                let x = self.0[0].get::<S>(register);
                self.0[1].set::<S>(register, super::exp(simd, x));
                self.0[2].set::<S>(register, sigmoid(simd, super::ln(simd, simd.mul_f32s(x, x))));
            }
            softmax(simd, self.0);
        }
    }

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        let x = Block(std::array::from_fn(|lane| 0.37 * lane as f32 - 5.0));
        let mut plain = [x; 3];
        pulp::WithSimd::with_simd(Functions(&mut plain), pulp::Scalar);
        for instructions in bicycle::lanes::Instructions::all() {
            let mut found = [x; 3];
            instructions.run(Functions(&mut found));
            assert_eq!(found, plain, "{instructions:?}");
        }
    }
}
