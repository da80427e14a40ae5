//! Whether a plan may be driven: looked at in f64, step by step, over the distance in which the vehicle could stop.
//!
//! Model, start and limits are those of the rollouts, which look at the whole horizon until the goal. The judge looks on
//! beyond the goal: a vehicle that arrives has yet to stop.

use crate::sampling::Control;
use bicycle::{GroundSample, MotionLimits, MotionState, MotionStepper};
use traversability::{Risk, RiskMapView};

/// Plans expect no less traction than this of any ground, whatever the map says [-]. Who is stuck gains or loses nothing by
/// what is decided, so plans are for the case in which the vehicle moves: one that expected it to stay would call every
/// command as good as the others, and would not see the obstacle behind the mud.
pub(crate) const TRACTION_LEAST: f32 = Risk::STUCK_TRACTION;

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
        let at_least =
            |traction: f32| f64::from(if traction < TRACTION_LEAST { TRACTION_LEAST } else { traction });
        let mut sample = GroundSample {
            linear_traction: at_least(risk.linear_traction),
            angular_traction: at_least(risk.angular_traction),
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

    /// Whether a step of the controls leads where `is_there` says, asked of each with its number.
    pub(crate) fn leads(
        &self,
        start: &MotionState,
        controls: impl Iterator<Item = Control>,
        memory: &mut [f64],
        is_there: impl Fn(usize, &MotionState) -> bool,
    ) -> bool {
        let mut state = *start;
        controls.enumerate().any(|(t, control)| {
            state = self.step(&state, control, memory, t);
            is_there(t, &state)
        })
    }

    /// Whether the controls lead over a limit of attitude. A vehicle that stands beyond a limit may leave: its first
    /// poses count only where the ground leans beyond the limit and more than where it stands. What blocks a pose is no
    /// leaning: who leaves an obstacle does not come onto steeper ground for it.
    pub(crate) fn breaks_limits(
        &self,
        start: &MotionState,
        controls: impl Iterator<Item = Control>,
        memory: &mut [f64],
    ) -> bool {
        let leaning_rad = self.leaning_start_rad(start);
        let mut is_leaving = leaning_rad.is_some();
        let (mut state, mut risk) = (*start, self.risk(start));
        for (t, control) in controls.enumerate() {
            state = self.step_on(risk, &state, control, (&mut *memory, t));
            risk = self.risk(&state);
            let [roll_rad, pitch_rad] = risk.lean_rad().map(f64::from);
            let is_no_worse =
                leaning_rad.is_some_and(|most_rad| roll_rad <= most_rad[0] && pitch_rad <= most_rad[1]);
            if self.is_tilted(risk) && !(is_leaving && is_no_worse) {
                return true;
            }
            is_leaving = is_leaving && self.is_tilted(risk);
        }
        false
    }

    /// |roll| and |pitch| up to which the ground may lean on the way out, if the vehicle stands beyond a limit: those of
    /// where it stands, at least the limits [rad].
    pub(crate) fn leaning_start_rad(&self, start: &MotionState) -> Option<[f64; 2]> {
        let (risk, limits) = (self.risk(start), self.limits);
        let [roll_rad, pitch_rad] = risk.lean_rad().map(f64::from);
        self.is_tilted(risk).then(|| [roll_rad.max(limits.roll_max_rad), pitch_rad.max(limits.pitch_max_rad)])
    }

    /// A number that is not finite is beyond every limit.
    fn is_tilted(&self, risk: Risk) -> bool {
        let MotionLimits { roll_max_rad, pitch_max_rad, .. } = *self.limits;
        let within = risk.roll_rad <= roll_max_rad as f32 && risk.pitch_rad <= pitch_max_rad as f32;
        !within
    }
}
