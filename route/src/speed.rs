//! How fast to drive along a line (AnyNav, equations 43 to 51).
//!
//! In squared speeds what is allowed at a point and the next one is convex. Backwards along the line, from standing, the
//! most at each point from which the rest can still be driven is found; forwards, at each point the most that is reached
//! (Pham and Pham, A new approach to time-optimal path parameterization based on reachability analysis, 2018). The paper
//! solves a programme for it; two sweeps find the same time to within a thousandth and take microseconds.

use crate::config::check;
use serde::{Deserialize, Serialize};
use terrain::SettingError;

/// Standard gravity [m/s2].
const GRAVITY_MPS2: f64 = 9.806_65;
/// Of the interval that a squared speed is sought in: what is left is below a millionth of a millionth.
const HALVINGS: usize = 40;

/// What the vehicle can do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SpeedLimits {
    /// Fastest, in [0.1, 100] [m/s].
    pub speed_max_mps: f64,
    /// Traction force over mass (F_th / M of equation 49), in [0.1, 100] [m/s2].
    pub traction_max_mps2: f64,
    /// Largest deceleration that the brakes give, in [0.1, 100] [m/s2].
    pub braking_max_mps2: f64,
    /// Share of the friction that is used, in [0.05, 1].
    pub friction_share: f64,
    /// Speed times roughness that is driven at most (phi of equation 50 is this over the roughness), in [1e-4, 100]
    /// [m2/s].
    pub roughness_speed_m2ps: f64,
}

impl Default for SpeedLimits {
    fn default() -> Self {
        Self {
            speed_max_mps: 5.0,
            traction_max_mps2: 3.0,
            braking_max_mps2: 4.0,
            friction_share: 0.8,
            roughness_speed_m2ps: 0.3,
        }
    }
}

impl SpeedLimits {
    /// Whether every number is in its range.
    ///
    /// # Errors
    /// The first one that is not.
    pub fn validate(&self) -> Result<(), SettingError> {
        let acceleration = "0.1 to 100 m/s2";
        check("speed_max_mps", self.speed_max_mps, 0.1..=100.0, "0.1 to 100 m/s")?;
        check("traction_max_mps2", self.traction_max_mps2, 0.1..=100.0, acceleration)?;
        check("braking_max_mps2", self.braking_max_mps2, 0.1..=100.0, acceleration)?;
        check("friction_share", self.friction_share, 0.05..=1.0, "0.05 to 1")?;
        check("roughness_speed_m2ps", self.roughness_speed_m2ps, 1e-4..=100.0, "1e-4 to 100 m2/s")
    }

    /// Equation 50: the fastest on ground of a roughness [m/s].
    fn fastest_mps(&self, roughness_m: f64) -> f64 {
        self.speed_max_mps.min(self.roughness_speed_m2ps / roughness_m.max(1e-9))
    }
}

/// What a line is like at one of its points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bend {
    /// Of the line, left positive [1/m].
    pub curvature_per_m: f64,
    /// Rise along the line [-].
    pub grade: f64,
    /// Rise to its left [-].
    pub cross_slope: f64,
    /// Friction coefficient [-].
    pub friction: f64,
    /// Of the ground [m].
    pub roughness_m: f64,
}

impl Bend {
    /// Friction, and gravity along and to the right of the line, over mass [m/s2].
    fn forces_mps2(&self, limits: &SpeedLimits) -> (f64, f64, f64) {
        let weight_mps2 = GRAVITY_MPS2 / (1.0 + self.grade.powi(2) + self.cross_slope.powi(2)).sqrt();
        let friction_mps2 = limits.friction_share * self.friction * weight_mps2;
        (friction_mps2, weight_mps2 * self.grade, weight_mps2 * self.cross_slope)
    }
}

/// Why there is no speed profile.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SpeedError {
    /// Gravity alone takes more than the friction that may be used.
    #[error("ground at {at_m:.1} m along the way: expected a slope of at most {held:.2}, found {found:.2}")]
    Slides {
        /// Along the way [m].
        at_m: f64,
        /// Slope that the friction holds [-].
        held: f64,
        /// Slope [-].
        found: f64,
    },
    /// Gravity along the way is more than the drive's force.
    #[error(
        "climb at {at_m:.1} m along the way: expected at most {traction_mps2:.2} m/s2, found {found_mps2:.2}"
    )]
    TooWeak {
        /// Along the way [m].
        at_m: f64,
        /// What the drive gives [m/s2].
        traction_mps2: f64,
        /// What the climb takes [m/s2].
        found_mps2: f64,
    },
    /// Gravity along the way is more than the brakes'.
    #[error(
        "descent at {at_m:.1} m along the way: expected at most {braking_mps2:.2} m/s2, found {found_mps2:.2}"
    )]
    BrakesTooWeak {
        /// Along the way [m].
        at_m: f64,
        /// What the brakes give [m/s2].
        braking_mps2: f64,
        /// What the descent takes [m/s2].
        found_mps2: f64,
    },
    /// A setting is out of range.
    #[error(transparent)]
    Setting(#[from] SettingError),
}

/// The fastest speeds [m/s] at points `spacing_m` apart, from standing to standing.
///
/// # Errors
/// A setting out of range, or a place where the vehicle could not even creep.
pub fn fastest_speeds(bends: &[Bend], spacing_m: f64, limits: &SpeedLimits) -> Result<Vec<f64>, SpeedError> {
    limits.validate()?;
    faults(bends, spacing_m, limits).next().map_or(Ok(()), |(_, fault)| Err(fault))?;
    let n = bends.len();
    let ways: Vec<Way> = bends.iter().map(|bend| Way::after(bend, spacing_m, limits)).collect();
    let mut squares = vec![0.0; n];
    for point in (1..n.saturating_sub(1)).rev() {
        squares[point] = ways[point].fastest_before(squares[point + 1]);
    }
    for point in 1..n {
        let most = ways[point - 1].reached_from(squares[point - 1]).map_or(0.0, |[_, most]| most);
        squares[point] = squares[point].min(most.max(0.0));
    }
    Ok(squares.into_iter().map(f64::sqrt).collect())
}

/// A point and the way to the next one, in squared speeds [m2/s2].
struct Way {
    bend: Bend,
    friction_mps2: f64,
    grade_mps2: f64,
    cross_mps2: f64,
    /// Acceleration by the drive, at most, and deceleration by the brakes.
    forces_mps2: [f64; 2],
    /// Of the point itself.
    fastest: f64,
    spacing_m: f64,
}

impl Way {
    fn after(bend: &Bend, spacing_m: f64, limits: &SpeedLimits) -> Self {
        let (friction_mps2, grade_mps2, cross_mps2) = bend.forces_mps2(limits);
        Self {
            bend: *bend,
            friction_mps2,
            grade_mps2,
            cross_mps2,
            forces_mps2: [limits.traction_max_mps2, limits.braking_max_mps2],
            fastest: limits.fastest_mps(bend.roughness_m).powi(2),
            spacing_m,
        }
    }

    /// Least and most at the next point: what turning leaves of the friction goes along the way, as far as drive and
    /// brakes use it; `None` where turning takes more than there is.
    fn reached_from(&self, square: f64) -> Option<[f64; 2]> {
        let turning_mps2 = self.cross_mps2 + self.bend.curvature_per_m * square;
        let left = self.friction_mps2.powi(2) - turning_mps2.powi(2);
        let left_mps2 = (left >= 0.0).then(|| left.sqrt())?;
        let [traction_mps2, braking_mps2] = self.forces_mps2.map(|force| force.min(left_mps2));
        let change = |along_mps2: f64| square + 2.0 * self.spacing_m * (along_mps2 - self.grade_mps2);
        Some([change(-braking_mps2), change(traction_mps2)])
    }

    /// The most from which the next point is reached with no more than is allowed there. Whoever creeps can go on, and
    /// what is allowed is convex, so that it is an interval from 0.
    fn fastest_before(&self, next: f64) -> f64 {
        let leads_on =
            |square: f64| self.reached_from(square).is_some_and(|[least, most]| least <= next && most >= 0.0);
        if leads_on(self.fastest) {
            return self.fastest;
        }
        let (mut low, mut high) = (0.0, self.fastest);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            *(if leads_on(middle) { &mut low } else { &mut high }) = middle;
        }
        low
    }
}

/// Equation 43: what a profile takes [s].
pub fn duration_s(speeds_mps: &[f64], spacing_m: f64) -> f64 {
    speeds_mps.windows(2).map(|ends| 2.0 * spacing_m / (ends[0] + ends[1])).sum()
}

/// The points at which no speed will do, and why.
pub(crate) fn faults(
    bends: &[Bend],
    spacing_m: f64,
    limits: &SpeedLimits,
) -> impl Iterator<Item = (usize, SpeedError)> {
    let fault = move |(index, bend): (usize, &Bend)| {
        Some((index, creeping_fault(bend, index as f64 * spacing_m, limits)?))
    };
    bends.iter().enumerate().filter_map(fault)
}

/// A vehicle that creeps needs friction, traction and brakes against gravity alone.
fn creeping_fault(bend: &Bend, at_m: f64, limits: &SpeedLimits) -> Option<SpeedError> {
    let (friction_mps2, grade_mps2, cross_mps2) = bend.forces_mps2(limits);
    if libm::hypot(grade_mps2, cross_mps2) >= friction_mps2 {
        let held = limits.friction_share * bend.friction;
        return Some(SpeedError::Slides { at_m, held, found: libm::hypot(bend.grade, bend.cross_slope) });
    }
    if grade_mps2 >= limits.traction_max_mps2 {
        let traction_mps2 = limits.traction_max_mps2;
        return Some(SpeedError::TooWeak { at_m, traction_mps2, found_mps2: grade_mps2 });
    }
    let braking_mps2 = limits.braking_max_mps2;
    (-grade_mps2 >= braking_mps2).then(|| SpeedError::BrakesTooWeak {
        at_m,
        braking_mps2,
        found_mps2: -grade_mps2,
    })
}

#[cfg(test)]
mod tests;
