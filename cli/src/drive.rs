//! `surefoot drive`: world, vehicle, navigator and episode, tied together.

use crate::arguments::DriveArguments;
use crate::output::OutputFolder;
use crate::{WorkFailed, interrupt};

pub(crate) fn run(arguments: &DriveArguments) -> anyhow::Result<()> {
    arguments.bush_height_m()?;
    OutputFolder::prepare(&arguments.out)?;
    interrupt::catch_interrupts()?;
    Err(WorkFailed("drive: this build has no plant to drive".to_owned()).into())
}
