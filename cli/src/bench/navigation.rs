//! `surefoot bench navigation`: the drives, a bar meanwhile, and the table as text, JSON and picture.

use ::bench::closed_loop::DriveError;
use ::bench::navigation::{BrokenDrive, NavigationError, Report, Request, measure};
use navigator::NavigatorError;
use traversability::CvarLevel;

use crate::arguments::BenchNavigationArguments;
use crate::output::WithRevision;
use crate::{UsageError, progress};

pub(crate) fn run_navigation(arguments: &BenchNavigationArguments) -> anyhow::Result<()> {
    let request = request(arguments)?;
    arguments.results.prepare()?;
    let bar = progress::bar(request.n_drives(), "{pos}/{len} drives, {eta} left   {msg}");
    let measured = measure(&request, |drive| {
        bar.set_message(report::navigation::drive_text(drive));
        bar.inc(1);
    });
    bar.finish_and_clear();
    let report = measured.map_err(told)?;
    print!("{}", report::navigation::text(&report));
    write(&report, arguments)
}

fn request(arguments: &BenchNavigationArguments) -> Result<Request, UsageError> {
    let levels = arguments.alpha.iter().map(|&alpha| CvarLevel::new(alpha));
    Ok(Request {
        methods: arguments.methods.iter().map(|&method| method.into()).collect(),
        levels: levels.collect::<Result<_, _>>().map_err(UsageError::from_input)?,
        n_seeds: arguments.seeds,
        time_limit_s: arguments.time_limit,
        n_threads: arguments.kernels.threads.count(),
        isa: arguments.kernels.isa.into(),
    })
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
    arguments.results.write_json("navigation.json", &WithRevision::of(report))?;
    arguments.results.write("navigation.png", &report::navigation::picture(report)?)?;
    println!("\n  navigation.json and navigation.png in {}", arguments.results.out.display());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

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
