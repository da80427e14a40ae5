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
    BackUp { target_m: [f64; 2] },
}

/// Watches progress.
#[derive(Clone, Debug)]
pub(crate) struct Watch {
    config: Recovery,
    mode: Mode,
    /// Where progress was last made, or backing up began [m]; none before the first look.
    anchor_m: Option<[f64; 2]>,
    /// Since then [s].
    waited_s: f64,
}

impl Watch {
    pub(crate) fn new(config: Recovery) -> Self {
        Self { config, mode: Mode::Onward, anchor_m: None, waited_s: 0.0 }
    }

    /// Goes by another configuration from now on.
    pub(crate) fn set(&mut self, config: Recovery) {
        self.config = config;
    }

    /// Forgets what was; to be called when the vehicle is not meant to move.
    pub(crate) fn reset(&mut self) {
        (self.mode, self.anchor_m, self.waited_s) = (Mode::Onward, None, 0.0);
    }

    /// The frame moved: places of before lie where `carry` takes them.
    pub(crate) fn carry(&mut self, carry: impl Fn([f64; 2]) -> [f64; 2]) {
        self.anchor_m = self.anchor_m.map(&carry);
        if let Mode::BackUp { target_m } = &mut self.mode {
            *target_m = carry(*target_m);
        }
    }

    /// Looks at a vehicle that is meant to move.
    pub(crate) fn observe(&mut self, state: &MotionState, elapsed_s: f64) -> Mode {
        let here_m = [state.x_m, state.y_m];
        let anchor_m = *self.anchor_m.get_or_insert(here_m);
        let moved_m = libm::hypot(here_m[0] - anchor_m[0], here_m[1] - anchor_m[1]);
        self.waited_s += elapsed_s;
        match self.mode {
            Mode::Onward if moved_m >= self.config.progress_m => self.begin(Mode::Onward, here_m),
            Mode::Onward if self.waited_s >= self.config.patience_s => {
                let back_m = self.config.distance_m;
                let (sine, cosine) = libm::sincos(state.yaw_rad);
                let target_m = [here_m[0] - back_m * cosine, here_m[1] - back_m * sine];
                self.begin(Mode::BackUp { target_m }, here_m);
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
        (self.mode, self.anchor_m, self.waited_s) = (mode, Some(here_m), 0.0);
    }
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
            assert_eq!(watch.observe(&at(0.05 * f64::from(k)), 0.1), Mode::Onward);
        }
    }

    #[test]
    fn a_standing_vehicle_backs_up_after_its_patience_and_goes_on_after_the_duration() {
        let mut watch = Watch::new(CONFIG);
        let modes: Vec<bool> =
            (0..80).map(|_| matches!(watch.observe(&at(0.0), 0.1), Mode::BackUp { .. })).collect();
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
            mode = watch.observe(&standing, 0.1);
        }
        let Mode::BackUp { target_m } = mode else { panic!("stuck for longer than the patience") };
        assert!((target_m[0] - 2.0).abs() < 1e-12 && (target_m[1] + 1.0).abs() < 1e-12);
        let moved = MotionState { y_m: -1.01, ..standing };
        assert_eq!(watch.observe(&moved, 0.1), Mode::Onward);
    }

    /// To the north by 100 m and a quarter turn to the left, in the midst of it: nothing else changes.
    #[test]
    fn backing_up_goes_on_behind_the_vehicle_in_a_frame_that_moved() {
        let mut watch = Watch::new(CONFIG);
        for _ in 0..32 {
            watch.observe(&at(2.0), 0.1);
        }
        watch.carry(|[x_m, y_m]| [-y_m, x_m + 100.0]);
        let carried =
            MotionState { y_m: 102.0, yaw_rad: std::f64::consts::FRAC_PI_2, ..MotionState::default() };
        let Mode::BackUp { target_m } = watch.observe(&carried, 0.1) else { panic!("not yet there") };
        assert!(target_m[0].abs() < 1e-12 && (target_m[1] - 101.0).abs() < 1e-12, "{target_m:?}");
        assert_eq!(watch.observe(&MotionState { y_m: 100.99, ..carried }, 0.1), Mode::Onward);
    }

    #[test]
    fn endless_patience_never_backs_up() {
        let mut watch = Watch::new(Recovery { patience_s: f64::INFINITY, ..CONFIG });
        assert!((0..1000).all(|_| watch.observe(&at(0.0), 10.0) == Mode::Onward));
    }
}
