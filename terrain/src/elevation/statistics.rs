//! What the rigid points of one cell and scan say together.

use super::cell::CellPoint;

/// Sums over the ground points of one cell and scan.
pub(super) struct RigidStatistics {
    pub n: f32,
    first_m: f32,
    sum_m: f32,
    sum_m2: f32,
    variance_sum_m2: f32,
    shared_sum_m2: f32,
    lowest_m: f32,
    highest_m: f32,
    second_highest_m: f32,
}

impl RigidStatistics {
    /// Sums over points.
    pub fn of<'a>(points: impl Iterator<Item = &'a CellPoint>) -> Self {
        let mut all = Self {
            n: 0.0,
            first_m: f32::NAN,
            sum_m: 0.0,
            sum_m2: 0.0,
            variance_sum_m2: 0.0,
            shared_sum_m2: 0.0,
            lowest_m: f32::INFINITY,
            highest_m: f32::NEG_INFINITY,
            second_highest_m: f32::NEG_INFINITY,
        };
        for point in points {
            if all.n == 0.0 {
                all.first_m = point.height_m;
            }
            // Relative to the first point, so that the squares keep their digits.
            let relative_m = point.height_m - all.first_m;
            all.n += 1.0;
            all.sum_m += relative_m;
            all.sum_m2 += relative_m * relative_m;
            all.variance_sum_m2 += point.variance_m2;
            all.shared_sum_m2 += point.shared_m2;
            all.lowest_m = all.lowest_m.min(point.height_m);
            all.second_highest_m = all.second_highest_m.max(point.height_m.min(all.highest_m));
            all.highest_m = all.highest_m.max(point.height_m);
        }
        all
    }

    /// Mean height; NaN without points.
    pub fn mean_m(&self) -> f32 {
        self.first_m + self.sum_m / self.n
    }

    /// From the lowest point to the second highest, so that one point named wrongly builds no wall.
    pub fn span_m(&self) -> f32 {
        (self.second_highest_m - self.lowest_m).max(0.0)
    }

    /// Mean variance of the error that the points share.
    pub fn shared_m2(&self) -> f32 {
        self.shared_sum_m2 / self.n
    }

    /// Mean sensor variance of one point.
    pub fn noise_m2(&self) -> f32 {
        self.variance_sum_m2 / self.n
    }

    /// Variance between the points beyond what sensor noise explains (two standard errors of a sample variance).
    pub fn excess_m2(&self) -> f32 {
        if self.n < 2.0 {
            return 0.0;
        }
        let sample_m2 = (self.sum_m2 - self.sum_m * self.sum_m / self.n).max(0.0) / (self.n - 1.0);
        let explained_m2 = self.noise_m2() * (1.0 + 2.0 * (2.0 / (self.n - 1.0)).sqrt());
        (sample_m2 - explained_m2).max(0.0)
    }
}
