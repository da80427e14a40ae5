//! What `scripts/package` puts into an archive, and what the unit for systemd starts.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test that cannot be set up has failed")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn package(out: &Path, programs: &[&Path]) -> Output {
    Command::new(root().join("scripts/package")).arg("--out").arg(out).args(programs).output().unwrap()
}

fn machine() -> &'static str {
    std::env::consts::ARCH
}

/// Packs programs for machines of these names and unpacks the archives.
fn unpacked(folder: &Path, programs: &[(&str, &Path)]) -> Vec<PathBuf> {
    let paths: Vec<&Path> = programs.iter().map(|(_, program)| *program).collect();
    let packed = package(folder, &paths);
    assert!(packed.status.success(), "{}", String::from_utf8_lossy(&packed.stderr));
    let name = |machine: &str| format!("surefoot-{}-{machine}", env!("CARGO_PKG_VERSION"));
    let archives: Vec<PathBuf> =
        programs.iter().map(|(machine, _)| folder.join(format!("{}.tar.gz", name(machine)))).collect();
    let told = String::from_utf8(packed.stdout).unwrap();
    assert_eq!(told.lines().map(PathBuf::from).collect::<Vec<_>>(), archives);
    for archive in &archives {
        let tar = Command::new("tar").arg("-xzf").arg(archive).arg("-C").arg(folder).status();
        assert!(tar.unwrap().success());
    }
    programs.iter().map(|(machine, _)| folder.join(name(machine))).collect()
}

/// Packs this test's own program, which is one for this machine, and unpacks it.
fn unpacked_own(folder: &Path) -> PathBuf {
    let program = std::env::current_exe().unwrap();
    unpacked(folder, &[(machine(), &program)]).remove(0)
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
    let archive = unpacked_own(folder.path());
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

/// Every file below a folder, by its path from there.
fn files(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                files.push((path.strip_prefix(folder).unwrap().to_owned(), std::fs::read(&path).unwrap()));
            }
        }
    }
    files.sort_unstable();
    files
}

/// The head of a program for the machine of this number, as the linker writes it.
fn head(machine: u8) -> Vec<u8> {
    let mut bytes = vec![0; 64];
    bytes[..7].copy_from_slice(b"\x7fELF\x02\x01\x01");
    bytes[18] = machine;
    bytes
}

#[test]
fn each_machine_has_an_archive_of_its_own_that_differs_in_the_program_alone() {
    let folder = tempfile::tempdir().unwrap();
    let [intel, arm] = [("intel", 0x3e), ("arm", 0xb7)].map(|(name, machine)| {
        let path = folder.path().join(name);
        std::fs::write(&path, head(machine)).unwrap();
        path
    });
    let archives = unpacked(folder.path(), &[("x86_64", &intel), ("aarch64", &arm)]);
    let [on_intel, on_arm] = [&archives[0], &archives[1]].map(|archive| files(archive));
    let differ: Vec<_> = on_intel.iter().zip(&on_arm).filter(|(one, other)| one != other).collect();
    let program = |machine: u8| (PathBuf::from("bin/surefoot"), head(machine));
    assert_eq!(differ, [(&program(0x3e), &program(0xb7))]);
    assert_eq!(on_intel.len(), on_arm.len());
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
        let refused = package(&out, &[&program]);
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
