//! Other nodes of the same name: two that command one robot by the same topics, and answer for the same parameters.

use std::collections::BTreeSet;

use ros2_client::builtin_topics::ros_discovery;
use ros2_client::entities_info::ParticipantEntitiesInfo;
use ros2_client::{Context, Subscription};
use rustdds::{DomainParticipantStatusEvent, GUID, TopicKind};

use super::NodeError;

/// Messages that are taken in at one look.
const BATCH: usize = 64;

/// The participants that have a node of the name of this one.
pub(super) struct Namesakes {
    told: Subscription<ParticipantEntitiesInfo>,
    own: GUID,
    full_name: String,
    participants: BTreeSet<GUID>,
}

impl Namesakes {
    pub(super) fn new(
        context: &Context,
        node: &mut ros2_client::Node,
        full_name: &str,
    ) -> Result<Self, NodeError> {
        let failed = |problem: String| NodeError::Topic { topic: ros_discovery::TOPIC_NAME.into(), problem };
        let topic = context.domain_participant().create_topic(
            ros_discovery::TOPIC_NAME.into(),
            ros_discovery::TYPE_NAME.into(),
            &ros_discovery::QOS_PUB,
            TopicKind::NoKey,
        );
        let topic = topic.map_err(|error| failed(error.to_string()))?;
        // As it is published: those that were there before tell what they said last.
        let told = node.create_subscription(&topic, None).map_err(|error| failed(error.to_string()))?;
        let own = context.participant_entities_info().gid().into();
        Ok(Self { told, own, full_name: full_name.to_owned(), participants: BTreeSet::new() })
    }

    /// Follows what participants say of their nodes, and returns how many others have one of this name.
    pub(super) fn look(&mut self) -> usize {
        for _ in 0..BATCH {
            match self.told.take() {
                Ok(Some((told, _))) => self.note(&told),
                Ok(None) => break,
                // Nodes whose names are none have not this one either.
                Err(_) => {}
            }
        }
        self.participants.len()
    }

    /// Those that have left are no namesakes any more.
    pub(super) fn follow(&mut self, event: &DomainParticipantStatusEvent) {
        if let DomainParticipantStatusEvent::ParticipantLost { id, .. } = event {
            self.participants.retain(|participant| participant.prefix != *id);
        }
    }

    fn note(&mut self, told: &ParticipantEntitiesInfo) {
        let participant = GUID::from(told.gid());
        let has_name = told.nodes().iter().any(|node| node.fully_qualified_name() == self.full_name);
        if has_name && participant != self.own {
            self.participants.insert(participant);
        } else {
            self.participants.remove(&participant);
        }
    }
}
