//! The numbers of the navigation benchmark as tables.

use bench::navigation::{Comparison, Entrant, JUMP_S, Report, Row, name_of_outcome};
use scenarios::Outcome;

use crate::table::Table;

/// How often every row arrives, how long it takes, and how it fails.
pub(super) fn rows(report: &Report) -> Table {
    let n_all = report.n_missing + report.drives.len();
    let mut notes = Vec::new();
    if report.n_missing > 0 {
        notes.push(format!("{} of {n_all} drives are missing", report.n_missing));
    }
    let mut header: Vec<String> =
        ["method", "alpha", "goal", "success [95 % Wilson]", "median time", "failures"]
            .map(str::to_owned)
            .into();
    let has_jumped = report.rows.iter().any(|row| row.n_jumped > 0);
    if has_jumped {
        header.push("jumped".to_owned());
        notes.push(format!("jumped: drives with all wheels off the ground for {JUMP_S} s or more"));
    }
    let has_compute = report.rows.iter().any(|row| row.compute.is_some());
    if has_compute {
        header.push("a command [ms]".to_owned());
        notes.push("a command: median and, of the worst drive, 99 of 100, by the machine's clock; no simulated time passes".to_owned());
    }
    let mut rows: Vec<Vec<String>> = report.rows.iter().map(row).collect();
    if has_jumped {
        rows.iter_mut().zip(&report.rows).for_each(|(cells, row)| cells.push(row.n_jumped.to_string()));
    }
    if has_compute {
        rows.iter_mut().zip(&report.rows).for_each(|(cells, row)| cells.push(compute(row)));
    }
    Table { title: "Goals reached".to_owned(), note: notes.join("\n"), header, rows }
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

/// How long a planner of other people's took for a command.
fn compute(row: &Row) -> String {
    row.compute.map_or("-".to_owned(), |compute| format!("{:.1}, {:.1}", compute.median_ms, compute.p99_ms))
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
    let name = |who: &Entrant, alpha: Option<f64>| match alpha {
        Some(alpha) => format!("{} {alpha}", who.name()),
        None => who.name().to_owned(),
    };
    vec![
        name(&compared.method, compared.alpha),
        name(&compared.other, compared.other_alpha),
        compared.paired.n.to_string(),
        compared.paired.n_only_one.to_string(),
        compared.paired.n_only_other.to_string(),
        format!("{:.4}", compared.paired.p_value),
        compared.paired.time_difference_s.map_or("-".to_owned(), |time| {
            format!("{:+.1} s [{:+.1}, {:+.1}]", time.value, time.low, time.high)
        }),
    ]
}
