//! The mapping as a process: scans become the map of the ground; while learning is silent, also physics' risk map.

use std::collections::VecDeque;

use bicycle::{Model, SensorModel, Vehicle};
use navigator::{Assessor, Belief, Config, MessageId, StandIn, Surface, Surveyor, TracksMessage};
use traversability::CvarLevel;

use crate::RuntimeError;
use crate::convert::{odometry_message, scan_message, surface_record, track_record, tracks_header};
use crate::intake::Intake;
use crate::risk_maker::RiskMaker;
use bus::ages::AgeLimits;
use bus::channel::{Bus, Inlet, MISSION, ODOMETRY, Outlet, RISK, RISK_PHYSICS, SCAN, STUCK, SURFACE, TRACKS};
use bus::clock::{self, Clock};
use bus::message::{
    MissionRecord, OdometryRecord, PointRecord, RiskHeader, ScanHeader, Stamp, StuckRecord, SurfaceHeader,
    TRACKS_MAX, TrackRecord, TracksHeader,
};
use bus::payload::{self, RiskParts};
use bus::status::{Health, Meter, Role};

/// Number of [`SurfaceHeader::event`]: a scan was fused.
pub const FUSED: u64 = 1;
/// Number of [`SurfaceHeader::event`]: the localisation jumped.
pub const JUMPED: u64 = 2;
/// Number of [`RiskHeader::map_source`]: what was learned.
pub const LEARNED: u64 = 1;
/// Number of [`RiskHeader::map_source`]: physics alone.
pub const PHYSICS: u64 = 2;

/// Time between two looks at the channels [ns].
const POLL_NS: u64 = 2_000_000;
/// Scans whose time of sending is remembered: as many as may wait to be mapped.
const SCANS_KEPT: usize = 4;

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

/// The surveyor and its channels, stepped by whoever has its clock.
pub struct Mapping {
    clock: Clock,
    surveyor: Surveyor,
    intake: Intake,
    odometry: Inlet<Stamp, OdometryRecord>,
    scans: Inlet<ScanHeader, PointRecord>,
    surfaces: Outlet<SurfaceHeader, [f32; 8]>,
    /// Where what moves is tracked.
    tracks: Option<Outlet<TracksHeader, TrackRecord>>,
    fallback: Fallback,
    meter: Meter,
    /// When scans of late were sent [ns].
    sent: VecDeque<(MessageId, u64)>,
    /// When the newest scan was taken that was mapped, and the newest odometry [ns].
    newest_ns: [Option<u64>; 2],
}

/// Physics' own risk map, made while nobody hears of learning.
struct Fallback {
    maker: RiskMaker,
    stand_in: StandIn,
    learned: Inlet<RiskHeader, [f32; 4]>,
    missions: Inlet<Stamp, MissionRecord>,
    stuck: Inlet<Stamp, StuckRecord>,
    outlet: Outlet<RiskHeader, [f32; 4]>,
}

impl Mapping {
    /// Nothing has been mapped yet.
    ///
    /// # Errors
    /// A channel that cannot be used, settings that cannot be.
    pub fn new(bus: &Bus, setup: &MappingSetup<'_>) -> Result<Self, RuntimeError> {
        let MappingSetup { vehicle, config, model, .. } = setup;
        let n_cells = config.elevation.n_rows * config.elevation.n_cols;
        Ok(Self {
            clock: bus.clock().clone(),
            surveyor: Surveyor::new(vehicle, config.elevation, config.guard, Surface::Sensed)?
                .with_sensors(SensorModel::of(&model.effects))
                .with_mounts(config.sensors.clone())
                .with_moving(config.moving.as_ref())?,
            intake: Intake::default(),
            odometry: bus.inlet(&ODOMETRY)?,
            scans: bus.inlet(&SCAN)?,
            surfaces: bus.outlet(&SURFACE, n_cells)?,
            tracks: config.moving.map(|_| bus.outlet(&TRACKS, TRACKS_MAX)).transpose()?,
            fallback: Fallback::new(bus, setup)?,
            meter: Meter::new(bus, Role::Mapping)?,
            sent: VecDeque::with_capacity(SCANS_KEPT),
            newest_ns: [None; 2],
        })
    }

    /// Takes in what has come, and tells what became of it.
    pub fn look(&mut self) -> Result<(), RuntimeError> {
        let now_ns = self.clock.now_ns();
        let mut odometry = Vec::new();
        self.odometry.poll(|stamp, records| odometry.extend(records.first().map(|record| (*stamp, *record))));
        for (stamp, record) in odometry {
            self.intake.note(&stamp, &record);
            self.newest_ns[1] = Some(stamp.valid_at_ns);
            if let Some(header) = self.surveyor.hear_odometry(&odometry_message(&stamp, &record))? {
                self.tell(&header, now_ns)?;
            }
        }
        let (surveyor, sent) = (&mut self.surveyor, &mut self.sent);
        self.scans.poll(|header, points| {
            let message = scan_message(header, points);
            if sent.len() == SCANS_KEPT {
                sent.pop_front();
            }
            sent.push_back((message.id, header.stamp.published_at_ns));
            surveyor.hear_scan(message, now_ns);
        });
        while let Some(header) = self.surveyor.next_surface(now_ns)? {
            self.newest_ns[0] = Some(header.valid_at_ns);
            let sent_at_ns = self.sent.iter().find(|(id, _)| *id == header.scan).map(|(_, at_ns)| *at_ns);
            self.meter.count(now_ns.saturating_sub(sent_at_ns.unwrap_or(now_ns)));
            // First, so that nobody has a map of a scan and not what moves in it.
            if let Some(message) = self.surveyor.tracks(&header) {
                self.tell_tracks(&message)?;
            }
            self.tell(&header, now_ns)?;
        }
        self.fallback.listen(now_ns)?;
        self.report()
    }

    fn tell_tracks(&mut self, message: &TracksMessage) -> Result<(), RuntimeError> {
        let Some(outlet) = &mut self.tracks else { return Ok(()) };
        let tracks = message.tracks();
        let mut loan = outlet.write(tracks.len(), |place| track_record(&tracks[place]))?;
        *loan.header_mut() = tracks_header(message);
        outlet.send(loan, message.valid_at_ns)?;
        Ok(())
    }

    /// Writes the map as it is now where its readers will read it.
    fn tell(&mut self, header: &navigator::SurfaceHeader, now_ns: u64) -> Result<(), RuntimeError> {
        let surface = self.surveyor.surface();
        let cells = surface.values();
        let mut loan = self.surfaces.write(cells.len(), |place| payload::cell_numbers(&cells[place]))?;
        let mut record = SurfaceHeader {
            odometry_hash: self.intake.take_hash(),
            content_hash: payload::content_hash(loan.payload()),
            ..surface_record(header, surface.geometry())
        };
        *loan.header_mut() = record;
        let told = self.fallback.is_needed(now_ns).then(|| loan.payload().to_vec());
        record.stamp = self.surfaces.send(loan, header.valid_at_ns)?;
        self.fallback.maker.hear_surface(&record);
        told.map_or(Ok(()), |told| self.fallback.speak(&record, &told))
    }

    fn report(&mut self) -> Result<(), RuntimeError> {
        let now_ns = self.clock.now_ns();
        let [scan_s, odometry_s] =
            self.newest_ns.map(|at_ns| at_ns.map_or(-1.0, |at_ns| clock::age_s(now_ns, at_ns)));
        let age_s = [odometry_s, scan_s, -1.0, -1.0];
        let (n_missed, figure) = (self.surveyor.n_unmapped(), self.surveyor.n_jumps() as f64);
        let counts = [self.odometry.counts(), self.scans.counts()];
        let health = Health { age_s, n_missed, figure, ..Health::default() };
        Ok(self.meter.report(now_ns, || counts.into_iter().fold(health, Health::with))?)
    }
}

impl Fallback {
    fn new(bus: &Bus, setup: &MappingSetup<'_>) -> Result<Self, RuntimeError> {
        let MappingSetup { vehicle, config, level, model, ages } = setup;
        let assessor = Assessor::new(vehicle, &model.limits, config, &Belief::Physics, *level)?;
        Ok(Self {
            maker: RiskMaker::new(assessor, PHYSICS, 0),
            stand_in: StandIn::new(bus.clock().now_ns(), ages.learning_silence_ns),
            learned: bus.inlet(&RISK)?,
            missions: bus.inlet(&MISSION)?,
            stuck: bus.inlet(&STUCK)?,
            outlet: bus.outlet(&RISK_PHYSICS, risk_elements(config))?,
        })
    }

    fn listen(&mut self, now_ns: u64) -> Result<(), RuntimeError> {
        let stand_in = &mut self.stand_in;
        self.learned.poll(|_, _| stand_in.note_heard(now_ns));
        let maker = &mut self.maker;
        self.stuck.poll(|stamp, stuck| stuck.iter().for_each(|stuck| maker.note_stuck(stamp, stuck)));
        Ok(maker.hear_missions(&mut self.missions)?)
    }

    fn is_needed(&self, now_ns: u64) -> bool {
        self.maker.has_goal() && self.stand_in.is_needed(now_ns)
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
    RiskParts::new(&geometry, window.n_yaws, config.cost_to_go.n_headings()).n_elements()
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
