//! How often drives reached their goal, for a terminal.

use bench::navigation::{DriveResult, Report, name_of_outcome};

use super::tables;
use crate::verdict;

/// Failures that are told; all of them are in the JSON.
const FAILURES_TOLD: usize = 40;

/// The table, rows against one another, the rules, and below them how drives failed.
pub fn text(report: &Report) -> String {
    let mut told = tables::rows(report).text();
    if !report.comparisons.is_empty() {
        told += &format!("\n{}", tables::comparisons(report).text());
    }
    if !report.verdicts.is_empty() {
        told += &format!("\n{}", verdict::text(&report.verdicts));
    }
    let failed: Vec<&DriveResult> =
        report.drives.iter().filter(|drive| drive.failed_at_m.is_some()).collect();
    if !failed.is_empty() {
        told += "\n  failed\n";
    }
    told.extend(failed.iter().take(FAILURES_TOLD).map(|drive| format!("  {}\n", drive_text(drive))));
    if failed.len() > FAILURES_TOLD {
        told += &format!("  and {} more\n", failed.len() - FAILURES_TOLD);
    }
    told
}

/// How a drive ended and, if it failed, where.
pub fn drive_text(drive: &DriveResult) -> String {
    let told = format!(
        "{:<16}{:>6}   map {:<3} pair {:<3} {} after {:.1} s",
        drive.method.name(),
        tables::alpha(drive.alpha),
        drive.map + 1,
        drive.pair + 1,
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
    use std::collections::BTreeMap;

    use super::*;
    use bench::navigation::{ComputeTime, Entrant, Plan, PlannerName, Request};
    use bicycle::StopReason;
    use scenarios::{Outcome, RockFieldConfig};

    fn report(outcomes: &[Outcome]) -> Report {
        let request = Request {
            vehicle: "pietra_full_size".to_owned(),
            speed_mps: None,
            methods: vec![bench::closed_loop::Method::Physics],
            planners: Vec::new(),
            levels: vec![traversability::CvarLevel::new(0.6).expect("a level")],
            field: RockFieldConfig::default(),
            seed: 1,
            n_maps: 2,
            n_pairs: 5,
            time_limit_s: 120.0,
            isa: mppi::Isa::Portable,
            plant: scenarios::Engine::Rapier,
            settings: String::new(),
        };
        let drives = outcomes.iter().zip(0..).map(|(&outcome, k)| DriveResult {
            method: bench::closed_loop::Method::Physics.into(),
            alpha: Some(0.6),
            map: k / 5,
            pair: k % 5,
            outcome,
            time_s: 48.04,
            path_length_m: 44.0,
            distance_to_goal_m: 12.34,
            largest_roll_deg: 10.0,
            largest_pitch_deg: 12.0,
            longest_flight_s: 0.0,
            failed_at_m: (outcome != Outcome::Goal).then_some([20.0, 31.26]),
            stops: BTreeMap::from([(StopReason::StaleScan, 1), (StopReason::NoFeasibleRollout, 41)]),
            compute: None,
        });
        Plan::new(&request).expect("a plan").report(&drives.collect::<Vec<_>>())
    }

    #[test]
    fn table_tells_shares_and_why_drives_failed() {
        let mut outcomes = [Outcome::Goal; 10];
        (outcomes[2], outcomes[6]) = (Outcome::Stopped, Outcome::Stopped);
        let told = text(&report(&outcomes));
        let lines: Vec<&str> = told.lines().collect();
        // 8 of 10: the interval reaches from 49.0 to 94.3 %.
        for part in ["physics", "0.6", "8 of 10", " 80 % [49 % to 94 %]", "48.0 s", "2 stopped"] {
            assert!(lines[2].contains(part), "{part} in {told}");
        }
        assert_eq!(lines.len(), 7, "{told}");
        for (line, place) in [(lines[5], "map 1   pair 3"), (lines[6], "map 2   pair 2")] {
            assert!(line.contains(place) && line.contains("stopped after 48.0 s at (20.0, 31.3)"), "{line}");
            assert!(line.ends_with("12.3 m left, no feasible rollout 41x"), "{line}");
        }
    }

    #[test]
    fn what_a_command_took_is_told_where_there_are_planners_of_others() {
        let ours = report(&[Outcome::Goal]);
        assert!(!text(&ours).contains("a command"));
        let name: PlannerName = "mine".parse().expect("a name");
        let mut drives = ours.drives.clone();
        drives.push(DriveResult {
            method: Entrant::External(name.clone()),
            alpha: None,
            compute: Some(ComputeTime { n_cycles: 480, median_ms: 12.34, p99_ms: 45.67 }),
            ..drives[0].clone()
        });
        let told = text(&Plan { planners: vec![name], ..ours.plan }.report(&drives));
        let line =
            |who: &str| told.lines().find(|line| line.trim().starts_with(who)).expect("a row").trim_end();
        assert!(line("mine").ends_with("12.3, 45.7") && line("physics").ends_with('-'), "{told}");
    }

    #[test]
    fn table_without_failures_lists_none_and_tells_what_is_missing() {
        let told = text(&report(&[Outcome::Goal]));
        assert!(!told.contains("failed") && told.contains("9 of 10 drives are missing"), "{told}");
        // Nobody reached anything: there is no median.
        let told = text(&report(&[Outcome::Stuck; 10]));
        assert!(
            !told.contains("missing") && told.lines().nth(2).expect("a row").contains(" -  10 stuck"),
            "{told}"
        );
    }
}
