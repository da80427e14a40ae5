//! `surefoot up`.

use std::net::SocketAddr;
use std::ops::RangeInclusive;

use bus::ages::Periods;
use bus::channel::{RunName, THIRD_PARTIES};
use bus::status::Role;
use clap::{Args, FromArgMatches, ValueEnum};
use formats::{CONTROL_RATES_HZ, ODOMETRY_RATES_HZ, RobotFile, SCAN_RATES_HZ, THIRD_PARTIES_MAX};

use super::values;
use super::{DriveArguments, Goal};

/// Where the live view is served: on this machine, at the port that Foxglove looks for.
pub const LIVE_DEFAULT: &str = "127.0.0.1:8765";

/// What describes a simulated vehicle or its world, and what a robot's file says.
const SIMULATION: [&str; 17] = [
    "world",
    "bush_height",
    "walkers",
    "start",
    "vehicle",
    "speed",
    "deviation",
    "model",
    "config",
    "method",
    "weights",
    "correct",
    "time_limit",
    "rate",
    "odometry_rate",
    "scan_rate",
    "command_age",
];

/// What to run, and for which machine.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = AFTER_HELP)]
pub struct UpArguments {
    /// Which process to be; all starts every one of them and keeps them alive
    #[arg(long, value_enum, default_value_t = UpRole::All, help_heading = "Processes")]
    pub role: UpRole,

    /// Supervise the processes of a real robot, which this TOML file describes, and simulate none: vehicle, roles, rates,
    /// ages, sensors, goals, areas to keep out of
    ///
    /// The robot's own driver publishes odometry and scans and follows commands; see docs/runtime.md, "Your robot".
    #[arg(long, value_name = "FILE", conflicts_with_all = SIMULATION, help_heading = "Processes")]
    pub robot: Option<std::path::PathBuf>,

    /// Simulate the vehicle, as without --robot
    #[arg(long, conflicts_with = "robot", help_heading = "Processes")]
    pub sim: bool,

    /// What the robot's file says.
    #[arg(skip)]
    pub described: Option<Box<RobotFile>>,

    /// Name of the run: processes of the same name find one another
    #[arg(long, value_name = "NAME", default_value = "field", help_heading = "Processes")]
    pub run: RunName,

    /// Decisions per second, 1 to 50 [Hz]
    #[arg(long, value_name = "HERTZ", value_parser = rate_hz, default_value = "10",
          allow_hyphen_values = true, help_heading = "Times")]
    pub rate: f64,

    /// Odometry messages per second, 2 to 400 [Hz]: what the simulated vehicle sends, or your own does
    #[arg(long, value_name = "HERTZ", value_parser = odometry_rate_hz, default_value = "50",
          allow_hyphen_values = true, help_heading = "Times")]
    pub odometry_rate: f64,

    /// Scans per second, 0.5 to 50 [Hz]: what the simulated vehicle sends, or your own does
    ///
    /// Limits on ages follow from this and the two rates above; see docs/runtime.md. Give every process of a run the same.
    #[arg(long, value_name = "HERTZ", value_parser = scan_rate_hz, default_value = "5",
          allow_hyphen_values = true, help_heading = "Times")]
    pub scan_rate: f64,

    /// Age of the odometry behind a command up to which the vehicle follows it [s]; then it stops [default: 0.3, more
    /// where decisions are rarer than 10 a second]
    #[arg(long, value_name = "SECONDS", value_parser = values::duration_s, allow_hyphen_values = true,
          help_heading = "Times")]
    pub command_age: Option<f64>,

    /// Readers that each channel has room for beside the run's own; give every process of a run the same
    ///
    /// A publisher of maps reserves shared memory for every place: for a full-size vehicle some 25 MB in all.
    #[arg(long, value_name = "N", value_parser = third_parties, default_value_t = THIRD_PARTIES,
          help_heading = "Processes")]
    pub third_parties: usize,

    /// Pin processes to cores, the largest to what the vehicle waits for, ask for SCHED_FIFO and lock memory; each says on standard error what was not permitted
    #[arg(long, help_heading = "Processes")]
    pub realtime: bool,

    /// Serve a live view to Foxglove, by a process of its own: poses, maps, commands, the way to the goal, statuses
    ///
    /// Open it with "Open connection", Foxglove WebSocket, ws://127.0.0.1:8765. A slow client loses frames; nothing waits
    /// for one. There is no password: an address that others can reach shows them everything.
    #[arg(long, value_name = "HOST:PORT", num_args = 0..=1, require_equals = true,
          default_missing_value = LIVE_DEFAULT, help_heading = "Live view")]
    pub live: Option<SocketAddr>,

    /// Size that all recordings in the output folder together may reach, those of before included [MB]; then the vehicle
    /// drives on without a recording, and the recorder says so
    #[arg(long, value_name = "MEGABYTES", value_parser = quota_mb, default_value = "16000",
          allow_hyphen_values = true, help_heading = "Recording")]
    pub record_quota: f64,

    /// Time after which what was recorded is put onto the disk (fsync): what a failure of the power may cost [s]
    #[arg(long, value_name = "SECONDS", value_parser = values::duration_s, default_value = "1",
          allow_hyphen_values = true, help_heading = "Recording")]
    pub record_sync: f64,

    /// How much is told of what happens: on standard error, in the files of --log, and whether statuses are shown
    ///
    /// Where systemd's journal takes standard error, lines carry their level: `journalctl -p warning` finds them.
    #[arg(long, value_enum, default_value_t = LogLevel::Info, help_heading = "Log")]
    pub log_level: LogLevel,

    /// Keep what is told also in files of this folder, PROCESS.log, with times; of 4 MB each, four of before
    ///
    /// When one is full it becomes PROCESS.log.1, what was that PROCESS.log.2, and the last of all is dropped.
    #[arg(long, value_name = "FOLDER", help_heading = "Log")]
    pub log: Option<std::path::PathBuf>,

    /// Go on learning from the drive; networks that prove better are used and kept in OUT/learned
    ///
    /// What the vehicle does over what is asked of it becomes labels, as with `surefoot collect`; networks are fitted to
    /// them in the background, at the lowest priority. They are used when they are better on stretches of the drive that
    /// nothing is learned from, by more than the standard error, and at most 2 % worse on the original validation data;
    /// else they are dropped, and those that prove worse later are rolled back. Left out, a drive knows what it knew at
    /// its start, and the same processes drive alike every time. Needs a --method with networks.
    #[arg(long, help_heading = "Learning")]
    pub learn: bool,

    /// Data that the networks were chosen by, as `surefoot collect --split validation` leaves them [default: a sample
    /// that comes with the program, for its own networks]
    #[arg(long, value_name = "FILE", help_heading = "Learning")]
    pub validation: Option<std::path::PathBuf>,

    /// Begin without a mission, but for those of --goal, and wait for `surefoot goal`; stay when a mission is over
    ///
    /// --time-limit counts all the same.
    #[arg(long, help_heading = "Run")]
    pub standby: bool,

    /// Set for a process that takes the place of one that has died.
    #[arg(long, hide = true)]
    pub again: bool,

    /// Set for the processes that `--role all` starts: end when it does
    #[arg(long, hide = true)]
    pub supervised: bool,

    /// World, vehicle, controller and output, as for `surefoot drive`.
    #[command(flatten)]
    pub drive: DriveArguments,
}

impl UpArguments {
    /// What `surefoot up --robot FILE` is told, with goals [m].
    ///
    /// # Errors
    /// Words that the command line would refuse.
    pub fn of_robot(robot: &std::path::Path, goals: &[Goal]) -> Result<Self, clap::Error> {
        let words = ["up".into(), "--robot".into(), robot.as_os_str().to_owned()].into_iter();
        let goals = goals.iter().map(|goal| format!("--goal={},{}", goal.x_m, goal.y_m).into());
        let command = Self::augment_args(clap::Command::new("up"));
        Self::from_arg_matches(&command.try_get_matches_from(words.chain(goals))?)
    }

    /// How often the parts of the run speak.
    pub fn periods(&self) -> Periods {
        let Self { rate, odometry_rate, scan_rate, .. } = *self;
        Periods {
            control_s: rate.recip(),
            odometry_s: odometry_rate.recip(),
            scan_s: scan_rate.recip(),
            ..Periods::default()
        }
    }
}

/// How much is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
pub enum LogLevel {
    /// Why a run or a process ended that should not have
    Error,
    /// Also what was stopped for, refused, not permitted or lost, and processes that were started again
    Warning,
    /// Also what goes as it should: decisions and the mission as they change, rounds of learning; and once a second, on
    /// standard output, how every process is doing
    Info,
}

/// A process, or all of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum UpRole {
    /// All of the others, kept alive
    All,
    /// The simulated vehicle; leave it out and run your own instead
    Plant,
    /// Scans and poses to the map of the ground
    Mapping,
    /// The map of the ground to risk
    Learning,
    /// Risk to commands
    Control,
    /// Everything into a recording
    Recorder,
    /// Orders to what the vehicle is told to do
    Mission,
    /// A ROS 2 node that is the driver of the robot in --robot, by the part `ros` of its file
    Ros,
    /// The live view that `--live` serves
    Live,
}

impl UpRole {
    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match (self, self.role()) {
            (_, Some(role)) => role.name(),
            (Self::Live, None) => "live",
            _ => "all",
        }
    }

    /// The one part of the machine; `None` for all, and for the view of it.
    pub fn role(self) -> Option<Role> {
        match self {
            Self::All | Self::Live => None,
            Self::Plant => Some(Role::Plant),
            Self::Mapping => Some(Role::Mapping),
            Self::Learning => Some(Role::Learning),
            Self::Control => Some(Role::Control),
            Self::Recorder => Some(Role::Recorder),
            Self::Mission => Some(Role::Mission),
            Self::Ros => Some(Role::Ros),
        }
    }
}

fn rate_hz(word: &str) -> Result<f64, String> {
    rate_in(word, &CONTROL_RATES_HZ)
}

fn odometry_rate_hz(word: &str) -> Result<f64, String> {
    rate_in(word, &ODOMETRY_RATES_HZ)
}

fn scan_rate_hz(word: &str) -> Result<f64, String> {
    rate_in(word, &SCAN_RATES_HZ)
}

fn rate_in(word: &str, range: &RangeInclusive<f64>) -> Result<f64, String> {
    let expected = format!("a rate from {} to {} Hz", range.start(), range.end());
    values::number_where(word, &expected, |value| range.contains(&value))
}

fn third_parties(word: &str) -> Result<usize, String> {
    let places = word.trim().parse().ok().filter(|n| *n <= THIRD_PARTIES_MAX);
    places
        .ok_or_else(|| format!("expected a number of readers from 0 to {THIRD_PARTIES_MAX}, found {word:?}"))
}

fn quota_mb(word: &str) -> Result<f64, String> {
    values::number_where(word, "a size from 1 to 1000000 MB", |value| (1.0..=1e6).contains(&value))
}

pub(super) const LONG_ABOUT: &str = "\
Drives as `surefoot drive` does, with every part a process of its own: the vehicle, mapping, learning, control, \
the recorder and the mission, linked by channels in shared memory.

Control decides at absolute deadlines on what there is and never waits for a map. When learning dies, physics judges \
the ground; when nothing young enough is left to drive on, the vehicle stops; when control dies, the vehicle's own \
watchdog stops it. Processes may start in any order, each in its own terminal, and be restarted at any time. Give each \
the same words: what describes the run concerns them all.";

const AFTER_HELP: &str = "\
Examples:
  surefoot up
      All processes, over a generated rock field.
  surefoot up --role control --run north
      One of them, in its own terminal, for the run `north`.
  surefoot up --realtime --rate 50
      As regular as the system permits, 50 decisions a second.
  surefoot up --robot mine.toml
      The processes of a robot of your own, without a simulator; its driver is yours.
  surefoot up --robot mine.toml --standby --log-level warning --log /var/log/surefoot
      For weeks: what was wrong, in files that do not grow for ever.
  surefoot up --standby --time-limit 3600
      Wait for `surefoot goal`, `pause`, `estop` and the others; see `surefoot goal --help`.

`--role all` leaves drive-000.mcap, drive-001.mcap and so on, summary.json (how the drive
ended, how often the localisation jumped) and runtime.json: how control kept its times (jitter, lateness, misses, age of
its maps) and what each process took of processor and memory.

Exit codes:
  0  the goal was reached, or the process was told to end
  1  it was not, or a process could not be kept alive; one line says why
  2  bad usage or input; one line says what was expected and what was found";

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Only {
        #[command(flatten)]
        up: UpArguments,
    }

    #[test]
    fn rates_and_runs_are_what_they_may_be() {
        let parse = |words: &[&str]| Only::try_parse_from(std::iter::once(&"surefoot").chain(words));
        let up = parse(&[]).unwrap().up;
        assert_eq!((up.role, up.rate, up.run.to_string()), (UpRole::All, 10.0, "field".to_owned()));
        for wrong in [["--rate", "0"], ["--rate", "51"], ["--run", "a b"], ["--role", "pilot"]] {
            assert!(parse(&wrong).is_err(), "{wrong:?}");
        }
    }
}
