//! The numbers of the navigation benchmark as tables.

use bench::closed_loop::Method;
use bench::navigation::{Comparison, Report, Row, name_of_outcome};
use scenarios::Outcome;

use crate::table::Table;

/// How often every row arrives, how long it takes, and how it fails.
pub(super) fn rows(report: &Report) -> Table {
    let n_all = report.n_missing + report.drives.len();
    let note = match report.n_missing {
        0 => String::new(),
        n => format!("{n} of {n_all} drives are missing"),
    };
    Table {
        title: "Goals reached".to_owned(),
        note,
        header: ["method", "alpha", "goal", "success [95 % Wilson]", "median time", "failures"]
            .map(str::to_owned)
            .into(),
        rows: report.rows.iter().map(row).collect(),
    }
}

fn row(row: &Row) -> Vec<String> {
    let [share, low, high] = [row.success, row.wilson_low, row.wilson_high].map(|share| 100.0 * share);
    let failures = row.outcomes.iter().filter(|(outcome, _)| **outcome != Outcome::Goal);
    let failures: Vec<String> =
        failures.map(|(outcome, n)| format!("{n} {}", name_of_outcome(*outcome))).collect();
    vec![
        row.method.name().to_owned(),
        alpha(row.alpha),
        format!("{} of {}", row.n_goal, row.n),
        format!("{share:.0} % [{low:.0} % to {high:.0} %]"),
        row.median_time_to_goal_s.map_or("-".to_owned(), |time_s| format!("{time_s:.1} s")),
        if failures.is_empty() { "-".to_owned() } else { failures.join(", ") },
    ]
}

/// Alpha as it was asked for, "any" where the method knows none.
pub(super) fn alpha(alpha: Option<f64>) -> String {
    alpha.map_or("any".to_owned(), |alpha| alpha.to_string())
}

/// Rows against one another on the same starts and goals.
pub(super) fn comparisons(report: &Report) -> Table {
    Table {
        title: "The same starts and goals".to_owned(),
        note: "p: exact test of the pairs in which only one arrived (McNemar)\n\
               time: of the one less that of the other where both arrived, mean and 95 % bootstrap"
            .to_owned(),
        header: ["one", "other", "pairs", "only one", "only other", "p", "time"].map(str::to_owned).into(),
        rows: report.comparisons.iter().map(comparison).collect(),
    }
}

fn comparison(compared: &Comparison) -> Vec<String> {
    let name = |method: Method, alpha: Option<f64>| match alpha {
        Some(alpha) => format!("{} {alpha}", method.name()),
        None => method.name().to_owned(),
    };
    vec![
        name(compared.method, compared.alpha),
        name(compared.other, compared.other_alpha),
        compared.n.to_string(),
        compared.n_only_one.to_string(),
        compared.n_only_other.to_string(),
        format!("{:.4}", compared.p_value),
        compared.time_difference_s.map_or("-".to_owned(), |time| {
            format!("{:+.1} s [{:+.1}, {:+.1}]", time.value, time.low, time.high)
        }),
    ]
}
