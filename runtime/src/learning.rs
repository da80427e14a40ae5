//! The learning as a process: the map of the ground becomes risk by what driving taught.

use bicycle::Vehicle;
use navigator::{Assessor, Belief, Config};
use traversability::CvarLevel;

use crate::RuntimeError;
use crate::mapping::{LEARNED, risk_elements, send_risk};
use crate::online::{Judge, School, SchoolSetup, Told};
use crate::risk_maker::RiskMaker;
use bus::channel::{Bus, Inlet, MISSION, Message, Outlet, RISK, STUCK, SURFACE};
use bus::clock::{self, Clock};
use bus::message::{MissionRecord, RiskHeader, Stamp, StuckRecord, SurfaceHeader};
use bus::status::{Health, Meter, Role};

/// Time between two looks at the channels [ns].
const POLL_NS: u64 = 2_000_000;

/// What judges the ground.
pub struct LearningSetup<'a> {
    /// The machine.
    pub vehicle: &'a Vehicle,
    /// Settings of the pipeline.
    pub config: Config,
    /// What is believed of the ground.
    pub belief: Belief,
    /// First 8 bytes of the SHA-256 of the networks' weights; 0 = none.
    pub checkpoint: u64,
    /// Share of the worst outcomes to plan for.
    pub level: CvarLevel,
    /// Limits that plans keep to.
    pub limits: bicycle::Limits,
}

/// Judges until `is_over` says to end.
pub fn run(bus: &Bus, setup: &LearningSetup<'_>, is_over: &dyn Fn() -> bool) -> Result<(), RuntimeError> {
    let mut learning = Learning::new(bus, setup)?;
    while !is_over() {
        learning.look()?;
        clock::sleep_until(clock::now_ns() + POLL_NS);
    }
    Ok(())
}

/// Judges until `is_over` says to end, and learns from the drive meanwhile. `tell` hears of every round.
pub fn run_and_learn(
    bus: &Bus,
    setup: &LearningSetup<'_>,
    school: SchoolSetup,
    is_over: &dyn Fn() -> bool,
    tell: &mut dyn FnMut(Told<'_>),
) -> Result<(), RuntimeError> {
    let judge = Judge {
        vehicle: setup.vehicle.clone(),
        limits: setup.limits,
        config: setup.config.clone(),
        level: setup.level,
        unfamiliar: school.unfamiliar,
    };
    let mut learning = Learning::new(bus, setup)?;
    learning.school = Some(School::new(bus, school, judge)?);
    while !is_over() {
        learning.attend(tell)?;
        learning.look()?;
        clock::sleep_until(clock::now_ns() + POLL_NS);
    }
    Ok(())
}

/// The assessor and its channels, stepped by whoever has its clock.
pub struct Learning {
    clock: Clock,
    maker: RiskMaker,
    school: Option<School>,
    surfaces: Inlet<SurfaceHeader, [f32; 8]>,
    missions: Inlet<Stamp, MissionRecord>,
    stuck: Inlet<Stamp, StuckRecord>,
    outlet: Outlet<RiskHeader, [f32; 4]>,
    meter: Meter,
    last_surface: Option<Stamp>,
    n_malformed: u64,
    took_s: f64,
}

impl Learning {
    /// Nothing has been judged yet.
    ///
    /// # Errors
    /// A channel that cannot be used, settings that cannot be.
    pub fn new(bus: &Bus, setup: &LearningSetup<'_>) -> Result<Self, RuntimeError> {
        let LearningSetup { vehicle, config, belief, checkpoint, level, limits } = setup;
        let assessor = Assessor::new(vehicle, limits, config, belief, *level)?;
        Ok(Self {
            clock: bus.clock().clone(),
            maker: RiskMaker::new(assessor, LEARNED, *checkpoint),
            school: None,
            surfaces: bus.inlet(&SURFACE)?,
            missions: bus.inlet(&MISSION)?,
            stuck: bus.inlet(&STUCK)?,
            outlet: bus.outlet(&RISK, risk_elements(config))?,
            meter: Meter::new(bus, Role::Learning)?,
            last_surface: None,
            n_malformed: 0,
            took_s: 0.0,
        })
    }

    /// Listens to the drive, and judges by what was learned as soon as there is something better.
    fn attend(&mut self, tell: &mut dyn FnMut(Told<'_>)) -> Result<(), RuntimeError> {
        let Some(school) = &mut self.school else { return Ok(()) };
        school.listen();
        match school.news() {
            Some(Ok(news)) => {
                school.publish(&news)?;
                let checkpoint = news.change.as_ref().map(|(checkpoint, ..)| checkpoint.as_ref());
                tell(Told::Round(&news.round, checkpoint));
                if let Some((_, hash, assessor)) = news.change {
                    self.maker.judge_by(assessor, hash)?;
                }
            }
            Some(Err(why)) => tell(Told::Ended(&why)),
            None => {}
        }
        school.repeat()
    }

    /// Takes in what has come. What is judged is sent, so that whoever has the messages knows all that was judged; and where
    /// the vehicle got stuck is told at once.
    pub fn look(&mut self) -> Result<(), RuntimeError> {
        let maker = &mut self.maker;
        let newest = self.surfaces.newest_of(|header| maker.hear_surface(header));
        let mut is_stuck = false;
        self.stuck.poll(|stamp, stuck| {
            stuck.iter().for_each(|stuck| maker.note_stuck(stamp, stuck));
            is_stuck = true;
        });
        maker.hear_missions(&mut self.missions)?;
        match newest {
            Some(surface) if maker.has_goal() => self.judge(&surface)?,
            None if is_stuck => {
                let valid_at_ns = self.last_surface.map_or(0, |stamp| stamp.valid_at_ns);
                send_risk(maker, &mut self.outlet, valid_at_ns)?;
            }
            Some(_) | None => {}
        }
        self.report()
    }

    fn judge(&mut self, surface: &Message<SurfaceHeader, [f32; 8]>) -> Result<(), RuntimeError> {
        let began_ns = self.clock.now_ns();
        let header = surface.header();
        match self.maker.update(header, surface.payload())? {
            Ok(()) => send_risk(&mut self.maker, &mut self.outlet, header.stamp.valid_at_ns)?,
            Err(_) => self.n_malformed += 1,
        }
        if let Some(school) = &mut self.school {
            school.note_surface(header, surface.payload());
        }
        self.last_surface = Some(header.stamp);
        self.took_s = clock::age_s(self.clock.now_ns(), began_ns);
        self.meter.count(began_ns.saturating_sub(header.stamp.published_at_ns));
        Ok(())
    }

    fn report(&mut self) -> Result<(), RuntimeError> {
        let now_ns = self.clock.now_ns();
        let surface_s = self.last_surface.map_or(-1.0, |stamp| clock::age_s(now_ns, stamp.valid_at_ns));
        let (took_s, n_malformed) = (self.took_s, self.n_malformed);
        let counts = [self.surfaces.counts(), self.missions.counts(), self.stuck.counts()];
        Ok(self.meter.report(now_ns, || {
            let health = Health { age_s: [surface_s, -1.0, -1.0, -1.0], figure: took_s, ..Health::default() };
            let health = counts.into_iter().fold(health, Health::with);
            let [lost, refused, failed] = health.messages;
            Health { messages: [lost, refused + n_malformed, failed], ..health }
        })?)
    }
}
