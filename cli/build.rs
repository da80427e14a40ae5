//! Captures the git revision of the sources, so that every result says what made it. Never fails: outside a
//! repository, or without git, the revision is `unknown`.

use std::process::Command;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    // The reflog changes with every commit and checkout, wherever the branch's own file may be packed.
    if let Some(reflog) = git(&["rev-parse", "--git-path", "logs/HEAD"])
        && std::path::Path::new(&reflog).exists()
    {
        println!("cargo::rerun-if-changed={reflog}");
    }
    let revision = git(&["rev-parse", "--short=12", "HEAD"]).unwrap_or_else(|| "unknown".to_owned());
    println!("cargo::rustc-env=SUREFOOT_REVISION={revision}");
}

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?.trim().to_owned();
    (output.status.success() && !text.is_empty()).then_some(text)
}
