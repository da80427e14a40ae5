//! How a command becomes motion: a delay and a first-order lag, found in the log itself.

use serde::{Deserialize, Serialize};

use super::signals::Signals;

/// What stands between a command and its effect.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Response {
    /// Until anything happens [s].
    pub delay_s: f64,
    /// Time constant of the first-order lag after that [s].
    pub time_constant_s: f64,
}

/// Responses of both commands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Responses {
    /// Of the speed.
    pub speed: Response,
    /// Of the steering, or of the yaw rate where that is what is commanded.
    pub turn: Response,
}

/// Delays and time constants that are tried [s].
const DELAYS_S: [f64; 13] = [0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.5, 0.6, 0.8, 1.0];
const TIME_CONSTANTS_S: [f64; 14] = [0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.5, 2.0];
/// The worst response tried must leave this share of the motion's energy more unexplained than the best, or the log
/// does not tell: a command that never changes arrives as itself, whatever the response.
const TELLING_SHARE: f64 = 0.005;

impl Responses {
    /// The responses that explain the motion of all runs best, the gain of every run free: a gain below one is what
    /// the ground takes.
    pub(super) fn estimate(runs: &[Signals]) -> Self {
        let speed = best(|response| {
            let of_run = |run: &Signals| Energy::of(&run.speed_mps, &run.arrived_speed(response));
            runs.iter().map(of_run).fold(Energy::default(), Energy::plus)
        });
        let speeds_mps: Vec<Vec<f64>> = runs.iter().map(|run| run.arrived_speed(&speed)).collect();
        let turn = best(|response| {
            let of_run = |(run, speed_mps): (&Signals, &Vec<f64>)| {
                Energy::of(&run.yaw_rate_radps, &run.arrived_yaw_rate(response, speed_mps))
            };
            runs.iter().zip(&speeds_mps).map(of_run).fold(Energy::default(), Energy::plus)
        });
        Self { speed, turn }
    }
}

impl Response {
    /// A command as far as it has arrived, exactly for a command that is held from row to row. Before the first row
    /// it is taken to have been held too; `start` had arrived then. A command that is not finite changes nothing.
    pub(super) fn follow(&self, time_s: &[f64], commanded: &[f64], start: f64) -> Vec<f64> {
        let mut arrived = Vec::with_capacity(time_s.len());
        let mut value = start;
        // The command whose effect begins next.
        let mut next = 0;
        let mut held = commanded.first().copied().filter(|command| command.is_finite()).unwrap_or(start);
        let Some(mut then_s) = time_s.first().copied() else { return arrived };
        for &now_s in time_s {
            while next < commanded.len() && time_s[next] + self.delay_s <= now_s {
                let begins_s = (time_s[next] + self.delay_s).max(then_s);
                value = self.after(begins_s - then_s, value, held);
                then_s = begins_s;
                held = if commanded[next].is_finite() { commanded[next] } else { held };
                next += 1;
            }
            value = self.after(now_s - then_s, value, held);
            then_s = now_s;
            arrived.push(value);
        }
        arrived
    }

    /// What has arrived of a held command after a while.
    fn after(&self, duration_s: f64, value: f64, held: f64) -> f64 {
        if self.time_constant_s > 0.0 {
            held + (value - held) * (-duration_s / self.time_constant_s).exp()
        } else {
            held
        }
    }
}

/// Sums of squares of a motion.
#[derive(Clone, Copy, Debug, Default)]
struct Energy {
    total: f64,
    /// What is left once the expected motion, times the gain that fits best, is taken away.
    unexplained: f64,
}

impl Energy {
    fn of(measured: &[f64], expected: &[f64]) -> Self {
        let (mut yy, mut yf, mut ff) = (0.0, 0.0, 0.0);
        for (y, f) in measured.iter().zip(expected).filter(|(y, f)| y.is_finite() && f.is_finite()) {
            yy += y * y;
            yf += y * f;
            ff += f * f;
        }
        let explained = if ff > 0.0 { yf.max(0.0).powi(2) / ff } else { 0.0 };
        Self { total: yy, unexplained: yy - explained }
    }

    fn plus(self, other: Self) -> Self {
        Self { total: self.total + other.total, unexplained: self.unexplained + other.unexplained }
    }
}

/// The response that leaves least unexplained; none when the motion does not tell them apart.
fn best(energy: impl Fn(&Response) -> Energy) -> Response {
    let candidates = DELAYS_S.into_iter().flat_map(|delay_s| {
        TIME_CONSTANTS_S.into_iter().map(move |time_constant_s| Response { delay_s, time_constant_s })
    });
    let judged: Vec<(Response, Energy)> = candidates.map(|response| (response, energy(&response))).collect();
    let of = |(_, energy): &&(Response, Energy)| energy.unexplained;
    let least = judged.iter().min_by(|a, b| of(a).total_cmp(&of(b)));
    let most = judged.iter().map(|judged| judged.1.unexplained).fold(0.0, f64::max);
    match least {
        Some((response, energy)) if most - energy.unexplained > TELLING_SHARE * energy.total => *response,
        _ => Response::default(),
    }
}
