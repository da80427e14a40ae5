//! Courses of turns over ground of which some is slippery.

use std::f64::consts::TAU;

use rand::RngExt;
use scenarios::{Patch, Stribeck, World, WorldError, seed_of, stream};
use serde::Serialize;
use terrain::GridGeometry;

/// Side of the world, and how near to its border a course comes [m].
const SIDE_M: f64 = 150.0;
const BORDER_M: f64 = 25.0;
const CELL_M: f64 = 0.25;
/// Goals of a course, how far they are from each other [m] and by how much the way turns at each [rad].
const GOALS: usize = 5;
const LEG_M: std::ops::Range<f64> = 25.0..40.0;
const TURN_RAD: std::ops::Range<f64> = 0.7..1.5;
/// Share of the turns on slippery ground, how large that is, and how far its middle may lie from the goal [m].
const SLICK_SHARE: f64 = 0.6;
const SLICK_RADIUS_M: std::ops::Range<f64> = 7.0..15.0;
const SLICK_OFF_M: f64 = 6.0;
/// Posts behind a turn, where somebody ends who slides straight on, and their size [m].
const POST_BEHIND_M: std::ops::Range<f64> = 7.0..10.0;
const POST_RADIUS_M: f64 = 0.4;
const POST_HEIGHT_M: f32 = 1.0;
/// Kinds of slippery ground by name and what their published friction is multiplied by, in range.
const KINDS: [(&str, Stribeck, [f32; 2]); 3] = [
    ("ice", Stribeck::ICE, [0.7, 1.1]),
    ("wet grass", Stribeck::GRASS, [0.4, 0.6]),
    ("mud", Stribeck::MUD, [0.5, 0.8]),
];
/// Ground between.
const FIRM: Stribeck = Stribeck::DIRT;

/// A round place that is slippery.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Slick {
    /// What it is.
    pub kind: &'static str,
    /// Its middle [m].
    pub centre_m: [f64; 2],
    /// [m].
    pub radius_m: f64,
    #[serde(skip)]
    friction: Stribeck,
}

/// Where a drive goes, and over what.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Course {
    /// Start: x [m], y [m], yaw [rad].
    pub start: [f64; 3],
    /// Goals, one after the other [m].
    pub goals_m: Vec<[f64; 2]>,
    /// Slippery ground.
    pub slicks: Vec<Slick>,
    /// Middles of the posts [m].
    pub posts_m: Vec<[f64; 2]>,
}

impl Slick {
    fn holds(&self, x_m: f64, y_m: f64) -> bool {
        (x_m - self.centre_m[0]).hypot(y_m - self.centre_m[1]) < self.radius_m
    }
}

fn along([x_m, y_m]: [f64; 2], yaw_rad: f64, distance_m: f64) -> [f64; 2] {
    [x_m + distance_m * yaw_rad.cos(), y_m + distance_m * yaw_rad.sin()]
}

impl Course {
    /// The course of a seed and a number.
    pub fn draw(seed: u64, number: u64) -> Self {
        let mut random = stream(seed_of(seed, &[number]), &[0x511C]);
        let inside = |place_m: [f64; 2]| place_m.iter().all(|at| (BORDER_M..SIDE_M - BORDER_M).contains(at));
        let start_m = [0, 1].map(|_| random.random_range(BORDER_M..SIDE_M - BORDER_M));
        let centre = [0.5 * SIDE_M; 2];
        let mut yaw_rad = (centre[1] - start_m[1]).atan2(centre[0] - start_m[0]);
        let start = [start_m[0], start_m[1], yaw_rad];
        let mut course = Self { start, goals_m: Vec::new(), slicks: Vec::new(), posts_m: Vec::new() };
        let mut at_m = start_m;
        for number in 0..GOALS {
            at_m = along(at_m, yaw_rad, random.random_range(LEG_M));
            course.goals_m.push(at_m);
            if number + 1 < GOALS {
                course.draw_turn(at_m, yaw_rad, &mut random);
            }
            let turn_rad: f64 = random.random_range(TURN_RAD);
            let side = if random.random_bool(0.5) { 1.0 } else { -1.0 };
            // Whichever side the next leg stays inside on; if neither does, about.
            let next = [side, -side]
                .into_iter()
                .find(|side| inside(along(at_m, yaw_rad + side * turn_rad, LEG_M.end)));
            yaw_rad += next.map_or(0.45 * TAU, |side| side * turn_rad);
        }
        course.keep_the_way_free();
        course
    }

    fn draw_turn(&mut self, at_m: [f64; 2], yaw_rad: f64, random: &mut impl RngExt) {
        self.posts_m.push(along(at_m, yaw_rad, random.random_range(POST_BEHIND_M)));
        let (is_slick, off_rad) = (random.random_bool(SLICK_SHARE), random.random_range(0.0..TAU));
        let off_m = random.random_range(0.0..SLICK_OFF_M);
        let radius_m = random.random_range(SLICK_RADIUS_M);
        let (kind, published, scale) = KINDS[random.random_range(0..KINDS.len())];
        let friction = published.scaled(random.random_range(scale[0]..scale[1]));
        if is_slick {
            self.slicks.push(Slick { kind, centre_m: along(at_m, off_rad, off_m), radius_m, friction });
        }
    }

    /// Takes away the posts that stand in the way of another leg.
    fn keep_the_way_free(&mut self) {
        let [x_m, y_m, _] = self.start;
        let places: Vec<[f64; 2]> = std::iter::once([x_m, y_m]).chain(self.goals_m.iter().copied()).collect();
        let is_free = |post_m: &[f64; 2]| {
            places
                .windows(2)
                .all(|leg| distance_to_leg_m(*post_m, leg[0], leg[1]) > 0.9 * POST_BEHIND_M.start)
        };
        self.posts_m.retain(is_free);
    }

    /// The ground of the course.
    pub(super) fn world(&self) -> Result<World, WorldError> {
        let n = (SIDE_M / CELL_M) as usize;
        let geometry = GridGeometry { resolution_m: CELL_M, origin: [0, 0], n_rows: n, n_cols: n };
        let height_m = |x_m: f64, y_m: f64| 0.15 * (TAU * x_m / 45.0).sin() * (TAU * y_m / 37.0).cos();
        let patch = |x_m: f64, y_m: f64| {
            let slick = self.slicks.iter().find(|slick| slick.holds(x_m, y_m));
            let ground = Patch::open(slick.map_or(FIRM, |slick| slick.friction));
            let is_post = |post: &[f64; 2]| (x_m - post[0]).hypot(y_m - post[1]) < POST_RADIUS_M;
            if self.posts_m.iter().any(is_post) { ground.obstructed(POST_HEIGHT_M) } else { ground }
        };
        World::from_fn("slippery", geometry, height_m, patch)
    }
}

fn distance_to_leg_m(place_m: [f64; 2], from_m: [f64; 2], to_m: [f64; 2]) -> f64 {
    let [dx, dy] = [to_m[0] - from_m[0], to_m[1] - from_m[1]];
    let [px, py] = [place_m[0] - from_m[0], place_m[1] - from_m[1]];
    let share = ((px * dx + py * dy) / (dx * dx + dy * dy)).clamp(0.0, 1.0);
    (px - share * dx).hypot(py - share * dy)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn courses_lie_inside_turn_and_keep_their_way_free() {
        let courses: Vec<Course> = (0..100).map(|number| Course::draw(3, number)).collect();
        let mut n_slicks = 0;
        for course in &courses {
            assert_eq!(course.goals_m.len(), GOALS);
            assert!(
                course.goals_m.iter().flatten().all(|at_m| (10.0..SIDE_M - 10.0).contains(at_m)),
                "{course:?}"
            );
            let from =
                std::iter::once([course.start[0], course.start[1]]).chain(course.goals_m.iter().copied());
            let places: Vec<[f64; 2]> = from.collect();
            for (post, leg) in
                course.posts_m.iter().flat_map(|post| places.windows(2).map(move |leg| (post, leg)))
            {
                assert!(distance_to_leg_m(*post, leg[0], leg[1]) > 6.2);
            }
            n_slicks += course.slicks.len();
        }
        // 0.6 of 400 turns; four deviations are 39.
        assert!((201..279).contains(&n_slicks), "{n_slicks}");
        assert_ne!(courses[0], courses[1]);
        assert_eq!(courses[7], Course::draw(3, 7));
    }

    #[test]
    fn slippery_places_are_slippery_in_the_world() {
        let course =
            (0..100).map(|number| Course::draw(5, number)).find(|course| !course.slicks.is_empty()).unwrap();
        let world = course.world().unwrap();
        let slick = &course.slicks[0];
        let [x_m, y_m] = slick.centre_m;
        let friction = world.patch(x_m, y_m).friction;
        assert!(friction.dynamic_friction < 0.5, "{friction:?}");
        let lies_between = |[x_m, y_m]: &[f64; 2]| course.slicks.iter().all(|slick| !slick.holds(*x_m, *y_m));
        let [x_m, y_m] = [[12.1, 12.1], [12.1, 138.1], [138.1, 12.1]].into_iter().find(lies_between).unwrap();
        assert_eq!(world.patch(x_m, y_m).friction, FIRM);
    }
}
