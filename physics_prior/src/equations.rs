//! PIETRA's equations 15 to 18: from the ground under a pose to distributions of its traversability.

use traversability::{Bins, N_BINS, PmfQuad};

use crate::PriorConfig;
use crate::ground::Contact;
use crate::lengths::Lengths;
use crate::pose::PoseGround;

/// The configuration in the form that the equations want.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Equations {
    uniform_weight: f32,
    per_slope: [f32; 2],
    per_vegetation_m: f32,
    spread_bins: f32,
    unknown_share_max: f32,
    unknown_traction: f32,
    /// Angles of unknown ground, by attitude bin.
    unknown_attitude: [f32; N_BINS],
    bump_max_m: f32,
    high_centred_traction: f32,
    /// Wheel distances of the roll and the pitch pairs [m].
    distances_m: [f32; 2],
}

/// Wheel pairs of equation 17, wheels counted from 0: front left, rear left, rear right, front right.
const PAIRS: [[[usize; 2]; 2]; 2] = [[[0, 3], [1, 2]], [[0, 1], [3, 2]]];
const ROLL_LANE: usize = 2;

impl Equations {
    pub fn new(config: &PriorConfig, lengths: &Lengths) -> Self {
        let mut unknown_attitude = [0.0; N_BINS];
        let half_width = config.unknown_attitude_rad as f32 / Bins::ATTITUDE_WIDTH_RAD;
        add_folded_triangle(&mut unknown_attitude, 0.0, half_width, 1.0);
        Self {
            uniform_weight: config.uniform_weight as f32,
            per_slope: [config.linear_slope_max_rad, config.angular_slope_max_rad]
                .map(|slope_rad| (1.0 / slope_rad.tan()) as f32),
            per_vegetation_m: (1.0 / config.vegetation_height_max_m) as f32,
            spread_bins: config.attitude_spread_rad as f32 / Bins::ATTITUDE_WIDTH_RAD,
            unknown_share_max: config.unknown_share_max as f32,
            unknown_traction: config.unknown_traction as f32,
            unknown_attitude,
            bump_max_m: lengths.ground_clearance_m - config.belly_margin_m as f32,
            high_centred_traction: config.high_centred_traction as f32,
            distances_m: [lengths.wheels.track_m as f32, lengths.wheels.wheelbase_m as f32],
        }
    }

    /// Distributions of the four parameters at one pose. A footprint of which too little is known counts as
    /// unknown under every wheel.
    pub fn distribution(&self, pose: &PoseGround) -> PmfQuad {
        let mut quad = PmfQuad { rows: [[0.0; 4]; N_BINS] };
        let all_unknown = pose.unknown_share > self.unknown_share_max;
        let unknown = pose
            .wheels
            .each_ref()
            .map(|wheel| if all_unknown { 1.0 } else { wheel.values[Contact::UNKNOWN] });
        self.add_traction(&mut quad, pose, unknown);
        self.add_attitude(&mut quad, pose, unknown);
        quad
    }

    /// Equations 15, 16 and 18; a wheel over unknown ground has the traction of unknown ground.
    fn add_traction(&self, quad: &mut PmfQuad, pose: &PoseGround, unknown: [f32; 4]) {
        let high_centred = pose.bump_m > self.bump_max_m;
        let traction_max = if high_centred { self.high_centred_traction } else { 1.0 };
        for row in &mut quad.rows {
            let uniform = self.uniform_weight / N_BINS as f32;
            (row[0], row[1]) = (uniform, uniform);
        }
        let per_wheel = 0.25 * (1.0 - self.uniform_weight);
        for ((wheel, slope), unknown) in pose.wheels.iter().zip(pose.slopes).zip(unknown) {
            let known = per_wheel * (1.0 - unknown);
            let vegetation = known * pose.vegetation_share;
            let on_vegetation = 1.0 - wheel.values[Contact::VEGETATION] * self.per_vegetation_m;
            for lane in 0..2 {
                let on_dirt = 1.0 - slope * self.per_slope[lane];
                add_traction_atom(quad, lane, on_dirt.clamp(0.0, traction_max), known - vegetation);
                if vegetation > 0.0 {
                    add_traction_atom(quad, lane, on_vegetation.clamp(0.0, traction_max), vegetation);
                }
                if unknown > 0.0 {
                    let on_unknown = self.unknown_traction.min(traction_max);
                    add_traction_atom(quad, lane, on_unknown, per_wheel * unknown);
                }
            }
        }
    }

    /// Equations 17 and 18, with a triangle around the estimate in place of the uniform distribution, both
    /// widened by the variance of the heights; a pair over unknown ground gives its share to the angles of
    /// unknown ground.
    fn add_attitude(&self, quad: &mut PmfQuad, pose: &PoseGround, unknown: [f32; 4]) {
        for (axis, pairs) in PAIRS.iter().enumerate() {
            let mut angles = [0.0; N_BINS];
            for &[i, j] in pairs {
                let (a, b) = (&pose.wheels[i].values, &pose.wheels[j].values);
                let known = (1.0 - unknown[i]) * (1.0 - unknown[j]);
                let tangent = (a[Contact::HEIGHT] - b[Contact::HEIGHT]).abs() / self.distances_m[axis];
                let centre = tangent.atan() / Bins::ATTITUDE_WIDTH_RAD;
                // d atan(t) = cos^2 dt, and a triangle of half-width w has the variance w^2 / 6.
                let variance = (a[Contact::VARIANCE] + b[Contact::VARIANCE]) * 6.0;
                let per_tangent = 1.0 / (self.distances_m[axis] * (1.0 + tangent * tangent));
                let noise_bins = variance.sqrt() * per_tangent / Bins::ATTITUDE_WIDTH_RAD;
                let noise_bins = noise_bins.min(N_BINS as f32);
                let spread_bins = self.spread_bins.hypot(noise_bins);
                let share = 0.5 * known;
                add_folded_triangle(&mut angles, centre, noise_bins, share * (1.0 - self.uniform_weight));
                add_folded_triangle(&mut angles, centre, spread_bins, share * self.uniform_weight);
                if known < 1.0 {
                    let unknown = 0.5 * (1.0 - known);
                    angles.iter_mut().zip(&self.unknown_attitude).for_each(|(p, u)| *p += unknown * u);
                }
            }
            add_angles(quad, ROLL_LANE + axis, &angles);
        }
    }
}

/// Adds probabilities by attitude bin to a lane, which runs from the largest angle down.
fn add_angles(quad: &mut PmfQuad, lane: usize, angles: &[f32; N_BINS]) {
    for (row, angle) in quad.rows.iter_mut().rev().zip(angles) {
        row[lane] += angle;
    }
}

/// Adds a probability at a traction, split between the two bins whose values enclose it as
/// [`traversability::Pmf::interpolated`] does.
fn add_traction_atom(quad: &mut PmfQuad, lane: usize, traction: f32, probability: f32) {
    // Values 0, 0.05, 0.15, ..., 0.95, 1: steps of 0.1 inside and of 0.05 at both ends.
    let inside = 10.0 * traction + 0.5;
    let place = inside.min(20.0 * traction).max(20.0 * traction - 9.0);
    let below = (place as usize).min(N_BINS - 2);
    let share = place - below as f32;
    quad.rows[below][lane] += probability * (1.0 - share);
    quad.rows[below + 1][lane] += probability * share;
}

/// Adds the distribution of |X|, X triangular around `centre`, split between bin values so that its mean is
/// kept (except where it is cut off at the smallest and largest value). In units of attitude bins.
///
/// Splitting linearly between neighbours makes the cumulative probability at bin k the rise of the stop-loss
/// function S(y) = E[(y - |X|)^+] from value k to value k + 1.
fn add_folded_triangle(angles: &mut [f32; N_BINS], centre: f32, half_width: f32, probability: f32) {
    let half_width = half_width.max(1e-3);
    let stop_loss = |y: f32| {
        // E[(y - X)^+] of a triangle: the kink rounded off by a cubic on either side.
        let off = y - centre;
        let inside = (1.0 - off.abs() / half_width).max(0.0);
        off.max(0.0) + half_width / 6.0 * inside * inside * inside
    };
    // S up to a constant that the differences cancel.
    let folded: [f32; N_BINS] = std::array::from_fn(|k| {
        let value = k as f32 + 0.5;
        stop_loss(value) + stop_loss(-value)
    });
    let mut below = 0.0;
    for k in 0..N_BINS {
        let cumulative = if k + 1 < N_BINS { (folded[k + 1] - folded[k]).clamp(below, 1.0) } else { 1.0 };
        angles[k] += probability * (cumulative - below);
        below = cumulative;
    }
}
