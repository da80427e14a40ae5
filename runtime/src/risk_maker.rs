//! A surface message becomes a risk map's: the work of learning, of mapping while learning is silent, and of replay.

use crate::convert::{mission_message, source_of, stuck_message, surface_header};
use navigator::{Assessor, Destination, NavigatorError};
use traversability::{CvarLevel, RiskMapView};

use bus::channel::{Inlet, Refusal};
use bus::message::{Grid, MissionRecord, RiskHeader, Stamp, StuckRecord, SurfaceHeader};
use bus::payload::{self, RiskParts};

/// An assessor whose risk maps are written where messages lie.
pub struct RiskMaker {
    assessor: Assessor,
    map_source: u64,
    checkpoint: u64,
}

impl RiskMaker {
    /// A maker by this assessor; `map_source` and `checkpoint` are those of [`RiskHeader`].
    pub fn new(assessor: Assessor, map_source: u64, checkpoint: u64) -> Self {
        Self { assessor, map_source, checkpoint }
    }

    /// Judges the ground by other networks from now on, the next time as a whole. What driving has proved stays, and so
    /// does the share of outcomes.
    pub fn judge_by(&mut self, assessor: Assessor, checkpoint: u64) -> Result<(), NavigatorError> {
        self.checkpoint = checkpoint;
        self.assessor.judge_like(assessor)
    }

    /// Follows what was said of where to go, and for which share of outcomes to plan.
    pub fn follow(&mut self, stamp: &Stamp, mission: &MissionRecord) -> Result<(), NavigatorError> {
        self.assessor.hear_mission(&mission_message(stamp, mission))
    }

    /// The same of all that has come.
    pub(crate) fn hear_missions(
        &mut self,
        missions: &mut Inlet<Stamp, MissionRecord>,
    ) -> Result<(), NavigatorError> {
        let mut followed = Ok(());
        missions.poll(|stamp, missions| {
            missions.iter().for_each(|mission| {
                followed =
                    std::mem::replace(&mut followed, Ok(())).and_then(|()| self.follow(stamp, mission));
            });
        });
        followed
    }

    /// Judges for this share of the worst outcomes from now on.
    pub fn judge_at(&mut self, level: CvarLevel) -> Result<(), NavigatorError> {
        self.assessor.judge_at(level)
    }

    /// The networks that it judges by, as [`RiskHeader::checkpoint`].
    pub fn checkpoint(&self) -> u64 {
        self.checkpoint
    }

    /// Where the times to the goal shall lead from now on.
    pub fn set_destination(&mut self, destination: Destination) {
        self.assessor.set_destination(destination);
    }

    /// Whether it has been said where to: before, no surface is worth judging.
    pub fn has_goal(&self) -> bool {
        self.assessor.has_goal()
    }

    /// Remembers where the vehicle got stuck.
    pub fn note_stuck(&mut self, stamp: &Stamp, stuck: &StuckRecord) {
        self.assessor.hear_stuck(&stuck_message(stamp, stuck));
    }

    /// Looks at what a surface says of itself, whether or not it is judged.
    pub fn hear_surface(&mut self, header: &SurfaceHeader) {
        self.assessor.hear_surface(&surface_header(header));
    }

    /// Judges a surface; refuses one that holds cells that cannot be.
    ///
    /// # Errors
    /// The surface is of another resolution than the assessor was made for.
    pub fn update(
        &mut self,
        header: &SurfaceHeader,
        payload: &[[f32; 8]],
    ) -> Result<Result<(), Refusal>, NavigatorError> {
        let Some(next) = payload::surface_map(header, payload) else { return Ok(Err(Refusal::Malformed)) };
        self.assessor.judge(&surface_header(header), &next).map(Ok)
    }

    /// Number of elements of the message; `None` before the first surface or without a goal.
    pub fn n_elements(&self) -> Option<usize> {
        let known = self.assessor.known().filter(|_| self.has_goal())?;
        Some(self.parts(&known).n_elements())
    }

    /// What is to be written into the message first, element by element.
    pub fn writer(&self) -> Option<impl Fn(usize) -> [f32; 4] + '_> {
        let known = self.assessor.known()?;
        let parts = self.parts(&known);
        Some(move |place| parts.element(&known, place))
    }

    fn parts(&self, known: &RiskMapView<'_>) -> RiskParts {
        RiskParts::new(&known.geometry, known.n_yaws, self.assessor.n_headings())
    }

    /// Completes, in place, a message that was written so, and gives its header, without stamp.
    pub fn finish(&mut self, payload: &mut [[f32; 4]]) -> Result<RiskHeader, NavigatorError> {
        let Some(known) = self.assessor.known() else { return Ok(RiskHeader::default()) };
        let (geometry, n_yaws) = (known.geometry, known.n_yaws);
        let parts = self.parts(&known);
        self.assessor.correct(parts.risks_mut(payload));
        // The parts have the lengths of a map of this shape.
        let Ok(map) = RiskMapView::new(geometry, n_yaws, parts.risks(payload), parts.ground(payload)) else {
            return Ok(RiskHeader::default());
        };
        let Some(header) = self.assessor.finish(map)? else { return Ok(RiskHeader::default()) };
        let times = self.assessor.time_to_goal();
        let [seconds, turning_s] = parts.times_mut(payload);
        seconds.copy_from_slice(times.seconds);
        turning_s.copy_from_slice(times.turning_s);
        let Destination { goal_m, tolerance_m } = header.destination;
        Ok(RiskHeader {
            stamp: Stamp::default(),
            grid: Grid::from(&geometry),
            n_yaws: n_yaws as u64,
            map_source: self.map_source,
            surface: source_of(header.surface),
            odometry_at_ns: header.frame_at_ns,
            stuck: source_of(header.stuck),
            goal_m,
            tolerance_m,
            n_headings: self.assessor.n_headings() as u64,
            alpha: self.assessor.level().get(),
            checkpoint: self.checkpoint,
            content_hash: payload::content_hash(payload),
        })
    }
}
