//! Every library has an example that a stranger can start from, and every example does what it says: each checks what it
//! shows, so that it is enough to run them. Cargo builds them with the tests of the workspace.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use cargo_metadata::MetadataCommand;

/// Crates whose product is not for others to build on: the binary, the wheel, whose examples are in Python, and the tests
/// that cross crates.
const NO_LIBRARIES: [&str; 3] = ["cli", "python", "tests"];

/// An example as Cargo knows it.
struct Example {
    package: String,
    name: String,
    source: PathBuf,
}

/// Those in the folders `examples`: what times other people's code lies elsewhere and wants arguments.
fn examples() -> Vec<Example> {
    let metadata = MetadataCommand::new().no_deps().exec().unwrap();
    let mut examples = Vec::new();
    for package in metadata.workspace_packages() {
        let folder = package.manifest_path.parent().unwrap().join("examples");
        let targets = package.targets.iter().filter(|target| target.is_example());
        examples.extend(targets.filter(|target| target.src_path.starts_with(&folder)).map(|target| {
            Example {
                package: package.name.to_string(),
                name: target.name.clone(),
                source: target.src_path.clone().into(),
            }
        }));
    }
    examples
}

/// Where Cargo puts them, beside the folder of this test.
fn folder() -> PathBuf {
    std::env::current_exe().unwrap().parent().and_then(Path::parent).unwrap().join("examples")
}

#[test]
fn every_library_has_an_example_of_a_name_of_its_own() {
    let metadata = MetadataCommand::new().no_deps().exec().unwrap();
    let libraries: BTreeSet<String> = metadata
        .workspace_packages()
        .iter()
        .map(|package| package.name.to_string())
        .filter(|name| !NO_LIBRARIES.contains(&name.as_str()))
        .collect();
    let examples = examples();
    let shown: BTreeSet<String> = examples.iter().map(|example| example.package.clone()).collect();
    assert_eq!(shown, libraries);
    let names: BTreeSet<&str> = examples.iter().map(|example| example.name.as_str()).collect();
    assert_eq!(names.len(), examples.len(), "all binaries lie in one folder: {names:?}");
}

#[test]
fn every_example_is_short_and_says_how_to_run_it() {
    for Example { package, name, source } in examples() {
        let text = std::fs::read_to_string(&source).unwrap();
        let command = format!("//! `cargo run -p {package} --example {name}`");
        assert!(text.contains(&command), "{}: expected {command}", source.display());
        assert!(text.lines().count() <= 100, "{}: {} lines", source.display(), text.lines().count());
    }
}

#[test]
fn every_example_runs_and_tells_something() {
    let runs: Vec<_> = examples()
        .into_iter()
        .map(|example| {
            let binary = folder().join(&example.name);
            let changed = |path: &Path| std::fs::metadata(path).and_then(|about| about.modified()).ok();
            assert!(
                changed(&binary).is_some_and(|built| Some(built) >= changed(&example.source)),
                "{}: expected it built from {}; run `cargo build --workspace --examples` first, or all tests",
                binary.display(),
                example.source.display()
            );
            let child = Command::new(&binary).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
            (example.name, child.unwrap())
        })
        .collect();
    assert!(runs.len() >= 12, "only {} examples", runs.len());
    for (name, child) in runs {
        let output = child.wait_with_output().unwrap();
        let [told, complained] = [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes));
        assert!(output.status.success(), "{name}: {}\n{told}\n{complained}", output.status);
        assert!(told.lines().count() >= 1, "{name} tells nothing");
    }
}
