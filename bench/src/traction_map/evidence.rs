//! How many observations a prediction is worth, by the density of its features.

/// Evidence at the density of the most familiar training sample if the ground were that of the training: the certainty
/// budget of a natural posterior network at the mode of a latent of 8 dimensions, 2^(8/2). The least familiar training
/// sample, at density 0, is worth one observation: itself.
pub const LATENT_EVIDENCE_MAX: f64 = 16.0;

/// Most observations that samples of one foreign forest can stand for, however many they are.
///
/// A density of features sees that a place looks unlike the training. It cannot see that ground of the same look
/// behaves otherwise: another soil, another load, another controller. Samples of one site share these, so `n` of them
/// tell of another site only as much as `n / (1 + n r)`, with `r` the variance between sites over that within one
/// (the design effect of samples in clusters, Kish 1965). Between: the steering efficiency, one over the factor from
/// track to effective track, of five calibrations of skid-steered machines (Jackal 1.5, Husky A200 1.525 on a floor
/// and 1.875 as shipped, A300 1.75, Warthog 1.69 in its recorded drive) has a standard deviation of 0.057. Within: in
/// the Warthog's drive, the achieved yaw rate over the commanded one has 0.11. That makes r = 1/4 and at most four.
pub const FOREIGN_EVIDENCE_MAX: f64 = 4.0;

/// Evidence of a prediction (equation 10) made in a forest other than that of the training, from the normalised log
/// density of its features: log-linear in the density, with the ceiling of a foreign site.
pub fn evidence_of(normalised_density: f64) -> f64 {
    let as_if_at_home = LATENT_EVIDENCE_MAX.powf(normalised_density);
    as_if_at_home / (1.0 + as_if_at_home / FOREIGN_EVIDENCE_MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ceiling_is_the_ratio_of_the_stated_variances() {
        let efficiencies = [1.5, 1.525, 1.69, 1.75, 1.875_f64].map(|factor| 1.0 / factor);
        let mean = efficiencies.iter().sum::<f64>() / 5.0;
        let variance = efficiencies.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / 4.0;
        assert!((variance.sqrt() - 0.057).abs() < 1e-3, "{}", variance.sqrt());
        let ratio = 0.11_f64.powi(2) / variance;
        assert!((ratio - FOREIGN_EVIDENCE_MAX).abs() < 0.5, "{ratio}");
    }

    #[test]
    fn evidence_rises_with_density_between_its_ends() {
        // 1 / (1 + 1/4) and 16 / (1 + 16/4).
        assert!((evidence_of(0.0) - 0.8).abs() < 1e-12 && (evidence_of(1.0) - 3.2).abs() < 1e-12);
        let rising: Vec<f64> = (-40..80).map(|step| evidence_of(f64::from(step) * 0.1)).collect();
        assert!(rising.windows(2).all(|pair| pair[0] < pair[1]));
        assert!(rising[0] < 1e-4 && rising[119] < FOREIGN_EVIDENCE_MAX);
    }

    #[test]
    fn out_of_distribution_the_prediction_hardly_counts() {
        assert!(evidence_of(0.0) / (evidence_of(0.0) + 12.0) < 0.1);
        assert_eq!(evidence_of(f64::NEG_INFINITY), 0.0);
        // Far above all training the ceiling still holds.
        assert!(evidence_of(200.0) <= FOREIGN_EVIDENCE_MAX);
    }
}
