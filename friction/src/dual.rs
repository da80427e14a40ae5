//! Numbers that carry their derivatives: forward-mode differentiation in a fixed number of directions.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A value and its derivatives in `N` directions; with `N` = 0 a plain number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<const N: usize> {
    /// Value.
    pub value: f64,
    /// Derivative in each direction.
    pub slope: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// A number that depends on nothing.
    pub const fn constant(value: f64) -> Self {
        Self { value, slope: [0.0; N] }
    }

    /// The variable of direction `index`.
    pub fn variable(value: f64, index: usize) -> Self {
        let mut variable = Self::constant(value);
        variable.slope[index] = 1.0;
        variable
    }

    /// A function of it, given its value and its derivative.
    fn chain(self, value: f64, derivative: f64) -> Self {
        Self { value, slope: self.slope.map(|slope| slope * derivative) }
    }

    /// Exponential.
    pub fn exp(self) -> Self {
        let value = self.value.exp();
        self.chain(value, value)
    }

    /// Hyperbolic tangent.
    pub fn tanh(self) -> Self {
        let value = self.value.tanh();
        self.chain(value, 1.0 - value * value)
    }

    /// Square root of what is above zero.
    pub fn sqrt(self) -> Self {
        let value = self.value.sqrt();
        self.chain(value, 0.5 / value)
    }

    /// Held within two ends; beyond them it depends on nothing.
    pub fn clamp(self, low: f64, high: f64) -> Self {
        let value = self.value.clamp(low, high);
        if value == self.value { self } else { Self::constant(value) }
    }

    /// Sine and cosine.
    pub fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.value.sin_cos();
        (self.chain(sin, cos), self.chain(cos, -sin))
    }
}

impl<const N: usize> From<f64> for Dual<N> {
    fn from(value: f64) -> Self {
        Self::constant(value)
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let slope = std::array::from_fn(|i| self.slope[i] + other.slope[i]);
        Self { value: self.value + other.value, slope }
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        let slope = std::array::from_fn(|i| self.slope[i] - other.slope[i]);
        Self { value: self.value - other.value, slope }
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    fn neg(self) -> Self {
        self.chain(-self.value, -1.0)
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[expect(clippy::suspicious_arithmetic_impl, reason = "the product rule")]
    fn mul(self, other: Self) -> Self {
        let slope = std::array::from_fn(|i| self.slope[i] * other.value + self.value * other.slope[i]);
        Self { value: self.value * other.value, slope }
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let inverse = 1.0 / other.value;
        self * other.chain(inverse, -inverse * inverse)
    }
}

impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        self.chain(self.value * factor, factor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_are_those_of_central_differences() {
        fn function<const N: usize>(x: Dual<N>, y: Dual<N>) -> Dual<N> {
            let (sin, cos) = (x * y).sin_cos();
            (sin / (y + Dual::from(2.0))).tanh() * x.exp() - (x * x + y * y).sqrt() * cos * 0.3
        }
        let (x, y, step) = (0.7, -0.4, 1e-6);
        let found = function::<2>(Dual::variable(x, 0), Dual::variable(y, 1));
        let plain = |x: f64, y: f64| function::<0>(x.into(), y.into()).value;
        assert_eq!(found.value, plain(x, y));
        let differences = [
            (plain(x + step, y) - plain(x - step, y)) / (2.0 * step),
            (plain(x, y + step) - plain(x, y - step)) / (2.0 * step),
        ];
        for (slope, difference) in found.slope.iter().zip(differences) {
            assert!((slope - difference).abs() < 1e-8, "{slope} {difference}");
        }
    }
}
