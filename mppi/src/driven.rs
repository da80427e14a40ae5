//! Which motion models a controller can drive.

use crate::discs::MovingDiscs;
use crate::rollout::Job;
use bicycle::{Model, MotionModel, SkidSteer};

/// A motion model that a [`crate::Controller`] can drive: `impl Driven for MyModel {}` is all that it takes.
pub trait Driven: MotionModel {
    /// Rolls out some futures. Models of this crate override it with the same, so that their loops are compiled here
    /// and once.
    #[doc(hidden)]
    fn roll_out(job: Job<'_, Self::Stepper, ()>) {
        job.run();
    }

    /// The same among discs that move.
    #[doc(hidden)]
    fn roll_out_among(job: Job<'_, Self::Stepper, MovingDiscs>) {
        job.run();
    }
}

impl Driven for Model {
    fn roll_out(job: Job<'_, Self::Stepper, ()>) {
        job.run();
    }

    fn roll_out_among(job: Job<'_, Self::Stepper, MovingDiscs>) {
        job.run();
    }
}

impl Driven for SkidSteer {
    fn roll_out(job: Job<'_, Self::Stepper, ()>) {
        job.run();
    }

    fn roll_out_among(job: Job<'_, Self::Stepper, MovingDiscs>) {
        job.run();
    }
}
