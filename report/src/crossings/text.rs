//! How crossings ended, for a terminal.

use bench::crossings::{Crossing, Report, Row};

/// The table and below it every run that did not reach the goal.
pub fn text(report: &Report) -> String {
    let mut told = format!(
        "  {:<9}{:>6}{:>7}{:>9}{:>11}{:>13}{:>13}{:>13}{:>7}\n",
        "people", "runs", "goal", "struck", "avoidable", "walked into", "stopped for", "median time", "other"
    );
    told.extend(report.rows.iter().map(row_text));
    let mut failed = report.runs.iter().filter(|run| run.outcome != scenarios::Outcome::Goal).peekable();
    if failed.peek().is_some() {
        told += "\n  goal not reached\n";
    }
    told.extend(failed.map(|run| format!("  {}\n", run_text(run))));
    told
}

fn row_text(row: &Row) -> String {
    let time = row.median_time_s.map_or("-".to_owned(), |time_s| format!("{time_s:.1} s"));
    format!(
        "  {:<9}{:>6}{:>7}{:>9}{:>11}{:>13}{:>13}{time:>13}{:>7}\n",
        row.handling.name(),
        row.n_runs,
        row.n_goal,
        row.n_struck,
        row.n_avoidable,
        row.n_walked_into,
        row.n_stopped_for,
        row.n_other
    )
}

/// How one run ended, in a line.
pub fn run_text(run: &Crossing) -> String {
    let told =
        format!("{:<9}run {:<4} {} after {:.1} s", run.handling.name(), run.number, run.outcome, run.time_s);
    let Some(contact) = run.contact else { return told };
    let [x_m, y_m] = contact.at_m;
    let spared =
        if contact.was_avoidable { "a stop would have avoided it" } else { "no stop would have avoided it" };
    format!("{told} at ({x_m:.1}, {y_m:.1}), {:.1} m/s: {spared}", contact.speed_mps)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bench::crossings::{Contact, Handling};
    use scenarios::Outcome;

    fn run(number: u64, outcome: Outcome) -> Crossing {
        let contact = Contact {
            time_s: 7.0,
            at_m: [3.04, -1.0],
            speed_mps: 0.84,
            foreseen_at_s: Some(6.0),
            was_avoidable: number == 1,
        };
        Crossing {
            handling: Handling::Tracked,
            number,
            outcome,
            time_s: 21.04,
            contact: (outcome == Outcome::WalkerStruck).then_some(contact),
            n_walked_into: 0,
            n_stops_for_moving: 3,
            least_clearance_m: 0.4,
            trail: Vec::new(),
        }
    }

    #[test]
    fn table_tells_who_was_struck_and_whether_a_stop_would_have_avoided_it() {
        let runs = vec![run(0, Outcome::Goal), run(1, Outcome::WalkerStruck), run(2, Outcome::WalkerStruck)];
        let report = Report {
            vehicle: "pietra_full_size",
            seed: 1,
            n_runs: 3,
            n_walkers: 2,
            isa: mppi::Isa::Portable,
            config_hash: String::new(),
            rows: Row::of(&runs).into_iter().collect(),
            runs,
        };
        let told = text(&report);
        let lines: Vec<&str> = told.lines().collect();
        let words: Vec<&str> = lines[1].split_whitespace().collect();
        assert_eq!(words, ["tracked", "3", "1", "2", "1", "0", "3", "21.0", "s", "0"], "{told}");
        assert!(lines[4].contains("run 1") && lines[4].ends_with("0.8 m/s: a stop would have avoided it"));
        assert!(lines[5].contains("(3.0, -1.0)") && lines[5].ends_with("no stop would have avoided it"));
    }
}
