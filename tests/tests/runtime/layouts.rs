//! The layouts as other languages know them are those of the types.

use std::path::{Path, PathBuf};
use std::process::Command;

use bus::channel::{COMMAND, Channel, IMU, MISSION, ODOMETRY, RISK, SCAN};
use bus::layout::{c_header, python_module};
use bus::message::{LAYOUT_VERSION, layouts};

fn place(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}

/// Compares, or writes when asked to.
fn hold(path: &str, text: &str) {
    if std::env::var_os("SUREFOOT_WRITE_LAYOUTS").is_some() {
        std::fs::write(place(path), text).unwrap();
    }
    let found = std::fs::read_to_string(place(path)).unwrap();
    assert_eq!(
        found, text,
        "{path} has drifted; SUREFOOT_WRITE_LAYOUTS=1 cargo test -p tests --test runtime layouts"
    );
}

#[test]
fn the_c_header_is_that_of_the_types_and_compiles() {
    hold("examples/c/surefoot_layout.h", &c_header(&layouts(), LAYOUT_VERSION));
    // The header asserts every size and offset when it is compiled.
    let compiled = Command::new("cc")
        .args(["-std=c11", "-Wall", "-Werror", "-fsyntax-only", "-x", "c"])
        .arg(place("examples/c/surefoot_layout.h"))
        .output()
        .unwrap();
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
}

#[test]
fn the_python_module_is_that_of_the_types() {
    hold("ros/tests/surefoot_layout.py", &python_module(&layouts(), LAYOUT_VERSION));
}

/// Depth, readers and history, as the table of `channels.py` ends its row of a channel: where they differ, whoever opens
/// the channel second is refused.
fn python_row<H, T>(channel: &Channel<H, T>) -> [String; 2] {
    let Channel { name, depth, n_readers, history, .. } = channel;
    [format!("    \"{name}\": ("), format!(", {depth}, {n_readers}, {history}),")]
}

#[test]
fn the_python_channels_are_those_of_the_run() {
    let text = std::fs::read_to_string(place("ros/tests/channels.py")).unwrap();
    let rows = [
        python_row(&ODOMETRY),
        python_row(&IMU),
        python_row(&SCAN),
        python_row(&RISK),
        python_row(&COMMAND),
        python_row(&MISSION),
    ];
    for [begin, end] in rows {
        let row = text.lines().find(|line| line.starts_with(&begin)).unwrap_or_else(|| panic!("{begin}"));
        assert!(row.ends_with(&end), "{row} does not end in {end}");
    }
}
