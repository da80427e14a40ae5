//! Why there is no table of drives, to its user.

use ::bench::closed_loop::DriveError;
use ::bench::sweep::{BrokenDrive, SweepError};
use navigator::NavigatorError;

use crate::UsageError;

/// An instruction set that the machine lacks is the user's choice; all else is not.
pub(super) fn told(error: SweepError) -> anyhow::Error {
    if let SweepError::Drive { source, .. } = &error
        && let BrokenDrive::Loop(DriveError::Navigator(NavigatorError::Controller(refused))) = source.as_ref()
        && matches!(refused, mppi::ConfigError::Isa(_))
    {
        return UsageError(refused.to_string()).into();
    }
    error.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instruction_set_that_is_absent_is_the_users_choice() {
        let absent = || mppi::ConfigError::Isa(bicycle::lanes::IsaAbsent { isa: mppi::Isa::Avx512 });
        let broken = SweepError::Drive {
            drive: "truth, seed 1".to_owned(),
            source: Box::new(DriveError::from(NavigatorError::from(absent())).into()),
        };
        let error = told(broken);
        assert!(error.is::<UsageError>());
        assert_eq!(error.to_string(), absent().to_string());
        assert!(!told(SweepError::NoDrives { expected: "a drive" }).is::<UsageError>());
    }
}
