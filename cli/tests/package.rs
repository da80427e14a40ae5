//! What `scripts/package` puts into an archive, and what the unit for systemd starts.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test that cannot be set up has failed")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn package(out: &Path, program: &Path) -> Output {
    Command::new(root().join("scripts/package")).arg("--out").args([out, program]).output().unwrap()
}

fn machine() -> &'static str {
    std::env::consts::ARCH
}

/// Packs this test's own program, which is one for this machine, and unpacks it.
fn unpacked(folder: &Path) -> PathBuf {
    let packed = package(folder, &std::env::current_exe().unwrap());
    assert!(packed.status.success(), "{}", String::from_utf8_lossy(&packed.stderr));
    let name = format!("surefoot-{}-{}", env!("CARGO_PKG_VERSION"), machine());
    let archive = folder.join(format!("{name}.tar.gz"));
    assert_eq!(String::from_utf8_lossy(&packed.stdout).trim(), archive.to_str().unwrap());
    let tar = Command::new("tar").arg("-xzf").arg(&archive).arg("-C").arg(folder).status();
    assert!(tar.unwrap().success());
    folder.join(name)
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort_unstable();
    names
}

#[test]
fn an_archive_holds_what_a_robot_needs() {
    let folder = tempfile::tempdir().unwrap();
    let archive = unpacked(folder.path());
    let expected = [
        "Containerfile",
        "LICENSE-APACHE",
        "LICENSE-MIT",
        "README.md",
        "bin",
        "robot.toml",
        "systemd",
        "vehicles",
    ];
    assert_eq!(names(&archive), expected);
    assert_eq!(names(&archive.join("vehicles")), names(&root().join("scenarios/vehicles")));
    let program = std::fs::read(archive.join("bin/surefoot")).unwrap();
    assert!(
        program == std::fs::read(std::env::current_exe().unwrap()).unwrap(),
        "the program as it was built"
    );
    let listed = Command::new(archive.join("bin/surefoot")).arg("--list").output().unwrap();
    assert!(String::from_utf8_lossy(&listed.stdout).contains("an_archive_holds"), "it can be started");
    // Whatever the container is made of lies in the archive.
    let text = std::fs::read_to_string(archive.join("Containerfile")).unwrap();
    let copied = text.lines().filter_map(|line| line.strip_prefix("COPY "));
    let sources: Vec<&str> = copied.flat_map(|line| line.rsplit_once(' ').unwrap().0.split(' ')).collect();
    assert!(
        sources.contains(&"bin/surefoot") && sources.iter().all(|path| archive.join(path).exists()),
        "{text}"
    );
}

#[test]
fn what_is_no_program_for_a_robot_is_refused_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (text, out) = (folder.path().join("text"), folder.path().join("out"));
    std::fs::write(&text, "no program").unwrap();
    for (program, expected) in [
        (text, "expected a program of Linux for x86-64 or 64-bit ARM, found another file"),
        (folder.path().join("absent"), "expected a program that was built, found no file"),
    ] {
        let refused = package(&out, &program);
        let error = String::from_utf8(refused.stderr).unwrap();
        assert!(
            !refused.status.success() && error.contains(expected) && error.lines().count() == 1,
            "{error}"
        );
        assert!(!out.exists());
    }
}

/// The words that the unit starts are understood: what is amiss is the robot's file, which is not here.
#[test]
fn the_unit_starts_what_the_program_understands() {
    let unit = std::fs::read_to_string(root().join("packaging/surefoot.service")).unwrap();
    let start = unit.lines().find_map(|line| line.strip_prefix("ExecStart=")).unwrap();
    let (program, words) = start.split_once(' ').unwrap();
    assert!(program.ends_with("/surefoot"));
    let words = words.replace("/etc/surefoot/robot.toml", "absent-robot.toml");
    let refused = Command::new(env!("CARGO_BIN_EXE_surefoot")).args(words.split(' ')).output().unwrap();
    let error = String::from_utf8(refused.stderr).unwrap();
    assert!(!refused.status.success() && error.contains("absent-robot.toml"), "{error}");
}
