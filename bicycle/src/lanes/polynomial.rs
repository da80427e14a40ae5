//! Minimax polynomials of the trigonometric functions, lowest power first (own Remez fits).

use super::Lanes;

/// sin(2 pi r) / r in r^2, |r| <= 1/2; absolute error of the sine below 1.2e-7.
const SIN_TURNS: [f32; 6] = [6.283_183_6, -41.341_473, 81.597_18, -76.588_43, 41.236_626, -12.314_538];
/// cos(2 pi r) in r^2, |r| <= 1/2; absolute error below 1.1e-8.
const COS_TURNS: [f32; 7] = [1.0, -19.739_204, 64.939_12, -85.450_165, 60.167_83, -25.968_313, 6.529_610_4];
/// tan(d) / d in d^2, |d| <= 0.8; absolute error of the tangent below 1.7e-7.
const TAN: [f32; 6] = [0.999_998_2, 0.333_416_68, 0.132_286_44, 0.059_395_746, 0.008_769_429, 0.022_696_837];

#[inline(always)]
pub(super) fn sin_cos_turns<L: Lanes>(lanes: L, r: L::Value) -> (L::Value, L::Value) {
    let z = lanes.mul(r, r);
    (lanes.mul(r, lanes.polynomial(z, &SIN_TURNS)), lanes.polynomial(z, &COS_TURNS))
}

#[inline(always)]
pub(super) fn tan<L: Lanes>(lanes: L, d: L::Value) -> L::Value {
    lanes.mul(d, lanes.polynomial(lanes.mul(d, d), &TAN))
}
