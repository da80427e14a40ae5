//! The risk sweep for a terminal.

use bench::risk::{Cell, Difference, Published, Report, Row};

use crate::axes::number;
use crate::table::{Table, probability};

const NOTE: &str = "\
success [%] with 95 % Wilson intervals; in brackets behind it the mean time to the goal [s]
- published: whole bins less the published success, in points, with 95 % and p (Fisher, Holm)
exact - bins: points, runs that only one of both brought to the goal, p (McNemar, Holm)";

/// The table.
pub fn text(report: &Report) -> String {
    let header =
        ["density", "alpha", "published", "whole bins", "- published", "p", "exact", "exact - bins", "p"];
    let title = format!(
        "{} runs a cell and method, seeds {} to {}",
        report.n_runs,
        report.first_seed,
        report.first_seed.wrapping_add(report.n_runs - 1)
    );
    let table = Table {
        title,
        note: NOTE.to_owned(),
        header: header.map(str::to_owned).to_vec(),
        rows: report.cells.iter().map(cells).collect(),
    };
    table.text()
}

fn cells(cell: &Cell) -> Vec<String> {
    let paired = &cell.exact_less_whole_bin;
    let against = cell.whole_bin.less_published.as_ref();
    vec![
        number_of(cell.density),
        number_of(cell.alpha),
        cell.published.map_or(nothing(), published),
        row(&cell.whole_bin),
        against.map_or(nothing(), difference),
        against.map_or(nothing(), |difference| probability(difference.p_holm)),
        row(&cell.exact),
        format!("{} ({}/{})", points(paired.value), paired.n_exact_only, paired.n_whole_bin_only),
        probability(paired.p_holm),
    ]
}

fn nothing() -> String {
    "-".to_owned()
}

fn number_of(value: f64) -> String {
    format!("{value}")
}

fn published(published: Published) -> String {
    let [low, high] = published.time_to_goal_s;
    let time = if low == high { format!("{low:.1}") } else { format!("{low:.1}-{high:.1}") };
    format!("{:.1} ({time})", 100.0 * published.success)
}

fn row(row: &Row) -> String {
    let [share, low, high] = [row.success, row.wilson_low, row.wilson_high].map(|share| 100.0 * share);
    let time = row.mean_time_to_goal_s.map_or(nothing(), |time_s| format!("{time_s:.1}"));
    format!("{share:.1} [{low:.0}, {high:.0}] ({time})")
}

fn difference(difference: &Difference) -> String {
    let [low, high] = [difference.low, difference.high].map(|end| number(100.0 * end, 0));
    format!("{} [{low}, {high}]", points(difference.value))
}

/// Percentage points with their sign.
fn points(value: f64) -> String {
    let told = number(100.0 * value, 1);
    if value > 0.0 { format!("+{told}") } else { told }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bench::risk::Paired;
    use bench::statistics::Count;

    fn row_of(n_hit: usize) -> Row {
        Row {
            count: Count { n_hit, n: 200 },
            success: n_hit as f64 / 200.0,
            wilson_low: 0.1,
            wilson_high: 0.2,
            mean_time_to_goal_s: (n_hit > 0).then_some(11.84),
            less_published: Some(Difference {
                value: -0.025,
                low: -0.1,
                high: 0.06,
                p: 0.0004,
                p_holm: 0.0082,
            }),
            times_to_goal_s: Vec::new(),
        }
    }

    #[test]
    fn table_tells_every_cell() {
        let cell = Cell {
            density: 1.0,
            alpha: 0.6,
            published: Published::at(1.0, 0.6),
            whole_bin: row_of(40),
            exact: row_of(0),
            exact_less_whole_bin: Paired {
                value: -0.2,
                n_exact_only: 3,
                n_whole_bin_only: 43,
                p: 1e-9,
                p_holm: 1e-8,
            },
        };
        let isa = mppi::Isa::Portable;
        let unpublished = Cell { density: 0.5, published: None, ..cell.clone() };
        let report = Report { n_runs: 200, first_seed: 1, isa, cells: vec![cell, unpublished] };
        let told = text(&report);
        let lines: Vec<&str> = told.lines().collect();
        assert!(lines[0].contains("200 runs") && lines[0].contains("seeds 1 to 200"), "{told}");
        let row = lines[lines.len() - 2];
        for part in [
            "22.5 (11.8)",
            "20.0 [10, 20] (11.8)",
            "−2.5 [−10, 6]",
            "0.008",
            "0.0 [10, 20] (-)",
            "−20.0 (3/43)",
            "<0.001",
        ] {
            assert!(row.contains(part), "{part} in {told}");
        }
        assert!(!lines[lines.len() - 1].contains("22.5"), "{told}");
    }
}
