//! How a command becomes motion: a delay, a limited rate and a first-order lag, found in the log itself.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::signals::Signals;

/// What stands between a command and its effect, in this order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Response {
    /// Until anything happens [s].
    pub delay_s: f64,
    /// Fastest change of what is aimed at, per second in units of the command; `None` = any.
    pub rate_max_per_s: Option<f64>,
    /// Time constant of the first-order lag after that [s].
    pub time_constant_s: f64,
}

/// Responses of both commands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Responses {
    /// Of the speed [m/s].
    pub speed: Response,
    /// Of the steering, as curvature [1/m], or of the yaw rate where that is what is commanded [rad/s].
    pub turn: Response,
}

/// Delays that are tried [s].
const DELAYS_S: [f64; 12] = [0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0];
/// Time constants that are tried [s].
const TIME_CONSTANTS_S: [f64; 12] = [0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.7, 1.0, 1.5];
/// Times from zero to the largest command that are tried, beside any rate [s].
const RAMPS_S: [f64; 10] = [0.25, 0.5, 0.75, 1.0, 1.2, 1.4, 1.6, 2.0, 3.0, 4.0];
/// Length of the stretches that each have a gain and a scatter of their own [s].
const STRETCH_S: f64 = 5.0;
/// The best response must be likelier than the worst by this much, or the log does not tell: a command that never
/// changes arrives as itself, whatever the response [nats].
const TELLING_NATS: f64 = 20.0;
/// Largest gain: the ground takes of a motion and does not add to it, but for a hundredth of error or so in whoever
/// measures. A larger one would let any slow response explain a start that is cut short.
const GAIN_MAX: f64 = 1.05;
/// Added to the mean square of what a response leaves unexplained, so that no log is explained perfectly: 1 mm/s or
/// 1 mrad/s.
const FLOOR: f64 = 1e-6;

impl Responses {
    /// The responses that explain the motion of all runs best. Of every stretch of a few seconds the gain is free,
    /// since what the ground takes is a gain below one, and so is the scatter: where the ground changed or the vehicle
    /// got stuck, the motion says little of its servos.
    pub(super) fn estimate(runs: &[Signals]) -> Self {
        let commanded_mps = runs.iter().flat_map(|run| &run.commanded_mps);
        let fastest_mps =
            commanded_mps.filter(|speed| speed.is_finite()).fold(0.0, |a: f64, b| a.max(b.abs()));
        // Machines ramp their speed; the steering that they cannot follow at once is a small part of any drive.
        let rates = RAMPS_S.map(|ramp_s| Some(fastest_mps / ramp_s).filter(|rate| *rate > 0.0));
        let speed = best(&[&[None], &rates[..]].concat(), |response| {
            let of_run =
                |run: &Signals| misfit_nats(&run.time_s, &run.speed_mps, &run.arrived_speed(response));
            runs.iter().map(of_run).sum()
        });
        let speeds_mps: Vec<Vec<f64>> = runs.iter().map(|run| run.arrived_speed(&speed)).collect();
        let turn = best(&[None], |response| {
            let of_run = |(run, speed_mps): (&Signals, &Vec<f64>)| {
                misfit_nats(&run.time_s, &run.yaw_rate_radps, &run.arrived_yaw_rate(response, speed_mps))
            };
            runs.iter().zip(&speeds_mps).map(of_run).sum()
        });
        Self { speed, turn }
    }
}

impl Response {
    /// A command as far as it has arrived, exactly for a command that is held from row to row. Before the first row
    /// `start` was commanded and had arrived. A command that is not finite changes nothing.
    pub(super) fn follow(&self, time_s: &[f64], commanded: &[f64], start: f64) -> Vec<f64> {
        let mut arrived = Vec::with_capacity(time_s.len());
        // The command whose effect begins next.
        let mut next = 0;
        let mut held = start;
        let mut state = Arrival { aim: start, value: start };
        let Some(mut then_s) = time_s.first().copied() else { return arrived };
        for &now_s in time_s {
            while next < commanded.len() && time_s[next] + self.delay_s <= now_s {
                let begins_s = (time_s[next] + self.delay_s).max(then_s);
                self.advance(&mut state, held, begins_s - then_s);
                then_s = begins_s;
                held = if commanded[next].is_finite() { commanded[next] } else { held };
                next += 1;
            }
            self.advance(&mut state, held, now_s - then_s);
            then_s = now_s;
            arrived.push(state.value);
        }
        arrived
    }

    /// A while of a held command: the aim runs to it and stays there.
    fn advance(&self, state: &mut Arrival, held: f64, duration_s: f64) {
        let rate = self.rate_max_per_s.unwrap_or(f64::INFINITY).copysign(held - state.aim);
        let ramp_s = ((held - state.aim) / rate).clamp(0.0, duration_s);
        if ramp_s > 0.0 {
            self.lag(state, rate, ramp_s);
        }
        if ramp_s < duration_s || self.rate_max_per_s.is_none() {
            state.aim = held;
            self.lag(state, 0.0, duration_s - ramp_s);
        }
    }

    /// The lag behind an aim that moves at a rate.
    fn lag(&self, state: &mut Arrival, rate: f64, duration_s: f64) {
        // In the long run the value trails the aim by the way of one time constant.
        let trailing = rate * self.time_constant_s;
        let offset = state.value - (state.aim - trailing);
        state.aim += rate * duration_s;
        let left = if self.time_constant_s > 0.0 { (-duration_s / self.time_constant_s).exp() } else { 0.0 };
        state.value = state.aim - trailing + offset * left;
    }
}

/// A command on its way.
struct Arrival {
    /// After the limited rate.
    aim: f64,
    /// After the lag.
    value: f64,
}

/// Sum of [`stretch_nats`] over the stretches of a run.
fn misfit_nats(time_s: &[f64], measured: &[f64], expected: &[f64]) -> f64 {
    let Some(first_s) = time_s.first() else { return 0.0 };
    let stretch = |row: usize| ((time_s[row] - first_s) / STRETCH_S).floor();
    let rows: Vec<usize> = (0..time_s.len()).collect();
    let stretches = rows.chunk_by(|&a, &b| stretch(a) == stretch(b));
    stretches.map(|rows| stretch_nats(rows.iter().map(|&row| (measured[row], expected[row])))).sum()
}

/// Negative logarithm of the likelihood of a motion, but for constants: it scatters normally around the expected one
/// times a gain from 0 to [`GAIN_MAX`], gain and scatter being those that fit best. Pairs of measured and expected motion.
fn stretch_nats(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (mut n, mut yy, mut yf, mut ff) = (0.0, 0.0, 0.0, 0.0);
    for (y, f) in pairs.filter(|(y, f)| y.is_finite() && f.is_finite()) {
        n += 1.0;
        yy += y * y;
        yf += y * f;
        ff += f * f;
    }
    if n == 0.0 {
        return 0.0;
    }
    let gain = if ff > 0.0 { (yf / ff).clamp(0.0, GAIN_MAX) } else { 0.0 };
    // Rounding may leave a perfect fit below zero.
    let left = (yy - 2.0 * gain * yf + gain * gain * ff).max(0.0);
    0.5 * n * (left / n + FLOOR).ln()
}

/// The response that fits best; none when the motion does not tell them apart.
fn best(rates: &[Option<f64>], misfit_nats: impl Fn(&Response) -> f64 + Sync + Send) -> Response {
    let mut candidates = Vec::with_capacity(rates.len() * DELAYS_S.len() * TIME_CONSTANTS_S.len());
    for &rate_max_per_s in rates {
        for delay_s in DELAYS_S {
            candidates.extend(TIME_CONSTANTS_S.map(|time_constant_s| Response {
                delay_s,
                rate_max_per_s,
                time_constant_s,
            }));
        }
    }
    let nats: Vec<f64> = candidates.par_iter().map(misfit_nats).collect();
    let most = nats.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let least = candidates.iter().zip(&nats).min_by(|a, b| a.1.total_cmp(b.1));
    match least {
        Some((response, least)) if most - least > TELLING_NATS => *response,
        _ => Response::default(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps(n: usize, dt_s: f64) -> Vec<f64> {
        (0..n).map(|row| row as f64 * dt_s).collect()
    }

    #[test]
    fn a_step_arrives_after_the_delay_as_an_exponential() {
        let time_s = steps(60, 0.1);
        let commanded: Vec<f64> = time_s.iter().map(|t| if *t < 0.95 { 0.0 } else { 2.0 }).collect();
        let response = Response { delay_s: 0.25, rate_max_per_s: None, time_constant_s: 0.4 };
        let arrived = response.follow(&time_s, &commanded, 0.0);
        // The command of the row at 1.0 s begins to act at 1.25 s.
        for (t, value) in time_s.iter().zip(&arrived) {
            let expected = if *t < 1.25 { 0.0 } else { 2.0 * (1.0 - (-(t - 1.25) / 0.4_f64).exp()) };
            assert!((value - expected).abs() < 1e-9, "{t}: {value} {expected}");
        }
    }

    #[test]
    fn a_limited_rate_is_a_ramp_that_the_lag_trails_by_its_time_constant() {
        let time_s = steps(80, 0.05);
        let commanded: Vec<f64> = time_s.iter().map(|_| 2.0).collect();
        let response = Response { delay_s: 0.0, rate_max_per_s: Some(1.0), time_constant_s: 0.1 };
        let arrived = response.follow(&time_s, &commanded, 0.0);
        for (t, value) in time_s.iter().zip(&arrived) {
            // y' = (u - y) / T for u = t gives t - T + T exp(-t / T); then u = 2.
            let ramp = |t: f64| t - 0.1 + 0.1 * (-t / 0.1).exp();
            let expected =
                if *t <= 2.0 { ramp(*t) } else { 2.0 + (ramp(2.0) - 2.0) * (-(t - 2.0) / 0.1).exp() };
            assert!((value - expected).abs() < 1e-9, "{t}: {value} {expected}");
        }
        // Downwards alike, and without a lag the ramp itself.
        let bare = Response { time_constant_s: 0.0, ..response };
        let down = bare.follow(&time_s[..11], &[-2.0; 11], 0.25);
        assert!((down[10] + 0.25).abs() < 1e-9, "{down:?}");
    }

    #[test]
    fn no_response_is_the_command_itself_and_what_is_no_number_changes_nothing() {
        let time_s = steps(5, 0.1);
        let commanded = [1.0, 2.0, f64::NAN, 3.0, f64::NAN];
        assert_eq!(Response::default().follow(&time_s, &commanded, 9.0), [1.0, 2.0, 2.0, 3.0, 3.0]);
        assert!(Response::default().follow(&[], &[], 1.0).is_empty());
    }

    #[test]
    fn the_response_does_not_depend_on_how_often_a_held_command_is_logged() {
        let response = Response { delay_s: 0.13, rate_max_per_s: Some(1.7), time_constant_s: 0.2 };
        let command = |t: f64| (t / 0.5).floor();
        let of = |dt_s: f64, n: usize| {
            let time_s = steps(n, dt_s);
            let commanded: Vec<f64> = time_s.iter().map(|t| command(*t + 1e-9)).collect();
            response.follow(&time_s, &commanded, 0.0)
        };
        let (coarse, fine) = (of(0.5, 8), of(0.05, 71));
        for (row, value) in coarse.iter().enumerate() {
            assert!((value - fine[10 * row]).abs() < 1e-9, "{row}");
        }
    }

    #[test]
    fn misfit_prefers_the_true_gain_and_punishes_the_wrong_sign() {
        let f: Vec<f64> = (0..50).map(|k| (0.3 * f64::from(k)).sin()).collect();
        let of = |gain: f64| stretch_nats(f.iter().map(|v| (gain * v, *v)));
        // Any gain fits perfectly: nothing but the floor is left, 25 ln 1e-6.
        assert!((of(0.4) - 25.0 * FLOOR.ln()).abs() < 1e-6);
        let left: f64 = f.iter().map(|v| v * v).sum::<f64>() / 50.0;
        assert!((of(-1.0) - 25.0 * (left + FLOOR).ln()).abs() < 1e-9);
        // Twice as much motion as commanded is 0.95 of it too much.
        assert!((of(2.0) - 25.0 * (0.95 * 0.95 * left + FLOOR).ln()).abs() < 1e-9);
        assert_eq!(stretch_nats([(f64::NAN, 1.0)].into_iter()), 0.0);
    }

    #[test]
    fn every_stretch_has_its_own_gain() {
        let time_s = steps(100, 0.1);
        let expected = vec![1.0; 100];
        let measured =
            |at_s: f64| time_s.iter().map(|t| if *t < at_s { 0.9 } else { 0.3 }).collect::<Vec<_>>();
        let perfect = 50.0 * FLOOR.ln();
        assert!((misfit_nats(&time_s, &measured(4.95), &expected) - perfect).abs() < 1e-6);
        // A change within a stretch spoils that one alone: 25 rows of each, 0.3 off their mean.
        let spoilt = 25.0 * FLOOR.ln() + 25.0 * (0.09 + FLOOR).ln();
        assert!((misfit_nats(&time_s, &measured(7.45), &expected) - spoilt).abs() < 1e-6);
    }
}
