//! The lines that go to a simulator and come from it: `docs/simulator_protocol.md`.

use serde::{Deserialize, Serialize};
use sim_to_real::{Machine, Motion, SimulatorDescription, SimulatorRun};

/// Version of the protocol.
pub(super) const VERSION: u32 = 1;
/// So much of a line that is no answer is shown [characters].
const SHOWN: usize = 80;

/// What a simulator says.
#[derive(Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub(super) enum Reply {
    Hello {
        protocol: u32,
        #[serde(flatten)]
        description: SimulatorDescription,
    },
    Motion {
        id: u64,
        #[serde(flatten)]
        motion: Motion,
    },
    Error {
        message: String,
    },
}

#[derive(Serialize)]
struct Hello<'a> {
    r#type: &'static str,
    protocol: u32,
    vehicle: Vehicle<'a>,
}

#[derive(Serialize)]
struct Vehicle<'a> {
    name: &'a str,
    wheelbase_m: f64,
    steering_max_rad: f64,
    speed_max_mps: f64,
}

/// The first line.
pub(super) fn hello(machine: &Machine) -> Result<String, serde_json::Error> {
    let &Machine { wheelbase_m, steering_max_rad, speed_max_mps, .. } = machine;
    let vehicle = Vehicle { name: &machine.name, wheelbase_m, steering_max_rad, speed_max_mps };
    serde_json::to_string(&Hello { r#type: "hello", protocol: VERSION, vehicle })
}

/// A run without type and number: the same for the same run.
pub(super) fn run_body(run: &SimulatorRun) -> Result<String, serde_json::Error> {
    serde_json::to_string(run)
}

/// The line that asks for a run.
pub(super) fn run(id: u64, body: &str) -> String {
    format!("{{\"type\":\"run\",\"id\":{id},{}", &body[1..])
}

/// What a line says. Errors: what was expected and what was found.
pub(super) fn reply(line: &str) -> Result<Reply, String> {
    serde_json::from_str(line).map_err(|error| {
        let not_a_number = ["NaN", "Infinity"].into_iter().find(|word| line.contains(word));
        match not_a_number {
            Some(word) => format!("expected finite numbers, found {word}"),
            None if line.trim_start().starts_with('{') => {
                format!("expected an answer of the protocol, found one where {error}")
            }
            None => format!("expected a line of JSON, found '{}'", shown(line)),
        }
    })
}

fn shown(line: &str) -> String {
    let start: String = line.trim().chars().take(SHOWN).collect();
    if start.len() < line.trim().len() { format!("{start}...") } else { start }
}
