//! The table for a terminal.

use bench::route::{Comparison, Drive, Report, Row, published};
use bench::statistics::Mean;
use scenarios::LandscapeKind;

use crate::table::{Table, probability};
use crate::verdict;

/// Rows of both landscapes beside the published ones, then ours beside the others, then the rules.
pub fn text(report: &Report) -> String {
    let tables: String =
        LandscapeKind::ALL.iter().map(|landscape| of_landscape(report, *landscape)).collect();
    let rules = if report.verdicts.is_empty() { String::new() } else { verdict::text(&report.verdicts) };
    tables + &refusals(&report.drives) + &rules
}

fn of_landscape(report: &Report, landscape: LandscapeKind) -> String {
    let rows: Vec<&Row> = report.rows.iter().filter(|row| row.landscape == landscape).collect();
    let n = rows.iter().map(|row| row.n).max().unwrap_or(0);
    let header = ["", "at goal", "95 %", "time [s]", "over expected", "paper", "failures"];
    let table = Table {
        title: format!("{}, {n} tasks of seed {}, {}", landscape.name(), report.seed, report.vehicle),
        note: "time, and time over expected: of the tasks at the goal, with intervals of 95 %".to_owned(),
        header: header.map(str::to_owned).to_vec(),
        rows: rows.iter().map(|row| line(row)).collect(),
    };
    let of_it = report.comparisons.iter().filter(|comparison| comparison.landscape == landscape);
    let header = ["beside ours", "only ours", "only it", "p", "its time over ours"];
    let pairs = Table {
        title: "task by task".to_owned(),
        header: header.map(str::to_owned).to_vec(),
        rows: of_it.map(pair).collect(),
        ..Table::default()
    };
    table.text() + "\n" + &pairs.text() + "\n"
}

fn name(row: &Row) -> String {
    match row.tracking {
        bench::route::Tracking::Pd => row.method.name().to_owned(),
        bench::route::Tracking::Mppi => format!("{}, followed by MPPI", row.method.name()),
    }
}

fn line(row: &Row) -> Vec<String> {
    let published = published(row.landscape, row.method);
    let ratio = published.ratio.map_or("-".to_owned(), |ratio| format!("{ratio:.2}"));
    let paper = format!("{:.0} %, {:.1} s, {ratio}", 100.0 * published.success, published.time_s);
    let is_pd = row.tracking == bench::route::Tracking::Pd;
    let failures: Vec<String> = row.failures.iter().map(|(end, n)| format!("{n} {}", end.name())).collect();
    let [low, high] = row.success_interval.map(|end| 100.0 * end);
    vec![
        name(row),
        format!("{} of {}", row.n_success, row.n),
        format!("{low:.0} to {high:.0}"),
        spread(row.time_s, 1),
        spread(row.ratio, 3),
        if is_pd { paper } else { String::new() },
        failures.join(", "),
    ]
}

pub(super) fn spread(mean: Option<Mean>, decimals: usize) -> String {
    mean.map_or("-".to_owned(), |Mean { value, low, high }| {
        format!("{value:.decimals$} [{low:.decimals$}, {high:.decimals$}]")
    })
}

fn pair(comparison: &Comparison) -> Vec<String> {
    let by = match comparison.tracking {
        bench::route::Tracking::Pd => String::new(),
        bench::route::Tracking::Mppi => ", followed by MPPI".to_owned(),
    };
    vec![
        comparison.method.name().to_owned() + &by,
        comparison.n_only_ours.to_string(),
        comparison.n_only_other.to_string(),
        probability(comparison.p_value),
        spread(comparison.time_ratio, 3),
    ]
}

/// Why our planner found no route, where it found none.
fn refusals(drives: &[Drive]) -> String {
    let ours = drives.iter().filter(|drive| drive.method == bench::route::Method::Ours);
    let told = ours.filter_map(|drive| {
        let why = drive.refused.as_ref()?;
        Some(format!("  {} task {}: {why}\n", drive.landscape.name(), drive.task))
    });
    told.collect()
}
