//! PIETRA's equations 15 to 17: what may happen at a pose, as weighted outcomes.
//!
//! The yaw rate is the speed times the curvature, so what a slope takes of the speed it takes of the turn. What it does
//! to the curvature has no sign that the heights would tell: a bump under a wheel pushes the nose out of the turn as
//! often as into it, and load that leaves the steered axle uphill returns downhill. Equation 15 for angular traction,
//! `1 - s / s_max`, is the first half of that alone; here both halves are outcomes of equal probability,
//! `linear (1 - s / s_max)` and `linear (1 + s / s_max)`, which ends at 1.

use traversability::{Bins, N_BINS};

use crate::PriorConfig;
use crate::ground::Contact;
use crate::lengths::Lengths;
use crate::pose::PoseGround;
use crate::triangle::Triangles;

/// The part of equation 18 that is not spread out: outcomes of traction and of attitude. Probabilities include
/// the weights of equation 18; per parameter they sum to one less the uniform share of traction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outcomes {
    /// Linear traction of each wheel on dirt.
    pub linear_dirt: [[f32; 4]; 1],
    /// Angular traction of each wheel on dirt where the slope works against the turn, and where it works for it.
    pub angular_dirt: [[f32; 4]; 2],
    /// Of a wheel's dirt; its outcomes share it evenly.
    pub dirt_probability: [f32; 4],
    /// Traction, linear and angular, of each wheel on vegetation.
    pub vegetation: [f32; 4],
    pub vegetation_probability: [f32; 4],
    /// Traction, linear and angular, on unknown ground.
    pub unknown: f32,
    pub unknown_probability: f32,
    /// Angles of the wheel pairs, as sharp as the heights are known, and spread.
    pub angles: [Triangles; 2],
    /// Probability of the angles of unknown ground: roll, pitch.
    pub unknown_angle_probability: [f32; 2],
}

impl Outcomes {
    const NONE: Self = Self {
        linear_dirt: [[0.0; 4]; 1],
        angular_dirt: [[0.0; 4]; 2],
        dirt_probability: [0.0; 4],
        vegetation: [0.0; 4],
        vegetation_probability: [0.0; 4],
        unknown: 0.0,
        unknown_probability: 0.0,
        angles: [Triangles::NONE; 2],
        unknown_angle_probability: [0.0; 2],
    };
}

/// The configuration in the form that the equations want.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Equations {
    pub uniform_weight: f32,
    /// The angles of unknown ground.
    pub unknown_attitude: Triangles,
    per_slope: [f32; 2],
    per_vegetation_m: f32,
    spread_bins: f32,
    unknown_share_max: f32,
    unknown_traction: f32,
    per_belly_depth_m: f32,
    /// Over the distance of each wheel pair [1/m].
    per_distance: [f32; 4],
}

/// Wheel pairs of equation 17, wheels counted from 0 as front left, rear left, rear right, front right: two for
/// roll, the axles, and two for pitch, the sides.
const PAIRS: [[usize; 2]; 4] = [[0, 3], [1, 2], [0, 1], [3, 2]];

impl Equations {
    pub fn new(config: &PriorConfig, lengths: &Lengths) -> Self {
        let slopes_rad = [config.linear_slope_max_rad, config.angular_slope_max_rad];
        let (track_m, wheelbase_m) = (lengths.wheels.track_m, lengths.wheels.wheelbase_m);
        let distances_m = [track_m, track_m, wheelbase_m, wheelbase_m];
        let belly_depth_m = (config.high_centred_clearances - 1.0) * f64::from(lengths.ground_clearance_m);
        // A vehicle without clearance loses everything at the first touch.
        let per_belly_depth_m = (1.0 / belly_depth_m.max(1e-6)) as f32;
        let unknown_bins = config.unknown_attitude_rad as f32 / Bins::ATTITUDE_WIDTH_RAD;
        Self {
            uniform_weight: config.uniform_weight as f32,
            unknown_attitude: Triangles::new([0.0; 4], [unknown_bins; 4], [0.25; 4]),
            per_slope: slopes_rad.map(|slope_rad| (1.0 / libm::tan(slope_rad)) as f32),
            per_vegetation_m: (1.0 / config.vegetation_height_max_m) as f32,
            spread_bins: config.attitude_spread_rad as f32 / Bins::ATTITUDE_WIDTH_RAD,
            unknown_share_max: config.unknown_share_max as f32,
            unknown_traction: config.unknown_traction as f32,
            per_belly_depth_m,
            per_distance: distances_m.map(|distance_m| (1.0 / distance_m) as f32),
        }
    }

    /// Whether too little of a footprint is known.
    #[inline(always)]
    pub fn is_unknown(&self, pose: &PoseGround) -> bool {
        pose.unknown_share > self.unknown_share_max
    }

    /// What may happen at a pose. A footprint of which too little is known counts as unknown under every wheel.
    #[inline(always)]
    pub fn outcomes(&self, pose: &PoseGround) -> Outcomes {
        let all_unknown = self.is_unknown(pose);
        let freedom = (1.0 - pose.belly_depth_m * self.per_belly_depth_m).max(0.0);
        let per_wheel = 0.25 * (1.0 - self.uniform_weight);
        let mut outcomes = Outcomes { unknown: self.unknown_traction * freedom, ..Outcomes::NONE };
        let mut known = [0.0; 4];
        for wheel in 0..4 {
            let contact = &pose.wheels[wheel].values;
            known[wheel] = if all_unknown { 0.0 } else { 1.0 - contact[Contact::UNKNOWN] };
            let [linear, angular] = self.per_slope.map(|per_slope| pose.slopes[wheel] * per_slope);
            let speed = (1.0 - linear).max(0.0) * freedom;
            outcomes.linear_dirt[0][wheel] = speed;
            outcomes.angular_dirt[0][wheel] = speed * (1.0 - angular).max(0.0);
            outcomes.angular_dirt[1][wheel] = (speed * (1.0 + angular)).min(1.0);
            let on_vegetation = 1.0 - contact[Contact::VEGETATION] * self.per_vegetation_m;
            outcomes.vegetation[wheel] = on_vegetation.clamp(0.0, 1.0) * freedom;
            outcomes.dirt_probability[wheel] = per_wheel * known[wheel] * (1.0 - pose.vegetation_share);
            outcomes.vegetation_probability[wheel] = per_wheel * known[wheel] * pose.vegetation_share;
            outcomes.unknown_probability += per_wheel * (1.0 - known[wheel]);
        }
        self.lean(&pose.wheels, known, &mut outcomes);
        outcomes
    }

    /// Equation 17 with the spread of equation 18 as a triangle around the estimate, which the variance of the
    /// heights widens; a pair over unknown ground has the angles of unknown ground.
    #[inline(always)]
    fn lean(&self, wheels: &[Contact; 4], known: [f32; 4], outcomes: &mut Outcomes) {
        let (mut tangent, mut deviation, mut share) = ([0.0; 4], [0.0; 4], [0.0; 4]);
        for (pair, [i, j]) in PAIRS.into_iter().enumerate() {
            let (a, b) = (&wheels[i].values, &wheels[j].values);
            tangent[pair] = (a[Contact::HEIGHT] - b[Contact::HEIGHT]).abs() * self.per_distance[pair];
            deviation[pair] = (a[Contact::VARIANCE] + b[Contact::VARIANCE]).sqrt() * self.per_distance[pair];
            share[pair] = 0.5 * known[i] * known[j];
        }
        let mut angle = arc_tangent(tangent);
        let (mut noise, mut spread) = ([0.0; 4], [0.0; 4]);
        let (mut sharp_share, mut spread_share) = ([0.0; 4], [0.0; 4]);
        for pair in 0..4 {
            angle[pair] *= BINS_PER_RAD;
            // d atan(t) = cos^2 dt, and a triangle of half-width w has the variance w^2 / 6.
            let per_tangent = SQRT_6 * BINS_PER_RAD / (1.0 + tangent[pair] * tangent[pair]);
            noise[pair] = (deviation[pair] * per_tangent).min(N_BINS as f32);
            spread[pair] = (self.spread_bins * self.spread_bins + noise[pair] * noise[pair]).sqrt();
            sharp_share[pair] = share[pair] * (1.0 - self.uniform_weight);
            spread_share[pair] = share[pair] * self.uniform_weight;
        }
        outcomes.angles =
            [Triangles::new(angle, noise, sharp_share), Triangles::new(angle, spread, spread_share)];
        outcomes.unknown_angle_probability = [1.0 - share[0] - share[1], 1.0 - share[2] - share[3]];
    }
}

const BINS_PER_RAD: f32 = 1.0 / Bins::ATTITUDE_WIDTH_RAD;
const SQRT_6: f32 = 2.449_489_7;

/// Arc tangent of numbers that are not negative, error below 2e-8 before rounding (Abramowitz and Stegun,
/// 4.4.49): unlike the library's it runs in lanes.
#[inline(always)]
fn arc_tangent(tangent: [f32; 4]) -> [f32; 4] {
    const COEFFICIENTS: [f32; 9] = [
        0.002_866_225_7,
        -0.016_165_737,
        0.042_909_614,
        -0.075_289_64,
        0.106_562_64,
        -0.142_089,
        0.199_935_51,
        -0.333_331_45,
        1.0,
    ];
    // atan(t) = pi/2 - atan(1/t).
    let x = tangent.map(|t| if t > 1.0 { 1.0 / t } else { t });
    let mut series = [0.0; 4];
    for coefficient in COEFFICIENTS {
        for lane in 0..4 {
            series[lane] = series[lane] * (x[lane] * x[lane]) + coefficient;
        }
    }
    let mut angle_rad = [0.0; 4];
    for lane in 0..4 {
        let near = x[lane] * series[lane];
        angle_rad[lane] = if tangent[lane] > 1.0 { std::f32::consts::FRAC_PI_2 - near } else { near };
    }
    angle_rad
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_arc_tangent_agrees_with_the_library() {
        for step in 0..20_000 {
            let tangent = step as f32 * 1e-3;
            assert!((arc_tangent([tangent; 4])[3] - tangent.atan()).abs() < 3e-7, "{tangent}");
        }
        assert!((arc_tangent([f32::MAX; 4])[0] - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
    }
}
