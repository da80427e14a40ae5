//! What the controller believes: the calibrated simulator, that model repaired by the diagnosis, or with the truth.

use bicycle::{DriveLog, Effect, Model};
use scenarios::{Style, TestMachine, seed_of, test_drive};
use serde::{Deserialize, Serialize};
use sim_to_real::{
    Baseline, ControllerModel, GroundMap, Machine, SensorNoise, Verdict, composed, controller_model, diagnose,
};

use super::gap::{Gap, friction};
use super::{ClosedLoopError, Job, LATERAL_SHARE};

/// What the controller believes of the vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Belief {
    /// The kinematic bicycle, uncalibrated.
    Bare,
    /// What the simulator's own drives have calibrated.
    Nominal,
    /// What the diagnosis of recorded drives of the plant makes of it.
    Repaired,
    /// The same with the effect that the gap amounts to.
    True,
}

impl Belief {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Bare, Self::Nominal, Self::Repaired, Self::True];

    /// Name in files and pictures.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Bare => "bare",
            Self::Nominal => "nominal",
            Self::Repaired => "repaired",
            Self::True => "true",
        }
    }
}

/// Drivers of the simulator's drives, and of the robot's.
const SIM_STYLES: [Style; 4] = [Style::Rich, Style::Rich, Style::Rich, Style::Track];
const REAL_STYLES: [Style; 2] = [Style::Rich, Style::Rich];
/// Words that keep the seeds of the drives apart.
const SIM: u64 = 1;
const REAL: u64 = 2;

/// The simulator's calibration, for all gaps of a machine.
pub(super) struct Simulator {
    described: Machine,
    baseline: Baseline,
}

impl Simulator {
    /// Drives the undeviating plant and calibrates the model on it.
    pub fn calibrate(machine: &TestMachine, seed: u64) -> Result<Self, ClosedLoopError> {
        let drive =
            |(k, &style): (usize, &Style)| test_drive(machine, &[], style, seed_of(seed, &[SIM, k as u64]));
        let logs: Vec<DriveLog> = SIM_STYLES.iter().enumerate().map(drive).collect::<Result<_, _>>()?;
        let described = described(machine);
        let baseline = Baseline::calibrate(&described, &logs, &|_| ())?;
        Ok(Self { described, baseline })
    }

    /// The effects of the calibrated model.
    pub fn calibrated(&self) -> &[Effect] {
        self.baseline.effects_for_control()
    }

    /// Drives the plant with a gap, and diagnoses what was recorded: the verdict, what was announced, and the controller's
    /// model.
    pub fn diagnose(
        &self,
        machine: &TestMachine,
        gap: Gap,
        seed: u64,
    ) -> Result<(Verdict, Vec<Effect>, ControllerModel), ClosedLoopError> {
        let deviations: Vec<_> = gap.deviation(machine).into_iter().collect();
        let drive = |(k, &style): (usize, &Style)| {
            let seed = seed_of(seed, &[REAL, gap as u64, k as u64]);
            test_drive(machine, &deviations, style, seed)
        };
        let logs: Vec<DriveLog> = REAL_STYLES.iter().enumerate().map(drive).collect::<Result<_, _>>()?;
        let diagnosis = diagnose(&self.baseline, &self.described, &logs)?;
        let model = controller_model((&self.baseline, &diagnosis), &self.described, &logs, None)?;
        Ok((diagnosis.answer(gap.name()).verdict, diagnosis.effects().to_vec(), model))
    }

    /// The controller's model.
    pub fn model(&self, machine: &TestMachine, job: Job, repaired: &ControllerModel) -> Model {
        let mut model = Model::of(&machine.vehicle);
        model.limits.lateral_acceleration_max_mps2 = LATERAL_SHARE * 9.81 * friction(machine);
        let nominal = self.baseline.effects_for_control();
        let truth: Vec<Effect> = job.gap.effect(machine).into_iter().collect();
        model.effects = match job.belief {
            Belief::Bare => Vec::new(),
            Belief::Nominal => nominal.to_vec(),
            Belief::Repaired => repaired.effects(),
            Belief::True => composed(nominal, &truth),
        };
        model
    }
}

/// What the owner of the simulator would say of the machine.
fn described(machine: &TestMachine) -> Machine {
    let (sensors, world) = (&machine.sensors, &machine.world);
    let geometry = *world.geometry();
    let n_nodes = [geometry.n_cols, geometry.n_rows];
    let nodes = || (0..n_nodes[0]).flat_map(|i| (0..n_nodes[1]).map(move |j| j * n_nodes[0] + i));
    Machine {
        name: machine.vehicle.name.clone(),
        wheelbase_m: machine.vehicle.geometry.wheelbase_m,
        steering_max_rad: machine.steering_max_rad,
        speed_max_mps: machine.speeds_mps[1],
        noise: Some(SensorNoise {
            position_m: sensors.position_noise_m,
            yaw_rad: sensors.attitude_noise_rad,
            speed_mps: sensors.velocity_noise_mps,
            yaw_rate_radps: sensors.yaw_rate_noise_radps,
        }),
        ground: Some(GroundMap {
            origin_m: geometry.centre_m(geometry.cell(0)),
            resolution_m: geometry.resolution_m,
            n_nodes,
            height_m: nodes().map(|index| world.heights.values()[index]).collect(),
            class: nodes().map(|index| world.patches.values()[index].class as u8).collect(),
        }),
    }
}
