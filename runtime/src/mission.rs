//! The mission as a process: orders come in, and what the vehicle is told to do goes out, as long as this lives.

mod heard;
mod record;

use bicycle::{Model, SensorModel};
use navigator::{Areas, Mission, NavigatorError, Order, OrderRefusal, Route, Said};

use crate::RuntimeError;
use bus::ages::{AgeLimits, Periods};
use bus::channel::{Bus, EMERGENCY_STOP, Inlet, MISSION, ODOMETRY, ORDER, Outlet};
use bus::clock;
use bus::message::{MissionRecord, OdometryRecord, OrderHeader, Source, Stamp};
use bus::status::{Health, Meter, Role};
pub use heard::Heard;
pub(crate) use record::taken_by;
use record::verdict_of;
pub use record::{header_of, order_of, record_of, said_by};

/// Time between two looks at the channels [ns].
const POLL_NS: u64 = 5_000_000;

/// What leads.
pub struct MissionSetup<'a> {
    /// How it begins.
    pub beginning: Beginning,
    /// How near to a point counts as there where an order does not say [m].
    pub tolerance_m: f64,
    /// What is believed of the vehicle: how its sensors misstate its motion.
    pub model: &'a Model,
    /// How often the mission is said again.
    pub periods: Periods,
    /// How old orders may be.
    pub ages: AgeLimits,
    /// Where the vehicle may be.
    pub areas: Areas,
}

/// How a mission begins.
#[derive(Clone, Debug, PartialEq)]
pub enum Beginning {
    /// With nothing to do.
    Idle,
    /// On a route.
    Driving(Route),
    /// In the place of a process that has died: with the emergency stop latched, because nobody knows any more what was
    /// ordered.
    Latched,
}

/// Leads until `is_over` says to end.
pub fn run(bus: &Bus, setup: MissionSetup<'_>, is_over: &dyn Fn() -> bool) -> Result<(), RuntimeError> {
    let mut leader = Leader::new(bus, setup)?;
    while !is_over() {
        leader.look(clock::now_ns())?;
        clock::sleep_until(clock::now_ns() + POLL_NS);
    }
    // What was driven since the mission was said last counts.
    leader.look(clock::now_ns())?;
    leader.tell()
}

/// Keeps the mission of a run.
struct Leader {
    mission: Mission,
    tolerance_m: f64,
    sensors: SensorModel,
    orders: Inlet<OrderHeader, [f64; 2]>,
    emergency_stops: Inlet<OrderHeader, [f64; 2]>,
    odometry: Inlet<Stamp, OdometryRecord>,
    outlet: Outlet<Stamp, MissionRecord>,
    meter: Meter,
    /// The order that was judged last, and what became of it.
    judged: (Source, u64),
    stopwatch: Stopwatch,
    odometry_at_ns: Option<u64>,
    period_ns: u64,
    told_at_ns: Option<u64>,
}

impl Leader {
    fn new(bus: &Bus, setup: MissionSetup<'_>) -> Result<Self, RuntimeError> {
        let MissionSetup { beginning, tolerance_m, model, periods, ages, areas } = setup;
        Ok(Self {
            mission: begun(beginning, Mission::new(ages.order_ns).within(areas))?,
            tolerance_m,
            sensors: SensorModel::of(&model.effects),
            orders: bus.inlet(&ORDER)?,
            emergency_stops: bus.inlet(&EMERGENCY_STOP)?,
            odometry: bus.inlet(&ODOMETRY)?,
            outlet: bus.outlet(&MISSION, 1)?,
            meter: Meter::new(bus, Role::Mission)?,
            judged: (Source::default(), 0),
            stopwatch: Stopwatch::default(),
            odometry_at_ns: None,
            period_ns: clock::nanoseconds(periods.mission_s),
            told_at_ns: None,
        })
    }

    fn look(&mut self, now_ns: u64) -> Result<(), RuntimeError> {
        self.follow_orders()?;
        let has_changed = self.follow_odometry();
        let is_due = self.told_at_ns.is_none_or(|at_ns| now_ns.saturating_sub(at_ns) >= self.period_ns);
        if has_changed || is_due {
            self.tell()?;
        }
        self.outlet.welcome();
        let age_s = self.odometry_at_ns.map_or(-1.0, |at_ns| clock::age_s(now_ns, at_ns));
        let n_refused = self.mission.refused().values().sum();
        let health =
            Health { age_s: [age_s, -1.0, -1.0, -1.0], messages: [0, n_refused, 0], ..Health::default() };
        let counts = [self.orders.counts(), self.emergency_stops.counts(), self.odometry.counts()];
        Ok(self.meter.report(now_ns, || counts.into_iter().fold(health, Health::with))?)
    }

    /// Every order is answered. Emergency stops come last: whatever else was said has then been heard.
    fn follow_orders(&mut self) -> Result<(), RuntimeError> {
        let mut waiting = Vec::new();
        for inlet in [&mut self.orders, &mut self.emergency_stops] {
            inlet.poll(|header, points_m| waiting.push((*header, points_m.to_vec())));
        }
        for (header, points_m) in waiting {
            let tolerance_m = if header.tolerance_m == 0.0 { self.tolerance_m } else { header.tolerance_m };
            let order = order_of(&OrderHeader { tolerance_m, ..header }, &points_m);
            let taken = self.take(order, said_by(&header));
            self.judged = (header.stamp.source(), verdict_of(taken));
            self.tell()?;
        }
        Ok(())
    }

    fn take(&mut self, order: Result<Order, OrderRefusal>, said: Said) -> Result<(), OrderRefusal> {
        let now_ns = clock::now_ns();
        self.meter.count(now_ns.saturating_sub(said.at_ns));
        match order {
            Ok(order) => self.mission.order(order, said, now_ns),
            Err(refusal) => {
                self.mission.note_refused(refusal);
                Err(refusal)
            }
        }
    }

    /// Returns whether the vehicle is to do something else now.
    fn follow_odometry(&mut self) -> bool {
        let Self { mission, sensors, odometry, odometry_at_ns, stopwatch, .. } = self;
        let mut has_changed = false;
        odometry.poll(|stamp, records| {
            for record in records {
                *odometry_at_ns = Some(stamp.valid_at_ns);
                stopwatch.run(mission, stamp.valid_at_ns);
                has_changed |= mission.advance(&sensors.corrected(&record.odometry(stamp.valid_at_ns)));
            }
        });
        has_changed
    }

    fn tell(&mut self) -> Result<(), RuntimeError> {
        let now_ns = clock::now_ns();
        let (order, verdict) = self.judged;
        let record =
            MissionRecord { time_s: self.stopwatch.time_s(), order, verdict, ..record_of(&self.mission) };
        self.outlet.send_one(Stamp::default(), record, now_ns)?;
        self.told_at_ns = Some(now_ns);
        Ok(())
    }
}

fn begun(beginning: Beginning, mut mission: Mission) -> Result<Mission, NavigatorError> {
    match beginning {
        Beginning::Idle => {}
        Beginning::Driving(route) => {
            // The first order of all: every other is said later.
            mission.order(Order::Drive(route), Said { sequence: 1, ..Said::default() }, 0)?;
        }
        Beginning::Latched => mission = mission.latched(),
    }
    Ok(mission)
}

/// Time of the mission: from the first odometry that it had until it was over.
#[derive(Clone, Copy, Debug, Default)]
struct Stopwatch {
    number: u64,
    began_ns: u64,
    until_ns: u64,
}

impl Stopwatch {
    fn run(&mut self, mission: &Mission, at_ns: u64) {
        if self.number != mission.number() {
            *self = Self { number: mission.number(), began_ns: at_ns, until_ns: at_ns };
        }
        if mission.target().is_some() {
            self.until_ns = at_ns;
        }
    }

    fn time_s(&self) -> f64 {
        clock::age_s(self.until_ns, self.began_ns)
    }
}
