//! One schedule, two transports: parts that tell one another over shared memory, stepped by a clock of the test, decide and
//! map to the bit as the same parts in one object do.
//!
//! The schedule is recorded from a drive: what was measured, when each message came, and when each part worked.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU64, Ordering};

use bicycle::{Applied, AppliedBy, Command, Decision, HoldReason, Model, Odometry, StopReason};
use bus::ages::{AgeLimits, Periods};
use bus::channel::{Bus, DECISION, Inlet, ODOMETRY, ORDER, Outlet, RISK, RISK_PHYSICS, SCAN, SURFACE};
use bus::clock::Clock;
use bus::message::{
    DecisionRecord, OdometryRecord, OrderHeader, PointRecord, RiskHeader, ScanHeader, Source, Stamp,
    SurfaceHeader,
};
use bus::payload::{RiskParts, cell_numbers, content_hash};
use navigator::{
    Assessor, Belief, Config, Jump, MessageId, Navigator, OdometryMessage, Order, PilotAges, RiskMessage,
    Route, ScanMessage, Setup, Surface,
};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use runtime::control::{Control, ControlSetup};
use runtime::convert::decision_record;
use runtime::learning::{Learning, LearningSetup};
use runtime::mapping::{Mapping, MappingSetup};
use runtime::mission::{Beginning, Leading, MissionSetup, header_of};
use scenarios::Episode;
use terrain::Scan;
use traversability::CvarLevel;

use crate::fixture::{ALPHA, Run, SEED, ages, episode_config, machine, task};

const MILLISECOND_NS: u64 = 1_000_000;
const BEGAN_NS: u64 = 1_000 * MILLISECOND_NS;
/// Time between two looks of the vehicle at its sensors, and cycles between two scans.
const CYCLE_MS: u64 = 20;
const LASTS_MS: u64 = 15_000;

/// What happens at a time: something comes, or a part works.
#[derive(Clone, Debug)]
enum Step {
    Odometry(Odometry, Applied),
    Scan(Arc<Scan>),
    Order(Order),
    Lead,
    Survey,
    Assess,
    Decide,
}

/// Of a map: the content, and of a risk map also what it says of itself, without the lives of publishers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Made {
    Surface { content: u64 },
    Risk { author: u64, content: u64, surface: u64, stuck: u64, times_ns: [u64; 2], goal: [u64; 2] },
    Decision { bits: u64, record: Shown },
}

/// What is shown of a decision when two differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Shown {
    cycle: u64,
    decision: u32,
    reason: u32,
    author: u64,
    risk: u64,
}

type Schedule = Vec<(u64, Step)>;

/// When what happens to the drive [ms].
mod plan {
    use std::ops::Range;

    pub const NOT_A_NUMBER: Range<u64> = 3000..3200;
    pub const LEARNING_IS_SILENT: Range<u64> = 4000..6000;
    pub const JUMPS_FROM: u64 = 5010;
    pub const PAUSED: Range<u64> = 6500..7000;
    pub const BOLDER_FROM: u64 = 7300;
    pub const HELD: Range<u64> = 8000..10_500;
    pub const MISSION_IS_SILENT: Range<u64> = 11_000..14_200;
}

fn config() -> Config {
    let (_, mut config) = machine();
    config.controller.recovery.patience_s = 1.0;
    config
}

fn navigator() -> Navigator {
    let ((vehicle, _), config, task) = (machine(), config(), task());
    let (model, level) = (Model::of(&vehicle), CvarLevel::new(ALPHA).unwrap());
    let physics = Assessor::new(&vehicle, &model.limits, &config, &Belief::Physics, level).unwrap();
    let AgeLimits { learned_ns, mission_ns, learning_silence_ns, .. } = ages();
    Navigator::new(Setup {
        geometry: &vehicle.geometry,
        model,
        config,
        belief: Belief::Physics,
        surface: Surface::Sensed,
        level,
        seed: SEED,
        goal_m: task.goal_m,
        tolerance_m: task.goal_tolerance_m,
    })
    .unwrap()
    .with_ages(PilotAges { learned_ns, mission_ns })
    .with_stand_in(physics, learning_silence_ns, BEGAN_NS)
}

/// The parts in one object.
struct InProcess {
    navigator: Navigator,
    sequences: [u64; 2],
    told: [u64; 3],
}

impl InProcess {
    fn new() -> Self {
        Self { navigator: navigator(), sequences: [0; 2], told: [0; 3] }
    }

    /// Returns what was made, and the decision.
    fn step(&mut self, at_ns: u64, step: &Step) -> (Vec<Made>, Option<Decision>) {
        let navigator = &mut self.navigator;
        let mut id = |place: usize| {
            self.sequences[place] += 1;
            MessageId { epoch_ns: 1, sequence: self.sequences[place] }
        };
        let mut made = Vec::new();
        let mut decided = None;
        match step {
            Step::Odometry(odometry, applied) => {
                navigator.hear_odometry(&OdometryMessage {
                    id: id(0),
                    odometry: *odometry,
                    applied: *applied,
                });
            }
            Step::Scan(scan) => {
                navigator.hear_scan(ScanMessage { id: id(1), sensor: 0, scan: scan.as_ref().clone() });
            }
            Step::Order(order) => navigator.order(order.clone(), at_ns).unwrap(),
            Step::Lead => navigator.lead(at_ns),
            Step::Survey => {
                navigator.survey(at_ns).unwrap();
                let cells: Vec<[f32; 8]> = navigator.surface().values().iter().map(cell_numbers).collect();
                // Before anything was seen there is no map to tell of.
                let has_seen = navigator.scans().fused > 0;
                made.push(Made::Surface { content: if has_seen { content_hash(&cells) } else { 0 } });
                made.extend(navigator.stand_in_map().and_then(|map| risk(&mut self.told[1], 2, &map)));
            }
            Step::Assess => {
                navigator.assess().unwrap();
                made.extend(navigator.risk().and_then(|map| risk(&mut self.told[0], 1, &map)));
            }
            Step::Decide => {
                let answer = navigator.answer(at_ns);
                decided = Some(answer.decision);
                made.push(decision(&decision_record(&answer)));
            }
        }
        (made, decided)
    }
}

/// A risk map that has not been told of before.
fn risk(told: &mut u64, author: u64, message: &RiskMessage<'_>) -> Option<Made> {
    let header = message.header;
    if std::mem::replace(told, header.id.sequence) == header.id.sequence {
        return None;
    }
    let (map, times) = message.content.unwrap();
    let parts = RiskParts::new(&map.geometry, map.n_yaws);
    let mut payload: Vec<[f32; 4]> =
        (0..parts.n_elements()).map(|place| parts.element(&map, place)).collect();
    parts.seconds_mut(&mut payload).copy_from_slice(times.seconds);
    Some(Made::Risk {
        author,
        content: content_hash(&payload),
        surface: header.surface.sequence,
        stuck: header.stuck.sequence,
        times_ns: [header.valid_at_ns, header.frame_at_ns],
        goal: header.goal_m.map(f64::to_bits),
    })
}

/// All bits of a decision but the lives of publishers.
fn decision(record: &DecisionRecord) -> Made {
    let nameless = |source: Source| Source { epoch_ns: 0, ..source };
    let bare = DecisionRecord {
        odometry: nameless(record.odometry),
        risk: nameless(record.risk),
        mission: nameless(record.mission),
        learned: nameless(record.learned),
        physics: nameless(record.physics),
        ..*record
    };
    let DecisionRecord { cycle, author, .. } = bare;
    let (decision, reason) = (bare.command.decision, bare.command.reason);
    let record = Shown { cycle, decision, reason, author, risk: bare.risk.sequence };
    Made::Decision { bits: content_hash(std::slice::from_ref(&bare)), record }
}

/// The same parts, each with its channels, one after the other as the schedule says.
struct Processes {
    time_ns: Arc<AtomicU64>,
    odometry: Outlet<Stamp, OdometryRecord>,
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
    fn new(ages: AgeLimits) -> Self {
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
        let control = ControlSetup { model: model.clone(), config, seed: SEED, period_s: 0.1, ages };
        Self {
            odometry: bus.outlet(&ODOMETRY, 1).unwrap(),
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

    fn step(&mut self, at_ns: u64, step: &Step) -> Vec<Made> {
        self.time_ns.store(at_ns, Ordering::Relaxed);
        let mut made = Vec::new();
        match step {
            Step::Odometry(odometry, applied) => {
                let record = OdometryRecord::from(odometry).with_applied(applied);
                self.odometry.send_one(Stamp::default(), record, odometry.valid_at_ns).unwrap();
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

    fn told(&mut self, author: usize) -> Option<Made> {
        let message = self.risks[author].newest()?;
        let header = message.header();
        assert_eq!(header.content_hash, content_hash(message.payload()));
        Some(Made::Risk {
            author: header.author,
            content: header.content_hash,
            surface: header.surface.sequence,
            stuck: header.stuck.sequence,
            times_ns: [header.stamp.valid_at_ns, header.odometry_at_ns],
            goal: header.goal_m.map(f64::to_bits),
        })
    }
}

/// A drive, and the order in which its messages came and its parts worked.
struct Recorder {
    random: Xoshiro256PlusPlus,
    episode: Episode,
    /// What is on its way, by when it comes.
    coming: BTreeMap<(u64, u64), Step>,
    n_coming: u64,
    applied: Applied,
    decided: Decision,
}

impl Recorder {
    fn new() -> Self {
        let (vehicle, _) = machine();
        let mut config = episode_config(&vehicle);
        (config.control_hz, config.cycles_per_scan) = (1e3 / CYCLE_MS as f64, 10);
        Self {
            random: Xoshiro256PlusPlus::seed_from_u64(5),
            episode: Episode::new(task(), &vehicle, config, SEED).unwrap(),
            coming: BTreeMap::new(),
            n_coming: 0,
            applied: Applied { command: Command::default(), since_ns: 0, by: AppliedBy::Command },
            decided: Decision::Hold(HoldReason::NoMap),
        }
    }

    fn put(&mut self, at_ns: u64, step: Step) {
        self.n_coming += 1;
        self.coming.insert((at_ns, self.n_coming), step);
    }

    /// Measures, and carries out what was decided.
    fn measure(&mut self, at_ms: u64) {
        let at_ns = BEGAN_NS + at_ms * MILLISECOND_NS;
        let observation = self.episode.observe().clone();
        let correction = Jump { step_m: [3.0, -2.0, 0.0], yaw_rad: 0.3 };
        let mut odometry = Odometry { valid_at_ns: at_ns, ..observation.odometry };
        if at_ms >= plan::JUMPS_FROM {
            odometry = correction.odometry(&odometry);
        }
        if plan::NOT_A_NUMBER.contains(&at_ms) {
            odometry.yaw_rate_radps = f64::NAN;
        }
        let late_ns = self.random.random_range(0..6 * MILLISECOND_NS);
        self.put(at_ns + late_ns, Step::Odometry(odometry, self.applied));
        if let Some(scan) = observation.scan {
            // Between two odometry messages, and now and then far behind them.
            let scan = Scan { valid_at_ns: at_ns + 7 * MILLISECOND_NS, ..scan.as_ref().clone() };
            let late_ns = self.random.random_range(7 * MILLISECOND_NS..70 * MILLISECOND_NS);
            self.put(at_ns + late_ns, Step::Scan(Arc::new(scan)));
        }
        let command = self.decided.command(self.applied.command);
        if command != self.applied.command {
            self.applied = Applied { command, since_ns: at_ns, by: AppliedBy::Command };
        }
        // Whoever holds it tells nobody.
        let held = plan::HELD.contains(&at_ms).then_some(Decision::Hold(HoldReason::Manual));
        self.episode.apply(&held.unwrap_or(self.decided)).unwrap();
    }

    /// The parts work again and again, none of them quite regularly.
    fn put_to_work(&mut self) {
        let parts =
            [(Step::Lead, 15, 9), (Step::Survey, 8, 7), (Step::Assess, 13, 30), (Step::Decide, 90, 20)];
        for (part, every_ms, more_ms) in parts {
            let mut at_ms = 0;
            while at_ms < LASTS_MS {
                at_ms += every_ms + self.random.random_range(0..=more_ms);
                let is_silent = match part {
                    Step::Assess => plan::LEARNING_IS_SILENT.contains(&at_ms),
                    Step::Lead => plan::MISSION_IS_SILENT.contains(&at_ms),
                    _ => false,
                };
                if !is_silent {
                    self.put(BEGAN_NS + at_ms * MILLISECOND_NS + 1, part.clone());
                }
            }
        }
        let level = CvarLevel::new(0.3).unwrap();
        for (at_ms, order) in [
            (plan::PAUSED.start, Order::Pause),
            (plan::PAUSED.end, Order::Resume),
            (plan::BOLDER_FROM, Order::Tolerate(level)),
        ] {
            self.put(BEGAN_NS + at_ms * MILLISECOND_NS, Step::Order(order));
            self.put(BEGAN_NS + at_ms * MILLISECOND_NS, Step::Lead);
        }
    }

    /// Drives, and returns what happened, with what the parts in one object made of it.
    fn record(mut self) -> (Schedule, Vec<Made>) {
        let mut parts = InProcess::new();
        let (mut schedule, mut made) = (Schedule::new(), Vec::new());
        self.put_to_work();
        for cycle in 0..LASTS_MS / CYCLE_MS {
            self.measure(cycle * CYCLE_MS);
            let until_ns = BEGAN_NS + (cycle + 1) * CYCLE_MS * MILLISECOND_NS;
            while let Some(entry) = self.coming.first_entry().filter(|entry| entry.key().0 < until_ns) {
                let ((at_ns, _), step) = entry.remove_entry();
                let (new, decided) = parts.step(at_ns, &step);
                made.extend(new);
                self.decided = decided.unwrap_or(self.decided);
                schedule.push((at_ns, step));
            }
        }
        assert_eq!(parts.navigator.n_jumps(), 1);
        (schedule, made)
    }
}

static RECORDED: LazyLock<(Schedule, Vec<Made>)> = LazyLock::new(|| Recorder::new().record());

/// What the parts make of a schedule over shared memory, up to the first difference from what they are to make.
fn first_difference(
    schedule: &Schedule,
    ages: AgeLimits,
    expected: &[Made],
) -> Option<(usize, Option<Made>)> {
    let mut processes = Processes::new(ages);
    let mut expected = expected.iter();
    for (place, (at_ns, step)) in schedule.iter().enumerate() {
        for made in processes.step(*at_ns, step) {
            if expected.next() != Some(&made) {
                return Some((place, Some(made)));
            }
        }
    }
    expected.next().map(|_| (schedule.len(), None))
}

/// Everything that the parts have rules for happened.
#[test]
fn the_schedule_holds_what_there_are_rules_for() {
    let (schedule, made) = &*RECORDED;
    let decisions: Vec<Shown> = made
        .iter()
        .filter_map(|made| if let Made::Decision { record, .. } = made { Some(*record) } else { None })
        .collect();
    let n = |holds: &dyn Fn(&Shown) -> bool| decisions.iter().filter(|shown| holds(shown)).count();
    let stop = |reason: StopReason| {
        bus::message::STOP_REASONS.iter().position(|known| *known == reason).unwrap() as u32 + 1
    };
    let hold = |reason: HoldReason| {
        bus::message::HOLD_REASONS.iter().position(|known| *known == reason).unwrap() as u32 + 1
    };
    assert!(decisions.len() > 120, "{}", decisions.len());
    assert!(n(&|shown| shown.decision == 1 && shown.author == 1) > 50, "on learned maps: {decisions:?}");
    assert!(n(&|shown| shown.decision == 1 && shown.author == 2) > 5, "on physics' maps: {decisions:?}");
    for (decision, reason) in [
        (3, stop(StopReason::NonFiniteInput)),
        (3, stop(StopReason::StaleMission)),
        (2, hold(HoldReason::Paused)),
    ] {
        assert!(n(&|shown| (shown.decision, shown.reason) == (decision, reason)) > 0, "{decision} {reason}");
    }
    let knows_stuck = |made: &&Made| matches!(made, Made::Risk { stuck, .. } if *stuck > 0);
    assert!(made.iter().filter(knows_stuck).count() > 3, "it got stuck");
    assert!(schedule.len() > 3000, "{}", schedule.len());
}

#[test]
fn processes_decide_and_map_to_the_bit_as_the_parts_in_one_object() {
    let (schedule, made) = &*RECORDED;
    let n_risks = made.iter().filter(|made| matches!(made, Made::Risk { .. })).count();
    let n_decisions = made.iter().filter(|made| matches!(made, Made::Decision { .. })).count();
    println!("{} steps, {n_risks} risk maps, {n_decisions} decisions", schedule.len());
    assert_eq!(first_difference(schedule, ages(), made), None);
}

/// Whatever happens, deciding takes no memory that it did not have; a place where the vehicle is stuck is told of by a
/// message, which does.
#[test]
fn deciding_takes_no_memory() {
    let (schedule, _) = &*RECORDED;
    let mut parts = InProcess::new();
    let mut n_measured = 0;
    for (at_ns, step) in schedule {
        let is_warm = *at_ns > BEGAN_NS + 2000 * MILLISECOND_NS;
        if !(is_warm && matches!(step, Step::Decide)) {
            parts.step(*at_ns, step);
            continue;
        }
        let mut is_stuck = false;
        let counted =
            allocation_counter::measure(|| is_stuck = parts.navigator.answer(*at_ns).stuck.is_some());
        assert!(is_stuck || counted.count_total == 0, "{counted:?} at {at_ns} ns");
        n_measured += 1;
    }
    assert!(n_measured > 100, "{n_measured}");
}

/// The witness for the bits: another limit on an age, or another order of two steps, shows.
#[test]
fn another_age_limit_or_another_order_makes_other_decisions() {
    let (schedule, made) = &*RECORDED;
    let usual = ages();
    for other in [
        AgeLimits { learned_ns: usual.learned_ns + 600 * MILLISECOND_NS, ..usual },
        AgeLimits { mission_ns: usual.mission_ns - 500 * MILLISECOND_NS, ..usual },
        AgeLimits { learning_silence_ns: usual.learning_silence_ns + 300 * MILLISECOND_NS, ..usual },
    ] {
        assert!(first_difference(schedule, other, made).is_some(), "{other:?}");
    }
    // Once, a decision is made before the odometry that came just before it.
    let place = schedule
        .windows(2)
        .position(|pair| matches!((&pair[0].1, &pair[1].1), (Step::Odometry(..), Step::Decide)))
        .unwrap();
    let mut swapped = schedule.clone();
    let [first_ns, second_ns] = [place, place + 1].map(|place| swapped[place].0);
    swapped.swap(place, place + 1);
    (swapped[place].0, swapped[place + 1].0) = (first_ns, second_ns);
    let (differs_at, _) = first_difference(&swapped, usual, made).expect("another order");
    assert_eq!(differs_at, place);
}
