//! `surefoot bench gap`: the drives, a bar meanwhile, and the table as text, JSON and picture.

use ::bench::gap_closed_loop::{ClosedLoopError, Progress, Request, measure};

use crate::arguments::BenchGapArguments;
use crate::output::WithRevision;
use crate::{UsageError, progress};

pub(crate) fn run_gap(arguments: &BenchGapArguments) -> anyhow::Result<()> {
    let request = Request {
        vehicle: arguments.vehicle,
        grounds: arguments.grounds.clone(),
        gaps: arguments.gaps.clone(),
        n_seeds: arguments.seeds,
        n_threads: arguments.kernels.threads.count(),
        isa: arguments.kernels.isa.into(),
    };
    arguments.results.prepare()?;
    let bar = progress::bar(request.n_drives() as u64, "{pos}/{len} drives, {eta} left   {msg}");
    let measured = measure(&request, |progress| match progress {
        Progress::Diagnosed(found) => {
            bar.set_message(format!("diagnosed {}, seed {}", found.gap.name(), found.seed))
        }
        Progress::Drove(drive) => {
            bar.set_message(report::gap_closed_loop::drive_text(drive));
            bar.inc(1);
        }
    });
    bar.finish_and_clear();
    let report = measured.map_err(told)?;
    print!("{}", report::gap_closed_loop::text(&report));
    arguments.results.write_json("gap_closed_loop.json", &WithRevision::of(&report))?;
    arguments.results.write("gap_closed_loop.png", &report::gap_closed_loop::picture(&report)?)?;
    println!("\n  gap_closed_loop.json and gap_closed_loop.png in {}", arguments.results.out.display());
    Ok(())
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instruction_set_that_is_absent_is_the_users_choice() {
        let absent = mppi::ConfigError::Isa(bicycle::lanes::IsaAbsent { isa: mppi::Isa::Avx512 });
        assert!(told(ClosedLoopError::Controller(absent)).is::<UsageError>());
        assert!(!told(ClosedLoopError::NoDrives).is::<UsageError>());
    }
}
