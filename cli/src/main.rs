//! The `surefoot` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(cli::run())
}
