//! The way out of a channel: only what is whole counts, of the publisher that has the channel.

use iceoryx2::identifiers::UniquePublisherId;
use iceoryx2::port::ReceiveError;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::{CallbackProgression, PortFactory as _, ipc};
use iceoryx2::sample::Sample;
use iceoryx2::service::header::payload_header::PayloadHeader;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;

use super::failures::Failures;
use super::{Channel, Element, Header};
use crate::clock::Clock;
use crate::message::{LAYOUT_VERSION, Stamp};

/// Publishers whose memory is remembered: those of the present, and of late.
const CAPACITIES_KEPT: usize = 8;
/// Failures of the transport after which a look at the channel ends.
const FAILURES_MAX: u64 = 8;

/// A message whose payload is read where its publisher wrote it.
///
/// The publisher can still write there. The header is therefore a copy, and so is the number of elements, which lies
/// within the publisher's memory: whatever is written later, the same header is read, and nothing beyond that memory.
/// What the elements are may change at any time; whoever reads them bears every value.
pub struct Message<H: Header, T: Element> {
    sample: Sample<ipc::Service, [T], H>,
    header: H,
    n_elements: usize,
}

impl<H: Header, T: Element> Message<H, T> {
    fn new(sample: Sample<ipc::Service, [T], H>) -> Self {
        let header = *sample.user_header();
        let n_elements = usize::try_from(sample.header().number_of_elements()).unwrap_or(usize::MAX);
        Self { sample, header, n_elements }
    }

    /// The header as it was when the message was taken.
    pub fn header(&self) -> &H {
        &self.header
    }

    /// The elements, as many as when the message was taken; none once the publisher has written another number.
    /// To be asked for once for all that shall be of one length.
    pub fn payload(&self) -> &[T] {
        if self.sample.header().number_of_elements() != self.n_elements as u64 {
            return &[];
        }
        // The number is read again in there: what is longer by now is cut, what is shorter is nothing.
        self.sample.payload().get(..self.n_elements).unwrap_or_default()
    }
}

/// How far ahead of the reader's clock a message may claim to be [ns].
pub(crate) const FUTURE_NS: u64 = 20_000_000;

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
    /// Another publisher has had the channel since.
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
    /// Failures of the transport: publishers that are there and whose memory could not be reached.
    pub failed: u64,
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

/// The publisher that was heard last, and its last message that counted.
#[derive(Clone, Copy, Debug)]
struct Heard {
    origin: UniquePublisherId,
    stamp: Stamp,
}

/// The way out of a channel.
///
/// A channel has one publisher at a time, and each begins later than the one before. A reader follows the latest that it
/// has heard of, so that all readers follow the same one whenever they look: two controllers never take turns at the
/// wheel, and a restarted one is heard at once.
pub struct Inlet<H: Header, T: Element> {
    service: PortFactory<ipc::Service, [T], H>,
    subscriber: Subscriber<ipc::Service, [T], H>,
    failures: Failures,
    clock: Clock,
    /// Most elements of a message of each publisher, as it said before it sent any.
    capacities: Vec<(UniquePublisherId, usize)>,
    check: fn(&H, &[T]) -> Result<(), Refusal>,
    heard: Option<Heard>,
    counts: Counts,
    /// Messages of the present poll; their memory is kept for the next one.
    batch: Vec<Message<H, T>>,
    /// What is checked and taken by [`Inlet::poll`], out of reach of its publisher.
    copy: Vec<T>,
}

impl<H: Header, T: Element> Inlet<H, T> {
    pub(super) fn new(
        channel: &Channel<H, T>,
        service: PortFactory<ipc::Service, [T], H>,
        subscriber: Subscriber<ipc::Service, [T], H>,
        failures: Failures,
        clock: Clock,
    ) -> Self {
        Self {
            service,
            subscriber,
            failures,
            clock,
            capacities: Vec::with_capacity(CAPACITIES_KEPT),
            check: channel.check,
            heard: None,
            counts: Counts::default(),
            // Of the present publisher, and what one that died has left.
            batch: Vec::with_capacity(2 * (channel.depth + 1)),
            copy: Vec::with_capacity(1),
        }
    }

    /// Whether somebody has the way into the channel, or had it and died without anybody's clearing that away.
    pub fn has_publisher(&self) -> bool {
        self.service.dynamic_config().number_of_publishers() > 0
    }

    /// What became of the messages so far.
    pub fn counts(&self) -> &Counts {
        &self.counts
    }

    /// Takes every waiting message that counts, the oldest first, as copies that were checked. What arrives meanwhile
    /// waits for the next call, so that a flood ends.
    pub fn poll(&mut self, mut take: impl FnMut(&H, &[T])) {
        self.collect();
        let (mut batch, mut copy) = (std::mem::take(&mut self.batch), std::mem::take(&mut self.copy));
        for message in batch.drain(..) {
            copy.clear();
            if self.is_within_memory(&message) {
                copy.extend_from_slice(message.payload());
            }
            if self.admit(&message, &copy, self.clock.now_ns()) {
                take(&message.header, &copy);
            }
        }
        (self.batch, self.copy) = (batch, copy);
    }

    /// The newest waiting message that counts, to be read in place for as long as it is kept.
    pub fn newest(&mut self) -> Option<Message<H, T>> {
        self.newest_of(|_| ())
    }

    /// The same, after a look at the header of every waiting message that counts, the oldest first.
    pub fn newest_of(&mut self, mut look: impl FnMut(&H)) -> Option<Message<H, T>> {
        self.collect();
        let mut batch = std::mem::take(&mut self.batch);
        let mut newest = None;
        for message in batch.drain(..) {
            let payload = if self.is_within_memory(&message) { message.payload() } else { &[] };
            if self.admit(&message, payload, self.clock.now_ns()) {
                look(&message.header);
                newest = Some(message);
            }
        }
        self.batch = batch;
        newest
    }

    /// Ends once as many messages are held as a reader may hold, whatever their publisher does meanwhile.
    fn collect(&mut self) {
        let mut n_failed = 0;
        while n_failed < FAILURES_MAX {
            match self.subscriber.receive() {
                Ok(Some(sample)) => self.batch.push(Message::new(sample)),
                Ok(None) | Err(ReceiveError::ExceedsMaxBorrows) => break,
                // Others are still to be heard.
                Err(ReceiveError::ConnectionFailure(_)) => n_failed += 1,
            }
        }
        self.failures.note(n_failed);
        self.counts.failed = self.failures.n();
    }

    /// Whether a message lies within what its publisher has. The number of its elements is written by the publisher,
    /// and read as far as it says.
    fn is_within_memory(&mut self, message: &Message<H, T>) -> bool {
        let origin = message.sample.origin();
        let known = self.capacities.iter().find(|(of, _)| *of == origin).map(|(_, capacity)| *capacity);
        known.or_else(|| self.learn_capacity(origin)).is_some_and(|capacity| message.n_elements <= capacity)
    }

    /// What a publisher said that its messages hold at most; `None` when it has gone.
    fn learn_capacity(&mut self, origin: UniquePublisherId) -> Option<usize> {
        let mut capacity = None;
        self.service.dynamic_config().list_publishers(|details| {
            if details.publisher_id != origin {
                return CallbackProgression::Continue;
            }
            capacity = Some(details.max_slice_len);
            CallbackProgression::Stop
        });
        if self.capacities.len() == CAPACITIES_KEPT {
            self.capacities.remove(0);
        }
        self.capacities.extend(capacity.map(|capacity| (origin, capacity)));
        capacity
    }

    fn admit(&mut self, message: &Message<H, T>, payload: &[T], now_ns: u64) -> bool {
        let judged = self.judge(message, payload, now_ns);
        match judged {
            Ok(()) => self.counts.received += 1,
            Err(refusal) => self.counts.refused[refusal as usize] += 1,
        }
        judged.is_ok()
    }

    fn judge(&mut self, message: &Message<H, T>, payload: &[T], now_ns: u64) -> Result<(), Refusal> {
        let (stamp, origin) = (*message.header.stamp(), message.sample.origin());
        check_stamp(&stamp, now_ns)?;
        if let Some(Heard { origin: last_origin, stamp: last, .. }) = self.heard {
            if last_origin != origin && stamp.epoch_ns <= last.epoch_ns {
                return Err(Refusal::OtherPublisher);
            }
            let follows = stamp.sequence > last.sequence && stamp.valid_at_ns >= last.valid_at_ns;
            if last_origin == origin && !follows {
                return Err(Refusal::OutOfOrder);
            }
        }
        // One that says it is longer than its publisher's memory comes here as empty.
        if payload.len() != message.n_elements {
            return Err(Refusal::Malformed);
        }
        (self.check)(&message.header, payload)?;
        // What another publisher sent before it was heard of is no loss: only one that goes on is asked for it.
        if let Some(last) = self.heard.filter(|last| last.origin == origin) {
            let missing = stamp.sequence.saturating_sub(last.stamp.sequence.saturating_add(1));
            self.counts.lost = self.counts.lost.saturating_add(missing);
        }
        self.heard = Some(Heard { origin, stamp });
        Ok(())
    }
}

fn check_stamp(stamp: &Stamp, now_ns: u64) -> Result<(), Refusal> {
    if stamp.layout_version != LAYOUT_VERSION {
        return Err(Refusal::LayoutVersion);
    }
    let latest_ns = now_ns.saturating_add(FUTURE_NS);
    if [stamp.epoch_ns, stamp.published_at_ns, stamp.valid_at_ns].iter().any(|at_ns| *at_ns > latest_ns) {
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
        let unborn = Stamp { epoch_ns: u64::MAX, ..stamp };
        assert_eq!(
            check_stamp(&unborn, now_ns),
            Err(Refusal::FromFuture),
            "it would keep out all that follow"
        );
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
