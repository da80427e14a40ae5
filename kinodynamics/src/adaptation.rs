//! What ground and tyres do to the vehicle, learned from its odometry while it drives, inside the controller's own model.

use bicycle::effect::{Effect, RearSlip, RollingDrag, Understeer, add_in_order};
use bicycle::{Command, Model, Odometry};

/// Slower than this nothing is told of turning [m/s].
const SPEED_MIN_MPS: f64 = 0.3;
/// Odometry farther apart than this begins anew [s].
const GAP_MAX_S: f64 = 0.25;
/// Share of the kinematic yaw rate by which an oversteering model may exceed it at its fastest.
const OVERSTEER_MAX: f64 = 0.5;
/// What one sample is off by that the strengths do not explain, and how far they are from what was believed, of most
/// vehicles: yaw rate [rad/s] and understeer [s2/m2], leftward speed [m/s] and rear slip [s2/m], acceleration and drag [m/s2].
const UNDERSTEER: [f64; 2] = [0.1, 0.05];
const REAR_SLIP: [f64; 2] = [0.05, 0.02];
const DRAG: [f64; 2] = [2.0, 0.5];

/// Strengths of [`Understeer`], [`RearSlip`] and, where the model has a [`bicycle::effect::SpeedLoop`], [`RollingDrag`], found while
/// driving: each by least squares over what odometry has just shown, of which older samples count less, and held near what
/// the model said before where that shows little. It knows what the ground did to the vehicle so far; of what lies ahead it
/// knows nothing, as [`crate::Corrector`].
#[derive(Clone, Debug)]
pub struct Adaptation {
    model: Model,
    memory_s: f64,
    understeer: Strength,
    rear_slip: Strength,
    drag: Option<Drag>,
    last: Option<(Odometry, Command)>,
}

/// What resists the drive, through a speed controller of this time constant.
#[derive(Clone, Copy, Debug)]
struct Drag {
    strength: Strength,
    time_constant_s: f64,
}

/// y = strength x by least squares.
#[derive(Clone, Copy, Debug)]
struct Strength {
    xy: f64,
    xx: f64,
    /// What it is without a sample, and how many x^2 that counts for.
    believed: f64,
    weight: f64,
}

impl Strength {
    /// `[noise, deviation]` of a sample and of the strength.
    fn new(believed: f64, [noise, deviation]: [f64; 2]) -> Self {
        Self { xy: 0.0, xx: 0.0, believed, weight: (noise / deviation).powi(2) }
    }

    fn note(&mut self, kept: f64, x: f64, y: f64) {
        self.xy = kept * self.xy + x * y;
        self.xx = kept * self.xx + x * x;
    }

    fn value(&self) -> f64 {
        (self.xy + self.weight * self.believed) / (self.xx + self.weight)
    }
}

impl Adaptation {
    /// Of a model, whose strengths are what is believed at first; a sample counts 1/e after `memory_s` [s].
    pub fn new(mut model: Model, memory_s: f64) -> Self {
        let found = |model: &Model, id: &str| {
            model.effects.iter().find(|effect| effect.description().id == id).map(|effect| effect.values()[0])
        };
        let mut believed = |neutral: Effect| {
            found(&model, neutral.description().id).unwrap_or_else(|| {
                add_in_order(&mut model.effects, neutral);
                0.0
            })
        };
        let understeer = believed(Effect::Understeer(Understeer { gradient_s2_per_m2: 0.0 }));
        let rear_slip = believed(Effect::RearSlip(RearSlip { compliance_s2_per_m: 0.0 }));
        let drag = found(&model, "speed_loop").map(|time_constant_s| {
            let neutral = Effect::RollingDrag(RollingDrag { deceleration_mps2: 0.0 });
            let believed = found(&model, "rolling_drag").unwrap_or_else(|| {
                add_in_order(&mut model.effects, neutral);
                0.0
            });
            Drag { strength: Strength::new(believed, DRAG), time_constant_s }
        });
        Self {
            model,
            memory_s,
            understeer: Strength::new(understeer, UNDERSTEER),
            rear_slip: Strength::new(rear_slip, REAR_SLIP),
            drag,
            last: None,
        }
    }

    /// The model with the strengths as they are known by now.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Takes in where the vehicle is, and what it is told to do from now on. What is not finite tells nothing. Does not
    /// allocate.
    pub fn observe(&mut self, odometry: &Odometry, commanded: Command) {
        let Command { speed_mps, steering_rad } = commanded;
        if !(odometry.is_finite() && speed_mps.is_finite() && steering_rad.is_finite()) {
            self.last = None;
            return;
        }
        if let Some((before, told)) = self.last.replace((*odometry, commanded)) {
            let took_s = (odometry.valid_at_ns as f64 - before.valid_at_ns as f64) * 1e-9;
            if took_s > 0.0 && took_s <= GAP_MAX_S {
                self.learn(&before, told, odometry, took_s);
                self.enter();
            }
        }
    }

    fn learn(&mut self, before: &Odometry, told: Command, now: &Odometry, took_s: f64) {
        let kept = libm::exp(-took_s / self.memory_s);
        let speed_mps = now.wheel_speed_mps;
        if speed_mps.abs() >= SPEED_MIN_MPS {
            // yaw rate (1 + K v^2) = v tan(steering) / L; lateral speed = -C v (v yaw_rate).
            let kinematic = speed_mps * libm::tan(now.steering_rad) / self.model.wheelbase_m;
            let turn = speed_mps * speed_mps * now.yaw_rate_radps;
            self.understeer.note(kept, turn, kinematic - now.yaw_rate_radps);
            self.rear_slip.note(kept, turn, -now.velocity_mps[1]);
        }
        if let Some(Drag { strength, time_constant_s }) = &mut self.drag {
            let closed = -libm::expm1(-took_s / time_constant_s.max(1e-6));
            let speed_mps = before.wheel_speed_mps;
            let most_mps = self.model.limits.acceleration_max_mps2 * took_s;
            let wanted_mps = (f64::from(told.speed_mps) - speed_mps) * closed;
            // At the limit of acceleration nothing tells the drive's from the ground's.
            if wanted_mps.abs() < most_mps && speed_mps.abs() >= SPEED_MIN_MPS {
                let missing_mps = speed_mps + wanted_mps - now.wheel_speed_mps;
                strength.note(kept, 1.0, missing_mps / took_s * speed_mps.signum());
            }
        }
    }

    /// Enters the strengths into the model, as far as it may have them.
    fn enter(&mut self) {
        let fastest_mps = self.model.limits.speed_max_mps;
        let least = -OVERSTEER_MAX / (fastest_mps * fastest_mps);
        for effect in &mut self.model.effects {
            let parameter = effect.description().parameters[0];
            let within = |strength: &Strength| strength.value().clamp(parameter.low, parameter.high);
            match effect {
                Effect::Understeer(found) => found.gradient_s2_per_m2 = within(&self.understeer).max(least),
                Effect::RearSlip(found) => found.compliance_s2_per_m = within(&self.rear_slip),
                Effect::RollingDrag(found) => {
                    if let Some(drag) = &self.drag {
                        found.deceleration_mps2 = within(&drag.strength);
                    }
                }
                _ => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use bicycle::Limits;
    use bicycle::effect::SpeedLoop;

    use super::*;

    const WHEELBASE_M: f64 = 0.32;
    const STEP_S: f64 = 0.05;

    fn model() -> Model {
        let limits = Limits {
            speed_max_mps: 4.0,
            reverse_speed_max_mps: 1.0,
            steering_max_rad: 0.6,
            steering_rate_max_radps: 6.0,
            acceleration_max_mps2: 4.0,
            lateral_acceleration_max_mps2: 8.0,
            roll_max_rad: 0.5,
            pitch_max_rad: 0.5,
        };
        let effects = vec![Effect::SpeedLoop(SpeedLoop { time_constant_s: 0.2 })];
        Model { wheelbase_m: WHEELBASE_M, limits, effects }
    }

    /// A steady turn: K = 0.05 s2/m2, C = 0.01 s2/m, and a drag of 0.8 m/s2 behind a loop of 0.2 s.
    fn steady(tick: u64, speed_mps: f64, steering_rad: f64) -> (Odometry, Command) {
        let yaw_rate_radps =
            speed_mps * steering_rad.tan() / WHEELBASE_M / (1.0 + 0.05 * speed_mps * speed_mps);
        let odometry = Odometry {
            valid_at_ns: tick * 50_000_000,
            velocity_mps: [speed_mps, -0.01 * speed_mps * speed_mps * yaw_rate_radps],
            yaw_rate_radps,
            wheel_speed_mps: speed_mps,
            steering_rad,
            ..Odometry::default()
        };
        // Held where (command - v) (1 - exp(-dt / T)) = drag dt.
        let above_mps = 0.8 * STEP_S / (1.0 - (-STEP_S / 0.2f64).exp());
        let speed_mps = (speed_mps + above_mps) as f32;
        (odometry, Command { speed_mps, steering_rad: steering_rad as f32 })
    }

    fn strengths(adaptation: &Adaptation) -> [f64; 3] {
        ["understeer", "rear_slip", "rolling_drag"].map(|id| {
            let effects = adaptation.model().effects.iter();
            effects.filter(|effect| effect.description().id == id).map(|effect| effect.values()[0]).sum()
        })
    }

    #[test]
    fn steady_turns_tell_the_strengths() {
        let mut adaptation = Adaptation::new(model(), 3.0);
        assert_eq!(strengths(&adaptation), [0.0; 3]);
        for tick in 0..400 {
            let (odometry, command) = steady(tick, 2.0, if tick % 40 < 20 { 0.25 } else { -0.2 });
            adaptation.observe(&odometry, command);
        }
        let found = strengths(&adaptation);
        // x = 4 yaw rate, about 5 and 4 m2/s3, over 60 samples: x^2 sums to 1200 beside weights of 4 and 6.25; the drag
        // to 60 beside 16, 0.79 of it.
        for (found, least, most) in
            [(found[0], 0.0495, 0.05), (found[1], 0.0099, 0.01), (found[2], 0.61, 0.66)]
        {
            assert!((least..=most).contains(&found), "{found}");
        }
        assert!(adaptation.model().validate().is_ok());
    }

    #[test]
    fn the_past_fades_and_what_was_believed_comes_back() {
        let mut calibrated = model();
        calibrated.effects.push(Effect::Understeer(Understeer { gradient_s2_per_m2: 0.02 }));
        let mut adaptation = Adaptation::new(calibrated, 1.0);
        for tick in 0..100 {
            let (odometry, command) = steady(tick, 2.0, 0.25);
            adaptation.observe(&odometry, command);
        }
        assert!((strengths(&adaptation)[0] - 0.05).abs() < 1e-3);
        // Straight on for 15 s nothing is told of turning: exp(-15) of 500 is little beside 4.
        for tick in 100..400 {
            let (odometry, command) = steady(tick, 2.0, 0.0);
            adaptation.observe(&odometry, command);
        }
        assert!((strengths(&adaptation)[0] - 0.02).abs() < 1e-4, "{:?}", strengths(&adaptation));
    }

    #[test]
    fn what_tells_nothing_changes_nothing() {
        let mut adaptation = Adaptation::new(model(), 3.0);
        let (odometry, command) = steady(0, 2.0, 0.25);
        adaptation.observe(&odometry, command);
        // Not finite, a gap of a second, a clock that was set back, a vehicle that stands.
        let (after, _) = steady(1, 2.0, 0.25);
        adaptation.observe(&Odometry { yaw_rate_radps: f64::NAN, ..after }, command);
        adaptation.observe(&steady(20, 2.0, 0.25).0, command);
        adaptation.observe(&steady(40, 2.0, 0.25).0, command);
        adaptation.observe(&steady(3, 2.0, 0.25).0, command);
        adaptation.observe(&steady(4, 0.0, 0.25).0, Command { speed_mps: f32::NAN, ..command });
        adaptation.observe(&steady(5, 0.0, 0.25).0, command);
        adaptation.observe(&steady(6, 0.0, 0.25).0, command);
        assert_eq!(strengths(&adaptation), [0.0; 3]);
    }

    #[test]
    fn what_no_model_may_be_is_not_believed() {
        let mut adaptation = Adaptation::new(model(), 3.0);
        for tick in 0..200 {
            let (odometry, command) = steady(tick, 3.0, 0.1);
            let spinning = Odometry { yaw_rate_radps: 6.0, velocity_mps: [3.0, 40.0], ..odometry };
            adaptation.observe(&spinning, command);
        }
        assert_eq!(strengths(&adaptation)[..2], [-0.01, -0.05]);
        assert!(adaptation.model().validate().is_ok());
    }

    #[test]
    fn a_model_without_a_speed_loop_tells_nothing_of_drag() {
        let mut adaptation = Adaptation::new(Model { effects: Vec::new(), ..model() }, 3.0);
        for tick in 0..100 {
            let (odometry, command) = steady(tick, 2.0, 0.25);
            adaptation.observe(&odometry, command);
        }
        let ids: Vec<&str> =
            adaptation.model().effects.iter().map(|effect| effect.description().id).collect();
        assert_eq!(ids, ["understeer", "rear_slip"]);
    }

    #[test]
    fn nothing_is_allocated() {
        let mut adaptation = Adaptation::new(model(), 3.0);
        let samples: Vec<_> = (0..50).map(|tick| steady(tick, 2.0, 0.25)).collect();
        let counted = allocation_counter::measure(|| {
            samples.iter().for_each(|(odometry, command)| adaptation.observe(odometry, *command));
        });
        assert_eq!(counted.count_total, 0);
    }
}
