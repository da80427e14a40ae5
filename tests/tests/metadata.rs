//! What the manifests say of the crates, held by what `cargo metadata` makes of them.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::collections::BTreeSet;
use std::sync::LazyLock;

use cargo_metadata::{Metadata, MetadataCommand, Package};

/// The slugs of crates.io's categories that fit a crate of this workspace.
const CATEGORIES: [&str; 9] = [
    "command-line-utilities",
    "concurrency",
    "development-tools::profiling",
    "development-tools::testing",
    "mathematics",
    "network-programming",
    "parser-implementations",
    "science::robotics",
    "simulation",
];

static METADATA: LazyLock<Metadata> = LazyLock::new(|| MetadataCommand::new().no_deps().exec().unwrap());

fn packages() -> Vec<&'static Package> {
    let packages = METADATA.workspace_packages();
    assert!(packages.len() >= 14, "only {} crates", packages.len());
    packages
}

fn read(path: &str) -> String {
    std::fs::read_to_string(METADATA.workspace_root.join(path)).unwrap()
}

#[test]
fn every_crate_says_what_it_is_in_words_of_its_own() {
    let mut said = BTreeSet::new();
    for package in packages() {
        let description = package.description.clone().unwrap_or_default();
        assert!(description.len() >= 20, "{}: a description of {description:?}", package.name);
        assert!(said.insert(description), "{}: the description of another crate", package.name);
    }
}

#[test]
fn every_crate_has_a_licence_whose_text_is_there_and_names_who_grants_it() {
    for package in packages() {
        assert_eq!(package.license.as_deref(), Some("MIT OR Apache-2.0"), "{}", package.name);
        for author in &package.authors {
            assert!(read("LICENSE-MIT").contains(author), "{}: {author} grants no licence", package.name);
        }
        assert!(!package.authors.is_empty(), "{}: no author", package.name);
    }
    assert!(read("LICENSE-MIT").starts_with("MIT License"));
    assert!(read("LICENSE-APACHE").contains("Apache License"));
}

#[test]
fn every_crate_shows_the_readme() {
    for package in packages() {
        let readme = package.readme().unwrap_or_else(|| panic!("{}: no readme", package.name));
        assert_eq!(
            readme.canonicalize_utf8().unwrap(),
            METADATA.workspace_root.join("README.md"),
            "{}",
            package.name
        );
    }
}

#[test]
fn keywords_and_categories_are_such_as_a_registry_takes() {
    let is_keyword = |word: &String| {
        let may_stand = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        word.len() <= 20 && word.starts_with(|c: char| c.is_ascii_lowercase()) && word.chars().all(may_stand)
    };
    for package in packages() {
        let (name, keywords, categories) = (&package.name, &package.keywords, &package.categories);
        assert!((3..=5).contains(&keywords.len()) && keywords.iter().all(is_keyword), "{name}: {keywords:?}");
        let known = categories.iter().all(|category| CATEGORIES.contains(&category.as_str()));
        assert!((1..=5).contains(&categories.len()) && known, "{name}: {categories:?}");
    }
}

#[test]
fn every_crate_asks_for_the_toolchain_that_the_readme_asks_for() {
    let readme = read("README.md");
    for package in packages() {
        let version =
            package.rust_version.as_ref().unwrap_or_else(|| panic!("{}: no rust-version", package.name));
        let told = format!("A Rust toolchain ({}.{} or newer)", version.major, version.minor);
        assert!(readme.contains(&told), "{}: README.md does not say `{told}`", package.name);
    }
}
