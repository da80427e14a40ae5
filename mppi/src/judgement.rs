//! Whether a plan may be driven: looked at in f64, step by step, over the distance in which the vehicle could stop.
//!
//! Model, start and limits are those of the rollouts, which look at the whole horizon until the goal. The judge looks on
//! beyond the goal: a vehicle that arrives has yet to stop.

use crate::sampling::Control;
use bicycle::{GroundSample, MotionLimits, MotionState, MotionStepper};
use traversability::{Risk, RiskMapView};

/// Rolls single control sequences over the map with the reference model.
pub(crate) struct Judge<'a, S> {
    /// The model in metres.
    pub(crate) stepper: &'a S,
    pub(crate) limits: &'a MotionLimits,
    pub(crate) map: RiskMapView<'a>,
}

impl<S: MotionStepper> Judge<'_, S> {
    /// The state after one step.
    pub(crate) fn step(
        &self,
        state: &MotionState,
        command: Control,
        memory: &mut [f64],
        t: usize,
    ) -> MotionState {
        self.step_on(self.risk(state), state, command, (memory, t))
    }

    /// The state after one step on ground of known risk.
    fn step_on(
        &self,
        risk: Risk,
        state: &MotionState,
        command: Control,
        (memory, t): (&mut [f64], usize),
    ) -> MotionState {
        let mut sample = GroundSample {
            linear_traction: f64::from(risk.linear_traction),
            angular_traction: f64::from(risk.angular_traction),
            ..GroundSample::FIRM
        };
        if self.stepper.uses_ground() {
            let cell = self.map.geometry.cell_at(state.x_m, state.y_m);
            let ground = cell.map(|cell| self.map.ground[self.map.geometry.index(cell)]).unwrap_or_default();
            sample.gradient = ground.gradient.map(f64::from);
            sample.class = f64::from(ground.class);
        }
        self.stepper.step_one(state, command, &sample, memory, t)
    }

    fn risk(&self, state: &MotionState) -> Risk {
        self.map.risk_at(state.x_m, state.y_m, state.yaw_rad)
    }

    /// Whether the controls lead over a limit of attitude. A vehicle that stands beyond a limit may leave: its first
    /// poses count only when they are worse than where it stands.
    pub(crate) fn breaks_limits(
        &self,
        start: &MotionState,
        controls: impl Iterator<Item = Control>,
        memory: &mut [f64],
    ) -> bool {
        let start_risk = self.risk(start);
        let mut is_leaving = self.is_tilted(start_risk);
        let (mut state, mut risk) = (*start, start_risk);
        for (t, control) in controls.enumerate() {
            state = self.step_on(risk, &state, control, (&mut *memory, t));
            risk = self.risk(&state);
            let is_no_worse = risk.roll_rad <= start_risk.roll_rad && risk.pitch_rad <= start_risk.pitch_rad;
            if self.is_tilted(risk) && !(is_leaving && is_no_worse) {
                return true;
            }
            is_leaving = is_leaving && self.is_tilted(risk);
        }
        false
    }

    /// |roll| and |pitch| where the vehicle stands, if beyond a limit [rad].
    pub(crate) fn tilt(&self, state: &MotionState) -> Option<[f64; 2]> {
        let risk = self.risk(state);
        self.is_tilted(risk).then(|| [risk.roll_rad, risk.pitch_rad].map(f64::from))
    }

    /// A number that is not finite is beyond every limit.
    fn is_tilted(&self, risk: Risk) -> bool {
        let MotionLimits { roll_max_rad, pitch_max_rad, .. } = *self.limits;
        let within = risk.roll_rad <= roll_max_rad as f32 && risk.pitch_rad <= pitch_max_rad as f32;
        !within
    }
}
