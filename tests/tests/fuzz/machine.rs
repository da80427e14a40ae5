//! A machine with maps as small as they can be, and a short drive of it as its messages.

use std::sync::LazyLock;

use bicycle::{Command, Decision, Model, Odometry};
use bus::message::{
    CommandRecord, DecisionRecord, Grid, LAYOUT_VERSION, OdometryRecord, PointRecord, RiskHeader, ScanHeader,
    Stamp, SurfaceHeader,
};
use bus::payload::{cell_numbers, content_hash};
use navigator::{
    Activity, Assessor, Belief, Config, Destination, MissionMessage, MovingConfig, NavigatorError, Pilot,
    PilotAges, RiskMessage, RiskMessages, Surface, Surveyor,
};
use runtime::convert::{decision_record, id_of, odometry_message, risk_message};
use runtime::mapping::{FUSED, PHYSICS};
use runtime::risk_maker::RiskMaker;
use runtime::setup::MachineSetup;
use terrain::{RangePoint, Scan, TerrainClass};
use traversability::CvarLevel;

/// Share of the worst outcomes that are planned for.
pub const ALPHA: f64 = 0.6;
/// Decides the samples.
pub const SEED: u64 = 1;
/// Life of the publisher of all messages [ns].
const EPOCH_NS: u64 = 7;

/// The machine: few and large cells, few futures, and short ones.
pub static MACHINE: LazyLock<MachineSetup> = LazyLock::new(|| {
    let vehicle = formats::read_vehicle("pietra_full_size").unwrap();
    let mut config = Config::for_vehicle(&vehicle);
    config.elevation.resolution_m = 0.8;
    config.elevation.recentre_m = 3.2;
    config.elevation.gap_radius_m = 1.6;
    (config.elevation.n_rows, config.elevation.n_cols) = (22, 22);
    config.risk_map.recentre_m = 3.2;
    (config.risk_map.n_rows, config.risk_map.n_cols, config.risk_map.n_yaws) = (8, 8, 2);
    (config.controller.n_rollouts, config.controller.n_steps, config.controller.n_threads) = (64, 5, 1);
    MachineSetup { model: Model::of(&vehicle), vehicle, config }
});

/// Time of a cycle [ns].
pub fn at_ns(cycle: u64) -> u64 {
    1_000_000_000 + 100_000_000 * cycle
}

/// Stamp of a message of a cycle.
pub fn stamped(cycle: u64) -> Stamp {
    Stamp {
        layout_version: LAYOUT_VERSION,
        epoch_ns: EPOCH_NS,
        sequence: cycle + 1,
        valid_at_ns: at_ns(cycle),
        published_at_ns: at_ns(cycle),
        ..Stamp::default()
    }
}

/// Where the drive leads.
pub fn goal() -> Destination {
    Destination { goal_m: [2.0, 1.0], tolerance_m: 0.3 }
}

/// A controller that has seen nothing and is told, once and for all, to drive there.
pub fn pilot() -> Pilot {
    pilot_with(&MACHINE.config)
}

/// The same who keeps away from what moves.
pub fn pilot_among_people() -> Pilot {
    pilot_with(&Config { moving: Some(MovingConfig::default()), ..MACHINE.config.clone() })
}

fn pilot_with(config: &Config) -> Pilot {
    let ages = PilotAges { mission_ns: u64::MAX, ..PilotAges::default() };
    let mut pilot = Pilot::new(MACHINE.model.clone(), config, SEED).unwrap().with_ages(ages);
    pilot.hear_mission(&MissionMessage {
        id: id_of(stamped(0).source()),
        valid_at_ns: at_ns(0),
        activity: Activity::Drive,
        is_over: false,
        destination: Some(goal()),
        path: None,
        level: None,
    });
    pilot
}

/// Shows a pilot where the machine is.
pub fn show(pilot: &mut Pilot, odometry: &Odometry) {
    let stamp = Stamp { valid_at_ns: odometry.valid_at_ns, ..stamped(0) };
    pilot.hear_odometry(&odometry_message(&stamp, &OdometryRecord::from(odometry)));
}

/// The only map that there is: one of physics.
pub fn only(map: RiskMessage<'_>) -> RiskMessages<'_> {
    RiskMessages { learned: None, physics: Some(map) }
}

/// What judges the ground, before it has seen any.
pub fn judge() -> RiskMaker {
    let MachineSetup { vehicle, model, config } = &*MACHINE;
    let level = CvarLevel::new(ALPHA).unwrap();
    let assessor = Assessor::new(vehicle, &model.limits, config, &Belief::Physics, level).unwrap();
    RiskMaker::new(assessor, PHYSICS, 0)
}

/// The messages of a drive of two decisions, each as its process made it.
pub struct Drive {
    pub scan: (ScanHeader, Vec<PointRecord>),
    pub surface: (SurfaceHeader, Vec<[f32; 8]>),
    pub risk: (RiskHeader, Vec<[f32; 4]>),
    pub decisions: Vec<(Stamp, DecisionRecord)>,
}

static DRIVE: LazyLock<Drive> = LazyLock::new(Drive::made);

impl Drive {
    /// The drive.
    pub fn get() -> &'static Self {
        &DRIVE
    }

    /// Where the machine is in a cycle.
    pub fn odometry(cycle: u64) -> Odometry {
        Odometry {
            valid_at_ns: at_ns(cycle),
            position_m: [0.05 * cycle as f64, 0.0, 0.4],
            velocity_mps: [0.5, 0.0],
            wheel_speed_mps: 0.5,
            ..Odometry::default()
        }
    }

    /// The scan as the mapping takes it.
    pub fn scan(&self) -> Scan {
        self.scan.0.scan(&self.scan.1, &[]).unwrap()
    }

    /// The map of the ground as a message.
    pub fn surface(&self) -> (&SurfaceHeader, &[[f32; 8]]) {
        (&self.surface.0, &self.surface.1)
    }

    /// What the controller drives on.
    pub fn map(&self) -> RiskMessage<'_> {
        risk_message(&self.risk.0, &self.risk.1)
    }

    /// A risk map as its maker writes it into a message.
    pub fn risk_of(maker: &mut RiskMaker) -> Result<(RiskHeader, Vec<[f32; 4]>), NavigatorError> {
        let (Some(n), Some(writer)) = (maker.n_elements(), maker.writer()) else {
            return Ok((RiskHeader::default(), Vec::new()));
        };
        let mut elements: Vec<[f32; 4]> = (0..n).map(writer).collect();
        Ok((maker.finish(&mut elements)?, elements))
    }

    fn made() -> Self {
        let scan = scanned();
        let surface = surveyed(&scan);
        let mut maker = judge();
        maker.set_destination(goal());
        maker.update(&surface.0, &surface.1).unwrap().unwrap();
        let (header, elements) = Self::risk_of(&mut maker).unwrap();
        let risk = (RiskHeader { stamp: stamped(1), ..header }, elements);
        let mut drive = Self { scan, surface, risk, decisions: Vec::new() };
        drive.decisions = drive.decided();
        drive
    }

    /// Two decisions: on the map, and without one.
    fn decided(&self) -> Vec<(Stamp, DecisionRecord)> {
        let mut pilot = pilot();
        let mut decide = |cycle: u64, has_map: bool| {
            let record = OdometryRecord::from(&Self::odometry(cycle));
            pilot.hear_odometry(&odometry_message(&stamped(cycle), &record));
            pilot.use_rollouts(64);
            let maps = if has_map { only(self.map()) } else { RiskMessages::default() };
            (stamped(cycle), decision_record(&pilot.answer(at_ns(cycle), &maps)))
        };
        vec![decide(1, true), decide(2, false)]
    }
}

/// Rows of returns from the ground around the machine, and a bush.
fn scanned() -> (ScanHeader, Vec<PointRecord>) {
    let header = ScanHeader { stamp: stamped(1), origin_m: [1.0, 0.0, 1.5], ..ScanHeader::default() };
    let ground = (0..40).map(|k| [(k % 8) as f32 - 3.5, (k / 8) as f32 - 2.0, -0.4]);
    let point = |position_m, class| PointRecord::from(&RangePoint { position_m, class });
    let mut points: Vec<_> = ground.map(|at_m| point(at_m, TerrainClass::Open)).collect();
    points.push(point([3.0, 1.0, 0.2], TerrainClass::Vegetation));
    (header, points)
}

fn surveyed((header, points): &(ScanHeader, Vec<PointRecord>)) -> (SurfaceHeader, Vec<[f32; 8]>) {
    let MachineSetup { vehicle, config, .. } = &*MACHINE;
    let mut surveyor = Surveyor::new(vehicle, config.elevation, config.guard, Surface::Sensed).unwrap();
    let odometry = Drive::odometry(1);
    assert!(surveyor.fuse(&odometry, &header.scan(points, &[]).unwrap()).unwrap());
    let surface = surveyor.surface();
    let cells: Vec<[f32; 8]> = surface.values().iter().map(cell_numbers).collect();
    let told = SurfaceHeader {
        stamp: stamped(1),
        grid: Grid::from(surface.geometry()),
        scan: header.stamp.source(),
        odometry: OdometryRecord::from(&odometry),
        odometry_at_ns: odometry.valid_at_ns,
        event: FUSED,
        content_hash: content_hash(&cells),
        ..SurfaceHeader::default()
    };
    (told, cells)
}

/// A command that the drive's machine can carry out.
pub fn whole_command() -> CommandRecord {
    CommandRecord::from(&Decision::Drive(Command { speed_mps: 0.5, steering_rad: 0.1 }))
}
