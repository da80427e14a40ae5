//! The numbers of the hall as tables.

use bench::arena::{Comparison, Report, Row};
use bench::navigation::name_of_outcome;
use bench::statistics::Mean;
use scenarios::{ArenaWay, Outcome};

use crate::axes::number;
use crate::table::{Table, probability};

/// What a way is called; "no way" for a drive that did not come past the middle of the hall.
pub(super) fn way_name(way: Option<ArenaWay>) -> &'static str {
    match way {
        Some(ArenaWay::Bushes) => "bushes",
        Some(ArenaWay::Ramp) => "ramp",
        Some(ArenaWay::Floor) => "floor",
        None => "no way",
    }
}

/// How often every row arrives, how long it takes, where it goes and how it fails.
pub(super) fn rows(report: &Report) -> Table {
    Table {
        title: format!(
            "{} runs a row through the hall, alpha {}, seed {}",
            report.n_runs, report.alpha, report.seed
        ),
        note: "bushes of 2 to 10 cm are short, of 10 to 30 cm tall\n\
               time: of drives that arrived; means with 95 % bootstrap over runs"
            .to_owned(),
        header: [
            "bushes",
            "method",
            "arrived",
            "time [s]",
            "through bushes",
            "over ramp",
            "on floor",
            "failures",
        ]
        .map(str::to_owned)
        .to_vec(),
        rows: report.rows.iter().map(row).collect(),
    }
}

fn row(row: &Row) -> Vec<String> {
    let [_, low, high] = row.goal.map(|share| 100.0 * share);
    let on = |way: ArenaWay| row.ways.get(&way).copied().unwrap_or(0).to_string();
    let failures = row.outcomes.iter().filter(|(outcome, _)| **outcome != Outcome::Goal);
    let failures: Vec<String> =
        failures.map(|(outcome, n)| format!("{n} {}", name_of_outcome(*outcome))).collect();
    vec![
        row.mission.name().to_owned(),
        row.method.name().to_owned(),
        format!("{} of {} [{low:.0}, {high:.0} %]", row.n_goal, row.n),
        mean(row.time_s),
        on(ArenaWay::Bushes),
        on(ArenaWay::Ramp),
        on(ArenaWay::Floor),
        if failures.is_empty() { "-".to_owned() } else { failures.join(", ") },
    ]
}

fn mean(mean: Option<Mean>) -> String {
    let Some(Mean { value, low, high }) = mean else { return "-".to_owned() };
    let [value, low, high] = [value, low, high].map(|value| number(value, 1));
    format!("{value} [{low}, {high}]")
}

/// `pietra` beside the others, over both missions.
pub(super) fn comparisons(report: &Report) -> Table {
    Table {
        title: "pietra on the same runs as".to_owned(),
        note: "p: exact test of the runs in which only one arrived (McNemar)".to_owned(),
        header: ["method", "runs", "only pietra / only it", "p", "time less [s]"].map(str::to_owned).to_vec(),
        rows: report.comparisons.iter().map(comparison).collect(),
    }
}

fn comparison(beside: &Comparison) -> Vec<String> {
    vec![
        beside.other.name().to_owned(),
        beside.paired.n.to_string(),
        format!("{} / {}", beside.paired.n_only_one, beside.paired.n_only_other),
        probability(beside.paired.p_value),
        mean(beside.paired.time_difference_s),
    ]
}
