//! `surefoot bench`: what was asked, handed to the benchmarks, and their result shown and written.

use crate::WorkFailed;
use crate::arguments::{BenchControlArguments, BenchPriorMapArguments};

pub(crate) fn control(_arguments: &BenchControlArguments) -> anyhow::Result<()> {
    Err(WorkFailed("bench control: this build carries no benchmark of the controller".to_owned()).into())
}

pub(crate) fn prior_map(_arguments: &BenchPriorMapArguments) -> anyhow::Result<()> {
    Err(WorkFailed("bench prior-map: this build carries no benchmark of the risk map".to_owned()).into())
}
