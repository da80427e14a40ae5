//! The mapping as a process: scans become the map of the ground; while learning is silent, also physics' risk map.

use std::collections::VecDeque;

use bicycle::{Model, Odometry, SensorModel, Vehicle};
use navigator::{Assessor, Belief, Config, Jump, Surface, Surveyor, Whereabouts};
use terrain::{Mount, Scan};
use traversability::CvarLevel;

use crate::RuntimeError;
use crate::intake::Intake;
use crate::risk_maker::RiskMaker;
use bus::ages::AgeLimits;
use bus::channel::{Bus, Inlet, MISSION, ODOMETRY, Outlet, RISK, RISK_PHYSICS, SCAN, STUCK, SURFACE};
use bus::clock;
use bus::message::{
    Grid, MissionRecord, OdometryRecord, PointRecord, RiskHeader, ScanHeader, Source, Stamp, StuckRecord,
    SurfaceHeader,
};
use bus::payload::{self, RiskParts};
use bus::status::{Health, Meter, Role};

/// Number of [`SurfaceHeader::event`]: a scan was fused.
pub const FUSED: u64 = 1;
/// Number of [`SurfaceHeader::event`]: the localisation jumped.
pub const JUMPED: u64 = 2;
/// Number of [`RiskHeader::author`]: what was learned.
pub const LEARNED: u64 = 1;
/// Number of [`RiskHeader::author`]: physics alone.
pub const PHYSICS: u64 = 2;

/// Time between two looks at the channels [ns].
const POLL_NS: u64 = 2_000_000;
/// Scans that wait for the odometry after them; of more, the oldest is given up.
const WAITING_MAX: usize = 4;

/// What maps.
pub struct MappingSetup<'a> {
    /// The machine.
    pub vehicle: &'a Vehicle,
    /// Settings of the pipeline.
    pub config: Config,
    /// Share of the worst outcomes to plan for.
    pub level: CvarLevel,
    /// What is believed of the vehicle: limits that plans keep to, and how its sensors misstate its motion.
    pub model: &'a Model,
    /// How long learning may be silent.
    pub ages: AgeLimits,
}

/// Maps until `is_over` says to end.
pub fn run(bus: &Bus, setup: &MappingSetup<'_>, is_over: &dyn Fn() -> bool) -> Result<(), RuntimeError> {
    let mut mapping = Mapping::new(bus, setup)?;
    while !is_over() {
        mapping.look()?;
        clock::sleep_until(clock::now_ns() + POLL_NS);
    }
    Ok(())
}

struct Mapping {
    surveyor: Surveyor,
    mounts: Vec<Mount>,
    waiting: VecDeque<Waiting>,
    wait_max_ns: u64,
    intake: Intake,
    odometry: Inlet<Stamp, OdometryRecord>,
    scans: Inlet<ScanHeader, PointRecord>,
    surfaces: Outlet<SurfaceHeader, [f32; 8]>,
    fallback: Fallback,
    meter: Meter,
    last_scan: Option<Stamp>,
    last_odometry: Option<Stamp>,
    /// Scans that made no map, those of unknown sensors among them.
    n_unmapped: u64,
}

/// A scan that has come before the odometry of after it.
struct Waiting {
    since_ns: u64,
    stamp: Stamp,
    scan: Scan,
}

/// Physics' own risk map, made while nobody hears of learning.
struct Fallback {
    maker: RiskMaker,
    learned: Inlet<RiskHeader, [f32; 4]>,
    missions: Inlet<Stamp, MissionRecord>,
    stuck: Inlet<Stamp, StuckRecord>,
    outlet: Outlet<RiskHeader, [f32; 4]>,
    silence_max_ns: u64,
    began_ns: u64,
}

impl Mapping {
    fn new(bus: &Bus, setup: &MappingSetup<'_>) -> Result<Self, RuntimeError> {
        let MappingSetup { vehicle, config, model, .. } = setup;
        let n_cells = config.elevation.n_rows * config.elevation.n_cols;
        Ok(Self {
            surveyor: Surveyor::new(vehicle, config.elevation, config.guard, Surface::Sensed)?
                .with_sensors(SensorModel::of(&model.effects)),
            mounts: config.sensors.clone(),
            waiting: VecDeque::with_capacity(WAITING_MAX),
            wait_max_ns: clock::nanoseconds(config.guard.odometry_wait_max_s),
            intake: Intake::default(),
            odometry: bus.inlet(&ODOMETRY)?,
            scans: bus.inlet(&SCAN)?,
            surfaces: bus.outlet(&SURFACE, n_cells)?,
            fallback: Fallback::new(bus, setup)?,
            meter: Meter::new(bus, Role::Mapping)?,
            last_scan: None,
            last_odometry: None,
            n_unmapped: 0,
        })
    }

    /// Takes in what has come, and tells what became of it.
    fn look(&mut self) -> Result<(), RuntimeError> {
        let mut odometry = Vec::new();
        self.odometry.poll(|stamp, records| odometry.extend(records.first().map(|record| (*stamp, *record))));
        for (stamp, record) in odometry {
            self.follow(&stamp, &record)?;
        }
        let (waiting, n_unmapped, mounts) = (&mut self.waiting, &mut self.n_unmapped, &self.mounts);
        self.scans.poll(|header, points| {
            let Some(scan) = header.scan(points, mounts) else {
                *n_unmapped += 1;
                return;
            };
            if waiting.len() == WAITING_MAX {
                waiting.pop_front();
                *n_unmapped += 1;
            }
            waiting.push_back(Waiting { since_ns: clock::now_ns(), stamp: header.stamp, scan });
        });
        self.take_waiting()?;
        self.fallback.listen()?;
        self.report()
    }

    fn follow(&mut self, stamp: &Stamp, record: &OdometryRecord) -> Result<(), RuntimeError> {
        self.last_odometry = Some(*stamp);
        let Ok(Some(jump)) = self.intake.show(&mut self.surveyor, stamp, record) else { return Ok(()) };
        let odometry = record.odometry(stamp.valid_at_ns);
        self.surveyor.follow_jump(&odometry, &jump)?;
        let scan = self.last_scan;
        self.tell(&odometry, Event::Jumped(jump), scan)
    }

    /// Fuses the scans for which it is known by now where they were taken, or for which nothing better will come.
    fn take_waiting(&mut self) -> Result<(), RuntimeError> {
        while let Some(Waiting { since_ns, stamp, scan }) = self.waiting.pop_front() {
            let is_over = clock::now_ns().saturating_sub(since_ns) >= self.wait_max_ns;
            let there = match self.surveyor.place(scan.valid_at_ns) {
                Ok(Whereabouts::Ahead(_)) if !is_over => {
                    self.waiting.push_front(Waiting { since_ns, stamp, scan });
                    break;
                }
                Ok(Whereabouts::Between(there) | Whereabouts::Ahead(Some(there))) => Some(there),
                Ok(Whereabouts::Ahead(None) | Whereabouts::Unknown) => {
                    self.surveyor.note_unplaced();
                    None
                }
                Err(_) => None,
            };
            let is_mapped = there.map_or(Ok(false), |there| self.fuse(&there, &stamp, &scan))?;
            self.n_unmapped += u64::from(!is_mapped);
        }
        Ok(())
    }

    /// Returns whether there was anything to map.
    fn fuse(&mut self, there: &Odometry, stamp: &Stamp, scan: &Scan) -> Result<bool, RuntimeError> {
        let began_ns = clock::now_ns();
        if !self.surveyor.fuse(there, scan)? {
            return Ok(false);
        }
        self.last_scan = Some(*stamp);
        self.tell(there, Event::Fused, Some(*stamp))?;
        self.meter.count(began_ns.saturating_sub(stamp.published_at_ns));
        Ok(true)
    }

    /// Writes the map as it is now where its readers will read it.
    fn tell(&mut self, odometry: &Odometry, event: Event, scan: Option<Stamp>) -> Result<(), RuntimeError> {
        let surface = self.surveyor.surface();
        let cells = surface.values();
        let mut loan = self.surfaces.write(cells.len(), |place| payload::cell_numbers(&cells[place]))?;
        let (event, jump) = match event {
            Event::Fused => (FUSED, Jump::NONE),
            Event::Jumped(jump) => (JUMPED, jump),
        };
        let mut header = SurfaceHeader {
            grid: Grid::from(surface.geometry()),
            scan: scan.map_or(Source::default(), |stamp| stamp.source()),
            event,
            content_hash: payload::content_hash(loan.payload()),
            ..SurfaceHeader::default()
        };
        self.intake.tell(&self.surveyor, odometry, &jump, &mut header);
        *loan.header_mut() = header;
        // A jump moves what was seen; it is no news of the ground.
        let valid_at_ns = scan.map_or(odometry.valid_at_ns, |stamp| stamp.valid_at_ns);
        let is_needed = self.fallback.is_needed();
        let told = is_needed.then(|| loan.payload().to_vec());
        header.stamp = self.surfaces.send(loan, valid_at_ns)?;
        told.map_or(Ok(()), |told| self.fallback.speak(&header, &told))
    }

    fn report(&mut self) -> Result<(), RuntimeError> {
        let now_ns = clock::now_ns();
        let age_s =
            |stamp: &Option<Stamp>| stamp.map_or(-1.0, |stamp| clock::age_s(now_ns, stamp.valid_at_ns));
        let age_s = [age_s(&self.last_odometry), age_s(&self.last_scan), -1.0, -1.0];
        let (n_missed, figure) = (self.n_unmapped, self.surveyor.n_jumps() as f64);
        let counts = [self.odometry.counts(), self.scans.counts()];
        let health = Health { age_s, n_missed, figure, ..Health::default() };
        Ok(self.meter.report(now_ns, || counts.into_iter().fold(health, Health::with))?)
    }
}

/// What changed the map.
enum Event {
    Fused,
    Jumped(Jump),
}

impl Fallback {
    fn new(bus: &Bus, setup: &MappingSetup<'_>) -> Result<Self, RuntimeError> {
        let MappingSetup { vehicle, config, level, model, ages } = setup;
        let assessor = Assessor::new(vehicle, &model.limits, config, &Belief::Physics, *level)?;
        Ok(Self {
            maker: RiskMaker::new(assessor, PHYSICS, 0),
            learned: bus.inlet(&RISK)?,
            missions: bus.inlet(&MISSION)?,
            stuck: bus.inlet(&STUCK)?,
            outlet: bus.outlet(&RISK_PHYSICS, risk_elements(config))?,
            silence_max_ns: ages.learning_silence_ns,
            began_ns: clock::now_ns(),
        })
    }

    fn listen(&mut self) -> Result<(), RuntimeError> {
        self.learned.poll(|_, _| ());
        let (maker, mut followed) = (&mut self.maker, Ok(()));
        self.missions.poll(|_, missions| {
            missions.iter().for_each(|mission| {
                followed = std::mem::replace(&mut followed, Ok(())).and_then(|()| maker.follow(mission));
            });
        });
        self.stuck.poll(|stamp, stuck| stuck.iter().for_each(|stuck| maker.note_stuck(stamp, stuck)));
        Ok(followed?)
    }

    fn is_needed(&self) -> bool {
        let heard_at_ns = self.learned.heard_at_ns().unwrap_or(self.began_ns);
        self.maker.has_goal() && clock::now_ns().saturating_sub(heard_at_ns) > self.silence_max_ns
    }

    fn speak(&mut self, header: &SurfaceHeader, cells: &[[f32; 8]]) -> Result<(), RuntimeError> {
        if self.maker.update(header, cells)?.is_ok() {
            send_risk(&mut self.maker, &mut self.outlet, header.stamp.valid_at_ns)?;
        }
        Ok(())
    }
}

/// Elements of the risk maps that settings lead to.
pub(crate) fn risk_elements(config: &Config) -> usize {
    let window = &config.risk_map;
    let geometry = terrain::GridGeometry {
        resolution_m: config.risk_resolution_m(),
        origin: [0, 0],
        n_rows: window.n_rows,
        n_cols: window.n_cols,
    };
    RiskParts::new(&geometry, window.n_yaws).n_elements()
}

/// Writes a maker's map where its readers will read it; nothing before there is one.
pub fn send_risk(
    maker: &mut RiskMaker,
    outlet: &mut Outlet<RiskHeader, [f32; 4]>,
    valid_at_ns: u64,
) -> Result<(), RuntimeError> {
    let (Some(n), Some(writer)) = (maker.n_elements(), maker.writer()) else { return Ok(()) };
    let mut loan = outlet.write(n, writer)?;
    let header = maker.finish(loan.payload_mut())?;
    *loan.header_mut() = header;
    outlet.send(loan, valid_at_ns)?;
    Ok(())
}
