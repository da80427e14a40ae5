//! Who offers a topic less surely than it is heard, and who asks for more than is offered: neither hears the other, and
//! nothing else says so.

use rustdds::policy::{Durability, Reliability};
use rustdds::{DomainParticipantStatusEvent, GUID, QosPolicies};

/// Two ends of a topic that cannot be joined. Every message is one line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Mismatch {
    /// Who speaks does so less surely than is asked.
    #[error(
        "quality of service: expected a publisher that is {asked}, found one that is {offered} and is not heard"
    )]
    Publisher {
        /// By this node.
        asked: String,
        /// By the other.
        offered: String,
    },
    /// Who listens asks for more than there is.
    #[error(
        "quality of service: expected a subscriber that asks for {offered} at the most, found one that asks for {asked} \
         and hears nothing"
    )]
    Subscriber {
        /// By the other.
        asked: String,
        /// By this node.
        offered: String,
    },
}

/// Looks for such ends among those of one node.
#[derive(Default)]
pub(crate) struct Quality {
    endpoints: Vec<(GUID, String)>,
}

impl Quality {
    /// Looks at a topic from now on, by the first end of it: a second one hears who the first does not.
    pub(crate) fn watch(&mut self, endpoint: GUID, topic: &str) {
        if self.endpoints.iter().all(|(_, watched)| watched != topic) {
            self.endpoints.push((endpoint, topic.to_owned()));
        }
    }

    /// What an event tells of, with its topic.
    pub(crate) fn mismatch(&self, event: DomainParticipantStatusEvent) -> Option<(String, Mismatch)> {
        use DomainParticipantStatusEvent::{RemoteReaderQosIncompatible, RemoteWriterQosIncompatible};
        let (endpoint, mismatch) = match event {
            RemoteWriterQosIncompatible { local_reader, requested_qos, offered_qos, .. } => {
                let (asked, offered) = (told(&requested_qos), told(&offered_qos));
                (local_reader, Mismatch::Publisher { asked, offered })
            }
            RemoteReaderQosIncompatible { local_writer, requested_qos, offered_qos, .. } => {
                let (asked, offered) = (told(&requested_qos), told(&offered_qos));
                (local_writer, Mismatch::Subscriber { asked, offered })
            }
            _ => return None,
        };
        let (_, topic) = self.endpoints.iter().find(|(watched, _)| *watched == endpoint)?;
        Some((topic.clone(), mismatch))
    }
}

/// The two policies that ends part over, by the names that ROS has for them.
fn told(qos: &QosPolicies) -> String {
    let reliability = match qos.reliability() {
        Some(Reliability::Reliable { .. }) => "reliable",
        Some(Reliability::BestEffort) | None => "best effort",
    };
    let durability = match qos.durability() {
        Some(Durability::Volatile) | None => "volatile",
        Some(_) => "transient local",
    };
    format!("{reliability} and {durability}")
}
