//! Every message that goes over a channel: its numbers are put at the edges of what they can be, its payload has other
//! lengths, and what is admitted does the work that messages do.

use std::sync::LazyLock;

use bicycle::Command;
use bus::ages::Periods;
use bus::channel::{self, Channel, Element, Header};
use bus::layout::Scalar;
use bus::message::{
    CheckpointHeader, CommandRecord, DecisionRecord, Grid, ImuRecord, MissionRecord, OdometryRecord,
    OrderHeader, PlanRecord, RiskHeader, ScanHeader, StatusRecord, StuckRecord, SurfaceHeader, TrackRecord,
    TracksHeader, layouts,
};
use bus::payload::{HEADINGS, RiskParts, surface_map};
use bus::status::Role;
use bus::watchdog::Watchdog;
use bytemuck::{AnyBitPattern, NoUninit};
use evidential::Checkpoint;
use formats::DriveTopics;
use foxglove::Context;
use navigator::{
    Guard, GuardConfig, Instruction, MessageId, Mission, MissionMessage, Order, Route, Said, Surface,
    Surveyor,
};
use rand::RngExt;
use runtime::ages::{self, AskedAges};
use runtime::convert::{mission_message, risk_message, tracks_message};
use runtime::mission::{order_of, record_of, said_by};
use runtime::timing::Timing;
use terrain::{Mount, Pose};

use crate::harness::{Fate, Reader, Rng};
use crate::machine::{Drive, MACHINE, at_ns, goal, judge, only, pilot, pilot_among_people, show, stamped};
use crate::mutate::{self, once_in};
use crate::networks;

/// Where the numbers of a record lie.
pub fn places(record: &str) -> Vec<(usize, Scalar)> {
    let all = layouts();
    let layout = all.iter().find(|layout| layout.name == record).unwrap();
    let mut places = Vec::new();
    for field in &layout.fields {
        match field.scalar {
            Scalar::Record(inner) => {
                let size = all.iter().find(|layout| layout.name == inner).unwrap().size;
                for k in 0..field.count {
                    places
                        .extend(self::places(inner).iter().map(|(at, s)| (field.offset + k * size + at, *s)));
                }
            }
            scalar => {
                let width = if matches!(scalar, Scalar::F32 | Scalar::U32) { 4 } else { 8 };
                places.extend((0..field.count).map(|k| (field.offset + k * width, scalar)));
            }
        }
    }
    places
}

/// A message that is as it should be, and what it is made of.
#[derive(Clone)]
pub struct Whole {
    header: Vec<u8>,
    header_places: Vec<(usize, Scalar)>,
    payload: Vec<u8>,
    element_bytes: usize,
    element_places: Vec<(usize, Scalar)>,
}

impl Whole {
    fn new<H: NoUninit, T: NoUninit>(
        (header, name): (&H, &str),
        payload: &[T],
        element_places: Vec<(usize, Scalar)>,
    ) -> Self {
        Self {
            header: bytemuck::bytes_of(header).to_vec(),
            header_places: places(name),
            payload: bytemuck::cast_slice(payload).to_vec(),
            element_bytes: size_of::<T>(),
            element_places,
        }
    }

    /// A message of one record under a stamp.
    fn one<T: NoUninit>(record: T, name: &str) -> Self {
        Self::new((&stamped(1), "Stamp"), &[record], places(name))
    }

    /// The same under another header, with as many elements as that wants.
    fn under(&self, header: &impl NoUninit, n_elements: usize) -> Self {
        let payload = self.payload.iter().copied().cycle().take(n_elements * self.element_bytes).collect();
        Self { header: bytemuck::bytes_of(header).to_vec(), payload, ..self.clone() }
    }

    /// Header, then payload, of which numbers or lengths are broken.
    fn broken(&self, rng: &mut Rng) -> Vec<u8> {
        let (mut header, mut payload) = (self.header.clone(), self.payload.clone());
        mutate::scalars(rng, &mut header, &self.header_places);
        let n_elements = payload.len() / self.element_bytes;
        for _ in 0..rng.random_range(0..3) {
            let Some(last) = n_elements.checked_sub(1) else { break };
            let start = self.element_bytes * rng.random_range(0..=last);
            mutate::scalars(rng, &mut payload[start..start + self.element_bytes], &self.element_places);
        }
        match rng.random_range(0..16) {
            0 => payload.truncate(self.element_bytes * rng.random_range(0..=n_elements)),
            1 => payload.extend(vec![0; self.element_bytes * rng.random_range(1..4)]),
            2 => mutate::bytes(rng, &mut header),
            3 => mutate::bytes(rng, &mut payload),
            _ => {}
        }
        header.resize(self.header.len(), 0);
        [header, payload].concat()
    }
}

/// Header and payload out of bytes, as they would lie in shared memory.
fn parts<H: AnyBitPattern, T: AnyBitPattern>(input: &[u8]) -> (H, Vec<T>) {
    let (header, rest) = input.split_at(size_of::<H>());
    let payload = rest.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect();
    (bytemuck::pod_read_unaligned(header), payload)
}

/// Checks messages as every reader of the channel does, and has what is admitted used.
fn reader<H: Header, T: Element>(
    channel: Channel<H, T>,
    mut use_it: impl FnMut(&H, &[T]) + 'static,
) -> Reader {
    Box::new(move |input| {
        let (header, payload) = parts::<H, T>(input);
        let fate = Fate::of(&(channel.check)(&header, &payload));
        if fate == Fate::Taken {
            use_it(&header, &payload);
        }
        fate
    })
}

static ODOMETRY: LazyLock<Whole> =
    LazyLock::new(|| Whole::one(OdometryRecord::from(&Drive::odometry(1)), "OdometryRecord"));

pub fn odometry(rng: &mut Rng) -> Vec<u8> {
    ODOMETRY.broken(rng)
}

/// Between two that are whole, so that what it leaves behind is seen.
pub fn read_odometry() -> Reader {
    let (drive, topics) = (Drive::get(), DriveTopics::new(&Context::new()));
    reader(channel::ODOMETRY, move |stamp, records| {
        let odometry = records[0].odometry(stamp.valid_at_ns);
        let mut guard = Guard::new(GuardConfig::default());
        let mut pilot = pilot();
        for odometry in [Drive::odometry(0), odometry, Drive::odometry(2)] {
            guard.admit_odometry(&odometry).ok();
            show(&mut pilot, &odometry);
        }
        guard.check(at_ns(2)).ok();
        let mut message = drive.map();
        message.header.frame_at_ns = at_ns(1);
        let (map, _) = message.content.unwrap();
        pilot.answer(at_ns(3), &only(message));
        let [x_m, y_m, z_m] = odometry.position_m;
        let [roll_rad, pitch_rad, yaw_rad] = odometry.attitude_rad;
        topics.pose(stamp.valid_at_ns, &Pose { x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad });
        topics.risk(stamp.valid_at_ns, &map, yaw_rad);
    })
}

static IMU: LazyLock<Whole> = LazyLock::new(|| {
    let sample = |valid_at_ns| ImuRecord {
        valid_at_ns,
        acceleration_mps2: [0.1, 0.0, 9.81],
        angular_rate_radps: [0.0, 0.0, 0.2],
    };
    Whole::new((&stamped(1), "Stamp"), &[sample(at_ns(0)), sample(at_ns(1))], places("ImuRecord"))
});

pub fn imu(rng: &mut Rng) -> Vec<u8> {
    IMU.broken(rng)
}

/// Whoever reads them may count on order and numbers.
pub fn read_imu() -> Reader {
    reader(channel::IMU, |_: &bus::message::Stamp, samples: &[ImuRecord]| {
        assert!(samples.is_sorted_by_key(|sample| sample.valid_at_ns) && !samples.is_empty());
        let numbers = samples
            .iter()
            .flat_map(|sample| sample.acceleration_mps2.into_iter().chain(sample.angular_rate_radps));
        assert!(numbers.into_iter().all(f32::is_finite));
    })
}

static SCAN: LazyLock<Whole> = LazyLock::new(|| {
    let drive = Drive::get();
    Whole::new((&drive.scan.0, "ScanHeader"), &drive.scan.1, places("PointRecord"))
});

pub fn scan(rng: &mut Rng) -> Vec<u8> {
    SCAN.broken(rng)
}

pub fn read_scan() -> Reader {
    let (drive, topics) = (Drive::get(), DriveTopics::new(&Context::new()));
    reader(channel::SCAN, move |header: &ScanHeader, points| {
        let mount = Mount { position_m: [0.1, 0.0, 0.2], attitude_rad: [0.0, 0.2, 1.0], ..Mount::default() };
        let Some(scan) = header.scan(points, &[mount]) else { return };
        topics.scan(header.stamp.valid_at_ns, &scan);
        let (vehicle, config) = (&MACHINE.vehicle, &MACHINE.config);
        let mut surveyor = Surveyor::new(vehicle, config.elevation, config.guard, Surface::Sensed).unwrap();
        for scan in [&scan, &drive.scan()] {
            surveyor.fuse(&Drive::odometry(1), scan).unwrap();
        }
    })
}

/// Numbers of an element of so many f32.
fn floats(n: usize) -> Vec<(usize, Scalar)> {
    (0..n).map(|k| (4 * k, Scalar::F32)).collect()
}

static SURFACE: LazyLock<Whole> = LazyLock::new(|| {
    let drive = Drive::get();
    Whole::new((&drive.surface.0, "SurfaceHeader"), &drive.surface.1, floats(8))
});

/// A window around the vehicle with sides that fit nothing else, down to a single cell.
fn any_shape(rng: &mut Rng, grid: &mut Grid) {
    [grid.n_cols, grid.n_rows] = [(); 2].map(|()| rng.random_range(1..12));
    grid.origin = [grid.n_cols, grid.n_rows].map(|n| -(n as i64) / 2);
}

pub fn surface(rng: &mut Rng) -> Vec<u8> {
    let mut header = Drive::get().surface.0;
    if once_in(rng, 2) {
        any_shape(rng, &mut header.grid);
    }
    SURFACE.under(&header, (header.grid.n_rows * header.grid.n_cols) as usize).broken(rng)
}

/// Between two that are whole.
pub fn read_surface() -> Reader {
    let (drive, topics) = (Drive::get(), DriveTopics::new(&Context::new()));
    reader(channel::SURFACE, move |header: &SurfaceHeader, cells| {
        let mut maker = judge();
        maker.set_destination(goal());
        for (header, cells) in
            [(&drive.surface.0, drive.surface.1.as_slice()), (header, cells), drive.surface()]
        {
            // A map of another resolution than the machine's ends the process with an error: it is not this machine's.
            let Ok(Ok(())) = maker.update(header, cells) else { break };
            Drive::risk_of(&mut maker).unwrap();
        }
        if let Some(map) = surface_map(header, cells) {
            topics.elevation(header.stamp.valid_at_ns, &map);
        }
    })
}

static RISK: LazyLock<Whole> = LazyLock::new(|| {
    let drive = Drive::get();
    Whole::new((&drive.risk.0, "RiskHeader"), &drive.risk.1, floats(4))
});

pub fn risk(rng: &mut Rng) -> Vec<u8> {
    let mut header = Drive::get().risk.0;
    if once_in(rng, 2) {
        any_shape(rng, &mut header.grid);
        header.n_yaws = rng.random_range(1..4);
        header.n_headings = [0, HEADINGS as u64][rng.random_range(0..2)];
    }
    let [n_yaws, n_headings] = [header.n_yaws, header.n_headings].map(|n| n as usize);
    let parts = RiskParts::new(&header.grid.geometry().unwrap(), n_yaws, n_headings);
    RISK.under(&header, parts.n_elements()).broken(rng)
}

pub fn read_risk() -> Reader {
    let topics = DriveTopics::new(&Context::new());
    reader(channel::RISK, move |header: &RiskHeader, elements| {
        let message = risk_message(header, elements);
        topics.risk(header.stamp.valid_at_ns, &message.content.unwrap().0, 0.5);
        let mut pilot = pilot();
        for k in 0..3 {
            show(&mut pilot, &Drive::odometry(k));
            pilot.answer(at_ns(k), &only(message));
        }
    })
}

static COMMAND: LazyLock<Whole> = LazyLock::new(|| {
    let drive = CommandRecord {
        speed_mps: 0.5,
        steering_rad: 0.1,
        decision: 1,
        reason: 0,
        odometry_at_ns: at_ns(0),
        scan_at_ns: at_ns(0),
    };
    Whole::one(drive, "CommandRecord")
});

pub fn command(rng: &mut Rng) -> Vec<u8> {
    COMMAND.broken(rng)
}

pub fn read_command() -> Reader {
    let limits = MACHINE.vehicle.limits;
    let ages = ages::limits(&Periods::default(), &GuardConfig::default(), &AskedAges::default()).unwrap();
    reader(channel::COMMAND, move |stamp, records: &[CommandRecord]| {
        let decision = records[0].decision().unwrap();
        let mut watchdog = Watchdog::new(limits, ages);
        watchdog.admit(&records[0], stamp.published_at_ns);
        if let bicycle::Decision::Drive(command) = watchdog.decision(at_ns(1)) {
            let within = f64::from(command.speed_mps).abs() <= 1.001 * limits.speed_max_mps
                && f64::from(command.steering_rad).abs() <= 1.001 * limits.steering_max_rad;
            assert!(within, "beyond the limits: {command:?}");
        }
        let mut guard = Guard::new(GuardConfig::default());
        if let bicycle::Decision::Drive(command) = decision {
            guard.note_command(command.speed_mps);
        }
        for cycle in 0..3 {
            guard.admit_odometry(&Drive::odometry(cycle)).ok();
        }
    })
}

static DECISION: LazyLock<Whole> =
    LazyLock::new(|| Whole::one(Drive::get().decisions[0].1, "DecisionRecord"));

pub fn decision(rng: &mut Rng) -> Vec<u8> {
    DECISION.broken(rng)
}

pub fn read_decision() -> Reader {
    let (first, whole) = Drive::get().decisions[0];
    reader(channel::DECISION, move |stamp, records: &[DecisionRecord]| {
        let mut timing = Timing::default();
        for (stamp, record) in [(first, whole), (*stamp, records[0]), (first, whole)] {
            timing.take(&stamp, &record);
        }
        timing.report();
    })
}

static MISSION: LazyLock<Whole> = LazyLock::new(|| {
    let mission = MissionRecord {
        goal_m: goal().goal_m,
        tolerance_m: 0.5,
        time_s: 1.0,
        path_speed_mps: 0.5,
        n_corners: 2,
        ..MissionRecord::default()
    };
    Whole::one(mission, "MissionRecord")
});

pub fn mission(rng: &mut Rng) -> Vec<u8> {
    MISSION.broken(rng)
}

pub fn read_mission() -> Reader {
    let drive = Drive::get();
    reader(channel::MISSION, move |stamp, records: &[MissionRecord]| {
        let mut maker = judge();
        maker.set_destination(goal());
        maker.follow(stamp, &records[0]).unwrap();
        let (header, cells) = drive.surface();
        maker.update(header, cells).unwrap().unwrap();
        let (header, elements) = Drive::risk_of(&mut maker).unwrap();
        let mut pilot = pilot();
        show(&mut pilot, &Drive::odometry(1));
        pilot.hear_mission(&mission_message(stamp, &records[0]));
        // To drive and to stand are both told in words.
        assert!(!records[0].to_string().is_empty());
        pilot.answer(at_ns(1), &only(risk_message(&header, &elements)));
    })
}

static ORDER: LazyLock<Whole> = LazyLock::new(|| {
    let header = OrderHeader { stamp: stamped(1), kind: 2, tolerance_m: 0.5, speed_mps: 0.5, alpha: 0.5 };
    Whole::new(
        (&header, "OrderHeader"),
        &[[0.0, 0.0], [3.0, 0.0], [3.0, 3.0]],
        vec![(0, Scalar::F64), (8, Scalar::F64)],
    )
});

pub fn order(rng: &mut Rng) -> Vec<u8> {
    let mut header = bytemuck::pod_read_unaligned::<OrderHeader>(&ORDER.header);
    header.kind = rng.random_range(0..12);
    ORDER.under(&header, rng.random_range(0..5)).broken(rng)
}

/// After a mission that is under way, whatever comes next, the vehicle stops in an emergency.
pub fn read_order() -> Reader {
    reader(channel::ORDER, move |header: &OrderHeader, points_m| {
        let Ok(order) = order_of(header, points_m) else { return };
        let mut mission = Mission::new(u64::MAX);
        let said = |sequence| Said { at_ns: at_ns(1), sender_ns: 1, sequence };
        let first = Route::goals(vec![goal().goal_m], 0.5).unwrap();
        mission.order(Order::Drive(first), said(1), at_ns(1)).unwrap();
        mission.order(order, said_by(header), at_ns(2)).ok();
        mission.advance(&Drive::odometry(1));
        let told = MissionMessage::of(&mission, MessageId::default(), at_ns(2));
        assert!(!record_of(&mission, &told).to_string().is_empty());
        mission.order(Order::EmergencyStop, said(2), u64::MAX).ok();
        assert!(!matches!(mission.instruction(), Instruction::Drive(_)));
    })
}

static TRACKS: LazyLock<Whole> = LazyLock::new(|| {
    let header = TracksHeader { stamp: stamped(1), frame_at_ns: at_ns(1), ..TracksHeader::default() };
    let track = TrackRecord {
        number: 1,
        position_m: [1.5, 0.5],
        velocity_mps: [0.0, -0.5],
        position_m2: 0.01,
        cross_m2ps: 0.01,
        velocity_m2ps2: 0.1,
        radius_m: 0.3,
    };
    Whole::new((&header, "TracksHeader"), &[track; 3], places("TrackRecord"))
});

pub fn tracks(rng: &mut Rng) -> Vec<u8> {
    TRACKS.broken(rng)
}

/// Whatever is told of what moves, there is a decision, and a command of it that a vehicle can carry out.
pub fn read_tracks() -> Reader {
    let drive = Drive::get();
    reader(channel::TRACKS, move |header, records: &[TrackRecord]| {
        let mut pilot = pilot_among_people();
        show(&mut pilot, &Drive::odometry(1));
        pilot.hear_tracks(&tracks_message(header, records));
        let command = pilot.answer(at_ns(1), &only(drive.map())).decision.command(Command::default());
        assert!(command.speed_mps.is_finite() && command.steering_rad.is_finite(), "{command:?}");
    })
}

static STUCK: LazyLock<Whole> =
    LazyLock::new(|| Whole::one(StuckRecord { position_m: [2.0, 2.0], yaw_rad: 0.3 }, "StuckRecord"));

pub fn stuck(rng: &mut Rng) -> Vec<u8> {
    STUCK.broken(rng)
}

pub fn read_stuck() -> Reader {
    let drive = Drive::get();
    reader(channel::STUCK, move |stamp, records: &[StuckRecord]| {
        let mut maker = judge();
        maker.set_destination(goal());
        maker.note_stuck(stamp, &records[0]);
        let (header, cells) = drive.surface();
        maker.update(header, cells).unwrap().unwrap();
        Drive::risk_of(&mut maker).unwrap();
    })
}

static PLAN: LazyLock<Whole> = LazyLock::new(|| {
    let place = PlanRecord { position_m: [2.0, 2.0], yaw_rad: 0.3, speed_mps: 1.0 };
    Whole::one(place, "PlanRecord")
});

pub fn plan(rng: &mut Rng) -> Vec<u8> {
    PLAN.broken(rng)
}

pub fn read_plan() -> Reader {
    reader(channel::PLAN, |_, places: &[PlanRecord]| {
        assert!(places.iter().all(|place| place.yaw_rad.is_finite()));
    })
}

static STATUS: LazyLock<Whole> = LazyLock::new(|| Whole::one(StatusRecord::default(), "StatusRecord"));

pub fn status(rng: &mut Rng) -> Vec<u8> {
    STATUS.broken(rng)
}

pub fn read_status() -> Reader {
    reader(Role::Plant.status(), |_, _| ())
}

static LEARNED: LazyLock<Whole> = LazyLock::new(|| {
    let (n_weight_bytes, payload) = networks::message_payload();
    let header = CheckpointHeader { stamp: stamped(1), n_weight_bytes, ..CheckpointHeader::default() };
    Whole::new((&header, "CheckpointHeader"), &payload, vec![])
});

pub fn learned(rng: &mut Rng) -> Vec<u8> {
    let mut whole = bytemuck::pod_read_unaligned::<CheckpointHeader>(&LEARNED.header);
    let mut payload = LEARNED.payload.clone();
    match rng.random_range(0..4) {
        0 => whole.n_weight_bytes = networks::said_length(rng, payload.len()),
        1 => mutate::bytes(rng, &mut payload),
        2 => payload = networks::checkpoint(rng),
        _ => {}
    }
    let mut header = bytemuck::bytes_of(&whole).to_vec();
    if once_in(rng, 2) {
        mutate::scalars(rng, &mut header, &LEARNED.header_places);
    }
    [header, payload].concat()
}

pub fn read_learned() -> Reader {
    reader(channel::CHECKPOINT, |header: &CheckpointHeader, payload| {
        let (weights, sidecar) = payload.split_at(header.n_weight_bytes as usize);
        drop(Checkpoint::from_bytes(weights, sidecar));
    })
}
