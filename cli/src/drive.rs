//! `surefoot drive`: world, vehicle, navigator and episode, tied together.

use crate::arguments::DriveArguments;
use crate::output::OutputFiles;
use crate::{WorkFailed, interrupt};

pub(crate) fn run(arguments: &DriveArguments) -> anyhow::Result<()> {
    arguments.bush_height_m()?;
    OutputFiles::prepare(arguments)?;
    interrupt::catch_interrupts()?;
    Err(WorkFailed("drive: this build has no plant to drive".to_owned()).into())
}
