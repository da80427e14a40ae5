//! Beside a run: leads its vehicle along a route, by what its own process of mapping sees.

use std::time::Duration;

use bus::channel::{Bus, Inlet, MISSION, ODOMETRY, RunName, SURFACE};
use bus::clock::{self, SECOND_NS};
use bus::message::mission::{CANCELLED, EMERGENCY_STOP, MANUAL, PAUSED, REACHED};
use bus::message::{MissionRecord, OdometryRecord, Stamp, SurfaceHeader};
use bus::payload::surface_map;
use navigator::{Order, Route};
use runtime::operator;

use super::guided::{Guided, Place};
use crate::{UsageError, WorkFailed, interrupt};

/// How long the first odometry is waited for [ns].
const PATIENCE_NS: u64 = 5 * SECOND_NS;
/// Odometry of before this is none [s].
const SILENCE_MAX_S: f64 = 1.0;
/// Time between two looks.
const PERIOD: Duration = Duration::from_millis(100);
/// Where the run's own tolerance holds, a route is checked with any that would do.
const ANY_TOLERANCE_M: f64 = 1.0;

/// How far a run is on the way that it is led.
enum Stage {
    Driving,
    Paused,
    There,
}

/// A run that is listened to.
pub(super) struct Led {
    bus: Bus,
    name: RunName,
    odometry: Inlet<Stamp, OdometryRecord>,
    surfaces: Inlet<SurfaceHeader, [f32; 8]>,
    missions: Inlet<Stamp, MissionRecord>,
    heard: Option<(u64, Place)>,
    mission: Option<MissionRecord>,
}

impl Led {
    /// Joins a run, and waits until its vehicle says where it is.
    ///
    /// # Errors
    /// The run is not there, or its vehicle is silent.
    pub fn join(name: &RunName) -> anyhow::Result<(Self, Place)> {
        if !RunName::alive()?.contains(name) {
            return Err(
                UsageError(format!("--lead: expected a run that is there, found none named {name}")).into()
            );
        }
        let bus = Bus::visit(name)?;
        let mut led = Self {
            odometry: bus.inlet(&ODOMETRY)?,
            surfaces: bus.inlet(&SURFACE)?,
            missions: bus.inlet(&MISSION)?,
            bus,
            name: name.clone(),
            heard: None,
            mission: None,
        };
        let until_ns = clock::now_ns() + PATIENCE_NS;
        while clock::now_ns() < until_ns {
            led.listen();
            if let Some((_, place)) = led.heard {
                return Ok((led, place));
            }
            clock::sleep_until(clock::now_ns() + SECOND_NS / 100);
        }
        let patience_s = PATIENCE_NS / SECOND_NS;
        Err(WorkFailed(format!("run {name}: expected odometry within {patience_s} s, found none")).into())
    }

    fn listen(&mut self) {
        let heard = &mut self.heard;
        self.odometry.poll(|stamp, records| {
            let Some(OdometryRecord { position_m: [x_m, y_m, _], attitude_rad: [_, _, yaw_rad], .. }) =
                records.first()
            else {
                return;
            };
            let time_s = stamp.valid_at_ns as f64 * 1e-9;
            *heard = Some((stamp.valid_at_ns, Place { at_m: [*x_m, *y_m], yaw_rad: *yaw_rad, time_s }));
        });
        let mission = &mut self.mission;
        self.missions.poll(|_, records| *mission = records.first().copied().or(*mission));
    }

    /// Leads the vehicle until it is at the goal. While the mission is paused nothing is ordered.
    ///
    /// # Errors
    /// Its odometry ends, an order is refused, the mission is cancelled, somebody else directs it, or Ctrl-C.
    pub fn lead(&mut self, guided: &mut Guided) -> anyhow::Result<()> {
        interrupt::catch_interrupts()?;
        let mut number = None;
        loop {
            self.listen();
            let place = self.place()?;
            match self.stage(number)? {
                Stage::There => return Ok(()),
                Stage::Paused => guided.rest(place.time_s),
                Stage::Driving => number = self.guide(guided, place)?.or(number),
            }
            std::thread::sleep(PERIOD);
        }
    }

    /// Orders what is to be headed for, where that is something else than before; returns the number of its mission.
    fn guide(&mut self, guided: &mut Guided, place: Place) -> anyhow::Result<Option<u64>> {
        if let Some(surface) = self.surfaces.newest().and_then(|map| surface_map(map.header(), map.payload()))
        {
            guided.look(&surface, place);
        }
        let Some(goals_m) = guided.advance(place.at_m) else { return Ok(None) };
        let route = Route::goals(goals_m, ANY_TOLERANCE_M)?.without_tolerance();
        let told = operator::tell(&self.bus, &Order::Drive(route));
        Ok(Some(told.map_err(|error| self.failed(&error.to_string()))?.number))
    }

    fn place(&self) -> anyhow::Result<Place> {
        let age_s = |at_ns: u64| clock::age_s(clock::now_ns(), at_ns);
        match self.heard {
            _ if interrupt::interrupted() => {
                Err(self.failed("interrupted by the user; it drives on to where it was led"))
            }
            Some((at_ns, place)) if age_s(at_ns) <= SILENCE_MAX_S => Ok(place),
            _ => Err(self.failed("expected odometry, found none for a second")),
        }
    }

    /// How far the mission is that was ordered last.
    fn stage(&self, number: Option<u64>) -> anyhow::Result<Stage> {
        let (Some(mission), Some(number)) = (&self.mission, number) else { return Ok(Stage::Driving) };
        match (mission.state, mission.outcome) {
            _ if mission.number > number => Err(self.failed("somebody else has ordered something")),
            (EMERGENCY_STOP | MANUAL, _) => Err(self.failed(&mission.to_string())),
            // What is told may still be of the one before.
            _ if mission.number < number => Ok(Stage::Driving),
            (_, CANCELLED) => Err(self.failed(&mission.to_string())),
            (_, REACHED) => Ok(Stage::There),
            (PAUSED, _) => Ok(Stage::Paused),
            _ => Ok(Stage::Driving),
        }
    }

    fn failed(&self, why: &str) -> anyhow::Error {
        WorkFailed(format!("run {}: {why}", self.name)).into()
    }
}
