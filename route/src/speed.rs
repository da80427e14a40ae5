//! How fast to drive along a line (AnyNav, equations 43 to 51).
//!
//! In squared speeds the friction circle is a second-order cone and the rest is linear, and a segment's time is the
//! epigraph of a rotated cone: the fastest profile is a convex programme whose answer is the global one.

use crate::config::check;
use crate::programme::{Affine, Programme};
use serde::{Deserialize, Serialize};
use terrain::SettingError;

/// Standard gravity [m/s2].
const GRAVITY_MPS2: f64 = 9.806_65;

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
    /// A setting is out of range.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// The solver gave up.
    #[error("speeds: expected a solution for {n} points, found none")]
    Unsolved {
        /// Points of the line.
        n: usize,
    },
}

impl SpeedError {
    /// Where along the way no speed will do, if that is why [m].
    pub(crate) fn along_m(&self) -> Option<f64> {
        match *self {
            Self::Slides { at_m, .. } | Self::TooWeak { at_m, .. } => Some(at_m),
            Self::Setting(_) | Self::Unsolved { .. } => None,
        }
    }
}

/// The fastest speeds [m/s] at points `spacing_m` apart, from standing to standing.
///
/// # Errors
/// A setting out of range, or a place where the vehicle could not even creep.
pub fn fastest_speeds(bends: &[Bend], spacing_m: f64, limits: &SpeedLimits) -> Result<Vec<f64>, SpeedError> {
    limits.validate()?;
    check_creeping(bends, spacing_m, limits)?;
    let n = bends.len();
    if n < 3 {
        return Ok(vec![0.0; n]);
    }
    // Speeds at the points between the ends, their squares, and the segments' times.
    let (speed, square) = (|point: usize| point - 1, |point: usize| n - 2 + point - 1);
    let time = |segment: usize| 2 * (n - 2) + segment;
    let of_point = |variable: &dyn Fn(usize) -> usize, point: usize, factor: f64| {
        let is_inner = (1..n - 1).contains(&point);
        is_inner.then(|| (variable(point), factor))
    };
    let mut programme = Programme::new(2 * (n - 2) + n - 1);
    for (point, bend) in bends.iter().enumerate().take(n - 1).skip(1) {
        let fastest_mps = limits.fastest_mps(bend.roughness_m);
        programme.not_negative(&[
            Affine::new(fastest_mps.powi(2), &[(square(point), -1.0)]),
            Affine::new(0.0, &[(speed(point), 1.0)]),
        ]);
        // v^2 <= b, as (b + 1)^2 >= (b - 1)^2 + (2 v)^2.
        programme.no_shorter(&[
            Affine::new(1.0, &[(square(point), 1.0)]),
            Affine::new(-1.0, &[(square(point), 1.0)]),
            Affine::new(0.0, &[(speed(point), 2.0)]),
        ]);
    }
    for (segment, bend) in bends.iter().enumerate().take(n - 1) {
        let (friction_mps2, grade_mps2, cross_mps2) = bend.forces_mps2(limits);
        let per_length = 0.5 / spacing_m;
        let mut terms: Vec<_> = of_point(&square, segment + 1, per_length).into_iter().collect();
        terms.extend(of_point(&square, segment, -per_length));
        let along = Affine::new(grade_mps2, &terms);
        let turning: Vec<_> = of_point(&square, segment, bend.curvature_per_m).into_iter().collect();
        programme.no_shorter(&[
            Affine::new(friction_mps2, &[]),
            along.clone(),
            Affine::new(cross_mps2, &turning),
        ]);
        let negated: Vec<_> = along.terms.iter().map(|(variable, factor)| (*variable, -factor)).collect();
        programme.not_negative(&[
            Affine::new(limits.traction_max_mps2 - grade_mps2, &negated),
            Affine { constant: limits.braking_max_mps2 + grade_mps2, terms },
        ]);
        // t (v + w) >= 2 d, as (t + v + w)^2 >= (t - v - w)^2 + 8 d.
        let ends: Vec<_> =
            [segment, segment + 1].into_iter().filter_map(|point| of_point(&speed, point, 1.0)).collect();
        let signed = |sign: f64| {
            let mut terms: Vec<_> = ends.iter().map(|(variable, _)| (*variable, sign)).collect();
            terms.push((time(segment), 1.0));
            Affine { constant: 0.0, terms }
        };
        programme.no_shorter(&[signed(1.0), signed(-1.0), Affine::new((8.0 * spacing_m).sqrt(), &[])]);
        programme.minimise(time(segment), 1.0);
    }
    let found = programme.solve().ok_or(SpeedError::Unsolved { n })?;
    let at =
        |point: usize| if (1..n - 1).contains(&point) { found[square(point)].max(0.0).sqrt() } else { 0.0 };
    Ok((0..n).map(at).collect())
}

/// Equation 43: what a profile takes [s].
pub fn duration_s(speeds_mps: &[f64], spacing_m: f64) -> f64 {
    speeds_mps.windows(2).map(|ends| 2.0 * spacing_m / (ends[0] + ends[1])).sum()
}

/// A vehicle that creeps needs friction and traction against gravity alone.
fn check_creeping(bends: &[Bend], spacing_m: f64, limits: &SpeedLimits) -> Result<(), SpeedError> {
    for (index, bend) in bends.iter().enumerate() {
        let (friction_mps2, grade_mps2, cross_mps2) = bend.forces_mps2(limits);
        let at_m = index as f64 * spacing_m;
        if libm::hypot(grade_mps2, cross_mps2) >= friction_mps2 {
            let held = limits.friction_share * bend.friction;
            return Err(SpeedError::Slides { at_m, held, found: libm::hypot(bend.grade, bend.cross_slope) });
        }
        if grade_mps2 >= limits.traction_max_mps2 {
            let traction_mps2 = limits.traction_max_mps2;
            return Err(SpeedError::TooWeak { at_m, traction_mps2, found_mps2: grade_mps2 });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const LEVEL: Bend =
        Bend { curvature_per_m: 0.0, grade: 0.0, cross_slope: 0.0, friction: 0.6, roughness_m: 0.0 };
    const LIMITS: SpeedLimits = SpeedLimits {
        speed_max_mps: 10.0,
        traction_max_mps2: 2.0,
        braking_max_mps2: 20.0,
        friction_share: 1.0,
        roughness_speed_m2ps: 0.3,
    };

    #[test]
    fn a_straight_line_is_driven_at_full_traction_and_full_friction() {
        // 100 m: up at 2 m/s2, down at 0.6 g = 5.884 m/s2; never at 10 m/s for long:
        // 25 m to reach 10 m/s, 8.5 m to stop.
        let speeds = fastest_speeds(&vec![LEVEL; 101], 1.0, &LIMITS).unwrap();
        for (at_m, speed) in speeds.iter().enumerate() {
            let up = (2.0 * 2.0 * at_m as f64).sqrt();
            let down = (2.0 * 0.6 * GRAVITY_MPS2 * (100 - at_m) as f64).sqrt();
            assert!((speed - up.min(down).min(10.0)).abs() < 1e-3, "{at_m}: {speed}");
        }
        // 5 s up, 66.5 m at 10 m/s, 1.7 s down.
        let expected_s =
            5.0 + (100.0 - 25.0 - 50.0 / (0.6 * GRAVITY_MPS2)) / 10.0 + 10.0 / (0.6 * GRAVITY_MPS2);
        assert!((duration_s(&speeds, 1.0) - expected_s).abs() < 0.02);
    }

    #[test]
    fn a_long_bend_is_driven_at_the_speed_that_friction_holds_and_a_bank_changes_it() {
        let radius_m = 12.0;
        for cross_slope in [-0.2, 0.0, 0.2] {
            let bend = Bend { curvature_per_m: 1.0 / radius_m, cross_slope, ..LEVEL };
            let speeds = fastest_speeds(&vec![bend; 201], 1.0, &LIMITS).unwrap();
            let weight_mps2 = GRAVITY_MPS2 / (1.0 + cross_slope * cross_slope).sqrt();
            // Ground that rises to the left, inside of the turn, takes friction; a bank gives some.
            let expected = (radius_m * weight_mps2 * (0.6 - cross_slope)).sqrt();
            assert!((speeds[100] - expected).abs() < 2e-3, "{cross_slope}: {} {expected}", speeds[100]);
        }
    }

    #[test]
    fn every_constraint_holds_on_a_random_line_and_one_is_active_everywhere() {
        let mut state = 7_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let bends: Vec<Bend> = (0..200)
            .map(|_| Bend {
                curvature_per_m: 0.2 * (random() - 0.5),
                grade: 0.2 * (random() - 0.5),
                cross_slope: 0.2 * (random() - 0.5),
                friction: 0.4 + 0.5 * random(),
                roughness_m: 0.1 * random(),
            })
            .collect();
        let speeds = fastest_speeds(&bends, 1.0, &LIMITS).unwrap();
        assert!(speeds[0] < 1e-9 && speeds[199] < 1e-9);
        for (index, bend) in bends.iter().enumerate().take(199).skip(1) {
            let speed = speeds[index];
            let (friction_mps2, grade_mps2, cross_mps2) = bend.forces_mps2(&LIMITS);
            let force = |from: f64, to: f64| 0.5 * (to * to - from * from);
            let along = grade_mps2 + force(speed, speeds[index + 1]);
            let used = libm::hypot(along, cross_mps2 + bend.curvature_per_m * speed * speed);
            let fastest = LIMITS.fastest_mps(bend.roughness_m);
            assert!(used <= friction_mps2 + 1e-3, "{index}: {used} of {friction_mps2}");
            assert!(speed <= fastest + 1e-4 && along <= LIMITS.traction_max_mps2 + 1e-3, "{index}");
            // What keeps it from being faster is the point itself or a neighbour.
            let (before, _, _) = bends[index - 1].forces_mps2(&LIMITS);
            let (_, grade_before, cross_before) = bends[index - 1].forces_mps2(&LIMITS);
            let along_before = grade_before + force(speeds[index - 1], speed);
            let turning = cross_before + bends[index - 1].curvature_per_m * speeds[index - 1].powi(2);
            let used_before = libm::hypot(along_before, turning);
            let is_active = used > friction_mps2 - 1e-2
                || used_before > before - 1e-2
                || speed > fastest - 1e-2
                || along_before > LIMITS.traction_max_mps2 - 1e-2;
            assert!(is_active, "{index}: {speed}");
        }
    }

    #[test]
    fn what_cannot_even_creep_is_refused_with_its_place() {
        let mut bends = vec![LEVEL; 20];
        bends[7].cross_slope = 0.7;
        let error = fastest_speeds(&bends, 2.0, &LIMITS).unwrap_err();
        assert_eq!(
            error.to_string(),
            "ground at 14.0 m along the way: expected a slope of at most 0.60, found 0.70"
        );
        bends[7] = Bend { grade: 0.3, ..LEVEL };
        let error = fastest_speeds(&bends, 2.0, &LIMITS).unwrap_err();
        assert_eq!(
            error.to_string(),
            "climb at 14.0 m along the way: expected at most 2.00 m/s2, found 2.82"
        );
    }
}
