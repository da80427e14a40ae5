//! Our routes beside a slow reference, for a terminal.

use bench::route::{ExpertReport, ExpertRow, Pair};

use super::text::spread;
use crate::table::Table;

/// A row for each landscape, then one for each task.
pub fn experts(report: &ExpertReport) -> String {
    let header = [
        "",
        "at goal",
        "reference",
        "time [s]",
        "reference",
        "expected over reference's",
        "driven",
        "planned in [s]",
        "reference",
    ];
    let table = Table {
        title: format!("our routes beside a slow reference, seed {}, {}", report.seed, report.vehicle),
        note: "means with intervals of 95 %; driven: where both arrived".to_owned(),
        header: header.map(str::to_owned).to_vec(),
        rows: report.rows.iter().map(row).collect(),
    };
    let header = ["task", "length [m]", "reference", "expected [s]", "reference", "end", "reference"];
    let tasks = Table {
        title: "task by task".to_owned(),
        header: header.map(str::to_owned).to_vec(),
        rows: report.pairs.iter().map(pair).collect(),
        ..Table::default()
    };
    table.text() + "\n" + &tasks.text()
}

fn row(row: &ExpertRow) -> Vec<String> {
    let [ours_s, reference_s] = row.time_s.map(|time_s| spread(time_s, 1));
    let [ours_planned_s, reference_planned_s] = row.planning_s.map(|mean| spread(mean, 2));
    let [n_ours, n_reference] = row.n_success.map(|n_success| format!("{n_success} of {}", row.n));
    vec![
        row.landscape.name().to_owned(),
        n_ours,
        n_reference,
        ours_s,
        reference_s,
        spread(row.expected_ratio, 3),
        spread(row.driven_ratio, 3),
        ours_planned_s,
        reference_planned_s,
    ]
}

fn pair(pair: &Pair) -> Vec<String> {
    let Pair { landscape, task, ours, reference } = pair;
    vec![
        format!("{} {task}", landscape.name()),
        format!("{:.0}", ours.length_m),
        format!("{:.0}", reference.length_m),
        format!("{:.1}", ours.expected_s),
        format!("{:.1}", reference.expected_s),
        ours.end.name().to_owned(),
        reference.end.name().to_owned(),
    ]
}
