//! The way from scan to command computes the same on every machine: sines and their kin come from one library, and
//! every kernel runs on the instruction set that was asked for.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock};

use bicycle::lanes::{Instructions, Isa};
use bicycle::{Decision, Model, Odometry};
use evidential::Unfamiliar;
use navigator::{Belief, Config, Navigator, Setup, Surface};
use terrain::{RangePoint, Scan, TerrainClass};
use traversability::CvarLevel;

/// Crates, folders and files on the way from scan to command.
const ON_THE_WAY: [&str; 16] = [
    "terrain/src",
    "traversability/src",
    "tracking/src",
    "bicycle/src",
    "physics_prior/src",
    "evidential/src/belief_map.rs",
    "evidential/src/belief_map",
    "evidential/src/predictor",
    "kinodynamics/src/agreement.rs",
    "kinodynamics/src/correction.rs",
    "kinodynamics/src/dense.rs",
    "kinodynamics/src/familiarity.rs",
    "kinodynamics/src/history.rs",
    "kinodynamics/src/model.rs",
    "mppi/src",
    "navigator/src",
];
/// Functions of floating-point numbers that the standard library takes from the platform, or from the compiler's
/// machine where it knows the argument. Square roots, rounding, remainders and `mul_add` are exact everywhere.
const OF_THE_PLATFORM: [&str; 25] = [
    "sin", "cos", "sin_cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "asinh",
    "acosh", "atanh", "exp", "exp2", "exp_m1", "ln", "ln_1p", "log", "log2", "log10", "powf", "powi", "cbrt",
];
/// The lanes have a tangent of their own.
const TANGENT_OF_LANES: [&str; 2] = ["bicycle/src/lanes.rs", "bicycle/src/stepper.rs"];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

fn sources(path: &Path) -> Vec<PathBuf> {
    if path.is_file() {
        return vec![path.to_owned()];
    }
    let entries = std::fs::read_dir(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    entries.flat_map(|entry| sources(&entry.unwrap().path())).collect()
}

/// The code of the product: without comments and unit tests.
fn product(path: &Path) -> String {
    let text = std::fs::read_to_string(path).unwrap();
    let tests = text.find("#[cfg(test)]\nmod tests {").unwrap_or(text.len());
    text[..tests].lines().map(|line| line.split("//").next().unwrap_or(line)).collect::<Vec<_>>().join("\n")
}

/// Names of the platform's functions that the code calls.
fn platform_calls(code: &str) -> Vec<&'static str> {
    let goes_on = |rest: &str| rest.starts_with(|c: char| c.is_alphanumeric() || c == '_');
    let calls = |name: &str| {
        let by_path = |of: &str| code.split(&format!("{of}{name}")).skip(1).any(|rest| !goes_on(rest));
        by_path("f32::") || by_path("f64::") || code.contains(&format!(".{name}("))
    };
    OF_THE_PLATFORM.into_iter().chain(["hypot"]).filter(|name| calls(name)).collect()
}

#[test]
fn no_source_on_the_way_from_scan_to_command_calls_the_platforms_functions() {
    let mut n_sources = 0;
    let mut found = Vec::new();
    for path in ON_THE_WAY.iter().flat_map(|place| sources(&root().join(place))) {
        let name = path.strip_prefix(root()).unwrap().to_str().unwrap();
        if name.ends_with("tests.rs") || name.contains("/src/") && name.contains("/tests/") {
            continue;
        }
        n_sources += 1;
        for call in platform_calls(&product(&path)) {
            if !(call == "tan" && TANGENT_OF_LANES.contains(&name)) {
                found.push(format!("{name}: {call}"));
            }
        }
    }
    assert!(n_sources > 80, "{n_sources}");
    assert!(found.is_empty(), "use libm's instead: {found:?}");
    assert_eq!(platform_calls("let a = b.sin() + f64::hypot(c, d); x.sin_cos_turns()"), ["sin", "hypot"]);
}

/// What makes instructions out of nothing, or asks the machine for them.
const MAKES_INSTRUCTIONS: [&str; 8] = [
    "Instructions::find",
    "Instructions::widest",
    "Instructions::all",
    "Instructions::Portable",
    "Isa::Auto",
    "::try_new(",
    "is_x86_feature_detected",
    "target_feature",
];
/// Where that is allowed: where the sets are told apart, and where the configuration's is found, for the controller, for
/// the maps and for whoever corrects commands.
const MAY_MAKE_INSTRUCTIONS: [(&str, &[&str]); 6] = [
    ("bicycle/src/lanes/instructions.rs", &MAKES_INSTRUCTIONS),
    ("mppi/src/kernel.rs", &["Instructions::Portable"]),
    ("mppi/src/config.rs", &["Instructions::find", "Isa::Auto"]),
    ("mppi/src/controller.rs", &["Instructions::find"]),
    ("navigator/src/assessor.rs", &["Instructions::find"]),
    ("navigator/src/pilot.rs", &["Instructions::find"]),
];

/// Whoever computes between scan and command is handed its instruction set.
#[test]
fn no_kernel_picks_its_own_instruction_set() {
    let mut found = Vec::new();
    for path in ON_THE_WAY.iter().flat_map(|place| sources(&root().join(place))) {
        let name = path.strip_prefix(root()).unwrap().to_str().unwrap();
        if name.ends_with("tests.rs") || name.contains("/src/") && name.contains("/tests/") {
            continue;
        }
        let allowed =
            MAY_MAKE_INSTRUCTIONS.iter().find(|(place, _)| *place == name).map_or(&[][..], |(_, of)| *of);
        let code = product(&path);
        let makes =
            MAKES_INSTRUCTIONS.iter().filter(|made| code.contains(**made) && !allowed.contains(*made));
        found.extend(makes.map(|made| format!("{name}: {made}")));
    }
    assert!(found.is_empty(), "take the instructions that the configuration asks for: {found:?}");
}

/// A wave between 0 and 1 that needs no sine.
fn wave(place: f64) -> f64 {
    let within = place - place.floor();
    4.0 * within * (1.0 - within)
}

/// Heading of the drive, as cosine and sine; its angle is `YAW_RAD`.
const HEADING: [f64; 2] = [0.955_336_489_125_606, 0.295_520_206_661_339_6];
const YAW_RAD: f64 = 0.3;
const HEIGHT_M: f64 = 0.6;
const N_CYCLES: u64 = 9;

/// What is measured in one cycle of a drive over rough ground with plants and rocks; half-way the localisation corrects
/// itself.
fn measured(cycle: u64) -> (Odometry, Scan) {
    let driven_m = 0.12 * cycle as f64;
    let corrected_m = if cycle > N_CYCLES / 2 { 0.9 } else { 0.0 };
    let position_m =
        [3.0 + HEADING[0] * driven_m + corrected_m, -2.0 + HEADING[1] * driven_m - corrected_m, HEIGHT_M];
    let odometry = Odometry {
        valid_at_ns: 100_000_000 * (cycle + 1),
        position_m,
        attitude_rad: [0.01, -0.02, YAW_RAD],
        velocity_mps: [1.2, 0.0],
        yaw_rate_radps: 0.0,
        wheel_speed_mps: 1.25,
        steering_rad: 0.02,
    };
    let mut points = Vec::new();
    for (row, col) in (-30_i32..=30).flat_map(|row| (-14_i32..=60).map(move |col| (row, col))) {
        let [ahead_m, left_m] = [0.21 * f64::from(col) + 0.05, 0.19 * f64::from(row) + 0.03];
        let east_m = 3.0 + HEADING[0] * (ahead_m + driven_m) - HEADING[1] * left_m;
        let north_m = -2.0 + HEADING[1] * (ahead_m + driven_m) + HEADING[0] * left_m;
        let ground_m = 0.25 * wave(0.17 * east_m) * wave(0.13 * north_m + 0.2) + 0.03 * wave(1.7 * east_m);
        let (class, above_m) = match (17 * col + 29 * row).rem_euclid(97) {
            0 => (TerrainClass::Obstacle, 0.9),
            1..=9 => (TerrainClass::Vegetation, 0.3),
            10..=20 => (TerrainClass::Loose, 0.0),
            _ => (TerrainClass::Open, 0.0),
        };
        let z_m = ground_m + above_m - HEIGHT_M;
        points.push(RangePoint { position_m: [ahead_m as f32, left_m as f32, z_m as f32], class });
    }
    (odometry, Scan { valid_at_ns: odometry.valid_at_ns, origin_m: [0.8, 0.0, 1.4], points })
}

/// Fowler, Noll and Vo's hash of numbers to the last bit.
fn hash(numbers: impl IntoIterator<Item = f32>) -> u64 {
    let bytes = numbers.into_iter().flat_map(|number| number.to_bits().to_le_bytes());
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

/// Hashes of the ground, the risk map and the decisions of the drive.
fn drive(isa: Isa) -> [u64; 3] {
    let vehicle = formats::read_vehicle("pietra_full_size").unwrap();
    let mut config = Config::for_vehicle(&vehicle);
    config.controller.isa = isa;
    let checkpoint = Arc::new(evidential::shipped(evidential::Method::Pietra, &vehicle.geometry).unwrap());
    let mut navigator = Navigator::new(Setup {
        geometry: &vehicle.geometry,
        model: Model::of(&vehicle),
        config,
        belief: Belief::Learned { checkpoint, unfamiliar: Unfamiliar::Avoid },
        surface: Surface::Sensed,
        level: CvarLevel::new(0.6).unwrap(),
        seed: 7,
        goal_m: [40.0, 12.0],
        tolerance_m: 1.0,
    })
    .unwrap();
    let mut commands = Vec::new();
    for cycle in 0..N_CYCLES {
        let (odometry, scan) = measured(cycle);
        assert!(navigator.observe(odometry.valid_at_ns, &odometry, Some(&scan)).unwrap());
        match navigator.decide(odometry.valid_at_ns + 20_000_000).unwrap() {
            Decision::Drive(command) => commands.extend([command.speed_mps, command.steering_rad]),
            other => panic!("cycle {cycle}: expected a command, found {other:?}"),
        }
    }
    assert_eq!(navigator.n_jumps(), 1);
    let cells = navigator.surface().values().iter();
    let ground = cells.flat_map(|cell| [cell.height_m, cell.height_variance_m2, cell.vegetation_height_m]);
    let map = navigator.risk_map().unwrap();
    let risks = map.risks.iter();
    let risks = risks.flat_map(|r| [r.linear_traction, r.angular_traction, r.roll_rad, r.pitch_rad]);
    let gradients = map.ground.iter().flat_map(|ground| ground.gradient);
    [hash(ground), hash(risks.chain(gradients)), hash(commands)]
}

/// The drive on each instruction set that the machine has, the widest first.
static DRIVES: LazyLock<Vec<(Isa, [u64; 3])>> =
    LazyLock::new(|| Instructions::all().map(|found| (found.isa(), drive(found.isa()))).collect());

/// Maps differ in rounding, so one that was made with others would show.
#[test]
fn the_instruction_set_of_the_configuration_makes_the_map() {
    let (portable, wider) = DRIVES.split_last().unwrap();
    assert_eq!(portable.0, Isa::Portable);
    for (isa, [ground, map, _]) in wider {
        assert_eq!(*ground, portable.1[0], "no kernel has a part in the ground");
        assert_ne!(*map, portable.1[1], "{isa:?}");
    }
}

/// What [`drive`] gives on every machine that has the instruction set, whoever made its processor and whatever its
/// system is. A change of the computation changes these numbers on purpose; another compiler, processor or platform
/// must not.
const EVERYWHERE: [(Isa, [u64; 3]); 4] = [
    (Isa::Avx512, [0xaad0_1696_d718_376d, 0xa008_4e0d_dd26_2616, 0xef85_ebc0_52a3_7a2c]),
    (Isa::Avx2, [0xaad0_1696_d718_376d, 0xa008_4e0d_dd26_2616, 0x157f_6168_1dc8_432f]),
    (Isa::Neon, [0xaad0_1696_d718_376d, 0xa008_4e0d_dd26_2616, 0x2ec2_fa21_7848_eb5f]),
    (Isa::Portable, [0xaad0_1696_d718_376d, 0x136f_eb32_9efb_7565, 0x3b9b_b13e_2d1c_2038]),
];

#[test]
fn a_drive_gives_the_same_numbers_on_every_machine() {
    let here = |isa: &Isa| DRIVES.iter().any(|(of, _)| of == isa);
    let expected: Vec<_> = EVERYWHERE.into_iter().filter(|(isa, _)| here(isa)).collect();
    assert_eq!(*DRIVES, expected, "found {:#018x?}", *DRIVES);
}

/// The platform's own function, for the witness below: fails where that is not to be had.
#[test]
fn the_platforms_sine_is_near_ours() {
    for step in 0..1000 {
        let angle_rad = std::hint::black_box(0.01 * f64::from(step));
        assert!((angle_rad.sin() - libm::sin(angle_rad)).abs() < 1e-15);
    }
}

/// A library that stands in for the platform's and refuses every call.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn refusing_library(folder: &Path) -> PathBuf {
    const OF_ONE: [&str; 21] = [
        "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh",
        "exp", "exp2", "expm1", "log", "log1p", "log2", "log10", "cbrt", "tgamma",
    ];
    let mut code = "fn refuse(name: &str) -> ! { eprintln!(\"the platform's {name} was called\"); \
                    std::process::abort() }\n"
        .to_owned();
    let functions = OF_ONE.map(|name| (name, 1)).into_iter().chain([("pow", 2), ("atan2", 2), ("hypot", 2)]);
    for (name, n) in functions {
        for (suffix, kind) in [("", "f64"), ("f", "f32")] {
            let arguments = vec![format!("_: {kind}"); n].join(", ");
            code += &format!(
                "#[no_mangle] pub extern \"C\" fn {name}{suffix}({arguments}) -> {kind} {{ refuse(\"{name}\") }}\n"
            );
        }
    }
    for (suffix, kind) in [("", "f64"), ("f", "f32")] {
        code += &format!(
            "#[no_mangle] pub extern \"C\" fn sincos{suffix}(_: {kind}, _: *mut {kind}, _: *mut {kind}) \
             {{ refuse(\"sincos\") }}\n"
        );
    }
    let (source, library) = (folder.join("refusing.rs"), folder.join("librefusing.so"));
    std::fs::write(&source, code).unwrap();
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let made = std::process::Command::new(rustc)
        .args(["--edition", "2021", "--crate-type", "cdylib", "-A", "warnings", "-o"])
        .args([&library, &source])
        .status();
    assert!(made.unwrap().success());
    library
}

/// No drive on the way from scan to command asks the platform for a sine or any of its kin.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[test]
fn a_drive_runs_where_the_platforms_functions_refuse() {
    let folder = tempfile::tempdir().unwrap();
    let library = refusing_library(folder.path());
    let run = |test: &str| {
        let output = std::process::Command::new(std::env::current_exe().unwrap())
            .args(["--exact", test, "--nocapture", "--test-threads", "1"])
            .env("LD_PRELOAD", &library)
            .output()
            .unwrap();
        (output.status.success(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (passed, told) = run("the_platforms_sine_is_near_ours");
    assert!(!passed && told.contains("the platform's sin was called"), "the library refuses nothing: {told}");
    let (passed, told) = run("the_instruction_set_of_the_configuration_makes_the_map");
    assert!(passed, "{told}");
}
