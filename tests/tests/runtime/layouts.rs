//! The layouts as other languages know them are those of the types.

use std::path::{Path, PathBuf};
use std::process::Command;

use runtime::layout::{c_header, python_module};
use runtime::message::{LAYOUT_VERSION, layouts};

fn place(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(path)
}

/// Compares, or writes when asked to.
fn hold(path: &str, text: &str) {
    if std::env::var_os("SUREFOOT_WRITE_LAYOUTS").is_some() {
        std::fs::write(place(path), text).unwrap();
    }
    let found = std::fs::read_to_string(place(path)).unwrap();
    assert_eq!(
        found, text,
        "examples/{path} has drifted; SUREFOOT_WRITE_LAYOUTS=1 cargo test -p tests --test runtime layouts"
    );
}

#[test]
fn the_c_header_is_that_of_the_types_and_compiles() {
    hold("c/surefoot_layout.h", &c_header(&layouts(), LAYOUT_VERSION));
    // The header asserts every size and offset when it is compiled.
    let compiled = Command::new("cc")
        .args(["-std=c11", "-Wall", "-Werror", "-fsyntax-only", "-x", "c"])
        .arg(place("c/surefoot_layout.h"))
        .output()
        .unwrap();
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
}

#[test]
fn the_python_module_is_that_of_the_types() {
    hold("python/surefoot_layout.py", &python_module(&layouts(), LAYOUT_VERSION));
}
