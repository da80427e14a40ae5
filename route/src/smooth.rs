//! From a path over cells to a smooth line.
//!
//! A cubic B-spline whose control points bend as little as they can while each stays in a square around its cell,
//! which is the larger the more open ground there is around it. A B-spline lies within the hull of its control points,
//! so that it does not leave these squares; its curvature is continuous.

use crate::programme::{Affine, Programme};

/// A uniform cubic B-spline through the plane.
#[derive(Clone, Debug)]
pub(crate) struct Spline {
    /// Control points [m], with one added before the first and one behind the last, so that it begins and ends on them.
    controls_m: Vec<[f64; 2]>,
}

/// A point of a spline.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SplinePoint {
    pub at_m: [f64; 2],
    pub yaw_rad: f64,
    pub curvature_per_m: f64,
}

impl Spline {
    /// The least bent one near `points_m`, from the first to the last of them, control point i within `freedom_m[i]`
    /// of point i along each axis.
    pub fn least_bent(points_m: &[[f64; 2]], freedom_m: &[f64]) -> Option<Self> {
        let n = points_m.len();
        let mut controls_m = points_m.to_vec();
        if n > 2 {
            for axis in 0..2 {
                let at = |index: usize| points_m[index][axis];
                // Counted from the points, so that numbers stay small far from the origin.
                let mut programme = Programme::new(n - 2);
                for index in 1..n - 1 {
                    let bend = at(index - 1) - 2.0 * at(index) + at(index + 1);
                    minimise_bend(&mut programme, index, n, bend);
                    let freedom_m = freedom_m[index];
                    programme.not_negative(&[
                        Affine::new(freedom_m, &[(index - 1, 1.0)]),
                        Affine::new(freedom_m, &[(index - 1, -1.0)]),
                    ]);
                }
                for (control, moved_m) in controls_m[1..n - 1].iter_mut().zip(programme.solve()?) {
                    control[axis] += moved_m;
                }
            }
        }
        Some(Self::between_ends(controls_m))
    }

    /// With these control points, at least one; from the first to the last of them.
    pub fn between_ends(mut controls_m: Vec<[f64; 2]>) -> Self {
        let n = controls_m.len();
        let (first, last) = (controls_m[0], controls_m[n - 1]);
        let mirrored = |end: [f64; 2], next: [f64; 2]| [0, 1].map(|axis| 2.0 * end[axis] - next[axis]);
        let (before, behind) = match n {
            1 => (first, last),
            _ => (mirrored(first, controls_m[1]), mirrored(last, controls_m[n - 2])),
        };
        controls_m.insert(0, before);
        controls_m.push(behind);
        Self { controls_m }
    }

    fn n_segments(&self) -> usize {
        self.controls_m.len() - 3
    }

    /// The point at a parameter from 0 to the number of segments.
    fn at(&self, parameter: f64) -> SplinePoint {
        let segment = (parameter.floor() as usize).min(self.n_segments() - 1);
        let t = parameter - segment as f64;
        let s = 1.0 - t;
        let place =
            [s.powi(3), 3.0 * t.powi(3) - 6.0 * t * t + 4.0, 3.0 * s.powi(3) - 6.0 * s * s + 4.0, t.powi(3)];
        let first = [-s * s, 3.0 * t * t - 4.0 * t, -3.0 * s * s + 4.0 * s, t * t];
        let second = [s, 3.0 * t - 2.0, 3.0 * s - 2.0, t];
        let sum = |weights: [f64; 4], share: f64| {
            [0, 1].map(|axis| {
                let of_controls = self.controls_m[segment..].iter().zip(weights);
                share * of_controls.map(|(control, weight)| weight * control[axis]).sum::<f64>()
            })
        };
        let (at_m, [dx, dy], [ddx, ddy]) = (sum(place, 1.0 / 6.0), sum(first, 0.5), sum(second, 1.0));
        let speed = libm::hypot(dx, dy).max(1e-9);
        SplinePoint {
            at_m,
            yaw_rad: libm::atan2(dy, dx),
            curvature_per_m: (dx * ddy - dy * ddx) / speed.powi(3),
        }
    }

    /// Points as far apart as `spacing_m` or a little less, and the distance between two along the line [m].
    pub fn sampled(&self, spacing_m: f64) -> (Vec<SplinePoint>, f64) {
        const PER_SEGMENT: usize = 8;
        let n = self.n_segments() * PER_SEGMENT;
        let parameter = |index: usize| index as f64 / PER_SEGMENT as f64;
        let mut lengths_m = vec![0.0];
        let mut before = self.at(0.0).at_m;
        for index in 1..=n {
            let at = self.at(parameter(index)).at_m;
            lengths_m.push(lengths_m[index - 1] + libm::hypot(at[0] - before[0], at[1] - before[1]));
            before = at;
        }
        let length_m = lengths_m[n];
        let n_steps = (length_m / spacing_m).ceil().max(1.0) as usize;
        let spacing_m = length_m / n_steps as f64;
        let mut index = 0;
        let point = |step: usize| {
            let wanted_m = spacing_m * step as f64;
            while index + 1 < n && lengths_m[index + 1] < wanted_m {
                index += 1;
            }
            let gap_m = (lengths_m[index + 1] - lengths_m[index]).max(1e-12);
            let share = ((wanted_m - lengths_m[index]) / gap_m).clamp(0.0, 1.0);
            self.at(parameter(index) + share / PER_SEGMENT as f64)
        };
        ((0..=n_steps).map(point).collect(), spacing_m)
    }
}

/// Adds the square of a control point's second difference, whose part from the points themselves is `bend`.
fn minimise_bend(programme: &mut Programme, index: usize, n: usize, bend: f64) {
    let terms: Vec<(usize, f64)> = [(index - 1, 1.0), (index, -2.0), (index + 1, 1.0)]
        .into_iter()
        .filter(|(control, _)| (1..n - 1).contains(control))
        .map(|(control, factor)| (control - 1, factor))
        .collect();
    programme.minimise_square(&terms);
    for (variable, factor) in terms {
        programme.minimise(variable, 2.0 * bend * factor);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_staircase_becomes_the_line_that_it_stands_for() {
        // Two cells east, one north, and so on: 26.6 degrees, within half a cell of the straight line.
        let points: Vec<[f64; 2]> = (0..=40).map(|step| [f64::from(step), f64::from(step / 2)]).collect();
        let spline = Spline::least_bent(&points, &vec![0.5; points.len()]).unwrap();
        let (samples, spacing_m) = spline.sampled(1.0);
        assert!((spacing_m * (samples.len() - 1) as f64 - 40.0_f64.hypot(20.0)).abs() < 1e-3);
        for sample in samples {
            assert!((sample.yaw_rad - 0.5_f64.atan()).abs() < 1e-3, "{sample:?}");
            assert!(sample.curvature_per_m.abs() < 1e-3, "{sample:?}");
        }
    }

    #[test]
    fn points_on_a_circle_have_its_curvature() {
        let angle = |step: i32| f64::from(step) * 0.05;
        let points: Vec<[f64; 2]> =
            (0..=60).map(|step| [20.0 * angle(step).cos(), 20.0 * angle(step).sin()]).collect();
        let spline = Spline::least_bent(&points, &vec![0.0; points.len()]).unwrap();
        let (samples, spacing_m) = spline.sampled(0.5);
        for sample in &samples[10..samples.len() - 10] {
            // The spline of points on a circle runs inside of it by h^2 / 6 R with h = 1 m: 0.2 %.
            assert!((sample.curvature_per_m - 0.05).abs() < 2e-4, "{sample:?}");
        }
        let gaps = samples
            .windows(2)
            .map(|pair| libm::hypot(pair[1].at_m[0] - pair[0].at_m[0], pair[1].at_m[1] - pair[0].at_m[1]));
        assert!(gaps.into_iter().all(|gap_m| (gap_m - spacing_m).abs() < 1e-3));
    }

    #[test]
    fn control_points_stay_where_they_may() {
        let points = [[0.0, 0.0], [1.0, 1.0], [2.0, 0.0], [3.0, 1.0], [4.0, 0.0]];
        let freedom_m = [0.0, 0.1, 0.2, 0.1, 0.0];
        let spline = Spline::least_bent(&points, &freedom_m).unwrap();
        for ((control, point), freedom_m) in spline.controls_m[1..].iter().zip(points).zip(freedom_m) {
            assert!((0..2).all(|axis| (control[axis] - point[axis]).abs() <= freedom_m + 1e-6));
        }
        // The zigzag is flattened as far as that goes.
        assert!((spline.controls_m[2][1] - 0.9).abs() < 1e-4);
    }
}
