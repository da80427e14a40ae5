//! The score in tables for a terminal.

use bench::gap_score::{Quantiles, Score, Share};

/// Everything but the single cases.
pub fn text(score: &Score) -> String {
    let mut told =
        format!("\n  {:<62}{:>10}   share [95 % Wilson]\n", format!("{} cases", score.n_cases), "");
    told.extend(score.shares.iter().map(share));
    told += &format!("\n  {:<46}{:>5}{:>10}{:>10}{:>10}{:>10}\n", "", "n", "mean", "p10", "median", "p90");
    told.extend(numbers(score).iter().map(|(name, quantiles)| self::quantiles(name, quantiles)));
    let calibration = &score.calibration;
    told += &format!(
        "\n  calibration of the scores: Brier {} over all effects, {} over first names, mean distance {}\n",
        number(calibration.brier),
        number(calibration.brier_first),
        number(calibration.expected_error)
    );
    told += "\n  single effects, first name right\n";
    told.extend(score.first_names_by.iter().map(share));
    told
}

/// Numbers that many cases have, with their names.
pub(super) fn numbers(score: &Score) -> [(&'static str, Quantiles); 5] {
    [
        ("explanations in the credible set", score.credible_set_size),
        ("closed fraction, held out", score.closed),
        ("predicted from achieved, distance", score.predicted_off),
        ("parameter, relative error", score.parameter_error),
        ("naming a case [s]", score.naming_s),
    ]
}

fn share(share: &Share) -> String {
    let count = format!("{} of {}", share.n_hit, share.n);
    format!("  {:<62}{count:>10}   {}\n", share.name, percent(share))
}

/// `94 % [85 % to 98 %]`, a dash of nothing.
pub(super) fn percent(share: &Share) -> String {
    let Some(value) = share.share else { return "-".to_owned() };
    let [low, high] = share.wilson.map(|end| 100.0 * end);
    format!("{:.0} % [{low:.0} % to {high:.0} %]", 100.0 * value)
}

fn quantiles(name: &str, quantiles: &Quantiles) -> String {
    let Quantiles { n, mean, p10, median, p90 } = *quantiles;
    let [mean, p10, median, p90] = [mean, p10, median, p90].map(number);
    format!("  {name:<46}{n:>5}{mean:>10}{p10:>10}{median:>10}{p90:>10}\n")
}

/// Three decimals; a dash of nothing.
pub(super) fn number(value: Option<f64>) -> String {
    value.map_or("-".to_owned(), |value| format!("{value:.3}"))
}
