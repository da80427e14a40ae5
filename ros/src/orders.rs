//! Orders to the mission, by threads of their own: an answer takes a moment, and odometry does not wait for it.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};
use std::thread;

/// Orders that wait to be said; whoever floods with them is refused.
const WAITING_MAX: usize = 16;

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
    /// Stop, until it is reset.
    EmergencyStop,
    /// The emergency is over; the mission is paused.
    Reset,
}

/// Says an order to the run, and returns what the vehicle does now, or why it does not, in one line.
pub type Director = dyn Fn(&Order) -> Result<String, String> + Send + Sync;

/// An order on its way, and what became of it.
type Answer = (Order, Result<String, String>);

/// Whoever says orders.
pub(crate) struct Orders {
    ordinary: SyncSender<Order>,
    /// Emergency stops, and what ends them, wait for nothing else.
    urgent: SyncSender<Order>,
    answers: Receiver<Answer>,
}

impl Orders {
    /// Threads that say what they are given.
    pub(crate) fn new(director: Arc<Director>) -> Self {
        let (answer, answers) = channel();
        let [ordinary, urgent] = [Arc::clone(&director), director].map(|director| {
            let (sender, orders) = sync_channel::<Order>(WAITING_MAX);
            let answer = answer.clone();
            thread::spawn(move || say_all(&orders, &*director, &answer));
            sender
        });
        Self { ordinary, urgent, answers }
    }

    /// Gives an order to be said, and says whether there was room for it.
    pub(crate) fn say(&self, order: Order) -> bool {
        let is_urgent = matches!(order, Order::EmergencyStop | Order::Reset);
        let way = if is_urgent { &self.urgent } else { &self.ordinary };
        way.try_send(order).is_ok()
    }

    /// What has become of orders since the last look.
    pub(crate) fn answers(&self) -> impl Iterator<Item = Answer> + '_ {
        self.answers.try_iter()
    }
}

/// Ends when nobody gives orders any more.
fn say_all(orders: &Receiver<Order>, director: &Director, answer: &Sender<Answer>) {
    while let Ok(order) = orders.recv() {
        let said = director(&order);
        if answer.send((order, said)).is_err() {
            return;
        }
    }
}
