//! How often drives reached their goal, for a terminal.

use bench::navigation::{DriveResult, Report, Row, name_of_outcome};

/// The table and below it every failure.
pub fn text(report: &Report) -> String {
    let mut told = format!(
        "  {:<9}{:>6}{:>10}   {:<22}{:>14}\n",
        "method", "alpha", "goal", "success [95 % Wilson]", "median time"
    );
    for row in &report.rows {
        told += &row_text(row);
    }
    let mut failed = report.drives.iter().filter(|drive| drive.failed_at_m.is_some()).peekable();
    if failed.peek().is_some() {
        told += "\n  failed\n";
    }
    told.extend(failed.map(|drive| format!("  {}\n", drive_text(drive))));
    told
}

fn row_text(row: &Row) -> String {
    let percent = |share: f64| 100.0 * share;
    let success = format!(
        "{:3.0} % [{:.0} % to {:.0} %]",
        percent(row.success),
        percent(row.wilson_low),
        percent(row.wilson_high)
    );
    let time = row.median_time_to_goal_s.map_or("-".to_owned(), |time_s| format!("{time_s:.1} s"));
    let goal = format!("{} of {}", row.n_goal, row.n);
    format!("  {:<9}{:>6}{goal:>10}   {success:<22}{time:>14}\n", row.method.name(), alpha_text(row.alpha))
}

/// Alpha as it was asked for, "any" where the method knows none.
fn alpha_text(alpha: Option<f64>) -> String {
    alpha.map_or("any".to_owned(), |alpha| alpha.to_string())
}

/// How a drive ended and, if it failed, where.
pub fn drive_text(drive: &DriveResult) -> String {
    let told = format!(
        "{:<9}{:>6}   seed {:<4} {} after {:.1} s",
        drive.method.name(),
        alpha_text(drive.alpha),
        drive.seed,
        name_of_outcome(drive.outcome),
        drive.time_s
    );
    let Some([x_m, y_m]) = drive.failed_at_m else { return told };
    let stops = match drive.stops.iter().max_by_key(|(_, count)| **count) {
        Some((reason, count)) => format!(", {} {count}x", reason),
        None => String::new(),
    };
    format!("{told} at ({x_m:.1}, {y_m:.1}), {:.1} m left{stops}", drive.distance_to_goal_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bicycle::StopReason;
    use scenarios::Outcome;
    use std::collections::BTreeMap;

    fn drive(seed: u64, outcome: Outcome) -> DriveResult {
        DriveResult {
            method: bench::closed_loop::Method::Physics,
            alpha: Some(0.6),
            seed,
            outcome,
            time_s: 48.04,
            path_length_m: 44.0,
            distance_to_goal_m: 12.34,
            largest_roll_deg: 10.0,
            largest_pitch_deg: 12.0,
            failed_at_m: (outcome != Outcome::Goal).then_some([20.0, 31.26]),
            stops: BTreeMap::from([(StopReason::StaleScan, 1), (StopReason::NoFeasibleRollout, 41)]),
        }
    }

    fn report(drives: Vec<DriveResult>) -> Report {
        Report {
            world: "rocks",
            vehicle: "pietra_full_size",
            n_seeds: drives.len() as u64,
            time_limit_s: 120.0,
            isa: mppi::Isa::Portable,
            config_hash: String::new(),
            rows: Row::of(&drives).into_iter().collect(),
            drives,
        }
    }

    #[test]
    fn table_tells_shares_and_why_drives_failed() {
        let ended = (1..=10)
            .map(|seed| drive(seed, if seed == 3 || seed == 7 { Outcome::Stopped } else { Outcome::Goal }));
        let told = text(&report(ended.collect()));
        let lines: Vec<&str> = told.lines().collect();
        // 8 of 10: the interval reaches from 49.0 to 94.3 %.
        for part in ["physics", "0.6", "8 of 10", " 80 % [49 % to 94 %]", "48.0 s"] {
            assert!(lines[1].contains(part), "{part} in {told}");
        }
        assert_eq!(lines.len(), 6, "{told}");
        for (line, seed) in [(lines[4], "seed 3"), (lines[5], "seed 7")] {
            assert!(line.contains(seed) && line.contains("stopped after 48.0 s at (20.0, 31.3)"), "{line}");
            assert!(line.ends_with("12.3 m left, no feasible rollout 41x"), "{line}");
        }
    }

    #[test]
    fn table_without_failures_lists_none() {
        let told = text(&report(vec![drive(1, Outcome::Goal)]));
        assert!(!told.contains("failed") && told.lines().count() == 2, "{told}");
        // Nobody reached anything: there is no median.
        let told = text(&report(vec![drive(1, Outcome::Stuck)]));
        assert!(told.lines().nth(1).unwrap().ends_with(" -"), "{told}");
    }
}
