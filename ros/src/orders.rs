//! Orders to the mission, by threads of their own: an answer takes a moment, and odometry does not wait for it.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};
use std::thread;

use bus::message::MissionRecord;

/// Orders that wait to be said; whoever floods with them is refused.
const WAITING_MAX: usize = 16;

/// What is said of orders that there is no room for.
pub(crate) const FLOOD: &str = "expected no more than the mission can answer, found a flood of them";

/// What somebody who speaks ROS tells the vehicle to do.
#[derive(Clone, Debug, PartialEq)]
pub enum Order {
    /// Go to these places, one after the other, east and north [m].
    Goals(Vec<[f64; 2]>),
    /// Follow a path through these corners, east and north [m], at this speed [m/s].
    Path {
        /// Its corners [m].
        corners_m: Vec<[f64; 2]>,
        /// How fast [m/s].
        speed_mps: f64,
    },
    /// Plan for this share of the worst outcomes, in (0, 1].
    Tolerate(f64),
    /// Wait.
    Pause,
    /// Go on.
    Resume,
    /// Stand; the mission is over.
    Cancel,
    /// Stop, until it is reset.
    EmergencyStop,
    /// The emergency is over; the mission is paused.
    Reset,
}

impl Order {
    fn is_urgent(&self) -> bool {
        matches!(self, Self::EmergencyStop | Self::Reset)
    }
}

/// Says an order to the run, and returns what the vehicle is to do now, or why the order does not count, in one line.
pub type Director = dyn Fn(&Order) -> Result<MissionRecord, String> + Send + Sync;

/// Which order it is; they count up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Ticket(pub(crate) u64);

/// What became of an order.
#[derive(Clone, Debug)]
pub(crate) struct Answer {
    pub(crate) ticket: Ticket,
    pub(crate) order: Order,
    pub(crate) said: Result<MissionRecord, String>,
}

/// Whoever says orders.
pub(crate) struct Orders {
    ordinary: SyncSender<(Ticket, Order)>,
    /// Emergency stops, and what ends them, wait for nothing else.
    urgent: SyncSender<(Ticket, Order)>,
    answers: Receiver<Answer>,
    n_said: u64,
    /// The newest that was given to be said, of those that wait for one another.
    last: Ticket,
    /// The newest of them that was answered.
    answered: Ticket,
}

impl Orders {
    /// Threads that say what they are given.
    pub(crate) fn new(director: Arc<Director>) -> Self {
        let (answer, answers) = channel();
        let [ordinary, urgent] = [Arc::clone(&director), director].map(|director| {
            let (sender, orders) = sync_channel(WAITING_MAX);
            let answer = answer.clone();
            thread::spawn(move || say_all(&orders, &*director, &answer));
            sender
        });
        let none = Ticket::default();
        Self { ordinary, urgent, answers, n_said: 0, last: none, answered: none }
    }

    /// Gives an order to be said, if there is room for it.
    pub(crate) fn say(&mut self, order: Order) -> Option<Ticket> {
        let (ticket, is_urgent) = (Ticket(self.n_said + 1), order.is_urgent());
        let way = if is_urgent { &self.urgent } else { &self.ordinary };
        way.try_send((ticket, order)).ok()?;
        self.n_said = ticket.0;
        self.last = if is_urgent { self.last } else { ticket };
        Some(ticket)
    }

    /// What has become of orders since the last look.
    pub(crate) fn answers(&mut self) -> Vec<Answer> {
        let answers: Vec<Answer> = self.answers.try_iter().collect();
        let ordinary = answers.iter().rfind(|answer| !answer.order.is_urgent());
        self.answered = ordinary.map_or(self.answered, |answer| answer.ticket);
        answers
    }

    /// The newest that was given to be said, of those that wait for one another.
    pub(crate) fn last(&self) -> Ticket {
        self.last
    }

    /// The newest of them that was answered.
    pub(crate) fn answered(&self) -> Ticket {
        self.answered
    }
}

/// Ends when nobody gives orders any more.
fn say_all(orders: &Receiver<(Ticket, Order)>, director: &Director, answer: &Sender<Answer>) {
    while let Ok((ticket, order)) = orders.recv() {
        let said = director(&order);
        if answer.send(Answer { ticket, order, said }).is_err() {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_answered_by_their_tickets_and_urgent_ones_wait_for_nobody() {
        let (begin, begun) = sync_channel::<()>(0);
        let begun = std::sync::Mutex::new(begun);
        let mut orders = Orders::new(Arc::new(move |order: &Order| match order {
            Order::EmergencyStop => Ok(MissionRecord::default()),
            _ => {
                begun.lock().unwrap().recv().unwrap();
                Err("refused".to_owned())
            }
        }));
        let tickets = [Order::Pause, Order::EmergencyStop].map(|order| orders.say(order).unwrap());
        assert_eq!((tickets, orders.last()), ([Ticket(1), Ticket(2)], Ticket(1)));
        let mut next = || loop {
            if let Some(answer) = orders.answers().pop() {
                break (answer.ticket, answer.said.is_ok(), orders.answered());
            }
            thread::yield_now();
        };
        assert_eq!(next(), (Ticket(2), true, Ticket(0)), "the first is still waiting");
        begin.send(()).unwrap();
        assert_eq!(next(), (Ticket(1), false, Ticket(1)));
    }
}
