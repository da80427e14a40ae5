//! What the pages say, held by what the repository has.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::path::{Path, PathBuf};

use cargo_metadata::{Metadata, MetadataCommand};

fn metadata() -> Metadata {
    // Default members are those of the workspace only where Cargo is called from its root.
    MetadataCommand::new().current_dir(root()).no_deps().exec().unwrap()
}

/// The first page of a crate's documentation.
fn front_page(package: &str) -> String {
    let text = std::fs::read_to_string(root().join(package).join("src/lib.rs")).unwrap();
    let lines = text.lines().map_while(|line| line.strip_prefix("//!"));
    lines.map(|line| format!("{}\n", line.trim_start())).collect()
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned()
}

/// The pages that a user reads, by name.
fn pages() -> Vec<(String, String)> {
    let docs = std::fs::read_dir(root().join("docs")).unwrap().map(|entry| entry.unwrap().path());
    let is_page = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "md");
    let mut paths: Vec<PathBuf> = docs.filter(is_page).collect();
    assert!(paths.len() >= 5, "only {} pages in docs", paths.len());
    paths.extend([root().join("README.md"), root().join("bench/peers/README.md")]);
    let page = |path: PathBuf| (path.display().to_string(), std::fs::read_to_string(path).unwrap());
    paths.into_iter().map(page).collect()
}

/// The tables of a page, each with the text between it and the table or heading before it.
fn tables(page: &str) -> Vec<(String, String)> {
    let mut tables: Vec<(String, String)> = Vec::new();
    let mut text = String::new();
    let mut is_table = false;
    for line in page.lines() {
        if line.starts_with('|') {
            if !is_table {
                tables.push((std::mem::take(&mut text), String::new()));
            }
            tables.last_mut().unwrap().1 += &format!("{line}\n");
        } else if line.starts_with('#') {
            text.clear();
        } else {
            text += &format!("{line}\n");
        }
        is_table = line.starts_with('|');
    }
    tables
}

#[test]
fn tables_of_times_say_on_which_processor_they_were_taken() {
    let mut n_timed = 0;
    for (name, page) in pages() {
        for (text, table) in tables(&page) {
            // The work of a computer takes milliseconds; seconds are those of a drive.
            if !table.contains("[ms]") && !table.contains(" ms") {
                continue;
            }
            n_timed += 1;
            let is_told = text.contains("AMD EPYC") || text.contains("processor was not recorded");
            assert!(is_told, "{name}: before this table stands no processor:\n{table}");
        }
    }
    assert!(n_timed >= 5, "only {n_timed} tables of times");
}

#[test]
fn the_documentation_opens_on_a_guide_to_every_crate_and_example() {
    // `cargo doc --open` opens the library of the first default member.
    let metadata = metadata();
    let opened: Vec<&str> =
        metadata.workspace_default_packages().iter().map(|package| package.name.as_str()).collect();
    assert_eq!(opened, ["cli"]);
    let guide = front_page("cli");
    for package in metadata.workspace_packages() {
        let name = &package.name;
        if ["cli", "tests"].contains(&name.as_str()) {
            continue;
        }
        assert!(guide.contains(&format!("[`{name}`]")), "the guide does not link {name}");
        let page = front_page(name);
        assert!(page.contains("](../cli/index.html)"), "{name} does not lead back to the guide");
        for target in package.targets.iter().filter(|target| target.is_example()) {
            let file = format!("examples/{}.rs", target.name);
            if root().join(name.as_str()).join(&file).exists() {
                let command = format!("`cargo run -p {name} --example {}`", target.name);
                assert!(guide.contains(&command), "the guide does not tell of {command}");
                assert!(page.contains(&format!("`{file}`")), "the page of {name} does not tell of {file}");
            }
        }
    }
}
