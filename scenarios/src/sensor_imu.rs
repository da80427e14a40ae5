//! A simulated inertial measurement unit at 200 Hz. Beside noise and bias it shakes with speed and with the texture
//! of the ground below the plant's resolution, as the real ones do: what the ground is like can be heard.

use std::f64::consts::TAU;

use bicycle::ImuSample;
use rand_xoshiro::Xoshiro256PlusPlus;
use terrain::TerrainClass;

use crate::random::{normal, stream};
use crate::{Motion, World};

/// Time between samples [ns]: 200 Hz.
pub const IMU_PERIOD_NS: u64 = 5_000_000;

/// What the unit adds to the truth.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImuConfig {
    /// Standard deviation of the specific force, each axis [m/s2].
    pub acceleration_noise_mps2: f64,
    /// Standard deviation of the angular rate, each axis [rad/s].
    pub rate_noise_radps: f64,
    /// Standard deviation of the constant error of a run, each axis [m/s2].
    pub acceleration_bias_mps2: f64,
    /// The same of the angular rate [rad/s].
    pub rate_bias_radps: f64,
    /// Vertical vibration per speed and roughness of the ground [1/(m s)].
    pub vibration_per_m_s: f64,
    /// Frequency of the wheels' hopping, at which the vibration sits [Hz].
    pub hop_hz: f64,
    /// Distance over which the ground's roughness is taken [m].
    pub roughness_spacing_m: f64,
}

impl ImuConfig {
    /// A unit of the cheap kind on a vehicle of this length.
    pub fn for_length(length_m: f64) -> Self {
        Self {
            acceleration_noise_mps2: 0.05,
            rate_noise_radps: 0.005,
            acceleration_bias_mps2: 0.03,
            rate_bias_radps: 0.002,
            vibration_per_m_s: 60.0 / length_m,
            hop_hz: 12.0,
            roughness_spacing_m: 0.08 * length_m,
        }
    }
}

/// The unit of one vehicle in one episode.
#[derive(Clone, Debug)]
pub struct Imu {
    config: ImuConfig,
    rng: Xoshiro256PlusPlus,
    acceleration_bias_mps2: [f64; 3],
    rate_bias_radps: [f64; 3],
    /// One of unit variance for each axis of force.
    hops: [Resonance; 3],
}

impl Imu {
    /// A unit with a bias of its own.
    pub fn new(config: ImuConfig, seed: u64) -> Self {
        let mut rng = stream(seed, &[0x1111]);
        let acceleration_bias_mps2 = [(); 3].map(|()| config.acceleration_bias_mps2 * normal(&mut rng));
        let rate_bias_radps = [(); 3].map(|()| config.rate_bias_radps * normal(&mut rng));
        let hops = [(); 3].map(|()| Resonance::at(config.hop_hz));
        Self { config, rng, acceleration_bias_mps2, rate_bias_radps, hops }
    }

    /// The next sample; to be called every [`IMU_PERIOD_NS`].
    pub fn sample(&mut self, motion: &Motion, world: &World, valid_at_ns: u64) -> ImuSample {
        let vibration_mps2 = self.vibration_mps2(motion, world);
        let config = &self.config;
        let mut acceleration_mps2 = [0.0; 3];
        let mut angular_rate_radps = [0.0; 3];
        for axis in 0..3 {
            // Wheels hop up and down; half of it reaches the horizontal axes.
            let share = if axis == 2 { 1.0 } else { 0.5 };
            let shake_mps2 = share * vibration_mps2 * self.hops[axis].next(normal(&mut self.rng));
            let force = motion.specific_force_mps2[axis]
                + self.acceleration_bias_mps2[axis]
                + shake_mps2
                + config.acceleration_noise_mps2 * normal(&mut self.rng);
            let rate = motion.angular_rate_radps[axis]
                + self.rate_bias_radps[axis]
                + config.rate_noise_radps * normal(&mut self.rng);
            acceleration_mps2[axis] = force as f32;
            angular_rate_radps[axis] = rate as f32;
        }
        ImuSample { valid_at_ns, acceleration_mps2, angular_rate_radps }
    }

    /// Standard deviation of the vertical vibration [m/s2].
    fn vibration_mps2(&self, motion: &Motion, world: &World) -> f64 {
        let (x_m, y_m) = (motion.pose.x_m, motion.pose.y_m);
        let spacing_m = self.config.roughness_spacing_m;
        // Texture that the map's cells do not resolve, as a share of the spacing.
        let texture_m = spacing_m
            * match world.patch(x_m, y_m).class {
                TerrainClass::Open | TerrainClass::Obstacle => 0.01,
                TerrainClass::Loose | TerrainClass::Vegetation => 0.04,
            };
        let roughness_m = world.roughness_m(x_m, y_m, spacing_m) + texture_m;
        self.config.vibration_per_m_s * motion.velocity_mps[0].hypot(motion.velocity_mps[1]) * roughness_m
    }
}

/// Band-limited noise of unit variance: an autoregression with a pair of poles at a frequency.
#[derive(Clone, Copy, Debug)]
struct Resonance {
    feedback: [f64; 2],
    gain: f64,
    last: [f64; 2],
}

impl Resonance {
    fn at(frequency_hz: f64) -> Self {
        const DECAY: f64 = 0.9;
        let turn = TAU * frequency_hz * IMU_PERIOD_NS as f64 * 1e-9;
        let square = DECAY * DECAY;
        let feedback = [2.0 * DECAY * turn.cos(), -square];
        // Stationary variance of an AR(2) driven by unit noise (Yule and Walker).
        let variance =
            (1.0 + square) / ((1.0 - square) * ((1.0 + square).powi(2) - feedback[0] * feedback[0]));
        Self { feedback, gain: variance.sqrt().recip(), last: [0.0; 2] }
    }

    fn next(&mut self, noise: f64) -> f64 {
        let value = self.feedback[0] * self.last[0] + self.feedback[1] * self.last[1] + self.gain * noise;
        self.last = [value, self.last[0]];
        value
    }
}
