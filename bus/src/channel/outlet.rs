//! The way into a channel: messages are written where the readers will read them.

use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::ipc;
use iceoryx2::sample_mut::SampleMut;

use super::failures::Failures;
use super::{ChannelError, Element, Header};
use crate::clock::Clock;
use crate::message::{LAYOUT_VERSION, Stamp};

/// The way into a channel.
pub struct Outlet<H: Header, T: Element> {
    channel: &'static str,
    publisher: Publisher<ipc::Service, [T], H>,
    failures: Failures,
    epoch_ns: u64,
    n_sent: u64,
    n_max: usize,
    clock: Clock,
}

/// A message that lies in shared memory already and can still be changed.
pub struct Loan<H: Header, T: Element>(SampleMut<ipc::Service, [T], H>);

impl<H: Header, T: Element> Loan<H, T> {
    /// Its header.
    pub fn header_mut(&mut self) -> &mut H {
        self.0.user_header_mut()
    }

    /// Its payload.
    pub fn payload(&self) -> &[T] {
        self.0.payload()
    }

    /// Its payload, to be changed in place.
    pub fn payload_mut(&mut self) -> &mut [T] {
        self.0.payload_mut()
    }
}

impl<H: Header, T: Element> Outlet<H, T> {
    pub(super) fn new(
        channel: &'static str,
        publisher: Publisher<ipc::Service, [T], H>,
        failures: Failures,
        n_max: usize,
        clock: Clock,
    ) -> Self {
        Self { channel, publisher, failures, epoch_ns: clock.now_ns(), n_sent: 0, n_max, clock }
    }

    /// Failures of the transport so far: readers that are there and could not be reached.
    pub fn n_failed(&self) -> u64 {
        self.failures.n()
    }

    /// Most elements of a message.
    pub fn n_max(&self) -> usize {
        self.n_max
    }

    /// Messages sent so far.
    pub fn n_sent(&self) -> u64 {
        self.n_sent
    }

    /// Takes memory for a message that readers can reach and writes element by element into it.
    pub fn write(&self, n: usize, element: impl FnMut(usize) -> T) -> Result<Loan<H, T>, ChannelError> {
        let loan = self.publisher.loan_slice_uninit(n).map_err(|error| self.failed(error))?;
        Ok(Loan(loan.write_from_fn(element)))
    }

    /// Stamps a message and hands it over; returns its stamp.
    pub fn send(&mut self, mut loan: Loan<H, T>, valid_at_ns: u64) -> Result<Stamp, ChannelError> {
        self.n_sent += 1;
        let stamp = Stamp {
            layout_version: LAYOUT_VERSION,
            reserved: 0,
            epoch_ns: self.epoch_ns,
            sequence: self.n_sent,
            valid_at_ns,
            published_at_ns: self.clock.now_ns(),
        };
        *loan.0.user_header_mut().stamp_mut() = stamp;
        loan.0.send().map_err(|error| self.failed(error))?;
        Ok(stamp)
    }

    /// Gives readers that have come since the last message what the channel keeps for them, without a new one.
    pub fn welcome(&self) {
        // Whoever cannot be reached is counted by the handler of failures.
        self.publisher.update_connections().ok();
    }

    /// Writes and sends a message of one record.
    pub fn send_one(&mut self, header: H, record: T, valid_at_ns: u64) -> Result<Stamp, ChannelError> {
        let mut loan = self.write(1, |_| record)?;
        *loan.header_mut() = header;
        self.send(loan, valid_at_ns)
    }

    fn failed(&self, error: impl std::fmt::Display) -> ChannelError {
        ChannelError::Send { channel: self.channel, problem: error.to_string() }
    }
}
