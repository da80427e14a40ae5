//! How far a predicted distribution is from what was measured.

use traversability::N_BINS;

/// Probability of each bin.
pub(super) type Probabilities = [f64; N_BINS];

/// Probability of being in this bin or below.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cdf([f64; N_BINS]);

impl Cdf {
    pub fn of(probabilities: &Probabilities) -> Self {
        let mut sum = 0.0;
        Self(probabilities.map(|probability| {
            sum += probability;
            sum
        }))
    }

    pub fn at(&self, bin: usize) -> f64 {
        self.0[bin]
    }

    /// EMD2 to a measurement in one bin, in squared bins (equation 12 with a one-hot target).
    pub fn emd2(&self, measured: usize) -> f64 {
        let gap = |(bin, cumulated): (usize, &f64)| cumulated - f64::from(u8::from(bin >= measured));
        self.0.iter().enumerate().map(gap).map(|gap| gap * gap).sum()
    }

    /// Probability integral transform: where in the distribution a measurement lies. Of the probability of its own bin,
    /// `share` counts as below it; drawn evenly from 0 to 1, a calibrated prediction makes the transform uniform.
    pub fn transform(&self, measured: usize, share: f64) -> f64 {
        let below = if measured == 0 { 0.0 } else { self.0[measured - 1] };
        below + share * (self.0[measured] - below)
    }
}

/// Groups of [`Calibration`].
pub(super) const N_GROUPS: usize = 10;

/// What a calibration is computed from.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Calibration {
    transforms: [u64; N_GROUPS],
    events: [Events; N_GROUPS],
}

/// Events "in bin k or below" whose predicted probability lies in one group.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Events {
    n: u64,
    predicted: f64,
    happened: u64,
}

impl Calibration {
    pub fn add(&mut self, cdf: &Cdf, measured: usize, share: f64) {
        self.transforms[group(cdf.transform(measured, share))] += 1;
        // All events of the last bin happen and are certain.
        for bin in 0..N_BINS - 1 {
            let predicted = cdf.at(bin);
            let events = &mut self.events[group(predicted)];
            events.n += 1;
            events.predicted += predicted;
            events.happened += u64::from(measured <= bin);
        }
    }

    /// Shares of the transforms in tenths of their range; a calibrated prediction has a tenth in each. NaN without
    /// measurements.
    pub fn histogram(&self) -> [f64; N_GROUPS] {
        let n: u64 = self.transforms.iter().sum();
        self.transforms.map(|count| count as f64 / n as f64)
    }

    /// Expected calibration error of the CDF: |predicted probability - observed frequency| of the events "in bin k or
    /// below", in groups of tenths of predicted probability, weighted by their size. NaN without measurements.
    pub fn expected_error(&self) -> f64 {
        let n: u64 = self.events.iter().map(|events| events.n).sum();
        let gap = |events: &Events| (events.predicted - events.happened as f64).abs();
        self.events.iter().map(gap).sum::<f64>() / n as f64
    }
}

fn group(share: f64) -> usize {
    ((share * N_GROUPS as f64) as usize).min(N_GROUPS - 1)
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    const SKEWED: Probabilities = [0.02, 0.08, 0.2, 0.05, 0.15, 0.1, 0.1, 0.05, 0.15, 0.05, 0.03, 0.02];

    fn one_hot(bin: usize) -> Cdf {
        Cdf::of(&std::array::from_fn(|b| f64::from(u8::from(b == bin))))
    }

    #[test]
    fn uniform_against_one_bin_is_the_known_series() {
        let uniform = Cdf::of(&[1.0 / N_BINS as f64; N_BINS]);
        // sum_k (k/12 - [k > bin])^2: 506, 386, 290, 218, 170 and 146 over 144.
        for (bin, over_144) in [506.0, 386.0, 290.0, 218.0, 170.0, 146.0].into_iter().enumerate() {
            for bin in [bin, N_BINS - 1 - bin] {
                assert!((uniform.emd2(bin) - over_144 / 144.0).abs() < 1e-12, "{bin}: {}", uniform.emd2(bin));
            }
        }
        assert_eq!(one_hot(3).emd2(8), 5.0);
        assert_eq!(one_hot(3).emd2(3), 0.0);
    }

    #[test]
    fn transform_lies_within_the_step_of_the_measured_bin() {
        let cdf = Cdf::of(&SKEWED);
        assert_eq!(cdf.transform(0, 0.5), 0.01);
        assert!((cdf.transform(2, 0.0) - 0.10).abs() < 1e-12 && (cdf.transform(2, 1.0) - 0.30).abs() < 1e-12);
    }

    fn calibration(predicted: &Probabilities, true_bin: impl Fn(f64) -> usize) -> Calibration {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        let cdf = Cdf::of(predicted);
        let mut calibration = Calibration::default();
        for _ in 0..40_000 {
            calibration.add(&cdf, true_bin(rng.random()), rng.random());
        }
        calibration
    }

    #[test]
    fn what_is_drawn_from_the_prediction_is_calibrated() {
        let cdf = Cdf::of(&SKEWED);
        let calibration =
            calibration(&SKEWED, |u| (0..N_BINS - 1).find(|&b| u < cdf.at(b)).unwrap_or(N_BINS - 1));
        // Five standard errors of a tenth over 40 000 draws.
        for share in calibration.histogram() {
            assert!((share - 0.1).abs() < 0.0075, "{share}");
        }
        assert!(calibration.expected_error() < 0.005, "{}", calibration.expected_error());
    }

    #[test]
    fn calibration_error_of_a_constant_prediction_is_known() {
        // Everything falls into bin 0; the uniform distribution has k/12 below bin k: the mean of 1 - k/12 over k = 1 to
        // 11 is 1/2.
        let calibration = calibration(&[1.0 / N_BINS as f64; N_BINS], |_| 0);
        assert!((calibration.expected_error() - 0.5).abs() < 1e-9, "{}", calibration.expected_error());
        // Transforms between 0 and 1/12.
        assert!((calibration.histogram()[0] - 1.0).abs() < 1e-12);
    }

    #[test]
    fn nothing_measured_is_no_number() {
        let nothing = Calibration::default();
        assert!(nothing.expected_error().is_nan() && nothing.histogram()[0].is_nan());
    }
}
