//! `surefoot gap`: why simulator and robot disagree, and the controller's model repaired.

mod apply;
mod baseline;
mod diagnose;
mod drives;
mod effects;
mod follow_up;
mod ground;
mod in_simulator;
mod machine;
mod model_file;
mod outputs;
mod progress;
mod request;
mod score;
mod seal;
mod simulator;
mod workers;

use crate::arguments::GapCommand;

pub(crate) fn run(command: &GapCommand) -> anyhow::Result<()> {
    match command {
        GapCommand::Diagnose(diagnose) => diagnose::run(diagnose),
        GapCommand::Apply(apply) => apply::run(apply),
        GapCommand::Ground(ground) => ground::run(ground),
        GapCommand::Effects(effects) => effects::run(effects),
        GapCommand::Seal(seal) => seal::run(seal),
        GapCommand::Score(score) => score::run(score),
    }
}
