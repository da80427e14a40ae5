//! `surefoot bench navigation`: the drives, a bar meanwhile, and the table as text, JSON and picture.

use std::io::IsTerminal;

use ::bench::closed_loop::DriveError;
use ::bench::navigation::{
    BrokenDrive, DriveResult, NavigationError, Report, Request, Row, measure, name_of_outcome,
};
use indicatif::{ProgressBar, ProgressStyle};
use navigator::NavigatorError;
use serde::Serialize;
use traversability::CvarLevel;

use crate::arguments::BenchNavigationArguments;
use crate::picture::draw_navigation_table;
use crate::{UsageError, output, summary};

/// Room that must be free beforehand: JSON and picture of the largest table take less [bytes].
const ROOM_BYTES: u64 = 16 << 20;

/// The content of `navigation.json`.
#[derive(Serialize)]
struct Written<'a> {
    revision: &'static str,
    #[serde(flatten)]
    report: &'a Report,
}

pub(crate) fn run_navigation(arguments: &BenchNavigationArguments) -> anyhow::Result<()> {
    let request = request(arguments)?;
    formats::prepare_out_dir(&arguments.out, ROOM_BYTES)
        .map_err(|error| UsageError(format!("--out: {}", UsageError::from_input(error))))?;
    arguments.json.as_deref().map_or(Ok(()), output::prepare_json)?;
    let bar = bar(&request);
    let measured = measure(&request, |drive| {
        bar.set_message(told_drive(drive));
        bar.inc(1);
    });
    bar.finish_and_clear();
    let report = measured.map_err(told)?;
    print!("{}", told_table(&report));
    write(&report, arguments)
}

fn request(arguments: &BenchNavigationArguments) -> Result<Request, UsageError> {
    let levels = arguments.alpha.iter().map(|&alpha| CvarLevel::new(alpha));
    Ok(Request {
        methods: arguments.methods.iter().map(|&method| method.into()).collect(),
        levels: levels.collect::<Result<_, _>>().map_err(UsageError::from_input)?,
        n_seeds: arguments.seeds,
        time_limit_s: arguments.time_limit,
        n_threads: arguments.n_threads(),
        isa: arguments.isa.into(),
    })
}

/// Counts drives on standard error; draws nothing where that is not a terminal.
fn bar(request: &Request) -> ProgressBar {
    let bar = if std::io::stderr().is_terminal() {
        ProgressBar::new(request.n_drives())
    } else {
        ProgressBar::hidden()
    };
    // The template is a constant: were it wrong, the plain bar would do.
    if let Ok(style) =
        ProgressStyle::with_template("  {bar:28.green/black.bright} {pos}/{len} drives, {eta} left   {msg}")
    {
        bar.set_style(style.progress_chars("━╸━"));
    }
    bar
}

/// An instruction set that the machine lacks is the user's choice; all else is not.
fn told(error: NavigationError) -> anyhow::Error {
    if let NavigationError::Drive { source, .. } = &error
        && let BrokenDrive::Loop(DriveError::Navigator(NavigatorError::Controller(refused))) = source.as_ref()
        && matches!(refused, mppi::ConfigError::Isa(_))
    {
        return UsageError(refused.to_string()).into();
    }
    error.into()
}

fn write(report: &Report, arguments: &BenchNavigationArguments) -> anyhow::Result<()> {
    let written = Written { revision: summary::revision(), report };
    let file = |name: &str| arguments.out.join(name);
    for path in [Some(file("navigation.json")), arguments.json.clone()].iter().flatten() {
        formats::write_json_atomic(path, &written)?;
    }
    draw_navigation_table(report, &file("navigation.png"))?;
    println!("\n  navigation.json and navigation.png in {}", arguments.out.display());
    Ok(())
}

/// The table and below it every failure.
fn told_table(report: &Report) -> String {
    let mut told = format!(
        "  {:<9}{:>6}{:>10}   {:<22}{:>14}\n",
        "method", "alpha", "goal", "success [95 % Wilson]", "median time"
    );
    for row in &report.rows {
        told += &told_row(row);
    }
    let mut failed = report.drives.iter().filter(|drive| drive.failed_at_m.is_some()).peekable();
    if failed.peek().is_some() {
        told += "\n  failed\n";
    }
    told.extend(failed.map(|drive| format!("  {}\n", told_drive(drive))));
    told
}

fn told_row(row: &Row) -> String {
    let percent = |share: f64| 100.0 * share;
    let success = format!(
        "{:3.0} % [{:.0} % to {:.0} %]",
        percent(row.success),
        percent(row.wilson_low),
        percent(row.wilson_high)
    );
    let time = row.median_time_to_goal_s.map_or("-".to_owned(), |time_s| format!("{time_s:.1} s"));
    let goal = format!("{} of {}", row.n_goal, row.n);
    format!("  {:<9}{:>6}{goal:>10}   {success:<22}{time:>14}\n", row.method.name(), told_alpha(row.alpha))
}

/// Alpha as it was asked for, "any" where the method knows none.
fn told_alpha(alpha: Option<f64>) -> String {
    alpha.map_or("any".to_owned(), |alpha| alpha.to_string())
}

/// How a drive ended and, if it failed, where.
fn told_drive(drive: &DriveResult) -> String {
    let told = format!(
        "{:<9}{:>6}   seed {:<4} {} after {:.1} s",
        drive.method.name(),
        told_alpha(drive.alpha),
        drive.seed,
        name_of_outcome(drive.outcome),
        drive.time_s
    );
    let Some([x_m, y_m]) = drive.failed_at_m else { return told };
    let stops = match drive.stops.iter().max_by_key(|(_, count)| **count) {
        Some((reason, count)) => format!(", {} {count}x", summary::name_of(*reason)),
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
            method: ::bench::closed_loop::Method::Physics,
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
        let told = told_table(&report(ended.collect()));
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
        let told = told_table(&report(vec![drive(1, Outcome::Goal)]));
        assert!(!told.contains("failed") && told.lines().count() == 2, "{told}");
        // Nobody reached anything: there is no median.
        let told = told_table(&report(vec![drive(1, Outcome::Stuck)]));
        assert!(told.lines().nth(1).unwrap().ends_with(" -"), "{told}");
    }

    #[test]
    fn instruction_set_that_is_absent_is_the_users_choice() {
        let absent = || mppi::ConfigError::Isa(bicycle::lanes::IsaAbsent { isa: mppi::Isa::Avx512 });
        let broken = NavigationError::Drive {
            drive: "truth, seed 1".to_owned(),
            source: Box::new(DriveError::from(NavigatorError::from(absent())).into()),
        };
        let error = told(broken);
        assert!(error.is::<UsageError>());
        assert_eq!(error.to_string(), absent().to_string());
        assert!(!told(NavigationError::NoDrives).is::<UsageError>());
    }
}
