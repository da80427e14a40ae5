//! The search against plain halving.

use super::*;
use proptest::prelude::*;

/// Every halving tried.
fn halve(wanted: f32, last_s: f32, sample_size: impl Fn(f32) -> f32) -> f32 {
    let mut bracket = Bracket { low_s: last_s / SEARCH_FACTOR, high_s: last_s * SEARCH_FACTOR };
    for _ in 0..N_HALVINGS {
        let temperature_s = bracket.middle_s();
        bracket.narrow(&Tried { temperature_s, sample_size: sample_size(temperature_s) }, wanted);
    }
    bracket.middle_s()
}

/// Effective sample size of costs at a temperature, from its definition.
fn of_costs(costs_s: &[f64], temperature_s: f32) -> f32 {
    let weights = costs_s.iter().map(|cost_s| (-cost_s / f64::from(temperature_s)).exp());
    let (sum, squares) =
        weights.fold((0.0, 0.0), |(sum, squares), weight| (sum + weight, squares + weight * weight));
    (sum * sum / squares) as f32
}

/// What is found, and after how many trials.
fn counted(wanted: f32, last_s: f32, sample_size: impl Fn(f32) -> f32) -> (f32, usize) {
    let mut n_tried = 0;
    let found_s = find(wanted, last_s, |temperature_s| {
        n_tried += 1;
        sample_size(temperature_s)
    });
    (found_s, n_tried)
}

proptest! {
    /// The least cost is 0, as the controller takes it off. Never more are tried than guesses, halvings and the two ends.
    #[test]
    fn finds_what_halving_finds(
        mut costs_s in prop::collection::vec(0.0..100.0_f64, 2..200),
        share in 0.01..1.0_f32,
        log2_last in -9.0..12.0_f32,
    ) {
        costs_s[0] = 0.0;
        let (wanted, last_s) = (share * costs_s.len() as f32, log2_last.exp2());
        let (found_s, n_tried) = counted(wanted, last_s, |temperature_s| of_costs(&costs_s, temperature_s));
        let expected_s = halve(wanted, last_s, |temperature_s| of_costs(&costs_s, temperature_s));
        prop_assert_eq!(found_s.to_bits(), expected_s.to_bits());
        prop_assert!(n_tried <= N_GUESSES + N_HALVINGS + 2, "{} trials", n_tried);
    }
}

#[test]
fn few_are_tried_where_the_temperature_changes_little() {
    let costs_s: Vec<f64> = (0..1024).map(|i| 40.0 * (f64::from(i) / 1023.0).powi(2)).collect();
    for last_s in [0.5, 0.8, 1.0, 1.25, 2.0] {
        let wanted = of_costs(&costs_s, 1.0);
        let (found_s, n_tried) = counted(wanted, last_s, |temperature_s| of_costs(&costs_s, temperature_s));
        assert!((found_s - 1.0).abs() < 1e-3 && n_tried <= 6, "from {last_s}: {found_s} after {n_tried}");
    }
}

/// Where no temperature of the span is right the nearest end is found; nothing loops.
#[test]
fn ends_of_the_span_are_found() {
    for (always, expected_s) in
        [(1.0, SEARCH_FACTOR), (100.0, 1.0 / SEARCH_FACTOR), (f32::NAN, 1.0 / SEARCH_FACTOR)]
    {
        let (found_s, n_tried) = counted(10.0, 1.0, |_| always);
        assert!((found_s / expected_s - 1.0).abs() < 1e-3, "{always}: {found_s}");
        assert!(n_tried <= N_GUESSES + N_HALVINGS);
    }
}
