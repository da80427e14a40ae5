//! How the cells of the risk map lie on the cells of the surface. Both lattices start at the map's origin, so
//! with a rational ratio of resolutions there are only a few distinct positions, computed without rounding.

/// Resolution of the risk map over that of the surface, `numerator / denominator`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ResolutionRatio {
    numerator: i64,
    denominator: i64,
}

/// Largest number of distinct positions per axis.
const DENOMINATOR_MAX: i64 = 16;

impl ResolutionRatio {
    /// The ratio of two resolutions; `None` when it is no fraction with a small denominator.
    pub fn new(risk_resolution_m: f64, surface_resolution_m: f64) -> Option<Self> {
        let ratio = risk_resolution_m / surface_resolution_m;
        if !(ratio.is_finite() && ratio > 0.0) {
            return None;
        }
        let fits = |denominator: &i64| {
            let scaled = ratio * *denominator as f64;
            scaled.round() >= 1.0 && (scaled - scaled.round()).abs() <= 1e-6 * scaled
        };
        let denominator = (1..=DENOMINATOR_MAX).find(fits)?;
        Some(Self { numerator: (ratio * denominator as f64).round() as i64, denominator })
    }

    /// Number of distinct positions per axis.
    pub fn n_phases(self) -> usize {
        self.denominator as usize
    }

    /// Which of the positions a cell of the risk map has.
    pub fn phase_index(self, risk_index: i64) -> usize {
        risk_index.rem_euclid(self.denominator) as usize
    }

    /// Where in its surface cell the centre of a risk cell lies, in [0, 1).
    pub fn phase(self, risk_index: i64) -> f64 {
        let double = (2 * risk_index + 1) * self.numerator;
        double.rem_euclid(2 * self.denominator) as f64 / (2 * self.denominator) as f64
    }

    /// The surface cell that holds the centre of a risk cell, as lattice indices.
    pub fn base(self, risk_index: i64) -> i64 {
        ((2 * risk_index + 1) * self.numerator).div_euclid(2 * self.denominator)
    }

    /// The first cell of the risk map from `first` on that has a position.
    pub fn like(self, phase_index: usize, first: i64) -> i64 {
        first + (phase_index as i64 - first).rem_euclid(self.denominator)
    }

    /// How many surface cells the base advances over [`ResolutionRatio::n_phases`] risk cells.
    pub fn stride(self) -> i64 {
        self.numerator
    }

    /// The surface cells that a risk cell shares an area with, from the first to one past the last.
    pub fn covered(self, risk_index: i64) -> std::ops::Range<i64> {
        let end = (risk_index + 1) * self.numerator + self.denominator - 1;
        (risk_index * self.numerator).div_euclid(self.denominator)..end.div_euclid(self.denominator)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_agree_with_real_arithmetic() {
        for (risk_m, surface_m) in [(0.1, 0.1), (0.2, 0.1), (0.25, 0.1), (0.1, 0.2), (0.15, 0.1), (0.4, 0.3)]
        {
            let ratio = ResolutionRatio::new(risk_m, surface_m).unwrap();
            for i in -30..30 {
                let centre = (i as f64 + 0.5) * risk_m / surface_m;
                let exact = ratio.base(i) as f64 + ratio.phase(i);
                assert!((exact - centre).abs() < 1e-9, "{risk_m} {surface_m} {i}");
                assert!((0.0..1.0).contains(&ratio.phase(i)));
                let same = ratio.phase_index(i) as i64;
                assert_eq!(ratio.phase(i), ratio.phase(same));
                let covered = ratio.covered(i);
                assert!(covered.contains(&ratio.base(i)));
                let (west, east) = (i as f64 * risk_m / surface_m, (i + 1) as f64 * risk_m / surface_m);
                assert!(covered.start as f64 <= west + 1e-9 && (covered.start + 1) as f64 > west + 1e-9);
                assert!(covered.end as f64 >= east - 1e-9 && ((covered.end - 1) as f64) < east - 1e-9);
            }
        }
    }

    #[test]
    fn awkward_ratios_are_refused() {
        for (risk_m, surface_m) in
            [(0.1, 0.0), (f64::NAN, 0.1), (0.1, 0.1 * std::f64::consts::PI), (-0.1, 0.1)]
        {
            assert_eq!(ResolutionRatio::new(risk_m, surface_m), None);
        }
    }
}
