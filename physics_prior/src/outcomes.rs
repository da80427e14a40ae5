//! PIETRA's equations 15 to 17: what may happen at a pose, as weighted outcomes.
//!
//! The yaw rate is the speed times the curvature, so what a slope takes of the speed it takes of the turn. What it does
//! to the curvature has no sign that the heights would tell: a bump under a wheel pushes the nose out of the turn as
//! often as into it, and load that leaves the steered axle uphill returns downhill. Equation 15 for angular traction,
//! `1 - s / s_max`, is the first half of that alone; here both halves are outcomes of equal probability,
//! `linear (1 - s / s_max)` and `linear (1 + s / s_max)`, which ends at 1.
//!
//! Slopes across the heading, which these equations leave out, are judged by the circle of friction. Of the friction
//! mu, the slope t across takes t; the rest, `sqrt(1 - (t / mu)^2)` of it, drives and steers: s_max of the linear
//! traction shrinks to that share, and so does the angular traction. Friction is equally likely anywhere in a range.
//!
//! Equation 15 makes an outcome of each wheel, so that of a vehicle with one wheel before a face it says three times in
//! four that nothing is there. But a body goes where all its wheels go, and friction is one unknown for all of them: a
//! wheel's slope s and t ask for `d = sqrt(s^2 + t^2)`, and friction below the largest d of the four moves nothing, up
//! or down. Friction above it stands for its mean. Slopes are those of a ball in the wheel's place over about its
//! diameter: one beyond friction is a step of about a radius.
//!
//! That is the law of [`SlopeLaw::Linear`]. By [`SlopeLaw::Friction`] a slope s along the heading asks for the friction a of
//! the axle that slides first ([`bicycle::AxleDemand`]), which the mean slope of the wheels unloads, in the place of s
//! in d. A wheel slips by `3 mu / C (1 - cbrt(1 - d / mu))`, of which a / d lies along the heading, and the way up counts
//! by its level part: `linear = (1 - slip) / sqrt(1 + s^2)`. A plane under all wheels turns nobody: what equation 15
//! takes of a turn, or gives to it, is the slope under a wheel less the mean of all.

use bicycle::lanes::{Lanes, Real};
use traversability::{Bins, N_BINS};

use crate::lengths::Lengths;
use crate::pose::{PoseGround, WheelGround};
use crate::triangle::{Triangle, Triangles};
use crate::{PriorConfig, SlopeLaw};

/// The part of equation 18 that is not spread out: outcomes of traction and of attitude. Probabilities include
/// the weights of equation 18; per parameter they sum to one less the uniform share of traction.
pub(crate) struct Outcomes<L: Lanes> {
    /// Linear traction of each wheel on dirt.
    pub linear_dirt: [[Real<L>; 4]; 1],
    /// Angular traction of each wheel on dirt where the slope works against the turn, and where it works for it.
    pub angular_dirt: [[Real<L>; 4]; 2],
    /// Of a wheel's dirt; its outcomes share it evenly.
    pub dirt_probability: [Real<L>; 4],
    /// Traction, linear and angular, of each wheel on vegetation.
    pub vegetation: [Real<L>; 4],
    pub vegetation_probability: [Real<L>; 4],
    /// Of known ground that a wheel finds no hold on: the vehicle stays or slides down, without any traction.
    pub sliding_probability: Real<L>,
    /// Traction, linear and angular, on unknown ground.
    pub unknown: Real<L>,
    pub unknown_probability: Real<L>,
    /// Angles of the wheel pairs, as sharp as the heights are known, and spread.
    pub angles: [Triangles<L, 2>; 4],
    /// Probability of the angles of unknown ground: roll, pitch.
    pub unknown_angle_probability: [Real<L>; 2],
}

/// The configuration in the form that the equations want.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Equations {
    pub uniform_weight: f32,
    /// Half the width of the triangle of angles of unknown ground, in attitude bins.
    pub unknown_bins: f32,
    law: Law,
    /// Over the slope that takes all of a turn.
    per_turn_slope: f32,
    per_vegetation_m: f32,
    friction: [f32; 2],
    per_friction_range: f32,
    spread_bins: f32,
    unknown_share_max: f32,
    unknown_traction: f32,
    per_belly_depth_m: f32,
    /// Over the distance of each wheel pair [1/m].
    per_distance: [f32; 4],
    /// Angle of the body over that of each wheel pair [bins/rad].
    lean: [f32; 4],
}

/// [`SlopeLaw`] in that form.
#[derive(Clone, Copy, Debug)]
enum Law {
    Linear { per_slope: f32 },
    Friction { per_stiffness: f32, share: f32, unloading: f32 },
}

/// How a vehicle holds on the ground under its wheels.
#[derive(Clone, Copy)]
struct Hold<L: Lanes> {
    /// Of friction that is less than some wheel asks for.
    sliding_probability: Real<L>,
    /// Mean of the other friction.
    friction: Real<L>,
    /// Share of that mean that a slope across the heading leaves for driving and turning.
    share: Real<L>,
}

/// What a wheel on dirt makes of its turning.
struct Rolling<L: Lanes> {
    /// Linear traction.
    speed: Real<L>,
    /// Slope that works for or against a turn [-].
    bump: Real<L>,
}

/// Wheel pairs of equation 17, wheels counted from 0 as front left, rear left, rear right, front right: two for
/// roll, the axles, and two for pitch, the sides.
const PAIRS: [[usize; 2]; 4] = [[0, 3], [1, 2], [0, 1], [3, 2]];

impl Equations {
    pub fn new(config: &PriorConfig, lengths: &Lengths) -> Self {
        let (track_m, wheelbase_m) = (lengths.wheels.track_m, lengths.wheels.wheelbase_m);
        let distances_m = [track_m, track_m, wheelbase_m, wheelbase_m];
        let belly_depth_m = (config.high_centred_clearances - 1.0) * f64::from(lengths.ground_clearance_m);
        // A vehicle without clearance loses everything at the first touch.
        let per_belly_depth_m = (1.0 / belly_depth_m.max(1e-6)) as f32;
        Self {
            uniform_weight: config.uniform_weight as f32,
            unknown_bins: config.unknown_attitude_rad as f32 / Bins::ATTITUDE_WIDTH_RAD,
            law: Law::new(config),
            per_turn_slope: (1.0 / libm::tan(config.angular_slope_max_rad)) as f32,
            per_vegetation_m: (1.0 / config.vegetation_height_max_m) as f32,
            friction: config.friction.map(|friction| friction as f32),
            per_friction_range: (1.0 / (config.friction[1] - config.friction[0])) as f32,
            spread_bins: config.attitude_spread_rad as f32 / Bins::ATTITUDE_WIDTH_RAD,
            unknown_share_max: config.unknown_share_max as f32,
            unknown_traction: config.unknown_traction as f32,
            per_belly_depth_m,
            lean: [0, 0, 1, 1].map(|axis| BINS_PER_RAD * config.lean[axis] as f32),
            per_distance: distances_m.map(|distance_m| (1.0 / distance_m) as f32),
        }
    }

    /// Where too little of a footprint is known.
    #[inline(always)]
    pub fn is_unknown<L: Lanes>(&self, lanes: L, pose: &PoseGround<L>) -> L::Mask {
        lanes.real_single(self.unknown_share_max).less(pose.unknown_share)
    }

    /// What may happen at a pose. A footprint of which too little is known counts as unknown under every wheel.
    #[inline(always)]
    pub fn outcomes<L: Lanes>(&self, lanes: L, pose: &PoseGround<L>) -> Outcomes<L> {
        let (zero, one) = (lanes.real(0.0), lanes.real(1.0));
        let all_unknown = self.is_unknown(lanes, pose);
        let per_belly_depth_m = lanes.real_single(self.per_belly_depth_m);
        let freedom = (one - pose.belly_depth_m * per_belly_depth_m).max(zero);
        let per_wheel = lanes.real_single(0.25 * (1.0 - self.uniform_weight));
        let per_turn_slope = lanes.real_single(self.per_turn_slope);
        let per_vegetation_m = lanes.real_single(self.per_vegetation_m);
        let mut known = [zero; 4];
        for (known, ground) in known.iter_mut().zip(&pose.wheels) {
            *known = zero.or_else(all_unknown, one - ground.unknown);
        }
        let hold = self.hold(lanes, pose, &known);
        let (mut linear_dirt, mut angular_dirt) = ([[zero; 4]; 1], [[zero; 4]; 2]);
        let (mut dirt_probability, mut vegetation_probability) = ([zero; 4], [zero; 4]);
        let mut vegetation = [zero; 4];
        let (mut sliding_probability, mut unknown_probability) = (zero, zero);
        for (wheel, ground) in pose.wheels.iter().enumerate() {
            let Rolling { speed, bump } = self.rolling(lanes, pose, ground, hold);
            let (speed, angular) = (speed * freedom, bump * per_turn_slope);
            linear_dirt[0][wheel] = speed;
            let turn = speed * hold.share;
            angular_dirt[0][wheel] = turn * (one - angular).max(zero);
            angular_dirt[1][wheel] = (turn * (one + angular)).min(one);
            let on_vegetation = one - ground.vegetation_m * per_vegetation_m;
            vegetation[wheel] = on_vegetation.max(zero).min(one) * freedom;
            let stood_on = per_wheel * known[wheel];
            sliding_probability = sliding_probability + stood_on * hold.sliding_probability;
            let probability = stood_on * (one - hold.sliding_probability);
            dirt_probability[wheel] = probability * (one - pose.vegetation_share);
            vegetation_probability[wheel] = probability * pose.vegetation_share;
            unknown_probability = unknown_probability + per_wheel * (one - known[wheel]);
        }
        let (angles, unknown_angle_probability) = self.lean(lanes, &pose.wheels, &known);
        Outcomes {
            linear_dirt,
            angular_dirt,
            dirt_probability,
            vegetation,
            vegetation_probability,
            sliding_probability,
            unknown: lanes.real_single(self.unknown_traction) * freedom,
            unknown_probability,
            angles,
            unknown_angle_probability,
        }
    }

    /// What a wheel on dirt makes of its turning, by the law.
    #[inline(always)]
    fn rolling<L: Lanes>(
        &self,
        lanes: L,
        pose: &PoseGround<L>,
        ground: &WheelGround<L>,
        hold: Hold<L>,
    ) -> Rolling<L> {
        let (zero, one) = (lanes.real(0.0), lanes.real(1.0));
        let (least, slope) = (lanes.real_single(SHARE_LEAST), ground.forward_slope.abs());
        match self.law {
            Law::Linear { per_slope } => {
                let lost = slope * (lanes.real_single(per_slope) / hold.share.max(least));
                Rolling { speed: (one - lost).max(zero), bump: slope }
            }
            Law::Friction { per_stiffness, .. } => {
                let along = self.asked_along(lanes, pose, slope);
                let asked = (along * along + pose.across * pose.across).sqrt();
                let kept = cube_root(lanes, (one - asked / hold.friction).max(zero));
                let slip = lanes.real_single(3.0 * per_stiffness) * hold.friction * (one - kept);
                let slip_along = slip * along / asked.max(least);
                let speed = (one - slip_along).max(zero) / (one + slope * slope).sqrt();
                Rolling { speed, bump: (ground.forward_slope - pose.along).abs() }
            }
        }
    }

    /// Friction that a slope under a wheel along the heading asks for, by the law. What all wheels share moves weight
    /// between the axles.
    #[inline(always)]
    fn asked_along<L: Lanes>(&self, lanes: L, pose: &PoseGround<L>, slope: Real<L>) -> Real<L> {
        match self.law {
            Law::Linear { .. } => slope,
            Law::Friction { share, unloading, .. } => {
                let left = lanes.real(1.0) - lanes.real_single(unloading) * pose.along.abs();
                lanes.real_single(share) * slope / left.max(lanes.real_single(SHARE_LEAST))
            }
        }
    }

    /// Whether the friction holds that the wheels ask for, each as far as its ground is known, and what a slope across
    /// the heading leaves of its circle.
    #[inline(always)]
    fn hold<L: Lanes>(&self, lanes: L, pose: &PoseGround<L>, known: &[Real<L>; 4]) -> Hold<L> {
        let (zero, one) = (lanes.real(0.0), lanes.real(1.0));
        let [least, most] = self.friction;
        let (least, most) = (lanes.real_single(least), lanes.real_single(most));
        let mut along = zero;
        for (ground, known) in pose.wheels.iter().zip(known) {
            along = along.max(*known * self.asked_along(lanes, pose, ground.forward_slope.abs()));
        }
        let asked = (along * along + pose.across * pose.across).sqrt();
        let mean = lanes.real(0.5) * (asked.max(least) + most);
        let taken = pose.across / mean;
        Hold {
            sliding_probability: ((asked - least).max(zero) * lanes.real_single(self.per_friction_range))
                .min(one),
            friction: mean,
            share: (one - taken * taken).max(zero).sqrt(),
        }
    }

    /// Equation 17 with the spread of equation 18 as a triangle around the estimate, which the variance of the
    /// heights widens; a pair over unknown ground has the angles of unknown ground.
    #[inline(always)]
    fn lean<L: Lanes>(
        &self,
        lanes: L,
        wheels: &[WheelGround<L>; 4],
        known: &[Real<L>; 4],
    ) -> ([Triangles<L, 2>; 4], [Real<L>; 2]) {
        let (half, one) = (lanes.real(0.5), lanes.real(1.0));
        let mut share = [half; 4];
        let mut angles = [Triangles::nothing(lanes); 4];
        for (pair, [i, j]) in PAIRS.into_iter().enumerate() {
            share[pair] = half * known[i] * known[j];
            angles[pair] = self.angle(lanes, [&wheels[i], &wheels[j]], pair, share[pair]);
        }
        (angles, [one - share[0] - share[1], one - share[2] - share[3]])
    }

    /// Angle of a wheel pair of a probability.
    #[inline(always)]
    fn angle<L: Lanes>(
        &self,
        lanes: L,
        [a, b]: [&WheelGround<L>; 2],
        pair: usize,
        probability: Real<L>,
    ) -> Triangles<L, 2> {
        let real = |value: f32| lanes.real_single(value);
        let per_distance = real(self.per_distance[pair]);
        let tangent = (a.height_m - b.height_m).abs() * per_distance;
        let deviation = (a.variance_m2 + b.variance_m2).sqrt() * per_distance;
        // d atan(t) = cos^2 dt, and a triangle of half-width w has the variance w^2 / 6.
        let per_tangent = real(SQRT_6 * BINS_PER_RAD) / (real(1.0) + tangent * tangent);
        let noise = (deviation * per_tangent).min(real(N_BINS as f32));
        let spread = (real(self.spread_bins * self.spread_bins) + noise * noise).sqrt();
        let sharp = Triangle::new(lanes, noise, probability * real(1.0 - self.uniform_weight));
        let spread = Triangle::new(lanes, spread, probability * real(self.uniform_weight));
        Triangles { centre: arc_tangent(lanes, tangent) * real(self.lean[pair]), around: [sharp, spread] }
    }
}

impl Law {
    fn new(config: &PriorConfig) -> Self {
        match config.slope_law {
            SlopeLaw::Linear {} => {
                Self::Linear { per_slope: (1.0 / libm::tan(config.linear_slope_max_rad)) as f32 }
            }
            SlopeLaw::Friction { slip_stiffness, axle } => Self::Friction {
                per_stiffness: (1.0 / slip_stiffness) as f32,
                share: axle.share as f32,
                unloading: axle.unloading as f32,
            },
        }
    }
}

/// Cube root of numbers from 0 to 1, error below 1e-3: two of Halley's steps from the fourth root.
#[inline(always)]
fn cube_root<L: Lanes>(lanes: L, x: Real<L>) -> Real<L> {
    let double = x + x;
    // At zero the steps have no direction.
    let mut root = x.max(lanes.real_single(1e-10)).sqrt().sqrt();
    for _ in 0..2 {
        let cube = root * root * root;
        root = root * (cube + double) / (cube + cube + x);
    }
    root
}

/// What is left of the circle of friction counts as no less [-].
const SHARE_LEAST: f32 = 1e-6;

const BINS_PER_RAD: f32 = 1.0 / Bins::ATTITUDE_WIDTH_RAD;
const SQRT_6: f32 = 2.449_489_7;

/// Arc tangent of numbers that are not negative, error below 2e-8 before rounding (Abramowitz and Stegun,
/// 4.4.49): unlike the library's it runs in lanes.
#[inline(always)]
fn arc_tangent<L: Lanes>(lanes: L, tangent: Real<L>) -> Real<L> {
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
    let one = lanes.real(1.0);
    let is_steep = one.less(tangent);
    // atan(t) = pi/2 - atan(1/t); hardly any ground is that steep.
    let x = if lanes.any(is_steep) { (one / tangent).or_else(is_steep, tangent) } else { tangent };
    let squared = x * x;
    let mut series = lanes.real_single(COEFFICIENTS[0]);
    for coefficient in &COEFFICIENTS[1..] {
        series = series * squared + lanes.real_single(*coefficient);
    }
    let near = x * series;
    (lanes.real(std::f64::consts::FRAC_PI_2) - near).or_else(is_steep, near)
}

#[cfg(test)]
mod tests {
    use bicycle::lanes::Portable;

    use super::*;

    #[test]
    fn the_cube_root_is_good_to_a_thousandth() {
        for step in 0..=10_000 {
            let x = step as f32 * 1e-4;
            let found = super::cube_root(Portable, Portable.real_single(x)).1[3];
            assert!((found - x.cbrt()).abs() < 1e-3, "{x}: {found}");
        }
    }

    fn arc_tangent(tangent: f32) -> f32 {
        super::arc_tangent(Portable, Portable.real_single(tangent)).1[3]
    }

    #[test]
    fn the_arc_tangent_agrees_with_the_library() {
        for step in 0..20_000 {
            let tangent = step as f32 * 1e-3;
            assert!((arc_tangent(tangent) - tangent.atan()).abs() < 3e-7, "{tangent}");
        }
        assert!((arc_tangent(f32::MAX) - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
    }
}
