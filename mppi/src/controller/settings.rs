//! Settings that change between two decisions.

use super::Controller;
use crate::config::{Actuation, Config, ConfigError};
use crate::cost::{RolloutCost, StepCost};
use crate::driven::Driven;
use crate::lag;
use crate::rollout::MAX_SLOTS;
use bicycle::{MotionLimits, MotionStepper};

/// What a controller makes of its model.
pub(super) struct Prepared<M: Driven> {
    pub(super) limits: MotionLimits,
    pub(super) stepper: M::Stepper,
    pub(super) lag_s: [f64; 2],
    pub(super) turning_s_per_rad: f64,
}

impl<M: Driven> Prepared<M> {
    /// Of a model that is valid.
    pub(super) fn new(config: &Config, model: &M) -> Result<Self, ConfigError> {
        let limits = model.motion_limits();
        let stepper = model.stepper(config.step_s, 1.0);
        let stepper = match config.actuation {
            Actuation::Instant => stepper.with_instant_actuators(),
            Actuation::Limited => stepper,
        };
        if stepper.n_slots() > MAX_SLOTS {
            return Err(ConfigError::EffectMemory { found: stepper.n_slots(), step_s: config.step_s });
        }
        let lag_s = lag::of_actuators(&stepper, limits.rates, config.step_s);
        Ok(Self { limits, stepper, lag_s, turning_s_per_rad: model.turning_s_per_rad() })
    }
}

impl<M: Driven, S: StepCost, R: RolloutCost> Controller<M, S, R> {
    /// Decides by another configuration from now on. Plan, history and progress stay. Memory, threads and time are laid
    /// out once: `n_rollouts`, `n_steps`, `step_s`, `n_threads`, `isa`, `delay_s` and `period_min_s` must be what they
    /// were. To be called between decisions; it may allocate, the decisions after it do not.
    ///
    /// # Errors
    /// A value out of range, or another layout. The controller then goes on as it was.
    pub fn set_config(&mut self, config: Config) -> Result<(), ConfigError> {
        config.validate()?;
        self.config.refuse_other_layout(&config)?;
        let prepared = Prepared::new(&config, &self.model)?;
        self.plan.set_noise(&config);
        self.watch.set(config.recovery);
        self.config = config;
        self.adopt(prepared);
        Ok(())
    }

    /// Believes another model from now on: other limits, another wheelbase, other strengths of the same effects. Plan,
    /// history and progress stay. To be called between decisions; it may allocate, the decisions after it do not.
    ///
    /// # Errors
    /// A model out of range, or one whose effects remember or hold more or less than those of the model before. The
    /// controller then goes on as it was.
    pub fn set_model(&mut self, model: M) -> Result<(), ConfigError> {
        model.validate()?;
        let prepared = Prepared::new(&self.config, &model)?;
        let remembers = |stepper: &M::Stepper| {
            let (slots, held, past_s) = (stepper.n_slots(), stepper.n_held(), stepper.past_s());
            format!("{slots} numbers of {past_s:.2} s, {held} of them held")
        };
        let (expected, found) = (remembers(&self.stepper), remembers(&prepared.stepper));
        if expected != found {
            return Err(ConfigError::Fixed { field: "memory of the model's effects", expected, found });
        }
        self.model = model;
        self.adopt(prepared);
        Ok(())
    }

    fn adopt(&mut self, prepared: Prepared<M>) {
        self.cell_stepper = prepared.stepper.clone();
        self.stepper = prepared.stepper;
        self.limits = prepared.limits;
        self.lag_s = prepared.lag_s;
        self.turning_s_per_rad = prepared.turning_s_per_rad;
    }

    /// The model.
    pub fn model(&self) -> &M {
        &self.model
    }
}
