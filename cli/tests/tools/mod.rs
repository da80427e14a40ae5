//! Programs that not every machine has.

use std::process::Command;

/// Whether a program is there and ends well with these words. A test that needs it is left out where it is not;
/// where `SUREFOOT_REQUIRE_TOOLS` is set, as `.ci/run` does, it fails instead.
pub fn is_there(program: &str, words: &[&str]) -> bool {
    let output = Command::new(program).args(words).output();
    let problem = match output {
        Ok(output) if output.status.success() => return true,
        Ok(output) => String::from_utf8_lossy(&output.stderr).trim().to_owned(),
        Err(error) => error.to_string(),
    };
    let is_required = std::env::var_os("SUREFOOT_REQUIRE_TOOLS").is_some();
    assert!(!is_required, "{program} {words:?}: expected to end well, found: {problem}");
    println!("left out for want of {program} {words:?}: {problem}");
    false
}
