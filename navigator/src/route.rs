//! Where a mission leads: goals one after the other, or a path to follow.

use mppi::ReferencePath;

use crate::{Destination, Target};

/// Most corners of a path that the controller is shown at a time.
pub const CORNERS_MAX: usize = 32;
/// Time of driving that these must reach for, at the path's speed: more than any horizon [s].
const WINDOW_S: f64 = 6.0;

/// Share of the tolerance within which a path is driven to its end. It is approached slowly: whoever stopped at the
/// tolerance would stand outside of it as often as the localisation is off to the other side.
pub(crate) const PATH_END_SHARE: f64 = 0.5;

/// Goals or a path, checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Route {
    points_m: Vec<[f64; 2]>,
    tolerance_m: f64,
    course: Course,
}

/// How the points of a route are meant.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Course {
    /// Each is to be come near, on whatever way is best.
    Goals,
    /// They are the corners of the way.
    Path { speed_mps: f64 },
}

/// Points that make no route.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RouteError {
    /// Too few.
    #[error("route: expected at least {least} points, found {found}")]
    TooShort {
        /// What it takes.
        least: usize,
        /// How many there are.
        found: usize,
    },
    /// A number is none, or not one that would do.
    #[error("route {field}: expected {expected}, found {found}")]
    Number {
        /// What it is.
        field: &'static str,
        /// What would do.
        expected: &'static str,
        /// What it is.
        found: f64,
    },
    /// Corners so close that the controller is not shown enough of the way.
    #[error(
        "path: expected {most} corners in a row to reach {needed_m:.2} m at this speed, found {found_m:.2} m from \
         corner {corner} on; leave corners out",
        most = CORNERS_MAX
    )]
    Dense {
        /// The first of them, from 0.
        corner: usize,
        /// Length that they must have [m].
        needed_m: f64,
        /// Length that they have [m].
        found_m: f64,
    },
}

impl Route {
    /// Goals in the map frame [m], in their order; within `tolerance_m` of one counts as there.
    ///
    /// # Errors
    /// No goal, a number that is none, or several goals of which none counts as reached.
    pub fn goals(points_m: Vec<[f64; 2]>, tolerance_m: f64) -> Result<Self, RouteError> {
        check_points(&points_m, 1)?;
        let is_near = tolerance_m.is_finite() && (tolerance_m > 0.0 || points_m.len() == 1);
        require(is_near && tolerance_m >= 0.0, "tolerance", "a distance above 0 m", tolerance_m)?;
        Ok(Self { points_m, tolerance_m, course: Course::Goals })
    }

    /// A path along corners in the map frame [m] at a speed [m/s]; it ends within `tolerance_m` of the last.
    ///
    /// # Errors
    /// Less than two corners, a number that is none, or corners too close together.
    pub fn path(points_m: Vec<[f64; 2]>, speed_mps: f64, tolerance_m: f64) -> Result<Self, RouteError> {
        check_points(&points_m, 2)?;
        let is_above_0 = |value: f64| value.is_finite() && value > 0.0;
        require(is_above_0(tolerance_m), "tolerance", "a distance above 0 m", tolerance_m)?;
        require(is_above_0(speed_mps), "speed", "a speed above 0 m/s", speed_mps)?;
        let route = Self { points_m, tolerance_m, course: Course::Path { speed_mps } };
        (1..route.points_m.len()).try_for_each(|leg| route.check_window(leg, speed_mps))?;
        Ok(route)
    }

    /// The same where somebody else is to say how near counts as there.
    pub fn without_tolerance(self) -> Self {
        Self { tolerance_m: 0.0, ..self }
    }

    /// All points [m].
    pub fn points_m(&self) -> &[[f64; 2]] {
        &self.points_m
    }

    /// Distance that counts as there [m].
    pub fn tolerance_m(&self) -> f64 {
        self.tolerance_m
    }

    /// Speed along it, if it is a path [m/s].
    pub fn path_speed_mps(&self) -> Option<f64> {
        match self.course {
            Course::Goals => None,
            Course::Path { speed_mps } => Some(speed_mps),
        }
    }

    /// The first point to head for.
    pub(crate) fn first_leg(&self) -> usize {
        match self.course {
            Course::Goals => 0,
            Course::Path { .. } => 1,
        }
    }

    /// What to do on the way to a point. Only the last counts as a place to stand at.
    pub(crate) fn target(&self, leg: usize) -> Target<'_> {
        let is_last = leg + 1 == self.points_m.len();
        let tolerance_m = if is_last { self.tolerance_m } else { 0.0 };
        match self.course {
            Course::Goals => Target::Goal(Destination { goal_m: self.points_m[leg], tolerance_m }),
            Course::Path { speed_mps } => Target::Path(ReferencePath {
                points_m: &self.points_m[leg - 1..=self.window_end(leg, speed_mps)],
                speed_mps,
                tolerance_m,
            }),
        }
    }

    /// The point to head for from a place, given the one before. The last stays the last.
    pub(crate) fn next_leg(&self, leg: usize, at_m: [f64; 2]) -> usize {
        let passed = |leg: &usize| leg + 1 < self.points_m.len() && self.is_passed(*leg, at_m);
        std::iter::successors(Some(leg), |leg| passed(leg).then_some(leg + 1)).last().unwrap_or(leg)
    }

    /// Whether this is as near to the last point as it must be.
    pub(crate) fn is_end(&self, leg: usize, at_m: [f64; 2]) -> bool {
        let share = if self.path_speed_mps().is_some() { PATH_END_SHARE } else { 1.0 };
        leg + 1 == self.points_m.len() && distance_m(self.points_m[leg], at_m) <= share * self.tolerance_m
    }

    /// A goal is passed within its tolerance. So is a corner of a path, also where the vehicle is abreast of it or has cut
    /// it: nearer to the next stretch by more than the tolerance.
    fn is_passed(&self, leg: usize, at_m: [f64; 2]) -> bool {
        if distance_m(self.points_m[leg], at_m) <= self.tolerance_m {
            return true;
        }
        let Course::Path { .. } = self.course else { return false };
        let [before, corner, after] = [leg - 1, leg, leg + 1].map(|place| self.points_m[place]);
        let (here, next) = (Foot::of(at_m, before, corner), Foot::of(at_m, corner, after));
        here.is_beyond || next.distance_m + self.tolerance_m < here.distance_m
    }

    /// The last corner that is shown with a leg.
    fn window_end(&self, leg: usize, speed_mps: f64) -> usize {
        let last = self.points_m.len() - 1;
        let enough = |end: &usize| self.length_m(leg, *end) >= speed_mps * WINDOW_S;
        (leg..last.min(leg + CORNERS_MAX - 2)).find(enough).unwrap_or(last.min(leg + CORNERS_MAX - 2))
    }

    fn check_window(&self, leg: usize, speed_mps: f64) -> Result<(), RouteError> {
        let end = self.window_end(leg, speed_mps);
        let (found_m, needed_m) = (self.length_m(leg, end), speed_mps * WINDOW_S);
        let is_enough = found_m >= needed_m || end + 1 == self.points_m.len();
        if is_enough { Ok(()) } else { Err(RouteError::Dense { corner: leg, needed_m, found_m }) }
    }

    /// Along the points from one to another [m].
    fn length_m(&self, from: usize, to: usize) -> f64 {
        self.points_m[from..=to].windows(2).map(|ends| distance_m(ends[0], ends[1])).sum()
    }
}

fn check_points(points_m: &[[f64; 2]], least: usize) -> Result<(), RouteError> {
    if points_m.len() < least {
        return Err(RouteError::TooShort { least, found: points_m.len() });
    }
    let broken = points_m.iter().flatten().find(|value| !value.is_finite());
    broken.map_or(Ok(()), |&found| require(false, "point", "finite numbers", found))
}

fn require(holds: bool, field: &'static str, expected: &'static str, found: f64) -> Result<(), RouteError> {
    if holds { Ok(()) } else { Err(RouteError::Number { field, expected, found }) }
}

fn distance_m(one_m: [f64; 2], other_m: [f64; 2]) -> f64 {
    libm::hypot(one_m[0] - other_m[0], one_m[1] - other_m[1])
}

/// The place of a stretch that is nearest to a point.
struct Foot {
    distance_m: f64,
    /// The point lies beyond the end of the stretch.
    is_beyond: bool,
}

impl Foot {
    fn of(at_m: [f64; 2], from_m: [f64; 2], to_m: [f64; 2]) -> Self {
        let along = [to_m[0] - from_m[0], to_m[1] - from_m[1]];
        let square_m2 = along[0] * along[0] + along[1] * along[1];
        let inner = (at_m[0] - from_m[0]) * along[0] + (at_m[1] - from_m[1]) * along[1];
        // Two corners at the same place have no length, and whoever is there is beyond them.
        let share = if square_m2 > 0.0 { inner / square_m2 } else { 1.0 };
        let within = share.clamp(0.0, 1.0);
        let foot_m = [from_m[0] + within * along[0], from_m[1] + within * along[1]];
        Self { distance_m: distance_m(at_m, foot_m), is_beyond: share >= 1.0 }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

    use super::*;

    fn path(points_m: &[[f64; 2]]) -> Route {
        Route::path(points_m.to_vec(), 1.0, 0.5).unwrap()
    }

    #[test]
    fn what_is_no_route_is_refused_with_what_was_found() {
        let told = |refused: Result<Route, RouteError>| refused.unwrap_err().to_string();
        assert_eq!(told(Route::goals(vec![], 1.0)), "route: expected at least 1 points, found 0");
        assert!(told(Route::goals(vec![[0.0, f64::NAN]], 1.0)).contains("found NaN"));
        assert!(
            told(Route::goals(vec![[0.0; 2], [9.0; 2]], 0.0))
                .contains("tolerance: expected a distance above 0")
        );
        assert!(told(Route::goals(vec![[0.0; 2]], -1.0)).contains("found -1"));
        assert!(told(Route::path(vec![[0.0; 2]], 1.0, 1.0)).contains("at least 2 points, found 1"));
        assert!(told(Route::path(vec![[0.0; 2], [1.0; 2]], 0.0, 1.0)).contains("speed"));
        let dense = (0..100).map(|k| [0.1 * f64::from(k), 0.0]).collect();
        assert!(
            told(Route::path(dense, 1.0, 0.5))
                .contains("to reach 6.00 m at this speed, found 3.00 m from corner 1")
        );
        assert!(Route::goals(vec![[0.0; 2]], 0.0).is_ok(), "one that is never reached");
    }

    #[test]
    fn goals_are_passed_one_by_one_within_their_tolerance() {
        let route = Route::goals(vec![[5.0, 0.0], [5.0, 5.0], [0.0, 5.0]], 1.0).unwrap();
        assert_eq!(route.next_leg(0, [3.9, 0.0]), 0);
        assert_eq!(route.next_leg(0, [4.1, 0.0]), 1);
        assert_eq!(route.next_leg(1, [0.0, 5.0]), 1, "the last before it is its turn");
        assert_eq!(route.next_leg(2, [0.0, 5.0]), 2);
        assert!(!route.is_end(1, [5.0, 5.0]) && route.is_end(2, [0.9, 5.0]) && !route.is_end(2, [1.1, 5.0]));
        let near = |leg: usize| match route.target(leg) {
            Target::Goal(destination) => destination.tolerance_m,
            Target::Path(_) => f64::NAN,
        };
        assert_eq!([near(0), near(1), near(2)], [0.0, 0.0, 1.0], "only the last is a place to stand at");
    }

    #[test]
    fn a_path_is_driven_well_into_the_tolerance_of_its_end() {
        let route = path(&[[0.0, 0.0], [10.0, 0.0]]);
        assert!(!route.is_end(1, [9.7, 0.0]) && route.is_end(1, [9.8, 0.0]));
    }

    #[test]
    fn corners_are_passed_abreast_or_cut_and_never_on_the_way_there() {
        let route = path(&[[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]]);
        assert_eq!(route.next_leg(1, [9.0, 0.0]), 1);
        assert_eq!(route.next_leg(1, [9.6, 0.0]), 2, "within the tolerance");
        assert_eq!(route.next_leg(1, [10.1, -3.0]), 2, "abreast, and off the path");
        assert_eq!(route.next_leg(1, [9.9, 2.0]), 2, "cut");
        // There and back again: the way back is no shortcut.
        let hairpin = path(&[[0.0, 0.0], [20.0, 0.0], [20.0, 2.0], [0.0, 2.0]]);
        for x_m in 0..19 {
            assert_eq!(hairpin.next_leg(1, [f64::from(x_m), 0.2]), 1, "{x_m}");
        }
        assert_eq!(hairpin.next_leg(1, [20.1, 0.3]), 2);
    }

    #[test]
    fn the_controller_is_shown_as_much_of_a_path_as_it_can_drive_and_no_more_than_it_takes() {
        let route = Route::path((0..200).map(|k| [f64::from(k), 0.0]).collect(), 1.0, 0.5).unwrap();
        let shown = |leg: usize| match route.target(leg) {
            Target::Path(path) => (path.points_m[0][0], path.points_m.len(), path.tolerance_m),
            Target::Goal(_) => (f64::NAN, 0, f64::NAN),
        };
        assert_eq!(shown(1), (0.0, 8, 0.0), "the stretch that it is on, and six metres");
        assert_eq!(shown(100), (99.0, 8, 0.0));
        assert_eq!(shown(199), (198.0, 2, 0.5), "the end");
        let fast = Route::path((0..200).map(|k| [f64::from(k), 0.0]).collect(), 5.0, 0.5).unwrap();
        let Target::Path(window) = fast.target(1) else { panic!("a path") };
        assert_eq!(window.points_m.len(), CORNERS_MAX);
    }
}
