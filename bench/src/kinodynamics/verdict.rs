//! The rules that were settled beforehand, and whether they hold.

use rand::RngExt;
use scenarios::stream;
use serde::Serialize;

use super::Row;
use super::probe::Probe;
use super::report::{RowReport, TrackReport};
use crate::Verdict;

/// Draws of the bootstrap.
const DRAWS: usize = 2000;

/// Failures of one model over those of another, with the 95 % interval of a bootstrap over laps, which both drove.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Ratio {
    /// Ratio.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Ratio {
    /// Of two models that drove the same laps.
    pub fn of(above: &RowReport, below: &RowReport, seed: u64) -> Self {
        let (above, below) = (above.failures_of_laps(), below.failures_of_laps());
        let ratio = |places: &mut dyn Iterator<Item = usize>| {
            let (mut sum_above, mut sum_below) = (0, 0);
            for place in places {
                sum_above += above[place];
                sum_below += below[place];
            }
            if sum_below == 0 { f64::NAN } else { sum_above as f64 / sum_below as f64 }
        };
        let n = above.len();
        let mut rng = stream(seed, &[0xB007]);
        let mut drawn: Vec<f64> =
            (0..DRAWS).map(|_| ratio(&mut (0..n).map(|_| rng.random_range(0..n)))).collect();
        drawn.sort_by(f64::total_cmp);
        let at = |share: f64| drawn[(share * DRAWS as f64) as usize];
        Self { value: ratio(&mut (0..n)), low: at(0.025), high: at(0.975) }
    }
}

impl std::fmt::Display for Ratio {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:.2} [{:.2}, {:.2}]", self.value, self.low, self.high)
    }
}

/// All rules that the rows allow to judge.
pub(super) fn verdicts(
    outdoor: &TrackReport,
    indoor: &TrackReport,
    probe: &Probe,
    seed: u64,
) -> Vec<Verdict> {
    let mut verdicts = Vec::new();
    let mut rule = |rule: &str, found: String, is_passed: bool| {
        verdicts.push(Verdict { rule: rule.to_owned(), found, is_passed });
    };
    if let [Some(base), Some(ablation), Some(learned)] = Row::PAPER.map(|row| outdoor.row(row)) {
        let success = [base, ablation, learned].map(|row| row.success);
        let told = success.map(|share| format!("{:.1} %", 100.0 * share)).join(" < ");
        rule(
            "success in the order baseline < ablation < learned (paper 52.4 < 82.9 < 86.9 %)",
            told,
            success[0] < success[1] && success[1] < success[2],
        );
        rule(
            "baseline's success between 47.4 and 57.4 %: the walls were tuned to it",
            format!("{:.1} %", 100.0 * success[0]),
            (0.474..=0.574).contains(&success[0]),
        );
        for (name, above, below, most) in [
            ("failures ablation / baseline at most 0.45 (paper 0.36)", ablation, base, 0.45),
            ("failures learned / baseline at most 0.35 (paper 0.28)", learned, base, 0.35),
            ("failures learned / ablation at most 0.90 (paper 0.77)", learned, ablation, 0.90),
        ] {
            let ratio = Ratio::of(above, below, seed);
            rule(name, ratio.to_string(), ratio.value <= most);
        }
        for row in [base, ablation, learned] {
            let rank = spearman(&outdoor.speeds_mps, &row.failed_per_speed);
            let name = format!("{}: failures rise with speed (Spearman above 0.8)", row.row.name());
            rule(&name, format!("{rank:.2}"), rank > 0.8);
        }
        let per_800 = 800.0 * learned.failures as f64 / learned.n as f64;
        rule("beat: at most 105 failures of 800", format!("{per_800:.0}"), per_800 <= 105.0);
    }
    if let [Some(base), Some(learned)] = [Row::Baseline, Row::Learned].map(|row| indoor.row(row)) {
        let ratio = Ratio::of(learned, base, seed);
        let name = "unseen floor: failures learned / baseline at most 0.35 (paper 0.26)";
        rule(name, ratio.to_string(), ratio.value <= 0.35);
        let per_200 = 200.0 * learned.failures as f64 / learned.n as f64;
        rule("unseen floor, beat: at most 26 failures of 200", format!("{per_200:.0}"), per_200 <= 26.0);
    }
    for (control, what) in [(Row::Shuffled, "shuffled"), (Row::Constant, "constant")] {
        if let [Some(control), Some(ablation)] = [control, Row::Ablation].map(|row| outdoor.row(row)) {
            let ratio = Ratio::of(control, ablation, seed);
            // At the ablation's level: not better beyond chance.
            let name =
                format!("control: with a {what} history no better than the ablation (interval reaches 1)");
            rule(&name, ratio.to_string(), ratio.high >= 1.0);
        }
    }
    rule(
        "the ground can be told from the unit and not from the wish (accuracy)",
        format!(
            "{:.2} from the unit, {:.2} from speed and curvature, {:.2} by chance",
            probe.from_imu, probe.from_wish, probe.chance
        ),
        probe.from_imu > 2.0 * probe.chance && probe.from_wish < probe.chance + 0.1,
    );
    verdicts
}

/// Rank correlation; equal values share their mean rank.
fn spearman(a: &[f64], b: &[f64]) -> f64 {
    let ranks = |values: &[f64]| -> Vec<f64> {
        let rank = |value: &f64| {
            let below = values.iter().filter(|other| *other < value).count() as f64;
            let equal = values.iter().filter(|other| *other == value).count() as f64;
            below + 0.5 * (equal - 1.0)
        };
        values.iter().map(rank).collect()
    };
    let (a, b) = (ranks(a), ranks(b));
    let mean = 0.5 * (a.len() as f64 - 1.0);
    let sum = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| (x - mean) * (y - mean)).sum::<f64>();
    sum(&a, &b) / (sum(&a, &a) * sum(&b, &b)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rank_correlation_of_known_orders() {
        assert!((spearman(&[1.0, 2.0, 3.0, 4.0], &[10.0, 20.0, 30.0, 99.0]) - 1.0).abs() < 1e-12);
        // Ranks 0 1 2 3 against 1 0 2 3: 1 - 6 x 2 / (4 x 15) = 0.8.
        assert!((spearman(&[1.0, 2.0, 3.0, 4.0], &[2.0, 1.0, 3.0, 4.0]) - 0.8).abs() < 1e-12);
        // The paper's baseline per speed.
        let speeds: Vec<f64> = (0..10).map(|k| 1.6 + 0.1 * f64::from(k)).collect();
        let failed = [23.8, 27.5, 35.0, 47.5, 58.8, 52.5, 57.5, 57.5, 56.2, 60.0];
        assert!(spearman(&speeds, &failed) > 0.8);
    }
}
