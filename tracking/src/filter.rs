//! A Kalman filter of constant velocity in the plane.
//!
//! Noise is the same along both axes, so both share one covariance of position and velocity: two by two numbers instead
//! of four by four. The process is white acceleration (Bar-Shalom, Li and Kirubarajan, Estimation with Applications to
//! Tracking and Navigation, 2001, section 6.2.2).

/// Covariance of position and velocity along each axis; the axes are independent.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Variance {
    /// Of the position [m2].
    pub position_m2: f64,
    /// Between position and velocity [m2/s].
    pub cross_m2ps: f64,
    /// Of the velocity [m2/s2].
    pub velocity_m2ps2: f64,
}

impl Variance {
    /// After a while in which nothing was measured; `density_m2ps3` is the spectral density of the acceleration.
    pub fn after(&self, time_s: f64, density_m2ps3: f64) -> Self {
        let Self { position_m2, cross_m2ps, velocity_m2ps2 } = *self;
        let (t, q) = (time_s, density_m2ps3);
        Self {
            position_m2: position_m2 + t * (2.0 * cross_m2ps + t * (velocity_m2ps2 + q * t / 3.0)),
            cross_m2ps: cross_m2ps + t * (velocity_m2ps2 + 0.5 * q * t),
            velocity_m2ps2: velocity_m2ps2 + q * t,
        }
    }
}

/// Where something is and how it moves, as far as is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Estimate {
    /// East, north [m].
    pub position_m: [f64; 2],
    /// East, north [m/s].
    pub velocity_mps: [f64; 2],
    pub variance: Variance,
}

impl Estimate {
    /// Of something that was seen for the first time.
    pub fn new(position_m: [f64; 2], position_m2: f64, velocity_m2ps2: f64) -> Self {
        let variance = Variance { position_m2, cross_m2ps: 0.0, velocity_m2ps2 };
        Self { position_m, velocity_mps: [0.0; 2], variance }
    }

    /// Of something that was measured twice, `elapsed_s` apart, and is at the second place: the difference of two points
    /// (Bar-Shalom, Li and Kirubarajan 2001, section 5.5.3).
    pub fn of_two([first_m, second_m]: [[f64; 2]; 2], elapsed_s: f64, noise_m2: f64) -> Self {
        let variance = Variance {
            position_m2: noise_m2,
            cross_m2ps: noise_m2 / elapsed_s,
            velocity_m2ps2: 2.0 * noise_m2 / (elapsed_s * elapsed_s),
        };
        let velocity_mps = [0, 1].map(|axis| (second_m[axis] - first_m[axis]) / elapsed_s);
        Self { position_m: second_m, velocity_mps, variance }
    }

    /// Lets time pass.
    pub fn predict(&mut self, time_s: f64, density_m2ps3: f64) {
        self.position_m = [0, 1].map(|axis| self.position_m[axis] + time_s * self.velocity_mps[axis]);
        self.variance = self.variance.after(time_s, density_m2ps3);
    }

    /// Takes in where it was measured, with that measurement's variance along each axis [m2].
    pub fn update(&mut self, measured_m: [f64; 2], noise_m2: f64) {
        let Variance { position_m2, cross_m2ps, velocity_m2ps2 } = self.variance;
        let innovation_m2 = position_m2 + noise_m2;
        let (gain, gain_per_s) = (position_m2 / innovation_m2, cross_m2ps / innovation_m2);
        let innovation_m = [0, 1].map(|axis| measured_m[axis] - self.position_m[axis]);
        self.position_m = [0, 1].map(|axis| self.position_m[axis] + gain * innovation_m[axis]);
        self.velocity_mps = [0, 1].map(|axis| self.velocity_mps[axis] + gain_per_s * innovation_m[axis]);
        self.variance = Variance {
            position_m2: (1.0 - gain) * position_m2,
            cross_m2ps: (1.0 - gain) * cross_m2ps,
            velocity_m2ps2: velocity_m2ps2 - gain_per_s * cross_m2ps,
        };
    }

    /// Squared number of standard deviations between the estimate and a measurement.
    pub fn squared_distance(&self, measured_m: [f64; 2], noise_m2: f64) -> f64 {
        let [east_m, north_m] = [0, 1].map(|axis| measured_m[axis] - self.position_m[axis]);
        (east_m * east_m + north_m * north_m) / (self.variance.position_m2 + noise_m2)
    }

    pub fn speed_mps(&self) -> f64 {
        libm::hypot(self.velocity_mps[0], self.velocity_mps[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOISE_M2: f64 = 0.01;

    /// The oracle: the straight line of least squares through equally good measurements, which is what a filter without
    /// process noise and without knowledge of the start comes to.
    fn line(times_s: &[f64], values: &[f64]) -> (f64, f64, f64) {
        let n = times_s.len() as f64;
        let mean = |values: &[f64]| values.iter().sum::<f64>() / n;
        let (mean_s, mean_value) = (mean(times_s), mean(values));
        let spread: f64 = times_s.iter().map(|t| (t - mean_s) * (t - mean_s)).sum();
        let slope =
            times_s.iter().zip(values).map(|(t, value)| (t - mean_s) * (value - mean_value)).sum::<f64>()
                / spread;
        let last_s = times_s[times_s.len() - 1] - mean_s;
        let variance = NOISE_M2 * (1.0 / n + last_s * last_s / spread);
        (mean_value + slope * last_s, slope, variance)
    }

    #[test]
    fn without_process_noise_it_is_the_line_of_least_squares() {
        let times_s = [0.0, 0.2, 0.4, 0.7, 0.8, 1.1];
        let [east_m, north_m] = [[1.0, 1.21, 1.38, 1.72, 1.79, 2.13], [3.0, 2.7, 2.45, 1.95, 1.8, 1.4]];
        let mut estimate = Estimate::new([east_m[0], north_m[0]], NOISE_M2, 1e6);
        for k in 1..times_s.len() {
            estimate.predict(times_s[k] - times_s[k - 1], 0.0);
            estimate.update([east_m[k], north_m[k]], NOISE_M2);
        }
        for (axis, values) in [east_m, north_m].iter().enumerate() {
            let (value_m, slope_mps, variance_m2) = line(&times_s, values);
            assert!((estimate.position_m[axis] - value_m).abs() < 1e-6);
            assert!((estimate.velocity_mps[axis] - slope_mps).abs() < 1e-5);
            assert!((estimate.variance.position_m2 - variance_m2).abs() < 1e-6);
        }
    }

    /// White acceleration in many small steps, each a kick to the velocity: variances of sums of independent numbers.
    /// Two points are the line of least squares through two points.
    #[test]
    fn of_two_points_it_is_the_line_through_both() {
        let two = Estimate::of_two([[1.0, 2.0], [1.5, 1.6]], 0.5, NOISE_M2);
        let mut line = Estimate::new([1.0, 2.0], NOISE_M2, 1e9);
        line.predict(0.5, 0.0);
        line.update([1.5, 1.6], NOISE_M2);
        let Variance { position_m2, cross_m2ps, velocity_m2ps2 } = line.variance;
        // 0.01, 0.01 / 0.5 and 2 x 0.01 / 0.25.
        assert_eq!(two.variance, Variance { position_m2: 0.01, cross_m2ps: 0.02, velocity_m2ps2: 0.08 });
        for (found, expected) in [(position_m2, 0.01), (cross_m2ps, 0.02), (velocity_m2ps2, 0.08)] {
            assert!((found - expected).abs() < 1e-6, "{found} {expected}");
        }
        for axis in 0..2 {
            assert!((two.position_m[axis] - line.position_m[axis]).abs() < 1e-6);
            assert!((two.velocity_mps[axis] - line.velocity_mps[axis]).abs() < 1e-6);
        }
    }

    #[test]
    fn without_measurements_it_grows_as_sums_of_kicks_do() {
        let (density, time_s, n) = (0.5, 2.0, 20_000);
        let step_s = time_s / f64::from(n);
        let kick_m2ps2 = density * step_s;
        let (mut position_m2, mut cross, mut velocity_m2ps2) = (0.04, 0.0, 0.09);
        position_m2 += time_s * time_s * velocity_m2ps2;
        cross += time_s * velocity_m2ps2;
        for k in 0..n {
            let left_s = time_s - (f64::from(k) + 0.5) * step_s;
            position_m2 += left_s * left_s * kick_m2ps2;
            cross += left_s * kick_m2ps2;
            velocity_m2ps2 += kick_m2ps2;
        }
        let start = Variance { position_m2: 0.04, cross_m2ps: 0.0, velocity_m2ps2: 0.09 };
        let found = start.after(time_s, density);
        assert!((found.position_m2 - position_m2).abs() < 1e-6, "{found:?}");
        assert!((found.cross_m2ps - cross).abs() < 1e-6);
        assert!((found.velocity_m2ps2 - velocity_m2ps2).abs() < 1e-9);
        let in_two = start.after(0.7, density).after(1.3, density);
        assert!((in_two.position_m2 - found.position_m2).abs() < 1e-12, "whatever the steps");
    }
}
