//! Numbers of several footprints side by side, and the functions that the networks need of them.
//!
//! Loops over lanes have a fixed length and no branches, so that they become vector instructions inside
//! [`pulp::Arch::dispatch`]. Products and sums stay apart, so that every instruction set gives the same bits.

/// Footprints that are worked on together: two registers of the widest instruction set.
pub(crate) const N_LANES: usize = 32;

/// One number of [`N_LANES`] footprints.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub(crate) struct Lanes(pub [f32; N_LANES]);

impl Lanes {
    pub const ZERO: Self = Self([0.0; N_LANES]);

    #[inline(always)]
    pub fn map(self, function: impl Fn(f32) -> f32) -> Self {
        let mut result = self;
        for lane in 0..N_LANES {
            result.0[lane] = function(self.0[lane]);
        }
        result
    }

    #[inline(always)]
    pub fn zip(self, other: Self, function: impl Fn(f32, f32) -> f32) -> Self {
        let mut result = self;
        for lane in 0..N_LANES {
            result.0[lane] = function(self.0[lane], other.0[lane]);
        }
        result
    }
}

/// Largest argument of [`exp`] and, negated, the smallest: e^87 and e^-87 are normal numbers in f32.
const EXP_MAX: f32 = 87.0;

/// Exponential function, relative error below 2e-7; arguments are cut to [-87, 87].
#[inline(always)]
pub(crate) fn exp(x: f32) -> f32 {
    // 1.5 * 2^23: adding it rounds to an integer, which stands in the low bits.
    const ROUND: f32 = 12_582_912.0;
    // ln 2 in two parts, the first exact in few bits.
    const LN_2: [f32; 2] = [0.693_359_375, -2.121_944_4e-4];
    // Minimax of (e^r - 1 - r) / r^2 on |r| <= ln 2 / 2 (Cephes).
    const COEFFICIENTS: [f32; 6] =
        [1.987_569_1e-4, 1.398_199_9e-3, 8.333_452e-3, 4.166_579_5e-2, 1.666_666_5e-1, 0.5];
    let x = x.clamp(-EXP_MAX, EXP_MAX);
    let rounded = x * std::f32::consts::LOG2_E + ROUND;
    let power = rounded - ROUND;
    let r = x - power * LN_2[0] - power * LN_2[1];
    let mut series = COEFFICIENTS[0];
    for coefficient in &COEFFICIENTS[1..] {
        series = series * r + coefficient;
    }
    let two_to_power = f32::from_bits((rounded.to_bits() << 23).wrapping_add(127 << 23));
    (series * (r * r) + r + 1.0) * two_to_power
}

/// Natural logarithm of a normal positive number, absolute error below 2e-7 times one or the result; what is smaller
/// counts as the smallest normal number.
#[inline(always)]
pub(crate) fn ln(x: f32) -> f32 {
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
    let bits = x.max(f32::MIN_POSITIVE).to_bits();
    let shifted = bits.wrapping_sub(SPLIT);
    let exponent = ((shifted as i32) >> 23) as f32;
    let m = f32::from_bits((shifted & 0x007f_ffff).wrapping_add(SPLIT)) - 1.0;
    let mut series = COEFFICIENTS[0];
    for coefficient in &COEFFICIENTS[1..] {
        series = series * m + coefficient;
    }
    let squared = m * m;
    let small = series * m * squared - 0.5 * squared + exponent * -2.121_944_4e-4;
    m + small + exponent * 0.693_359_375
}

/// 1 / (1 + e^-x).
#[inline(always)]
pub(crate) fn sigmoid(x: f32) -> f32 {
    1.0 / (1.0 + exp(-x))
}

/// Turns one number per bin into probabilities.
#[inline(always)]
pub(crate) fn softmax<const N: usize>(logits: &mut [Lanes; N]) {
    let mut largest = logits[0];
    for logit in &logits[1..] {
        largest = largest.zip(*logit, |a, b| if a > b { a } else { b });
    }
    let mut sum = Lanes::ZERO;
    for logit in logits.iter_mut() {
        *logit = logit.zip(largest, |logit, largest| exp(logit - largest));
        sum = sum.zip(*logit, |sum, weight| sum + weight);
    }
    let per_sum = sum.map(|sum| 1.0 / sum);
    for logit in logits.iter_mut() {
        *logit = logit.zip(per_sum, |weight, per_sum| weight * per_sum);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let mut logits = [Lanes([-1e6; N_LANES]), Lanes([3.0; N_LANES]), Lanes([3.0 + 2f32.ln(); N_LANES])];
        logits[0].0[1] = 1e6;
        softmax(&mut logits);
        for (found, expected) in [(logits[0].0[0], 0.0), (logits[1].0[0], 1.0 / 3.0), (logits[0].0[1], 1.0)] {
            assert!((found - expected).abs() < 1e-6, "{found} {expected}");
        }
    }
}
