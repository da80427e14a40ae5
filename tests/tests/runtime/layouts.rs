//! The layouts as other languages know them are those of the types.

use std::path::{Path, PathBuf};
use std::process::Command;

use bicycle::Decision;
use bus::channel::{COMMAND, Channel, IMU, MISSION, ODOMETRY, RISK, SCAN};
use bus::layout::{c_header, python_module};
use bus::message::{CommandRecord, LAYOUT_VERSION, layouts};
use bus::watchdog::Watchdog;

use crate::fixture::{ages, machine};

fn place(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(path)
}

/// What a vehicle does at a time [ns] with a command that was sent at another.
struct Case {
    decision: u32,
    odometry_at_ns: u64,
    scan_at_ns: u64,
    sent_at_ns: u64,
    now_ns: u64,
}

/// In time; old odometry; an old scan; sent late, half of its time left and none; to stand; decided on nothing.
const CASES: [Case; 9] = {
    const fn case(decision: u32, [odometry, scan, sent, now]: [u64; 4]) -> Case {
        const MS: u64 = 1_000_000;
        let (odometry_at_ns, scan_at_ns) = (odometry * MS, scan * MS);
        Case { decision, odometry_at_ns, scan_at_ns, sent_at_ns: sent * MS, now_ns: now * MS }
    }
    [
        case(1, [5000, 4900, 5010, 5300]),
        case(1, [5000, 4900, 5010, 5301]),
        case(1, [5000, 4100, 5010, 5100]),
        case(1, [5000, 4100, 5010, 5101]),
        case(1, [5000, 4900, 5200, 5300]),
        case(1, [5000, 4900, 9000, 9000]),
        case(2, [5000, 4900, 5010, 5020]),
        case(3, [5000, 4900, 5010, 5020]),
        case(1, [0, 0, 5010, 5020]),
    ]
};

/// The driver in Python carries out what the vehicle's own watchdog would, and nothing else.
#[test]
fn the_python_drivers_watchdog_is_that_of_the_vehicle() {
    let (mut script, mut expected) = ("from watchdog import Watchdog\n".to_owned(), String::new());
    script += "from surefoot_layout import CommandRecord\n";
    for Case { decision, odometry_at_ns, scan_at_ns, sent_at_ns, now_ns } in CASES {
        let reason = u32::from(decision != 1);
        let command = CommandRecord {
            speed_mps: 0.5,
            steering_rad: 0.25,
            decision,
            reason,
            odometry_at_ns,
            scan_at_ns,
        };
        let mut watchdog = Watchdog::new(machine().0.limits, ages());
        watchdog.admit(&command, sent_at_ns);
        let drives = matches!(watchdog.decision(now_ns), Decision::Drive(_));
        expected += if drives { "(0.5, 0.25)\n" } else { "None\n" };
        script += &format!(
            "watchdog = Watchdog()\n\
             watchdog.admit(CommandRecord(0.5, 0.25, {decision}, {reason}, {odometry_at_ns}, {scan_at_ns}))\n\
             print(watchdog.command({now_ns}))\n"
        );
    }
    let told =
        Command::new("python3").args(["-B", "-c", &script]).current_dir(place("python")).output().unwrap();
    assert_eq!(String::from_utf8_lossy(&told.stdout), expected, "{}", String::from_utf8_lossy(&told.stderr));
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

/// Depth, readers and history, as the table of `channels.py` ends its row of a channel: where they differ, whoever opens
/// the channel second is refused.
fn python_row<H, T>(channel: &Channel<H, T>) -> [String; 2] {
    let Channel { name, depth, n_readers, history, .. } = channel;
    [format!("    \"{name}\": ("), format!(", {depth}, {n_readers}, {history}),")]
}

#[test]
fn the_python_channels_are_those_of_the_run() {
    let text = std::fs::read_to_string(place("python/channels.py")).unwrap();
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
