//! `surefoot gap`: why simulator and robot disagree, and the controller's model repaired.

mod apply;

use crate::arguments::GapCommand;

pub(crate) fn run(command: &GapCommand) -> anyhow::Result<()> {
    match command {
        GapCommand::Apply(apply) => apply::run(apply),
    }
}
