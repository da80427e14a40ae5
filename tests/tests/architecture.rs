//! The shape of the repository, held by what `cargo metadata` and the text of the tree say.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use cargo_metadata::{DependencyKind, Metadata, MetadataCommand};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

/// Every crate with the internal crates that its product may use, and no others. `cli` calls `bench` to run
/// `surefoot bench`; `tests` may use all, but has no product: it has dev-dependencies only.
const MAY_USE: [(&str, &[&str]); 23] = [
    ("terrain", &[]),
    ("traversability", &["terrain"]),
    ("bicycle", &[]),
    ("physics_prior", &["terrain", "traversability", "bicycle"]),
    ("mppi", &["traversability", "bicycle"]),
    ("evidential", &["terrain", "traversability", "bicycle", "physics_prior"]),
    ("kinodynamics", &["bicycle", "evidential"]),
    (
        "navigator",
        &[
            "terrain",
            "traversability",
            "bicycle",
            "physics_prior",
            "evidential",
            "kinodynamics",
            "tracking",
            "mppi",
        ],
    ),
    ("route", &["terrain"]),
    ("friction", &["bicycle", "route"]),
    ("tracking", &["terrain"]),
    ("scenarios", &["terrain", "bicycle"]),
    ("sim_to_real", &["terrain", "traversability", "bicycle", "formats"]),
    ("formats", &["terrain", "traversability", "bicycle"]),
    ("bus", &["terrain", "traversability", "bicycle"]),
    (
        "runtime",
        &[
            "terrain",
            "traversability",
            "bicycle",
            "physics_prior",
            "evidential",
            "kinodynamics",
            "tracking",
            "mppi",
            "navigator",
            "formats",
            "bus",
        ],
    ),
    ("simulator", &["bicycle", "scenarios", "bus"]),
    ("ros", &["terrain", "traversability", "bicycle", "formats", "bus"]),
    ("bench", &LIBRARIES),
    (
        "report",
        &[
            "terrain",
            "traversability",
            "bicycle",
            "evidential",
            "navigator",
            "route",
            "friction",
            "scenarios",
            "sim_to_real",
            "formats",
            "bench",
        ],
    ),
    ("cli", ALL.split_at(19).0),
    ("python", &ALL),
    ("tests", &[]),
];
const LIBRARIES: [&str; 13] = [
    "route",
    "friction",
    "terrain",
    "traversability",
    "bicycle",
    "physics_prior",
    "evidential",
    "kinodynamics",
    "mppi",
    "navigator",
    "scenarios",
    "sim_to_real",
    "formats",
];
/// Everything but `tests`, and the wheel itself; the first 19 are for `cli`.
const ALL: [&str; 21] = [
    "friction",
    "route",
    "terrain",
    "traversability",
    "bicycle",
    "physics_prior",
    "evidential",
    "kinodynamics",
    "mppi",
    "navigator",
    "scenarios",
    "sim_to_real",
    "formats",
    "bus",
    "runtime",
    "simulator",
    "ros",
    "bench",
    "report",
    "tracking",
    "cli",
];

/// Dependencies that no code names: they give what builds others' bindings the features of the whole workspace.
const FOR_FEATURES: [(&str, &str); 2] = [("python", "libc"), ("python", "memchr")];

/// Crates that may read a clock: those that talk to a person or measure.
const MAY_READ_CLOCK: [&str; 7] = ["bus", "runtime", "simulator", "ros", "cli", "bench", "tests"];
/// Crates that may touch files and processes.
const MAY_TOUCH_FILES: [&str; 5] = ["formats", "bus", "runtime", "cli", "tests"];
/// Where unsafe code may stand: the rollout kernel, the allocator that counts in a test, and yardsticks by hand that
/// belong to no crate.
const MAY_BE_UNSAFE: [&str; 5] = [
    "mppi/src/kernel.rs",
    "mppi/src/kernel/",
    "mppi/tests/allocation.rs",
    "bench/peers/bound_of_a_drive_update.rs",
    "bench/peers/bound_of_an_update_on_arm.rs",
];
/// The model's dynamics, which no plant may use.
const DYNAMICS: [&str; 12] = [
    "Effect",
    "GroundSample",
    "LaneState",
    "Model",
    "MotionModel",
    "MotionStepper",
    "SkidSteer",
    "SkidSteerStepper",
    "Stepper",
    "effect",
    "lanes",
    "*",
];

static METADATA: LazyLock<Metadata> = LazyLock::new(|| MetadataCommand::new().no_deps().exec().unwrap());

fn root() -> &'static Path {
    METADATA.workspace_root.as_std_path()
}

fn read(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// A source file: its path from the repository's root, and its text without comments.
struct Source {
    path: String,
    code: String,
}

impl Source {
    fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).unwrap();
        let without_comment = |line: &str| line.split("//").next().unwrap_or_default().to_owned();
        Self {
            path: path.strip_prefix(root()).unwrap().to_str().unwrap().to_owned(),
            code: text.lines().map(without_comment).collect::<Vec<_>>().join("\n"),
        }
    }

    fn in_crates(&self, crates: &[&str]) -> bool {
        self.path.split('/').next().is_some_and(|folder| crates.contains(&folder))
    }

    /// Where `needle` stands in the code as whole words.
    fn places(&self, needle: &str) -> Vec<String> {
        let lines = self.code.lines().enumerate().filter(|(_, line)| has_word(line, needle));
        lines.map(|(i, line)| format!("{}:{}: {}", self.path, i + 1, line.trim())).collect()
    }

    /// Names that the code takes from a crate by `crate::name` or `crate::{name, ..}`.
    fn names_from(&self, from: &str) -> Vec<&str> {
        let path = format!("{from}::");
        let listed = |(start, _): (usize, &str)| {
            let rest = &self.code[start + path.len()..];
            let end = if rest.starts_with('{') {
                rest.find('}')
            } else {
                rest.find([';', '(', ',', ')', ' ', '>'])
            };
            &rest[..end.unwrap_or(rest.len())]
        };
        let separates = |c: char| !(c.is_alphanumeric() || c == '_' || c == '*');
        let lists = self.code.match_indices(&path).map(listed);
        lists.flat_map(|list| list.split(separates)).filter(|name| !name.is_empty()).collect()
    }
}

/// Every Rust file of every crate but this one, which has to name what it forbids.
fn sources() -> Vec<Source> {
    let mut sources = all_sources();
    sources.retain(|source| source.path != "tests/tests/architecture.rs");
    sources
}

/// Every Rust file of every crate.
fn all_sources() -> Vec<Source> {
    let mut folders: Vec<PathBuf> = MAY_USE.iter().map(|(name, _)| root().join(name)).collect();
    let mut sources = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                sources.push(Source::read(&path));
            }
        }
    }
    assert!(sources.len() > 20, "the walk found only {} files", sources.len());
    sources
}

fn assert_absent(word: &str, searched: impl Fn(&Source) -> bool) {
    let places: Vec<String> =
        sources().iter().filter(|source| searched(source)).flat_map(|source| source.places(word)).collect();
    assert!(places.is_empty(), "`{word}` must not stand in\n{}", places.join("\n"));
}

#[test]
fn crates_use_only_what_they_may() {
    let may_use: BTreeMap<&str, &[&str]> = MAY_USE.into_iter().collect();
    let packages = METADATA.workspace_packages();
    let names: BTreeSet<&str> = packages.iter().map(|package| package.name.as_str()).collect();
    assert_eq!(names, may_use.keys().copied().collect(), "the crates of the workspace");
    for package in packages {
        let name = package.name.as_str();
        for dependency in package.dependencies.iter().filter(|dependency| dependency.path.is_some()) {
            let used = dependency.name.as_str();
            assert!(names.contains(used), "{name} uses {used}, which lies outside the workspace");
            let allowed = dependency.kind != DependencyKind::Normal || may_use[name].contains(&used);
            assert!(allowed, "{name} uses {used}; it may use {:?}", may_use[name]);
        }
    }
}

#[test]
fn every_declared_dependency_is_used() {
    let sources = all_sources();
    let mut declared: BTreeSet<String> = BTreeSet::new();
    let mut unused = Vec::new();
    for package in METADATA.workspace_packages() {
        for dependency in &package.dependencies {
            let name = dependency.rename.as_ref().unwrap_or(&dependency.name);
            // Where the code that it is declared for stands.
            let places: &[&str] = match dependency.kind {
                DependencyKind::Normal => &["src/"],
                DependencyKind::Build => &["build.rs"],
                _ => &[""],
            };
            let is_place = |path: &str| {
                let inside = path.strip_prefix(package.name.as_str()).and_then(|path| path.strip_prefix('/'));
                inside.is_some_and(|path| places.iter().any(|place| path.starts_with(place)))
            };
            let word = name.replace('-', "_");
            let is_used = |source: &Source| is_place(&source.path) && has_word(&source.code, &word);
            let is_for_features = FOR_FEATURES.contains(&(package.name.as_str(), name.as_str()));
            if !is_for_features && !sources.iter().any(is_used) {
                unused.push(format!("{}: {name} ({:?})", package.name, dependency.kind));
            }
            declared.insert(name.clone());
        }
    }
    let manifest = read("Cargo.toml");
    let offered = manifest.lines().skip_while(|line| *line != "[workspace.dependencies]").skip(1);
    let offered = offered.take_while(|line| !line.starts_with('[')).filter_map(|line| line.split_once(" = "));
    unused.extend(
        offered
            .map(|(name, _)| name)
            .filter(|name| !declared.contains(*name))
            .map(|name| format!("workspace: {name}")),
    );
    assert!(unused.is_empty(), "declared and not used:\n{}", unused.join("\n"));
}

#[test]
fn folders_are_crates_and_share_the_lints() {
    for package in METADATA.workspace_packages() {
        let manifest = format!("{}/Cargo.toml", package.name);
        assert_eq!(root().join(&manifest), package.manifest_path.as_std_path(), "folder name = crate name");
        assert!(read(&manifest).contains("[lints]\nworkspace = true"), "{manifest} has lints of its own");
        assert_eq!(package.publish, Some(Vec::new()), "{manifest}: nothing is published yet");
    }
}

#[test]
fn the_map_shows_the_crates_that_exist_and_no_others() {
    let text = read("ARCHITECTURE.md");
    // A room is a row of the table: | `name` | ...
    let rooms: BTreeSet<&str> =
        text.lines().filter_map(|line| line.strip_prefix("| `")?.split('`').next()).collect();
    assert_eq!(rooms, MAY_USE.iter().map(|(name, _)| *name).collect());
}

#[test]
fn the_map_points_at_files_that_exist() {
    let text = read("ARCHITECTURE.md");
    let quoted = text.split('`').skip(1).step_by(2);
    let missing: Vec<&str> =
        quoted.filter(|name| name.ends_with(".rs") && !root().join(name).exists()).collect();
    assert!(missing.is_empty(), "ARCHITECTURE.md names {missing:?}");
}

#[test]
fn files_stay_short() {
    let sources = sources();
    let long = sources.iter().filter(|source| source.code.lines().count() > 800);
    let long: Vec<&str> = long.map(|source| source.path.as_str()).collect();
    assert!(long.is_empty(), "over 800 lines: {long:?}");
}

#[test]
fn nothing_below_the_command_line_reads_a_clock() {
    for clock in ["Instant::now", "time::Instant", "SystemTime", "UNIX_EPOCH", "sleep"] {
        assert_absent(clock, |source| !source.in_crates(&MAY_READ_CLOCK));
    }
}

#[test]
fn nothing_below_formats_touches_files_or_processes() {
    // Modules of tests may read the shared data.
    let is_test = |source: &Source| source.path.split('/').any(|part| matches!(part, "tests" | "tests.rs"));
    let is_product = |source: &Source| source.path.split('/').nth(1) == Some("src") && !is_test(source);
    let keeps_tiles = |source: &Source| source.path.starts_with("route/src/tiles");
    let speaks = |source: &Source, access: &str| access == "std::net" && source.in_crates(&["ros"]);
    for access in ["std::fs", "std::process", "std::env", "std::net", "File"] {
        assert_absent(access, |source| {
            let may = source.in_crates(&MAY_TOUCH_FILES) || keeps_tiles(source) || speaks(source, access);
            is_product(source) && !may
        });
    }
}

#[test]
fn no_plant_is_built_on_the_models_dynamics() {
    for source in sources().iter().filter(|source| source.in_crates(&["scenarios"])) {
        for name in source.names_from("bicycle") {
            assert!(!DYNAMICS.contains(&name), "{} uses bicycle's {name}", source.path);
        }
    }
}

#[test]
fn unsafe_code_stands_in_the_kernel_alone() {
    let allowed = |source: &Source| MAY_BE_UNSAFE.iter().any(|place| source.path.starts_with(place));
    for word in ["unsafe", "unsafe_code"] {
        assert_absent(word, |source| !allowed(source));
    }
}

#[test]
fn tests_of_shared_data_and_no_others_are_left_to_who_has_it() {
    let faults: Vec<String> = sources()
        .iter()
        .flat_map(|source| {
            ignored_wrongly(&source.code).into_iter().map(|fault| format!("{}: {fault}", source.path))
        })
        .collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Tests of a file that reach the shared data and are not ignored, or are ignored and do not reach it, and reasons
/// other than the one there is.
fn ignored_wrongly(code: &str) -> Vec<String> {
    let (attribute, reason, place) = ("#[ignore", " = \"needs the shared data\"]", "../shared");
    let items = items(code);
    let mut reaching: BTreeSet<&str> = BTreeSet::new();
    let reaches = |item: &Item, reaching: &BTreeSet<&str>| {
        item.code.contains(place) || reaching.iter().any(|name| has_word(item.code, name))
    };
    loop {
        let more = items.iter().filter(|item| !item.name.is_empty() && reaches(item, &reaching));
        let more: BTreeSet<&str> = more.map(|item| item.name).collect();
        if more.len() == reaching.len() {
            break;
        }
        reaching = more;
    }
    let wrong = |item: &Item| {
        let n_tests = item.code.matches("#[test]").count();
        let (n_ignored, n_rightly) = (
            item.code.matches(attribute).count(),
            item.code.matches(&format!("{attribute}{reason}")).count(),
        );
        let n_expected = if reaches(item, &reaching) { n_tests } else { 0 };
        (n_ignored != n_rightly || n_ignored != n_expected).then(|| {
            format!("{}: {n_tests} tests, {n_expected} of shared data, {n_ignored} ignored", item.name)
        })
    };
    items.iter().filter_map(wrong).collect()
}

/// Something that stands at a file's outermost level, with its attributes.
struct Item<'a> {
    name: &'a str,
    code: &'a str,
}

/// The items of a file as rustfmt lays them out: each ends with a line that is not indented and closes it.
fn items(code: &str) -> Vec<Item<'_>> {
    let mut items = Vec::new();
    let (mut start, mut end) = (0, 0);
    for line in code.split_inclusive('\n') {
        end += line.len();
        let closes = line.starts_with('}') || line.trim_end().ends_with([';', '}']);
        if !line.starts_with(' ') && closes {
            let code = &code[start..end];
            items.push(Item { name: item_name(code), code });
            start = end;
        }
    }
    items
}

/// The name after the first word that brings one; empty where there is none.
fn item_name(code: &str) -> &str {
    let is_separator = |c: char| !(c.is_alphanumeric() || c == '_');
    let mut words = code.split(is_separator).filter(|word| !word.is_empty());
    while let Some(word) = words.next() {
        if ["fn", "const", "static", "struct", "enum", "mod", "impl"].contains(&word) {
            return words.next().unwrap_or_default();
        }
    }
    ""
}

fn has_word(text: &str, word: &str) -> bool {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    text.match_indices(word).any(|(start, _)| {
        !text[..start].ends_with(is_word) && !text[start + word.len()..].starts_with(is_word)
    })
}

#[test]
fn a_test_that_should_be_ignored_is_found_through_what_it_calls() {
    let path = "const DATA: &str = \"../shared/data\";\n";
    let helper = "fn read() -> String {\n    DATA.to_owned()\n}\n";
    let test = |attributes: &str, call: &str| {
        format!("{path}{helper}#[test]\n{attributes}fn it() {{\n    {call};\n}}\n")
    };
    let (right, other) = ("#[ignore = \"needs the shared data\"]\n", "#[ignore = \"slow\"]\n");
    for (attributes, call, n_wrong) in [
        (right, "read()", 0),
        ("", "read()", 1),
        (other, "read()", 1),
        ("", "ready()", 0),
        (right, "ready()", 1),
    ] {
        assert_eq!(ignored_wrongly(&test(attributes, call)).len(), n_wrong, "{attributes}{call}");
    }
}

#[test]
fn the_readme_says_how_to_drive_and_to_test_and_ci_does_the_latter() {
    let readme = read("README.md");
    let commands: Vec<&str> =
        readme.lines().map(str::trim).filter(|line| line.starts_with("cargo ")).collect();
    let first = |start: &str| {
        let found = commands.iter().find(|command| command.starts_with(start));
        *found.unwrap_or_else(|| panic!("README.md: no `{start}` among {commands:?}"))
    };
    first("cargo run --release -- drive");
    let test = first("cargo test");
    let script = read(".ci/run");
    let tests: Vec<&str> = script.lines().filter(|line| line.starts_with("cargo test --workspace")).collect();
    // What needs the shared data runs apart, so that nothing runs twice.
    assert_eq!(tests, [test, &format!("{test} -- --ignored")], ".ci/run and README.md must agree");
}
