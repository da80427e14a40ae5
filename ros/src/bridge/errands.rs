//! The action by which somebody says a goal and is told how it ends.

use bus::clock::SECOND_NS;
use bus::message::OdometryRecord;
use formats::{RobotRos, RosNavigateResult};
use ros2_client::RmwRequestId;
use ros2_client::action::{CancelGoalResponse, GoalId, GoalInfo, GoalStatusEnum};
use ros2_client::action_msgs::{CancelGoalResponseEnum, GoalStatus};
use ros2_client::builtin_interfaces;

use super::hearing::Refused;
use super::{Bridge, BridgeError, arrival};
use crate::errand::{Accepted, Ending, ErrandError, Errands, Uncancelled};
use crate::intake::IntakeError;
use crate::message::{
    Duration, Header, NavigateToPoseFeedback, NavigateToPoseGoal, NavigateToPoseResult, Point, Pose,
    PoseStamped, Time,
};
use crate::node::{Action, Node, NodeError};
use crate::odometry::motion_of_record;
use crate::orders::{FLOOD, Order};
use crate::rigid;

/// What lines about goals begin with.
const WHAT: &str = "navigate";

/// Why a goal is not accepted. Every message is one line.
#[derive(Debug, thiserror::Error)]
enum Unaccepted {
    #[error(transparent)]
    Nowhere(#[from] IntakeError),
    #[error(transparent)]
    Errand(#[from] ErrandError),
    #[error("{FLOOD}")]
    Flood,
}

/// The action, and the goals that came by it.
pub(super) struct Navigation {
    action: Action<NavigateToPoseGoal, NavigateToPoseResult, NavigateToPoseFeedback>,
    pub(super) errands: Errands<RmwRequestId>,
    result: RosNavigateResult,
}

impl Navigation {
    /// None if the robot file has no name for it.
    pub(super) fn offer(node: &mut Node, ros: &RobotRos) -> Result<Option<Self>, NodeError> {
        let action = node.act(&ros.topics.navigate, "nav2_msgs", "NavigateToPose")?;
        Ok(action.map(|action| Self { action, errands: Errands::default(), result: ros.navigate_result }))
    }

    /// Tells those who asked of goals that have ended, and everybody of goals that have changed.
    fn tell_ends(&mut self, now_ns: u64) -> Result<(), NodeError> {
        let Self { action, errands, result: kind } = self;
        let result = |ending| result(ending, *kind);
        action.askers(|id, asker| {
            if let Some(ending) = errands.ask(id, asker) {
                action.tell_end(asker, ending.status, result(ending));
            }
        });
        for (asker, ending) in errands.take_told() {
            action.tell_end(asker, ending.status, result(ending));
        }
        let Some(news) = errands.news(now_ns) else { return Ok(()) };
        let status = |(accepted, status): &_| GoalStatus { goal_info: info(accepted), status: *status };
        action.tell_statuses(news.iter().map(status).collect())
    }
}

impl Bridge {
    /// Deals with goals of the action: those that come, those that are to be cancelled, and those that have ended.
    pub(super) fn run_errands(&mut self, now_ns: u64, tell: &mut dyn FnMut(&str)) -> Result<(), BridgeError> {
        let Some(mut navigation) = self.navigation.take() else { return Ok(()) };
        let mut complaints = std::mem::take(&mut self.complaints);
        let mut refused = Refused { complaints: &mut complaints, tell };
        let Navigation { action, errands, .. } = &mut navigation;
        action.goals(|id, goal| {
            let accepted = self.accept(errands, id, &goal, now_ns);
            accepted.map_err(|why| refused.note(WHAT, &why)).ok()
        });
        let last = self.orders.last();
        action.cancels(|asked| answer_of(errands.cancel(asked.id, asked.stamp_ns(), now_ns, last)));
        let answered = self.orders.answered();
        errands.cancel_due(now_ns, answered, || self.orders.say(Order::Cancel));
        errands.problems().iter().for_each(|problem| tell(&format!("{WHAT}: {problem}")));
        self.complaints = complaints;
        navigation.tell_ends(now_ns)?;
        if let Some((accepted, feedback)) = self.progress(&mut navigation.errands, now_ns) {
            navigation.action.tell_progress(accepted.id, feedback)?;
        }
        self.navigation = Some(navigation);
        Ok(())
    }

    /// Orders what a goal asks for, and returns the stamp of its acceptance [ns].
    fn accept(
        &mut self,
        errands: &mut Errands<RmwRequestId>,
        id: GoalId,
        goal: &NavigateToPoseGoal,
        now_ns: u64,
    ) -> Result<i64, Unaccepted> {
        errands.admit(id)?;
        let places_m = self.intake.goal(&goal.pose)?;
        let place_m = places_m.first().copied().unwrap_or([f64::NAN; 2]);
        let order = self.orders.say(Order::Goals(places_m)).ok_or(Unaccepted::Flood)?;
        let stamp_ns = self.intake.clock().stamp_ns(now_ns, arrival()).unwrap_or_default();
        errands.begin(Accepted { id, place_m, at_ns: now_ns, stamp_ns }, order);
        Ok(stamp_ns)
    }

    /// How far the goal is that is under way, when that is due and somebody knows where the vehicle is.
    fn progress(
        &self,
        errands: &mut Errands<RmwRequestId>,
        now_ns: u64,
    ) -> Option<(Accepted, NavigateToPoseFeedback)> {
        let (at_ns, odometry) = self.ears.odometry?;
        let stamp_ns = self.intake.clock().stamp_ns(at_ns, arrival())?;
        let accepted = errands.progress(now_ns)?;
        let header =
            Header { stamp: Time::from_nanoseconds(stamp_ns), frame_id: self.intake.map_frame().to_owned() };
        let ([x_m, y_m, _], [goal_x_m, goal_y_m]) = (odometry.position_m, accepted.place_m);
        let feedback = NavigateToPoseFeedback {
            current_pose: PoseStamped { header, pose: pose_of(&odometry) },
            navigation_time: duration(now_ns.saturating_sub(accepted.at_ns)),
            distance_remaining: (goal_x_m - x_m).hypot(goal_y_m - y_m) as f32,
            ..NavigateToPoseFeedback::default()
        };
        Some((accepted, feedback))
    }
}

fn pose_of(odometry: &OdometryRecord) -> Pose {
    let [x, y, z] = odometry.position_m;
    let orientation = rigid::quaternion_of(&motion_of_record(odometry).rotation);
    Pose { position: Point { x, y, z }, orientation }
}

fn duration(time_ns: u64) -> Duration {
    let (seconds, nanosec) = (time_ns / SECOND_NS, (time_ns % SECOND_NS) as u32);
    Duration { sec: i32::try_from(seconds).unwrap_or(i32::MAX), nanosec }
}

fn info(accepted: &Accepted) -> GoalInfo {
    GoalInfo { goal_id: accepted.id, stamp: builtin_interfaces::Time::from_nanos(accepted.stamp_ns) }
}

fn result(ending: Ending, kind: RosNavigateResult) -> NavigateToPoseResult {
    let error_code = match ending.status {
        GoalStatusEnum::Succeeded | GoalStatusEnum::Canceled => NavigateToPoseResult::NONE,
        _ => NavigateToPoseResult::UNKNOWN,
    };
    let error_msg = match kind {
        RosNavigateResult::Code => None,
        RosNavigateResult::CodeAndText => Some(ending.problem),
    };
    NavigateToPoseResult { error_code, error_msg }
}

fn answer_of(cancelled: Result<Vec<Accepted>, Uncancelled>) -> CancelGoalResponse {
    let return_code = match cancelled {
        Ok(_) => CancelGoalResponseEnum::None,
        Err(Uncancelled::Unknown) => CancelGoalResponseEnum::UnknownGoal,
        Err(Uncancelled::Over) => CancelGoalResponseEnum::GoalTerminated,
    };
    let goals_canceling = cancelled.unwrap_or_default().iter().map(info).collect();
    CancelGoalResponse { return_code, goals_canceling }
}
