//! Dirichlet distributions over PMFs in double precision: the losses of equations 12 to 14 for one example, and the
//! entropy. Training evaluates the same forms for whole batches; here they stand alone, to be read and tested.
//!
//! Notation of the equations: concentrations beta_b, A_k = beta_1 + .. + beta_k, beta_0 = A_B, m_k = A_k / beta_0, the
//! cumulated target Y_k.

use traversability::N_BINS;

/// From here on the asymptotic series of ln G, psi and psi' are exact to double precision; below, their recurrences
/// lead up to it.
const SERIES_FROM: f64 = 10.0;
/// Steps of the recurrence that lift any positive argument to [`SERIES_FROM`].
const STEPS: usize = SERIES_FROM as usize;
/// From here on `ln G(x) - (x - 1) psi(x) + x` is its own short series.
const ENTROPY_SERIES_FROM: f64 = 1000.0;
/// ln(2 pi) / 2.
const HALF_LOG_TWO_PI: f64 = 0.918_938_533_204_672_8;

/// EMD2 of two PMFs, in squared bins (equation 12).
pub fn emd2(p: &[f64; N_BINS], target: &[f64; N_BINS]) -> f64 {
    let (mut gap, mut sum) = (0.0, 0.0);
    for bin in 0..N_BINS {
        gap += p[bin] - target[bin];
        sum += gap * gap;
    }
    sum
}

/// Derivative of [`emd2`] by every probability of `p`: `2 sum_{k >= j} (cs(p)_k - Y_k)`.
pub fn emd2_gradient(p: &[f64; N_BINS], target: &[f64; N_BINS]) -> [f64; N_BINS] {
    let mut gap = 0.0;
    let gaps: [f64; N_BINS] = std::array::from_fn(|bin| {
        gap += p[bin] - target[bin];
        gap
    });
    let mut tail = 0.0;
    let mut gradient = [0.0; N_BINS];
    for bin in (0..N_BINS).rev() {
        tail += 2.0 * gaps[bin];
        gradient[bin] = tail;
    }
    gradient
}

/// UEMD2: the expectation of EMD2 to a target over Dir(concentration) (equation 13).
///
/// cs(p)_k has a beta distribution, so the expectation is
/// `sum_k (m_k - Y_k)^2 + sum_k m_k (1 - m_k) / (beta_0 + 1)`.
pub fn uemd2(concentration: &[f64; N_BINS], target: &[f64; N_BINS]) -> f64 {
    uemd2_with_gradient(concentration, target).0
}

/// [`uemd2`] and its derivative by every concentration:
/// `1/beta_0 sum_k [2 (m_k - Y_k) + (1 - 2 m_k)/(beta_0 + 1)] (1[j <= k] - m_k) - sum_k m_k (1 - m_k) / (beta_0 + 1)^2`.
pub fn uemd2_with_gradient(concentration: &[f64; N_BINS], target: &[f64; N_BINS]) -> (f64, [f64; N_BINS]) {
    let total: f64 = concentration.iter().sum();
    let (per_total, per_next) = (1.0 / total, 1.0 / (total + 1.0));
    let mut slope = [0.0; N_BINS];
    let (mut mean, mut cumulated) = (0.0, 0.0);
    let (mut bias, mut variance, mut by_mean) = (0.0, 0.0, 0.0);
    for bin in 0..N_BINS {
        mean += concentration[bin] * per_total;
        cumulated += target[bin];
        let gap = mean - cumulated;
        slope[bin] = 2.0 * gap + (1.0 - 2.0 * mean) * per_next;
        by_mean += slope[bin] * mean;
        bias += gap * gap;
        variance += mean * (1.0 - mean);
    }
    let common = by_mean * per_total + variance * per_next * per_next;
    let mut gradient = [0.0; N_BINS];
    let mut tail = 0.0;
    for bin in (0..N_BINS).rev() {
        tail += slope[bin];
        gradient[bin] = tail * per_total - common;
    }
    (bias + variance * per_next, gradient)
}

/// Differential entropy of Dir(concentration):
/// `sum ln G(beta_b) - ln G(beta_0) + (beta_0 - B) psi(beta_0) - sum (beta_b - 1) psi(beta_b)`.
///
/// Exact for large sums too, where the terms as written are many orders above their sum.
pub fn entropy(concentration: &[f64; N_BINS]) -> f64 {
    let total: f64 = concentration.iter().sum();
    let bins: f64 = concentration.iter().map(|&beta| entropy_part(beta)).sum();
    bins - entropy_part(total) - (N_BINS as f64 - 1.0) * digamma(total)
}

/// Derivative of [`entropy`] by every concentration: `(beta_0 - B) psi'(beta_0) - (beta_j - 1) psi'(beta_j)`.
pub fn entropy_gradient(concentration: &[f64; N_BINS]) -> [f64; N_BINS] {
    let total: f64 = concentration.iter().sum();
    let common = (total - N_BINS as f64) * trigamma(total);
    concentration.map(|beta| common - (beta - 1.0) * trigamma(beta))
}

/// `ln G(x) - (x - 1) psi(x) + x`. The last term, whose sums over the bins and for the total cancel, takes away the
/// only part that grows faster than ln x.
fn entropy_part(x: f64) -> f64 {
    if x >= ENTROPY_SERIES_FROM {
        let per_x = 1.0 / x;
        let series = per_x * (-1.0 / 3.0 + per_x * (-1.0 / 12.0 - per_x / 90.0));
        return 0.5 * x.ln() + HALF_LOG_TWO_PI + 0.5 + series;
    }
    let lifted = Lifted::new(x);
    lifted.log_gamma() - (x - 1.0) * lifted.digamma() + x
}

/// psi(x), the derivative of ln G(x), for x > 0.
pub fn digamma(x: f64) -> f64 {
    Lifted::new(x).digamma()
}

/// psi'(x), the second derivative of ln G(x), for x > 0.
pub fn trigamma(x: f64) -> f64 {
    let (mut numerator, mut denominator, mut y) = (0.0, 1.0, x);
    if x < SERIES_FROM {
        // The sum of 1/(x + i)^2 as one fraction.
        for _ in 0..STEPS {
            let square = y * y;
            numerator = numerator * square + denominator;
            denominator *= square;
            y += 1.0;
        }
    }
    let per_y = 1.0 / y;
    let per_y2 = per_y * per_y;
    let tail = 1.0 / 42.0 + per_y2 * (-1.0 / 30.0 + per_y2 * (5.0 / 66.0 - per_y2 * 691.0 / 2730.0));
    let series = per_y * (1.0 + per_y * (0.5 + per_y * (1.0 / 6.0 + per_y2 * (-1.0 / 30.0 + per_y2 * tail))));
    numerator / denominator + series
}

/// An argument lifted into the range of the series, with what the recurrences G(x + 1) = x G(x) owe for it.
struct Lifted {
    y: f64,
    log_y: f64,
    /// x (x + 1) .. (y - 1).
    product: f64,
    /// 1/x + 1/(x + 1) + .. + 1/(y - 1).
    reciprocals: f64,
}

impl Lifted {
    fn new(x: f64) -> Self {
        let (mut product, mut numerator, mut y) = (1.0, 0.0, x);
        if x < SERIES_FROM {
            for _ in 0..STEPS {
                numerator = numerator * y + product;
                product *= y;
                y += 1.0;
            }
        }
        Self { y, log_y: y.ln(), product, reciprocals: numerator / product }
    }

    fn log_gamma(&self) -> f64 {
        let per_y = 1.0 / self.y;
        let per_y2 = per_y * per_y;
        let tail =
            1.0 / 1260.0 + per_y2 * (-1.0 / 1680.0 + per_y2 * (1.0 / 1188.0 - per_y2 * 691.0 / 360_360.0));
        let series = per_y * (1.0 / 12.0 + per_y2 * (-1.0 / 360.0 + per_y2 * tail));
        (self.y - 0.5) * self.log_y - self.y + HALF_LOG_TWO_PI + series - self.product.ln()
    }

    fn digamma(&self) -> f64 {
        let per_y = 1.0 / self.y;
        let per_y2 = per_y * per_y;
        let tail = 1.0 / 252.0 + per_y2 * (-1.0 / 240.0 + per_y2 * (1.0 / 132.0 - per_y2 * 691.0 / 32_760.0));
        let series = per_y2 * (1.0 / 12.0 + per_y2 * (-1.0 / 120.0 + per_y2 * tail));
        self.log_y - 0.5 * per_y - series - self.reciprocals
    }
}

#[cfg(test)]
#[allow(clippy::excessive_precision, reason = "the tables hold what was computed with more digits")]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, Gamma};
    use rand_xoshiro::Xoshiro256PlusPlus;

    const SKEWED: [f64; N_BINS] = [0.3, 2.0, 0.7, 5.0, 1.0, 0.1, 9.0, 3.0, 0.5, 1.5, 4.0, 0.9];
    const UNIFORM: [f64; N_BINS] = [1.0 / N_BINS as f64; N_BINS];

    fn one_hot(bin: usize) -> [f64; N_BINS] {
        std::array::from_fn(|b| f64::from(u8::from(b == bin)))
    }

    fn close(found: f64, expected: f64, tolerance: f64) {
        assert!((found - expected).abs() <= tolerance * expected.abs().max(1.0), "{found} is not {expected}");
    }

    #[test]
    fn emd2_of_the_uniform_distribution_is_known_for_every_bin() {
        // sum_k (k/12 - [k > bin])^2 by hand: 506/144 = 3.514 in the outermost bins, 146/144 = 1.014 in the middle.
        let expected = [3.513_888_9, 2.680_555_6, 2.013_888_9, 1.513_888_9, 1.180_555_6, 1.013_888_9];
        for (bin, &value) in expected.iter().enumerate() {
            close(emd2(&UNIFORM, &one_hot(bin)), value, 1e-7);
            close(emd2(&UNIFORM, &one_hot(N_BINS - 1 - bin)), value, 1e-7);
        }
        assert_eq!(emd2(&one_hot(3), &one_hot(7)), 4.0);
    }

    #[test]
    fn uemd2_is_the_mean_of_emd2_over_drawn_pmfs() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        let gammas = SKEWED.map(|beta| Gamma::new(beta, 1.0).unwrap());
        for target in [one_hot(2), UNIFORM] {
            let (mut sum, mut squares, n) = (0.0, 0.0, 60_000);
            for _ in 0..n {
                let drawn = gammas.map(|gamma| gamma.sample(&mut rng));
                let total: f64 = drawn.iter().sum();
                let value = emd2(&drawn.map(|weight| weight / total), &target);
                sum += value;
                squares += value * value;
            }
            let mean = sum / f64::from(n);
            let standard_error = ((squares / f64::from(n) - mean * mean) / f64::from(n)).sqrt();
            let exact = uemd2(&SKEWED, &target);
            assert!((mean - exact).abs() < 4.0 * standard_error, "{mean} +- {standard_error}, {exact}");
            // The draws can tell the expectation from the value at the mean.
            let at_mean = emd2(&SKEWED.map(|beta| beta / SKEWED.iter().sum::<f64>()), &target);
            assert!((at_mean - exact).abs() > 8.0 * standard_error);
        }
    }

    #[test]
    fn uemd2_approaches_emd2_with_evidence_and_falls_with_it() {
        let total: f64 = SKEWED.iter().sum();
        let mean = SKEWED.map(|beta| beta / total);
        let at = |evidence: f64| uemd2(&mean.map(|p| evidence * p), &one_hot(4));
        let limit = emd2(&mean, &one_hot(4));
        close(at(1e12), limit, 1e-10);
        assert!(at(1.0) > at(10.0) && at(10.0) > at(100.0) && at(100.0) > limit);
    }

    #[test]
    fn gradients_match_finite_differences() {
        for scale in [0.4, 1.0, 30.0] {
            let concentration = SKEWED.map(|beta| scale * beta);
            let target = one_hot(7);
            let exact = [
                uemd2_with_gradient(&concentration, &target).1,
                emd2_gradient(&concentration, &target),
                entropy_gradient(&concentration),
            ];
            for bin in 0..N_BINS {
                let step = 1e-5 * concentration[bin];
                let moved = |by: f64| {
                    let mut moved = concentration;
                    moved[bin] += by;
                    [uemd2(&moved, &target), emd2(&moved, &target), entropy(&moved)]
                };
                let (above, below) = (moved(step), moved(-step));
                for form in 0..3 {
                    close(exact[form][bin], (above[form] - below[form]) / (2.0 * step), 1e-6);
                }
            }
        }
    }

    #[test]
    fn gamma_functions_match_high_precision_values() {
        // Computed with 30 digits.
        for (x, expected) in DIGAMMA {
            close(digamma(x), expected, 1e-13);
        }
        for (x, expected) in TRIGAMMA {
            close(trigamma(x), expected, 1e-13);
        }
        for (x, expected) in LOG_GAMMA {
            close(Lifted::new(x).log_gamma(), expected, 1e-13);
        }
    }

    #[test]
    fn entropy_of_the_flat_distribution_is_the_log_volume_of_the_simplex() {
        // Dir(1, .., 1) has the density 11! everywhere.
        close(entropy(&[1.0; N_BINS]), -(39_916_800f64).ln(), 1e-12);
    }

    #[test]
    fn entropy_of_huge_concentrations_is_that_of_the_normal_limit() {
        // Computed with 60 digits; the terms as written are 1e14.
        for (scale, expected) in HUGE_ENTROPY {
            close(entropy(&SKEWED.map(|beta| scale * beta)), expected, 1e-12);
        }
    }

    const DIGAMMA: [(f64, f64); 9] = [
        (0.001, -1000.5755719318103),
        (0.3, -3.502524222200133),
        (1.0, -0.57721566490153286),
        (2.5, 0.70315664064524319),
        (9.999, 2.2516474172057353),
        (10.0, 2.2517525890667211),
        (12.34, 2.4717804848135005),
        (99.5, 4.5951241013255638),
        (1000000.0, 13.815510057964191),
    ];
    const TRIGAMMA: [(f64, f64); 9] = [
        (0.001, 1000001.6425331959),
        (0.3, 12.24536454610773),
        (1.0, 1.6449340668482264),
        (2.5, 0.49035775610023486),
        (9.999, 0.10517738667672887),
        (10.0, 0.10516633568168575),
        (12.34, 0.084409377182852399),
        (99.5, 0.010100924219897489),
        (1000000.0, 1.0000005000001667e-6),
    ];
    const LOG_GAMMA: [(f64, f64); 9] = [
        (0.001, 6.9071788853838537),
        (0.3, 1.0957979948180755),
        (1.0, 0.0),
        (2.5, 0.28468287047291916),
        (9.999, 12.799575780077412),
        (10.0, 12.80182748008147),
        (12.34, 18.337787022900233),
        (99.5, 356.83538282361307),
        (1000000.0, 12815504.569147612),
    ];
    const HUGE_ENTROPY: [(f64, f64); 4] = [
        (1.0, -33.595735663385229),
        (100.0, -46.744953885861062),
        (1e6, -97.333122394911),
        (1e13, -185.98264170546342),
    ];
}
