//! Where results go.

use std::path::PathBuf;

use clap::Args;

/// Where results go; [`crate::output`] tries the places out and writes.
#[derive(Args, Clone, Debug)]
pub struct ResultArguments {
    /// Folder for the results; made if missing, earlier files are replaced
    #[arg(long, value_name = "DIR", default_value = "surefoot-out")]
    pub out: PathBuf,

    /// The numbers once more.
    #[command(flatten)]
    pub copy: JsonArguments,
}

/// Where the numbers of a result go, besides the terminal and the folder of the results.
#[derive(Args, Clone, Debug)]
pub struct JsonArguments {
    /// Write the result to this file too
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}
