//! The kinematic bicycle on ground that takes a share of every motion (PIETRA, equation 2), step by step.

mod contract;

use crate::effect::{CommandStep, Driving, Moving, PreparedEffects};
use crate::lanes::{Constant, Lanes, Real, STEERING_DOMAIN_RAD};
use crate::{Command, GroundSample, Model, MotionStepper, State};
use std::f64::consts::TAU;

/// States of a pack of vehicles. Lengths are in the unit that the stepper was made for.
#[derive(Clone, Copy)]
pub struct LaneState<L: Lanes> {
    /// East [unit].
    pub x: Real<L>,
    /// North [unit].
    pub y: Real<L>,
    /// Yaw in whole turns, within [-1/2, 1/2].
    pub turns: Real<L>,
    /// Speed that the drive has reached [m/s].
    pub speed: Real<L>,
    /// Angle that the steering has reached [rad], or yaw rate of a skid-steered vehicle [rad/s].
    pub steering: Real<L>,
}

impl<L: Lanes> LaneState<L> {
    /// Moves the pose by a step along the yaw that it begins with [unit], and by a yaw rate [rad/s] at so many turns per
    /// radian per second.
    #[inline(always)]
    pub(crate) fn carry_on(&mut self, advance: Real<L>, yaw_rate: Real<L>, turn: Constant) {
        let (sine, cosine) = self.turns.sin_cos_turns();
        let turns = yaw_rate.mul_add(Real::constant(self.x.0, turn), self.turns);
        // A yaw rate that is not finite shows in the position where it does not show in the yaw.
        let [turns, x] = turns.wrap_witnessed(yaw_rate, self.x);
        self.x = advance.mul_add(cosine, x);
        self.y = advance.mul_add(sine, self.y);
        self.turns = turns;
    }
}

/// Body rates of a step, after the ground took its share.
#[derive(Clone, Copy)]
pub struct Rates<L: Lanes> {
    /// Speed asked of the ground, before it took its share [m/s].
    pub speed: Real<L>,
    /// Speed to the left, before the ground took its share [m/s]; 0 of a model that does not tell it.
    pub side_speed: Real<L>,
    /// Yaw rate [rad/s].
    pub yaw_rate: Real<L>,
}

/// What the command asks of the actuators, once the effects on it have acted.
#[derive(Clone, Copy)]
pub struct Asked<L: Lanes> {
    /// Speed of the drive [m/s].
    pub speed: Real<L>,
    /// Angle of the steering [rad], or yaw rate of a skid-steered vehicle [rad/s].
    pub steering: Real<L>,
    /// Acceleration that the drive shall give beside what its speed asks for [m/s2].
    pub acceleration: Real<L>,
}

impl<L: Lanes> Asked<L> {
    /// A speed and an angle.
    #[inline(always)]
    pub fn of([speed, steering]: [Real<L>; 2]) -> Self {
        Self { speed, steering, acceleration: speed.0.real(0.0) }
    }
}

/// Speeds that forces may push a vehicle to [m/s]: far beyond any, near enough that no arithmetic overflows.
const SPEED_DOMAIN_MPS: f64 = 1000.0;
/// Change in a step that limits nothing.
pub(crate) const ENDLESS: f64 = 1e30;

/// What an actuator reaches in a step that can change it by so much.
#[inline(always)]
pub(crate) fn towards<L: Lanes>(asked: Real<L>, reached: Real<L>, change: Constant) -> Real<L> {
    let change = Real::constant(reached.0, change);
    // In this order, what was reached stays NaN once it is.
    asked.max(reached - change).min(reached + change)
}

/// A model made ready for one step length and one unit of length.
#[derive(Clone, Debug)]
pub struct Stepper {
    wheelbase: Constant,
    per_wheelbase: Constant,
    advance: Constant,
    turn: Constant,
    speed_change: Constant,
    steering_change: Constant,
    steering_domain: Constant,
    speed_domain: Constant,
    step: Constant,
    per_step: Constant,
    effects: PreparedEffects,
}

impl Stepper {
    /// Steps of `step_s`, positions in units of `unit_m`.
    pub fn new(model: &Model, step_s: f64, unit_m: f64) -> Self {
        Self {
            wheelbase: Constant::new(model.wheelbase_m),
            per_wheelbase: Constant::new(1.0 / model.wheelbase_m),
            advance: Constant::new(step_s / unit_m),
            turn: Constant::new(step_s / TAU),
            speed_change: Constant::new(model.limits.acceleration_max_mps2 * step_s),
            steering_change: Constant::new(model.limits.steering_rate_max_radps * step_s),
            steering_domain: Constant::new(STEERING_DOMAIN_RAD),
            speed_domain: Constant::new(SPEED_DOMAIN_MPS),
            step: Constant::new(step_s),
            per_step: Constant::new(1.0 / step_s),
            effects: PreparedEffects::new(&model.effects, step_s),
        }
    }

    /// Changes the unit of length.
    pub fn rescale(&mut self, unit_m: f64) {
        self.advance = Constant::new(self.step.value() / unit_m);
    }

    /// Without the limits on acceleration and steering rate.
    pub fn with_instant_actuators(mut self) -> Self {
        let endless = Constant::new(ENDLESS);
        (self.speed_change, self.steering_change) = (endless, endless);
        self
    }

    /// Whether the model has effects; if not, [`Stepper::step_plain`] is the whole step.
    pub fn has_effects(&self) -> bool {
        !self.effects.is_empty()
    }

    /// Whether the actuators follow at once; of a model without effects, [`Stepper::step_bare`] is then the whole step.
    pub fn has_instant_actuators(&self) -> bool {
        self.speed_change.value() >= ENDLESS
    }

    /// How far back [`Stepper::recall`] asks for commands [s].
    pub fn past_s(&self) -> f64 {
        self.effects.past_s()
    }

    /// Whether an effect reads the gradient or the class of the ground.
    pub fn uses_ground(&self) -> bool {
        self.effects.use_ground()
    }

    /// Numbers per vehicle that the effects carry from step to step.
    pub fn n_slots(&self) -> usize {
        self.effects.n_slots()
    }

    /// Fills the memory, [`Stepper::n_slots`] values, as the past leaves it: `past` gives the command that was in
    /// force an age [s] before the start, up to [`Stepper::past_s`]. What is held stays as it was.
    pub fn recall(&self, past: &dyn Fn(f64) -> Command, memory: &mut [f64]) {
        self.effects.recall(past, memory);
    }

    /// Number of accelerations that effects hold against the forces that they met; see [`Stepper::correct_held`].
    pub fn n_held(&self) -> usize {
        self.effects.n_held()
    }

    /// Those accelerations, of all that the memory carries [m/s2].
    pub fn held<'a, T>(&self, memory: &'a mut [T]) -> &'a mut [T] {
        self.effects.held(memory)
    }

    /// Corrects what is held once a step was measured: what makes the vehicle faster than foretold [m/s] is a force that
    /// the integral has met and the model has not.
    #[inline(always)]
    pub fn correct_held<L: Lanes>(&self, memory: &mut [L::Value], faster: Real<L>) {
        self.effects.correct_held(memory, faster);
    }

    /// Lets vehicles begin with a measured speed to the left [m/s] and yaw rate [rad/s], where the third is 1, or as the
    /// model has them, where it is 0.
    pub fn start_motion<V: Copy>(&self, memory: &mut [V], motion: [V; 3]) {
        self.effects.start_motion(memory, motion);
    }

    /// Whether an effect carries how the body moves from step to step; see [`Stepper::start_motion`].
    pub fn carries_motion(&self) -> bool {
        self.effects.carries_motion()
    }

    /// Fills the memory as a command leaves it that was in force for long.
    pub fn fill_steady_state(&self, command: Command, memory: &mut [f64]) {
        let command = [f64::from(command.speed_mps), f64::from(command.steering_rad)];
        self.effects.fill_steady_state(command, memory);
    }

    /// One step of a model without effects whose actuators follow at once.
    #[inline(always)]
    pub fn step_bare<L: Lanes>(
        &self,
        state: &mut LaneState<L>,
        command: [Real<L>; 2],
        ground: &GroundSample<Real<L>>,
    ) -> Rates<L> {
        [state.speed, state.steering] = command;
        self.roll(state, ground)
    }

    /// One step of a model without effects, from a steering angle and to a command within [`STEERING_DOMAIN_RAD`].
    #[inline(always)]
    pub fn step_plain<L: Lanes>(
        &self,
        state: &mut LaneState<L>,
        command: [Real<L>; 2],
        ground: &GroundSample<Real<L>>,
    ) -> Rates<L> {
        self.follow_command(state, command);
        self.roll(state, ground)
    }

    /// Moves the body of a model without effects whose actuators have acted.
    #[inline(always)]
    fn roll<L: Lanes>(&self, state: &mut LaneState<L>, ground: &GroundSample<Real<L>>) -> Rates<L> {
        let lanes = state.x.0;
        let (speed, steering) = (state.speed, state.steering);
        let advance = speed * ground.linear_traction * Real::constant(lanes, self.advance);
        let curving = steering.tan() * ground.angular_traction;
        let yaw_rate = speed * Real::constant(lanes, self.per_wheelbase) * curving;
        state.carry_on(advance, yaw_rate, self.turn);
        Rates { speed, side_speed: lanes.real(0.0), yaw_rate }
    }

    /// One step of the whole model: effects on the command, limits of acceleration and steering rate, effects on
    /// the acceleration and on the motion, traction. `memory` holds [`Stepper::n_slots`] values, `step` counts
    /// from the start.
    #[inline(always)]
    pub fn step<L: Lanes>(
        &self,
        state: &mut LaneState<L>,
        command: [Real<L>; 2],
        ground: &GroundSample<Real<L>>,
        memory: &mut [L::Value],
        step: usize,
    ) -> Rates<L> {
        let asked = self.asked(command, state.speed, memory, step);
        self.follow(state, asked, ground, memory)
    }

    /// The first half of a step: what the command asks of the actuators at a speed that was reached, once the effects
    /// on it have acted.
    #[inline(always)]
    pub fn asked<L: Lanes>(
        &self,
        command: [Real<L>; 2],
        reached_speed: Real<L>,
        memory: &mut [L::Value],
        step: usize,
    ) -> Asked<L> {
        let mut state = CommandStep { asked: Asked::of(command), reached_speed, step };
        self.effects.on_command(memory, &mut state);
        state.asked
    }

    /// The second half of a step: the actuators follow what is asked of them, and the body moves.
    #[inline(always)]
    pub fn follow<L: Lanes>(
        &self,
        state: &mut LaneState<L>,
        asked: Asked<L>,
        ground: &GroundSample<Real<L>>,
        memory: &mut [L::Value],
    ) -> Rates<L> {
        let lanes = state.x.0;
        let reached_speed = state.speed;
        self.actuate(state, [asked.speed, asked.steering]);
        let tangent = state.steering.tan();
        let per_wheelbase = Real::constant(lanes, self.per_wheelbase);
        let turning = |speed: Real<L>| speed * per_wheelbase * tangent;
        self.move_body(state, (asked, reached_speed, tangent), turning, (ground, memory))
    }

    /// [`Stepper::follow`] for a skid-steered vehicle: the second of what is asked is a yaw rate [rad/s], which is
    /// reached at once and at any speed.
    #[inline(always)]
    pub fn follow_yaw_rate<L: Lanes>(
        &self,
        state: &mut LaneState<L>,
        asked: Asked<L>,
        ground: &GroundSample<Real<L>>,
        memory: &mut [L::Value],
    ) -> Rates<L> {
        let straight = state.x.0.real(0.0);
        let reached_speed = state.speed;
        self.actuate(state, [asked.speed, straight]);
        self.move_body(state, (asked, reached_speed, straight), |_| asked.steering, (ground, memory))
    }

    /// Moves a body whose actuators have acted, from the speed before and with the tangent of the steering angle;
    /// `turning` gives the yaw rate at a speed.
    #[inline(always)]
    fn move_body<L: Lanes>(
        &self,
        state: &mut LaneState<L>,
        (asked, reached_speed, steering_tangent): (Asked<L>, Real<L>, Real<L>),
        turning: impl Fn(Real<L>) -> Real<L>,
        (ground, memory): (&GroundSample<Real<L>>, &mut [L::Value]),
    ) -> Rates<L> {
        let lanes = state.x.0;
        let (sine, cosine) = state.turns.sin_cos_turns();
        let mut side_acceleration = lanes.real(0.0);
        if self.effects.drive() {
            let mut driving = Driving {
                acceleration: (state.speed - reached_speed) * Real::constant(lanes, self.per_step),
                side_acceleration,
                acceleration_limit: Real::constant(lanes, self.speed_change)
                    * Real::constant(lanes, self.per_step),
                asked_speed: asked.speed,
                asked_acceleration: asked.acceleration,
                speed: reached_speed,
                steering_tangent,
                yaw_rate: turning(reached_speed),
                heading: [sine, cosine],
                ground: *ground,
                held: lanes.real(0.0),
                withheld: lanes.real(0.0),
                resisted: lanes.real(0.0),
            };
            self.effects.on_drive(memory, &mut driving);
            let step = Real::constant(lanes, self.step);
            let domain = Real::constant(lanes, self.speed_domain);
            state.speed = driving.acceleration.mul_add(step, reached_speed).clamp(-domain, domain);
            side_acceleration = driving.side_acceleration;
        }
        let yaw_rate = turning(state.speed);
        let acceleration = (state.speed - reached_speed) * Real::constant(lanes, self.per_step);
        let lateral = lanes.real(0.0);
        let mut moving = Moving {
            forward: state.speed,
            lateral,
            yaw_rate,
            side_acceleration,
            acceleration,
            steering_tangent,
            wheelbase: Real::constant(lanes, self.wheelbase),
            gained: lanes.real(0.0),
            remembered: [lanes.real(0.0); 3],
        };
        self.effects.on_motion(memory, &mut moving);
        let Moving { forward, lateral, yaw_rate, gained, .. } = moving;
        state.speed = state.speed + gained;
        let share = ground.linear_traction * Real::constant(lanes, self.advance);
        let (forward_step, lateral_step) = (forward * share, lateral * share);
        state.x = forward_step.mul_add(cosine, state.x) - lateral_step * sine;
        state.y = forward_step.mul_add(sine, lateral_step.mul_add(cosine, state.y));
        let yaw_rate = yaw_rate * ground.angular_traction;
        state.turns = yaw_rate.mul_add(Real::constant(lanes, self.turn), state.turns).wrap_turns();
        Rates { speed: forward, side_speed: lateral, yaw_rate }
    }

    #[inline(always)]
    fn actuate<L: Lanes>(&self, state: &mut LaneState<L>, asked: [Real<L>; 2]) {
        self.follow_command(state, asked);
        let domain = Real::constant(state.x.0, self.steering_domain);
        state.steering = state.steering.clamp(-domain, domain);
    }

    /// The actuators go towards what is asked of them, as far as they come in a step.
    #[inline(always)]
    fn follow_command<L: Lanes>(&self, state: &mut LaneState<L>, asked: [Real<L>; 2]) {
        state.speed = towards(asked[0], state.speed, self.speed_change);
        state.steering = towards(asked[1], state.steering, self.steering_change);
    }

    /// One step of one vehicle in metres and radians: the reference. The stepper's unit must be 1 m.
    pub fn step_state(
        &self,
        state: &State,
        command: Command,
        ground: &GroundSample,
        memory: &mut [f64],
        step: usize,
    ) -> State {
        self.step_one(&(*state).into(), command.into(), ground, memory, step).into()
    }
}
