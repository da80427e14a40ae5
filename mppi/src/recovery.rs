//! Noticing that the vehicle is stuck, and backing up for a while.
//!
//! No clock: time comes in as the time between two decisions.

use crate::config::Recovery;
use bicycle::MotionState;

/// What the controller should do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Mode {
    /// Go for the objective.
    Onward,
    /// Drive backwards, towards this point [m].
    BackUp {
        target_m: [f64; 2],
        /// Whether there is no way where it stood: the ground held it, so that it moved less than half of what it was
        /// told, or it found no way from about there the time before.
        is_no_way: bool,
    },
}

/// Watches progress.
#[derive(Clone, Debug)]
pub(crate) struct Watch {
    config: Recovery,
    mode: Mode,
    /// Where progress was last made, or backing up began [m]; none before the first look.
    anchor_m: Option<[f64; 2]>,
    /// Where it was at the last look [m].
    last_m: [f64; 2],
    /// Where backing up began the last time [m].
    backed_m: Option<[f64; 2]>,
    /// Way since the anchor, to and fro, and what was told [m].
    driven_m: f64,
    told_m: f64,
    /// Since then [s].
    waited_s: f64,
}

impl Watch {
    pub(crate) fn new(config: Recovery) -> Self {
        Self {
            config,
            mode: Mode::Onward,
            anchor_m: None,
            last_m: [0.0; 2],
            backed_m: None,
            driven_m: 0.0,
            told_m: 0.0,
            waited_s: 0.0,
        }
    }

    /// Goes by another configuration from now on.
    pub(crate) fn set(&mut self, config: Recovery) {
        self.config = config;
    }

    /// Forgets what was; to be called when the vehicle is not meant to move.
    pub(crate) fn reset(&mut self) {
        self.begin(Mode::Onward, [0.0; 2]);
        self.anchor_m = None;
    }

    /// The frame moved: places of before lie where `carry` takes them.
    pub(crate) fn carry(&mut self, carry: impl Fn([f64; 2]) -> [f64; 2]) {
        self.anchor_m = self.anchor_m.map(&carry);
        self.last_m = carry(self.last_m);
        self.backed_m = self.backed_m.map(&carry);
        if let Mode::BackUp { target_m, .. } = &mut self.mode {
            *target_m = carry(*target_m);
        }
    }

    /// Looks at a vehicle that is meant to move, and was told to at this speed.
    pub(crate) fn observe(&mut self, state: &MotionState, told_mps: f64, elapsed_s: f64) -> Mode {
        let here_m = [state.x_m, state.y_m];
        if self.anchor_m.is_none() {
            self.begin(Mode::Onward, here_m);
        }
        let anchor_m = self.anchor_m.unwrap_or(here_m);
        let (moved_m, step_m) = (distance_m(here_m, anchor_m), distance_m(here_m, self.last_m));
        self.last_m = here_m;
        self.waited_s += elapsed_s;
        self.driven_m += step_m;
        self.told_m += told_mps.abs() * elapsed_s;
        // Who rolled back before it gathered speed is about to pass the anchor.
        let moves = step_m * self.config.patience_s >= self.config.progress_m * elapsed_s;
        match self.mode {
            Mode::Onward if moved_m >= self.config.progress_m => self.begin(Mode::Onward, here_m),
            Mode::Onward if self.waited_s >= self.config.patience_s && !moves => {
                let back_m = self.config.distance_m;
                let (sine, cosine) = libm::sincos(state.yaw_rad);
                let target_m = [here_m[0] - back_m * cosine, here_m[1] - back_m * sine];
                let is_held = self.told_m > 2.0 * self.driven_m + self.config.progress_m;
                let near_m = 0.5 * self.config.distance_m;
                let is_again = self.backed_m.is_some_and(|before_m| distance_m(here_m, before_m) < near_m);
                self.backed_m = Some(here_m);
                self.begin(Mode::BackUp { target_m, is_no_way: is_held || is_again }, here_m);
            }
            Mode::BackUp { .. }
                if moved_m >= self.config.distance_m || self.waited_s >= self.config.duration_s =>
            {
                self.begin(Mode::Onward, here_m);
            }
            _ => {}
        }
        self.mode
    }

    fn begin(&mut self, mode: Mode, here_m: [f64; 2]) {
        (self.mode, self.anchor_m, self.last_m) = (mode, Some(here_m), here_m);
        (self.waited_s, self.driven_m, self.told_m) = (0.0, 0.0, 0.0);
    }
}

fn distance_m(a_m: [f64; 2], b_m: [f64; 2]) -> f64 {
    libm::hypot(a_m[0] - b_m[0], a_m[1] - b_m[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONFIG: Recovery = Recovery { patience_s: 3.0, progress_m: 0.5, distance_m: 1.0, duration_s: 2.0 };

    fn at(x_m: f64) -> MotionState {
        MotionState { x_m, ..MotionState::default() }
    }

    #[test]
    fn a_vehicle_at_half_a_metre_per_second_is_never_stuck() {
        let mut watch = Watch::new(CONFIG);
        // Progress of 0.5 m takes 1 s of the 3 s of patience.
        for k in 0..200 {
            assert_eq!(watch.observe(&at(0.05 * f64::from(k)), 1.0, 0.1), Mode::Onward);
        }
    }

    /// It rolls back by 0.4 m in 2 s and returns at 0.4 m/s: 3 s after the start it is where it was, within 0.5 m of the
    /// anchor for longer than the patience, and on its way.
    #[test]
    fn a_vehicle_that_rolled_back_before_it_set_off_is_not_stuck() {
        let mut watch = Watch::new(CONFIG);
        let place_m = |t_s: f64| if t_s < 2.0 { -0.2 * t_s } else { 0.4 * (t_s - 3.0) };
        for k in 0..60 {
            assert_eq!(watch.observe(&at(place_m(0.1 * f64::from(k))), 1.0, 0.1), Mode::Onward, "{k}");
        }
        // Swaying by half as much it is: where it turns it stands.
        let mut watch = Watch::new(CONFIG);
        let modes: Vec<Mode> =
            (0..60).map(|k| watch.observe(&at(0.2 * (0.3 * f64::from(k)).sin()), 1.0, 0.1)).collect();
        assert!(modes[..30].iter().all(|mode| *mode == Mode::Onward));
        assert!(modes.iter().any(|mode| *mode != Mode::Onward), "{modes:?}");
    }

    #[test]
    fn a_standing_vehicle_backs_up_after_its_patience_and_goes_on_after_the_duration() {
        let mut watch = Watch::new(CONFIG);
        let modes: Vec<bool> =
            (0..80).map(|_| matches!(watch.observe(&at(0.0), 1.0, 0.1), Mode::BackUp { .. })).collect();
        // 30 looks of 0.1 s are the patience; 20 more are the duration; then patience again.
        assert!(modes[..29].iter().all(|&back| !back));
        assert!(modes[31..49].iter().all(|&back| back));
        assert!(modes[51..79].iter().all(|&back| !back));
    }

    #[test]
    fn backing_up_aims_behind_the_vehicle_and_ends_with_the_distance() {
        let mut watch = Watch::new(CONFIG);
        let standing =
            MotionState { x_m: 2.0, yaw_rad: std::f64::consts::FRAC_PI_2, ..MotionState::default() };
        let mut mode = Mode::Onward;
        for _ in 0..32 {
            mode = watch.observe(&standing, 1.0, 0.1);
        }
        let Mode::BackUp { target_m, .. } = mode else { panic!("stuck for longer than the patience") };
        assert!((target_m[0] - 2.0).abs() < 1e-12 && (target_m[1] + 1.0).abs() < 1e-12);
        let moved = MotionState { y_m: -1.01, ..standing };
        assert_eq!(watch.observe(&moved, 1.0, 0.1), Mode::Onward);
    }

    /// Backing up ends, and 0.4 m from where it began the vehicle finds nothing better again; 0.6 m away it would be another
    /// place.
    #[test]
    fn who_finds_no_way_twice_from_about_the_same_place_has_none_there() {
        for (again_m, expected) in [(0.4, true), (0.6, false)] {
            let mut watch = Watch::new(CONFIG);
            let mut modes =
                (0..100).map(|k| watch.observe(&at(if k < 40 { 0.0 } else { again_m }), 0.1, 0.1));
            assert!(
                modes.by_ref().take(40).any(|mode| matches!(mode, Mode::BackUp { is_no_way: false, .. }))
            );
            let again = modes.find(|mode| matches!(mode, Mode::BackUp { is_no_way: true, .. }));
            assert_eq!(again.is_some(), expected, "{again_m}");
        }
    }

    /// Told to drive at 1 m/s it stood for 3 s: 3 m are more than none and the half metre of progress. Told to drive at
    /// 0.1 m/s, where nothing better was to be had, it was not held: 0.3 m are less.
    #[test]
    fn the_ground_held_who_was_told_to_drive_and_stood() {
        for (told_mps, expected) in [(1.0, true), (-1.0, true), (0.1, false)] {
            let mut watch = Watch::new(CONFIG);
            let mut mode = Mode::Onward;
            for _ in 0..32 {
                mode = watch.observe(&at(0.0), told_mps, 0.1);
            }
            assert!(
                matches!(mode, Mode::BackUp { is_no_way, .. } if is_no_way == expected),
                "{told_mps}: {mode:?}"
            );
        }
    }

    /// To the north by 100 m and a quarter turn to the left, in the midst of it: nothing else changes.
    #[test]
    fn backing_up_goes_on_behind_the_vehicle_in_a_frame_that_moved() {
        let mut watch = Watch::new(CONFIG);
        for _ in 0..32 {
            watch.observe(&at(2.0), 1.0, 0.1);
        }
        watch.carry(|[x_m, y_m]| [-y_m, x_m + 100.0]);
        let carried =
            MotionState { y_m: 102.0, yaw_rad: std::f64::consts::FRAC_PI_2, ..MotionState::default() };
        let Mode::BackUp { target_m, .. } = watch.observe(&carried, 1.0, 0.1) else {
            panic!("not yet there")
        };
        assert!(target_m[0].abs() < 1e-12 && (target_m[1] - 101.0).abs() < 1e-12, "{target_m:?}");
        assert_eq!(watch.observe(&MotionState { y_m: 100.99, ..carried }, 1.0, 0.1), Mode::Onward);
    }

    #[test]
    fn endless_patience_never_backs_up() {
        let mut watch = Watch::new(Recovery { patience_s: f64::INFINITY, ..CONFIG });
        assert!((0..1000).all(|_| watch.observe(&at(0.0), 1.0, 10.0) == Mode::Onward));
    }
}
