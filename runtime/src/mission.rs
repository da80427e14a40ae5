//! The mission as a process: orders come in, and what the vehicle is told to do goes out, as long as this lives.

mod record;

use bicycle::{Model, SensorModel};
use navigator::{Areas, GuardConfig, Leader, MessageId, Mission, NavigatorError, Order, Route, Said};

use crate::RuntimeError;
use crate::convert::odometry_message;
use bus::ages::{AgeLimits, Periods};
use bus::channel::{Bus, EMERGENCY_STOP, Inlet, MISSION, ODOMETRY, ORDER, Outlet};
use bus::clock::{self, Clock};
use bus::message::{MissionRecord, OdometryRecord, OrderHeader, Source, Stamp};
use bus::status::{Health, Meter, Role};
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
    /// What odometry may enter.
    pub guard: GuardConfig,
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
    let mut leading = Leading::new(bus, setup)?;
    while !is_over() {
        leading.look()?;
        clock::sleep_until(clock::now_ns() + POLL_NS);
    }
    // What was driven since the mission was said last counts.
    leading.look()?;
    leading.tell()
}

/// The leader and its channels, stepped by whoever has its clock.
pub struct Leading {
    clock: Clock,
    leader: Leader,
    tolerance_m: f64,
    orders: Inlet<OrderHeader, [f64; 2]>,
    emergency_stops: Inlet<OrderHeader, [f64; 2]>,
    odometry: Inlet<Stamp, OdometryRecord>,
    outlet: Outlet<Stamp, MissionRecord>,
    meter: Meter,
    /// The order that was judged last, and what became of it.
    judged: (Source, u64),
}

impl Leading {
    /// A mission that begins as the setup says.
    ///
    /// # Errors
    /// A channel that cannot be used, a route that may not be driven.
    pub fn new(bus: &Bus, setup: MissionSetup<'_>) -> Result<Self, RuntimeError> {
        let MissionSetup { beginning, tolerance_m, model, guard, periods, ages, areas } = setup;
        let mission = begun(beginning, Mission::new(ages.order_ns).within(areas))?;
        let (sensors, period_ns) = (SensorModel::of(&model.effects), clock::nanoseconds(periods.mission_s));
        Ok(Self {
            clock: bus.clock().clone(),
            leader: Leader::new(mission, &guard, sensors, period_ns),
            tolerance_m,
            orders: bus.inlet(&ORDER)?,
            emergency_stops: bus.inlet(&EMERGENCY_STOP)?,
            odometry: bus.inlet(&ODOMETRY)?,
            outlet: bus.outlet(&MISSION, 1)?,
            meter: Meter::new(bus, Role::Mission)?,
            judged: (Source::default(), 0),
        })
    }

    /// Takes in what has come, and says what is to be done when that is due.
    pub fn look(&mut self) -> Result<(), RuntimeError> {
        self.follow_orders()?;
        let leader = &mut self.leader;
        self.odometry.poll(|stamp, records| {
            records.iter().for_each(|record| leader.hear_odometry(&odometry_message(stamp, record)));
        });
        let now_ns = self.clock.now_ns();
        if self.leader.is_due(now_ns) {
            self.tell()?;
        }
        self.outlet.welcome();
        let age_s = self.leader.odometry_at_ns().map_or(-1.0, |at_ns| clock::age_s(now_ns, at_ns));
        let n_refused = self.leader.mission().refused().values().sum();
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
            let (said, now_ns) = (said_by(&header), self.clock.now_ns());
            self.meter.count(now_ns.saturating_sub(said.at_ns));
            let taken = self.leader.hear_order(order, said, now_ns);
            self.judged = (header.stamp.source(), verdict_of(taken));
            self.tell()?;
        }
        Ok(())
    }

    fn tell(&mut self) -> Result<(), RuntimeError> {
        let now_ns = self.clock.now_ns();
        // Its name is that of its stamp, which comes with its sending.
        let told = self.leader.tell(MessageId::default(), now_ns);
        let (order, verdict) = self.judged;
        let record = MissionRecord {
            time_s: self.leader.time_s(),
            order,
            verdict,
            ..record_of(self.leader.mission(), &told)
        };
        self.outlet.send_one(Stamp::default(), record, now_ns)?;
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
