//! What the parts of the pipeline tell one another: plain values, each under its name and the time at which it was true,
//! whatever carries them. Times are nanoseconds on the clock of the measurements.

use bicycle::{Applied, Command, Decision, HoldReason, MotionCommand, Odometry, State, StopReason};
use kinodynamics::Corrected;
use mppi::{CostToGoView, ReferencePath};
use terrain::Scan;
use tracking::{TRACKS_MAX, Track};
use traversability::{CvarLevel, RiskMapView};

use crate::{CORNERS_MAX, Destination, Instruction, Jump, Mission, Stage, StuckPose, Target};

/// Names a message: the life of its publisher, and its number there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MessageId {
    /// When its publisher began [ns]; 0 of a message that there is not.
    pub epoch_ns: u64,
    /// Counts the messages of one publisher from 1.
    pub sequence: u64,
}

/// The time of what never gets old, and the frame of what no jump of the localisation moves [ns].
pub const TIMELESS_NS: u64 = u64::MAX;

/// Where the vehicle is, and what its actuators were told last before that was measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OdometryMessage<C = Command> {
    /// Its name.
    pub id: MessageId,
    /// What was measured, with its time.
    pub odometry: Odometry,
    /// What was sent to the actuators.
    pub applied: Applied<C>,
}

/// A sweep of a range sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanMessage {
    /// Its name.
    pub id: MessageId,
    /// Whose frame the points are of: 0 the vehicle's body, else the sensor of this number in [`crate::Config::sensors`],
    /// from 1.
    pub sensor: u32,
    /// The points, with their time.
    pub scan: Scan,
}

/// What a map of the ground says of itself; its cells are those of [`crate::Surveyor::surface`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceHeader {
    /// Its name.
    pub id: MessageId,
    /// When the scan was taken that it ends with [ns]. A jump moves what was seen; it is no news of the ground.
    pub valid_at_ns: u64,
    /// The scan that was fused last.
    pub scan: MessageId,
    /// Where the vehicle was when that scan was taken, or the odometry that showed the jump, as it was measured.
    pub odometry: Odometry,
    /// When the odometry was measured in whose frame it lies: the newest usable one that was taken in [ns].
    pub frame_at_ns: u64,
    /// The odometry that was taken in last, usable or not.
    pub last_odometry: MessageId,
    /// How many were taken in since the map before.
    pub n_odometry: u64,
    /// The jump of the localisation that it follows, if that is what it is sent for.
    pub jump: Option<Jump>,
    /// All jumps so far together.
    pub shift: Jump,
}

/// What moves, as the last scan shows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TracksMessage {
    /// Its name.
    pub id: MessageId,
    /// When the scan was taken [ns].
    pub valid_at_ns: u64,
    /// The scan.
    pub scan: MessageId,
    /// When the odometry was measured in whose frame they lie [ns].
    pub frame_at_ns: u64,
    n: usize,
    tracks: [Track; TRACKS_MAX],
}

impl TracksMessage {
    /// Of these tracks; of more than there is room for, the first. Those that are no numbers are left out: nothing can be
    /// said of where such a thing will be.
    pub fn new(
        id: MessageId,
        (scan, valid_at_ns): (MessageId, u64),
        frame_at_ns: u64,
        moving: &[Track],
    ) -> Self {
        let tracks = [Track::default(); TRACKS_MAX];
        let mut message = Self { id, valid_at_ns, scan, frame_at_ns, n: 0, tracks };
        for (room, track) in message.tracks.iter_mut().zip(moving.iter().filter(|track| track.is_sound())) {
            *room = *track;
            message.n += 1;
        }
        message
    }

    /// The tracks, in the map frame.
    pub fn tracks(&self) -> &[Track] {
        &self.tracks[..self.n]
    }
}

/// What a risk map says of itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RiskHeader {
    /// Its name.
    pub id: MessageId,
    /// When the scan was taken that it ends with [ns].
    pub valid_at_ns: u64,
    /// The map of the ground that was judged.
    pub surface: MessageId,
    /// When the odometry was measured in whose frame it lies [ns]; later jumps of the localisation have left it behind.
    pub frame_at_ns: u64,
    /// The last stuck pose that it takes into account.
    pub stuck: MessageId,
    /// Where its times lead, as it was said.
    pub destination: Destination,
}

/// A risk map as the pilot reads it, where whoever carries it keeps it.
#[derive(Clone, Copy, Debug)]
pub struct RiskMessage<'a> {
    /// What it says of itself.
    pub header: RiskHeader,
    /// Risk around the vehicle, and the least time to the goal over it; `None` of one that cannot be read any more.
    pub content: Option<(RiskMapView<'a>, CostToGoView<'a>)>,
}

/// The newest risk map of each source.
#[derive(Clone, Copy, Debug, Default)]
pub struct RiskMessages<'a> {
    /// By whoever judges the ground as the method says.
    pub learned: Option<RiskMessage<'a>>,
    /// By physics alone, which stands in.
    pub physics: Option<RiskMessage<'a>>,
}

/// Who made a risk map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RiskMapSource {
    /// Whoever judges the ground as the method says.
    Learned,
    /// Physics alone.
    Physics,
}

/// Where the vehicle got stuck.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StuckMessage {
    /// Its name.
    pub id: MessageId,
    /// When the odometry was measured in whose frame it lies [ns].
    pub valid_at_ns: u64,
    /// The pose.
    pub pose: StuckPose,
}

/// What a vehicle is doing for its mission.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activity {
    /// Drives.
    Drive,
    /// Stands, because there is no mission.
    Nothing,
    /// Stands and waits.
    Paused,
    /// An operator has the wheel.
    Manual,
    /// Stops until reset.
    EmergencyStop,
}

/// The part of a path that is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathWindow {
    /// Speed along it [m/s].
    pub speed_mps: f64,
    /// Corners that count.
    pub n_corners: usize,
    /// The corners [m].
    pub corners_m: [[f64; 2]; CORNERS_MAX],
}

/// What a vehicle is told to do, as a whole: whoever has heard the last one knows all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MissionMessage {
    /// Its name.
    pub id: MessageId,
    /// When it was said [ns].
    pub valid_at_ns: u64,
    /// What it is doing.
    pub activity: Activity,
    /// Whether it has come to its end, whatever that was.
    pub is_over: bool,
    /// Where it leads, if it leads anywhere.
    pub destination: Option<Destination>,
    /// The path that leads there, if there is one.
    pub path: Option<PathWindow>,
    /// The share of worst outcomes to plan for, if anybody has said so.
    pub level: Option<CvarLevel>,
}

/// How a command was corrected for the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correction<C = Command> {
    /// The command as the controller planned it.
    pub planned: C,
    /// What became of it.
    pub corrected: Corrected,
}

/// A decision with all that it was made from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DecisionMessage<C = Command> {
    /// What was decided, as it goes to the vehicle.
    pub decision: Decision<C>,
    /// Number of the decision since the pilot began.
    pub cycle: u64,
    /// When it was made [ns].
    pub decided_at_ns: u64,
    /// The odometry that was taken in last, and how many were since the decision before.
    pub odometry: (MessageId, u64),
    /// When the odometry was measured that it was decided on [ns]; 0 = none.
    pub odometry_at_ns: u64,
    /// The risk map that it was made on.
    pub risk: Option<(RiskMapSource, RiskHeader)>,
    /// The newest risk map of each source that there was to choose from: learned, physics.
    pub held: [MessageId; 2],
    /// What was known last of what moves.
    pub tracks: MessageId,
    /// What was said last of where to go.
    pub mission: MessageId,
    /// Where to go; nowhere to stand.
    pub destination: Option<Destination>,
    /// Futures that were sampled.
    pub n_rollouts: usize,
    /// Time since the decision before [s].
    pub elapsed_s: f64,
    /// What whoever corrects commands for the ground made of the planned one; none of a decision to stand.
    pub correction: Option<Correction<C>>,
    /// The message of the inertial measurement unit that was taken in last, and how many were since the decision before,
    /// without a gap up to the last.
    pub imu: (MessageId, u64),
    /// Where the vehicle was found stuck, and when the odometry was measured that says so [ns].
    pub stuck: Option<(u64, StuckPose)>,
    /// State that it was made for.
    pub state: State,
}

impl<C: MotionCommand> DecisionMessage<C> {
    /// When the scan was measured that the map ends with that it was decided on [ns]; 0 = no map.
    pub fn scan_at_ns(&self) -> u64 {
        self.risk.map_or(0, |(_, header)| header.valid_at_ns)
    }
}

impl MissionMessage {
    /// What a mission is at.
    pub fn of(mission: &Mission, id: MessageId, valid_at_ns: u64) -> Self {
        let target = mission.target();
        Self {
            id,
            valid_at_ns,
            activity: activity_of(mission),
            is_over: matches!(mission.stage(), Stage::Reached | Stage::Cancelled),
            destination: target.map(|target| target.end()),
            path: target.and_then(|target| PathWindow::of(&target)),
            level: mission.level(),
        }
    }

    /// What is to be done now. A mission that was not repeated for longer than `age_max_ns` is lost, but for what is over
    /// and for an emergency stop.
    pub fn instruction(&self, now_ns: u64, age_max_ns: u64) -> Instruction<'_> {
        let is_lost = now_ns.saturating_sub(self.valid_at_ns) > age_max_ns;
        match self.activity {
            Activity::EmergencyStop => stop(StopReason::EmergencyStop),
            Activity::Drive | Activity::Paused | Activity::Manual if !self.is_over && is_lost => {
                stop(StopReason::StaleMission)
            }
            Activity::Manual => hold(HoldReason::Manual),
            Activity::Paused => hold(HoldReason::Paused),
            Activity::Drive if !self.is_over => {
                self.target().map_or(hold(HoldReason::NoMission), Instruction::Drive)
            }
            Activity::Drive | Activity::Nothing => hold(HoldReason::NoMission),
        }
    }

    fn target(&self) -> Option<Target<'_>> {
        let destination = self.destination?;
        Some(self.path.as_ref().map_or(Target::Goal(destination), |path| {
            Target::Path(ReferencePath {
                points_m: &path.corners_m[..path.n_corners],
                speed_mps: path.speed_mps,
                tolerance_m: destination.tolerance_m,
            })
        }))
    }
}

impl PathWindow {
    fn of(target: &Target<'_>) -> Option<Self> {
        let Target::Path(path) = target else { return None };
        let mut corners_m = [[0.0; 2]; CORNERS_MAX];
        let n_corners = path.points_m.len().min(CORNERS_MAX);
        corners_m[..n_corners].copy_from_slice(&path.points_m[..n_corners]);
        Some(Self { speed_mps: path.speed_mps, n_corners, corners_m })
    }
}

fn activity_of(mission: &Mission) -> Activity {
    match (mission.is_latched(), mission.is_manual(), mission.stage()) {
        (true, ..) => Activity::EmergencyStop,
        (_, true, _) => Activity::Manual,
        (.., Stage::Paused) => Activity::Paused,
        (.., Stage::Driving) => Activity::Drive,
        (.., Stage::Idle | Stage::Reached | Stage::Cancelled) => Activity::Nothing,
    }
}

fn hold(reason: HoldReason) -> Instruction<'static> {
    Instruction::Stand(Decision::Hold(reason))
}

fn stop(reason: StopReason) -> Instruction<'static> {
    Instruction::Stand(Decision::Stop(reason))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

    use super::*;
    use crate::{Order, Route, Said};

    const AGE_MAX_NS: u64 = 2500;
    const THERE: Destination = Destination { goal_m: [3.0, 4.0], tolerance_m: 1.0 };

    fn said_at(valid_at_ns: u64, activity: Activity) -> MissionMessage {
        MissionMessage {
            id: MessageId { epoch_ns: 1, sequence: 1 },
            valid_at_ns,
            activity,
            is_over: false,
            destination: Some(THERE),
            path: None,
            level: None,
        }
    }

    #[test]
    fn a_mission_counts_while_it_is_repeated_and_until_it_is_over() {
        let said = said_at(1000, Activity::Drive);
        let there = Instruction::Drive(Target::Goal(THERE));
        assert_eq!(said.instruction(1000 + AGE_MAX_NS, AGE_MAX_NS), there);
        assert_eq!(said.instruction(1001 + AGE_MAX_NS, AGE_MAX_NS), stop(StopReason::StaleMission));
        let over = MissionMessage { is_over: true, ..said };
        assert_eq!(over.instruction(1001, AGE_MAX_NS), hold(HoldReason::NoMission));
        assert_eq!(
            over.instruction(1_000_000, AGE_MAX_NS),
            hold(HoldReason::NoMission),
            "it does not get lost"
        );
    }

    #[test]
    fn only_one_activity_drives_and_an_emergency_stop_does_not_grow_old() {
        for (activity, fresh, lost) in [
            (Activity::Paused, hold(HoldReason::Paused), stop(StopReason::StaleMission)),
            (Activity::Manual, hold(HoldReason::Manual), stop(StopReason::StaleMission)),
            (Activity::EmergencyStop, stop(StopReason::EmergencyStop), stop(StopReason::EmergencyStop)),
            (Activity::Nothing, hold(HoldReason::NoMission), hold(HoldReason::NoMission)),
        ] {
            let said = said_at(1000, activity);
            assert_eq!(said.instruction(1000, AGE_MAX_NS), fresh, "{activity:?}");
            assert_eq!(said.instruction(1001 + AGE_MAX_NS, AGE_MAX_NS), lost, "{activity:?}, lost");
        }
    }

    /// What the pilot does by the message is what the mission says to be done, whatever was ordered.
    #[test]
    fn a_message_tells_what_the_mission_says() {
        let points_m = vec![[0.0, 0.0], [5.0, 0.0], [5.0, 8.0]];
        let goals = Order::Drive(Route::goals(points_m.clone(), 0.5).unwrap());
        let path = Order::Drive(Route::path(points_m, 0.7, 0.5).unwrap());
        let level = CvarLevel::new(0.3).unwrap();
        let orders = [
            goals,
            Order::Pause,
            Order::Resume,
            path,
            Order::TakeOver,
            Order::Resume,
            Order::Tolerate(level),
        ];
        let orders =
            orders.into_iter().chain([Order::EmergencyStop, Order::Reset, Order::Resume, Order::Cancel]);
        let mut mission = Mission::new(0);
        let told = |mission: &Mission| {
            let message = MissionMessage::of(mission, MessageId::default(), 7);
            assert_eq!(message.instruction(7, 0), mission.instruction(), "{message:?}");
            assert_eq!(
                (message.level, message.destination),
                (mission.level(), mission.target().map(|target| target.end()))
            );
        };
        told(&mission);
        for (place, order) in orders.enumerate() {
            let said = Said { sequence: place as u64 + 1, ..Said::default() };
            assert_eq!(mission.order(order.clone(), said, 0), Ok(()), "{order:?}");
            told(&mission);
        }
        assert_eq!(mission.level(), Some(level));
    }
}
