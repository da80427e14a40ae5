//! The same parts, each with its channels.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use bicycle::Model;
use bus::ages::{AgeLimits, Periods};
use bus::channel::{Bus, DECISION, IMU, Inlet, ODOMETRY, ORDER, Outlet, RISK, RISK_PHYSICS, SCAN, SURFACE};
use bus::clock::Clock;
use bus::message::{
    DecisionRecord, ImuRecord, OdometryRecord, OrderHeader, PointRecord, RiskHeader, ScanHeader, Stamp,
    SurfaceHeader,
};
use bus::payload::content_hash;
use navigator::{Belief, Route};
use runtime::control::{Control, ControlSetup};
use runtime::learning::{Learning, LearningSetup};
use runtime::mapping::{Mapping, MappingSetup};
use runtime::mission::{Beginning, Leading, MissionSetup, header_of};
use traversability::CvarLevel;

use super::in_process::{Made, config, decision};
use super::schedule::{BEGAN_NS, Step};
use crate::corrector::CORRECTOR;
use crate::fixture::{ALPHA, Run, SEED, machine, task};

/// The same parts, each with its channels, one after the other as the schedule says.
pub struct Processes {
    time_ns: Arc<AtomicU64>,
    odometry: Outlet<Stamp, OdometryRecord>,
    imu: Outlet<Stamp, ImuRecord>,
    scans: Outlet<ScanHeader, PointRecord>,
    orders: Outlet<OrderHeader, [f64; 2]>,
    leading: Leading,
    mapping: Mapping,
    learning: Learning,
    control: Control,
    surfaces: Inlet<SurfaceHeader, [f32; 8]>,
    risks: [Inlet<RiskHeader, [f32; 4]>; 2],
    decisions: Inlet<Stamp, DecisionRecord>,
    surface: u64,
    _bus: Bus,
    _run: Run,
}

impl Processes {
    pub fn new(ages: AgeLimits) -> Self {
        let run = Run::new();
        let time_ns = Arc::new(AtomicU64::new(BEGAN_NS));
        let bus = Bus::join(&run.name).unwrap().with_clock(Clock::Stepped(Arc::clone(&time_ns)));
        let ((vehicle, _), config, task) = (machine(), config(), task());
        let (model, level) = (Model::of(&vehicle), CvarLevel::new(ALPHA).unwrap());
        let (limits, belief) = (model.limits, Belief::Physics);
        let route = Route::goals(vec![task.goal_m], task.goal_tolerance_m).unwrap();
        let mission = MissionSetup {
            beginning: Beginning::Driving(route),
            tolerance_m: task.goal_tolerance_m,
            model: &model,
            guard: config.guard,
            periods: Periods::default(),
            ages,
            areas: config.areas.clone(),
        };
        let mapping = MappingSetup { vehicle: &vehicle, config: config.clone(), level, model: &model, ages };
        let learning =
            LearningSetup { vehicle: &vehicle, config: config.clone(), belief, checkpoint: 0, level, limits };
        let corrector = Some(Arc::clone(&CORRECTOR));
        let control =
            ControlSetup { model: model.clone(), config, corrector, seed: SEED, period_s: 0.1, ages };
        Self {
            odometry: bus.outlet(&ODOMETRY, 1).unwrap(),
            imu: bus.outlet(&IMU, 16).unwrap(),
            scans: bus.outlet(&SCAN, 1 << 14).unwrap(),
            orders: bus.outlet(&ORDER, 4).unwrap(),
            leading: Leading::new(&bus, mission).unwrap(),
            mapping: Mapping::new(&bus, &mapping).unwrap(),
            learning: Learning::new(&bus, &learning).unwrap(),
            control: Control::new(&bus, control).unwrap(),
            surfaces: bus.inlet(&SURFACE).unwrap(),
            risks: [bus.inlet(&RISK).unwrap(), bus.inlet(&RISK_PHYSICS).unwrap()],
            decisions: bus.inlet(&DECISION).unwrap(),
            surface: 0,
            time_ns,
            _bus: bus,
            _run: run,
        }
    }

    pub fn step(&mut self, at_ns: u64, step: &Step) -> Vec<Made> {
        self.time_ns.store(at_ns, Ordering::Relaxed);
        let mut made = Vec::new();
        match step {
            Step::Odometry(odometry, applied) => {
                let record = OdometryRecord::from(odometry).with_applied(applied);
                self.odometry.send_one(Stamp::default(), record, odometry.valid_at_ns).unwrap();
            }
            Step::Imu(samples) => {
                let element = |place: usize| ImuRecord::from(&samples[place]);
                let loan = self.imu.write(samples.len(), element).unwrap();
                self.imu.send(loan, at_ns).unwrap();
            }
            Step::Scan(scan) => {
                let element = |place: usize| PointRecord::from(&scan.points[place]);
                let mut loan = self.scans.write(scan.points.len(), element).unwrap();
                loan.header_mut().origin_m = scan.origin_m;
                self.scans.send(loan, scan.valid_at_ns).unwrap();
            }
            Step::Order(order) => {
                let (header, points_m) = header_of(order);
                let mut loan = self.orders.write(points_m.len(), |place| points_m[place]).unwrap();
                *loan.header_mut() = header;
                self.orders.send(loan, at_ns).unwrap();
            }
            Step::Lead => self.leading.look().unwrap(),
            Step::Survey => {
                self.mapping.look().unwrap();
                self.surfaces.poll(|header, cells| {
                    assert_eq!(header.content_hash, content_hash(cells));
                    self.surface = header.content_hash;
                });
                made.push(Made::Surface { content: self.surface });
                made.extend(self.told(1));
            }
            Step::Assess => {
                self.learning.look().unwrap();
                made.extend(self.told(0));
            }
            Step::Decide => {
                self.control.cycle(at_ns, 0).unwrap();
                self.decisions.poll(|_, records| made.extend(records.iter().map(decision)));
            }
        }
        made
    }

    fn told(&mut self, map_source: usize) -> Option<Made> {
        let message = self.risks[map_source].newest()?;
        let header = message.header();
        assert_eq!(header.content_hash, content_hash(message.payload()));
        Some(Made::Risk {
            map_source: header.map_source,
            content: header.content_hash,
            surface: header.surface.sequence,
            stuck: header.stuck.sequence,
            times_ns: [header.stamp.valid_at_ns, header.odometry_at_ns],
            goal: header.goal_m.map(f64::to_bits),
        })
    }
}
