//! Actions: goals that are accepted or not, said how far they are, cancelled, and answered when they end.

use byteorder::LittleEndian;
use cdr_encoding::{from_bytes, to_vec};
use ros2_client::action::{
    ActionServer, ActionServerQosPolicies, CancelGoalRequest, GoalId, SendGoalResponse,
};
use ros2_client::action::{CancelGoalResponse, GetResultResponse, GoalStatusEnum};
use ros2_client::action_msgs::{GoalStatus, GoalStatusArray};
use ros2_client::builtin_interfaces::Time;
use ros2_client::qos::{Durability, History, QosProfile, WhenFull};
use ros2_client::{ActionTypeName, Message, Name, RmwRequestId, ServiceMapping};
use serde::Deserialize;

use super::{BATCH, Node, NodeError, REQUESTS, absolute};

/// Words of how far goals are that wait for whoever hears them.
const PROGRESS: usize = 4;

/// An action that is offered, with its goals, results and feedback.
pub(crate) struct Action<G: Message + Clone, R: Message + Clone, F: Message> {
    server: ActionServer<G, R, F>,
    name: String,
}

/// Which goals are to be cancelled: what `CancelGoalRequest` holds and does not show.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub(crate) struct Cancelled {
    /// The one of this name; of no name if zero.
    pub(crate) id: GoalId,
    sec: i32,
    nanosec: u32,
}

impl Cancelled {
    fn of(request: &CancelGoalRequest) -> Option<Self> {
        let bytes = to_vec::<_, LittleEndian>(request).ok()?;
        from_bytes::<Self, LittleEndian>(&bytes).ok().map(|(cancelled, _)| cancelled)
    }

    /// And those up to this stamp, unless it is 0 [ns].
    pub(crate) fn stamp_ns(&self) -> i64 {
        i64::from(self.sec) * 1_000_000_000 + i64::from(self.nanosec)
    }
}

impl<G, R, F> Action<G, R, F>
where
    G: Message + Clone + 'static,
    R: Message + Clone + 'static,
    F: Message + 'static,
{
    /// Hands over goals that have come, each to be accepted, at a stamp [ns], or not. What cannot be read is asked in
    /// vain: nobody knows whom to answer.
    pub(crate) fn goals(&self, mut accept: impl FnMut(GoalId, G) -> Option<i64>) {
        for _ in 0..BATCH {
            match self.server.receive_goal() {
                Ok(Some((asked, request))) => {
                    let stamp_ns = accept(request.goal_id, request.goal);
                    let stamp = Time::from_nanos(stamp_ns.unwrap_or_default());
                    let answer = SendGoalResponse { accepted: stamp_ns.is_some(), stamp };
                    // Who asked and takes no answer waits no longer: no robot stops for it.
                    self.server.send_goal_response(asked, answer).ok();
                }
                Ok(None) => return,
                Err(_) => {}
            }
        }
    }

    /// Answers whoever wants goals cancelled.
    pub(crate) fn cancels(&self, mut cancel: impl FnMut(Cancelled) -> CancelGoalResponse) {
        for _ in 0..BATCH {
            match self.server.receive_cancel_request() {
                Ok(Some((asked, request))) => {
                    if let Some(cancelled) = Cancelled::of(&request) {
                        self.server.send_cancel_response(asked, cancel(cancelled)).ok();
                    }
                }
                Ok(None) => return,
                Err(_) => {}
            }
        }
    }

    /// Hands over who asks how a goal ended. It may be told later.
    pub(crate) fn askers(&self, mut ask: impl FnMut(GoalId, RmwRequestId)) {
        for _ in 0..BATCH {
            match self.server.receive_result_request() {
                Ok(Some((asked, request))) => ask(request.goal_id, asked),
                Ok(None) => return,
                Err(_) => {}
            }
        }
    }

    /// Tells who asked how a goal ended.
    pub(crate) fn tell_end(&self, asked: RmwRequestId, status: GoalStatusEnum, result: R) {
        self.server.send_result(asked, GetResultResponse { status, result }).ok();
    }

    /// Says how far a goal is.
    pub(crate) fn tell_progress(&self, id: GoalId, feedback: F) -> Result<(), NodeError> {
        self.server.send_feedback(id, feedback).map_err(|error| self.failed(&error.to_string()))
    }

    /// Says how all goals stand; who comes late is told, too.
    pub(crate) fn tell_statuses(&self, status_list: Vec<GoalStatus>) -> Result<(), NodeError> {
        let told = self.server.send_goal_statuses(GoalStatusArray { status_list });
        told.map_err(|error| self.failed(&error.to_string()))
    }

    fn failed(&self, problem: &str) -> NodeError {
        NodeError::Topic { topic: self.name.clone(), problem: problem.to_owned() }
    }
}

fn reliable(depth: usize) -> QosProfile {
    QosProfile::publisher_default().history(History::KeepLast { depth }).reliability_reliable(WhenFull::Fail)
}

impl Node {
    /// Offers an action of a type of a package; none of an empty name.
    pub(crate) fn act<G, R, F>(
        &mut self,
        action: &str,
        package: &str,
        kind: &str,
    ) -> Result<Option<Action<G, R, F>>, NodeError>
    where
        G: Message + Clone + 'static,
        R: Message + Clone + 'static,
        F: Message + 'static,
    {
        if action.is_empty() {
            return Ok(None);
        }
        let path = Name::parse(&absolute(self.node.namespace(), action)).map_err(|error| {
            NodeError::Name { what: "ros.topics", found: action.to_owned(), problem: error.to_string() }
        })?;
        let qualities = ActionServerQosPolicies {
            goal_service: reliable(REQUESTS),
            result_service: reliable(REQUESTS),
            cancel_service: reliable(REQUESTS),
            feedback_publisher: reliable(PROGRESS),
            status_publisher: reliable(1).durability(Durability::TransientLocal),
        };
        let failed = |problem: String| NodeError::Topic { topic: action.to_owned(), problem };
        let kind = ActionTypeName::new(package, kind);
        let server = self.node.create_action_server(ServiceMapping::Enhanced, &path, &kind, qualities);
        let mut server: ActionServer<G, R, F> = server.map_err(|error| failed(error.to_string()))?;
        self.wake_for(server.goal_server())
            .and_then(|()| self.wake_for(server.cancel_server()))
            .and_then(|()| self.wake_for(server.result_server()))
            .map_err(|error| failed(error.to_string()))?;
        self.quality.watch(server.feedback_publisher().guid(), &format!("{action}/_action/feedback"));
        self.quality.watch(server.my_status_publisher().guid(), &format!("{action}/_action/status"));
        Ok(Some(Action { server, name: action.to_owned() }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ros2_client::action::GoalInfo;
    use serde::Serialize;

    /// What a request consists of.
    #[derive(Serialize)]
    struct Told {
        goal_info: GoalInfo,
    }

    #[test]
    fn what_a_request_to_cancel_holds_is_read() {
        let (id, stamp) = (GoalId::new_random(), Time::from_nanos(1_700_000_000_000_000_042));
        let told = to_vec::<_, LittleEndian>(&Told { goal_info: GoalInfo { goal_id: id, stamp } }).unwrap();
        let (request, _) = from_bytes::<CancelGoalRequest, LittleEndian>(&told).unwrap();
        let cancelled = Cancelled::of(&request).unwrap();
        assert_eq!((cancelled.id, cancelled.stamp_ns()), (id, 1_700_000_000_000_000_042));
    }
}
