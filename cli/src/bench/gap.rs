//! `surefoot bench gap`: the drives, a bar meanwhile, and the table as text, JSON and picture.

use std::io::IsTerminal;

use ::bench::gap_closed_loop::{ClosedLoopError, DriveResult, Mean, Progress, Report, Request, Row, measure};
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use crate::arguments::BenchGapArguments;
use crate::picture::draw_gap_closed_loop;
use crate::{UsageError, output, summary};

/// Room that must be free beforehand: JSON and picture of the largest table take less [bytes].
const ROOM_BYTES: u64 = 16 << 20;

/// The content of `gap_closed_loop.json`.
#[derive(Serialize)]
struct Written<'a> {
    revision: &'static str,
    #[serde(flatten)]
    report: &'a Report,
}

pub(crate) fn run_gap(arguments: &BenchGapArguments) -> anyhow::Result<()> {
    let request = Request {
        grounds: arguments.grounds.clone(),
        gaps: arguments.gaps.clone(),
        n_seeds: arguments.seeds,
        n_threads: arguments.n_threads(),
        isa: arguments.isa.into(),
    };
    formats::prepare_out_dir(&arguments.out, ROOM_BYTES)
        .map_err(|error| UsageError(format!("--out: {}", UsageError::from_input(error))))?;
    arguments.json.as_deref().map_or(Ok(()), output::prepare_json)?;
    let bar = bar(request.n_drives() as u64);
    let measured = measure(&request, |progress| match progress {
        Progress::Diagnosed(found) => bar.set_message(format!("diagnosed {}", found.gap.name())),
        Progress::Drove(drive) => {
            bar.set_message(told_drive(drive));
            bar.inc(1);
        }
    });
    bar.finish_and_clear();
    let report = measured.map_err(told)?;
    print!("{}", told_table(&report));
    let file = |name: &str| arguments.out.join(name);
    let written = Written { revision: summary::revision(), report: &report };
    for path in [Some(file("gap_closed_loop.json")), arguments.json.clone()].iter().flatten() {
        formats::write_json_atomic(path, &written)?;
    }
    draw_gap_closed_loop(&report, &file("gap_closed_loop.png"))?;
    println!("\n  gap_closed_loop.json and gap_closed_loop.png in {}", arguments.out.display());
    Ok(())
}

/// Counts drives on standard error; draws nothing where that is not a terminal.
fn bar(n_drives: u64) -> ProgressBar {
    let bar =
        if std::io::stderr().is_terminal() { ProgressBar::new(n_drives) } else { ProgressBar::hidden() };
    // The template is a constant: were it wrong, the plain bar would do.
    if let Ok(style) =
        ProgressStyle::with_template("  {bar:28.green/black.bright} {pos}/{len} drives, {eta} left   {msg}")
    {
        bar.set_style(style.progress_chars("━╸━"));
    }
    bar
}

/// An instruction set that the machine lacks is the user's choice; all else is not.
fn told(error: ClosedLoopError) -> anyhow::Error {
    match error {
        ClosedLoopError::Controller(refused @ mppi::ConfigError::Isa(_)) => {
            UsageError::from_input(refused).into()
        }
        other => other.into(),
    }
}

fn told_drive(drive: &DriveResult) -> String {
    let job = &drive.job;
    let (ground, gap, belief) = (job.ground.name(), job.gap.name(), job.belief.name());
    format!("{ground}, {gap}, {belief}, seed {}: {:?} after {:.1} s", job.seed, drive.end, drive.time_s)
}

fn told_table(report: &Report) -> String {
    let mut told = String::from("  found in the recorded drives\n");
    for found in &report.diagnoses {
        let effects: Vec<String> = found.found.iter().map(told_effect).collect();
        let effects = if effects.is_empty() { "nothing".to_owned() } else { effects.join(", ") };
        let truth = found.truth.as_ref().map_or("nothing".to_owned(), told_effect);
        told += &format!("    {:<14} {effects}; true: {truth}\n", found.gap.name());
    }
    told += &format!(
        "\n  {:<7}{:<14}{:<10}{:>8}  {:<22}{:<22}{:<22}{:<22}\n",
        "", "gap", "model", "goal", "time [s]", "off course RMS [m]", "speed RMS [m/s]", "plan RMS [m]"
    );
    told.extend(report.rows.iter().map(told_row));
    told
}

/// Id and parameters.
fn told_effect(effect: &bicycle::Effect) -> String {
    let description = effect.description();
    let numbers = description.parameters.iter().zip(effect.values());
    let numbers: Vec<String> =
        numbers.map(|(parameter, value)| format!("{} {value:.3}", parameter.name)).collect();
    format!("{} ({})", description.id, numbers.join(", "))
}

fn told_row(row: &Row) -> String {
    let mean = |mean: Option<Mean>| {
        mean.map_or("-".to_owned(), |mean| format!("{:.2} [{:.2}, {:.2}]", mean.value, mean.low, mean.high))
    };
    format!(
        "  {:<7}{:<14}{:<10}{:>8}  {:<22}{:<22}{:<22}{:<22}\n",
        row.ground.name(),
        row.gap.name(),
        row.belief.name(),
        format!("{} of {}", row.n_goal, row.n),
        mean(row.time_s),
        mean(row.across_rms_m),
        mean(row.speed_rms_mps),
        mean(row.plan_rms_m)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::bench::gap_closed_loop::{Belief, Differences, Gap, Ground};

    #[test]
    fn a_row_tells_counts_and_intervals_and_leaves_out_what_there_is_not() {
        let mean = Some(Mean { value: 0.284, low: 0.2, high: 0.3333 });
        let nothing =
            Differences { across_rms_m: None, across_max_m: None, speed_rms_mps: None, plan_rms_m: None };
        let row = Row {
            ground: Ground::Course,
            gap: Gap::SteerLag,
            belief: Belief::Repaired,
            n: 10,
            n_goal: 7,
            wilson: [0.4, 0.9],
            time_s: None,
            across_rms_m: mean,
            across_max_m: None,
            speed_rms_mps: None,
            plan_rms_m: None,
            less_nominal: nothing,
        };
        let told = told_row(&row);
        for part in ["course", "steer_lag", "repaired", "7 of 10", "0.28 [0.20, 0.33]", "-"] {
            assert!(told.contains(part), "{part} in {told}");
        }
    }

    #[test]
    fn instruction_set_that_is_absent_is_the_users_choice() {
        let absent = mppi::ConfigError::Isa(bicycle::lanes::IsaAbsent { isa: mppi::Isa::Avx512 });
        assert!(told(ClosedLoopError::Controller(absent)).is::<UsageError>());
        assert!(!told(ClosedLoopError::NoDrives).is::<UsageError>());
    }
}
