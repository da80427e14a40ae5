//! The way out of a channel: one publisher counts, and only what is whole.

use iceoryx2::identifiers::UniquePublisherId;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::ipc;
use iceoryx2::sample::Sample;

use super::{Channel, Element, Header};
use crate::clock;
use crate::message::{LAYOUT_VERSION, Stamp};

/// A message that is read where its publisher wrote it.
pub type Message<H, T> = Sample<ipc::Service, [T], H>;

/// How far ahead of the reader's clock a message may claim to be [ns].
const FUTURE_NS: u64 = 20_000_000;

/// Why a message does not count.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Refusal {
    /// It has another layout.
    LayoutVersion,
    /// Its sizes or numbers cannot be.
    Malformed,
    /// It holds a number that is not finite where it must be.
    NonFinite,
    /// It claims to come from the future.
    FromFuture,
    /// It is older than one that was taken from the same publisher, or the same.
    OutOfOrder,
    /// Another publisher has the channel.
    OtherPublisher,
}

impl Refusal {
    /// All of them, in the order of [`Counts::refused`].
    pub const ALL: [Self; 6] = [
        Self::LayoutVersion,
        Self::Malformed,
        Self::NonFinite,
        Self::FromFuture,
        Self::OutOfOrder,
        Self::OtherPublisher,
    ];
}

/// What became of the messages of a channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Taken.
    pub received: u64,
    /// Lost on the way, by gaps in their numbers.
    pub lost: u64,
    /// Refused, by [`Refusal::ALL`].
    pub refused: [u64; Refusal::ALL.len()],
}

impl Counts {
    /// Refused for any reason.
    pub fn n_refused(&self) -> u64 {
        self.refused.iter().sum()
    }

    /// Refused for this reason.
    pub fn of(&self, refusal: Refusal) -> u64 {
        self.refused[refusal as usize]
    }
}

/// The publisher that has the channel.
#[derive(Clone, Copy, Debug)]
struct Leader {
    origin: UniquePublisherId,
    stamp: Stamp,
    heard_at_ns: u64,
}

/// The way out of a channel.
///
/// The first publisher of a message that counts has the channel until it has been silent for as long as the channel
/// says; what others send meanwhile is refused. So two controllers never take turns at the wheel, and a restarted one
/// is heard as soon as its predecessor is known to be silent.
pub struct Inlet<H: Header, T: Element> {
    subscriber: Subscriber<ipc::Service, [T], H>,
    check: fn(&H, &[T]) -> Result<(), Refusal>,
    silence_ns: u64,
    leader: Option<Leader>,
    counts: Counts,
    /// Messages of the present poll; their memory is kept for the next one.
    batch: Vec<Message<H, T>>,
}

impl<H: Header, T: Element> Inlet<H, T> {
    pub(super) fn new(channel: &Channel<H, T>, subscriber: Subscriber<ipc::Service, [T], H>) -> Self {
        Self {
            subscriber,
            check: channel.check,
            silence_ns: channel.silence_ns,
            leader: None,
            counts: Counts::default(),
            batch: Vec::with_capacity(super::PUBLISHERS_MAX * (channel.depth + 1)),
        }
    }

    /// What became of the messages so far.
    pub fn counts(&self) -> &Counts {
        &self.counts
    }

    /// When the last message that counted came in [ns]; `None` before the first.
    pub fn heard_at_ns(&self) -> Option<u64> {
        self.leader.map(|leader| leader.heard_at_ns)
    }

    /// Takes every waiting message that counts, the oldest first. What arrives meanwhile waits for the next call, so
    /// that a flood ends.
    pub fn poll(&mut self, mut take: impl FnMut(&H, &[T])) {
        self.collect();
        let mut batch = std::mem::take(&mut self.batch);
        for message in batch.drain(..) {
            if self.admit(&message, clock::now_ns()) {
                take(message.user_header(), message.payload());
            }
        }
        self.batch = batch;
    }

    /// The newest waiting message that counts, to be read in place for as long as it is kept.
    pub fn newest(&mut self) -> Option<Message<H, T>> {
        self.collect();
        let mut batch = std::mem::take(&mut self.batch);
        let mut newest = None;
        for message in batch.drain(..) {
            if self.admit(&message, clock::now_ns()) {
                newest = Some(message);
            }
        }
        self.batch = batch;
        newest
    }

    /// A publisher is passed over once as many of its messages are held as a reader may hold, so this ends whatever
    /// they do.
    fn collect(&mut self) {
        while let Ok(Some(message)) = self.subscriber.receive() {
            self.batch.push(message);
        }
    }

    fn admit(&mut self, message: &Message<H, T>, now_ns: u64) -> bool {
        let judged = self.judge(message, now_ns);
        match judged {
            Ok(()) => self.counts.received += 1,
            Err(refusal) => self.counts.refused[refusal as usize] += 1,
        }
        judged.is_ok()
    }

    fn judge(&mut self, message: &Message<H, T>, now_ns: u64) -> Result<(), Refusal> {
        let (stamp, origin) = (*message.user_header().stamp(), message.origin());
        check_stamp(&stamp, now_ns)?;
        let leader =
            self.leader.filter(|leader| now_ns.saturating_sub(leader.heard_at_ns) <= self.silence_ns);
        if let Some(leader) = &leader {
            if leader.origin != origin {
                return Err(Refusal::OtherPublisher);
            }
            if stamp.sequence <= leader.stamp.sequence || stamp.valid_at_ns < leader.stamp.valid_at_ns {
                return Err(Refusal::OutOfOrder);
            }
        }
        (self.check)(message.user_header(), message.payload())?;
        // Silence is no loss: only a publisher that goes on is asked for what lies between.
        if let Some(last) = self.leader.filter(|last| last.origin == origin) {
            let missing = stamp.sequence.saturating_sub(last.stamp.sequence.saturating_add(1));
            self.counts.lost = self.counts.lost.saturating_add(missing);
        }
        self.leader = Some(Leader { origin, stamp, heard_at_ns: now_ns });
        Ok(())
    }
}

fn check_stamp(stamp: &Stamp, now_ns: u64) -> Result<(), Refusal> {
    if stamp.layout_version != LAYOUT_VERSION {
        return Err(Refusal::LayoutVersion);
    }
    let latest_ns = now_ns.saturating_add(FUTURE_NS);
    if stamp.published_at_ns > latest_ns || stamp.valid_at_ns > latest_ns {
        return Err(Refusal::FromFuture);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_of_another_layout_or_from_the_future_are_refused() {
        let now_ns = 1_000_000_000;
        let stamp = Stamp {
            layout_version: LAYOUT_VERSION,
            valid_at_ns: now_ns,
            published_at_ns: now_ns,
            ..Stamp::default()
        };
        assert_eq!(check_stamp(&stamp, now_ns), Ok(()));
        let late = |field_ns: u64| Stamp { published_at_ns: field_ns, ..stamp };
        assert_eq!(check_stamp(&late(now_ns + FUTURE_NS), now_ns), Ok(()));
        assert_eq!(check_stamp(&late(now_ns + FUTURE_NS + 1), now_ns), Err(Refusal::FromFuture));
        let ahead = Stamp { valid_at_ns: u64::MAX, ..stamp };
        assert_eq!(check_stamp(&ahead, now_ns), Err(Refusal::FromFuture));
        let other = Stamp { layout_version: LAYOUT_VERSION + 1, ..stamp };
        assert_eq!(check_stamp(&other, now_ns), Err(Refusal::LayoutVersion));
    }

    #[test]
    fn refusals_have_their_own_counters() {
        for (place, refusal) in Refusal::ALL.into_iter().enumerate() {
            assert_eq!(refusal as usize, place);
        }
    }
}
