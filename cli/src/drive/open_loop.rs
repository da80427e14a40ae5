//! Commands from a file, carried out by the plant as they stand there.

use std::path::Path;

use bench::closed_loop::Cycle;
use bicycle::{Column, Command, Decision, Limits};
use scenarios::{Episode, EpisodeConfig, EpisodeError};

use crate::UsageError;

/// Commands per second [Hz]: the rate of drive logs.
const COMMAND_HZ: f64 = 50.0;
/// Rounding that a limit in a file may be written with.
const ROUNDING: f64 = 1e-3;

/// Commands over time; each holds until the next, the last for one cycle.
#[derive(Clone, Debug)]
pub(super) struct Script {
    time_s: Vec<f64>,
    commands: Vec<Command>,
}

impl Script {
    /// Reads the columns `t`, `cmd_speed` and `cmd_steer` of a drive log, CSV or MCAP.
    ///
    /// Errors: an unreadable file, more than one run, a column that is missing or has holes, a command beyond the
    /// vehicle's limits.
    pub fn read(path: &Path, limits: &Limits) -> Result<Self, UsageError> {
        let told = |text: String| UsageError(format!("--commands {}: {text}", path.display()));
        let log = formats::read_drive(path).map_err(UsageError::from_input)?.log;
        if log.runs().len() != 1 {
            return Err(told(format!("expected one run, found {}", log.runs().len())));
        }
        let runs: Vec<_> = log.runs().collect();
        let run = runs[0];
        let column = |column: Column| {
            run.column(column)
                .ok_or_else(|| told(format!("expected the column {}, found none", column.name())))
        };
        let (speeds, angles) = (column(Column::CmdSpeed)?, column(Column::CmdSteer)?);
        let allowed = [
            (Column::CmdSpeed, speeds, -limits.reverse_speed_max_mps, limits.speed_max_mps),
            (Column::CmdSteer, angles, -limits.steering_max_rad, limits.steering_max_rad),
        ];
        for (column, values, low, high) in allowed {
            let fits = |value: &f64| (low - ROUNDING..=high + ROUNDING).contains(value);
            if let Some(row) = values.iter().position(|value| !fits(value)) {
                let (name, time_s, found) = (column.name(), run.time_s()[row], values[row]);
                return Err(told(format!("{name} at {time_s} s: expected {low} to {high}, found {found}")));
            }
        }
        let command = |(&speed, &angle): (&f64, &f64)| Command {
            speed_mps: speed as f32,
            steering_rad: angle.clamp(-limits.steering_max_rad, limits.steering_max_rad) as f32,
        };
        let first_s = run.time_s()[0];
        Ok(Self {
            time_s: run.time_s().iter().map(|time_s| time_s - first_s).collect(),
            commands: speeds.iter().zip(angles).map(command).collect(),
        })
    }

    /// The episode as a script needs it: its own rate, and nobody who looks ahead.
    pub fn prepare(episode: &mut EpisodeConfig) {
        episode.control_hz = COMMAND_HZ;
        episode.range_sensor = None;
    }

    /// Length [s].
    fn duration_s(&self) -> f64 {
        self.time_s.last().copied().unwrap_or(0.0) + 1.0 / COMMAND_HZ
    }

    /// Whether every command was carried out.
    pub fn is_over(&self, episode: &Episode) -> bool {
        episode.time_s() + 1e-6 >= self.duration_s()
    }

    /// Carries out what stands there for now.
    pub fn cycle(&self, episode: &mut Episode) -> Result<Cycle, EpisodeError> {
        let now_s = episode.time_s() + 1e-6;
        let row = self.time_s.partition_point(|time_s| *time_s <= now_s).saturating_sub(1);
        let decision = Decision::Drive(self.commands[row]);
        episode.apply(&decision)?;
        Ok(Cycle { decision, map_ms: None, control_ms: 0.0 })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

    use super::*;
    use scenarios::{RockFieldConfig, Task};

    fn vehicle() -> bicycle::Vehicle {
        formats::read_vehicle("rc_car").unwrap()
    }

    fn read(text: &str) -> Result<Script, UsageError> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("c.csv");
        std::fs::write(&file, text).unwrap();
        Script::read(&file, &vehicle().limits)
    }

    #[test]
    fn what_cannot_be_driven_is_refused() {
        let refused = |text: &str| read(text).unwrap_err().to_string();
        assert!(refused("t,cmd_speed\n0,1\n").contains("cmd_steer"));
        assert!(refused("t,cmd_speed,cmd_steer\n0,1,0\n0.02,99,0\n").contains("cmd_speed at 0.02 s"));
        assert!(refused("t,cmd_speed,cmd_steer\n0,1,0\n0.02,1,\n").contains("cmd_steer at 0.02 s"));
        assert!(refused("run,t,cmd_speed,cmd_steer\n1,0,1,0\n2,0,1,0\n").contains("expected one run"));
    }

    /// Rows at 5.00, 5.04 and 5.06 s: the first command holds for two cycles, the last for one.
    #[test]
    fn commands_hold_until_the_next() {
        let script = read("t,cmd_speed,cmd_steer\n5,1,0.1\n5.04,0.5,0\n5.06,0,-0.1\n").unwrap();
        let task = Task::rock_field(&RockFieldConfig::default(), 1).unwrap();
        let mut config = EpisodeConfig::for_vehicle(&vehicle());
        Script::prepare(&mut config);
        let mut episode = Episode::new(task, &vehicle(), config, 1).unwrap();
        let mut speeds = Vec::new();
        while !script.is_over(&episode) {
            script.cycle(&mut episode).unwrap();
            speeds.push(episode.trace().last().unwrap().command.speed_mps);
        }
        assert_eq!(speeds, [1.0, 1.0, 0.5, 0.0]);
    }
}
