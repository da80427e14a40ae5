//! `surefoot doctor`: is this machine, and are this robot's sensors, fit to drive?

mod bag;

use std::path::Path;

use bus::channel::{Bus, RunName};
use formats::read_vehicle;
use runtime::doctor::{self, Expected, Finding, Verdict};

use crate::arguments::{AskedRun, DoctorArguments, UpArguments};
use crate::up::robot;
use crate::{UsageError, WorkFailed, interrupt, orders, progress};

pub(crate) fn run(arguments: &DoctorArguments) -> anyhow::Result<()> {
    arguments.copy.prepare()?;
    let up = arguments.robot.as_deref().map(described).transpose()?;
    let expected = up.as_ref().map(expected).transpose()?.unwrap_or_default();
    if let (Some(bag), Some(file), Some(up)) = (&arguments.bag, &arguments.robot, &up) {
        let findings = bag::look(bag, up, robot::ros(up, file)?, &expected)?;
        print(&format!("bag {}", bag.display()), &findings);
        arguments.copy.write(&findings)?;
        return conclude(&findings);
    }
    let run = which(&arguments.run, up.as_ref())?;
    let mut findings = doctor::machine(&arguments.recordings);
    print("this machine", &findings);
    match run {
        Some(run) => {
            let of_run = watch(&run, &expected, arguments.seconds)?;
            print(&format!("run {run}, looked on at for up to {} s", arguments.seconds), &of_run);
            findings.extend(of_run);
        }
        None => println!("There is no run to look on at: start one with `surefoot up`."),
    }
    arguments.copy.write(&findings)?;
    conclude(&findings)
}

/// What `surefoot up` would make of the robot's file.
fn described(file: &Path) -> anyhow::Result<UpArguments> {
    Ok(robot::described(&UpArguments::of_robot(file, &[])?)?)
}

/// What the robot's file says that it is like.
fn expected(up: &UpArguments) -> Result<Expected, UsageError> {
    let vehicle = read_vehicle(up.drive.vehicle_name_or_path()).map_err(UsageError::from_input)?;
    let sensors = up.described.iter().flat_map(|robot| &robot.sensors);
    Ok(Expected {
        periods: Some(robot::periods(up)),
        mounts: sensors.map(|sensor| sensor.mount.clone()).collect(),
        wheel_and_length_m: Some([vehicle.geometry.wheel_radius_m, vehicle.geometry.length_m]),
    })
}

/// The run that is asked for, else the robot's, else the only one; `None` where nobody asked and there is none.
fn which(asked: &AskedRun, up: Option<&UpArguments>) -> anyhow::Result<Option<RunName>> {
    let names_run = |up: &&UpArguments| up.described.as_ref().is_some_and(|robot| robot.run.is_some());
    let of_robot = up.filter(names_run).map(|up| up.run.clone());
    if asked.run.is_some() || !RunName::alive()?.is_empty() {
        let run = asked.run.clone().or(of_robot);
        return orders::choose(&AskedRun { run }).map(Some);
    }
    Ok(None)
}

fn watch(run: &RunName, expected: &Expected, watched_s: f64) -> anyhow::Result<Vec<Finding>> {
    let bar = progress::bar((1e3 * watched_s) as u64, "looking on at {msg}").with_message(run.to_string());
    interrupt::catch_interrupts()?;
    let mut is_over = |passed_s: f64| {
        bar.set_position((1e3 * passed_s) as u64);
        interrupt::interrupted()
    };
    let findings = doctor::watch(&Bus::visit(run)?, expected, watched_s, &mut is_over)?;
    bar.finish_and_clear();
    Ok(findings)
}

fn print(of: &str, findings: &[Finding]) {
    println!("{of}:");
    let widest = findings.iter().map(|finding| finding.what.len()).max().unwrap_or(0);
    for Finding { what, verdict, found } in findings {
        println!("  {:7}  {what:widest$}  {found}", word(*verdict));
    }
}

const fn word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Fine => "fine",
        Verdict::Doubtful => "look",
        Verdict::Wrong => "WRONG",
        Verdict::Unknown => "unknown",
    }
}

fn conclude(findings: &[Finding]) -> anyhow::Result<()> {
    let n = |verdict| findings.iter().filter(|finding| finding.verdict == verdict).count();
    let counts = [Verdict::Fine, Verdict::Doubtful, Verdict::Wrong, Verdict::Unknown];
    let [fine, doubtful, wrong, unknown] = counts.map(n);
    println!(
        "{} checks: {fine} fine, {doubtful} to look at, {wrong} wrong, {unknown} unknown",
        findings.len()
    );
    match findings.iter().find(|finding| finding.verdict == Verdict::Wrong) {
        Some(Finding { what, found, .. }) => Err(WorkFailed(format!("{what}: {found}")).into()),
        None => Ok(()),
    }
}
