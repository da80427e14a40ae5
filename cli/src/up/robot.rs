//! A robot's file in place of the words that describe a simulated vehicle.

use std::collections::BTreeMap;
use std::path::Path;

use bus::ages::Periods;
use bus::channel::RunName;
use bus::status::Role;
use clap::ValueEnum;
use formats::{RobotFile, RobotRos, RobotSafety, read_robot, read_vehicle};
use navigator::{Areas, GuardConfig};
use runtime::ages::AskedAges;

use crate::UsageError;
use crate::arguments::{Correct, Goal, Method, UpArguments, UpRole};
use crate::drive::scene::{self, Machine};

/// Lengths of the vehicle within which a robot is at its goal, where nobody says how near that is.
const TOLERANCE_LENGTHS: f64 = 0.3;

/// The arguments with what the robot's file says in them; without a file, as they are.
pub(crate) fn described(arguments: &UpArguments) -> Result<UpArguments, UsageError> {
    let mut arguments = arguments.clone();
    let Some(path) = &arguments.robot else { return Ok(arguments) };
    let robot = read_robot(path).map_err(UsageError::from_input)?;
    let told = |text: String| UsageError(format!("{}: {text}", path.display()));
    if let Some(run) = &robot.run {
        arguments.run = run.parse::<RunName>().map_err(|error| told(format!("run: {error}")))?;
    }
    if let Some(name) = &robot.ground.method {
        let method = Method::from_str(name, true).map_err(|_| told(unknown_method(name)))?;
        arguments.drive.method = Some(method);
    }
    if let Some(correction) = &robot.correction {
        let name = &correction.method;
        let method = Correct::from_str(name, true)
            .map_err(|_| told(format!("correction.method: expected kinodynamics, found {name:?}")))?;
        arguments.drive.correct = Some(method);
        arguments.drive.kinodynamics_weights = Some(correction.weights.clone());
    }
    let directs = roles_of(&robot).map_err(told)?.contains(&Role::Mission);
    let RobotFile { rates, ground, mission, .. } = &robot;
    arguments.rate = rates.control_hz.unwrap_or(arguments.rate);
    arguments.odometry_rate = rates.odometry_hz.unwrap_or(arguments.odometry_rate);
    arguments.scan_rate = rates.scan_hz.unwrap_or(arguments.scan_rate);
    arguments.third_parties = robot.third_parties.unwrap_or(arguments.third_parties);
    // The node shows maps that no other driver reads.
    arguments.third_parties += usize::from(robot.ros.is_some());
    let drive = &mut arguments.drive;
    drive.vehicle = Some(robot.vehicle.clone());
    (drive.model, drive.config) = (robot.model.clone(), robot.config.clone());
    drive.weights = ground.weights.clone();
    drive.alpha = ground.alpha.unwrap_or(drive.alpha);
    if drive.goal.is_empty() {
        drive.goal = mission.goals_m.iter().map(|&[x_m, y_m]| Goal { x_m, y_m }).collect();
    }
    drive.tolerance = drive.tolerance.or(mission.tolerance_m);
    // Where somebody else says the mission, the run ends with it.
    arguments.standby |= directs && (mission.standby || arguments.drive.goal.is_empty());
    arguments.described = Some(Box::new(robot));
    refuse_other_roles(&arguments)?;
    Ok(arguments)
}

/// What the robot's file says of ROS 2, which reading a bag needs.
pub(crate) fn ros<'a>(arguments: &'a UpArguments, file: &Path) -> Result<&'a RobotRos, UsageError> {
    let ros = arguments.described.as_ref().and_then(|robot| robot.ros.as_ref());
    let file = file.display();
    ros.ok_or_else(|| UsageError(format!("{file}: expected a robot file with a part [ros], found none")))
}

/// What the topics of a bag are by their names from the root: those that the file names once, and every one of clouds.
pub(crate) fn topics<T: Copy>(ros: &RobotRos, single: &[(&String, T)], clouds: T) -> BTreeMap<String, T> {
    let clouds = ros.topics.points.iter().map(|name| (name, clouds));
    let named = single.iter().copied().chain(clouds);
    named.filter_map(|(name, topic)| Some((ros::bag::topic_name(ros, name)?, topic))).collect()
}

fn unknown_method(name: &str) -> String {
    let known = Method::value_variants().iter().filter_map(ValueEnum::to_possible_value);
    let names = known.map(|value| value.get_name().to_owned()).filter(|name| name != "truth");
    format!("ground.method: expected one of {}, found {name:?}", names.collect::<Vec<_>>().join(", "))
}

/// Who is asked to be a process that the robot does not run here.
fn refuse_other_roles(arguments: &UpArguments) -> Result<(), UsageError> {
    let (Some(role), Some(robot)) = (arguments.role.role(), &arguments.described) else { return Ok(()) };
    let roles = roles_of(robot).map_err(UsageError)?;
    if roles.contains(&role) {
        return Ok(());
    }
    let names: Vec<&str> = roles.iter().map(|role| role.name()).collect();
    Err(UsageError(format!(
        "--role: expected one of the robot's roles, {}, found {}",
        names.join(", "),
        UpRole::name(arguments.role)
    )))
}

/// The processes that are to run here: of a robot, those that its file names, and never a simulated vehicle.
pub(super) fn roles(arguments: &UpArguments) -> Result<Vec<Role>, UsageError> {
    let all = || Ok(Role::SIMULATED.to_vec());
    arguments.described.as_ref().map_or_else(all, |robot| roles_of(robot).map_err(UsageError))
}

fn roles_of(robot: &RobotFile) -> Result<Vec<Role>, String> {
    let is_own = |role: &Role| *role != Role::Plant && (*role != Role::Ros || robot.ros.is_some());
    let own: Vec<Role> = Role::ALL.into_iter().filter(is_own).collect();
    let Some(names) = &robot.roles else { return Ok(own) };
    let named = |name: &String| {
        let names = || own.iter().map(|role| role.name()).collect::<Vec<_>>().join(", ");
        let found = own.iter().copied().find(|role| role.name() == name);
        found.ok_or_else(|| format!("roles: expected some of {}, found {name:?}", names()))
    };
    let roles = names.iter().map(named).collect::<Result<Vec<_>, _>>()?;
    if roles.is_empty() { Err("roles: expected at least one, found none".to_owned()) } else { Ok(roles) }
}

/// How often the parts of the run speak.
pub(crate) fn periods(arguments: &UpArguments) -> Periods {
    let periods = arguments.periods();
    let mission_hz = arguments.described.as_ref().and_then(|robot| robot.rates.mission_hz);
    Periods { mission_s: mission_hz.map_or(periods.mission_s, f64::recip), ..periods }
}

/// The ages that are asked for.
pub(crate) fn ages(arguments: &UpArguments) -> AskedAges {
    let of_words = AskedAges::of_command(arguments.command_age);
    arguments.described.as_ref().map_or(of_words, |robot| {
        let ages = &robot.ages;
        AskedAges {
            command_s: ages.command_s.or(arguments.command_age),
            learned_s: ages.learned_s,
            learning_silence_s: ages.learning_silence_s,
            mission_s: ages.mission_s,
            order_s: ages.order_s,
        }
    })
}

/// The machine, with a guard that its configuration may change; of a robot, with its limits, sensors and areas.
pub(crate) fn machine(arguments: &UpArguments, guard: GuardConfig) -> Result<Machine, UsageError> {
    let Some(robot) = &arguments.described else { return scene::machine(&arguments.drive, guard) };
    let mut vehicle = read_vehicle(&robot.vehicle).map_err(UsageError::from_input)?;
    lower(&mut vehicle.limits, &robot.safety);
    let mut machine = scene::machine_of(vehicle, &arguments.drive, guard)?;
    lower(&mut machine.model.limits, &robot.safety);
    let config = &mut machine.config;
    if !robot.sensors.is_empty() {
        config.sensors = robot.sensors.iter().map(|sensor| sensor.mount.clone()).collect();
    }
    let Areas { keep_out_m, geofence_m } = &mut config.areas;
    keep_out_m.extend(robot.areas.keep_out_m.iter().cloned());
    if !robot.areas.geofence_m.is_empty() {
        geofence_m.clone_from(&robot.areas.geofence_m);
    }
    Ok(machine)
}

fn lower(limits: &mut bicycle::Limits, safety: &RobotSafety) {
    let pairs = [
        (&mut limits.speed_max_mps, safety.speed_max_mps),
        (&mut limits.reverse_speed_max_mps, safety.speed_max_mps),
        (&mut limits.roll_max_rad, safety.roll_max_rad),
        (&mut limits.pitch_max_rad, safety.pitch_max_rad),
        (&mut limits.lateral_acceleration_max_mps2, safety.lateral_acceleration_max_mps2),
    ];
    for (limit, lower) in pairs {
        *limit = lower.map_or(*limit, |lower| limit.min(lower));
    }
}

/// How near to a goal counts as there [m]; `None` where a simulated world says it.
pub(crate) fn tolerance_m(arguments: &UpArguments, machine: &Machine) -> Option<f64> {
    let of_length = TOLERANCE_LENGTHS * machine.vehicle.geometry.length_m;
    arguments.drive.tolerance.or(arguments.described.as_ref().map(|_| of_length))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

    use super::*;
    use crate::arguments::{Arguments, Command};
    use clap::Parser;

    const ROBOT: &str = "\
format = 1
run = 'north'
vehicle = 'rc_car'
roles = ['mapping', 'control', 'mission']
ground = { method = 'physics', alpha = 0.3 }
rates = { scan_hz = 10.0, mission_hz = 4.0 }
ages = { command_s = 0.5 }
mission = { goals_m = [[4.0, 1.0]], tolerance_m = 0.2 }
areas = { geofence_m = [[-5.0, -5.0], [5.0, -5.0], [5.0, 5.0], [-5.0, 5.0]] }
safety = { speed_max_mps = 0.4 }
sensors = [{ name = 'lidar', mount = { position_m = [0.1, 0.0, 0.2], attitude_rad = [0.0, 0.1, 0.0] } }]
";

    fn up(text: &str, words: &[&str]) -> Result<UpArguments, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("robot.toml");
        std::fs::write(&path, text).unwrap();
        let words =
            ["surefoot", "up", "--robot", path.to_str().unwrap()].into_iter().chain(words.iter().copied());
        let Command::Up(arguments) =
            Arguments::try_parse_from(words).map_err(|error| error.to_string())?.command
        else {
            unreachable!("parsed from `up`")
        };
        described(&arguments).map_err(|error| error.0)
    }

    #[test]
    fn a_robots_file_decides_everything_that_it_says() {
        let arguments = up(ROBOT, &[]).unwrap();
        assert_eq!((arguments.run.to_string().as_str(), arguments.standby), ("north", false));
        assert_eq!(roles(&arguments).unwrap(), [Role::Mapping, Role::Control, Role::Mission]);
        let periods = periods(&arguments);
        assert!((periods.scan_s - 0.1).abs() < 1e-12 && (periods.mission_s - 0.25).abs() < 1e-12);
        assert_eq!(ages(&arguments).command_s, Some(0.5));
        let machine = machine(&arguments, GuardConfig::default()).unwrap();
        assert_eq!(machine.vehicle.limits.speed_max_mps, 0.4);
        assert_eq!(machine.model.limits.speed_max_mps, 0.4, "what the controller believes, too");
        assert_eq!(machine.config.sensors.len(), 1);
        assert!(!machine.config.areas.allow([5.5, 0.0]) && machine.config.areas.allow([4.5, 0.0]));
        assert_eq!(tolerance_m(&arguments, &machine), Some(0.2));
        assert_eq!(arguments.drive.alpha, 0.3);
    }

    #[test]
    fn a_limit_above_the_machines_own_raises_nothing() {
        let reckless = up(&ROBOT.replace("speed_max_mps = 0.4", "speed_max_mps = 99.0"), &[]).unwrap();
        let own = read_vehicle("rc_car").unwrap().limits;
        assert_eq!(machine(&reckless, GuardConfig::default()).unwrap().vehicle.limits, own);
    }

    #[test]
    fn without_goals_a_robot_waits_for_orders() {
        assert!(up("format = 1\nvehicle = 'rc_car'", &[]).unwrap().standby);
    }

    #[test]
    fn what_a_robot_cannot_be_is_refused() {
        let told = |text: &str, words: &[&str]| up(text, words).unwrap_err();
        let plant = told(&ROBOT.replace("'mapping', ", "'plant', "), &[]);
        assert!(
            plant.contains("roles: expected some of mapping, learning, control")
                && plant.contains("\"plant\"")
        );
        assert!(told(ROBOT, &["--role", "plant"]).contains("--role: expected one of the robot's roles"));
        assert!(
            told(&ROBOT.replace("'physics'", "'magic'"), &[])
                .contains("ground.method: expected one of pietra")
        );
        assert!(told(ROBOT, &["--world", "arena"]).contains("--world"), "there is no simulated world");
        assert!(told(&ROBOT.replace("'north'", "'no rth'"), &[]).contains("run: expected 1 to 32 letters"));
    }
}
