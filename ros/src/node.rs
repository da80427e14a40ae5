//! A node of ROS 2: what it hears and what it says.

mod action;
mod namesakes;

use std::net::{IpAddr, Ipv4Addr};

use ros2_client::qos::{Durability, History, QosProfile, WhenFull};
use ros2_client::{
    Context, Gid, Message, MessageTypeName, Name, NodeName, NodeOptions, Publisher, Server, ServiceMapping,
    ServiceTypeName, Subscription,
};
use rustdds::mio1::event::Source;
use rustdds::mio1::{Events, Interest, Poll, Token};
use rustdds::{DomainParticipantBuilder, DomainParticipantStatusListener, StatusEvented};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::time::Duration;

use crate::environment::{Discovery, Range};
use crate::message::Named;
use crate::quality::{Mismatch, Quality};
pub(crate) use action::Action;
use namesakes::Namesakes;

/// Messages of one topic that are taken in at one look: whoever floods a topic keeps no other waiting.
const BATCH: usize = 64;
/// Requests of a service that wait.
const REQUESTS: usize = 16;

/// Why there is no node, or no topic of it. Every message is one line.
#[derive(Debug, thiserror::Error)]
pub enum NodeError {
    /// A name that is none.
    #[error(
        "{what}: expected a name of ROS 2, letters, digits and _ with / between them, found {found:?}: {problem}"
    )]
    Name {
        /// What it should name.
        what: &'static str,
        /// What it is.
        found: String,
        /// Why.
        problem: String,
    },
    /// The network.
    #[error("domain {domain_id}: expected to join it, found: {problem}")]
    Join {
        /// The domain.
        domain_id: u16,
        /// What the system said.
        problem: String,
    },
    /// A topic that cannot be used.
    #[error("topic {topic}: expected to use it, found: {problem}")]
    Topic {
        /// Its name.
        topic: String,
        /// What the middleware said.
        problem: String,
    },
}

/// How surely a topic is heard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Hearing {
    /// What is lost is lost; every publisher is heard, however it offers its topic.
    Loose(usize),
    /// What is lost comes again, and of publishers that keep what they said, what was said before.
    Kept(usize),
    /// What is lost comes again; only of publishers that offer it.
    Sure(usize),
}

impl Hearing {
    fn profile(self) -> QosProfile {
        let (Self::Loose(depth) | Self::Kept(depth) | Self::Sure(depth)) = self;
        let profile = QosProfile::subscription_default().history(History::KeepLast { depth });
        match self {
            Self::Loose(_) => profile,
            Self::Sure(_) => profile.reliability_reliable(WhenFull::Fail),
            Self::Kept(_) => {
                profile.reliability_reliable(WhenFull::Fail).durability(Durability::TransientLocal)
            }
        }
    }
}

/// Whether those that come late are told what was said last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Saying {
    /// They wait for the next.
    Passing,
    /// They are given the last.
    Latched,
}

/// Which message it is, by whom.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Origin {
    pub(crate) publisher: Gid,
    /// Counts the publisher's messages.
    pub(crate) sequence: i64,
}

/// A topic that is listened to.
pub(crate) struct Ear<M: 'static> {
    pub(crate) topic: String,
    subscription: Subscription<M>,
}

impl<M: DeserializeOwned + 'static> Ear<M> {
    /// Hands over what has come, and why what cannot be read is not.
    pub(crate) fn take(&mut self, mut take: impl FnMut(&str, Result<(M, Origin), String>)) {
        for _ in 0..BATCH {
            match self.subscription.take() {
                Ok(Some((message, info))) => {
                    let (publisher, sequence) = (info.publisher_gid(), info.sequence_number());
                    take(&self.topic, Ok((message, Origin { publisher, sequence })));
                }
                Ok(None) => return,
                Err(error) => {
                    take(&self.topic, Err(format!("message: expected its type's bytes, found: {error}")))
                }
            }
        }
    }
}

/// A topic that is spoken on.
pub(crate) struct Voice<M: Serialize> {
    pub(crate) topic: String,
    publisher: Publisher<M>,
}

impl<M: Serialize> Voice<M> {
    /// Says something, and never waits for whoever hears it.
    pub(crate) fn say(&self, message: M) -> Result<(), NodeError> {
        let failed = |problem: String| NodeError::Topic { topic: self.topic.clone(), problem };
        self.publisher.publish(message).map_err(|error| failed(error.to_string()))
    }
}

/// A service that is offered.
pub(crate) struct Service<Q: Message, A: Message> {
    server: Server<Q, A>,
}

impl<Q: Message + 'static, A: Message + 'static> Service<Q, A> {
    /// Answers what has been asked. What cannot be read is asked in vain: nobody knows whom to answer.
    pub(crate) fn answer(&self, mut reply: impl FnMut(Q) -> A) {
        for _ in 0..BATCH {
            match self.server.receive_request() {
                Ok(Some((id, asked))) => match self.server.send_response(id, reply(asked)) {
                    // Who asked and takes no answer waits no longer: no robot stops for it.
                    Ok(()) | Err(_) => {}
                },
                Ok(None) => break,
                Err(_) => {}
            }
        }
    }
}

/// A topic's name from the root: those without a slash at their beginning lie below the namespace.
pub(crate) fn absolute(namespace: &str, topic: &str) -> String {
    if topic.starts_with('/') {
        topic.to_owned()
    } else {
        format!("{}/{topic}", namespace.trim_end_matches('/'))
    }
}

/// The node.
pub(crate) struct Node {
    node: ros2_client::Node,
    poll: Poll,
    events: Events,
    n_ears: usize,
    full_name: String,
    events_of_others: DomainParticipantStatusListener,
    quality: Quality,
    namesakes: Namesakes,
}

impl Node {
    /// Joins a domain under this name.
    pub(crate) fn join(discovery: Discovery, namespace: &str, name: &str) -> Result<Self, NodeError> {
        let Discovery { domain_id, range } = discovery;
        let refused = |problem: String| NodeError::Join { domain_id, problem };
        let named = NodeName::new(namespace, name).map_err(|error| NodeError::Name {
            what: "ros.node",
            found: format!("{namespace} {name}"),
            problem: error.to_string(),
        })?;
        let builder = DomainParticipantBuilder::new(domain_id);
        let builder = match range {
            Range::Localhost => builder.with_only_networks([IpAddr::V4(Ipv4Addr::LOCALHOST)]),
            Range::Subnet => builder,
        };
        let participant = builder.build().map_err(|error| refused(error.to_string()))?;
        let context =
            Context::from_domain_participant(participant).map_err(|error| refused(error.to_string()))?;
        let events_of_others = context.domain_participant().status_listener();
        let options = NodeOptions::new().enable_rosout(false);
        let mut node = context.new_node(named, options).map_err(|error| refused(error.to_string()))?;
        let poll = Poll::new().map_err(|error| refused(error.to_string()))?;
        let full_name = absolute(namespace, name);
        let namesakes = Namesakes::new(&context, &mut node, &full_name)?;
        let (events, quality) = (Events::with_capacity(64), Quality::default());
        Ok(Self { node, poll, events, n_ears: 0, full_name, events_of_others, quality, namesakes })
    }

    /// Namespace and name.
    pub(crate) fn full_name(&self) -> &str {
        &self.full_name
    }

    /// Ends of its topics that cannot be joined to those of others, found since the last look.
    pub(crate) fn mismatches(&mut self) -> Vec<(String, Mismatch)> {
        let mut found = Vec::new();
        while let Some(event) = self.events_of_others.try_recv_status() {
            self.namesakes.follow(&event);
            found.extend(self.quality.mismatch(event));
        }
        found
    }

    /// How many other nodes of its name there are.
    pub(crate) fn n_namesakes(&mut self) -> usize {
        self.namesakes.look()
    }

    /// Listens to a topic; to none of an empty name.
    pub(crate) fn listen<M>(&mut self, topic: &str, hearing: Hearing) -> Result<Option<Ear<M>>, NodeError>
    where
        M: Named + DeserializeOwned + 'static,
    {
        if topic.is_empty() {
            return Ok(None);
        }
        let failed = |problem: String| NodeError::Topic { topic: topic.to_owned(), problem };
        let profile = hearing.profile();
        let of = self.topic::<M>(topic, &profile)?;
        let subscription = self.node.create_subscription::<M>(&of, Some(profile));
        let mut subscription = subscription.map_err(|error| failed(error.to_string()))?;
        self.wake_for(&mut subscription).map_err(|error| failed(error.to_string()))?;
        self.quality.watch(subscription.guid(), topic);
        Ok(Some(Ear { topic: topic.to_owned(), subscription }))
    }

    /// Speaks on a topic; on none of an empty name.
    pub(crate) fn speak<M: Named + Serialize>(
        &mut self,
        topic: &str,
        saying: Saying,
    ) -> Result<Option<Voice<M>>, NodeError> {
        if topic.is_empty() {
            return Ok(None);
        }
        let profile = QosProfile::publisher_default().reliability_reliable(WhenFull::Fail);
        let profile = match saying {
            Saying::Passing => profile.history(History::KeepLast { depth: 4 }),
            Saying::Latched => {
                profile.history(History::KeepLast { depth: 1 }).durability(Durability::TransientLocal)
            }
        };
        let of = self.topic::<M>(topic, &profile)?;
        let publisher = self.node.create_publisher(&of, Some(profile));
        let failed = |problem: String| NodeError::Topic { topic: topic.to_owned(), problem };
        let publisher = publisher.map_err(|error| failed(error.to_string()))?;
        self.quality.watch(publisher.guid(), topic);
        Ok(Some(Voice { topic: topic.to_owned(), publisher }))
    }

    /// Offers a service of the node's parameters below its name, of a type of `rcl_interfaces`.
    pub(crate) fn serve<Q, A>(&mut self, service: &str, kind: &str) -> Result<Service<Q, A>, NodeError>
    where
        Q: Message + Clone + 'static,
        A: Message + 'static,
    {
        let name = format!("{}/{service}", self.full_name);
        let failed = |problem: String| NodeError::Topic { topic: name.clone(), problem };
        let path = Name::parse(&name).map_err(|error| failed(error.to_string()))?;
        let profile = QosProfile::publisher_default()
            .history(History::KeepLast { depth: REQUESTS })
            .reliability_reliable(WhenFull::Fail);
        let kind = ServiceTypeName::new("rcl_interfaces", kind);
        let mapping = ServiceMapping::Enhanced;
        let server = self.node.create_server(mapping, &path, &kind, profile.clone(), profile.clone());
        let mut server = server.map_err(|error| failed(error.to_string()))?;
        self.wake_for(&mut server).map_err(|error| failed(error.to_string()))?;
        Ok(Service { server })
    }

    /// Ends a wait when there is something to be read.
    fn wake_for(&mut self, source: &mut impl Source) -> std::io::Result<()> {
        let token = Token(self.n_ears);
        self.n_ears += 1;
        self.poll.registry().register(source, token, Interest::READABLE)
    }

    /// Waits until something has come, at most so long.
    pub(crate) fn wait(&mut self, patience: Duration) {
        // A signal wakes early, and whatever else is wrong shows where messages are taken.
        self.poll.poll(&mut self.events, Some(patience)).ok();
    }

    fn topic<M: Named>(&self, topic: &str, profile: &QosProfile) -> Result<rustdds::Topic, NodeError> {
        let name = Name::parse(&absolute(self.node.namespace(), topic)).map_err(|error| NodeError::Name {
            what: "ros.topics",
            found: topic.to_owned(),
            problem: error.to_string(),
        })?;
        let created = self.node.create_topic(&name, MessageTypeName::new(M::PACKAGE, M::TYPE), profile);
        created.map_err(|error| NodeError::Topic { topic: topic.to_owned(), problem: error.to_string() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn topics_lie_below_the_namespace_unless_they_begin_at_the_root() {
        for (namespace, topic, expected) in
            [("/", "odom", "/odom"), ("/north", "a/odom", "/north/a/odom"), ("/north", "/tf", "/tf")]
        {
            assert_eq!(absolute(namespace, topic), expected);
            assert!(Name::parse(expected).unwrap().is_absolute());
        }
    }
}
