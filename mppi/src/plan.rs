//! The nominal control sequence: kept from cycle to cycle, shifted by the time that passed, and turned into what the
//! sampling needs.

use crate::config::{Config, SampleSpace};
use crate::sampling::{Control, SampleStep};

/// Nominal controls and the constants of their perturbation.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub(crate) nominal: Vec<Control>,
    /// What the sampling of the next iteration reads.
    pub(crate) steps: Vec<SampleStep>,
    /// Scratch: the rows of the inverse covariance times the nominal sequence.
    scores: Vec<[f64; 2]>,
    noise: Noise,
}

/// A stationary Gauss-Markov sequence, per channel.
#[derive(Clone, Copy, Debug)]
struct Noise {
    /// Standard deviation in the space that is sampled, per step.
    std: [f64; 2],
    /// Correlation of neighbours.
    correlation: f64,
    space: SampleSpace,
}

impl Noise {
    fn new(config: &Config) -> Self {
        let sampling = &config.sampling;
        let per_step = match sampling.space {
            SampleSpace::Controls => 1.0,
            SampleSpace::Rates => config.step_s,
        };
        let correlation = if sampling.correlation_s > 0.0 {
            libm::exp(-config.step_s / sampling.correlation_s)
        } else {
            0.0
        };
        Self {
            std: [sampling.speed_std, sampling.steering_std].map(|std| std * per_step),
            correlation,
            space: sampling.space,
        }
    }
}

impl Plan {
    pub(crate) fn new(config: &Config) -> Self {
        Self {
            nominal: vec![[0.0; 2]; config.n_steps],
            steps: vec![SampleStep::default(); config.n_steps],
            scores: vec![[0.0; 2]; config.n_steps + 1],
            noise: Noise::new(config),
        }
    }

    /// Perturbs as another configuration says from now on.
    pub(crate) fn set_noise(&mut self, config: &Config) {
        self.noise = Noise::new(config);
    }

    /// The same control for the whole horizon.
    pub(crate) fn hold(&mut self, control: Control) {
        self.nominal.fill(control);
    }

    /// Lets `steps` steps, whole or not, pass; the last control is held.
    pub(crate) fn shift(&mut self, steps: f64) {
        let last = self.nominal.len() - 1;
        let steps = steps.clamp(0.0, last as f64);
        let (whole, share) = (steps.floor() as usize, steps.fract() as f32);
        for t in 0..=last {
            let (from, to) = (self.nominal[(t + whole).min(last)], self.nominal[(t + whole + 1).min(last)]);
            self.nominal[t] = [0, 1].map(|c| from[c] + share * (to[c] - from[c]));
        }
    }

    /// Correlation of neighbouring noise.
    pub(crate) fn correlation(&self) -> f32 {
        self.noise.correlation as f32
    }

    /// 1 when the noise is on rates, 0 when it is on controls.
    pub(crate) fn kept_control(&self) -> f32 {
        match self.noise.space {
            SampleSpace::Controls => 0.0,
            SampleSpace::Rates => 1.0,
        }
    }

    /// Fills in what the sampling reads, for controls that start at `start` and a control cost of `weight_s` times
    /// u' S^-1 e (Williams et al. 2017), S being the covariance of the noise sequence.
    pub(crate) fn prepare(&mut self, start: Control, weight_s: f64) {
        self.score(start);
        let n = self.nominal.len();
        let fresh = (1.0 - self.noise.correlation * self.noise.correlation).sqrt();
        for t in 0..n {
            let (nominal, before) = (self.nominal[t], if t == 0 { start } else { self.nominal[t - 1] });
            let share = if t == 0 { 1.0 } else { fresh };
            let (base, gradient) = match self.noise.space {
                SampleSpace::Controls => (nominal, self.scores[t]),
                // The change of step t is control t less control t - 1: its score acts on both.
                SampleSpace::Rates => (
                    [0, 1].map(|c| nominal[c] - before[c]),
                    [0, 1].map(|c| self.scores[t][c] - self.scores[t + 1][c]),
                ),
            };
            self.steps[t] = SampleStep {
                nominal,
                base,
                innovation: self.noise.std.map(|std| (std * share) as f32),
                gradient: gradient.map(|score| (weight_s * score) as f32),
            };
        }
    }

    /// S^-1 times the nominal sequence in the space that is sampled; S^-1 of a Gauss-Markov sequence is tridiagonal.
    fn score(&mut self, start: Control) {
        let n = self.nominal.len();
        let Noise { std, correlation, space } = self.noise;
        let sampled = |t: usize, c: usize| {
            let before = if t == 0 { start[c] } else { self.nominal[t - 1][c] };
            match space {
                SampleSpace::Controls => f64::from(self.nominal[t][c]),
                SampleSpace::Rates => f64::from(self.nominal[t][c] - before),
            }
        };
        let inverse = std.map(|std| 1.0 / (std * std * (1.0 - correlation * correlation)));
        for t in 0..n {
            self.scores[t] = [0, 1].map(|c| {
                let rim = t == 0 || t + 1 == n;
                let middle = if rim { 1.0 } else { 1.0 + correlation * correlation };
                let before = if t == 0 { 0.0 } else { sampled(t - 1, c) };
                let after = if t + 1 == n { 0.0 } else { sampled(t + 1, c) };
                let sum = middle * sampled(t, c) - correlation * (before + after);
                sum * inverse[c]
            });
        }
        self.scores[n] = [0.0; 2];
    }
}
