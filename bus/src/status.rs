//! What every process tells of itself.

use crate::channel::{Bus, Channel, ChannelError, Counts, Outlet, status_channel};
use crate::clock::SECOND_NS;
use crate::message::{Stamp, StatusRecord};

/// Time between two statuses [ns].
const PERIOD_NS: u64 = SECOND_NS / 2;

/// A part of the machine that is a process of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Role {
    /// The simulated vehicle.
    Plant,
    /// Measurements to the map of the ground.
    Mapping,
    /// The map of the ground to risk.
    Learning,
    /// Risk to commands.
    Control,
    /// Everything into a file.
    Recorder,
    /// Orders to what the vehicle is told to do.
    Mission,
    /// The topics of a robot that speaks ROS 2.
    Ros,
}

impl Role {
    /// All of them.
    pub const ALL: [Self; 7] =
        [Self::Plant, Self::Mapping, Self::Learning, Self::Control, Self::Recorder, Self::Mission, Self::Ros];
    /// Those of a run whose vehicle is simulated.
    pub const SIMULATED: [Self; 6] =
        [Self::Plant, Self::Mapping, Self::Learning, Self::Control, Self::Recorder, Self::Mission];

    /// Name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Plant => "plant",
            Self::Mapping => "mapping",
            Self::Learning => "learning",
            Self::Control => "control",
            Self::Recorder => "recorder",
            Self::Mission => "mission",
            Self::Ros => "ros",
        }
    }

    /// Where it tells how it is doing.
    pub const fn status(self) -> Channel<Stamp, StatusRecord> {
        status_channel(match self {
            Self::Plant => "status_plant",
            Self::Mapping => "status_mapping",
            Self::Learning => "status_learning",
            Self::Control => "status_control",
            Self::Recorder => "status_recorder",
            Self::Mission => "status_mission",
            Self::Ros => "status_ros",
        })
    }
}

/// What a process knows of its health beside its rate and lateness.
#[derive(Clone, Copy, Debug)]
pub struct Health {
    /// Ages of its inputs [s]; negative = none.
    pub age_s: [f64; 4],
    /// Deadlines missed so far.
    pub n_missed: u64,
    /// Messages lost and refused so far, and looks that the transport broke off.
    pub messages: [u64; 3],
    /// Figure of its own.
    pub figure: f64,
}

impl Default for Health {
    fn default() -> Self {
        Self { age_s: [-1.0; 4], n_missed: 0, messages: [0; 3], figure: 0.0 }
    }
}

impl Health {
    /// With what became of the messages of one more channel.
    pub fn with(mut self, counts: &Counts) -> Self {
        let [lost, refused, failed] = self.messages;
        self.messages = [lost + counts.lost, refused + counts.n_refused(), failed + counts.failed];
        self
    }
}

/// Measures a process and tells the others.
pub struct Meter {
    role: Role,
    outlet: Outlet<Stamp, StatusRecord>,
    reported_at_ns: u64,
    lateness_s: Vec<f64>,
}

impl Meter {
    /// A meter that has measured nothing. It tells so at once: whoever made it is there and has opened its channels.
    pub fn new(bus: &Bus, role: Role) -> Result<Self, ChannelError> {
        let (outlet, now_ns) = (bus.outlet(&role.status(), 1)?, bus.clock().now_ns());
        let mut meter = Self { role, outlet, reported_at_ns: now_ns, lateness_s: Vec::with_capacity(64) };
        meter.tell(now_ns, 0.0, Health::default())?;
        Ok(meter)
    }

    /// Notes a cycle that began so much after its time.
    pub fn count(&mut self, lateness_ns: u64) {
        self.lateness_s.push(lateness_ns as f64 * 1e-9);
    }

    /// Tells the others, when it is time to.
    pub fn report(&mut self, now_ns: u64, health: impl FnOnce() -> Health) -> Result<(), ChannelError> {
        let since_ns = now_ns.saturating_sub(self.reported_at_ns);
        if since_ns < PERIOD_NS {
            return Ok(());
        }
        self.reported_at_ns = now_ns;
        let rate_hz = self.lateness_s.len() as f64 / (since_ns as f64 * 1e-9);
        self.tell(now_ns, rate_hz, health())
    }

    fn tell(&mut self, now_ns: u64, rate_hz: f64, health: Health) -> Result<(), ChannelError> {
        self.lateness_s.sort_by(f64::total_cmp);
        let median_s = self.lateness_s.get(self.lateness_s.len() / 2).copied().unwrap_or_default();
        let largest_s = self.lateness_s.last().copied().unwrap_or_default();
        let Health { age_s, n_missed, messages: [n_lost, n_refused, n_failed], figure } = health;
        let record = StatusRecord {
            role: self.role as u64 + 1,
            process: u64::from(std::process::id()),
            rate_hz,
            lateness_s: [median_s, largest_s],
            age_s,
            n_missed,
            n_lost,
            n_refused,
            n_failed,
            figure,
        };
        self.lateness_s.clear();
        self.outlet.send_one(Stamp::default(), record, now_ns).map(drop)
    }
}
