//! `surefoot bench risk`: the runs, a bar meanwhile, and what they add up to as text, JSON and picture.

use ::bench::risk::{Report, Request, RiskError, measure};
use traversability::CvarLevel;

use crate::arguments::BenchRiskArguments;
use crate::output::WithRevision;
use crate::{UsageError, progress};

pub(crate) fn run_risk(arguments: &BenchRiskArguments) -> anyhow::Result<()> {
    let request = request(arguments)?;
    arguments.results.prepare()?;
    let bar = progress::bar(request.n_drives(), "{pos}/{len} runs, {eta} left");
    let measured = measure(&request, || bar.inc(1));
    bar.finish_and_clear();
    let report = measured.map_err(told)?;
    print!("{}", report::risk::text(&report));
    write(&report, arguments)
}

fn request(arguments: &BenchRiskArguments) -> Result<Request, UsageError> {
    let levels = arguments.alpha.iter().map(|&alpha| CvarLevel::new(alpha));
    Ok(Request {
        densities: arguments.densities.clone(),
        levels: levels.collect::<Result<_, _>>().map_err(UsageError::from_input)?,
        n_runs: arguments.runs,
        first_seed: arguments.seed,
        n_threads: arguments.kernels.threads.count(),
        isa: arguments.kernels.isa.into(),
    })
}

/// An instruction set that the machine lacks is the user's choice; all else is not.
fn told(error: RiskError) -> anyhow::Error {
    match error {
        RiskError::Isa(absent) => UsageError(absent.to_string()).into(),
        other => other.into(),
    }
}

fn write(report: &Report, arguments: &BenchRiskArguments) -> anyhow::Result<()> {
    arguments.results.write_json("risk.json", &WithRevision::of(report))?;
    arguments.results.write("risk.png", &report::risk::picture(report)?)?;
    println!("\n  risk.json and risk.png in {}", arguments.results.out.display());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instruction_set_that_is_absent_is_the_users_choice() {
        let absent = || bicycle::lanes::IsaAbsent { isa: mppi::Isa::Avx512 };
        let error = told(absent().into());
        assert!(error.is::<UsageError>());
        assert_eq!(error.to_string(), absent().to_string());
        assert!(!told(RiskError::NoRuns).is::<UsageError>());
    }
}
