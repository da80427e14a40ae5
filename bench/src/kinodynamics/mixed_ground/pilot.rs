//! The controller with whatever knows the ground, along a line.

use bicycle::effect::{Effect, SpeedLoop, SteerDelay, SteerLag};
use bicycle::lanes::{Instructions, Isa};
use bicycle::{Command, Model, Odometry, Vehicle};
use kinodynamics::{Adaptation, CorrectionConfig, Corrector};
use mppi::{Config, Controller, Costs, Input, Objective, Recovery, ReferencePath, Sampling};
use terrain::GridGeometry;
use traversability::{Risk, RiskMap};

use super::super::machine::{Machine, TICK_S};
use super::super::track::Track;
use super::run::Run;
use super::{KinodynamicsError, Method};

/// Of the horizon: one second in steps of the time between commands. A right model cuts corners with a longer one, whose end
/// outweighs its beginning.
const N_STEPS: usize = 20;
/// Corners of the reference path are so far apart [m].
const SPACING_M: f64 = 0.1;
/// The path begins so far behind the car, and reaches so far beyond the horizon [m].
const MARGIN_M: f64 = 0.5;
/// Edge of a cell and number of headings of the risk map, which is the same everywhere [m].
const CELL_M: f64 = 0.25;
const N_YAWS: usize = 4;
/// Ground around the line on that map [m].
const AROUND_M: f64 = 3.0;
/// Time in which what adapts forgets [s].
const MEMORY_S: f64 = 3.0;

/// Decides along the line.
pub(super) struct Pilot {
    controller: Controller,
    map: RiskMap,
    aid: Aid,
    /// Corners of the path ahead; their memory is kept.
    corners_m: Vec<[f64; 2]>,
    /// Way along the line of where it thinks it is [m].
    pub way_m: f64,
    sent: Command,
    cycle: u64,
}

enum Aid {
    Nothing,
    Behind(Box<Corrector>),
    Inside(Box<Adaptation>),
}

impl Pilot {
    pub(super) fn new(run: &Run<'_>, instructions: Instructions) -> Result<Self, KinodynamicsError> {
        let model = model(run.vehicle);
        let (aid, model) = match (run.method, run.checkpoint) {
            (Method::Adapted, _) => {
                let adaptation = Adaptation::new(model, MEMORY_S);
                let model = adaptation.model().clone();
                (Aid::Inside(Box::new(adaptation)), model)
            }
            (_, Some(checkpoint)) => {
                let corrector = Corrector::new(checkpoint, CorrectionConfig::default(), instructions)?;
                (Aid::Behind(Box::new(corrector)), model)
            }
            (_, None) => (Aid::Nothing, model),
        };
        let controller = Controller::new(config(instructions.isa()), model, run.seed)?;
        let map = RiskMap::constant(around(run.middle), N_YAWS, Risk::NONE);
        let corners_m = Vec::new();
        Ok(Self { controller, map, aid, corners_m, way_m: 0.0, sent: Command::default(), cycle: 0 })
    }

    /// Takes in what the unit measured since the last command.
    pub(super) fn hear(&mut self, machine: &Machine) {
        if let Aid::Behind(corrector) = &mut self.aid {
            corrector.sense(machine.samples());
        }
    }

    /// The command for now.
    pub(super) fn command(
        &mut self,
        run: &Run<'_>,
        odometry: &Odometry,
        now_ns: u64,
    ) -> Result<Command, KinodynamicsError> {
        let [x_m, y_m, _] = odometry.position_m;
        self.way_m = run.middle.project([x_m, y_m], self.way_m, super::run::REACH_M).0;
        self.lay_path(run);
        if let Aid::Inside(adaptation) = &self.aid {
            self.controller.set_model(adaptation.model().clone())?;
        }
        let objective = Objective::Path(ReferencePath {
            points_m: &self.corners_m,
            speed_mps: run.speed_mps,
            tolerance_m: 0.0,
        });
        let elapsed_s = if self.cycle == 0 { 0.0 } else { TICK_S };
        let state = odometry.state();
        let input = Input { state, elapsed_s, map: self.map.view(), objective, cycle: self.cycle };
        let planned = self.controller.decide(&input).command(self.sent);
        self.cycle += 1;
        self.sent = planned;
        match &mut self.aid {
            Aid::Nothing => {}
            Aid::Behind(corrector) => {
                self.sent = corrector.correct(planned, odometry, now_ns).command;
                self.controller.note_followed(self.sent, 0.0);
            }
            Aid::Inside(adaptation) => adaptation.observe(odometry, planned),
        }
        Ok(self.sent)
    }

    fn lay_path(&mut self, run: &Run<'_>) {
        let reach_m = run.speed_mps * TICK_S * N_STEPS as f64 + MARGIN_M;
        let n = ((reach_m + MARGIN_M) / SPACING_M).ceil() as usize;
        let corner = |k: usize| run.middle.place(self.way_m - MARGIN_M + SPACING_M * k as f64).0;
        self.corners_m.clear();
        self.corners_m.extend((0..=n).map(corner));
    }

    /// Strengths that the model has by now, with their names.
    pub(super) fn strengths(&self) -> Vec<(&'static str, f64)> {
        let Aid::Inside(adaptation) = &self.aid else { return Vec::new() };
        let effects = adaptation.model().effects.iter();
        let told = effects.map(|effect| (effect.description().id, effect.values()[0]));
        told.filter(|(id, _)| ["understeer", "rear_slip", "rolling_drag"].contains(id)).collect()
    }
}

/// What is known of the car: its description, with the lags of servo and motor.
pub(super) fn model(vehicle: &Vehicle) -> Model {
    let (servo, drivetrain) = (&vehicle.servo, &vehicle.drivetrain);
    let effects = vec![
        Effect::SteerDelay(SteerDelay { delay_s: servo.delay_s }),
        Effect::SteerLag(SteerLag { time_constant_s: servo.response_s }),
        Effect::SpeedLoop(SpeedLoop { time_constant_s: drivetrain.response_s }),
    ];
    Model { effects, ..Model::of(vehicle) }
}

/// Of a metre across and along the path, squared, per step [s/m2], and of the sampled steering rate [rad/s]. Chosen with a car
/// that is what the controller believes, so that a right model keeps to the line at the speed that is asked for; never with
/// the plant.
const PATH_ACROSS_S_PER_M2: f64 = 200.0;
const PATH_ALONG_S_PER_M2: f64 = 20.0;
const STEERING_STD_RADPS: f64 = 1.0;

/// Settings for a car of this size.
fn config(isa: Isa) -> Config {
    let default = Config::default();
    let costs = Costs {
        path_across_s_per_m2: PATH_ACROSS_S_PER_M2,
        path_along_s_per_m2: PATH_ALONG_S_PER_M2,
        ..default.costs
    };
    let recovery = Recovery { patience_s: f64::INFINITY, ..default.recovery };
    let sampling = Sampling { steering_std: STEERING_STD_RADPS, ..default.sampling };
    Config { n_steps: N_STEPS, step_s: TICK_S, isa, costs, recovery, sampling, ..default }
}

/// The cells around a line.
fn around(line: &Track) -> GridGeometry {
    let extent = |axis: usize| {
        let nodes = line.nodes_m.iter().map(|node| node[axis]);
        nodes.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)])
    };
    let [[west_m, east_m], [south_m, north_m]] = [extent(0), extent(1)];
    let n = |low_m: f64, high_m: f64| ((high_m - low_m + 2.0 * AROUND_M) / CELL_M).ceil() as usize;
    let centre = |low_m: f64, high_m: f64| 0.5 * (low_m + high_m);
    let (n_rows, n_cols) = (n(south_m, north_m), n(west_m, east_m));
    GridGeometry::centred(CELL_M, n_rows, n_cols, centre(west_m, east_m), centre(south_m, north_m))
}
